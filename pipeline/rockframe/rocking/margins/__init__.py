"""Margins of a verdict: first overturning, sensitivity, robust margins."""
