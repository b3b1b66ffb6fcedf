"""Margins of bents of two unequal columns against overturning."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rockframe.options.respond import Ensemble
from rockframe.rocking.assessments import FirstOverturning, Margin, RobustMargin
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.kernels.tails import DISTANCE, EXCURSION_SIZE
from rockframe.rocking.margins.first_overturning import (
    LARGEST_SCALE,
    SliverSearch,
    answered,
    largest_scale_of,
)
from rockframe.rocking.margins.members import draws
from rockframe.rocking.margins.robust import FamilySearch, resampled
from rockframe.rocking.response import as_ground, refuse_flight
from rockframe.rocking.verdict import Verdict
from rockframe.unequal.bent import UnequalBent, require_bent
from rockframe.unequal.ensemble import bent_members
from rockframe.unequal.response import Motion
from rockframe.unequal.scenarios import outcomes_of
from rockframe.units import GRAVITY

Float = NDArray[np.float64]


def bent_margin(bent: UnequalBent, motion: Motion, ensemble: Ensemble | None = None) -> Margin:
    """Search for the first overturning of a bent over the scale of a motion.

    The search is that of `rockframe.margins` without its refinement for thin intervals: scales from
    0.64 % apart, and bisection.

    Parameters
    ----------
    bent : UnequalBent
        The bent.
    motion : Record, Pulse or GroundAcceleration
        Ground acceleration, as for `respond_bent`.
    ensemble : Ensemble, optional
        Compute the robust margins of this ensemble too.

    Returns
    -------
    Margin
        The margin, with the robust one if it was requested.

    Raises
    ------
    ParameterError
        If a vertical acceleration falls faster than gravity, or a member cannot rock.

    Examples
    --------
    >>> from rockframe import Pulse
    >>> bent = UnequalBent(heights=(9.0, 7.0), widths=(1.4, 1.4), spacing=12.0, mass_ratio=3.6)
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=0.5 * 9.81, T_p=1.2)
    >>> round(bent_margin(bent, pulse).critical_scale, 3)
    1.34
    """
    require_bent(bent)
    ground = as_ground(motion)
    refuse_flight(ground)
    largest = largest_scale_of(ground, LARGEST_SCALE)
    first = _first_overturning(bent, ground, largest)
    robust = None if ensemble is None else _robust(bent, ground, ensemble, largest)
    return Margin(first=first, largest_scale=largest, robust=robust)


def _first_overturning(
    bent: UnequalBent, ground: GroundAcceleration, largest: float
) -> FirstOverturning:
    search = SliverSearch(_least_scale([bent], ground), largest, 1.0).search()

    def answer(scales: Float) -> tuple[NDArray[np.bool_], Float, Float]:
        excursions = np.zeros((scales.size, 1, EXCURSION_SIZE))
        excursions[..., DISTANCE] = -np.inf
        return *_outcomes([bent], ground, np.zeros(scales.size, dtype=np.intp), scales), excursions

    first: FirstOverturning = answered(search, answer)
    return first


def _robust(
    bent: UnequalBent, ground: GroundAcceleration, ensemble: Ensemble, largest: float
) -> RobustMargin:
    """Return the scales at which shares of the ensemble overturn."""
    family = bent_members(ensemble, bent)
    amplitude = draws(ensemble)[:, 3]
    search = FamilySearch(amplitude, _least_scale(family, ground), largest, ensemble.seed).search()

    def answer(request: tuple[NDArray[np.int64], Float]) -> tuple[NDArray[np.bool_], Float]:
        return _outcomes(family, ground, *request)

    margin: RobustMargin = answered(search, answer)
    every = np.arange(len(family))
    falls, finer = (
        _outcomes(family, sampled, every, amplitude)[0] for sampled in (ground, resampled(ground))
    )
    return replace(margin, sampling_changes=int((falls != finer).sum()))


def _outcomes(
    family: Sequence[UnequalBent],
    ground: GroundAcceleration,
    member: NDArray[np.int64],
    scale: Float,
) -> tuple[NDArray[np.bool_], Float]:
    """Return which scenarios overturn, and their largest |theta| over that of the balance."""
    results = outcomes_of([ground], family, np.zeros_like(member), member, scale)
    balances = np.array([bent.balance_rotations for bent in family])[member]
    ratios = np.maximum(results["peak"] / balances[:, 0], results["speed"] / balances[:, 1])
    return results["verdict"] == Verdict.OVERTURNS, ratios


def _least_scale(family: Sequence[UnequalBent], ground: GroundAcceleration) -> float:
    """Return a scale below which no member uplifts; infinite if the ground is still."""
    powers = ground.time_step ** np.arange(ground.coefficients.shape[1])
    strongest = float((np.abs(ground.coefficients) * powers).sum(axis=1).max()) / GRAVITY
    upwards = max(abs(bound) for bound in ground.upward_bounds()) / GRAVITY
    limit = min(min(bent.uplift_accelerations) for bent in family)
    pull = strongest + limit * upwards
    return limit / pull if pull > 0.0 else math.inf
