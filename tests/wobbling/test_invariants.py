"""Identities that hold exactly for columns that roll, over random columns, frames and motions."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import brentq

from rockframe import (
    GroundAcceleration,
    PairAcceleration,
    Pulse,
    RockingFrame,
    Verdict,
    respond,
    wobble,
)
from rockframe.units import GRAVITY
from rockframe.wobbling.response import axial_inertia

from .cases import Float, random_frame, random_motion, with_tendon

seeds = pytest.mark.parametrize("seed", range(12))


def energy_and_momentum(frame: RockingFrame, theta: Float, rates: tuple[Float, Float]) -> Float:
    """Return energy and p = B phi' per mass of a column, from displacements and angular rates."""
    gamma, b, z = frame.mass_ratio, 0.5 * frame.width, frame.centre_height
    one, sine = 1.0 - np.cos(theta), np.sin(theta)
    transverse = (frame.inertia_ratio - 1.0) * frame.size**2
    u, v = frame.horizontal_displacement(theta), frame.vertical_displacement(theta)
    inertia = (b * one + z * sine) ** 2 + gamma * u**2 + transverse * sine**2
    inertia += axial_inertia(frame) * one**2
    along = b**2 + z**2 + transverse
    along += gamma * ((b + 0.5 * frame.top_contact_width) ** 2 + frame.height**2)
    potential = GRAVITY * (b * sine - z * one + gamma * v)
    kinetic = 0.5 * along * rates[0] ** 2 + 0.5 * inertia * rates[1] ** 2
    return np.array([kinetic + potential, inertia * rates[1]])


@seeds
def test_free_motion_without_loss_conserves_energy_and_momentum(seed: int) -> None:
    """Rolling does no work, and nothing turns the frame about the vertical: 10 s, to 1e-12."""
    rng = np.random.default_rng(seed)
    frame = random_frame(rng)
    alpha, p = frame.slenderness, frame.effective_frequency_parameter
    rates = rng.uniform(-1.0, 1.0, 2) * p
    start = (rng.uniform(0.1, 0.5) * alpha, 0.3 * alpha * rates[0], 0.3, rates[1])
    still = PairAcceleration(np.zeros(1001), np.zeros(1001), time_step=0.01)
    found = wobble(frame, still, contact_shortening=0.0, start=start)
    kept = energy_and_momentum(frame, found.theta, (found.theta_rate, found.phi_rate))
    assert found.verdict is Verdict.STANDS
    assert np.abs(kept / kept[:, :1] - 1.0).max() < 1e-12


@seeds
def test_turning_the_motion_turns_the_response(seed: int) -> None:
    """A round column has no preferred direction, whatever the contact loses."""
    rng = np.random.default_rng(seed)
    frame = random_frame(rng)
    motion, angle = random_motion(rng, frame), rng.uniform(0.0, 360.0)
    one, other = wobble(frame, motion), wobble(frame, motion.turned(angle))
    assert one.uplift_time > 0.0
    assert one.verdict is other.verdict
    assert_allclose(other.peak_rotation, one.peak_rotation, rtol=1e-9)
    deck = (one.u_x + 1j * one.u_y) * np.exp(1j * math.radians(angle))
    assert_allclose(other.u_x + 1j * other.u_y, deck, rtol=0.0, atol=1e-7 * frame.width)


@seeds
def test_mirrored_and_exchanged_components_give_the_same_bits(seed: int) -> None:
    """Signs change, and products of both components add up in either order."""
    rng = np.random.default_rng(seed)
    frame = random_frame(rng)
    motion = random_motion(rng, frame)
    found = wobble(frame, motion)
    mirrored = wobble(frame, replace(motion, y=-motion.y))
    exchanged = wobble(frame, replace(motion, x=motion.y, y=motion.x))
    for name in ("theta", "v"):
        assert np.array_equal(getattr(found, name), getattr(mirrored, name), equal_nan=True)
        assert np.array_equal(getattr(found, name), getattr(exchanged, name), equal_nan=True)
    assert np.array_equal(found.u_x, exchanged.u_y, equal_nan=True)
    assert np.array_equal(found.u_y, -mirrored.u_y, equal_nan=True)


@pytest.mark.parametrize("parts", ["free", "tendons", "vertical"])
@seeds
def test_motion_in_one_plane_with_the_loss_is_the_planar_frame(seed: int, parts: str) -> None:
    """Without precession a column passes upright exactly and loses L_0, which is eq (43)."""
    rng = np.random.default_rng(seed)
    frame = random_frame(rng)
    motion = random_motion(rng, frame)
    frame = with_tendon(frame) if parts == "tendons" else frame
    strength = 1.8 * frame.uplift_acceleration / np.abs(motion.x).max()
    motion = replace(motion, x=strength * motion.x, y=0.0 * motion.y)
    ground = GroundAcceleration.from_samples(motion.x, motion.time_step)
    if parts == "vertical":
        motion = replace(motion, z=-0.3 * motion.x)
        upwards = GroundAcceleration.from_samples(-0.3 * motion.x, motion.time_step)
        ground = ground.with_vertical(upwards)
    planar = respond(frame, ground)
    found = wobble(frame, motion, contact_shortening=10.0 ** rng.uniform(-6.0, -3.0))
    assert planar.impacts > 1
    assert found.verdict is planar.verdict
    assert_allclose(found.uplift_time, planar.uplift_time, rtol=1e-12)
    assert_allclose(found.peak_rotation, planar.peak_rotation, rtol=1e-6)
    assert np.nanmax(np.abs(found.u_x - planar.u)) < 1e-6 * frame.width
    assert not np.nan_to_num(found.u_y).any()


@seeds
def test_motion_in_one_plane_without_loss_is_the_planar_frame_of_restitution_one(seed: int) -> None:
    rng = np.random.default_rng(seed)
    frame = random_frame(rng)
    motion = random_motion(rng, frame)
    motion = replace(motion, x=1.8 * frame.uplift_acceleration / np.abs(motion.x).max() * motion.x)
    elastic = replace(frame, restitution_factor=(1.0 - 1e-14) / frame.restitution)
    planar = respond(elastic, GroundAcceleration.from_samples(motion.x, motion.time_step))
    found = wobble(frame, replace(motion, y=0.0 * motion.y), contact_shortening=0.0)
    assert found.verdict is planar.verdict
    assert_allclose(found.peak_rotation, planar.peak_rotation, rtol=1e-6)


@seeds
def test_larger_structures_repeat_the_motion_more_slowly(seed: int) -> None:
    """Lengths times s, times times sqrt(s), the same accelerations: the same angles."""
    rng = np.random.default_rng(seed)
    frame = random_frame(rng)
    motion, s = random_motion(rng, frame), rng.uniform(1.5, 5.0)
    larger = frame.resized(s * frame.height, s * frame.width)
    slower = replace(motion, time_step=math.sqrt(s) * motion.time_step)
    one = wobble(frame, motion, contact_shortening=1e-5)
    other = wobble(larger, slower, contact_shortening=s * 1e-5)
    assert one.verdict is other.verdict
    assert_allclose(other.peak_rotation, one.peak_rotation, rtol=1e-9)
    assert_allclose(other.uplift_time, math.sqrt(s) * one.uplift_time, rtol=1e-12)


@seeds
def test_the_start_does_not_matter(seed: int) -> None:
    """The series from rest, and tilts of 1e-7 and 1e-9 rad at uplift, lead to one peak."""
    rng = np.random.default_rng(seed)
    frame = random_frame(rng)
    unit, p = GRAVITY * math.tan(frame.slenderness), frame.effective_frequency_parameter
    pulses = [
        Pulse(wavelet="symmetric_ricker", a_p=size * unit, T_p=1.5 / p, time=time / p)
        for size, time in ((rng.uniform(1.3, 1.6), 0.0), (rng.uniform(0.6, 0.9), 0.3))
    ]

    def excess(time: float) -> float:
        return math.hypot(*(float(one.acceleration(np.array([time]))[0]) for one in pulses)) - unit

    before = max(t for t in np.linspace(-1.0, 0.0, 200) / p if excess(t) < 0.0)
    uplift = brentq(excess, before, before + 0.005 / p, xtol=1e-15) + 1e-12
    x, y = (one.acceleration(uplift + 0.005 / p * np.arange(1200)) for one in pulses)
    motion = PairAcceleration(x, y, 0.005 / p)
    away = math.atan2(-y[0], -x[0])
    peaks = [
        wobble(frame, motion, contact_shortening=0.0, start=(tilt, 0.0, away, 0.0)).peak_rotation
        for tilt in (0.0, 1e-9, 1e-7)
    ]
    assert peaks[0] > 0.02 * frame.slenderness
    assert_allclose(peaks[1:], peaks[0], rtol=0.0, atol=1e-6)
