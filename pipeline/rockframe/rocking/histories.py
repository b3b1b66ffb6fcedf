"""Histories: which are stored, and the response to each motion of a sequence."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import replace
from enum import StrEnum
from typing import Any, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import RockframeWarning
from rockframe.record import Part
from rockframe.rocking.assessments import PartResponse
from rockframe.rocking.response import Response
from rockframe.rocking.verdict import Verdict

#: Rotations from this share of the slenderness are near overturning; their histories are selected.
NEAR: Final = 0.5
_DECIDED: Final = (Verdict.NO_UPLIFT, Verdict.STANDS)


Kept = TypeVar("Kept", bound=Any)


class Histories(StrEnum):
    """Scenarios whose histories are stored: none, those that overturn or come near it, or all.

    Examples
    --------
    >>> Histories("selected").name
    'SELECTED'
    """

    NONE = "none"
    SELECTED = "selected"
    ALL = "all"

    def keep(self, response: Kept, *, near: bool | None = None) -> Kept:
        """Return a response with its histories if they are selected, otherwise without them.

        Parameters
        ----------
        response : Response, or the response of another kind of structure
            Its class states the names of its histories.
        near : bool, optional
            True if it overturns or comes near it; by default from its verdict and its largest
            rotation.

        Examples
        --------
        >>> from rockframe import Pulse, RockingFrame, respond
        >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
        >>> strong = Pulse(wavelet="symmetric_ricker", a_p=0.5 * 9.81, T_p=1.5)
        >>> Histories.SELECTED.keep(respond(bent, strong)).time.size > 0
        True
        >>> Histories.NONE.keep(respond(bent, strong)).time.size
        0
        """
        if near is None:
            near = response.verdict not in _DECIDED or response.peak_rotation_ratio >= NEAR
        if self is Histories.ALL or (self is Histories.SELECTED and near):
            return response
        return replace(response, **dict.fromkeys(response.HISTORIES, np.empty(0)))

    def mask(self, verdict: NDArray[np.int8], ratio: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which scenarios are selected, from verdicts and largest |theta| / alpha [1].

        Examples
        --------
        >>> Histories.SELECTED.mask(np.array([1, 2], np.int8), np.array([0.4, 9.0])).tolist()
        [False, True]
        """
        if self is Histories.SELECTED:
            return ~np.isin(verdict, _DECIDED) | (ratio >= NEAR)
        return np.full(verdict.shape, self is Histories.ALL)


def with_parts(response: Response, parts: Sequence[Part]) -> Response:
    """Add the response to each motion of a sequence.

    A frame that does not rest when a motion begins causes a `RockframeWarning`.

    Parameters
    ----------
    response : Response
        Response of a frame to a sequence, with its histories.
    parts : sequence of Part
        The motions: `parts` of the record.

    Examples
    --------
    >>> from rockframe import Pulse, Record, RockingFrame, in_sequence, respond
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=0.5 * 9.81, T_p=1.5, time=5.0)
    >>> motion = Record(
    ...     record_id="main", acceleration=pulse.acceleration(0.01 * np.arange(999)), time_step=0.01
    ... )
    >>> both = in_sequence([motion, motion.scaled(0.8)], rest=120.0)
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    >>> done = with_parts(respond(bent, both), both.parts)
    >>> [round(one.peak_rotation_ratio, 3) for one in done.parts]
    [0.651, 0.299]
    """
    each_part = part_responses(response, parts)
    for part in each_part:
        if part.start_rotation_ratio > 0.0:
            words = not_at_rest(response.frame.name, part.part, part.start_rotation_ratio)
            warnings.warn(words, RockframeWarning, stacklevel=2)
    return replace(response, parts=each_part)


def not_at_rest(structure: str, part: Part, ratio: float) -> str:
    """Return the warning that a frame does not rest when a motion of a sequence begins.

    Examples
    --------
    >>> not_at_rest("bent", Part("after", 160.0, 200.0), 0.0123)[:66]
    "structure 'bent' does not rest when motion 'after' begins at 160 s"
    """
    begins = f"structure {structure!r} does not rest when motion {part.record_id!r} begins at "
    begins += f"{part.start:g} s: |theta| is {ratio:.3g} of its slenderness."
    return f"{begins} State a longer rest, unless its dissipaters keep the joints open."


def with_ends(parts: Sequence[Part]) -> list[tuple[Part, float]]:
    """Return each motion of a sequence with the time at which the next one begins [s].

    Examples
    --------
    >>> parts = [Part("main", 0.0, 40.0), Part("after", 160.0, 200.0)]
    >>> [end for _, end in with_ends(parts)]
    [160.0, inf]
    """
    starts = [part.start for part in parts[1:]]
    return list(zip(parts, [*starts, math.inf], strict=True))


def part_responses(response: Response, parts: Sequence[Part]) -> tuple[PartResponse, ...]:
    """Return the response to each motion of a sequence, without warnings; see `with_parts`."""
    nodes = [int(np.searchsorted(response.time, part.start - 1e-9 * part.end)) for part in parts]
    ends = [*nodes[1:], response.time.size - 1]
    rows = zip(parts, nodes, ends, strict=True)
    return tuple(_of_part(response, *row) for row in rows)


def _of_part(response: Response, part: Part, first: int, last: int) -> PartResponse:
    frame, restraint = response.frame, response.restraint
    peak = _peak(response, first, last)
    return PartResponse(
        part,
        start_rotation_ratio=abs(float(response.theta[first])) / frame.slenderness,
        peak_rotation_ratio=peak / frame.slenderness,
        peak_u=float(frame.horizontal_displacement(peak)),
        tendon_force=float(restraint.tendon_force[first]) if restraint else math.nan,
        dissipater_force=float(restraint.dissipater_force[first]) if restraint else math.nan,
    )


def _peak(response: Response, first: int, last: int) -> float:
    """Return the largest |theta| between two nodes [rad]; NaN if the frame overturned before."""
    time, theta = response.time, np.abs(response.theta[first : last + 1])
    if math.isnan(theta[0]):
        return math.nan
    is_last, when = last == time.size - 1, response.peak_time
    after = is_last and math.isnan(when)
    if after or time[first] <= when <= (math.inf if is_last else time[last]):
        return response.peak_rotation
    k = int(np.nanargmax(theta))
    near = [_between(response, first + j) for j in (k - 1, k) if 0 <= j < last - first]
    return min(max([float(theta[k]), *near]), response.peak_rotation)


def _between(response: Response, node: int) -> float:
    """Return the largest |theta| between a node and the next one, on the Hermite cubic [rad]."""
    pair = slice(node, node + 2)
    step = float(response.time[node + 1] - response.time[node])
    (a, end), (b, slope) = response.theta[pair], step * response.omega[pair]
    c, d = 3.0 * (end - a) - 2.0 * b - slope, 2.0 * (a - end) + b + slope
    path = np.polynomial.Polynomial([a, b, c, d])
    turns = path.deriv().roots()
    within = turns[(turns.imag == 0.0) & (turns.real > 0.0) & (turns.real < 1.0)].real
    return float(np.abs(path(within)).max(initial=0.0))
