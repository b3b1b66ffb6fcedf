"""Screen structures by all records at many scales: screen.nc, its statistics and its table."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rockframe.engines.engine import Engine
from rockframe.errors import ParameterError
from rockframe.options import STAGES
from rockframe.options.ingest import Filters
from rockframe.options.respond import ScreenOptions
from rockframe.outcome import InputOutcome
from rockframe.provenance import refuse_overwriting
from rockframe.results.pulses import read_metadata
from rockframe.results.records import RecordsFile, open_records
from rockframe.results.schema import SCREEN
from rockframe.results.screen import (
    Described,
    KeptHistory,
    Scenario,
    WritePart,
    design_units,
    design_values,
    pooled_fits,
    read_screening,
    write_screening,
    write_screening_index,
)
from rockframe.results.screen_tables import (
    refuse_strange_tables,
    screen_table_paths,
    write_screen_tables,
)
from rockframe.results.shards import BatchFiles
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
from rockframe.rocking import Histories, Verdict
from rockframe.rocking.verdict import COMPUTED
from rockframe.stages.common import (
    WHOLE,
    Batch,
    NamedFigure,
    Progress,
    Written,
    choose_structures,
    horizontal,
    in_one_plane_alone,
    made_structures,
    silent,
    unseen,
    warn_of_idle_contact,
)
from rockframe.stages.respond import Pair, pairs_of
from rockframe.stages.screen_motions import (
    IN_ONE_PLANE,
    Motions,
    further_names,
    require_some,
    rotd_names,
)
from rockframe.stages.screening.batches import ScreenedBatches
from rockframe.stages.screening.finished import FinishedTasks
from rockframe.stages.screening.outcomes import AllOutcomes
from rockframe.stages.screening.request import ScreeningRequest, require_in_both
from rockframe.stages.screening.statistics import MotionFacts, of_motions, statistics
from rockframe.stages.screening.tasks import ScreeningRun
from rockframe.study.structures import SHIPPED_STRUCTURES, StructureTable

if TYPE_CHECKING:
    import xarray as xr


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
    batch: Batch = WHOLE,
    shards: Sequence[str | Path] = (),
    engine: Engine | None = None,
    progress: Progress = silent,
    table_format: str = "csv",
    written: Written = unseen,
) -> Screening:
    """Screen structures by all records at all scales: ``screen.nc``, and tables beside it.

    An interrupted run leaves its finished tasks beside the output; the same call resumes it.

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
    batch : Batch
        Batch of the records. Its file has scenarios alone, without tables and statistics: the same
        call with the files of all batches as `shards` makes these.
    shards : sequence of str or Path
        Outputs of this function for all batches, in order. They must stay where they are from the
        output, which names them; readers open it as the file of all records.
    engine : Engine, optional
        Engine of the computation; the file does not depend on it.
    progress : callable
        Called with the number of tasks done and in total.
    table_format : str
        One of `rockframe.cells.TABLE_FORMATS`.
    written : callable
        Called with the dataset of the written file, at the reference scale and without histories;
        not called for a batch.

    Raises
    ------
    InputError
        If a file cannot be read or written, if the pulses belong to other records, or if a shard
        is of another screening.
    ParameterError
        If no record is left, if pulses are needed but not stated, or if a candidate of the design
        cannot rock.
    EngineError
        If the engine is not available.
    """
    if shards and not batch.whole:
        raise ParameterError(
            f"batch {batch.stated} and shards both stated. State only one of them."
        )
    output, options = Path(output), _with_hazard_file(options or ScreenOptions())
    pulses = Path(pulses_path) if pulses_path else None
    read = [Path(records_path), Path(structures_path), *filter(None, (pulses, options.hazard))]
    tables = screen_table_paths(output, **_asked(options), table_format=table_format)
    if not batch.whole:
        tables, options = {}, _of_scenarios(options)
    refuse_overwriting([output, *tables.values()], [*read, *map(Path, shards)], beside=output)
    refuse_strange_tables(tables)
    structures = tuple(choose_structures(Path(structures_path), options.structure))
    request = ScreeningRequest.of(options, structures)
    _require_pulses(options, pulses)
    with open_records(Path(records_path)) as file:
        screener = _Screener(file, read, pulses, request, filters or Filters(), output, engine)
        if shards:
            done = screener.index([*map(Path, shards)], progress)
        else:
            done = screener.compute(batch, progress)
    if done.dataset is not None:
        write_screen_tables(
            output, table_format=table_format, screening=done.dataset, engine=engine
        )
    FinishedTasks(output, {}).sweep()
    if done.dataset is not None:
        written(done.dataset)
        warn_of_idle_contact(options.ensemble, done.in_both)
    return Screening(done.motions, done.scenarios, tuple(done.rejections), done.left_out, tables)


class _Tally:
    """Counts the scenarios that are computed, and notes those whose histories are kept."""

    def __init__(self, histories: Histories, outcomes: AllOutcomes | None) -> None:
        self._histories, self._outcomes = histories, outcomes
        self.computed = 0
        self.selected: list[NDArray[np.intp]] = []

    def passed(self, rows: Iterable[Scenario]) -> Iterator[Scenario]:
        """Yield the scenarios of each motion as they are, and keep their outcomes."""
        for row in rows:
            verdict = row["verdict"]
            self.computed += int(np.isin(verdict, COMPUTED).sum())
            mask = self._histories.mask(verdict, row["peak_rotation_ratio"])
            self.selected.append(np.argwhere(mask & (verdict != Verdict.NOT_COMPUTED)))
            if self._outcomes is not None:
                self._outcomes.add(row)
            yield row


class _Done(NamedTuple):
    """The result of a screening: the dataset that it wrote, None for a batch, and its numbers."""

    dataset: xr.Dataset | None
    motions: int
    scenarios: int
    rejections: Sequence[InputOutcome]
    left_out: Mapping[str, str]
    in_both: bool


@dataclass(frozen=True, eq=False)
class _Screener:
    """Writes screen.nc; `read` has the files that it depends on, the records first."""

    file: RecordsFile
    read: Sequence[Path]
    pulses: Path | None
    request: ScreeningRequest
    filters: Filters
    output: Path
    engine: Engine | None

    def compute(self, batch: Batch, progress: Progress) -> _Done:
        """Compute the scenarios of a batch, or of all records with the statistics."""
        run, chosen = self._run(progress, batch)
        outcomes = None
        if batch.whole:
            outcomes = AllOutcomes(self.request, len(chosen.motions), self.output.parent)
        tally = _Tally(self.request.histories, outcomes)

        def describe(write: WritePart) -> Described:
            facts = MotionFacts.of(chosen.motions)
            values = of_motions(chosen, self.request, facts)
            if outcomes is None:
                return values | run.margin_values(None), {}
            values |= run.margin_values(write if outcomes.is_large else None)
            further, units = self._of_all_records(run, facts, outcomes, silent, write)
            return {**values, **further}, units

        in_both = any(motion.in_both for motion in chosen.motions)
        left_out = {r.file: r.reason for r in chosen.rejections} | chosen.left_out
        dataset = write_screening(
            *(tally.passed(run.rows()), run.sizes(), describe, self.output),
            reference=self.request.reference,
            batch=batch.stated,
            histories=self._histories(run, tally),
            filtered=chosen.left_out,
            input_sha256=input_hash(*self.read),
            parameters=self._parameters(in_both, batch),
            left_out=left_out,
        )
        motions, rejections = len(chosen.motions), chosen.rejections
        return _Done(dataset, motions, tally.computed, rejections, chosen.left_out, in_both)

    def index(self, shards: Sequence[Path], progress: Progress) -> _Done:
        """Compute the statistics from the files of all batches."""
        files, batches = BatchFiles.of(shards, self.output, SCREEN), ScreenedBatches(shards)
        files.require_of(self.output, input_hash(*self.read), self._parameters(True, WHOLE))
        motions = files.index["record_id"].shape[0]
        outcomes = AllOutcomes(self.request, motions, self.output.parent)
        tally = _Tally(self.request.histories, outcomes)
        for _ in tally.passed(batches.rows()):
            pass
        facts = MotionFacts.of_arrays(batches.facts, further_names(*self._wanted))
        self._require(facts)
        run = None
        if self.request.design is not None or self.request.options.histories != "none":
            run, _ = self._run(progress, WHOLE, joined=True)
        left_out = {name: files.left_out[name] for name in batches.filtered}
        in_both = bool(facts.in_both.any())
        dataset = write_screening_index(
            *(files, partial(self._of_all_records, run, facts, outcomes, progress), self.output),
            histories=self._histories(run, tally),
            filtered=batches.filtered,
            input_sha256=input_hash(*self.read),
            parameters=self._parameters(in_both, WHOLE),
            left_out=files.left_out,
        )
        reasons = files.left_out.items()
        rejections = [InputOutcome(*each) for each in reasons if each[0] not in left_out]
        return _Done(dataset, motions, tally.computed, rejections, left_out, in_both)

    def _require(self, facts: MotionFacts) -> None:
        """Raise the errors that need the motions of all batches."""
        if facts.in_both.any():
            require_in_both(self.request)
        for name in rotd_names(*self._wanted):
            require_some(name, facts.numbers[name])

    def _run(
        self, progress: Progress, batch: Batch, *, joined: bool = False
    ) -> tuple[ScreeningRun, Motions]:
        """Return the tasks of the motions of a batch, and the motions."""
        wanted = self._wanted  # refuses a hazard curve before records are read
        pairs = self._pairs
        names = batch.of(horizontal(self.file))
        names += [*chain(*(pairs[name].records for name in names if name in pairs))]
        metadata = read_metadata(self.read[0], self.pulses, names)
        chosen = Motions(
            *(self.file, metadata, self.request.options, self.filters),
            *(([], []) if joined else wanted),  # files of batches have the measures
            pairs=pairs,
            batch=batch,
        )
        origin = _origin(self.read[0], chosen, self.request)
        finished = FinishedTasks(self.output, origin)
        given = (chosen, self.request, finished, self.engine, progress)
        return ScreeningRun(*given, joined=joined), chosen

    def _of_all_records(
        self,
        run: ScreeningRun | None,
        facts: MotionFacts,
        outcomes: AllOutcomes,
        progress: Progress,
        write: WritePart,
    ) -> Described:
        request = self.request
        given = (request, facts, outcomes, self._hazard, self.engine)
        values, counting = statistics(*given, progress, write)
        if request.design is None or run is None:
            return values, {}
        shape = (len(request.structures), -1)
        results = (each.reshape(shape) for each in run.candidates(request.design, counting))
        return values | design_values(request.design, *results), design_units(request.design)

    def _histories(self, run: ScreeningRun | None, tally: _Tally) -> Iterator[KeptHistory] | None:
        if run is None or self.request.options.histories == "none":
            return None
        return run.histories(tally.selected)

    def _parameters(self, in_both: bool, batch: Batch) -> dict[str, Any]:
        """Return the parameters of a file; of a batch, those of its scenarios."""
        structures, stated = self.request.structures, self.request.options.stated()
        stated["filters"] = self.filters.bounds()
        stated["structures"] = [structure.name for structure in structures]
        if not batch.whole:
            of_all = STAGES["screen"].of_all_records
            return {name: value for name, value in stated.items() if name not in of_all}
        options = self.request.options
        wanted = options.both_directions and not options.azimuths_degree
        return stated | in_one_plane_alone(structures, wanted and not in_both)

    @cached_property
    def _pairs(self) -> dict[str, Pair]:
        return pairs_of(self.file) if self.request.pairs else {}

    @cached_property
    def _hazard(self) -> HazardCurve | None:
        return _hazard(self.request.options, self.pulses, bool(self._pairs))

    @cached_property
    def _wanted(self) -> tuple[list[float], list[str]]:
        return _wanted(self.request.options, self._hazard)


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


def _of_scenarios(options: ScreenOptions) -> ScreenOptions:
    """Return the options with the defaults of those that need all records."""
    fields = ScreenOptions.model_fields
    return options.replaced(
        **{name: fields[name].default for name in STAGES["screen"].of_all_records}
    )


def _origin(records_path: Path, chosen: Motions, request: ScreeningRequest) -> dict[str, Any]:
    """Return the inputs and options that the results of tasks depend on."""
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
