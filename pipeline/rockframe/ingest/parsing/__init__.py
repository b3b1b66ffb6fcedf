"""Read numbers, columns, times and stated peaks from text."""

import numpy as np
from numpy.typing import NDArray

#: Numbers of a file: samples, times, distances.
Float = NDArray[np.float64]
