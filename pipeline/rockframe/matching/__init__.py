"""The extended wavelet transform, which finds the pulse that explains most of a record."""
