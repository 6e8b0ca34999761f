"""The command line: parsing and printing only; every verb calls a function that Python users can call too."""
