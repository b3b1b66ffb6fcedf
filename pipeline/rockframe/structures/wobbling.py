"""Rocking frames with round columns under both horizontal directions of a ground motion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from rockframe.frame import RockingFrame
from rockframe.options.respond import Ensemble
from rockframe.rocking import (
    EnsembleResponse,
    FirstOverturning,
    Histories,
    Margin,
    RobustMargin,
    chosen_ensemble,
)
from rockframe.rocking.margins.first_overturning import LARGEST_SCALE
from rockframe.structures.contract import Shaking
from rockframe.wobbling import (
    PairAcceleration,
    WobblingResponse,
    wobble,
    wobbling_ensemble,
    wobbling_margins,
)
from rockframe.wobbling.reactions import wobbling_contact, wobbling_forces
from rockframe.wobbling.response import why_in_one_plane

#: The first overturning of the structure as given is not searched: its scale is one of chance.
_NOT_SEARCHED: Final = FirstOverturning(*(math.nan,) * 4, (), math.nan, 0)


def why_not_both(frame: RockingFrame) -> str:
    """Return why a frame is not computed for both directions; "" if it is.

    Examples
    --------
    >>> why_not_both(RockingFrame(height=7.5, width=1.8))
    'not computed for both directions: columns not circular'
    """
    reason = why_in_one_plane(frame)
    return reason and f"not computed for both directions: {reason}"


def respond_both(
    frames: Sequence[RockingFrame], motion: PairAcceleration, shaking: Shaking
) -> list[WobblingResponse]:
    """Return the response of each frame, with the demand on its joints, margins and forces."""
    options, responses = shaking.options, []
    robust: Sequence[RobustMargin | None] = [None] * len(frames)
    if (ensemble := chosen_ensemble(options)) is not None:
        [robust] = wobbling_margins([motion], frames, ensemble)
    for frame, margin in zip(frames, robust, strict=True):
        response = wobble(frame, motion)
        response = replace(response, contact=wobbling_contact(response, motion))
        if options.forces:
            response = replace(response, forces=wobbling_forces(response, motion))
        if margin is not None:
            response = replace(response, margin=Margin(_NOT_SEARCHED, LARGEST_SCALE, margin))
        # the frame as stated: its section in one plane changes no displacement
        responses.append(replace(Histories(options.histories).keep(response), frame=frame))
    return responses


def ensembles_both(
    frames: Sequence[RockingFrame], motions: Sequence[PairAcceleration], ensemble: Ensemble
) -> list[list[EnsembleResponse]]:
    """Return the response of the ensemble of each frame to each motion."""
    return [[wobbling_ensemble(frame, motion, ensemble) for frame in frames] for motion in motions]
