"""Statistics of a screening: ranks, distributions, fragility, rates, design."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rockframe.frame import RockingFrame
from rockframe.results.record_metadata import RecordMetadata
from rockframe.results.schema import SCREEN_NC
from rockframe.results.screening.screen import limited_in
from rockframe.results.screening.variables import (
    azimuth_values,
    demand_values,
    design_units,
    design_values,
    fragility_values,
    hazard_values,
    motion_values,
    observed_values,
)
from rockframe.risk import (
    MEASURES,
    Fragility,
    HazardCurve,
    LimitState,
    Outcome,
    better_measure,
    compared_motions,
    demand_ranks,
    fit_fragility,
    observed_shares,
    over_azimuths,
    overturning_rate,
    peak_distribution,
    period_of,
)
from rockframe.rocking import Design, smallest
from rockframe.stages.screening.motions import Motion

Float = NDArray[np.float64]

#: Levels of |theta| / slenderness of the peak distributions.
LEVELS: Final = np.linspace(0.0, 1.5, 151)
#: Number of intensities of the fragility curves.
_POINTS: Final = 101
#: Number of intensity classes of the observed shares.
_CLASSES: Final = 8
_NO_CLASSES: Final = np.full(_CLASSES, np.nan)
#: Factor by which the curves extend beyond the intensities tried.
_BEYOND: Final = 1.25


@dataclass(frozen=True, eq=False)
class Screened:
    """Results of all scenarios.

    Parameters
    ----------
    motions : sequence of Motion
        The motions.
    metadata : RecordMetadata
        Metadata of the records.
    frames : sequence of RockingFrame
        The structures.
    scales : array, shape (scales,)
        Multiples of the motions [1].
    limits : sequence of LimitState
        The limit states; the first is overturning.
    reached : array of bool, shape (limits, motions, structures, scales)
        True for scenarios that reach the limit state.
    counts : array of int, shape (structures, scales, 3)
        Numbers of motions that do not uplift, are safe, and overturn.
    ratio : array, shape (motions, structures)
        Largest |theta| / alpha at the scale nearest to 1; infinite if overturned.
    margins : mapping of str to array, shape (motions, structures)
        Result of `margins_of`, if requested.
    hazard : HazardCurve, optional
        Hazard curve of the site.
    design : Design, optional
        The design problem.
    candidates_reach : array of bool, shape (motions, structures times steps), optional
        True for candidates of the design that reach its limit.
    seed : int
        Random seed of the bootstrap.
    """

    motions: Sequence[Motion]
    metadata: RecordMetadata
    frames: Sequence[RockingFrame]
    scales: Float
    limits: Sequence[LimitState]
    reached: NDArray[np.bool_]
    counts: NDArray[np.int64]
    ratio: Float
    margins: Mapping[str, NDArray[Any]]
    hazard: HazardCurve | None
    design: Design | None
    candidates_reach: NDArray[np.bool_] | None
    seed: int


def statistics(screened: Screened) -> tuple[dict[str, Any], dict[str, str]]:
    """Return the values of screen.nc except those of single scenarios, and the units that vary."""
    motions = screened.motions
    numbers = {
        name: np.array([motion.numbers[name] for motion in motions]) for name in motions[0].numbers
    }
    clusters = np.array([motion.cluster for motion in motions])
    spectra = [name for name in numbers if period_of(name)]
    intensities = {name: numbers[name] for name in (*MEASURES, *spectra)}
    fits = [
        [_fits(intensities, screened.scales, fell, clusters) for fell in each]
        for each in _by_structure(screened)
    ]
    reference = float(screened.scales[np.argmin(np.abs(np.log(screened.scales)))])
    bands = [
        peak_distribution(column, LEVELS, clusters=clusters, seed=screened.seed)
        for column in screened.ratio.T
    ]
    ranks = demand_ranks(screened.ratio)
    values = {
        **motion_values([m.name for m in motions], _sources(screened), clusters, numbers),
        "limit_state": [limit.name for limit in screened.limits],
        **SCREEN_NC.filled("frame", list(screened.frames)),
        **demand_values(reference, ranks, LEVELS, bands, screened.counts),
        **fragility_values(
            fits, _better(screened, intensities, clusters), _grid(intensities, screened.scales)
        ),
        **observed_values(_observed(screened, intensities)),
        **_optional_values(screened, fits, clusters),
        "structure": [frame.name for frame in screened.frames],
        "scale": screened.scales,
    }
    return values, design_units(screened.design) if screened.design else {}


def _by_structure(screened: Screened) -> list[list[NDArray[np.bool_] | None]]:
    """Return masks (motions, scales) for each structure and limit; None if a limit does not
    apply.
    """
    return [
        [
            reached[:, k] if limited_in(frame, limit.quantity) else None
            for limit, reached in zip(screened.limits, screened.reached, strict=True)
        ]
        for k, frame in enumerate(screened.frames)
    ]


def _optional_values(
    screened: Screened,
    fits: Sequence[Sequence[Mapping[str, Fragility]]],
    clusters: NDArray[np.int64],
) -> dict[str, Any]:
    """Return the optional values: azimuths, margins, rates, design."""
    values: dict[str, Any] = {}
    motions = screened.motions
    if len(motions[0].records) > 1:  # a rotated pair
        first = [motions[int(i)].name for i in np.unique(clusters, return_index=True)[1]]
        values |= azimuth_values(first, over_azimuths(screened.ratio, clusters))
    if screened.margins:
        values |= screened.margins
    if screened.hazard is not None:
        curve = screened.hazard
        rates = [[overturning_rate(curve, fit[curve.measure]) for fit in each] for each in fits]
        values |= hazard_values(curve, rates)
    if screened.design is not None and screened.candidates_reach is not None:
        values |= _design_results(screened.design, screened.candidates_reach, len(screened.frames))
    return values


def _fits(
    intensities: Mapping[str, Float],
    scales: Float,
    overturned: NDArray[np.bool_] | None,
    clusters: NDArray[np.int64],
) -> dict[str, Fragility]:
    if overturned is None:
        return dict.fromkeys(intensities, Fragility(Outcome.ABSENT, 0, 0, 0))
    return {
        name: fit_fragility(values, scales, overturned, clusters)
        for name, values in intensities.items()
    }


def _better(
    screened: Screened, intensities: Mapping[str, Float], clusters: NDArray[np.int64]
) -> list[tuple[str, str]]:
    """Return the better measure for each structure, from motions that have all measures."""
    both = compared_motions(intensities)
    some = {name: values[both] for name, values in intensities.items()}
    told = []
    for fell in screened.reached[0].swapaxes(0, 1):
        preference = better_measure(_fits(some, screened.scales, fell[both], clusters[both]))
        told.append((preference.measure, preference.reason))
    return told


def _observed(
    screened: Screened, intensities: Mapping[str, Float]
) -> list[list[dict[str, tuple[Float, Float]]]]:
    return [
        [
            {
                name: (_NO_CLASSES,) * 2
                if fell is None
                else observed_shares(values, screened.scales, fell, _CLASSES)
                for name, values in intensities.items()
            }
            for fell in each
        ]
        for each in _by_structure(screened)
    ]


def _grid(intensities: Mapping[str, Float], scales: Float) -> dict[str, Float]:
    """Return intensities slightly beyond the range tried, for the curves; NaN if none is known."""
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
    texts = screened.metadata.texts
    return [(texts["event"][m.row], texts["station"][m.row]) for m in screened.motions]


def _design_results(design: Design, reached: NDArray[np.bool_], structures: int) -> dict[str, Any]:
    shares = (~reached).mean(axis=0).reshape(structures, design.steps)
    found = [smallest(design.values, row, design.share) for row in shares]
    return design_values(design, shares, found)
