"""Sequences of motions: what a frame forgets at rest, and what it keeps."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import cast

import numpy as np
import pytest
from numpy.typing import NDArray

from rockframe import Part, Record, RockingFrame, crushed, in_sequence, respond, with_parts
from rockframe.errors import ParameterError, RockframeWarning
from rockframe.parts import Dissipater, Pivot, Tendon
from rockframe.record import Orientation
from rockframe.rocking import GroundAcceleration, Response, as_ground
from rockframe.rocking.kernels import kernel
from rockframe.rocking.kernels.ties import Pair
from rockframe.rocking.response import ties_of
from rockframe.units import GRAVITY

STEP = 0.02


def motion(name: str, a_p: float, period: float, step: float = STEP) -> Record:
    """Return a Ricker pulse of 12 s [g, s], which begins and ends with a sample of zero."""
    phase = math.pi * (step * np.arange(round(12.0 / step) + 1) - 6.0) / period
    samples = a_p * GRAVITY * (1.0 - 2.0 * phase**2) * np.exp(-(phase**2))
    samples[[0, -1]] = 0.0
    return Record(record_id=name, acceleration=samples, time_step=step)


MAIN, AFTER = motion("main", 0.5, 1.5), motion("after", 0.4, 1.2)
BENT = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0, column_mass=48e3, name="bent")
ELASTIC = Tendon(area=2.8e-4, modulus=195e9, prestress=94.7e3)
BARS = Dissipater(stiffness=5e7, yield_force=1e5, lever_arm=0.8)
#: Loses a part of its prestress under the first motion.
YIELDING = Tendon(
    area=2.8e-4,
    modulus=195e9,
    length=20.0,
    prestress=300e3,
    yield_stress=1.66e9,
    loses_prestress=True,
)
FORGETFUL = {
    "free": BENT,
    "crushed": crushed(BENT, Pivot(compressive_strength=30e6, depth=1.4)),
    "elastic": replace(BENT, tendon=ELASTIC),
}
MINDFUL = {"bars": replace(BENT, dissipater=BARS), "yielding": replace(BENT, tendon=YIELDING)}


def to_sequence(frame: RockingFrame, *records: Record, rest: float = 90.0) -> Response:
    both = in_sequence(records, rest)
    return with_parts(respond(frame, both), both.parts)


def nodes_of(part: Part) -> slice:
    first = round(part.start / STEP)
    return slice(first, first + round((part.end - part.start) / STEP) + 1)


def test_a_sequence_of_one_record_is_the_record() -> None:
    assert in_sequence([MAIN], 90.0) is MAIN


def test_the_other_direction_has_the_same_peaks() -> None:
    """The peak of the second motion lies between two nodes."""
    first, other = (to_sequence(BENT, MAIN.scaled(s), AFTER.scaled(s)) for s in (1.0, -1.0))
    ours, theirs = (
        [part.peak_rotation_ratio for part in response.parts] for response in (first, other)
    )
    assert ours == theirs


@pytest.mark.parametrize("name", FORGETFUL)
def test_a_frame_without_memory_responds_to_each_motion_as_if_alone(name: str) -> None:
    """It begins each motion at rest, and nothing else of its past enters eq (26)."""
    frame = FORGETFUL[name]
    response = to_sequence(frame, MAIN, AFTER)
    for part, record in zip(response.parts, (MAIN, AFTER), strict=True):
        alone = respond(frame, record)
        within = response.theta[nodes_of(part.part)]
        assert np.abs(within - alone.theta).max() < 1e-13
        assert part.start_rotation_ratio == 0.0
        assert part.peak_rotation_ratio == pytest.approx(alone.peak_rotation_ratio, rel=1e-7)
        assert part.peak_u == pytest.approx(alone.peak_u, rel=1e-7)


def test_the_largest_peak_of_the_motions_is_that_of_the_sequence() -> None:
    response = to_sequence(BENT, AFTER, MAIN)
    assert max(part.peak_rotation_ratio for part in response.parts) == response.peak_rotation_ratio


def peaks(frame: RockingFrame, *records: Record) -> dict[str, float]:
    parts = to_sequence(frame, *records).parts
    return {part.part.record_id: part.peak_rotation_ratio for part in parts}


@pytest.mark.parametrize("name", [*FORGETFUL, *MINDFUL])
def test_order_matters_only_with_memory(name: str) -> None:
    frame = {**FORGETFUL, **MINDFUL}[name]
    first, other = peaks(frame, MAIN, AFTER), peaks(frame, AFTER, MAIN)
    differs = any(abs(first[record] - other[record]) > 1e-3 for record in first)
    assert differs == (name in MINDFUL)


def test_bars_keep_their_stretch() -> None:
    """A plastic stretch only shifts the force of a bar at rest (re-derived).

    So the second response is that of a frame whose bars have at rest the force that the first
    motion left, and the same highest and lowest force.
    """
    frame = MINDFUL["bars"]
    response = to_sequence(frame, MAIN, AFTER)
    second = response.parts[1]
    assert second.dissipater_force == pytest.approx(-BARS.yield_force, rel=1e-12)
    none, (stiffness, _, highest, lowest, kind) = cast(Pair, ties_of(frame))
    left = second.dissipater_force * frame.tie_moment(frame.joints, BARS.lever_arm)
    shifted = (none, (stiffness, left, highest, lowest, kind))
    theta = respond_with(frame, as_ground(AFTER), shifted)
    within = response.theta[nodes_of(second.part)]
    assert np.abs(within - theta).max() < 1e-12
    assert np.abs(within - respond(frame, AFTER).theta).max() > 1e-3


def respond_with(
    frame: RockingFrame, ground: GroundAcceleration, ties: Pair
) -> NDArray[np.float64]:
    """Return the rotations of a frame with ties in another state."""
    theta, omega, forces = (np.empty(ground.time.size) for _ in range(3))
    kernel.integrate(
        ground.coefficients / GRAVITY, np.empty((0, 2)), ground.time_step, 0.0, 1.0,
        frame.slenderness, frame.effective_frequency_parameter, frame.restitution, 0.0, 0.0,
        theta, omega, np.empty((9, 2)), np.empty(kernel.SUMMARY_SIZE), ties,
        np.empty((forces.size, 2)), np.empty((2, 4)),
    )  # fmt: skip
    return theta


def test_tendons_keep_their_loss() -> None:
    frame = MINDFUL["yielding"]
    left = respond(frame, MAIN).restraint
    assert left is not None
    assert 0.0 < left.tendon_force_left < 0.9 * YIELDING.prestress
    first, second = to_sequence(frame, MAIN, AFTER).parts
    assert first.tendon_force == pytest.approx(YIELDING.prestress, rel=1e-12)
    assert second.tendon_force == pytest.approx(left.tendon_force_left, rel=1e-12)


def test_a_coarser_record_keeps_its_straight_lines() -> None:
    """Samples between those of the coarse record are on the lines that join them anyway."""
    coarse = replace(MAIN, acceleration=MAIN.acceleration[::2], time_step=2.0 * STEP)
    both = in_sequence([coarse, AFTER], 90.0)
    assert both.time_step == STEP
    alone = respond(BENT, coarse)
    assert respond(BENT, both).theta[: MAIN.time.size : 2] == pytest.approx(alone.theta, abs=1e-12)


def test_times_of_the_motions_count_the_rest() -> None:
    both = in_sequence([MAIN, AFTER, MAIN], 30.0)
    assert [str(part) for part in both.parts] == ["main 0 12", "after 42 54", "main 84 96"]
    assert both.duration == pytest.approx(96.0, rel=1e-12)
    assert [*map(str, in_sequence([in_sequence([MAIN, AFTER], 30.0), MAIN], 30.0).parts)] == [
        *map(str, both.parts)
    ]


def test_a_frame_that_still_moves_is_named() -> None:
    with pytest.warns(RockframeWarning, match=r"'bent' does not rest when motion 'after' begins"):
        response = to_sequence(BENT, MAIN, AFTER, rest=0.1)
    assert response.parts[1].start_rotation_ratio > 0.01


def test_joints_kept_open_are_named_with_their_rotation() -> None:
    strong = replace(BENT, dissipater=Dissipater(stiffness=5e8, yield_force=1e6, lever_arm=0.8))
    rest = respond(strong, MAIN.scaled(1.5)).restraint
    assert rest is not None
    assert rest.residual_rotation > 0.0
    with pytest.warns(RockframeWarning, match=r"\|theta\| is .* unless its dissipaters keep the"):
        to_sequence(strong, MAIN.scaled(1.5), AFTER)


def test_after_overturning_there_is_nothing_more() -> None:
    first, second = to_sequence(BENT, MAIN.scaled(3.0), AFTER).parts
    assert first.peak_rotation_ratio == pytest.approx(0.5 * math.pi / BENT.slenderness)
    assert math.isnan(second.peak_rotation_ratio)


def test_facts_are_those_of_the_strongest_motion_or_common() -> None:
    main = replace(MAIN, magnitude=7.1, station="CLC", event="M7.1", orientation=Orientation(0))
    after = replace(AFTER, magnitude=6.4, station="CLC", event="M6.4", trusted=("samples: a.",))
    both = in_sequence([after, main], 60.0)
    assert (both.magnitude, both.station) == (7.1, "CLC")
    assert (both.event, both.orientation) == ("M6.4, then M7.1", Orientation.UNSTATED)
    assert both.trusted == ("samples: a.",)
    assert both.processing == ("sequence: after, then main, with 60 s of rest between them",)


def test_a_sensor_that_was_turned_a_little_still_records_one_direction() -> None:
    """Azimuths of 359.5 and 0.5 degrees are 1 degree apart."""
    turned = [replace(MAIN, azimuth=359.5), replace(AFTER, azimuth=0.5)]
    assert len(in_sequence(turned, 60.0).parts) == 2


@pytest.mark.parametrize(
    ("records", "rest", "message"),
    [
        ([], 60.0, r"A sequence of no records"),
        ([MAIN, AFTER], 0.0, r"Invalid rest 0\.0 s\. Must be positive and finite"),
        ([MAIN, motion("odd", 0.4, 1.2, 0.03)], 60.0, r"Time step 0\.03 s of record 'odd'\. Must"),
        (
            [MAIN, replace(AFTER, orientation=Orientation.VERTICAL)],
            60.0,
            r"horizontal and vertical",
        ),
        (
            [replace(MAIN, azimuth=0.0), AFTER, replace(MAIN, azimuth=90.0)],
            60.0,
            r"'main' \(0 degrees\) and 'main' \(90 degrees\)\. Must be of components in one",
        ),
        ([replace(MAIN, azimuth=0.0), replace(AFTER, azimuth=180.0)], 60.0, r"one direction"),
    ],
)
def test_sequences_that_cannot_be_joined(records: list[Record], rest: float, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        in_sequence(records, rest)
