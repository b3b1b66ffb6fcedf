"""Read the folder of a run: tables, labelled values, strips, and histories one at a time."""

from __future__ import annotations

import heapq
import io
import math
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rockframe.cells import number
from rockframe.errors import InputError
from rockframe.provenance import MANIFEST, read_manifest, sha256_of
from rockframe.results.pulses import best_pulses
from rockframe.results.records import open_records
from rockframe.results.response import strips_of
from rockframe.results.schema import PULSES, RECORDS, RESPONSE
from rockframe.results.schema.arrays import Array, Arrays
from rockframe.results.shards import opened_arrays, shards_of
from rockframe.results.stored import attributes_of
from rockframe.results.tables.entries import rows_in, rows_of
from rockframe.results.tables.forces import force_rows
from rockframe.results.tables.notes import left_out_reasons
from rockframe.results.tables.rows import LabelledValues, LabelledValuesOf, blocks, spread_verdict
from rockframe.results.tables.sensitivity import sensitivity_rows
from rockframe.results.writing import slices
from rockframe.rocking import Strip
from rockframe.rocking.verdict import SpreadVerdict, Verdict

Float = NDArray[np.float64]
#: Record and structure.
Pair = tuple[str, str]

#: Required columns of ``table.csv``.
_NEEDED: Final = (
    *("record_id", "event", "record", "structure", "verdict"),
    *("peak_rotation_ratio", "overturning_time_s"),
)


@dataclass(frozen=True)
class Run:
    """The contents of a run, without histories.

    Parameters
    ----------
    folder : Path
        Folder of the run.
    manifest : mapping
        Content of ``manifest.json``.
    manifest_sha256 : str
        Hash of that file, which identifies the run.
    counts : mapping of (str, str) to int
        Numbers of rows of ``table.csv``, by structure and kind of verdict.
    rows : tuple of mapping of str to str
        Rows of that table, one for each record and structure; or only the rows that `rank` puts
        first.
    verdicts : tuple of SpreadVerdict
        The verdict of each of these rows.
    entries : tuple of mapping of str to str
        Rows of ``records.csv``: each record and each file without a record, with the checks.
    records, structures, pairs : mapping to tuple of LabelledValue
        Values of each record and its pulse, of each structure, and of each pair of them.
    strips : mapping of (str, str) to Strip
        Strips by record and structure of the rows; empty if margins were not computed.
    spreads : mapping of (str, str) to mapping
        Rows of `sensitivity_rows` by record and structure; empty without an ensemble.
    summary : tuple of mapping of str to str
        Rows of ``summary.csv``; empty for runs of versions without it.
    forces : mapping of (str, str) to list of mapping
        Rows of `force_rows` by record and structure; empty without forces.
    listed : int
        Number of rows of ``records.csv``.
    left_out : mapping of str to str
        Reasons why accepted records have no response, by identifier.
    """

    folder: Path
    manifest: Mapping[str, Any]
    manifest_sha256: str
    counts: Mapping[tuple[str, str], int]
    rows: tuple[Mapping[str, str], ...]
    verdicts: tuple[SpreadVerdict, ...]
    entries: tuple[Mapping[str, str], ...]
    records: Mapping[str, LabelledValues]
    structures: Mapping[str, LabelledValues]
    pairs: LabelledValuesOf[Pair]
    strips: Mapping[Pair, Strip] = field(default_factory=dict)
    spreads: Mapping[Pair, Mapping[str, Any]] = field(default_factory=dict)
    summary: tuple[Mapping[str, str], ...] = ()
    forces: Mapping[Pair, Sequence[Mapping[str, Any]]] = field(default_factory=dict)
    listed: int = 0
    left_out: Mapping[str, str] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Name of the study, or of the folder if there is no study."""
        study = self.manifest["parameters"].get("study", {})
        return str(study.get("name") or self.folder.resolve().name)


def read_run(folder: Path, *, most: int | None = None, record: str | None = None) -> Run:
    """Read a run without its histories.

    Parameters
    ----------
    folder : Path
        Output of ``rockframe table1``.
    most : int, optional
        Largest number of rows of the table to keep; by default all. If it is stated and not 0, the
        run also has only the values of the records of these rows, and at most `MOST_ENTRIES` rows
        of ``records.csv`` beside theirs: rejections and warnings first.
    record : str, optional
        Read only the values of this record and of the motions of which it is a component, and no
        row of the table.

    Raises
    ------
    InputError
        If a file of the run is missing, corrupted, or of another kind.

    Examples
    --------
    >>> read_run(Path("no-such-folder"))
    Traceback (most recent call last):
    rockframe.errors.InputError: no-such-folder: no such folder. Must be the folder of a run.
    """
    manifest = read_manifest(folder)
    kept = _rows_that_are_kept(folder, most) if record is None else (Counter(), (), ())
    rows = kept[1]
    names = {row["record_id"] for row in rows}
    names |= {name for row in rows for name in row.get("components", "").split()}
    left_out = left_out_reasons(attributes_of(folder / "response.nc", RESPONSE))
    entries, listed = _entries(folder / "records.csv", {*names, *left_out} if most else None)
    with (
        opened_arrays(folder / "records.nc", RECORDS) as records,
        opened_arrays(folder / "pulses.nc", PULSES) as pulses,
        opened_arrays(folder / "response.nc", RESPONSE) as response,
    ):
        if record is not None:
            names = {n for n, of in motions_of(response).items() if record in (n, *of)} | {record}
        if most or record is not None:
            records, pulses, response = (
                _some(record, names) for record in (records, pulses, response)
            )
        return Run(
            folder,
            manifest,
            sha256_of(folder / MANIFEST),
            *kept,
            entries,
            LabelledValuesOf(records, pulses, keys=["record_id"]),
            LabelledValuesOf(with_parameters(response), keys=["structure"]),
            LabelledValuesOf(response, keys=["record_id", "structure"]),
            strips_of(response, names),
            {(row["record_id"], row["structure"]): row for row in sensitivity_rows(response)},
            tuple(rows_of(folder / "summary.csv")),
            {
                pair: list(rows)
                for pair, rows in groupby(
                    force_rows(response), lambda row: (row["record_id"], row["structure"])
                )
            },
            listed,
            left_out,
        )


#: Number of neighbouring records of an index that are read together.
_TOGETHER: Final = 64


def motions_of(response: Arrays) -> dict[str, list[str]]:
    """Return the names of the motions of responses, with their components; none of one record."""
    if "record_id" not in response:
        return {}
    names = [str(name) for name in response["record_id"].values]
    both = response["components"].values if "components" in response else [""] * len(names)
    return {name: str(of).split() for name, of in zip(names, both, strict=True)}


def with_parameters(response: Arrays) -> Arrays:
    """Return a dataset with a variable for each property of structures that do not rock."""
    if "parameter" not in response:
        return response
    names, units, labels = (
        map(str, response[name].values)
        for name in ("parameter", "parameter_units", "parameter_label")
    )
    values = response["parameter_value"].values.T
    further = {
        f"parameter_{name}": Array.of(["structure"], column, {"units": unit, "long_name": label})
        for name, unit, label, column in zip(names, units, labels, values, strict=True)
    }
    return response.with_variables({**response.variables, **further})


def _some(dataset: Arrays, names: Collection[str]) -> Arrays:
    """Return the values of some records, without series; of an index, those of a shard together."""
    places = [k for k, name in enumerate(dataset["record_id"].values) if str(name) in names]
    own = dataset.without("obs")
    if not shards_of(dataset.attrs):
        return own.isel(record=places)
    groups = [[*group] for _, group in groupby(places, lambda place: place // _TOGETHER)]
    parts = [own.isel(record=group).loaded() for group in groups or [[]]]
    return parts[0].with_variables(
        {name: _joined([part[name] for part in parts]) for name in own.variables}
    )


def _joined(parts: Sequence[Array]) -> Array:
    """Return the values of groups of records, one after another; what all share is in the first."""
    first = parts[0]
    if "record" not in first.dims:
        return first
    axis = first.dims.index("record")
    values = np.concatenate([part.values for part in parts], axis=axis)
    return Array.of(first.dims, values, first.attrs)


#: Largest number of records and files that a page lists with their checks.
MOST_ENTRIES: Final = 2000


def concern(entry: Mapping[str, str]) -> int:
    """Return 0 for a row of ``records.csv`` that was rejected, 1 for a warning, and 2 for others.

    Examples
    --------
    >>> concern({"status": "accepted", "passport": "warn"})
    1
    """
    said = {"rejected": 0, "left out": 0, "unread": 0}
    return said.get(entry["status"], 1 if entry["passport"] == "warn" else 2)


def _entries(path: Path, names: Collection[str] | None) -> tuple[tuple[dict[str, str], ...], int]:
    """Return the rows of these records and the `MOST_ENTRIES` rows of most concern, or all rows if
    no names are stated; and the number of all rows.
    """
    if names is None:
        every = tuple(_rows(path))
        return every, len(every)
    first: list[tuple[int, int, dict[str, str]]] = []
    entries: dict[int, dict[str, str]] = {}
    count = 0
    for count, entry in enumerate(_rows(path), 1):
        if entry["record_id"] in names:
            entries[count] = entry
        # counts differ, so that entries are not compared
        heapq.heappush(first, (-concern(entry), -count, entry))
        if len(first) > MOST_ENTRIES:
            heapq.heappop(first)
    entries |= {-place: entry for _, place, entry in first}
    return tuple(entries[place] for place in sorted(entries)), count


def rank(row: Mapping[str, str]) -> tuple[int, float]:
    """Return the sort key of a row of the table: rows of most interest first.

    The order is: structures that nominally rock and stand, by decreasing rotation, before those of
    kinds that do not rock; then structures that nominally overturn; then structures that never
    uplift, and those that were not computed.

    Examples
    --------
    >>> rows = [{"verdict": v, "peak_rotation_ratio": p} for v, p in
    ...         (("no_uplift", "0.0"), ("stands", "0.2"), ("overturns", "9.0"), ("stands", "0.9"))]
    >>> [row["peak_rotation_ratio"] for row in sorted(rows, key=rank)]
    ['0.9', '0.2', '9.0', '0.0']
    """
    kind = {"stands": 0, "overturns": 1, "no_uplift": 2}.get(row["verdict"], 3)
    rotation = number(row["peak_rotation_ratio"])
    return kind, 0.0 if math.isnan(rotation) else -rotation


def _rows_that_are_kept(
    folder: Path, most: int | None
) -> tuple[Counter[tuple[str, str]], tuple[dict[str, str], ...], tuple[SpreadVerdict, ...]]:
    """Return the number of verdicts of each structure by kind; all rows of the table, or those that
    `rank` puts first, in the order of the table; and the verdict of each of them.
    """
    table = folder / "table.csv"
    with opened_arrays(folder / "response.nc", RESPONSE, empty=True) as response:
        pairs = response.sizes.get("record", 0) * response.sizes.get("structure", 0)
        if most is None or pairs <= most:
            rows = tuple(_checked(_rows(table), table))
            verdicts = tuple(_verdict(row, table) for row in rows)
            kinds = zip(rows, verdicts, strict=True)
            counts: Counter[tuple[str, str]] = Counter(
                (row["structure"], verdict.kind) for row, verdict in kinds
            )
            return counts, rows, verdicts
        counts, places = _ranked(response, most)
    rows = tuple(_checked(_lines_at(table, places, pairs), table))
    return counts, rows, tuple(_verdict(row, table) for row in rows)


#: Variables that the number of verdicts by kind and the rank of a pair follow from.
_RANKED_BY: Final = ("verdict", "peak_rotation_ratio", "share_overturned", "share_uplifted")
#: Largest number of pairs of the motions of which a page has rows.
_MOST_PAIRS: Final = 2**19


def _ranked(response: Arrays, most: int) -> tuple[Counter[tuple[str, str]], NDArray[np.int64]]:
    """Count the verdicts of each structure, and return the places of the pairs that `rank` puts
    first, among all pairs in the order of the table.

    They are fewer than `most` if all pairs of their motions would not fit in memory.
    """
    structures = [str(name) for name in response["structure"].values]
    counts: Counter[tuple[str, str]] = Counter()
    best = np.empty((3, 0))
    start = 0
    ranked_by = {name: response[name] for name in _RANKED_BY if name in response}
    chosen = response.with_variables(ranked_by)
    for part in blocks(chosen):
        arrays = {str(name): variable.values for name, variable in part.variables.items()}
        _count_kinds(arrays, structures, counts)
        kind = arrays["verdict"].ravel().astype(float)
        order = np.select([kind == verdict.value for verdict in _RANKS], range(len(_RANKS)), 3)
        rotation = -np.nan_to_num(arrays["peak_rotation_ratio"].ravel(), nan=0.0, posinf=np.inf)
        keys = np.array([order, rotation, start + np.arange(kind.size)])
        best = np.concatenate([best, keys], axis=1)
        best = best[:, np.lexsort(best[::-1])[:most]]
        start += kind.size
    places = best[2].astype(np.int64)
    _, first_seen = np.unique(places // len(structures), return_index=True)
    motions = max(1, _MOST_PAIRS // len(structures))
    end = np.append(np.sort(first_seen), places.size)[min(motions, first_seen.size)]
    return counts, np.sort(places[:end])


#: Verdicts in the order of `rank`; others follow.
_RANKS: Final = (Verdict.STANDS, Verdict.OVERTURNS, Verdict.NO_UPLIFT)


def _count_kinds(
    arrays: Mapping[str, NDArray[Any]], structures: Sequence[str], counts: Counter[tuple[str, str]]
) -> None:
    """Add the verdicts of some motions to the number of verdicts of each structure, by kind."""
    verdict = arrays["verdict"].astype(float)
    unknown = np.full(verdict.shape, math.nan)
    shares = [arrays.get(f"share_{name}", unknown) for name in ("overturned", "uplifted")]
    # NaN does not equal itself, so that each would be a case of its own
    cases, of_case = np.unique(
        np.nan_to_num([verdict, *shares], nan=-1.0).reshape(3, -1), axis=1, return_inverse=True
    )
    of_case = of_case.reshape(verdict.shape)
    for place, (value, *known) in enumerate(cases.T.tolist()):
        overturned, uplifted = (math.nan if share < 0.0 else share for share in known)
        spread = SpreadVerdict(
            Verdict(int(value)), share_overturned=overturned, share_uplifted=uplifted
        )
        numbers = (of_case == place).sum(axis=0).tolist()
        for structure, number_of_verdicts in zip(structures, numbers, strict=True):
            counts[structure, spread.kind] += number_of_verdicts


def _lines_at(path: Path, places: NDArray[np.int64], pairs: int) -> Iterator[dict[str, str]]:
    """Yield the rows of a table at some places, without parsing the others."""
    wanted, row = {*places.tolist()}, -1
    chosen: list[str] = []
    if not path.is_file():
        raise InputError(path, "missing. Restore the file as the run wrote it.")
    with path.open(newline="", encoding="utf-8") as stream:
        head = next(stream, "")
        for row, line in enumerate(stream):
            if row in wanted:
                chosen.append(line)
    if row + 1 != pairs:  # a text has several lines
        yield from (cells for k, cells in enumerate(_rows(path)) if k in wanted)
        return
    yield from rows_in(io.StringIO("".join([head, *chosen]), newline=""), path)


def _checked(rows: Iterable[dict[str, str]], path: Path) -> Iterator[dict[str, str]]:
    """Yield the rows of the table, and require its columns."""
    for place, row in enumerate(rows):
        missing = [name for name in _NEEDED if name not in row] if place == 0 else []
        if missing:
            must_be = "Use a file that this version of `rockframe table1` wrote."
            raise InputError(path, f"without column {missing[0]!r}. {must_be}")
        yield row


def _verdict(row: Mapping[str, str], path: Path) -> SpreadVerdict:
    try:
        return spread_verdict(row)
    except (KeyError, ValueError) as error:
        must_be = "Restore the file as `rockframe table1` wrote it."
        raise InputError(path, f"invalid verdict or margin {error}. {must_be}") from None


def _rows(path: Path) -> Iterator[dict[str, str]]:
    """Yield the rows of a table that every run has."""
    if not path.is_file():
        raise InputError(path, "missing. Restore the file as the run wrote it.")
    return rows_of(path)


@dataclass(frozen=True)
class Ground:
    """The motion of a record, and its selected pulse.

    Parameters
    ----------
    record : str
        Identifier of the record.
    time_step : float
        Interval between samples, from 0 [s].
    acceleration : array, shape (samples,)
        Ground acceleration [m s-2].
    pulse : array, shape (samples of the pulse,)
        Selected pulse [m s-2] over its length; empty if there is no pulse.
    pulse_start : int
        Sample of the record at which the pulse begins.
    components : tuple of str
        Records of both components, if the motion is in both directions; then the acceleration is
        the length of their vector.
    """

    record: str
    time_step: float
    acceleration: Float
    pulse: Float
    pulse_start: int
    components: tuple[str, ...] = ()


@dataclass(frozen=True)
class History:
    """The history of a structure under a record, at the samples of the record.

    Parameters
    ----------
    record, structure : str
        Names of the record and of the structure.
    theta, u, v : array, shape (samples,)
        Rotation [rad], displacement and lift of the beam [m]; NaN after overturning.
    theta_low, theta_high : array, shape (samples,)
        Envelope of the ensemble [rad]; empty without one.
    u_x, u_y : array, shape (samples,)
        Components of the displacement under a motion in both directions [m]; empty in one plane.
    """

    record: str
    structure: str
    theta: Float
    u: Float
    v: Float
    theta_low: Float
    theta_high: Float
    u_x: Float
    u_y: Float


def read_histories(folder: Path, pairs: Sequence[Pair]) -> Iterator[tuple[Ground, list[History]]]:
    """Yield the motion of each requested record, with the histories of its structures.

    Parameters
    ----------
    folder : Path
        Output of ``rockframe table1``.
    pairs : sequence of (str, str)
        Records and structures.

    Yields
    ------
    Ground, list of History
        Motions and histories in the order of response.nc. Pairs without a stored history are
        skipped.

    Raises
    ------
    InputError
        If a file is missing, corrupted, or of another kind.
    """
    wanted = set(pairs)
    if not wanted:  # the pulses of all records would be read
        return
    pulses = best_pulses(folder / "pulses.nc")
    with (
        opened_arrays(folder / "records.nc", RECORDS) as records,
        opened_arrays(folder / "response.nc", RESPONSE) as response,
    ):
        rows_of = _samples_of(records)
        steps = dict(zip(_names(records, "record_id"), records["time_step"].values, strict=True))
        kept = response["history"].values
        for i, (record, rows) in enumerate(_samples_of(response).items()):
            chosen = [
                structure
                for k, structure in enumerate(_names(response, "structure"))
                if kept[i, k] and (record, structure) in wanted
            ]
            if not chosen:
                continue
            both = _components(response, i)
            if both:
                acceleration = _length(folder / "records.nc", both)
            else:
                acceleration = records["acceleration"].isel(obs=rows_of[record]).values
            step = float(steps[both[0] if both else record])
            pulse, start = np.empty(0), 0
            if record in pulses:
                selected = pulses[record].pulse
                time = step * np.arange(acceleration.size)
                near = np.flatnonzero(
                    np.abs(time - selected.time) <= selected.mother.reach * selected.T_p
                )
                pulse, start = selected.acceleration(time[near]), int(near[0])
            ground = Ground(record, step, acceleration, pulse, start, tuple(both))
            yield ground, [_history(response, record, name, rows, both) for name in chosen]


def _components(response: Arrays, row: int) -> list[str]:
    """Return the records of both components of a motion; empty for a motion in one plane."""
    return str(response["components"].values[row]).split() if "components" in response else []


def _length(path: Path, names: Sequence[str]) -> Float:
    """Return the length of the vector of both horizontal accelerations [m s-2]."""
    with open_records(path) as file:
        motion = file.in_both(names)
        return np.hypot(motion.first.acceleration, motion.second.acceleration)


def _history(
    response: Arrays, record: str, structure: str, rows: slice, both: Sequence[str]
) -> History:
    k = _names(response, "structure").index(structure)
    history_names = {"theta", "u", "v", *(("u_x", "u_y") if both else ("theta_low", "theta_high"))}
    names = ("theta", "u", "v", "theta_low", "theta_high", "u_x", "u_y")
    series = (
        response[name].isel(structure=k, obs=rows).values
        if name in history_names and name in response
        else np.empty(0)
        for name in names
    )
    return History(record, structure, *series)


def _names(dataset: Arrays, variable: str) -> list[str]:
    return [str(name) for name in dataset[variable].values]


def _samples_of(dataset: Arrays) -> dict[str, slice]:
    """Return the samples of each record along ``obs``."""
    of_obs = slices(dataset["row_size"].values)
    return dict(zip(_names(dataset, "record_id"), of_obs, strict=True))
