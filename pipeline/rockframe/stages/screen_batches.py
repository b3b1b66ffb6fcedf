"""Compute a screening: motions one at a time, in batches kept on disk until all are done."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import replace
from itertools import chain, islice, repeat
from typing import Any, Final, Self

import numpy as np
from numpy.typing import NDArray

from rockframe.engines.engine import Engine, map_tasks
from rockframe.quantities import LIMITED, OF_SCENARIO, QUANTILES
from rockframe.results.screen import Batches, KeptHistory
from rockframe.risk import OVERTURNING, HazardCurve, LimitState, demands_at, measure_of
from rockframe.rocking import Design, Verdict, chosen_ensemble, quantiles
from rockframe.rocking.verdict import COMPUTED
from rockframe.stages.common import Progress
from rockframe.stages.screen_motions import Motion, Motions
from rockframe.stages.screening.outcomes import AllOutcomes, Outcomes
from rockframe.stages.screening.request import LACKING_IN_BOTH, ScreeningRequest, require_in_both
from rockframe.structures.contract import (
    PEAKS,
    Structure,
    kind_of,
)
from rockframe.structures.screening import (
    Scenario,
    ScreeningTask,
    ground_of,
    has_quantity,
    margins_of,
    member_peaks_of,
    peaks_of,
    quantities_of,
    responses_of,
)

Float = NDArray[np.float64]
Arrays = dict[str, NDArray[Any]]
#: For each structure and limit state, the shares of members that reach it, for the motions that
#: count and the scales; None if the structure has no such quantity.
Reached = list[list[Float | None]]
_Named = tuple[str, Callable[[], ScreeningTask]]

#: Approximate number of responses per batch, of some 0.1 s each; an interruption loses no more.
_RESPONSES: Final = 2048
#: Largest number of motions per batch, which are in memory together.
_TOGETHER: Final = 64
#: Largest number of motions per batch if members respond, because each may have five versions.
_TOGETHER_IN_VERSIONS: Final = 12
#: Number of scenarios whose quantities are computed together.
_SCENARIOS: Final = 2**14
#: Largest number of responses of candidates that are in memory together.
_HELD: Final = 2**22
#: Approximate number of history nodes per batch.
_NODES: Final = 200_000


class ScreeningRun:
    """The batches of a screening, which share the chosen motions.

    `rows` fills the outcomes, from which `parts` makes runs of some structures each: their
    ``outcomes`` are those of all motions.

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
        batches: Batches,
        engine: Engine | None,
        progress: Progress,
    ) -> None:
        if any(motion.in_both for motion in chosen.motions):
            require_in_both(request)
        self._chosen = chosen
        self.motions = chosen.motions
        self.request = request
        self._batches = batches
        self._engine = engine
        self._progress = progress
        self._done = 0
        self._shape = (len(chosen.motions), len(request.structures), request.scales.size)
        self.members = request.options.scenario_members
        self.limits = [OVERTURNING, *(LimitState(*limit) for limit in request.options.limits())]
        some = LIMITED if request.options.return_period_years else ()
        self._every = AllOutcomes(
            *(self._shape, len(self.limits), self.members, [each.name for each in some]),
            batches.folder.parent,
        )
        self.outcomes: Outcomes
        self.computed = 0
        self._selected: list[NDArray[np.intp]] = []

    @property
    def is_large(self) -> bool:
        """Return True if the outcomes of all structures are not in memory together."""
        return self._every.is_large

    def parts(self) -> Iterator[tuple[slice, Self]]:
        """Yield places of structures, and the run of only these; call after `rows`."""
        for some, outcomes in self._every.parts():
            part = copy(self)
            part.request = replace(self.request, structures=self.request.structures[some])
            part.outcomes = outcomes
            yield some, part

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
        lacking = self.motions[motion].in_both and quantity in LACKING_IN_BOTH
        return has_quantity(structure, quantity) and not lacking

    def counting(self) -> list[NDArray[np.intp]]:
        """Return the places of the motions that count for each structure.

        They are those in both directions, if it is computed under any; else those in one plane.
        """
        in_both = np.array([motion.in_both for motion in self.motions])
        places = []
        for k in range(len(self.request.structures)):
            computed = self.outcomes.verdicts[:, k, 0] != Verdict.NOT_COMPUTED
            both = np.flatnonzero(computed & in_both)
            places.append(both if both.size else np.flatnonzero(computed & ~in_both))
        return places

    def sizes(self) -> dict[str, int]:
        """Return the dimensions of the variables of scenarios."""
        sizes = dict(zip(("record", "structure", "scale"), self._shape, strict=True))
        further = {"limit_state": len(self.limits), "quantile": len(QUANTILES)}
        return sizes | (further if self.members > 1 else {})

    def shares(self, limit: int) -> Float:
        """Return the shares of members that reach a limit, (motions, structures, scales)."""
        share: Float = self.outcomes.reached[limit] / self.members
        return share

    def reached_by_each(self, counting: Sequence[NDArray[np.intp]]) -> Reached:
        """Return the shares that reach each limit under the motions that count, by structure.

        Where all motions count, they are parts of one array for each limit.
        """
        shares = [self.shares(number) for number, _ in enumerate(self.limits)]
        whole = slice(None)
        return [
            [
                of_limit[whole if some.size == len(of_limit) else some, k]
                if self.has(structure, limit.quantity, int(some[0]))
                else None
                for of_limit, limit in zip(shares, self.limits, strict=True)
            ]
            for k, (structure, some) in enumerate(
                zip(self.request.structures, counting, strict=True)
            )
        ]

    def rows(self) -> Iterator[Arrays]:
        """Yield the scenarios motion by motion, and fill the outcomes."""
        structures = self.request.structures
        ensemble = self.request.options.scenario_ensemble()
        each = repeat(None) if ensemble is None else self._peaks("members")
        for i, (row, of_members) in enumerate(zip(self._nominal(), each, strict=False)):
            place, outcomes = self._every.of_motion(i)
            outcomes.verdicts[place] = row["verdict"]
            self.computed += int(np.isin(row["verdict"], COMPUTED).sum())
            mask = self.request.histories.mask(row["verdict"], row["peak_rotation_ratio"])
            self._selected.append(np.argwhere(mask & (row["verdict"] != Verdict.NOT_COMPUTED)))
            if ensemble is None or of_members is None:
                self._keep_nominal(i, row)
                yield row
                continue
            held_peaks = []
            for k, structure in enumerate(structures):
                columns = (values[k].T for values in of_members)
                family = quantities_of(kind_of(structure).members(structure, ensemble), *columns)
                self._keep(i, k, family)
                held_peaks.append(self._shares_and_bands(i, k, family))
            yield row | {
                name: np.stack([held_peak[name] for held_peak in held_peaks])
                for name in held_peaks[0]
            }

    def _nominal(self) -> Iterator[Arrays]:
        """Yield the quantities of the stated structures motion by motion, computed for many."""
        peaks = self._peaks("peaks")
        together = max(1, _SCENARIOS // (self._shape[1] * self._shape[2]))
        while some := list(islice(peaks, together)):
            joined = (np.concatenate(values, axis=1) for values in zip(*some, strict=True))
            arrays = quantities_of(self.request.structures, *joined)
            for k in range(len(some)):
                part = slice(k * self.request.scales.size, (k + 1) * self.request.scales.size)
                yield {name: values[:, part] for name, values in arrays.items()}

    def _keep_nominal(self, i: int, arrays: Arrays) -> None:
        """Keep what the stated structures do under a motion, shape (structures, scales)."""
        structures = self.request.structures
        fell = arrays["verdict"] == Verdict.OVERTURNS
        place, outcomes = self._every.of_motion(i)
        for limit, reached in zip(self.limits, outcomes.reached, strict=True):
            reached[place] = limit.reached(arrays, fell)
        for name, peaks in outcomes.peaks.items():
            peaks[place] = _standing(arrays, name)[:, self.request.reference, None]
        for name, demands in outcomes.demands.items():
            has = [k for k, structure in enumerate(structures) if self.has(structure, name, i)]
            demands[place] = np.nan
            demands[place, has] = _standing(arrays, name)[has][..., None]

    def _keep(self, i: int, k: int, arrays: Arrays) -> None:
        """Keep what the members of a structure do under a motion, shape (members, scales)."""
        fell = arrays["verdict"] == Verdict.OVERTURNS
        place, outcomes = self._every.of_motion(i)
        for limit, reached in zip(self.limits, outcomes.reached, strict=True):
            reached[place, k] = limit.reached(arrays, fell).sum(axis=0)
        for name, peaks in outcomes.peaks.items():
            peaks[place, k] = _standing(arrays, name)[:, self.request.reference]
        for name, demands in outcomes.demands.items():
            has = self.has(self.request.structures[k], name, i)
            demands[place, k] = _standing(arrays, name).T if has else np.nan

    def _shares_and_bands(self, i: int, k: int, arrays: Arrays) -> Arrays:
        """Return the variables of an ensemble, shape (scales, limits) or (scales, quantiles)."""
        place, outcomes = self._every.of_motion(i)
        structure = self.request.structures[k]
        has = [self.has(structure, limit.quantity, i) for limit in self.limits]
        share = outcomes.reached[:, place, k].T / self.members
        bands = {
            quantity.band: quantiles(_standing(arrays, quantity.name).T) for quantity in OF_SCENARIO
        }
        uplifted = (arrays["verdict"] != Verdict.NO_UPLIFT).mean(axis=0)
        reached = np.where(has, share, np.nan)
        if arrays["verdict"][0, 0] == Verdict.NOT_COMPUTED:
            uplifted, reached = np.full_like(uplifted, np.nan), np.full_like(reached, np.nan)
        return {"share_reached": reached, "share_uplifted": uplifted, **bands}

    def histories(self) -> Iterator[KeptHistory]:
        """Yield the kept histories motion by motion; call after `rows`."""
        where = self._where()
        for responses in map_tasks(responses_of, self._scenarios(), engine=self._engine):
            for response in responses:
                yield next(where), response

    def _where(self) -> Iterator[tuple[int, int, int]]:
        for i, selected in enumerate(self._selected):
            for k, s in selected.tolist():
                yield i, k, s

    def _scenarios(self) -> Iterator[tuple[Scenario, ...]]:
        """Yield groups of scenarios of limited size; each motion is read once."""
        structures, scales = self.request.structures, self.request.scales
        for motion, selected in zip(self.motions, self._selected, strict=True):
            if not len(selected):
                continue
            ground = ground_of(self._chosen.read(motion))
            together = max(1, _NODES // ground.time.size)
            for start in range(0, len(selected), together):
                yield tuple(
                    Scenario(ground, structures[k], float(scales[s]))
                    for k, s in selected[start : start + together].tolist()
                )

    def margins(self) -> Iterator[Arrays]:
        """Yield margins of some motions, shape (motions, structures), if they were requested."""
        if self.request.options.margins != "none":
            yield from self._map("margins")

    def demands_at(self, curve: HazardCurve, intensities: Mapping[str, Float]) -> dict[str, Any]:
        """Return the demand of each structure at the return periods, by variable.

        Parameters
        ----------
        curve : HazardCurve
            Hazard curve of the site.
        intensities : mapping of str to array, shape (motions,)
            Intensity of each motion, by measure.
        """
        options = self.request.options
        periods = options.return_period_years
        if not periods:
            return {}
        clusters = np.array([motion.cluster for motion in self.motions])
        measured, scales = intensities[curve.measure], self.request.scales
        factors, counting = scales ** measure_of(curve.measure).power, self.counting()
        values: dict[str, Any] = {"return_period_years": [*periods]}
        for name, of_frames in self.outcomes.demands.items():
            demands = [
                demands_at(
                    *(curve, periods, of_frames[some, k], (measured[some], factors)),
                    *(clusters[some], options.fragility_curve),
                )
                for k, some in enumerate(counting)
            ]
            for end in demands[0]:
                variable = f"{name}_at_return_period" + ("" if end == "value" else f"_{end}")
                values[variable] = np.stack([of_frame[end] for of_frame in demands])
        return values

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
        # of a structure, one value of the dimension after the other
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
        return self._batches.map(functions[kind], self._tasks(kind), self._engine, self._step)

    def _groups(self) -> list[tuple[Structure, ...]]:
        """Return the candidates in groups whose responses to all motions fit into memory."""
        candidates = self.request.candidates
        width = max(1, min(_RESPONSES, _HELD // len(self.motions)) // self.members)
        return [candidates[k : k + width] for k in range(0, len(candidates), width)]

    def _tasks(self, kind: str) -> Iterator[_Named]:
        """Yield the batches of one kind: several motions, or some scales of one motion."""
        scales = self.request.scales
        if kind in ("margins", "design"):
            scales = scales[self.request.reference :][:1]
        groups = self._groups() if kind == "design" else [self.request.structures]
        motions = self.motions
        for number, structures in enumerate(groups):
            columns = len(structures) * (1 if kind == "peaks" else self.members)
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
        self._progress(self._done, sum(1 for kind in self._kinds() for _ in self._tasks(kind)))

    def _kinds(self) -> list[str]:
        """Return the kinds of batches that are computed."""
        options = self.request.options
        wanted = {
            "peaks": True,
            "members": options.scenario_members > 1,
            "margins": options.margins != "none",
            "design": bool(self.request.candidates),
        }
        return [kind for kind, needed in wanted.items() if needed]


def _standing(arrays: Arrays, name: str) -> Float:
    """Return peaks, infinite where a structure overturns."""
    return np.where(arrays["verdict"] == Verdict.OVERTURNS, np.inf, arrays[name])
