"""Rocking frames, free, restrained, hybrid or with crushed edges, as a kind of structure."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rockframe.frame import RockingFrame
from rockframe.options.respond import Ensemble
from rockframe.oscillators.response import largest_until
from rockframe.parts import RECTANGULAR, SECTIONS, Lever, inertia_ratio_of
from rockframe.record import Record
from rockframe.rocking import (
    EnsembleResponse,
    GroundAcceleration,
    Histories,
    Margin,
    NominalResponses,
    Response,
    Versions,
    as_ground,
    chosen_ensemble,
    draws,
    ensemble_responses,
    margins,
    members,
    nominal_responses,
    part_responses,
    reactions,
    require_motion,
    respond,
    respond_many,
    respond_scenarios,
    surely_rock,
    ties_of,
    with_contact,
    with_envelope,
    with_forces,
    with_margins,
    with_pulse,
)
from rockframe.rocking.design import varied
from rockframe.rocking.margins.ensemble import shaken
from rockframe.rocking.scenarios import Prepared, scales_of
from rockframe.rocking.verdict import ModelEnd, Verdict, first_end, sometime
from rockframe.structures.contract import (
    Compared,
    Motion,
    Parameter,
    Shaking,
    StructureResponse,
    in_one_plane,
)
from rockframe.wavelets.pulse import Pulse

Float = NDArray[np.float64]


@dataclass(frozen=True)
class RockingKind:
    """The kind of `RockingFrame`; its methods keep the rules of `structures.contract`."""

    name: str = "rocking"
    quantities: tuple[str, ...] = ()
    slider_names: tuple[str, ...] = (
        *("height", "width", "mass_ratio", "restitution_factor", "section"),
    )

    def parameters(self, _structure: RockingFrame) -> tuple[Parameter, ...]:
        """Return none: all properties of frames have variables of their own."""
        return ()

    def why_not(self, structure: RockingFrame, motion: Motion) -> str:
        """Return why a frame is not computed under a motion; "" if it is."""
        if in_one_plane(motion):
            return ""
        from rockframe.structures.wobbling import why_not_both  # planar motions need no other code

        return why_not_both(structure)

    def require_possible(self, structure: RockingFrame, ensemble: Ensemble | None) -> None:
        """Require a frame, and members of its ensemble, that the kernel can compute."""
        ties_of(structure)
        if ensemble is not None and ensemble.members and not surely_rock(ensemble, structure):
            members(ensemble, structure)

    def members(self, structure: RockingFrame, ensemble: Ensemble) -> Sequence[RockingFrame]:
        """Return each member of the ensemble of a frame."""
        return members(ensemble, structure)

    def most_critical(self, structures: Sequence[RockingFrame], count: int) -> list[RockingFrame]:
        """Return the stoutest frames, and those that lose least in impacts."""
        stoutest = sorted(structures, key=lambda frame: -frame.slenderness)[:count]
        bounciest = sorted(structures, key=lambda frame: -frame.restitution)[:count]
        return [*dict.fromkeys([*stoutest, *bounciest])]

    def respond(
        self, structures: Sequence[RockingFrame], shaking: Shaking
    ) -> Sequence[StructureResponse]:
        """Return the response of each frame, with contact, pulse, margins and forces."""
        options = shaking.options
        if not isinstance(shaking.motion, Record | Pulse | GroundAcceleration):
            from rockframe.structures.wobbling import respond_both

            return respond_both(structures, shaking.motion, shaking)
        motion = as_ground(shaking.motion)
        require_motion(options.ensemble, motion)
        responses = _nominal(structures, motion, shaking)
        if shaking.parts:
            responses = [
                replace(response, parts=part_responses(response, shaking.parts))
                for response in responses
            ]
        if options.margins != "none":
            responses = with_margins(responses, motion, chosen_ensemble(options))
        if options.forces:
            beside = (motion, options.ensemble, shaking.versions)
            responses = [with_forces(response, *beside) for response in responses]
        kept = [Histories(options.histories).keep(response) for response in responses]
        ensemble = chosen_ensemble(options)
        if ensemble is None:
            return kept
        return [
            with_envelope(response, motion, ensemble, shaking.versions)
            if response.time.size
            else response
            for response in kept
        ]

    def nominal(
        self,
        structures: Sequence[RockingFrame],
        motions: Sequence[Record | GroundAcceleration],
        pulses: Sequence[Pulse | None],
    ) -> Sequence[NominalResponses] | None:
        """Return the responses to each motion as arrays; None if a frame needs its history."""
        return nominal_responses(motions, structures, pulses)

    def ensembles(
        self,
        structures: Sequence[RockingFrame],
        motions: Sequence[Motion],
        ensemble: Ensemble,
        versions: Sequence[Versions | None],
    ) -> list[list[EnsembleResponse]]:
        """Return the response of the ensemble of each frame to each motion."""
        of_motions: dict[int, list[EnsembleResponse]] = {}
        plane = [i for i, motion in enumerate(motions) if in_one_plane(motion)]
        if plane:
            rows = ensemble_responses(
                [motions[i] for i in plane],  # type: ignore[misc]
                structures,
                ensemble,
                [versions[i] for i in plane],
            )
            of_motions |= zip(plane, rows, strict=True)
        if both := [i for i in range(len(motions)) if i not in of_motions]:
            from rockframe.structures.wobbling import ensembles_both

            rows = ensembles_both(structures, [motions[i] for i in both], ensemble)  # type: ignore[misc]
            of_motions |= zip(both, rows, strict=True)
        return [of_motions[i] for i in range(len(motions))]

    def history(self, structure: RockingFrame, motion: Motion) -> StructureResponse:
        """Return the bare response to a motion."""
        if isinstance(motion, Record | Pulse | GroundAcceleration):
            return respond(structure, as_ground(motion))
        from rockframe.structures.wobbling import history_both

        return history_both(structure, motion)

    def peaks(
        self,
        structures: Sequence[RockingFrame],
        motions: Sequence[Motion],
        scales: Sequence[float],
    ) -> dict[str, NDArray[Any]]:
        """Return verdicts, peak rotations [rad] and speeds of impacts [m s-1] of scenarios."""
        if not in_one_plane(motions[0]):
            from rockframe.structures.wobbling import peaks_both

            return peaks_both(structures, motions, scales)  # type: ignore[arg-type]
        outcomes = respond_many(motions, structures, scales)  # type: ignore[arg-type]
        return {name: getattr(outcomes, attribute) for name, attribute in _PEAKS.items()}

    def member_peaks(
        self,
        structures: Sequence[RockingFrame],
        motions: Sequence[Motion],
        scales: Sequence[float],
        ensemble: Ensemble,
        versions: Sequence[Versions | None],
    ) -> dict[str, NDArray[Any]]:
        """Return the same of the members of each frame."""
        if not in_one_plane(motions[0]):
            from rockframe.structures.wobbling import member_peaks_both

            return member_peaks_both(structures, motions, scales, ensemble)  # type: ignore[arg-type]
        factors, count = scales_of(scales), ensemble.members
        family = [member for frame in structures for member in members(ensemble, frame)]
        grounds, of_member = shaken(motions, ensemble, versions)  # type: ignore[arg-type]
        shape = (len(motions), len(structures), factors.size, count)
        motion, frame, scale, member = (axis.ravel() for axis in np.indices(shape))
        outcomes = respond_scenarios(
            [Prepared(ground) for ground in grounds],
            family,
            of_member[motion, member],
            frame * count + member,
            factors[scale] * draws(ensemble)[member, 3],
        )
        return {
            name: getattr(outcomes, attribute).reshape(shape) for name, attribute in _PEAKS.items()
        }

    def quantities_of(
        self, structures: Sequence[RockingFrame], peak: Float, speed: Float
    ) -> dict[str, Float]:
        """Return the quantities of scenarios from peak rotations and speeds of impacts."""
        return quantities_of_frames(structures, peak, speed)

    def has(self, structure: RockingFrame, quantity: str) -> bool:
        """Return True if a frame has a quantity: some need a tendon that yields, or a gap."""
        if quantity == "peak_tendon_ratio":
            return structure.tendon is not None and structure.tendon.yield_force < math.inf
        if quantity == "peak_gap_ratio":
            return structure.abutment is not None
        return quantity != "ductility"

    def margins(
        self,
        structures: Sequence[RockingFrame],
        motions: Sequence[Motion],
        ensemble: Ensemble | None,
    ) -> list[list[Margin]]:
        """Return the margin of each frame under each motion."""
        if not in_one_plane(motions[0]):
            from rockframe.structures.wobbling import margins_both

            return margins_both(structures, motions, ensemble)  # type: ignore[arg-type]
        return margins(motions, structures, ensemble=ensemble)  # type: ignore[arg-type]

    def resized(self, structure: RockingFrame, dimension: str, value: float) -> RockingFrame:
        """Return a frame of another height, width or mass ratio: see `DIMENSIONS`."""
        return varied(structure, dimension, value)

    def sliders(self, structure: RockingFrame) -> dict[str, float | str]:
        """Return the dimensions of a free frame with prismatic columns; none of other frames."""
        if structure.restrained or not structure.prismatic:
            return {}
        values = {name: float(getattr(structure, name)) for name in self.slider_names[:-1]}
        return {**values, "section": _section(structure)}

    def of_sliders(self, values: Mapping[str, Any]) -> RockingFrame:
        """Return the frame of dimensions, and of a section or an inertia ratio."""
        height, width, section = values["height"], values["width"], values["section"]
        # The dimensions are checked before an inertia is computed from them.
        frame = RockingFrame(height=height, width=width, name="own")
        given = not isinstance(section, str)
        return replace(
            frame,
            mass_ratio=values["mass_ratio"],
            inertia_ratio=section if given else inertia_ratio_of(section, height, width),
            restitution_factor=values["restitution_factor"],
        )

    def compared(self, structure: RockingFrame, motion: Motion) -> Compared:
        """Return the response of a frame in the quantities that all bridges have."""
        ground = as_ground(motion)  # type: ignore[arg-type]
        return _compared(with_contact(respond(structure, ground), ground), ground)


def _nominal(
    frames: Sequence[RockingFrame], motion: GroundAcceleration, shaking: Shaking
) -> list[Response]:
    """Return the responses with contact and pulse, of all frames at once if no history is needed.

    Histories are needed for forces, and for the motions of a sequence.
    """
    options, pulse = shaking.options, shaking.pulse
    if options.histories == "none" and not (options.forces or shaking.parts):
        together = nominal_responses([motion], frames, [pulse])
        if together is not None:
            return together[0].responses()
    responses = [with_contact(respond(frame, motion), motion) for frame in frames]
    return [with_pulse(response, pulse) for response in responses] if pulse else responses


#: Attributes of `Scenarios` that are the peaks of the contract.
_PEAKS: Final = {"verdict": "verdict", "peak": "peak_rotation", "speed": "impact_velocity"}


def quantities_of_frames(
    frames: Sequence[RockingFrame], peak_rotation: Float, impact_velocity: Float
) -> dict[str, Float]:
    """Return the quantities of scenarios by name: ``peak_u`` and so on.

    Ratios of tendons and gaps are 0 for structures without them; these ratios are not written.

    Parameters
    ----------
    frames : sequence of RockingFrame
        The structures.
    peak_rotation, impact_velocity : array, shape (structures, scales)
        Results for one motion [rad, m s-1].
    """
    alpha = np.array([[frame.slenderness] for frame in frames])
    beams = [frame.beam for frame in frames]
    length, angle = (
        np.array([[getattr(beam, name)] for beam in beams]) for name in ("length", "angle")
    )
    beam = Lever(length, angle)  # type: ignore[arg-type]  # all beams at once
    u, v = beam.shift(peak_rotation), beam.lift(np.minimum(peak_rotation, angle))
    tendons, gaps = np.zeros_like(peak_rotation), np.zeros_like(peak_rotation)
    for k, frame in enumerate(frames):
        if frame.abutment is not None:
            gaps[k] = u[k] / frame.abutment.gap
        if frame.tendon is not None:
            tension = np.vectorize(frame.tension, otypes=[float])
            valid = np.minimum(peak_rotation[k], frame.abutment_rotation)
            tendons[k] = tension(valid) / frame.tendon.yield_force
    return {
        "peak_rotation_ratio": peak_rotation / alpha,
        "peak_u": u,
        "peak_v": v,
        "peak_impact_velocity": impact_velocity,
        "peak_tendon_ratio": tendons,
        "peak_gap_ratio": gaps,
    }


def _compared(response: Response, motion: GroundAcceleration) -> Compared:
    frame, tied = response.frame, response.restraint
    overturned = response.verdict is Verdict.OVERTURNS
    shear = reactions(response, motion).support_shear / (1.0 + frame.mass_ratio)
    end, until = first_end(_ends(response))
    demands = [
        getattr(response.contact, f"{joint}_friction_demand", math.nan)
        for joint in ("base", "top", "impact")
    ]
    rest = 0.0 if tied is None or math.isnan(tied.residual_rotation) else tied.residual_rotation
    return Compared(
        model=frame.name,
        time=response.time,
        u=response.u,
        v=response.v,
        base_shear=shear,
        peak_u=math.inf if overturned else response.peak_u,
        peak_v=math.inf if overturned else response.peak_v,
        residual_u=math.inf if overturned else float(frame.horizontal_displacement(rest)),
        peak_base_shear=largest_until(until, response.time, shear),
        peak_rotation_ratio=response.peak_rotation_ratio,
        peak_tendon_force=math.nan if tied is None else tied.peak_tendon_force,
        friction_demand=max(
            (demand for demand in demands if not math.isnan(demand)), default=math.nan
        ),
        model_end=end,
        valid_until=until,
        gap_closed_time=response.gap_closed_time,
        closing_velocity=response.closing_velocity,
    )


def _ends(response: Response) -> dict[ModelEnd, float]:
    """Return the time of each event that ends the model [s], as `first_end` needs it."""
    frame, tied = response.frame, response.restraint
    ends: dict[ModelEnd, float] = {}
    if response.verdict is Verdict.OVERTURNS:
        ends[ModelEnd.OVERTURNS] = sometime(response.overturning_time)
    if frame.abutment is not None:
        if response.peak_u >= frame.abutment.gap:
            ends[ModelEnd.GAP_CLOSES] = sometime(response.gap_closed_time)
        if response.peak_v >= frame.abutment.uplift_allowance:
            ends[ModelEnd.LIFT_EXCEEDED] = sometime(response.lift_exceeded_time)
    if tied is not None and frame.tendon is not None and not frame.tendon.loses_prestress:
        ends[ModelEnd.TENDON_YIELDS] = tied.tendon_yields
    return ends


def _section(frame: RockingFrame) -> str:
    """Return the section with the inertia of the frame; if there is none, the inertia ratio."""
    if frame.inertia_ratio == RECTANGULAR:
        return SECTIONS[0]
    for section in SECTIONS[1:]:
        if frame.inertia_ratio == inertia_ratio_of(section, frame.height, frame.width):
            return section
    return repr(frame.inertia_ratio)


ROCKING: Final = RockingKind()
