"""The extended wavelet transform: the pulse that explains most of a record.

For a mother wavelet psi of period s at time xi the coefficient is

    C(s, xi) = (s E)^(-1/2)  integral a(t) psi((t - xi) / s) dt,

with E the energy of psi, so that every daughter wavelet has unit energy and |C| is the length of
the projection of the record on it. The best match is its largest |C|. The weight s^(-1/2) is the
only one that finds the period of a record that is itself such a pulse (theory: Cauchy-Schwarz).

Vassiliou and Makris (2011), Bull. Seismol. Soc. Am. 101(2), name and use the transform.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import pywt
import scipy.fft
import scipy.optimize
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.wavelets import (
    ANTISYMMETRIC_RICKER,
    RICKERS,
    SYMMETRIC_RICKER,
    MotherWavelet,
    Pulse,
)

Float = NDArray[np.float64]

#: Default range of periods [s]; the paper does not state its own.
SHORTEST_PERIOD: Final = 0.2
LONGEST_PERIOD: Final = 5.0
#: A wavelet shorter than so many time steps is not resolved by the samples.
_STEPS_PER_PERIOD: Final = 8
#: Ratio of neighbouring periods of the search; |C| is within 2e-4 of its maximum between them.
_PERIOD_RATIO: Final = 1.025
#: So many local maxima over the period are refined; their grid values may be out of order.
_CANDIDATES: Final = 4
#: A refined period closer than this to an end of the range is at that end, not a maximum.
_AT_BOUND: Final = 1e-6
#: What PyWavelets calls a mother wavelet, and its variable over tau.
_PYRICKERS: Final = {
    SYMMETRIC_RICKER.name: ("mexh", math.sqrt(2.0) * math.pi),
    ANTISYMMETRIC_RICKER.name: ("gaus3", 2.0 * math.pi / math.sqrt(6.0)),
}


@dataclass(frozen=True, kw_only=True)
class PulseMatch:
    """The best pulse of one mother wavelet in a record.

    Parameters
    ----------
    pulse : Pulse
        The pulse, its time counted from the record's first sample.
    match_index : float
        Cosine between record and wavelet, 0 to 1: the root of the share of energy explained [1].
    at_period_bound : bool
        The best period is an end of the range that was searched: not a maximum of the transform.
    """

    pulse: Pulse
    match_index: float
    at_period_bound: bool


def match_pulse(
    acceleration: Float,
    time_step: float,
    wavelet: str,
    *,
    shortest_period: float = SHORTEST_PERIOD,
    longest_period: float = LONGEST_PERIOD,
) -> PulseMatch:
    """Find the pulse of one mother wavelet that explains most of a record.

    Every sample and a ladder of periods are searched with the FFT; period and time of the best
    candidates are then refined continuously. The amplitude is the least-squares one.

    Parameters
    ----------
    acceleration : array, shape (samples,)
        Acceleration [m s-2].
    time_step : float
        Interval between samples [s].
    wavelet : str
        Name of the mother wavelet.
    shortest_period, longest_period : float
        Range of T_p [s]; cut to what the record resolves: 8 time steps to its duration.

    Raises
    ------
    ParameterError
        If the wavelet is unknown, the record is zero throughout or not finite, or no period is left
        to search.

    Examples
    --------
    >>> t = np.arange(1000) * 0.01
    >>> planted = Pulse(wavelet="symmetric_ricker", a_p=2.0, T_p=0.8, time=5.0)
    >>> match = match_pulse(planted.acceleration(t), 0.01, "symmetric_ricker")
    >>> round(match.pulse.a_p, 6), round(match.pulse.T_p, 6), round(match.match_index, 6)
    (2.0, 0.8, 1.0)
    """
    if wavelet not in RICKERS:
        raise ParameterError(f"Invalid wavelet {wavelet!r}. Must be one of: {', '.join(RICKERS)}.")
    acceleration = np.asarray(acceleration, dtype=np.float64)
    energy = float(np.dot(acceleration, acceleration)) * time_step
    if not math.isfinite(energy):
        raise ParameterError("Invalid acceleration: not all samples are finite.")
    if energy == 0.0:
        raise ParameterError("Invalid acceleration: all samples are zero, there is no pulse.")
    mother = RICKERS[wavelet]
    low, high = _period_range(acceleration, time_step, shortest_period, longest_period)
    best = max(
        (
            _refine(acceleration, time_step, mother, start, (low, high))
            for start in _candidates(acceleration, time_step, mother, low, high)
        ),
        key=lambda found: abs(found[2]),
    )
    period, time, coefficient = best
    pulse = Pulse(
        wavelet=wavelet,
        a_p=abs(coefficient) / math.sqrt(period * mother.energy),
        T_p=period,
        time=time,
        phase=0.0 if coefficient >= 0.0 else math.pi,
    )
    at_bound = min(period / low - 1.0, 1.0 - period / high) < _AT_BOUND
    match_index = min(1.0, abs(coefficient) / math.sqrt(energy))
    return PulseMatch(pulse=pulse, match_index=match_index, at_period_bound=at_bound)


def best_match(matches: Sequence[PulseMatch]) -> int:
    """Return the index of the match that explains most, the one with the largest match index."""
    return max(range(len(matches)), key=lambda i: matches[i].match_index)


def scalogram(
    acceleration: Float, time_step: float, wavelet: str, periods: Float
) -> NDArray[np.float64]:
    """Return C(s, xi) at the samples and the given periods, computed with PyWavelets.

    An independent way to the same numbers, for pictures and as a check. PyWavelets samples its
    wavelets coarsely: it is right to half a sample in time and about half a percent in height.

    Parameters
    ----------
    acceleration : array, shape (samples,)
        Acceleration [m s-2].
    time_step : float
        Interval between samples [s].
    wavelet : str
        Name of the mother wavelet.
    periods : array, shape (periods,)
        Periods T_p [s].

    Returns
    -------
    array, shape (periods, samples)
        Coefficients [m s-3/2].

    Raises
    ------
    ParameterError
        If the wavelet is unknown.

    Examples
    --------
    >>> t = np.arange(1000) * 0.01
    >>> record = Pulse(wavelet="symmetric_ricker", a_p=2.0, T_p=0.8, time=5.0).acceleration(t)
    >>> picture = scalogram(record, 0.01, "symmetric_ricker", np.array([0.4, 0.8, 1.6]))
    >>> [int(i) for i in np.unravel_index(abs(picture).argmax(), picture.shape)]
    [1, 500]
    """
    if wavelet not in _PYRICKERS:
        known = ", ".join(_PYRICKERS)
        raise ParameterError(f"Invalid wavelet {wavelet!r}. Must be one of: {known}.")
    name, rate = _PYRICKERS[wavelet]
    scales = np.asarray(periods) / (rate * time_step)
    coefficients, _ = pywt.cwt(acceleration, scales, name, method="fft", precision=14)
    return np.asarray(coefficients * math.sqrt(time_step), dtype=np.float64)


def _period_range(
    acceleration: Float, time_step: float, shortest: float, longest: float
) -> tuple[float, float]:
    if not (0.0 < shortest < longest < math.inf):
        raise ParameterError(
            f"Invalid range of periods from {shortest!r} to {longest!r} s. "
            "Must be two positive numbers, the shorter one first."
        )
    low = max(shortest, _STEPS_PER_PERIOD * time_step)
    high = min(longest, time_step * (acceleration.size - 1))
    if high <= low:
        raise ParameterError(
            f"Invalid range of periods from {shortest:g} to {longest:g} s for a record of "
            f"{time_step * (acceleration.size - 1):g} s in steps of {time_step:g} s. Must overlap "
            f"with {_STEPS_PER_PERIOD} time steps to the record's duration."
        )
    return low, high


def _candidates(
    acceleration: Float, time_step: float, mother: MotherWavelet, low: float, high: float
) -> list[tuple[float, float]]:
    """Periods and times [s] of the largest local maxima of |C| over the ladder of periods."""
    rungs = max(3, math.ceil(math.log(high / low) / math.log(_PERIOD_RATIO)) + 1)
    periods = np.geomspace(low, high, rungs)
    margin = math.ceil(mother.reach * high / time_step)
    size = scipy.fft.next_fast_len(acceleration.size + 2 * margin, real=True)
    spectrum = scipy.fft.rfft(acceleration, size)
    lags = np.arange(size)
    tau = np.where(lags > size // 2, lags - size, lags) * time_step
    heights = np.empty(rungs)
    times = np.empty(rungs)
    for i, period in enumerate(periods):
        daughter = scipy.fft.rfft(mother.acceleration(tau / period))
        correlation = scipy.fft.irfft(spectrum * np.conj(daughter), size)[: acceleration.size]
        where = int(np.abs(correlation).argmax())
        heights[i] = abs(correlation[where]) / math.sqrt(period)
        times[i] = where * time_step
    padded = np.concatenate([[-1.0], heights, [-1.0]])
    peaks = np.flatnonzero((padded[1:-1] >= padded[:-2]) & (padded[1:-1] >= padded[2:]))
    largest = peaks[np.argsort(-heights[peaks], kind="stable")][:_CANDIDATES]
    return [(float(periods[i]), float(times[i])) for i in largest]


def _refine(
    acceleration: Float,
    time_step: float,
    mother: MotherWavelet,
    start: tuple[float, float],
    bounds: tuple[float, float],
) -> tuple[float, float, float]:
    """Period, time and coefficient C of the maximum of |C| near a starting point."""
    scale = math.sqrt(float(np.dot(acceleration, acceleration)) * time_step)

    def shortfall(x: Float) -> float:
        period = start[0] * math.exp(x[0])
        time = start[1] + start[0] * x[1]
        return 1.0 - abs(_coefficient(acceleration, time_step, mother, period, time)) / scale

    found = scipy.optimize.minimize(
        shortfall,
        x0=np.zeros(2),
        method="Nelder-Mead",
        bounds=[tuple(math.log(bound / start[0]) for bound in bounds), (None, None)],
        options={
            "initial_simplex": _simplex(start[0], bounds),
            "xatol": 1e-8,
            "fatol": 1e-15,
            "maxfev": 500,
        },
    )
    period = min(max(start[0] * math.exp(found.x[0]), bounds[0]), bounds[1])
    time = start[1] + start[0] * float(found.x[1])
    return period, time, _coefficient(acceleration, time_step, mother, period, time)


def _simplex(period: float, bounds: tuple[float, float]) -> Float:
    """First triangle of the search: one rung of the ladder wide, turned inwards at a bound."""
    step = math.log(_PERIOD_RATIO)
    if period * _PERIOD_RATIO > bounds[1]:
        step = -step
    return np.array([[0.0, 0.0], [step, 0.0], [0.0, 0.05]])


def _coefficient(
    acceleration: Float, time_step: float, mother: MotherWavelet, period: float, time: float
) -> float:
    reach = mother.reach * period
    first = max(0, math.ceil((time - reach) / time_step))
    last = min(acceleration.size, math.floor((time + reach) / time_step) + 1)
    tau = (np.arange(first, last, dtype=np.float64) * time_step - time) / period
    product = float(np.dot(acceleration[first:last], mother.acceleration(tau))) * time_step
    return product / math.sqrt(period * mother.energy)
