"""Formats that few folders contain: their modules are imported when a file needs them."""
