"""Margins against overturning: first overturning, sensitivity, robust margins."""
