"""Wrong input is refused in one line that says what is allowed."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from rockframe import (
    Abutment,
    Dissipater,
    Ensemble,
    PairAcceleration,
    Pivot,
    RockingFrame,
    Tendon,
    crushed,
    read_file,
    wobble,
    wobbling_ensemble,
)
from rockframe.components import pair_horizontals
from rockframe.errors import ParameterError
from rockframe.record import Orientation

from .cases import solid

COLUMN = replace(solid(7.5, 1.8), column_mass=50e3)
STILL = PairAcceleration(np.zeros(2), np.zeros(2), 0.01)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"x": [0.0, np.nan]}, "Invalid acceleration x, nan at sample 1. Must be finite"),
        ({"y": [0.0, np.inf]}, "Invalid acceleration y, inf at sample 1"),
        ({"y": [0.0, 0.0, 0.0]}, "acceleration y of 3 samples. Must have 2, as x"),
        ({"z": [0.0]}, "Invalid acceleration z of shape"),
        ({"x": [[0.0, 0.0]]}, r"Invalid acceleration x of shape \(1, 2\)"),
        ({"time_step": 0.0}, "Invalid time step 0.0 s. Must be positive"),
        ({"time_step": np.nan}, "Invalid time step nan s"),
        ({"start_time": np.inf}, "Invalid start time inf s"),
    ],
)
def test_motions_are_checked(change: dict[str, Any], words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        replace(STILL, **change)


@pytest.mark.parametrize(
    ("frame", "words"),
    [
        (RockingFrame(height=7.5, width=1.8), "section rectangular of the columns.*Must be circul"),
        (replace(COLUMN, section=None, inertia_ratio=1.335), "Invalid section unknown"),
        (replace(COLUMN, inertia_ratio=1.2), "Invalid inertia_ratio 1.2 of frame.*above 1.31"),
        (
            replace(COLUMN, dissipater=Dissipater(stiffness=1e7, yield_force=1e5, lever_arm=0.9)),
            "with dissipaters",
        ),
        (replace(COLUMN, abutment=Abutment(gap=0.3)), "with an abutment"),
        (crushed(COLUMN, Pivot(compressive_strength=30e6, depth=1.4)), "with crushed edges"),
        (
            replace(
                COLUMN,
                tendon=Tendon(area=1e-3, modulus=2e11, yield_stress=1e9, loses_prestress=True),
            ),
            "with tendons that lose prestress",
        ),
    ],
)
def test_frames_of_other_kinds_are_refused_by_name(frame: RockingFrame, words: str) -> None:
    for refused in (wobble, wobbling_ensemble):
        with pytest.raises(ParameterError, match=words):
            refused(frame, STILL)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"contact_shortening": -1e-4}, "Invalid contact_shortening -0.0001.*zero or above"),
        ({"start": (0.1, 0.0)}, "Invalid start .*four finite numbers"),
        ({"start": (2.0, 0.0, 0.0, 0.0)}, "Invalid start .*below pi/2"),
        ({"start": (0.0, 1.0, 0.0, 0.0)}, "upright with a rate"),
    ],
)
def test_options_are_checked(options: dict[str, Any], words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        wobble(COLUMN, STILL, **options)


def test_the_ground_must_not_fall_faster_than_gravity() -> None:
    falling = replace(STILL, z=np.full(2, -9.8))
    assert wobble(COLUMN, falling).peak_rotation == 0.0
    with pytest.raises(ParameterError, match="lose contact"):
        wobble(COLUMN, falling.scaled(1.01))
    with pytest.raises(ParameterError, match="lose contact"):
        wobbling_ensemble(COLUMN, falling)  # some members have 1.01 times the motion


def test_ensembles_are_checked() -> None:
    with pytest.raises(ParameterError, match="number of members 0"):
        wobbling_ensemble(COLUMN, STILL, Ensemble(members=0))
    with pytest.raises(ParameterError, match=r"contact_shortening 0\.5.*at least 1"):
        Ensemble(contact_shortening=0.5)


def test_other_motions_are_refused(bundled_records: Any) -> None:
    with pytest.raises(ParameterError, match="Invalid motion of type list"):
        wobble(COLUMN, [0.0, 1.0])  # type: ignore[arg-type]
    [pair], _ = pair_horizontals(read_file(bundled_records / "Ridgecrest2019-CCC.V1"))
    with pytest.raises(ParameterError, match="Missing vertical component"):
        PairAcceleration.from_pair(replace(pair, vertical=None), vertical=True)


def test_the_sense_of_a_vertical_component_is_that_of_its_orientation(bundled_records: Any) -> None:
    [pair], _ = pair_horizontals(read_file(bundled_records / "Ridgecrest2019-CCC.V1"))
    assert pair.vertical is not None
    downward = replace(
        pair.vertical,
        acceleration=-pair.vertical.acceleration,
        orientation=Orientation.DOWNWARD,
    )
    up, down = (
        PairAcceleration.from_pair(replace(pair, vertical=one), vertical=True)
        for one in (pair.vertical, downward)
    )
    np.testing.assert_array_equal(up.in_g(), down.in_g())


def test_the_section_for_both_directions_is_that_of_the_wobbling_column_alone() -> None:
    """The plane keeps the paper's rectangle; both directions have the cylinder."""
    rectangular = RockingFrame(height=7.5, width=1.8, section_both="circular")
    assert rectangular.inertia_ratio == RockingFrame(height=7.5, width=1.8).inertia_ratio
    pulse = 3.2 * np.sin(np.arange(0.0, 4.0, 0.02) * 2.0 * np.pi / 1.5)
    motion = PairAcceleration(pulse, 0.7 * np.roll(pulse, 20), 0.02)
    one, other = wobble(rectangular, motion), wobble(solid(7.5, 1.8), motion)
    assert one.peak_rotation == other.peak_rotation > 0.05
    assert one.frame.column_section == "circular"
    larger = rectangular.resized(15.0, 3.6).in_both_directions
    assert larger.inertia_ratio == pytest.approx(solid(7.5, 1.8).inertia_ratio, rel=1e-14)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            {"section_both": "rectangular"},
            "section_both 'rectangular'.*Must be circular, or absent",
        ),
        ({"top_width": 1.5}, "Must be absent unless the columns are solid, prismatic and rectangu"),
        ({"inertia_ratio": 1.4}, "state the section alone"),
        ({"section": "circular"}, "state the section alone"),
    ],
)
def test_the_section_for_both_directions_is_checked(change: dict[str, Any], words: str) -> None:
    column = RockingFrame(height=7.5, width=1.8, section_both="circular")
    with pytest.raises(ParameterError, match=words):
        replace(column, **change)
