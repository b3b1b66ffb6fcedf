"""Limit states (overturning, and limits of peaks), these peaks, and the words for their fits."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rockframe.frame import RockingFrame

Float = NDArray[np.float64]

#: Variable, symbol and unit of the quantities that can be limited.
QUANTITIES: Final = MappingProxyType(
    {
        "rotation_ratio": ("peak_rotation_ratio", "θ/α", ""),
        "u": ("peak_u", "u", "m"),
        "v": ("peak_v", "v", "m"),
        "impact_velocity": ("peak_impact_velocity", "impact velocity", "m/s"),
        "tendon_ratio": ("peak_tendon_ratio", "tendon / yield force", ""),
        "gap_ratio": ("peak_gap_ratio", "u / gap", ""),
    }
)


@dataclass(frozen=True)
class LimitState:
    """A state that a structure reaches when it overturns, or when a peak reaches a limit.

    Parameters
    ----------
    quantity : str
        One of `QUANTITIES`, or empty for overturning.
    value : float
        The limit, in SI units.

    Examples
    --------
    >>> LimitState("u", 0.2).name, LimitState("u", 0.2).words, OVERTURNING.name
    ('u_0.2m', 'u ≥ 0.2 m', 'overturning')
    """

    quantity: str
    value: float

    @property
    def name(self) -> str:
        """Name in datasets and tables."""
        if not self.quantity:
            return "overturning"
        return f"{self.quantity}_{self.value:g}{QUANTITIES[self.quantity][2]}".replace("/", "_")

    @property
    def words(self) -> str:
        """Name in figures."""
        if not self.quantity:
            return self.name
        _, symbol, unit = QUANTITIES[self.quantity]
        return f"{symbol} ≥ {self.value:g} {unit}".rstrip()

    @classmethod
    def named(cls, name: str) -> LimitState:
        """Return the limit state with a name.

        Examples
        --------
        >>> LimitState.named("rotation_ratio_0.5")
        LimitState(quantity='rotation_ratio', value=0.5)
        """
        for quantity in QUANTITIES:
            if name.startswith(f"{quantity}_"):
                return cls(quantity, float(name.removeprefix(f"{quantity}_").rstrip("m_s")))
        return OVERTURNING

    def reached(
        self, peaks: Mapping[str, NDArray[Any]], overturned: NDArray[np.bool_]
    ) -> NDArray[np.bool_]:
        """Return True for each scenario that reaches the limit state.

        Parameters
        ----------
        peaks : mapping of str to array
            The variables named in `QUANTITIES`, for each scenario.
        overturned : array of bool
            True for scenarios that overturn.
        """
        if not self.quantity:
            return overturned
        return np.asarray(overturned | (peaks[QUANTITIES[self.quantity][0]] >= self.value))


#: The limit state of overturning, which is always included.
OVERTURNING: Final = LimitState("", 0.0)


class Outcome(IntEnum):
    """Result of a fit: the values of the flag variable `fragility_outcome`.

    Here, overturning means reaching the limit state of the fit.
    """

    FITTED = 0
    NONE_OVERTURN = 1
    ALL_OVERTURN = 2
    SEPARATED = 3
    NOT_RISING = 4
    UNKNOWN = 5
    ABSENT = 6

    @property
    def sentence(self) -> str:
        """Outcome in words, for overturning."""
        return self.sentence_of("")

    def sentence_of(self, limit: str) -> str:
        """Return the outcome in words for a limit such as ``u ≥ 0.2 m``; "" for overturning."""
        words = {"reaches": "overturns it", "reach": "overturn", "state": "overturning"}
        if limit:
            words = {"reaches": f"reaches {limit}", "reach": f"reach {limit}", "state": limit}
        return _SENTENCES[self].format(**words)


_SENTENCES: Final = {
    Outcome.FITTED: "fitted by maximum likelihood",
    Outcome.NONE_OVERTURN: "no motion {reaches}: there is no fragility to fit, only a bound",
    Outcome.ALL_OVERTURN: "every motion {reaches}: there is no fragility to fit, only a bound",
    Outcome.SEPARATED: "all that {reach} are stronger than all that do not: the likelihood has no "
    "maximum, and the curve is a step somewhere between the two",
    Outcome.NOT_RISING: "{state} does not become more frequent with this measure",
    Outcome.UNKNOWN: "the measure is not known, or is the same for all motions",
    Outcome.ABSENT: "the structure has no such restraint",
}


def peaks_of_frames(
    frames: Sequence[RockingFrame],
    verdict: NDArray[np.int8],
    peak_rotation: Float,
    impact_velocity: Float,
) -> dict[str, NDArray[Any]]:
    """Return the variables of scenarios: ``verdict``, ``peak_u`` and so on.

    Ratios of tendons and gaps are 0 for structures without them; these ratios are not written.

    Parameters
    ----------
    frames : sequence of RockingFrame
        The structures.
    verdict, peak_rotation, impact_velocity : array, shape (structures, scales)
        Results for one motion [1, rad, m s-1].
    """
    alpha = np.array([[frame.slenderness] for frame in frames])
    u, v, tendons, gaps = (np.zeros_like(peak_rotation) for _ in range(4))
    for k, frame in enumerate(frames):
        u[k] = np.abs(frame.horizontal_displacement(peak_rotation[k]))
        if frame.abutment is not None:
            gaps[k] = u[k] / frame.abutment.gap
        if frame.tendon is not None:
            stretch = 2.0 * frame.tie_lever * np.sin(0.5 * peak_rotation[k])
            force = frame.tendon.prestress + frame.tendon.stiffness * stretch
            tendons[k] = force / frame.tendon.yield_force
        v[k] = frame.vertical_displacement(np.minimum(peak_rotation[k], frame.beam.angle))
    return {
        "verdict": verdict,
        "peak_rotation_ratio": peak_rotation / alpha,
        "peak_u": u,
        "peak_v": v,
        "peak_impact_velocity": impact_velocity,
        "peak_tendon_ratio": tendons,
        "peak_gap_ratio": gaps,
    }


def limited_in(frame: RockingFrame, quantity: str) -> bool:
    """Return True if a frame has a quantity: some need a tendon that yields, or a gap."""
    if quantity == "tendon_ratio":
        return frame.tendon is not None and frame.tendon.yield_force < math.inf
    return quantity != "gap_ratio" or frame.abutment is not None
