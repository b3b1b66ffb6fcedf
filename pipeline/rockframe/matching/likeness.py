"""Comparison of a record's match index with that of noise with the same spectrum and envelope.

Such noise is called a surrogate: it has the spectrum of the record and random phases. Random phases
alone would spread the motion evenly over the record. Any record that builds up and decays would
then match better than its surrogates, with or without a pulse. The record is therefore divided by
its envelope before its phases are randomised, and multiplied by the envelope afterwards. Then the
record differs from its surrogates only if its phases agree at one time, as those of a pulse do.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

import numpy as np
import scipy
from numpy.typing import NDArray

from rockframe.matching.match import PulseMatch
from rockframe.matching.search import ladder, search
from rockframe.matching.signal import Samples, Weighting, period_range, prepared, require_record
from rockframe.options.pulse import PulseOptions

Float = NDArray[np.float64]

#: Significance level of the verdict.
LEVEL: Final = 0.05
#: Resolution of the coarse search of surrogates and record: periods per octave, numbers of half
#: cycles, and times per period.
_PER_OCTAVE: Final = 5
_HALF_CYCLES: Final = 3
_FINENESS: Final = 6
#: Number of surrogates that are searched together.
_BATCH: Final = 10
#: Number of surrogates that are searched together with the record; with fewer than 19, no verdict
#: is certain.
_FIRST: Final = 20
#: Width of the Gaussian that smooths the squared record into its envelope, relative to the
#: significant duration D5-95, and its lower bound [s].
_ENVELOPE_SHARE: Final = 0.1
_ENVELOPE_LEAST: Final = 0.4
#: Lower bound of the envelope relative to its peak, to limit the amplification of quiet parts.
_FLOOR: Final = 0.05


class PulseVerdict(IntEnum):
    """Result of the comparison with surrogates: the values of the variable `pulse_verdict`."""

    UNTESTED = 0
    PULSE = 1
    NOISE = 2
    AT_BOUND = 3


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


def pulse_words(verdict: PulseVerdict, p_value: float) -> str:
    """Return the result of the comparison with noise in words.

    Parameters
    ----------
    verdict : PulseVerdict
        Result of the comparison.
    p_value : float
        Share of surrogates that match at least as well [1].

    Examples
    --------
    >>> pulse_words(PulseVerdict.NOISE, 0.32)
    'best match, could be noise (p = 0.32)'
    """
    return {
        PulseVerdict.UNTESTED: "best match, not tested against noise",
        PulseVerdict.PULSE: f"pulse, unlikely to be noise (p = {p_value:.2f})",
        PulseVerdict.NOISE: f"best match, could be noise (p = {p_value:.2f})",
        PulseVerdict.AT_BOUND: "best match, at the end of the range of periods",
    }[verdict]


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
        if ((drawn >= own).sum(axis=1) > allowed).all():
            break
        further = _indices(source.draw(min(_BATCH, rest)), time_step, options)
        drawn = np.concatenate([drawn, further], axis=1)
    beaten = (drawn >= own).sum(axis=1).tolist()
    levels = np.quantile(drawn, (0.5, 1.0 - LEVEL), axis=1)
    numbers = zip(beaten, own[:, 0].tolist(), *levels.tolist(), strict=True)
    return {
        name: _judged(matches[name], drawn.shape[1], *found)
        for name, found in zip(options.wavelet, numbers, strict=True)
    }


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
    found = search(signal, rungs, options.wavelet, half_cycles, _FINENESS, nearly=1.0)
    energy = np.square(signal.samples).sum(axis=1, dtype=np.float64) * time_step
    best = np.stack([found[name].power.max(axis=2) for name in options.wavelet])
    rung = (best * Weighting(options.weighting).of_square(rungs)).argmax(axis=2, keepdims=True)
    return np.asarray(np.sqrt(np.take_along_axis(best, rung, 2)[..., 0] / energy))
