"""The numerical kernels of two unequal columns: one to read, one vectorised."""
