"""Columns of tables without names, whose meaning their numbers or the user must tell."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from rockframe.errors import InputError
from rockframe.ingest.parsing import Float
from rockframe.ingest.parsing.columns import COMMAS, rises

#: Largest relative difference of a stated time step from that of a column of times.
_SAME_STEP: Final = 1e-3


def time_column(
    path: Path,
    table: Float,
    chosen: Collection[int],
    given: float | None,
    line: int,
    numbers: Sequence[int],
) -> int | None:
    """Return the index of the column of times beside chosen columns; None if there is none.

    Parameters
    ----------
    table : array, shape (rows, columns)
        All numbers.
    chosen : collection of int
        Indices of the columns that hold no times, such as the accelerations.
    given : float, optional
        Time step that the user states [s]. It decides between several columns that rise, such as
        numbers of rows and times.
    line : int
        Line number of the first row.
    numbers : sequence of int
        Number of each column in the file.

    Raises
    ------
    InputError
        If several columns rise, differ, and the time step does not decide between them.

    Examples
    --------
    >>> table = np.array([[0.1, 0.3], [-0.2, 0.1], [0.2, -0.4]])
    >>> time_column(Path("a.txt"), table, [1], 0.01, 1, [1, 2]) is None
    True
    """
    rising = [k for k in range(table.shape[1]) if k not in chosen and rises(table[:, k])]
    times = list({table[:, k].tobytes(): k for k in reversed(rising)}.values())[::-1]
    if given is not None and len(times) > 1:
        steps = {k: float(np.median(np.diff(table[:, k]))) for k in times}
        times = [k for k in times if abs(steps[k] - given) <= _SAME_STEP * given]
    if len(times) > 1 or (rising and not times):
        which = " and ".join(str(numbers[k]) for k in times or rising)
        message = f"columns {which} rise like times."
        do = "State one of them with --time-column, or its time step with --time-step-s."
        raise InputError(path, f"{message} {do}", line)
    return times[0] if times else None


def unclear(
    path: Path, values: Float, numbers: Sequence[int], line: int, *, commas: bool = False
) -> InputError:
    """Return the error for columns without names whose meaning the user must state.

    Parameters
    ----------
    values : array, shape (numbers,)
        Numbers in the order of the file.
    numbers : sequence of int
        Number of each column in the file.
    line : int
        Line number of the first row.
    commas : bool
        Whether commas separate the columns.

    Examples
    --------
    >>> raise unclear(Path("a.txt"), np.array([0.1, 0.2, -0.3, -0.4]), [1, 3], 1)
    Traceback (most recent call last):
    rockframe.errors.InputError: a.txt:1: 2 columns without names, which may be channels. Choose ...
    """
    columns = len(numbers)
    table = values[: values.size // columns * columns].reshape(-1, columns)
    rising = [
        number
        for number, column in zip(numbers, table.T, strict=True)
        if rises(column) or _never_falls(column)
    ]
    reason = f"of which column {rising[0]} rises like times" if rising else "which may be channels"
    do = f"Choose one with --column NUMBER, of {_of(numbers)}"
    also = "" if rising else ", or read them as one series, line by line, with --column all"
    hint = f" {COMMAS}" if columns == 4 else ""
    if commas and columns == 2:
        hint = " If the comma is a decimal comma, state --decimal comma."
    return InputError(path, f"{columns} columns without names, {reason}. {do}{also}.{hint}", line)


def _of(numbers: Sequence[int]) -> str:
    """Return numbers in words.

    Examples
    --------
    >>> _of([2, 3, 4]), _of([1, 3])
    ('2 to 4', '1 and 3')
    """
    first, last = numbers[0], numbers[-1]
    if last - first + 1 == len(numbers) > 1:
        return f"{first} to {last}"
    return " and ".join(filter(None, (", ".join(map(str, numbers[:-1])), str(last))))


def _never_falls(values: Float) -> bool:
    """Return True if numbers rise without ever falling, as times with too few decimals do.

    Examples
    --------
    >>> _never_falls(np.array([0.0, 0.0, 0.1])), _never_falls(np.array([0.1, 0.1]))
    (True, False)
    """
    return bool((np.diff(values) >= 0.0).all() and values[-1] > values[0])
