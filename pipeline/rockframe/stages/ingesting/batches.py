"""Batches of record files: each writes a shard, and an index opens them as one file of records.

What depends on files of several batches is decided by the index, as if all were read at once: which
file keeps an identifier that several claim, the corner that both horizontals of a motion share, and
RotD of both. A batch whose records it changes is read again.
"""

from __future__ import annotations

import hashlib
import io
import json
import shutil
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing
from dataclasses import astuple, dataclass, field, replace
from functools import cache
from itertools import chain
from pathlib import Path
from typing import Any, Self

import numpy as np

from rockframe.cells import write_table
from rockframe.components import Channel, motions_of
from rockframe.errors import InputError
from rockframe.ingest.collection import Claim, Claims, Owners
from rockframe.ingest.files import looked_into
from rockframe.options.ingest import Filters, IngestOptions
from rockframe.outcome import STATUSES, InputOutcome
from rockframe.provenance import make_folder, refuse_overwriting, scratch_folder, whole_file
from rockframe.record import Orientation, Record
from rockframe.results.records import (
    RecordRow,
    RecordsFile,
    channels_of,
    open_records,
    rotd_columns,
    rotd_of_motions,
    write_records,
)
from rockframe.results.schema import RECORDS
from rockframe.results.schema.arrays import Array
from rockframe.results.schema.records import RECORDS_NC
from rockframe.results.shards import INGESTED, opened_arrays
from rockframe.results.stored import attributes_of
from rockframe.results.tables.entries import entry_rows
from rockframe.results.writing import write_index
from rockframe.signals.corner import Corner, CornerSource
from rockframe.stages.common import Batch
from rockframe.stages.ingesting.acceptance import (
    Acceptance,
    CornerOf,
    Order,
    in_order,
    inspected,
    nothing_accepted,
    other_corners,
    require_selected,
)
from rockframe.stages.ingesting.request import Request, warn_of_idle_options


@dataclass(frozen=True)
class Settled:
    """Identifiers and corners of a batch that follow from the files of other batches.

    Parameters
    ----------
    owners : dict
        Identifiers in use by files of earlier batches.
    corners : mapping of str to Corner
        Corners of records whose other horizontal is in another batch, by identifier.
    """

    owners: Owners = field(default_factory=dict)
    corners: Mapping[str, Corner | None] = field(default_factory=dict)


@dataclass(frozen=True)
class _Notes:
    """Outcomes of the files of a batch, from which the index settles what depends on others.

    Parameters
    ----------
    listing : str
        Hash of the names of the files of all batches.
    lines : list of str
        Header and rows of the list of inputs, in the order of the files.
    outcomes : list of InputOutcome
        The same without passports.
    claims : list of (Claim, list of str or str)
        Identifiers that files ask for, and those that they got, or why they got none.
    order : list of CornerOf or None
        Each input in order, with the corner of a record.
    """

    listing: str
    lines: list[str]
    outcomes: list[InputOutcome]
    claims: Claims
    order: Order

    def text(self) -> str:
        """Return all of it as JSON."""
        return json.dumps(
            {
                "listing": self.listing,
                "lines": self.lines,
                "outcomes": [astuple(outcome) for outcome in self.outcomes],
                "claims": [[astuple(claim), granted] for claim, granted in self.claims],
                "order": [row and astuple(row) for row in self.order],
            }
        )

    @classmethod
    def of(cls, path: Path, batch: Batch) -> Self:
        """Read the notes in the file of a batch.

        Raises
        ------
        InputError
            If the file cannot be read, has no notes, or is that of another batch.
        """
        attrs = attributes_of(path, RECORDS)
        if attrs.get("batch") != batch.stated:
            number = attrs.get("batch", "1/1")
            raise InputError(path, f"is batch {number}. Must be batch {batch.stated} here.")
        try:
            held = json.loads(attrs[INGESTED])
            return cls(
                held["listing"],
                held["lines"],
                [InputOutcome(*values) for values in held["outcomes"]],
                [(Claim(tuple(names), *of), granted) for (names, *of), granted in held["claims"]],
                [row and _corner_of(*row) for row in held["order"]],
            )
        except (KeyError, TypeError, ValueError):
            must = "Must be a batch of record files, as a run of several batches writes it."
            raise InputError(path, f"says nothing of its record files. {must}") from None


def _corner_of(
    channel: Sequence[Any], upright: bool, own: Sequence[Any] | None, used: Sequence[Any] | None
) -> CornerOf:
    read = Channel(*channel)
    read = read._replace(orientation=Orientation(read.orientation))
    return CornerOf(read, upright, _corner(own), _corner(used))


def _corner(values: Sequence[Any] | None) -> Corner | None:
    return None if values is None else Corner(values[0], CornerSource(values[1]))


def ingest_batch(
    paths: Sequence[Path],
    output: Path,
    options: IngestOptions,
    filters: Filters,
    batch: Batch,
    *,
    settled: Settled = Settled(),
    progress: Callable[[str], None] | None = None,
    workers: int | None = None,
) -> tuple[InputOutcome, ...]:
    """Read a batch of record files into a file of their records, as `ingest_stage` reads all.

    Parameters
    ----------
    paths : sequence of Path
        Files and folders of all batches.
    output : Path
        The netCDF file to write; without an accepted record it has no variables.
    options : IngestOptions
        Options of reading and processing: without rotation and sequences. Strictness is left to
        the index.
    filters : Filters
        Filters of accepted records.
    batch : Batch
        The batch of the files, in the order of `sources_of`.
    settled : Settled
        What follows from other batches; by default nothing.
    progress, workers
        As for `ingest_stage`.

    Returns
    -------
    tuple of InputOutcome
        The rejected records and files.

    Raises
    ------
    InputError
        If a path does not exist, or the output would replace an input or cannot be written.
    """
    asked = Request.of(paths, options, filters, (), look=False)
    listing = _listing(asked)
    hashes = asked.hashes()  # of the catalogues of all files
    part = replace(asked, sources=tuple(map(looked_into, batch.of(asked.sources))))
    refuse_overwriting([output], [source.path for source in part.sources if source.is_read])
    acceptance = Acceptance(
        *(output, filters), strict=False, listed=None, factors=asked.factors, whole=False
    )
    claims: Claims = []
    order: Order = []
    notes: dict[str, str] = {}
    with closing(
        part.readings(progress, workers=workers, owners=settled.owners, claims=claims)
    ) as readings:

        def rows() -> Iterator[RecordRow]:
            yield from acceptance.passed(
                inspected(readings, options, asked.checks, stated=settled.corners, order=order)
            )
            outcomes = acceptance.outcomes
            without = [replace(outcome, passport=None) for outcome in outcomes]
            notes[INGESTED] = _Notes(listing, _lines(outcomes), without, claims, order).text()

        write_records(
            rows(),
            output,
            input_sha256=hashes,
            parameters=asked.parameters,
            spectral_periods=options.spectral_periods_s or (),
            batch=batch.stated,
            attrs=notes,
        )
    return tuple(outcome for outcome in acceptance.outcomes if outcome.status == "rejected")


def _listing(asked: Request) -> str:
    """Return a hash of the names of all files, which batches divide."""
    names = json.dumps([source.name for source in asked.sources])
    return hashlib.sha256(names.encode()).hexdigest()


def _lines(outcomes: Sequence[InputOutcome]) -> list[str]:
    """Return the header and the rows of the list of inputs as CSV; nothing without rows."""
    lines: list[str] = []
    for row in entry_rows(outcomes):
        stream = io.StringIO(newline="")
        write_table(stream, [row])
        header, line = stream.getvalue().split("\n", 1)  # names of columns have no line end
        lines += [line] if lines else [f"{header}\n", line]
    return lines


def index_batches(
    parts: Sequence[Path],
    output: Path,
    paths: Sequence[Path],
    options: IngestOptions,
    filters: Filters,
    again: Path,
    *,
    progress: Callable[[str], None] | None = None,
    workers: int | None = None,
) -> tuple[InputOutcome, ...]:
    """Write the index of the files of `ingest_batch`, and the list of all inputs beside it.

    Records, values and list are those of one `ingest_stage` for all files.

    Parameters
    ----------
    parts : sequence of Path
        Files of the batches, in order.
    output : Path
        The index to write.
    paths, options, filters
        As for the batches.
    again : Path
        Folder for the files of batches that are read again, because of files in others or because
        files were added or removed meanwhile.
    progress, workers
        As for the batches, for those that are read again.

    Returns
    -------
    tuple of InputOutcome
        The rejected records and files.

    Raises
    ------
    InputError
        If a file is missing, corrupted or of another run, if no record was accepted, or if the
        options are strict and a record was rejected.
    ParameterError
        If a record of the selection was not accepted.
    """
    notes = [_Notes.of(path, Batch(k, len(parts))) for k, path in enumerate(parts, 1)]

    def read_again(output: Path, batch: Batch, settled: Settled) -> None:
        given = (paths, output, options, filters, batch)
        ingest_batch(*given, settled=settled, progress=progress, workers=workers)

    joint = _Joint([*parts], notes, again, read_again)
    joint.settle(_listing(Request.of(paths, options, filters, (), look=False)))
    outcomes = [outcome for notes in joint.notes for outcome in notes.outcomes]
    first = next((outcome for outcome in outcomes if outcome.status == "rejected"), None)
    if options.strict and first is not None:
        raise InputError(first.file, first.reason, first.line)
    rows, table = in_order(outcomes), output.with_suffix(".csv")
    if not any(outcome.status == "accepted" for outcome in outcomes):
        if len(rows) > 1:
            _write_list(joint.notes, table)
        raise nothing_accepted(rows)
    require_selected(Request((), options, filters).factors, outcomes)
    own = _own_values(joint.parts, options.spectral_periods_s or ())
    write_index(joint.parts, output, RECORDS, own)
    _write_list(joint.notes, table)
    warn_of_idle_options(options, own["source_format"].values.tolist(), rows)
    return tuple(row for row in rows if row.status == "rejected")


@dataclass
class _Joint:
    """The batches together; those that depend on others are read again."""

    parts: list[Path]
    notes: list[_Notes]
    again: Path
    read: Callable[[Path, Batch, Settled], None]

    def settle(self, listing: str) -> None:
        """Settle identifiers first, because motions depend on them, and then corners.

        A batch that was divided from files of another `listing` is read again before.
        """
        try:
            if self.again.is_dir():
                shutil.rmtree(self.again)
            make_folder(self.again)
        except OSError as error:
            raise InputError(self.again, f"cannot be written: {error.strerror}.") from None
        for number, notes in enumerate(self.notes):
            if notes.listing != listing:  # else a file could be in no batch, or in two
                self._read_again(number, Settled())
        self._settle_corners(self._settle_identifiers())

    def _settle_identifiers(self) -> list[Owners]:
        """Return the identifiers in use by files before each batch."""
        owners: Owners = {}
        before: list[Owners] = []
        for number, notes in enumerate(self.notes):
            before.append(dict(owners))
            granted = [claim.granted(owners) for claim, _ in notes.claims]
            if granted != [got for _, got in notes.claims]:
                self._read_again(number, Settled(before[number]))
        return before

    def _settle_corners(self, before: Sequence[Owners]) -> None:
        of_batch = np.repeat(range(len(self.notes)), [len(notes.order) for notes in self.notes])
        order = [row for notes in self.notes for row in notes.order]
        corners: defaultdict[int, dict[str, Corner | None]] = defaultdict(dict)
        for place, corner in other_corners(order).items():
            record = order[place]
            if record is not None:
                corners[int(of_batch[place])][record.channel.record_id] = corner
        for number, of_records in corners.items():
            self._read_again(number, Settled(before[number], of_records))

    def _read_again(self, number: int, settled: Settled) -> None:
        """Read a batch again, with what the others settle."""
        output = self.again / self.parts[number].name
        batch = Batch(number + 1, len(self.parts))
        self.read(output, batch, settled)
        self.parts[number], self.notes[number] = output, _Notes.of(output, batch)


def _write_list(of_batches: Sequence[_Notes], path: Path) -> None:
    """Write the list of all inputs, sorted by status, from the lines of the batches."""
    listed = [notes.lines for notes in of_batches if notes.lines]
    header = max((lines[0] for lines in listed), key=len)
    # the list of a batch without records lacks the columns of the checks
    blanks = ["," * (header.count(",") - lines[0].count(",")) + "\n" for lines in listed]
    pairs = zip(listed, blanks, strict=True)
    lines = [f"{line[:-1]}{blank}" for of, blank in pairs for line in of[1:]]
    outcomes = chain.from_iterable(notes.outcomes for notes in of_batches)
    statuses = [STATUSES.index(outcome.status) for outcome in outcomes]
    with whole_file(path) as partial, partial.open("w", newline="", encoding="utf-8") as stream:
        stream.write(header)
        stream.writelines(lines[place] for place in np.argsort(statuses, kind="stable"))


def _own_values(parts: Sequence[Path], periods: Sequence[float]) -> dict[str, Array]:
    """Return all values of the records in the files of batches except their samples.

    RotD of motions with records in several batches is computed here.
    """
    of_batches = [values for values in map(_values_of, parts) if values]
    own = {
        name: Array.of(
            first.dims,
            np.concatenate([values[name].values for values in of_batches]),
            first.attrs,
        )
        for name, first in of_batches[0].items()
    }
    channels, computed = channels_of(own), _computed_rotd(of_batches)
    with ExitStack() as stack:

        @cache
        def file() -> RecordsFile:
            folder = stack.enter_context(scratch_folder())
            write_index(parts, folder / "records.nc", RECORDS, own)
            return stack.enter_context(open_records(folder / "records.nc"))

        def record(row: int) -> Record:
            return file().read(channels[row].record_id)

        rotd = rotd_of_motions(channels, record, periods, computed)
    columns = rotd_columns([channel.record_id for channel in channels], rotd, len(periods))
    return own | {name: RECORDS_NC[name].holding(column) for name, column in columns.items()}


def _computed_rotd(
    of_batches: Sequence[Mapping[str, Array]],
) -> dict[tuple[int, ...], dict[str, dict[str, Any]]]:
    """Return RotD of the motions of each batch by the places of their records among all."""
    computed: dict[tuple[int, ...], dict[str, dict[str, Any]]] = {}
    start = 0
    for values in of_batches:
        names = values["record_id"].values.tolist()
        columns = {
            name: variable.values.tolist()
            for name, variable in values.items()
            if "rotd" in name or name == "unpaired"
        }
        for rows in motions_of(channels_of(values)):
            computed[tuple(start + row for row in rows)] = {
                names[row]: {name: column[row] for name, column in columns.items()} for row in rows
            }
        start += len(names)
    return computed


def _values_of(path: Path) -> dict[str, Array]:
    """Return the values by record of the file of a batch, by variable; nothing without records."""
    with opened_arrays(path, RECORDS, empty=True) as arrays:
        held = arrays.without("obs").loaded().variables
        return {name: variable for name, variable in held.items() if "record" in variable.dims}
