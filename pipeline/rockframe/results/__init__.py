"""The files that stages write and read: netCDF with units and names (CF-1.11, ragged arrays).

The only room that knows the datasets' variables, dimensions, units and attributes. Each dataset is
built by one function, written whole by `write`, and read back by one function.
"""
