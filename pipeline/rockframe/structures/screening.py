"""Responses and margins of every combination of motions, structures and scales of a task."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rockframe.options.respond import Ensemble
from rockframe.quantities import LIMITED, OF_SCENARIO
from rockframe.record import Record
from rockframe.rocking import GroundAcceleration, Margin, Versions, as_ground
from rockframe.rocking.margins.members import MakesVersions
from rockframe.structures.contract import (
    PEAKS,
    Structure,
    StructureKind,
    StructureResponse,
    kind_of,
    places_of_kinds,
)

Arrays: TypeAlias = dict[str, NDArray[Any]]


@dataclass(frozen=True)
class ScreeningTask:
    """A task: motions, structures and scales; every combination is computed.

    Parameters
    ----------
    motions : tuple of Record or GroundAcceleration
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

    motions: tuple[Record | GroundAcceleration, ...]
    structures: tuple[Structure, ...]
    scales: tuple[float, ...] = (1.0,)
    ensemble: Ensemble | None = None
    uncertain: tuple[MakesVersions | None, ...] = ()


@dataclass(frozen=True)
class Scenario:
    """One structure under one motion at one scale [1]."""

    motion: Record | GroundAcceleration
    structure: Structure
    scale: float


def responses_of(scenarios: tuple[Scenario, ...]) -> list[StructureResponse]:
    """Return the responses of scenarios, with their histories.

    Examples
    --------
    >>> from rockframe import RockingFrame
    >>> shake = Record(record_id="shake", acceleration=[0.0, 3.0, 0.0], time_step=0.1)
    >>> scenario = Scenario(shake, RockingFrame(height=9.6, width=1.6), 0.1)
    >>> [response.verdict.name for response in responses_of((scenario,))]
    ['NO_UPLIFT']
    """
    return [
        kind_of(scenario.structure).history(
            scenario.structure, as_ground(scenario.motion).scaled(scenario.scale)
        )
        for scenario in scenarios
    ]


def peaks_of(task: ScreeningTask) -> Arrays:
    """Return the verdict and peaks of each combination of motion, structure and scale.

    Returns
    -------
    dict of str to array, shape (motions, structures, scales)
        ``verdict``, ``peak`` and ``speed``: see `StructureKind.peaks`.

    Examples
    --------
    >>> from rockframe import RockingFrame
    >>> shake = Record(record_id="shake", acceleration=[0.0, 3.0, 0.0], time_step=0.1)
    >>> task = ScreeningTask((shake,), (RockingFrame(height=9.6, width=1.6),), (0.1, 1.0))
    >>> peaks_of(task)["verdict"].tolist()
    [[[0, 1]]]
    """
    return _together(
        task.structures, lambda kind, some: kind.peaks(some, task.motions, task.scales)
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
    >>> from rockframe import RockingFrame
    >>> shake = Record(record_id="shake", acceleration=[0.0, 3.0, 0.0], time_step=0.1)
    >>> frame, ensemble = RockingFrame(height=9.6, width=1.6), Ensemble(members=16)
    >>> task = ScreeningTask((shake,), (frame,), (0.1, 1.0), ensemble)
    >>> member_peaks_of(task)["verdict"].sum(axis=3).tolist()
    [[[0, 16]]]
    """
    ensemble = task.ensemble or Ensemble()
    made_of = task.uncertain or (None,) * len(task.motions)
    versions: list[Versions | None] = [
        None if one is None else one.versions(ensemble, motion)
        for one, motion in zip(made_of, task.motions, strict=True)
    ]
    return _together(
        task.structures,
        lambda kind, some: kind.member_peaks(some, task.motions, task.scales, ensemble, versions),
    )


def margins_of(task: ScreeningTask) -> Arrays:
    """Return critical scales, numbers of islands, and robust margins.

    Returns
    -------
    dict of str to array, shape (motions, structures)
        ``critical_scale`` and ``safe_islands``; with an ensemble also ``robust_scale_10`` and
        ``robust_error_10``, and those of 25 and 50.

    Examples
    --------
    >>> from rockframe import RockingFrame
    >>> shake = Record(record_id="shake", acceleration=[0.0, 3.0, 0.0], time_step=0.1)
    >>> task = ScreeningTask((shake,), (RockingFrame(height=9.6, width=1.6),))
    >>> margins_of(task)["safe_islands"].tolist()
    [[0]]
    """
    rows: list[list[Margin]] = [[] for _ in task.motions]
    order: list[int] = []
    for kind, places in places_of_kinds(task.structures):
        some = [task.structures[place] for place in places]
        order += places
        for row, margins in zip(rows, kind.margins(some, task.motions, task.ensemble), strict=True):
            row += margins
    ordered = [[row[order.index(place)] for place in range(len(order))] for row in rows]
    robust = {
        f"robust_{measure}_{share}": np.array(
            [[getattr(margin.robust, f"{prefix}{share}") for margin in row] for row in ordered]
        )
        for share in (() if task.ensemble is None else (10, 25, 50))
        for measure, prefix in (("scale", "s"), ("error", "error"))
    }
    return robust | {
        "critical_scale": np.array([[margin.critical_scale for margin in row] for row in rows]),
        "safe_islands": np.array(
            [[margin.safe_islands for margin in row] for row in rows], dtype=np.int32
        ),
    }


def _together(
    structures: Sequence[Structure],
    compute: Callable[[StructureKind, Sequence[Structure]], Arrays],
) -> Arrays:
    """Return the peaks of structures of several kinds in their order."""
    joined: Arrays = {}
    for kind, places in places_of_kinds(structures):
        part = compute(kind, [structures[place] for place in places])
        if len(places) == len(structures):
            return part
        for name in PEAKS:
            motions, _, *others = part[name].shape
            whole = np.empty((motions, len(structures), *others), dtype=part[name].dtype)
            joined.setdefault(name, whole)[:, places] = part[name]
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
    names = (one.name for one in dict.fromkeys((*OF_SCENARIO, *LIMITED)))
    arrays: Arrays = {"verdict": verdict, **{name: np.full(peak.shape, np.nan) for name in names}}
    for kind, places in places_of_kinds(structures):
        part = kind.quantities_of([structures[k] for k in places], peak[places], speed[places])
        for name, values in part.items():
            arrays[name][places] = values
    return arrays


def has_quantity(structure: Structure, quantity: str) -> bool:
    """Return True if limits of a quantity apply to a structure; "" is overturning or collapse."""
    return not quantity or kind_of(structure).has(structure, quantity)
