"""Margins of isolated decks and monolithic frames against collapse."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.options.respond import BridgeEnsemble
from rockframe.oscillators.ensemble import bridge_members
from rockframe.oscillators.response import Oscillator, OscillatorPeaks, respond_pairs
from rockframe.rivals import FixedFrame
from rockframe.rocking.assessments import FirstOverturning, Margin, RobustMargin
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.kernels.tails import DISTANCE, EXCURSION_SIZE
from rockframe.rocking.margins.first_overturning import LARGEST_SCALE, SliverSearch, answered
from rockframe.rocking.margins.members import draws
from rockframe.rocking.margins.robust import FamilySearch, resampled
from rockframe.rocking.response import Motion, as_ground

Float = NDArray[np.float64]

#: The search begins at this share of the scale at which the model first yields [1].
_BEFORE: Final = 0.9


def can_collapse(model: Oscillator) -> bool:
    """Return True if P-delta exceeds the stiffness after yielding, so that the model may collapse.

    Examples
    --------
    >>> frame = FixedFrame(period=0.5, strength_ratio=0.2, stability_coefficient=0.05)
    >>> can_collapse(frame), can_collapse(FixedFrame(period=0.5, stability_coefficient=0.05))
    (True, False)
    """
    return isinstance(model, FixedFrame) and model.constants[0] < 0.0


def oscillator_margin(
    model: Oscillator, motion: Motion, ensemble: BridgeEnsemble | None = None
) -> Margin:
    """Search for the first collapse of a bridge over the scale of a motion.

    The search is that of `rockframe.margins` without its refinement for thin intervals: scales from
    0.64 % apart, and bisection. A bridge that cannot collapse has no critical scale.

    Parameters
    ----------
    model : IsolatedDeck or FixedFrame
        The bridge.
    motion : Record, Pulse or GroundAcceleration
        Ground acceleration; a vertical component is ignored.
    ensemble : BridgeEnsemble, optional
        Compute the robust margins of this ensemble too.

    Examples
    --------
    >>> from rockframe import Pulse
    >>> frame = FixedFrame(period=0.5, strength_ratio=0.2, stability_coefficient=0.05)
    >>> margin = oscillator_margin(frame, Pulse(wavelet="symmetric_ricker", a_p=4.0, T_p=1.5))
    >>> 0.5 < margin.critical_scale < 1.0
    True
    """
    ground = as_ground(motion)
    first = _first_collapse(model, ground)
    robust = None if ensemble is None else _robust(model, ground, ensemble)
    return Margin(first=first, largest_scale=LARGEST_SCALE, robust=robust)


def _first_collapse(model: Oscillator, ground: GroundAcceleration) -> FirstOverturning:
    least = _least_scale([model], ground)
    search = SliverSearch(least, LARGEST_SCALE, 1.0).search()

    def answer(scales: Float) -> tuple[NDArray[np.bool_], Float, Float]:
        peaks = respond_pairs([model], ground, np.zeros(scales.size, dtype=np.intp), scales)
        excursions = np.zeros((scales.size, 1, EXCURSION_SIZE))
        excursions[..., DISTANCE] = -np.inf
        return *_outcomes(peaks), excursions

    first: FirstOverturning = answered(search, answer)
    return first


def _robust(
    model: Oscillator, ground: GroundAcceleration, ensemble: BridgeEnsemble
) -> RobustMargin:
    """Return the scales at which shares of the ensemble collapse."""
    family = bridge_members(ensemble, model)
    amplitude = draws(ensemble)[:, 3]
    largest = LARGEST_SCALE
    search = FamilySearch(amplitude, _least_scale(family, ground), largest, ensemble.seed).search()

    def answer(request: tuple[NDArray[np.int64], Float]) -> tuple[NDArray[np.bool_], Float]:
        return _outcomes(respond_pairs(family, ground, *request))

    margin: RobustMargin = answered(search, answer)
    if not any(map(can_collapse, family)):
        return margin
    every = np.arange(len(family))
    falls, finer = (
        _outcomes(respond_pairs(family, sampled, every, amplitude))[0]
        for sampled in (ground, resampled(ground))
    )
    return replace(margin, sampling_changes=int((falls != finer).sum()))


def _outcomes(peaks: OscillatorPeaks) -> tuple[NDArray[np.bool_], Float]:
    """Return which oscillators collapse, and their ductility, large from where they yield."""
    return np.isinf(peaks.peak_displacement), np.nan_to_num(peaks.ductility, posinf=np.inf)


def _least_scale(family: Sequence[Oscillator], ground: GroundAcceleration) -> float:
    """Return a scale below which no member yields; infinite if none can collapse.

    Up to yielding, the displacement grows with the scale.
    """
    some = [member for member in family if can_collapse(member)]
    if not some:
        return math.inf
    elastic = [
        replace(member, strength_ratio=math.inf)
        for member in some
        if isinstance(member, FixedFrame)
    ]
    every = np.arange(len(some))
    peaks = respond_pairs(elastic, ground, every, np.ones(len(some))).peak_displacement
    yields = np.array([member.yield_displacement for member in some])
    with np.errstate(divide="ignore"):
        return float(_BEFORE * (yields / peaks).min())
