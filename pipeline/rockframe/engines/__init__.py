"""Batches of work in one process, in a pool of them, or on a Dask cluster: the same results."""
