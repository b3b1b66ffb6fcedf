"""Figures, one file for each subject. They draw datasets and compute only the limits of axes."""
