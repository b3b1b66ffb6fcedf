"""Horizontal components of a station: pairing, rotation, and measures over all azimuths."""
