"""Compute a screening: motions one at a time, in batches kept on disk until all are done."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import chain, islice, repeat
from typing import TYPE_CHECKING, Any, Final, Self, TypeGuard

import numpy as np
from numpy.typing import NDArray

from rockframe.engines.engine import Engine, map_tasks
from rockframe.errors import ParameterError, invalid
from rockframe.options.respond import ScreenOptions
from rockframe.quantities import LIMITED, OF_SCENARIO, QUANTILES, QUANTITIES
from rockframe.results.screen import Batches, KeptHistory
from rockframe.risk import OVERTURNING, HazardCurve, LimitState, demands_at, measure_of
from rockframe.rocking import Design, Histories, Verdict, chosen_ensemble, quantiles
from rockframe.stages.common import Progress
from rockframe.stages.screen_motions import IN_ONE_PLANE, Motion, Motions
from rockframe.structures.contract import (
    PEAKS,
    Structure,
    computed_in_both_directions,
    kind_of,
    require_possible,
    why_not_both,
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
from rockframe.study.kinds import declared_kind

if TYPE_CHECKING:
    from rockframe.frame import RockingFrame

Float = NDArray[np.float64]


Arrays = dict[str, NDArray[Any]]
#: For each structure and limit state, the shares of members that reach it, for the motions that
#: count and the scales; None if the structure has no such quantity.
Reached = list[list[Float | None]]
_Named = tuple[str, Callable[[], ScreeningTask]]

#: Peaks of which the values of all members at the reference scale are kept.
_KEPT: Final = ("peak_rotation_ratio", "peak_u")
#: Quantities that motions in both directions do not have: columns that roll hit nothing.
LACKING_IN_BOTH: Final = ("peak_impact_velocity",)
#: Quantities of restraints, each with the key that it needs and the owner of the key.
_RESTRAINED: Final = (
    ("peak_tendon_ratio", "yield_stress_pa", "tendons"),
    ("peak_gap_ratio", "gap_m", "abutments"),
    ("ductility", "strength_ratio", "isolated or fixed bridges"),
)
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


@dataclass(frozen=True, eq=False)
class ScreeningRequest:
    """The computation for each motion.

    Parameters
    ----------
    options : ScreenOptions
        Options of the screening.
    structures : tuple of Structure
        The structures.
    design : Design, optional
        The design problem.
    candidates : tuple of Structure
        Candidates of the design, structure by structure.
    scales : array, shape (scales,)
        Multiples of the motions [1].
    """

    options: ScreenOptions
    structures: tuple[Structure, ...]
    design: Design | None
    candidates: tuple[Structure, ...]
    scales: NDArray[np.float64]

    @classmethod
    def of(cls, options: ScreenOptions, structures: tuple[Structure, ...]) -> Self:
        """Return the request of these options for these structures.

        Raises
        ------
        ParameterError
            If a candidate of the design or a member of an ensemble cannot rock, if no structure
            has the restraint of a stated limit, or if a structure lacks the restraint that the
            design limits.
        """
        _require_free(options, structures)
        require_possible(structures, chosen_ensemble(options))
        for quantity, key, owner in _RESTRAINED:
            without = [
                structure.name for structure in structures if not has_quantity(structure, quantity)
            ]
            if getattr(options, f"limit_{quantity}") and len(without) == len(structures):
                raise invalid(key, None, owner, f"stated for limit_{quantity}")
            if without and options.design is not None and options.design.quantity == quantity:
                needs = f"stated for a design of quantity {quantity}"
                raise invalid(key, None, f"frame {without[0]!r}", needs)
        design = None
        if options.design is not None:
            lowest, highest = options.design.range
            others = {k: v for k, v in options.design if k != "range"}
            design = Design(lowest=lowest, highest=highest, **others)
        candidates = () if design is None else _candidates(design, structures)
        require_possible((*structures, *candidates), options.scenario_ensemble())
        return cls(options, structures, design, candidates, np.array(options.scales))

    @property
    def pairs(self) -> bool:
        """Return True if motions in both directions are computed, where the records have them."""
        options = self.options
        wanted = options.both_directions and not options.azimuths_degree
        return wanted and computed_in_both_directions(self.structures)

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
            "structures": [_as_json(structure) for structure in self.structures],
            "candidates": [_as_json(candidate) for candidate in self.candidates],
            "scales": self.scales.tolist(),
            "members": self.options.model_dump(
                mode="json", include={"margins", "ensemble", "scenario_members"}
            ),
        }


def is_free(structure: Structure) -> TypeGuard[RockingFrame]:
    """Return True for rocking frames without tendons, dissipaters and abutments."""
    return declared_kind(structure.kind).rocks and not getattr(structure, "restrained", True)


def _require_free(options: ScreenOptions, structures: Sequence[Structure]) -> None:
    free = [structure.name for structure in structures if is_free(structure)]
    if options.pooled and len(free) < 2:
        raise ParameterError(
            f"pooled needs at least two rocking structures without tendons and dissipaters, and "
            f"there {'is one' if free else 'is none'} of {len(structures)}. State more, or leave "
            "out pooled."
        )


def _candidates(design: Design, structures: Sequence[Structure]) -> tuple[Structure, ...]:
    """Return each structure with each value of the dimension of a design."""
    return tuple(
        kind_of(structure).resized(structure, design.dimension, value)
        for structure in structures
        for value in design.values.tolist()
    )


def _require_in_both(request: ScreeningRequest) -> None:
    """Require that structures have the stated quantities under motions in both directions."""
    if request.design is not None:
        _require_alike(request.design, request.structures, request.candidates)
    for quantity, _ in request.options.limits():
        lacking = quantity in LACKING_IN_BOTH
        if lacking and not any(
            why_not_both(structure) and has_quantity(structure, quantity)
            for structure in request.structures
        ):
            raise ParameterError(
                f"limit_{QUANTITIES[quantity].column()} applies to no structure: columns that roll "
                f"in both directions hit nothing. Leave it out, or state {IN_ONE_PLANE}."
            )


def _require_alike(
    design: Design, structures: Sequence[Structure], candidates: Sequence[Structure]
) -> None:
    """Require that the motions that count for a structure can count for its candidates."""
    for number, candidate in enumerate(candidates):
        structure = structures[number // design.values.size]
        if why_not_both(structure):
            continue
        if design.quantity in LACKING_IN_BOTH:
            reason = f"has no {design.quantity} in both directions"
        elif reason := why_not_both(candidate):
            reason = f"with another {design.dimension} is {reason}"
        else:
            continue
        raise ParameterError(
            f"structure {structure.name!r} {reason}. State {IN_ONE_PLANE} for a design in one "
            "plane."
        )


def _as_json(structure: Structure) -> dict[str, Any]:
    """Return what a structure is, as JSON values."""
    return {"kind": structure.kind, **asdict(structure)}  # type: ignore[call-overload]


class ScreeningRun:
    """The batches of a screening, which share the chosen motions.

    `rows` fills three attributes. ``verdicts``, shape (motions, structures, scales), has those of
    the stated structures. ``reached``, shape (limits, motions, structures, scales), counts the
    members that reach a limit state in each scenario. ``kept`` has the largest |theta| / alpha and
    |u| of each member at the scale nearest to 1, infinite for members that overturn, each of shape
    (motions, structures, members). Without an ensemble, the stated structure is the only member.

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
            _require_in_both(request)
        self._chosen = chosen
        self.motions = chosen.motions
        self.request = request
        self._batches = batches
        self._engine = engine
        self._progress = progress
        self._done = 0
        shape = (len(chosen.motions), len(request.structures), request.scales.size)
        self.members = request.options.scenario_members
        self.verdicts = np.empty(shape, dtype=np.int8)
        self.limits = [OVERTURNING, *(LimitState(*limit) for limit in request.options.limits())]
        self.reached = np.empty((len(self.limits), *shape), dtype=np.uint16)
        self.kept = {name: np.empty((*shape[:2], self.members)) for name in _KEPT}
        some = LIMITED if request.options.return_period_years else ()
        self._demands = {each.name: np.full((*shape, self.members), np.nan) for each in some}
        self._selected: list[NDArray[np.intp]] = []

    @property
    def ratio(self) -> Float:
        """Median of |theta| / alpha at the scale nearest to 1, shape (motions, structures)."""
        median: Float = quantiles(self.kept["peak_rotation_ratio"])[..., 1]
        return median

    @property
    def demand(self) -> Float:
        """The median that ranks motions: of |theta| / alpha or, without a rotation, of |u| [m]."""
        drift = quantiles(self.kept["peak_u"])[..., 1]
        return np.where(np.isnan(self.ratio), drift, self.ratio)

    def has(self, structure: Structure, quantity: str, motion: int) -> bool:
        """Return True if limits of a quantity apply to a structure under a motion by its place."""
        lacking = self.motions[motion].in_both and quantity in LACKING_IN_BOTH
        return has_quantity(structure, quantity) and not lacking

    def counting(self) -> list[NDArray[np.intp]]:
        """Return the places of the motions that count for each structure; call after `rows`.

        They are those in both directions, if it is computed under any; else those in one plane.
        """
        in_both = np.array([motion.in_both for motion in self.motions])
        places = []
        for k in range(len(self.request.structures)):
            computed = self.verdicts[:, k, 0] != Verdict.NOT_COMPUTED
            both = np.flatnonzero(computed & in_both)
            places.append(both if both.size else np.flatnonzero(computed & ~in_both))
        return places

    def sizes(self) -> dict[str, int]:
        """Return the dimensions of the variables of scenarios."""
        sizes = dict(zip(("record", "structure", "scale"), self.verdicts.shape, strict=True))
        further = {"limit_state": len(self.limits), "quantile": len(QUANTILES)}
        return sizes | (further if self.members > 1 else {})

    def shares(self, limit: int) -> Float:
        """Return the shares of members that reach a limit, (motions, structures, scales)."""
        share: Float = self.reached[limit] / self.members
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
        """Yield the scenarios motion by motion, and fill the attributes."""
        structures = self.request.structures
        ensemble = self.request.options.scenario_ensemble()
        each = repeat(None) if ensemble is None else self._peaks("members")
        for i, (row, of_members) in enumerate(zip(self._nominal(), each, strict=False)):
            self.verdicts[i] = row["verdict"]
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
        together = max(1, _SCENARIOS // self.verdicts[0].size)
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
        for limit, reached in zip(self.limits, self.reached, strict=True):
            reached[i] = limit.reached(arrays, fell)
        for name, kept in self.kept.items():
            kept[i] = _standing(arrays, name)[:, self.request.reference, None]
        for name, demands in self._demands.items():
            has = [k for k, structure in enumerate(structures) if self.has(structure, name, i)]
            demands[i, has] = _standing(arrays, name)[has][..., None]

    def _keep(self, i: int, k: int, arrays: Arrays) -> None:
        """Keep what the members of a structure do under a motion, shape (members, scales)."""
        fell = arrays["verdict"] == Verdict.OVERTURNS
        for limit, reached in zip(self.limits, self.reached, strict=True):
            reached[i, k] = limit.reached(arrays, fell).sum(axis=0)
        for name, kept in self.kept.items():
            kept[i, k] = _standing(arrays, name)[:, self.request.reference]
        for name, demands in self._demands.items():
            if self.has(self.request.structures[k], name, i):
                demands[i, k] = _standing(arrays, name).T

    def _shares_and_bands(self, i: int, k: int, arrays: Arrays) -> Arrays:
        """Return the variables of an ensemble, shape (scales, limits) or (scales, quantiles)."""
        structure = self.request.structures[k]
        has = [self.has(structure, limit.quantity, i) for limit in self.limits]
        share = self.reached[:, i, k].T / self.members
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

    def margins(self) -> Arrays:
        """Return margins, shape (motions, structures); empty if they were not requested."""
        if self.request.options.margins == "none":
            return {}
        batches = list(self._map("margins"))
        return {name: np.concatenate([part[name] for part in batches]) for name in batches[0]}

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
        for name, of_frames in self._demands.items():
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

    def candidates(self, design: Design) -> tuple[Float, Float]:
        """Return how candidates meet the limit of a design, over all motions and members.

        Returns
        -------
        share, quantile : array, shape (candidates,)
            Share below the limit [1], and 84 % quantile of the quantity, infinite if it overturns.
        """
        shares, largest = list[float](), list[float]()
        # of a structure, one value of the dimension after the other
        counting = chain.from_iterable(repeat(some, design.steps) for some in self.counting())
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
