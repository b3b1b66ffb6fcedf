"""Direct calls of the kernel, also with slenderness, size and restitution that no frame has."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rockframe.rocking.kernels import kernel
from rockframe.rocking.kernels.ties import TIE_LOG_SIZE, Tie

Float = NDArray[np.float64]


@dataclass(frozen=True)
class Outcome:
    """The arrays that the kernel filled."""

    verdict: int
    theta: Float
    omega: Float
    impact_times: Float
    impact_velocities: Float
    impacts: int
    peak: float
    peak_velocity: float
    uplift_time: float
    overturning_time: float
    forces: Float
    log: Float


def integrate(
    coefficients: ArrayLike,
    time_step: float,
    *,
    alpha: float,
    p_hat: float = 1.0,
    restitution: float,
    start: tuple[float, float] = (0.0, 0.0),
    vertical: ArrayLike | None = None,
    ties: tuple[()] | tuple[Tie, Tie] = (),
    impacts: Float | None = None,
) -> Outcome:
    """Run the kernel over a ground acceleration [g], shape (intervals, degree + 1)."""
    ground = np.array(coefficients, dtype=np.float64, order="C")
    if vertical is None:
        lift = np.empty((0, ground.shape[1]))
    else:
        lift = np.array(vertical, dtype=np.float64, order="C")
    theta, omega = np.empty((2, ground.shape[0] + 1))
    impacts = np.empty((16384, 2)) if impacts is None else impacts
    summary = np.empty(kernel.SUMMARY_SIZE)
    forces = np.empty((theta.size, len(ties)))
    log = np.empty((len(ties), TIE_LOG_SIZE))
    verdict = kernel.integrate(
        ground,
        lift,
        time_step,
        0.0,
        1.0,
        alpha,
        p_hat,
        restitution,
        *start,
        theta,
        omega,
        impacts,
        summary,
        ties,
        forces,
        log,
    )
    count = int(summary[kernel.IMPACTS])
    return Outcome(
        verdict=verdict,
        theta=theta,
        omega=omega,
        impact_times=impacts[:count, 0],
        impact_velocities=impacts[:count, 1],
        impacts=count,
        peak=float(summary[kernel.PEAK]),
        peak_velocity=float(summary[kernel.PEAK_VELOCITY]),
        uplift_time=float(summary[kernel.UPLIFT_TIME]),
        overturning_time=float(summary[kernel.OVERTURNING_TIME]),
        forces=forces,
        log=log,
    )


def straight_lines(samples: ArrayLike, time_step: float) -> Float:
    """Return the coefficients of the straight lines through samples."""
    values = np.asarray(samples, dtype=np.float64)
    return np.column_stack([values[:-1], np.diff(values) / time_step])
