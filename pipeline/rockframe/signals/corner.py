"""Lower corner of the band-pass of an uncorrected record, chosen from the record itself."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

import numpy as np

from rockframe.signals.noise import (
    QUARTERS,
    STEADY,
    arrival,
    is_straight,
    periodogram,
    quarter_levels,
)
from rockframe.signals.processing import (
    NYQUIST_SHARE,
    TAPER,
    BandPass,
    Float,
    correct,
    integrate,
    level,
    peak,
)

#: Corners that are tried [Hz]: preferred numbers, ten per decade, a third of an octave apart. The
#: last bits of a spectrum differ between processors; they do not change a choice among so few.
CORNERS: Final = (
    *(0.01, 0.0125, 0.016, 0.02, 0.025, 0.0315, 0.04, 0.05, 0.063, 0.08),
    *(0.1, 0.125, 0.16, 0.2, 0.25, 0.315, 0.4, 0.5, 0.63, 0.8),
    *(1.0, 1.25, 1.6, 2.0, 2.5, 3.15, 4.0, 5.0),
)
#: Factor from the middle to the edges of the octave over which amplitudes are averaged.
_HALF_OCTAVE: Final = 2.0**0.5
#: Least ratio of the amplitudes, where it is largest, at which what precedes the motion is noise.
#: In a record that starts late it is the P wave, which the motion exceeds by less than 10.
_NOISE: Final = 10.0
#: Largest displacement before the motion and in the last tenth of the record, as a share of its
#: peak.
_AT_REST: Final = 0.2


class CornerSource(IntEnum):
    """Source of the lower corner; the values of the flag variable `corner_source`."""

    NOT_CORRECTED = 0
    STATED = 1
    SIGNAL_TO_NOISE = 2
    DISPLACEMENT = 3
    DEFAULT = 4


#: Words of each source of a corner.
_WORDS: Final = {
    CornerSource.NOT_CORRECTED: "not corrected here",
    CornerSource.STATED: "as stated",
    CornerSource.SIGNAL_TO_NOISE: "chosen from the signal-to-noise ratio",
    CornerSource.DISPLACEMENT: "chosen so that the displacement begins and ends at rest",
    CornerSource.DEFAULT: "the default, because the noise before the event does not allow a choice",
}


@dataclass(frozen=True)
class Corner:
    """A lower corner of the band-pass.

    Parameters
    ----------
    frequency : float
        The corner [Hz]; NaN if this package did not correct the record.
    source : CornerSource
        Its source.

    Examples
    --------
    >>> print(Corner(0.05, CornerSource.SIGNAL_TO_NOISE))
    lower corner: 0.05 Hz, chosen from the signal-to-noise ratio
    """

    frequency: float
    source: CornerSource

    def __str__(self) -> str:
        return f"lower corner: {self.frequency:g} Hz, {_WORDS[self.source]}"


#: The corner of records that this package does not correct.
UNCHANGED: Final = Corner(math.nan, CornerSource.NOT_CORRECTED)


_NOTHING: Final = np.empty(0)
#: The corner of records that do not allow a choice.
DEFAULT: Final = Corner(BandPass().low, CornerSource.DEFAULT)


def choose_corner(acceleration: Float, time_step: float, ratio: float) -> Corner:
    """Choose the lower corner for an uncorrected record from its noise and its displacement.

    The record is judged without its least-squares line, which `correct` removes too. The corner is
    the lowest of `CORNERS` down to which the Fourier amplitudes of the record exceed those of the
    noise before the motion. Amplitudes are root-mean-square values over an octave. The noise is
    scaled to the duration of the record. Frequencies with less than one cycle before the motion are
    not judged, and never chosen. A baseline that shifts during the motion is not part of that
    noise. Therefore a corner below the default is raised, at most to the default, until the
    displacement before the motion and in the last tenth of the record is at most a fifth of its
    peak.

    Parameters
    ----------
    acceleration : array, shape (samples,)
        Acceleration as recorded.
    time_step : float
        Interval between samples [s].
    ratio : float
        Smallest ratio of the amplitudes [1].

    Returns
    -------
    Corner
        The source is ``SIGNAL_TO_NOISE``, or ``DISPLACEMENT`` for a raised corner. It is
        ``DEFAULT``, with the corner of `BandPass`, if nothing or padding (samples on one line)
        precedes the motion; if what precedes it is too short to judge the default; if it hides the
        default, but is no noise (its quarters differ by a factor of 3, or the motion nowhere
        exceeds it by a factor of 10); or if it exceeds the motion where that is strongest.

    References
    ----------
    Boore and Bommer (2005), Processing of strong-motion accelerograms, SDEE 25(2), 93-115: the
    signal-to-noise ratio, and the look at the displacement. Dawood, Rodriguez-Marek, Bayless,
    Goulet and Thompson (2016), A flatfile for the KiK-net database processed using an automated
    protocol, Earthquake Spectra 32(2), 1281-1302: the final displacement, at most a fifth of the
    peak.

    Examples
    --------
    >>> time = 0.01 * np.arange(8000)
    >>> hum = 1e-4 * np.random.default_rng(1).standard_normal(8000)
    >>> since = np.maximum(time - 30.0, 0.0)
    >>> motion = np.sin(2 * np.pi * since) * since * np.exp(-since / 4)
    >>> choose_corner(hum + motion, 0.01, 3.0)
    Corner(frequency=0.04, source=<CornerSource.SIGNAL_TO_NOISE: 2>)
    """
    largest = peak(acceleration)
    if largest == 0.0 or is_straight(acceleration / largest, 1.0):
        return DEFAULT
    motion = level(acceleration / largest)  # squares of extremely large samples would overflow
    motion /= peak(motion)
    onset = arrival(motion)
    quarters = np.array_split(motion[:onset], QUARTERS)
    padded = any(is_straight(part, 1.0) for part in quarters if part.size > 2)
    judged, ratios = ([], _NOTHING) if padded else _ratios(motion, time_step, onset)
    if not judged or ratios[-1] < ratio:
        return DEFAULT
    hidden = np.flatnonzero(ratios < ratio)
    lowest = judged[int(hidden[-1]) + 1 if hidden.size else 0]
    if lowest <= DEFAULT.frequency:
        return _at_rest(motion, time_step, onset, lowest)
    levels = quarter_levels(motion[:onset])
    noise = max(levels) <= STEADY * min(levels) and ratios.max() >= _NOISE
    return Corner(lowest, CornerSource.SIGNAL_TO_NOISE) if hidden.size and noise else DEFAULT


def _ratios(acceleration: Float, time_step: float, onset: int) -> tuple[list[float], Float]:
    """Return corners, and ratios of the amplitudes of the record and of its noise around them.

    They are those that can be judged, up to the one around which the record is strongest.
    """
    highest = 0.5 * min(BandPass().high, NYQUIST_SHARE * 0.5 / time_step)
    judged = [
        corner for corner in CORNERS if corner * onset * time_step >= 1.0 and corner <= highest
    ]
    if not judged:
        return [], _NOTHING
    noise = _powers(acceleration[:onset], time_step, judged)
    record = _powers(acceleration, time_step, judged)
    end = int(record.argmax()) + 1
    with np.errstate(divide="ignore"):
        return judged[:end], np.sqrt(record[:end] / noise[:end])


def _powers(window: Float, time_step: float, corners: list[float]) -> Float:
    """Return the mean power per hertz and second over the octave around each corner."""
    frequencies, power = periodogram(window, time_step, 2.0 * TAPER)
    octaves = ((corner / _HALF_OCTAVE, corner * _HALF_OCTAVE) for corner in corners)
    inside = [(frequencies >= low) & (frequencies <= high) for low, high in octaves]
    return np.array([power[octave].mean() for octave in inside])


def _at_rest(acceleration: Float, time_step: float, onset: int, lowest: float) -> Corner:
    """Return the lowest corner, up to the default, whose displacement begins and ends at rest."""
    for corner in (candidate for candidate in CORNERS if lowest <= candidate < DEFAULT.frequency):
        corrected, (velocity, place), _ = correct(acceleration, time_step, BandPass(corner))
        displacement = place + integrate(velocity + integrate(corrected, time_step), time_step)
        still = np.r_[displacement[:onset], displacement[-(displacement.size // 10) :]]
        if peak(still) <= _AT_REST * peak(displacement):
            break
    else:
        corner = DEFAULT.frequency
    source = CornerSource.DISPLACEMENT if corner > lowest else CornerSource.SIGNAL_TO_NOISE
    return Corner(corner, source)
