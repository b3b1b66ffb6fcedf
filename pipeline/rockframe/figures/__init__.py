"""Figures, one in each file. They draw datasets and compute nothing but the limits of axes."""
