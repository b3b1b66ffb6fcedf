"""Rocking frames, free, restrained, hybrid or with crushed edges, as a kind of structure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from rockframe.frame import RockingFrame
from rockframe.options.respond import Ensemble
from rockframe.record import Record
from rockframe.rocking import (
    EnsembleResponse,
    GroundAcceleration,
    Histories,
    Response,
    Versions,
    as_ground,
    chosen_ensemble,
    ensemble_responses,
    members,
    part_responses,
    require_motion,
    respond,
    ties_of,
    with_contact,
    with_envelope,
    with_forces,
    with_margins,
    with_pulse,
)
from rockframe.structures.contract import Motion, Shaking
from rockframe.wavelets.pulse import Pulse


@dataclass(frozen=True)
class RockingKind:
    """The kind of `RockingFrame`; its methods keep the rules of `structures.contract`."""

    name: str = "rocking"

    def why_not(self, _structure: RockingFrame, motion: Motion) -> str:
        """Return why a frame is not computed under a motion; "" if it is."""
        in_one_plane = isinstance(motion, Record | Pulse | GroundAcceleration)
        return "" if in_one_plane else "not computed for both directions"

    def require_possible(self, structure: RockingFrame, ensemble: Ensemble | None) -> None:
        """Require a frame, and members of its ensemble, that the kernel can compute."""
        ties_of(structure)
        if ensemble is not None and ensemble.members:
            members(ensemble, structure)

    def respond(self, structures: Sequence[RockingFrame], shaking: Shaking) -> list[Response]:
        """Return the response of each frame, with contact, pulse, margins and forces."""
        options = shaking.options
        motion = as_ground(shaking.motion)  # type: ignore[arg-type]  # `why_not` excludes pairs
        require_motion(options.ensemble, motion)
        responses = [with_contact(respond(frame, motion), motion) for frame in structures]
        if shaking.parts:
            responses = [
                replace(one, parts=part_responses(one, shaking.parts)) for one in responses
            ]
        if shaking.pulse is not None:
            responses = [with_pulse(response, shaking.pulse) for response in responses]
        if options.margins != "none":
            responses = with_margins(responses, motion, chosen_ensemble(options))
        if options.forces:
            beside = (motion, options.ensemble, shaking.versions)
            responses = [with_forces(one, *beside) for one in responses]
        kept = [Histories(options.histories).keep(response) for response in responses]
        ensemble = chosen_ensemble(options)
        if ensemble is None:
            return kept
        return [
            with_envelope(one, motion, ensemble, shaking.versions) if one.time.size else one
            for one in kept
        ]

    def ensembles(
        self,
        structures: Sequence[RockingFrame],
        motions: Sequence[Motion],
        ensemble: Ensemble,
        versions: Sequence[Versions | None],
    ) -> list[list[EnsembleResponse]]:
        """Return the response of the ensemble of each frame to each motion."""
        return ensemble_responses(motions, structures, ensemble, versions)  # type: ignore[arg-type]


ROCKING: Final = RockingKind()
