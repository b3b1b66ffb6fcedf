"""Comparison with the paper: its Table 1, numbers, equations and claims. Nothing is tuned."""
