"""CSV and white-space text."""
