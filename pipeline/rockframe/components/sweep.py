"""Measures of a motion as a function of azimuth (RotDnn)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.components.pair import HorizontalPair
from rockframe.errors import ParameterError

Float = NDArray[np.float64]

#: Default azimuths [degree]; beyond 180 degrees the motion only changes sign.
HALF_TURN: Final = tuple(float(azimuth) for azimuth in range(180))
#: Azimuths rotated at once; limits memory.
_BATCH: Final = 16


@dataclass(frozen=True)
class Sweep:
    """Values of a measure at each azimuth.

    Parameters
    ----------
    azimuths : array, shape (azimuths,)
        Clockwise from north [degree].
    values : array, shape (azimuths,)
        Values of the measure, in its own unit.

    Examples
    --------
    >>> sweep = Sweep(np.array([0.0, 60.0, 120.0]), np.array([1.0, 2.0, 5.0]))
    >>> sweep.percentile(50), sweep.strongest_azimuth
    (2.0, 120.0)
    """

    azimuths: Float
    values: Float = field(repr=False)

    def percentile(self, share: float) -> float:
        """Return RotDnn of the measure: 0 is the minimum, 50 the median, 100 the maximum."""
        return float(np.percentile(self.values, share))

    @property
    def strongest_azimuth(self) -> float:
        """Azimuth of the largest value [degree]."""
        return float(self.azimuths[self.values.argmax()])


def rotd(
    pair: HorizontalPair,
    *,
    transform: Callable[[Float, float], Float] | None = None,
    measure: Callable[[Float], float] | None = None,
    azimuths: Sequence[float] = HALF_TURN,
) -> Sweep:
    """Return a measure of the motion at each azimuth; its percentiles are RotD00, RotD50, RotD100.

    Parameters
    ----------
    pair : HorizontalPair
        The two recorded components.
    transform : callable, optional
        Linear function of a component and its time step, evaluated once for each component, for
        example `rockframe.signals.integrate` for PGV (default: the acceleration itself).
    measure : callable, optional
        Called with the motion toward each azimuth, shape (samples,); returns the measure (default:
        largest absolute value). If it depends on the sign of the motion, pass azimuths over 360
        degrees.
    azimuths : sequence of float
        Clockwise from north [degree] (default: 0 to 179).

    Raises
    ------
    ParameterError
        If there are no azimuths.

    References
    ----------
    Boore (2010), Orientation-independent, nongeometric-mean measures of seismic intensity from two
    horizontal components of motion, BSSA 100(4).

    Examples
    --------
    >>> from rockframe import Record
    >>> east, north = (
    ...     Record(record_id=name, acceleration=samples, time_step=0.01, azimuth=azimuth)
    ...     for name, samples, azimuth in (("e", [3.0, 0.0], 90.0), ("n", [3.0, 0.0], 0.0))
    ... )
    >>> sweep = rotd(HorizontalPair(east, north))
    >>> print(f"{sweep.percentile(100):.3f} m/s2 toward {sweep.strongest_azimuth:g} degrees")
    4.243 m/s2 toward 45 degrees
    """
    if not len(azimuths):
        raise ParameterError("no azimuth to sweep. Must be one or more.")
    toward = np.array(azimuths, dtype=np.float64)
    components = [
        record.acceleration
        if transform is None
        else transform(record.acceleration, record.time_step)
        for record in (pair.first, pair.second)
    ]
    values: list[float] = []
    for start in range(0, toward.size, _BATCH):
        rotated = pair.toward(toward[start : start + _BATCH], components)
        if measure is None:
            values += np.abs(rotated).max(axis=1).tolist()
        else:
            values += [measure(series) for series in rotated]
    return Sweep(toward, np.array(values))
