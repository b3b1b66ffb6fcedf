"""Tables state times and samples in words; a record agrees with them, or the user is asked."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tests.ingest.test_table_layout import COUNT, EAST, NORTH, STEP, read, rows

from rockframe.errors import InputError
from rockframe.ingest import ReadOptions, TextLayout
from rockframe.ingest.parsing.timing import clock_seconds
from rockframe.units import GRAVITY


def _of_day(seconds: float) -> str:
    return f"{int(seconds // 3600):02d}:{int(seconds // 60 % 60):02d}:{seconds % 60:06.3f}"


@pytest.mark.parametrize("lost", [1, 3, 20_000])
@pytest.mark.parametrize(
    ("name", "printed"),
    [
        ("time_ms", lambda k: f"{1_562_383_193_010 + 5 * k}"),
        ("time_us", lambda k: f"{1_562_383_193_010_000 + 5000 * k}"),
        ("time_s", lambda k: f"{1_562_383_193 + k / 200:.3f}"),
        ("time", lambda k: _of_day(72_000 + k / 200)),
    ],
)
def test_lost_samples_of_a_clock_or_counter_are_no_even_times(
    name: str, printed: Callable[[int], str], lost: int
) -> None:
    times = [printed(k + lost * (k >= 200)) for k in range(COUNT)]
    with pytest.raises(InputError, match=r":202: .*time .* Must be .*--time-column none"):
        read(f"{name},acc_g\n{rows(times, NORTH)}", ReadOptions())
    [record] = read(f"{name},acc_g\n{rows(map(printed, range(COUNT)), NORTH)}", ReadOptions())
    assert record.time_step == pytest.approx(0.005, rel=1e-9)


def test_a_counter_of_microseconds_has_no_tolerance_of_single_precision() -> None:
    """After an hour, single precision would allow 0.0004 s in steps of 0.005 s."""
    times = [f"{3_600_000_000 + 5000 * k + 100 * (k % 3)}" for k in range(COUNT)]
    with pytest.raises(InputError, match="even steps"):
        read(f"time_us,acc_g\n{rows(times, NORTH)}", ReadOptions())


@pytest.mark.parametrize(
    ("name", "units"),
    [
        ("time (ms) rel", "ms"),
        ("elapsed_ms_total", "ms"),
        ("timems", "timems"),
        ("timemS", "timemS"),
        ("tMs", "tMs"),
        ("time_min", "min"),
        ("Time [h]", "h"),
        ("Zeit [Std]", "Std"),
        ("t [ms] [s]", "ms"),
    ],
)
@pytest.mark.parametrize(
    "layout",
    [
        {"column": "2"},
        {"layout": TextLayout(channels=("2=NS",), time_column="1")},
    ],
)
def test_times_in_other_units_are_no_seconds(name: str, units: str, layout: dict[str, Any]) -> None:
    """Read as seconds, milliseconds would make the motion a thousand times as long."""
    text = f"{name},acc_g\n" + rows([f"{10 * k}" for k in range(COUNT)], NORTH)
    words = replace(layout.get("layout", TextLayout()), time_column="1")
    with pytest.raises(InputError, match=rf":1: .*has units '{units}'.*--time-column none"):
        read(text, ReadOptions(**layout | {"layout": words}))
    words = replace(words, time_column="none")
    assert read(text, ReadOptions(None, STEP, **layout | {"layout": words}))[0].time_step == STEP


@pytest.mark.parametrize(
    ("name", "size"),
    [
        ("timeMs", 3), ("t [ ms ]", 3), ("time_mS", 3), ("Time (uSec)", 6),
        ("timeUS", 6), ("micros", 6), ("t (ns)", 9),
        ("time_ns", 9), ("Zeit", 0), ("Zeit (Sek.)", 0), ("time rel [s]", 0), ("t_sec", 0),
    ],
)  # fmt: skip
def test_the_end_of_a_name_states_the_parts_of_a_second(name: str, size: int) -> None:
    text = f"{name},acc_g\n" + rows([f"{10 * k}" for k in range(COUNT)], NORTH)
    [record] = read(text, ReadOptions(column="2", layout=TextLayout(time_column="1")))
    assert record.time_step == pytest.approx(10.0 ** (1 - size), rel=1e-12)


@pytest.mark.parametrize("zone", ["+09", " +0900", " Z", " UTC", "-03:30", "GMT"])
@pytest.mark.parametrize("date", ["", "2019-07-06 ", "06.07.2019 "])
def test_clock_times_have_a_zone_in_numbers(zone: str, date: str) -> None:
    times = [f"{date}{_of_day(60_000 + k / 100)}{zone}" for k in range(COUNT)]
    [record] = read("time,acc_g\n" + rows(times, NORTH), ReadOptions())
    assert record.time_step == STEP
    times[200] = times[200].removesuffix(zone)
    with pytest.raises(InputError, match=rf":202: .*time '{re.escape(times[200])}'"):
        read("time,acc_g\n" + rows(times, NORTH), ReadOptions())


@pytest.mark.parametrize("date", ["", "2019-07-06T"])
def test_a_change_of_the_zone_neither_hides_an_hour_nor_adds_one(date: str) -> None:
    zones = ["+01:00"] * 200 + ["+02:00"] * 200
    clock = [_of_day(17_998 + k / 100) for k in range(COUNT)]
    times = [date + time + zone for time, zone in zip(clock, zones, strict=True)]
    with pytest.raises(InputError, match=r":202: .*time 10800 s after 14399\.99 s"):
        read("time,acc_g\n" + rows(times, NORTH), ReadOptions())
    later = [_of_day(17_998 + 3600 * (k >= 200) + k / 100) for k in range(COUNT)]
    times = [date + time + zone for time, zone in zip(later, zones, strict=True)]
    [record] = read("time,acc_g\n" + rows(times, NORTH), ReadOptions())
    assert record.time_step == STEP


def test_clock_times_before_the_first_midnight_keep_their_decimals() -> None:
    times = ["2019-07-06T00:30:00.5Z", "2019-07-05T23:59:59.25Z"]
    assert clock_seconds(times) == ["1800.5", "-0.75"]


@pytest.mark.parametrize(
    ("words", "step"),
    [
        ("Sampling interval: 1/200 sec", 0.005),
        ("dt = 0,005 s", 0.005),
        ("dt = 5 ms. Filtered.", 0.005),
        ("time step [µs]: 5000", 0.005),
        ("dt=.005SEC, 400 values", 0.005),
        ("sampling rate,200", 0.005),
    ],
)
def test_a_step_in_words_is_proposed_as_it_stands(words: str, step: float) -> None:
    text = f"# {words}\n{rows(NORTH)}"
    with pytest.raises(InputError, match=rf":1: .*has .*: --time-step-s {step}\.$"):
        read(text, ReadOptions("g"))
    assert read(text, ReadOptions("g", step))[0].time_step == step
    with pytest.raises(InputError, match=rf":1: .*time step {2 * step} s of the samples"):
        read(text, ReadOptions("g", 2 * step))


@pytest.mark.parametrize(
    "words",
    [
        "Sampling rate: 1,000 Hz", "1,000 sps", "sample rate: 1 kHz", "dt = 10,5 ms",
        "dt = 3/400 s", "time step 3 of 5", "time step: 0.02 min", "sampling interval = 200 Hz",
        "Sampling rate: 0.005 s", "sampling rate 16 bit", "dt = 0 s", "Sampling rate: 0 Hz",
    ],
)  # fmt: skip
def test_no_part_of_a_number_is_proposed_as_a_step_and_no_other_unit(words: str) -> None:
    """The user states the step where its words have two readings."""
    with pytest.raises(InputError, match=r"time step unstated\. State it with --time-step-s, or"):
        read(f"# {words}\n{rows(NORTH)}", ReadOptions("g"))


THREE = rows(STEP * np.arange(COUNT), NORTH, EAST)


@pytest.mark.parametrize(
    ("top", "other"),
    [
        ("# Column 2: acceleration\n# Column 3: velocity (m/s)\n", [3]),
        ("# accelerogram of site A\n# Column 2: vel (cm/s)\n", [2]),
        ("# 2nd column: displ. (cm)\n# third column: acceleration\n", [2]),
        ("# Column 1: time, column 2: velocity, column 3: acc\n", [2]),
        ("Column 2 = velocity\nColumn 3 = acceleration\n", [2]),
        ("# Columns: time acceleration velocity\n", [3]),
        ("# Columns: time velocity\n", [2, 3]),
        ("# accelerogram of site A\n# Units: s, cm/s\n", [2, 3]),
        ("# Column 5 of the velocity array, pier 3\n", []),
        ("# Column 2: acceleration in the direction of the velocity pulse\n", []),
    ],
)
@pytest.mark.parametrize("chosen", [2, 3])
@pytest.mark.parametrize("skipped", [False, True])
def test_a_column_that_a_comment_names_a_velocity_is_read_only_without_it(
    top: str, other: list[int], chosen: int, skipped: bool
) -> None:
    count = top.count("\n")
    options = ReadOptions("g", column=str(chosen))
    if skipped:
        options = replace(options, layout=TextLayout(skip_lines=count))
    if chosen in other and not skipped:
        with pytest.raises(InputError, match=r"which is no acceleration\. .*--skip-lines \d"):
            read(top + THREE, options)
    else:
        [record] = read(top + THREE, options)
        np.testing.assert_array_equal(record.acceleration, (NORTH, EAST)[chosen - 2] * GRAVITY)


def test_columns_in_comments_are_numbered_as_in_the_file() -> None:
    blank = rows(STEP * np.arange(COUNT), [""] * COUNT, NORTH, EAST)
    for number in (2, 3, 4):
        text = f"# Column {number}: velocity\n{blank}"
        if number == 3:
            with pytest.raises(InputError, match="states 'Column 3: velocity'"):
                read(text, ReadOptions("g", column="3"))
        else:
            [record] = read(text, ReadOptions("g", column="3"))
            np.testing.assert_array_equal(record.acceleration, NORTH * GRAVITY)


@pytest.mark.parametrize(("number", "counts"), [(1, False), (2, True), (3, True), (4, False)])
def test_a_column_of_row_numbers_may_be_counted_in_comments_or_not(
    number: int, counts: bool
) -> None:
    numbers = [str(k) for k in range(COUNT)]
    table = rows(numbers, STEP * np.arange(COUNT), NORTH, EAST)
    text = f"# Column {number}: velocity\n,time_s,acc_g,other\n{table}"
    if counts:
        with pytest.raises(InputError, match="velocity', which is no acc"):
            read(text, ReadOptions(column="acc_g"))
    else:
        assert read(text, ReadOptions(column="acc_g"))[0].acceleration.size == COUNT


@pytest.mark.parametrize("first", ["0.01000", "1e-2", "0.01", "1.0E-02"])
def test_a_first_number_that_is_the_step_is_asked_for(first: str) -> None:
    """A header of one number is a sample more; zero and other numbers are samples."""
    text = f"{first}\n{rows(NORTH)}"
    with pytest.raises(InputError, match=r":1: .*a time step\? State --skip-lines 1, or --first-l"):
        read(text, ReadOptions("g", 0.01))
    for words, count in ((TextLayout(skip_lines=1), 0), (TextLayout(first_line="numbers"), 1)):
        [record] = read(text, ReadOptions("g", 0.01, layout=words))
        assert record.acceleration.size == COUNT + count
    [record] = read(f"0.01100\n{rows(NORTH)}", ReadOptions("g", 0.01))
    assert record.acceleration.size == COUNT + 1


@pytest.mark.parametrize("title", ["El Centro", "Northridge 1994", "A 12", "1994 Northridge"])
def test_a_title_of_as_many_words_as_columns_names_the_way_out(title: str) -> None:
    text = f"{title}\n{rows(STEP * np.arange(COUNT), NORTH, separator=' ')}"
    with pytest.raises(InputError, match=r":1: .* a title, leave it out with --skip-lines 1\.$"):
        read(text, ReadOptions("g"))
    [record] = read(text, ReadOptions("g", layout=TextLayout(skip_lines=1)))
    np.testing.assert_array_equal(record.acceleration, NORTH * GRAVITY)


def test_names_of_columns_are_not_taken_for_a_title() -> None:
    with pytest.raises(InputError, match=r"'t,acc,count'\. .*NAME=AZIMUTH\.$"):
        read("t,acc,count\n" + THREE, ReadOptions("g"))
