"""Minimum overturning acceleration spectra: Makris and Vassiliou (2013), section 6, Figure 9.

Overturning depends on the form of the pulse, the frequency ratio omega_p / p with p of the column,
the slenderness, the mass ratio, and the amplitude a_p / (g tan slenderness), eq (47).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise, product
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rockframe.engines.engine import Engine, OneProcess, map_tasks, on_threads, threads
from rockframe.errors import ParameterError
from rockframe.frame import RockingFrame
from rockframe.parts import RECTANGULAR
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.kernels.steps import MAX_GROUND_DEGREE
from rockframe.rocking.spectra.scan import OverturningSpectrum, Scan, concatenated, scan
from rockframe.units import GRAVITY
from rockframe.wavelets.pulse import Pulse

Float = NDArray[np.float64]

#: Relative tolerance of edges [1].
EDGE_TOLERANCE: Final = 1e-9
#: Least frequency ratio. A longer pulse lasts for hundreds of the frame's periods and acts like a
#: static pull; its response would take very long to compute.
LEAST_FREQUENCY_RATIO: Final = 0.01
#: Least number of intervals in a period of the pulse. The pulse is then interpolated to 4e-11 of
#: its amplitude, and edges are exact to 1e-9; half as many do if edges need be known to
#: `_ROUGH_TOLERANCE` only. At frequency ratios below `_FEWEST_UP_TO` the number is doubled until an
#: interval is about as short in units of the frame's period.
_INTERVALS: Final = 50
_ROUGH_TOLERANCE: Final = 1e-6
_FEWEST_UP_TO: Final = 4.0
#: Number of responses in a task: large enough that most rounds of the edge search are large too.
_TASK: Final = 320_000


@dataclass(frozen=True)
class _Task:
    """Pulses with their frequency ratios, and the frames that are computed under each of them."""

    grounds: tuple[tuple[Pulse, float], ...]
    frames: tuple[RockingFrame, ...]
    amplitude: Float
    tolerance: float


def overturning_spectrum(
    pulses: Sequence[Pulse],
    slendernesses: ArrayLike,
    mass_ratios: ArrayLike,
    frequency_ratios: ArrayLike,
    amplitudes: ArrayLike,
    *,
    tolerance: float = EDGE_TOLERANCE,
    engine: Engine | None = None,
) -> OverturningSpectrum:
    """Compute which pulses overturn which frames, and the edges of all intervals of overturning.

    Parameters
    ----------
    pulses : sequence of Pulse
        The pulses. Only their forms are used, not amplitude, period or time.
    slendernesses : array_like, shape (slenderness,)
        Slenderness of the columns, which are rectangular [rad].
    mass_ratios : array_like, shape (mass_ratio,)
        Mass of the beam over that of all columns [1].
    frequency_ratios : array_like, shape (frequency_ratio,)
        omega_p / p, with p of the column alone [1].
    amplitudes : array_like, shape (amplitude,)
        a_p / (g tan slenderness) of the scan [1]; edges between amplitudes are bisected.
    tolerance : float
        Relative tolerance of the edges [1].
    engine : Engine, optional
        Where to compute; by default in this process. The result has the same bits with any engine.

    Returns
    -------
    OverturningSpectrum
        Verdicts at all points, and the intervals of overturning.

    Raises
    ------
    ParameterError
        If `pulses` is empty or contains a pulse twice; if an array is empty, not increasing or not
        positive; or if a frequency ratio is below 0.01.

    Notes
    -----
    Stability is not monotone in the amplitude: there may be islands above the least amplitude
    that overturns. An interval of overturning may be narrower than the step of `amplitudes`. Such
    intervals are searched for only near the largest rotations of frames that stand, so some may be
    missed.

    Examples
    --------
    >>> pulse = Pulse(wavelet="antisymmetric_ricker", a_p=1.0, T_p=1.0)
    >>> found = overturning_spectrum([pulse], [0.2], [0.0, 4.0], [3.0], np.linspace(1, 8, 71))
    >>> found.minimum_overturning_amplitude.ravel().round(4)
    array([1.6421, 4.3282])
    """
    frames = require_scan(pulses, slendernesses, mass_ratios, frequency_ratios, amplitudes)
    slenderness, mass_ratio, frequency_ratio, amplitude = (
        np.atleast_1d(np.asarray(row, dtype=np.float64))
        for row in (slendernesses, mass_ratios, frequency_ratios, amplitudes)
    )
    grounds = list(product(pulses, frequency_ratio.tolist()))
    size = max(1, _TASK // (len(frames) * amplitude.size))
    tasks = [
        _Task(tuple(grounds[start : start + size]), frames, amplitude, tolerance)
        for start in range(0, len(grounds), size)
    ]
    parts = list(map_tasks(_scans, tasks, engine=OneProcess() if engine is None else engine))
    # computed with the frames of a ground side by side; the dimensions have the frequency ratio
    # last
    shape = (len(pulses), frequency_ratio.size, slenderness.size, mass_ratio.size)
    order = np.arange(math.prod(shape)).reshape(shape).transpose(0, 2, 3, 1).ravel()
    scan = _together(parts).ordered(order)
    return OverturningSpectrum(
        tuple(pulses), slenderness, mass_ratio, frequency_ratio, amplitude, scan
    )


def require_scan(
    pulses: Sequence[Pulse],
    slendernesses: ArrayLike,
    mass_ratios: ArrayLike,
    frequency_ratios: ArrayLike,
    amplitudes: ArrayLike,
) -> tuple[RockingFrame, ...]:
    """Return the frames of an overturning spectrum, after checking its arguments.

    Raises
    ------
    ParameterError
        Under the conditions of `overturning_spectrum`.
    """
    if not pulses:
        raise ParameterError("Invalid number of pulses, 0. Must be one or more.")
    for number, pulse in enumerate(pulses):
        if pulse in pulses[:number]:
            raise ParameterError(f"Invalid pulses: {pulse.wavelet!r} twice. Must differ.")
    frames = columns_of(slendernesses, mass_ratios, math.tau)
    least = increasing("frequency_ratio", frequency_ratios)[0]
    if least < LEAST_FREQUENCY_RATIO:
        raise ParameterError(
            f"Invalid frequency_ratio {least:g}. Must be {LEAST_FREQUENCY_RATIO:g} or more: a "
            "longer pulse acts as a static load."
        )
    increasing("amplitude", amplitudes)
    return frames


def columns_of(
    slendernesses: ArrayLike, mass_ratios: ArrayLike, column_periods: ArrayLike
) -> tuple[RockingFrame, ...]:
    """Return the frame of each slenderness, mass ratio and 2 pi / p; the last varies fastest.

    Raises
    ------
    ParameterError
        If an array is empty, not increasing or not positive, or no frame has such values.
    """
    rows = (
        increasing("slenderness", slendernesses),
        increasing("mass_ratio", mass_ratios, zero=True),
        increasing("column_period", column_periods),
    )
    return tuple(column_of(*of_frame) for of_frame in product(*(row.tolist() for row in rows)))


def column_of(
    slenderness: float, mass_ratio: float = 0.0, period: float = math.tau
) -> RockingFrame:
    """Return the frame of rectangular columns with a slenderness [rad] and a 2 pi / p [s].

    Raises
    ------
    ParameterError
        If no frame has these values.

    Examples
    --------
    >>> round(column_of(0.2).frequency_parameter, 12)
    1.0
    """
    diagonal = 2.0 * GRAVITY / RECTANGULAR * (period / math.tau) ** 2
    return RockingFrame(
        height=diagonal * math.cos(slenderness),
        width=diagonal * math.sin(slenderness),
        mass_ratio=mass_ratio,
        name=f"slenderness {math.degrees(slenderness):.6g} degrees",
    )


def increasing(label: str, values: ArrayLike, *, zero: bool = False) -> Float:
    """Return the values of a dimension as an array, after checking them.

    Parameters
    ----------
    label : str
        Name of the dimension, for errors.
    values : array_like
        The values.
    zero : bool
        True if zero is allowed.

    Raises
    ------
    ParameterError
        If there are no values, or they are not positive, finite and strictly increasing.

    Examples
    --------
    >>> increasing("scale", [1.0, 3.0, 2.0])
    Traceback (most recent call last):
    rockframe.errors.ParameterError: Invalid scale 2.0 after 3.0. Must be increasing.
    """
    row = np.atleast_1d(np.asarray(values, dtype=np.float64))
    if row.ndim != 1 or row.size == 0:
        raise ParameterError(f"Invalid {label} of shape {row.shape}. Must be a row of numbers.")
    for value in row:
        if not (math.isfinite(value) and (value > 0.0 or (zero and value == 0.0))):
            kind = "zero or positive" if zero else "positive"
            raise ParameterError(f"Invalid {label} {value:g}. Must be {kind} and finite.")
    for before, value in pairwise(row):
        if value <= before:
            raise ParameterError(f"Invalid {label} {value} after {before}. Must be increasing.")
    return row


def _scans(task: _Task) -> Scan:
    """Scan a task; each thread computes neighbouring grounds."""
    number, count = len(task.grounds), min(threads(), len(task.grounds))
    ends = [number * k // count for k in range(count + 1)]
    parts = [replace(task, grounds=task.grounds[start:end]) for start, end in pairwise(ends)]
    return _together(on_threads(_scan, parts))


def _scan(task: _Task) -> Scan:
    """Scan the frames under each ground; frames of one ground are computed side by side."""
    grounds = [
        _stretched(_unit_ground(pulse, _intervals_of(ratio, task.tolerance)), math.tau / ratio)
        for pulse, ratio in task.grounds
    ]
    ground, frame = np.indices((len(grounds), len(task.frames))).reshape(2, -1)
    return scan(
        grounds,
        task.frames,
        ground,
        frame,
        task.amplitude,
        tolerance=task.tolerance,
        unit=np.array([each.uplift_acceleration for each in task.frames])[frame],
    )


def _intervals_of(frequency_ratio: float, tolerance: float) -> int:
    least = _INTERVALS // 2 if tolerance >= _ROUGH_TOLERANCE else _INTERVALS
    return least << max(0, math.ceil(math.log2(_FEWEST_UP_TO / frequency_ratio)))


@lru_cache(maxsize=16)
def _unit_ground(pulse: Pulse, intervals: int) -> GroundAcceleration:
    """Return the pulse with amplitude 1 m s-2 and period 1 s, over its reach."""
    unit, reach = replace(pulse, a_p=1.0, T_p=1.0, time=0.0), pulse.mother.reach
    number = math.ceil(2.0 * reach * intervals)
    return GroundAcceleration.from_function(
        unit.acceleration, -reach, reach, intervals=number, degree=MAX_GROUND_DEGREE
    )


def _stretched(unit: GroundAcceleration, period: float) -> GroundAcceleration:
    """Return a pulse of period 1 s stretched to another period [s], for columns of p = 1 rad/s."""
    powers = period ** -np.arange(unit.coefficients.shape[1], dtype=np.float64)
    return GroundAcceleration(
        unit.coefficients * powers, period * unit.time_step, period * unit.start_time
    )


def _together(parts: Sequence[Scan]) -> Scan:
    starts = np.cumsum([0, *(len(part.verdict) for part in parts[:-1])])
    return concatenated(
        [
            replace(part, line=part.line + start)
            for part, start in zip(parts, starts.tolist(), strict=True)
        ]
    )
