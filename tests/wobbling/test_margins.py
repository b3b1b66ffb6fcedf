"""Robust margins of round columns: the plane, shares, scales and directions."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rockframe import (
    Ensemble,
    GroundAcceleration,
    PairAcceleration,
    Pulse,
    RockingFrame,
    wobble,
    wobbling_ensemble,
)
from rockframe.errors import ParameterError
from rockframe.rocking.margins.robust import Grid, robust_margins
from rockframe.units import GRAVITY
from rockframe.wobbling import wobbling_margins

from .cases import solid

COLUMN = solid(7.5, 1.8)
FEW = Ensemble(members=32)
ALONG, ACROSS = (
    Pulse(wavelet="symmetric_ricker", a_p=a_p, T_p=1.5, time=time)
    for a_p, time in ((3.2, 0.0), (2.5, 0.4))
)
MOTION = PairAcceleration.from_pulses(ALONG, ACROSS)
SCALES = ("s10", "s25", "s50")


def test_margins_of_motion_in_one_plane_are_those_of_the_planar_frame() -> None:
    """The members, their losses and the scales are the same, and so are the verdicts."""
    times = np.arange(-4.0, 10.0, 0.01)
    along = ALONG.acceleration(times)
    [[planar]] = robust_margins([GroundAcceleration.from_samples(along, 0.01)], [COLUMN], FEW)
    alone = PairAcceleration(along, 0.0 * along, 0.01)
    [[found]] = wobbling_margins([alone], [COLUMN], FEW, grid=Grid(step=0.01, averaged=4))
    for name in SCALES:
        assert getattr(found, name) == pytest.approx(getattr(planar, name), rel=2e-3)


def test_fewer_overturn_below_the_scales_and_more_above() -> None:
    """Under pulses the share rises from 0 to 1 within a few steps of the search."""
    [[margin]] = wobbling_margins([MOTION], [COLUMN])
    below = wobbling_ensemble(COLUMN, MOTION.scaled(margin.s10 / 1.07)).share_overturned
    above = wobbling_ensemble(COLUMN, MOTION.scaled(margin.s50 * 1.07)).share_overturned
    assert below < 0.10
    assert above > 0.50


def test_scales_of_a_stronger_motion_are_smaller_and_turning_changes_nothing() -> None:
    factor = 1.04**3  # a scale of the search
    [[one], [other], [turned]] = wobbling_margins(
        [MOTION, MOTION.scaled(factor), MOTION.turned(77.0)], [COLUMN], FEW
    )
    for name in SCALES:
        assert getattr(other, name) * factor == pytest.approx(getattr(one, name), rel=0.02)
        assert getattr(turned, name) == pytest.approx(getattr(one, name), rel=0.01)


def test_a_motion_that_lifts_nothing_has_no_margin() -> None:
    still = PairAcceleration(np.zeros(9), np.zeros(9), 0.01)
    [[margin]] = wobbling_margins([still], [COLUMN], FEW)
    assert math.isnan(margin.s10)
    assert margin.responses == 0


def test_a_search_ends_before_the_ground_falls_faster_than_gravity() -> None:
    falling = replace(MOTION, z=np.where(np.arange(MOTION.x.size) == 9, -0.98 * GRAVITY, 0.0))
    [[margin]] = wobbling_margins([falling], [COLUMN], FEW)
    assert math.isnan(margin.s50)


def test_longer_steps_of_members_keep_their_peaks() -> None:
    """Members take longer steps than single responses: peaks differ by less than 1e-6 of alpha."""
    alike = Ensemble(
        members=16, height=0.0, width=0.0, amplitude=0.0, impact_loss=1.0, contact_shortening=1.0
    )
    found = wobbling_ensemble(COLUMN, MOTION, alike)
    one = wobble(COLUMN, MOTION, contact_shortening=1e-4)
    assert_allclose(found.bands.peak_rotation_ratio, one.peak_rotation_ratio, rtol=0.0, atol=1e-6)


def test_margins_are_checked() -> None:
    with pytest.raises(ParameterError, match=r"Invalid largest scale 0\.5\. Must be 1 or more"):
        wobbling_margins([MOTION], [COLUMN], largest_scale=0.5)
    with pytest.raises(ParameterError, match="Must be circular"):
        wobbling_margins([MOTION], [RockingFrame(height=7.5, width=1.8)])


def test_what_the_ensemble_knows_of_another_motion_is_not_used() -> None:
    """Margins take the verdicts of the ensemble at the scale 1, of the same motion and draws."""
    [[alone]] = wobbling_margins([MOTION.scaled(1.25)], [COLUMN], FEW)
    wobbling_ensemble(COLUMN, MOTION, FEW)
    wobbling_ensemble(COLUMN, MOTION.scaled(1.25), Ensemble(members=32, seed=1))
    [[after], [other]] = wobbling_margins([MOTION.scaled(1.25), MOTION], [COLUMN], FEW)
    assert after == alone
    assert other.s10 > alone.s10 * 1.2


def test_a_search_that_begins_where_members_are_known_to_overturn_finds_the_same_scales() -> None:
    strong = MOTION.scaled(1.3)  # some members overturn at the scale 1
    fallen = wobbling_ensemble(COLUMN, strong).overturned
    assert 0 < fallen < Ensemble().members
    [[margin]] = wobbling_margins([strong], [COLUMN])
    steps = [wobbling_ensemble(COLUMN, strong.scaled(1.04**k)).share_overturned for k in (-3, 3)]
    assert steps[0] < 0.10 <= steps[1]
    assert 1.04**-3 < margin.s10 < 1.04**3
