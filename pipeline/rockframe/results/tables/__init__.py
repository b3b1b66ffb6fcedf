"""Rows of tables, the columns of printed ones, and labelled values."""
