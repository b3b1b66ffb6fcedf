"""ASDF of gmprocess: real workspaces, small files with the same layout, and corrupted copies."""

from __future__ import annotations

import json
import math
import random
from collections.abc import Mapping
from pathlib import Path

import netCDF4
import numpy as np
import pytest

from rockframe.errors import InputError
from rockframe.ingest import FORMATS, ReadOptions, collect, read_bytes, read_file
from rockframe.ingest.files import read_outcomes
from rockframe.ingest.registry import sniff_format
from rockframe.options.ingest import IngestOptions
from rockframe.record import Orientation, Record
from rockframe.stages.ingest import ingest_stage

# obspy 1.5 looks up its entry points in a way that Python 3.11 deprecates.
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")

SAMPLES = (10.0, -30.0, 20.0, 0.0)
FILTER = """<prov:activity prov:id="a"><prov:label>Highpass Filter</prov:label>
<seis_prov:corner_frequency xsi:type="xsd:double">0.05</seis_prov:corner_frequency>
</prov:activity><prov:activity prov:id="b"><prov:label>Remove Response</prov:label>
<seis_prov:output_units>cm/s^2</seis_prov:output_units></prov:activity>"""
QUAKEML = b"""<q:quakeml xmlns="http://quakeml.org/xmlns/bed/1.2"
 xmlns:q="http://quakeml.org/xmlns/quakeml/1.2"><eventParameters publicID="smi:local/p">
<event publicID="smi:local/ev1"><origin publicID="smi:local/o"><time>
<value>2020-01-01T00:00:00Z</value></time><latitude><value>0.0</value></latitude>
<longitude><value>1.0</value></longitude><depth><value>10000.0</value></depth></origin>
<magnitude publicID="smi:local/m"><mag><value>6.1</value></mag></magnitude></event>
</eventParameters></q:quakeml>"""
STATION = b"""<FDSNStationXML xmlns="http://www.fdsn.org/xml/station/1" schemaVersion="1.1">
<Source>s</Source><Created>2020-01-01T00:00:00Z</Created><Network code="XX"><Station code="AAA">
<Latitude>0.0</Latitude><Longitude>2.0</Longitude><Elevation>0</Elevation><Site><Name>a</Name>
</Site>%s</Station></Network></FDSNStationXML>"""
CHANNEL = """<Channel code="HN%s" locationCode=""><Latitude>0.0</Latitude><Longitude>2.0</Longitude>
<Elevation>0</Elevation><Depth>0</Depth><Azimuth>%s</Azimuth><SampleRate>100.0</SampleRate>
<Response><InstrumentSensitivity><Value>1000.0</Value><Frequency>1.0</Frequency><InputUnits>
<Name>M/S**2</Name></InputUnits><OutputUnits><Name>COUNTS</Name></OutputUnits>
</InstrumentSensitivity></Response></Channel>"""


def asdf(
    traces: Mapping[str, tuple[float, ...]] | None = None,
    documents: Mapping[str, bytes | str] | None = None,
    *,
    label: str = "default",
    azimuths: tuple[float, float] = (90.0, 0.0),
    rate: float = 100.0,
    last: str = "2020-01-01T00:00:10",
    dtype: str = "f8",
    mark: str = "ASDF",
) -> bytes:
    """Return an ASDF file of one station, with a document at each path."""
    file = netCDF4.Dataset("asdf", "w", memory=4096)
    file.setncattr("file_format", mark)
    channels = "".join(CHANNEL % one for one in zip("ENZ", (*azimuths, 0.0), strict=True))
    told = {
        "QuakeML": QUAKEML,
        "Waveforms/XX.AAA/StationXML": STATION.replace(b"%s", channels.encode()),
        **(documents or {}),
    }
    for path, document in told.items():
        values = document.encode() if isinstance(document, str) else document
        folder, _, name = path.rpartition("/")
        group = file.createGroup(folder) if folder else file
        group.createDimension(f"d{len(group.dimensions)}", len(values))
        variable = group.createVariable(name, "i1", (f"d{len(group.dimensions) - 1}",))
        variable[:] = np.frombuffer(values, np.int8)
    stored = {"HNE": SAMPLES, "HNN": SAMPLES[::-1], "HNZ": SAMPLES} if traces is None else traces
    group = file.createGroup("Waveforms/XX.AAA")
    for channel, samples in stored.items():
        group.createDimension(channel, len(samples))
        name = f"XX.AAA..{channel[:3]}__2020-01-01T00:00:10__{last}__ev1_{label}"
        waves = group.createVariable(name + channel[3:], dtype, (channel,))
        waves[:] = np.array(samples, dtype)
        waves.setncatts({"sampling_rate": rate, "event_id": "smi:local/ev1"})
        waves.setncattr("starttime", np.int64(1577836810 * 10**9))
    return bytes(file.close())


def of_trace(kind: str, channel: str, label: str = "default") -> str:
    """Return the path of a document on a trace or a stream."""
    return f"AuxiliaryData/{kind}/XX.AAA/XX.AAA..{channel}_ev1_{label}"


def provenance(*channels: str) -> dict[str, str]:
    return {f"Provenance/XX.AAA..{channel}_ev1_default": FILTER for channel in channels}


GOOD = provenance("HNE", "HNN", "HNZ")


def read(data: bytes, **options: str) -> list[Record]:
    return read_bytes("work.h5", data, ReadOptions(**options))  # type: ignore[arg-type]


@pytest.fixture
def workspaces() -> Path:
    """Return the folder of real workspaces, which are not bundled; skip if it is absent."""
    folder = Path(__file__).resolve().parents[3] / "shared" / "asdf"
    if not folder.is_dir():
        pytest.skip("no folder 'shared/asdf' beside the repository")
    return folder


def test_a_real_workspace_has_what_gmprocess_printed(workspaces: Path) -> None:
    """The peaks, distances and filters are those in the documents of the workspace."""
    east, north, up = read_file(workspaces / "nc72282711_workspace.h5")
    assert [one.pga / 0.0980665 for one in (east, north, up)] == pytest.approx(
        [37.278592, 33.891816, 21.516983], rel=1e-7
    )
    assert (east.distance_rrup, east.distance_rjb, east.magnitude) == (4.5, 4.03, 6.02)
    assert (east.azimuth, north.azimuth, up.orientation) == (90.0, 0.0, Orientation.VERTICAL)
    assert (east.filter_low, east.filter_high) == (0.041109969167523124, 40.0)
    assert not east.uncorrected
    assert [one.peak_ratio for one in (east, north, up)] == pytest.approx([1.0] * 3, rel=1e-7)


def test_raw_streams_of_a_real_workspace_are_the_same_motion(workspaces: Path) -> None:
    """Counts divided by the sensitivity agree with gmprocess's own conversion."""
    path = workspaces / "nc72282711_workspace.h5"
    raw, done = (read_file(path, ReadOptions(streams=name))[0] for name in ("raw", "processed"))
    assert raw.uncorrected
    assert raw.instrument_file == f"{path.name}:CE.68150.StationXML"
    start = round(22.32 / 0.005)  # from 10:20:21.00 to 10:20:43.32
    window = raw.acceleration[start : start + done.acceleration.size]
    assert np.corrcoef(window - window.mean(), done.acceleration)[0, 1] > 0.99


def test_a_stream_that_gmprocess_left_out_is_unread_with_its_reason(workspaces: Path) -> None:
    [outcome] = read_outcomes(workspaces / "usp0009d4z_workspace.h5", ReadOptions())
    assert not isinstance(outcome, list)
    assert outcome.file == "usp0009d4z_workspace.h5:GE.ISP..BH"
    assert outcome.status == "unread"
    assert outcome.reason == "left out by gmprocess (BHE): Failed clipping check: prob_clip = 0.99."


def test_an_ingest_of_that_stream_alone_counts_no_others(workspaces: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"prob_clip = 0\.99\.$"):
        ingest_stage([workspaces / "usp0009d4z_workspace.h5"], tmp_path / "r.nc", workers=0)


def test_no_other_format_claims_it() -> None:
    data = asdf()
    assert [known.name for known in FORMATS if known.sniff(data[:4096])] == ["asdf"]


def test_units_come_from_the_provenance_and_time_from_the_rate() -> None:
    east, north, up = read(asdf(documents=GOOD))
    assert east.acceleration == pytest.approx([0.1, -0.3, 0.2, 0.0])
    assert (east.time_step, east.start_time) == (0.01, "2020-01-01T00:00:10.000000Z")
    assert (east.record_id, east.event, east.magnitude) == ("ev1-XX.AAA..HNE", "ev1", 6.1)
    assert (east.azimuth, north.azimuth, up.orientation) == (90.0, 0.0, Orientation.VERTICAL)
    assert (east.filter_low, east.uncorrected) == (0.05, False)
    assert math.isnan(east.filter_high)
    # One degree of longitude on the equator, at a depth of 10 km.
    assert (east.epicentral_distance, east.distance_hypocentral) == (111.2, 111.6)
    assert east.processing[0] == "archive: highpass filter (corner_frequency 0.05)"


def test_station_metrics_replace_distances_from_coordinates() -> None:
    metrics = '<rupture units="km">4.5</rupture><joyner_boore units="km">nan</joyner_boore>'
    documents = {**GOOD, "AuxiliaryData/StationMetrics/XX.AAA/XX.AAA..HN_ev1": metrics}
    record = read(asdf(documents=documents))[0]
    assert (record.distance_rrup, record.epicentral_distance) == (4.5, 111.2)
    assert math.isnan(record.distance_rjb)
    assert record.facts_source == "QuakeML and StationMetrics of the ASDF file"


def test_stated_peaks_are_compared() -> None:
    """30 cm/s2 is 3.0591 % of 9.80665 m/s2; a peak stated twice as large gives the ratio 0.5."""
    peaks = '<pga units="%g"><H1 a="b">3.059149</H1><H2>6.118298</H2><Z>3.059149</Z></pga>'
    documents = {**GOOD, of_trace("WaveFormMetrics", "HN"): peaks}
    ratios = sorted(one.peak_ratio for one in read(asdf(documents=documents)))
    assert ratios == pytest.approx([0.5, 1.0, 1.0], rel=1e-6)


def test_counts_are_divided_by_the_sensitivity() -> None:
    """1000 counts per m/s2; integers are counts unless the file states otherwise."""
    data = asdf(label="unprocessed", dtype="i4")
    with pytest.raises(InputError, match=r"no streams for --streams processed.*: unprocessed"):
        read(data)
    east = read(data, streams="raw")[0]
    assert east.acceleration == pytest.approx([0.01, -0.03, 0.02, 0.0])
    assert east.uncorrected
    assert east.instrument_file == "work.h5:XX.AAA.StationXML"


def test_physical_units_without_a_high_pass_are_uncorrected() -> None:
    level = {"standard": {"process_level": "uncorrected physical units"}}
    documents = {of_trace("StreamSupplementalStats", "HN"): json.dumps(level)}
    record = read(asdf(documents=documents))[0]
    assert record.uncorrected
    assert record.acceleration == pytest.approx([0.1, -0.3, 0.2, 0.0])


def test_unstated_units_are_the_users() -> None:
    with pytest.raises(InputError, match=r"XX\.AAA\.\.HN: acceleration units unstated"):
        read(asdf())
    assert read(asdf(), units="g")[0].pga == pytest.approx(30.0 * 9.81)
    with pytest.raises(InputError, match="units 'g' given, but the file states 'cm/s2'"):
        read(asdf(documents=GOOD), units="g")


def failed(*channels: str, any_trace: bool = True) -> bytes:
    failure = json.dumps({"failure": {"module": "snr", "reason": "too noisy"}})
    stream = json.dumps({"any_trace_failures": any_trace})
    documents = {of_trace("TraceProcessingParameters", name): failure for name in channels}
    return asdf(
        documents={**GOOD, **documents, of_trace("StreamProcessingParameters", "HN"): stream}
    )


def test_streams_that_failed_are_left_out_as_gmprocess_would() -> None:
    with pytest.raises(InputError, match=r"left out by gmprocess \(HNN\): too noisy\."):
        read(failed("HNN"))
    assert [one.component for one in read(failed("HNN", any_trace=False))] == ["HNE", "HNZ"]
    with pytest.raises(InputError, match="too noisy"):
        read(failed("HNE", "HNN", "HNZ", any_trace=False))


def test_a_manual_review_has_the_last_word() -> None:
    path = of_trace("review", "HNN") + "/accepted"
    with pytest.raises(InputError, match="rejected in a manual review"):
        read(asdf(documents={**GOOD, path: b"\0"}))
    failure = {of_trace("TraceProcessingParameters", "HNN"): '{"failure": {"reason": "noise"}}'}
    assert len(read(asdf(documents={**GOOD, **failure, path: b"\1"}))) == 3


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (asdf({}), "ASDF without waveforms"),
        (asdf(mark="other"), "is HDF5, but not ASDF"),
        (asdf(documents=GOOD, rate=1.0), "4 samples at 1 Hz .*T00:00:10 in its name"),
        (asdf(documents=GOOD, last="2020-01-01T00:00:12"), "but 2020-01-01T00:00:12 in its name"),
        (asdf(documents=GOOD, rate=-1.0), "at -1.0 Hz.* Must be 2 numbers or more"),
        (asdf({"HNE": (1.0,)}, GOOD), "contains 1 of float64"),
        (asdf({"HNE": (1.0, math.nan)}, GOOD), "contains NaN"),
        (asdf({"HNE": SAMPLES, "HNE2": SAMPLES}, GOOD), "2 labels for --streams processed"),
        (asdf(documents={**GOOD, "QuakeML": b"<quakeml>"}), "cannot be read as QuakeML"),
        (asdf(documents=GOOD, azimuths=(80.0, 0.0)), "channel 'HNE', but azimuth 80"),
        (asdf(documents={of_trace("StreamSupplementalStats", "HN"): "{"}), "is not JSON"),
    ],
)
def test_contradictions_are_one_line(data: bytes, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        read(data)
    assert "\n" not in str(caught.value)


def test_an_output_of_rockframe_is_named_for_what_it_is(
    bundled_records: Path, tmp_path: Path
) -> None:
    ingest_stage([bundled_records / "Ridgecrest2019-CLC.V1"], tmp_path / "a.nc", workers=0)
    with pytest.raises(InputError, match="is netCDF, as outputs of rockframe are"):
        read_file(tmp_path / "a.nc")


def test_velocities_are_unread() -> None:
    documents = {**GOOD, "Provenance/XX.AAA..HNE_ev1_default": FILTER.replace("s^2", "s")}
    with pytest.raises(InputError, match="samples in cm/s, not accelerations"):
        read(asdf(documents=documents))


def test_each_stream_has_an_outcome_of_its_own(tmp_path: Path) -> None:
    """A stream without records does not cost the others of its file."""
    broken = {"HNE": SAMPLES, "HNN": SAMPLES, "HNZ": SAMPLES, "HGE": (1.0, math.inf)}
    (tmp_path / "work.h5").write_bytes(asdf(broken, {**GOOD, **provenance("HGE")}))
    *records, outcome = collect([tmp_path])
    assert len(records) == 3
    assert not isinstance(outcome, Record)
    assert (outcome.file, outcome.status) == ("work.h5:XX.AAA..HG", "rejected")


def test_the_option_reaches_the_reader(tmp_path: Path) -> None:
    wave = tuple(1000.0 * math.sin(0.1 * k) * math.exp(-0.002 * k) for k in range(2001))
    traces = {"HNE": wave, "HNN": wave[::-1]}
    data = asdf(traces, label="unprocessed", dtype="i4", last="2020-01-01T00:00:30")
    (tmp_path / "work.h5").write_bytes(data)
    done = ingest_stage([tmp_path], tmp_path / "a.nc", IngestOptions(streams="raw"), workers=0)
    assert [one.source_format for one in done.accepted] == ["asdf", "asdf"]


@pytest.mark.parametrize("seed", range(60))
def test_damage_is_one_line_or_none(seed: int) -> None:
    """Damage where nothing is stored, or in a value, leaves a file that is read."""
    rng, good = random.Random(seed), asdf(documents=GOOD)  # noqa: S311 - no cryptography
    data = bytearray(good)
    for _ in range(rng.choice((1, 3, 10))):
        data[rng.randrange(8, len(data))] = rng.randrange(256)
    if seed % 3 == 0:
        data = data[: rng.randrange(8, len(data))]
    said = ""
    try:
        read(bytes(data))
    except InputError as error:
        said = str(error)
    assert "\n" not in said


def test_a_heap_that_the_library_never_finishes_is_rejected() -> None:
    """Strings are in heaps; a gap of size zero there makes HDF5 read the same place for ever."""
    good = bytearray(asdf(documents=GOOD))
    place = good.index(b"GCOL") + 16
    while good[place : place + 2] != b"\0\0":  # objects, up to the gap at the end
        size = int.from_bytes(good[place + 8 : place + 16], "little")
        place += 16 + -(-size // 8) * 8
    assert int.from_bytes(good[place + 8 : place + 16], "little") > 16
    good[place + 8 : place + 16] = bytes(8)
    with pytest.raises(InputError, match=f"corrupted HDF5: empty gap in the heap at byte {place}"):
        read(bytes(good))


def test_the_head_settles_the_format() -> None:
    assert sniff_format(asdf()).name == "asdf"
