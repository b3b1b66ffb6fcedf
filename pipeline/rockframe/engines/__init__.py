"""Compute batches in one process, in a pool of processes, or on a Dask cluster."""
