"""The request of a screening: what is computed for each motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Final, Self, TypeGuard

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import ParameterError, invalid
from rockframe.options.respond import ScreenOptions
from rockframe.quantities import LIMITED, QUANTITIES
from rockframe.risk import OVERTURNING, LimitState
from rockframe.rocking import Design, Histories, chosen_ensemble
from rockframe.stages.screen_motions import IN_ONE_PLANE
from rockframe.structures.contract import (
    Structure,
    computed_in_both_directions,
    kind_of,
    require_possible,
    why_not_both,
)
from rockframe.structures.screening import has_quantity
from rockframe.study.kinds import declared_kind

if TYPE_CHECKING:
    from rockframe.frame import RockingFrame

#: Quantities that motions in both directions do not have: columns that roll hit nothing.
LACKING_IN_BOTH: Final = ("peak_impact_velocity",)
#: Quantities of restraints, each with the key that it needs and the owner of the key.
_RESTRAINED: Final = (
    ("peak_tendon_ratio", "yield_stress_pa", "tendons"),
    ("peak_gap_ratio", "gap_m", "abutments"),
    ("ductility", "strength_ratio", "isolated or fixed bridges"),
)


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
    def limits(self) -> list[LimitState]:
        """Limit states, overturning first."""
        return [OVERTURNING, *(LimitState(*limit) for limit in self.options.limits())]

    @property
    def members(self) -> int:
        """Number of members of the ensemble in each scenario; 1 for the stated structure alone."""
        return self.options.scenario_members

    @property
    def demands(self) -> list[str]:
        """Quantities whose peaks at all scales are needed, for demands at return periods."""
        limited = LIMITED if self.options.return_period_years else ()
        return [quantity.name for quantity in limited]

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


def require_in_both(request: ScreeningRequest) -> None:
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
    """Return the kind and the parameters of a structure, as JSON values."""
    return {"kind": structure.kind, **asdict(structure)}  # type: ignore[call-overload]
