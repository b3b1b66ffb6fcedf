"""Passport of a record: its measured quantities and the verdicts of the quality checks."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import TYPE_CHECKING, Final

import numpy as np

from rockframe.record import Record, SiteType
from rockframe.signals.corner import UNCHANGED, Corner
from rockframe.signals.measures import (
    arias_intensity,
    clipped_samples,
    cumulative_absolute_velocity,
    longest_constant,
    opening_share,
    significant_duration,
)
from rockframe.signals.noise import pre_event, signal_to_noise_band, usable_periods
from rockframe.signals.processing import Float, integrate, level, peak
from rockframe.units import GRAVITY, acceleration_factor

if TYPE_CHECKING:  # processes that read files need no options, whose import takes long
    from rockframe.options.ingest import PassportLimits

#: The checks in order: unit, and True if the limit is a lower limit, False if it is an upper one.
CHECKS: Final = {
    "peak_acceleration": ("m s-2", False),
    "time_step": ("s", False),
    "not_free_field": ("1", False),
    "azimuth": ("degree", False),
    "stated_peak": ("1", False),
    "clipped_samples": ("1", False),
    "constant_time": ("s", False),
    "opening_share": ("1", False),
    "closing_share": ("1", False),
    "end_velocity_share": ("1", False),
    "end_displacement_share": ("1", False),
    "signal_to_noise": ("1", True),
    "usable_period_longest": ("s", True),
    "significant_duration": ("s", True),
    "arias_intensity": ("m s-1", True),
}


class CheckVerdict(IntEnum):
    """Verdict of a check; the values of the flag variable `passport`."""

    OK = 0
    WARN = 1
    REJECT = 2
    NOT_MEASURED = 3


@dataclass(frozen=True)
class Check:
    """Result of one check of a record.

    Parameters
    ----------
    name : str
        Name of the measured quantity, one of `CHECKS`.
    value : float
        Measured value; NaN if it cannot be measured on this record.
    limit : float
        The limit that decided the verdict: the rejection limit if the value is beyond it, else the
        warning limit.
    verdict : CheckVerdict
        ``OK``, ``WARN``, ``REJECT``, or ``NOT_MEASURED``, which does not affect the verdict on the
        record.
    unit, at_least : str, bool
        Unit of value and limit, and whether the limit is a lower limit.

    Examples
    --------
    >>> print(Check("clipped_samples", 40.0, 25.0, CheckVerdict.REJECT, "1"))
    clipped_samples 40. Must be at most 25.
    """

    name: str
    value: float
    limit: float
    verdict: CheckVerdict
    unit: str
    at_least: bool = False

    def __str__(self) -> str:
        unit = "" if self.unit == "1" else f" {self.unit}"
        bound = "at least" if self.at_least else "at most"
        return f"{self.name} {self.value:.4g}{unit}. Must be {bound} {self.limit:.4g}{unit}."


#: Measures that grow with the amplitude of a motion.
_LINEAR: Final = (
    "peak_acceleration",
    "peak_velocity",
    "end_velocity",
    "end_displacement",
    "noise_level",
    "cumulative_absolute_velocity",
)


@dataclass(frozen=True, kw_only=True)
class Measures:
    """Measured quantities of a record. Quantities that cannot be measured are NaN.

    Parameters
    ----------
    peak_acceleration : float
        Peak acceleration after processing [m s-2].
    peak_velocity : float
        Peak velocity after processing, integrated from rest [m s-1].
    arias_intensity : float
        Arias intensity after processing [m s-1].
    cumulative_absolute_velocity : float
        Integral of |a| after processing [m s-1].
    strong_start, strong_end, strong_end_75 : float
        Times at which the Arias intensity reaches 5, 95 and 75 % of its final value [s].
    end_velocity, end_displacement : float
        Velocity [m s-1] and displacement [m] at the end of the record, due to drift of the
        baseline. They are integrated from rest. Records that this package corrected are integrated
        from the start values of `correct`, unless they were rotated.
    end_velocity_share, end_displacement_share : float
        Absolute end velocity and displacement, divided by the peaks of velocity and displacement
        [1].
    clipped_samples : int
        Length of the longest run of equal samples at an extreme, before processing.
    constant_time : float
        Longest time without change, before processing, between 5 and 95 % of the Arias
        intensity [s].
    opening_share, closing_share : float
        Peaks of the first and of the last 0.1 s divided by the peak, before the taper [1].
    pre_event, noise_level : float
        Length of the noise window before the event [s], 0 if there is none, and root mean square of
        the noise [m s-2].
    stated_peak : float
        Relative difference between the peak of the samples and the peak stated in the header [1].
    usable_period_shortest, usable_period_longest : float
        Usable periods from the filter corners and the noise [s]; both 0 if there are none.
    """

    peak_acceleration: float
    peak_velocity: float
    arias_intensity: float
    cumulative_absolute_velocity: float
    strong_start: float
    strong_end: float
    strong_end_75: float
    end_velocity: float
    end_displacement: float
    end_velocity_share: float
    end_displacement_share: float
    clipped_samples: int
    constant_time: float
    opening_share: float
    closing_share: float
    pre_event: float
    noise_level: float
    stated_peak: float
    usable_period_shortest: float
    usable_period_longest: float

    def scaled(self, factor: float) -> Measures:
        """Return the measures of the motion times a factor."""
        linear = {name: factor * getattr(self, name) for name in _LINEAR}
        return replace(self, arias_intensity=factor**2 * self.arias_intensity, **linear)

    @property
    def significant_duration(self) -> float:
        """Significant duration D5-95 [s]."""
        return self.strong_end - self.strong_start

    @property
    def significant_duration_75(self) -> float:
        """Significant duration D5-75 [s]."""
        return self.strong_end_75 - self.strong_start


@dataclass(frozen=True)
class Passport:
    """Measured quantities of a record, one result for each of `CHECKS`, in that order, and the
    lower corner with which this package corrected it.
    """

    measures: Measures
    checks: tuple[Check, ...]
    corner: Corner = UNCHANGED

    @property
    def verdict(self) -> CheckVerdict:
        """Worst verdict among the checks that could be measured."""
        measured = (c.verdict for c in self.checks if c.verdict is not CheckVerdict.NOT_MEASURED)
        return max(measured, default=CheckVerdict.NOT_MEASURED)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Names of the checks with the verdict ``WARN``."""
        return tuple(c.name for c in self.checks if c.verdict is CheckVerdict.WARN)

    @property
    def rejections(self) -> tuple[Check, ...]:
        """Checks with the verdict ``REJECT``."""
        return tuple(c for c in self.checks if c.verdict is CheckVerdict.REJECT)

    @property
    def late_trigger(self) -> bool:
        """True if the record seems to begin during the motion."""
        (check,) = (c for c in self.checks if c.name == "opening_share")
        return check.verdict in (CheckVerdict.WARN, CheckVerdict.REJECT)


def implausible_peak(peak_acceleration: float, limits: PassportLimits) -> str:
    """Return words for a peak acceleration [m s-2] that suggests wrong units; empty otherwise.

    Plausible peaks are at most the limit above which the passport warns, and at least the same
    number in gal as that limit in g: a record in g that is read as gal is weaker. Unknown peaks,
    NaN, have no words.

    Examples
    --------
    >>> from rockframe.options.ingest import PassportLimits
    >>> [implausible_peak(9.81 * peak, PassportLimits()) for peak in (3.4, 0.3, 0.0003)]
    ['PGA 3.4 g: check the units', '', 'PGA 0.0003 g: check the units']
    """
    most = limits.peak_acceleration_warn
    least = most / GRAVITY * acceleration_factor("gal")
    beyond = peak_acceleration > most or peak_acceleration < least
    return f"PGA {peak_acceleration / GRAVITY:.2g} g: check the units" if beyond else ""


def passport(
    before: Record,
    after: Record,
    limits: PassportLimits,
    start: tuple[float, float] = (0.0, 0.0),
    measures: Measures | None = None,
) -> Passport:
    """Measure a record and compare the measures with the limits.

    Parameters
    ----------
    before, after : Record
        The record as published by the archive, and after processing by this package; the same
        record if it was not processed. Clipping, gaps, noise and late triggers are measured before
        processing, because a filter hides them. Intensity and drift are measured after processing.
    limits : PassportLimits
        Limits of warning and rejection.
    start : (float, float)
        Velocity [m s-1] and displacement [m] at the first sample, from `correct`.
    measures : Measures, optional
        Results of `measured` for these arguments, if they are known.

    Raises
    ------
    ParameterError
        If all samples are zero.

    Examples
    --------
    >>> from rockframe.options.ingest import PassportLimits
    >>> time = 0.01 * np.arange(2001)
    >>> wave = np.sin(np.pi * time) * np.sin(np.pi * time / 20)
    >>> record = Record(record_id="wave", acceleration=wave, time_step=0.01)
    >>> result = passport(record, record, PassportLimits())
    >>> result.verdict.name, result.warnings
    ('OK', ())
    >>> print(f"{result.measures.significant_duration:.2f} s")
    11.60 s
    """
    values = measures or measured(before, after, limits.signal_to_noise_ratio, start)
    return Passport(values, _judge(values, after, limits))


def measured(
    before: Record, after: Record, ratio: float, start: tuple[float, float] = (0.0, 0.0)
) -> Measures:
    """Return the measures of a record; `ratio` is the limit of its signal-to-noise ratio.

    The other parameters, and the errors, are those of `passport`.

    Examples
    --------
    >>> record = Record(record_id="wave", acceleration=[0.0, 2.0, -1.0, 0.0], time_step=0.01)
    >>> measured(record, record, 3.0).peak_acceleration
    2.0
    """
    # Squares of extremely large samples overflow; the check of the peak rejects them.
    with np.errstate(over="ignore", invalid="ignore"):
        return _measure(before, after, ratio, start)


def _measure(before: Record, after: Record, ratio: float, moving: tuple[float, float]) -> Measures:
    step = after.time_step
    start, end = significant_duration(after.acceleration, step)
    from_rest = integrate(after.acceleration, step)
    velocity = moving[0] + from_rest
    displacement = moving[1] + integrate(velocity, step)
    raw = before.acceleration
    # The straight line that `correct` removes is not part of the motion, nor of its noise.
    motion = level(raw) if after.uncorrected else raw
    quiet, noise = pre_event(motion, step)
    band = signal_to_noise_band(motion, step, quiet, (start, end), ratio)
    corners = after.filter_low, after.filter_high
    shortest, longest = usable_periods(step, after.duration, corners, band)
    strong = slice(int(start / step), int(end / step) + 2)
    return Measures(
        peak_acceleration=peak(after.acceleration),
        peak_velocity=peak(from_rest),
        arias_intensity=arias_intensity(after.acceleration, step),
        cumulative_absolute_velocity=cumulative_absolute_velocity(after.acceleration, step),
        strong_start=start,
        strong_end=end,
        strong_end_75=significant_duration(after.acceleration, step, 0.05, 0.75)[1],
        end_velocity=float(velocity[-1]),
        end_displacement=float(displacement[-1]),
        end_velocity_share=_end_share(velocity),
        end_displacement_share=_end_share(displacement),
        clipped_samples=clipped_samples(raw),
        constant_time=longest_constant(raw[strong], step),
        opening_share=opening_share(motion, step),
        closing_share=opening_share(motion[::-1], step),
        pre_event=quiet,
        noise_level=noise,
        stated_peak=abs(before.peak_ratio - 1.0),
        usable_period_shortest=shortest,
        usable_period_longest=longest,
    )


def _end_share(series: Float) -> float:
    largest = peak(series)
    return abs(float(series[-1])) / largest if largest > 0.0 else 0.0


def _judge(measures: Measures, record: Record, limits: PassportLimits) -> tuple[Check, ...]:
    site_known = record.site_type is not SiteType.UNKNOWN
    named = re.fullmatch(r"\d{3}", record.component, re.ASCII)
    derived = {
        "azimuth": float(record.component) if named else record.azimuth,
        "time_step": record.time_step,
        "not_free_field": float(record.site_type is not SiteType.FREE_FIELD)
        if site_known
        else math.nan,
        "signal_to_noise": measures.peak_acceleration / measures.noise_level,
    }
    return tuple(
        _check(name, derived[name] if name in derived else getattr(measures, name), limits)
        for name in CHECKS
    )


def _check(name: str, value: float, limits: PassportLimits) -> Check:
    unit, at_least = CHECKS[name]
    warn, reject = (getattr(limits, f"{name}_{kind}") for kind in ("warn", "reject"))
    limit, verdict = warn, CheckVerdict.OK
    if math.isnan(value):
        verdict = CheckVerdict.NOT_MEASURED
    elif (value < reject) if at_least else (value > reject):
        limit, verdict = reject, CheckVerdict.REJECT
    elif (value < warn) if at_least else (value > warn):
        verdict = CheckVerdict.WARN
    return Check(name, float(value), limit, verdict, unit, at_least)
