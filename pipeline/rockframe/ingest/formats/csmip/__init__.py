"""CSMIP volumes 1 and 2."""
