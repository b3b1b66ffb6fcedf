"""Responses of plausible structures with round columns to both directions of a ground motion."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Final
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from rockframe.frame import RockingFrame
from rockframe.options.respond import Ensemble
from rockframe.rocking.assessments import Bands, EnsembleResponse
from rockframe.rocking.margins.ensemble import quantiles
from rockframe.rocking.margins.members import (
    draws,
    hypercube,
    members,
    powers_within,
    rank_correlations,
    ranks,
    require_members,
)
from rockframe.rocking.verdict import Verdict
from rockframe.wobbling import kernel
from rockframe.wobbling.motion import PairAcceleration, PairMotion, as_pair
from rockframe.wobbling.response import (
    SHORTENING,
    constants,
    integrated,
    require_no_flight,
    rolling,
)

Float = NDArray[np.float64]

#: Steps of members over those of `wobble` [1]. They keep energy to 1e-10 in place of 1e-12, in two
#: thirds of the time.
_LENGTH: Final = 2.0


def wobbling_ensemble(
    frame: RockingFrame,
    motion: PairMotion,
    ensemble: Ensemble | None = None,
) -> EnsembleResponse:
    """Compute the responses of an ensemble of round columns to both directions of a motion.

    Parameters
    ----------
    frame : RockingFrame
        The frame as stated, as for `wobble`.
    motion : PairAcceleration, HorizontalPair or BothDirections
        The ground motion.
    ensemble : Ensemble, optional
        Number of members, spreads and seed; the draws of height, width, loss of an impact and
        amplitude are those of the planar ensemble. The corner is not varied, and the orientation
        need not be: turning both components changes no peak.

    Returns
    -------
    EnsembleResponse
        Numbers of members, bands of theta/alpha, u (the largest length of the vector) and v, and
        rank correlations. Bands of velocities and forces at the joints are NaN: not computed.

    Raises
    ------
    ParameterError
        As `wobble`; if the ensemble has no members, or a member cannot rock.

    Examples
    --------
    >>> from rockframe import PairAcceleration, Pulse, inertia_ratio_of
    >>> inertia = inertia_ratio_of("circular", 7.5, 1.8)
    >>> column = RockingFrame(height=7.5, width=1.8, inertia_ratio=inertia)
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=3.2, T_p=1.5)
    >>> across = Pulse(wavelet="symmetric_ricker", a_p=2.5, T_p=1.5, time=0.4)
    >>> found = wobbling_ensemble(column, PairAcceleration.from_pulses(pulse, across))
    >>> found.overturned, [round(ratio, 2) for ratio in found.bands.peak_rotation_ratio]
    (0, [0.28, 0.29, 0.29])
    """
    chosen = ensemble or Ensemble()
    require_members(chosen)
    family = family_of(frame, chosen)
    ground = as_pair(motion)
    scales = draws(chosen)[:, 3]
    require_no_flight(ground, float(scales.max()))
    verdicts, summaries = family.under(ground, scales)
    peaks = np.where(verdicts == Verdict.OVERTURNS, math.inf, summaries[:, kernel.PEAK])
    ratios = peaks / family.slenderness
    correlations = rank_correlations(ratios, chosen)
    correlations["contact_shortening"] = _rank_correlation(ratios, shortenings(chosen))
    return EnsembleResponse(
        members=chosen.members,
        uplifted=int((verdicts != Verdict.NO_UPLIFT).sum()),
        overturned=int((verdicts == Verdict.OVERTURNS).sum()),
        model_ends=None,
        bands=_bands(family.frames, peaks, ratios),
        rank_correlations=correlations,
    )


@dataclass(frozen=True, eq=False)
class Family:
    """The members of an ensemble of round columns, in the form of the kernel.

    Parameters
    ----------
    frames : tuple of RockingFrame
        The members.
    slots : array, shape (members, kernel.MEMBER_SIZE)
        Their constants, see the kernel.
    """

    frames: tuple[RockingFrame, ...]
    slots: Float
    _answers: WeakKeyDictionary[PairAcceleration, tuple[NDArray[np.int8], Float]] = field(
        default_factory=WeakKeyDictionary
    )

    def at(self, member: NDArray[np.int64], scale: Float) -> Float:
        """Return the constants of members at scales of the motion [1]."""
        rows: Float = self.slots[member]
        rows[:, kernel.SCALE] = scale
        return rows

    def under(self, ground: PairAcceleration, amplitude: Float) -> tuple[NDArray[np.int8], Float]:
        """Return verdicts and summaries of all members under a motion, each at its amplitude [1].

        They are kept as long as the motion: the ensemble and the margins need them.
        """
        answers = self._answers.get(ground)
        if answers is None:
            everyone = np.arange(len(self.frames))
            answers = self._answers[ground] = integrated(ground, self.at(everyone, amplitude))
        return answers

    @cached_property
    def slenderness(self) -> Float:
        """Slenderness of the members [rad]."""
        return np.array([frame.slenderness for frame in self.frames])


@lru_cache(maxsize=16)
def family_of(frame: RockingFrame, ensemble: Ensemble) -> Family:
    """Return the members of an ensemble; parameters and errors are those of `wobbling_ensemble`."""
    frames = members(ensemble, rolling(frame))
    drawn = shortenings(ensemble).tolist()
    rows = [
        constants(member, contact_shortening=softness, length=_LENGTH)
        for member, softness in zip(frames, drawn, strict=True)
    ]
    return Family(frames, np.array(rows))


@lru_cache(maxsize=16)
def shortenings(ensemble: Ensemble) -> Float:
    """Return the shortening of the contact of each member [m].

    They are stratified, and the same for all motions and structures.

    Examples
    --------
    >>> drawn = shortenings(Ensemble())
    >>> round(float(np.sqrt(drawn.min() * drawn.max())), 5)
    0.0001
    """
    rng = np.random.default_rng([ensemble.seed, 3])  # not the draws of the structures
    drawn = hypercube(rng, ensemble.members, 1)[:, 0]
    shortened: Float = SHORTENING * powers_within(ensemble.contact_shortening, drawn)
    shortened.flags.writeable = False  # the cache returns this array again
    return shortened


def _bands(family: tuple[RockingFrame, ...], peaks: Float, ratios: Float) -> Bands:
    """Return the bands of peaks [rad] of members; those of members that overturn are infinite."""
    standing = np.isfinite(peaks)
    u, v = np.full((2, peaks.size), math.inf)
    for k in np.flatnonzero(standing).tolist():
        beam = family[k].beam
        u[k] = beam.shift(peaks[k])
        v[k] = beam.lift(min(peaks[k], beam.angle))
    peaks_of = {"peak_rotation_ratio": ratios, "peak_u": u, "peak_v": v}
    return Bands({name: tuple(quantiles(each).tolist()) for name, each in peaks_of.items()})


def _rank_correlation(first: Float, other: Float) -> float:
    """Return Spearman's rank correlation; NaN if all values of one are equal."""
    if np.ptp(ranks(first)) == 0.0 or np.ptp(ranks(other)) == 0.0:
        return math.nan
    return float(np.corrcoef(ranks(first), ranks(other))[0, 1])
