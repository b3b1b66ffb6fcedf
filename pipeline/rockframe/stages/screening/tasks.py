"""The tasks of a screening, whose results are kept on disk until all are done."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from itertools import chain, islice, repeat
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rockframe.engines.engine import Engine, map_tasks
from rockframe.quantities import OF_SCENARIO, QUANTILES
from rockframe.results.schema.response import SCREEN_NC
from rockframe.results.screen import KeptHistory, WritePart
from rockframe.risk import LimitState
from rockframe.rocking import Design, Verdict, chosen_ensemble, quantiles
from rockframe.stages.common import Progress
from rockframe.stages.screen_motions import Motion, Motions
from rockframe.stages.screening.finished import FinishedTasks
from rockframe.stages.screening.outcomes import OF_MEMBERS, applies
from rockframe.stages.screening.request import ScreeningRequest, require_in_both
from rockframe.structures.contract import (
    PEAKS,
    Structure,
    kind_of,
)
from rockframe.structures.screening import (
    Scenario,
    ScreeningTask,
    ground_of,
    margins_of,
    member_peaks_of,
    peaks_of,
    quantities_of,
    responses_of,
)

Float = NDArray[np.float64]
Arrays = dict[str, NDArray[Any]]
_Named = tuple[str, Callable[[], ScreeningTask]]

#: Approximate number of responses per task, of some 0.1 s each; an interruption loses no more.
_RESPONSES: Final = 2048
#: Largest number of motions per task, which are in memory together.
_TOGETHER: Final = 64
#: Largest number of motions per task if members respond, because each may have five versions.
_TOGETHER_IN_VERSIONS: Final = 12
#: Number of scenarios whose quantities are computed together.
_SCENARIOS: Final = 2**14
#: Largest number of responses of candidates that are in memory together.
_HELD: Final = 2**22
#: Approximate number of history nodes per task.
_NODES: Final = 200_000


class ScreeningRun:
    """The tasks of a screening, whose motions are chosen.

    If it is `joined`, files of batches have the scenarios already.

    Raises
    ------
    ParameterError
        If motions in both directions count, and a structure lacks there what the design needs, or
        no structure has the quantity of a stated limit.
    """

    def __init__(
        self,
        chosen: Motions,
        request: ScreeningRequest,
        finished: FinishedTasks,
        engine: Engine | None,
        progress: Progress,
        *,
        joined: bool = False,
    ) -> None:
        if any(motion.in_both for motion in chosen.motions):
            require_in_both(request)
        self._chosen = chosen
        self.motions = chosen.motions
        self.request = request
        self._finished = finished
        self._engine = engine
        self._progress = progress
        self._joined = joined
        self._done = 0

    def sizes(self) -> dict[str, int]:
        """Return the dimensions of the variables of scenarios."""
        request = self.request
        sizes = {
            "record": len(self.motions),
            "structure": len(request.structures),
            "scale": request.scales.size,
            "limit_state": len(request.limits),
            "member": request.members,
        }
        return sizes | ({"quantile": len(QUANTILES)} if request.members > 1 else {})

    def rows(self) -> Iterator[Arrays]:
        """Yield the scenarios of each motion by variable, with the outcomes of the members.

        Without an ensemble, the stated structure is the only member.
        """
        structures, ensemble = self.request.structures, self.request.options.scenario_ensemble()
        if ensemble is None:
            for motion, row in zip(self.motions, self._nominal(), strict=True):
                alone = {name: values[:, None] for name, values in row.items()}
                yield row | self._outcomes(motion, alone)
            return
        each = self._peaks("members")
        for motion, row, peaks in zip(self.motions, self._nominal(), each, strict=True):
            families = [
                quantities_of(
                    kind_of(structure).members(structure, ensemble),
                    *(values[k].T for values in peaks),
                )
                for k, structure in enumerate(structures)
            ]
            arrays = {name: np.stack([family[name] for family in families]) for name in families[0]}
            outcomes = self._outcomes(motion, arrays)
            yield row | outcomes | self._shares_and_bands(motion, arrays, outcomes["reached"])

    def _nominal(self) -> Iterator[Arrays]:
        """Yield the quantities of the stated structures motion by motion, computed for many."""
        peaks = self._peaks("peaks")
        structures, scales = self.request.structures, self.request.scales.size
        together = max(1, _SCENARIOS // (len(structures) * scales))
        while some := list(islice(peaks, together)):
            joined = (np.concatenate(values, axis=1) for values in zip(*some, strict=True))
            arrays = quantities_of(structures, *joined)
            for k in range(len(some)):
                part = slice(k * scales, (k + 1) * scales)
                yield {name: values[:, part] for name, values in arrays.items()}

    def _outcomes(self, motion: Motion, arrays: Arrays) -> Arrays:
        """Return the outcomes; arrays have the shape (structures, members, scales)."""
        request = self.request
        fell = arrays["verdict"] == Verdict.OVERTURNS
        reached = [limit.reached(arrays, fell).sum(axis=1) for limit in request.limits]
        outcomes: Arrays = {"reached": np.stack(reached, axis=-1)}
        for name in OF_MEMBERS:
            outcomes[f"members_{name}"] = _standing(arrays, name)[..., request.reference]
        for name in request.demands:
            demands = np.where(
                self._has(motion, [name])[:, :, None], _standing(arrays, name), np.nan
            )
            outcomes[f"members_{name}_at_scales"] = demands.swapaxes(1, 2)
        return outcomes

    def _has(self, motion: Motion, quantities: Sequence[str]) -> NDArray[np.bool_]:
        """Return if limits of quantities apply under a motion, shape (structures, quantities)."""
        return np.array(
            [
                [applies(structure, name, in_both=motion.in_both) for name in quantities]
                for structure in self.request.structures
            ]
        )

    def _shares_and_bands(
        self, motion: Motion, arrays: Arrays, reached: NDArray[np.intp]
    ) -> Arrays:
        """Return the variables of an ensemble, shape (structures, scales, ...)."""
        has = self._has(motion, [limit.quantity for limit in self.request.limits])
        shares = np.where(has[:, None], reached / self.request.members, np.nan)
        uplifted = (arrays["verdict"] != Verdict.NO_UPLIFT).mean(axis=1)
        unknown = arrays["verdict"][:, 0, 0] == Verdict.NOT_COMPUTED
        shares[unknown], uplifted[unknown] = np.nan, np.nan
        bands = {
            quantity.band: quantiles(_standing(arrays, quantity.name).swapaxes(1, 2))
            for quantity in OF_SCENARIO
        }
        return {"share_reached": shares, "share_uplifted": uplifted, **bands}

    def histories(self, selected: Sequence[NDArray[np.intp]]) -> Iterator[KeptHistory]:
        """Yield histories of scenarios motion by motion.

        Parameters
        ----------
        selected : sequence of array, shape (scenarios, 2)
            For each motion, the places of structures and scales.
        """
        where = ((i, k, s) for i, of_motion in enumerate(selected) for k, s in of_motion.tolist())
        for responses in map_tasks(responses_of, self._scenarios(selected), engine=self._engine):
            for response in responses:
                yield next(where), response

    def _scenarios(self, selected: Sequence[NDArray[np.intp]]) -> Iterator[tuple[Scenario, ...]]:
        """Yield groups of scenarios of limited size; each motion is read once."""
        structures, scales = self.request.structures, self.request.scales
        for motion, of_motion in zip(self.motions, selected, strict=True):
            if not len(of_motion):
                continue
            ground = ground_of(self._chosen.read(motion))
            together = max(1, _NODES // ground.time.size)
            for start in range(0, len(of_motion), together):
                yield tuple(
                    Scenario(ground, structures[k], float(scales[s]))
                    for k, s in of_motion[start : start + together].tolist()
                )

    def margin_values(self, write: WritePart | None) -> dict[str, Any]:
        """Return the margins, shape (motions, structures), or write them; none if not requested."""
        if self.request.options.margins == "none":
            return {}
        parts = self._map("margins")
        if write is None:
            held = [*parts]
            return {name: np.concatenate([part[name] for part in held]) for name in held[0]}
        start = 0
        for part in parts:
            end = start + len(next(iter(part.values())))
            for name, values in part.items():
                write(name, (slice(start, end), slice(None)), SCREEN_NC[name].array(values))
            start = end
        return {}

    def candidates(self, design: Design, each: Sequence[NDArray[np.intp]]) -> tuple[Float, Float]:
        """Return how candidates meet the limit of a design, over all motions and members.

        Parameters
        ----------
        design : Design
            The design.
        each : sequence of array
            The motions that count for each structure.

        Returns
        -------
        share, quantile : array, shape (candidates,)
            Share below the limit [1], and 84 % quantile of the quantity, infinite if it overturns.
        """
        shares, largest = list[float](), list[float]()
        # a structure has one candidate for each value of the dimension, and the same motions count
        counting = chain.from_iterable(repeat(some, design.steps) for some in each)
        for candidates, held in self._of_groups():
            for reached, demand in zip(*self._of_candidates(design, candidates, held), strict=True):
                some = next(counting)
                shares.append(float((~reached[some]).mean()))
                largest.append(float(quantiles(demand[some].ravel())[2]))
        return np.array(shares), np.array(largest)

    def _of_groups(self) -> Iterator[tuple[tuple[Structure, ...], Arrays]]:
        """Yield each group of candidates with its peaks, (motions, candidates, scale, ...)."""
        groups, held, width = iter(self._groups()), list[Arrays](), 0
        for part in self._map("design"):
            held.append(part)
            width += len(part["verdict"])
            if width == len(self.motions):
                whole = {name: np.concatenate([entry[name] for entry in held]) for name in PEAKS}
                yield next(groups), whole
                held, width = [], 0

    def _of_candidates(
        self, design: Design, candidates: Sequence[Structure], held: Arrays
    ) -> tuple[NDArray[np.bool_], Float]:
        """Return which responses reach the limit, and their demand, (candidates, motions, ...)."""
        ensemble = self.request.options.scenario_ensemble()
        family = candidates
        if ensemble is not None:
            family = [
                m
                for candidate in candidates
                for m in kind_of(candidate).members(candidate, ensemble)
            ]
        columns = {name: values.reshape(len(self.motions), -1).T for name, values in held.items()}
        quantities = quantities_of(family, *(columns[name] for name in PEAKS))
        fell = quantities["verdict"] == Verdict.OVERTURNS
        shape = (len(candidates), -1, len(self.motions))
        reached = LimitState(design.quantity, design.limit).reached(quantities, fell)
        demand = _standing(quantities, design.quantity)
        return tuple(values.reshape(shape).swapaxes(1, 2) for values in (reached, demand))  # type: ignore[return-value]

    def _peaks(self, kind: str) -> Iterator[tuple[NDArray[Any], ...]]:
        """Yield the `PEAKS` of each motion, each of shape (structures, scales, ...)."""
        held: list[Arrays] = []
        width = 0
        for part in self._map(kind):
            held.append(part)
            width += part["verdict"].shape[2]
            if width < self.request.scales.size:
                continue
            whole = (np.concatenate([entry[name] for entry in held], axis=2) for name in PEAKS)
            yield from zip(*whole, strict=True)
            held, width = [], 0

    def _map(self, kind: str) -> Iterator[Arrays]:
        each = peaks_of if self.request.options.scenario_members == 1 else member_peaks_of
        functions = {"peaks": peaks_of, "margins": margins_of, "members": each, "design": each}
        return self._finished.map(functions[kind], self._tasks(kind), self._engine, self._step)

    def _groups(self) -> list[tuple[Structure, ...]]:
        """Return the candidates in groups whose responses to all motions fit into memory."""
        candidates = self.request.candidates
        width = max(1, min(_RESPONSES, _HELD // len(self.motions)) // self.request.members)
        return [candidates[k : k + width] for k in range(0, len(candidates), width)]

    def _tasks(self, kind: str) -> Iterator[_Named]:
        """Yield the tasks of one kind: several motions, or some scales of one motion."""
        scales = self.request.scales
        if kind in ("margins", "design"):
            scales = scales[self.request.reference :][:1]
        groups = self._groups() if kind == "design" else [self.request.structures]
        motions = self.motions
        for number, structures in enumerate(groups):
            columns = len(structures) * (1 if kind == "peaks" else self.request.members)
            most = _TOGETHER if columns == len(structures) else _TOGETHER_IN_VERSIONS
            each = columns * scales.size
            together = 1 if kind == "margins" else min(max(1, _RESPONSES // each), most)
            width = scales.size if each <= _RESPONSES else max(1, _RESPONSES // columns)
            for first in range(0, len(motions), together):
                for start in range(0, scales.size, width):
                    some = motions[first : first + together]
                    part = tuple(scales[start : start + width].tolist())
                    name = f"{kind}-{number}-{first}-{start}"
                    yield name, self._maker(kind, some, structures, part)

    def _maker(
        self,
        kind: str,
        motions: Sequence[Motion],
        structures: tuple[Structure, ...],
        scales: tuple[float, ...],
    ) -> Callable[[], ScreeningTask]:
        options = self.request.options
        ensemble = chosen_ensemble(options) if kind == "margins" else options.scenario_ensemble()
        responding = kind in ("members", "design")
        return lambda: ScreeningTask(
            tuple(map(self._chosen.read, motions)),
            structures,
            scales,
            ensemble,
            tuple(map(self._chosen.uncertain, motions)) if responding else (),
        )

    def _step(self) -> None:
        self._done += 1
        self._progress(self._done, self._count)

    @cached_property
    def _count(self) -> int:
        """Number of all tasks; with the scenarios in files of batches, only those of the design."""
        options = self.request.options
        wanted = {
            "peaks": not self._joined,
            "members": options.scenario_members > 1 and not self._joined,
            "margins": options.margins != "none" and not self._joined,
            "design": bool(self.request.candidates),
        }
        return sum(1 for kind, needed in wanted.items() if needed for _ in self._tasks(kind))


def _standing(arrays: Arrays, name: str) -> Float:
    """Return peaks, infinite where a structure overturns."""
    return np.where(arrays["verdict"] == Verdict.OVERTURNS, np.inf, arrays[name])
