"""Ground accelerations that are polynomials within each of their intervals.

Both kinds of input take this form. A sampled record is piecewise linear (degree 1). A continuous
pulse is interpolated to round-off by polynomials of higher degree.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rockframe.errors import ParameterError
from rockframe.rocking.kernels.steps import MAX_GROUND_DEGREE
from rockframe.wavelets.pulse import Pulse

Float = NDArray[np.float64]

#: Degree, and number of intervals per period, at which a pulse is exact to round-off.
_PULSE_DEGREE: Final = 5
_PULSE_INTERVALS: Final = 200


@dataclass(frozen=True, eq=False)
class GroundAcceleration:
    """Ground acceleration, piecewise polynomial on intervals of equal length.

    It is horizontal; `with_vertical` adds a vertical component.

    Parameters
    ----------
    coefficients : array, shape (intervals, degree + 1)
        Acceleration [m s-2] in powers of the time since the start of each interval [s].
    time_step : float
        Length of an interval [s].
    start_time : float
        Time of the first node [s]. Before it and after the last node the ground is still.
    vertical : array, shape (intervals, degree + 1), optional
        Vertical ground acceleration, upwards, in the same form.

    Raises
    ------
    ParameterError
        If the coefficients have another shape, a degree above 5, or are not finite; if the time
        step is not positive; or if the start is not finite.
    """

    coefficients: Float
    time_step: float
    start_time: float = 0.0
    vertical: Float | None = None

    def __post_init__(self) -> None:
        shape = self.coefficients.shape
        if len(shape) != 2 or shape[0] < 1 or not 1 <= shape[1] <= MAX_GROUND_DEGREE + 1:
            raise ParameterError(
                f"Invalid coefficients of shape {shape}. Must be one interval or more, and "
                f"1 to {MAX_GROUND_DEGREE + 1} coefficients in each."
            )
        if not (math.isfinite(self.time_step) and self.time_step > 0.0):
            raise ParameterError(
                f"Invalid time step {self.time_step!r} s. Must be positive and finite."
            )
        if not np.isfinite(self.coefficients).all():
            where = int(np.argwhere(~np.isfinite(self.coefficients))[0, 0])
            raise ParameterError(
                f"Invalid ground acceleration in interval {where}. Must be finite."
            )
        if not math.isfinite(self.start_time):
            raise ParameterError(f"Invalid start time {self.start_time!r} s. Must be finite.")
        if self.vertical is not None:
            if self.vertical.shape != shape:
                raise ParameterError(
                    f"Invalid vertical acceleration of shape {self.vertical.shape}. Must be "
                    f"{shape}, as the horizontal."
                )
            if not np.isfinite(self.vertical).all():
                where = int(np.argwhere(~np.isfinite(self.vertical))[0, 0])
                raise ParameterError(
                    f"Invalid vertical acceleration in interval {where}. Must be finite."
                )

    @classmethod
    def from_samples(
        cls, acceleration: ArrayLike, time_step: float, start_time: float = 0.0
    ) -> Self:
        """Return the motion that joins samples by straight lines.

        Parameters
        ----------
        acceleration : array_like, shape (samples,)
            Ground acceleration [m s-2].
        time_step, start_time : float
            Interval between samples and time of the first one [s].

        Raises
        ------
        ParameterError
            If there are fewer than two samples, a sample is not finite, or the time step is not
            positive.

        Examples
        --------
        >>> GroundAcceleration.from_samples([0.0, 2.0, 1.0], 0.5).coefficients.tolist()
        [[0.0, 4.0], [2.0, -2.0]]
        """
        samples = np.asarray(acceleration, dtype=np.float64)
        if samples.ndim != 1 or samples.size < 2:
            raise ParameterError(
                f"Invalid acceleration of shape {samples.shape}. Must be one row of two samples "
                "or more."
            )
        if not np.isfinite(samples).all():
            where = int(np.flatnonzero(~np.isfinite(samples))[0])
            raise ParameterError(
                f"Invalid acceleration {samples[where]} at sample {where}. Must be finite."
            )
        with np.errstate(divide="ignore", invalid="ignore"):  # __post_init__ rejects a bad step
            slopes = np.diff(samples) / time_step
        return cls(np.column_stack([samples[:-1], slopes]), time_step, start_time)

    @classmethod
    def from_function(
        cls,
        acceleration: Callable[[Float], Float],
        start_time: float,
        end_time: float,
        *,
        intervals: int,
        degree: int,
    ) -> Self:
        """Interpolate a function at Chebyshev points; it must be smooth within each interval.

        Parameters
        ----------
        acceleration : callable
            Function that returns the ground acceleration [m s-2] at an array of times [s].
        start_time, end_time : float
            Start and end of the motion [s].
        intervals, degree : int
            Number of equal intervals; degree of the polynomial in each, at most 5.

        Raises
        ------
        ParameterError
            If the end is not after the start, there is no interval, or the degree is not 0 to 5.

        Examples
        --------
        >>> import numpy as np
        >>> pull = GroundAcceleration.from_function(np.sin, 0.0, np.pi, intervals=300, degree=5)
        >>> bool(np.allclose(pull.acceleration(), np.sin(pull.time), rtol=0, atol=1e-14))
        True
        """
        if not (end_time > start_time and intervals >= 1):
            raise ParameterError(
                f"Invalid span from {start_time!r} to {end_time!r} s in {intervals!r} intervals. "
                "Must be a positive span and at least one interval."
            )
        if not 0 <= degree <= MAX_GROUND_DEGREE:
            raise ParameterError(f"Invalid degree {degree!r}. Must be 0 to {MAX_GROUND_DEGREE}.")
        step = (end_time - start_time) / intervals
        points = 0.5 * (1.0 - np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1)))
        starts = start_time + step * np.arange(intervals)
        values = acceleration(starts[:, None] + step * points)
        scaled = np.linalg.solve(np.vander(points, increasing=True), values.T).T
        return cls(scaled / step ** np.arange(degree + 1), step, start_time)

    @classmethod
    def from_pulse(cls, pulse: Pulse) -> Self:
        """Return the motion of a pulse over the time in which it is not zero to round-off.

        The nodes are a 200th of the period apart, from 3 periods before the centre of the pulse to
        3 periods after it. A pulse that ends with a kink has nodes at both ends, and between them
        at least as many per period.

        Parameters
        ----------
        pulse : Pulse
            The pulse.

        Examples
        --------
        >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=1.0, T_p=2.0)
        >>> GroundAcceleration.from_pulse(pulse).start_time
        -6.0
        """
        half = pulse.mother.extent * pulse.T_p
        return cls.from_function(
            pulse.acceleration,
            pulse.time - half,
            pulse.time + half,
            intervals=math.ceil(2.0 * pulse.mother.extent * _PULSE_INTERVALS),
            degree=_PULSE_DEGREE,
        )

    def with_vertical(self, other: GroundAcceleration) -> Self:
        """Return this motion with the acceleration of another as its vertical one, upwards.

        Parameters
        ----------
        other : GroundAcceleration
            A motion of the same length, time step and start.

        Raises
        ------
        ParameterError
            If the number of intervals, the time step or the start differs.

        Examples
        --------
        >>> across = GroundAcceleration.from_samples([0.0, 2.0, 0.0], 0.5)
        >>> upwards = GroundAcceleration.from_samples([0.0, 1.0, 0.0], 0.5)
        >>> across.with_vertical(upwards).vertical.tolist()
        [[0.0, 2.0], [1.0, -2.0]]
        """
        mine, theirs = self.coefficients.shape, other.coefficients.shape
        if mine[0] != theirs[0]:
            raise ParameterError(
                f"Invalid vertical acceleration of {theirs[0]} intervals. Must have {mine[0]}, as "
                "the horizontal."
            )
        for label, here, there in (
            ("time step", self.time_step, other.time_step),
            ("start time", self.start_time, other.start_time),
        ):
            if here != there:
                raise ParameterError(
                    f"Invalid {label} {there!r} s of the vertical acceleration. Must be {here!r}, "
                    "as the horizontal."
                )
        degree = max(mine[1], theirs[1])
        across, upwards = (
            np.pad(c, ((0, 0), (0, degree - c.shape[1])))
            for c in (self.coefficients, other.coefficients)
        )
        return type(self)(across, self.time_step, self.start_time, upwards)

    def scaled(self, factor: float) -> Self:
        """Return the same motion with all accelerations multiplied by a finite factor.

        Examples
        --------
        >>> GroundAcceleration.from_samples([0.0, 2.0], 0.5).scaled(0.5).coefficients.tolist()
        [[0.0, 2.0]]
        """
        vertical = None if self.vertical is None else factor * self.vertical
        return type(self)(factor * self.coefficients, self.time_step, self.start_time, vertical)

    @property
    def time(self) -> Float:
        """Times of the nodes [s], shape (intervals + 1,)."""
        return self.start_time + self.time_step * np.arange(self.coefficients.shape[0] + 1)

    def acceleration(self) -> Float:
        """Acceleration at the nodes [m s-2], shape (intervals + 1,)."""
        last = np.polynomial.polynomial.polyval(self.time_step, self.coefficients[-1])
        return np.append(self.coefficients[:, 0], last)

    def at_nodes(self) -> tuple[Float, Float]:
        """Return the horizontal and the vertical acceleration at the nodes [m s-2]."""
        across = self.acceleration()
        if self.vertical is None:
            return across, np.zeros_like(across)
        upwards = type(self)(self.vertical, self.time_step, self.start_time)
        return across, upwards.acceleration()

    def followed_by_rest(self, duration: float) -> Self:
        """Return the motion followed by at least `duration` [s] of still ground.

        Raises
        ------
        ParameterError
            If the duration is negative or not finite.
        """
        if not (math.isfinite(duration) and duration >= 0.0):
            raise ParameterError(f"Invalid duration {duration!r} s. Must be zero or positive.")
        if duration == 0.0:
            return self
        intervals = math.ceil(duration / self.time_step)
        still = np.zeros((intervals, self.coefficients.shape[1]))
        vertical = None if self.vertical is None else np.concatenate([self.vertical, still])
        return type(self)(
            np.concatenate([self.coefficients, still]), self.time_step, self.start_time, vertical
        )

    def upward_bounds(self) -> tuple[float, float]:
        """Return bounds of the vertical acceleration [m s-2]; (0, 0) if there is none.

        They are the extremes if it is piecewise linear, and may be slightly wider otherwise.
        """
        if self.vertical is None:
            return 0.0, 0.0
        powers = self.time_step ** np.arange(self.vertical.shape[1])
        parts = self.vertical * powers
        if parts.shape[1] <= 2:
            ends = np.concatenate([parts[:, 0], parts.sum(axis=1)])
            return float(ends.min()), float(ends.max())
        middle, rest = parts[:, 0], np.abs(parts[:, 1:]).sum(axis=1)
        return float((middle - rest).min()), float((middle + rest).max())
