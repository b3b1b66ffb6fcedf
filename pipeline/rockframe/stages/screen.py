"""Screen structures by all records at many scales: screen.nc, its statistics and its table."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rockframe.engines.engine import Engine
from rockframe.errors import ParameterError
from rockframe.options.ingest import Filters
from rockframe.options.respond import ScreenOptions
from rockframe.outcome import InputOutcome
from rockframe.provenance import refuse_overwriting
from rockframe.quantities import QUANTILES
from rockframe.record import SiteType
from rockframe.results.pulses import RecordMetadata, read_metadata
from rockframe.results.records import open_records
from rockframe.results.response import component_values, structure_values
from rockframe.results.schema.response import OUTCOMES, SCREEN_NC, UNITS_OF_MEASURES
from rockframe.results.screen import (
    Batches,
    Fits,
    design_units,
    design_values,
    pooled_fits,
    rate_values,
    read_screening,
    write_screening,
)
from rockframe.results.screen_tables import (
    refuse_strange_tables,
    screen_table_paths,
    write_screen_tables,
)
from rockframe.results.writing import input_hash
from rockframe.risk import (
    FURTHER,
    MEASURES,
    Fragility,
    HazardCurve,
    LimitState,
    Outcome,
    Site,
    better_measure,
    compared_motions,
    demand_ranks,
    fit_fragility,
    hazard_file,
    mean_relative_ranks,
    mean_shares,
    measure_of,
    observed_shares,
    over_azimuths,
    over_azimuths_of,
    period_of,
    pooled_intensities,
    read_hazard,
    shares_at_most,
)
from rockframe.risk.distribution import Band
from rockframe.risk.fragility import Curve
from rockframe.rocking import quantiles
from rockframe.rocking.verdict import COMPUTED
from rockframe.stages.common import (
    NamedFigure,
    Progress,
    Written,
    choose_structures,
    made_structures,
    silent,
    unseen,
    warn_of_idle_contact,
)
from rockframe.stages.respond import pairs_of
from rockframe.stages.screen_batches import Reached, ScreeningRequest, ScreeningRun, is_free
from rockframe.stages.screen_motions import IN_ONE_PLANE, Motions
from rockframe.study.structures import SHIPPED_STRUCTURES, StructureTable

Float = NDArray[np.float64]

#: Levels of |theta| / slenderness of the peak distributions.
LEVELS: Final = np.linspace(0.0, 1.5, 151)
#: Number of intensities of the fragility curves.
_POINTS: Final = 101
#: Number of intensity classes of the observed shares.
_CLASSES: Final = 8
#: Factor by which the curves extend beyond the intensities tried.
_BEYOND: Final = 1.25
#: Distribution of peaks of a structure that lacks the quantity.
_UNKNOWN: Final = Band(*np.full((3, LEVELS.size), np.nan))


def statistics(
    run: ScreeningRun, metadata: RecordMetadata, hazard: HazardCurve | None
) -> tuple[dict[str, Any], dict[str, str]]:
    """Return the values of screen.nc except those of single scenarios, and the units that vary.

    Parameters
    ----------
    run : ScreeningRun
        A run whose `rows` were read.
    metadata : RecordMetadata
        Metadata of the records.
    hazard : HazardCurve, optional
        Hazard curve of the site.
    """
    request, motions, texts = run.request, run.motions, metadata.texts
    numbers = {
        name: np.array([motion.numbers[name] for motion in motions]) for name in motions[0].numbers
    }
    clusters = np.array([motion.cluster for motion in motions])
    spectra = [name for name in numbers if period_of(name)]
    further = [name for name in numbers if name in FURTHER]
    intensities = {name: numbers[name] for name in (*MEASURES, *further, *spectra)}
    counting = run.counting()
    reached = run.reached_by_each(counting)
    form = request.options.fragility_curve
    fits = [
        [_fits(_at(intensities, some), request.scales, fell, clusters[some], form) for fell in each]
        for each, some in zip(reached, counting, strict=True)
    ]
    values = {
        "record_id": [motion.name for motion in motions],
        "event": [texts["event"][motion.row] for motion in motions],
        "station": [texts["station"][motion.row] for motion in motions],
        "site_type": [SiteType.named(texts["site"][motion.row]) for motion in motions],
        "cluster": clusters,
        **component_values([motion.components for motion in motions]),
        **{name: numbers[name] for name in numbers if name not in spectra},
        "limit_state": [limit.name for limit in run.limits],
        **_demand_values(run, clusters, counting),
        "fragility_curve": form,
        **_fragility_values(fits, _grid(intensities, request.scales)),
        **_preferences(run, intensities, clusters, fits),
        **_observed_values(reached, [_at(intensities, some) for some in counting], request.scales),
        **(_pooled_values(run, reached, numbers, clusters) if request.options.pooled else {}),
        **_optional_values(run, {name: numbers[name] for name in spectra}, clusters),
        **(rate_values(hazard, fits) | run.demands_at(hazard, intensities) if hazard else {}),
        **structure_values(SCREEN_NC, request.structures),
        "scale": request.scales,
    }
    return values, design_units(request.design) if request.design else {}


def _at(arrays: Mapping[str, Float], some: NDArray[np.intp]) -> dict[str, Float]:
    """Return arrays along motions at the places of some."""
    return {name: values[some] for name, values in arrays.items()}


def _demand_values(
    run: ScreeningRun, clusters: NDArray[np.int64], counting: Sequence[NDArray[np.intp]]
) -> dict[str, Any]:
    """Return ranks, distributions of peaks, counts of outcomes, and results over all motions that
    count.
    """
    seed, at, fell = run.request.options.seed, run.request.reference, run.shares(0)
    bands, overall = [_UNKNOWN] * len(counting), [_UNKNOWN] * len(counting)
    ranks = np.full(run.demand.shape, np.nan)
    for some, places in _alike(counting):
        rotations = [run.kept["peak_rotation_ratio"][some, k] for k in places]
        at_most = (shares_at_most(peaks, LEVELS) for peaks in rotations)
        each = mean_shares(at_most, clusters=clusters[some], seed=seed)
        for k, peaks, band in zip(places, rotations, each, strict=True):
            bands[k] = _UNKNOWN if np.isnan(peaks).any() else band
        each = mean_shares([fell[some, k] for k in places], clusters=clusters[some], seed=seed)
        for k, band in zip(places, each, strict=True):
            overall[k] = band
        here = np.ix_(some, np.array(places))
        ranks[here] = demand_ranks(run.demand[here], fell[:, :, at][here])
    counts = np.array(
        [
            [(run.verdicts[some, k] == verdict).sum(axis=0) for verdict in COMPUTED]
            for k, some in enumerate(counting)
        ]
    ).swapaxes(1, 2)
    return {
        "reference_scale": float(run.request.scales[at]),
        "demand_rank": ranks,
        "mean_relative_rank": mean_relative_ranks(ranks),
        "level": LEVELS,
        **SCREEN_NC.filled("band", bands),
        "verdict_count": counts,
        "outcome": OUTCOMES,
        "members": run.members,
        "quantile": [*QUANTILES],
        **SCREEN_NC.filled("overall", overall),
        **{
            f"overall_{name}_band": np.array(
                [quantiles(peaks[some, k].ravel()) for k, some in enumerate(counting)]
            )
            for name, peaks in run.kept.items()
        },
    }


def _alike(
    counting: Sequence[NDArray[np.intp]],
) -> Iterator[tuple[NDArray[np.intp], list[int]]]:
    """Yield places of motions, with the places of the structures for which exactly these count."""
    groups: dict[bytes, list[int]] = {}
    for k, some in enumerate(counting):
        groups.setdefault(some.tobytes(), []).append(k)
    for places in groups.values():
        yield counting[places[0]], places


def _optional_values(
    run: ScreeningRun, spectra: Mapping[str, Float], clusters: NDArray[np.int64]
) -> dict[str, Any]:
    """Return spectral accelerations, percentiles over azimuths, margins and the design."""
    values: dict[str, Any] = run.margins()
    for end in ("", "rotd50", "rotd100"):
        some = {name: values for name, values in spectra.items() if over_azimuths_of(name) == end}
        if some:
            variable = "spectral_acceleration" + (end and f"_{end}")
            values[variable] = np.array([*some.values()]).T
            values["spectral_period"] = [period_of(name) for name in some]
    if run.request.options.azimuths_degree:
        firsts = np.unique(clusters, return_index=True)[1]
        values["recording"] = [run.motions[int(i)].name for i in firsts]
        percentiles = over_azimuths(run.ratio, clusters)
        for name, row in zip(("rotd00", "rotd50", "rotd100"), percentiles, strict=True):
            values[f"{name}_peak_rotation_ratio"] = row
    if run.request.design is not None:
        shape = (len(run.request.structures), -1)
        share, largest = (values.reshape(shape) for values in run.candidates(run.request.design))
        values |= design_values(run.request.design, share, largest)
    return values


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
    run: ScreeningRun, intensities: Mapping[str, Float], clusters: NDArray[np.int64], fits: Fits
) -> dict[str, Any]:
    """Return the better measure for each structure, from motions that have all measures.

    `fits` are those from all motions.
    """
    scales, form, fell = run.request.scales, run.request.options.fragility_curve, run.shares(0)
    overturned = []
    for k, counts in enumerate(run.counting()):
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
    run: ScreeningRun,
    reached: Reached,
    numbers: Mapping[str, Float],
    clusters: NDArray[np.int64],
) -> dict[str, Any]:
    """Return the fragilities of all free-standing structures together.

    A recording is one observation, whatever number of structures respond to it.
    """
    request, limits = run.request, [k for k, limit in enumerate(run.limits) if _is_pooled(limit)]
    free = [k for k, structure in enumerate(request.structures) if is_free(structure)]
    frames = [structure for structure in request.structures if is_free(structure)]
    counting = run.counting()
    together = np.concatenate([clusters[counting[k]] for k in free])
    of_each = [
        pooled_intensities([frame], numbers["pga"][counting[k]], numbers["pgv"][counting[k]])
        for k, frame in zip(free, frames, strict=True)
    ]
    intensities = {
        name: np.concatenate([measured[name] for measured in of_each]) for name in of_each[0]
    }
    # Without restraints, a frame has the share of each of these limit states.
    shares: list[Float | None] = [
        np.concatenate([one for one in (reached[k][limit] for k in free) if one is not None])
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
        "pooled_limit_state": [run.limits[k].name for k in limits],
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


@dataclass(frozen=True)
class Screening:
    """Summary of a screening.

    Parameters
    ----------
    motions, scenarios : int
        Number of motions, and of scenarios that were computed: motions by structures by scales.
    rejections : tuple of InputOutcome
        Records without a partner or without a requested vertical.
    left_out : mapping of str to str
        Reasons of the motions that the selection rejects, by identifier.
    tables : mapping of str to Path
        Tables beside the file: ``""`` for motions and structures, ``scenarios``, ``fragility``, and
        if requested ``pooled``, ``rates`` and ``design``.
    """

    motions: int
    scenarios: int
    rejections: tuple[InputOutcome, ...]
    left_out: Mapping[str, str]
    tables: Mapping[str, Path]

    @property
    def table(self) -> Path:
        """Table with a row for each motion and structure."""
        return self.tables[""]


def screen_stage(
    records_path: str | Path,
    output: str | Path,
    options: ScreenOptions | None = None,
    *,
    structures_path: str | Path = SHIPPED_STRUCTURES,
    pulses_path: str | Path | None = None,
    filters: Filters | None = None,
    engine: Engine | None = None,
    progress: Progress = silent,
    table_format: str = "csv",
    written: Written = unseen,
) -> Screening:
    """Screen structures by all records at all scales: ``screen.nc``, and tables beside it.

    An interrupted run leaves its finished batches beside the output; the same call resumes it.

    Parameters
    ----------
    records_path, output : str or Path
        Output of `ingest_stage`, and the netCDF file to write. The table of motions has the same
        name with another suffix; the other tables are ``fragility.csv`` and so on beside
        ``screen.nc``, and ``NAME-fragility.csv`` beside ``NAME.nc``.
    options : ScreenOptions, optional
        Options for motions, scales and results.
    structures_path : str or Path
        TOML file of ``[[structure]]`` tables; by default the bundled ones.
    pulses_path : str or Path, optional
        Output of `pulse_stage` for the same records; needed for fragility over a_p and L_p, and for
        filters by the pulse.
    filters : Filters, optional
        Filters of records; by default all horizontal records.
    engine : Engine, optional
        Engine of the computation; the file does not depend on it.
    progress : callable
        Called with the number of batches done and in total.
    table_format : str
        One of `rockframe.cells.TABLE_FORMATS`.
    written : callable
        Called with the dataset of the written file, at the reference scale and without histories.

    Raises
    ------
    InputError
        If a file cannot be read or written, or if the pulses belong to other records.
    ParameterError
        If no record is left, if pulses are needed but not stated, or if a candidate of the design
        cannot rock.
    EngineError
        If the engine is not available.
    """
    records_path, output = Path(records_path), Path(output)
    options, structures_path = _with_hazard_file(options or ScreenOptions()), Path(structures_path)
    pulses_path, filters = Path(pulses_path) if pulses_path else None, filters or Filters()
    tables = screen_table_paths(output, **_asked(options), table_format=table_format)
    read = [records_path, structures_path, *filter(None, (pulses_path, options.hazard))]
    refuse_overwriting([output, *tables.values()], read, beside=output)
    refuse_strange_tables(tables)
    structures = tuple(choose_structures(structures_path, options.structure))
    request = ScreeningRequest.of(options, structures)
    _require_pulses(options, pulses_path)
    with open_records(records_path) as file:
        pairs = request.pairs and bool(pairs_of(file))
        hazard = _hazard(options, pulses_path, pairs)
        metadata = read_metadata(records_path, pulses_path)
        chosen = Motions(file, metadata, options, filters, *_wanted(options, hazard), pairs=pairs)
        batches = Batches(output, _origin(records_path, chosen, request))
        run = ScreeningRun(chosen, request, batches, engine, progress)
        dataset = write_screening(
            run.rows(),
            run.sizes(),
            request.reference,
            lambda: statistics(run, metadata, hazard),
            output,
            input_sha256=input_hash(*read),
            parameters=options.stated()
            | {
                "filters": chosen.filters.bounds(),
                "structures": [structure.name for structure in structures],
            }
            | chosen.in_one_plane_alone(structures),
            left_out={r.file: r.reason for r in chosen.rejections} | chosen.left_out,
            filtered=chosen.left_out,
            histories=None if options.histories == "none" else run.histories(),
        )
    write_screen_tables(output, table_format=table_format, screening=dataset)
    batches.sweep()
    written(dataset)
    warn_of_idle_contact(options.ensemble, "components" in dataset)
    computed = int(np.isin(run.verdicts, COMPUTED).sum())
    return Screening(len(run.verdicts), computed, tuple(chosen.rejections), chosen.left_out, tables)


def foresee_screen(options: ScreenOptions, structures: Sequence[StructureTable]) -> None:
    """Raise the errors of `screen_stage` that need no record."""
    ScreeningRequest.of(options, made_structures(structures, options.structure))


def _asked(options: ScreenOptions) -> dict[str, bool]:
    """Return which tables are written only if they are asked for."""
    asked = {"rates": options.hazard, "demands": options.return_period_years}
    some = {name: value is not None for name, value in (asked | {"design": options.design}).items()}
    return some | {"pooled": options.pooled}


def _with_hazard_file(options: ScreenOptions) -> ScreenOptions:
    """Return the options with the file of the hazard curve: a folder may contain several."""
    if options.hazard is None:
        return options
    return options.replaced(hazard=hazard_file(options.hazard, options.hazard_curve))


def _origin(records_path: Path, chosen: Motions, request: ScreeningRequest) -> dict[str, Any]:
    """Return what the results of a batch are made of; other batches are not taken."""
    return {
        "records": input_hash(records_path),
        "motions": [motion.name for motion in chosen.motions],
        # The names of rotated motions round their azimuths.
        "azimuths": [motion.azimuth for motion in chosen.motions],
        "vertical": request.options.vertical,
        **request.scenarios(),
    }


def _require_pulses(options: ScreenOptions, pulses_path: Path | None) -> None:
    for name in options.pulse_filters():
        if pulses_path is None:
            raise ParameterError(f"{name} needs pulses. State them with --pulses.")


def _wanted(options: ScreenOptions, hazard: HazardCurve | None) -> tuple[list[float], list[str]]:
    """Return periods and names of further measures, including those of the hazard curve."""
    periods, names = {*(options.spectral_periods_s or ())}, list[str](options.measures or ())
    if hazard is not None:
        end = over_azimuths_of(hazard.measure)
        needed = f"sa_{end}" if end else hazard.measure
        names += [needed] if (end or needed in FURTHER) and needed not in names else []
        periods |= {period_of(hazard.measure)} - {0.0}
    return sorted(periods), names


def stated_hazard(path: Path, options: ScreenOptions) -> HazardCurve:
    """Return the hazard curve of a file, with the site and the measure that the options state."""
    site = Site(options.hazard_site, options.hazard_site_id or "", options.hazard_site_within_km)
    columns, measure = options.hazard_columns or (), options.hazard_measure
    return read_hazard(path, site, options.hazard_curve, columns=columns, measure=measure)


def _hazard(options: ScreenOptions, pulses_path: Path | None, pairs: bool) -> HazardCurve | None:
    if (path := options.hazard) is None:
        return None
    curve = stated_hazard(path, options)
    if curve.measure in ("a_p", "L_p"):
        unknown = {
            "without pulses. State them with --pulses.": pulses_path is None,
            "for rotated motions. Remove azimuths_degree.": bool(options.azimuths_degree),
            f"in both directions. State {IN_ONE_PLANE}.": pairs,
        }
        for words in (words for words, holds in unknown.items() if holds):
            start = f"{path}: is a hazard curve of {curve.measure}, which is unknown"
            raise ParameterError(f"{start} {words}")
    return curve


def screening_figures(path: Path, _most: int) -> Iterator[NamedFigure]:
    """Yield the figures of each structure: its fragility, and its peaks by scale."""
    from rockframe.figures.fragility import draw_fragility, draw_peak_distribution

    screening = read_screening(path, every_scale=False)
    for structure in map(str, screening["structure"].values):
        screened = screening.sel(structure=structure)
        yield f"fragility-{structure}", structure, draw_fragility(screened)
        yield f"peaks-{structure}", structure, draw_peak_distribution(screened)
    together = pooled_fits(screening)
    if together is not None:
        name = str(together["structure"].item())
        yield "fragility-pooled", name, draw_fragility(together.squeeze("structure"))
