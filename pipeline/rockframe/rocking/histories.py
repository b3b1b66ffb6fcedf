"""Selection of the histories that are stored."""

from __future__ import annotations

from dataclasses import replace
from enum import StrEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.rocking.response import Response
from rockframe.rocking.verdict import Verdict

#: Rotations from this share of the slenderness are near overturning; their histories are selected.
NEAR: Final = 0.5
_DECIDED: Final = (Verdict.NO_UPLIFT, Verdict.STANDS)


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

    def keep(self, response: Response) -> Response:
        """Return a response with its histories if they are selected, otherwise without them.

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
        near = response.verdict not in _DECIDED or response.peak_rotation_ratio >= NEAR
        if self is Histories.ALL or (self is Histories.SELECTED and near):
            return response
        none = np.empty(0)
        return replace(
            response,
            time=none,
            theta=none,
            omega=none,
            impact_times=none,
            impact_velocities=none,
        )

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
