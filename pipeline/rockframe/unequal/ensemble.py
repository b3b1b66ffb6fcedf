"""Responses of plausible bents of two unequal columns to a ground motion."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.options.respond import Ensemble
from rockframe.rocking.assessments import Bands, EnsembleResponse
from rockframe.rocking.margins.ensemble import quantiles
from rockframe.rocking.margins.members import (
    draws,
    rank_correlations,
    require_members,
    require_motion,
)
from rockframe.rocking.response import as_ground
from rockframe.rocking.verdict import Verdict
from rockframe.unequal.bent import UnequalBent, require_bent, sizes_of
from rockframe.unequal.kernels import kernel, steps
from rockframe.unequal.linkage import Linkage, Sizes, Tables, tables_of
from rockframe.unequal.response import Motion
from rockframe.unequal.scenarios import outcomes, rotations

Float = NDArray[np.float64]


def bent_ensemble(
    bent: UnequalBent, motion: Motion, ensemble: Ensemble | None = None
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
        widths, and one to the losses of both impacts. The corner and the orientation are not
        varied.

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
    family = member_tables(bent, chosen)
    every = np.arange(chosen.members)
    verdicts, summaries = outcomes(
        [ground], [family], np.zeros_like(every), every, draws(chosen)[:, 3]
    )
    courses = summaries[:, None, [kernel.PEAK_RIGHT, kernel.PEAK_LEFT]]
    sides = family.numbers.reshape(chosen.members, 2, -1)[:, :, steps.BARRIER]
    peaks, balances = (rotations(family, each)[:, 0] for each in (courses, sides[:, None]))
    overturned = verdicts == Verdict.OVERTURNS
    ratios = np.where(overturned, math.inf, (peaks / balances).max(axis=1))
    u, v = _largest_displacements(family, courses[:, 0], sides)
    bands = {
        "peak_rotation_ratio": ratios,
        "peak_u": np.where(overturned, math.inf, u),
        "peak_v": np.where(overturned, math.inf, v),
    }
    return EnsembleResponse(
        members=chosen.members,
        uplifted=int((verdicts != Verdict.NO_UPLIFT).sum()),
        overturned=int(overturned.sum()),
        model_ends=None,
        bands=Bands({name: tuple(quantiles(each).tolist()) for name, each in bands.items()}),
        rank_correlations=rank_correlations(ratios, chosen),
    )


def member_tables(bent: UnequalBent, ensemble: Ensemble) -> Tables:
    """Return the numbers of the members of an ensemble for the kernel.

    Raises
    ------
    ParameterError
        If a member cannot rock.
    """
    height, width, loss = draws(ensemble)[:, :3].T
    nominal = sizes_of([bent])
    sizes = Sizes(
        heights=height[:, None] * nominal.heights,
        widths=width[:, None] * nominal.widths,
        spacing=np.repeat(nominal.spacing, height.size),
        shares=np.repeat(nominal.shares, height.size, axis=0),
        mass_ratio=np.repeat(nominal.mass_ratio, height.size),
        beam_depth=np.repeat(nominal.beam_depth, height.size),
        beam_offset=np.repeat(nominal.beam_offset, height.size),
    )
    rigid = Linkage(sizes).kept_speeds()
    _require(bent, ensemble, rigid.min(axis=1) > 0.0, "loses all speed at an impact")
    # both impacts keep the same share of the energy; a loss counts as `loss` losses
    share = bent.restitution_factor * np.sqrt(rigid.prod(axis=1))
    tables = tables_of(sizes, rigid * (share**loss / np.sqrt(rigid.prod(axis=1)))[:, None])
    limits = tables.numbers.reshape(height.size, 2, -1)[:, :, steps.LIMIT]
    _require(bent, ensemble, limits.min(axis=1) > 0.0, "does not stand")
    _require(bent, ensemble, tables.crossings.min(axis=1) > 0, "locks before it overturns")
    return tables


def _require(bent: UnequalBent, ensemble: Ensemble, holds: NDArray[np.bool_], fault: str) -> None:
    if not holds.all():
        member = int(holds.argmin())
        raise ParameterError(
            f"Invalid spread height {ensemble.height:g} and width {ensemble.width:g} of the "
            f"ensemble of bent {bent.name!r}: member {member + 1} {fault}. State a smaller spread."
        )


def _largest_displacements(family: Tables, peaks: Float, balances: Float) -> tuple[Float, Float]:
    """Return the largest |u| and v of members from their largest courses on both sides [m]."""
    linkage = family.courses.linkage

    def displacements(courses: Float) -> tuple[Float, Float]:
        within = (courses / family.stretch)[..., None]
        return linkage.beam_displacement(linkage.pose(family.courses.rotations(within)))

    u, _ = displacements(peaks)
    _, v = displacements(np.minimum(peaks, balances))
    return u[..., 0].max(axis=1), v[..., 0].max(axis=1)
