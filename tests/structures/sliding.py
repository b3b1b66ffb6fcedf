"""A structure that the package does not have: a deck that slides on its piers, with its table."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import invalid
from rockframe.rocking import (
    EnsembleResponse,
    GroundAcceleration,
    Margin,
    SpreadVerdict,
    Verdict,
)
from rockframe.study.structures import StructureTable
from rockframe.units import GRAVITY

Float = NDArray[np.float64]


@dataclass(frozen=True)
class SlidingDeck:
    """A rigid deck that slides with a coefficient of friction [1]."""

    kind: ClassVar[str] = "sliding"

    friction: float
    name: str

    def __post_init__(self) -> None:
        if not 0.0 < self.friction < math.inf:
            raise invalid("friction", self.friction, repr(self.name), "positive and finite")


class SlidingTable(StructureTable):
    """A ``[[structure]]`` of kind sliding."""

    kind: Literal["sliding"] = "sliding"
    friction: float

    def made(self) -> SlidingDeck:
        """Return the deck."""
        return SlidingDeck(self.friction, self.name)


@dataclass(frozen=True, eq=False)
class SlidingResponse:
    """Slip of a deck [m], with the attributes that rules of the contract need."""

    structure: SlidingDeck
    time: Float
    u: Float
    peak_u: float
    residual_u: float
    ensemble: EnsembleResponse | None = None
    margin: Margin | None = None

    @property
    def verdict(self) -> Verdict:
        """A deck that slides does not fall."""
        return Verdict.STANDS

    @property
    def spread_verdict(self) -> SpreadVerdict:
        """The verdict."""
        share = self.ensemble.share_overturned if self.ensemble else math.nan
        return SpreadVerdict(self.verdict, share_overturned=share, fails="fall")


def slip(ground: GroundAcceleration, friction: float) -> Float:
    """Return the slip at the nodes [m], by small steps of constant acceleration."""
    acceleration, step = ground.at_nodes()[0], ground.time_step
    limit = friction * GRAVITY
    u, v, slips = 0.0, 0.0, [0.0]
    for at in acceleration[:-1].tolist():
        if v == 0.0 and abs(at) <= limit:
            slips.append(u)
            continue
        sign = math.copysign(1.0, v) if v else -math.copysign(1.0, at)
        after = v - step * (at + sign * limit)
        if v * after < 0.0:
            after = 0.0
        u, v = u + 0.5 * step * (v + after), after
        slips.append(u)
    return np.array(slips)


def respond_sliding(deck: SlidingDeck, ground: GroundAcceleration) -> SlidingResponse:
    """Return the response of a deck."""
    u = slip(ground, deck.friction)
    return SlidingResponse(deck, ground.time, u, float(np.abs(u).max()), abs(float(u[-1])))


def varied_decks(deck: SlidingDeck, factors: Sequence[float]) -> list[SlidingDeck]:
    """Return decks with multiples of the friction."""
    return [SlidingDeck(factor * deck.friction, deck.name) for factor in factors]
