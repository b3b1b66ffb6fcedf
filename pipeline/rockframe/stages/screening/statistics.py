"""Statistics of a screening: fragility, distributions, ranks, rates and designs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from hashlib import sha256
from typing import Any, Final, Self

import numpy as np
from numpy.typing import NDArray

from rockframe.engines.engine import Engine, map_tasks
from rockframe.quantities import QUANTILES
from rockframe.record import SiteType
from rockframe.results.response import component_values, structure_values
from rockframe.results.schema.arrays import Arrays
from rockframe.results.schema.response import OUTCOMES, SCREEN_NC, UNITS_OF_MEASURES
from rockframe.results.screen import Fits, WritePart, rate_values
from rockframe.risk import (
    FURTHER,
    MEASURES,
    Fragility,
    HazardCurve,
    LimitState,
    Outcome,
    better_measure,
    compared_motions,
    demand_ranks,
    demands_at,
    fit_fragility,
    mean_shares,
    measure_of,
    observed_shares,
    over_azimuths,
    over_azimuths_of,
    period_of,
    pooled_intensities,
    shares_at_most,
    spectral,
)
from rockframe.risk.distribution import Band, RelativeRanks
from rockframe.risk.fragility import Curve
from rockframe.rocking import quantiles
from rockframe.rocking.verdict import COMPUTED
from rockframe.stages.common import Progress
from rockframe.stages.screen_motions import Motion, Motions
from rockframe.stages.screening.outcomes import AllOutcomes, Reached, ScreenedStructures
from rockframe.stages.screening.request import ScreeningRequest, is_free

Float = NDArray[np.float64]

#: Levels of |theta| / slenderness of the peak distributions.
LEVELS: Final = np.linspace(0.0, 1.5, 151)
#: Number of intensities of the fragility curves.
_POINTS: Final = 101
#: Number of intensity classes of the observed shares.
_CLASSES: Final = 8
#: Factor by which the curves extend beyond the intensities tried.
_BEYOND: Final = 1.25
#: Number of shares of motions below levels that are in memory together.
_SHARES: Final = 2**22
#: Percentiles over the azimuths, as names of measures and variables end; "" is one component.
_ENDS: Final = ("", "rotd50", "rotd100")
#: Distribution of peaks of a structure that lacks the quantity.
_UNKNOWN: Final = Band(*np.full((3, LEVELS.size), np.nan))


@dataclass(frozen=True, eq=False)
class MotionFacts:
    """The names, numbers and recordings of all motions.

    Parameters
    ----------
    names : sequence of str
        Identifiers.
    numbers : mapping of str to array, shape (motions,)
        Metadata, as in `RecordMetadata.numbers`, and further measures of intensity [SI].
    clusters : array, shape (motions,)
        Numbers of the recordings.
    in_both : array, shape (motions,)
        True for motions in both directions.
    """

    names: Sequence[str]
    numbers: Mapping[str, Float]
    clusters: NDArray[np.int64]
    in_both: NDArray[np.bool_]

    @classmethod
    def of(cls, motions: Sequence[Motion]) -> Self:
        """Return the facts of motions."""
        names = motions[0].numbers
        return cls(
            [motion.name for motion in motions],
            {name: np.array([motion.numbers[name] for motion in motions]) for name in names},
            np.array([motion.cluster for motion in motions]),
            np.array([motion.in_both for motion in motions]),
        )

    @classmethod
    def of_arrays(cls, arrays: Arrays, further: Sequence[str]) -> Self:
        """Return the facts of motions from the variables of a screening.

        `further` names the measures that were asked for, in their order.
        """
        numbers = {
            name: variable.values
            for name, variable in arrays.variables.items()
            if variable.dims == ("record",) and variable.values.dtype.kind == "f"
        }
        for end in _ENDS:
            variable = "spectral_acceleration" + (end and f"_{end}")
            if variable in arrays:
                for k, period in enumerate(arrays["spectral_period"].values.tolist()):
                    numbers[spectral(period, end).name] = arrays[variable].values[:, k]
        numbers = {name: values for name, values in numbers.items() if name not in further} | {
            name: numbers[name] for name in further
        }
        names = arrays["record_id"].values.tolist()
        in_both = np.zeros(len(names), dtype=bool)
        if "components" in arrays:
            in_both = arrays["components"].values != ""
        return cls(names, numbers, arrays["cluster"].values, in_both)

    @cached_property
    def intensities(self) -> dict[str, Float]:
        """Those numbers that are measures of intensity."""
        further = [name for name in self.numbers if name in FURTHER]
        spectra = [name for name in self.numbers if period_of(name)]
        return {name: self.numbers[name] for name in (*MEASURES, *further, *spectra)}


@dataclass(frozen=True, eq=False)
class StatisticsTask:
    """The outcomes of some structures, the facts of all motions, and the hazard curve."""

    structures: ScreenedStructures
    facts: MotionFacts
    hazard: HazardCurve | None


def statistics(
    request: ScreeningRequest,
    facts: MotionFacts,
    outcomes: AllOutcomes,
    hazard: HazardCurve | None,
    engine: Engine | None,
    progress: Progress,
    write: WritePart,
) -> tuple[dict[str, Any], list[NDArray[np.intp]]]:
    """Return the values of screen.nc that need all motions, and the motions that count for each
    structure.

    Parameters
    ----------
    request : ScreeningRequest
        The request.
    facts : MotionFacts
        Numbers of the motions.
    outcomes : AllOutcomes
        The outcomes of all motions.
    hazard : HazardCurve, optional
        Hazard curve of the site.
    engine : Engine, optional
        Engine of the computation; the values do not depend on it.
    progress : callable
        Called with the number of parts of the structures done and in total.
    write : callable
        Writes the values of a variable for some motions and structures, which are not returned. It
        is called for large screenings only.
    """
    values_of_parts, counting = list[dict[str, Any]](), list[NDArray[np.intp]]()
    different: dict[bytes, NDArray[np.intp]] = {}
    places: list[slice] = []
    pooled: Reached = []
    ranks = RelativeRanks()
    without_names = replace(facts, names=())  # workers do not need them

    def tasks() -> Iterator[StatisticsTask]:
        for some, part in outcomes.parts(facts.in_both):
            places.append(some)
            counting.extend(_shared(part.counting(), different))
            if request.options.pooled:
                pooled.extend(part.reached_by_each(part.counting()))
            yield StatisticsTask(part, without_names, hazard)

    for number, values in enumerate(map_tasks(statistics_of, tasks(), engine=engine)):
        ranks.add(values["demand_rank"])
        some = places[number]
        progress(number + 1, len(outcomes))
        values_of_parts.append(_written(values, some, write) if outcomes.is_large else values)
    values = _of_request(request) | _joined(values_of_parts)
    values["fragility_curve"] = request.options.fragility_curve
    values["mean_relative_rank"] = ranks.mean
    if request.options.azimuths_degree:
        firsts = np.unique(facts.clusters, return_index=True)[1]
        values["recording"] = [facts.names[int(i)] for i in firsts]
    if request.options.pooled:
        values |= _pooled_values(request, pooled, counting, facts)
    return values, counting


def _of_request(request: ScreeningRequest) -> dict[str, Any]:
    """Return the values that do not depend on the motions."""
    return {
        "limit_state": [limit.name for limit in request.limits],
        **structure_values(SCREEN_NC, request.structures),
        "scale": request.scales,
    }


def of_motions(chosen: Motions, request: ScreeningRequest, facts: MotionFacts) -> dict[str, Any]:
    """Return the values of screen.nc of each motion, and of the structures as they are stated.

    Parameters
    ----------
    chosen : Motions
        The motions.
    request : ScreeningRequest
        The request.
    facts : MotionFacts
        Numbers of the motions.
    """
    motions, texts, numbers = chosen.motions, chosen.metadata.texts, facts.numbers
    spectra = [name for name in numbers if period_of(name)]
    values = {
        "record_id": facts.names,
        "event": [texts["event"][motion.row] for motion in motions],
        "station": [texts["station"][motion.row] for motion in motions],
        "site_type": [SiteType.named(texts["site"][motion.row]) for motion in motions],
        "cluster": facts.clusters,
        **(component_values([motion.components for motion in motions]) if chosen.pairs else {}),
        **{name: numbers[name] for name in numbers if name not in spectra},
    }
    for end in _ENDS:
        some = {name: numbers[name] for name in spectra if over_azimuths_of(name) == end}
        if some:
            variable = "spectral_acceleration" + (end and f"_{end}")
            values[variable] = np.array([*some.values()]).T
            values["spectral_period"] = [period_of(name) for name in some]
    return values | _of_request(request)


def statistics_of(task: StatisticsTask) -> dict[str, Any]:
    """Return the values of screen.nc of some structures, under all motions."""
    structures, facts, hazard = task.structures, task.facts, task.hazard
    request, clusters = structures.request, facts.clusters
    form, intensities, counting = (
        request.options.fragility_curve,
        facts.intensities,
        structures.counting(),
    )
    reached = structures.reached_by_each(counting)
    fits = [
        [_fits(_at(intensities, some), request.scales, fell, clusters[some], form) for fell in each]
        for each, some in zip(reached, counting, strict=True)
    ]
    values = {
        **_demand_values(structures, clusters, counting),
        **_fragility_values(fits, _grid(intensities, request.scales)),
        **_preferences(structures, intensities, clusters, fits),
        **_observed_values(reached, [_at(intensities, some) for some in counting], request.scales),
    }
    if hazard is not None:
        values |= rate_values(hazard, fits)
        values |= _demands_at_return_periods(structures, facts, hazard, counting)
    if request.options.azimuths_degree:
        percentiles = over_azimuths(structures.ratio, clusters)
        for name, row in zip(("rotd00", "rotd50", "rotd100"), percentiles, strict=True):
            values[f"{name}_peak_rotation_ratio"] = row
    return values


def _demands_at_return_periods(
    structures: ScreenedStructures,
    facts: MotionFacts,
    curve: HazardCurve,
    counting: Sequence[NDArray[np.intp]],
) -> dict[str, Any]:
    """Return the demand of each structure at the return periods, by variable."""
    request = structures.request
    periods = request.options.return_period_years
    if not periods:
        return {}
    measured, scales = facts.intensities[curve.measure], request.scales
    factors = scales ** measure_of(curve.measure).power
    values: dict[str, Any] = {"return_period_years": [*periods]}
    for name, of_frames in structures.outcomes.demands.items():
        demands = [
            demands_at(
                *(curve, periods, of_frames[some, k], (measured[some], factors)),
                *(facts.clusters[some], request.options.fragility_curve),
            )
            for k, some in enumerate(counting)
        ]
        for end in demands[0]:
            variable = f"{name}_at_return_period" + ("" if end == "value" else f"_{end}")
            values[variable] = np.stack([of_frame[end] for of_frame in demands])
    return values


def _shared(
    arrays: Sequence[NDArray[np.intp]], different: dict[bytes, NDArray[np.intp]]
) -> list[NDArray[np.intp]]:
    """Return arrays of places, of which equal ones are one array; `different` has each, by hash."""
    return [different.setdefault(sha256(array.data).digest(), array) for array in arrays]


def _written(values: Mapping[str, Any], some: slice, write: WritePart) -> dict[str, Any]:
    """Return the values of some structures without those along motions, which are written."""
    rest = {}
    for name, value in values.items():
        if {*SCREEN_NC[name].dims[:2]} & {"record", "recording"}:
            if "structure" in SCREEN_NC[name].dims:
                write(name, (slice(None), some), SCREEN_NC[name].array(value))
        else:
            rest[name] = value
    return rest


def _joined(parts: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the values of all structures, from parts with some structures each."""
    values = dict(parts[0])
    if len(parts) > 1:
        for name in values:
            dims = SCREEN_NC[name].dims
            if "structure" in dims:
                arrays = [SCREEN_NC[name].array(part[name]) for part in parts]
                values[name] = np.concatenate(arrays, axis=dims.index("structure"))
    return values


def _at(arrays: Mapping[str, Float], some: NDArray[np.intp]) -> dict[str, Float]:
    """Return arrays along motions at the places of some."""
    return {name: values[some] for name, values in arrays.items()}


def _demand_values(
    structures: ScreenedStructures,
    clusters: NDArray[np.int64],
    counting: Sequence[NDArray[np.intp]],
) -> dict[str, Any]:
    """Return ranks, distributions of peaks, counts of outcomes, and results over all motions that
    count.
    """
    request, outcomes, demand = structures.request, structures.outcomes, structures.demand
    seed, at, fell = request.options.seed, request.reference, structures.shares(0)
    bands, overall = [_UNKNOWN] * len(counting), [_UNKNOWN] * len(counting)
    ranks = np.full(demand.shape, np.nan)
    for some, places in _alike(counting):
        rotations = [outcomes.peaks["peak_rotation_ratio"][some, k] for k in places]
        distributions = _distributions(rotations, clusters[some], seed)
        for k, peaks, band in zip(places, rotations, distributions, strict=True):
            bands[k] = _UNKNOWN if np.isnan(peaks).any() else band
        each = mean_shares([fell[some, k] for k in places], clusters=clusters[some], seed=seed)
        for k, band in zip(places, each, strict=True):
            overall[k] = band
        here = np.ix_(some, np.array(places))
        ranks[here] = demand_ranks(demand[here], fell[:, :, at][here])
    counts = np.array(
        [
            [(outcomes.verdicts[some, k] == verdict).sum(axis=0) for verdict in COMPUTED]
            for k, some in enumerate(counting)
        ]
    ).swapaxes(1, 2)
    return {
        "reference_scale": float(request.scales[at]),
        "demand_rank": ranks,
        "level": LEVELS,
        **SCREEN_NC.filled("band", bands),
        "verdict_count": counts,
        "outcome": OUTCOMES,
        "members": request.members,
        "quantile": [*QUANTILES],
        **SCREEN_NC.filled("overall", overall),
        **{
            f"overall_{name}_band": np.array(
                [quantiles(peaks[some, k].ravel()) for k, some in enumerate(counting)]
            )
            for name, peaks in outcomes.peaks.items()
        },
    }


def _distributions(
    peaks: Sequence[Float], clusters: NDArray[np.int64], seed: int
) -> Iterator[Band]:
    """Yield the distribution of the peaks of each structure; of many motions, level by level."""
    width = max(1, _SHARES // max(1, len(clusters)))
    parts = [
        mean_shares(
            (shares_at_most(of_structure, LEVELS[first : first + width]) for of_structure in peaks),
            clusters=clusters,
            seed=seed,
        )
        for first in range(0, LEVELS.size, width)
    ]
    for bands in zip(*parts, strict=True):
        ends = ([getattr(band, end) for band in bands] for end in ("share", "low", "high"))
        yield Band(*map(np.concatenate, ends))


def _alike(
    counting: Sequence[NDArray[np.intp]],
) -> Iterator[tuple[NDArray[np.intp], list[int]]]:
    """Yield places of motions, with the places of the structures for which exactly these count."""
    groups: dict[bytes, list[int]] = {}
    for k, some in enumerate(counting):
        groups.setdefault(some.tobytes(), []).append(k)
    for places in groups.values():
        yield counting[places[0]], places


def _fits(
    intensities: Mapping[str, Float],
    scales: Float,
    shares: Float | None,
    clusters: NDArray[np.int64],
    form: Curve,
) -> dict[str, Fragility]:
    if shares is None:
        return dict.fromkeys(intensities, Fragility(Outcome.ABSENT, 0, 0, 0))
    return {
        name: fit_fragility(values, _powers(scales, name), shares, clusters, curve=form)
        for name, values in intensities.items()
    }


def _powers(scales: Float, name: str) -> Float:
    """Return the factors of a measure at the scales of the motions."""
    power = measure_of(name).power
    return scales if power == 1 else scales**power


def _fragility_values(fits: Fits, points: Mapping[str, Float]) -> dict[str, Any]:
    """Return the curve of each structure and limit state over each measure, at the points."""
    rows = [[[fit[name] for name in points] for fit in each] for each in fits]
    values: dict[str, Any] = {
        "measure": list(points),
        "measure_units": [UNITS_OF_MEASURES.get(name, "m s-2") for name in points],
        **SCREEN_NC.filled("fit", rows),
        "log_likelihood": [[[_total(fit) for fit in row] for row in each] for each in rows],
        "fragility_intensity": [*points.values()],
    }
    for name in ("median", "lognormal_beta"):
        both = np.array([[[getattr(f, f"{name}_band") for f in row] for row in s] for s in rows])
        values |= {f"fragility_{name}_low": both[..., 0], f"fragility_{name}_high": both[..., 1]}
    curves = np.array(
        [
            [[(fit[n].probability(x), *fit[n].band(x)) for n, x in points.items()] for fit in each]
            for each in fits
        ]
    )
    for k, name in enumerate(("fragility", "fragility_low", "fragility_high")):
        values[name] = curves[..., k, :]
    return values


def _total(fit: Fragility) -> float:
    return float(fit.log_likelihood.sum()) if fit.log_likelihood.size else float("nan")


def _grid(intensities: Mapping[str, Float], scales: Float) -> dict[str, Float]:
    """Return intensities slightly beyond the range tried, for the curves; NaN if none is known."""
    grid = {}
    for name, values in intensities.items():
        positive = values[np.isfinite(values) & (values > 0.0)]
        if not positive.size:
            grid[name] = np.full(_POINTS, np.nan)
            continue
        factors = _powers(scales, name)
        least, most = positive.min() * factors[0], positive.max() * factors[-1]
        grid[name] = np.geomspace(least / _BEYOND, most * _BEYOND, _POINTS)
    return grid


def _preferences(
    structures: ScreenedStructures,
    intensities: Mapping[str, Float],
    clusters: NDArray[np.int64],
    fits: Fits,
) -> dict[str, Any]:
    """Return the better measure for each structure, from motions that have all measures.

    `fits` are those from all motions.
    """
    request, fell = structures.request, structures.shares(0)
    scales, form = request.scales, request.options.fragility_curve
    overturned = []
    for k, counts in enumerate(structures.counting()):
        some = counts[compared_motions(_at(intensities, counts))]
        overturned.append(  # nothing is fitted again
            fits[k][0]
            if some.size == counts.size
            else _fits(_at(intensities, some), scales, fell[some, k], clusters[some], form)
        )
    better = [better_measure(of_measures) for of_measures in overturned]
    names = {"better_measure": "measure", "better_measure_reason": "reason"}
    return {key: [getattr(each, name) for each in better] for key, name in names.items()}


def _observed_values(
    reached: Reached, intensities: Sequence[Mapping[str, Float]], scales: Float
) -> dict[str, Any]:
    """Return the shares that reach each limit state in classes of intensity, for each structure."""
    unknown = (np.full(_CLASSES, np.nan),) * 2
    both = np.array(
        [
            [
                [
                    unknown
                    if fell is None
                    else observed_shares(values, _powers(scales, name), fell, _CLASSES)
                    for name, values in measured.items()
                ]
                for fell in each
            ]
            for each, measured in zip(reached, intensities, strict=True)
        ]
    )
    return {"bin_intensity": both[:, 0, :, 0], "bin_share": both[:, :, :, 1]}


def _pooled_values(
    request: ScreeningRequest,
    reached: Reached,
    counting: Sequence[NDArray[np.intp]],
    facts: MotionFacts,
) -> dict[str, Any]:
    """Return the fragilities of all free-standing structures together.

    A recording is one observation, whatever number of structures respond to it. All observations
    are in memory.
    """
    limits = [k for k, limit in enumerate(request.limits) if _is_pooled(limit)]
    free = [k for k, structure in enumerate(request.structures) if is_free(structure)]
    frames = [structure for structure in request.structures if is_free(structure)]
    pga, pgv = (facts.numbers[name] for name in ("pga", "pgv"))
    together = np.concatenate([facts.clusters[counting[k]] for k in free])
    of_each = [
        pooled_intensities([frame], pga[counting[k]], pgv[counting[k]])
        for k, frame in zip(free, frames, strict=True)
    ]
    intensities = {
        name: np.concatenate([measured[name] for measured in of_each]) for name in of_each[0]
    }
    # Without restraints, a frame has the share of each of these limit states.
    shares: list[Float | None] = [
        np.concatenate([each for each in (reached[k][limit] for k in free) if each is not None])
        for limit in limits
    ]
    form = request.options.fragility_curve
    fits = [_fits(intensities, request.scales, share, together, form) for share in shares]
    better = better_measure(fits[0])
    of_one_structure = {
        **_fragility_values([fits], _grid(intensities, request.scales)),
        **_observed_values([shares], [intensities], request.scales),
    }
    # These do not vary with the structure.
    alone = ("measure", "measure_units", "fragility_intensity")
    return {
        "pooled": [int(k in free) for k in range(len(request.structures))],
        "pooled_limit_state": [request.limits[k].name for k in limits],
        "pooled_better_measure": better.measure,
        "pooled_better_measure_reason": better.reason,
        **{
            f"pooled_{name}": values if name in alone else np.asarray(values)[0]
            for name, values in of_one_structure.items()
        },
    }


def _is_pooled(limit: LimitState) -> bool:
    """Return True for overturning and limits of theta/alpha, which do not depend on the size."""
    return limit.quantity in ("", "peak_rotation_ratio")
