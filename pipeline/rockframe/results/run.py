"""Reads the folder of a run: its tables, its labelled values and its strips."""

from __future__ import annotations

import heapq
from collections import Counter, deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from rockframe.errors import InputError
from rockframe.provenance import MANIFEST, sha256_of
from rockframe.results.manifest import read_manifest
from rockframe.results.margins import strips_of
from rockframe.results.motions import Pair
from rockframe.results.reading import opened
from rockframe.results.schema import PULSES, RECORDS, RESPONSE
from rockframe.results.tables.columns import stated_verdict
from rockframe.results.tables.entries import rows_of
from rockframe.results.tables.known import Facts, FactsOf
from rockframe.rocking import Strip

#: Columns of ``table.csv`` without which it says nothing of a record and a structure.
_NEEDED: Final = (
    *("record_id", "event", "record", "structure", "verdict"),
    *("peak_rotation_ratio", "overturning_time_s"),
)


@dataclass(frozen=True)
class Run:
    """The content of a run without its histories.

    Parameters
    ----------
    folder : Path
        Where it is.
    manifest : mapping
        Content of ``manifest.json``.
    manifest_sha256 : str
        Hash of that file: it stands for the run.
    counts : mapping of (str, str) to int
        How many rows ``table.csv`` has, by structure and kind of verdict.
    rows : tuple of mapping of str to str
        Its rows, a record and a structure each; or those of them that are looked at first.
    entries : tuple of mapping of str to str
        Rows of ``records.csv``: each record and each file that gave none, with the checks.
    records, structures, pairs : mapping to tuple of Fact
        What is known of each record and its pulse, each structure, and each record with each
        structure.
    strips : mapping of (str, str) to Strip
        By record and structure of the rows; none if margins were not computed.
    """

    folder: Path
    manifest: Mapping[str, Any]
    manifest_sha256: str
    counts: Mapping[tuple[str, str], int]
    rows: tuple[Mapping[str, str], ...]
    entries: tuple[Mapping[str, str], ...]
    records: Mapping[str, Facts]
    structures: Mapping[str, Facts]
    pairs: Mapping[Pair, Facts]
    strips: Mapping[Pair, Strip] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Name of the study, or of the folder if there is no study."""
        study = self.manifest["parameters"].get("study", {})
        return str(study.get("name") or self.folder.resolve().name)


def read_run(folder: Path, *, most: int | None = None) -> Run:
    """Read a run without its histories.

    Parameters
    ----------
    folder : Path
        Output of ``rockframe table1``.
    most : int, optional
        Most rows of the table that are kept; by default all.

    Raises
    ------
    InputError
        If one of its files is missing, corrupted, or something else.

    Examples
    --------
    >>> read_run(Path("no-such-folder"))
    Traceback (most recent call last):
    rockframe.errors.InputError: no-such-folder: no such folder. Must be the folder of a run.
    """
    manifest = read_manifest(folder)
    counts: Counter[tuple[str, str]] = Counter()
    rows = _kept(_counted(folder / "table.csv", counts), most)
    with (
        opened(folder / "records.nc", RECORDS) as records,
        opened(folder / "pulses.nc", PULSES) as pulses,
        opened(folder / "response.nc", RESPONSE) as response,
    ):
        return Run(
            folder,
            manifest,
            sha256_of(folder / MANIFEST),
            counts,
            rows,
            tuple(_rows(folder / "records.csv")),
            FactsOf(records, pulses, keys=["record_id"]),
            FactsOf(response, keys=["structure"]),
            FactsOf(response, keys=["record_id", "structure"]),
            strips_of(response, {row["record_id"] for row in rows}),
        )


def rank(row: Mapping[str, str]) -> tuple[int, float]:
    """Return where a row of the table stands among those that are looked at first.

    What stands or is undecided comes first, the largest rotation before the others, then what
    overturned, then what never uplifted.

    Examples
    --------
    >>> rows = [{"verdict": v, "peak_rotation_ratio": p} for v, p in
    ...         (("no_uplift", "0.0"), ("safe", "0.2"), ("overturned", "9.0"), ("safe", "0.9"))]
    >>> [row["peak_rotation_ratio"] for row in sorted(rows, key=rank)]
    ['0.9', '0.2', '9.0', '0.0']
    """
    kind = {"undecided": 0, "safe": 0, "overturned": 1}.get(row["verdict"], 2)
    return kind, -float(row["peak_rotation_ratio"])


def _counted(path: Path, counts: Counter[tuple[str, str]]) -> Iterator[dict[str, str]]:
    """Give the rows of the table, and count the verdicts of each structure by kind."""
    for number, row in enumerate(_rows(path)):
        missing = [name for name in _NEEDED if name not in row] if number == 0 else []
        if missing:
            must_be = "Must be as this version of `rockframe table1` writes it."
            raise InputError(path, f"without column {missing[0]!r}. {must_be}")
        try:
            counts[row["structure"], stated_verdict(row).kind] += 1
        except (KeyError, ValueError) as error:
            must_be = "Must be as `rockframe table1` wrote it."
            raise InputError(path, f"invalid verdict or margin {error}. {must_be}") from None
        yield row


def _kept(rows: Iterator[dict[str, str]], most: int | None) -> tuple[dict[str, str], ...]:
    """Return all rows, or those that `rank` puts first, in the order of the table."""
    if most is None:
        return tuple(rows)
    best = heapq.nsmallest(most, enumerate(rows), key=lambda numbered: rank(numbered[1]))
    deque(rows, maxlen=0)  # of none that are kept, all are counted
    return tuple(row for _, row in sorted(best, key=lambda numbered: numbered[0]))


def _rows(path: Path) -> Iterator[dict[str, str]]:
    """Give the rows of a table that a run must have."""
    if not path.is_file():
        raise InputError(path, "missing. Must be as the run wrote it.")
    return rows_of(path)
