"""Horizontal components of a motion: pairing, rotation, and measures over all azimuths."""
