"""Compute a screening in batches, which are kept on disk until all are done."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final, Self

import numpy as np
from numpy.typing import NDArray

from rockframe.engines.engine import Engine, map_batches
from rockframe.errors import invalid
from rockframe.frame import RockingFrame
from rockframe.options.respond import ScreenOptions
from rockframe.results.screening.batches import Batches
from rockframe.results.screening.screen import KeptHistory
from rockframe.risk import OVERTURNING, LimitState
from rockframe.risk.limits import limited_in, peaks_of_frames
from rockframe.rocking import (
    Design,
    Histories,
    Scenario,
    ScreeningBatch,
    Verdict,
    as_ground,
    chosen_ensemble,
    margins_of,
    peaks_of,
    responses_of,
)
from rockframe.stages.common import Progress
from rockframe.stages.screening.motions import Motion, Motions

Arrays = dict[str, NDArray[Any]]
Task = tuple[str, Callable[[], ScreeningBatch]]

#: Arrays of a batch of peaks.
_PEAKS: Final = ("verdict", "peak_rotation", "impact_velocity")
#: Quantities of restraints, each with the key that it needs and the owner of the key.
_RESTRAINED: Final = (
    ("tendon_ratio", "yield_stress_pa", "tendons"),
    ("gap_ratio", "gap_m", "abutments"),
)
#: Approximate number of scenarios per batch, of some 0.1 s each; an interruption loses no more.
_SCENARIOS: Final = 2048
#: Largest number of motions per batch, which are in memory together.
_TOGETHER: Final = 64
#: Approximate number of history nodes per batch.
_NODES: Final = 200_000


@dataclass(frozen=True, eq=False)
class ScreeningRequest:
    """The computation for each motion.

    Parameters
    ----------
    options : ScreenOptions
        Options of the screening.
    frames : tuple of RockingFrame
        The structures.
    design : Design, optional
        The design problem.
    candidates : tuple of RockingFrame
        Candidate frames of the design, structure by structure.
    scales : array, shape (scales,)
        Multiples of the motions [1].
    """

    options: ScreenOptions
    frames: tuple[RockingFrame, ...]
    design: Design | None
    candidates: tuple[RockingFrame, ...]
    scales: NDArray[np.float64]

    @classmethod
    def of(cls, options: ScreenOptions, frames: tuple[RockingFrame, ...]) -> Self:
        """Return the request of these options for these structures.

        Raises
        ------
        ParameterError
            If a candidate of the design or a member of the ensemble cannot rock, if no structure
            has the restraint of a stated limit, or if a structure lacks the restraint that the
            design limits.
        """
        chosen_ensemble(options, frames)
        for quantity, key, owner in _RESTRAINED:
            without = [frame.name for frame in frames if not limited_in(frame, quantity)]
            if getattr(options, f"limit_{quantity}") and len(without) == len(frames):
                raise invalid(key, None, owner, f"stated for limit_{quantity}")
            if without and options.design is not None and options.design.quantity == quantity:
                stated = f"stated for a design of quantity {quantity}"
                raise invalid(key, None, f"frame {without[0]!r}", stated)
        design = None
        if options.design is not None:
            lowest, highest = options.design.range
            others = {k: v for k, v in options.design if k != "range"}
            design = Design(lowest=lowest, highest=highest, **others)
        candidates = tuple(c for one in frames for c in (design.candidates(one) if design else ()))
        return cls(options, frames, design, candidates, np.array(options.scales))

    @property
    def histories(self) -> Histories:
        """Scenarios whose histories are written."""
        return Histories(self.options.histories)

    @property
    def reference(self) -> int:
        """Position of the scale nearest to 1."""
        return int(np.argmin(np.abs(np.log(self.scales))))

    def scenarios(self) -> dict[str, Any]:
        """Return everything that the scenarios depend on, as JSON values."""
        return {
            "frames": [asdict(frame) for frame in self.frames],
            "candidates": [asdict(frame) for frame in self.candidates],
            "scales": self.scales.tolist(),
            "margins": self.options.model_dump(mode="json", include={"margins", "ensemble"}),
        }


class ScreeningRun:
    """The batches of a screening, which share the chosen motions.

    `rows` fills three arrays: ``verdicts``, shape (motions, structures, scales); ``ratio``, the
    largest |theta| / alpha at the scale nearest to 1, infinite if the structure overturns, shape
    (motions, structures); and ``reached``, True for scenarios that reach a limit state, shape
    (limits, motions, structures, scales).
    """

    def __init__(
        self,
        chosen: Motions,
        request: ScreeningRequest,
        batches: Batches,
        engine: Engine | None,
        progress: Progress,
    ) -> None:
        self._chosen = chosen
        self.motions = chosen.motions
        self.request = request
        self._batches = batches
        self._engine = engine
        self._progress = progress
        self._done = 0
        shape = (len(chosen.motions), len(request.frames), request.scales.size)
        self.verdicts = np.empty(shape, dtype=np.int8)
        self.ratio = np.empty(shape[:2])
        self.limits = [OVERTURNING, *(LimitState(*limit) for limit in request.options.limits())]
        self.reached = np.empty((len(self.limits), *shape), dtype=bool)
        self._kept: list[NDArray[np.intp]] = []

    def rows(self) -> Iterator[Arrays]:
        """Yield the scenarios motion by motion, and fill `verdicts` and `ratio`."""
        frames, at = self.request.frames, self.request.reference
        for i, (verdict, *peaks) in enumerate(self._peaks()):
            row = peaks_of_frames(frames, verdict, *peaks)
            self.verdicts[i] = verdict
            fell = verdict[:, at] == Verdict.OVERTURNED
            for limit, reached in zip(self.limits, self.reached, strict=True):
                reached[i] = limit.reached(row, verdict == Verdict.OVERTURNED)
            ratio = row["peak_rotation_ratio"]
            self.ratio[i] = np.where(fell, np.inf, ratio[:, at])
            self._kept.append(np.argwhere(self.request.histories.mask(verdict, ratio)))
            yield row

    def histories(self) -> Iterator[KeptHistory]:
        """Yield the kept histories motion by motion; call after `rows`."""
        where = self._where()
        for responses in map_batches(responses_of, self._scenarios(), engine=self._engine):
            for response in responses:
                yield next(where), response

    def _where(self) -> Iterator[tuple[int, int, int]]:
        for i, kept in enumerate(self._kept):
            for k, s in kept.tolist():
                yield i, k, s

    def _scenarios(self) -> Iterator[tuple[Scenario, ...]]:
        """Yield groups of scenarios of limited size; each motion is read once."""
        frames, scales = self.request.frames, self.request.scales
        for motion, kept in zip(self.motions, self._kept, strict=True):
            if not len(kept):
                continue
            ground = as_ground(self._chosen.read(motion))
            together = max(1, _NODES // ground.coefficients.shape[0])
            for start in range(0, len(kept), together):
                yield tuple(
                    Scenario(ground, frames[k], float(scales[s]))
                    for k, s in kept[start : start + together].tolist()
                )

    def margins(self) -> Arrays:
        """Return margins, shape (motions, structures); empty if they were not requested."""
        if self.request.options.margins == "none":
            return {}
        found = list(self._map(margins_of, "margins"))
        return {name: np.concatenate([part[name] for part in found]) for name in found[0]}

    def candidates_reach(self) -> NDArray[np.bool_] | None:
        """Return a mask of motions that bring candidates to the limit, (motions, candidates)."""
        design = self.request.options.design
        if design is None:
            return None
        limit = LimitState(design.quantity, design.limit)
        rows = []
        for part in self._map(peaks_of, "design"):
            for verdict, *peaks in zip(*(part[name] for name in _PEAKS), strict=True):
                row = peaks_of_frames(self.request.candidates, verdict, *peaks)
                rows.append(limit.reached(row, verdict == Verdict.OVERTURNED)[:, 0])
        return np.array(rows)

    def _peaks(self) -> Iterator[tuple[NDArray[Any], ...]]:
        """Yield verdict, peaks and so on of each motion, each of shape (structures, scales)."""
        held: list[Arrays] = []
        width = 0
        for part in self._map(peaks_of, "peaks"):
            held.append(part)
            width += part["verdict"].shape[2]
            if width < self.request.scales.size:
                continue
            whole = (np.concatenate([one[name] for one in held], axis=2) for name in _PEAKS)
            yield from zip(*whole, strict=True)
            held, width = [], 0

    def _map(self, function: Callable[[ScreeningBatch], Arrays], kind: str) -> Iterator[Arrays]:
        return self._batches.map(function, self._tasks(kind), self._engine, self._step)

    def _tasks(self, kind: str) -> Iterator[Task]:
        """Yield the batches of one kind: several motions, or some scales of one motion."""
        frames = self.request.candidates if kind == "design" else self.request.frames
        scales = self.request.scales
        if kind != "peaks":
            scales = scales[self.request.reference :][:1]
        each = len(frames) * scales.size
        together = 1 if kind == "margins" else min(max(1, _SCENARIOS // each), _TOGETHER)
        width = scales.size if each <= _SCENARIOS else max(1, _SCENARIOS // len(frames))
        motions = self.motions
        for first in range(0, len(motions), together):
            for start in range(0, scales.size, width):
                some = motions[first : first + together]
                part = tuple(scales[start : start + width].tolist())
                yield f"{kind}-{first}-{start}", self._maker(some, frames, part)

    def _maker(
        self, motions: Sequence[Motion], frames: tuple[RockingFrame, ...], scales: tuple[float, ...]
    ) -> Callable[[], ScreeningBatch]:
        ensemble = chosen_ensemble(self.request.options)
        return lambda: ScreeningBatch(
            tuple(map(self._chosen.read, motions)), frames, scales, ensemble
        )

    def _step(self) -> None:
        self._done += 1
        kinds = ["peaks", *(["margins"] if self.request.options.margins != "none" else [])]
        kinds += ["design"] if self.request.candidates else []
        self._progress(self._done, sum(1 for kind in kinds for _ in self._tasks(kind)))
