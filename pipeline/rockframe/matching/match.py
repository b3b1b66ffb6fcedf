"""The pulse that explains most of a record; the match index over the period; the scalogram."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.matching.refine import Refined, crest, refine
from rockframe.matching.search import Heights, ladder, search, summits
from rockframe.matching.signal import Signal, Weighting, period_range, prepared, require_record
from rockframe.options.pulse import PulseOptions
from rockframe.wavelets.family import (
    ANTISYMMETRIC_RICKER,
    RICKERS,
    SYMMETRIC_RICKER,
    WAVELETS,
    combined,
    phase_and_amplitude,
)
from rockframe.wavelets.pulse import Pulse

Float = NDArray[np.float64]

#: Candidates are the maxima over time at the periods of the grid's maxima, above this share of the
#: largest square; at most `_LOCATED` of them, and the first and the last, are located exactly.
_NEARLY: Final = 0.95
_LOCATED: Final = 64
#: The highest of these are refined, at most `_REFINED`, if they are above this share of the
#: highest: the periods of the grid are too coarse to decide which is the highest.
_CLOSE: Final = 0.98
_REFINED: Final = 12
#: A refined value counts as at a bound of its range if it is closer to the bound than this.
_AT_BOUND: Final = 1e-6
#: Share of a pulse's energy outside the record above which the pulse counts as cut.
_CUT: Final = 0.01


@dataclass(frozen=True, kw_only=True)
class PulseMatch:
    """The best pulse of one wavelet in a record.

    Parameters
    ----------
    pulse : Pulse
        The pulse. Its time counts from the first sample of the record.
    match_index : float
        Cosine of the angle between record and wavelet, from 0 to 1 [1]: the square root of the
        share of energy that the pulse explains. With the weighting ``velocity`` it is that of their
        velocities.
    at_period_bound : bool
        True if the best period is a bound of the range searched, and so not a maximum of the
        transform.
    at_half_cycle_bound : bool
        True if the best number of half cycles is a bound of its range.
    outside : float
        Share of the pulse's energy before the first or after the last sample [1].
    """

    pulse: Pulse
    match_index: float
    at_period_bound: bool
    at_half_cycle_bound: bool = False
    outside: float = field(default=0.0)

    @property
    def energy_share(self) -> float:
        """Share of the record's energy that the pulse explains [1]."""
        return self.match_index**2

    @property
    def cut(self) -> bool:
        """True if more than 1 % of the pulse's energy is before or after the record."""
        return self.outside > _CUT


def match_pulse(acceleration: Float, time_step: float, wavelet: str, **options: Any) -> PulseMatch:
    """Find the pulse of one wavelet that explains most of a record.

    The FFT searches all times at a geometric series of periods and at several numbers of half
    cycles; the best phase follows in closed form. The best candidates are then refined
    continuously. The amplitude is the least-squares fit.

    Parameters
    ----------
    acceleration : array, shape (samples,)
        Acceleration [m s-2].
    time_step : float
        Interval between samples [s].
    wavelet : str
        Name of the wavelet.
    **options
        Further fields of `PulseOptions`: ``periods_s``, ``weighting``, ``most_half_cycles``.

    Raises
    ------
    ParameterError
        If an option is not allowed, the record is constant or not finite, or no period is left
        to search.

    Examples
    --------
    >>> t = np.arange(1000) * 0.01
    >>> planted = Pulse(wavelet="symmetric_ricker", a_p=2.0, T_p=0.8, time=5.0)
    >>> match = match_pulse(planted.acceleration(t), 0.01, "symmetric_ricker")
    >>> round(match.pulse.a_p, 6), round(match.pulse.T_p, 6), round(match.match_index, 6)
    (2.0, 0.8, 1.0)
    """
    alone = PulseOptions(**{"wavelet": (wavelet,), **options})
    return match_pulses(acceleration, time_step, alone)[wavelet]


def match_pulses(
    acceleration: Float, time_step: float, options: PulseOptions | None = None
) -> dict[str, PulseMatch]:
    """Find the best pulse of each wavelet.

    Parameters
    ----------
    acceleration : array, shape (samples,)
        Acceleration [m s-2].
    time_step : float
        Interval between samples [s].
    options : PulseOptions, optional
        Wavelets, periods and weighting of the search.

    Raises
    ------
    ParameterError
        If the record is constant or not finite, or no period is left to search.

    Examples
    --------
    >>> t = np.arange(1000) * 0.01
    >>> planted = Pulse(wavelet="antisymmetric_ricker", a_p=2.0, T_p=0.8, time=5.0)
    >>> found = match_pulses(planted.acceleration(t), 0.01)
    >>> [round(match.match_index, 3) for match in found.values()]
    [0.899, 1.0, 1.0, 0.994]
    """
    options = options or PulseOptions()
    samples = require_record(acceleration, time_step)
    periods = period_range(samples.size, time_step, options)
    signal = prepared(samples, time_step, options, periods[1])
    rungs = ladder(*periods)
    heights = search(signal, rungs, options.wavelet, options.half_cycles, nearly=_NEARLY)
    return {name: _best(signal, name, heights[name], periods, options) for name in options.wavelet}


def best_match(matches: Sequence[PulseMatch]) -> int:
    """Return the position of the match with the largest match index."""
    return max(range(len(matches)), key=lambda i: matches[i].match_index)


def best_ricker(matches: Mapping[str, PulseMatch]) -> str:
    """Return the Ricker wavelet of fixed phase that explains more, or else the best wavelet.

    The Ricker wavelet of any phase and that of Mavroeidis and Papageorgiou have more parameters,
    so they explain more of every record. This does not mean that they suit the record better.
    """
    matched = [name for name in matches if name in RICKERS] or list(matches)
    return matched[best_match([matches[name] for name in matched])]


def _best(
    signal: Signal,
    wavelet: str,
    heights: Heights,
    periods: tuple[float, float],
    options: PulseOptions,
) -> PulseMatch:
    rungs = [crest(signal, wavelet, *start) for start in _candidates(signal, wavelet, heights)]
    highest = max(rung.weighted for rung in rungs)
    open_ones = [rung for rung in rungs if rung.weighted >= _CLOSE * highest]
    # of equally high ones the earliest, as round-off must not decide
    open_ones.sort(key=lambda rung: (-round(rung.weighted / highest, 9), rung.time))
    best = refine(signal, open_ones[:_REFINED], periods, (1.0, options.most_half_cycles))
    number = best.half_cycles
    ends = (best.period / periods[0] - 1.0, 1.0 - best.period / periods[1])
    pulse = matched_pulse(best, Weighting(options.weighting))
    return PulseMatch(
        pulse=pulse,
        match_index=min(1.0, math.sqrt(best.explained / signal.energy)),
        at_period_bound=min(ends) < _AT_BOUND,
        at_half_cycle_bound=number is not None
        and min(number - 1.0, options.most_half_cycles - number) < _AT_BOUND,
        outside=_outside(pulse, signal.duration),
    )


def matched_pulse(refined: Refined, weighting: Weighting) -> Pulse:
    """Return the pulse that belongs to a maximum of the transform."""
    # factors of velocities have the unit of a_p T_p
    scale = 1.0 / refined.period if weighting.of_velocity else 1.0
    factors = tuple(scale * factor for factor in refined.factors)
    phase, a_p = phase_and_amplitude(refined.wavelet, refined.half_cycles, factors)
    return Pulse(
        wavelet=refined.wavelet,
        a_p=a_p,
        T_p=refined.period,
        time=refined.time,
        phase=phase,
        half_cycles=refined.half_cycles,
    )


def _candidates(
    signal: Signal, wavelet: str, heights: Heights
) -> list[tuple[float, float, float | None]]:
    """Return period, time and half cycles of the candidates: maxima close to the largest."""
    weighted = heights.power[0] * signal.weighting.of_square(heights.periods)[:, None]
    rows, columns = weighted.shape
    least = _NEARLY * weighted.max()
    padded = np.full((rows + 2, columns + 2), least)
    padded[1:-1, 1:-1] = weighted
    peaks = [
        (i, j)
        for i, j in np.argwhere(weighted >= least).tolist()
        if weighted[i, j] >= padded[i : i + 3, j : j + 3].max()
    ]
    candidates = []
    for i, j in peaks:
        period, number = float(heights.periods[i]), heights.half_cycles[j]
        factor = float(signal.weighting.of_square(heights.periods[i]))
        for square, time in summits(signal, wavelet, period, number, _NEARLY):
            candidates.append((factor * square, period, time, number))
    least = _NEARLY * max(candidate[0] for candidate in candidates)
    candidates = sorted(
        (candidate for candidate in candidates if candidate[0] >= least),
        key=lambda candidate: (-candidate[0], candidate[2]),
    )
    # the first and the last may be at an end of the record, where the grid errs most
    ends = [choose(candidates, key=lambda candidate: candidate[2]) for choose in (min, max)]
    return [candidate[1:] for candidate in dict.fromkeys([*candidates[:_LOCATED], *ends])]


def _outside(pulse: Pulse, duration: float) -> float:
    """Return the share of a pulse's energy before or after a record."""
    parts = WAVELETS[pulse.wavelet].parts(pulse.half_cycles)
    weights = [1.0] if len(parts) == 1 else [math.cos(pulse.phase), math.sin(pulse.phase)]
    shape = combined(parts, weights)
    reach = pulse.T_p * shape.reach
    if reach <= pulse.time <= duration - reach:
        return 0.0
    tau = np.linspace(-shape.reach, shape.reach, 801)
    square = shape.acceleration(tau) ** 2
    time = pulse.time + pulse.T_p * tau
    return float(square[(time < 0.0) | (time > duration)].sum() / square.sum())


#: Number of times per period and of periods per octave. The curve is then within 0.1 % of the
#: maxima.
_FINENESS: Final = 24
_PER_OCTAVE: Final = 28


def match_curve(
    acceleration: Float, time_step: float, options: PulseOptions
) -> tuple[Float, dict[str, Float]]:
    """Return the largest match index of each wavelet at each period, over all times and phases.

    Parameters
    ----------
    acceleration : array, shape (samples,)
        Acceleration [m s-2].
    time_step : float
        Interval between samples [s].
    options : PulseOptions
        Wavelets, periods and weighting of the search.

    Returns
    -------
    periods : array, shape (periods,)
        T_p [s].
    indices : dict of str to array, shape (periods,)
        Match indices by wavelet [1].

    Raises
    ------
    ParameterError
        If the record is constant or not finite, or no period is left to search.

    Examples
    --------
    >>> from rockframe import Pulse
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=2.0, T_p=0.8, time=5.0)
    >>> record = pulse.acceleration(0.01 * np.arange(1000))
    >>> periods, indices = match_curve(record, 0.01, PulseOptions())
    >>> round(float(periods[indices["symmetric_ricker"].argmax()]), 2)
    0.8
    """
    samples = require_record(acceleration, time_step)
    low, high = period_range(samples.size, time_step, options)
    signal = prepared(samples, time_step, options, high)
    periods = ladder(low, high, _PER_OCTAVE)
    best = search(signal, periods, options.wavelet, options.half_cycles, _FINENESS)
    return periods, {
        name: np.sqrt(np.minimum(1.0, heights.power[0].max(axis=1) / signal.energy))
        for name, heights in best.items()
    }


#: Name of each wavelet in PyWavelets, and its variable divided by tau.
_PYWAVELETS: Final = {
    SYMMETRIC_RICKER.name: ("mexh", math.sqrt(2.0) * math.pi),
    ANTISYMMETRIC_RICKER.name: ("gaus3", 2.0 * math.pi / math.sqrt(6.0)),
}


def scalogram(
    acceleration: Float, time_step: float, wavelet: str, periods: Float
) -> NDArray[np.float64]:
    """Return C(s, xi) at the samples and the given periods, computed with PyWavelets.

    This computation is independent of the search; it is used for figures and as a check. ``mexh``
    and ``gaus3`` have unit energy over the variables x = sqrt(2) pi tau and 2 pi tau / sqrt(6), and
    ``pywt.cwt`` divides by the square root of the scale in samples. Times the square root of the
    time step, the result is the transform with the weighting ``energy``. PyWavelets samples its
    wavelets coarsely: the error is half a sample in time and about half a percent in height.

    Parameters
    ----------
    acceleration : array, shape (samples,)
        Acceleration [m s-2].
    time_step : float
        Interval between samples [s].
    wavelet : str
        ``symmetric_ricker`` or ``antisymmetric_ricker``; PyWavelets does not have the others.
    periods : array, shape (periods,)
        Periods T_p [s].

    Returns
    -------
    array, shape (periods, samples)
        Coefficients [m s-3/2].

    Raises
    ------
    ParameterError
        If the wavelet is not one of these.

    Examples
    --------
    >>> from rockframe import Pulse
    >>> t = np.arange(1000) * 0.01
    >>> record = Pulse(wavelet="symmetric_ricker", a_p=2.0, T_p=0.8, time=5.0).acceleration(t)
    >>> picture = scalogram(record, 0.01, "symmetric_ricker", np.array([0.4, 0.8, 1.6]))
    >>> [int(i) for i in np.unravel_index(abs(picture).argmax(), picture.shape)]
    [1, 500]
    """
    import pywt  # for figures alone

    if wavelet not in _PYWAVELETS:
        allowed = ", ".join(_PYWAVELETS)
        raise ParameterError(f"Invalid wavelet {wavelet!r}. Must be one of: {allowed}.")
    name, rate = _PYWAVELETS[wavelet]
    scales = np.asarray(periods) / (rate * time_step)
    coefficients, _ = pywt.cwt(acceleration, scales, name, method="fft", precision=14)
    return np.asarray(coefficients * math.sqrt(time_step), dtype=np.float64)
