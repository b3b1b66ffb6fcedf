"""Scenarios: the result of each does not depend on the other scenarios of the request."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from rockframe import (
    GroundAcceleration,
    ParameterError,
    Pulse,
    RockingFrame,
    Scenarios,
    respond,
    respond_many,
    respond_scenarios,
)
from rockframe.parts import Dissipater, Tendon
from rockframe.rocking import scenarios
from rockframe.rocking.kernels import steps
from rockframe.rocking.verdict import Verdict
from rockframe.units import GRAVITY

BENT = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
COLUMN = RockingFrame(height=9.6, width=1.6, restitution_factor=0.9)
TIED = dataclasses.replace(
    BENT, column_mass=48e3, tendon=Tendon(area=1e-4, modulus=195e9, length=9.6, prestress=1e5)
)
YIELDING = dataclasses.replace(
    TIED, dissipater=Dissipater(stiffness=5e6, yield_force=2e4, lever_arm=0.8)
)
PULSE = Pulse(wavelet="symmetric_ricker", a_p=GRAVITY, T_p=1.5)


def noise(seed: int, step: float = 0.01) -> GroundAcceleration:
    samples = 3.0 * np.random.default_rng(seed).uniform(-1.0, 1.0, 500)
    return GroundAcceleration.from_samples(samples, step)


def same_bits(ours: Scenarios, theirs: Scenarios, of: NDArray[np.intp] | slice) -> None:
    for field in dataclasses.fields(Scenarios):
        assert_array_equal(getattr(ours, field.name), getattr(theirs, field.name)[of])


def test_same_bits_in_any_company_and_order() -> None:
    lifted = noise(2, 0.005).with_vertical(noise(3, 0.005))
    grounds = (noise(1), PULSE, lifted, noise(4))
    frames = [BENT, COLUMN]
    rng = np.random.default_rng(5)
    ground, frame = rng.integers(0, 4, 300), rng.integers(0, 2, 300)
    scale = rng.uniform(0.2, 2.0, 300)
    together = respond_scenarios(grounds, frames, ground, frame, scale)
    shuffled = rng.permutation(300)
    same_bits(
        respond_scenarios(grounds, frames, ground[shuffled], frame[shuffled], scale[shuffled]),
        together,
        shuffled,
    )
    for k in range(0, 300, 37):
        alone = respond_scenarios([grounds[ground[k]]], [frames[frame[k]]], [0], [0], [scale[k]])
        same_bits(alone, together, slice(k, k + 1))


def test_same_bits_in_requests_of_any_size() -> None:
    """When no scenario is left, the last ones move to other lanes, and hop in smaller packs."""
    rng = np.random.default_rng(6)
    grounds, frames = [noise(1), noise(4).scaled(0.5)], [BENT, COLUMN]
    ground, frame = rng.integers(0, 2, 250), rng.integers(0, 2, 250)
    scale = rng.uniform(0.2, 40.0, 250)
    together = respond_scenarios(grounds, frames, ground, frame, scale)
    assert len(np.unique(together.overturning_time)) > 50  # lanes end at many times
    for count in (2, 9, 17, 40, 145, 180):
        some = respond_scenarios(grounds, frames, ground[:count], frame[:count], scale[:count])
        same_bits(some, together, slice(count))


def test_full_packs_are_computed_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """A pack that is full does not wait for other motions; the bits are the same."""

    def computed() -> Scenarios:
        return respond_scenarios(
            [noise(1), PULSE], [BENT, COLUMN], [0, 1, 1], [0, 0, 1], [0.5, 1.0, 1.5]
        )

    together = computed()
    monkeypatch.setattr(scenarios, "AT_A_TIME", 1)
    same_bits(computed(), together, slice(None))


def test_an_interval_is_divided_into_at_most_sixteen_pieces() -> None:
    """Each piece is short enough for one step; the scalar kernel (0) computes longer intervals."""
    still = scenarios.Prepared(GroundAcceleration(np.zeros((3, 1)), 1.0))
    rates = steps.MAX_STRIDE * np.array([0.5, 1.0, 1.01, 2.0, 8.01, 16.0, 16.01])
    constants = np.zeros((rates.size, 13))  # as of `constants_of`, without ties
    constants[:, 1] = rates
    assert still.pieces(np.zeros(rates.size), constants).tolist() == [1, 1, 2, 2, 16, 16, 0]
    lowered = still.ground.with_vertical(GroundAcceleration(np.full((3, 1), -3.0 * GRAVITY), 1.0))
    halves = scenarios.Prepared(lowered).pieces(np.ones(rates.size), constants)
    assert halves.tolist() == [1, 2, 4, 4, 0, 0, 0]


@pytest.mark.parametrize("strength", [-0.9, 0.9])
def test_a_jump_at_the_start_of_an_interval_uplifts_to_either_side(strength: float) -> None:
    """Within the interval the ground acceleration falls to zero."""
    lines = np.zeros((3, 2))
    lines[1] = strength * GRAVITY * np.array([1.0, -100.0])
    found = respond_scenarios([GroundAcceleration(lines, 0.01)], [BENT], [0], [0], [1.0])
    assert found.uplift_time[0] == 0.01


def test_a_motion_does_not_see_the_next_one_of_its_pack() -> None:
    """It ends at rest, and the next one begins far above the uplift acceleration."""
    weak, strong = (GroundAcceleration(np.full((20, 1), a * GRAVITY), 0.01) for a in (0.01, 0.9))
    found = respond_scenarios([weak, strong], [BENT], [0, 1], [0, 0], [1.0, 1.0])
    assert found.verdict.tolist() == [Verdict.NO_UPLIFT, Verdict.STANDS]
    assert np.isnan(found.uplift_time).tolist() == [True, False]


def test_many_is_the_product_of_scenarios() -> None:
    many = respond_many([noise(1), PULSE], [BENT, COLUMN], [0.5, 1.0, 1.5])
    one = respond_scenarios([noise(1), PULSE], [BENT, COLUMN], [1], [0], [1.5])
    assert many.peak_rotation[1, 0, 2] == one.peak_rotation[0]
    assert many.peak_velocity.shape == (2, 2, 3)


def test_peak_velocity_is_not_below_that_of_the_nodes_and_close_to_it() -> None:
    weak = dataclasses.replace(PULSE, a_p=0.5 * GRAVITY)
    response = respond(BENT, weak, free_rocking=20.0)
    found = respond_scenarios([weak], [BENT], [0], [0], [1.0])
    met = max(np.abs(response.omega).max(), np.abs(response.impact_velocities).max())
    assert met * (1.0 - 1e-12) <= found.peak_velocity[0] < met * (1.0 + 1e-4)


def test_peak_velocity_of_free_rocking_is_that_of_the_landing() -> None:
    """The motion ends while the frame is uplifted, so it lands with the energy at that time."""
    pull = GroundAcceleration.from_samples(np.full(31, 0.3 * GRAVITY), 0.01)
    response = respond(COLUMN, pull)
    theta, omega = float(response.theta[-1]), float(response.omega[-1])
    alpha, p = COLUMN.slenderness, COLUMN.effective_frequency_parameter
    landing = math.sqrt(omega**2 + 2.0 * p**2 * (math.cos(alpha - abs(theta)) - math.cos(alpha)))
    found = respond_scenarios([pull], [COLUMN], [0], [0], [1.0])
    assert found.peak_velocity[0] == pytest.approx(landing, rel=1e-12)
    assert found.impact_velocity[0] == pytest.approx(COLUMN.width * landing, rel=1e-12)
    assert found.impacts[0] == 0


@pytest.mark.parametrize(
    "pushes",
    [
        np.repeat([0.0, 1.8, -1.8, 1.8, -1.8, 0.0], 20),
        # the frame falls from its peak faster than it rose, and the next push slows it down
        np.array([2.0, *[0.9] * 9, -4.0, 3.0, *[0.0] * 20]),
    ],
)
def test_peak_velocity_where_the_ground_jumps(pushes: NDArray[np.float64]) -> None:
    """The rate is largest at the node where the stepped push changes its sign."""
    ground = GroundAcceleration(BENT.uplift_acceleration * pushes[:, np.newaxis], 0.01)
    response = respond(BENT, ground, free_rocking=20.0)
    found = respond_scenarios([ground], [BENT], [0], [0], [1.0])
    met = max(np.abs(response.omega).max(), np.abs(response.impact_velocities).max())
    assert found.peak_velocity[0] == pytest.approx(met, rel=1e-12)


@pytest.mark.parametrize("scale", [0.1, 0.5, 0.8, 3.0])
@pytest.mark.parametrize("frame", [BENT, COLUMN, TIED, YIELDING])
def test_impact_velocity_is_that_of_the_hardest_impact(frame: RockingFrame, scale: float) -> None:
    """The lifted corner is 2 b from the pivot. A frame that does not uplift has no impact."""
    ground = GroundAcceleration.from_pulse(PULSE).scaled(scale)
    impacts = np.abs(respond(frame, ground, free_rocking=20.0).impact_velocities)
    found = respond_scenarios([PULSE], [frame], [0], [0], [scale])
    expected = frame.width * impacts.max(initial=0.0)
    assert found.impact_velocity[0] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("frame", [BENT, YIELDING], ids=["free", "yielding"])
def test_a_negative_scale_reverses_the_motion(frame: RockingFrame) -> None:
    """Long intervals, and ties that yield, are left to the kernel of single responses."""
    ground = GroundAcceleration.from_samples([0.0, 6.0, -6.0, 6.0, 0.0], 1.0)
    found = respond_scenarios([ground], [frame], [0, 0], [0, 0], [1.0, -1.0])
    assert found.verdict[0] != Verdict.NO_UPLIFT
    same_bits(found, found, slice(None, None, -1))


def test_nothing_asked_nothing_answered() -> None:
    assert respond_scenarios([PULSE], [BENT], [], [], []).verdict.shape == (0,)


@pytest.mark.parametrize(
    ("ground", "frame", "scale", "words"),
    [
        ([0, 0], [0], [1.0], "Invalid ground indices of shape (2,). Must be one row, as long"),
        ([0], [1], [1.0], "Invalid frame index 1 of scenario 0. Must be 0 to 0."),
        ([-1], [0], [1.0], "Invalid ground index -1 of scenario 0. Must be 0 to 0."),
        ([0.0], [0], [1.0], "Invalid ground indices of float64. Must be integers."),
        ([0], [0], [math.nan], "Invalid scale nan of scenario 0. Must be finite."),
    ],
)
def test_what_cannot_be_asked(
    ground: list[int], frame: list[int], scale: list[float], words: str
) -> None:
    with pytest.raises(ParameterError) as error:
        respond_scenarios([PULSE], [BENT], ground, frame, scale)
    assert words in str(error.value)


def test_ground_that_falls_faster_than_gravity_at_its_scale() -> None:
    falling = noise(1).with_vertical(noise(2))
    with pytest.raises(ParameterError, match="lose contact"):
        respond_scenarios([falling], [BENT], [0, 0], [0, 0], [1.0, 4.0])


def test_ground_that_falls_freely_has_no_contact() -> None:
    samples = np.zeros(500)
    samples[100] = -GRAVITY
    falls = GroundAcceleration.from_samples(samples, 0.01)
    with pytest.raises(ParameterError, match="lose contact"):
        respond(BENT, noise(1).with_vertical(falls))
    respond(BENT, noise(1).with_vertical(falls.scaled(1.0 - 1e-6)))


def test_ties_do_not_round_the_ground_differently_in_company() -> None:
    """A lane that waits for other lanes is loaded again after an impact, and must be the same."""
    tendon = Tendon(area=1e-3, modulus=195e9, prestress=2e5)
    frames = [
        dataclasses.replace(one, restitution_factor=1.0, column_mass=48e3, tendon=tendon)
        for one in (COLUMN, BENT)
    ]
    rng = np.random.default_rng(3)
    samples = np.convolve(rng.standard_normal(800), np.hanning(25), mode="same")
    motion = GroundAcceleration.from_samples(3.0 * samples / np.abs(samples).max(), 0.01)
    motion = motion.followed_by_rest(20.0)
    alone = respond_scenarios([motion], frames, [0], [0], [1.0])
    for many in (1, 7, 40):
        frame = np.array([0, *[1] * many])
        whole = respond_scenarios([motion], frames, 0 * frame, frame, np.ones(frame.size))
        same_bits(alone, whole, np.array([0]))


def test_a_frame_at_rest_bears_its_mass_times_the_ground_acceleration_in_both_directions() -> None:
    weak = GroundAcceleration.from_samples([0.0, 0.5, 0.0], 0.01)
    found = respond_scenarios([weak], [BENT], [0, 0], [0, 0], [1.0, -1.0], demands=True)
    assert (found.verdict == Verdict.NO_UPLIFT).all()
    np.testing.assert_allclose(found.base_shear, 0.5 / GRAVITY, rtol=1e-12)
    np.testing.assert_allclose(found.friction_demand, 0.5 / GRAVITY, rtol=1e-12)
