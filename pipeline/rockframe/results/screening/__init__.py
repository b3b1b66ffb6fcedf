"""The files of a screening."""
