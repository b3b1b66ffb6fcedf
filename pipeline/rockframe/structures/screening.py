"""Responses and margins of every combination of motions, structures and scales of a task."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from rockframe.options.respond import Ensemble
from rockframe.quantities import LIMITED, OF_SCENARIO
from rockframe.rocking import Margin, Verdict, Versions, as_ground
from rockframe.rocking.margins.members import MakesVersions
from rockframe.structures.contract import (
    PEAKS,
    Motion,
    Structure,
    StructureKind,
    StructureResponse,
    alike,
    in_one_plane,
    kind_of,
    places_of_kinds,
)

if TYPE_CHECKING:
    from rockframe.rocking import GroundAcceleration
    from rockframe.wobbling import PairAcceleration

Arrays: TypeAlias = dict[str, NDArray[Any]]
Entry = TypeVar("Entry")


@dataclass(frozen=True)
class ScreeningTask:
    """A task: motions, structures and scales; every combination is computed.

    Parameters
    ----------
    motions : tuple of Record, GroundAcceleration or PairAcceleration
        The motions.
    structures : tuple of Structure
        The structures, of one or several kinds.
    scales : tuple of float
        Multiples of the motions [1].
    ensemble : Ensemble, optional
        Ensemble of `member_peaks_of`, or of the robust margins of `margins_of`.
    uncertain : tuple of MakesVersions or None
        For each motion, what its versions are made of, which shake the members of
        `member_peaks_of`; None for motions with one version. Empty if all have only one.
    """

    motions: tuple[Motion, ...]
    structures: tuple[Structure, ...]
    scales: tuple[float, ...] = (1.0,)
    ensemble: Ensemble | None = None
    uncertain: tuple[MakesVersions | None, ...] = ()


@dataclass(frozen=True)
class Scenario:
    """One structure under one motion at one scale [1]."""

    motion: Motion
    structure: Structure
    scale: float


def responses_of(scenarios: tuple[Scenario, ...]) -> list[StructureResponse]:
    """Return the responses of scenarios, with their histories.

    Examples
    --------
    >>> from rockframe import Record, RockingFrame
    >>> shake = Record(record_id="shake", acceleration=[0.0, 3.0, 0.0], time_step=0.1)
    >>> scenario = Scenario(shake, RockingFrame(height=9.6, width=1.6), 0.1)
    >>> [response.verdict.name for response in responses_of((scenario,))]
    ['NO_UPLIFT']
    """
    return [
        kind_of(scenario.structure).history(
            scenario.structure, ground_of(scenario.motion).scaled(scenario.scale)
        )
        for scenario in scenarios
    ]


def ground_of(motion: Motion) -> GroundAcceleration | PairAcceleration:
    """Return the ground acceleration of a motion, in one plane or in both directions."""
    return as_ground(motion) if in_one_plane(motion) else motion  # type: ignore[arg-type, return-value]


def peaks_of(task: ScreeningTask) -> Arrays:
    """Return the verdict and peaks of each combination of motion, structure and scale.

    The verdict of a structure that is not computed under a motion says so; its peaks are NaN.

    Returns
    -------
    dict of str to array, shape (motions, structures, scales)
        ``verdict``, ``peak`` and ``speed``: see `StructureKind.peaks`.

    Examples
    --------
    >>> from rockframe import Record, RockingFrame
    >>> shake = Record(record_id="shake", acceleration=[0.0, 3.0, 0.0], time_step=0.1)
    >>> task = ScreeningTask((shake,), (RockingFrame(height=9.6, width=1.6),), (0.1, 1.0))
    >>> peaks_of(task)["verdict"].tolist()
    [[[0, 1]]]
    """
    return _together(
        task, lambda kind, some, those: kind.peaks(some, _of(task.motions, those), task.scales)
    )


def member_peaks_of(task: ScreeningTask) -> Arrays:
    """Return the verdict and peaks of each member of the ensemble in each scenario.

    The stated structure is not one of the members.

    Returns
    -------
    dict of str to array, shape (motions, structures, scales, members)
        As for `peaks_of`.

    Examples
    --------
    >>> from rockframe import Record, RockingFrame
    >>> shake = Record(record_id="shake", acceleration=[0.0, 3.0, 0.0], time_step=0.1)
    >>> frame, ensemble = RockingFrame(height=9.6, width=1.6), Ensemble(members=16)
    >>> task = ScreeningTask((shake,), (frame,), (0.1, 1.0), ensemble)
    >>> member_peaks_of(task)["verdict"].sum(axis=3).tolist()
    [[[0, 16]]]
    """
    ensemble = task.ensemble or Ensemble()
    made_of = task.uncertain or (None,) * len(task.motions)
    versions: list[Versions | None] = [
        None if one is None else one.versions(ensemble, motion)  # type: ignore[arg-type]
        for one, motion in zip(made_of, task.motions, strict=True)
    ]
    return _together(
        task,
        lambda kind, some, those: kind.member_peaks(
            some, _of(task.motions, those), task.scales, ensemble, _of(versions, those)
        ),
    )


def margins_of(task: ScreeningTask) -> Arrays:
    """Return critical scales, numbers of islands, and robust margins.

    Returns
    -------
    dict of str to array, shape (motions, structures)
        ``critical_scale`` and ``safe_islands``, NaN and -1 where no critical scale is searched, as
        in both directions; with an ensemble also ``robust_scale_10`` and ``robust_error_10``, and
        those of 25 and 50.

    Examples
    --------
    >>> from rockframe import Record, RockingFrame
    >>> shake = Record(record_id="shake", acceleration=[0.0, 3.0, 0.0], time_step=0.1)
    >>> task = ScreeningTask((shake,), (RockingFrame(height=9.6, width=1.6),))
    >>> margins_of(task)["safe_islands"].tolist()
    [[0]]
    """
    found: list[list[Margin | None]] = [[None] * len(task.structures) for _ in task.motions]
    for kind, some, those, places in _groups(task):
        rows = kind.margins(some, _of(task.motions, those), task.ensemble)
        for i, row in zip(those, rows, strict=True):
            for k, margin in zip(places, row, strict=True):
                found[i][k] = margin

    def values(name: str, unknown: float) -> NDArray[Any]:
        """Return an attribute of all margins; the stated value where none was computed."""
        read = attrgetter(name)
        return np.array([[unknown if m is None else read(m) for m in row] for row in found])

    robust = {
        f"robust_{measure}_{share}": values(f"robust.{prefix}{share}", math.nan)
        for share in (() if task.ensemble is None else (10, 25, 50))
        for measure, prefix in (("scale", "s"), ("error", "error"))
    }
    islands = values("safe_islands", -1).astype(np.int32)
    islands[[not in_one_plane(motion) for motion in task.motions]] = -1
    return robust | {"critical_scale": values("critical_scale", math.nan), "safe_islands": islands}


def _groups(
    task: ScreeningTask,
) -> Iterator[tuple[StructureKind, list[Structure], list[int], list[int]]]:
    """Yield each kind with structures and places of motions that it computes together.

    The motions of a group are all in one plane, or all in both directions; the last item has the
    places of its structures.
    """
    plane = [in_one_plane(motion) for motion in task.motions]
    for kind, places in places_of_kinds(task.structures):
        structures = [task.structures[place] for place in places]
        for computed, which in alike(kind, structures, task.motions):
            for flat in (True, False):
                if those := [i for i in computed if plane[i] is flat]:
                    some = [structures[k] for k in which]
                    yield kind, some, those, [places[k] for k in which]


def _of(entries: Sequence[Entry], places: Sequence[int]) -> list[Entry]:
    return [entries[place] for place in places]


def _together(
    task: ScreeningTask,
    compute: Callable[[StructureKind, Sequence[Structure], list[int]], Arrays],
) -> Arrays:
    """Return the peaks of all structures and motions in their order; see `peaks_of`."""
    joined: Arrays = {}
    shape = len(task.motions), len(task.structures)
    unknown = {"verdict": Verdict.NOT_COMPUTED}
    for kind, some, those, places in _groups(task):
        part = compute(kind, some, those)
        if (len(those), len(places)) == shape:
            return part
        for name in PEAKS:
            whole = np.full(
                (*shape, *part[name].shape[2:]), unknown.get(name, np.nan), part[name].dtype
            )
            joined.setdefault(name, whole)[np.ix_(those, places)] = part[name]
    return joined


def quantities_of(
    structures: Sequence[Structure],
    verdict: NDArray[np.int8],
    peak: NDArray[np.float64],
    speed: NDArray[np.float64],
) -> Arrays:
    """Return the quantities of scenarios by name, and the verdicts; NaN for those that are lacking.

    Parameters
    ----------
    structures : sequence of Structure
        The structures.
    verdict, peak, speed : array, shape (structures, scales)
        Results for one motion, as from `peaks_of`.
    """
    names = (quantity.name for quantity in dict.fromkeys((*OF_SCENARIO, *LIMITED)))
    arrays: Arrays = {"verdict": verdict, **{name: np.full(peak.shape, np.nan) for name in names}}
    for kind, places in places_of_kinds(structures):
        part = kind.quantities_of([structures[k] for k in places], peak[places], speed[places])
        for name, values in part.items():
            arrays[name][places] = values
    return arrays


def has_quantity(structure: Structure, quantity: str) -> bool:
    """Return True if limits of a quantity apply to a structure; "" is overturning or collapse."""
    return not quantity or kind_of(structure).has(structure, quantity)
