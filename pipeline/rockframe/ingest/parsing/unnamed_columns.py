"""Meaning of columns without names, recognised from their numbers.

A line may hold times and one acceleration, several pairs of them, values of several channels at one
time, or several values of one series.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np

from rockframe.errors import InputError
from rockframe.ingest.parsing import Float
from rockframe.ingest.parsing.column_headers import COMMAS

#: Share of the steps of a column of times that rise. An acceleration rises in about half of them.
_RISING: Final = 0.9
#: Bounds of a series with several values per line, beside what 64 real records with 3 to 10 values
#: per line have. The step between neighbours, over that to the value below (records: up to 0.78).
_SMOOTH: Final = 0.85
#: The largest over the smallest step between two neighbouring places of a line (up to 1.4 in 80
#: lines, 1.3 in 300).
_EVEN: Final = 1.45
#: The step to the value below, over that to the values beside it (all records but one: 0.9 or more;
#: channels: less).
_DIP: Final = 0.9
#: Largest relative difference of a stated time step from that of a column of times.
_SAME_STEP: Final = 1e-3


def rises(values: Float) -> bool:
    """Return True if numbers rise like times: in at least nine of ten steps.

    Examples
    --------
    >>> rises(np.array([0.0, 0.01, 0.02])), rises(np.array([0.1, 0.3, -0.2]))
    (True, False)
    """
    return bool(values.size > 1 and (np.diff(values) > 0.0).mean() >= _RISING)


def _never_falls(values: Float) -> bool:
    """Return True if numbers rise without ever falling, as times with too few decimals do.

    Examples
    --------
    >>> _never_falls(np.array([0.0, 0.0, 0.1])), _never_falls(np.array([0.1, 0.1]))
    (True, False)
    """
    return bool((np.diff(values) >= 0.0).all() and values[-1] > values[0])


def are_pairs(values: Float, columns: int) -> bool:
    """Return True if the numbers of all lines, one after another, are times and accelerations.

    Parameters
    ----------
    values : array, shape (numbers,)
        Numbers in the order of the file.
    columns : int
        Numbers per line.

    Examples
    --------
    >>> are_pairs(np.array([0.00, 0.3, 0.01, -0.1, 0.02, 0.2, 0.03, 0.1]), 4)
    True
    """
    return columns % 2 == 0 and rises(values[::2]) and not rises(values[1::2])


def is_series(values: Float, columns: int) -> bool:
    """Return True if each line clearly continues the line before, as in one series.

    Then neighbouring values differ less than values one below the other; the steps within lines are
    as large as those from the end of a line to the next one; and values one below the other do not
    differ less than those beside them. Otherwise the columns may be channels.

    Parameters
    ----------
    values, columns
        As in `are_pairs`.

    Examples
    --------
    >>> wave = np.sin(0.3 * np.arange(800.0))
    >>> channels = np.outer(wave, np.arange(1.0, 9.0)).ravel()
    >>> is_series(wave, 8), is_series(channels, 8)
    (True, False)
    """
    whole = values[: values.size // columns * columns]
    if whole.size < 2 * columns:
        return False
    steps = np.square(np.append(np.diff(whole), 0.0)).reshape(-1, columns)[:-1]
    total = steps.sum(axis=1, keepdims=True)
    moving = total[:, 0] > 0.0
    if not moving.any() or any(rises(whole[k::columns]) for k in range(columns)):
        return False
    shares = (steps[moving] / total[moving]).mean(axis=0)
    below = _mean_square_step(whole, columns)
    beside = 0.5 * (_mean_square_step(whole, columns - 1) + _mean_square_step(whole, columns + 1))
    return bool(
        _mean_square_step(whole, 1) < _SMOOTH**2 * below
        and shares.max() < _EVEN**2 * shares.min()
        and below >= _DIP * beside
    )


def _mean_square_step(values: Float, distance: int) -> float:
    return float(np.square(values[distance:] - values[:-distance]).mean())


def time_column(
    path: Path, table: Float, chosen: int, given: float | None, line: int
) -> int | None:
    """Return the index of the column of times beside a chosen column; None if there is none.

    Parameters
    ----------
    table : array, shape (rows, columns)
        All numbers.
    chosen : int
        Index of the column of acceleration.
    given : float, optional
        Time step that the user states [s]. It decides between several columns that rise, such as
        numbers of rows and times.
    line : int
        Line number of the first row.

    Raises
    ------
    InputError
        If several columns rise, differ, and the time step does not decide between them.

    Examples
    --------
    >>> table = np.array([[0.1, 0.3], [-0.2, 0.1], [0.2, -0.4]])
    >>> time_column(Path("a.txt"), table, 1, 0.01, 1) is None
    True
    """
    rising = [k for k in range(table.shape[1]) if k != chosen and rises(table[:, k])]
    times = list({table[:, k].tobytes(): k for k in reversed(rising)}.values())[::-1]
    if given is not None and len(times) > 1:
        steps = {k: float(np.median(np.diff(table[:, k]))) for k in times}
        times = [k for k in times if abs(steps[k] - given) <= _SAME_STEP * given]
    if len(times) > 1 or (rising and not times):
        numbers = " and ".join(str(k + 1) for k in times or rising)
        message = f"columns {numbers} without names rise like times."
        do = "State the time step of one of them with --time-step-s."
        raise InputError(path, f"{message} {do}", line)
    return times[0] if times else None


def unclear(path: Path, values: Float, columns: int, line: int) -> InputError:
    """Return the error for columns without names whose meaning the user must state.

    The parameters are those of `are_pairs`.

    Examples
    --------
    >>> raise unclear(Path("a.txt"), np.array([0.1, 0.2, -0.3, -0.4]), 2, 1)
    Traceback (most recent call last):
    rockframe.errors.InputError: a.txt:1: 2 columns without names, which may be channels. Choose ...
    """
    table = values[: values.size // columns * columns].reshape(-1, columns)
    rising = [k + 1 for k, column in enumerate(table.T) if rises(column) or _never_falls(column)]
    what = f"of which column {rising[0]} rises like times" if rising else "which may be channels"
    do = f"Choose one with --column NUMBER, of 1 to {columns}"
    also = "" if rising else ", or read them as one series, line by line, with --column all"
    commas = f" {COMMAS}" if columns == 4 else ""
    return InputError(path, f"{columns} columns without names, {what}. {do}{also}.{commas}", line)
