"""The numerical kernels: one to read, one vectorised."""
