"""Rocking frames with round columns under both horizontal directions of a ground motion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rockframe.frame import RockingFrame
from rockframe.options.respond import Ensemble
from rockframe.rocking import (
    EnsembleResponse,
    FirstOverturning,
    Histories,
    Margin,
    RobustMargin,
    chosen_ensemble,
    draws,
)
from rockframe.rocking.margins.first_overturning import LARGEST_SCALE
from rockframe.structures.contract import Shaking
from rockframe.wobbling import (
    PairAcceleration,
    WobblingResponse,
    kernel,
    wobble,
    wobbling_ensemble,
    wobbling_margins,
)
from rockframe.wobbling.ensemble import family_of
from rockframe.wobbling.reactions import (
    wobbling_contact,
    wobbling_force_bands,
    wobbling_forces,
)
from rockframe.wobbling.response import constants, integrated, rolling, why_in_one_plane

Float = NDArray[np.float64]

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
            if options.ensemble.members:
                bands = wobbling_force_bands(frame, motion, options.ensemble)
                response = replace(response, force_bands=bands)
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


def history_both(frame: RockingFrame, motion: PairAcceleration) -> WobblingResponse:
    """Return the bare response of a frame to a motion."""
    return replace(wobble(frame, motion), frame=frame)


def peaks_both(
    frames: Sequence[RockingFrame], motions: Sequence[PairAcceleration], scales: Sequence[float]
) -> dict[str, NDArray[Any]]:
    """Return verdicts and peaks [rad] of scenarios, shape (motions, frames, scales).

    Speeds of impacts are NaN: columns that roll do not hit the ground.
    """
    members = [
        constants(rolling(frame), scale=float(scale)) for frame in frames for scale in scales
    ]
    answers = [integrated(motion, members) for motion in motions]
    return _scenarios(answers, (len(motions), len(frames), len(scales)))


def member_peaks_both(
    frames: Sequence[RockingFrame],
    motions: Sequence[PairAcceleration],
    scales: Sequence[float],
    ensemble: Ensemble,
) -> dict[str, NDArray[Any]]:
    """Return the same of members, shape (motions, frames, scales, members)."""
    count, amplitude = ensemble.members, draws(ensemble)[:, 3]
    scale, member = (axis.ravel() for axis in np.indices((len(scales), count)))
    factors = np.array(scales)[scale] * amplitude[member]
    families = [family_of(frame, ensemble) for frame in frames]
    members = np.concatenate([family.at(member, factors) for family in families])
    answers = [integrated(motion, members) for motion in motions]
    return _scenarios(answers, (len(motions), len(frames), len(scales), count))


def _scenarios(
    answers: Sequence[tuple[NDArray[np.int8], Float]], shape: tuple[int, ...]
) -> dict[str, NDArray[Any]]:
    peaks = np.array([summaries[:, kernel.PEAK] for _, summaries in answers]).reshape(shape)
    verdicts = np.array([verdict for verdict, _ in answers]).reshape(shape)
    return {"verdict": verdicts, "peak": peaks, "speed": np.full(shape, np.nan)}


def margins_both(
    frames: Sequence[RockingFrame],
    motions: Sequence[PairAcceleration],
    ensemble: Ensemble | None,
) -> list[list[Margin]]:
    """Return the robust margin of each frame under each motion; without an ensemble, none."""
    if ensemble is None:
        return [[Margin(_NOT_SEARCHED, LARGEST_SCALE, None)] * len(frames) for _ in motions]
    rows = wobbling_margins(motions, frames, ensemble)
    return [[Margin(_NOT_SEARCHED, LARGEST_SCALE, robust) for robust in row] for row in rows]
