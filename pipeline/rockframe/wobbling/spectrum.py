"""Overturning spectra of round columns under two pulses in different directions."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rockframe.frame import RockingFrame
from rockframe.rocking.spectra.overturning import increasing
from rockframe.rocking.verdict import Verdict
from rockframe.wavelets.pulse import Pulse
from rockframe.wobbling.motion import PairAcceleration
from rockframe.wobbling.response import SHORTENING, constants, integrated, rolling

Float = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class WobblingSpectrum:
    """The outcomes of round columns under two pulses, over their period and amplitude.

    Parameters
    ----------
    frequency_ratio : array, shape (ratios,)
        omega_p / p of the first pulse, with p of the column alone [1].
    amplitude : array, shape (amplitudes,)
        a_p / (g tan slenderness) of the first pulse [1].
    verdict : array of int, shape (ratios, amplitudes)
        Values of `Verdict`.
    """

    frequency_ratio: Float
    amplitude: Float
    verdict: NDArray[np.int8]

    @property
    def minimum_overturning_amplitude(self) -> Float:
        """Least amplitude tried that overturns, shape (ratios,); NaN if none does.

        Larger amplitudes may stand: stability is not monotone in the amplitude.
        """
        fell = self.verdict == Verdict.OVERTURNS
        return np.where(fell.any(axis=1), self.amplitude[fell.argmax(axis=1)], math.nan)


def wobbling_spectrum(
    frame: RockingFrame,
    first: Pulse,
    second: Pulse,
    frequency_ratios: ArrayLike,
    amplitudes: ArrayLike,
    *,
    angle_degree: float = 90.0,
    contact_shortening: float = SHORTENING,
) -> WobblingSpectrum:
    """Compute which pairs of pulses overturn a frame with round columns.

    Parameters
    ----------
    frame : RockingFrame
        Frame or column of circular section, as for `wobble`.
    first, second : Pulse
        The pulses. Only their forms and proportions are used: the ratios of their amplitudes and
        periods, and the lag of the second one over the period of the first.
    frequency_ratios : array_like, shape (ratios,)
        omega_p / p of the first pulse, with p of the column alone [1].
    amplitudes : array_like, shape (amplitudes,)
        a_p / (g tan slenderness) of the first pulse [1].
    angle_degree : float
        Direction of the second pulse, from that of the first [degree].
    contact_shortening : float
        As for `wobble` [m].

    Returns
    -------
    WobblingSpectrum
        The verdict at each frequency ratio and amplitude.

    Raises
    ------
    ParameterError
        As `wobble`; if an array is empty, not increasing or not positive; if the angle is not
        finite.

    Notes
    -----
    Under a single pulse the motion stays in one plane, and its spectrum is that of
    `overturning_spectrum`, for columns of this inertia, as long as nothing acts across the plane. A
    real column leaves it after few impacts: a second pulse of a hundredth of the first one tells
    how much this changes.

    Examples
    --------
    >>> column = RockingFrame(height=7.5, width=1.8, section="circular")
    >>> along = Pulse(wavelet="symmetric_ricker", a_p=1.0, T_p=1.0)
    >>> across = Pulse(wavelet="symmetric_ricker", a_p=0.8, T_p=1.0, time=0.5)
    >>> found = wobbling_spectrum(column, along, across, [2.0, 4.0], np.linspace(1.0, 8.0, 29))
    >>> found.minimum_overturning_amplitude.tolist()
    [1.5, 3.25]
    """
    frame = rolling(frame)
    ratios, tried = (
        increasing(name, values)
        for name, values in (("frequency_ratio", frequency_ratios), ("amplitude", amplitudes))
    )
    uplift = frame.uplift_acceleration
    members = np.array(
        [
            constants(frame, contact_shortening=contact_shortening, scale=scale)
            for scale in (uplift / first.a_p * tried).tolist()
        ]
    )
    verdicts = np.empty((ratios.size, tried.size), dtype=np.int8)
    for row, ratio in zip(verdicts, ratios.tolist(), strict=True):
        stretch = math.tau / (ratio * frame.frequency_parameter * first.T_p)
        pulses = (
            replace(pulse, T_p=stretch * pulse.T_p, time=stretch * (pulse.time - first.time))
            for pulse in (first, second)
        )
        motion = PairAcceleration.from_pulses(*pulses, angle_degree=angle_degree)
        row[:], _ = integrated(motion, members)
    return WobblingSpectrum(ratios, tried, verdicts)
