"""Files of recorders are read by one reader of obspy each, in m/s2, and national CSV by its own.

Their values are those of the same record in another format, or of obspy with the same calibration.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tests.ingest.imitations import jma_csv, knet_csv

from rockframe.errors import InputError
from rockframe.ingest import FORMATS, ReadOptions, read_bytes, read_file, sniff_format
from rockframe.ingest.formats.rare.miniseed3 import converted
from rockframe.ingest.stationxml import is_station_xml
from rockframe.record import Orientation
from rockframe.units import utc_seconds

# obspy 1.5 looks up its entry points in a way that Python 3.11 deprecates.
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::UserWarning")

COUNTS = ReadOptions(sensitivity=1000.0)


@pytest.fixture(scope="module")
def installed() -> Path:
    """Return the folder of obspy's readers; skip if their test data are not installed."""
    import obspy

    folder = Path(obspy.__file__).parent / "io"
    if not (folder / "gcf" / "tests" / "data").is_dir():
        pytest.skip("obspy is installed without its test data")
    return folder


#: A file of each format among obspy's own, and obspy's name of the format.
FILES = {
    "gcf/tests/data/20160603_1955n.gcf": ("gcf", "GCF"),
    "reftek/tests/data/225051000_00008656": ("reftek", "REFTEK130"),
    "gse2/tests/data/loc_RJOB20050831023349.z": ("gse2", "GSE2"),
    "gse2/tests/data/loc_STAU20031119011659.z": ("gse1", "GSE1"),
    "ascii/tests/data/slist.ascii": ("slist", "SLIST"),
    "ascii/tests/data/tspair.ascii": ("tspair", "TSPAIR"),
    "seisan/tests/data/2001-01-13-1742-24S.KONO__004": ("seisan", "SEISAN"),
    "win/tests/data/10030302.00": ("win", "WIN"),
    "seg2/tests/data/20180307_031245000.0.seg2": ("seg2", "SEG2"),
}


@pytest.mark.parametrize("name", FILES)
def test_counts_over_the_stated_sensitivity(installed: Path, name: str) -> None:
    """A stated sensitivity has no error of its own: the samples are obspy's over it."""
    from obspy import read

    path = installed / name
    kind, obspy_name = FILES[name]
    assert sniff_format(path.read_bytes()[:4096]).name == kind
    traces = read(str(path), format=obspy_name)
    try:
        records = read_file(path, COUNTS)
    except InputError as error:  # seismometers record velocity
        assert re.search("is a velocity|gap in|overlap in", error.reason)  # noqa: PT017
        return
    assert [r.acceleration.size for r in records] == [t.stats.npts for t in traces]
    for record, trace in zip(records, traces, strict=True):
        np.testing.assert_allclose(record.acceleration, trace.data / 1000.0, rtol=1e-12)
        assert record.time_step == pytest.approx(trace.stats.delta, rel=1e-12)


@pytest.mark.parametrize("name", [*FILES])
def test_no_other_format_claims_them(installed: Path, name: str) -> None:
    head = (installed / name).read_bytes()[:4096]
    marked = [known.name for known in FORMATS if known.sniff(head)]
    assert FILES[name][0] in marked
    assert {*marked} <= {FILES[name][0], "gcf", "win"}


@pytest.mark.parametrize("name", [*FILES])
@pytest.mark.parametrize("share", [0.02, 0.5, 0.97])
def test_a_cut_file_is_refused_or_shorter(installed: Path, name: str, share: float) -> None:
    """It never holds other samples than the whole file."""
    data = (installed / name).read_bytes()
    try:
        whole = read_bytes("a", data, COUNTS)
        cut = read_bytes("a", data[: int(share * len(data))], COUNTS)
    except InputError:
        return
    for record in cut:
        same = [one for one in whole if one.component == record.component]
        assert any(
            np.array_equal(record.acceleration, one.acceleration[: record.acceleration.size])
            for one in same
        )


def test_a_gse2_waveform_that_the_format_does_not_allow_is_refused() -> None:
    """Its lines have at most 80 characters, and a sample needs one character at least."""
    head = (
        b"WID2 2005/08/31 02:33:49.850 RJOB  HNZ      CM6     1200  200.000000   9.49e-02   1.000\n"
    )
    data = head[:80] + b"\nDAT2\n" + b"k" * 82 + b"\nCHK2 720\n"
    with pytest.raises(InputError, match=r":3: 82 characters\. Must be at most 81"):
        read_bytes("a.gse2", data, COUNTS)
    short = head[:80].replace(b" 1200", b"  200") + b"\nDAT2\n" + b"k" * 70 + b"\nCHK2 720\n"
    with pytest.raises(InputError, match=r"200 samples stated in a waveform of 1\d\d bytes"):
        read_bytes("a.gse2", short, COUNTS)


def test_a_format_without_a_meaning_of_counts_asks_for_it() -> None:
    text = "TIMESERIES XX_TEST__HNE_R, 4 samples, 100 sps, 2008-01-15T00:00:00.000000, SLIST, "
    data = f"{text}INTEGER, Counts\n1\t-2\n3\t-4\n".encode()
    with pytest.raises(InputError, match=r"--station-xml, or state .*--sensitivity-counts-s2-m"):
        read_bytes("a.ascii", data)
    [record] = read_bytes("a.ascii", data, COUNTS)
    assert record.acceleration.tolist() == [0.001, -0.002, 0.003, -0.004]
    assert (record.azimuth, record.time_step) == (90.0, 0.01)
    in_units = data.replace(b"Counts", b"M/S**2")
    assert read_bytes("a.ascii", in_units)[0].acceleration.tolist() == [1.0, -2.0, 3.0, -4.0]
    unstated = data.replace(b" Counts", b" ")
    [record] = read_bytes("a.ascii", unstated, ReadOptions("gal"))
    assert record.acceleration.tolist() == pytest.approx([0.01, -0.02, 0.03, -0.04])


def slist(
    samples: list[str], *, count: int = 40, rate: str = "100", units: str = "M/S**2"
) -> bytes:
    head = f"TIMESERIES XX_ABC__HNE_D, {count} samples, {rate} sps, 2020-01-01T00:00:00.000000"
    return f"{head}, SLIST, FLOAT, {units}\n{chr(10).join(samples)}\n".encode()


def tspair(samples: list[str], *, step: float = 0.01, late: float = 0.0, **header: str) -> bytes:
    """Return a TSPAIR text whose times jump by `late` seconds in the middle."""
    seconds = [step * k + late * (k > 20) for k in range(len(samples))]
    rows = [f"2020-01-01T00:00:{t:09.6f}  {x}" for t, x in zip(seconds, samples, strict=True)]
    return slist(rows, **header).replace(b"SLIST", b"TSPAIR")  # type: ignore[arg-type]


SAMPLES = [f"{np.sin(0.3 * k):.3e}" for k in range(40)]


@pytest.mark.parametrize(
    ("data", "trust", "message"),
    [
        (slist(SAMPLES[:39]), "samples", "a:1: 40 samples in the header, 39 in the file"),
        (slist([*SAMPLES, "0.1"]), "samples", "a:1: 40 samples in the header, 41 in the file"),
        (slist(SAMPLES) + slist(SAMPLES[:30]), "", "a:42: 40 samples .*, 30 in the file"),
        (slist(SAMPLES)[:-5], "samples", "a:41: the file ends within"),
        (tspair(SAMPLES)[:-5], "samples", "a:41: the file ends within"),
        (tspair(SAMPLES, rate="50"), "waveform", "a:1: 50 sps .*, time step 0.01 s of the times"),
        (tspair(SAMPLES, late=0.05), "", "a:23: time 0.26 s after 0.2 s. Must be 0.21 s"),
        (tspair(SAMPLES).replace(b"T00:00:00.200", b"T00:xx:00.200"), "", "a:22: time '2020-01"),
    ],
)
def test_a_header_of_text_is_compared_with_its_rows(data: bytes, trust: str, message: str) -> None:
    """As in text tables: the trusted statement settles it."""
    with pytest.raises(InputError, match=message):
        read_bytes("a", data)
    if trust:
        [record] = read_bytes("a", data, ReadOptions(trust=(trust,)))
        assert record.time_step == 0.01
        assert record.acceleration[:39].tolist() == [float(x) for x in SAMPLES[:39]]


@pytest.mark.parametrize("rate", ["100", "62.5", "128", "0.8", "99.9937"])
def test_times_of_a_text_at_every_rate(rate: str) -> None:
    """Times are printed with six decimals, so that they are rounded."""
    [record] = read_bytes("a", tspair(SAMPLES, step=1.0 / float(rate), rate=rate))
    assert record.time_step == pytest.approx(1.0 / float(rate), rel=1e-12)
    assert record.acceleration.tolist() == [float(x) for x in SAMPLES]


@pytest.mark.parametrize(
    ("units", "options", "message"),
    [
        ("M/S", ReadOptions("g"), "units 'M/S' in the header. Must be counts, or one of: .*m/s2"),
        ("M/S", ReadOptions(factor=1.0), "units 'M/S' in the header. Must be counts"),
        ("m", ReadOptions("m/s2"), "units 'm' in the header. Must be counts"),
        ("V", COUNTS, "units 'V' in the header.* Otherwise state its acc"),
        ("NM/S**2", ReadOptions("g"), "units 'NM/S[*]{2}2' in the header.*--factor-m-s2"),
        ("COUNTS", ReadOptions("g"), "'g' given, but the header states 'COUNTS'.*--factor-m-s2"),
        ("", ReadOptions("g", sensitivity=10.0), "10 counts s2/m is given beside units and fac"),
        ("M/S**2", ReadOptions(sensitivity=10.0), "is given beside units of the header"),
    ],
)
def test_units_of_a_text_that_are_no_acceleration(
    units: str, options: ReadOptions, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        read_bytes("a", slist(SAMPLES, units=units), options)


@pytest.mark.parametrize("units", ["", "Counts", "V", "NM/S**2"])
def test_a_factor_is_the_acceleration_of_the_number_one(units: str) -> None:
    [record] = read_bytes("a", slist(SAMPLES, units=units), ReadOptions(factor=0.5))
    assert record.acceleration.tolist() == [0.5 * float(x) for x in SAMPLES]


def test_the_calibration_of_an_evt_file(shared_reports: Path) -> None:
    """Its header states volts a count and volts a g, but no azimuths."""
    records = read_file(shared_reports / "12_K2.evt")
    assert [record.acceleration.size for record in records] == [9750] * 6
    assert {record.time_step for record in records} == {0.004}
    first = records[0].acceleration
    assert np.abs(first).max() / 9.81 == pytest.approx(0.0107, abs=5e-5)
    assert np.abs(first - first.mean()).max() == pytest.approx(0.0877, abs=5e-5)
    assert all(np.isnan(record.azimuth) for record in records)
    [written] = read_file(shared_reports / "12_MOLA_1.AT2")
    assert np.isnan(written.azimuth)


def miniseed3(
    samples: bytes,
    encoding: int,
    count: int,
    *,
    rate: float = 100.0,
    code: str = "FDSN:XX_A__H_N_E",
    start: tuple[int, int, int, int, int] = (2019, 187, 3, 19, 53),
) -> bytes:
    """Return a data record of miniSEED 3 with its checksum."""
    head = struct.pack(
        "<2sBBIHHBBBBdIIBBHI",
        *(b"MS", 3, 0, 250_000_000, *start, encoding, rate, count, 0, 1),
        *(len(code), 0, len(samples)),
    )
    data = bytearray(head + code.encode() + samples)
    value = 0xFFFFFFFF
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = value >> 1 ^ (0x82F63B78 if value & 1 else 0)
    data[28:32] = struct.pack("<I", value ^ 0xFFFFFFFF)
    return bytes(data)


@pytest.mark.parametrize(("encoding", "kind"), [(1, "<i2"), (3, "<i4"), (4, "<f4"), (5, "<f8")])
def test_samples_of_miniseed_3(encoding: int, kind: str) -> None:
    samples = np.arange(-40, 41).astype(kind)
    data = miniseed3(samples.tobytes(), encoding, samples.size)
    [record] = read_bytes("a.ms3", data, COUNTS)
    np.testing.assert_array_equal(record.acceleration, samples.astype(float) / 1000.0)
    assert (record.time_step, record.azimuth) == (0.01, 90.0)
    assert record.start_time.startswith("2019-07-06T03:19:53.25")
    damaged = bytearray(data)
    damaged[-3] ^= 1
    with pytest.raises(InputError, match="at byte 0 is corrupted: its checksum differs"):
        read_bytes("a.ms3", bytes(damaged), COUNTS)
    with pytest.raises(InputError, match="is cut off"):
        read_bytes("a.ms3", data[:-1], COUNTS)


@pytest.mark.parametrize("rate", [-0.5, 0.0, 62.5, 200.0, 128.0])
def test_rates_of_miniseed_3(rate: float) -> None:
    samples = np.arange(9, dtype="<i4")
    data = miniseed3(samples.tobytes(), 3, 9, rate=rate)
    if rate == 0.0:
        with pytest.raises(InputError, match=r"9 samples at 0 Hz"):
            read_bytes("a.ms3", data, COUNTS)
        return
    [record] = read_bytes("a.ms3", data, COUNTS)
    assert record.time_step == pytest.approx(1.0 / rate if rate > 0.0 else -rate, rel=1e-12)


def test_a_long_identifier_of_miniseed_3_is_refused() -> None:
    data = miniseed3(bytes(8), 3, 2, code="FDSN:LONGNET_STATION__H_N_E")
    with pytest.raises(InputError, match="Must be codes of at most 2, 5, 2 and 3 characters"):
        converted(Path("a.ms3"), data)


def test_miniseed_3_as_another_program_wrote_it(shared_reports: Path) -> None:
    [record] = read_file(shared_reports / "17_miniseed3.ms3", ReadOptions(sensitivity=1.0))
    assert (record.acceleration.size, record.time_step) == (2000, 0.01)
    pymseed = pytest.importorskip("pymseed")
    traces = pymseed.MS3TraceList.from_file(
        str(shared_reports / "17_miniseed3.ms3"), unpack_data=True
    )
    [samples] = [segment.np_datasamples for trace in traces for segment in trace]
    np.testing.assert_array_equal(record.acceleration, samples)


def test_codes_that_are_no_ascii(shared_reports: Path) -> None:
    [record] = read_file(shared_reports / "11_gecko.ms", ReadOptions(sensitivity=1.0))
    assert (record.acceleration.size, record.time_step) == (206, 0.004)
    assert (record.station, record.component) == ("GECKO", "CNZ")
    assert record.orientation is Orientation.VERTICAL


@pytest.mark.parametrize("name", ["NS", "EW", "UD"])
def test_a_csv_of_knet_is_the_record_of_its_ascii(
    shared_reports: Path, shared_records: Path, name: str
) -> None:
    records = read_file(shared_reports / "08_knet_AOM017.csv")
    [record] = [one for one in records if one.component == name]
    [ascii_record] = read_file(shared_records / f"formats/knet/AOM0170806140843.{name}")
    moving = ascii_record.acceleration - ascii_record.acceleration.mean()
    # the CSV has two decimals of gal
    np.testing.assert_allclose(record.acceleration, moving, atol=1.1e-4)
    assert utc_seconds(record.start_time) == utc_seconds(ascii_record.start_time)
    for field in ("station", "azimuth", "magnitude", "epicentral_distance"):
        np.testing.assert_equal(getattr(record, field), getattr(ascii_record, field))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda text: text.replace(b"#115\n", b"#114\n"),
            "11400 samples, but 11500 in.*--trust",
        ),
        (lambda text: text.replace(b"#100\n", b"#200\n"), "at 200 samples a second"),
        (lambda text: text.replace(b"N-S(gal),E-W", b"N-S(cm),E-W"), "columns '#Time"),
        (lambda text: text.replace(b",-5.13,", b",x,", 1), "acceleration 'x'"),
        (lambda text: text.replace(b",-5.13,", b",", 1), "4 columns. Must be 5"),
        (lambda text: text[:-2], r"the file ends within '-11\.2'.*--trust samples"),
        (lambda text: text[:-4], r"the file ends within '-11'|the file ends within"),
        (
            lambda text: text.replace(b"#Offset", b"#MaxAcceleration\n#N-S(gal)\n#99\n#Offset"),
            "peak 99 gal stated.*--trust values",
        ),
    ],
)
def test_a_damaged_csv_of_knet_is_refused(change: Callable[[bytes], bytes], message: str) -> None:
    data = knet_csv()
    assert change(data) != data
    with pytest.raises(InputError, match=message):
        read_bytes("AOM017.csv", change(data))


def test_the_peaks_of_a_csv_of_knet_are_without_the_offset() -> None:
    data = knet_csv()
    records = read_bytes("AOM017.csv", data)
    peaks = [100.0 * float(np.abs(record.acceleration).max()) for record in records]
    assert all(np.isnan(record.peak_ratio) for record in records)
    names = b"#MaxAcceleration\n#N-S(gal),E-W(gal),U-D(gal)\n#%.2f,%.2f,%.2f\n"
    stated = data.replace(b"#Time,", names % (*peaks,) + b"#Time,")
    again = read_bytes("AOM017.csv", stated)
    assert [record.peak_ratio for record in again] == pytest.approx([1.0] * 3, rel=1e-9)
    for record, other in zip(records, again, strict=True):
        np.testing.assert_array_equal(record.acceleration, other.acceleration)
    with pytest.raises(InputError, match=r"peak .* gal stated, but"):
        read_bytes("a.csv", data.replace(b"#Time,", names % (*peaks[:2], peaks[2] + 1) + b"#Time,"))


@pytest.mark.parametrize("left", [-3, -4])
def test_a_cut_csv_of_jma_is_refused(left: int) -> None:
    data = jma_csv()
    with pytest.raises(InputError, match="the file ends within '42"):
        read_bytes("a.csv", data[: left + 1])
    whole = read_bytes("a.csv", data)
    for record, other in zip(whole, read_bytes("a.csv", data.rstrip()), strict=True):
        np.testing.assert_array_equal(record.acceleration, other.acceleration)


def test_a_csv_of_jma() -> None:
    records = read_bytes("08_jma.csv", jma_csv())
    peaks = [float(np.abs(record.acceleration).max()) / 9.81 for record in records]
    assert peaks == pytest.approx([0.4704, 0.5636, 0.3612], abs=5e-5)
    assert {record.station for record in records} == {"47662 東京"}
    assert records[0].start_time == "2011-03-11T05:46:40Z"
    data = jma_csv()
    with pytest.raises(InputError, match=r"'UNIT'.*|UNIT 'm/s2'"):
        read_bytes("a.csv", data.replace(b"gal(cm/s/s)", b"m/s2"))


def test_a_mexican_standard_file_of_another_network(shared_reports: Path) -> None:
    """Its keys have other commas and blanks than those of UNAM."""
    records = read_file(shared_reports / "10_RAC_cicese.dat")
    peaks = [100.0 * record.acceleration[k] for record, k in zip(records, (5632, 5893, 5618))]  # noqa: B905
    assert peaks == pytest.approx([-72.8008, -64.4431, -59.2262], abs=5e-5)
    assert [record.component for record in records] == ["N90E", "N00E", "V"]
    assert [record.azimuth for record in records[:2]] == [90.0, 0.0]
    assert records[2].orientation is Orientation.VERTICAL
    assert records[0].start_time == "2010-04-04T22:45:22.147Z"
    # 32.020 N 116.301 W to 32.320 N 115.330 W: 33.4 km and 91.4 km
    assert records[0].epicentral_distance == pytest.approx(np.hypot(33.4, 91.4), abs=0.3)


def test_we_of_itaca_is_the_east(shared_reports: Path) -> None:
    folder = shared_reports / "16_itaca_WE"
    azimuths = {
        read_file(path)[0].component: read_file(path)[0].azimuth
        for path in sorted(folder.iterdir())
    }
    assert azimuths == {"NS": 0.0, "WE": 90.0}


def test_scale_of_a_sac_file_that_is_trusted(shared_reports: Path, installed: Path) -> None:
    """The same record in K-NET ASCII."""
    path = shared_reports / "13_scale.sac"
    with pytest.raises(InputError, match=r"--units also\. Settled by --trust scale"):
        read_file(path, ReadOptions("m/s2"))
    [record] = read_file(path, ReadOptions("m/s2", trust=("scale",)))
    [knet] = read_file(installed / "nied/tests/data/test.knet")
    np.testing.assert_allclose(record.acceleration, knet.acceleration, rtol=1e-5)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_stated_sensitivity_is_that_of_a_station_xml(shared_reports: Path, sign: float) -> None:
    folder = shared_reports / "14_output_ms2"
    [named] = read_file(folder / "CI.CLC..HNE.mseed")
    [stated] = read_file(folder / "CI.CLC..HNE.mseed", ReadOptions(sensitivity=213808.0 * sign))
    np.testing.assert_allclose(sign * stated.acceleration, named.acceleration, rtol=1e-2)


def test_a_negative_sensitivity_turns_the_sign_if_it_is_trusted(
    shared_reports: Path, tmp_path: Path
) -> None:
    source = shared_reports / "14_output_ms2"
    text = (source / "CI.CLC.xml").read_text()
    (tmp_path / "CI.CLC.xml").write_text(
        text.replace("<Value>213808.0<", "<Value>-213808.0<").replace(
            "<Value>213945.0<", "<Value>-213945.0<"
        )
    )
    waveform = tmp_path / "CI.CLC..HNE.mseed"
    waveform.write_bytes((source / "CI.CLC..HNE.mseed").read_bytes())
    [named] = read_file(source / "CI.CLC..HNE.mseed")
    try:
        [record] = read_file(waveform, ReadOptions(trust=("sensitivity",)))
    except InputError as error:
        pytest.fail(error.reason)
    with pytest.raises(InputError, match=r"is negative.*Settled by --trust sensitivity"):
        read_file(waveform)
    np.testing.assert_allclose(record.acceleration, -named.acceleration, rtol=1e-12)


def test_a_resp_file_beside_a_waveform(installed: Path, tmp_path: Path) -> None:
    """It states the sensitivity of a channel, but no direction."""
    text = (installed / "xseed/tests/data/RESP.BW.FURT..EHZ").read_text()
    text = text.replace("EHZ", "HNE").replace("M/S - Velocity in Meters per Second", "M/S**2 - Acc")
    (tmp_path / "RESP.BW.FURT..HNE").write_text(text)
    head = "TIMESERIES BW_FURT__HNE_R, 4 samples, 200 sps, 2008-01-15T00:00:00.000000, SLIST, "
    path = tmp_path / "a.ascii"
    path.write_text(f"{head}INTEGER, Counts\n1\t-2\n3\t-4\n")
    [record] = read_file(path)
    # 400 V s2/m by 3.278688E+05 counts a volt, or as the last stage of the file states
    counts = [line for line in text.splitlines() if line.startswith("B058F04")]
    stages = [float(line.split()[-1]) for line in counts]
    total = stages[-1] if len(stages) > 2 else float(np.prod(stages))
    assert record.acceleration[0] == pytest.approx(1.0 / total, rel=1e-2)
    assert record.azimuth == 90.0
    assert record.instrument_file == "RESP.BW.FURT..HNE"


def test_a_long_comment_above_a_resp_file_takes_no_time(tmp_path: Path) -> None:
    """A pattern with two repetitions took minutes for a comment of a few lines."""
    (tmp_path / "RESP.XX.A..HNE").write_text("#\t\t ====  \t \n" * 400 + "no metadata\n")
    assert not is_station_xml(tmp_path / "RESP.XX.A..HNE")
    (tmp_path / "RESP.XX.A..HNE").write_text(
        "#\t\t ====  \t \n" * 40 + "B050F03     Station:     A\n"
    )
    assert is_station_xml(tmp_path / "RESP.XX.A..HNE")


def test_uneven_samples_of_a_sac_file_are_interpolated() -> None:
    """An uneven file contains the time of each sample; points of a straight line stay on it."""
    from tests.ingest.test_sac import sac

    times = np.cumsum([0.0, *([0.01, 0.02, 0.015, 0.011] * 10)])
    values = tuple(float(np.float32(2.0 * time)) for time in times)
    data = bytearray(sac(values))
    struct.pack_into("<i", data, 4 * (70 + 35), 0)
    data += struct.pack(f"<{times.size}f", *times)
    [record] = read_bytes("a.sac", bytes(data), ReadOptions("m/s2"))
    grid = record.time_step * np.arange(record.acceleration.size)
    np.testing.assert_allclose(record.acceleration, 2.0 * grid, atol=1e-6)
    assert "uneven points" in record.processing[0]


@pytest.mark.parametrize("change", [-1, 1])
def test_a_sample_more_or_fewer_in_a_block_of_usc_is_settled(
    shared_records: Path, change: int
) -> None:
    folder = shared_records.parent / "more_formats" / "usc"
    for path in sorted(folder.iterdir()):
        data = path.read_bytes()
        stated = re.search(rb"NO OF POINTS=\s*(\d+)", data)
        if stated:
            break
    else:
        pytest.skip("no blocks of USC among the shared files")
    [whole] = read_bytes(path.name, data)
    other = str(int(stated[1]) + change).encode().rjust(len(stated[1]))
    damaged = data[: stated.start(1)] + other + data[stated.end(1) :]
    with pytest.raises(InputError, match="--trust samples"):
        read_bytes(path.name, damaged)
    [record] = read_bytes(path.name, damaged, ReadOptions(trust=("samples",)))
    np.testing.assert_array_equal(record.acceleration, whole.acceleration)
