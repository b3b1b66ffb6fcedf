"""Screening: many structures, records and scales."""
