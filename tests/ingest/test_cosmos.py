from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rockframe.errors import InputError
from rockframe.ingest import ReadOptions, read_bytes
from rockframe.record import Orientation

Lines = list[str]
PATH = Path("BMR.V2c")
WHAT = {
    0: "Raw acceleration counts  ",
    1: "Uncorrected acceleration ",
    2: "Corrected acceleration  ",
}
#: Indices of the line above each section, and of the first line of samples.
INTEGERS, REALS, COMMENTS, HEADING, SAMPLES = 13, 24, 45, 48, 49


def channel(
    samples: Sequence[float] = (1.0, -2.5, 0.5),
    *,
    stage: int = 2,
    quantity: str = "acceleration",
    units: str = "cm/sec2(04)",
    label: str = " 90 Deg",
    integers: dict[int, int] | None = None,
    reals: dict[int, float] | None = None,
) -> Lines:
    """Return the lines of a channel; samples of V1 and V2 start on line 50, in (8F10.3)."""
    count = len(samples)
    peak = max(range(count), key=lambda k: abs(samples[k]))
    at = f"{0.005 * peak:.3f}"
    code = int(units.rsplit("(", 1)[1].rstrip(")"))
    whole = (
        dict.fromkeys(range(1, 101), -999) | {1: stage, 2: 1, 3: code, 54: 90} | (integers or {})
    )
    real = dict.fromkeys(range(1, 101), -999.0)
    real |= {13: 7.0, 17: 98.3, 22: 0.8, 34: 0.02, 42: 1.2, 47: 1.0, 62: 5.0, 63: 0.005 * count}
    real |= {64: samples[peak], 65: 0.005 * peak} | (reals or {})
    width, form = (8, "(10I8)") if stage == 0 else (10, "(8F10.3)")
    text = "".join(f"{x:8.0f}" if stage == 0 else f"{x:10.3f}" for x in samples)
    return [
        f"{WHAT.get(stage, 'Spectra')} (Format v01.20 with 13 text lines)".replace(
            "acceleration", quantity
        ),
        "Record of Point MacKenzie Earthquake of Fri Nov 30, 2018 17:29 UTC",
        "Hypocenter: 61.34640 -149.95520 H= 46km Mw=7.0",
        "Origin: 2018/11/30 17:29:29    UTC",
        "Statn No: 37-000011 Code:AK-BMR     UAF  Bremner River, AK, USA",
        "Coords: 60.9677 -144.6051  Site geology:",
        "Recorder: (see cmnt)      ( ? Chns of   3 at Sta) Sensor: (see comment)",
        "Rcrd start time: 2018/11/30 17:29:39.137 UTC (Q=5) RcrdId: (see comment)",
        f"Sta Chan   ?:{label} (Rcrdr Chan  ?) Location:",
        f"Raw record length = 210 sec, Uncor max = {abs(samples[peak]):.0f} counts, at {at} sec.",
        f"Processed:2019-03-03 05:46 GMT, Max = {samples[peak]:.3f} {units[:-4]} at {at} sec",
        "Record filtered below  0.03 Hz (periods over 33.33 secs), and above 20.0 Hz",
        "Values used when parameter or data value is unknown/unspecified:   -999, -999.00",
        " 100 Integer-header values follow on  10 lines, Format= (10I8)",
        *("".join(f"{whole[i]:8d}" for i in range(k, k + 10)) for k in range(1, 101, 10)),
        " 100 Real-header values follow on  20 lines, Format= (5F15.6)",
        *("".join(f"{real[i]:15.6f}" for i in range(k, k + 5)) for k in range(1, 101, 5)),
        '   2 Comment line(s) follow, each starting with a "|":',
        "| Recorder: QUANTERRA Q330",
        "|<SCNL>BMR.BNZ.AK.--    <AUTH> 2019/02/01 21:38:15.000",
        f"{count:8d} {quantity} pts, approx  210 secs, units={units},Format={form}",
        *(
            text[start : start + 80]
            for start in range(0, len(text), 10 * width if width == 8 else 80)
        ),
        "End-of-data for ChanBNZ acceleration",
    ]


def cosmos(*channels: Lines) -> bytes:
    return "\n".join([line for one in channels for line in one] + [""]).encode()


@given(st.lists(st.integers(-99999999, 999999999).map(lambda n: n / 1e3), min_size=2, max_size=40))
def test_round_trip(samples: list[float]) -> None:
    [record] = read_bytes(PATH, cosmos(channel(samples)))
    assert np.array_equal(record.acceleration, 0.01 * np.array(samples))


@given(st.lists(st.integers(-9999999, 99999999).map(float), min_size=2, max_size=40))
def test_counts_round_trip(counts: list[float]) -> None:
    raw = channel(counts, stage=0, units="counts (50)", reals={34: 0.005})
    [record] = read_bytes(PATH, cosmos(raw))
    assert record.acceleration == pytest.approx(np.array(counts) * 0.8e-6 / 1.2 * 9.81, rel=1e-14)


def test_facts() -> None:
    [record] = read_bytes(PATH, cosmos(channel()))
    assert (record.network, record.station, record.component) == ("AK", "BMR", "090")
    assert (record.event, record.start_time) == (
        "Point MacKenzie Earthquake",
        "2018-11-30T17:29:39.137Z",
    )
    assert (record.magnitude, record.epicentral_distance, record.azimuth) == (7.0, 98.3, 90.0)
    assert record.processing == ("archive: band-pass 0.03 to 20 Hz",)
    assert not record.uncorrected


def test_the_step_is_that_of_the_processed_samples() -> None:
    [record] = read_bytes(PATH, cosmos(channel(reals={34: 0.02, 62: 5.0})))
    assert record.time_step == 0.005


@pytest.mark.parametrize(("units", "factor"), [("g(02)", 9.81), ("gal (10)", 0.01)])
def test_units(units: str, factor: float) -> None:
    [record] = read_bytes(PATH, cosmos(channel(units=units)))
    assert record.acceleration.tolist() == [factor * sample for sample in (1.0, -2.5, 0.5)]


def test_volume_1_is_uncorrected() -> None:
    [record] = read_bytes(PATH, cosmos(channel(stage=1)))
    assert record.uncorrected


def test_raw_says_how_it_was_converted() -> None:
    raw = channel([3.0, -5.0], stage=0, units="counts (50)", reals={34: 0.005, 64: 5.0})
    [record] = read_bytes(PATH, cosmos(raw))
    assert "counts converted with 0.8 uV a count, 1.2 V/g, gain 1" in record.processing
    assert record.uncorrected


@pytest.mark.parametrize(("gain", "said"), [(10.0, "gain 10"), (-999.0, "gain unstated")])
def test_gain(gain: float, said: str) -> None:
    raw = channel([3.0, -6.0], stage=0, units="counts (50)", reals={34: 0.005, 47: gain})
    [record] = read_bytes(PATH, cosmos(raw))
    assert record.acceleration[0] == pytest.approx(3 * 0.8e-6 / 1.2 / max(gain, 1.0) * 9.81)
    assert said in record.processing[-1]


@pytest.mark.parametrize(
    ("reals", "message"),
    [
        ({42: -999.0}, r":25: raw counts without a usable sensitivity: sensitivity .* unknown in"),
        ({42: 0.0}, r":25: raw counts without a usable sensitivity: .* 0 in item 42"),
        ({22: -999.0}, r":25: raw counts without a usable sensitivity: microvolts .* in item 22"),
        ({47: 0.0}, r":25: gain 0 in item 47 of the real header\. Must be positive"),
        ({62: 10.0}, r":25: time step 0\.005 s in item 34 .*but 10 ms in item 62"),
        ({23: 134.0}, r":25: 0\.8 uV a count .* make 13\.4218 V .*, but .* 134 V"),
        ({43: 4.1, 44: 2.0}, r":25: 1\.2 V/g .* and 2 g in item 44 make 2\.4 V, but 4\.1 V"),
    ],
)
def test_raw_is_refused(reals: dict[int, float], message: str) -> None:
    raw = channel(stage=0, units="counts (50)", reals={34: 0.005, 64: -2.0} | reals)
    with pytest.raises(InputError, match=message):
        read_bytes(PATH, cosmos(raw))


@pytest.mark.parametrize("sensitivity", [1000.0, -50.0])
def test_what_a_header_does_not_state_can_be_stated(sensitivity: float) -> None:
    raw = channel([3.0, -6.0], stage=0, units="counts (50)", reals={34: 0.005, 42: -999.0})
    with pytest.raises(InputError, match=r"usable sensitivity.*--sensitivity-counts-s2-m"):
        read_bytes(PATH, cosmos(raw))
    [record] = read_bytes(PATH, cosmos(raw), ReadOptions(sensitivity=sensitivity))
    assert record.acceleration.tolist() == [3.0 / sensitivity, -6.0 / sensitivity]
    unstated = cosmos(channel(reals={62: -999.0}))
    with pytest.raises(InputError, match=r"no time step \[ms\] .*--time-step-s"):
        read_bytes(PATH, unstated)
    [record] = read_bytes(PATH, unstated, ReadOptions(time_step=0.005))
    assert record.time_step == 0.005


@pytest.mark.parametrize(
    ("bits", "full_scale"),
    # Archives state the full range (5 V for +-2.5 V) or half of it (2.5 V).
    [(24, 13.4), (24, 6.71), (-999, 13.4), (16, 0.0524), (16, 13.4), (8, 2.05e-4), (32, 3436.0)],
)
def test_the_full_scale_is_that_of_all_counts(bits: int, full_scale: float) -> None:
    scales = {34: 0.005, 64: -2.0, 23: full_scale, 43: 4.8, 44: 4.0}
    raw = channel(stage=0, units="counts (50)", integers={35: bits}, reals=scales)
    assert len(read_bytes(PATH, cosmos(raw))) == 1


@pytest.mark.parametrize(("bits", "full_scale"), [(7, 1.02e-4), (33, 6872.0)])
def test_no_recorder_has_counts_of_so_few_or_many_bits(bits: int, full_scale: float) -> None:
    """The full scale fits them, but only the usual 24 bits are believed."""
    scales = {34: 0.005, 64: -2.0, 23: full_scale}
    raw = channel(stage=0, units="counts (50)", integers={35: bits}, reals=scales)
    with pytest.raises(InputError, match="V with 24 bits, but a full scale of"):
        read_bytes(PATH, cosmos(raw))


def test_the_nearest_number_of_bits_is_named() -> None:
    """Counts of 16 bits would make 0.0524 V, still further from 134 V than 24 bits."""
    scales = {34: 0.005, 64: -2.0, 23: 134.0}
    raw = channel(stage=0, units="counts (50)", integers={35: 16}, reals=scales)
    with pytest.raises(
        InputError, match=r"make 13\.4218 V with 24 bits, but a full scale of 134 V"
    ):
        read_bytes(PATH, cosmos(raw))


@pytest.mark.parametrize("ratio", [0.94, 0.96, 1.0, 1.04, 1.06])
@pytest.mark.parametrize(("item", "words"), [(54, 0.03), (57, 20.0)])
def test_corners_in_words_are_rounded_by_less_than_a_twentieth(
    item: int, words: float, ratio: float
) -> None:
    file = cosmos(channel(reals={item: ratio * words}))
    if abs(ratio - 1.0) < 0.05:
        assert len(read_bytes(PATH, file)) == 1
    else:
        with pytest.raises(InputError, match=f"filter corner {words:g} Hz in words, but"):
            read_bytes(PATH, file)


def test_seed_channel_names_what_the_text_does_not() -> None:
    [record] = read_bytes(PATH, cosmos(channel(label="Other  ")))
    assert (record.component, record.orientation) == ("BNZ", Orientation.VERTICAL)


@pytest.mark.parametrize(
    ("label", "code", "orientation"),
    [
        ("Up", 400, Orientation.VERTICAL),
        ("Vert", 401, Orientation.DOWNWARD),
        ("Vert", 402, Orientation.VERTICAL),
        ("Other", 401, Orientation.DOWNWARD),
        ("Down", 401, Orientation.DOWNWARD),
    ],
)
def test_the_sense_of_a_vertical(label: str, code: int, orientation: Orientation) -> None:
    [record] = read_bytes(PATH, cosmos(channel(label=label, integers={54: code})))
    assert record.orientation is orientation


@pytest.mark.parametrize(("label", "code"), [("Up", 401), ("Down", 400)])
def test_up_is_not_down(label: str, code: int) -> None:
    lines = channel(label=label, integers={54: code})
    with pytest.raises(InputError, match=rf":9: component {label.upper()} stated, but {code} in"):
        read_bytes(PATH, cosmos(lines))


def test_velocity_beside_acceleration_is_passed_over() -> None:
    velocity = channel(quantity="velocity", units="cm/sec(05)", integers={2: 2})
    records = read_bytes(PATH, cosmos(channel(), velocity, channel(label="Up")))
    assert [record.record_id for record in records] == ["BMR-090", "BMR-UP"]


def test_velocity_alone_is_refused() -> None:
    with pytest.raises(InputError, match=r":1: quantity 2 \(velocity\) in item 2 .*acceleration"):
        read_bytes(PATH, cosmos(channel(quantity="velocity", integers={2: 2})))


@pytest.mark.parametrize(
    ("quantity", "code", "message"),
    [
        ("acceleration", 2, r":52: 'Corrected acceleration', but quantity 2 \(velocity\)"),
        ("acceleration", -999, r":52: .* but quantity unknown in item 2"),
        ("velocity", 1, r":52: 'Corrected velocity', but quantity 1 \(acceleration\) in item 2"),
    ],
)
def test_a_channel_of_another_quantity_than_its_title_is_refused(
    quantity: str, code: int, message: str
) -> None:
    # A channel that counts as velocity would be skipped without notice.
    other = channel(quantity=quantity, label="Up", integers={2: code})
    with pytest.raises(InputError, match=message):
        read_bytes(PATH, cosmos(channel(), other))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"stage": 3}, r":1: processing stage 3 in item 1 .*0 \(raw\), 1 \(uncorrected\)"),
        ({"integers": {3: 5}}, r":49: units \(4\) stated, but 5 in item 3"),
        ({"units": "in/s/s(07)"}, r":49: acceleration units 'in/s/s' \(7\)\. Must be 2 \(g\), 4"),
        ({"integers": {54: 180}}, r":9: component 090 stated, but 180 in item 54"),
        ({"reals": {62: -999.0}}, r":25: no time step \[ms\] in item 62"),
        ({"reals": {62: 20.0}}, r":25: length 0\.015 s in item 63 .*, but 0\.06 s of samples"),
        ({"reals": {64: -2.6}}, r":25: peak -2\.6 cm/sec2 stated, but -2\.5 cm/sec2 in the file"),
        ({"reals": {64: 2.5}}, r":25: peak 2\.5 cm/sec2 stated, but -2\.5 cm/sec2 in the file"),
        ({"reals": {65: 3.0}}, r":25: peak stated at 3 s, but at 0\.005 s in the file"),
    ],
)
def test_headers_are_compared(changes: dict[str, object], message: str) -> None:
    lines = channel(**changes)  # type: ignore[arg-type]
    with pytest.raises(InputError, match=message):
        read_bytes(PATH, cosmos(lines))


@pytest.mark.parametrize(
    ("index", "old", "new", "message"),
    [
        (HEADING, "3", "4", r":49: 4 samples stated, 3 in the file"),
        (
            HEADING,
            "(8F10.3)",
            "(free)",
            r":49: format '\(free\)'\. Only formats such as '\(8F10\.5\)'",
        ),
        (HEADING, "pts", "points", r":49: .*such as '20000 acceleration pts"),
        (COMMENTS, "2", "3", r":46: 3 comment lines stated, 2 in the file"),
        (COMMENTS, "Comment", "Remark", r":46: .*such as '4 Comment line"),
        (REALS, "100", "101", r":25: 101 values of the real header stated, 100 in the file"),
        (REALS, "Real", "Integer", r":25: Integer header in the place of the Real header"),
        (INTEGERS, "10 lines", "9 lines", r":14: 100 values of the integer header stated, 90"),
        (INTEGERS + 1, "-999", "-9.9", r":15: header value '-9\.9'"),
        (REALS + 1, "-999.000000", "NaN        ", r":26: header value 'NaN'"),
        (SAMPLES, "-2.500", "   nan", r":50: acceleration 'nan' in characters 11 to 20"),
        (SAMPLES, "-2.500", "2.500", r":49: 3 samples stated|:50: 29 characters of samples"),
        (INTEGERS, "(10I8)", "(10F8.1)", r":14: format '\(10F8\.1\)' of the Integer header"),
        (0, "13 text", "12 text", r":1: 12 lines of text stated\. Must be 13 or more"),
        (0, "(Format v01.20 with 13 text lines)", "", "unknown format"),
    ],
)
def test_damaged(index: int, old: str, new: str, message: str) -> None:
    lines = channel()
    assert old in lines[index]
    lines[index] = lines[index].replace(old, new, 1)
    with pytest.raises(InputError, match=message):
        read_bytes(PATH, cosmos(lines))


@pytest.mark.parametrize("kept", [5, 13, 20, 30, 46, 48])
def test_truncated(kept: int) -> None:
    with pytest.raises(InputError, match=r"is no heading of a section|stated, \d+ in the file"):
        read_bytes(PATH, cosmos(channel()[:kept]))


def test_lost_line_of_samples() -> None:
    lines = channel([0.5] * 20)
    with pytest.raises(InputError, match=r":49: 20 samples stated, 12 in the file"):
        read_bytes(PATH, cosmos(lines[:SAMPLES] + lines[SAMPLES + 1 :]))


def test_whole_numbers_have_no_point() -> None:
    raw = channel(stage=0, units="counts (50)", reals={34: 0.005, 64: -2.0})
    raw[SAMPLES] = raw[SAMPLES].replace("      -2", "    -2.0")
    with pytest.raises(InputError, match=r":50: acceleration '-2\.0' .*Must be a whole number"):
        read_bytes(PATH, cosmos(raw))


def test_options_must_agree() -> None:
    with pytest.raises(InputError, match=r":49: acceleration units 'g' given, but the file states"):
        read_bytes(PATH, cosmos(channel()), ReadOptions(units="g"))


@pytest.mark.parametrize("end", [["/&"], ["End-of-data", "/&"], ["End-of-data for ChanBNZ"]])
def test_lines_that_end_a_channel(end: Lines) -> None:
    one, other = channel((1.0, 2.0, -3.0))[:-1], channel((3.0, 2.0, -4.0))[:-1]
    records = read_bytes(PATH, cosmos([*one, *end], [*other, *end]))
    assert [record.acceleration.size for record in records] == [3, 3]
