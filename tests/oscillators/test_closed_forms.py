"""Limits with closed forms: elastic oscillators, sliding blocks, friction pendulums."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from rockframe import FixedFrame, GroundAcceleration, IsolatedDeck, respond_oscillator
from rockframe.units import GRAVITY

Float = NDArray[np.float64]
STEP = 0.01
PERIOD, DAMPING = 0.7, 0.05
RATE = math.tau / PERIOD
DAMPED = RATE * math.sqrt(1.0 - DAMPING**2)
ELASTIC = FixedFrame(period=PERIOD, damping_ratio=DAMPING)
HEIGHT, COLUMN, DECK, MODULUS = 30.0, 1e5, 1e6, 15e9
#: Two slender columns under a deck; their stiffness [N/m], moving mass [kg], and weight that leans.
TALL = partial(
    FixedFrame.from_columns, columns=2, height=HEIGHT, width=1.2, depth=1.2, modulus=MODULUS,
    column_mass=COLUMN, deck_mass=DECK,
)  # fmt: skip
STIFFNESS = 24.0 * MODULUS * (1.2**4 / 12.0) / HEIGHT**3
MOVING, LEANING = DECK + 26.0 / 35.0 * COLUMN, (DECK + COLUMN) * GRAVITY


def free(t: Float, u: float, v: float) -> Float:
    """Return the free vibration from a displacement and a velocity."""
    decay = np.exp(-DAMPING * RATE * t)
    sine = (v + DAMPING * RATE * u) / DAMPED
    return np.asarray(decay * (u * np.cos(DAMPED * t) + sine * np.sin(DAMPED * t)))


def test_a_suddenly_applied_acceleration() -> None:
    """The response, 1 minus a free vibration, overshoots by exp(-zeta pi / sqrt(1 - zeta^2))."""
    response = respond_oscillator(ELASTIC, GroundAcceleration(np.full((300, 1), 2.0), STEP))
    static = -2.0 / RATE**2
    np.testing.assert_allclose(response.u, static + free(response.time, -static, 0.0), atol=1e-14)
    over = math.exp(-DAMPING * math.pi / math.sqrt(1.0 - DAMPING**2))
    assert response.peak_displacement == pytest.approx(-static * (1.0 + over), rel=1e-13)
    assert response.peak_time == pytest.approx(math.pi / DAMPED, rel=1e-7)  # the peak is flat


def test_a_ramp() -> None:
    """The response is the quasi-static one, delayed by 2 zeta / w, plus a free vibration."""
    response = respond_oscillator(ELASTIC, GroundAcceleration.from_samples(np.arange(300.0), STEP))
    slope = -1.0 / STEP / RATE**2
    late = 2.0 * DAMPING / RATE
    right = slope * (response.time - late) + free(response.time, slope * late, -slope)
    np.testing.assert_allclose(response.u, right, rtol=1e-12, atol=1e-13)


def test_harmonic_ground() -> None:
    """The response is the steady state plus the free vibration that makes it start from rest."""
    drive = 1.7 * RATE
    ground = GroundAcceleration.from_function(
        lambda t: np.asarray(np.sin(drive * t)), 0.0, 3.0, intervals=600, degree=5
    )
    steady = -1.0 / (RATE**2 - drive**2 + 2j * DAMPING * RATE * drive)
    response = respond_oscillator(ELASTIC, ground)
    moving = np.imag(steady * np.exp(1j * drive * response.time))
    start = np.imag(steady), np.real(steady) * drive
    np.testing.assert_allclose(
        response.u, moving + free(response.time, -start[0], -start[1]), atol=1e-13
    )


def test_a_sliding_block_without_stiffness() -> None:
    """Newmark (1965): under A for a time t0 it slips V^2 / (2 q) (1 - q / A), V = A t0."""
    strong, friction, duration = 0.5 * GRAVITY, 0.1, 0.4
    block = IsolatedDeck.friction_pendulum(radius=1e12, friction=friction)
    rows = np.concatenate([np.full((40, 1), -strong), np.zeros((300, 1))])
    response = respond_oscillator(block, GroundAcceleration(rows, duration / 40))
    q = friction * GRAVITY
    slip = (strong * duration) ** 2 / (2.0 * q) * (1.0 - q / strong)
    assert response.residual_displacement == pytest.approx(slip, rel=1e-10)
    assert response.peak_time == pytest.approx(strong * duration / q, rel=1e-7)
    assert response.dissipated_energy == pytest.approx(friction * slip, rel=1e-10)
    assert response.yields == 1


def test_a_friction_pendulum_loses_twice_mu_radius_each_half_cycle() -> None:
    """It reverses at A - 2 mu R, A - 4 mu R, ..., and sticks at the first reversal within mu R."""
    radius, friction = 2.0, 0.01
    model = IsolatedDeck.friction_pendulum(radius=radius, friction=friction)
    push = GroundAcceleration(np.array([[-3.0 * GRAVITY]] * 20 + [[0.0]] * 1500), STEP)
    response = respond_oscillator(model, push)
    turns = np.flatnonzero(response.velocity[:-1] * response.velocity[1:] < 0.0)
    first = response.peak_displacement
    amplitudes = first - 2.0 * friction * radius * np.arange(turns.size)
    nodes = np.maximum(np.abs(response.u[turns]), np.abs(response.u[turns + 1]))
    np.testing.assert_allclose(nodes, amplitudes, rtol=1e-3)
    halves = math.ceil((first / (friction * radius) - 1.0) / 2.0)
    end = abs(first - 2.0 * friction * radius * halves)
    assert abs(response.residual_displacement) == pytest.approx(end, rel=1e-11)
    assert end <= friction * radius
    assert response.yields == halves + 1


def test_a_pendulum_that_is_not_pushed_hard_enough_sticks() -> None:
    """The peak force is that of the ground on a rigid body, also at a peak between nodes."""
    ground = GroundAcceleration.from_function(
        lambda t: np.asarray(0.5 * np.sin(t)), 0.0, 3.0, intervals=4, degree=5
    )
    response = respond_oscillator(IsolatedDeck.friction_pendulum(radius=2.0, friction=0.1), ground)
    assert response.peak_displacement == 0.0
    assert math.isnan(response.first_yield_time)
    assert response.peak_force_ratio == pytest.approx(0.5 / GRAVITY, rel=1e-4)
    np.testing.assert_allclose(response.force_ratio, -ground.acceleration() / GRAVITY, atol=1e-16)


def test_p_delta_is_the_weight_over_the_height() -> None:
    """A constant push is held where (K - W / H) u equals it; W is the deck and half the columns."""
    response = respond_oscillator(
        TALL(damping_ratio=0.5), GroundAcceleration(np.full((3000, 1), -1.0), STEP)
    )
    assert response.u[-1] == pytest.approx(MOVING / (STIFFNESS - LEANING / HEIGHT), rel=1e-9)
    assert LEANING / HEIGHT > 0.05 * STIFFNESS


def test_p_delta_in_motion_is_that_of_another_solver() -> None:
    """DOP853 on forces in newtons: inertia, damping, columns, and the weight that leans."""
    damping = 2.0 * 0.05 * math.sqrt(STIFFNESS * MOVING)

    def rates(t: float, y: Float) -> list[float]:
        force = (LEANING / HEIGHT - STIFFNESS) * y[0] - damping * y[1]
        return [y[1], force / MOVING - math.sin(2.0 * t)]

    ground = GroundAcceleration.from_function(
        lambda t: np.asarray(np.sin(2.0 * t)), 0.0, 9.0, intervals=300, degree=5
    )
    response = respond_oscillator(TALL(), ground)
    other = solve_ivp(
        rates, (0.0, 9.0), (0.0, 0.0), "DOP853", t_eval=response.time, rtol=1e-12, atol=1e-14
    )
    np.testing.assert_allclose(response.u, other.y[0], atol=1e-10)


@pytest.mark.parametrize(("share", "stands"), [(0.9999, True), (1.0001, False)])
def test_a_frame_that_softens_collapses_beyond_its_barrier(share: float, stands: bool) -> None:
    """It stands unless its kinetic energy exceeds the work up to where its force vanishes."""
    frame = FixedFrame(
        period=1.0, damping_ratio=0.0, strength_ratio=0.1, stability_coefficient=0.05
    )
    lean, strength, first = 0.05 * math.tau**2, 0.1 * GRAVITY, frame.yield_displacement
    far = strength / lean
    work = strength * (far - 0.5 * first) - 0.5 * lean * far**2
    speed = share * math.sqrt(2.0 * work)
    rows = np.concatenate([[[-speed / 1e-9]], np.zeros((5, 1))])
    response = respond_oscillator(frame, GroundAcceleration(rows, 1e-9))
    assert math.isfinite(response.peak_displacement) == stands
    if stands:
        assert response.peak_displacement == pytest.approx(
            far * (1.0 - math.sqrt(1.0 - share**2)), 0.1
        )
        assert 0.0 < response.residual_displacement < response.peak_displacement
    else:
        assert (response.residual_displacement, response.ductility) == (math.inf, math.inf)


def test_a_collapse_during_the_motion_ends_the_history() -> None:
    frame = FixedFrame(period=1.0, strength_ratio=0.1, stability_coefficient=0.3)
    push = GroundAcceleration(np.array([[5.0]] * 300 + [[-5.0]] * 900_000), STEP)
    response = respond_oscillator(frame, push)
    assert (response.peak_displacement, response.residual_displacement) == (math.inf, math.inf)
    ended = int(np.flatnonzero(np.isnan(response.u))[0])
    still = response.u[ended - 1]
    lean = 0.3 * math.tau**2 * abs(still) - 0.1 * GRAVITY
    assert 0.5 * 5.0 < lean < 1.5 * 5.0  # the pull of the weight outgrows the ground about then
    assert np.isnan(response.velocity[ended:]).all()
    assert np.isnan(response.force_ratio[ended:]).all()


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_strong_pull_brings_a_frame_back(side: float) -> None:
    """It is pushed out, pulled, pushed further, and pulled back from where no push could hold it.

    The weight there outweighs columns and push, but not columns and pull.
    """
    frame = FixedFrame(period=1.0, strength_ratio=0.3, stability_coefficient=0.3)
    motion = np.repeat([-5.0, 20.0, -5.0, 20.0, 0.0], [54, 24, 24, 42, 10])
    response = respond_oscillator(frame, GroundAcceleration(side * motion[:, None], STEP))
    lean, strength = 0.3 * math.tau**2, 0.3 * GRAVITY
    assert strength + 5.0 < lean * response.peak_displacement < strength + 20.0
    assert lean * abs(response.residual_displacement) < strength


def test_an_elastic_plastic_frame_stays_where_its_last_excursion_left_it() -> None:
    """An initial velocity V gives the peak uy / 2 + V^2 / (2 fy), and a residual less by uy."""
    frame = FixedFrame(period=1.0, damping_ratio=0.0, strength_ratio=0.1)
    speed, strength = 1.0, 0.1 * GRAVITY
    blow = GroundAcceleration(np.array([[-speed / 1e-9], [0.0]]), 1e-9)
    response = respond_oscillator(frame, blow)
    peak = 0.5 * frame.yield_displacement + speed**2 / (2.0 * strength)
    assert response.peak_displacement == pytest.approx(peak, rel=1e-8)
    left = peak - frame.yield_displacement
    assert response.residual_displacement == pytest.approx(left, rel=1e-8)
    assert response.dissipated_energy == pytest.approx(0.1 * left, rel=1e-8)
    assert response.peak_force_ratio == pytest.approx(0.1, rel=1e-12)


@pytest.mark.parametrize(
    ("model", "period"),
    [
        (
            IsolatedDeck.friction_pendulum(radius=3.0, friction=1e-6),
            math.tau * (3.0 / GRAVITY) ** 0.5,
        ),
        (IsolatedDeck(strength_ratio=1e-6, period=2.0, yield_displacement=0.01), 2.0),
    ],
)
def test_a_tiny_strength_hardly_changes_an_undamped_oscillator(
    model: IsolatedDeck, period: float
) -> None:
    """It needs more than 1,000,000 steps to come to rest, but its peaks are those without it."""
    blow = GroundAcceleration.from_samples([8.0] * 100, 0.01)
    elastic = respond_oscillator(FixedFrame(period=period, damping_ratio=0.0), blow)
    response = respond_oscillator(model, blow)
    assert response.peak_displacement == pytest.approx(elastic.peak_displacement, rel=1e-4)
    assert response.peak_force_ratio == pytest.approx(elastic.peak_force_ratio, rel=1e-4)
    assert response.residual_displacement == 0.0


def test_a_tiny_strength_alone_stops_a_frame_after_a_long_way() -> None:
    """A frame that is still as the ground gains 8 m/s slides v^2 / 2 q; no step bounds the way."""
    frame = FixedFrame(period=0.05, strength_ratio=1e-6, damping_ratio=0.0)
    response = respond_oscillator(frame, GroundAcceleration.from_samples([8.0] * 101, 0.01))
    q = 1e-6 * GRAVITY
    moved, speed = 0.5 * (8.0 - q), 8.0 - q
    way = moved + speed**2 / (2.0 * q)
    assert response.peak_displacement == pytest.approx(way, rel=1e-6)
    assert response.dissipated_energy == pytest.approx(1e-6 * way, rel=1e-6)
