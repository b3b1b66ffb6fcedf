"""Compute responses from records.nc and a file of structures, and write response.nc."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import chain
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Final, NamedTuple, Self

from rockframe.components import BothDirections, vertical_beside
from rockframe.engines.engine import Engine, map_tasks, on_threads
from rockframe.errors import ParameterError, RockframeWarning, require_known
from rockframe.options.respond import RespondOptions
from rockframe.outcome import InputOutcome
from rockframe.provenance import refuse_overwriting
from rockframe.quantities import PEAKS
from rockframe.record import Orientation, Part, Record
from rockframe.results.pulses import (
    best_pulses,
    loaded_pulses,
    require_pulses_of,
    require_samples,
    sample_hashes,
)
from rockframe.results.records import RecordsFile, open_records
from rockframe.results.response import (
    NO_COMPONENTS,
    Components,
    nominal_row,
    response_row,
    write_response_rows,
)
from rockframe.results.tables.rows import Row, ensemble_cells, spread_verdict
from rockframe.results.tables.table import part_rows
from rockframe.results.versions import Uncertain, VersionSources
from rockframe.results.writing import Row as WrittenRow
from rockframe.results.writing import input_hash
from rockframe.rocking import (
    EnsembleResponse,
    GroundAcceleration,
    NominalResponses,
    Versions,
    as_ground,
    not_at_rest,
)
from rockframe.stages.common import (
    WHOLE,
    Batch,
    Counted,
    Progress,
    WrittenArrays,
    accepted,
    choose_structures,
    horizontal,
    in_one_plane_alone,
    made_structures,
    silent,
    unseen,
    warn_of_idle_contact,
)
from rockframe.structures.contract import (
    Shaking,
    Structure,
    StructureResponse,
    computed_in_both_directions,
    ensembles_of_each,
    most_critical,
    nominal_of_each,
    require_possible,
    respond_each,
)
from rockframe.study.structures import SHIPPED_STRUCTURES, StructureTable
from rockframe.wavelets.pulse import Pulse

if TYPE_CHECKING:
    from rockframe.results.schema.arrays import Arrays
    from rockframe.wobbling import PairAcceleration

#: Largest number of samples times structures in a task, which limits memory for histories.
_NODES: Final = 200_000
#: Factor of it for tasks that compute many nominal responses at once.
_AT_ONCE: Final = 10

WITHOUT_VERTICAL: Final = (
    "no vertical record of the same event, station and time step has 95 % of its energy in the "
    "samples that they share, or several have. Add one, or compute without the vertical component."
)
#: Number of structures of each kind that are tried with their members before a run.
_TRIED: Final = 16


class _Motion(NamedTuple):
    """A motion by its name, its number of samples, and what belongs to it; see `ResponseTask`."""

    name: str
    samples: int
    motion: Record | GroundAcceleration | PairAcceleration
    uncertain: Uncertain | None = None
    record: Record | None = None
    components: Components = NO_COMPONENTS


@dataclass(frozen=True)
class ResponseTask:
    """Motions by the names of their records, and the structures that respond to them.

    Of records with several versions, `uncertain` has what these are made of, of sequences `parts`
    has their motions, and of motions in both directions `components` has their records. `pairs` is
    true if the file has such motions.
    """

    motions: Mapping[str, Record | GroundAcceleration | PairAcceleration]
    uncertain: Mapping[str, Uncertain]
    parts: Mapping[str, tuple[Part, ...]]
    pulses: Mapping[str, Pulse]
    structures: tuple[Structure, ...]
    options: RespondOptions
    components: Mapping[str, Components] = field(default_factory=dict)
    pairs: bool = False


def respond_stage(
    records_path: str | Path,
    output: str | Path,
    options: RespondOptions | None = None,
    *,
    structures_path: str | Path = SHIPPED_STRUCTURES,
    pulses_path: str | Path | None = None,
    batch: Batch = WHOLE,
    engine: Engine | None = None,
    progress: Progress = silent,
    written: WrittenArrays = unseen,
) -> tuple[InputOutcome, ...]:
    """Compute the response of each structure to each horizontal record: ``response.nc``.

    Parameters
    ----------
    records_path, output : str or Path
        Output of `ingest_stage`, and the netCDF file to write.
    options : RespondOptions, optional
        Options for structures, motions, histories and margins.
    structures_path : str or Path
        TOML file of ``[[structure]]`` tables; by default the bundled ones.
    pulses_path : str or Path, optional
        Output of `pulse_stage` for these records: adds the response to the pulse alone.
    batch : Batch
        Batch of the records; `index_stage` joins the files of all batches.
    engine : Engine, optional
        Engine of the computation; the file does not depend on it.
    progress : callable
        Called with the number of records done and in total.
    written : callable
        Called with the `Arrays` of the written file, without its histories.

    Returns
    -------
    tuple of InputOutcome
        Rejected records: a requested vertical record is missing, or its acceleration exceeds
        gravity downwards.

    Raises
    ------
    InputError
        If records, structures or pulses cannot be read, the pulses were computed from other
        samples, or the output cannot be written.
    ParameterError
        If there is no structure of that name, if a member of the ensemble does not rock, if no
        record is horizontal, or if all records are rejected.
    EngineError
        If the engine is not available.
    """
    records_path, output = Path(records_path), Path(output)
    options, structures_path = options or RespondOptions(), Path(structures_path)
    beside = [Path(pulses_path)] if pulses_path else []
    refuse_overwriting([output], [records_path, structures_path, *beside])
    structures = choose_structures(structures_path, options.structure)
    require_possible(structures, options.ensemble)
    left_out: dict[str, str] = {}
    with open_records(records_path) as file:
        names = batch.of(horizontal(file))
        both = options.both_directions and computed_in_both_directions(structures)
        pairs = pairs_of(file) if both else {}
        motions = _motions(file, names, options, left_out, pairs)
        pulses = _Pulses.read(next(iter(beside), None), names, horizontal(file))
        tasks = Counted(
            _tasks(motions, tuple(structures), options, pulses, bool(pairs)),
            math.ceil(
                (2 if pairs else 1) * file.samples(names) * len(structures) / _nodes(options)
            ),
        )
        every = _with_pairs(names, pairs)
        answers = chain.from_iterable(map_tasks(_rows, tasks, engine=engine))
        dataset = write_response_rows(
            (row for _, row in accepted(answers, every, batch, left_out, progress)),
            structures,
            output,
            input_sha256=input_hash(records_path, structures_path, *beside),
            parameters=options.stated()
            | {
                "structures": [structure.name for structure in structures],
                "pulses": pulses_path is not None,
            }
            | ({"pairs": True} if pairs else in_one_plane_alone(structures, both)),
            left_out=left_out,
            batch=batch.stated,
            motions=file.most_parts,
        )
    written(dataset)
    warn_of_idle_contact(options.ensemble, bool(pairs))
    _warn_of_motion(dataset)
    return tuple(InputOutcome(name, left_out[name]) for name in every if name in left_out)


def foresee_respond(options: RespondOptions, structures: Sequence[StructureTable]) -> None:
    """Raise the errors of `respond_stage` that need no record.

    Of thousands of structures, whose members would take minutes, only those are tried with their
    members that are the first of which members are impossible.
    """
    chosen = made_structures(structures, options.structure)
    require_possible(chosen, None)
    require_possible(most_critical(chosen, _TRIED), options.ensemble)


def _warn_of_motion(response: Arrays) -> None:
    """Warn of structures that do not rest when a motion of a sequence begins."""
    for row in part_rows(response):
        if row["start_rotation_ratio"] > 0.0:
            part = Part(row["motion_id"], row["start_s"], row["end_s"])
            words = not_at_rest(row["structure"], part, row["start_rotation_ratio"])
            warnings.warn(words, RockframeWarning, stacklevel=3)


class Pair(NamedTuple):
    """A motion of which both horizontals are recorded: its name, and all its records."""

    name: str
    records: tuple[str, ...]


def pairs_of(file: RecordsFile) -> dict[str, Pair]:
    """Return the motions with two horizontals, by the later of these in the file."""
    pairs: dict[str, Pair] = {}
    level = {*horizontal(file)}
    sequences = {*file.sequences}
    for records in file.motions:
        across = [name for name in records if name in level]
        if len(across) == 2 and not sequences.intersection(across):
            pairs[across[1]] = Pair(file.name_of_pair(across[0]), tuple(records))
    return pairs


def _with_pairs(names: Sequence[str], pairs: Mapping[str, Pair]) -> list[str]:
    """Return the names of the records, and after both components of a motion its own."""
    further = {name: [pairs[name].name] if name in pairs else [] for name in names}
    return [*chain(*([name, *further[name]] for name in names))]


def in_both(file: RecordsFile, pair: Pair, *, vertical: bool) -> BothDirections:
    """Read both components of a station.

    Raises
    ------
    ParameterError
        If they cannot be combined, or the vertical one is requested and missing.
    """
    both = file.in_both(pair.records)
    if vertical and both.vertical is None:
        raise ParameterError(WITHOUT_VERTICAL)
    return both


def _motion_in_both(file: RecordsFile, pair: Pair, options: RespondOptions) -> _Motion:
    from rockframe.wobbling import PairAcceleration  # not needed for motions in one plane

    both = in_both(file, pair, vertical=options.vertical)
    motion = PairAcceleration.from_pair(both, vertical=options.vertical)
    components = Components.of(both)
    return _Motion(pair.name, 2 * motion.x.size, motion, components=components)


def _motions(
    file: RecordsFile,
    names: Sequence[str],
    options: RespondOptions,
    left_out: dict[str, str],
    pairs: Mapping[str, Pair] = MappingProxyType({}),
) -> Iterator[_Motion]:
    """Read one record at a time, with its vertical record if requested; after the second horizontal
    of a station, both.
    """
    beside = vertical_beside(file) if options.vertical else {}
    sources = VersionSources.of(file, options.ensemble, names)
    for name in names:
        record = file.read(name)
        try:
            motion = with_vertical(record, beside) if options.vertical else record
        except ParameterError as error:
            left_out[name] = str(error)
        else:
            samples = record.acceleration.size
            yield _Motion(name, samples, motion, sources.uncertain(record), record)
        if name in pairs:
            try:
                yield _motion_in_both(file, pairs[name], options)
            except ParameterError as error:
                left_out[pairs[name].name] = str(error)


def _nodes(options: RespondOptions) -> int:
    """Return the largest number of samples times structures in a task."""
    return _NODES * (_AT_ONCE if _nominal_only(options) else 1)


def _tasks(
    motions: Iterable[_Motion],
    structures: tuple[Structure, ...],
    options: RespondOptions,
    pulses: _Pulses,
    pairs: bool,
) -> Iterator[ResponseTask]:
    held: list[_Motion] = []
    for motion in motions:
        held.append(motion)
        if sum(entry.samples for entry in held) * len(structures) >= _nodes(options):
            yield _task(held, structures, options, pulses, pairs)
            held = []
    if held:
        yield _task(held, structures, options, pulses, pairs)


def _task(
    held: Sequence[_Motion],
    structures: tuple[Structure, ...],
    options: RespondOptions,
    pulses: _Pulses,
    pairs: bool,
) -> ResponseTask:
    records = [entry.record for entry in held if entry.record is not None]
    beside: dict[str, Pulse] = {}
    for record in records:
        beside |= pulses.of(record)
    return ResponseTask(
        {entry.name: entry.motion for entry in held},
        {entry.name: entry.uncertain for entry in held if entry.uncertain is not None},
        {record.record_id: record.parts for record in records if record.parts},
        beside,
        structures,
        options,
        {entry.name: entry.components for entry in held if entry.components.records},
        pairs,
    )


@dataclass(frozen=True)
class _Pulses:
    """The pulses of a file, each with the hash of its record's samples."""

    path: Path | None
    known: Mapping[str, Pulse]
    hashes: Mapping[str, str]

    @classmethod
    def read(cls, path: Path | None, names: Sequence[str], every: Sequence[str]) -> Self:
        """Return the pulses of the records with these names, of `every` record."""
        if path is None:
            return cls(path, {}, {})
        require_pulses_of(path, every)
        pulses = loaded_pulses(path, names)
        best = {name: match.pulse for name, match in best_pulses(pulses).items()}
        return cls(path, best, sample_hashes(pulses))

    def of(self, record: Record) -> dict[str, Pulse]:
        """Return the record's pulse by name; empty if it has none."""
        if self.path is None or record.record_id not in self.known:
            return {}
        require_samples(self.path, self.hashes, record)
        return {record.record_id: self.known[record.record_id]}


def _rows(task: ResponseTask) -> list[tuple[str, WrittenRow | None, str]]:
    """Return what is written of each record, or the reason why it is rejected."""
    together = _together(task)
    if together is not None:
        return [(name, nominal_row(name, reading), "") for name, reading in together.items()]
    parameters = task.options.stated() | {"pairs": task.pairs}

    def row(name: str, responses: Sequence[StructureResponse]) -> WrittenRow:
        components = task.components.get(name, NO_COMPONENTS)
        return response_row(name, responses, parameters, components)

    return [
        (name, row(name, responses) if responses else None, reason)
        for name, responses, reason in answer_task(task)
    ]


def _nominal_only(options: RespondOptions) -> bool:
    """Return True if only nominal values are wanted: neither histories, margins nor members."""
    further = options.forces or options.vertical or options.ensemble.members > 0
    return options.histories == "none" and options.margins == "none" and not further


def _together(task: ResponseTask) -> dict[str, NominalResponses] | None:
    """Return the nominal responses to each motion, if all can be computed at once.

    A motion that is not possible is found by computing them one by one.
    """
    if not _nominal_only(task.options) or task.parts or task.pairs:
        return None
    motions = [motion for motion in task.motions.values() if isinstance(motion, Record)]
    pulses = [task.pulses.get(name) for name in task.motions]
    try:
        found = nominal_of_each(task.structures, motions, pulses)
    except ParameterError:
        return None
    return None if found is None else dict(zip(task.motions, found, strict=True))


def answer_task(task: ResponseTask) -> list[tuple[str, list[StructureResponse] | None, str]]:
    """Return the responses to each record, or the reason why it is rejected.

    Margins take most of the time and run in threads, because the kernel releases the GIL.
    """
    ensemble = task.options.ensemble
    several = {
        name: made_of.versions(ensemble, task.motions[name])  # type: ignore[arg-type]  # one plane
        for name, made_of in task.uncertain.items()
    }
    answers = on_threads(partial(_answer_one, task, several), list(task.motions))
    names = [name for name, responses, _ in answers if responses]
    if not (names and ensemble.members):
        return answers
    motions = [task.motions[name] for name in names]
    versions = [several.get(name) for name in names]
    rows = ensembles_of_each(task.structures, motions, ensemble, versions)
    of_name = dict(zip(names, rows, strict=True))
    return [
        (name, responses and _with_ensembles(responses, of_name[name]), reason)
        for name, responses, reason in answers
    ]


def _with_ensembles(
    responses: Sequence[StructureResponse], ensembles: Sequence[EnsembleResponse | None]
) -> list[StructureResponse]:
    return [
        replace(  # type: ignore[type-var]  # rule 6 of the contract
            response,
            ensemble=ensemble and ensemble.with_forces(getattr(response, "force_bands", None)),
        )
        for response, ensemble in zip(responses, ensembles, strict=True)
    ]


def _answer_one(
    task: ResponseTask, several: Mapping[str, Versions], name: str
) -> tuple[str, list[StructureResponse] | None, str]:
    shaking = Shaking(
        task.motions[name],
        task.options,
        task.parts.get(name, ()),
        task.pulses.get(name),
        several.get(name),
    )
    try:
        return name, respond_each(task.structures, shaking), ""
    except ParameterError as error:
        return name, None, str(error)


def scaled_rows(
    records_path: Path,
    scales: Sequence[float],
    options: RespondOptions | None = None,
    *,
    structures_path: Path = SHIPPED_STRUCTURES,
    records: Sequence[str] = (),
    progress: Progress = silent,
) -> tuple[list[Row], tuple[InputOutcome, ...]]:
    """Return the peaks and shares of the structures under each record at several scales.

    Parameters
    ----------
    records_path, structures_path : Path
        Output of `ingest_stage`, and TOML file of ``[[structure]]`` tables.
    scales : sequence of float
        Factors on the accelerations [1].
    options : RespondOptions, optional
        Structure, vertical component and ensemble.
    records : sequence of str
        Names of records; by default all horizontal ones.
    progress : callable
        Called with the number of records done and in total.

    Returns
    -------
    list of dict
        A row for each record, structure and scale, with the columns of `response_rows` for
        verdict, peaks, shares and bands; without an ensemble, those of the stated structure.
    tuple of InputOutcome
        Rejected records, for the reasons of `respond_stage`, at the largest scale.

    Raises
    ------
    InputError
        If records or structures cannot be read.
    ParameterError
        If there is no structure or horizontal record of a name.
    """
    options = options or RespondOptions()
    structures = choose_structures(structures_path, options.structure)
    left_out: dict[str, str] = {}
    rows: list[Row] = []
    with open_records(records_path) as file:
        names = horizontal(file)
        for name in records:
            require_known("record", name, names)
        names = [name for name in names if name in records] if records else names
        for done, held in enumerate(_motions(file, names, options, left_out)):
            motion = as_ground(held.motion)  # type: ignore[arg-type]  # without pairs
            made_of = held.uncertain
            versions = made_of.versions(options.ensemble, motion) if made_of else None
            try:
                rows += _at_scales(held.name, motion, structures, scales, options, versions)
            except ParameterError as error:
                left_out[held.name] = str(error)
            progress(done + 1, len(names))
    return rows, tuple(InputOutcome(name, left_out[name]) for name in left_out)


def _at_scales(
    name: str,
    ground: GroundAcceleration,
    structures: Sequence[Structure],
    scales: Sequence[float],
    options: RespondOptions,
    versions: Versions | None,
) -> Iterator[Row]:
    """Yield the rows of one record, by structure and scale."""
    grounds = [ground.scaled(scale) for scale in scales]
    every = [None if versions is None else versions.scaled(scale) for scale in scales]
    ensemble = options.ensemble
    alone = options.replaced(margins="none", forces=False, histories="none")
    spread = ensembles_of_each(structures, grounds, ensemble, every) if ensemble.members else None
    nominal = [respond_each(structures, Shaking(motion, alone)) for motion in grounds]
    for k, structure in enumerate(structures):
        for j, scale in enumerate(scales):
            response, members = nominal[j][k], spread[j][k] if spread else None
            row: Row = {
                "record_id": name,
                "structure": structure.name,
                "scale": float(scale),
                "verdict": response.verdict.name.lower(),
                **{
                    quantity.column(): getattr(response, quantity.name, math.nan)
                    for quantity in PEAKS
                },
                "overturning_time_s": getattr(response, "overturning_time", math.nan),
                **(ensemble_cells(members) if members else {}),
            }
            yield row | {"verdict_words": spread_verdict(row).words}


def with_vertical(record: Record, beside: Mapping[str, Record]) -> GroundAcceleration:
    """Return the ground motion of a record with its vertical component.

    Parameters
    ----------
    record : Record
        The horizontal record.
    beside : mapping of str to Record
        Result of `vertical_beside`.

    Raises
    ------
    ParameterError
        If there is no vertical record.

    Examples
    --------
    >>> record = Record(record_id="shake", acceleration=[0.0, 1.0], time_step=0.1)
    >>> upwards = Record(record_id="up", acceleration=[0.0, 2.0], time_step=0.1)
    >>> with_vertical(record, {"shake": upwards}).vertical.tolist()
    [[0.0, 20.0]]
    """
    upward = beside.get(record.record_id)
    if upward is None:
        raise ParameterError(WITHOUT_VERTICAL)
    sign = -1.0 if upward.orientation is Orientation.DOWNWARD else 1.0
    across = GroundAcceleration.from_samples(record.acceleration, record.time_step)
    return across.with_vertical(
        GroundAcceleration.from_samples(sign * upward.acceleration, upward.time_step)
    )
