"""Invalid input of a response: an error of one line with the fault and the allowed values."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.frame import RockingFrame
from rockframe.parts import Dissipater
from rockframe.record import Record
from rockframe.rocking import margins, respond_many
from rockframe.rocking.design import Design
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.portrait import barrier_rate
from rockframe.rocking.reactions import column_forces
from rockframe.rocking.response import respond
from rockframe.rocking.verdict import Verdict
from rockframe.wavelets.pulse import Pulse

BENT = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
BARS = Dissipater(stiffness=5e7, yield_force=1e5, lever_arm=0.8)
TIED = replace(BENT, column_mass=5e4, dissipater=BARS)
STILL = GroundAcceleration.from_samples(np.zeros(11), 0.01)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"initial_rotation": math.nan}, "Invalid initial_rotation nan rad. Must be within +-pi/2"),
        ({"initial_rotation": 1.6}, "Invalid initial_rotation 1.6 rad. Must be within +-pi/2"),
        ({"initial_rotation": -0.5 * math.pi}, "Must be within +-pi/2"),
        ({"initial_velocity": math.inf}, "Invalid initial_velocity inf. Must be finite"),
        ({"free_rocking": -1.0}, "Invalid duration -1.0 s. Must be zero or positive"),
        ({"free_rocking": math.nan}, "Invalid duration nan s. Must be zero or positive"),
    ],
)
def test_states_of_no_standing_frame(changes: dict[str, float], words: str) -> None:
    with pytest.raises(ParameterError) as error:
        respond(BENT, STILL, **changes)
    assert words in str(error.value)


@pytest.mark.parametrize(
    ("function", "arguments", "words"),
    [
        (respond, (BENT, [0.0, 1.0]), "motion of type list. Must be a Record, Pulse or GroundAcc"),
        (respond, (STILL, BENT), "motion of type RockingFrame. Must be a Record"),
        (respond, (STILL, STILL), "frame of type GroundAcceleration. Must be a RockingFrame"),
        (margins, (BENT, STILL), "motions of type RockingFrame. Must be a sequence of motions"),
        (margins, ([BENT], [STILL]), "frame of type GroundAcceleration. Must be a RockingFrame"),
        (respond_many, ([STILL], BENT), "frames of type RockingFrame. Must be a sequence"),
        (lambda height: RockingFrame(height=height, width=1.0), ("9.6",), "height '9.6' of frame"),
        (lambda top: RockingFrame(height=9.0, width=1.0, top_width=top), ([1.0],), "a number"),
    ],
)
def test_arguments_of_other_types(function: Any, arguments: tuple[Any, ...], words: str) -> None:
    with pytest.raises(ParameterError) as error:
        function(*arguments)
    assert words in str(error.value)


@pytest.mark.parametrize(
    ("samples", "words"),
    [
        ([], "Invalid acceleration of shape (0,). Must be one row of two samples or more"),
        ([1.0], "Invalid acceleration of shape (1,)"),
        ([[1.0, 2.0], [3.0, 4.0]], "Invalid acceleration of shape (2, 2)"),
        ([0.0, 1.0, math.nan, math.inf], "Invalid acceleration nan at sample 2. Must be finite"),
        ([-math.inf, 1.0], "Invalid acceleration -inf at sample 0. Must be finite"),
    ],
)
def test_samples_that_are_no_motion(samples: Any, words: str) -> None:
    with pytest.raises(ParameterError) as error:
        GroundAcceleration.from_samples(samples, 0.01)
    assert words in str(error.value)


@pytest.mark.parametrize("time_step", [0.0, -0.01, math.nan, math.inf])
def test_time_steps_must_be_positive(time_step: float) -> None:
    words = f"Invalid time step {time_step!r} s"
    with pytest.raises(ParameterError) as error:
        GroundAcceleration.from_samples([0.0, 1.0], time_step)
    assert words in str(error.value)
    with pytest.raises(ParameterError) as error:
        Record(record_id="shake", acceleration=np.zeros(2), time_step=time_step)
    assert f"{words} of record 'shake'. Must be positive and finite." in str(error.value)


@pytest.mark.parametrize(
    ("start", "end", "intervals"), [(0.0, 0.0, 1), (1.0, 0.0, 1), (0.0, 1.0, 0), (0.0, math.nan, 1)]
)
def test_spans_must_be_positive(start: float, end: float, intervals: int) -> None:
    with pytest.raises(ParameterError) as error:
        GroundAcceleration.from_function(np.sin, start, end, intervals=intervals, degree=3)
    assert f"Invalid span from {start!r} to {end!r} s in {intervals} intervals" in str(error.value)
    assert "Must be a positive span and at least one interval" in str(error.value)


@pytest.mark.parametrize("identifier", ["", " ", "-shake", "a/b", "..", "a b", "x" * 65, "\u0301e"])
def test_record_identifiers_are_safe_in_file_names(identifier: str) -> None:
    with pytest.raises(ParameterError) as error:
        Record(record_id=identifier, acceleration=np.zeros(2), time_step=0.01)
    assert f"Invalid record identifier {identifier!r}" in str(error.value)
    assert "Must be 1 to 64 letters" in str(error.value)


@pytest.mark.parametrize(
    ("samples", "words"),
    [
        (np.zeros(1), "Invalid acceleration of shape (1,) in record 'shake'"),
        (np.zeros((2, 2)), "Invalid acceleration of shape (2, 2) in record 'shake'"),
        (np.array([0.0, math.nan]), "Invalid acceleration nan at sample 1 of record 'shake'"),
    ],
)
def test_samples_of_a_record(samples: Any, words: str) -> None:
    with pytest.raises(ParameterError) as error:
        Record(record_id="shake", acceleration=samples, time_step=0.01)
    assert words in str(error.value)


def test_a_record_keeps_its_own_samples() -> None:
    samples = np.array([0.0, 1.0, 0.0])
    record = Record(record_id="shake", acceleration=samples, time_step=0.01)
    samples[1] = 99.0
    assert record.acceleration[1] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        record.acceleration[1] = 2.0


def test_messages_are_one_line() -> None:
    with pytest.raises(ParameterError) as error:
        respond(BENT, STILL, initial_rotation=2.0)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("coefficients", "words"),
    [
        (np.full((3, 2), np.nan), "Invalid ground acceleration in interval 0. Must be finite"),
        (np.zeros((1, 7)), "Invalid coefficients of shape (1, 7). Must be one interval or more"),
        (np.zeros((0, 2)), "Invalid coefficients of shape (0, 2)"),
        (np.zeros((3, 0)), "Invalid coefficients of shape (3, 0)"),
        (np.zeros(3), "Invalid coefficients of shape (3,)"),
    ],
)
def test_a_ground_that_is_none_is_refused(coefficients: NDArray[np.float64], words: str) -> None:
    with pytest.raises(ParameterError, match=re.escape(words)):
        GroundAcceleration(coefficients, 0.1)


def test_a_start_that_is_no_time_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"Invalid start time nan s. Must be finite"):
        GroundAcceleration.from_samples([0.0, 1.0], 0.1, start_time=math.nan)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: replace(STILL, vertical=np.zeros((3, 2))), "of shape (3, 2). Must be (10, 2)"),
        (lambda: replace(STILL, vertical=np.full((10, 2), np.inf)), "interval 0. Must be finite"),
        (lambda: STILL.with_vertical(STILL.followed_by_rest(0.1)), "20 intervals. Must have 10"),
        (lambda: STILL.with_vertical(replace(STILL, time_step=0.02)), "time step 0.02 s of the"),
        (
            lambda: GroundAcceleration.from_function(np.sin, 0.0, 1.0, intervals=3, degree=6),
            "Invalid degree 6. Must be 0 to 5",
        ),
        (
            lambda: respond(replace(TIED, dissipater=replace(BARS, stiffness=1e13)), STILL),
            "times the moment of gravity. Must be 10000 times at most",
        ),
        (lambda: barrier_rate(TIED, 0.0), "has tendons or dissipaters. The moment and the barrier"),
        (
            lambda: column_forces(respond(TIED, STILL), STILL, spacing=9.0, beam_centre=1.0),
            "has tendons or dissipaters, and their effect",
        ),
        (
            lambda: Design(dimension="width", lowest=1.0, highest=2.0).candidates(
                replace(BENT, inertia_ratio=1.4)
            ),
            "has a stated inertia_ratio 1.4, which depends on the width",
        ),
    ],
)
def test_grounds_frames_and_designs_that_do_not_fit(make: Callable[[], Any], words: str) -> None:
    with pytest.raises(ParameterError, match=re.escape(words)):
        make()


def test_a_design_varies_the_mass_ratio_alone() -> None:
    design = Design(dimension="mass_ratio", lowest=1.0, highest=2.0, steps=2)
    expected = (replace(BENT, mass_ratio=1.0), replace(BENT, mass_ratio=2.0))
    assert design.candidates(BENT) == expected


def test_a_pulse_at_no_time_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"Invalid time nan of a pulse. Must be finite"):
        Pulse(wavelet="symmetric_ricker", a_p=1.0, T_p=1.0, time=math.nan)


def test_balanced_on_the_barrier_counts_as_overturned_without_a_time() -> None:
    frame = RockingFrame(height=9.6, width=1.6)
    still = GroundAcceleration.from_samples([0.0, 0.0], 0.1)
    response = respond(frame, still, initial_rotation=frame.slenderness)
    assert response.verdict is Verdict.OVERTURNS
    assert math.isnan(response.overturning_time)
    assert response.peak_rotation == 0.5 * math.pi


@pytest.mark.parametrize("distance", [1e-9, 1e-4, 0.01, 0.04])
def test_however_slow_close_to_the_balance_point_a_frame_never_leans(distance: float) -> None:
    """A body that moves slowly is not at rest: only the side of the balance point decides."""
    still = GroundAcceleration.from_samples([0.0, 0.0], 0.1)
    below, above = (
        respond(BENT, still, initial_rotation=share * BENT.slenderness).verdict
        for share in (1.0 - distance, 1.0 + distance)
    )
    assert (below, above) == (Verdict.STANDS, Verdict.OVERTURNS)


def test_whole_numbers_are_the_same_sizes_and_motion_as_decimal_ones() -> None:
    acceleration = [0, 4, 6, 4, 0, -4, -6, -4, 0]
    whole = respond(
        RockingFrame(height=8, width=2, mass_ratio=3),
        GroundAcceleration.from_samples(np.array(acceleration), 1),
    )
    decimal = respond(
        RockingFrame(height=8.0, width=2.0, mass_ratio=3.0),
        GroundAcceleration.from_samples(np.array(acceleration, dtype=float), 1.0),
    )
    assert whole.peak_rotation == decimal.peak_rotation > 0.0
    assert whole.verdict is decimal.verdict


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"dimension": "depth"}, "dimension 'depth'. Must be height, width or mass_ratio."),
        ({"lowest": 0.0}, "design range [0, 4]. Must be positive, and increase."),
        ({"steps": 1}, "steps 1. Must be at least 2."),
    ],
)
def test_a_design_in_python_has_the_limits_of_that_in_a_study(
    values: dict[str, object], words: str
) -> None:
    """`DesignOptions` states them once; mass ratios may begin at 0, a column alone."""
    valid = {"dimension": "height", "lowest": 2.0, "highest": 4.0, "steps": 3}
    with pytest.raises(ParameterError, match=re.escape(words)):
        Design(**{**valid, **values})  # type: ignore[arg-type]
    assert Design(dimension="mass_ratio", lowest=0.0, highest=4.0, steps=3).values[0] == 0.0
