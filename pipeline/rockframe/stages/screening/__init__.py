"""Outcomes of the scenarios of a screening, and their statistics."""
