"""Identities under any motion: energy, symmetry, scaling, batches, division of intervals."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.oscillators.direct import direct

from rockframe import (
    FixedFrame,
    GroundAcceleration,
    IsolatedDeck,
    OscillatorPeaks,
    OscillatorResponse,
    Pulse,
    read_file,
    respond_oscillator,
    respond_oscillators,
)
from rockframe.units import GRAVITY

RUBBER = IsolatedDeck.lead_rubber(strength_ratio=0.05, period=2.5)
PENDULUM = IsolatedDeck.friction_pendulum(radius=2.0, friction=0.06)
YIELDING = FixedFrame(period=0.4, strength_ratio=0.15, post_yield_ratio=0.05)
PERFECT = FixedFrame(period=0.3, strength_ratio=0.2, damping_ratio=0.0)
SOFTENING = FixedFrame(period=0.6, strength_ratio=0.1, stability_coefficient=0.003)
MODELS: tuple[IsolatedDeck | FixedFrame, ...] = (
    RUBBER,
    replace(RUBBER, damping_ratio=0.1),
    PENDULUM,
    YIELDING,
    PERFECT,
    SOFTENING,
)
#: Its largest force precedes its largest displacement.
DAMPED = FixedFrame(period=0.5, damping_ratio=0.3)
PEAKS = tuple(OscillatorPeaks.__dataclass_fields__)
each_model = pytest.mark.parametrize("model", MODELS, ids=lambda model: f"{model.period:.2f}")


def rough(seed: int, samples: int = 150, step: float = 0.05) -> GroundAcceleration:
    noise = np.random.default_rng(seed).uniform(-0.5, 0.5, samples)
    return GroundAcceleration.from_samples(GRAVITY * noise, step)


#: Under it a damped isolator has its largest force between two nodes.
SWELL = GroundAcceleration.from_function(
    lambda t: np.sin(0.8 * 6.28 * t) + 0.3 * np.sin(1.7 * 6.28 * t),
    *(0.0, 2.0),
    intervals=40,
    degree=5,
)


#: In its short steps the largest force and the largest displacement are far apart.
SMOOTH = GroundAcceleration.from_samples(np.sin(0.04 * np.arange(300)), 0.005)


def divided(motion: GroundAcceleration, parts: int) -> GroundAcceleration:
    """Return the same straight lines in shorter intervals."""
    first, slope = np.repeat(motion.coefficients, parts, axis=0).T
    step = motion.time_step / parts
    within = np.tile(step * np.arange(parts), motion.coefficients.shape[0])
    return GroundAcceleration(np.column_stack([first + slope * within, slope]), step)


def assert_same(first: OscillatorResponse, other: OscillatorResponse, tolerance: float) -> None:
    for name in PEAKS:
        at = 1e-6 if name == "peak_time" else tolerance  # where a peak is flat
        np.testing.assert_allclose(getattr(first, name), getattr(other, name), rtol=at, atol=at)


def test_ground_that_jumps_at_nodes() -> None:
    """Peaks are found also if the ground acceleration jumps at nodes."""
    frame = FixedFrame(period=1.0, damping_ratio=0.0)
    for seed in (14, 57, 71):
        lines = np.random.default_rng(seed).uniform(-3.0, 3.0, (60, 2))
        lines[:, 1] = (0.2 * lines[:, 1] - lines[:, 0]) / 0.1  # ends at 0.2 of the second number
        motion = GroundAcceleration(lines, 0.1)
        coarse, fine = (
            respond_oscillator(frame, ground) for ground in (motion, divided(motion, 32))
        )
        assert_same(coarse, fine, 1e-10)


@each_model
@pytest.mark.parametrize(("seed", "step"), [(1, 0.01), (2, 0.1), (3, 0.3)])
def test_another_solver_finds_the_same(
    model: IsolatedDeck | FixedFrame, seed: int, step: float
) -> None:
    """DOP853 with events agrees, for time steps from a hundredth of the period to all of it."""
    motion = rough(seed, 60, step).followed_by_rest(1.0)
    ours, theirs = respond_oscillator(model, motion), direct(model, motion)
    np.testing.assert_allclose(ours.u, theirs.u, atol=1e-11 * np.abs(theirs.u).max())
    scale = np.abs(theirs.velocity).max()
    np.testing.assert_allclose(ours.velocity, theirs.velocity, atol=1e-11 * scale)
    assert ours.first_yield_time == pytest.approx(theirs.first_yield, rel=1e-12)
    assert ours.yields >= theirs.yields > 0


@pytest.mark.parametrize("model", [RUBBER, PENDULUM, YIELDING], ids=lambda m: f"{m.period:.2f}")
def test_another_solver_finds_the_same_of_a_record(
    bundled_records: Path, model: IsolatedDeck | FixedFrame
) -> None:
    record = next(r for r in read_file(bundled_records / "Ridgecrest2019-CLC.V1"))
    top = int(np.abs(record.acceleration).argmax())
    window = record.acceleration[top - 100 : top + 150]
    motion = GroundAcceleration.from_samples(window, record.time_step)
    ours, theirs = respond_oscillator(model, motion), direct(model, motion)
    np.testing.assert_allclose(ours.u, theirs.u, atol=1e-11 * np.abs(theirs.u).max())
    assert ours.yields >= theirs.yields > 0


@each_model
def test_the_division_of_intervals_does_not_matter(model: IsolatedDeck | FixedFrame) -> None:
    """In shorter intervals another part of the kernel finds peaks and changes of branch."""
    motion = rough(4)
    ours, other = (respond_oscillator(model, m) for m in (motion, divided(motion, 16)))
    np.testing.assert_allclose(ours.u, other.u[::16], atol=1e-12)
    assert_same(ours, other, 1e-11)
    assert ours.peak_displacement >= np.abs(other.u).max() * (1.0 - 1e-14)
    assert ours.peak_force_ratio >= np.abs(other.force_ratio).max() * (1.0 - 1e-14)


@pytest.mark.parametrize(
    ("damping", "step", "intervals", "slow", "fast"),
    [(0.0, 0.19, 61, 5.8, 7.3), (0.2, 0.13, 19, 12.9, 6.6)],
)
def test_no_peak_is_excluded_by_a_bound(
    damping: float, step: float, intervals: int, slow: float, fast: float
) -> None:
    """They exclude peaks from most intervals, and are others in intervals an eighth as long."""
    frame = FixedFrame(period=1.0, damping_ratio=damping)
    coarse, fine = (
        respond_oscillator(
            frame,
            GroundAcceleration.from_function(
                lambda t: 3.0 * np.sin(slow * t) + np.sin(fast * t + 1.0),
                *(0.0, step * intervals),
                intervals=parts * intervals,
                degree=5,
            ),
        )
        for parts in (1, 8)
    )
    assert coarse.peak_displacement == pytest.approx(fine.peak_displacement, rel=2e-5)
    assert coarse.peak_force_ratio == pytest.approx(fine.peak_force_ratio, rel=2e-5)


@pytest.mark.parametrize("dip", [0.01, 0.03, 0.05])
def test_no_reversal_is_excluded_by_a_bound(dip: float) -> None:
    """A frame that softens moves outwards at both ends of an interval, but inwards in the middle.

    Without the reversal it would keep yielding, at a rate v with v'' = r^2 v + G: a hyperbolic
    cosine that dips below zero, in this very long interval, by a small share of G / r^2.
    """
    frame = replace(SOFTENING, stability_coefficient=0.3, damping_ratio=0.0)
    k, _, q, _ = frame.constants
    rate = math.sqrt(-k)
    half = 0.6 / rate
    push = np.array([-0.3 * GRAVITY, 0.0])
    begun = respond_oscillator(frame, GroundAcceleration(push[None], 2.0 * half))
    u, v = begun.u[-1], begun.velocity[-1]
    fall = -k * v / ((1.0 - dip) * math.cosh(0.6) - 1.0)
    first = (1.0 - dip) * fall / rate * math.sinh(0.6) - (q + k * u)
    motion = GroundAcceleration(np.array([push, [first, -fall]]), 2.0 * half)
    response, other = (
        respond_oscillator(frame, ground) for ground in (motion, divided(motion, 32))
    )
    assert response.velocity[2] * v > 0.0 > other.velocity.min()
    assert response.u[2] == pytest.approx(other.u[64], rel=1e-12)


@pytest.mark.parametrize("model", MODELS[:-1], ids=lambda model: f"{model.period:.2f}")
@pytest.mark.parametrize("seed", [14, 15, 16])
def test_the_peak_force_is_that_of_the_spring(model: IsolatedDeck | FixedFrame, seed: int) -> None:
    """Without damping it is (q + k u) / m at the largest u; and always the most of the history."""
    undamped = replace(model, damping_ratio=0.0)
    k, _, q, _ = undamped.constants
    response = respond_oscillator(undamped, rough(seed))
    bound = (q + k * response.peak_displacement) / GRAVITY
    assert response.yields > 0
    assert response.peak_force_ratio == pytest.approx(bound, rel=1e-12)
    fine = divided(rough(seed), 64).followed_by_rest(10.0)
    other = respond_oscillator(model, fine)
    reached = np.abs(other.force_ratio).max()
    assert reached * (1.0 - 1e-14) <= other.peak_force_ratio <= reached * (1.0 + 1e-3)


def test_a_pendulum_that_the_first_ground_moves_bears_its_friction() -> None:
    """Friction limits the force also at the first node, where the ground already exceeds it."""
    push = GroundAcceleration(np.full((10, 1), 0.5 * GRAVITY), 0.01)
    response = respond_oscillator(PENDULUM, push)
    assert response.force_ratio[0] == pytest.approx(-0.06, rel=1e-14)
    assert response.peak_force_ratio >= np.abs(response.force_ratio).max()


@pytest.mark.parametrize("strength", [-0.5, 0.5])
def test_a_pendulum_that_a_fading_push_moves_slides_at_once(strength: float) -> None:
    """Within the interval the ground acceleration falls from far above the friction to nothing."""
    push = GroundAcceleration(strength * GRAVITY * np.array([[1.0, -10.0], [0.0, 0.0]]), 0.1)
    response = respond_oscillator(PENDULUM, push)
    assert response.first_yield_time == 0.0
    assert strength * response.u[1] < 0.0


@pytest.mark.parametrize("strength", [-0.5, 0.5])
def test_a_pendulum_that_a_push_held_slides_back_when_it_ends(strength: float) -> None:
    """It sticks beside its centre, where the friction alone could not hold it."""
    push = GroundAcceleration(strength * GRAVITY * np.array([[1.0, 0.0]] * 400), 0.1)
    response = respond_oscillator(PENDULUM, push)
    stiffness, _, friction, _ = PENDULUM.constants
    assert abs(response.velocity[-1]) < 1e-12
    assert abs(stiffness * response.u[-1]) > 1.5 * friction
    assert abs(stiffness * response.residual_displacement) <= friction


@pytest.mark.parametrize("model", [RUBBER, PENDULUM, PERFECT], ids=lambda m: f"{m.period:.2f}")
def test_energy_balance(model: IsolatedDeck | FixedFrame) -> None:
    """The work of constant ground acceleration in an interval is exactly -a (u_2 - u_1)."""
    noise = GRAVITY * np.random.default_rng(5).uniform(-0.5, 0.5, (400, 1))
    response = respond_oscillator(model, GroundAcceleration(noise, 0.05), free_vibration=600.0)
    work = -np.sum(noise[:, 0] * np.diff(response.u[:401]))
    k, k_z, _, _ = model.constants
    u, v = response.u[-1], response.velocity[-1]
    z = GRAVITY * response.force_ratio[-1] - k * u
    stored = 0.5 * v**2 + 0.5 * k * u**2 + 0.5 * z**2 / k_z
    lost = GRAVITY * response.dissipated_energy
    assert response.yields > 20
    assert lost > 0.9 * work
    assert stored + lost == pytest.approx(work, rel=1e-12)


@pytest.mark.parametrize("model", [*MODELS, DAMPED], ids=lambda model: f"{model.period:.2f}")
@pytest.mark.parametrize("motion", [rough(6), SWELL, SMOOTH], ids=["straight", "curved", "fine"])
def test_the_other_direction_is_the_mirror_image(
    model: IsolatedDeck | FixedFrame, motion: GroundAcceleration
) -> None:
    response, other = (
        respond_oscillator(model, motion),
        respond_oscillator(model, motion.scaled(-1.0)),
    )
    np.testing.assert_array_equal(response.u, -other.u)
    assert response.residual_displacement == -other.residual_displacement
    for name in {*PEAKS} - {"residual_displacement"}:
        np.testing.assert_equal(getattr(response, name), getattr(other, name))


def test_a_reversed_motion_collapses_as_the_motion_does() -> None:
    """Under gravity, on both sides of the scale at which the bridge collapses."""
    scales = np.linspace(0.4, 1.6, 7)
    weak = replace(SOFTENING, stability_coefficient=0.1)
    peaks_of_all = respond_oscillators([weak], [rough(6, 40)], [*scales, *-scales])
    (peaks,) = peaks_of_all.peak_displacement
    np.testing.assert_array_equal(peaks[0, :7], peaks[0, 7:])
    assert np.isinf(peaks[0, :7]).sum() == 4


def test_motion_and_strength_scale_together() -> None:
    """Three times the motion, strength and yield displacement give three times the response."""
    motion = rough(7)
    strong = replace(RUBBER, strength_ratio=0.15, yield_displacement=0.03)
    response, three = (
        respond_oscillator(RUBBER, motion),
        respond_oscillator(strong, motion.scaled(3.0)),
    )
    np.testing.assert_allclose(3.0 * response.u, three.u, atol=1e-12)
    assert three.ductility == pytest.approx(response.ductility, rel=1e-12)
    assert three.dissipated_energy == pytest.approx(9.0 * response.dissipated_energy, rel=1e-11)


def test_an_infinite_strength_is_elastic() -> None:
    motion = rough(8)
    elastic = respond_oscillator(FixedFrame(period=0.4), motion)
    strong = respond_oscillator(FixedFrame(period=0.4, strength_ratio=100.0), motion)
    np.testing.assert_allclose(strong.u, elastic.u, atol=1e-14)
    assert (strong.yields, elastic.yields) == (0, 0)
    assert np.isnan(elastic.ductility)
    assert elastic.residual_displacement == 0.0
    assert abs(strong.residual_displacement) < 1e-15


def test_company_does_not_change_a_bit() -> None:
    pulse = Pulse(wavelet="symmetric_ricker", a_p=0.6 * GRAVITY, T_p=1.2)
    motions = [rough(10), GroundAcceleration.from_pulse(pulse), rough(11)]
    many = respond_oscillators(MODELS, motions, [0.7, -1.0, 1.0])
    for m, motion in enumerate(motions):
        for n, model in enumerate(MODELS):
            single = respond_oscillator(model, motion)
            for name in PEAKS:
                np.testing.assert_array_equal(getattr(many, name)[m, n, 2], getattr(single, name))


def test_free_vibration_goes_on_to_what_was_foretold() -> None:
    """Peaks and residual displacement are already known at the end of the motion."""
    motion = rough(12, samples=20)
    for model in MODELS:
        short = respond_oscillator(model, motion)
        long = respond_oscillator(model, motion, free_vibration=100.0)
        assert_same(short, long, 1e-10)
        rest = GRAVITY * long.force_ratio[-1], long.u[-1] - long.residual_displacement
        if model.damping_ratio and model.yield_displacement:
            np.testing.assert_allclose(rest, 0.0, atol=1e-6)


def test_vibration_that_just_reaches_the_strength_in_each_cycle() -> None:
    """On still ground an undamped elastic-plastic frame reaches +q and -q hundreds of times."""
    blow = GroundAcceleration.from_samples([0.0, 2.0, -1.0, *[0.0] * 400], 0.07)
    frame = FixedFrame(period=0.017, strength_ratio=0.006, damping_ratio=0.0)
    response, other = (respond_oscillator(frame, motion) for motion in (blow, divided(blow, 3)))
    np.testing.assert_allclose(response.u, other.u[::3], atol=1e-9 * response.peak_displacement)
    assert response.residual_displacement == pytest.approx(other.residual_displacement, rel=1e-9)
    moved = np.abs(response.u[100:] - response.residual_displacement).max()
    assert moved <= frame.yield_displacement * (1.0 + 1e-6)


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("period", [0.05, 0.4, 1.3])
def test_a_frame_that_stops_just_at_its_strength_goes_on(period: float, side: float) -> None:
    """Under a ramp an undamped frame stops after each period; after the second, at its strength."""
    frame = FixedFrame(
        period=period, strength_ratio=0.006, post_yield_ratio=0.05, damping_ratio=0.0
    )
    samples = 2.0 * 0.006 * GRAVITY * side * np.array([0.0, -1.0, 1.0, 1.0, 0.0, 0.0])
    motion = GroundAcceleration.from_samples(samples, 4.0 * period)
    ours, theirs = respond_oscillator(frame, motion), direct(frame, motion)
    np.testing.assert_allclose(ours.u, theirs.u, atol=1e-11 * np.abs(theirs.u).max())
    assert ours.first_yield_time == pytest.approx(2.0 * period, rel=1e-4)  # it stops slowly
