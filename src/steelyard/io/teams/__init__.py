"""Team descriptions: checked and written."""
