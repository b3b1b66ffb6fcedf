"""Overturning spectra and rocking spectra."""
