"""Ground acceleration in both horizontal directions at common samples."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final, Self, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rockframe.components import BothDirections, HorizontalPair
from rockframe.errors import ParameterError
from rockframe.record import Orientation
from rockframe.units import GRAVITY
from rockframe.wavelets.pulse import Pulse

Float = NDArray[np.float64]

#: Samples of two pulses per period of the shorter one. Straight lines between them miss a Ricker
#: wavelet by less than 3e-5 of its amplitude.
_SAMPLES_PER_PERIOD: Final = 500


@dataclass(frozen=True, eq=False)
class PairAcceleration:
    """Ground acceleration in both horizontal directions, linear between common samples.

    Parameters
    ----------
    x, y : array_like, shape (samples,)
        Horizontal accelerations along two axes at right angles [m s-2].
    time_step : float
        Time between samples [s].
    z : array_like, shape (samples,), optional
        Vertical acceleration, upwards [m s-2]; by default there is none.
    start_time : float
        Time of the first sample [s]. Before it and after the last one the ground is still.

    Raises
    ------
    ParameterError
        If a component is not one row of two finite samples or more, their lengths differ, the time
        step is not positive, or the start is not finite.

    Examples
    --------
    >>> motion = PairAcceleration([0.0, 3.0, 0.0], [0.0, 4.0, 0.0], time_step=0.1)
    >>> float(motion.largest)
    5.0
    >>> motion.turned(90.0).y.round(12).tolist()
    [0.0, 3.0, 0.0]
    """

    x: Float
    y: Float
    time_step: float
    z: Float | None = None
    start_time: float = 0.0

    def __post_init__(self) -> None:
        for name in ("x", "y", "z"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, self._checked(name))
        if not (math.isfinite(self.time_step) and self.time_step > 0.0):
            raise ParameterError(
                f"Invalid time step {self.time_step!r} s. Must be positive and finite."
            )
        if not math.isfinite(self.start_time):
            raise ParameterError(f"Invalid start time {self.start_time!r} s. Must be finite.")

    def _checked(self, name: str) -> Float:
        samples = np.asarray(getattr(self, name), dtype=np.float64)
        if samples.ndim != 1 or samples.size < 2:
            raise ParameterError(
                f"Invalid acceleration {name} of shape {samples.shape}. Must be one row of two "
                "samples or more."
            )
        if not np.isfinite(samples).all():
            where = int(np.flatnonzero(~np.isfinite(samples))[0])
            raise ParameterError(
                f"Invalid acceleration {name}, {samples[where]} at sample {where}. Must be finite."
            )
        if samples.size != np.size(self.x):
            raise ParameterError(
                f"Invalid acceleration {name} of {samples.size} samples. Must have "
                f"{np.size(self.x)}, as x."
            )
        return samples

    @classmethod
    def from_pair(cls, pair: HorizontalPair | BothDirections, *, vertical: bool = False) -> Self:
        """Return the motion of a station; x is toward the azimuth of the first component.

        Parameters
        ----------
        pair : HorizontalPair or BothDirections
            Two components at right angles, corrected alike, and the vertical one.
        vertical : bool
            Include the vertical component.

        Raises
        ------
        ParameterError
            If the vertical component is requested and the pair has none.

        Examples
        --------
        >>> from rockframe import bundled_records, pair_horizontals, read_file
        >>> [pair], _ = pair_horizontals(
        ...     read_file(bundled_records() / "Ridgecrest2019-CCC.V1")
        ... )
        >>> PairAcceleration.from_pair(pair).x.shape
        (10000,)
        """
        if vertical and pair.vertical is None:
            raise ParameterError(
                f"Missing vertical component beside {pair.first.record_id!r}. State vertical=False."
            )
        upwards = None
        if vertical and pair.vertical is not None:
            downward = pair.vertical.orientation is Orientation.DOWNWARD
            upwards = (-1.0 if downward else 1.0) * pair.vertical.acceleration
        first, other = pair.first, pair.second
        return cls(first.acceleration, other.acceleration, first.time_step, upwards)

    @classmethod
    def from_pulses(cls, first: Pulse, second: Pulse, *, angle_degree: float = 90.0) -> Self:
        """Return the motion of two pulses; the lag is the difference of their times.

        Parameters
        ----------
        first, second : Pulse
            Pulses; the first is along x.
        angle_degree : float
            Direction of the second pulse, from x towards y [degree].

        Raises
        ------
        ParameterError
            If the angle is not finite.

        Notes
        -----
        The samples are a 500th of the shorter period apart. They begin before both pulses and end
        after both.

        Examples
        --------
        >>> one = Pulse(wavelet="symmetric_ricker", a_p=4.0, T_p=1.0)
        >>> two = Pulse(wavelet="symmetric_ricker", a_p=3.0, T_p=1.0, time=0.5)
        >>> motion = PairAcceleration.from_pulses(one, two)
        >>> motion.start_time, round(float(motion.y.max()), 6)
        (-3.0, 3.0)
        """
        if not math.isfinite(angle_degree):
            raise ParameterError(f"Invalid angle {angle_degree!r} degrees. Must be finite.")
        pulses = (first, second)
        start = min(pulse.time - pulse.mother.extent * pulse.T_p for pulse in pulses)
        end = max(pulse.time + pulse.mother.extent * pulse.T_p for pulse in pulses)
        step = min(pulse.T_p for pulse in pulses) / _SAMPLES_PER_PERIOD
        times = start + step * np.arange(math.ceil((end - start) / step) + 1)
        along, other = (pulse.acceleration(times) for pulse in pulses)
        cosine, sine = _direction(angle_degree)
        return cls(along + cosine * other, sine * other, step, None, start)

    def scaled(self, factor: float) -> Self:
        """Return the same motion with all accelerations multiplied by a factor."""
        upwards = None if self.z is None else factor * self.z
        return replace(self, x=factor * self.x, y=factor * self.y, z=upwards)

    def turned(self, angle_degree: float) -> Self:
        """Return the motion turned from x towards y by an angle [degree]."""
        cosine, sine = _direction(angle_degree)
        x, y = cosine * self.x - sine * self.y, sine * self.x + cosine * self.y
        return replace(self, x=x, y=y)

    @property
    def time(self) -> Float:
        """Times of the samples [s], shape (samples,)."""
        return self.start_time + self.time_step * np.arange(self.x.size, dtype=np.float64)

    @property
    def largest(self) -> float:
        """Largest length of the vector of both horizontal accelerations [m s-2]."""
        return float(np.hypot(self.x, self.y).max())

    def in_g(self) -> Float:
        """Return the accelerations in x, y and z [g], shape (samples, 3)."""
        upwards = np.zeros_like(self.x) if self.z is None else self.z
        ground: Float = np.column_stack([self.x, self.y, upwards]) / GRAVITY
        return ground


def _direction(angle_degree: float) -> tuple[float, float]:
    """Return cosine and sine of an angle [degree], exact at multiples of a right angle."""
    quarter, rest = divmod(angle_degree, 90.0)
    cosine, sine = math.cos(math.radians(rest)), math.sin(math.radians(rest))
    for _ in range(int(quarter) % 4):
        cosine, sine = -sine, cosine
    return cosine, sine


#: A motion in both horizontal directions.
PairMotion: TypeAlias = PairAcceleration | HorizontalPair | BothDirections


def as_pair(motion: PairMotion) -> PairAcceleration:
    """Return the motion of a station, without its vertical component, as a `PairAcceleration`."""
    if isinstance(motion, HorizontalPair | BothDirections):
        return PairAcceleration.from_pair(motion)
    if not isinstance(motion, PairAcceleration):  # such as a list, where types are not checked
        allowed = "a PairAcceleration, a HorizontalPair or BothDirections"  # type: ignore[unreachable]
        raise ParameterError(f"Invalid motion of type {type(motion).__name__}. Must be {allowed}.")
    return motion
