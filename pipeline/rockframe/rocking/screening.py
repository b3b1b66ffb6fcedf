"""Responses and margins of every combination of motions, structures and scales of a task."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rockframe.frame import RockingFrame
from rockframe.options.respond import Ensemble
from rockframe.record import Record
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.margins.ensemble import shaken
from rockframe.rocking.margins.margins import margins
from rockframe.rocking.margins.members import MakesVersions, draws, members
from rockframe.rocking.response import Response, as_ground, respond
from rockframe.rocking.scenarios import Prepared, respond_many, respond_scenarios, scales_of

Arrays = dict[str, NDArray[Any]]

#: Results of a scenario: the verdict, and the peaks from which all others follow.
PEAKS: Final = ("verdict", "peak_rotation", "impact_velocity")


@dataclass(frozen=True)
class ScreeningTask:
    """A task: motions, structures and scales; every combination is computed.

    Parameters
    ----------
    motions : tuple of Record or GroundAcceleration
        The motions.
    frames : tuple of RockingFrame
        The structures.
    scales : tuple of float
        Multiples of the motions [1].
    ensemble : Ensemble, optional
        Ensemble of `member_peaks_of`, or of the robust margins of `margins_of`.
    uncertain : tuple of MakesVersions or None
        For each motion, what its versions are made of, which shake the members of
        `member_peaks_of`; None for motions with one version. Empty if all have only one.
    """

    motions: tuple[Record | GroundAcceleration, ...]
    frames: tuple[RockingFrame, ...]
    scales: tuple[float, ...] = (1.0,)
    ensemble: Ensemble | None = None
    uncertain: tuple[MakesVersions | None, ...] = ()


@dataclass(frozen=True)
class Scenario:
    """One structure under one motion at one scale [1]."""

    motion: Record | GroundAcceleration
    frame: RockingFrame
    scale: float


def responses_of(scenarios: tuple[Scenario, ...]) -> list[Response]:
    """Return the responses of scenarios, with their histories.

    Examples
    --------
    >>> shake = Record(record_id="shake", acceleration=[0.0, 3.0, 0.0], time_step=0.1)
    >>> scenario = Scenario(shake, RockingFrame(height=9.6, width=1.6), 0.1)
    >>> [response.verdict.name for response in responses_of((scenario,))]
    ['NO_UPLIFT']
    """
    return [respond(one.frame, as_ground(one.motion).scaled(one.scale)) for one in scenarios]


def peaks_of(task: ScreeningTask) -> Arrays:
    """Return the verdict and peaks of each combination of motion, structure and scale.

    Returns
    -------
    dict of str to array, shape (motions, frames, scales)
        ``verdict``, ``peak_rotation`` [rad] and ``impact_velocity`` [m s-1].

    Examples
    --------
    >>> shake = Record(record_id="shake", acceleration=[0.0, 3.0, 0.0], time_step=0.1)
    >>> task = ScreeningTask((shake,), (RockingFrame(height=9.6, width=1.6),), (0.1, 1.0))
    >>> peaks_of(task)["verdict"].tolist()
    [[[0, 1]]]
    """
    found = respond_many(task.motions, task.frames, task.scales)
    return {name: getattr(found, name) for name in PEAKS}


def member_peaks_of(task: ScreeningTask) -> Arrays:
    """Return the verdict and peaks of each member of the ensemble in each scenario.

    The stated structure is not one of the members.

    Returns
    -------
    dict of str to array, shape (motions, frames, scales, members)
        As for `peaks_of`.

    Examples
    --------
    >>> shake = Record(record_id="shake", acceleration=[0.0, 3.0, 0.0], time_step=0.1)
    >>> frame, ensemble = RockingFrame(height=9.6, width=1.6), Ensemble(members=16)
    >>> task = ScreeningTask((shake,), (frame,), (0.1, 1.0), ensemble)
    >>> member_peaks_of(task)["verdict"].sum(axis=3).tolist()
    [[[0, 16]]]
    """
    ensemble = task.ensemble or Ensemble()
    scales, count = scales_of(task.scales), ensemble.members
    family = [member for frame in task.frames for member in members(ensemble, frame)]
    made_of = task.uncertain or (None,) * len(task.motions)
    versions = [
        None if one is None else one.versions(ensemble, motion)
        for one, motion in zip(made_of, task.motions, strict=True)
    ]
    grounds, of_member = shaken(task.motions, ensemble, versions)
    shape = (len(task.motions), len(task.frames), scales.size, count)
    motion, frame, scale, member = (axis.ravel() for axis in np.indices(shape))
    found = respond_scenarios(
        [Prepared(ground) for ground in grounds],
        family,
        of_member[motion, member],
        frame * count + member,
        scales[scale] * draws(ensemble)[member, 3],
    )
    return {name: getattr(found, name).reshape(shape) for name in PEAKS}


def margins_of(task: ScreeningTask) -> Arrays:
    """Return critical scales, numbers of islands, and robust margins.

    Returns
    -------
    dict of str to array, shape (motions, frames)
        ``critical_scale`` and ``safe_islands``; with an ensemble also ``robust_scale_10`` and
        ``robust_error_10``, and those of 25 and 50.

    Examples
    --------
    >>> shake = Record(record_id="shake", acceleration=[0.0, 3.0, 0.0], time_step=0.1)
    >>> task = ScreeningTask((shake,), (RockingFrame(height=9.6, width=1.6),))
    >>> margins_of(task)["safe_islands"].tolist()
    [[0]]
    """
    found = margins(task.motions, task.frames, ensemble=task.ensemble)
    robust = {
        f"robust_{what}_{share}": np.array(
            [[getattr(margin.robust, f"{prefix}{share}") for margin in row] for row in found]
        )
        for share in (() if task.ensemble is None else (10, 25, 50))
        for what, prefix in (("scale", "s"), ("error", "error"))
    }
    return robust | {
        "critical_scale": np.array([[margin.critical_scale for margin in row] for row in found]),
        "safe_islands": np.array(
            [[margin.safe_islands for margin in row] for row in found], dtype=np.int32
        ),
    }
