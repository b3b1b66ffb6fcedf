"""The numerical kernels: one to read, one vectorised."""

from typing import Final

# Outcomes, the values of the flag variable `verdict`.
NO_UPLIFT: Final = 0
STANDS: Final = 1
OVERTURNS: Final = 2
