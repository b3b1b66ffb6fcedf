"""Claims about equations, sections 3 to 5; misprints are evaluated as printed and as corrected."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.frame import RockingFrame
from rockframe.paper.claim import Check, Finding, check, judged
from rockframe.paper.frames import BRIDGE
from rockframe.rocking import GroundAcceleration, respond, restoring_moment
from rockframe.units import GRAVITY
from rockframe.wavelets.pulse import Pulse

Float = NDArray[np.float64]

#: Rotation [rad] and ground acceleration [m s-2] at which misprints are evaluated.
_THETA: Final = 0.5 * BRIDGE.slenderness
_GROUND: Final = 0.1 * GRAVITY
#: Rotation [rad], its rate [rad s-1] and acceleration [rad s-2] for the beam's rates.
_TURNED: Final = 0.05
_OMEGA: Final = 0.3
_RATE: Final = -0.8
#: Step of finite differences, in rotation [rad] and time [s].
_STEP: Final = 1e-4


def motion_checks() -> dict[str, Check]:
    """Check the claims about kinematics and the equation of motion, section 3."""
    residual, frequency = _kinematic_residual(), _frequency_difference()
    push = GroundAcceleration.from_samples([0.0, 4.0, 4.0], 0.2)
    theta = float(respond(BRIDGE, push).theta[-1])
    return {
        "eq-7-11": check(residual < 1e-6, worst=residual),
        "eq-26": check(frequency < 1e-13, worst=frequency),
        "energy": _energy_check(),
        "sign": check(theta < 0.0, theta=theta),
        "eq-47": _similarity_check(),
    }


def misprint_checks() -> dict[str, Check]:
    """Check the misprinted equations, with values of both forms."""
    alpha = BRIDGE.slenderness
    printed = _work_slope(math.cos(alpha + _THETA), math.sin(alpha + _THETA))
    meant = _work_slope(math.cos(alpha - _THETA), math.sin(alpha - _THETA))
    slope = (_work(_THETA + _STEP) - _work(_THETA - _STEP)) / (2.0 * _STEP)
    return {
        "eq-12": _lift_check(),
        "eq-23": check(Finding.MISPRINT, printed=8.0 + 2.0, meant=8.0 + 0.5 * 2.0),
        "eq-24": _misprint(printed, slope, meant),
        "eq-34": _uplift_check(),
    }


def impact_checks() -> dict[str, Check]:
    """Check eq (43) against the solution of eqs (37) to (41), section 5."""
    worst = 0.0
    for gamma in (0.0, 0.3, 1.0, 4.0, 100.0):
        for alpha in np.radians([5.0, 10.0, 14.0, 30.0]):
            frame = RockingFrame(height=5.0, width=5.0 * math.tan(alpha), mass_ratio=gamma)
            worst = max(worst, abs(_impact(alpha, gamma) - frame.restitution))
    return {"eq-43": check(worst < 1e-13, worst=worst)}


def _kinematic_residual() -> float:
    """Compare finite differences of the displacements with (8), (9), (11) as printed."""
    worst = 0.0
    for side in (1.0, -1.0):
        u, v = (_differences(place, side) for place in (
            BRIDGE.horizontal_displacement, BRIDGE.vertical_displacement,
        ))  # fmt: skip
        printed = _printed_rates(side)
        worst = max(worst, *(abs(one / other - 1.0) for one, other in
                             zip((*u, v[0]), printed[:3], strict=True)))  # fmt: skip
    return worst


def _differences(place: Callable[[Float], Float], side: float) -> tuple[float, float]:
    """Return the first and second time derivative of a displacement, by finite differences."""
    time = _STEP * np.arange(-1, 2)
    values = place(side * (_TURNED + _OMEGA * time + 0.5 * _RATE * time**2))
    first = (values[2] - values[0]) / (2.0 * _STEP)
    return float(first), float((values[2] - 2.0 * values[1] + values[0]) / _STEP**2)


def _printed_rates(side: float) -> tuple[float, float, float, float]:
    """Evaluate (8), (9), (11), (12) as printed; a printed ± means -side, and ∓ means side."""
    omega, rate, twice = side * _OMEGA, side * _RATE, 2.0 * BRIDGE.size
    phi = BRIDGE.slenderness - _TURNED  # alpha -+ theta, for both sides
    sine, cosine = math.sin(phi), math.cos(phi)
    return (
        twice * cosine * omega,
        twice * (side * sine * omega**2 + cosine * rate),
        twice * side * sine * omega,
        -twice * (cosine * omega**2 + sine * rate),
    )


def _lift_check() -> Check:
    """Check eq (12) for theta > 0, where one of its signs contradicts (11)."""
    _, right = _differences(BRIDGE.vertical_displacement, 1.0)
    printed = _printed_rates(1.0)[3]
    meant = printed + 4.0 * BRIDGE.size * math.sin(BRIDGE.slenderness - _TURNED) * _RATE
    return _misprint(printed, right, meant, theta=_TURNED, rate=_OMEGA, acceleration=_RATE)


def _frequency_difference() -> float:
    worst = 0.0
    for columns in (2, 5, 12):
        for gamma in (0.0, 0.3, 1.0, 4.0, 100.0):
            frame = RockingFrame(height=9.6, width=1.6, mass_ratio=gamma)
            size, beam = frame.size, gamma * columns  # m_c = 1
            inertia = columns * 4.0 / 3.0 * size**2 + 4.0 * beam * size**2  # twice (17)
            p_hat_2 = 2.0 * size * (beam + 0.5 * columns) * GRAVITY / inertia  # (21)
            worst = max(worst, abs(p_hat_2 / frame.effective_frequency_parameter**2 - 1.0))
    return worst


def _energy_check() -> Check:
    ground = GroundAcceleration.from_samples(np.zeros(2001), 0.005)
    response = respond(BRIDGE, ground, initial_rotation=0.8 * BRIDGE.slenderness)
    energy = 0.5 * response.omega**2 + BRIDGE.effective_frequency_parameter**2 * (
        np.cos(BRIDGE.slenderness - np.abs(response.theta)) - math.cos(BRIDGE.slenderness)
    )
    flights = np.split(energy, np.searchsorted(response.time, response.impact_times))
    drift = max(np.ptp(flight) for flight in flights if flight.size) / energy[0]
    moment = restoring_moment(BRIDGE, np.array([1e-15, BRIDGE.slenderness]))
    first, last = moment[0], abs(moment[1])
    holds = drift < 1e-12 and abs(first - 1.0) < 1e-12 and last < 1e-12
    return check(bool(holds), drift=drift, first=first, last=last)


def _similarity_check() -> Check:
    """Compare two sizes of frame with the same five products of eq (47)."""
    scale = 0.3
    small = RockingFrame(height=scale * 9.6, width=scale * 1.6, mass_ratio=4.0)
    full = respond(BRIDGE, Pulse(wavelet="symmetric_ricker", a_p=5.0, T_p=1.6))
    reduced = respond(small, Pulse(wavelet="symmetric_ricker", a_p=5.0, T_p=1.6 * math.sqrt(scale)))
    apart = float(np.abs(full.theta - reduced.theta).max())
    return check(apart < 1e-11, scale=scale, apart=apart)


def _uplift_check() -> Check:
    """Check eq (34) at theta > 0, where the printed equation treats the columns as unrotated."""
    alpha, gamma = BRIDGE.slenderness, BRIDGE.mass_ratio
    beam = alpha - _THETA
    printed = (2.0 * gamma * math.sin(beam) + math.sin(alpha)) / (
        2.0 * gamma * math.cos(beam) + math.cos(alpha)
    )
    return _misprint(printed, math.tan(beam), math.tan(beam))


def _misprint(printed: float, right: float, meant: float, **others: float) -> Check:
    """Return MISPRINT if the printed value is wrong and the intended value is right."""
    near = abs(meant - right) <= 1e-6 * abs(right)
    wrong = near and abs(printed - right) > 1e-3 * abs(right)
    found = Finding.MISPRINT if wrong else judged(near)
    return check(found, printed=printed, right=right, meant=meant, **others)


def _work(theta: float) -> float:
    """Return the integral of eq (18), divided by N m_c g R."""
    weight = BRIDGE.mass_ratio + 0.5
    u = float(BRIDGE.horizontal_displacement(theta))
    v = float(BRIDGE.vertical_displacement(theta))
    return weight * (_GROUND * u + GRAVITY * v) / (GRAVITY * BRIDGE.size)


def _work_slope(cosine: float, sine: float) -> float:
    """Return eq (24) divided by N m_c g R, given the cosine and sine of its argument."""
    return 2.0 * (BRIDGE.mass_ratio + 0.5) * (_GROUND / GRAVITY * cosine + sine)


def _impact(alpha: float, gamma: float) -> float:
    """Solve eqs (37) to (41) for the rate after an impact: two columns of unit mass and size."""
    columns, inertia = 2.0, 4.0 / 3.0
    beam = gamma * columns
    b, h = math.sin(alpha), math.cos(alpha)
    across = 2.0 * beam * h / columns  # (39), times (rate before - rate after)
    upwards = 2.0 * beam * b / columns  # (40), times (rate before + rate after)
    before = inertia - 2.0 * b * math.sin(alpha) - 2.0 * b * upwards + 2.0 * h * across
    return before / (inertia + 2.0 * b * upwards + 2.0 * h * across)
