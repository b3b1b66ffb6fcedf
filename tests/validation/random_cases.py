"""Random structures and motions of each kind, for the package and for the plain integrator.

Only numbers are shared: dimensions, masses, forces and samples. The plain structures are computed
here from the geometry, with the moments of tapered columns by quadrature.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import quad
from tests.validation.plain import GRAVITY, Oscillator, Rocker, Tie

from rockframe.frame import RockingFrame, crushed
from rockframe.parts import Abutment, Dissipater, Pivot, Tendon, tapered
from rockframe.rivals import FixedFrame, IsolatedDeck

Float: TypeAlias = NDArray[np.float64]

KINDS: Final = (
    *("free", "tapered", "tendons", "dissipaters", "crushed", "vertical", "abutment"),
    *("isolated", "fixed"),
)
_MASS: Final = 5e4
#: Share of gravity that is left when the ground moves upwards and downwards most.
_LIFT: Final = 0.4


@dataclass(frozen=True, eq=False)
class Case:
    """A structure as the package and as the plain integrator take it, and its motion [m s-2]."""

    ours: RockingFrame | IsolatedDeck | FixedFrame
    plain: Rocker | Oscillator
    time_step: float
    across: Float
    upwards: Float | None = None


def case_of(kind: str, seed: int) -> Case:
    """Return a random case of a kind; the same seed returns the same case."""
    rng = np.random.default_rng([KINDS.index(kind), seed])
    if kind in ("isolated", "fixed"):
        one, spring, strength = _oscillator(kind, rng)
        step, shape = _shape(rng)
        return Case(one, spring, step, rng.uniform(1.0, 4.0) * strength * shape)
    ours, plain = _frame(kind, rng)
    closed = sum(tie.joints * tie.lever * tie.prestress for tie in plain.ties)
    strength = (GRAVITY * plain.across + closed / _MASS) / plain.upwards
    step, shape = _shape(rng)
    across = rng.uniform(1.0, 4.0) * strength * shape
    upwards = None
    if kind == "vertical":
        upwards = _LIFT * GRAVITY * rng.uniform(-1.0, 1.0, shape.size) * (shape != 0.0)
    return Case(ours, plain, step, across, upwards)


def _shape(rng: np.random.Generator) -> tuple[float, Float]:
    """Return the time step [s] and samples of up to 1: rough, smooth, or a pulse."""
    count, kind = 100, rng.integers(3)
    if kind == 0:
        step, shape = rng.uniform(0.04, 0.15), rng.uniform(-1.0, 1.0, count)
    elif kind == 1:
        step = 0.04
        shape = np.convolve(rng.normal(size=count), np.hanning(rng.integers(5, 30)), "same")
    else:
        step = 0.04
        phase = (step * np.arange(count) - 2.0) / rng.uniform(0.3, 1.5) * math.pi
        shape = (1.0 - 2.0 * phase**2) * np.exp(-(phase**2))
    shape = shape / np.abs(shape).max()
    shape[-2:] = 0.0
    return float(step), shape


def _frame(kind: str, rng: np.random.Generator) -> tuple[RockingFrame, Rocker]:
    height = rng.uniform(2.0, 12.0)
    frame = RockingFrame(
        height=height,
        width=rng.uniform(0.07, 0.3) * height,
        mass_ratio=rng.choice([0.0, rng.uniform(0.1, 8.0)]),
        restitution_factor=rng.uniform(0.85, 1.0),
        column_mass=_MASS,
    )
    gyration = (height**2 + frame.width**2) / 12.0
    plain = _body(frame, height, frame.width, frame.width, 0.5 * height, gyration)
    if kind == "tapered":
        return _tapered(frame, rng)
    if kind == "tendons" or (kind in ("dissipaters", "crushed") and rng.random() < 0.4):
        frame, plain = _tied(frame, plain, rng)
    if kind == "dissipaters":
        frame, plain = _with_bars(frame, plain, rng)
    if kind == "crushed":
        return _crushed(frame, plain, rng)
    if kind == "abutment":
        gap, allowance = rng.uniform(0.02, 0.4) * frame.width, rng.uniform(0.001, 0.02) * height
        frame = replace(frame, abutment=Abutment(gap=gap, uplift_allowance=allowance))
        plain = replace(plain, gap=gap, allowance=allowance)
    return frame, plain


def _body(
    frame: RockingFrame, height: float, base: float, top: float, centre: float, gyration: float
) -> Rocker:
    """Return the plain structure, from its squared radius of gyration about the centre [m2]."""
    gamma, half, reach = frame.mass_ratio, 0.5 * base, 0.5 * (base + top)
    about_corner = gyration + centre**2 + half**2
    inertia = about_corner + gamma * (reach**2 + height**2)
    # angular momentum about the other corner, before the impact, over that after it
    kept = about_corner - 2.0 * half**2 + gamma * (height**2 - reach**2)
    return Rocker(
        across=float(half + gamma * reach),
        upwards=float(centre + gamma * height),
        inertia=float(inertia),
        restitution=float(frame.restitution_factor * kept / inertia),
        mass=_MASS,
        reach=reach,
        height=height,
    )


def _tapered(frame: RockingFrame, rng: np.random.Generator) -> tuple[RockingFrame, Rocker]:
    section = str(rng.choice(["rectangular", "circular"]))
    height, base, top = frame.height, frame.width, rng.uniform(0.4, 1.3) * frame.width
    shape = tapered(section, height, base, top)
    power, share = (1, 12.0) if section == "rectangular" else (2, 16.0)

    def moment(order: int, more: int = 0) -> float:
        def weight(z: float) -> float:
            return float((base + (top - base) * z / height) ** (power + more) * z**order)

        return float(quad(weight, 0.0, height, epsabs=0.0, epsrel=1e-13)[0])

    area = moment(0)
    centre = moment(1) / area
    gyration = moment(2) / area - centre**2 + moment(0, 2) / area / share
    ours = replace(
        frame,
        top_width=top,
        centre_of_gravity=shape.centre_of_gravity,
        inertia_ratio=shape.inertia_ratio,
    )
    return ours, _body(frame, height, base, top, centre, gyration)


def _gravity(plain: Rocker) -> float:
    """Return the moment of gravity of an upright column with its beam [N m]."""
    return _MASS * GRAVITY * plain.across


def _tied(
    frame: RockingFrame, plain: Rocker, rng: np.random.Generator
) -> tuple[RockingFrame, Rocker]:
    lever = plain.reach if frame.mass_ratio > 0.0 else 0.5 * frame.width
    unit = _gravity(plain) / lever
    prestress = float(rng.choice([0.0, rng.uniform(0.0, 0.4)])) * unit
    highest = prestress + rng.uniform(0.05, 1.0) * unit
    stiffness = rng.uniform(0.1, 2.0) * unit / lever / plain.slenderness
    area, loses = stiffness * frame.height / 2e11, bool(rng.random() < 0.5)
    tendon = Tendon(
        area=area,
        modulus=2e11,
        prestress=prestress,
        yield_stress=highest / area,
        loses_prestress=loses,
    )
    tie = Tie(lever, stiffness, prestress, highest if loses else math.inf, cable=loses)
    return replace(frame, tendon=tendon), replace(plain, ties=(*plain.ties, tie))


def _with_bars(
    frame: RockingFrame, plain: Rocker, rng: np.random.Generator
) -> tuple[RockingFrame, Rocker]:
    joints, lever = (2.0 if frame.mass_ratio > 0.0 else 1.0), 0.5 * frame.width
    unit = _gravity(plain) / lever / joints
    share = rng.uniform(1.0, 2.5) if rng.random() < 0.3 else rng.uniform(0.05, 0.9)
    strength, stiffness = share * unit, rng.uniform(0.5, 12.0) * unit / lever / plain.slenderness
    bars = Dissipater(stiffness=stiffness, yield_force=strength, lever_arm=lever)
    tie = Tie(lever, stiffness, 0.0, strength, -strength, joints)
    return replace(frame, dissipater=bars), replace(plain, ties=(*plain.ties, tie))


def _crushed(
    frame: RockingFrame, plain: Rocker, rng: np.random.Generator
) -> tuple[RockingFrame, Rocker]:
    """Move the corners inwards by half the block that carries weight and tendon, by iteration."""
    load = (1.0 + frame.mass_ratio) * _MASS * GRAVITY
    tendon = plain.ties[0] if plain.ties else None
    most = load if tendon is None else load + 3.0 * _gravity(plain) / tendon.lever
    pivot = Pivot(compressive_strength=most / frame.width / rng.uniform(0.05, 0.3), depth=1.0)
    base = top = frame.width
    body, tension = plain, 0.0
    for _ in range(100):
        stress = pivot.compressive_strength * pivot.depth
        base = frame.width - (load + tension) / stress
        top = frame.width - (frame.mass_ratio * _MASS * GRAVITY + tension) / stress
        gyration = (frame.width**2 + frame.height**2) / 12.0
        body = _body(frame, frame.height, base, top, 0.5 * frame.height, gyration)
        if tendon is not None:
            lever = body.reach if frame.mass_ratio > 0.0 else 0.5 * base
            stretch = 2.0 * lever * math.sin(0.5 * body.slenderness)
            tension = min(tendon.prestress + tendon.stiffness * stretch, tendon.highest)
            body = replace(body, ties=(replace(tendon, lever=lever),))
    return crushed(frame, pivot), body


def _oscillator(
    kind: str, rng: np.random.Generator
) -> tuple[IsolatedDeck | FixedFrame, Oscillator, float]:
    strength = rng.uniform(0.02, 0.2)
    damping, force = float(rng.choice([0.0, rng.uniform(0.0, 0.1)])), strength * GRAVITY
    if kind == "isolated" and rng.random() < 0.5:
        radius = rng.uniform(1.0, 4.0)
        k = GRAVITY / radius
        pendulum = IsolatedDeck.friction_pendulum(
            radius=radius, friction=strength, damping_ratio=damping
        )
        return pendulum, Oscillator(k, math.inf, force, 2.0 * damping * math.sqrt(k)), 2.0 * force
    if kind == "isolated":
        period, first = rng.uniform(1.5, 4.0), rng.uniform(0.003, 0.03)
        rate = 2.0 * math.pi / period
        rubber = IsolatedDeck.lead_rubber(
            strength_ratio=strength, period=period, yield_displacement=first, damping_ratio=damping
        )
        return rubber, Oscillator(rate**2, force / first, force, 2.0 * damping * rate), 2.0 * force
    period = rng.uniform(0.2, 1.5)
    rate, after = 2.0 * math.pi / period, rng.uniform(0.0, 0.1)
    weight = float(rng.choice([0.0, rng.uniform(0.0, 0.15)]))
    frame = FixedFrame(
        period=period,
        strength_ratio=strength,
        damping_ratio=damping,
        post_yield_ratio=after,
        stability_coefficient=weight,
    )
    plain = Oscillator(
        (after - weight) * rate**2,
        (1.0 - after) * rate**2,
        (1.0 - after) * force,
        2.0 * damping * rate,
    )
    return frame, plain, force
