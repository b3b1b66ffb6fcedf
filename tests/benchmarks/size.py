"""The size of benchmarks: the stated one, or the smallest one, at which `make check` runs each.

A benchmark states both sizes of whatever makes it long: ``sized(1000, 1)`` records.
"""

from __future__ import annotations

import os
from typing import Final, TypeVar

#: Environment variable; if it is set, benchmarks have their smallest size. Their numbers then say
#: nothing: they only show that the benchmark works.
SMALLEST: Final = "ROCKFRAME_SMALLEST_BENCHMARKS"

Value = TypeVar("Value")
Other = TypeVar("Other")


def sized(stated: Value, smallest: Other) -> Value | Other:
    """Return the stated size, or the smallest one if the environment asks for it."""
    return smallest if SMALLEST in os.environ else stated
