"""The files that stages write and read: netCDF with units and names (CF-1.11, ragged arrays).

Only this room knows the variables, dimensions, units and attributes of datasets. For each dataset,
one function builds it, `write` writes it completely or not at all, and one function reads it.
"""
