"""Compare rocking bridges with alternative systems under each record, and write compare.nc."""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Callable, Collection, Hashable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from rockframe.engines.engine import Engine, map_tasks
from rockframe.errors import InputError, ParameterError, require_known
from rockframe.frame import RockingFrame
from rockframe.options.ingest import Filters
from rockframe.options.respond import BridgeEnsemble
from rockframe.outcome import InputOutcome
from rockframe.provenance import refuse_overwriting, whole_file
from rockframe.record import Record
from rockframe.results.pulses import read_metadata
from rockframe.results.records import RecordsFile, open_records
from rockframe.results.response import furthest_pairs, read_histories, write_comparison
from rockframe.results.versions import Uncertain, VersionSources
from rockframe.results.writing import input_hash
from rockframe.rivals import FixedFrame, IsolatedDeck
from rockframe.stages.common import (
    WHOLE,
    Batch,
    Counted,
    NamedFigure,
    Progress,
    WrittenArrays,
    accepted,
    filtered_by,
    horizontal,
    in_one_plane_alone,
    silent,
    unseen,
)
from rockframe.structures.comparison import Rivals, compare
from rockframe.structures.contract import Compared, require_possible
from rockframe.study.frames import StructureEntry
from rockframe.study.structures import (
    CompareEntry,
    FixedEntry,
    StructureTable,
    read_bridges,
)
from rockframe.study.toml import line_of, read_text


def compare_stage(
    records_path: str | Path | Sequence[str | Path],
    output: str | Path,
    structures_path: str | Path,
    options: CompareEntry | None = None,
    *,
    against: Collection[str] | None = None,
    structure: str | None = None,
    filters: Filters | None = None,
    batch: Batch = WHOLE,
    engine: Engine | None = None,
    progress: Progress = silent,
    written: WrittenArrays = unseen,
) -> tuple[InputOutcome, ...]:
    """Compute each structure and its alternatives under each horizontal record: ``compare.nc``.

    Parameters
    ----------
    records_path : str or Path, or sequence of them
        Output of `ingest_stage`, or several of them without common records.
    output : str or Path
        The netCDF file to write.
    structures_path : str or Path
        TOML file of ``[[structure]]`` tables, and of ``[compare]`` tables of the alternatives.
    options : CompareEntry, optional
        The alternatives; replaces the tables of the file.
    against : collection of str, optional
        Only these alternatives: restrained, hybrid, isolated, fixed.
    structure : str, optional
        Only the structure of this name.
    filters : Filters, optional
        Only records that pass these filters.
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
        Records that could not be computed. The attribute ``left_out`` of the file also has those
        outside the filters.

    Raises
    ------
    InputError
        If records or structures cannot be read, a record is in two files, the output cannot be
        written, or an alternative is not stated.
    ParameterError
        If there is no structure of that name or no alternative, a structure is a column alone, or
        no record is left.
    EngineError
        If the engine is not available.
    """
    given = [records_path] if isinstance(records_path, str | Path) else records_path
    paths, output, structures_path = [*map(Path, given)], Path(output), Path(structures_path)
    refuse_overwriting([output], [*paths, structures_path])
    entries, of_file = read_bridges(structures_path)
    common = options or of_file
    compared = _compared(structures_path, entries, common, against, structure)
    filters = filters or Filters()
    filtered, left_out = _filtered(paths, filters), dict[str, str]()
    with ExitStack() as stack:
        files = [stack.enter_context(open_records(path)) for path in paths]
        chosen = [[name for name in horizontal(file) if name not in filtered] for file in files]
        names = [name for some in chosen for name in some]
        if not names:
            name, reason = next(iter(filtered.items()))
            raise ParameterError(f"no record is left to compare; {name!r}: {reason}.")
        names = batch.of(names)
        of_batch = {*names}
        chosen = [[name for name in some if name in of_batch] for some in chosen]
        tasks = Counted(_tasks(files, chosen, tuple(compared), common.ensemble), len(names))
        answers = map_tasks(_answer, tasks, engine=engine)
        dataset = write_comparison(
            accepted(answers, names, batch, left_out, progress),
            [rivals.frame for rivals in compared],
            output,
            input_sha256=input_hash(*paths, structures_path),
            parameters={"against": list(compared[0].models)[1:], "structure": structure}
            | {"ensemble": common.ensemble.stated(), "filters": filters.bounds()}
            | in_one_plane_alone([rivals.frame for rivals in compared], True),
            left_out=ChainMap(left_out, filtered),
            batch=batch.stated,
        )
    written(dataset)
    return tuple(InputOutcome(name, left_out[name]) for name in names if name in left_out)


def _compared(
    path: Path,
    entries: Sequence[StructureTable],
    common: CompareEntry,
    against: Collection[str] | None,
    structure: str | None,
) -> list[Rivals]:
    """Return the models of each requested rocking frame."""
    frames = _frames(entries)
    if structure is not None:
        require_known("structure", structure, [frame.name for frame in frames])
    compared: list[Rivals] = []
    for entry in frames:
        if structure not in (None, entry.name):
            continue
        try:
            compared.append(_next_rivals(compared, entry, common, against))
        except ParameterError as error:
            line = line_of(read_text(path), ("structure", entries.index(entry)))
            raise InputError(path, str(error), line) from None
    return compared


def _frames(entries: Sequence[StructureTable]) -> list[StructureEntry]:
    """Return the rocking frames; other structures of a file are rivals of none.

    Raises
    ------
    ParameterError
        If there is none.
    """
    frames = [entry for entry in entries if isinstance(entry, StructureEntry)]
    if not frames:
        kinds = ", ".join(f"{entry.name!r} is {entry.kind}" for entry in entries[:3])
        raise ParameterError(f"No rocking frame to compare: {kinds}. State one of kind rocking.")
    return frames


def foresee_compare(options: CompareEntry, structures: Sequence[StructureTable]) -> None:
    """Raise the errors of `compare_stage` that need no record."""
    compared: list[Rivals] = []
    for entry in _frames(structures):
        compared.append(_next_rivals(compared, entry, options))
    models = [model for rivals in compared for model in rivals.models.values()]
    require_possible(models, options.ensemble)


def _next_rivals(
    found: Sequence[Rivals],
    entry: StructureEntry,
    common: CompareEntry,
    against: Collection[str] | None = None,
) -> Rivals:
    """Return the models of a structure; all structures must have the same."""
    rivals = _rivals_of(entry, common, against or common.against or ())
    _require_same_rivals([*found, rivals])
    return rivals


def _filtered(paths: Sequence[Path], filters: Filters) -> dict[str, str]:
    """Return the reasons why records are filtered out; a record in two files is an error."""
    source: dict[str, Path] = {}
    reasons: dict[str, str] = {}
    for path in paths:
        metadata = read_metadata(path, None)
        for row, name in enumerate(metadata.names):
            if name in source:
                raise InputError(
                    path, f"has record {name!r}, which {source[name]} has too. Leave out one file."
                )
            source[name] = path
            numbers = {key: float(values[row]) for key, values in metadata.numbers.items()}
            reason = filtered_by(filters, numbers, metadata.texts["site"][row])
            if reason:
                reasons[name] = reason
    return reasons


@dataclass(frozen=True)
class _Task:
    """A record, the data of its other versions, and the models of each structure."""

    name: str
    record: Record
    made_of: Uncertain | None
    compared: tuple[Rivals, ...]
    ensemble: BridgeEnsemble


def _tasks(
    files: Sequence[RecordsFile],
    chosen: Sequence[Sequence[str]],
    compared: tuple[Rivals, ...],
    ensemble: BridgeEnsemble,
) -> Iterator[_Task]:
    """Read one record at a time."""
    for file, names in zip(files, chosen, strict=True):
        sources = VersionSources.of(file, ensemble, names)
        for name in names:
            record = file.read(name)
            yield _Task(name, record, sources.uncertain(record), compared, ensemble)


def _answer(task: _Task) -> tuple[str, list[list[Compared]] | None, str]:
    """Return the responses to a record, or the reason why it is rejected."""
    made_of, ensemble = task.made_of, task.ensemble
    versions = None if made_of is None else made_of.versions(ensemble, task.record)
    try:
        responses = [compare(rival, task.record, ensemble, versions) for rival in task.compared]
    except ParameterError as error:
        return task.name, None, str(error)
    return task.name, responses, ""


def _rivals_of(entry: StructureEntry, common: CompareEntry, against: Collection[str]) -> Rivals:
    """Return the requested alternatives of a structure; by default all that are stated."""
    whole = entry.whole()
    tendon, dissipater = whole.tendon or common.restrained, whole.dissipater or common.hybrid
    free, isolated = replace(whole, tendon=None, dissipater=None), entry.isolated or common.isolated
    makers: dict[str, Callable[[], RockingFrame | IsolatedDeck | FixedFrame | None]] = {
        "restrained": lambda: entry.on_pivots(replace(free, tendon=tendon)) if tendon else None,
        "hybrid": lambda: (
            entry.on_pivots(replace(free, tendon=tendon, dissipater=dissipater))
            if tendon and dissipater
            else None
        ),
        "isolated": lambda: None if isolated is None else isolated.made(),
        "fixed": lambda: _fixed(free, entry, entry.fixed or common.fixed),
    }
    if dissipater is not None and tendon is None and (not against or "hybrid" in against):
        raise ParameterError(
            f"Dissipaters of {whole.name!r} without a tendon. State a tendon in "
            "[structure.tendon] or [compare.restrained]."
        )
    rivals = {name: make() for name, make in makers.items() if not against or name in against}
    tables = {"restrained": "tendon", "hybrid": "dissipater"}
    for name in against:
        if rivals[name] is None:
            raise ParameterError(
                f"{name} bridge of {whole.name!r} not stated. State it in "
                f"[structure.{tables.get(name, name)}] or [compare.{name}]."
            )
    if not any(rivals.values()):
        raise ParameterError(
            f"No bridge to compare with {whole.name!r}. State one in [compare.isolated], "
            "[compare.fixed], [compare.restrained] or [compare.hybrid]."
        )
    return Rivals(entry.on_pivots(free), **rivals)  # type: ignore[arg-type]


def _require_same_rivals(compared: Sequence[Rivals]) -> None:
    """Reject structures with different alternatives, because the file has one list of models."""
    first, last = compared[0], compared[-1]
    if list(last.models) != list(first.models):
        here, there = (", ".join(end.models) for end in (last, first))
        raise ParameterError(
            f"{last.frame.name!r} has the models {here}, and {first.frame.name!r} {there}. "
            "Must be the same: state `against`, or one structure."
        )


def _fixed(
    frame: RockingFrame, entry: StructureEntry, fixed: FixedEntry | None
) -> FixedFrame | None:
    if fixed is None:
        return None
    circular = entry.section == "circular"
    needed = f"stated for the stiffness and mass of the fixed bridge of {frame.name!r}"
    if frame.column_mass is None:
        raise ParameterError(f"key 'column_mass_kg' or 'density_kg_m3' missing. Must be {needed}.")
    if not (circular or entry.depth_m):
        raise ParameterError(f"key 'depth_m' missing. Must be {needed}.")
    for key in ("top_width_m", "inner_width_m", "inertia_ratio", "centre_of_gravity_m"):
        if getattr(entry, key) is not None:
            raise ParameterError(
                f"{key} {getattr(entry, key)!r} of {frame.name!r}. Must be absent: columns of the "
                "fixed bridge are solid and prismatic."
            )
    return fixed.of_columns(
        height=entry.height_m,
        width=entry.width_m,
        depth=None if circular else entry.depth_m,
        column_mass=frame.column_mass,
        deck_mass=frame.mass_ratio * frame.column_mass,
    )


def comparison_figures(path: Path, most: int) -> Iterator[NamedFigure]:
    """Yield a figure of each structure under the `most` records with the largest drifts."""
    from rockframe.figures.histories import draw_comparison

    for record, structure in furthest_pairs(path, most):
        history = read_histories(path, record, structure)
        yield f"{record}-{structure}", f"{record} {structure}", draw_comparison(history)


def write_comparison_page(
    path: Path,
    title: str,
    rows: Sequence[Mapping[str, Any]],
    recordings: Mapping[str, Hashable],
    left_out: Mapping[str, str] | None = None,
    note: str = "",
) -> None:
    """Write one HTML page about a comparison: a chart of its designs, and its tables.

    Parameters
    ----------
    path : Path
        File to write.
    title : str
        Title of the page.
    rows : sequence of mapping
        Rows of `comparison_rows`.
    recordings : mapping of str to hashable
        As for `summary_rows`.
    left_out : mapping of str to str, optional
        Reasons why other records were not computed, by identifier.
    note : str
        A note below the chart, see `comparison_note`.

    Raises
    ------
    InputError
        If the page cannot be written.
    """
    from rockframe.report.comparison import render_comparison

    with whole_file(path) as partial:
        page = render_comparison(title, rows, recordings, left_out, note)
        partial.write_text(page, encoding="utf-8")
