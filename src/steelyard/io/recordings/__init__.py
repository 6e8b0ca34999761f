"""Log descriptions: checked, guessed, proposed and written, and the files that they name."""
