"""The time step of a printed column of times."""

from __future__ import annotations

from decimal import Decimal
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import InputError

Float = NDArray[np.float64]

#: A time is good to single precision at best, however many digits are printed.
_SINGLE: Final = 2.0**-24
#: Rounding of the last operations on doubles.
_DOUBLE: Final = 2.0**-50
#: No time step needs more decimals than a double holds.
_MOST_DECIMALS: Final = 20


def time_step_of(
    path: Path, tokens: list[bytes], first_line: int, given: float | None = None
) -> float:
    """Return the time step of evenly spaced times as they are printed [s].

    Each printed time must be that of the first sample plus a whole number of steps, within its own
    printed resolution: exactly if possible, else rounded, else cut off. Of the steps that fit, the
    shortest decimal is taken. If it needs two places more than are printed, and exactly one whole
    number of samples a second fits, the step is its reciprocal (1/240 s printed with four places).

    Parameters
    ----------
    path : Path
        The file, for the error.
    tokens : list of bytes
        The printed times [s], finite numbers, two or more; one a line.
    first_line : int
        Line number of the first.
    given : float, optional
        Time step that the user gave [s]; it is returned if it fits.

    Raises
    ------
    InputError
        If the times do not increase, are uneven, or do not fit the given step.

    Examples
    --------
    >>> time_step_of(Path("motion.csv"), [b"0.000", b"0.005", b"0.010"], 2)
    0.005
    >>> times = [f"{i / 240:.4f}".encode() for i in range(4000)]
    >>> time_step_of(Path("motion.csv"), times, 2) == 1 / 240
    True
    """
    times = np.array(tokens, dtype=np.float64)
    _require_increase(path, times, first_line)
    places = np.zeros(times.size)
    for share, precision in ((0.0, _DOUBLE), (0.5, _SINGLE), (1.0, _SINGLE)):
        if share == 0.5:
            places = np.array([_decimals(token) for token in tokens], dtype=np.float64)
            _require_resolution(path, times, 10.0**-places, first_line)
        largest = np.maximum(np.abs(times), abs(times[0]))
        slack = np.maximum(share * 10.0**-places, precision * largest)
        low, high = _fitting_steps(times, slack)
        if low[-1] <= high[-1]:
            return _settle(path, (low[-1], high[-1]), int(places.max()), given)
    where = int(np.flatnonzero(low > high)[0]) + 1
    step = 0.5 * (low[where - 2] + high[where - 2])
    raise _uneven(path, times, where, float(times[0] + where * step), first_line)


def _require_increase(path: Path, times: Float, first_line: int) -> None:
    still = np.flatnonzero(np.diff(times) <= 0.0)
    if still.size:
        where = int(still[0]) + 1
        raise InputError(
            path,
            f"time {times[where]:.12g} s after {times[where - 1]:.12g} s. Must increase.",
            line=first_line + where,
        )


def _require_resolution(path: Path, times: Float, units: Float, first_line: int) -> None:
    """Refuse uneven times printed so coarsely that a lost sample would pass for rounding."""
    steps = np.diff(times)
    typical = float(np.median(steps))
    odd = np.flatnonzero(np.abs(steps - typical) > 0.5 * units[1:])
    if odd.size and float(np.median(units)) > typical / 3.0:
        where = int(odd[0]) + 1
        raise _uneven(path, times, where, float(times[where - 1] + typical), first_line)


def _fitting_steps(times: Float, slack: Float) -> tuple[Float, Float]:
    """Bounds of the steps that fit the first 2, 3, ... times, shape (times - 1,) each."""
    count = np.arange(1, times.size)
    shift = times[1:] - times[0]
    low = np.maximum.accumulate((shift - slack[1:]) / count)
    high = np.minimum.accumulate((shift + slack[1:]) / count)
    return low, high


def _settle(path: Path, fitting: tuple[float, float], places: int, given: float | None) -> float:
    low, high = fitting
    if given is None:
        return _simplest(low, high, places)
    # The user's number may be as short as the step's own decimal.
    if low * (1.0 - 1e-9) <= given <= high * (1.0 + 1e-9):
        return given
    raise InputError(
        path,
        f"time step {given!r} s given, but the times state {_simplest(low, high, places)!r} s. "
        "Must agree.",
    )


def _simplest(low: float, high: float, places: int) -> float:
    middle = 0.5 * (low + high)
    decimals, step = _shortest_decimal(low, high)
    if places and decimals > places + 1:
        rate = round(1.0 / middle)
        others = (rate - 1, rate + 1)
        if _fits(rate, low, high) and not any(_fits(other, low, high) for other in others):
            return 1.0 / rate
    return step


def _fits(rate: int, low: float, high: float) -> bool:
    return rate > 0 and low <= 1.0 / rate <= high


def _shortest_decimal(low: float, high: float) -> tuple[int, float]:
    """The decimal of fewest places between the bounds, nearest to their middle."""
    middle = 0.5 * (low + high)
    for decimals in range(_MOST_DECIMALS):
        step = round(middle, decimals)
        if low <= step <= high:
            return decimals, step
    return _MOST_DECIMALS, middle


def _uneven(path: Path, times: Float, where: int, expected: float, first_line: int) -> InputError:
    return InputError(
        path,
        f"time {times[where]:.12g} s after {times[where - 1]:.12g} s. "
        f"Must be {expected:.6g} s: even steps, printed finely enough to show them.",
        line=first_line + where,
    )


def _decimals(token: bytes) -> int:
    """Places after the decimal point; negative if the last digit printed is above the units."""
    if b"e" in token or b"E" in token:
        exponent = Decimal(token.decode("ascii").strip()).as_tuple().exponent
        return -exponent if isinstance(exponent, int) else 0
    token = token.strip()
    point = token.find(b".")
    return len(token) - point - 1 if point >= 0 else 0
