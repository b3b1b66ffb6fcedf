"""All pulses of one record: best matches, comparison with noise, velocity pulse, runners-up."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.matching.likeness import Likeness, likeness
from rockframe.matching.match import PulseMatch, best_ricker, match_pulses
from rockframe.matching.signal import period_range, velocity_of
from rockframe.options.pulse import PulseOptions
from rockframe.record import Record
from rockframe.wavelets.family import RICKERS
from rockframe.wavelets.pulse import Pulse

Float = NDArray[np.float64]


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
    return _pulses_of(samples, step, options or PulseOptions(), name)


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
    found: list[tuple[str, RecordPulses | None, str]] = []
    for record, options in task:
        try:
            found.append((record.record_id, find_pulses(record, options=options), ""))
        except ParameterError as error:
            found.append((record.record_id, None, str(error)))
    return found


def _pulses_of(
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
    alone = options.replaced(wavelet=(best.pulse.wavelet,), pulse_wavelet=None)
    rest, found, match = acceleration, list[RunnerUp](), best
    whole = float(acceleration @ acceleration)
    for _ in range(options.runners_up):
        rest = rest - match.pulse.acceleration(time)
        if float(rest @ rest) < 1e-20 * whole:
            break
        match = match_pulses(rest, time_step, alone)[best.pulse.wavelet]
        further = rest - match.pulse.acceleration(time)
        share = float(rest @ rest - further @ further) / whole
        found.append(RunnerUp(match=match, energy_share=share))
    return tuple(found)


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
    chosen = options.replaced(wavelet=tuple(RICKERS), pulse_wavelet=None, weighting="velocity")
    matches = match_pulses(acceleration, time_step, chosen)
    pulse = matches[best_ricker(matches)].pulse
    whole = velocity_of(acceleration, time_step)
    time = time_step * np.arange(acceleration.size)
    rest = velocity_of(acceleration - pulse.acceleration(time), time_step)
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
