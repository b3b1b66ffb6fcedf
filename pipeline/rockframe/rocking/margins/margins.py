"""How far a verdict is from another one: critical scales, and verdicts left undecided."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.frame import RockingFrame
from rockframe.record import Record
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.margins.first_overturning import first_overturnings
from rockframe.rocking.margins.perturbed import Sensitivity, sensitivities
from rockframe.rocking.margins.scale_limits import LARGEST_SCALE, largest_scale_of, least_scale_of
from rockframe.rocking.margins.sliver_search import FirstOverturning
from rockframe.rocking.response import Response, Verdict, as_ground, refuse_flight
from rockframe.wavelets.pulse import Pulse

Float = NDArray[np.float64]


@dataclass(frozen=True)
class Margin:
    """How far one frame is from overturning under one motion.

    Parameters
    ----------
    first : FirstOverturning
        The first overturning that was found, and how the frame fares above it.
    largest_scale : float
        Largest multiple of the motion that was searched [1].
    undecided_by : Sensitivity
        Perturbations that change whether it overturns under the motion itself.
    """

    first: FirstOverturning
    largest_scale: float
    undecided_by: Sensitivity

    @property
    def critical_scale(self) -> float:
        """Least multiple of the motion found to overturn [1]; NaN if none was found."""
        return self.first.lower

    @property
    def islands(self) -> tuple[tuple[float, float], ...]:
        """Scales above the critical one between which samples 0.64 to 2.56 % apart stand [1]."""
        return self.first.islands

    @property
    def safe_islands(self) -> int:
        """Number of these islands; finer samples would show more."""
        return len(self.first.islands)

    def verdict(self, unperturbed: Verdict) -> Verdict:
        """Return the verdict, given that of the motion as it is."""
        return Verdict.UNDECIDED if self.undecided_by else unperturbed


def margins(
    motions: Sequence[Record | Pulse | GroundAcceleration],
    frames: Sequence[RockingFrame],
    *,
    largest_scale: float = LARGEST_SCALE,
) -> list[list[Margin]]:
    """Search for the first overturning of each frame under each motion.

    Stability is not monotone in the scale of the motion: below the scale from which on a frame
    overturns for good there are slivers where it does too, above it islands where it stands. The
    search finds 99 of 100 slivers that are at least a ten-thousandth of the scale wide, and thinner
    ones by chance; the critical scale is the lower edge of the lowest, bisected to a share of 1e-6.

    Parameters
    ----------
    motions : sequence of Record, Pulse or GroundAcceleration
        Ground motions, as `respond` takes them.
    frames : sequence of RockingFrame
        The frames.
    largest_scale : float
        Where the search ends [1]; earlier for a vertical acceleration that would then fall faster
        than gravity.

    Returns
    -------
    list of list of Margin
        For each motion those of the frames; the same whatever else is asked for.

    Raises
    ------
    ParameterError
        If there is no motion or frame, the largest scale is below 1 or not finite, or a vertical
        acceleration falls faster than gravity.

    Notes
    -----
    A verdict is undecided if it changes when the amplitude is changed by 1 % or less, when the
    velocity ratio of impacts is changed by 1 % (never beyond eq (43)), or when a record is sampled
    twice as finely, by band-limited interpolation, before its samples are joined by lines.

    Examples
    --------
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=0.5 * 9.81, T_p=1.5)
    >>> [[margin]] = margins([pulse], [bent])
    >>> round(margin.critical_scale, 4), margin.safe_islands, margin.undecided_by.value
    (1.0941, 1, 0)
    """
    for label, number in (("motions", len(motions)), ("frames", len(frames))):
        if number == 0:
            raise ParameterError(f"Invalid number of {label}, 0. Must be one or more.")
    grounds = [as_ground(motion) for motion in motions]
    for one in grounds:
        refuse_flight(one)
    ground, frame = np.indices((len(grounds), len(frames))).reshape(2, -1)
    largest = np.array([largest_scale_of(one, largest_scale) for one in grounds])[ground]
    least = np.array(
        [
            least_scale_of(grounds[i], frames[k])
            for i, k in zip(ground.tolist(), frame.tolist(), strict=True)
        ]
    )
    found = first_overturnings(grounds, frames, ground, frame, least, largest)
    intervals = [
        np.array([[one.lower, one.upper]])[: 0 if math.isnan(one.lower) else 1] for one in found
    ]
    sensitive = sensitivities(grounds, frames, ground, frame, intervals, largest)
    every = [
        Margin(first=one, largest_scale=float(end), undecided_by=by)
        for one, end, by in zip(found, largest, sensitive, strict=True)
    ]
    width = len(frames)
    return [every[start : start + width] for start in range(0, len(every), width)]


def with_margins(
    responses: Sequence[Response], motion: Record | Pulse | GroundAcceleration
) -> list[Response]:
    """Add margins to responses; a verdict that small changes would turn becomes undecided.

    Parameters
    ----------
    responses : sequence of Response
        What `respond` returned.
    motion : Record, Pulse or GroundAcceleration
        The motion of all of them.

    Raises
    ------
    ParameterError
        If its vertical acceleration falls faster than gravity.

    Examples
    --------
    >>> from rockframe.rocking import respond
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=0.547 * 9.81, T_p=1.5)
    >>> [response] = with_margins([respond(bent, pulse)], pulse)
    >>> response.verdict.name, round(response.margin.critical_scale, 4)
    ('UNDECIDED', 1.0001)
    """
    found = margins([motion], [response.frame for response in responses])[0]
    return [
        replace(response, verdict=margin.verdict(response.verdict), margin=margin)
        for response, margin in zip(responses, found, strict=True)
    ]
