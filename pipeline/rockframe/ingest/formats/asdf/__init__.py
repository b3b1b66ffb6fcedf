"""Reader of ASDF, and the HDF5 file that it reads."""
