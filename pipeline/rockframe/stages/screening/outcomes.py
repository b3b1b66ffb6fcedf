"""The outcomes of all scenarios; of a large screening, some structures are in memory at a time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Self

import numpy as np
from numpy.typing import NDArray

from rockframe.results.tables.number_store import NumberStore

Float = NDArray[np.float64]

#: Peaks of which the values of all members at the reference scale are kept.
OF_MEMBERS: Final = ("peak_rotation_ratio", "peak_u")
#: Number of numbers of a large screening that are in memory together.
_TOGETHER: Final = 2**21


@dataclass(frozen=True, eq=False)
class Outcomes:
    """Outcomes of some motions and structures.

    Parameters
    ----------
    verdicts : array, shape (motions, structures, scales)
        Those of the stated structures.
    reached : array, shape (limits, motions, structures, scales)
        Numbers of members that reach a limit state.
    peaks : mapping of str to array, shape (motions, structures, members)
        The largest |theta| / alpha and |u| of each member at the scale nearest to 1, infinite for
        members that overturn. Without an ensemble, the stated structure is the only member.
    demands : mapping of str to array, shape (motions, structures, scales, members)
        Peaks that return periods need; NaN where a structure has no such quantity.
    """

    verdicts: NDArray[np.int8]
    reached: NDArray[np.uint16]
    peaks: Mapping[str, Float]
    demands: Mapping[str, Float]

    @classmethod
    def empty(
        cls, shape: tuple[int, int, int], limits: int, members: int, demands: Sequence[str]
    ) -> Self:
        """Return arrays to be filled, for numbers of motions, structures and scales."""
        return cls(
            np.empty(shape, dtype=np.int8),
            np.empty((limits, *shape), dtype=np.uint16),
            {name: np.empty((*shape[:2], members)) for name in OF_MEMBERS},
            {name: np.full((*shape, members), np.nan) for name in demands},
        )

    def numbers(self, motions: int) -> Float:
        """Return the outcomes of the first motions, shape (structures, series, motions)."""
        first = slice(motions)
        parts: list[NDArray[Any]] = [
            self.verdicts[first].transpose(1, 2, 0),
            *self.reached[:, first].transpose(0, 2, 3, 1),
            *(values[first].transpose(1, 2, 0) for values in self.peaks.values()),
            *(
                of_scale
                for values in self.demands.values()
                for of_scale in values[first].transpose(2, 1, 3, 0)
            ),
        ]
        return np.concatenate(parts, axis=1, dtype=np.float64)

    def of_numbers(self, numbers: Sequence[Float]) -> Outcomes:
        """Return the outcomes of some structures, whose `numbers` these are, (series, motions)."""
        rest = np.stack(numbers).transpose(2, 0, 1)
        limits, _, _, scales = self.reached.shape
        members = next(iter(self.peaks.values())).shape[2]

        def taken(count: int) -> Float:
            nonlocal rest
            part, rest = np.ascontiguousarray(rest[:, :, :count]), rest[:, :, count:]
            return part

        verdicts = taken(scales).astype(np.int8)
        reached = np.stack([taken(scales).astype(np.uint16) for _ in range(limits)])
        peaks = {name: taken(members) for name in self.peaks}
        demands = {
            name: np.stack([taken(members) for _ in range(scales)], axis=2) for name in self.demands
        }
        return Outcomes(verdicts, reached, peaks, demands)


class AllOutcomes:
    """The outcomes of all motions, filled motion by motion and read by structures.

    Parameters
    ----------
    shape : tuple of int
        Numbers of motions, structures and scales.
    limits, members : int
        Numbers of limit states and members.
    demands : sequence of str
        Quantities of `Outcomes.demands`.
    folder : Path
        Folder of a temporary file, for a large screening.

    Examples
    --------
    >>> every = AllOutcomes((2, 1, 3), 1, 1, [], Path())
    >>> place, outcomes = every.of_motion(1)
    >>> place, outcomes.verdicts.shape, every.is_large
    (1, (2, 1, 3), False)
    """

    def __init__(
        self,
        shape: tuple[int, int, int],
        limits: int,
        members: int,
        demands: Sequence[str],
        folder: Path,
    ) -> None:
        motions, structures, scales = shape
        series = scales * (1 + limits + len(demands) * members) + len(OF_MEMBERS) * members
        self.is_large = motions * structures * series > _TOGETHER
        together = max(1, _TOGETHER // (4 * structures * series)) if self.is_large else motions
        self._outcomes = Outcomes.empty((together, *shape[1:]), limits, members, demands)
        self._shape, self._together, self._first = shape, together, 0
        self._names = [f"{number}" for number in range(structures)]
        self._width = max(1, _TOGETHER // (motions * series))
        self._numbers = NumberStore(series, folder)

    def of_motion(self, motion: int) -> tuple[int, Outcomes]:
        """Return the arrays to fill with the outcomes of a motion, and its place in them."""
        place = motion - self._first
        if place == self._together:
            self._keep(place)
            place = 0
        return place, self._outcomes

    def _keep(self, motions: int) -> None:
        names = [f"{self._first + number}" for number in range(motions)]
        self._numbers.add(self._names, names, self._outcomes.numbers(motions))
        self._first += motions

    def parts(self) -> Iterator[tuple[slice, Outcomes]]:
        """Yield the outcomes of all motions, structures by structures; all of a small screening."""
        motions, structures, _ = self._shape
        if not self.is_large:
            yield slice(0, structures), self._outcomes
            return
        if self._first < motions:
            self._keep(motions - self._first)
        for start in range(0, structures, self._width):
            some = slice(start, min(start + self._width, structures))
            yield some, self._outcomes.of_numbers([*map(self._numbers.of, self._names[some])])
