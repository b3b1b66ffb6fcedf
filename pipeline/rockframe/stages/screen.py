"""Screen structures by all records at many scales: screen.nc, its statistics and its table."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rockframe.engines.engine import Engine
from rockframe.errors import ParameterError
from rockframe.options.ingest import Filters
from rockframe.options.respond import ScreenOptions
from rockframe.outcome import InputOutcome
from rockframe.provenance import refuse_overwriting
from rockframe.results.pulses import read_metadata
from rockframe.results.records import open_records
from rockframe.results.screen import (
    Batches,
    pooled_fits,
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
    HazardCurve,
    Site,
    hazard_file,
    over_azimuths_of,
    period_of,
    read_hazard,
)
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
from rockframe.stages.screen_batches import ScreeningRun
from rockframe.stages.screen_motions import IN_ONE_PLANE, Motions
from rockframe.stages.screening.request import ScreeningRequest
from rockframe.stages.screening.statistics import statistics
from rockframe.study.structures import SHIPPED_STRUCTURES, StructureTable


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
            lambda write: statistics(run, metadata, hazard, write),
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
    motions, scenarios = len(run.motions), run.computed
    return Screening(motions, scenarios, tuple(chosen.rejections), chosen.left_out, tables)


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
