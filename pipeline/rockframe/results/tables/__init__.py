"""Rows of tables, and labelled values."""
