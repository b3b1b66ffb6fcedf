"""All pulses of one record: best matches, comparison with noise, velocity pulse, runners-up."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import scipy
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.matching.match import PulseMatch, best_ricker, match_pulses
from rockframe.matching.search import ladder, search
from rockframe.matching.signal import (
    Samples,
    Weighting,
    integrate_velocity,
    period_range,
    prepared,
    require_record,
)
from rockframe.matching.verdict import PulseVerdict
from rockframe.options.pulse import PulseOptions
from rockframe.record import Record
from rockframe.wavelets.family import RICKERS
from rockframe.wavelets.pulse import Pulse

Float = NDArray[np.float64]

#: Significance level of the verdict.
LEVEL: Final = 0.05
#: Resolution of the coarse search of surrogates and record: periods per octave, numbers of half
#: cycles, and times per period.
_PER_OCTAVE: Final = 5
_HALF_CYCLES: Final = 3
_FINENESS: Final = 6
#: Number of surrogates that are searched together.
_TOGETHER: Final = 10
#: Number of values that are searched together, of a record that matches better than the first
#: surrogates: short ones are searched with more surrogates at once.
_VALUES: Final = 1 << 16
#: Number of surrogates that are searched together with the record; with fewer than 19, no verdict
#: is certain.
_FIRST: Final = 20
#: Width of the Gaussian that smooths the squared record into its envelope, relative to the
#: significant duration D5-95, and its lower bound [s].
_ENVELOPE_SHARE: Final = 0.1
_ENVELOPE_LEAST: Final = 0.4
#: Lower bound of the envelope relative to its peak, to limit the amplification of quiet parts.
_FLOOR: Final = 0.05


@dataclass(frozen=True, kw_only=True)
class Likeness:
    """Result of the comparison of a match with those of surrogates.

    Parameters
    ----------
    verdict : PulseVerdict
        ``PULSE`` if p is at most 0.05 and the period is not a bound of the range.
    p_value : float
        Share of surrogates that match at least as well, counting the record as one [1]; NaN if
        untested.
    surrogates : int
        Number of surrogates drawn.
    match_index : float
        Match index of the record in the same coarse search as the surrogates [1].
    median, high : float
        Median and 95 % quantile of the match indices of the surrogates [1].
    """

    verdict: PulseVerdict
    p_value: float
    surrogates: int
    match_index: float
    median: float
    high: float


def likeness(
    acceleration: Float,
    time_step: float,
    matches: Mapping[str, PulseMatch],
    options: PulseOptions,
    record_id: str = "",
) -> dict[str, Likeness]:
    """Compare the matches of a record with those of its surrogates.

    Parameters
    ----------
    acceleration : array, shape (samples,)
        Acceleration [m s-2].
    time_step : float
        Interval between samples [s].
    matches : mapping of str to PulseMatch
        Result of `match_pulses` with the same options.
    options : PulseOptions
        Options of the search, with the number and the seed of the surrogates.
    record_id : str, optional
        Identifier of the record. The random phases follow from it, the number of samples, the time
        step and the seed, so that they are the same on every processor.

    Raises
    ------
    ParameterError
        If the record is constant or not finite, or no period is left to search.

    Examples
    --------
    >>> from rockframe.matching.match import match_pulses
    >>> from rockframe import Pulse
    >>> noise = np.random.default_rng(1).normal(0.0, 0.3, 2000)
    >>> planted = Pulse(wavelet="symmetric_ricker", a_p=2.0, T_p=1.0, time=8.0)
    >>> samples = planted.acceleration(0.01 * np.arange(2000)) + noise
    >>> options = PulseOptions(wavelet=("symmetric_ricker",))
    >>> found = match_pulses(samples, 0.01, options)
    >>> likeness(samples, 0.01, found, options)["symmetric_ricker"].verdict.name
    'PULSE'
    """
    samples = require_record(acceleration, time_step)
    if options.surrogates == 0:
        return {name: _untested() for name in matches}
    allowed = math.floor(LEVEL * (options.surrogates + 1) + 1e-9) - 1
    source = _Surrogates(samples, time_step, options, record_id)
    first = source.draw(min(_FIRST, options.surrogates))
    whole = _indices(np.concatenate([source.record[None], first]), time_step, options)
    own, drawn = whole[:, :1], whole[:, 1:]
    while (rest := options.surrogates - drawn.shape[1]) > 0:
        end = _enough(drawn >= own, allowed)
        if end:
            drawn = drawn[:, :end]
            break
        clear = ((drawn >= own).sum(axis=1) == 0).any()  # then all surrogates will be needed
        count = max(_TOGETHER, _VALUES // samples.size) if clear else _TOGETHER
        further = _indices(source.draw(min(count, rest)), time_step, options)
        drawn = np.concatenate([drawn, further], axis=1)
    beaten = (drawn >= own).sum(axis=1).tolist()
    levels = np.quantile(drawn, (0.5, 1.0 - LEVEL), axis=1)
    numbers = zip(beaten, own[:, 0].tolist(), *levels.tolist(), strict=True)
    return {
        name: _judged(matches[name], drawn.shape[1], *number)
        for name, number in zip(options.wavelet, numbers, strict=True)
    }


def _enough(beaten: NDArray[np.bool_], allowed: int) -> int:
    """Return the number of surrogates after which no wavelet can pass; 0 if one still can.

    It is one of those at which a search of `_TOGETHER` at a time would stop, so that the result
    does not depend on how many are searched at once.
    """
    counts = beaten.cumsum(axis=1)
    ends = range(min(_FIRST, counts.shape[1]), counts.shape[1] + 1, _TOGETHER)
    return next((end for end in ends if (counts[:, end - 1] > allowed).all()), 0)


def _judged(
    match: PulseMatch, count: int, beaten: int, own: float, median: float, high: float
) -> Likeness:
    p_value = (1 + beaten) / (1 + count)
    verdict = PulseVerdict.PULSE if p_value <= LEVEL + 1e-12 else PulseVerdict.NOISE
    if match.at_period_bound:
        verdict = PulseVerdict.AT_BOUND
    return Likeness(
        verdict=verdict,
        p_value=p_value,
        surrogates=count,
        match_index=own,
        median=median,
        high=high,
    )


def _untested() -> Likeness:
    nothing = math.nan
    return Likeness(
        verdict=PulseVerdict.UNTESTED,
        p_value=nothing,
        surrogates=0,
        match_index=nothing,
        median=nothing,
        high=nothing,
    )


class _Surrogates:
    """A source of surrogates of one record."""

    def __init__(
        self, samples: Float, time_step: float, options: PulseOptions, record_id: str = ""
    ) -> None:
        # The seed must not depend on the samples: their last bits differ between processors.
        described = f"{record_id} {samples.size} {time_step:.9g}"
        digest = hashlib.sha256(described.encode()).digest()[:16]
        self._random = np.random.default_rng([options.seed, int.from_bytes(digest, "little")])
        samples = samples / np.abs(samples).max()  # large numbers overflow in single precision
        self.record = samples.astype(np.float32)
        self._size = samples.size
        self._envelope = np.ones(samples.size)
        divisor = self._envelope
        if options.scrambling == "envelope":
            self._envelope = _envelope(samples, time_step)
            divisor = np.hypot(self._envelope, _FLOOR * self._envelope.max())
        self._length = scipy.fft.next_fast_len(samples.size, real=True)
        lines = scipy.fft.rfft(samples / divisor, self._length)
        self._amplitudes = np.abs(lines).astype(np.float32)
        self._amplitudes[0] = 0.0
        self._envelope = self._envelope.astype(np.float32)

    def draw(self, count: int) -> NDArray[np.float32]:
        """Return surrogates, shape (count, samples), in single precision like the search."""
        phases = self._random.uniform(0.0, 2.0 * math.pi, (count, self._amplitudes.size))
        angles, lines = phases.astype(np.float32), np.empty(phases.shape, dtype=np.complex64)
        np.multiply(self._amplitudes, np.cos(angles), out=lines.real)
        np.multiply(self._amplitudes, np.sin(angles), out=lines.imag)
        even = scipy.fft.irfft(lines, self._length, overwrite_x=True)
        return np.asarray(self._envelope * even[:, : self._size])


def _envelope(samples: Float, time_step: float) -> Float:
    """Return the square root of the squared record after smoothing with a Gaussian."""
    square = samples**2
    growth = np.cumsum(square) / square.sum()
    strong = float(np.searchsorted(growth, 0.95) - np.searchsorted(growth, 0.05)) * time_step
    width = max(_ENVELOPE_SHARE * strong, _ENVELOPE_LEAST)
    margin = math.ceil(5.0 * width / time_step)
    size = scipy.fft.next_fast_len(samples.size + margin, real=True)
    frequency = scipy.fft.rfftfreq(size, time_step)
    smooth = np.exp(-2.0 * (math.pi * width * frequency) ** 2)
    smoothed = scipy.fft.irfft(scipy.fft.rfft(square, size) * smooth, size)[: samples.size]
    return np.asarray(np.sqrt(np.maximum(smoothed, 0.0)))


def _indices(samples: Samples, time_step: float, options: PulseOptions) -> Float:
    """Return the match indices of each wavelet and several records, from a coarse search."""
    periods = period_range(samples.shape[1], time_step, options)
    signal = prepared(samples, time_step, options, periods[1])
    half_cycles = np.linspace(1.0, options.most_half_cycles, _HALF_CYCLES).tolist()
    rungs = ladder(*periods, _PER_OCTAVE)
    indices = search(signal, rungs, options.wavelet, half_cycles, _FINENESS, nearly=1.0)
    energy = np.square(signal.samples).sum(axis=1, dtype=np.float64) * time_step
    best = np.stack([indices[name].power.max(axis=2) for name in options.wavelet])
    rung = (best * Weighting(options.weighting).of_square(rungs)).argmax(axis=2, keepdims=True)
    return np.asarray(np.sqrt(np.take_along_axis(best, rung, 2)[..., 0] / energy))


@dataclass(frozen=True, kw_only=True)
class RunnerUp:
    """A further pulse of a record.

    Parameters
    ----------
    match : PulseMatch
        Best match in the residual of the record without the stronger pulses.
    energy_share : float
        Share of the record's energy that this pulse explains [1].
    """

    match: PulseMatch
    energy_share: float


@dataclass(frozen=True, kw_only=True)
class RecordPulses:
    """The pulses of one record.

    Parameters
    ----------
    matches, likeness : mapping
        The best pulse of each wavelet, and its comparison with noise, by name of the wavelet.
    velocity : VelocityPulse
        The pulse in the velocity, for comparison.
    used : str
        Wavelet of the selected pulse.
    runners_up : tuple of RunnerUp
        Further pulses of the same wavelet.
    periods : tuple of float
        Shortest and longest period searched [s].
    """

    matches: Mapping[str, PulseMatch]
    likeness: Mapping[str, Likeness]
    velocity: VelocityPulse
    used: str
    runners_up: tuple[RunnerUp, ...]
    periods: tuple[float, float]


def find_pulses(
    acceleration: Float | Record,
    time_step: float | None = None,
    options: PulseOptions | None = None,
) -> RecordPulses:
    """Find the best pulse of each wavelet, test it against noise, and find its runners-up.

    Parameters
    ----------
    acceleration : Record, or array of shape (samples,)
        A record, or its acceleration [m s-2].
    time_step : float, optional
        Interval between samples [s]. It must not be given with a `Record`.
    options : PulseOptions, optional
        Options of the search.

    Raises
    ------
    ParameterError
        If the record is constant or not finite, no period is left to search, or an array is given
        without a time step or a record with one.

    Examples
    --------
    >>> from rockframe import Pulse
    >>> t = 0.01 * np.arange(2000)
    >>> first = Pulse(wavelet="symmetric_ricker", a_p=2.0, T_p=0.8, time=5.0)
    >>> second = Pulse(wavelet="symmetric_ricker", a_p=1.0, T_p=1.0, time=12.0)
    >>> record = first.acceleration(t) + second.acceleration(t)
    >>> found = find_pulses(record, 0.01, PulseOptions(surrogates=0))
    >>> found.used, round(found.runners_up[0].match.pulse.a_p, 3)
    ('symmetric_ricker', 1.0)
    """
    record = acceleration if isinstance(acceleration, Record) else None
    if (record is None) == (time_step is None):
        raise ParameterError("Invalid time_step. Must be stated for an array, not for a Record.")
    samples = np.asarray(acceleration if record is None else record.acceleration)
    step = time_step or (record.time_step if record else 0.0)
    name = record.record_id if record else ""
    return _find_pulses(samples, step, options or PulseOptions(), name)


def pulses_or_reasons(
    task: Sequence[tuple[Record, PulseOptions]],
) -> list[tuple[str, RecordPulses | None, str]]:
    """Return the name of each record, and its pulses or the reason why there are none.

    This function is in this module, not in that of the stage, so that workers do not import the
    modules that read and write files.

    Parameters
    ----------
    task : sequence
        Records, each with the options of its search.
    """
    results: list[tuple[str, RecordPulses | None, str]] = []
    for record, options in task:
        try:
            results.append((record.record_id, find_pulses(record, options=options), ""))
        except ParameterError as error:
            results.append((record.record_id, None, str(error)))
    return results


def _find_pulses(
    acceleration: Float, time_step: float, options: PulseOptions, record_id: str
) -> RecordPulses:
    matches = match_pulses(acceleration, time_step, options)
    used = options.pulse_wavelet or best_ricker(matches)
    return RecordPulses(
        matches=matches,
        likeness=likeness(acceleration, time_step, matches, options, record_id),
        velocity=velocity_pulse(acceleration, time_step, options),
        used=used,
        runners_up=_runners_up(acceleration, time_step, matches[used], options),
        periods=period_range(acceleration.size, time_step, options),
    )


def _runners_up(
    acceleration: Float, time_step: float, best: PulseMatch, options: PulseOptions
) -> tuple[RunnerUp, ...]:
    """Search the residual repeatedly, at most until nothing is left of it."""
    time = time_step * np.arange(acceleration.size)
    alone = options.of_wavelets(best.pulse.wavelet)
    rest, runners, match = acceleration, list[RunnerUp](), best
    whole = float(acceleration @ acceleration)
    for _ in range(options.runners_up):
        rest = rest - match.pulse.acceleration(time)
        if float(rest @ rest) < 1e-20 * whole:
            break
        match = match_pulses(rest, time_step, alone)[best.pulse.wavelet]
        further = rest - match.pulse.acceleration(time)
        share = float(rest @ rest - further @ further) / whole
        runners.append(RunnerUp(match=match, energy_share=share))
    return tuple(runners)


#: Constant, factor of the peak ratio and factor of the energy ratio in the published regression.
_INDICATOR: Final = (-23.3, 14.6, 20.5)


@dataclass(frozen=True, kw_only=True)
class VelocityPulse:
    """The pulse in a record's velocity, and the residual velocity without it.

    Parameters
    ----------
    pulse : Pulse
        The Ricker pulse whose velocity explains most of the velocity of the record.
    peak_ratio : float
        Peak velocity of the residual record over that of the record [1].
    energy_ratio : float
        Integral of the squared velocity of the residual record over that of the record [1].
    indicator : float
        1 / (1 + exp(-23.3 + 14.6 peak_ratio + 20.5 energy_ratio)) [1]. Baker (2007) classifies
        records above 0.85 as pulse-like, and records below 0.15 as not pulse-like.
    """

    pulse: Pulse
    peak_ratio: float
    energy_ratio: float
    indicator: float


def velocity_pulse(acceleration: Float, time_step: float, options: PulseOptions) -> VelocityPulse:
    """Find the pulse in a record's velocity, and compare the velocity with and without it.

    The ratios and the indicator are those of Baker (2007), Quantitative classification of
    near-fault ground motions using wavelet analysis, Bull. Seismol. Soc. Am. 97(5), 1486-1501.
    Baker extracts a Daubechies wavelet. This function extracts the Ricker pulse that explains most
    of the velocity, so its indicator is an approximation.

    Parameters
    ----------
    acceleration : array, shape (samples,)
        Acceleration [m s-2].
    time_step : float
        Interval between samples [s].
    options : PulseOptions
        Options of the search, of which only the range of periods is used.

    Raises
    ------
    ParameterError
        If the record is constant or not finite, or no period is left to search.

    Examples
    --------
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=2.0, T_p=0.8, time=5.0)
    >>> record = pulse.acceleration(0.01 * np.arange(1000))
    >>> round(velocity_pulse(record, 0.01, PulseOptions()).indicator, 6)
    1.0
    """
    chosen = options.of_wavelets(*RICKERS).replaced(weighting="velocity")
    matches = match_pulses(acceleration, time_step, chosen)
    pulse = matches[best_ricker(matches)].pulse
    whole = integrate_velocity(acceleration, time_step)
    time = time_step * np.arange(acceleration.size)
    rest = integrate_velocity(acceleration - pulse.acceleration(time), time_step)
    peak_ratio = float(np.abs(rest).max() / np.abs(whole).max())
    energy_ratio = float((rest @ rest) / (whole @ whole))
    constant, of_peak, of_energy = _INDICATOR
    exponent = constant + of_peak * peak_ratio + of_energy * energy_ratio
    return VelocityPulse(
        pulse=pulse,
        peak_ratio=peak_ratio,
        energy_ratio=energy_ratio,
        indicator=1.0 / (1.0 + math.exp(min(exponent, 700.0))),
    )
