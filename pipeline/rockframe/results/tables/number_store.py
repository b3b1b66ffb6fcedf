"""Numbers of all responses, in a file where they would fill the memory, and their statistics."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, Final
from weakref import finalize

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rockframe.errors import InputError
from rockframe.quantities import QUANTILES
from rockframe.results.tables.rows import Row

Float = NDArray[np.float64]

#: Size of the numbers that remain in memory until they are written to the file [bytes].
_IN_MEMORY: Final = 2**23


@dataclass(frozen=True, eq=False)
class _Group:
    """Structures that respond to the same records, with their numbers, or where the file has them.

    The numbers have the shape (structures, series, records).
    """

    structures: tuple[str, ...]
    records: tuple[str, ...]
    numbers: Float | int


class NumberStore:
    """Numbers of structures under records; those of one structure are read at a time.

    Parameters
    ----------
    series : int
        Number of numbers of each response.
    folder : Path, optional
        Folder of a temporary file without a name, which ends with the process; by default all
        numbers remain in memory.

    Examples
    --------
    >>> store = NumberStore(1)
    >>> store.add(["bent", "pier"], ["a", "b"], np.array([[[0.1, 0.2]], [[0.3, 0.4]]]))
    >>> store.add(["pier"], ["c"], np.array([[[0.5]]]))
    >>> store.of("pier").tolist(), store.records_of("pier")
    ([[0.3, 0.4, 0.5]], ['a', 'b', 'c'])
    """

    def __init__(self, series: int, folder: Path | None = None) -> None:
        self._series, self._folder = series, folder
        self._groups: list[_Group] = []
        self._places: dict[tuple[str, ...], dict[str, int]] = {}
        self._file: IO[bytes] | None = None
        self._in_file, self._size = 0, 0

    def add(self, structures: Sequence[str], records: Sequence[str], numbers: Float) -> None:
        """Keep the numbers of structures under further records.

        Parameters
        ----------
        structures, records : sequence of str
            Their names.
        numbers : array, shape (structures, series, records)
            The numbers.

        Raises
        ------
        InputError
            If the temporary file cannot be written.
        """
        names = tuple(structures)
        if names not in self._places:
            self._places[names] = {name: place for place, name in enumerate(names)}
        self._groups.append(_Group(names, tuple(records), numbers))
        self._size += numbers.nbytes
        if self._folder is not None and self._size > _IN_MEMORY:
            try:
                self._write(self._folder)
            except OSError as error:
                wrong = f"a temporary file in it cannot be written: {error.strerror}"
                raise InputError(self._folder, f"{wrong}. Must have room for it.") from None

    def join(self, other: NumberStore) -> None:
        """Keep the numbers that another object has in memory, after those of this one."""
        for group in other._groups:
            self.add(group.structures, group.records, np.asarray(group.numbers))

    def groups_of(self, structure: str) -> tuple[int, ...]:
        """Return the groups that a structure is in; in the same groups are the same records."""
        every = enumerate(self._groups)
        return tuple(k for k, group in every if structure in self._places[group.structures])

    def records_of(self, structure: str) -> list[str]:
        """Return the names of the records of a structure."""
        return [
            name for number in self.groups_of(structure) for name in self._groups[number].records
        ]

    def of(self, structure: str) -> Float:
        """Return the numbers of a structure under all its records, shape (series, records)."""
        pieces = [np.empty((self._series, 0))]
        for number in self.groups_of(structure):
            group = self._groups[number]
            pieces.append(self._read(group, self._places[group.structures][structure]))
        return np.concatenate(pieces, axis=1)

    def _write(self, folder: Path) -> None:
        """Move the numbers in memory to the file; neighbours of the same structures together."""
        if self._file is None:
            # without a buffer, a full disk is noticed here; it is open as long as this object
            self._file = TemporaryFile(dir=folder, buffering=0)  # noqa: SIM115
            finalize(self, self._file.close)
        in_memory = self._groups[self._in_file :]
        del self._groups[self._in_file :]
        for _, alike in groupby(in_memory, lambda group: group.structures):
            some = [*alike]
            numbers = np.concatenate([np.asarray(group.numbers) for group in some], axis=2)
            names = tuple(name for group in some for name in group.records)
            start = self._file.seek(0, 2)
            rest = np.ascontiguousarray(numbers).data.cast("B")
            while rest:
                rest = rest[self._file.write(rest) :]
            self._groups.append(replace(some[0], records=names, numbers=start))
        self._in_file, self._size = len(self._groups), 0

    def _read(self, group: _Group, place: int) -> Float:
        """Return the numbers of the structure at a place of a group."""
        if isinstance(group.numbers, np.ndarray):
            of_structure: Float = group.numbers[place]
            return of_structure
        if self._file is None:  # only groups that were written have no array
            raise ValueError(f"numbers of {len(group.structures)} structures without their file")
        count = self._series * len(group.records)
        self._file.seek(group.numbers + 8 * count * place)
        return np.frombuffer(self._file.read(8 * count)).reshape(self._series, -1)


def mean_shares_of(
    shares: Iterable[Sequence[float]], records: Iterable[str], recordings: Mapping[str, Hashable]
) -> list[Row]:
    """Return the mean share of each structure that overturns under records, and its interval.

    Parameters
    ----------
    shares : iterable of sequence of float
        The share of each structure under each record [1].
    records : iterable of str
        Identifiers of the records.
    recordings : mapping of str to hashable
        As for `summary_rows`.
    """
    from rockframe.risk.distribution import mean_shares

    place: dict[Hashable, int] = {}
    keys = (recordings.get(name, name) for name in records)
    clusters = [place.setdefault(key, len(place)) for key in keys]
    if not clusters:
        names = [f"share_overturned{end}" for end in ("", "_low", "_high")]
        return [dict.fromkeys(names, math.nan) for _ in shares]
    means = mean_shares((np.reshape(share, (-1, 1)) for share in shares), clusters=clusters)
    ends = [{"": mean.share, "_low": mean.low, "_high": mean.high} for mean in means]
    return [
        {f"share_overturned{end}": float(value[0]) for end, value in one.items()} for one in ends
    ]


def over_records(values: ArrayLike) -> list[float]:
    """Return the `QUANTILES` of the values of records; NaN without records.

    Examples
    --------
    >>> over_records([0.1, 0.2, math.inf])[1]
    0.2
    """
    from rockframe.rocking.margins.ensemble import quantiles

    numbers = np.asarray(values, dtype=np.float64)
    return quantiles(numbers).tolist() if numbers.size else [math.nan] * len(QUANTILES)
