"""Pulses of every wavelet as ground motion: exact between the nodes, with nodes at the kinks."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rockframe.frame import RockingFrame
from rockframe.rocking import GroundAcceleration, respond
from rockframe.wavelets.pulse import Pulse

SHAPES = [
    ("symmetric_ricker", math.pi, None),
    ("antisymmetric_ricker", 0.0, None),
    ("ricker_any_phase", 2.5, None),
    ("mavroeidis_papageorgiou", 0.9, 1.0),
    ("mavroeidis_papageorgiou", 0.0, 1.37),
    ("mavroeidis_papageorgiou", 4.0, 3.0),
]


@pytest.mark.parametrize(("name", "phase", "half_cycles"), SHAPES)
def test_a_pulse_is_met_between_the_nodes(
    name: str, phase: float, half_cycles: float | None
) -> None:
    pulse = Pulse(wavelet=name, a_p=4.0, T_p=1.3, time=0.2, phase=phase, half_cycles=half_cycles)
    motion = GroundAcceleration.from_pulse(pulse)
    for share in (0.03, 0.37, 0.81):
        inside = motion.time_step * share
        values = motion.coefficients @ inside ** np.arange(motion.coefficients.shape[1])
        exact = pulse.acceleration(motion.time[:-1] + inside)
        np.testing.assert_allclose(values, exact, rtol=0, atol=1e-11)
    assert abs(float(pulse.velocity(motion.time[0]))) < 1e-13
    assert abs(float(pulse.velocity(motion.time[-1]))) < 1e-13


def test_the_ends_of_a_finite_pulse_are_nodes() -> None:
    pulse = Pulse(wavelet="mavroeidis_papageorgiou", a_p=4.0, T_p=1.3, phase=1.0, half_cycles=1.37)
    motion = GroundAcceleration.from_pulse(pulse)
    assert motion.time[0] == pytest.approx(-0.5 * 1.37 * 1.3, rel=1e-15)
    assert motion.time[-1] == pytest.approx(0.5 * 1.37 * 1.3, rel=1e-14)


def test_a_frame_under_a_pulse_and_under_its_samples() -> None:
    """Dense samples of a pulse give the same response as the pulse."""
    pulse = Pulse(wavelet="mavroeidis_papageorgiou", a_p=4.0, T_p=1.3, phase=1.0, half_cycles=1.37)
    frame = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    motion = GroundAcceleration.from_pulse(pulse)
    time = np.linspace(motion.time[0], motion.time[-1], 20_001)
    samples = GroundAcceleration.from_samples(pulse.acceleration(time), time[1] - time[0], time[0])
    sampled = respond(frame, samples).peak_rotation_ratio
    assert respond(frame, pulse).peak_rotation_ratio == pytest.approx(sampled, rel=1e-6)
