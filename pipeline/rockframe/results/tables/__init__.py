"""Rows of tables, columns of printed tables, and labelled values."""
