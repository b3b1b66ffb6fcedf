"""Isolated decks and monolithic frames as kinds of structures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rockframe.engines.engine import on_threads
from rockframe.errors import ParameterError
from rockframe.options.respond import Ensemble
from rockframe.oscillators.ensemble import bridge_ensemble, bridge_members, oscillator_ensemble
from rockframe.oscillators.margins import oscillator_margin
from rockframe.oscillators.response import (
    BaseShear,
    Oscillator,
    OscillatorResponse,
    respond_oscillator,
    respond_oscillators,
    respond_pairs,
)
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
    draws,
)
from rockframe.rocking.histories import with_ends
from rockframe.rocking.margins.ensemble import shaken
from rockframe.rocking.response import ToPulse
from rockframe.rocking.scenarios import scales_of
from rockframe.rocking.verdict import ModelEnd
from rockframe.structures.contract import Compared, Motion, Parameter, Shaking, in_one_plane
from rockframe.wavelets.pulse import Pulse

Float = NDArray[np.float64]


@dataclass(frozen=True)
class OscillatorKind:
    """The kind of `IsolatedDeck` or `FixedFrame`; it keeps the rules of `structures.contract`."""

    name: str
    quantities: tuple[str, ...]

    def parameters(self, structure: Oscillator) -> list[Parameter]:
        """Return the properties of a bridge that are finite."""
        parameters = [
            Parameter(name, label, float(getattr(structure, name)), units)
            for name, units, label in _PARAMETERS
            if hasattr(structure, name)
        ]
        if structure.abutment is not None:
            gap = structure.abutment.gap
            parameters.append(Parameter("gap", "gap at the abutment", gap, "m"))
        return [parameter for parameter in parameters if math.isfinite(parameter.value)]

    def why_not(self, _structure: Oscillator, motion: Motion) -> str:
        """Return why a bridge is not computed under a motion; "" if it is."""
        return "" if in_one_plane(motion) else "not computed for both directions"

    def require_possible(self, structure: Oscillator, ensemble: Ensemble | None) -> None:
        """Require members of an ensemble of the bridge that can be computed."""
        if ensemble is not None and ensemble.members:
            bridge_members(bridge_ensemble(ensemble), structure)

    def members(self, structure: Oscillator, ensemble: Ensemble) -> Sequence[Oscillator]:
        """Return each member of the ensemble of a bridge."""
        return bridge_members(bridge_ensemble(ensemble), structure)

    def most_critical(self, structures: Sequence[Oscillator], count: int) -> list[Oscillator]:
        """Return bridges of which members may be impossible: those that P-delta makes softest."""
        softest = sorted(
            structures, key=lambda structure: -getattr(structure, "stability_coefficient", 0.0)
        )
        return softest[:count]

    def respond(
        self, structures: Sequence[Oscillator], shaking: Shaking
    ) -> list[OscillatorResponse]:
        """Return the response of each bridge, with pulse, margins and base shear."""
        motion = as_ground(shaking.motion)  # type: ignore[arg-type]  # `why_not` excludes pairs
        return [_response(structure, motion, shaking) for structure in structures]

    def ensembles(
        self,
        structures: Sequence[Oscillator],
        motions: Sequence[Motion],
        ensemble: Ensemble,
        versions: Sequence[Versions | None],
    ) -> list[list[EnsembleResponse]]:
        """Return the response of the ensemble of each bridge to each motion."""
        chosen = bridge_ensemble(ensemble)
        return [
            [oscillator_ensemble(structure, motion, chosen, of_motion) for structure in structures]  # type: ignore[arg-type]
            for motion, of_motion in zip(motions, versions, strict=True)
        ]

    def history(self, structure: Oscillator, motion: GroundAcceleration) -> OscillatorResponse:
        """Return the bare response to a motion."""
        return respond_oscillator(structure, motion)

    def peaks(
        self,
        structures: Sequence[Oscillator],
        motions: Sequence[Record | GroundAcceleration],
        scales: Sequence[float],
    ) -> dict[str, NDArray[Any]]:
        """Return verdicts and largest displacements [m] of scenarios."""
        return _outcomes(respond_oscillators(structures, motions, scales).peak_displacement)

    def member_peaks(
        self,
        structures: Sequence[Oscillator],
        motions: Sequence[Record | GroundAcceleration],
        scales: Sequence[float],
        ensemble: Ensemble,
        versions: Sequence[Versions | None],
    ) -> dict[str, NDArray[Any]]:
        """Return the same of the members of each bridge."""
        factors, count = scales_of(scales), ensemble.members
        family = [
            member for structure in structures for member in self.members(structure, ensemble)
        ]
        grounds, of_member = shaken(motions, ensemble, versions)
        shape = (len(structures), factors.size, count)
        structure, scale, member = (axis.ravel() for axis in np.indices(shape))
        who, amplitude = structure * count + member, factors[scale] * draws(ensemble)[member, 3]

        def peaks(row: NDArray[np.int64]) -> Float:
            displacements = np.empty(who.size)
            for version in np.unique(row).tolist():
                some = row[member] == version
                of_version = respond_pairs(family, grounds[version], who[some], amplitude[some])
                displacements[some] = of_version.peak_displacement
            return displacements.reshape(shape)

        return _outcomes(np.stack(on_threads(peaks, list(of_member))))

    def quantities_of(
        self, structures: Sequence[Oscillator], peak: Float, _speed: Float
    ) -> dict[str, Float]:
        """Return the quantities of scenarios from the largest displacements."""
        yields = np.array([[structure.yield_displacement] for structure in structures])
        gaps = [
            math.nan if structure.abutment is None else structure.abutment.gap
            for structure in structures
        ]
        can_yield = (yields > 0.0) & np.isfinite(yields)
        return {
            "peak_u": peak,
            "peak_v": np.zeros_like(peak),
            "ductility": np.divide(peak, yields, out=np.full(peak.shape, np.nan), where=can_yield),
            "peak_gap_ratio": peak / np.array(gaps)[:, None],
        }

    def has(self, structure: Oscillator, quantity: str) -> bool:
        """Return True if limits of a quantity apply to a bridge."""
        yields = 0.0 < structure.yield_displacement < math.inf
        has = {"peak_u": True, "peak_v": True, "ductility": yields}
        has["peak_gap_ratio"] = structure.abutment is not None
        return has.get(quantity, False)

    def margins(
        self,
        structures: Sequence[Oscillator],
        motions: Sequence[Record | GroundAcceleration],
        ensemble: Ensemble | None,
    ) -> list[list[Margin]]:
        """Return the margin of each bridge under each motion."""
        chosen = None if ensemble is None else bridge_ensemble(ensemble)
        return [
            [oscillator_margin(structure, motion, chosen) for structure in structures]
            for motion in motions
        ]

    def resized(self, structure: Oscillator, dimension: str, _value: float) -> Oscillator:
        """Raise an error: the model of the bridge has none of the dimensions of a frame."""
        raise ParameterError(
            f"{self.name} bridge {structure.name!r} has no {dimension} to search for. Choose a "
            "rocking structure for the design."
        )

    def sliders(self, _structure: Oscillator) -> dict[str, float | str]:
        """Return none: the page of the explorer draws columns that uplift."""
        return {}

    def compared(self, structure: Oscillator, motion: Motion) -> Compared:
        """Return the response of a bridge in the quantities that all bridges have."""
        response = respond_oscillator(structure, motion)  # type: ignore[arg-type]
        return Compared(
            model=structure.name,
            time=response.time,
            u=response.u,
            v=response.v,
            base_shear=response.base_shear,
            peak_u=response.peak_u,
            peak_v=response.peak_v,
            residual_u=response.residual_u,
            peak_base_shear=response.peak_base_shear,
            ductility=response.ductility,
            model_end=response.model_end,
            valid_until=response.model_end_time,
            gap_closed_time=response.gap_closed_time,
            closing_velocity=response.closing_velocity,
        )


def _outcomes(displacement: Float) -> dict[str, NDArray[Any]]:
    """Return the peaks of the contract; an infinite displacement is a collapse."""
    fallen = np.where(np.isinf(displacement), Verdict.OVERTURNS, Verdict.STANDS)
    return {
        "verdict": fallen.astype(np.int8),
        "peak": displacement,
        "speed": np.full(displacement.shape, np.nan),
    }


def _response(
    structure: Oscillator, motion: GroundAcceleration, shaking: Shaking
) -> OscillatorResponse:
    """Return the response to one motion, with all that is asked."""
    options = shaking.options
    response = respond_oscillator(structure, motion)
    if shaking.parts:
        parts = tuple(_of_part(response, *ends) for ends in with_ends(shaking.parts))
        response = replace(response, parts=parts)
    if shaking.pulse is not None:
        response = replace(response, to_pulse=_to_pulse(response, shaking.pulse))
    if options.margins != "none":
        chosen = chosen_ensemble(options)
        ensemble = None if chosen is None else bridge_ensemble(chosen)
        response = replace(response, margin=oscillator_margin(structure, motion, ensemble))
    if options.forces:
        response = replace(response, forces=BaseShear(response.peak_base_shear))
    ends = response.model_end is not ModelEnd.NONE or response.verdict is Verdict.OVERTURNS
    return Histories(options.histories).keep(response, near=ends)


def _to_pulse(response: OscillatorResponse, pulse: Pulse) -> ToPulse:
    """Return the response to the pulse alone, and the error of its largest displacement."""
    alone = respond_oscillator(response.model, pulse)
    return ToPulse.of(response, alone, "peak_u", ratio=math.nan)


def _of_part(response: OscillatorResponse, part: Part, end: float) -> PartResponse:
    """Return the largest |u| at the nodes of a motion of a sequence, or the peak within it."""
    within = (response.time >= part.start) & (response.time <= end)
    u = float(np.abs(response.u[within]).max(initial=0.0))  # NaN after collapse
    if part.start <= response.peak_time <= end:
        u = max(u, response.peak_u)
    return PartResponse(part, math.nan, math.nan, u, math.nan, math.nan)


#: Properties of isolated and fixed bridges: name, unit and description.
_PARAMETERS: Final = (
    ("period", "s", "period of the stiffness of the isolators, or of the elastic frame"),
    ("strength_ratio", "1", "strength of isolators or columns over the weight that they carry"),
    ("yield_displacement", "m", "displacement at first yield"),
    ("damping_ratio", "1", "viscous damping over critical damping"),
    ("post_yield_ratio", "1", "stiffness after yielding over the elastic one"),
    ("stability_coefficient", "1", "moment of P-delta over that of the elastic shear"),
    ("limit_ductility", "1", "largest ductility for which the model is valid"),
)
_QUANTITIES: Final = ("ductility", "peak_force_ratio", "residual_u", "first_yield_time")
ISOLATED: Final = OscillatorKind("isolated", _QUANTITIES)
FIXED: Final = OscillatorKind("fixed", (*_QUANTITIES, "ductility_exceeded_time"))
