"""The peak that a header states, compared with the samples."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import InputError
from rockframe.ingest.lines import bad_number, is_number

#: Headers and samples may come from different roundings of a number in single precision.
_SINGLE: Final = 2.0**-22


@dataclass(frozen=True)
class Printed:
    """A number as it is printed.

    Parameters
    ----------
    value : float
        The number.
    unit : float
        One unit of its last printed digit.

    Examples
    --------
    >>> Printed.of("-267.957"), Printed.of("0.12E+03")
    (Printed(value=-267.957, unit=0.001), Printed(value=120.0, unit=10.0))
    """

    value: float
    unit: float

    @classmethod
    def of(cls, token: str) -> Printed:
        """Return the number that a decimal token prints.

        Raises
        ------
        ValueError
            If it prints none.
        """
        digits, _, exponent = re.sub("[dD]", "e", token.strip()).lower().partition("e")
        places = len(digits.partition(".")[2])
        power = max(-300, min(int(exponent[:6] or 0) - places, 300))
        return cls(float(token), float(10.0**power))


@dataclass(frozen=True, kw_only=True)
class StatedPeak:
    """The peak that a header states.

    Parameters
    ----------
    value : Printed
        The peak, in the units of the file.
    time : Printed, optional
        Its time since the first sample [s].
    units : str
        The file's name of its units, for the error.
    line : int
        Line of the file that states it.
    signed : bool
        Whether the sign is that of the sample. Some headers print sizes: there a plus says nothing,
        but a minus does.

    Examples
    --------
    >>> StatedPeak(value=Printed.of("-267.957"), units="cm/s2", line=18).signed
    True
    """

    value: Printed
    time: Printed | None = None
    units: str
    line: int
    signed: bool = True


def require_peak(
    path: Path,
    samples: NDArray[np.float64],
    time_step: float,
    stated: StatedPeak,
    resolution: float,
) -> float:
    """Refuse a file whose header states another peak than its samples have.

    The stated number and the samples may differ by one unit of the last digit of either. The time
    may be off by one step, as some archives count it from the first step. Of samples that are as
    large as the largest, each may be the one stated.

    Parameters
    ----------
    path : Path
        The file, for the error.
    samples : array, shape (samples,)
        The samples, in the units of the file.
    time_step : float
        Interval between them [s].
    stated : StatedPeak
        What the header states.
    resolution : float
        One unit of the last printed digit of the samples, in the same units.

    Returns
    -------
    float
        The peak in the file over the stated one [1], of their sizes if the header's has no sign;
        NaN if that is zero.

    Raises
    ------
    InputError
        With both numbers, if size, sign or time of the peak disagree.

    Examples
    --------
    >>> peak = StatedPeak(value=Printed.of("-0.30"), units="g", line=8)
    >>> require_peak(Path("a.V2"), np.array([0.1, -0.3]), 0.01, peak, 0.1)
    1.0
    >>> require_peak(Path("a.V2"), np.array([0.1, -0.5]), 0.01, peak, 0.1)
    Traceback (most recent call last):
    rockframe.errors.InputError: a.V2:8: peak -0.3 g stated, but -0.5 g in the file. Must agree.
    """
    sizes = np.abs(samples)
    where = int(sizes.argmax())
    value, largest = stated.value.value, float(sizes[where])
    slack = stated.value.unit + resolution + _SINGLE * largest
    peaks = np.flatnonzero(sizes >= largest - slack)
    right = np.flatnonzero(np.abs(samples[peaks] - value) <= slack)
    signed = stated.signed or value < 0.0
    if not signed and not right.size:
        right = np.flatnonzero(np.abs(sizes[peaks] - abs(value)) <= slack)
    if not right.size:
        raise InputError(
            path,
            f"peak {value:.10g} {stated.units} stated, but {samples[where]:.10g} {stated.units} "
            "in the file. Must agree.",
            line=stated.line,
        )
    late = np.abs(peaks * time_step - stated.time.value) if stated.time else np.zeros(1)
    if stated.time and late.min() > time_step * (1.0 + _SINGLE) + stated.time.unit:
        raise InputError(
            path,
            f"peak stated at {stated.time.value:.10g} s, but at {where * time_step:.10g} s "
            "in the file. Must agree.",
            line=stated.line,
        )
    agreeing = samples[peaks[right]]
    ratio = float(agreeing[np.abs(agreeing).argmax()]) / value if value else math.nan
    return ratio if signed else abs(ratio)


def require_printed_peak(
    path: Path,
    stated: str,
    samples: NDArray[np.float64],
    units: str,
    line: int,
    *,
    signed: bool = False,
    time: str = "",
    time_step: float = 1.0,
    first: float = 0.0,
) -> float:
    """Refuse samples whose peak is not the one that the header prints.

    Parameters
    ----------
    path : Path
        The file, for the error.
    stated : str
        The peak as printed in the header.
    samples : array, shape (samples,)
        Acceleration, in the units of the stated peak.
    units : str
        These units, for the error.
    line : int
        Line of the header.
    signed : bool
        As of `StatedPeak`.
    time : str
        Time of the peak since the first sample as printed [s]; empty if none is.
    time_step, first : float
        Interval between samples, and the first one's time as the header counts it [s].

    Returns
    -------
    float
        As `require_peak`.

    Raises
    ------
    InputError
        If the stated peak or its time is no number, or is another one.

    Examples
    --------
    >>> require_printed_peak(Path("a.ASC"), "0.31", np.array([0.1, -0.4]), "cm/s2", 38)
    Traceback (most recent call last):
    rockframe.errors.InputError: a.ASC:38: peak 0.31 cm/s2 stated, but -0.4 cm/s2 in the file. ...
    """
    for token, quantity in ((stated, "peak acceleration"), (time or "0", "time of the peak")):
        if not is_number(token.encode("latin-1", "replace")):
            raise bad_number(path, token.encode("latin-1", "replace"), line, quantity)
    peak = StatedPeak(
        value=Printed.of(stated),
        time=_since(Printed.of(time), first) if time else None,
        units=units,
        line=line,
        signed=signed,
    )
    return require_peak(path, samples, time_step, peak, 0.0)


def _since(time: Printed, first: float) -> Printed:
    return Printed(time.value - first, time.unit)
