"""Read numbers, columns, times and stated peaks from text."""
