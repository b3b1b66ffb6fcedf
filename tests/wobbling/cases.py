"""Random frames with round columns, and random motions, that several tests use."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rockframe import (
    PairAcceleration,
    Pulse,
    RockingFrame,
    Tendon,
    hollow,
    inertia_ratio_of,
    tapered,
)
from rockframe.units import GRAVITY

Float = NDArray[np.float64]


def solid(height: float, width: float, mass_ratio: float = 0.0) -> RockingFrame:
    """Return a frame of solid cylinders."""
    inertia = inertia_ratio_of("circular", height, width)
    return RockingFrame(
        height=height, width=width, mass_ratio=mass_ratio, inertia_ratio=inertia, section="circular"
    )


def random_frame(rng: np.random.Generator) -> RockingFrame:
    """Return a frame of cylinders, solid or hollow, or of frustums, with or without a slab."""
    height, slenderness = rng.uniform(2.0, 12.0), rng.uniform(0.1, 0.3)
    width, mass_ratio = height * math.tan(slenderness), float(rng.choice([0.0, 0.3, 1.0, 6.0]))
    kind = rng.integers(3)
    if kind == 0:
        return solid(height, width, mass_ratio)
    top = float(width * rng.uniform(0.7, 1.0)) if kind == 1 else None
    shape = (
        tapered("circular", height, width, top)
        if top
        else hollow("circular", height, width, width * rng.uniform(0.3, 0.9))
    )
    return RockingFrame(
        height=height,
        width=width,
        mass_ratio=mass_ratio,
        inertia_ratio=shape.inertia_ratio,
        top_width=top,
        centre_of_gravity=shape.centre_of_gravity if top else None,
        section="circular",
    )


def random_motion(rng: np.random.Generator, frame: RockingFrame) -> PairAcceleration:
    """Return two Ricker pulses of strengths that make the frame rock, with a lag and an angle."""
    unit, seconds = GRAVITY * math.tan(frame.slenderness), frame.effective_frequency_parameter
    period = rng.uniform(1.0, 2.0, 2) / seconds
    lag = rng.uniform(-0.4, 0.4) * period[0]
    along, across = (
        Pulse(wavelet="symmetric_ricker", a_p=unit * strength, T_p=T_p, time=time)
        for strength, T_p, time in zip(
            rng.uniform([1.6, 0.5], [2.2, 1.2]), period, (0.0, lag), strict=True
        )
    )
    times = np.arange(-2.0 * period.max(), 6.0 / seconds, 0.005 / seconds)
    angle = math.radians(rng.uniform(40.0, 140.0))
    first, second = along.acceleration(times), across.acceleration(times)
    return PairAcceleration(
        first + math.cos(angle) * second, math.sin(angle) * second, 0.005 / seconds
    )


def with_tendon(frame: RockingFrame) -> RockingFrame:
    """Return the frame with stiff prestressed tendons: three quarters of its weight at alpha."""
    weight = 50e3 * GRAVITY * (1.0 + frame.mass_ratio)
    stiff = 0.5 * weight / (frame.tie_lever * frame.slenderness)
    tendon = Tendon(area=1e-3, modulus=stiff * frame.height / 1e-3, prestress=0.25 * weight)
    return replace(frame, column_mass=50e3, tendon=tendon)
