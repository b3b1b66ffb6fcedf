"""Nominal responses of many frames at once are those of one response after the other."""

from __future__ import annotations

import math
from dataclasses import asdict, replace

import numpy as np
import pytest

from rockframe import Abutment, GroundAcceleration, Pulse, Record, RockingFrame, Tendon, respond
from rockframe.rocking import Verdict, nominal_responses, with_contact, with_pulse

PULSE = Pulse(wavelet="antisymmetric_ricker", a_p=3.0, T_p=1.2, time=4.0)
FRAMES = [
    RockingFrame(height=9.6, width=1.6, mass_ratio=4.0, beam_depth=1.5, name="bent"),
    RockingFrame(height=9.6, width=1.6, name="column"),
    RockingFrame(height=4.0, width=0.4, mass_ratio=1.0, top_width=0.3, name="tapered"),
    RockingFrame(height=2.0, width=1.5, mass_ratio=2.0, beam_depth=0.5, name="stout"),
    RockingFrame(height=20.0, width=2.6, mass_ratio=8.0, restitution_factor=0.9, name="tall"),
]


def record(time_step: float = 0.01, *, strength: float = 1.0, name: str = "shake") -> Record:
    """Return a motion of several pulses, which moves on after the first sample."""
    time = time_step * np.arange(round(14.0 / time_step))
    samples = PULSE.acceleration(time) + 0.4 * PULSE.acceleration(time - 3.0)
    samples += 0.3 * np.sin(9.0 * time) * np.exp(-0.3 * time)
    return Record(record_id=name, acceleration=strength * samples, time_step=time_step)


#: Of the same frames: weak, moderate, strong, and sampled so that intervals are divided.
MOTIONS = [record(strength=strength) for strength in (0.1, 0.8, 1.0, 1.3, 2.5)] + [record(0.04)]


def test_values_are_those_of_single_responses() -> None:
    """Both kernels integrate one equation: they agree to round-off in values, times and forces."""
    verdicts = set()
    together = nominal_responses(MOTIONS, FRAMES, [PULSE] * len(MOTIONS))
    assert together is not None
    for motion, found in zip(MOTIONS, together, strict=True):
        for frame, response, u in zip(FRAMES, found.responses(), found.peak_u, strict=True):
            alone = with_pulse(with_contact(respond(frame, motion), motion), PULSE)
            verdicts.add(response.verdict)
            assert response.verdict is alone.verdict
            assert response.impacts == alone.impacts
            for name in ("peak_rotation", "peak_time", "uplift_time", "overturning_time"):
                mine, theirs = getattr(response, name), getattr(alone, name)
                assert mine == pytest.approx(theirs, abs=5e-10, rel=0, nan_ok=True), name
            assert u == pytest.approx(alone.peak_u, abs=5e-10)
            assert response.contact is not None
            assert alone.contact is not None
            assert response.to_pulse is not None
            assert alone.to_pulse is not None
            for part, other in (
                (response.contact, alone.contact),
                (response.to_pulse, alone.to_pulse),
            ):
                assert asdict(part) == pytest.approx(asdict(other), abs=5e-10, nan_ok=True)
    assert verdicts == {Verdict.NO_UPLIFT, Verdict.STANDS, Verdict.OVERTURNS}


def test_results_do_not_depend_on_the_others() -> None:
    """Each response has the same bits alone as among others."""
    together = nominal_responses(MOTIONS, FRAMES)
    alone = nominal_responses(MOTIONS[2:3], FRAMES[:1])
    assert together is not None
    assert alone is not None
    assert together[2].responses()[0].peak_rotation == alone[0].responses()[0].peak_rotation
    for name, values in alone[0].contact.items():
        assert np.array_equal(values, together[2].contact[name][:1], equal_nan=True), name


def test_ground_that_begins_with_a_jump_uplifts_at_the_first_sample() -> None:
    """The forces of that instant count: the frame already turns, though it has not yet moved."""
    frame = FRAMES[0]
    samples = np.concatenate([[3.0], np.linspace(2.0, 0.0, 50), np.zeros(400)])
    jump = Record(record_id="jump", acceleration=samples, time_step=0.01)
    found = nominal_responses([jump], [frame])
    assert found is not None
    demand = with_contact(respond(frame, jump), jump).contact
    assert demand is not None
    values = {name: float(values[0]) for name, values in found[0].contact.items()}
    assert values == pytest.approx(asdict(demand), abs=5e-10, nan_ok=True)


def test_frames_at_rest_need_the_friction_of_the_ground() -> None:
    """A frame that does not uplift is fixed to the ground: |a| / g, and the static forces."""
    weak = record(strength=0.1)
    found = nominal_responses([weak], FRAMES[:1])
    assert found is not None
    friction = float(np.abs(weak.acceleration).max()) / 9.81
    assert found[0].contact["base_friction_demand"] == pytest.approx(friction, rel=1e-12)
    assert found[0].contact["top_friction_demand"] == pytest.approx(friction, rel=1e-12)
    assert found[0].contact["least_base_vertical"].tolist() == [1.0]
    assert math.isnan(found[0].contact["impact_friction_demand"][0])


def test_other_frames_and_motions_are_left_to_respond() -> None:
    """Ties, abutments, vertical motion and smooth motion need histories or other sums."""
    tendon = Tendon(area=2.8e-4, modulus=195e9, prestress=94.7e3)
    tied = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0, column_mass=5e4, tendon=tendon)
    near = replace(FRAMES[0], abutment=Abutment(gap=0.1))
    ground = GroundAcceleration.from_samples([0.0, 1.0, 0.0], 0.1)
    for frame in (tied, near):
        assert nominal_responses([ground], [FRAMES[0], frame]) is None
    assert nominal_responses([ground.with_vertical(ground)], FRAMES) is None
    assert nominal_responses([PULSE], FRAMES) is None
