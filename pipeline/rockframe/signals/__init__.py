"""Processing of accelerograms, intensity measures, and the quality checks of a record."""
