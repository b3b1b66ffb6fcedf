"""Tables of every layout hold the same samples, or the refusal names the option that decides."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.ingest.imitations import layout

from rockframe.errors import InputError, ParameterError
from rockframe.ingest import ReadOptions, TextLayout, collect, read_bytes, sorted_out
from rockframe.ingest.parsing import Float
from rockframe.ingest.parsing.timing import clock_seconds
from rockframe.record import Orientation, Record
from rockframe.units import GRAVITY

COUNT, STEP = 400, 0.01
TIMES = STEP * np.arange(COUNT)
#: Smooth motions of three channels [g], printed with five decimals.
NORTH: Float = (np.sin(9.0 * TIMES + TIMES**2) * np.exp(-0.3 * TIMES)).round(5)
EAST: Float = (0.6 * np.cos(7.0 * TIMES + TIMES**2) * np.exp(-0.2 * TIMES)).round(5)
UP: Float = (0.3 * np.sin(15.0 * TIMES) * np.exp(-0.5 * TIMES)).round(5)
G = ReadOptions("g", STEP)


def rows(*columns: Iterable[object], separator: str = ",", end: str = "") -> str:
    texts = [
        [value if isinstance(value, str) else f"{value:.5f}" for value in column]
        for column in columns
    ]
    return "".join(separator.join(row) + end + "\n" for row in zip(*texts, strict=True))


def five_a_line(samples: Float) -> str:
    lines = samples.reshape(-1, 5)
    return "".join("".join(f"{value:15.6E}" for value in line) + "\n" for line in lines)


def read(text: str, options: ReadOptions) -> list[Record]:
    return read_bytes("table.txt", text.encode(), options)


NUMBERS = [str(k) for k in range(COUNT)]
SECONDS = rows(TIMES, NORTH)
CLOCKS = [f"03:19:{int(53 * 100 + k) // 100 % 60:02d}.{k % 100:02d}" for k in range(COUNT)]
DATES = [f"2019-07-06T03:19:{53 + k // 100:02d}.{k % 100:02d}Z" for k in range(COUNT)]
LAYOUTS: dict[str, tuple[str, ReadOptions]] = {
    "title, sizes, five a line": (f"A site\n{COUNT} 0.01\n{five_a_line(NORTH)}", ReadOptions("g")),
    "title, sizes, one a line": (f"A site\n{COUNT} 0.01\n{rows(NORTH)}", ReadOptions("g")),
    "three titles": (f"A\nstation of\nthe array\n{rows(NORTH)}", G),
    "five a line": (five_a_line(NORTH), G),
    "names in a comment": ("# time_s acc_g\n" + rows(TIMES, NORTH, separator=" "), ReadOptions()),
    "units below names": ("Time,Acc\ns,g\n" + SECONDS, ReadOptions()),
    "units in a title": (
        "Channel units: sec,g\n\nTime\tACC1\n" + rows(TIMES, NORTH, separator="\t"), ReadOptions()),
    "numbers of rows": (",time_s,acc_g\n" + rows(NUMBERS, TIMES, NORTH), ReadOptions()),
    "numbers of rows in R": ('"time_s" "acc_g"\n' + rows(
        [f'"{k + 1}"' for k in range(COUNT)], TIMES, NORTH, separator=" "), ReadOptions()),
    "numbers of rows, no names": (rows(NUMBERS, TIMES, NORTH, separator=" "), ReadOptions("g")),
    "numbers of rows, no times": (rows(NUMBERS, NORTH, separator=" "), G),
    "separator at the end": ("time_s,acc_g\n" + rows(TIMES, NORTH, end=","), ReadOptions()),
    "quotes": ('"time_s","acc_g"\n"' + rows(TIMES, NORTH, separator='","', end='"')
               .replace("\n", '\n"').rstrip('"'), ReadOptions()),
    "decimal commas, tabs": (
        "t\tacc_g\n" + rows(TIMES, NORTH, separator="\t").replace(".", ","), ReadOptions()),
    "decimal commas, blanks": (
        rows(TIMES, NORTH, separator="  ").replace(".", ","), ReadOptions("g")),
    "decimal commas in quotes": ('t,acc_g\n"' + rows(TIMES, NORTH, separator='";"', end='"')
        .replace(".", ",").replace(";", ",").replace("\n", '\n"').rstrip('"'), ReadOptions()),
    "one column of decimal commas": (
        rows(NORTH).replace(".", ","), ReadOptions("g", STEP, layout=TextLayout(decimal="comma"))),
    "clock times": ("time,acc_g\n" + rows(CLOCKS, NORTH), ReadOptions()),
    "dates and clock times": ("datetime,acc_g\n" + rows(DATES, NORTH), ReadOptions()),
    "dates and clock times between blanks": (
        rows([date.replace("T", " ").rstrip("Z") for date in DATES], NORTH, separator="  "),
        ReadOptions("g")),
    "dates and clock times with names": ("Date,Time,acc_g\n" + rows(
        [date.replace("T", ",").rstrip("Z") for date in DATES], NORTH), ReadOptions()),
    "dates with points over midnight": (rows(
        [f"{'06' if k < 10 else '07'}.07.2019 {'23:59:59.9' if k < 10 else '00:00:0'}"
         f"{k % 10 if k < 10 else f'{(k - 10) // 100}.{(k - 10) % 100:02d}'}"
         for k in range(COUNT)], NORTH), ReadOptions("g")),
    "dates with slashes": ("Date Time acc_g\n" + rows(
        [date.replace("T", " ").replace("-", "/").rstrip("Z") for date in DATES], NORTH,
        separator=" "), ReadOptions()),
    "exponents of Fortran": (five_a_line(NORTH).replace("E", "D"), G),
    "lines skipped": ("1 2 3\n4 5 6\n" + SECONDS, ReadOptions(
        "g", layout=TextLayout(skip_lines=2))),
    "comments of another mark": ("! 1\n! 2\n" + SECONDS, ReadOptions(
        "g", layout=TextLayout(comment="!"))),
    "four channels, one stated": (rows(TIMES, EAST, NORTH, UP), ReadOptions(
        "g", layout=TextLayout(channels=("3=045",)))),
    "times left out": (rows([f"{time:.1f}" for time in TIMES], NORTH), ReadOptions(
        "g", STEP, column="2", layout=TextLayout(time_column="none"))),
    "times in the last column": (rows(NORTH, EAST, TIMES), ReadOptions(
        "g", column="1", layout=TextLayout(time_column="3"))),
    "names of numbers": ("1,2\n" + SECONDS, ReadOptions("g", column="2", layout=TextLayout(
        first_line="names", time_column="1"))),
    "an end mark": ("*Amplitude, name=EQ\n" + rows(TIMES, NORTH) + "*END\n", ReadOptions("g")),
    "an end mark and a comment": (
        rows(TIMES, NORTH) + "}\n# written by hand, 2019\n", ReadOptions("g")),
    "milliseconds": ("time_ms,acc_g\n" + rows([f"{10 * k}" for k in range(COUNT)], NORTH),
                     ReadOptions()),
    "milliseconds in a line of units": ("Time,Acc\nms,g\n" + rows(
        [f"{10 * k + 7}" for k in range(COUNT)], NORTH), ReadOptions()),
    "microseconds of a counter": ("stamp_us,acc_g\n" + rows(
        [f"{10_000 * k + 123_456_789}" for k in range(COUNT)], NORTH), ReadOptions(
            column="acc_g", layout=TextLayout(time_column="stamp_us"))),
    "numbers that touch, numbers of lines": ("A site, 90 degrees\n" + "".join(
        "".join(f"{value:8.5f}" for value in line) + f"{k:7d}\n"
        for k, line in enumerate(NORTH.reshape(-1, 8), 1)), G),
    "a title of as many words as columns": ("Imperial Valley earthquake N-S\n" + rows(
        TIMES[::2], NORTH[::2], TIMES[1::2], NORTH[1::2], separator="  "), ReadOptions("g")),
    "sizes and a further number": (
        f"Time history matched to spectrum: target.tgt\n{COUNT} 0.01 114\n{five_a_line(NORTH)}",
        ReadOptions("g")),
    "blank columns": (",Time,,Acc,\n,(s),,(g),\n" + rows(
        [""] * COUNT, TIMES, [""] * COUNT, NORTH, end=","), ReadOptions()),
    "clock times of another zone": ("time,acc_g\n" + rows(
        [date.replace("Z", "+09:00") for date in DATES], NORTH), ReadOptions()),
    "a first sample that has fewer decimals": (f"{NORTH[0]:.1f}\n" + rows(NORTH[1:]), G),
    "a direction that is no unit": ("t,table_x\n" + rows(TIMES, NORTH), ReadOptions(
        "g", column="table_x")),
    "a factor": (rows(TIMES, 1000.0 * NORTH), ReadOptions(factor=GRAVITY / 1000.0)),
    "mg": ("Time (s),Acceleration (mg)\n" + rows(TIMES, 1000.0 * NORTH), ReadOptions()),
}  # fmt: skip


@pytest.mark.parametrize("layout", LAYOUTS)
def test_every_layout_holds_the_same_samples(layout: str) -> None:
    text, options = LAYOUTS[layout]
    [record] = read(text, options)
    assert record.time_step == pytest.approx(STEP, rel=1e-12)
    np.testing.assert_allclose(record.acceleration, GRAVITY * NORTH, rtol=1e-6, atol=1e-9)


def test_a_line_with_another_number_than_its_place_is_rejected() -> None:
    """A lost line leaves a gap in the numbers of lines, which the samples do not show."""
    text, options = LAYOUTS["numbers that touch, numbers of lines"]
    lines = text.splitlines(keepends=True)
    with pytest.raises(
        InputError, match=r":32: .*number '32' of a line\. Must be 31, counted from"
    ):
        read("".join([*lines[:31], *lines[32:]]), options)


CHANNEL = ReadOptions(layout=TextLayout(channels=("2=NS",)))
COUNTED = [f"{k if k < 30 else 0}" for k in range(COUNT)]


@pytest.mark.parametrize("separator", [" ", "\t"])
@pytest.mark.parametrize(
    ("text", "options"),
    [
        ("t_s acc_g n\n" + rows(TIMES, NORTH, NUMBERS, separator=" "), ReadOptions(column="acc_g")),
        ("t_s acc_g n\n" + rows(TIMES, NORTH, NUMBERS, separator=" "), CHANNEL),
        (rows(TIMES, NORTH, COUNTED, separator=" "), ReadOptions("g", column="2")),
        (rows(TIMES, NORTH, COUNTED, separator=" "), replace(CHANNEL, units="g")),
        (rows(100.0 * NORTH, NUMBERS, separator=" "), ReadOptions(
            "mg", column="1", layout=TextLayout(time_column="2"))),
    ],
)  # fmt: skip
def test_a_last_column_that_names_or_options_state_has_no_numbers_of_lines(
    text: str, options: ReadOptions, separator: str
) -> None:
    [record] = read(text.replace(" ", separator), options)
    factor = 0.1 if options.units == "mg" else 1.0
    np.testing.assert_allclose(record.acceleration, GRAVITY * factor * NORTH, rtol=1e-9)
    assert record.time_step == pytest.approx(1.0 if options.units == "mg" else STEP)


def test_a_last_column_that_stops_counting_is_asked_for() -> None:
    with pytest.raises(InputError, match=r":31: number '0' of a.*state --column or --channels\.$"):
        read(rows(TIMES, NORTH, COUNTED, separator="\t"), ReadOptions("g"))
    with pytest.raises(InputError, match=r":31: .*number '0' of a line"):
        read(rows(NORTH, EAST, COUNTED, separator=" "), replace(G, column="all"))


@pytest.mark.parametrize("word", ["N/A", "null", "None", "OverRange", "*N/A", "*MISSING", "***"])
@pytest.mark.parametrize("columns", [[NORTH], [TIMES, NORTH], [TIMES, [""] * COUNT, NORTH]])
def test_words_in_place_of_the_last_samples_are_no_end_mark(
    word: str, columns: list[Iterable[object]]
) -> None:
    """A logger writes a word for a sample that it could not measure."""
    for last in (word, f"{word}\n{word}", f"{word}\nEND"):
        with pytest.raises(InputError, match=rf":{COUNT + 1}: .*{re.escape(word)}|:40[23]: "):
            read(rows(*columns) + last, ReadOptions("g", STEP))


@pytest.mark.parametrize(
    ("last", "comment", "note"),
    [
        ("END", None, "'END' below"),
        ("end of data.\n\n", None, "'end of data.' below"),
        ("]);", None, r"'\]\);' below"),
        ("# 1\n# 2\n# 3\n\n# 4\nEOF", None, "'# 1', '# 2', '# 3' and 2 more below"),
        ("// 1\n// 2", "//", "'// 1', '// 2' below"),
        ("! 0.5", "!", "'! 0.5' below"),
    ],
)
def test_end_marks_and_comments_below_the_rows_are_noted(
    last: str, comment: str | None, note: str
) -> None:
    [record] = read(rows(NORTH) + last, replace(G, layout=TextLayout(comment=comment)))
    assert record.acceleration.size == COUNT
    assert re.search(note, record.processing[0])


def test_numbers_that_touch_far_below_the_first_rows_are_separated() -> None:
    """Strong motion begins late: the first -100 gal of `F8.3` stands below many short numbers."""
    samples = np.concatenate([np.tile(40.0 * NORTH, 5), 200.0 * NORTH]).round(3)
    text = "".join(
        "".join(f"{value:8.3f}" for value in line) + "\n" for line in samples.reshape(-1, 8)
    )
    assert re.search(r"\d-", text[:16_384]) is None
    [record] = read(text, ReadOptions("gal", STEP))
    np.testing.assert_allclose(100.0 * record.acceleration, samples, atol=1e-12)


GAP = [""] * COUNT
BLANK = rows(TIMES, GAP, NORTH, EAST)
DATED = rows([date.replace("T", ",").rstrip("Z") for date in DATES], GAP, NORTH, EAST)


@pytest.mark.parametrize(
    ("text", "numbers"),
    [
        (BLANK, "134"),
        (BLANK.replace(",", "\t"), "134"),
        ('"t","","a","b"\n"' + rows(TIMES, GAP, NORTH, EAST, separator='","', end='"').replace(
            "\n", '\n"').rstrip('"'), "134"),
        ("t,Comment,a,b\n" + BLANK, "134"),
        (rows(TIMES, GAP, NORTH, GAP, EAST, end=",") + "*END\n", "135"),
        (DATED, "145"),
        ("Date,Time,,a,b\n" + DATED, "145"),
        (BLANK.replace(".", "D").replace(",", ";").replace("D", ","), "134"),
    ],
)  # fmt: skip
def test_numbers_of_columns_count_blank_ones_and_dates(text: str, numbers: str) -> None:
    """A number that meant another column after one is left out would read another channel."""
    time, north, east = (*numbers,)
    for number, samples in ((north, NORTH), (east, EAST)):
        layouts = [(number, TextLayout()), (number, TextLayout(time_column=time))]
        for column, words in [*layouts, (None, TextLayout(channels=(f"{number}=NS",)))]:
            [record] = read(text, ReadOptions("g", column=column, layout=words))
            np.testing.assert_allclose(record.acceleration, samples * GRAVITY, rtol=1e-12)
            assert re.search(r"blank columns? \d(, \d)? left out", record.processing[0])
    blank = "2" if numbers[1] == "3" else "3"
    with pytest.raises(InputError, match=rf"no column {blank} with values\. Must be one of: 1, "):
        read(text, ReadOptions("g", column=blank))


def test_columns_that_must_be_chosen_have_their_numbers_in_the_file() -> None:
    """The second column is blank: its number would mean another column than the message."""
    blank = [""] * COUNT
    with pytest.raises(InputError, match=r"--column NUMBER, of 1, 3 and 4,"):
        read(rows(NORTH, blank, -NORTH, NORTH[::-1]), G)
    with pytest.raises(InputError, match=r"columns 1 and 3 rise like times"):
        read(rows(TIMES, blank, 2.0 * np.array(TIMES, float), NORTH), ReadOptions("g", column="4"))


def test_a_row_without_its_blank_cell_is_rejected() -> None:
    with pytest.raises(InputError, match=r":6: .*'.*' in column 2, which is blank in other"):
        read(BLANK.replace("0.05000,,", "0.05000,"), ReadOptions("g", column="3"))
    lines = BLANK.split("\n")
    lines[5] = "0.05000,"
    with pytest.raises(InputError, match=r":6: .*2 columns in '0.05000,'\. Must be 4, as above"):
        read("\n".join(lines), ReadOptions("g", column="3"))


@pytest.mark.parametrize("last", ["nan", "0.1x", "-", "1"])
def test_a_last_line_that_may_be_a_sample_is_no_end_mark(last: str) -> None:
    with pytest.raises(InputError, match=r"table\.txt:401: "):
        read(rows(TIMES, NORTH) + last, ReadOptions("g"))


@pytest.mark.parametrize("layout", ["title, sizes, five a line", "numbers of rows", "clock times"])
def test_what_was_recognised_is_noted(layout: str) -> None:
    words = {
        "title, sizes, five a line": "table: 1 title line, 5 values a line, 0.01 s, g",
        "numbers of rows": "table: column of row numbers left out, 0.01 s, g",
        "clock times": "table: clock times, 0.01 s, g",
    }
    assert read(*LAYOUTS[layout])[0].processing == (words[layout],)
    assert read(SECONDS, ReadOptions("g"))[0].processing == ()
    sizes = read(*LAYOUTS["sizes and a further number"])[0].processing[0]
    assert sizes.startswith("table: '114' after the sizes left out, ")


@pytest.mark.parametrize(
    ("text", "options", "message"),
    [
        ("Velocity of A\n" + rows(NORTH), G, r":1: .*title .* states 'Velocity'.*--skip-lines 1"),
        ("A\nScale factor 3\n" + rows(NORTH), G, r":2: .*states 'Scale'.*--skip-lines 2 .*--fac"),
        ("1,2\nA site\n" + SECONDS, G, r":1: numbers in '1,2', with text .*--skip-lines NUMBER"),
        (rows(NORTH, EAST), G, r"2 columns without names, which may be channels.*--column NUMBER"),
        (rows(NORTH).replace(".", ","), G, r"2 columns .*state --decimal comma"),
        ("t,acc\n" + rows(TIMES.round(1), NORTH), G, r"Must increase\. .*--time-column none"),
        ("Units: gal\n" + rows(NORTH), ReadOptions(None, STEP), r":1: .* unstated.*--units gal\.$"),
        (",time_s,NS_g,EW_g\n" + rows(NUMBERS, TIMES, NORTH, EAST), ReadOptions(column="3"),
         r"column 3 may be 'EW_g' or 'NS_g'.*State its name"),
        ("Sample rate: 200\n" + SECONDS, G, r":1: .*'Sample rate: 200' in the comment, time st"),
        ("# Column 2: East-west velocity (m/s)\n" + rows(TIMES, NORTH, EAST), ReadOptions(
            "g", column="2"), r":1: .*states 'Column 2: East-west velocity .*--skip-lines 1"),
        ("0.01\n" + rows(NORTH), G, r":1: .*a time step\? State --skip-lines 1, or --first-l"),
        ("time_s,,acc_g\n" + rows(TIMES, [""] * 30 + ["1"] + [""] * (COUNT - 31), NORTH), G,
         r":32: .*'1' in column 2, which is blank in other rows"),
        ("0.01 400\n" + rows(NORTH), G, r":1: 2 columns in .*--skip-lines NUMBER\.$"),
        (rows(TIMES), G, r":1: .*the only column rises by even steps, as times do"),
        ("A\n1 0 9.81 0 0\nB\n" + SECONDS, ReadOptions("g"), r":2: .*above the table, which may"),
        ("400 0.01 0.001\n" + rows(NORTH), G, r":1: .*3 columns in .*--skip-lines NUMBER\.$"),
        ("400 0.01 981\n" + rows(NORTH), G, r":1: .*3 columns in .*--skip-lines NUMBER\.$"),
        ("400 0.01 1000\n" + five_a_line(NORTH), G, r":1: .*3 values.*--skip-lines NUMBER\.$"),
        ("El Centro\n" + SECONDS.replace(",", " "), G, r":1: .*'El,Centro'.*--skip-lines 1\.$"),
        ("Northridge\n" + rows(NORTH), G, r":1: .*'Northridge'.*--column NAME.*--skip-lines 1\.$"),
        ("A\nNorthridge 1994\n" + SECONDS.replace(",", " "), G,
         r":2: .*'Northridge 1994' has words in place of numbers\. If it is a.*--skip-lines 2\.$"),
        ("1994 Northridge\n" + SECONDS.replace(",", " "), G, r":1: .*--skip-lines 1\.$"),
        ("*CURVE\n9.81\n*DATA\n" + SECONDS, G, r":2: .*numbers in '9.81' above the table, "
         r"which may scale it\. Leave lines out with --skip-lines NUMBER"),
        ("1 0.01 9.81\n" + five_a_line(NORTH), G, r":1: .*3 values.*--skip-lines NUMBER\.$"),
        ("A, DT = 0.01 sec\n" + rows(NORTH), ReadOptions("g"), r":1: .*--time-step-s 0\.01\.$"),
        (rows(TIMES, NORTH) + "Velocity\n" + rows(TIMES, EAST), ReadOptions("g"),
         r":401: .*1 column in 'Velocity'"),
        (five_a_line(NORTH), ReadOptions("g", STEP, layout=TextLayout(values_per_line=4)),
         r":1: .*5 values in a line\. Must be 4"),
        ("t,acc_1,acc_2\n" + rows(TIMES, NORTH, EAST), G, r"several with --channels NAME=AZIMUTH"),
        (SECONDS, ReadOptions("g", layout=TextLayout(channels=("2=NS",), time_column="2")),
         r"column 2 is both time and acceleration"),
        ("A site, 400, 0.01\n" + SECONDS, ReadOptions("g", layout=TextLayout(first_line="sizes")),
         r":1: .*first line 'A site, 400, 0\.01'\. Must be the number of"),
        ("1 400 0.01 7\n" + five_a_line(NORTH), ReadOptions("g", layout=TextLayout(
            first_line="sizes")), r":1: .*first line '1 400 0\.01 7'\. Must be"),
        (rows(CLOCKS, NORTH), replace(G, column="1"), r":1: .*column 1 has clock times\. Must"),
        (rows(NUMBERS, CLOCKS, NORTH), replace(G, layout=TextLayout(channels=("2=NS",))),
         r":1: .*column 2 has clock times"),
        ("t,acc_g\n" + SECONDS, ReadOptions(factor=2.0), r"factor 2 m/s2 given, but .* 'g'"),
    ],
)  # fmt: skip
def test_where_two_readings_are_possible_the_option_is_named(
    text: str, options: ReadOptions, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        read(text, options)


@pytest.mark.parametrize(
    ("top", "word"),
    [
        ("all values x 10^-3", "x 10^-3"),
        ("multiply by 2.0", "multiply"),
        ("# Scale factor 2.0", "Scale"),
        ("# factor: 0.001", "factor"),
        ("SF=9.81", "SF=9"),
        ("# SF = 9.81", "SF = 9"),
        ("# Velocity (cm/s)", "Velocity"),
        ("# Units: velocity in cm/s", "velocity"),
        ("VEL in cm/s", "VEL"),
        ("Displ. (cm)", "Displ"),
        ("Geschwindigkeit cm/s", "cm/s"),
    ],
)
def test_a_scale_or_another_quantity_above_the_numbers_is_rejected(top: str, word: str) -> None:
    with pytest.raises(InputError, match=rf":1: .* states '.*{re.escape(word)}.*--skip-lines 1"):
        read(f"{top}\n{SECONDS}", G)
    [record] = read(f"{top}\n{SECONDS}", replace(G, layout=TextLayout(skip_lines=1)))
    np.testing.assert_array_equal(record.acceleration, NORTH * GRAVITY)


@pytest.mark.parametrize(
    "top",
    [
        "# converted from counts with factor 2.1e-5",
        "# mean shear-wave velocity of the site: 300 m/s",
        "# gain 4, sensitivity 1.25 V/g",
        "PGA scaled to 0.6",
        "Acceleration and velocity of floor 3",
        "# 10 values per line were 5",
    ],
)
def test_words_about_the_site_or_the_recorder_are_no_reason_to_ask(top: str) -> None:
    [record] = read(f"{top}\n{SECONDS}", G)
    np.testing.assert_array_equal(record.acceleration, NORTH * GRAVITY)


@pytest.mark.parametrize(
    ("top", "message"),
    [
        ("Number of points: 401", "npts 401 in the comment, 400 rows"),
        ("# No. of data points = 399", "npts 399 in the comment"),
        ("# 401 points of acceleration", "npts 401 in the comment"),
        ("mg", "acceleration units 'mg' in the comment, 'g' given"),
        ("Sample rate: 0", "'Sample rate: 0' in the comment"),
    ],
)
def test_sizes_and_units_in_words_are_compared(top: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        read(f"A site\n{top}\n{SECONDS}", G)


@pytest.mark.parametrize(
    ("names", "units"),
    [("Time [s],Acc [g]", "s,m/s2"), ("Time,Acc_g", "s,m/s2"), ("Time (s),Acc", "g,g")],
)
def test_units_of_names_and_of_their_own_line_agree(names: str, units: str) -> None:
    with pytest.raises(InputError, match=r"table.txt:1: column '.*, but '.*' in the line of units"):
        read(f"{names}\n{units}\n{SECONDS}", ReadOptions())


@pytest.mark.parametrize(
    ("names", "units"),
    [
        ("Time [s],Acc [g]", "sec,g"),
        ("Time,Acc_g", "s,(g)"),
        ("Time,Table_Acc", "s,g"),
        ("Time,Acc,Vel", "(sec),(g),(cm/sec)"),
        ("Time,Acc", "s,G"),
    ],
)
def test_the_line_of_units_is_that_of_the_names(names: str, units: str) -> None:
    table = THREE if names.count(",") == 2 else SECONDS
    [record] = read(f"{names}\n{units}\n{table}", ReadOptions(column="2"))
    np.testing.assert_array_equal(record.acceleration, NORTH * GRAVITY)


@pytest.mark.parametrize("damage", ["0.0x,0.1", "0.1", "oops,0.1", ",0.1"])
@pytest.mark.parametrize("place", [0, 1, 2, 30])
@pytest.mark.parametrize("top", ["", "A site\n", "time_s,acc_g\n"])
def test_a_damaged_row_is_no_title(top: str, place: int, damage: str) -> None:
    """Left out as a title, it and all rows above it would be missing in the record."""
    lines = SECONDS.split("\n")
    lines[place] = damage
    line = top.count("\n") + place + 1
    with pytest.raises(InputError, match=rf"table\.txt:{line}: "):
        read(top + "\n".join(lines), ReadOptions("g"))


def test_channels_have_the_directions_that_the_user_states() -> None:
    layout = TextLayout(channels=("NS_g=045", "EW_g=S45E", "4=UP"))
    text = "time_s,NS_g,EW_g,V_g\n" + rows(TIMES, NORTH, EAST, UP)
    first, second, third = read(text, ReadOptions(layout=layout))
    assert (first.azimuth, second.azimuth) == (45.0, 135.0)
    assert third.orientation is Orientation.VERTICAL
    for record, samples in zip((first, second, third), (NORTH, EAST, UP), strict=True):
        np.testing.assert_array_equal(record.acceleration, samples * GRAVITY)


CHANNELS = ReadOptions(layout=TextLayout(channels=("2=NS", "3=EW")))
THREE = rows(TIMES, NORTH, EAST)


@pytest.mark.parametrize(
    ("names", "units"),
    [
        ("time [s],NS [g],EW [gal]\n", ["g", "gal"]),
        ("t,A1,A2\ns,g,gal\n", ["g", "gal"]),
        ("t,acc x [g],Ost [cm/s²]\n", ["g", "cm/s2"]),
    ],
)
def test_each_channel_has_its_own_units(names: str, units: list[str]) -> None:
    north, east = read(names + THREE, CHANNELS)
    np.testing.assert_array_equal(north.acceleration, NORTH * GRAVITY)
    np.testing.assert_array_equal(east.acceleration, EAST * 0.01)
    assert [record.processing[0].rpartition(" ")[2] for record in (north, east)] == units
    with pytest.raises(InputError, match=r"'g' given, but the file states '(gal|cm/s2)'"):
        read(names + THREE, replace(CHANNELS, units="g"))


@pytest.mark.parametrize(
    ("text", "options", "message"),
    [
        ("time [s],NS [g],vel EW [cm/s]\n" + THREE, CHANNELS, "vel EW.* is a velocity"),
        ("time [s],acc NS [g],disp [cm]\n" + THREE, CHANNELS, "disp.* is a displacement"),
        ("time [s],NS [g],Geschw [cm/s]\n" + THREE, CHANNELS, "acceleration units 'cm/s'"),
        ("time [s],NS [g],EW\n" + THREE, CHANNELS, "acceleration units unstated.*--units"),
        ("time [s],NS [g],EW [gal]\n" + THREE, ReadOptions(), "in different units .*--channels"),
        ("Acceleration [mg]\n" + five_a_line(NORTH), replace(G, column="all"),
         "'g' given, but the file states 'mg'"),
        ("Acceleration [mg]\n" + five_a_line(NORTH), replace(G, layout=TextLayout(
            values_per_line=5)), "'g' given, but the file states 'mg'"),
        ("Vel\n" + five_a_line(NORTH), replace(G, column="all"), "is a velocity"),
        ("time,acc_g\n" + SECONDS, replace(G, column="all"), "'time,acc_g' are names.*-lines 1"),
        ("NS,EW,UD\n" + THREE, replace(G, layout=TextLayout(values_per_line=3)), "are names of"),
    ],
)  # fmt: skip
def test_names_and_units_above_stated_columns_count(
    text: str, options: ReadOptions, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        read(text, options)


def test_a_name_above_a_stated_series_states_its_units() -> None:
    text = "Acceleration [mg]\n" + five_a_line(1000.0 * NORTH)
    [record] = read(text, ReadOptions(None, STEP, column="all"))
    np.testing.assert_allclose(record.acceleration, GRAVITY * NORTH, rtol=1e-6, atol=1e-9)
    [titled] = read("Site A of an array\n" + five_a_line(NORTH), replace(G, column="all"))
    np.testing.assert_allclose(titled.acceleration, record.acceleration, rtol=1e-5, atol=1e-9)


@pytest.mark.parametrize("name", ["Zeit", "temps", "x", "Punkt"])
@pytest.mark.parametrize("chosen", [{"column": "2"}, {"layout": TextLayout(channels=("2=NS",))}])
def test_times_of_any_name_agree_with_the_stated_step(name: str, chosen: dict[str, Any]) -> None:
    text = f"{name},Beschl\n{SECONDS}"
    with pytest.raises(InputError, match=r"0.05 s given, but the times state 0.01.*-column none"):
        read(text, ReadOptions("g", 0.05, **chosen))
    [record] = read(text, ReadOptions("g", STEP, **chosen))
    np.testing.assert_array_equal(record.acceleration, NORTH * GRAVITY)
    with pytest.raises(InputError, match=f"Column '{name}' rises like times.*--time-column"):
        read(text, ReadOptions("g", **chosen))
    unnamed = replace(chosen.get("layout", TextLayout()), time_column="none")
    [record] = read(text, ReadOptions("g", 0.05, **chosen | {"layout": unnamed}))
    assert record.time_step == 0.05


def test_two_channels_without_names_and_a_stated_step() -> None:
    numbered = rows([str(k) for k in range(5, COUNT + 5)], TIMES, NORTH, EAST)
    layout = TextLayout(channels=("3=NS", "4=EW"))
    with pytest.raises(InputError, match="columns 1 and 2 rise like times"):
        read(numbered, ReadOptions("g", layout=layout))
    records = read(numbered, ReadOptions("g", STEP, layout=layout))
    assert [record.time_step for record in records] == [STEP, STEP]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (replace(CHANNELS, column="2"), "--column and --channels are both stated"),
        (replace(CHANNELS, column="all"), "--column all and --channels are both"),
        (ReadOptions(column="2", layout=TextLayout(values_per_line=5)), "-per-line and --column"),
        (ReadOptions(layout=TextLayout(values_per_line=5, time_column="1")), "and --time-column"),
        (ReadOptions(column="all", layout=TextLayout(time_column="1")), "and --time-column"),
        (ReadOptions(layout=TextLayout(channels=("2=NS", " 2=EW"))), "' 2=EW': the same column"),
    ],
)
def test_options_of_which_one_would_be_ignored_are_refused(
    options: ReadOptions, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        read(THREE, replace(options, units="g"))


@pytest.mark.parametrize(
    ("names", "vertical"),
    [("H1,H2,V", "V"), ("L,T,V", "V"), ("X,Y,Z", "Z"), ("HNE,HNN,HNZ", "HNZ"), ("EW,NS,V", "V")],
)
def test_the_vertical_stands_beside_two_horizontals(names: str, vertical: str) -> None:
    records = read(f"time_s,{names}\n{rows(TIMES, NORTH, EAST, UP)}", ReadOptions("g"))
    assert [record.component for record in records] == names.split(",")
    upright = [record.component for record in records if record.orientation.upright]
    assert upright == [vertical]
    with pytest.raises(InputError, match="'V' is a velocity"):
        read(f"time_s,V\n{SECONDS}", ReadOptions("g"))


@given(st.integers(0, 86_399), st.lists(st.integers(1, 40_000), min_size=1, max_size=8))
def test_clock_times_go_on_after_midnight(first: int, steps: list[int]) -> None:
    seconds = np.cumsum([first, *steps]).tolist()
    texts = [f"{s // 3600 % 24:02d}:{s // 60 % 60:02d}:{s % 60:02d}.50" for s in seconds]
    assert clock_seconds(texts) == [f"{s}.50" for s in seconds]


def test_a_catalogue_states_the_layout_of_each_file(tmp_path: Path) -> None:
    """Files of different layouts lie in one folder."""
    (tmp_path / "a.txt").write_text("Scale factor 1\n" + five_a_line(NORTH))
    (tmp_path / "b.csv").write_text(rows(EAST, NORTH))
    (tmp_path / "catalogue.csv").write_text(
        "file,units,time_step_s,skip_lines,values_per_line,column\n"
        "a.txt,g,0.01,1,5,\nb.csv,%g,0.02,,,2\n"
    )
    records, rejections = sorted_out(collect([tmp_path]))
    assert not rejections
    np.testing.assert_allclose(records[0].acceleration, GRAVITY * NORTH, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(100.0 * records[1].acceleration, GRAVITY * NORTH, atol=1e-9)
    assert [record.time_step for record in records] == [0.01, 0.02]
    (tmp_path / "catalogue.csv").write_text("file,separator\na.txt,colon\n")
    with pytest.raises(InputError, match=r"catalogue\.csv:2: Invalid separator 'colon'"):
        list(collect([tmp_path]))


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ({"decimal": "dot"}, "Invalid decimal 'dot'. Must be one of: point, comma"),
        ({"skip_lines": -1}, "Invalid skip_lines -1. Must be 0 or more"),
        ({"channels": ("NS",)}, "Invalid channel 'NS'"),
        ({"channels": ("2=400",)}, "Invalid component '400' of channel '2=400'. Must be an azim"),
        ({"channels": ("2=NS", "3=foo")}, "Invalid component 'foo' of channel '3=foo'"),
        ({"comment": " "}, "Invalid comment ' '"),
    ],
)
def test_words_of_a_layout_are_checked(words: dict[str, object], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        TextLayout(**words)  # type: ignore[arg-type]


def test_real_channels_are_never_taken_as_one_series(shared_records: Path) -> None:
    """Three to twelve values a line are recognised; the channels of a station are no series."""
    from rockframe.ingest.parsing.columns import is_series

    records, _ = sorted_out(collect([shared_records / "formats" / "csmip"]))
    stations: dict[str, list[Record]] = {}
    for record in records:
        stations.setdefault(record.source_file, []).append(record)
    tables = [channels for channels in stations.values() if len(channels) >= 3]
    assert len(tables) >= 2
    for channels in tables:
        length = min(channel.acceleration.size for channel in channels)
        for count in range(3, min(len(channels), 12) + 1):
            table = np.stack([one.acceleration[:length] for one in channels[:count]], axis=1)
            assert not is_series(table.ravel(), count)


@pytest.mark.parametrize(
    ("name", "options", "peaks"),
    [
        ("02_savetxt_header.txt", ReadOptions("g", column="2"), [0.4704]),
        ("04_values5perline.txt", G, [0.5636]),
        ("05_clock_time.csv", ReadOptions(None, 0.01, column="acc_g"), [0.5636]),
        ("06_pandas_index.csv", ReadOptions(column="acc_g"), [0.5636]),
        ("06_pandas_index.csv", ReadOptions(column="2"), [0.5636]),
        ("06_trailing_comma.csv", ReadOptions(column="2"), [0.5636]),
        ("07_names_then_units.csv", ReadOptions("g"), [0.4704, 0.5636, 0.3612]),
        ("07_nees.txt", ReadOptions("g", column="ACC02"), [0.5636]),
        ("09_h1h2v.csv", ReadOptions("g"), [0.5636, 0.4704, 0.3612]),
        ("09_mg.csv", ReadOptions(), [0.5636]),
    ],
)
def test_reported_layouts(name: str, options: ReadOptions, peaks: list[float]) -> None:
    records = read_bytes(name, layout(name), options)
    sizes = [float(np.abs(record.acceleration).max()) / GRAVITY for record in records]
    assert sizes == pytest.approx(peaks, abs=5e-5)
    assert {(record.acceleration.size, record.time_step) for record in records} == {(2500, 0.01)}
