"""Baseline correction, band-pass and integration of accelerograms."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.signals.loops import through_sections

Float = NDArray[np.float64]

#: Share of the record that is tapered (cosine) at each end.
TAPER: Final = 0.02
_ORDER: Final = 4
#: Length of the zero padding at each end, in periods of the high-pass corner. Both ends together
#: have 1.5 x order periods, as Boore (2005) recommends, so that the filter transient decays inside.
_PAD_PERIODS: Final = 0.75 * _ORDER
#: Largest low-pass corner, as a share of the Nyquist frequency.
NYQUIST_SHARE: Final = 0.8


@dataclass(frozen=True)
class BandPass:
    """Corner frequencies of the band-pass for uncorrected records.

    Parameters
    ----------
    low, high : float
        Corners [Hz]; `high` is reduced to 0.8 of the Nyquist frequency if that is lower.

    Raises
    ------
    ParameterError
        Unless `low` is positive and the corners are at least an octave apart.

    Examples
    --------
    >>> BandPass(0.1, 40.0).corners(time_step=0.02, duration=60.0)
    (0.1, 20.0)
    """

    low: float = 0.1
    high: float = 40.0

    def __post_init__(self) -> None:
        if not (math.isfinite(self.high) and 0.0 < 2.0 * self.low <= self.high):
            raise ParameterError(
                f"Invalid band-pass from {self.low!r} to {self.high!r} Hz. Must be two positive "
                "frequencies, the lower one first, at least an octave apart."
            )

    def corners(self, time_step: float, duration: float) -> tuple[float, float]:
        """Return the corners [Hz] for a record with this time step and duration [s].

        Raises
        ------
        ParameterError
            If the record is too coarse or too short for the band.
        """
        if self.low * duration < 1.0:
            raise ParameterError(
                f"Invalid duration {duration:g} s for a band-pass from {self.low:g} Hz. "
                f"Must be {1.0 / self.low:g} s or more."
            )
        high = min(self.high, NYQUIST_SHARE * 0.5 / time_step)
        if high < 2.0 * self.low:
            raise ParameterError(
                f"Invalid time step {time_step:g} s for a band-pass from {self.low:g} Hz. "
                f"Must be at most {NYQUIST_SHARE * 0.25 / self.low:g} s."
            )
        return self.low, high


def correct(
    acceleration: Float, time_step: float, band: BandPass
) -> tuple[Float, tuple[float, float], tuple[str, ...]]:
    """Correct the baseline of an accelerogram and apply a band-pass.

    A straight line is removed, the ends are tapered and padded with zeros, and a Butterworth filter
    is applied forwards and backwards (zero phase). The padding is removed afterwards.

    Parameters
    ----------
    acceleration : array, shape (samples,)
        Acceleration [m s-2].
    time_step : float
        Interval between samples [s].
    band : BandPass
        Corner frequencies.

    Returns
    -------
    array, shape (samples,)
        Corrected acceleration [m s-2].
    (float, float)
        Velocity [m s-1] and displacement [m] at the first sample. They are integrals over the
        padding before it, into which the filter spreads part of the motion.
    tuple of str
        Processing steps, in order.

    Raises
    ------
    ParameterError
        If the record is too coarse or too short for the band.

    References
    ----------
    Boore (2005), On pads and filters: processing strong-motion data, BSSA 95(2).

    Examples
    --------
    >>> import numpy as np
    >>> offset = np.full(2000, 0.3)
    >>> corrected, start, steps = correct(offset, 0.01, BandPass())
    >>> bool(np.abs(corrected).max() < 1e-12), steps[0]
    (True, 'baseline: least-squares line removed')
    """
    low, high = band.corners(time_step, time_step * (acceleration.size - 1))
    pad = math.ceil(_PAD_PERIODS / (low * time_step))
    padded = np.pad(_tapered(acceleration), pad)
    filtered = _both_ways(_butterworth(low * time_step, high * time_step), padded)
    before = integrate(filtered[: pad + 1], time_step)
    start = float(before[-1]), float(integrate(before, time_step)[-1])
    steps = (
        "baseline: least-squares line removed",
        f"taper: cosine over {TAPER:.0%} of the record at each end",
        f"band-pass: Butterworth of order {_ORDER}, {low:g} to {high:g} Hz, forwards and "
        f"backwards, with {pad * time_step:g} s of zeros at each end, cut off again",
    )
    return np.ascontiguousarray(filtered[pad:-pad]), start, steps


@dataclass(frozen=True, eq=False)
class AsRead:
    """Samples before `correct`, and the band to which it limited them.

    Parameters
    ----------
    samples : array, shape (samples,)
        Acceleration before the correction [m s-2].
    band : BandPass
        The corners in effect.
    """

    samples: Float
    band: BandPass

    def scaled(self, factor: float) -> AsRead:
        """Return the samples times a factor, with the same band."""
        return AsRead(factor * self.samples, self.band)

    def corrected(self, time_step: float, factor: float) -> Float:
        """Return what `correct` returns with another lower corner [m s-2].

        Parameters
        ----------
        time_step : float
            Interval between samples [s].
        factor : float
            The lower corner over that of the band [1]. The nearest corner that the duration and the
            upper corner allow is taken.

        Examples
        --------
        >>> shake = AsRead(np.sin(np.arange(3000.0)), BandPass(0.1, 40.0))
        >>> again, *_ = correct(shake.samples, 0.01, BandPass(0.2, 40.0))
        >>> bool((shake.corrected(0.01, 2.0) == again).all())
        True
        """
        longest, high = (1.0 - 1e-12) * time_step * (self.samples.size - 1), self.band.high
        low = min(max(factor * self.band.low, 1.0 / longest), 0.5 * high)
        pad = math.ceil(_PAD_PERIODS / (low * time_step))
        # Zeros before the record would give zeros, and what is before it is cut off.
        padded = np.pad(_tapered(self.samples), (0, pad))
        filtered = _both_ways(_butterworth(low * time_step, high * time_step), padded)
        return np.ascontiguousarray(filtered[: self.samples.size])


def _tapered(series: Float) -> Float:
    return np.asarray(level(series) * taper(series.size, 2.0 * TAPER))


def taper(size: int, share: float) -> Float:
    """Return a window of ones whose ends are tapered (cosine), together over this share of it.

    Examples
    --------
    >>> taper(9, 0.5).round(3).tolist()
    [0.0, 0.5, 1.0, 1.0, 1.0, 1.0, 1.0, 0.5, 0.0]
    """
    if size < 2:
        return np.ones(size)
    place = 2.0 * np.arange(size) / share / (size - 1)
    width = math.floor(share * (size - 1) / 2.0) + 1
    window = np.ones(size)
    window[:width] = 0.5 * (1.0 + np.cos(np.pi * (place[:width] - 1.0)))
    window[-width:] = 0.5 * (1.0 + np.cos(np.pi * (1.0 - 2.0 / share + place[-width:])))
    return window


def level(series: Float) -> Float:
    """Subtract the least-squares line.

    The closed form gives the same bits on every processor; a library of linear algebra does not.

    Examples
    --------
    >>> level(np.array([1.0, 2.0, 3.0])).tolist()
    [0.0, 0.0, 0.0]
    """
    place = np.arange(series.size) - 0.5 * (series.size - 1)
    slope = (place * series).sum() / np.square(place).sum()
    return np.asarray(series - series.mean() - slope * place)


def _butterworth(low: float, high: float) -> Float:
    """Return second-order sections of a band-pass, shape (_ORDER, 6), as in SciPy.

    The poles are computed in extended precision and then rounded, so that the last bits of a
    filtered record are the same on every processor. Those of scipy.signal.butter are not, and a
    rocking response amplifies the difference.

    Parameters
    ----------
    low, high : float
        Corner frequencies over the sampling frequency [1].
    """
    wide = np.longdouble
    half_turn = 4 * np.arctan(wide(1))
    lower, upper = 2 * np.tan(half_turn * np.array([low, high], dtype=wide))
    angle = half_turn * (2 * np.arange(_ORDER).astype(wide) + 1 + _ORDER) / (2 * _ORDER)
    prototype = (np.cos(angle) + 1j * np.sin(angle)) * (upper - lower) / 2
    root = np.sqrt(prototype**2 - lower * upper)
    analogue = np.concatenate([prototype + root, prototype - root])
    poles = (2 + analogue) / (2 - analogue)
    poles = poles[poles.imag > 0]
    middle = 2 * np.arctan(np.sqrt(lower * upper) / 2)
    centre = np.cos(middle) + 1j * np.sin(middle)
    # zeros at 0 Hz and at the Nyquist frequency; a gain of 1 at the centre of the band
    gain = np.abs((centre - poles) * (centre - poles.conj()) / (centre**2 - 1))
    ones, nothing = np.ones_like(gain), np.zeros_like(gain)
    rows = (gain, nothing, -gain, ones, -2 * poles.real, np.abs(poles) ** 2)
    return np.stack(rows, axis=1).astype(np.float64)


def _both_ways(sections: Float, series: Float) -> Float:
    """Filter a series forwards and backwards; a constant before its start leaves no transient."""
    for _ in range(2):
        series = np.ascontiguousarray(through_sections(sections, series)[::-1])
    return series


def integrate(series: Float, time_step: float) -> Float:
    """Return the running integral of a series by the trapezoidal rule, zero at its first sample.

    Examples
    --------
    >>> integrate(np.array([0.0, 1.0, 2.0]), 0.5).tolist()
    [0.0, 0.25, 1.0]
    """
    areas = time_step * (series[1:] + series[:-1]) / 2.0
    return np.concatenate([[0.0], np.cumsum(areas)])


def peak(series: Float) -> float:
    """Return the largest absolute value of a series.

    Examples
    --------
    >>> peak(np.array([1.0, -3.0]))
    3.0
    """
    return float(np.abs(series).max())
