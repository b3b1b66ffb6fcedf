"""Claims about equations (13) to (21): kinetic energy, work, and Lagrange's equation."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.frame import RockingFrame
from rockframe.paper.claim import Judgement, judgement
from rockframe.rocking import GroundAcceleration, respond
from rockframe.units import GRAVITY

Float = NDArray[np.float64]

#: A bridge of three columns of unit mass.
_BRIDGE: Final = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
_COLUMNS: Final = 3.0
_BEAM: Final = _COLUMNS * _BRIDGE.mass_ratio
_INERTIA: Final = 4.0 / 3.0 * _BRIDGE.size**2
#: Negative rotations [rad], their rate [rad s-1], and a ground acceleration [m s-2].
_THETA: Final = -_BRIDGE.slenderness * np.linspace(0.05, 0.95, 19)
_OMEGA: Final = -0.3
_GROUND: Final = 0.1 * GRAVITY
#: An admissible rotation [rad].
_TURN: Final = 1e-5
#: Time step of the response that must satisfy Lagrange's equation [s].
_STEP: Final = 1e-3


def derivation_checks() -> dict[str, Judgement]:
    """Check each of equations (13) to (21) at rotations theta < 0, for which they are printed.

    Examples
    --------
    >>> {found.finding.value for found in derivation_checks().values()}
    {'agrees'}
    """
    across, upwards = _rates(_THETA)
    slope = _factor() * (_GROUND * across + GRAVITY * upwards)  # (20)
    printed = _slope(_THETA, _GROUND)  # (21)
    difference = _work(_THETA + 0.5 * _TURN) - _work(_THETA - 0.5 * _TURN)
    of_bodies = _work_of_bodies(_THETA + 0.5 * _TURN) - _work_of_bodies(_THETA - 0.5 * _TURN)
    turning = 0.5 * _COLUMNS * _INERTIA * _OMEGA**2
    energy = turning + 0.5 * _BEAM * _OMEGA**2 * (across**2 + upwards**2)  # (16)
    reduced = np.full(_THETA.shape, _kinetic() * _OMEGA**2)  # (17)
    force, inertia = _lagrange()
    return {
        "eq-13": _equal(inertia, force, 1e-5),
        "eq-14": judgement(bool((np.sign(force) == np.sign(inertia)).all()), nodes=force.size),
        "eq-15": _equal(printed * _TURN, of_bodies, 1e-8),
        "eq-16": _equal(energy, _energy_of_bodies(), 1e-12),
        "eq-17": _equal(reduced, energy, 1e-12),
        "eq-18": _equal(difference, of_bodies, 1e-8),
        "eq-19": _equal(slope * _TURN, difference, 1e-8),
        "eq-20": _equal(slope, difference / _TURN, 1e-8),
        "eq-21": _equal(printed, slope, 1e-12),
    }


def _equal(printed: Float, ours: Float, tolerance: float) -> Judgement:
    """Compare two forms; the difference is relative to the largest value."""
    worst = float(np.abs(printed - ours).max() / np.abs(ours).max())
    return judgement(worst < tolerance, worst=worst)


def _factor() -> float:
    return _BEAM + 0.5 * _COLUMNS


def _kinetic() -> float:
    """Return the factor of the squared rate in (17)."""
    return 0.5 * _COLUMNS * _INERTIA + 2.0 * _BEAM * _BRIDGE.size**2


def _rates(theta: Float) -> tuple[Float, Float]:
    """Return du/dtheta and dv/dtheta at theta < 0, by (8) and (11) as printed [m]."""
    phi, twice = _BRIDGE.slenderness + theta, 2.0 * _BRIDGE.size
    return twice * np.cos(phi), -twice * np.sin(phi)


def _slope(theta: Float, ground: float) -> Float:
    """Return dW/dtheta by (21) as printed."""
    phi = _BRIDGE.slenderness + theta
    return np.asarray(
        2.0 * _BRIDGE.size * _factor() * (ground * np.cos(phi) - GRAVITY * np.sin(phi))
    )


def _work(theta: Float) -> Float:
    """Return the integral of (18)."""
    u, v = _BRIDGE.horizontal_displacement(theta), _BRIDGE.vertical_displacement(theta)
    return _factor() * (_GROUND * u + GRAVITY * v)


def _work_of_bodies(theta: Float) -> Float:
    """Return the sum over the beam and the columns of mass times ground and gravity times path."""
    u, v = _BRIDGE.horizontal_displacement(theta), _BRIDGE.vertical_displacement(theta)
    shift, lift = _BRIDGE.centre.shift(theta), _BRIDGE.centre.lift(theta)
    beam = _BEAM * (_GROUND * u + GRAVITY * v)
    return np.asarray(beam + _COLUMNS * (_GROUND * shift + GRAVITY * lift))


def _energy_of_bodies() -> Float:
    """Return the energy of the beam's translation, and of translation and rotation of columns."""
    omega = np.full(_THETA.shape, _OMEGA)
    beam = (
        _BRIDGE.horizontal_velocity(_THETA, omega) ** 2
        + _BRIDGE.vertical_velocity(_THETA, omega) ** 2
    )
    centre = _BRIDGE.centre.shift_rate(_THETA, omega) ** 2
    centre = centre + _BRIDGE.centre.lift_rate(_THETA, omega) ** 2
    about_centre = (_BRIDGE.height**2 + _BRIDGE.width**2) / 12.0 * omega**2
    return np.asarray(0.5 * _BEAM * beam + 0.5 * _COLUMNS * (centre + about_centre))


def _lagrange() -> tuple[Float, Float]:
    """Return -dW/dtheta and d/dt (dT/dtheta'), equal by (13), while a push turns the bridge."""
    push = 2.0 * math.tan(_BRIDGE.slenderness) * GRAVITY
    samples = np.full(int(0.4 / _STEP), push)
    response = respond(_BRIDGE, GroundAcceleration.from_samples(samples, _STEP))
    rate = 2.0 * _kinetic() * response.omega
    growth = (rate[2:] - rate[:-2]) / (2.0 * _STEP)
    within = response.theta[1:-1] < -1e-3 * _BRIDGE.slenderness
    return -_slope(response.theta[1:-1][within], push), growth[within]
