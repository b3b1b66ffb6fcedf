"""Four invariants of histories of the package: `broken` names those that a history violates.

An impact is not earlier than the one before; theta does not jump; energy does not rise without work
of the ground; and the verdict is that of the history. Bounds and energies are those of the plain
structure, in a ground motion that is constant in each interval: it acts like a tilted gravity, so
its work is known exactly.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from tests.validation.plain import GRAVITY, Oscillator, Rocker
from tests.validation.random_cases import Case

from rockframe.frame import RockingFrame
from rockframe.oscillators.response import OscillatorResponse, respond_oscillator
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.response import Response, respond
from rockframe.rocking.verdict import Verdict

Float: TypeAlias = NDArray[np.float64]

#: Time for which histories continue after the motion [s].
_LONGER = 20.0
#: Rise of energy over the largest energy that counts as round-off.
_ROUND_OFF = 1e-10


def ground_of(case: Case, *, held: bool = False) -> GroundAcceleration:
    """Return the motion for the package; if held, constant in each interval."""
    ground = GroundAcceleration.from_samples(case.across, case.time_step)
    if case.upwards is not None:
        ground = ground.with_vertical(GroundAcceleration.from_samples(case.upwards, case.time_step))
    if not held:
        return ground
    upwards = None if ground.vertical is None else ground.vertical[:, :1].copy()
    return replace(ground, coefficients=ground.coefficients[:, :1].copy(), vertical=upwards)


def broken(case: Case) -> list[str]:
    """Return the names of the invariants that the package's histories of a case violate."""
    ground = ground_of(case, held=True)
    if isinstance(case.ours, RockingFrame):
        assert isinstance(case.plain, Rocker)
        free = respond(case.ours, ground)
        longer = respond(case.ours, ground, free_rocking=_LONGER)
        checks = {
            "impacts": impacts_follow(free),
            "jumps": not jumps(case.plain, free, ground),
            "energy": rise(case.plain, free, ground) <= _ROUND_OFF,
            "verdict": verdict_fits(free, longer),
        }
    else:
        assert isinstance(case.plain, Oscillator)
        one = respond_oscillator(case.ours, ground)
        checks = {
            "jumps": not oscillator_jumps(one, ground),
            "energy": oscillator_rise(case.plain, one, ground) <= _ROUND_OFF,
            "verdict": collapse_fits(
                one, respond_oscillator(case.ours, ground, free_vibration=_LONGER)
            ),
        }
    return [name for name, holds in checks.items() if not holds]


def impacts_follow(response: Response) -> bool:
    """Return True if impacts follow the uplift and each other."""
    times = response.impact_times
    after = not times.size or response.uplift_time < times[0]
    return bool(after and np.all(np.diff(times) > 0.0))


def _in_intervals(response: Response) -> NDArray[np.intp]:
    """Return the number of the interval of each impact; those after the motion are left out."""
    during = response.impact_times[response.impact_times <= response.time[-1]]
    place: NDArray[np.intp] = np.searchsorted(response.time, during) - 1
    return place


def jumps(plain: Rocker, response: Response, ground: GroundAcceleration) -> bool:
    """Return True if theta changes by more than the largest rate and acceleration allow."""
    step, place = ground.time_step, _in_intervals(response)
    strongest = GRAVITY + float(np.abs(ground.coefficients).max())
    if ground.vertical is not None:
        strongest += float(np.abs(ground.vertical).max())
    pull = strongest * math.hypot(plain.across, plain.upwards)
    for tie in plain.ties:
        largest = tie.prestress + tie.stiffness * tie.lever * math.sqrt(2.0)
        force = min(tie.highest, largest)
        pull += tie.joints * tie.lever * force / plain.mass
    pull /= plain.inertia
    rates = np.abs(response.omega)
    fastest = np.maximum(rates[1:], rates[:-1])
    np.maximum.at(fastest, place, np.abs(response.impact_velocities[: place.size]))
    moved = np.abs(np.diff(response.theta))
    standing = np.isfinite(moved)
    return bool(np.any(moved[standing] > ((fastest + pull * step) * step)[standing]))


def rise(plain: Rocker, response: Response, ground: GroundAcceleration) -> float:
    """Return the largest rise of energy in an interval, over the largest energy [1]."""
    theta, own = response.theta, 0.5 * plain.inertia * response.omega**2
    size, side = np.abs(theta), np.sign(theta)
    sine, short = np.sin(size), 2.0 * np.sin(0.5 * size) ** 2  # 1 - cos without cancellation
    up = plain.across * sine - plain.upwards * short
    moved = side * (plain.upwards * sine + plain.across * short)
    scale = 1e-6 * GRAVITY * plain.across  # and all that is subtracted, because of round-off
    for tie, force in zip(plain.ties, _forces(response), strict=True):
        pulled = np.maximum(force, 0.0) if tie.cable else force
        stored = tie.joints * (pulled**2 - tie.prestress**2) / (2.0 * tie.stiffness)
        own = own + stored / plain.mass
        scale += tie.joints * float(np.nanmax(pulled**2)) / (2.0 * tie.stiffness * plain.mass)
    across = ground.coefficients[:, 0]
    weight = GRAVITY + (0.0 if ground.vertical is None else ground.vertical[:, 0])
    before = own[:-1] + weight * up[:-1] + across * moved[:-1]
    after = own[1:] + weight * up[1:] + across * moved[1:]
    place = _in_intervals(response)
    rates = response.impact_velocities[: place.size]
    lost = 0.5 * plain.inertia * (1.0 - plain.restitution**2) * rates**2
    np.subtract.at(before, place, lost)
    rises = (after - before)[np.isfinite(after)]
    scale += float(np.nanmax(np.abs(before)))
    return float(rises.max(initial=0.0)) / scale


def _forces(response: Response) -> list[Float]:
    """Return the forces of tendon and bars, of those that the frame has."""
    restraint = response.restraint
    if restraint is None:
        return []
    both = (restraint.tendon_force, restraint.dissipater_force)
    present = (response.frame.tendon, response.frame.dissipater)
    return [force for force, part in zip(both, present, strict=True) if part is not None]


def verdict_fits(response: Response, longer: Response) -> bool:
    """Return True if a longer history has the same verdict and peak, and shows the verdict."""
    standing = np.isfinite(longer.theta)
    peak = longer.peak_rotation
    falls = longer.verdict is Verdict.OVERTURNS
    ends = np.isfinite(longer.theta[-1]) != (falls and longer.overturning_time <= longer.time[-1])
    return bool(
        longer.verdict is response.verdict
        and math.isclose(peak, response.peak_rotation, rel_tol=1e-9)
        and falls == (peak >= 0.5 * math.pi)
        and (longer.verdict is Verdict.NO_UPLIFT) == (not longer.theta[standing].any())
        and np.abs(longer.theta[standing]).max() <= peak * (1.0 + 1e-12)
        and ends
    )


def oscillator_jumps(one: OscillatorResponse, ground: GroundAcceleration) -> bool:
    """Return True if u changes by more than the largest velocity and acceleration allow."""
    step, standing = ground.time_step, np.isfinite(one.u[1:])
    force = np.abs(one.force_ratio[np.isfinite(one.force_ratio)]).max()
    force = max(float(force), one.peak_force_ratio if one.peak_force_ratio > 0.0 else 0.0)
    pull = float(np.abs(ground.coefficients).max()) + GRAVITY * force
    fastest = np.maximum(np.abs(one.velocity[1:]), np.abs(one.velocity[:-1]))
    moved = np.abs(np.diff(one.u))
    return bool(np.any(moved[standing] > ((fastest + pull * step) * step)[standing]))


def oscillator_rise(
    plain: Oscillator, one: OscillatorResponse, ground: GroundAcceleration
) -> float:
    """Return the largest rise of energy beyond the work of the ground, over the largest energy."""
    stored = 0.5 * plain.k * one.u**2 + 0.5 * one.velocity**2
    if math.isfinite(plain.k_z):
        plastic = GRAVITY * one.force_ratio - plain.k * one.u - plain.c * one.velocity
        stored += 0.5 * plastic**2 / plain.k_z
    rises = np.diff(stored) + ground.coefficients[:, 0] * np.diff(one.u)
    rises = rises[np.isfinite(rises)]
    scale = 1e-6 + float(np.nanmax(np.abs(stored)))
    return float(rises.max(initial=0.0)) / scale


def collapse_fits(one: OscillatorResponse, longer: OscillatorResponse) -> bool:
    """Return True if a longer history has the same peak, and ends if it is infinite."""
    standing = np.isfinite(longer.u)
    return bool(
        (
            longer.peak_displacement == one.peak_displacement
            or math.isclose(longer.peak_displacement, one.peak_displacement, rel_tol=1e-9)
        )
        and np.abs(longer.u[standing]).max() <= longer.peak_displacement * (1.0 + 1e-12)
        and (math.isfinite(longer.peak_displacement) or not standing[-1])
        and (longer.yields > 0) == math.isfinite(longer.first_yield_time)
    )
