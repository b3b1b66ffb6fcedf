"""Two horizontal components of one motion, and the vertical component if there is one."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.record import Record

Float = NDArray[np.float64]

#: Tolerance of the right angle [degree]. Files state whole degrees, so larger deviations are real.
_SQUARE: Final = 0.01


@dataclass(frozen=True)
class HorizontalPair:
    """The two horizontal components of one motion, and its vertical if there is one.

    Parameters
    ----------
    first, second : Record
        Horizontal components at right angles, sampled at the same times.
    vertical : Record, optional
        Vertical component, sampled at the same times; rotation leaves it unchanged.

    Raises
    ------
    ParameterError
        If time steps, lengths or start times differ, an azimuth is unknown, or the azimuths are not
        90 degrees apart.

    Examples
    --------
    >>> east, north = (
    ...     Record(record_id=name, acceleration=samples, time_step=0.01, azimuth=azimuth)
    ...     for name, samples, azimuth in (("e", [3.0, 0.0], 90.0), ("n", [4.0, 1.0], 0.0))
    ... )
    >>> HorizontalPair(east, north).first.record_id
    'e'
    """

    first: Record
    second: Record
    vertical: Record | None = None

    def __post_init__(self) -> None:
        one, other = self.first, self.second
        for partner in (other, self.vertical):
            if partner is not None:
                _require_same_times(one, partner)
        apart = (other.azimuth - one.azimuth) % 180.0
        if not abs(apart - 90.0) <= _SQUARE:
            raise ParameterError(
                f"azimuths {one.azimuth:g} and {other.azimuth:g} degrees of {one.record_id!r} and "
                f"{other.record_id!r}. Must be stated, and 90 degrees apart."
            )

    def toward(self, azimuths: Iterable[float], series: Sequence[Float] | None = None) -> Float:
        """Return the motion toward each azimuth, positive in that direction.

        Parameters
        ----------
        azimuths : iterable of float
            Azimuths, clockwise from north [degree].
        series : two arrays, shape (samples,), optional
            Series to rotate instead of the accelerations [m s-2], for example the velocities. Each
            must be a linear function of its component.

        Returns
        -------
        array, shape (azimuths, samples)
        """
        one, other = (
            (self.first.acceleration, self.second.acceleration) if series is None else series
        )
        toward = np.array(list(azimuths), dtype=np.float64)
        return np.outer(_cosine(toward - self.first.azimuth), one) + np.outer(
            _cosine(toward - self.second.azimuth), other
        )


def sampling(record: Record) -> tuple[str, float, int]:
    """Return start time, time step [s] and number of samples of a record."""
    return record.start_time, record.time_step, record.acceleration.size


def _require_same_times(one: Record, other: Record) -> None:
    for what, here, there in zip(
        ("start times", "time steps [s]", "numbers of samples"),
        sampling(one),
        sampling(other),
        strict=True,
    ):
        if here != there:
            raise ParameterError(
                f"{what} {here!r} and {there!r} of {one.record_id!r} and {other.record_id!r}. "
                "Must be equal."
            )


def _cosine(degrees: Float) -> Float:
    """Return the cosine, exactly zero at right angles so that components do not mix."""
    turned = np.mod(degrees, 360.0)
    cosine: Float = np.cos(np.radians(turned))
    cosine[(turned == 90.0) | (turned == 270.0)] = 0.0
    return cosine
