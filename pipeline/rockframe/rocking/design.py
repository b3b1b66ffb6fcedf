"""Scans over height, width or mass ratio for the smallest value that meets a requirement."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from typing import Final, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rockframe.errors import ParameterError
from rockframe.frame import RockingFrame
from rockframe.options.respond import DesignOptions
from rockframe.parts import SECTIONS

Float = NDArray[np.float64]

#: Statistics of the demand that can keep the limit.
Statistic: TypeAlias = Literal["share", "quantile_84"]
#: Dimensions that can be scanned, and what stays constant meanwhile.
DIMENSIONS: Final = {
    "height": "height of the columns [m] at constant slenderness",
    "width": "width of the columns [m] at constant height",
    "mass_ratio": "mass of the beam over that of all columns [1], with unchanged columns",
}


@dataclass(frozen=True, kw_only=True)
class Design:
    """A scan for the smallest dimension at which enough motions stay below a limit.

    Parameters
    ----------
    dimension : str
        One of `DIMENSIONS`.
    lowest, highest : float
        Range of values of the dimension.
    limit : float
        Limit of the quantity [1, m, m s-1].
    statistic : {"share", "quantile_84"}
        What must keep the limit: a share of the motions and members, or the 84 % quantile of the
        quantity over all of them.
    share : float
        Required share of the motions and members below the limit [1].
    steps : int
        Number of evenly spaced values, including both ends.
    quantity : str
        A quantity of `quantities.LIMITED`: ``peak_rotation_ratio``, ``peak_u`` and so on.

    Raises
    ------
    ParameterError
        If `DesignOptions` does not allow a value.

    Examples
    --------
    >>> Design(dimension="height", lowest=2.0, highest=4.0, steps=3).values.tolist()
    [2.0, 3.0, 4.0]
    """

    dimension: str
    lowest: float
    highest: float
    limit: float = 0.5
    statistic: Statistic = "share"
    share: float = 0.9
    steps: int = 41
    quantity: str = "peak_rotation_ratio"

    def __post_init__(self) -> None:
        options = {field.name: getattr(self, field.name) for field in fields(self)}
        span = options.pop("lowest"), options.pop("highest")
        DesignOptions(range=span, **options)

    @property
    def values(self) -> Float:
        """Values of the dimension, shape (steps,)."""
        return np.linspace(self.lowest, self.highest, self.steps)

    def result(self, shares: ArrayLike, quantiles: ArrayLike) -> DesignResult:
        """Return the result of a scan.

        Parameters
        ----------
        shares, quantiles : array_like, shape (steps,)
            Share of the motions and members below the limit [1], and the 84 % quantile of the
            quantity, at each value of the dimension.

        Examples
        --------
        >>> design = Design(dimension="height", lowest=2.0, highest=4.0, steps=3, limit=0.5)
        >>> design.result([0.8, 0.95, 1.0], [0.6, 0.55, 0.4])
        DesignResult(smallest=3.0, sure_from=3.0)
        >>> replace(design, statistic="quantile_84").result([0.8, 0.95, 1.0], [0.6, 0.55, 0.4])
        DesignResult(smallest=4.0, sure_from=4.0)
        """
        if self.statistic == "share":
            return smallest(self.values, shares, self.share)
        return smallest(self.values, np.asarray(quantiles) < self.limit, 1.0)

    def candidates(self, frame: RockingFrame) -> tuple[RockingFrame, ...]:
        """Return one frame for each value of the dimension.

        Raises
        ------
        ParameterError
            If a frame cannot rock; if the dimension is the width and the columns have a stated
            inertia; or if the pivots of the frame crush.
        """
        return tuple(varied(frame, self.dimension, float(value)) for value in self.values)


def varied(frame: RockingFrame, dimension: str, value: float) -> RockingFrame:
    """Return a frame with another value of one of `DIMENSIONS`.

    Raises
    ------
    ParameterError
        As `Design.candidates`.
    """
    if frame.before_crushing is not None:
        raise ParameterError(
            f"frame {frame.name!r} rocks on pivots that crush, which depend on its {dimension}. "
            f"Remove the pivots to search for a {dimension}."
        )
    if dimension == "mass_ratio":
        return replace(frame, mass_ratio=value)
    if dimension == "height":
        return frame.resized(value, frame.width * value / frame.height)
    if frame.column_section is None:
        raise ParameterError(
            f"frame {frame.name!r} has a stated inertia_ratio {frame.inertia_ratio:g}, which "
            f"depends on the width. State a section instead, {' or '.join(SECTIONS)}, to "
            "search for a width."
        )
    return frame.resized(frame.height, value)


@dataclass(frozen=True)
class DesignResult:
    """The result of a scan.

    Parameters
    ----------
    smallest : float
        Smallest value at which the required share is met; NaN if there is none.
    sure_from : float
        Smallest value such that it and all larger values meet the share; NaN if there is none.
    """

    smallest: float
    sure_from: float


def smallest(values: ArrayLike, shares: ArrayLike, share: float) -> DesignResult:
    """Return the smallest value that meets the required share of motions.

    Larger values may miss it, because the response is not monotone in the dimensions.

    Parameters
    ----------
    values, shares : array_like, shape (steps,)
        Increasing values of a dimension, and the share of motions below the limit at each [1].
    share : float
        Required share of motions [1].

    Examples
    --------
    >>> smallest([1.0, 2.0, 3.0, 4.0], [0.5, 0.9, 0.8, 1.0], 0.9)
    DesignResult(smallest=2.0, sure_from=4.0)
    """
    tried = np.asarray(values, dtype=np.float64)
    met = np.asarray(shares, dtype=np.float64) >= share
    if not met.any():
        return DesignResult(math.nan, math.nan)
    missed = np.flatnonzero(~met)
    after = int(missed[-1]) + 1 if missed.size else 0
    sure = float(tried[after]) if after < tried.size else math.nan
    return DesignResult(float(tried[met.argmax()]), sure)
