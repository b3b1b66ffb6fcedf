"""The comparison of bridges: results that all models share, and the end of their validity."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.rocking.motions import BENT, noise

from rockframe.errors import ParameterError
from rockframe.parts import Abutment, Dissipater, Tendon
from rockframe.rivals import FixedFrame, IsolatedDeck
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.response import first_crossing, respond
from rockframe.rocking.verdict import ModelEnd
from rockframe.structures.comparison import Rivals, compare
from rockframe.units import GRAVITY
from rockframe.wavelets.pulse import Pulse

TENDON = Tendon(area=1e-3, modulus=195e9, length=9.6, prestress=1e5, yield_stress=6e8)
BARS = Dissipater(stiffness=5e7, yield_force=2e5, lever_arm=0.8)
BRIDGE = replace(BENT, column_mass=48e3, abutment=Abutment(gap=0.3, uplift_allowance=0.06))
RIVALS = Rivals(
    BRIDGE,
    restrained=replace(BRIDGE, tendon=TENDON),
    hybrid=replace(BRIDGE, tendon=TENDON, dissipater=BARS),
    isolated=IsolatedDeck.friction_pendulum(radius=2.5, friction=0.2),
    fixed=FixedFrame(period=1e-3),
)
PULSE = Pulse(wavelet="symmetric_ricker", a_p=0.5 * GRAVITY, T_p=1.5)


def test_what_does_not_move_bears_its_mass_times_the_acceleration_of_the_ground() -> None:
    """Below uplift and below sliding all bridges are one rigid body."""
    weak = GroundAcceleration.from_samples(noise(3, 200, 0.1), 0.01)
    for model in (*compare(RIVALS, weak), *compare(RIVALS, weak.scaled(-1.0))):
        tolerance = 0.2 if model.model == "fixed" else 1e-12  # the fixed frame vibrates at 1000 Hz
        shear = math.copysign(1.0, model.base_shear[9] * weak.acceleration()[9]) * model.base_shear
        assert shear == pytest.approx(weak.acceleration() / GRAVITY, abs=tolerance)
        assert model.peak_base_shear == np.abs(shear).max()
        assert (model.peak_u < 1e-6, model.model_end) == (True, ModelEnd.NONE)


@pytest.mark.parametrize("level", [0.1, 0.6])
def test_the_mirrored_motion_has_the_same_results(level: float) -> None:
    """Peaks, residual drifts and the ends of validity have no sign."""
    ground = GroundAcceleration.from_samples(noise(3, 400, level), 0.02)
    rivals = replace(RIVALS, fixed=FixedFrame(period=0.4, strength_ratio=0.2))
    for first, other in zip(*(compare(rivals, ground.scaled(s)) for s in (1.0, -1.0)), strict=True):
        assert first.model == other.model
        assert first.u == pytest.approx(-other.u, nan_ok=True)
        for name in ("peak_u", "residual_u", "peak_base_shear", "ductility", "valid_until"):
            assert getattr(first, name) == pytest.approx(getattr(other, name), nan_ok=True), name


def test_frames_that_rock_are_those_of_respond() -> None:
    free, restrained, hybrid, *_ = compare(RIVALS, PULSE)
    for first, frame in zip(
        (free, restrained, hybrid), (BRIDGE, RIVALS.restrained, RIVALS.hybrid), strict=True
    ):
        assert frame is not None
        assert first.peak_u == respond(frame, PULSE).peak_u


def test_base_shear_of_a_frame_that_rocks_is_the_mass_times_its_acceleration() -> None:
    """Between impacts, only the base shear changes the momentum of deck and columns."""
    strong = Pulse(wavelet="symmetric_ricker", a_p=0.45 * GRAVITY, T_p=1.5)
    (first, *_) = compare(RIVALS, strong)
    response = respond(BRIDGE, strong)
    share = BRIDGE.mass_ratio / (1.0 + BRIDGE.mass_ratio)
    deck, column = BRIDGE.beam, BRIDGE.centre
    momentum = share * deck.shift_rate(response.theta, response.omega)
    momentum = momentum + (1.0 - share) * column.shift_rate(response.theta, response.omega)
    from_impact = np.searchsorted(first.time, response.impact_times[1])
    quiet = slice(int(from_impact) + 1, int(np.searchsorted(first.time, response.impact_times[2])))
    step = first.time[1] - first.time[0]
    ground = strong.acceleration(first.time) / GRAVITY
    force = (first.base_shear - ground)[quiet] * GRAVITY
    gained = step * (force.sum() - 0.5 * (force[0] + force[-1]))
    lost = momentum[quiet][-1] - momentum[quiet][0]
    assert gained == pytest.approx(lost, rel=1e-4)


def test_the_first_event_ends_a_model() -> None:
    free, restrained, *_ = compare(RIVALS, PULSE)
    assert (free.model_end, restrained.model_end) == (ModelEnd.GAP_CLOSES, ModelEnd.TENDON_YIELDS)
    assert free.valid_until == free.gap_closed_time
    wide = replace(RIVALS, frame=replace(BRIDGE, abutment=Abutment(gap=3.0, uplift_allowance=0.01)))
    assert compare(wide, PULSE)[0].model_end is ModelEnd.LIFT_EXCEEDED


def test_a_gap_that_closes_after_the_motion_ends_the_model_too() -> None:
    """The largest drift may occur after the motion; its time is then unknown."""
    time = np.arange(0.0, 0.7, 0.01)
    kick = GroundAcceleration.from_samples(0.35 * GRAVITY * np.sin(np.pi * time / 0.7), 0.01)
    peak = compare(RIVALS, kick)[0].peak_u
    reached = np.nanmax(np.abs(compare(RIVALS, kick)[0].u))
    assert peak > 1.01 * reached
    wide = replace(BRIDGE, abutment=Abutment(gap=0.5 * (peak + reached)))
    late = compare(replace(RIVALS, frame=wide), kick)[0]
    assert (late.model_end, np.isnan(late.valid_until)) == (ModelEnd.GAP_CLOSES, True)


def test_a_fixed_frame_is_valid_up_to_its_ductility() -> None:
    """The event is the crossing of the limit; with a wide gap and a wide limit the model holds."""
    bare = replace(RIVALS, frame=replace(BRIDGE, abutment=None))
    weak = FixedFrame(period=0.4, strength_ratio=0.2, limit_ductility=1e3)
    reached = compare(replace(bare, fixed=weak), PULSE)[-1]
    assert reached.model_end is ModelEnd.NONE
    half = replace(weak, limit_ductility=0.5 * reached.ductility)
    (*_, ended) = compare(replace(bare, fixed=half), PULSE)
    assert (ended.model_end, ended.peak_u) == (ModelEnd.DUCTILITY_EXCEEDED, reached.peak_u)
    at = np.searchsorted(ended.time, ended.valid_until)
    before, after = np.abs(ended.u[at - 1 : at + 1])
    assert before < 0.5 * reached.peak_u <= after


def test_a_fixed_frame_that_collapses_exceeds_any_ductility() -> None:
    frail = FixedFrame(
        period=1.0, strength_ratio=0.05, stability_coefficient=0.5, limit_ductility=np.inf
    )
    one = compare(replace(RIVALS, frame=replace(BRIDGE, abutment=None), fixed=frail), PULSE)[-1]
    assert (one.model_end, one.peak_u) == (ModelEnd.DUCTILITY_EXCEEDED, np.inf)
    assert np.isfinite(one.peak_base_shear)


def test_a_deck_on_isolators_or_fixed_columns_does_not_rise() -> None:
    *_, isolated, fixed = compare(RIVALS, PULSE)
    for rival in (isolated, fixed):
        assert rival.peak_v == np.abs(rival.v).max() == 0.0


def test_overturning_ends_the_free_frame_and_not_the_restrained() -> None:
    huge = Pulse(wavelet="symmetric_ricker", a_p=3.0 * GRAVITY, T_p=2.0)
    free, restrained, *_ = compare(replace(RIVALS, frame=replace(BRIDGE, abutment=None)), huge)
    assert (free.model_end, free.peak_u) == (ModelEnd.OVERTURNS, np.inf)
    assert np.isfinite(restrained.peak_u)


@given(level=st.floats(0.01, 0.99), rate=st.floats(0.5, 5.0))
def test_crossings_lie_between_nodes(level: float, rate: float) -> None:
    time = np.linspace(0.0, 2.0, 200)
    when, speed = first_crossing(time, -np.sin(rate * time), -rate * np.cos(rate * time), level)
    if np.sin(rate * time).max() > level:
        assert when == pytest.approx(np.arcsin(level) / rate, abs=1e-6)
        assert speed == pytest.approx(rate * np.sqrt(1.0 - level**2), abs=1e-3)


@pytest.mark.parametrize("start", [-1.0, 1.0])
def test_what_starts_beyond_the_level_crosses_it_at_once(start: float) -> None:
    time = np.array([0.0, 1.0, 2.0])
    assert first_crossing(time, start * (1.0 - time), np.full(3, -start), 0.5) == (0.0, 1.0)


def test_a_column_alone_has_no_rivals() -> None:
    with pytest.raises(ParameterError, match="is a column without a beam"):
        Rivals(replace(BENT, mass_ratio=0.0))


def test_a_gap_is_closed_by_a_peak_between_two_nodes() -> None:
    time = np.array([0.0, 0.8, 2.2, 3.0])  # the peak of the parabola is 2.25, at 1.5
    when, speed = first_crossing(time, time * (3.0 - time), 3.0 - 2.0 * time, 2.0)
    assert (when, speed) == pytest.approx((1.0, 1.0), rel=1e-12)
    assert math.isnan(first_crossing(time, time * (3.0 - time), 3.0 - 2.0 * time, 2.26)[0])
