"""Answers in words: numbers as people read them, and tables of estimates, for str(estimate) and the command line."""
