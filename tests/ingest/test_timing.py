from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rockframe.errors import InputError
from rockframe.ingest.parsing.timing import even_samples, even_time_step

PATH = Path("shake.csv")


def step_of(printed: list[str], given_step: float | None = None) -> float:
    tokens = [token.encode() for token in printed]
    return even_time_step(PATH, np.array(tokens, dtype=np.float64), lambda: tokens, 2, given_step)


@given(
    places=st.integers(0, 5),
    digits=st.integers(1, 9999),
    start=st.integers(0, 100000),
    count=st.integers(2, 300),
)
def test_a_printed_step_is_found_exactly(places: int, digits: int, start: int, count: int) -> None:
    printed = [f"{(start + i * digits) / 10**places:.{places}f}" for i in range(count)]
    assert step_of(printed) == digits / 10**places


@pytest.mark.parametrize("rate", [60, 150, 240, 300, 256])
@pytest.mark.parametrize("start", [0, 1])
def test_rounded_times_of_a_whole_rate(rate: int, start: int) -> None:
    printed = [f"{(i + start) / rate:.4f}" for i in range(4000)]
    assert step_of(printed) == pytest.approx(1 / rate, rel=1e-12)


def test_rounded_times_of_a_decimal_step() -> None:
    assert step_of([f"{0.0042 * i:.3f}" for i in range(100)]) == 0.0042


def test_times_cut_off() -> None:
    printed = [f"{int(i / 240 * 1e4) / 1e4:.4f}" for i in range(4000)]
    assert step_of(printed) == 1 / 240


def test_shortest_representation() -> None:
    assert step_of([repr(i * 0.005) for i in range(3000)]) == 0.005
    assert step_of([f"{i * 0.005:g}" for i in range(3000)]) == 0.005
    assert step_of([f"{i * 0.005:.18e}" for i in range(3000)]) == 0.005


def test_single_precision() -> None:
    times = np.arange(4000, dtype=np.float32) * np.float32(0.02)
    assert step_of([f"{time:.9g}" for time in times]) == 0.02


@pytest.mark.parametrize("lost", [3, 50, 97])
@pytest.mark.parametrize(("rate", "places"), [(100, 2), (100, 4), (240, 4), (200, 3), (128, 7)])
def test_a_lost_sample_is_found(lost: int, rate: int, places: int) -> None:
    printed = [f"{i / rate:.{places}f}" for i in range(100)]
    del printed[lost]
    with pytest.raises(InputError, match=rf"^shake\.csv:{lost + 2}: time .* Must be"):
        step_of(printed)


def test_times_printed_too_coarsely() -> None:
    with pytest.raises(InputError, match="even steps, printed finely enough"):
        step_of([f"{i / 80:.2f}" for i in range(100)])


@pytest.mark.parametrize("start", range(5))
@pytest.mark.parametrize(("rate", "fine"), [(45, False), (30, True)])
def test_uneven_times_need_three_printed_units_a_step(rate: int, fine: bool, start: int) -> None:
    """At 45 Hz steps of 0.02 and 0.03 s alternate, and rounding could hide a lost sample: the next
    time but one is 0.04 s later. At 30 Hz it is 0.07 s later, and no rounded step is that long.
    """
    printed = [f"{(i + start) / rate:.2f}" for i in range(100)]
    if fine:
        assert step_of(printed) == pytest.approx(1 / rate, rel=1e-12)
        del printed[50]
    with pytest.raises(InputError, match="even steps, printed finely enough"):
        step_of(printed)


@pytest.mark.parametrize("start", [0, 72_000_000, 1_562_383_193_010])
@pytest.mark.parametrize("rate", [100, 128, 200, 240])
def test_a_counter_of_milliseconds_of_any_size(start: int, rate: int) -> None:
    """Whole numbers have no single precision, of which an epoch would leave 100 s."""
    counts = [start + 1000 * k // rate for k in range(400)]
    tokens = [b"%de-3" % count for count in counts]
    times = np.array(counts) / 1000.0
    step = even_time_step(PATH, times, lambda: tokens, 2, single=False)
    assert step == pytest.approx(1.0 / rate, rel=1e-9)
    late = np.delete(np.arange(400), 200)
    with pytest.raises(InputError, match=r"shake\.csv:202: time .* Must be"):
        even_time_step(PATH, times[late], lambda: [tokens[k] for k in late], 2, single=False)


@pytest.mark.parametrize("start", [0, 1_562_383_193])
@pytest.mark.parametrize("single", [True, False])
def test_seconds_of_an_epoch_hide_no_lost_sample(start: int, single: bool) -> None:
    printed = [f"{start + k / 200:.3f}" for k in range(400) if k != 200]
    tokens = [token.encode() for token in printed]
    with pytest.raises(InputError, match=rf"time {start + 1}\.005 s after {start or '0'}"):
        even_time_step(PATH, np.array(printed, float), lambda: tokens, 2, single=single)


def test_times_of_a_clock_have_no_tolerance_of_single_precision() -> None:
    """Single precision holds 0.0002 s after an hour; a clock that prints microseconds is exact."""
    printed = [f"{3600 + k / 128 + (k % 3) * 1e-4:.6f}" for k in range(400)]
    tokens = [token.encode() for token in printed]
    with pytest.raises(InputError, match="even steps"):
        even_time_step(PATH, np.array(printed, float), lambda: tokens, 2, single=False)
    assert even_time_step(PATH, np.array(printed, float), lambda: tokens, 2) > 0.0


def test_whole_numbers_have_no_tolerance_of_single_precision() -> None:
    """Single precision would allow 119 at 1e9; a counter is exact."""
    with pytest.raises(InputError, match="even steps"):
        step_of([f"{1_000_000_000 + 5000 * k + 50 * (k % 3)}" for k in range(400)])
    assert step_of([f"{1_000_000_000 + 5000 * k + k % 2}" for k in range(400)]) == 5000.0


@pytest.mark.parametrize("late", [1, -1])
def test_times_one_printed_unit_late(late: int) -> None:
    """The bounds of the step are then at the step itself, but for round-off."""
    counts = [10 * k + late * (k % 5 == 1) for k in range(400)]
    assert step_of([f"{count / 1000:.3f}" for count in counts]) == 0.01


def test_given_step_must_fit() -> None:
    printed = [f"{i / 240:.4f}" for i in range(1000)]
    assert step_of(printed, 0.00416667) == 0.00416667
    with pytest.raises(
        InputError, match=r"time step 0\.0042 s given, but the times state 0\.00416"
    ):
        step_of(printed, 0.0042)


@pytest.mark.parametrize("other", [0.01, 0.03])
def test_four_uneven_steps_are_film_and_three_are_a_fault(other: float) -> None:
    """Samples equal to their times are interpolated at the even times themselves."""
    for few in (3, 4):
        times = np.cumsum([0.0, *[0.02, other] * few, *[0.02] * 8])
        if few == 3:
            with pytest.raises(InputError, match="even steps"):
                even_samples(PATH, times, times, 2, None)
        else:
            step, samples, _ = even_samples(PATH, times, times, 2, None)
            assert step == {0.01: 0.01, 0.03: 0.02}[other]
            assert samples == pytest.approx(step * np.arange(samples.size), abs=1e-12)
            assert times[-1] - step < samples[-1] <= times[-1]


@pytest.mark.parametrize(("gap", "lost"), [(0.064, False), (0.067, True)])
def test_points_of_film_are_at_most_four_mean_steps_apart(gap: float, lost: bool) -> None:
    """With 19 steps of 0.01 s and 19 of 0.02 s, a gap of 0.0651 s is four times the mean step."""
    times = np.cumsum([0.0, *[0.01, 0.02] * 19, gap])
    if lost:
        with pytest.raises(InputError, match=r":40: time 0\.637 s after 0\.57 s"):
            even_samples(PATH, times, times, 1, None)
    else:
        assert even_samples(PATH, times, times, 1, None)[0] == 0.01
