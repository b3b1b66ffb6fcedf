"""How far a verdict is from another one: critical scales, safe islands, verdicts left undecided."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.frame import RockingFrame
from rockframe.record import Record
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.perturbed import Sensitivity, sensitivities
from rockframe.rocking.response import Response, Verdict, as_ground, refuse_flight
from rockframe.rocking.scan import islands, scan
from rockframe.units import GRAVITY
from rockframe.wavelets import Pulse

Float = NDArray[np.float64]

#: Up to this multiple of the motion overturning is looked for [1].
LARGEST_SCALE: Final = 10.0
#: Each scale of the scan is larger than the one before by this share [1].
SCAN_STEP: Final = 0.005
#: The critical scale is bisected until it is known to this share of itself [1].
EDGE_TOLERANCE: Final = 1e-6
#: So are the edges of safe islands above it [1]: under rough motions there may be a hundred.
ISLAND_TOLERANCE: Final = 5e-4
#: The ground may fall with nearly the acceleration of gravity [1].
_NEARLY: Final = 1.0 - 1e-9


@dataclass(frozen=True)
class Margin:
    """How far one frame is from overturning under one motion.

    Parameters
    ----------
    critical_scale : float
        Least multiple of the motion that overturns [1]; NaN if none up to `largest_scale` does.
    largest_scale : float
        Where the scan ends [1].
    islands : tuple of (float, float)
        Scales between which the frame stands, above the critical one; the last island may end at
        the largest scale only because the scan does.
    undecided_by : Sensitivity
        Perturbations that change whether it overturns under the motion itself.
    """

    critical_scale: float
    largest_scale: float
    islands: tuple[tuple[float, float], ...]
    undecided_by: Sensitivity

    @property
    def safe_islands(self) -> int:
        """Number of safe islands above the critical scale."""
        return len(self.islands)

    def verdict(self, unperturbed: Verdict) -> Verdict:
        """Return the verdict, given that of the motion as it is."""
        return Verdict.UNDECIDED if self.undecided_by else unperturbed


def margins(
    motions: Sequence[Record | Pulse | GroundAcceleration],
    frames: Sequence[RockingFrame],
    *,
    largest_scale: float = LARGEST_SCALE,
    step: float = SCAN_STEP,
) -> list[list[Margin]]:
    """Find the margin of each frame under each motion, by a full scan over the motion's scale.

    Stability is not monotone in the scale: islands of safety lie above the critical scale, and
    thin slivers of overturning may lie below the one found. Every scale that is larger by `step`
    than the one before is tried, slivers between them are looked for where the frame leans
    furthest and beside the first edge, and every edge found is bisected: the critical scale to a
    share of 1e-6, those of islands above it to 5e-4.

    Parameters
    ----------
    motions : sequence of Record, Pulse or GroundAcceleration
        Ground motions, as `respond` takes them.
    frames : sequence of RockingFrame
        The frames.
    largest_scale : float
        Where the scan ends [1]; earlier for a vertical acceleration that would then fall faster
        than gravity.
    step : float
        By what share each scale is larger than the one before [1].

    Returns
    -------
    list of list of Margin
        For each motion those of the frames; the same whatever else is asked for.

    Raises
    ------
    ParameterError
        If there is no motion or frame, the largest scale is below 1 or not finite, the step not
        between 0 and 1, or a vertical acceleration falls faster than gravity.

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
    if not (math.isfinite(largest_scale) and largest_scale >= 1.0):
        raise ParameterError(f"Invalid largest scale {largest_scale!r}. Must be 1 or more.")
    if not 0.0 < step < 1.0:
        raise ParameterError(f"Invalid step {step!r} of a scan. Must be between 0 and 1.")
    grounds = [as_ground(motion) for motion in motions]
    for one in grounds:
        refuse_flight(one)
    ground, frame = np.indices((len(grounds), len(frames))).reshape(2, -1)
    largest = np.array([_largest(one, largest_scale) for one in grounds])[ground]
    least = np.array(
        [
            _least(grounds[i], frames[k])
            for i, k in zip(ground.tolist(), frame.tolist(), strict=True)
        ]
    )
    found = scan(
        grounds,
        frames,
        ground,
        frame,
        _grid(least, largest, step),
        tolerance=EDGE_TOLERANCE,
        tolerance_above=ISLAND_TOLERANCE,
    )
    intervals = found.intervals()
    sensitive = sensitivities(grounds, frames, ground, frame, intervals, largest)
    every = [
        Margin(
            critical_scale=float(overturning[0, 0]) if len(overturning) else math.nan,
            largest_scale=float(end),
            islands=islands(overturning, float(end)),
            undecided_by=by,
        )
        for overturning, end, by in zip(intervals, largest, sensitive, strict=True)
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


def _largest(ground: GroundAcceleration, largest_scale: float) -> float:
    """Where the scan of a motion ends: before its vertical part falls faster than gravity."""
    lowest = ground.upward_bounds()[0]
    return min(largest_scale, _NEARLY * GRAVITY / -lowest if lowest < 0.0 else math.inf)


def _least(ground: GroundAcceleration, frame: RockingFrame) -> float:
    """A scale below which the frame does not uplift; infinite if the ground is still."""
    powers = ground.time_step ** np.arange(ground.coefficients.shape[1])
    strongest = float((np.abs(ground.coefficients) * powers).sum(axis=1).max())
    tangent = frame.uplift_acceleration / GRAVITY
    pull = strongest + tangent * max(abs(bound) for bound in ground.upward_bounds())
    return frame.uplift_acceleration / pull if pull > 0.0 else math.inf


def _grid(least: Float, largest: Float, step: float) -> Float:
    """Powers of 1 + step, so that 1 is among them, cut to where anything can happen."""
    growth = math.log1p(step)
    lowest = min(float(least.min()), float(largest.max()))
    powers = range(
        math.floor(math.log(lowest) / growth), math.ceil(math.log(largest.max()) / growth)
    )
    grid = np.array([math.exp(growth * k) for k in (*powers, powers.stop)])
    ends = np.minimum(grid, largest[:, None])
    cut: Float = np.maximum(ends, np.minimum(least, largest)[:, None])
    return cut
