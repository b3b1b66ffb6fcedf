from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rockframe.errors import InputError, ParameterError
from rockframe.ingest import ReadOptions, collect, read_bytes, read_file, sorted_out
from rockframe.record import Orientation, SiteType

# obspy 1.5 looks up its entry points in a way that Python 3.11 deprecates.
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")

START = "2019-07-06T03:19:23.0383"
COUNTS = (0, 1000, -3000, 2000)
Write = Callable[..., Path]


def trace(counts: Any = COUNTS, channel: str = "HNE", start: str = START, **header: Any) -> Any:
    from obspy import Trace, UTCDateTime

    codes = {"network": "CI", "station": "CLC", "channel": channel, "delta": 0.01}
    begin = {"starttime": UTCDateTime(start)}
    return Trace(np.array(counts, dtype=np.int32), {**codes, **begin, **header})


def mseed(*traces: Any, **options: Any) -> bytes:
    from obspy import Stream

    target = BytesIO()
    Stream(list(traces or [trace()])).write(target, format="MSEED", **{"reclen": 512, **options})
    return target.getvalue()


def channel_xml(
    code: str = "HNE",
    value: str = "1000.0",
    units: str = "M/S**2",
    dip: str = "0.0",
    rate: str = "100.0",
    epoch: str = 'startDate="2012-04-13T17:28:00"',
    output: str = "COUNTS",
    stages: str = "",
) -> str:
    return f"""<Channel code="{code}" locationCode="" {epoch}>
<Latitude>35.8</Latitude><Longitude>-117.6</Longitude><Elevation>775</Elevation><Depth>0</Depth>
<Azimuth>90.0</Azimuth><Dip>{dip}</Dip><SampleRate>{rate}</SampleRate>
<Response><InstrumentSensitivity><Value>{value}</Value><Frequency>0.03</Frequency>
<InputUnits><Name>{units}</Name></InputUnits><OutputUnits><Name>{output}</Name></OutputUnits>
</InstrumentSensitivity>{stages}</Response></Channel>"""


def stage_xml(number: int, gain: str, enters: str, leaves: str) -> str:
    """Return a stage that only multiplies by a gain."""
    return f"""<Stage number="{number}"><Coefficients>
<InputUnits><Name>{enters}</Name></InputUnits><OutputUnits><Name>{leaves}</Name></OutputUnits>
<CfTransferFunctionType>DIGITAL</CfTransferFunctionType></Coefficients>
<StageGain><Value>{gain}</Value><Frequency>0.03</Frequency></StageGain></Stage>"""


def station_xml(*channels: str) -> str:
    return f"""<?xml version="1.0"?>
<FDSNStationXML xmlns="http://www.fdsn.org/xml/station/1" schemaVersion="1.1">
<Source>test</Source><Created>2019-08-02T10:45:47</Created><Network code="CI">
<Station code="CLC"><Latitude>35.8</Latitude><Longitude>-117.6</Longitude>
<Elevation>775</Elevation><Site><Name>China Lake</Name></Site>
{"".join(channels or [channel_xml()])}</Station></Network></FDSNStationXML>"""


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Return a function that writes a miniSEED file and its StationXML (`None`: without)."""

    def _write(data: bytes | None = None, xml: str | None = "") -> Path:
        path = tmp_path / "CI.CLC..HNE.mseed"
        path.write_bytes(mseed() if data is None else data)
        if xml is not None:
            (tmp_path / "CI.CLC.xml").write_text(xml or station_xml())
        return path

    return _write


def test_facts(write: Write) -> None:
    [record] = read_file(write())
    assert record.acceleration.tolist() == [0.0, 1.0, -3.0, 2.0]
    assert (record.record_id, record.component, record.azimuth) == ("CI.CLC..HNE", "HNE", 90.0)
    assert (record.station, record.network, record.time_step) == ("CLC", "CI", 0.01)
    assert (record.start_time, record.uncorrected) == ("2019-07-06T03:19:23.038300Z", True)
    assert record.processing == ("divided by the sensitivity of 1000 counts per m/s2 (CI.CLC.xml)",)


@given(st.lists(st.integers(-(2**28), 2**28), min_size=2, max_size=300))
def test_round_trip(tmp_path_factory: pytest.TempPathFactory, counts: list[int]) -> None:
    xml = tmp_path_factory.getbasetemp() / "round-trip.xml"
    xml.write_text(station_xml())
    data = mseed(trace(counts), encoding="INT32")
    [record] = read_bytes("a.mseed", data, ReadOptions(station_xml=xml))
    assert record.acceleration.tolist() == [count / 1000.0 for count in counts]


@pytest.mark.parametrize(
    ("units", "factor"),
    [("m/s**2", 1.0), ("m/s^2", 1.0), ("M/S/S", 1.0), ("m/(s**2)", 1.0), ("cm/s**2", 1e-2),
     ("mm/s2", 1e-3), ("nm/s**2", 1e-9), ("NM/S**2", 1e-9),
     ("g", 9.81)],
)  # fmt: skip
def test_units_of_the_sensitivity(write: Write, units: str, factor: float) -> None:
    [record] = read_file(write(xml=station_xml(channel_xml(units=units))))
    assert record.acceleration == pytest.approx([0.0, factor, -3 * factor, 2 * factor])


def test_an_epoch_may_begin_and_end_with_the_samples(write: Write) -> None:
    epoch = f'startDate="{START}" endDate="2019-07-06T03:19:23.0683"'
    [record] = read_file(write(xml=station_xml(channel_xml(epoch=epoch))))
    assert record.acceleration.size == 4


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"units": "M/S"}, r"per 'M/S', a velocity, not an acceleration"),
        ({"units": "M/SEC"}, r"a velocity, not an acceleration"),
        ({"units": "V"}, r"sensitivity of CI\.CLC\.\.HNE per 'V'\. Must be per m/s\*\*2"),
        ({"value": "0.0"}, r"sensitivity 0 of CI\.CLC\.\.HNE\. Must be finite, and not zero"),
        ({"value": "NaN"}, r"sensitivity nan of CI\.CLC\.\.HNE\. Must be finite|cannot be read"),
        ({"output": "V"}, r"sensitivity of CI\.CLC\.\.HNE to 'V'\. Must be to counts"),
        ({"rate": "200.0"}, r"100 samples a second in the file, 200 in CI\.CLC\.xml"),
        ({"code": "HNN"}, r"no StationXML of CI\.CLC\.\.HNE at 2019-07.*looked at: CI\.CLC\.xml"),
        ({"epoch": 'startDate="2019-07-07T00:00:00"'}, r"HNE for other times: from 2019-07-07"),
        ({"epoch": 'endDate="2019-07-06T03:19:23.05"'}, r"HNE for other times: to .*3\.05.*xml"),
    ],
)
def test_station_xml_that_does_not_fit(write: Write, changes: dict[str, str], message: str) -> None:
    with pytest.raises(InputError, match=message):
        read_file(write(xml=station_xml(channel_xml(**changes))))


@pytest.mark.parametrize(
    ("units", "gain", "message"),
    [
        ("M/S**2", "1000.0", ""),
        ("M/S**2", "1005.0", ""),  # rounded
        ("CM/S**2", "10.0", ""),
        ("M/S**2", "10000.0", r"is 1000 counts per m/s2, but the gains .* multiply to 10000\."),
        ("CM/S**2", "1000.0", r"multiply to 100000\. Must agree within 1%"),
        ("M/S", "1000.0", r"first stage of .* is per 'M/S', its sensitivity per 'M/S\*\*2'"),
    ],
)
def test_the_sensitivity_is_the_product_of_the_stages(
    write: Write, units: str, gain: str, message: str
) -> None:
    stages = stage_xml(1, "0.5", units, "V") + stage_xml(2, str(2 * float(gain)), "V", "COUNTS")
    path = write(xml=station_xml(channel_xml(stages=stages)))
    if message:
        with pytest.raises(InputError, match=message):
            read_file(path)
    else:
        assert read_file(path)[0].acceleration.tolist() == [0.0, 1.0, -3.0, 2.0]


def test_no_station_xml(write: Write) -> None:
    with pytest.raises(InputError, match=r"looked at: none that names .* with --station-xml"):
        read_file(write(xml=None))


@pytest.mark.parametrize("deeper", [False, True])
def test_station_xml_in_the_archive(tmp_path: Path, *, deeper: bool) -> None:
    """miniSEED and SAC files find StationXML in the same archive, as data centres pack it."""
    from .test_containers import tarred, zipped
    from .test_sac import SCALE, sac

    known = station_xml(channel_xml(rate="50.0")).replace("CLC", "T001230").replace("CI", "CJ")
    counts = {"data/a.mseed": mseed(), "data/T001230.sac": sac(fields={SCALE: 1000.0})}
    described = {"CI.xml": station_xml().encode(), "meta/CJ.xml": known.encode()}
    data = tarred(*counts.items(), *described.items())
    name = "b.tgz" if deeper else "a.tgz"
    path = tmp_path / "a.zip" if deeper else tmp_path / name
    path.write_bytes(zipped((name, data)) if deeper else data)
    outcomes = list(collect([tmp_path]))
    records, rejections = sorted_out(outcomes)
    assert not rejections
    assert len(outcomes) == 4  # each StationXML has a row, as unread
    place = "a.zip:b.tgz:" if deeper else "a.tgz:"
    assert [r.instrument_file for r in records] == [f"{place}CI.xml", f"{place}meta/CJ.xml"]
    assert [r.instrument_file for r in read_file(path)] == [r.instrument_file for r in records]
    assert records[0].acceleration == pytest.approx([0.0, 1.0, -3.0, 2.0])


def test_station_xml_beside_the_archive(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """StationXML is searched in the archive's folder, not in the working directory."""
    from .test_containers import zipped

    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "a.zip").write_bytes(zipped(("a.mseed", mseed())))
    (tmp_path / "CI.xml").write_text(station_xml())
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match="no StationXML of CI"):
        read_file("in/a.zip")
    (tmp_path / "CI.xml").rename(tmp_path / "in" / "CI.xml")
    [record] = read_file("in/a.zip")
    assert record.instrument_file == "CI.xml"


def test_station_xml_elsewhere(write: Write, tmp_path: Path) -> None:
    xml = tmp_path / "metadata.d" / "all.xml"
    xml.parent.mkdir()
    xml.write_text(station_xml())
    assert len(read_file(write(xml=None), ReadOptions(station_xml=xml))) == 1


@pytest.mark.parametrize(
    ("xml", "message"),
    [
        (station_xml()[:700], r"mseed: StationXML b\.xml: cannot be read as StationXML"),
        ("<!DOCTYPE a>" + station_xml(), r"XML with a document type is not read\. Save"),
        (station_xml(channel_xml(), channel_xml(value="2.0")), r"described differently in"),
    ],
)
def test_damaged_station_xml(write: Write, tmp_path: Path, xml: str, message: str) -> None:
    (tmp_path / "b.xml").write_text(xml)
    with pytest.raises(InputError, match=message):
        read_file(write(xml=None), ReadOptions(station_xml=tmp_path / "b.xml"))


def test_a_description_given_twice_is_one(write: Write, tmp_path: Path) -> None:
    (tmp_path / "again.xml").write_text(station_xml())
    assert len(read_file(write())) == 1


def test_vertical(write: Write) -> None:
    [record] = read_file(write(xml=station_xml(channel_xml(dip="-90.0"))))
    assert record.orientation is Orientation.VERTICAL


def test_a_sensor_far_below_the_surface_is_in_a_borehole(write: Write) -> None:
    deep = station_xml().replace("<Depth>0</Depth>", "<Depth>120</Depth>")
    assert read_file(write(xml=deep))[0].site_type is SiteType.BOREHOLE


def test_lost_station_xml(write: Write, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"mseed: StationXML c\.xml: cannot be opened: No such"):
        read_file(write(), ReadOptions(station_xml=tmp_path / "c.xml"))


@pytest.mark.parametrize("channel", ["HHE", "BHZ"])
def test_seismometer(write: Write, channel: str) -> None:
    with pytest.raises(InputError, match=rf"channel '{channel}' is a velocity, of a seismometer"):
        read_file(write(mseed(trace(channel=channel))))


def test_channels(write: Write) -> None:
    data = mseed(trace(), trace(channel="HNN"))
    path = write(data, station_xml(channel_xml(), channel_xml("HNN", value="500.0")))
    records = read_file(path)
    assert [record.record_id for record in records] == [
        "CI.CLC..HNE-CI.CLC..HNE",
        "CI.CLC..HNE-CI.CLC..HNN",
    ]
    assert [record.acceleration[1] for record in records] == [1.0, 2.0]


@pytest.mark.parametrize(
    ("start", "what"), [("2019-07-06T03:19:24", "gap"), ("2019-07-06T03:19:23.05", "overlap")]
)
def test_pieces(write: Write, start: str, what: str) -> None:
    data = mseed(trace()) + mseed(trace(start=start))
    with pytest.raises(
        InputError, match=rf"{what} in CI\.CLC\.\.HNE: 2019-07-06T03:19:23\.068300Z to {start}"
    ):
        read_file(write(data))


def test_records_in_line_are_one_piece(write: Write) -> None:
    data = mseed(trace()) + mseed(trace(start="2019-07-06T03:19:23.0783"))
    assert read_file(write(data))[0].acceleration.size == 8


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda data: data[:-1], r"record at byte 512 is cut off: 511 of 512 bytes"),
        (lambda data: data + b"x" * 60, r"no miniSEED header at byte 1024: the file is corrupted"),
        (lambda data: data[:512] + bytes(512), r"no miniSEED header at byte 512"),
        (lambda data: data[:46] + bytes(2) + data[48:], r"no length in the record at byte 0"),
        (lambda data: data[:30] + b"\0\1" + data[32:], r"obspy's MSEED reader failed|in the head"),
        (lambda data: data[:200] + bytes(200) + data[400:], r"obspy's MSEED reader failed: "),
        (lambda data: data[:8] + b"\xff" + data[9:], r"no miniSEED header at byte 0"),
    ],
)
def test_damaged(write: Write, change: Callable[[bytes], bytes], message: str) -> None:
    rough = np.random.default_rng(1).integers(-9000, 9000, 350)
    data = mseed(trace(rough), encoding="STEIM2")
    assert len(data) == 1024
    with pytest.raises(InputError, match=message):
        read_file(write(change(data)))


def test_not_finite(write: Write) -> None:
    piece = trace()
    piece.data = np.array([0.0, np.nan, 1.0], dtype=np.float32)
    with pytest.raises(InputError, match=r"CI\.CLC\.\.HNE contains NaN or infinity"):
        read_file(write(mseed(piece)))


def test_log_messages(write: Write) -> None:
    piece = trace()
    piece.data = np.frombuffer(b"clock locked", dtype="|S1")
    with pytest.raises(InputError, match=r"Must be 2 numbers or more"):
        read_file(write(mseed(piece)))


def test_full_response_needs_stages(write: Write) -> None:
    with pytest.raises(InputError, match=r"no stages of CI\.CLC\.\.HNE in CI\.CLC\.xml"):
        read_file(write(), ReadOptions(water_level=60.0))


def test_units_must_agree(write: Write) -> None:
    with pytest.raises(InputError, match=r"units 'g' given, but the file states 'm/s2'"):
        read_file(write(), ReadOptions(units="g"))


def test_station_xml_is_no_record(write: Write) -> None:
    path = write()
    (path.parent / "quakes.xml").write_text("<quakeml/>")
    records, rejections = sorted_out(collect([path.parent]))
    assert [record.record_id for record in records] == ["CI.CLC..HNE"]
    assert [rejection.file for rejection in rejections] == ["quakes.xml"]


def test_options_of_the_command_line(write: Write, tmp_path: Path) -> None:
    from rockframe.cli.main import main

    path, output = write(), tmp_path / "records.nc"
    xml = tmp_path / "given" / "CI.CLC.xml"
    xml.parent.mkdir()
    (tmp_path / "CI.CLC.xml").rename(xml)
    arguments = ["ingest", str(path), "--output", str(output), "--station-xml", str(xml)]
    arguments += ["--workers", "0"]
    assert main([*arguments, "--water-level", "60"]) == 2
    long = mseed(trace(np.random.default_rng(1).integers(-9000, 9000, 3000)))
    path.write_bytes(long)
    assert main(arguments) == 0
    assert output.is_file()


@pytest.mark.parametrize("level", [0.0, -60.0, float("nan")])
def test_water_level(level: float) -> None:
    with pytest.raises(ParameterError, match=r"Invalid water level .* dB\. Must be positive"):
        ReadOptions(water_level=level)


def long(write: Write) -> tuple[Path, bytes]:
    """Return the path of a file of many records, with StationXML next to it, and its bytes."""
    counts = (1000 * np.random.default_rng(1).standard_normal(3000)).astype(int)
    data = mseed(trace(counts))
    return write(data), data


def test_the_first_half_lost_is_told(write: Write) -> None:
    path, data = long(write)
    assert len(data) // 512 > 4
    path.write_bytes(data[1024:])
    [record] = read_file(path)
    assert record.processing[0] == "archive: begins with record 3 of its sequence"


def test_a_record_lost_within_is_a_gap(write: Write) -> None:
    path, data = long(write)
    path.write_bytes(data[:512] + data[1024:])
    with pytest.raises(InputError, match=r"gap in CI\.CLC\.\.HNE"):
        read_file(path)


@pytest.mark.parametrize(("bit", "said"), [(0, "clipping"), (1, "clipping"), (4, "")])
def test_flags_of_data_quality(write: Write, bit: int, said: str) -> None:
    path, data = long(write)
    path.write_bytes(data[:512] + data[512 : 512 + 38] + bytes([1 << bit]) + data[512 + 39 :])
    if said:
        assert read_file(path)[0].processing[0] == f"archive: {said} flagged"
    else:
        with pytest.raises(InputError, match="the headers flag missing or padded data"):
            read_file(path)


def test_a_fetched_file_is_held_to_its_hash(write: Write) -> None:
    path, data = long(write)
    digest = hashlib.sha256(data).hexdigest()
    files = {path.name: {"sha256": digest}, "lost.mseed": {"sha256": digest}}
    (path.parent / "request.json").write_text(json.dumps({"files": files}))
    [record], [rejection] = sorted_out(collect([path.parent]))
    assert record.source_sha256 == digest
    assert (rejection.file, rejection.reason) == ("lost.mseed", "no such file.")
    path.write_bytes(data[: len(data) // 1024 * 512])
    [], rejections = sorted_out(collect([path.parent]))
    assert rejections[0].reason.startswith("changed since it was fetched: SHA-256")


#: Number of samples in a data record of `pieces`.
PIECE = 100


def pieces(*late: float) -> list[bytes]:
    """Return data records of 100 samples, each this number of samples after its place."""
    from obspy import UTCDateTime

    counts = np.arange(PIECE * len(late)).reshape(-1, PIECE)
    starts = [UTCDateTime(START) + 0.01 * (PIECE * k + shift) for k, shift in enumerate(late)]
    return [
        mseed(trace(row, start=str(start)), encoding="INT32")
        for row, start in zip(counts, starts, strict=True)
    ]


@pytest.mark.parametrize("order", [(0, 1, 2, 3), (3, 2, 1, 0), (1, 0, 3, 2)])
@pytest.mark.parametrize("codes", ["DDDD", "DDQQ", "QDMR"])
def test_quality_codes_and_the_order_of_records_make_no_gap(
    write: Write, order: tuple[int, ...], codes: str
) -> None:
    """Data centres replace the code after a check, and archives append records that came late."""
    records = [
        piece[:6] + code.encode() + piece[7:]
        for piece, code in zip(pieces(0, 0, 0, 0), codes, strict=True)
    ]
    [record] = read_file(write(b"".join(records[k] for k in order)))
    assert np.array_equal(record.acceleration, np.arange(4 * PIECE) / 1000.0)
    assert record.start_time == "2019-07-06T03:19:23.038300Z"
    lost = b"".join(records[k] for k in order if k != 1)
    with pytest.raises(InputError, match=r"gap in CI\.CLC\.\.HNE: "):
        read_file(write(lost))
    doubled = b"".join([*records, records[1]])
    with pytest.raises(InputError, match=r"overlap in CI\.CLC\.\.HNE: "):
        read_file(write(doubled))


@pytest.mark.parametrize("drift", [0.4, -0.4, 0.2])
def test_records_that_drift_are_not_even_unless_trusted(write: Write, drift: float) -> None:
    """Each differs from the one before it by less than obspy allows; together they do not."""
    path = write(b"".join(pieces(*(drift * k for k in range(6)))))
    with pytest.raises(
        InputError, match=r"headers 100: .* apart\. .*--trust waveform or --trust h"
    ):
        read_file(path)
    [record] = read_file(path, ReadOptions(trust=("header",)))
    assert record.time_step == 0.01
    [record] = read_file(path, ReadOptions(trust=("waveform",)))
    assert record.time_step == pytest.approx(0.01 * (1.0 + drift / PIECE), rel=1e-6)


def test_jitter_of_a_clock_is_no_drift(write: Write) -> None:
    [record] = read_file(write(b"".join(pieces(0.0, 0.4, -0.1, 0.3, 0.0))))
    assert (record.time_step, record.acceleration.size) == (0.01, 5 * PIECE)


def test_records_of_different_rates_are_named_as_such(write: Write) -> None:
    from obspy import UTCDateTime

    other = trace(range(9), start=str(UTCDateTime(START) + 0.04), delta=0.005)
    with pytest.raises(InputError, match=r"HNE has 100 samples a second, and 200 from 2019-07-06"):
        read_file(write(mseed(trace()) + mseed(other)))


BOUNDARY = "2019-07-06T03:19:23.05"
BEFORE, AFTER = f'endDate="{BOUNDARY}"', f'startDate="{BOUNDARY}"'


def test_a_record_may_cross_two_epochs_that_are_the_same(write: Write) -> None:
    xml = station_xml(channel_xml(epoch=BEFORE), channel_xml(epoch=AFTER))
    [record] = read_file(write(xml=xml))
    assert record.acceleration.tolist() == [0.0, 1.0, -3.0, 2.0]


@pytest.mark.parametrize(
    ("first", "second", "message"),
    [
        ({"epoch": BEFORE}, {"epoch": AFTER, "value": "2000.0"},
         r"differently in two epochs of CI\.CLC\.xml: to 2019-.*, and from .* Cut the record"),
        ({}, {"value": "2000.0"}, r"in two epochs of CI\.CLC\.xml: .* Keep one"),
        ({"epoch": BEFORE}, {"epoch": 'startDate="2019-07-07T00:00:00"'},
         r"other times: to 2019-07-06.*; from 2019-07-07.* The record lasts from 2019-07-06"),
    ],
)  # fmt: skip
def test_epochs_that_differ_or_do_not_meet(
    write: Write, first: dict[str, str], second: dict[str, str], message: str
) -> None:
    """Before, the message was that there is no StationXML, or named one file twice."""
    with pytest.raises(InputError, match=message):
        read_file(write(xml=station_xml(channel_xml(**first), channel_xml(**second))))


def test_reported_station_xml(shared_reports: Path, shared_records: Path) -> None:
    """One entry differs from the real StationXML, in a way that means the same."""
    name = "CI.CLC..HNE.mseed"
    [known] = read_file(shared_records / "formats" / "miniseed" / name)
    for folder in ("14_input_g", "14_location_dashes", "14_output_ms2"):
        [record] = read_file(shared_reports / folder / name)
        assert record.acceleration == pytest.approx(known.acceleration, rel=4e-4)
    with pytest.raises(InputError, match=r"for other times: from 2012-04-13.* to 2019-07-06T03:21"):
        read_file(shared_reports / "14_epoch_ends_early" / name)
