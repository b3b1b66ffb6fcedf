"""The ensemble at the motion: its members are separate responses, its limits are known."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import ArrayLike, NDArray
from scipy.stats import binomtest

from rockframe import (
    Ensemble,
    GroundAcceleration,
    ParameterError,
    Pulse,
    RockingFrame,
    Verdict,
    respond,
    respond_scenarios,
)
from rockframe.frame import crushed
from rockframe.parts import Abutment, Dissipater, Pivot, Tendon
from rockframe.rocking import (
    EnsembleResponse,
    MemberPeaks,
    ensemble_responses,
    member_peaks,
    reactions,
    with_contact,
)
from rockframe.rocking.assessments import share_interval
from rockframe.rocking.margins.ensemble import quantiles
from rockframe.rocking.margins.members import draws, members, surely_rock
from rockframe.rocking.verdict import ModelEnd
from rockframe.structures.contract import require_possible
from rockframe.units import GRAVITY

BENT = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0, name="bent")
COLUMN = RockingFrame(height=9.6, width=1.6, name="column")
TAPERED = RockingFrame(
    height=9.6, width=1.6, top_width=1.2, centre_of_gravity=4.4, mass_ratio=2.0, name="tapered"
)
HEAVY = dataclasses.replace(BENT, column_mass=48e3)
CRUSHED = crushed(HEAVY, Pivot(compressive_strength=30e6, depth=1.4))
TENDON = Tendon(area=1e-3, modulus=195e9, prestress=2e5, yield_stress=1.6e9)
RESTRAINED = dataclasses.replace(HEAVY, tendon=TENDON)
TIED_COLUMN = dataclasses.replace(COLUMN, column_mass=48e3, tendon=TENDON)
BARS = Dissipater(stiffness=5e7, yield_force=1e5, lever_arm=0.8)
HYBRID = dataclasses.replace(RESTRAINED, dissipater=BARS)
FRAMES = [BENT, COLUMN, TAPERED, CRUSHED, RESTRAINED, TIED_COLUMN, HYBRID]
STRONG = Pulse(wavelet="symmetric_ricker", a_p=0.5 * GRAVITY, T_p=1.5)
SMALL = Ensemble(members=16, seed=2)
#: Tolerance of both kernels: a rocking response amplifies their last bits.
CLOSE = 1e-6
#: All members are the stated structure under the stated motion.
SAME = Ensemble(members=16, height=0.0, width=0.0, impact_loss=1.0, amplitude=0.0)


def rough(seed: int, peak: float = 3.0) -> GroundAcceleration:
    """Return a motion of 8 s that makes all frames rock, and some of them bounce."""
    rng = np.random.default_rng(seed)
    samples = np.convolve(rng.standard_normal(800), np.hanning(25), mode="same")
    motion = GroundAcceleration.from_samples(peak * samples / np.abs(samples).max(), 0.01)
    return motion.followed_by_rest(20.0)


LIFTED = rough(1).with_vertical(rough(2, 3.0))


def test_members_are_separate_responses() -> None:
    frames = [*FRAMES, RockingFrame(height=2.0, width=0.5, mass_ratio=1.0, name="small")]
    for motion in (rough(3), LIFTED):
        peaks = member_peaks([motion], frames, SMALL)
        for k, frame in enumerate(frames):
            factors = draws(SMALL)[:, 3].tolist()
            for j, (member, factor) in enumerate(zip(members(SMALL, frame), factors, strict=True)):
                ground = motion.scaled(factor)
                response = with_contact(respond(member, ground), ground)
                forces = reactions(response, ground)
                assert peaks.verdict[0, k, j] == response.verdict == Verdict.STANDS
                tied, contact = response.restraint, response.contact
                assert contact is not None
                friction = [contact.base_friction_demand, contact.impact_friction_demand]
                friction += [contact.top_friction_demand] if frame.mass_ratio > 0.0 else []
                shear = np.abs(forces.support_shear).max() / (1.0 + frame.mass_ratio)
                speed = np.abs(response.impact_velocities).max() * member.width
                values_of = {name: values[0, k, j] for name, values in peaks.peaks.items()}
                assert_allclose(
                    values_of["peak_rotation_ratio"], response.peak_rotation_ratio, rtol=CLOSE
                )
                assert_allclose(values_of["peak_u"], response.peak_u, rtol=CLOSE)
                assert_allclose(values_of["peak_v"], response.peak_v, rtol=CLOSE)
                assert_allclose(values_of["peak_impact_velocity"], speed, rtol=CLOSE)
                assert_allclose(values_of["peak_base_shear"], shear, rtol=CLOSE)
                assert_allclose(values_of["friction_demand"], max(friction), rtol=CLOSE)
                assert_allclose(
                    values_of["peak_tendon_force"],
                    math.nan if tied is None else tied.peak_tendon_force,
                    rtol=CLOSE,
                )
                bars = math.nan
                if frame.dissipater is not None and tied is not None:
                    bars = np.abs(tied.dissipater_force).max()
                # a node may miss the largest rotation
                assert_allclose(values_of["peak_dissipater_force"], bars, rtol=1e-3)


def test_frames_that_stay_at_rest_lean_like_fixed_bodies() -> None:
    weak = LIFTED.scaled(0.05)
    peaks = member_peaks([weak], FRAMES, SAME)
    assert (peaks.verdict == Verdict.NO_UPLIFT).all()
    for k, frame in enumerate(FRAMES):
        forces = reactions(respond(frame, weak), weak)
        assert_allclose(peaks.peaks["friction_demand"][0, k], forces.base_friction_demand.max())
        assert_allclose(
            peaks.peaks["peak_base_shear"][0, k], np.abs(weak.acceleration()).max() / GRAVITY
        )
        assert not peaks.peaks["peak_rotation_ratio"][0, k].any()


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_vertical_motion_at_rest_counts(sign: float) -> None:
    """Heavier by the vertical motion, the frame carries more shear at rest than later, rocking."""
    time = np.linspace(0.0, 4.0, 401)
    across = GRAVITY * (0.2 * (np.abs(time - 1.0) < 0.2) + 0.17 * (np.abs(time - 3.0) < 0.05))
    upwards = 0.9 * GRAVITY * (np.abs(time - 1.0) < 0.3)
    _assert_shear_of_the_push(sign * across, upwards)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_push_of_the_last_sample_counts_at_rest(sign: float) -> None:
    """The frame has rocked before, but a motion that ends with a push asks for more shear."""
    time = np.linspace(0.0, 4.0, 401)
    across = GRAVITY * (0.17 * (np.abs(time - 1.0) < 0.05) + 0.2 * (time == time[-1]))
    _assert_shear_of_the_push(sign * across, 0.9 * GRAVITY * (time > 3.5))


def _assert_shear_of_the_push(across: ArrayLike, upwards: ArrayLike) -> None:
    """Compare with the largest push, 0.2 g, and with the forces of the history."""
    motion = GroundAcceleration.from_samples(across, 0.01).with_vertical(
        GroundAcceleration.from_samples(upwards, 0.01)
    )
    peaks = member_peaks([motion], [BENT], SAME)
    forces = reactions(respond(BENT, motion), motion)
    assert (peaks.verdict == Verdict.STANDS).all()
    assert_allclose(peaks.peaks["peak_base_shear"], np.abs(forces.support_shear).max() / 5.0)
    assert_allclose(peaks.peaks["peak_base_shear"], 0.2)


def test_without_spreads_all_members_are_the_stated_structure() -> None:
    for motion in (rough(3), LIFTED, STRONG):
        peaks = member_peaks([motion], FRAMES, SAME)
        count = np.arange(len(FRAMES))
        alone = respond_scenarios([motion], FRAMES, 0 * count, count, np.ones(count.size))
        standing = alone.verdict != Verdict.OVERTURNS
        for values in peaks.peaks.values():
            each = values[0]
            assert_array_equal(each, np.repeat(each[:, :1], SAME.members, axis=1))
        assert_array_equal(peaks.verdict[0, :, 0], alone.verdict)
        assert_array_equal(
            peaks.peaks["peak_rotation_ratio"][0, standing, 0], alone.peak_rotation_ratio[standing]
        )
        assert_array_equal(
            peaks.peaks["peak_impact_velocity"][0, standing, 0], alone.impact_velocity[standing]
        )


@pytest.mark.parametrize("stated", [0.9, 1.0, 1.02])
def test_the_loss_of_impacts_is_between_half_and_twice_that_of_the_structure(
    stated: float,
) -> None:
    alone = Ensemble(height=0.0, width=0.0, amplitude=0.0)
    for frame in FRAMES[:4]:
        frame = dataclasses.replace(frame, restitution_factor=stated)
        lost = np.array([-math.log(member.restitution) for member in members(alone, frame)])
        factor = draws(alone)[:, 2]
        assert_allclose(lost, -factor * math.log(frame.restitution), rtol=1e-12)
        assert_allclose((factor.min(), factor.max()), (0.5, 2.0), rtol=0.025)
        assert 0.45 < (factor < 1.0).mean() < 0.55


def test_all_motions_and_structures_have_the_same_draws() -> None:
    motions: list[GroundAcceleration | Pulse] = [rough(1), rough(2), STRONG]
    frames = [BENT, COLUMN, TIED_COLUMN, HYBRID]
    together = member_peaks(motions, frames, SMALL)
    for i, motion in enumerate(motions):
        for k, frame in enumerate(frames):
            alone = member_peaks([motion], [frame], SMALL)
            for whole, first in zip(_arrays(together), _arrays(alone), strict=True):
                assert_array_equal(whole[..., i, k, :], first[..., 0, 0, :])


def _arrays(peaks: MemberPeaks) -> list[NDArray[Any]]:
    return [peaks.verdict, peaks.limits_reached, *peaks.peaks.values()]


def test_shares_reach_their_limits() -> None:
    [[none]] = ensemble_responses([rough(1).scaled(0.01)], [BENT])
    [[some]] = ensemble_responses([rough(1)], [BENT])
    [[every]] = ensemble_responses([rough(1, 40.0)], [BENT])
    assert (none.uplifted, none.overturned) == (0, 0)
    assert (some.share_uplifted, some.share_overturned) == (1.0, 0.0)
    assert (every.share_overturned, every.share_overturned_high) == (1.0, 1.0)
    assert every.bands.peak_u == (math.inf,) * 3
    assert all(math.isnan(bound) for bound in every.bands.peak_tendon_force)


@pytest.mark.parametrize(
    ("count", "size"), [(0, 64), (1, 64), (20, 64), (64, 64), (7, 16), (999, 2000)]
)
def test_the_interval_is_that_of_clopper_and_pearson(count: int, size: int) -> None:
    exact = binomtest(count, size).proportion_ci(confidence_level=0.9, method="exact")
    assert_allclose(share_interval(count, size), (exact.low, exact.high), rtol=1e-10, atol=1e-12)
    bands = ensemble_responses([STRONG], [BENT])[0][0].bands
    response = EnsembleResponse(size, size, count, None, bands)
    limits = response.share_overturned_low, response.share_overturned_high
    assert limits == share_interval(count, size)


def test_quantiles_count_members_that_overturn_as_the_largest() -> None:
    finite = np.random.default_rng(0).uniform(size=(3, 64))
    assert_allclose(quantiles(finite), np.quantile(finite, (0.16, 0.5, 0.84), axis=-1).T)
    fallen = np.where(np.arange(64) < 20, np.inf, finite)
    low, median, high = quantiles(fallen)[0]
    standing = np.sort(fallen[0])[:44]
    assert_allclose((low, median), np.interp([0.16 * 63, 0.5 * 63], np.arange(44), standing))
    assert math.isinf(high)
    # the median of 64 members is between members 32 and 33: one that overturns there decides
    half = np.where(np.arange(64) < 32, np.inf, finite)
    assert math.isinf(quantiles(half)[0, 1])
    assert np.isinf(quantiles(np.full(64, np.inf))).all()


def test_the_model_ends_where_a_member_reaches_a_limit() -> None:
    motion = rough(3)
    [[free]] = ensemble_responses([motion], [BENT])
    assert free.model_ends is None
    assert math.isnan(free.share_model_ends)
    u, v = member_peaks([motion], [BENT], Ensemble()).peaks["peak_u"], free.bands.peak_v
    gap = float(np.sort(u.ravel())[40])
    joint = dataclasses.replace(BENT, abutment=Abutment(gap=gap))
    [[closed]] = ensemble_responses([motion], [joint])
    assert closed.model_ends == 24  # of 64: those from the 41st on
    assert (free.model_end, closed.model_end) == (ModelEnd.NONE, ModelEnd.GAP_CLOSES)
    lifted = dataclasses.replace(BENT, abutment=Abutment(gap=10.0, uplift_allowance=0.9 * v[0]))
    [[raised]] = ensemble_responses([motion], [lifted])
    assert raised.share_model_ends > 0.8
    assert raised.model_end is ModelEnd.LIFT_EXCEEDED
    pulled = member_peaks([motion], [RESTRAINED], Ensemble()).peaks["peak_tendon_force"]
    weak = dataclasses.replace(TENDON, yield_stress=float(np.median(pulled)) / TENDON.area)
    for loses, expected in ((False, 32), (True, None)):
        tendon = dataclasses.replace(weak, loses_prestress=loses)
        yields = dataclasses.replace(RESTRAINED, tendon=tendon)
        [[tied]] = ensemble_responses([motion], [yields])
        assert tied.model_ends == expected
        assert (tied.model_end is ModelEnd.TENDON_YIELDS) == (expected is not None)


def test_members_with_bars_alone_have_no_tendon_force() -> None:
    barred = dataclasses.replace(RESTRAINED, tendon=None, dissipater=BARS)
    peaks = member_peaks([rough(3)], [barred], Ensemble(members=16))
    assert np.isnan(peaks.peaks["peak_tendon_force"]).all()
    assert (peaks.peaks["peak_dissipater_force"] > 0.0).all()


def test_no_loss_of_impacts_makes_a_member_impossible() -> None:
    """A member of a block of 45 degrees, of which an impact takes three quarters, keeps some."""
    cube = RockingFrame(height=3.0, width=3.0)
    assert cube.restitution == pytest.approx(0.25)
    kept = [member.restitution for member in members(Ensemble(impact_loss=10.0), cube)]
    assert 0.0 < min(kept) < 1e-5
    assert 0.8 < max(kept) < 1.0


def test_impossible_members_name_the_spread_and_the_value() -> None:
    stocky = RockingFrame(height=3.0, width=4.0, name="stocky")
    with pytest.raises(ParameterError, match=r"spread width 0\.2 of .*'stocky'.*width 4\.\d+ m"):
        member_peaks([STRONG], [stocky], Ensemble(width=0.2, impact_loss=1.0))
    with pytest.raises(ParameterError, match=r"spread height 0\.3 of .*height 2\.\d+ m"):
        member_peaks([STRONG], [stocky], Ensemble(height=0.3, impact_loss=1.0))
    with pytest.raises(ParameterError, match=r"spread height 0\.05 and width 0\.05 of"):
        member_peaks([STRONG], [stocky], Ensemble(height=0.05, width=0.05, impact_loss=1.0))
    falling = LIFTED.with_vertical(rough(2, 0.99 * GRAVITY))
    respond(BENT, falling)  # the motion itself is possible
    with pytest.raises(ParameterError, match=r"spread amplitude 0\.1 .*1\.\d+ times the motion"):
        member_peaks([falling], [BENT], Ensemble(amplitude=0.1))


#: Frames near a limit: of slenderness, of the size, of the moment of tendons, and of the inertia.
NEAR_LIMITS = [
    RockingFrame(height=3.0, width=4.0, name="stocky"),
    RockingFrame(height=0.003, width=0.0011, name="short"),
    dataclasses.replace(RESTRAINED, column_mass=20.0, name="light"),
    RockingFrame(height=9.6, width=1.6, inertia_ratio=1.02, section="circular", name="pendulum"),
]


SPREADS = st.sampled_from([0.0, 0.02, 0.1, 0.2, 0.5, 0.9])


@settings(max_examples=20)
@given(height=SPREADS, width=SPREADS, loss=st.floats(1.0, 10.0))
def test_all_members_of_frames_that_surely_rock_can_be_made(
    height: float, width: float, loss: float
) -> None:
    """The check of all members together accepts no frame that has an impossible member."""
    ensemble = Ensemble(members=16, height=height, width=width, impact_loss=loss)
    for frame in [*FRAMES, *NEAR_LIMITS]:
        if surely_rock(ensemble, frame):
            members(ensemble, frame)


def test_usual_frames_surely_rock_and_others_are_refused() -> None:
    """Usual frames are accepted without making their members. Near a limit these are made."""
    assert all(surely_rock(Ensemble(), frame) for frame in FRAMES)
    require_possible(NEAR_LIMITS, Ensemble())
    for frame in NEAR_LIMITS:
        with pytest.raises(ParameterError, match=f"the ensemble of frame '{frame.name}': member"):
            require_possible([frame], Ensemble(height=0.5, width=0.5))


@pytest.mark.parametrize("count", [1, 15])
def test_too_few_members_are_refused(count: int) -> None:
    with pytest.raises(ParameterError, match=rf"members {count}\. Must be 0, or at least 16"):
        Ensemble(members=count)
    assert Ensemble(members=16).members == 16


def test_no_members_have_no_response() -> None:
    with pytest.raises(ParameterError, match="number of members 0 of"):
        ensemble_responses([STRONG], [BENT], Ensemble(members=0))


def test_the_last_sample_counts() -> None:
    """A ramp pushes hardest at its end, where the frames rock: the joints need most friction."""
    ramp = GroundAcceleration.from_samples(np.linspace(0.0, 0.3 * GRAVITY, 51), 0.01)
    level = GroundAcceleration.from_samples(np.linspace(0.0, -0.2 * GRAVITY, 51), 0.01)
    for motion in (ramp, ramp.with_vertical(level)):
        peaks = member_peaks([motion], FRAMES, SAME)
        for k, frame in enumerate(FRAMES):
            response = respond(frame, motion)
            assert response.verdict == Verdict.STANDS
            forces = reactions(response, motion)
            demand = forces.base_friction_demand
            if frame.mass_ratio > 0.0:
                demand = np.maximum(demand, forces.top_friction_demand)
            assert demand.argmax() == 50
            assert_allclose(peaks.peaks["friction_demand"][0, k], demand[50], rtol=CLOSE)
            shear = np.abs(forces.support_shear).max() / (1.0 + frame.mass_ratio)
            assert_allclose(peaks.peaks["peak_base_shear"][0, k], shear, rtol=CLOSE)
