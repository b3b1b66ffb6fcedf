"""Ensembles of plausible structures and motions about those that are stated."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.frame import RockingFrame

Float = NDArray[np.float64]

#: Fewer members tell little of a share of 10 %; more take more time than they are worth.
LEAST_MEMBERS: Final = 32
_MOST_MEMBERS: Final = 10_000


@dataclass(frozen=True, kw_only=True)
class Ensemble:
    """Plausible structures and motions about those that are stated; the spreads are shares [1].

    Parameters
    ----------
    members : int
        Their number.
    height, width, amplitude : float
        Largest deviation of the columns' height and width and of the motion's amplitude.
    restitution : float
        Largest loss of the velocity ratio of impacts beyond the stated one.
    seed : int
        Of the draws: uniform within the spreads, stratified in each (a Latin hypercube).

    Raises
    ------
    ParameterError
        If there are fewer than 32 members, a spread is negative or not below 1, or the seed is
        negative.

    Examples
    --------
    >>> Ensemble(seed=1).draws().shape
    (64, 4)
    """

    members: int = 64
    height: float = 0.01
    width: float = 0.01
    restitution: float = 0.03
    amplitude: float = 0.01
    seed: int = 0

    def __post_init__(self) -> None:
        if not LEAST_MEMBERS <= self.members <= _MOST_MEMBERS:
            raise ParameterError(
                f"Invalid number of members {self.members} of an ensemble. Must be "
                f"{LEAST_MEMBERS} to {_MOST_MEMBERS}."
            )
        for name in ("height", "width", "restitution", "amplitude"):
            spread = getattr(self, name)
            if not 0.0 <= spread < 1.0:
                raise ParameterError(
                    f"Invalid spread {spread!r} of the {name} in an ensemble. Must be 0 or more, "
                    "and below 1."
                )
        if self.seed < 0:
            raise ParameterError(f"Invalid seed {self.seed} of an ensemble. Must be 0 or more.")

    def draws(self) -> Float:
        """Return factors of height, width, restitution and amplitude [1], shape (members, 4)."""
        rng = np.random.default_rng(self.seed)
        strata = np.column_stack([rng.permutation(self.members) for _ in range(4)])
        drawn = (strata + rng.random(strata.shape)) / self.members
        both = np.array([self.height, self.width, 0.0, self.amplitude]) * (2.0 * drawn - 1.0)
        down = np.array([0.0, 0.0, self.restitution, 0.0]) * drawn
        factors: Float = 1.0 + both - down
        return factors

    def frames(self, frame: RockingFrame) -> list[RockingFrame]:
        """Return the members' structures.

        Raises
        ------
        ParameterError
            If one of them does not rock.
        """
        try:
            return [
                replace(
                    frame.resized(height * frame.height, width * frame.width),
                    restitution_factor=loss * frame.restitution_factor,
                )
                for height, width, loss, _ in self.draws().tolist()
            ]
        except ParameterError as error:
            raise ParameterError(
                f"Invalid spreads of an ensemble of frame {frame.name!r}: {error}"
            ) from None
