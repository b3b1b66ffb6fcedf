"""Versions of a motion of uncertain processing or orientation, and the version of each member."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from rockframe.options.respond import Ensemble
from rockframe.record import Record
from rockframe.rocking.excitation import GroundAcceleration

Float = NDArray[np.float64]

#: Number of values of a spread that takes versions of the motion.
VALUES: Final = 5


@dataclass(frozen=True, eq=False)
class Versions:
    """The versions of one motion, which all structures share.

    Parameters
    ----------
    grounds : tuple of GroundAcceleration
        The versions.
    of_member : array of int, shape (members,)
        Index of the version of each member.
    varied : tuple of str
        The spreads in which the versions differ.
    """

    grounds: tuple[GroundAcceleration, ...]
    of_member: NDArray[np.int64]
    varied: tuple[str, ...]

    def scaled(self, factor: float) -> Self:
        """Return the versions of the motion multiplied by a factor [1]."""
        return replace(self, grounds=tuple(ground.scaled(factor) for ground in self.grounds))


class MakesVersions(Protocol):
    """A motion from which versions can be made."""

    def versions(self, ensemble: Ensemble, motion: Record | GroundAcceleration) -> Versions:
        """Return the versions that the members of an ensemble need."""


@lru_cache(maxsize=16)
def corner_factors(ensemble: Ensemble) -> Float:
    """Return the factor of the lower corner of the band-pass of each member [1].

    The factors are the same for all motions and structures.

    Examples
    --------
    >>> factors = corner_factors(Ensemble())
    >>> sorted({round(one, 3) for one in factors.tolist()})
    [0.5, 0.707, 1.0, 1.414, 2.0]
    """
    largest, root = ensemble.corner, math.sqrt(ensemble.corner)
    factors: Float = np.array([1.0 / largest, 1.0 / root, 1.0, root, largest])[_drawn(ensemble)[0]]
    factors.flags.writeable = False  # the cache returns this array again
    return factors


@lru_cache(maxsize=16)
def turned_degrees(ensemble: Ensemble) -> Float:
    """Return the angle by which the motion of each member is turned clockwise [degree].

    The angles are the same for all motions and structures.

    Examples
    --------
    >>> sorted(set(turned_degrees(Ensemble(orientation_degree=3.0)).tolist()))
    [-3.0, -1.5, 0.0, 1.5, 3.0]
    """
    degrees: Float = ensemble.orientation_degree * np.linspace(-1.0, 1.0, VALUES)
    turned: Float = degrees[_drawn(ensemble)[1]]
    turned.flags.writeable = False
    return turned


def _drawn(ensemble: Ensemble) -> NDArray[np.int64]:
    """Return the values that each member has, counted from 0, shape (2, members).

    The values are as equally frequent as their number allows, and symmetric about the middle one.
    """
    rng = np.random.default_rng([ensemble.seed, 2])  # not the draws of the structures
    values = (2 * np.arange(ensemble.members) + 1) * VALUES // (2 * ensemble.members)
    return np.array([rng.permutation(values) for _ in range(2)])
