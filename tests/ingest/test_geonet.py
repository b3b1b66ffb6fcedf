from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rockframe.errors import InputError
from rockframe.ingest import read_bytes
from rockframe.ingest.formats.geonet import sniff as geonet_sniff
from rockframe.record import Orientation

PATH = Path("20180212_211557_WPWS_20.V2A")
SAMPLES = (0.1, -41.6, *[0.0] * 10)
Lines = list[str]


def component(
    name: str = "S16W",
    samples: tuple[float, ...] = SAMPLES,
    kind: str = "C",
    others: int | None = None,
    bearing: int = 196,
) -> Lines:
    """Return the lines of a component at 0.02 s: V2A, or V1A by `kind` "Unc" and 0 `others`."""
    count, peak = len(samples), max(samples, key=abs)
    rest = count if others is None else others
    integers = [0] * 40
    integers[8:10], integers[18:20], integers[38:40] = [2018, 2], [12, 21], [15, 17500]
    integers[27] = bearing
    integers[33:36] = [count, rest, rest]
    reals = [0.0] * 60
    reals[25] = 0.02
    readings = (
        "Instrument corrected data at 0.020 sec intervals"
        if kind == "C"
        else "Raw readings in units of 1.00 mm/s/s  at intervals of 0.020 s"
    )
    return [
        f"{kind}orrected accelerogram 20180212_211554_WPWS_20 GNS Science",
        "Site WPWS      39 56 38S  176 35 04E     Basalt file:  20180212_211557_WPWS",
        "Waipawa District Council",
        "Instrument Basalt_2413",
        "Resolution: 24-bit   Instr Period: 0.0050 s   Damping: 0.700",
        "Accelerogram 20180212_211554_WPWS_20                 Processed 2018 February 21",
        "6 km south of Waipukurau",
        "2018 February 12         21:15:54 UT",
        "Epicentre  40 03 27S 176 32 45E  Bearing S15W  Dist   13km  Depth    9km M  4.17",
        f"Number of points  {count}    Duration {0.02 * (count - 1):.2f} sec",
        readings,
        "Band-pass filter transition bands are .10-.25 Hz and 24.50-25.50 Hz",
        f"Component {name}  Longitudinal Accelerometer Axis",
        f"Acceleration:  peak    {peak:.1f} mm/s/s at  {0.02 * samples.index(peak):.2f} sec",
        "Velocity:      peak     1.65 mm/s   at  43.56 sec     rms     0.09 mm/s",
        "Displacement:  peak    0.131 mm     at  43.66 sec     rms    0.007 mm",
        *rows([f"{item:8d}" for item in integers]),
        *rows([f"{item:8.4f}" for item in reals]),
        *rows([f"{sample:8.1f}" for sample in samples]),
        *rows(["  0.0001"] * rest),
        *rows([" 0.00009"] * rest),
    ]


def rows(fields: list[str]) -> Lines:
    return ["".join(fields[start : start + 10]) for start in range(0, len(fields), 10)]


def geonet(*components: Lines) -> bytes:
    usual = (component(), component("S74E", bearing=106), component("Up", bearing=0))
    return "\n".join([line for lines in components or usual for line in [*lines]] + [""]).encode()


def test_facts() -> None:
    records = read_bytes(PATH, geonet())
    assert [r.record_id for r in records] == [f"{PATH.stem}-{c}" for c in ("S16W", "S74E", "UP")]
    assert [r.azimuth for r in records[:2]] == [196.0, 106.0]
    assert records[2].orientation is Orientation.VERTICAL
    first = records[0]
    assert (first.station, first.magnitude, first.epicentral_distance) == ("WPWS", 4.17, 13.0)
    assert first.event == "2018 February 12 21:15:54 UT"
    assert first.start_time == "2018-02-12T21:15:17.500Z"
    assert (first.time_step, first.uncorrected, first.acceleration.size) == (0.02, False, 12)


def test_raw() -> None:
    lines = component("S16W", SAMPLES, "Unc", 0)
    records = read_bytes(Path("a.V1A"), geonet(lines, lines, lines))
    assert [record.record_id for record in records] == ["a-S16W-1", "a-S16W-2", "a-S16W-3"]
    assert all(record.uncorrected for record in records)
    assert records[0].acceleration[1] == -41.6 * 0.001


@given(st.lists(st.integers(-99999, 99999).map(lambda n: n / 10), min_size=2, max_size=40))
def test_round_trip(samples: list[float]) -> None:
    lines = component(samples=tuple(samples))
    for record in read_bytes(PATH, geonet(lines, lines, lines)):
        assert np.array_equal(record.acceleration, np.array(samples) * 0.001)


def test_numbers_may_touch() -> None:
    lines = component(samples=(-12345.6,) * 11)
    assert (read_bytes(PATH, geonet(lines, lines, lines))[0].acceleration == -12345.6 * 0.001).all()


def test_no_time_where_samples_were_put_before_the_buffer() -> None:
    lines = component()
    lines[13] = lines[13].replace("0.02 sec", "-4.98 sec")
    lines[19] = lines[19][:8] + f"{250:8d}" + lines[19][16:]
    assert read_bytes(PATH, geonet(lines, lines, lines))[0].start_time == ""


@pytest.mark.parametrize(
    ("index", "old", "new", "message"),
    [
        (9, "points  12", "points  13", r":10: 13 points stated, but 12 in item 34"),
        (9, "0.22", "2.20", r":10: 2\.20 s stated, but 12 points at 0\.02 s"),
        (10, "0.020", "0.010", r":11: time step 0\.010 s stated, but 0\.02 in the real|0\.02 s in"),
        (10, "sec intervals", "", r":11: .*such as 'Instrument corrected data at"),
        (12, "S16W", "S17E", r":13: component 'S17E' is 163 degrees, but 196 in item 28"),
        (13, "-41.6", "-42.6", r":14: peak -42\.6 mm/s2 stated, but -41\.6 mm/s2 in the file"),
        (13, "-41.6", "41.6", r":14: peak 41\.6 mm/s2 stated, but -41\.6 mm/s2 in the file"),
        (13, "mm/s/s", "g", r":14: .*such as 'Acceleration:  peak"),
        (19, "      12", "      xx", r":20: item 34 'xx'\. Must be a number"),
        (26, "   -41.6", "     nan", r":27: acceleration 'nan' in characters 9 to 16"),
        (26, "   -41.6", "   -41.6 ", r":27: 81 characters of samples\. Must be 80"),
        (29, "  0.0001", "", r":30: 8 characters|12 samples stated, 11 in the file"),
    ],
)
def test_damaged(index: int, old: str, new: str, message: str) -> None:
    lines = component()
    assert old in lines[index]
    lines[index] = lines[index].replace(old, new, 1)
    with pytest.raises(InputError, match=message):
        read_bytes(PATH, geonet(lines, component(), component()))


@pytest.mark.parametrize("lost", [26, 28, 30, 31])
def test_lost_line_of_samples(lost: int) -> None:
    lines = component()
    del lines[lost]
    with pytest.raises(InputError, match=r":20: 6 lines of samples stated .* 5 in the file"):
        read_bytes(PATH, geonet(lines, component(), component()))


def test_lost_component() -> None:
    with pytest.raises(InputError, match=r":33: 2 components\. Must be 3"):
        read_bytes(PATH, geonet(component(), component()))


def test_raw_readings_in_other_units() -> None:
    lines = component("S16W", SAMPLES, "Unc", 0)
    lines[10] = lines[10].replace("1.00", "0.50")
    with pytest.raises(InputError, match=r":11: raw readings in units of 0\.50 mm/s/s\. Must be"):
        read_bytes(PATH, geonet(lines, lines, lines))


def test_truncated_header() -> None:
    with pytest.raises(
        InputError, match=r":20: the file ends after 20 of the 26 lines of a component's"
    ):
        read_bytes(PATH, "\n".join(component()[:20]).encode())


def test_csmip_is_another_format() -> None:
    head = b"Corrected accelerogram   89146-L2500-12044.02       Chan  1: 360 Deg\n"
    assert not geonet_sniff(head)


def with_time(time: float, prepended: int = 0) -> bytes:
    """Return the usual file with another stated time of the peak of its first component."""
    lines = component()
    lines[13] = lines[13].replace("0.02 sec", f"{time:.2f} sec")
    lines[19] = lines[19][:8] + f"{prepended:8d}" + lines[19][16:]
    return geonet(lines, component("S74E", bearing=106), component("Up", bearing=0))


def test_the_time_of_the_peak_is_counted_from_the_first_recorded_sample() -> None:
    assert len(read_bytes(PATH, with_time(-0.10, prepended=6))) == 3
    with pytest.raises(InputError, match=r"V2A:14: peak stated at 0.14 s, but at 0.02 s in the fi"):
        read_bytes(PATH, with_time(0.14))


def test_the_archives_filter_is_the_inner_end_of_its_transition_bands() -> None:
    record = read_bytes(PATH, geonet())[0]
    assert (record.filter_low, record.filter_high) == (0.25, 24.5)
