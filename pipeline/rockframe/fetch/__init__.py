"""Download records from FDSN data centres, check them, and keep them as received."""
