"""Datasets of the figures."""
