"""Following many clips, each independently."""
