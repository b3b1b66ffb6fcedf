"""What several stages need."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from rockframe.errors import ParameterError
from rockframe.record import Record

#: Called with what is done and what there is to do in all.
Progress = Callable[[int, int], None]


def silent(_done: int, _total: int) -> None:
    """Report progress to nobody."""


def horizontal(records: list[Record], path: Path) -> list[Record]:
    """Return the records that are not vertical.

    Raises
    ------
    ParameterError
        If all are.
    """
    chosen = [r for r in records if not r.orientation.upright]
    if not chosen:
        raise ParameterError(
            f"{path}: all {len(records)} records are vertical. Must hold a horizontal one."
        )
    return chosen
