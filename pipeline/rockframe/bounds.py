"""Bounds of what users state: the same in study files, on the command line and in Python."""

from __future__ import annotations

from typing import Final

#: With fewer surrogates no share of them is small enough to tell a pulse from chance.
FEWEST_SURROGATES: Final = 19
#: With these p reaches 1/10000, far below the level of the verdict.
MOST_SURROGATES: Final = 9_999
#: Each further pulse is a search of its own, and a column in the file.
MOST_RUNNERS_UP: Final = 100
#: Largest multiple of a record.
LARGEST_SCALE: Final = 1e3
#: Longest list of numbers; a longer one does not fit into a command.
MOST_NUMBERS: Final = 2_000
