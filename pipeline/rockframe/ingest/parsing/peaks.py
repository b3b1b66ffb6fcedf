"""Compare the peak stated in a header with the samples."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from rockframe.errors import InputError
from rockframe.ingest.parsing import Float
from rockframe.ingest.parsing.lines import bad_number, is_number

#: Relative tolerance: header and samples may be rounded from single precision in different ways.
_SINGLE: Final = 2.0**-22


@dataclass(frozen=True)
class Printed:
    """A printed number and its resolution.

    Parameters
    ----------
    value : float
        Value of the number.
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
        """Parse a decimal token.

        Raises
        ------
        ValueError
            If the token is not a number.
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
        Peak in file units.
    time : Printed, optional
        Time of the peak since the first sample [s].
    units : str
        Units as the file names them, for error messages.
    line : int
        Line number of the statement.
    signed : bool
        True if the header prints the sign of the sample. Some headers print absolute values; a plus
        then has no meaning, but a minus does.

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
    samples: Float,
    time_step: float,
    stated: StatedPeak,
    resolution: float,
) -> float:
    """Return the ratio of actual to stated peak; reject a file in which they differ.

    Stated value and samples may differ by one unit in the last digit of either. The time may differ
    by one step, because some archives count from the first step. If several samples are equally
    large, any of them may be the stated peak.

    Parameters
    ----------
    samples : array, shape (samples,)
        Samples in file units.
    time_step : float
        Interval between samples [s].
    resolution : float
        One unit of the last printed digit of the samples, in file units.

    Returns
    -------
    float
        Ratio of actual to stated peak [1], of absolute values if the header states no sign; NaN if
        the stated peak is zero.

    Raises
    ------
    InputError
        If absolute value, sign or time of the peak differ.

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
        found = f"{samples[where]:.10g} {stated.units} in the file"
        message = f"peak {value:.10g} {stated.units} stated, but {found}. Must agree."
        raise InputError(path, message, stated.line)
    late = np.abs(peaks * time_step - stated.time.value) if stated.time else np.zeros(1)
    if stated.time and late.min() > time_step * (1.0 + _SINGLE) + stated.time.unit:
        message = f"peak stated at {stated.time.value:.10g} s, but at {where * time_step:.10g} s"
        raise InputError(path, f"{message} in the file. Must agree.", stated.line)
    agreeing = samples[peaks[right]]
    ratio = float(agreeing[np.abs(agreeing).argmax()]) / value if value else math.nan
    return ratio if signed else abs(ratio)


def require_printed_peak(
    path: Path,
    stated: str,
    samples: Float,
    units: str,
    line: int,
    *,
    signed: bool = False,
    time: str = "",
    time_step: float = 1.0,
    first: float = 0.0,
) -> float:
    """Return the ratio of actual to printed peak; reject a file in which they differ.

    Parameters
    ----------
    stated : str
        Peak as printed in the header.
    samples : array, shape (samples,)
        Acceleration in the units of the stated peak.
    units, line, signed
        As in `StatedPeak`.
    time : str
        Printed time of the peak since the first sample [s]; empty if unstated.
    time_step, first : float
        Interval between samples, and time of the first sample as the header counts it [s].

    Raises
    ------
    InputError
        If the stated peak or its time is not a number or differs from the samples.

    Examples
    --------
    >>> require_printed_peak(Path("a.ASC"), "0.31", np.array([0.1, -0.4]), "cm/s2", 38)
    Traceback (most recent call last):
    rockframe.errors.InputError: a.ASC:38: peak 0.31 cm/s2 stated, but -0.4 cm/s2 in the file. ...
    """
    for token, quantity in ((stated, "peak acceleration"), (time or "0", "time of the peak")):
        if not is_number(token):
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
