"""Forces are those until the model ends: what a stronger motion does later does not count."""

from __future__ import annotations

from dataclasses import astuple, replace

import numpy as np
import pytest
from tests.rocking.motions import BENT

from rockframe import Ensemble, GroundAcceleration, IsolatedDeck, Record, Rivals, compare, respond
from rockframe.figures.joints import draw_joints
from rockframe.parts import Abutment, Tendon
from rockframe.rocking import draws, joint_forces, members
from rockframe.rocking.contact import with_contact
from rockframe.rocking.margins.ensemble import member_peaks
from rockframe.structures.screening import quantities_of
from rockframe.units import GRAVITY

STEP = 0.01
#: A second of 1 Hz that closes the gap; after 3 s at rest, stronger and shorter strokes.
SAMPLES = GRAVITY * np.concatenate(
    [
        0.35 * np.sin(2.0 * np.pi * STEP * np.arange(100)),
        np.zeros(300),
        0.9 * np.sin(2.0 * np.pi * 5.0 * STEP * np.arange(40)),
        np.zeros(100),
    ]
)
MOTION = GroundAcceleration.from_samples(SAMPLES, STEP)
FREE = replace(BENT, column_mass=48e3)
GAP = Abutment(gap=0.02)
JOINED = replace(FREE, abutment=GAP)
TENDON = Tendon(area=1e-3, modulus=195e9, length=9.6, prestress=1e5)


def cut(when: float) -> GroundAcceleration:
    """Return the motion up to the last node before a time."""
    return GroundAcceleration.from_samples(SAMPLES[: int(when / STEP) + 1], STEP)


def test_forces_are_those_of_the_motion_until_the_gap_closes() -> None:
    response = respond(JOINED, MOTION)
    assert 0.0 < response.gap_closed_time < 1.5
    before = cut(response.gap_closed_time)
    expected = joint_forces(respond(FREE, before), before)
    assert astuple(joint_forces(response, MOTION)) == pytest.approx(astuple(expected), nan_ok=True)
    demand = with_contact(respond(FREE, before), before).contact
    contact = with_contact(response, MOTION).contact
    assert demand is not None
    assert contact is not None
    assert astuple(contact) == pytest.approx(astuple(demand), nan_ok=True)
    whole = joint_forces(respond(FREE, MOTION), MOTION)
    assert whole.peak_base_shear > 1.02 * expected.peak_base_shear
    assert whole.base_joint_vertical > 1.05 * expected.base_joint_vertical
    assert whole.base_impulse_vertical > expected.base_impulse_vertical == 0.0


def test_a_tendon_pulls_as_at_the_closed_gap_in_responses_members_and_screenings() -> None:
    tied = replace(JOINED, tendon=TENDON)
    response = respond(tied, MOTION)
    assert response.restraint is not None
    assert response.peak_u > 1.5 * GAP.gap
    closed = tied.abutment_rotation
    assert tied.horizontal_displacement(closed) == pytest.approx(GAP.gap, rel=1e-12)
    force = response.restraint.peak_tendon_force
    assert force == tied.tension(closed)
    nodes = response.time <= response.gap_closed_time
    assert response.restraint.tendon_force[nodes].max() == pytest.approx(force, rel=0.05)
    weak = replace(tied, tendon=replace(TENDON, yield_stress=1e9))
    rotation = np.array([[response.peak_rotation]])
    peaks = quantities_of([weak], np.array([[1]], np.int8), rotation, rotation)
    assert peaks["peak_tendon_ratio"][0, 0] == pytest.approx(force / 1e6)
    peaks_of_members = member_peaks([MOTION], [tied], Ensemble(members=16))
    assert peaks_of_members.peaks["peak_tendon_force"].max() < 1.1 * force


def test_the_members_of_an_ensemble_have_the_forces_until_their_gap_closes() -> None:
    ensemble = Ensemble(members=16)
    peaks = member_peaks([MOTION], [JOINED], ensemble)
    assert peaks.limits_reached[0].any()
    for k, member in enumerate(members(ensemble, JOINED)):
        ground = MOTION.scaled(float(draws(ensemble)[k, 3]))
        alone = joint_forces(respond(member, ground), ground)
        shear = peaks.peaks["peak_base_shear"][0, 0, k]
        assert shear == pytest.approx(alone.peak_base_shear, rel=1e-6)


def test_bridges_are_compared_by_their_forces_until_their_model_ends() -> None:
    deck = IsolatedDeck.friction_pendulum(radius=2.5, friction=0.05)
    for model in compare(Rivals(JOINED, isolated=deck), MOTION):
        assert model.valid_until < 1.5
        shear = np.abs(model.base_shear)
        assert model.peak_base_shear == shear[model.time <= model.valid_until].max()
        assert model.peak_base_shear < 0.99 * shear.max()


def test_the_figure_of_the_joints_ends_with_the_model() -> None:
    record = Record(record_id="a", acceleration=SAMPLES, time_step=STEP)
    drawn = draw_joints(record, JOINED)
    end = respond(JOINED, MOTION).gap_closed_time
    for panel in drawn.figure.axes:
        assert np.asarray(panel.get_lines()[0].get_xdata(), dtype=float)[-1] <= end
    assert f"until the model ends: gap closes {end:.2f} s" in drawn.caption
    assert "model ends" not in draw_joints(record, FREE).caption
