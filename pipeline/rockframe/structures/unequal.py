"""Bents of two unequal columns as a kind of structure."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.options.respond import Ensemble
from rockframe.record import Part, Record
from rockframe.rocking import (
    EnsembleResponse,
    GroundAcceleration,
    Histories,
    Margin,
    PartResponse,
    Verdict,
    Versions,
    as_ground,
    chosen_ensemble,
    require_motion,
)
from rockframe.rocking.histories import with_ends
from rockframe.rocking.response import ToPulse
from rockframe.rocking.scenarios import scales_of
from rockframe.rocking.verdict import ModelEnd
from rockframe.structures.contract import Compared, Motion, Parameter, Shaking, in_one_plane
from rockframe.unequal import BentResponse, UnequalBent, bent_ensemble, respond_bent
from rockframe.unequal.ensemble import bent_members, member_peaks
from rockframe.unequal.forces import (
    base_shear,
    bent_forces,
    demand_of,
    force_bands,
    largest_forces,
)
from rockframe.unequal.margins import bent_margin
from rockframe.unequal.scenarios import outcomes_of, quantities_of

Float = NDArray[np.float64]


@dataclass(frozen=True)
class UnequalKind:
    """The kind of `UnequalBent`; its methods keep the rules of `structures.contract`."""

    name: str = "unequal"
    quantities: tuple[str, ...] = ("peak_level_difference",)
    slider_names: tuple[str, ...] = (
        *("height_left", "height_right", "width_left", "width_right"),
        *("spacing", "beam_depth", "beam_offset", "mass_ratio", "restitution_factor"),
    )

    def parameters(self, structure: UnequalBent) -> list[Parameter]:
        """Return dimensions of a bent, and what differs between its sides."""
        values = {name: getattr(structure, name) for name in _OF_BEAM}
        for name, attribute in _OF_SIDES.items():
            values |= zip(
                (f"{name}_right", f"{name}_left"), getattr(structure, attribute), strict=True
            )
        for name, attribute in _OF_COLUMNS.items():
            values |= zip(
                (f"{name}_left", f"{name}_right"), getattr(structure, attribute), strict=True
            )
        return [
            Parameter(name, label, values[name], units) for name, (label, units) in _LABELS.items()
        ]

    def why_not(self, _structure: UnequalBent, motion: Motion) -> str:
        """Return why a bent is not computed under a motion; "" if it is."""
        return "" if in_one_plane(motion) else "not computed for both directions"

    def require_possible(self, structure: UnequalBent, ensemble: Ensemble | None) -> None:
        """Require members of an ensemble of the bent that can rock."""
        if ensemble is not None and ensemble.members:
            bent_members(ensemble, structure)

    def members(self, structure: UnequalBent, ensemble: Ensemble) -> Sequence[UnequalBent]:
        """Return each member of the ensemble of a bent."""
        return bent_members(ensemble, structure)

    def most_critical(self, structures: Sequence[UnequalBent], count: int) -> list[UnequalBent]:
        """Return the bents that lose most, and those that lose least in impacts."""
        by_loss = sorted(structures, key=lambda bent: math.prod(bent.restitutions))
        return [*dict.fromkeys([*by_loss[:count], *by_loss[-count:]])]

    def respond(self, structures: Sequence[UnequalBent], shaking: Shaking) -> list[BentResponse]:
        """Return the response of each bent, with pulse and margins."""
        motion = as_ground(shaking.motion)  # type: ignore[arg-type]  # `why_not` excludes pairs
        require_motion(shaking.options.ensemble, motion)
        return [_response(structure, motion, shaking) for structure in structures]

    def ensembles(
        self,
        structures: Sequence[UnequalBent],
        motions: Sequence[Motion],
        ensemble: Ensemble,
        versions: Sequence[Versions | None],
    ) -> list[list[EnsembleResponse]]:
        """Return the response of the ensemble of each bent to each motion."""
        return [
            [bent_ensemble(bent, motion, ensemble, of_motion) for bent in structures]  # type: ignore[arg-type]
            for motion, of_motion in zip(motions, versions, strict=True)
        ]

    def history(self, structure: UnequalBent, motion: GroundAcceleration) -> BentResponse:
        """Return the bare response to a motion."""
        return respond_bent(structure, motion)

    def peaks(
        self,
        structures: Sequence[UnequalBent],
        motions: Sequence[Record | GroundAcceleration],
        scales: Sequence[float],
    ) -> dict[str, NDArray[Any]]:
        """Return verdicts, and in place of peak and speed the largest |theta| to both sides."""
        factors = scales_of(scales)
        shape = (len(motions), len(structures), factors.size)
        motion, bent, scale = (axis.ravel() for axis in np.indices(shape))
        grounds = [as_ground(each) for each in motions]
        results = outcomes_of(grounds, structures, motion, bent, factors[scale])
        return {name: results[name].reshape(shape) for name in ("verdict", "peak", "speed")}

    def member_peaks(
        self,
        structures: Sequence[UnequalBent],
        motions: Sequence[Record | GroundAcceleration],
        scales: Sequence[float],
        ensemble: Ensemble,
        versions: Sequence[Versions | None],
    ) -> dict[str, NDArray[Any]]:
        """Return the same of the members of each bent."""
        results = member_peaks(structures, motions, scales, ensemble, versions)
        return {name: results[name] for name in ("verdict", "peak", "speed")}

    def quantities_of(
        self, structures: Sequence[UnequalBent], peak: Float, speed: Float
    ) -> dict[str, Float]:
        """Return the quantities of scenarios from the largest |theta| to both sides."""
        values = quantities_of(structures, peak, speed)
        # responses alone have the quantities of the kind
        return {name: values[name] for name in values if name not in self.quantities}

    def has(self, _structure: UnequalBent, quantity: str) -> bool:
        """Return True if limits of a quantity apply to a bent."""
        return quantity in ("peak_rotation_ratio", "peak_u", "peak_v")

    def margins(
        self,
        structures: Sequence[UnequalBent],
        motions: Sequence[Record | GroundAcceleration],
        ensemble: Ensemble | None,
    ) -> list[list[Margin]]:
        """Return the margin of each bent under each motion."""
        return [[bent_margin(bent, motion, ensemble) for bent in structures] for motion in motions]

    def resized(self, structure: UnequalBent, dimension: str, _value: float) -> UnequalBent:
        """Raise an error: designs are searched for frames of equal columns only."""
        raise ParameterError(
            f"bent {structure.name!r} has no {dimension} to search for: its columns are unequal. "
            "Choose a rocking structure for the design."
        )

    def sliders(self, structure: UnequalBent) -> dict[str, float | str]:
        """Return the dimensions of a bent whose columns have one density and depth."""
        sections = np.multiply(structure.heights, structure.widths)
        densities = np.divide(structure.column_masses or sections, sections)
        if abs(densities[1] / densities[0] - 1.0) > _ONE_DENSITY:
            return {}
        values = {name: float(getattr(structure, name)) for name in self.slider_names[4:]}
        for name, attribute in _OF_COLUMNS.items():
            pair = getattr(structure, attribute)
            values |= zip((f"{name}_left", f"{name}_right"), map(float, pair), strict=True)
        return {name: values[name] for name in self.slider_names}

    def of_sliders(self, values: Mapping[str, Any]) -> UnequalBent:
        """Return the bent of dimensions."""
        heights, widths = (
            (values[f"{name}_left"], values[f"{name}_right"]) for name in _OF_COLUMNS
        )
        others = {name: values[name] for name in self.slider_names[4:]}
        return UnequalBent(name="own", heights=heights, widths=widths, **others)

    def compared(self, structure: UnequalBent, motion: Motion) -> Compared:
        """Return the response of a bent in the quantities that all bridges have."""
        ground = as_ground(motion)  # type: ignore[arg-type]
        response = respond_bent(structure, ground)
        shear = base_shear(response, ground)
        overturned = response.verdict is Verdict.OVERTURNS
        time = response.overturning_time if overturned else math.nan
        return Compared(
            model=structure.name,
            time=response.time,
            u=response.u,
            v=response.v,
            base_shear=shear,
            peak_u=math.inf if overturned else response.peak_u,
            peak_v=math.inf if overturned else response.peak_v,
            residual_u=math.inf if overturned else 0.0,
            peak_base_shear=float(np.abs(shear[~np.isnan(response.u)]).max()),
            peak_rotation_ratio=response.peak_rotation_ratio,
            model_end=ModelEnd.OVERTURNS if overturned else ModelEnd.NONE,
            valid_until=time,
            gap_closed_time=math.nan,
            closing_velocity=math.nan,
        )


def _response(structure: UnequalBent, motion: GroundAcceleration, shaking: Shaking) -> BentResponse:
    """Return the response to one motion, with all that is asked."""
    options = shaking.options
    response = respond_bent(structure, motion)
    forces = bent_forces(response, motion)
    demand = demand_of(response, motion, forces)
    response = replace(response, contact=demand)
    if options.forces:
        largest = largest_forces(response, forces)
        response = replace(response, forces=demand, column_forces=largest)
        if options.ensemble.members:
            bands = force_bands(structure, motion, options.ensemble, shaking.versions)
            response = replace(response, column_bands=bands)
    if shaking.parts:
        parts = tuple(_of_part(response, *ends) for ends in with_ends(shaking.parts))
        response = replace(response, parts=parts)
    if shaking.pulse is not None:
        alone = respond_bent(structure, shaking.pulse)
        response = replace(response, to_pulse=ToPulse.of(response, alone, "peak_rotation_ratio"))
    if options.margins != "none":
        margin = bent_margin(structure, motion, chosen_ensemble(options))
        response = replace(response, margin=margin)
    return Histories(options.histories).keep(response)


def _of_part(response: BentResponse, part: Part, end: float) -> PartResponse:
    """Return the largest values at the nodes of a motion of a sequence."""
    within = (response.time >= part.start) & (response.time <= end)
    right, left = response.bent.balance_rotations
    theta = response.theta[within]
    ratio = np.maximum(theta / right, -theta / left)
    u = float(np.abs(response.u[within]).max(initial=0.0))  # NaN after overturning
    return PartResponse(part, float(ratio[0]), float(ratio.max()), u, math.nan, math.nan)


#: Largest relative difference of the densities of columns that count as of one density [1].
_ONE_DENSITY: Final = 1e-6
#: Properties of both columns, and of rocking to both sides: name and attribute.
_OF_COLUMNS: Final = {"height": "heights", "width": "widths"}
_OF_BEAM: Final = ("spacing", "beam_depth", "beam_offset")
_OF_SIDES: Final = {
    "uplift_acceleration": "uplift_accelerations",
    "restitution": "restitutions",
    "balance_rotation": "balance_rotations",
}
#: Names of properties with description and unit.
_LABELS: Final = {
    "height_left": ("height of the left column", "m"),
    "height_right": ("height of the right column", "m"),
    "width_left": ("width of the left column", "m"),
    "width_right": ("width of the right column", "m"),
    "spacing": ("distance between the axes of the columns", "m"),
    "beam_depth": ("depth of the beam", "m"),
    "beam_offset": ("distance of the beam's centre from the middle between the axes", "m"),
    "uplift_acceleration_right": ("ground acceleration that uplifts to the right, over g", "1"),
    "uplift_acceleration_left": ("ground acceleration that uplifts to the left, over g", "1"),
    "restitution_right": ("speed after an impact from the right over that before", "1"),
    "restitution_left": ("speed after an impact from the left over that before", "1"),
    "balance_rotation_right": ("rotation of the left column at balance on the right", "rad"),
    "balance_rotation_left": ("rotation of the left column at balance on the left", "rad"),
}
UNEQUAL: Final = UnequalKind()
