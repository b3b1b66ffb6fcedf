"""What follows from the verdicts of a screening: ranks, distributions, fragility, rates, design."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from rockframe.frame import RockingFrame
from rockframe.results import (
    Facts,
    azimuth_variables,
    demand_variables,
    design_variables,
    fragility_variables,
    hazard_variables,
    margin_variables,
    motion_variables,
    observed_variables,
    scale_axis,
    structure_names,
    structure_variables,
)
from rockframe.risk import (
    MEASURES,
    Fragility,
    HazardCurve,
    better_measure,
    compared_motions,
    demand_ranks,
    fit_fragility,
    observed_shares,
    over_azimuths,
    overturning_rate,
    peak_distribution,
)
from rockframe.rocking import Design, smallest
from rockframe.stages.screen_motions import Motion

Float = NDArray[np.float64]

#: Levels of |theta| / slenderness at which distributions of peaks are given.
LEVELS: Final = np.linspace(0.0, 1.5, 151)
#: Intensities at which fragility curves are given.
_POINTS: Final = 101
#: Classes of intensity whose observed shares are given.
_CLASSES: Final = 8
#: How far beyond those that were tried.
_BEYOND: Final = 1.25


@dataclass(frozen=True, eq=False)
class Screened:
    """What the kernel said of all scenarios.

    Parameters
    ----------
    motions : sequence of Motion
        The motions.
    facts : Facts
        What is known of the records.
    frames : sequence of RockingFrame
        The structures.
    scales : array, shape (scales,)
        Multiples of the motions [1].
    overturned : array of bool, shape (motions, structures, scales)
        Which scenarios overturn.
    counts : array of int, shape (structures, scales, 3)
        How many motions do not uplift, are safe, overturn.
    ratio : array, shape (motions, structures)
        Largest |theta| / alpha at the scale nearest to 1; infinite for what overturns.
    margins : mapping of str to array, shape (motions, structures)
        As `margins_of` gives them, if they were asked for.
    hazard : HazardCurve, optional
        Of the site.
    design : Design, optional
        What is looked for.
    candidate_ratio : array, shape (motions, structures times steps), optional
        As `ratio`, of the candidates of the design.
    seed : int
        Of the draws.
    """

    motions: Sequence[Motion]
    facts: Facts
    frames: Sequence[RockingFrame]
    scales: Float
    overturned: NDArray[np.bool_]
    counts: NDArray[np.int64]
    ratio: Float
    margins: Mapping[str, NDArray[Any]]
    hazard: HazardCurve | None
    design: Design | None
    candidate_ratio: Float | None
    seed: int


def statistics(screened: Screened) -> xr.Dataset:
    """Return all variables of screen.nc but those of each scenario."""
    motions = screened.motions
    numbers = {
        name: np.array([motion.numbers[name] for motion in motions]) for name in motions[0].numbers
    }
    clusters = np.array([motion.cluster for motion in motions])
    intensities = {name: numbers[name] for name in MEASURES}
    fits = [
        _fits(intensities, screened.scales, screened.overturned[:, k], clusters)
        for k in range(len(screened.frames))
    ]
    reference = float(screened.scales[np.argmin(np.abs(np.log(screened.scales)))])
    bands = [
        peak_distribution(column, LEVELS, clusters=clusters, seed=screened.seed)
        for column in screened.ratio.T
    ]
    ranks = demand_ranks(screened.ratio)
    variables = {
        **motion_variables([m.name for m in motions], _sources(screened), clusters, numbers),
        **structure_variables(screened.frames),
        **demand_variables(reference, ranks, LEVELS, bands, screened.counts),
        **fragility_variables(
            fits, _better(screened, intensities, clusters), _grid(intensities, screened.scales)
        ),
        **observed_variables(_observed(screened, intensities)),
    }
    variables |= _asked_besides(screened, fits, clusters)
    axes = ("measure", "outcome", "level")
    return xr.Dataset(
        {name: values for name, values in variables.items() if name not in axes},
        coords={
            "structure": structure_names(screened.frames),
            "scale": scale_axis(screened.scales),
            **{name: variables[name] for name in axes},
        },
        attrs={"title": "Screening of free-standing frames by records"},
    )


def _asked_besides(
    screened: Screened, fits: Sequence[Mapping[str, Fragility]], clusters: NDArray[np.int64]
) -> dict[str, xr.Variable]:
    """What there is only if it was asked for: azimuths, margins, rates, a design."""
    variables: dict[str, xr.Variable] = {}
    motions = screened.motions
    if len(motions[0].records) > 1:  # a pair, turned
        first = [motions[int(i)].name for i in np.unique(clusters, return_index=True)[1]]
        variables |= azimuth_variables(first, over_azimuths(screened.ratio, clusters))
    if screened.margins:
        variables |= margin_variables(screened.margins)
    if screened.hazard is not None:
        curve = screened.hazard
        rates = [overturning_rate(curve, fit[curve.measure]) for fit in fits]
        variables |= hazard_variables(curve, rates)
    if screened.design is not None and screened.candidate_ratio is not None:
        variables |= _designed(screened.design, screened.candidate_ratio, len(screened.frames))
    return variables


def _fits(
    intensities: Mapping[str, Float],
    scales: Float,
    overturned: NDArray[np.bool_],
    clusters: NDArray[np.int64],
) -> dict[str, Fragility]:
    return {
        name: fit_fragility(values, scales, overturned, clusters)
        for name, values in intensities.items()
    }


def _better(
    screened: Screened, intensities: Mapping[str, Float], clusters: NDArray[np.int64]
) -> list[tuple[str, str]]:
    """The better measure for each structure, of the motions that have them all."""
    both = compared_motions(intensities)
    told = []
    for k in range(len(screened.frames)):
        some = {name: values[both] for name, values in intensities.items()}
        fits = _fits(some, screened.scales, screened.overturned[both, k], clusters[both])
        preference = better_measure(fits)
        told.append((preference.measure, preference.reason))
    return told


def _observed(
    screened: Screened, intensities: Mapping[str, Float]
) -> list[dict[str, tuple[Float, Float]]]:
    return [
        {
            name: observed_shares(values, screened.scales, screened.overturned[:, k], _CLASSES)
            for name, values in intensities.items()
        }
        for k in range(len(screened.frames))
    ]


def _grid(intensities: Mapping[str, Float], scales: Float) -> dict[str, Float]:
    """Intensities from a little below to a little above what was tried; NaN if none is known."""
    grid = {}
    for name, values in intensities.items():
        known = values[np.isfinite(values) & (values > 0.0)]
        if not known.size:
            grid[name] = np.full(_POINTS, np.nan)
            continue
        least, most = known.min() * scales[0], known.max() * scales[-1]
        grid[name] = np.geomspace(least / _BEYOND, most * _BEYOND, _POINTS)
    return grid


def _sources(screened: Screened) -> list[tuple[str, str]]:
    texts = screened.facts.texts
    return [(texts["event"][m.row], texts["station"][m.row]) for m in screened.motions]


def _designed(design: Design, ratio: Float, structures: int) -> dict[str, xr.Variable]:
    below = (ratio < design.limit).mean(axis=0)
    shares = below.reshape(structures, design.steps)
    found = [smallest(design.values, row, design.share) for row in shares]
    return design_variables(design, shares, found)
