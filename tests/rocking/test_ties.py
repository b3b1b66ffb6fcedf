"""Tendons and dissipaters: the expected numbers, energy, limits, and another solver."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from numpy.polynomial import polynomial
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from tests.rocking.direct import Outcome, integrate, straight_lines
from tests.rocking.motions import BENT, noise, still

from rockframe.parts import Abutment, Dissipater, Tendon
from rockframe.rocking import kernels
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.kernels import tails
from rockframe.rocking.kernels.ties import (
    CABLE,
    ELASTIC,
    PLASTIC,
    PLASTIC_STRETCH,
    REST,
    WORK,
    YIELD_TIME,
    Tie,
)
from rockframe.rocking.response import respond
from rockframe.rocking.scenarios import respond_many
from rockframe.units import GRAVITY
from rockframe.wavelets.pulse import Pulse

Float = NDArray[np.float64]

NONE: Tie = (0.0, 0.0, math.inf, -math.inf, ELASTIC)
TENDON: Tie = (1.2, 0.02, math.inf, -math.inf, ELASTIC)
YIELDING: Tie = (1.2, 0.02, 0.06, 0.0, CABLE)
DISSIPATER: Tie = (3.0, 0.0, 0.04, -0.04, PLASTIC)
STRONG: Tie = (8.0, 0.0, 0.3, -0.3, PLASTIC)  # stronger than gravity: it holds the frame open
PAIRS = {
    "tendon": (TENDON, NONE),
    "yielding": (YIELDING, NONE),
    "hybrid": (TENDON, DISSIPATER),
    "yielding hybrid": (YIELDING, DISSIPATER),
    "strong": (NONE, STRONG),
}
BARS = Dissipater(stiffness=5e7, yield_force=2e5, lever_arm=0.8)
TENDONS = Tendon(area=1e-3, modulus=195e9, length=9.6, prestress=1e5, yield_stress=1.5e9)
RESTRAINED = replace(BENT, column_mass=48e3, tendon=TENDONS)
ALPHA, P_HAT, KEPT = 0.165, 1.4, 0.93


def run(ground: Float, step: float, ties: tuple[Tie, Tie], **options: Any) -> Outcome:
    return integrate(ground, step, alpha=ALPHA, p_hat=P_HAT, restitution=KEPT, ties=ties, **options)


def rough(seed: int, strength: float = 0.45) -> Float:
    samples = strength * np.random.default_rng(seed).uniform(-1.0, 1.0, 40)
    return straight_lines(np.append(samples, 0.0), 0.1)


def test_expected_histories_with_tendons_and_vertical_motion(
    expected: Callable[[str], Any],
) -> None:
    (case,) = (case for case in expected("a2_vertical_and_tendons")["cases"] if "c1" in case)
    period = case["T_p_s"]
    across, upwards = (
        GroundAcceleration.from_function(
            Pulse(wavelet="antisymmetric_ricker", a_p=a * GRAVITY, T_p=T, time=at).acceleration,
            *(-3.0 * period, 4.0 * period),
            intervals=1400,
            degree=5,
        )
        for a, T, at in ((case["a_p_g"], period, 0.0), (0.4, 0.5, -0.3))
    )
    outcome = integrate(
        across.coefficients / GRAVITY,
        across.time_step,
        alpha=BENT.slenderness,
        p_hat=BENT.effective_frequency_parameter,
        restitution=BENT.restitution,
        vertical=upwards.coefficients / GRAVITY,
        ties=((case["c1"], case["c2"], math.inf, -math.inf, ELASTIC), NONE),
    )
    places = [round((row["t_over_Tp"] + 3.0) * 200) for row in case["theta"]]
    assert outcome.theta[places] == pytest.approx([r["theta"] for r in case["theta"]], abs=1e-14)
    assert outcome.omega[places] == pytest.approx([r["thetadot"] for r in case["theta"]], abs=1e-14)
    times = [row["t"] + 3.0 * period for row in case["impacts"]]
    assert outcome.impact_times[: len(times)][outcome.impact_times[: len(times)] < 8.0] == (
        pytest.approx([t for t in times if t < 8.0], abs=1e-12)
    )
    assert outcome.uplift_time - 3.0 * period == pytest.approx(case["t_uplift"], abs=1e-12)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_ties_without_force_change_nothing(seed: int) -> None:
    free = integrate(rough(seed), 0.1, alpha=ALPHA, p_hat=P_HAT, restitution=KEPT)
    tied = run(rough(seed), 0.1, (NONE, NONE))
    np.testing.assert_allclose(tied.theta, free.theta, rtol=0.0, atol=1e-13)
    assert (tied.verdict, tied.impacts) == (free.verdict, free.impacts)


@pytest.mark.parametrize("name", PAIRS)
@pytest.mark.parametrize("seed", [4, 5])
def test_histories_are_those_of_another_solver(name: str, seed: int) -> None:
    outcome = run(rough(seed), 0.1, PAIRS[name])
    theta, omega, forces = by_dop853(rough(seed), 0.1, PAIRS[name])
    assert outcome.peak > 0.02
    np.testing.assert_allclose(outcome.theta, theta, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(outcome.omega, omega, rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(outcome.forces, forces, rtol=0.0, atol=1e-8)


@pytest.mark.parametrize("name", PAIRS)
def test_the_other_direction_is_the_mirror_image(name: str) -> None:
    first, other = (run(sign * rough(3, 1.0), 0.1, PAIRS[name]) for sign in (1.0, -1.0))
    np.testing.assert_array_equal(first.theta, -other.theta)
    np.testing.assert_array_equal(first.forces, other.forces)
    np.testing.assert_array_equal(first.log, other.log)


@pytest.mark.parametrize("name", PAIRS)
def test_energy_is_kept_or_accounted_for(name: str) -> None:
    """In free rocking the lost energy equals that of impacts and yielding, to round-off."""
    ties = PAIRS[name]
    outcome = run(np.zeros((3000, 1)), 0.01, ties, start=(0.9 * ALPHA, 0.0))
    lost_in_impacts = 0.5 * (1.0 - KEPT**2) * np.sum(outcome.impact_velocities**2)
    start = energy(0.9 * ALPHA, 0.0, outcome.forces[0], ties)
    end = energy(outcome.theta[-1], outcome.omega[-1], outcome.forces[-1], ties)
    dissipated = P_HAT**2 * outcome.log[:, WORK].sum()
    assert start - end == pytest.approx(lost_in_impacts + dissipated, abs=1e-13)


def test_scenarios_of_restrained_frames_are_their_responses() -> None:
    frames = [RESTRAINED, BENT, replace(RESTRAINED, dissipater=BARS)]
    pulse = Pulse(wavelet="symmetric_ricker", a_p=0.6 * GRAVITY, T_p=1.5)
    peaks = respond_many([pulse], frames)
    single = [respond(frame, pulse).peak_rotation for frame in frames]
    assert peaks.peak_rotation.ravel() == pytest.approx(single, rel=1e-9)


@pytest.mark.parametrize("outwards", [-0.05, -0.02, 0.0, 0.02])
@pytest.mark.parametrize("start", [0.3, 0.35, 0.45])
def test_the_verdict_is_that_of_a_longer_record(start: float, outwards: float) -> None:
    """Beyond the barrier a frame that moves inwards may still overturn after the motion."""
    soft = replace(RESTRAINED, tendon=replace(TENDONS, area=1e-4, prestress=0.0))
    verdicts = {
        respond(soft, still(span), initial_rotation=start, initial_velocity=outwards).verdict
        for span in (0.02, 60.0)
    }
    assert len(verdicts) == 1


@pytest.mark.parametrize("outwards", [-2.0, -0.9, 0.5])
@pytest.mark.parametrize("tied", [False, True])
def test_a_fall_after_the_motion_is_that_of_a_longer_record(tied: bool, outwards: float) -> None:
    """Thrown inwards from beyond the barrier, it lands first and overturns on the other side."""
    soft = replace(RESTRAINED, tendon=replace(TENDONS, area=1e-4, prestress=0.0))
    frame = soft if tied else BENT
    short, long = (
        respond(frame, still(span), initial_rotation=0.45, initial_velocity=outwards)
        for span in (0.02, 6.0)
    )
    assert short.impacts == long.impacts == (outwards < 0.0)
    np.testing.assert_allclose(short.impact_times, long.impact_times, rtol=1e-11)
    np.testing.assert_allclose(short.impact_velocities, long.impact_velocities, rtol=1e-11)
    assert short.overturning_time == pytest.approx(long.overturning_time, rel=1e-11)


@pytest.mark.parametrize(("k", "f"), [(0.0, 0.0), (0.3, 0.0), (0.3, 0.1), (0.6, 0.2)])
def test_the_barrier_is_where_gravity_and_elastic_ties_balance(k: float, f: float) -> None:
    def restoring(theta: float) -> float:
        return math.sin(ALPHA - theta) + k * math.sin(theta) + f * math.cos(0.5 * theta)

    top = tails._held_root(ALPHA, k, f, 0.0, 0.5 * math.pi, True)  # noqa: SLF001
    assert top == pytest.approx(brentq(restoring, 0.0, 0.5 * math.pi, xtol=1e-15), rel=1e-13)


def test_restrained_frames_in_lanes_are_those_of_the_scalar_kernel() -> None:
    """Verdict, peak rotation and overturning time agree, from rest to far beyond the barrier."""
    soft = replace(RESTRAINED, tendon=replace(TENDONS, area=2e-4, prestress=5e4))
    frames = [RESTRAINED, soft, replace(soft, mass_ratio=0.0), BENT]
    motions: list[GroundAcceleration] = [
        GroundAcceleration.from_samples(noise(7, 600, 1.0), 0.02),
        GroundAcceleration.from_pulse(Pulse(wavelet="symmetric_ricker", a_p=GRAVITY, T_p=1.5)),
    ]
    upwards = GroundAcceleration.from_samples(noise(8, 600, 0.2), 0.02)
    motions.append(motions[0].with_vertical(upwards))
    scales = np.linspace(0.1, 3.0, 20)
    peaks, compared = respond_many(motions, frames, scales), 0
    for i, motion in enumerate(motions):
        for k, frame in enumerate(frames):
            for n, scale in enumerate(scales):
                response = respond(frame, motion.scaled(scale))
                near = respond(frame, motion.scaled(scale * (1.0 + 1e-13)))
                if (response.verdict, response.impacts) != (near.verdict, near.impacts):
                    continue  # the last bits decide
                tolerance = 1e-8 + 100.0 * abs(
                    near.peak_rotation / (response.peak_rotation or 1.0) - 1.0
                )
                assert peaks.verdict[i, k, n] == response.verdict
                assert peaks.peak_rotation[i, k, n] == pytest.approx(
                    response.peak_rotation, rel=tolerance
                )
                assert peaks.overturning_time[i, k, n] == pytest.approx(
                    response.overturning_time, abs=1e-6, nan_ok=True
                )
                compared += 1
    assert compared > 0.9 * peaks.verdict.size
    assert {*peaks.verdict[:, :2].ravel().tolist()} == {0, 1, 2}


def test_a_stiff_tendon_never_lets_it_overturn() -> None:
    """With k above cos(alpha) the restoring moment is positive everywhere: there is no barrier."""
    strong = straight_lines(np.array([0.0, 3.0, 3.0, -3.0, -3.0, 0.0]), 0.5)
    free = integrate(strong, 0.5, alpha=ALPHA, p_hat=P_HAT, restitution=KEPT)
    tied = run(strong, 0.5, ((12.0, 0.0, math.inf, -math.inf, ELASTIC), NONE))
    assert (free.verdict, tied.verdict) == (kernels.OVERTURNS, kernels.STANDS)


def test_prestress_raises_the_uplift_acceleration() -> None:
    hold = 0.02 / math.cos(ALPHA)
    ramp = straight_lines([0.0, 1.0], 1.0)
    assert run(ramp, 1.0, (TENDON, NONE)).uplift_time == pytest.approx(
        math.tan(ALPHA) + hold, rel=1e-14
    )


def test_the_deck_closes_its_gap_where_the_drift_reaches_it() -> None:
    pulse = Pulse(wavelet="symmetric_ricker", a_p=0.5 * GRAVITY, T_p=1.5)
    response = respond(replace(BENT, abutment=Abutment(gap=0.25)), pulse)
    when = int(np.searchsorted(response.time, response.gap_closed_time))
    below, beyond = np.abs(response.u[when - 1 : when + 1])
    assert below < 0.25 <= beyond
    assert np.abs(response.u[:when]).max() < 0.25
    assert math.isnan(response.lift_exceeded_time)


def test_a_gap_that_the_released_frame_has_passed_is_closed_at_once() -> None:
    frame = replace(BENT, abutment=Abutment(gap=0.25))
    response = respond(frame, still(1.0), initial_rotation=0.9 * BENT.slenderness)
    assert response.gap_closed_time == 0.0
    assert response.facts()["gap closes at"] == "0.00 s"


def test_a_drawing_has_the_band_of_the_ensemble_where_there_is_one() -> None:
    from matplotlib.figure import Figure

    axes = Figure().subplots()
    response = respond(BENT, still(0.1), initial_rotation=0.5 * BENT.slenderness)
    low, high = response.theta - 0.01, response.theta + np.inf
    replace(response, theta_low=low, theta_high=high).draw(axes)
    (band,) = axes.collections
    extent = band.get_paths()[0].get_extents()
    assert extent.ymin == pytest.approx(low.min() / BENT.slenderness)
    assert extent.ymax == pytest.approx(math.pi / BENT.slenderness)


def test_a_deck_that_sinks_does_not_exceed_the_allowed_lift() -> None:
    """On its way to overturning the deck sinks, by more than it ever rose."""
    highest = 2.0 * BENT.size - BENT.height
    frame = replace(BENT, abutment=Abutment(gap=9.0, uplift_allowance=1.01 * highest))
    pulse = Pulse(wavelet="symmetric_ricker", a_p=0.8 * GRAVITY, T_p=1.5)
    response = respond(frame, pulse)
    assert np.nanmin(response.v) < -1.01 * highest
    assert response.facts()["nominal overturning time"] == f"{response.overturning_time:.2f} s"
    assert math.isnan(response.lift_exceeded_time)
    lower = replace(frame, abutment=Abutment(gap=9.0, uplift_allowance=0.99 * highest))
    when = int(np.searchsorted(response.time, respond(lower, pulse).lift_exceeded_time))
    assert response.v[when - 1] < 0.99 * highest <= response.v[when]


def test_a_push_lifts_the_deck_at_once() -> None:
    """From rest, theta is omega t - p_hat^2 sin(alpha) t^2 / 2, up to the third power of t."""
    half, pull = 0.005, BENT.effective_frequency_parameter**2 * math.sin(BENT.slenderness)
    lift = float(BENT.vertical_displacement(0.2 * half - 0.5 * pull * half**2))
    frame = replace(BENT, abutment=Abutment(gap=9.0, uplift_allowance=lift))
    response = respond(frame, still(0.1), initial_velocity=0.2)
    assert response.time[1] == 2.0 * half
    assert response.lift_exceeded_time == pytest.approx(half, rel=1e-4)


def test_yield_is_noted_where_the_force_reaches_it() -> None:
    ties = ((1.2, 0.02, 0.06, -math.inf, ELASTIC), NONE)
    push = straight_lines([0.5, 0.5], 2.0)
    when = run(push, 2.0, ties).log[0, YIELD_TIME]
    force = run(straight_lines([0.5, 0.5], when), when, ties).forces[-1, 0]
    assert force == pytest.approx(0.06, abs=1e-14)


HELD_OPEN = {
    "swings": (NONE, STRONG),
    "bounces": (TENDON, (1.2, 0.0, 0.5, -0.5, PLASTIC)),
    "slackens its tendon": (YIELDING, (5.4, 0.0, 0.9, -0.9, PLASTIC)),
}


def restoring(theta: float, plastic: Float, ties: tuple[Tie, Tie]) -> float:
    """Return the moment of gravity and ties towards closed joints, without further yielding."""
    stretch = 2.0 * math.sin(0.5 * theta)
    forces = [
        max(lowest, force + stiffness * (stretch - at))
        for (stiffness, force, _, lowest, _), at in zip(ties, plastic, strict=True)
    ]
    return float(math.sin(ALPHA - theta) + sum(forces) * math.cos(0.5 * theta))


@pytest.mark.parametrize("name", HELD_OPEN)
@pytest.mark.parametrize("seed", range(12))
def test_a_frame_kept_open_rests_where_the_moments_balance(name: str, seed: int) -> None:
    """The rest is the root of the restoring moment, or zero where that moment closes the joints."""
    ties = HELD_OPEN[name]
    outcome = run(rough(seed, 1.0), 0.1, ties)
    rest, plastic = outcome.log[0, REST], outcome.log[:, PLASTIC_STRETCH]
    if math.isnan(rest):
        assert outcome.verdict == kernels.OVERTURNS
    elif restoring(0.0, plastic, ties) >= 0.0:
        assert rest == 0.0
    else:
        balance = brentq(restoring, 0.0, 0.4, args=(plastic, ties), xtol=1e-15)
        assert rest == pytest.approx(balance, rel=1e-11)
        assert 0.0 < rest < outcome.peak


@pytest.mark.parametrize("name", HELD_OPEN)
def test_a_history_with_some_damping_ends_at_the_rest(name: str) -> None:
    """Another solver follows it, with damping from 20 s after the motion on; bars yield freely."""
    ties = HELD_OPEN[name]
    seed, outcome = next(
        (seed, tied)
        for seed in range(12)
        if (tied := run(rough(seed, 1.0), 0.1, ties)).log[0, REST] > 0.0
    )
    ground = np.concatenate([rough(seed, 1.0), np.zeros((500, 2))])
    theta, omega, _ = by_dop853(ground, 0.1, ties, damped_after=240)
    assert abs(omega[-1]) < 1e-6
    assert abs(theta[-1]) == pytest.approx(outcome.log[0, REST], abs=1e-7)


def test_bars_that_hold_a_frame_open_stretch_its_tendon() -> None:
    bars = Dissipater(stiffness=1e9, yield_force=6e6, lever_arm=0.8)
    frame = replace(RESTRAINED, dissipater=bars)
    tied = respond(frame, Pulse(wavelet="symmetric_ricker", a_p=GRAVITY, T_p=1.5)).restraint
    assert tied is not None
    assert tied.residual_rotation > 0.0
    assert tied.tendon_force_left == pytest.approx(frame.tension(tied.residual_rotation), rel=1e-12)


def energy(theta: float, omega: float, forces: Float, ties: tuple[Tie, Tie]) -> float:
    """Return the energy over the frame's inertia: kinetic, potential, and stored in the ties."""
    stored = sum(
        (force**2 - tie[1] ** 2) / (2.0 * tie[0])
        for force, tie in zip(forces, ties, strict=True)
        if tie[0]
    )
    height = math.cos(ALPHA - abs(theta)) - math.cos(ALPHA)
    return float(0.5 * omega**2 + P_HAT**2 * (height + stored))


def by_dop853(
    ground: Float, step: float, ties: tuple[Tie, Tie], damped_after: int | None = None
) -> tuple[Float, Float, Float]:
    """Return theta, omega and forces at the nodes, by a solver restarted at each event.

    The forces are unknowns of the solver. A force grows with the stretch and is constant while the
    tie yields. The computed force of a cable may become negative; it then counts as zero. Viscous
    damping acts from an interval on.
    """
    state = np.array([0.0, 0.0, ties[0][1], ties[1][1]])
    side, yields = 0.0, [False, False]
    kept = [state.copy()]
    for i, row in enumerate(ground):
        damping = 1.0 if damped_after is not None and i >= damped_after else 0.0
        now = 0.0
        while now < step:
            if side == 0.0:
                side, now = _uplift(row, now, step, acting(state, ties))
                if side == 0.0:
                    break
            if state[0] == 0.0 and state[1] == 0.0:
                state[0] = side * 1e-300
            now, state, side, yields = _until_event(
                row, now, step, state, side, yields, ties, damping
            )
        seen = state.copy()
        seen[2:] = acting(state, ties)
        kept.append(seen)
    theta, omega, *forces = np.array(kept).T
    return theta, omega, np.array(forces).T


def acting(state: Float, ties: tuple[Tie, Tie]) -> Float:
    return np.array(
        [max(f, 0.0) if tie[4] == CABLE else f for f, tie in zip(state[2:], ties, strict=True)]
    )


def _uplift(row: Float, now: float, step: float, forces: Float) -> tuple[float, float]:
    limit = math.tan(ALPHA) + forces.sum() / math.cos(ALPHA)
    times = [now]
    for sign in (1.0, -1.0):
        if row[1] != 0.0:
            times.append((sign * limit - row[0]) / row[1])
    for t in sorted(times):
        a = polynomial.polyval(t + 1e-9, row)
        if now <= t < step and abs(a) > limit:
            return -math.copysign(1.0, a), t
    return 0.0, step


def _until_event(
    row: Float,
    now: float,
    step: float,
    state: Float,
    side: float,
    yields: list[bool],
    ties: tuple[Tie, Tie],
    damping: float,
) -> tuple[float, Float, float, list[bool]]:
    def rates(t: float, y: Float) -> list[float]:
        psi = ALPHA * side - y[0]
        half = math.cos(0.5 * y[0])
        force = acting(y, ties).sum()
        pull = math.sin(psi) + polynomial.polyval(t, row) * math.cos(psi) + side * force * half
        growth = side * half * y[1]
        return [
            *(y[1], -(P_HAT**2) * pull - damping * y[1]),
            *(0.0 if flows else tie[0] * growth for flows, tie in zip(yields, ties, strict=True)),
        ]

    events = _events(state, side, yields, ties)
    solution = solve_ivp(
        rates,
        (now, step),
        state,
        method="DOP853",
        rtol=1e-11,
        atol=1e-14,
        events=list(events.values()),
        max_step=0.05,
    )
    state = solution.y[:, -1].copy()
    (hit,) = [
        name for name, times in zip(events, solution.t_events, strict=True) if times.size
    ] or [""]
    event, _, k = hit.partition(" ")
    if event == "landing":
        state[0], state[1], side = 0.0, KEPT * state[1], -side
        yields = [False, False]
        limit = math.tan(ALPHA) + acting(state, ties).sum() / math.cos(ALPHA)
        if abs(state[1]) < 1e-7 * P_HAT and abs(polynomial.polyval(solution.t[-1], row)) < limit:
            state[1], side = 0.0, 0.0
    elif event == "flow":
        state[2 + int(k)] = math.copysign(ties[int(k)][2], state[2 + int(k)])
        yields = [flows or i == int(k) for i, flows in enumerate(yields)]
    elif event == "slack":
        state[2 + int(k)] = math.copysign(1e-300, side * state[1])  # past the event
    elif event == "turn":
        state[1] = 0.0
        yields = [flows and i != int(k) for i, flows in enumerate(yields)]
    return solution.t[-1], state, side, yields


def _events(
    state: Float, side: float, yields: list[bool], ties: tuple[Tie, Tie]
) -> dict[str, Callable[[float, Float], float]]:
    """Return the events that end a branch, by name and index of the tie."""

    def event(direction: float, of: Callable[[Float], float]) -> Any:
        def reached(_: float, y: Float) -> float:
            return of(y)

        reached.terminal, reached.direction = True, direction  # type: ignore[attr-defined]
        return reached

    def spare(k: int, y: Float) -> float:
        return float((abs(y[2 + k]) if ties[k][4] == PLASTIC else y[2 + k]) - ties[k][2])

    def outwards(k: int, y: Float) -> float:
        return float(side * math.copysign(1.0, state[2 + k]) * y[1])

    events = {"landing": event(-1.0, lambda y: float(side * y[0]))}
    for k, tie in enumerate(ties):
        if yields[k]:
            events[f"turn {k}"] = event(-1.0, partial(outwards, k))
        elif tie[4] != ELASTIC:
            events[f"flow {k}"] = event(1.0, partial(spare, k))
            if tie[4] == CABLE:
                events[f"slack {k}"] = event(0.0, partial(lambda k, y: float(y[2 + k]), k))
    return events
