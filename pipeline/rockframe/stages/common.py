"""What several stages need."""

from __future__ import annotations

from collections.abc import Callable

from rockframe.errors import ParameterError
from rockframe.results import RecordsFile

#: Called with what is done and what there is to do in all.
Progress = Callable[[int, int], None]


def silent(_done: int, _total: int) -> None:
    """Report progress to nobody."""


def horizontal(records: RecordsFile) -> list[str]:
    """Return the identifiers of the records that are not vertical.

    Raises
    ------
    ParameterError
        If all are.
    """
    named = zip(records.names, records.orientations, strict=True)
    chosen = [name for name, orientation in named if not orientation.upright]
    if not chosen:
        raise ParameterError(
            f"{records.path}: all {len(records.names)} records are vertical. "
            "Must hold a horizontal one."
        )
    return chosen
