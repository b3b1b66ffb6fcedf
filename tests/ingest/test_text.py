from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.ingest.imitations import layout

from rockframe.errors import InputError, ParameterError
from rockframe.ingest import ReadOptions, read_bytes
from rockframe.ingest.formats.text import sniff
from rockframe.ingest.parsing import Float
from rockframe.record import Orientation, Record

PATH = Path("shake.csv")
BOTH = ReadOptions(units="g", time_step=0.01)


def one(text: str, options: ReadOptions | None = None) -> Record:
    [record] = read_bytes(PATH, text.encode(), options or ReadOptions())
    return record


@given(
    samples=st.lists(st.floats(-30, 30), min_size=2, max_size=40),
    step=st.sampled_from([0.0025, 0.005, 0.01, 0.02]),
    separator=st.sampled_from([",", ", ", "  ", "\t"]),
    end=st.sampled_from(["\n", "\r\n", "\r\r\n"]),
)
def test_round_trip(samples: list[float], step: float, separator: str, end: str) -> None:
    rows = [f"{i * step:.4f}{separator}{sample!r}" for i, sample in enumerate(samples)]
    record = one(end.join([f"time_s{separator}acc_m_s2", *rows]))
    assert record.time_step == step
    assert np.array_equal(record.acceleration, samples)


@pytest.mark.parametrize(
    ("name", "factor"),
    [
        ("acc_g", 9.81),
        ("acceleration_g", 9.81),
        ("acc (g)", 9.81),
        ("acc_gal", 0.01),
        ("acc_cm_s2", 0.01),
        ("Acceleration [cm/s^2]", 0.01),
        ("acc_m_s2", 1.0),
        ("acceleration_m_s2", 1.0),
        ("acceleration [m/s2]", 1.0),
        ("acceleration (m s-2)", 1.0),
        ("acceleration [cm/s²]", 0.01),
    ],
)
def test_units_in_the_name(name: str, factor: float) -> None:
    record = one(f"t,{name}\n0.00,2.0\n0.01,3.0\n")
    assert record.acceleration.tolist() == [2.0 * factor, 3.0 * factor]


@pytest.mark.parametrize("time", ["time_s", "t", "time [s]", "Time (sec)"])
def test_names_of_time(time: str) -> None:
    assert one(f"{time} acc_g\n0.00 2.0\n0.02 3.0\n").time_step == 0.02


def test_acceleration_alone() -> None:
    record = one("% one column\n\nacc_g\n1.0\n2.0\n", ReadOptions(time_step=0.02))
    assert (record.time_step, record.acceleration.size) == (0.02, 2)


def test_unnamed_columns() -> None:
    assert one("0.0 1.0\n0.5 2.0\n", ReadOptions(units="m/s2")).time_step == 0.5
    assert one("1.0\n2.0\n", BOTH).time_step == 0.01


def test_stated_count() -> None:
    assert one("# dt 1 s; npts 2\nt,acc_g\n0,1\n1,2\n").acceleration.size == 2
    with pytest.raises(InputError, match=r":1: npts 3 in the comment, 2 rows in the file"):
        one("# units g; npts 3\nt,acc_g\n0,1\n1,2\n")


@pytest.mark.parametrize(
    ("text", "options", "message"),
    [
        ("0.0,1\n0.1,2\n", ReadOptions(), "acceleration units unstated.*--units"),
        ("0,00,0,1\n0,01,0,2\n", BOTH, "4 columns without .* separate the columns with semicol"),
        ("t,acc_g\n0,00,0,1\n0,01,0,2\n", BOTH, "4 columns, but 2 .* with semicolons"),
        ("\ufeffZeit;Süd;Öst\n0;1;1\n1;2;2\n", BOTH, ":1: .*columns 'Zeit,Süd,Öst'. Must be"),
        ("time_s,acc\n0.0,1\n0.1,2\n", ReadOptions(), ":1: acceleration units unstated.*--units"),
        ("acc_g\n1\n2\n", ReadOptions(), "time step unstated.*--time-step"),
        ("t,acc_g\n0.0,1\n0.1,2\n", ReadOptions(units="gal"), r":1: .*'gal' given, but .* 'g'"),
        ("t,acc_g\n0.0,1\n0.1,2\n", BOTH, r"time step 0.01 s given, but the times state 0.1 s"),
        ("time_s,vel_cm_s\n0.0,1\n0.1,2\n", BOTH, r":1: column 'vel_cm_s' is a velocity"),
        ("time_s,displacement\n0.0,1\n0.1,2\n", BOTH, r":1: column 'displacement' is a displac"),
        ("time_min,acc_g\n0,1\n0.1,2\n", BOTH, r":1: time in units of 'min'\. Must be seconds"),
        ("time_s,acc_km_s2\n0.0,1\n0.1,2\n", BOTH, r":1: acceleration units 'kms2'\. Must be one"),
        ("x,y\n0.0,1\n0.1,2\n", BOTH, r":1: columns 'x,y'\. Must be time and acceleration"),
        ("t,acc_g,vel\n0,1,2\n1,2,3\n", BOTH, r":1: columns 't,acc_g,vel'\. Must be time and acc"),
        ("t,acc_g\n0.0,1\n0.1,nan\n", ReadOptions(), r":3: acceleration 'nan'\. Must be a finite"),
        ("t,acc_g\n0.0,1\n0.1,inf\n", ReadOptions(), r":3: acceleration 'inf'\. Must be a finite"),
        ("t,acc_g\n0.0,1\nabc,2\n", ReadOptions(), r":3: time 'abc'\. Must be a finite number"),
        ("t,acc_g\n0.0,1\n0.1,1_0\n", ReadOptions(), r":3: acceleration '1_0'\. Must be a finite"),
        ("t,acc_g\n0,1\n1,1e99\n", ReadOptions(), r":3: acceleration '1e99'\. Must be .* below"),
        ("t,acc_g\n0,1\n1,-1e99\n", ReadOptions(), r":3: acceleration '-1e99'\. Must be .* below"),
        ("t,acc_g\n0.0,1\n0.1\n0.2,1", ReadOptions(), r":3: 1 column in '0.1'\. Must be 2"),
        ("t,acc_g\n0.0,1\n\n0.2,1", ReadOptions(), r":3: 1 column in ''\. Must be 2"),
        ("t,acc_g\n0.0,1\n", ReadOptions(), r":2: 1 row of numbers\. Must be 2 or more"),
        ("t,acc_g\n0.0,1\n0.1,2\n0.1,3\n", ReadOptions(), r":4: time 0.1 s after 0.1 s\. Must inc"),
        ("t,acc_g\n0,1\n1,2\n2,3\n4,4\n5,5\n", ReadOptions(), r":5: time 4 s after 2 s\. Must be"),
    ],
)  # fmt: skip
def test_refused(text: str, options: ReadOptions, message: str) -> None:
    with pytest.raises(InputError, match=message):
        one(text, options)


@pytest.mark.parametrize(
    "head",
    [
        b"# Records\n\nThe six records of the paper.\n",
        b"36f3e1828cc6753d74713b141a453ea3  CICCC.RAW\nca29380a432a15142814  CICLC.v1\n",
        b"file,event,station,network,magnitude,epicentral_distance_km,source\nA.V1,,,,7.1,,x\n",
        b'{"a": 1,\n "b": 2}\n',
        b"[1.0,\n 2.0]\n",
        b"[[structure]]\nheight_m = 9.6\nwidth_m = 1.6\n",
        b"1971\nA year to remember.\nAnd some more words.\n",
        b"TIMESERIES BW_RJOB__EHZ_D, 6 samples, 200 sps, 2009, SLIST, INTEGER, Counts\n1 2 3 4\n",
        b"TIMESERIES XX_TEST__BHZ_R, 2 samples, 40 sps, 2008, TSPAIR, FLOAT, Counts\n2008-01 185\n",
        b"1.0 2.0 3.0 4.0 5.0\n1.0 2.0 3.0 4.0 5.0\n",
        b"\x80\x04\x95\x10\x00\x00",
        b"0.1\x000.2\n",
        b"",
        b"\n\n",
    ],
)
def test_sniff_says_no(head: bytes) -> None:
    assert not sniff(head)


@pytest.mark.parametrize(
    "head",
    [
        b"0.1\n0.2\n",
        b"\xef\xbb\xbftime_s,acc_g\r\n0.0,0.1\r\n",
        b"0.0 0.1\n0.1 oops\n0.2 0.3\n0.3 0.4\n",
        b"t,acc_g\n0.0,oops\n0.1,0.2\n0.2,0.3\n",
        b"0.00 nan\n0.01 0.1\n",
    ],
)
def test_sniff_says_yes(head: bytes) -> None:
    assert sniff(head)


def test_options_are_checked() -> None:
    with pytest.raises(ParameterError, match="Invalid acceleration units 'gallon'"):
        ReadOptions(units="gallon")
    with pytest.raises(ParameterError, match=r"Invalid time step 0\.0 s"):
        ReadOptions(time_step=0.0)


@pytest.mark.parametrize(
    ("comment", "agrees"),
    [
        ("# dt=0.01", True),
        ("% npts: 3, dt = .010 s", True),
        ("# dt = 5e-3 sec, unfiltered", False),
        ("# dt=0.005", False),
        ("# dt=10 ms", True),
        ("# dt=20 ms", False),
        ("# DT 0.02", False),
        ("Time step: 0.02 sec", False),
        ("Time step (ms): 10", True),
        ("Sampling interval = 0.02", False),
        ("# delta t = 0.02", False),
        ("# fs = 200", False),
        ("# fs = 100 Hz", True),
        ("2 points at 50 Hz", False),
        ("2 points of accel equally spaced at 0.02 sec", False),
        ("2 points of accel equally spaced at 0.010 sec", True),
        ("# 200 samples per second", False),
        ("# filtered at 50 Hz; resampled from dt = 0.02 s", True),
    ],
)
def test_a_step_in_a_comment_is_that_of_the_samples(comment: str, agrees: bool) -> None:
    data = f"{comment}\n0.1\n0.2\n-0.3\n".encode()
    options = ReadOptions(units="g", time_step=0.01)
    if agrees:
        assert read_bytes("a.txt", data, options)[0].time_step == 0.01
    else:
        with pytest.raises(InputError, match=r"a\.txt:1: .* in the comment, time step 0\.01 s"):
            read_bytes("a.txt", data, options)


def test_a_step_of_zero_in_a_comment_cannot_be_trusted() -> None:
    """Samples without time between them are no record, so only the samples can settle it."""
    with pytest.raises(InputError, match=r"Settled by --trust waveform\.$"):
        one("# dt = 0.0 s\n0.1\n0.2\n", BOTH)


@pytest.mark.parametrize(
    ("comment", "states"),
    [
        ("# units: g", None),
        ("# acceleration, corrected", None),
        ("# original units gal, converted", None),
        ("# Acceleration in cm/s^2", "cm/s2"),
        ("% IN UNITS OF GAL", "gal"),
    ],
)
def test_units_in_a_comment_are_those_of_the_samples(comment: str, states: str | None) -> None:
    options = ReadOptions(units="g", time_step=0.01)
    for data in (f"{comment}\n0.1\n0.2\n", f"{comment}\nacc_g\n0.1\n0.2\n"):
        if states is None:
            assert read_bytes("a.txt", data.encode(), options)[0].acceleration[1] > 1.9
        else:
            with pytest.raises(InputError, match=rf"a\.txt:1: .*'{states}' in the comment, 'g' "):
                read_bytes("a.txt", data.encode(), options)


def rows_of(*columns: list[float], separator: str = ",") -> str:
    rows = zip(*columns, strict=True)
    return "".join(separator.join(f"{x:.3f}" for x in row) + "\n" for row in rows)


TIMES, NORTH, EAST, UP = [0.0, 0.01, 0.02], [0.1, -0.2, 0.3], [0.4, 0.5, -0.6], [0.7, 0.8, 0.9]


@pytest.mark.parametrize(
    ("names", "units"),
    [
        ("time, NS, EW, UD", "g"),
        ("Time [s],N [g],E [g],Z [g]", None),
        ("t,acc_000_g,acc_090_g,acc_UP_g", None),
        ("N,E,V", "g"),
    ],
)
def test_several_components_by_their_headings(names: str, units: str | None) -> None:
    timed = names.count(",") == 3
    columns = [*([TIMES] if timed else []), NORTH, EAST, UP]
    options = ReadOptions(units, None if timed else 0.01)
    records = read_bytes("a.csv", f"{names}\n{rows_of(*columns)}".encode(), options)
    assert [record.acceleration.tolist() for record in records] == [
        [9.81 * value for value in values] for values in (NORTH, EAST, UP)
    ]
    assert [record.azimuth for record in records[:2]] == [0.0, 90.0]
    assert records[2].orientation is Orientation.VERTICAL
    assert len({record.record_id for record in records}) == 3


@pytest.mark.parametrize(
    ("names", "column", "values"),
    [
        ("t,acc_1_g,acc_2_g\n", "acc_2_g", EAST),
        ("t,acc_1_g,acc_2_g\n", "2", NORTH),
        ("t,vel,Acc X [g]\n", "acc x [g]", EAST),
        ("", "3", EAST),
    ],
)
def test_a_column_may_be_chosen(names: str, column: str, values: list[float]) -> None:
    text = names + rows_of(TIMES, NORTH, EAST)
    options = ReadOptions(None if names else "g", column=column)
    [record] = read_bytes("a.csv", text.encode(), options)
    assert record.acceleration.tolist() == [9.81 * value for value in values]
    assert record.time_step == 0.01


@pytest.mark.parametrize(
    ("names", "column", "message"),
    [
        (
            "t,acc_1,acc_2\n",
            None,
            r"2 accelerations of the same direction or of none.*--column NAME",
        ),
        ("", None, r"3 columns without names, of which column 1 rises.*--column NUMBER, of 1 to 3"),
        ("t,acc_1,acc_2\n", "acc_3", r"no column 'acc_3'\. Must be one of: t, acc_1, acc_2"),
        ("", "4", r"no column '4'\. Must be one of: 1 to 3"),
        ("t,vel_1,acc_2\n", "vel_1", r"column 'vel_1' is a velocity, not an acceleration"),
        ("t,NS_g,EW_gal\n", None, r"accelerations in different units \(g, gal\)"),
    ],
)
def test_columns_that_are_refused(names: str, column: str | None, message: str) -> None:
    text = names + rows_of(TIMES, NORTH, EAST)
    with pytest.raises(InputError, match=message):
        read_bytes("a.csv", text.encode(), ReadOptions("g", column=column))


def motion(count: int) -> Float:
    """Return a smooth motion in which neighbouring samples differ by less than distant ones."""
    time = 0.01 * np.arange(count)
    samples: Float = np.sin(40.0 * time + 3.0 * time**2) * np.exp(-0.2 * time)
    return samples.round(4)


def lines_of(table: Float) -> str:
    return "".join(" ".join(f"{x:10.4f}" for x in row) + "\n" for row in table)


@pytest.mark.parametrize("many", [8, 10])
def test_many_values_a_line_are_one_series(many: int) -> None:
    values = motion(60 * many + 3)
    text = lines_of(values[:-3].reshape(-1, many)) + lines_of(values[np.newaxis, -3:])
    [record] = read_bytes("a.txt", text.encode(), ReadOptions("m/s2", 0.01))
    assert np.array_equal(record.acceleration, values)
    short = text.replace(f"{values[many + 3]:10.4f}", "", 1)
    with pytest.raises(InputError, match=rf"{many - 1} values in a line"):
        read_bytes("a.txt", short.encode(), ReadOptions("m/s2", 0.01))


@pytest.mark.parametrize("many", [8, 10])
@pytest.mark.parametrize("kind", ["same motion", "other motions", "noise", "with times"])
def test_channels_are_no_series_and_one_can_be_chosen(many: int, kind: str) -> None:
    """Read line by line, channels would be a motion that no instrument recorded."""
    rows = 300
    noise = np.random.default_rng(1).standard_normal((rows, many))
    channels = {
        "same motion": np.outer(motion(rows), np.linspace(1.0, 1.7, many)),
        "other motions": np.stack([motion(rows + 40 * k)[-rows:] for k in range(many)], axis=1),
        "noise": noise,
        "with times": np.c_[0.01 * np.arange(rows), noise[:, 1:]],
    }[kind].round(4)
    text = lines_of(channels).encode()
    with pytest.raises(InputError, match=rf":1: {many} columns without names.* --column NUMBER"):
        read_bytes("a.txt", text, ReadOptions("m/s2", 0.01))
    [record] = read_bytes("a.txt", text, ReadOptions("m/s2", 0.01, column="3"))
    assert np.array_equal(record.acceleration, channels[:, 2])
    [record] = read_bytes("a.txt", text, ReadOptions("m/s2", 0.01, column="all"))
    assert np.array_equal(record.acceleration, channels.ravel())


@pytest.mark.parametrize("column", [None, "all"])
@pytest.mark.parametrize("row", ["0.1,,,,,,,", "0.1,0.2,,0.4,0.5,0.6,0.7,0.8"])
def test_a_missing_value_of_a_series_is_refused(row: str, column: str | None) -> None:
    """Without it, all samples after it would be a step early."""
    whole = "0.1,0.2,0.3,0.4,0.5,0.6,0.7,0.8"
    text = "\n".join([whole, row, whole, whole]).encode()
    with pytest.raises(InputError, match=r":2: acceleration ''\. Must be"):
        read_bytes("a.txt", text, ReadOptions("g", 0.01, column=column))


def test_the_last_line_of_a_series_may_end_in_empty_cells() -> None:
    text = b"0.1,0.2,0.3,0.4,0.5,0.6,0.7,0.8\n" * 3 + b"0.9,1.0,,,,,,\n"
    [record] = read_bytes("a.txt", text, ReadOptions("g", 0.01, column="all"))
    assert record.acceleration.size == 26


def test_one_row_of_many_values_is_refused_or_read_as_a_series() -> None:
    row = b"0.1 0.2 -0.3 0.4 0.5 -0.6 0.7 0.8\n"
    with pytest.raises(InputError, match=r"8 columns without names, "):
        read_bytes("a.txt", row, BOTH)
    assert read_bytes("a.txt", row, ReadOptions("g", 0.01, column="all"))[0].acceleration.size == 8


@pytest.mark.parametrize("pairs", [2, 4, 5])
def test_pairs_of_time_and_value_are_one_series(pairs: int) -> None:
    count = 40 * pairs
    table = np.c_[0.01 * np.arange(count), motion(count)].reshape(-1, 2 * pairs)
    text = lines_of(table)
    [record] = read_bytes("a.txt", text.encode(), ReadOptions("m/s2"))
    assert (record.time_step, record.acceleration.tolist()) == (0.01, motion(count).tolist())
    with pytest.raises(InputError, match=r"each line holds .* Leave out --column"):
        read_bytes("a.txt", text.encode(), ReadOptions("m/s2", column="2"))
    late = text.replace(f"{0.01 * (3 * pairs + 1):10.4f}", "    3.5001", 1)
    with pytest.raises(InputError, match=r":[45]: time 0\.\d+ s after 3\.5001 s"):
        read_bytes("a.txt", late.encode(), ReadOptions("m/s2"))
    odd = text.rsplit(" ", 1)[0] + "\n"
    with pytest.raises(InputError, match=rf":40: time {0.01 * (count - 1):g} s without an accel"):
        read_bytes("a.txt", odd.encode(), ReadOptions("m/s2"))


def test_two_channels_without_times() -> None:
    text = lines_of(np.c_[motion(50), motion(90)[-50:]]).encode()
    with pytest.raises(InputError, match=r"2 columns without names, which may be channels"):
        read_bytes("a.txt", text, BOTH)
    [record] = read_bytes("a.txt", text, ReadOptions("m/s2", 0.01, column="2"))
    assert np.array_equal(record.acceleration, motion(90)[-50:])
    with pytest.raises(InputError, match=r"time step unstated\. State it with --time-step-s"):
        read_bytes("a.txt", text, ReadOptions("m/s2", column="2"))


@pytest.mark.parametrize("decimals", [1, 2])
def test_times_of_too_few_decimals_are_not_offered_as_samples(decimals: int) -> None:
    """Read as one series with the accelerations, times of 10 s would be a PGA of 10 g."""
    times = (0.005 * np.arange(2000)).round(decimals)
    samples = motion(2000)
    text = lines_of(np.c_[times, samples]).encode()
    with pytest.raises(InputError, match=r"column 1 rises like times") as refused:
        read_bytes("a.txt", text, ReadOptions("g"))
    assert "one series" not in str(refused.value)
    assert "--column NUMBER, of 1 to 2" in str(refused.value)
    [record] = read_bytes("a.txt", text, ReadOptions("m/s2", 0.005, column="2"))
    assert record.acceleration.tolist() == samples.tolist()


def test_the_time_step_decides_between_numbers_of_rows_and_times() -> None:
    rows = np.arange(50.0)
    text = lines_of(np.c_[rows, 0.01 * rows, motion(50)]).encode()
    with pytest.raises(InputError, match=r"columns 1 and 2 rise like times.* --time-step-s"):
        read_bytes("a.txt", text, ReadOptions("m/s2", column="3"))
    [record] = read_bytes("a.txt", text, ReadOptions("m/s2", 0.01, column="3"))
    assert (record.time_step, record.acceleration.tolist()) == (0.01, motion(50).tolist())


@pytest.mark.parametrize("header", ["200 0.01", "  200, .01", "# made so\n200 0.0100"])
@pytest.mark.parametrize("columns", [1, 2, 5])
def test_a_line_above_the_numbers_states_their_number_and_step(header: str, columns: int) -> None:
    table = motion(200).reshape(-1, columns)
    if columns == 2:
        table = np.c_[0.01 * np.arange(200), motion(200)]
    text = f"{header}\n{lines_of(table)}"
    [record] = read_bytes("a.txt", text.encode(), ReadOptions("m/s2"))
    assert (record.time_step, record.acceleration.tolist()) == (0.01, motion(200).tolist())
    wrong = r"199 samples stated above 200 .*--trust samples|time 0 s after 199 s|Must be 2"
    with pytest.raises(InputError, match=wrong):
        read_bytes("a.txt", text.replace("200", "199", 1).encode(), ReadOptions("m/s2"))
    wrong = r"dt 0?.010?0? s in the header.*--trust header|time step 0.02 s given"
    with pytest.raises(InputError, match=wrong):
        read_bytes("a.txt", text.encode(), ReadOptions("m/s2", 0.02))


@pytest.mark.parametrize("columns", [1, 5])
def test_a_line_above_the_numbers_states_their_number(columns: int) -> None:
    text = f"200\n{lines_of(motion(200).reshape(-1, columns))}".encode()
    [record] = read_bytes("a.txt", text, BOTH)
    assert record.acceleration.tolist() == (9.81 * motion(200)).tolist()


@pytest.mark.parametrize("first", ["1", "+3", "2500", "-12"])
def test_a_whole_number_above_decimals_is_no_sample_unless_trusted(first: str) -> None:
    """A count or the number of a station became a sample, as 1 g."""
    text = f"{first}\n{lines_of(motion(200).reshape(-1, 1))}".encode()
    with pytest.raises(
        InputError, match=rf":1: '{re.escape(first)}' is a whole .* header.*--trust samples"
    ):
        read_bytes("a.txt", text, BOTH)
    trusting = ReadOptions("m/s2", 0.01, trust=("samples",))
    [record] = read_bytes("a.txt", text, trusting)
    assert record.acceleration[:2].tolist() == [float(first), motion(1)[0]]
    [record] = read_bytes("a.txt", b"# " + text, BOTH)
    assert record.acceleration.size == 200


@pytest.mark.parametrize("first", ["0", "1.0", "1."])
def test_other_numbers_above_decimals_are_samples(first: str) -> None:
    text = f"{first}\n{lines_of(motion(20).reshape(-1, 1))}".encode()
    assert read_bytes("a.txt", text, BOTH)[0].acceleration.size == 21


@pytest.mark.parametrize(
    ("usual", "last"),
    [("0.25", "0.0"), ("1e-05", "0.0"), ("-10.0", "1e-05"), ("0.125", "0.5"), ("7.0", "7")],
)
def test_a_shorter_last_number_without_a_line_end_is_whole(usual: str, last: str) -> None:
    """Python and others print as few digits as a number needs, and never end it in zeros."""
    rows = [f"{0.01 * k:.2f},{usual}" for k in range(20)]
    record = one("\n".join(["time_s,acc_m_s2", *rows, f"0.20,{last}"]))
    assert record.acceleration[-1] == float(last)


@pytest.mark.parametrize(
    ("usual", "last"),
    [("0.2500", "0.25"), ("1.50E-03", "1.5"), ("1.5E-03", "1.5E-0"), ("0.25", "0."), ("1.5", "1.")],
)
def test_a_number_that_is_cut_is_refused_unless_trusted(usual: str, last: str) -> None:
    text = "\n".join(["time_s,acc_m_s2", *[f"{0.01 * k:.2f},{usual}" for k in range(20)]])
    with pytest.raises(InputError, match=rf":22: the file ends within '{last}'.*--trust samples"):
        one(f"{text}\n0.20,{last}")
    record = one(f"{text}\n0.20,{last}", ReadOptions(trust=("samples",)))
    assert record.acceleration[-1] == float(last)


@pytest.mark.parametrize("names", ["", "Zeit;acc\n", "time;NS;EW\n"])
def test_decimal_comma_with_semicolons(names: str) -> None:
    if not names:
        columns: tuple[list[float], ...] = (TIMES, NORTH)
    else:
        columns = (TIMES, NORTH, EAST)[: names.count(";") + 1]
    text = names.replace("Zeit", "t") + rows_of(*columns, separator=";").replace(".", ",")
    records = read_bytes("a.csv", text.encode(), ReadOptions("g"))
    assert records[0].acceleration.tolist() == [9.81 * value for value in NORTH]
    assert records[0].time_step == 0.01


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1"])
def test_a_column_with_a_heading_in_any_language_can_be_chosen(encoding: str) -> None:
    words = "Χρόνος" if encoding != "latin-1" else "Zeit"
    text = f"{words} [s];{words[1]} [m/s²]\n0,00;0,1\n0,01;0,2\n"
    [record] = read_bytes("a.csv", text.encode(encoding), ReadOptions(column="2"))
    assert (record.time_step, record.acceleration.tolist()) == (0.01, [0.1, 0.2])


@pytest.mark.parametrize(
    ("units", "plain"),
    [
        ("m/s²", "m/s2"),
        ("m/s^2", "m/s2"),
        ("G", "g"),
        ("cm/s/s", "cm/s2"),
        ("m s-2", "m/s2"),
        ("cm s^-2", "cm/s2"),
        ("mm·s⁻²", "mm/s2"),
        ("m s**-2", "m/s2"),
    ],
)
def test_other_spellings_of_units(units: str, plain: str) -> None:
    from rockframe.options.ingest import IngestOptions

    assert ReadOptions(units).units == IngestOptions(units=units).units == plain


@pytest.mark.parametrize("odd", [b"\xa0", b"\x85", b"\x1c", b"\x1f"])
@pytest.mark.parametrize("row", [b"0.00%b0.1", b"0.1%b", b"0.00 0.1%b0.5"])
def test_what_is_a_blank_only_to_some_is_refused(row: bytes, odd: bytes) -> None:
    data = b"\n".join([row.replace(b"%b", odd)] * 3)
    with pytest.raises(InputError, match="Must be"):
        read_bytes("motion.txt", data, ReadOptions("g", 0.01))


def test_a_row_of_another_width_is_refused_unless_trusted() -> None:
    text = lines_of(motion(60).reshape(-1, 1))
    lines = text.split("\n")
    damaged = "\n".join([*lines[:30], lines[30][:-2] + lines[30][-1], *lines[31:]]).encode()
    with pytest.raises(InputError, match=r":31: 9 characters, where 57 other lines have 10"):
        read_bytes("a.txt", damaged, BOTH)
    trusting = ReadOptions("m/s2", 0.01, trust=("samples",))
    assert read_bytes("a.txt", damaged, trusting)[0].acceleration.size == 60


@pytest.mark.parametrize("columns", [1, 8])
@pytest.mark.parametrize("large", [[10.0005], [-11.2, 12.5], [0.00001]])
def test_a_digit_more_or_fewer_before_the_point_is_no_damage(
    columns: int, large: list[float]
) -> None:
    """A program that prints a fixed number of decimals widens the line where a number is large."""
    usual = 15.0 if large[0] == 0.00001 else 0.5  # then the small number has the shorter line
    samples = np.full(60 * columns, usual)
    samples[columns * 31 : columns * (31 + len(large)) : columns] = large
    rows = [" ".join(f"{x: .5f}" for x in row) for row in samples.reshape(-1, columns)]
    assert len(rows[31]) != len(rows[30]) == len(rows[33])
    text = "\n".join(rows).encode()
    options = ReadOptions("m/s2", 0.01, column="all" if columns > 1 else None)
    assert read_bytes("a.txt", text, options)[0].acceleration.tolist() == samples.tolist()
    if len(large) == 1:
        rows[20] = rows[20][:-1]
        with pytest.raises(InputError, match=r":21: \d+ characters, where 5[67] other lines have"):
            read_bytes("a.txt", "\n".join(rows).encode(), options)


@pytest.mark.parametrize(
    ("name", "options", "scale"),
    [
        ("01_eight_channels.csv", ReadOptions("g", 0.01, column="1"), 1.0),
        ("01_eight_channels.csv", ReadOptions("g", 0.01, column="8"), 1.7),
        ("01_pairs4_gal.th", ReadOptions("gal", 0.01), 1.0),
        ("01_pairs4_gal.th", ReadOptions("gal"), 1.0),
        ("03_two_components.txt", ReadOptions("g", 0.01, column="2"), 1.0),
        ("07_deepsoil.txt", ReadOptions("g", 0.01), 1.0),
    ],
)
def test_reported_tables(name: str, options: ReadOptions, scale: float) -> None:
    [record] = read_bytes(name, layout(name), options)
    sizes = np.abs(record.acceleration)
    assert (record.time_step, sizes.size, int(sizes.argmax())) == (0.01, 2500, 2137)
    assert sizes.max() / 9.81 == pytest.approx(0.5636 * scale, rel=5e-4)
