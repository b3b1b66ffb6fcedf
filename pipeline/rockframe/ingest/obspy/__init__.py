"""obspy plug-ins, and the readers of obspy."""
