"""Random bents and motions that several tests use."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rockframe import GroundAcceleration, Pulse, UnequalBent
from rockframe.units import GRAVITY

Float = NDArray[np.float64]

BENT = UnequalBent(heights=(9.0, 7.0), widths=(1.4, 1.4), spacing=12.0, mass_ratio=3.6)


def random_bent(rng: np.random.Generator, **changes: Any) -> UnequalBent:
    """Return a bent whose columns differ by up to a half in height and a fifth in width."""
    heights = rng.uniform(4.0, 12.0) * np.array([1.0, rng.uniform(0.5, 1.0)])
    widths = heights.mean() * rng.uniform(0.1, 0.3) * rng.uniform(0.8, 1.2, 2)
    bent = UnequalBent(
        heights=tuple(rng.permutation(heights).tolist()),
        widths=tuple(widths.tolist()),
        spacing=float(widths.mean() + rng.uniform(0.5, 2.0) * heights.mean()),
        mass_ratio=float(rng.choice([0.3, 1.0, 4.0])),
        beam_depth=float(rng.uniform(0.0, 2.0)),
        beam_offset=float(rng.uniform(-0.5, 0.5)),
    )
    return replace(bent, **changes)


def random_pulse(
    rng: np.random.Generator, bent: UnequalBent, strength: float
) -> GroundAcceleration:
    """Return a Ricker pulse, to the right or left, of a strength over the least that uplifts."""
    unit = GRAVITY * min(bent.uplift_accelerations)
    sign = float(rng.choice([-1.0, 1.0]))
    pulse = Pulse(wavelet="symmetric_ricker", a_p=strength * unit, T_p=rng.uniform(0.8, 1.6))
    return GroundAcceleration.from_pulse(pulse).scaled(sign)


def rough_motion(rng: np.random.Generator, samples: int = 1500) -> GroundAcceleration:
    """Return a sum of harmonics from 0.3 to 3 Hz within an envelope, 10 ms apart."""
    time = 0.01 * np.arange(samples)
    frequency, phase = rng.uniform(0.3, 3.0, 12), rng.uniform(0.0, 2.0 * np.pi, 12)
    waves = np.sin(2.0 * np.pi * frequency[:, None] * time + phase[:, None]).sum(axis=0)
    envelope = np.exp(-((time / time[-1] - 0.4) ** 2) / 0.06)
    return GroundAcceleration.from_samples(waves * envelope, 0.01)


def mirrored(bent: UnequalBent) -> UnequalBent:
    """Return the bent as seen from behind."""
    masses = bent.column_masses
    return replace(
        bent,
        heights=bent.heights[::-1],
        widths=bent.widths[::-1],
        beam_offset=-bent.beam_offset,
        column_masses=None if masses is None else masses[::-1],
    )
