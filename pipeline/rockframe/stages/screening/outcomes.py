"""The outcomes of all scenarios; of a large screening, some structures are in memory at a time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, Self

import numpy as np
from numpy.typing import NDArray

from rockframe.results.tables.number_store import NumberStore
from rockframe.rocking import Verdict, quantiles
from rockframe.stages.screening.request import LACKING_IN_BOTH, ScreeningRequest
from rockframe.structures.contract import Structure
from rockframe.structures.screening import has_quantity

Float = NDArray[np.float64]

#: Peaks of which the values of all members at the reference scale are kept.
OF_MEMBERS: Final = ("peak_rotation_ratio", "peak_u")
#: For each structure and limit state, the shares of members that reach it, for the motions that
#: count and the scales; None if the structure has no such quantity.
Reached = list[list[Float | None]]
#: Number of numbers of a large screening that are in memory together.
_TOGETHER: Final = 2**21
#: Approximate number of scenarios whose statistics are computed together, in up to a second.
_SCENARIOS: Final = 2**16


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

    def of_structures(self, some: slice) -> Outcomes:
        """Return the outcomes of some structures."""
        return Outcomes(
            self.verdicts[:, some],
            self.reached[:, :, some],
            {name: values[:, some] for name, values in self.peaks.items()},
            {name: values[:, some] for name, values in self.demands.items()},
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


@dataclass(frozen=True, eq=False)
class ScreenedStructures:
    """The outcomes of some structures under all motions, from which statistics are computed.

    Parameters
    ----------
    request : ScreeningRequest
        The request, with only these structures.
    in_both : array, shape (motions,)
        True for motions in both directions.
    outcomes : Outcomes
        Their outcomes.
    """

    request: ScreeningRequest
    in_both: NDArray[np.bool_]
    outcomes: Outcomes

    @property
    def ratio(self) -> Float:
        """Median of |theta| / alpha at the scale nearest to 1, shape (motions, structures)."""
        median: Float = quantiles(self.outcomes.peaks["peak_rotation_ratio"])[..., 1]
        return median

    @property
    def demand(self) -> Float:
        """The median that ranks motions: of |theta| / alpha or, without a rotation, of |u| [m]."""
        drift = quantiles(self.outcomes.peaks["peak_u"])[..., 1]
        return np.where(np.isnan(self.ratio), drift, self.ratio)

    def has(self, structure: Structure, quantity: str, motion: int) -> bool:
        """Return True if limits of a quantity apply to a structure under a motion by its place."""
        return applies(structure, quantity, in_both=bool(self.in_both[motion]))

    def counting(self) -> list[NDArray[np.intp]]:
        """Return the places of the motions that count for each structure.

        They are those in both directions, if it is computed under any; else those in one plane.
        """
        places = []
        for k in range(len(self.request.structures)):
            computed = self.outcomes.verdicts[:, k, 0] != Verdict.NOT_COMPUTED
            both = np.flatnonzero(computed & self.in_both)
            places.append(both if both.size else np.flatnonzero(computed & ~self.in_both))
        return places

    def shares(self, limit: int) -> Float:
        """Return the shares of members that reach a limit, (motions, structures, scales)."""
        share: Float = self.outcomes.reached[limit] / self.request.members
        return share

    def reached_by_each(self, counting: Sequence[NDArray[np.intp]]) -> Reached:
        """Return the shares that reach each limit under the motions that count, by structure.

        Where all motions count, they are parts of one array for each limit.
        """
        limits = self.request.limits
        shares = [self.shares(number) for number, _ in enumerate(limits)]
        whole = slice(None)
        return [
            [
                of_limit[whole if some.size == len(of_limit) else some, k]
                if self.has(structure, limit.quantity, int(some[0]))
                else None
                for of_limit, limit in zip(shares, limits, strict=True)
            ]
            for k, (structure, some) in enumerate(
                zip(self.request.structures, counting, strict=True)
            )
        ]


def applies(structure: Structure, quantity: str, *, in_both: bool) -> bool:
    """Return True if limits of a quantity apply to a structure under a motion."""
    return has_quantity(structure, quantity) and not (in_both and quantity in LACKING_IN_BOTH)


class AllOutcomes:
    """The outcomes of all motions, filled motion by motion and read by structures.

    Parameters
    ----------
    request : ScreeningRequest
        The request.
    motions : int
        Number of motions.
    folder : Path
        Folder of a temporary file, for a large screening.
    """

    def __init__(self, request: ScreeningRequest, motions: int, folder: Path) -> None:
        limits, members, demands = len(request.limits), request.members, request.demands
        structures, scales = len(request.structures), request.scales.size
        series = scales * (1 + limits + len(demands) * members) + len(OF_MEMBERS) * members
        self.is_large = motions * structures * series > _TOGETHER
        together = max(1, _TOGETHER // (4 * structures * series)) if self.is_large else motions
        shape = together, structures, scales
        self._outcomes = Outcomes.empty(shape, limits, members, demands)
        self._request, self._place, self._first = request, 0, 0
        self._names = [f"{number}" for number in range(structures)]
        self._width = max(1, min(_TOGETHER // (motions * series), _SCENARIOS // (motions * scales)))
        self._numbers = NumberStore(series, folder)

    def add(self, row: Mapping[str, NDArray[Any]]) -> None:
        """Add the outcomes of the next motion, by the variables of `rows`."""
        if self._place == len(self._outcomes.verdicts):
            self._keep()
        place, outcomes = self._place, self._outcomes
        outcomes.verdicts[place] = row["verdict"]
        outcomes.reached[:, place] = np.moveaxis(row["reached"], -1, 0)
        for name, peaks in outcomes.peaks.items():
            peaks[place] = row[f"members_{name}"]
        for name, demands in outcomes.demands.items():
            demands[place] = row[f"members_{name}_at_scales"]
        self._place += 1

    def _keep(self) -> None:
        names = [f"{self._first + number}" for number in range(self._place)]
        self._numbers.add(self._names, names, self._outcomes.numbers(self._place))
        self._first, self._place = self._first + self._place, 0

    def __len__(self) -> int:
        """Return the number of parts."""
        return -(-len(self._request.structures) // self._width)

    def parts(self, in_both: NDArray[np.bool_]) -> Iterator[tuple[slice, ScreenedStructures]]:
        """Yield the outcomes under all motions of some structures after the other.

        `in_both` is true for the motions in both directions.
        """
        structures = self._request.structures
        if self.is_large and self._place:
            self._keep()
        for start in range(0, len(structures), self._width):
            some = slice(start, min(start + self._width, len(structures)))
            if self.is_large:
                outcomes = self._outcomes.of_numbers([*map(self._numbers.of, self._names[some])])
            else:
                outcomes = self._outcomes.of_structures(some)
            part = replace(self._request, structures=structures[some], candidates=())
            yield some, ScreenedStructures(part, in_both, outcomes)
