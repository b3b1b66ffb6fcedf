from __future__ import annotations

import math
import struct
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rockframe.errors import InputError
from rockframe.ingest import ReadOptions, read_bytes, read_file
from rockframe.record import Orientation

PATH = Path("CJ.T001230.HNE.sac")
IN_G = ReadOptions(units="g")
SAMPLES = (0.125, -0.25, 0.5)
#: Byte offsets of header fields: first floats, then integers.
DELTA, DEPMAX, SCALE, DEPMEN, CMPAZ, CMPINC = (4 * place for place in (0, 2, 3, 56, 57, 58))
NZYEAR, NVHDR, NPTS, IFTYPE, IDEP, LEVEN = (4 * (70 + place) for place in (0, 6, 9, 15, 16, 35))


def sac(
    samples: tuple[float, ...] = SAMPLES,
    order: str = "<",
    fields: dict[int, float] | None = None,
    name: bytes = b"HNE",
) -> bytes:
    """Return a file at 0.02 s; `fields` maps the byte offset of a header field to its value."""
    floats = [-12345.0] * 70
    floats[0], floats[1], floats[2], floats[5] = 0.02, min(samples), max(samples), 0.0
    floats[57], floats[58] = 90.0, 90.0
    integers = [-12345] * 40
    integers[:6] = [2019, 187, 3, 19, 52, 0]
    integers[6], integers[9], integers[15], integers[35] = 6, len(samples), 1, 1
    names = b"T001230 " + b"-12345  " * 19 + name + b"\x0045  " + b"CJ\x00345  " + b"-12345  " * 2
    data = bytearray(
        struct.pack(f"{order}70f40i", *floats, *integers)
        + names
        + struct.pack(f"{order}{len(samples)}f", *samples)
    )
    for place, value in (fields or {}).items():
        struct.pack_into(f"{order}{'f' if place < 280 else 'i'}", data, place, value)
    return bytes(data)


def obspy_stream(data: bytes, **changes: Any) -> Any:
    from obspy import read

    [trace] = read(BytesIO(data), format="SAC")
    trace.stats.sac.update(changes)
    return trace


@pytest.mark.parametrize("order", ["<", ">"])
def test_facts(order: str) -> None:
    [record] = read_bytes(PATH, sac(order=order), IN_G)
    assert record.acceleration.tolist() == [9.81 * sample for sample in SAMPLES]
    # The header states the step in single precision.
    assert record.time_step == 0.019999999552965164
    assert (record.record_id, record.component) == ("CJ.T001230.HNE", "HNE")
    assert (record.station, record.network, record.event) == ("T001230", "CJ", "")
    assert (record.orientation, record.azimuth) == (Orientation.HORIZONTAL, 90.0)
    assert record.start_time == "2019-07-06T03:19:52.000000Z"
    assert math.isnan(record.magnitude)


@given(
    st.lists(st.floats(-1e6, 1e6, width=32), min_size=2, max_size=40), st.sampled_from(["<", ">"])
)
def test_round_trip(samples: list[float], order: str) -> None:
    [record] = read_bytes(PATH, sac(tuple(samples), order), ReadOptions(units="m/s2"))
    assert record.acceleration.tolist() == samples


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_obspy_reads_the_same() -> None:
    trace = obspy_stream(sac())
    assert trace.data.tolist() == list(SAMPLES)
    assert trace.stats.npts == 3


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_alphanumeric_as_obspy_writes_it() -> None:
    target = BytesIO()
    obspy_stream(sac()).write(target, format="SACXY")
    [record] = read_bytes(PATH, target.getvalue(), IN_G)
    assert record.acceleration.tolist() == [9.81 * sample for sample in SAMPLES]
    assert (record.time_step, record.component, record.azimuth) == (0.02, "HNE", 90.0)
    assert (record.station, record.network) == ("T001230", "CJ")


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_alphanumeric_cut_short() -> None:
    target = BytesIO()
    obspy_stream(sac(tuple(range(10)))).write(target, format="SACXY")
    lines = target.getvalue().rstrip().split(b"\n")
    with pytest.raises(InputError, match=r":16: NPTS 10 in the header, 5 samples in the file"):
        read_bytes(PATH, b"\n".join(lines[:-1]), IN_G)


@pytest.mark.parametrize(("offset", "uncorrected"), [(0.0, False), (1.0, True)])
def test_an_offset_shows_that_nothing_was_corrected(offset: float, uncorrected: bool) -> None:
    data = sac((offset + 0.25, offset - 0.5, offset + 0.25))
    assert read_bytes(PATH, data, IN_G)[0].uncorrected is uncorrected


@pytest.mark.parametrize("rate", [128, 256, 512])
def test_a_step_that_is_no_whole_number_of_microseconds_stays_exact(rate: int) -> None:
    """1/128 s has all its digits in single precision; obspy reads 7812 microseconds."""
    [record] = read_bytes(PATH, sac(fields={DELTA: 1.0 / rate}), IN_G)
    assert record.time_step == 1.0 / rate


def test_units_are_needed() -> None:
    with pytest.raises(InputError, match=r"units unstated, as in every SAC file.*--units"):
        read_bytes(PATH, sac())


def test_a_step_given_in_full_agrees() -> None:
    [record] = read_bytes(PATH, sac(), ReadOptions("g", 0.02))
    assert record.time_step == 0.019999999552965164
    with pytest.raises(InputError, match=r"time step 0\.01 s given, but the file states 0\.0199"):
        read_bytes(PATH, sac(), ReadOptions("g", 0.01))


@pytest.mark.parametrize(
    ("incidence", "orientation"), [(0.0, Orientation.VERTICAL), (180.0, Orientation.DOWNWARD)]
)
def test_vertical(incidence: float, orientation: Orientation) -> None:
    [record] = read_bytes(PATH, sac(fields={CMPINC: incidence}, name=b"HNZ"), IN_G)
    assert record.orientation is orientation


@pytest.mark.parametrize(
    ("fields", "name", "words"),
    [
        ({CMPAZ: 0.0}, b"HNE", "component 'HNE', but CMPINC 90 and CMPAZ 0"),
        ({CMPAZ: 95.1}, b"HNE", "component 'HNE', but CMPINC 90 and CMPAZ 95.1"),
        ({CMPAZ: 264.9}, b"HNE", "component 'HNE', but CMPINC 90 and CMPAZ 264.9"),
        ({CMPINC: 0.0}, b"HNN", "component 'HNN', but CMPINC 0 and CMPAZ 90"),
        ({}, b"HNZ", "component 'HNZ', but CMPINC 90 and CMPAZ 90"),
        ({SCALE: 213945.0}, b"HNE", "SCALE 213945. Must be 1 or undefined"),
        ({DEPMEN: 0.2}, b"HNE", "DEPMEN 0.2 in the header, 0.125 in the samples"),
    ],
)
def test_contradictions(fields: dict[int, float], name: bytes, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_bytes(PATH, sac(fields=fields, name=name), IN_G)


@pytest.mark.parametrize("azimuth", [92.5, 95.0, 265.0, 270.0, 273.0, 450.0])
def test_a_component_may_be_slightly_askew_or_reversed(azimuth: float) -> None:
    [record] = read_bytes(PATH, sac(fields={CMPAZ: azimuth, SCALE: 1.0, DEPMEN: 0.125}), IN_G)
    assert record.azimuth == azimuth


@pytest.mark.parametrize(("stated", "azimuth"), [(360.0, 0.0), (-2.0, 358.0), (362.0, 362.0)])
def test_azimuths_are_below_360_unless_a_warning_needs_them(stated: float, azimuth: float) -> None:
    [record] = read_bytes(PATH, sac(fields={CMPAZ: stated}, name=b"HNN"), IN_G)
    assert record.azimuth == azimuth


def test_direction_by_the_name_where_unstated() -> None:
    [record] = read_bytes(PATH, sac(fields={CMPINC: -12345.0, CMPAZ: -12345.0}), IN_G)
    assert record.azimuth == 90.0


def test_the_end_of_the_name_may_be_the_component() -> None:
    assert read_bytes("CLC.HNE", sac(), IN_G)[0].record_id == "CLC.HNE"


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({NPTS: 4}, r"NPTS 4 in the header, 3 samples in the file"),
        ({NPTS: -1}, r"NPTS -1 in the header, 3 samples in the file"),
        ({NVHDR: 7}, r"SAC header version 7\. Only version 6 is read"),
        ({IDEP: 7}, r"IDEP 7 is velocity, not an acceleration"),
        ({IDEP: 6}, r"IDEP 6 is displacement, not an acceleration"),
        ({LEVEN: 0}, r"LEVEN 0, IFTYPE 1\. Must be 1 and 1: an evenly sampled time series"),
        ({IFTYPE: 4}, r"LEVEN 1, IFTYPE 4\. Must be 1 and 1"),
        ({DEPMAX: 0.75}, r"DEPMAX 0\.75 in the header, 0\.5 in the samples"),
        ({4 * 6: 0.4}, r"E 0\.4 s in the header, but 3 samples at 0\.02 s from 0 s end at 0\.04 s"),
        ({0: 0.0}, r"time step 0\.0 s\. Must be positive"),
        ({0: math.nan}, r"time step nan s\. Must be positive"),
        ({632: 0}, r"DEPMAX|samples"),
    ],
)
def test_damaged(fields: dict[int, float], message: str) -> None:
    data = sac((9.0, -0.25, 0.5) if 632 in fields else SAMPLES, fields=fields)
    with pytest.raises(InputError, match=message):
        read_bytes(PATH, data, IN_G)


def test_cut() -> None:
    with pytest.raises(InputError, match=r"NPTS 3 in the header, 2\.5 samples in the file"):
        read_bytes(PATH, sac()[:-2], IN_G)


@pytest.mark.parametrize("value", [math.nan, math.inf, 1e35])
def test_not_finite(value: float) -> None:
    with pytest.raises(InputError, match=r"sample 2 is .*Must be finite and below 1e30"):
        read_bytes(PATH, sac()[:-8] + struct.pack("<2f", value, 0.5), IN_G)


def test_an_unset_time_stays_unknown() -> None:
    assert read_bytes(PATH, sac(fields={NZYEAR: -12345}), IN_G)[0].start_time == ""


def test_years_have_four_digits() -> None:
    """The search for StationXML needs years of four digits."""
    early = sac(fields={NZYEAR: 995})
    assert read_bytes(PATH, early, IN_G)[0].start_time == "0995-07-06T03:19:52.000000Z"
    with pytest.raises(InputError, match=r"no StationXML of CJ\.T001230\.\.HNE at 0995"):
        read_bytes(PATH, sac(fields={NZYEAR: 995, SCALE: 1000.0}), IN_G)


def test_counts_with_a_station_xml(tmp_path: Path) -> None:
    """Data centres write counts into SAC files, and the sensitivity into SCALE."""
    from .test_miniseed import channel_xml, station_xml

    xml = station_xml(channel_xml(rate="50.0")).replace("CLC", "T001230").replace("CI", "CJ")
    (tmp_path / "CJ.xml").write_text(xml)
    path = tmp_path / PATH.name
    path.write_bytes(sac(fields={SCALE: 1000.0}))
    [record] = read_file(path)
    assert record.acceleration == pytest.approx([sample / 1000.0 for sample in SAMPLES])
    assert record.instrument_file == "CJ.xml"
    path.write_bytes(sac(fields={SCALE: 900.0}))
    with pytest.raises(InputError, match=r"SCALE 900, but 1000 counts per m/s2 in CJ\.xml"):
        read_file(path)
    (tmp_path / "CJ.xml").unlink()
    with pytest.raises(InputError, match=r"SCALE 900\. Must be 1 or undefined, or have a Station"):
        read_file(path, IN_G)
