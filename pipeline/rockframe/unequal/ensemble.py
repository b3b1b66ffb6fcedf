"""Responses of plausible bents of two unequal columns to a ground motion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.options.respond import Ensemble
from rockframe.rocking.assessments import Bands, EnsembleResponse
from rockframe.rocking.margins.ensemble import quantiles, shaken
from rockframe.rocking.margins.members import (
    Versions,
    draws,
    rank_correlations,
    require_members,
    require_motion,
)
from rockframe.rocking.response import as_ground
from rockframe.rocking.scenarios import scales_of
from rockframe.rocking.verdict import Verdict
from rockframe.unequal.bent import UnequalBent, require_bent
from rockframe.unequal.response import Motion
from rockframe.unequal.scenarios import outcomes_of, quantities_of

Float = NDArray[np.float64]


def bent_ensemble(
    bent: UnequalBent,
    motion: Motion,
    ensemble: Ensemble | None = None,
    versions: Versions | None = None,
) -> EnsembleResponse:
    """Compute the responses of an ensemble of bents to a ground motion.

    Parameters
    ----------
    bent : UnequalBent
        The nominal bent.
    motion : Record, Pulse or GroundAcceleration
        The ground motion.
    ensemble : Ensemble, optional
        Number of members, spreads and seed. The draws are those of frames with equal columns, and
        as there the mass ratio is not varied. One factor applies to both heights, one to both
        widths, and one to the losses of both impacts.
    versions : Versions, optional
        Versions of the motion, one of which shakes each member; by default the motion itself.

    Returns
    -------
    EnsembleResponse
        Numbers of members, bands of the largest |theta| over that of the unstable equilibrium, and
        of u and v; rank correlations. Bands of velocities and forces are NaN: not computed.

    Raises
    ------
    ParameterError
        If the ensemble has no members, a member cannot rock, or a vertical acceleration falls
        faster than gravity.

    Examples
    --------
    >>> from rockframe import Pulse
    >>> bent = UnequalBent(heights=(9.0, 7.0), widths=(1.4, 1.4), spacing=12.0, mass_ratio=3.6)
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=0.5 * 9.81, T_p=1.2)
    >>> response = bent_ensemble(bent, pulse)
    >>> response.overturned, [round(ratio, 2) for ratio in response.bands.peak_rotation_ratio]
    (0, [0.37, 0.38, 0.39])
    """
    chosen = ensemble or Ensemble()
    require_members(chosen)
    require_bent(bent)
    ground = as_ground(motion)
    require_motion(chosen, ground)
    peaks = member_peaks([bent], [ground], [1.0], chosen, [versions])
    right, left = peaks["peak"][0, 0, 0], peaks["speed"][0, 0, 0]
    family = bent_members(chosen, bent)
    overturned = peaks["verdict"][0, 0, 0] == Verdict.OVERTURNS
    bands = {
        name: np.where(overturned, math.inf, each[:, 0])
        for name, each in quantities_of(family, right[:, None], left[:, None]).items()
    }
    return EnsembleResponse(
        members=chosen.members,
        uplifted=int((peaks["verdict"] != Verdict.NO_UPLIFT).sum()),
        overturned=int(overturned.sum()),
        model_ends=None,
        bands=Bands({name: tuple(quantiles(each).tolist()) for name, each in bands.items()}),
        rank_correlations=rank_correlations(bands["peak_rotation_ratio"], chosen, versions),
    )


@lru_cache(maxsize=256)
def bent_members(ensemble: Ensemble, bent: UnequalBent) -> tuple[UnequalBent, ...]:
    """Return the structure of each member of an ensemble.

    Raises
    ------
    ParameterError
        If a member cannot rock.

    Examples
    --------
    >>> bent = UnequalBent(heights=(9.0, 7.0), widths=(1.4, 1.4), spacing=12.0, mass_ratio=3.6)
    >>> heights = [member.heights[0] for member in bent_members(Ensemble(), bent)]
    >>> 8.91 < min(heights) < 8.92 < 9.08 < max(heights) < 9.09
    True
    """
    members = []
    for number, (height, width, loss) in enumerate(draws(ensemble)[:, :3].tolist(), 1):
        try:
            resized = bent.resized(height, width)
            # both impacts keep the same share of the energy; a loss counts as `loss` losses
            kept = math.sqrt(math.prod(resized.restitutions))
            factor = resized.restitution_factor * kept ** (loss - 1.0)
            members.append(replace(resized, restitution_factor=factor))
        except ParameterError as error:
            raise ParameterError(
                f"Invalid spread height {ensemble.height:g}, width {ensemble.width:g} or "
                f"impact_loss {ensemble.impact_loss:g} of the ensemble of bent {bent.name!r}: "
                f"member {number} cannot rock. {error} State a smaller spread."
            ) from None
    return tuple(members)


def member_peaks(
    bents: Sequence[UnequalBent],
    motions: Sequence[Motion],
    scales: Sequence[float],
    ensemble: Ensemble,
    versions: Sequence[Versions | None],
) -> dict[str, NDArray[Any]]:
    """Return the outcomes of the members of each bent.

    Returns
    -------
    dict of str to array, shape (motions, bents, scales, members)
        ``verdict``; ``peak`` and ``speed``: the largest |theta| to the right and to the left [rad].
    """
    factors, count = scales_of(scales), ensemble.members
    family = [member for bent in bents for member in bent_members(ensemble, bent)]
    grounds, of_member = shaken(motions, ensemble, versions)
    shape = (len(motions), len(bents), factors.size, count)
    motion, bent, scale, member = (axis.ravel() for axis in np.indices(shape))
    found = outcomes_of(
        grounds,
        family,
        of_member[motion, member],
        bent * count + member,
        factors[scale] * draws(ensemble)[member, 3],
    )
    return {name: values.reshape(shape) for name, values in found.items()}


@dataclass(frozen=True, eq=False)
class HeightRatios:
    """Responses of ensembles of bents with the same mean height and other ratios of the heights.

    Parameters
    ----------
    ratios : array, shape (ratios,)
        Height of the lower column over that of the higher one [1].
    scales : array, shape (scales,)
        Multiples of the motions [1].
    share_overturned : array, shape (ratios, scales)
        Share of all members under all motions that overturn [1].
    peak_rotation_ratio, peak_level_difference : array, shape (motions, ratios)
        Medians over the members under the motion itself: largest |theta| over that of the balance
        [1], infinite if more than half overturn; and difference of level over the span [m].
    """

    ratios: Float
    scales: Float
    share_overturned: Float
    peak_rotation_ratio: Float
    peak_level_difference: Float


def over_height_ratios(
    bent: UnequalBent,
    motions: Sequence[Motion],
    ratios: Sequence[float],
    scales: Sequence[float],
    ensemble: Ensemble,
) -> HeightRatios:
    """Return responses of bents with the mean height of a bent over the ratio of the heights.

    Parameters
    ----------
    bent : UnequalBent
        The bent.
    motions : sequence of Record, Pulse or GroundAcceleration
        Ground motions.
    ratios, scales : sequence of float
        Ratios of the heights, and multiples of the motions [1]; the motion itself is always added.
    ensemble : Ensemble
        Number of members, spreads and seed.

    Examples
    --------
    >>> from rockframe import Pulse
    >>> bent = UnequalBent(heights=(9.0, 7.0), widths=(1.4, 1.4), spacing=12.0, mass_ratio=3.6)
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=0.5 * 9.81, T_p=1.2)
    >>> found = over_height_ratios(bent, [pulse], [0.6, 1.0], [2.0], Ensemble(members=16))
    >>> found.peak_level_difference.round(3).tolist()
    [[0.034, 0.0]]
    """
    bents = [bent.with_height_ratio(ratio) for ratio in ratios]
    factors = [1.0, *scales]
    peaks = member_peaks(bents, motions, factors, ensemble, [None] * len(motions))
    fallen = peaks["verdict"] == Verdict.OVERTURNS
    shape = (len(motions), len(bents))
    medians = {name: np.empty(shape) for name in ("peak_rotation_ratio", "peak_level_difference")}
    for i, k in np.ndindex(*shape):
        family = bent_members(ensemble, bents[k])
        sides = (peaks[name][i, k, 0][:, None] for name in ("peak", "speed"))
        quantities = quantities_of(family, *sides)
        for name, values in medians.items():
            known = np.where(fallen[i, k, 0], math.inf, quantities[name][:, 0])
            values[i, k] = np.median(known)
    return HeightRatios(
        ratios=np.array(ratios),
        scales=np.array(scales),
        share_overturned=fallen[:, :, 1:].mean(axis=(0, 3)),
        **medians,
    )
