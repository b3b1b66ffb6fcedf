"""Files that contradict themselves: the words that settle it, and the values that they give.

Each file is sound but for one statement. What the user trusts gives the record of the sound file,
or that record with the one value that the other statement implies.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from rockframe.components import HorizontalPair, rotate
from rockframe.errors import InputError, ParameterError
from rockframe.ingest import ReadOptions, collect, read_bytes, read_file
from rockframe.options.ingest import IngestOptions
from rockframe.record import Orientation, Record
from rockframe.results.records import read_records
from rockframe.stages.ingest import ingest_stage

from . import (
    test_afad,
    test_cosmos,
    test_csmip_v2,
    test_geonet,
    test_sac,
    test_small_files,
    test_smc,
)
from .conftest import v1_channel
from .test_esm import esm
from .test_knet import knet
from .test_miniseed import Write, channel_xml, mseed, stage_xml, station_xml, trace, write

__all__ = ["write"]  # a fixture

# obspy 1.5 looks up its entry points in a way that Python 3.11 deprecates.
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")

Words = Mapping[str, Mapping[str, float]]


@dataclass(frozen=True)
class Case:
    """A sound file, one replacement in it, and what each word changes of the sound record."""

    name: str
    sound: bytes
    old: bytes
    new: bytes
    words: Words
    options: ReadOptions = field(default_factory=ReadOptions)

    @property
    def lie(self) -> bytes:
        assert self.old in self.sound
        return self.sound.replace(self.old, self.new, 1)

    def read(self, data: bytes, *trust: str) -> list[Record]:
        options = ReadOptions(units=self.options.units, trust=trust)
        return read_bytes(Path(self.name), data, options)


def small(kind: str, old: str, new: str, words: Words) -> Case:
    return Case(f"a.{kind}", test_small_files.SMALL[kind].data, old.encode(), new.encode(), words)


SAMPLES: Words = {"samples": {}}
VALUES: Words = {"values": {}}
AT2 = (
    b"PEER\nEvent, 1/17/1994, Station, 090\nACCELERATION TIME SERIES IN UNITS OF G. PGA= -.3 G\n"
    b"NPTS= 3, DT= .01 SEC\n .1 .2 -.3\n"
)
TEXT = b"# npts=3 dt=0.01\ntime_s,acc_g\n0.00,0.1\n0.01,0.2\n0.02,-0.3\n"
FULL_SCALES = {22: 0.8, 23: 0.8e-6 * 2**24, 34: 0.005, 43: 4.8, 44: 4.0, 64: 3000.0, 65: 0.01}
RAW = test_cosmos.cosmos(
    test_cosmos.channel((1000.0, -2000.0, 3000.0), stage=0, units="counts (50)", reals=FULL_SCALES)
)
COSMOS = test_cosmos.cosmos(test_cosmos.channel())
SAC, IN_G = test_sac.sac(), ReadOptions(units="g")
SMC = test_smc.joined(test_smc.smc())
V1 = "\n".join([*v1_channel(), ""]).encode()
V2 = test_csmip_v2.v2(test_csmip_v2.channel())
GEONET = test_geonet.geonet()
EW, ASC = knet().encode(), esm().encode()

CASES = [
    Case("a.AT2", AT2, b"NPTS= 3", b"NPTS= 4", SAMPLES),
    Case("b.AT2", AT2, b"PGA= -.3", b"PGA= -.6", {"values": {"peak_ratio": 0.5}}),
    Case("a.csv", TEXT, b"npts=3", b"npts=2", SAMPLES),
    Case("b.csv", TEXT, b"dt=0.01", b"dt=0.02", {"waveform": {}, "header": {"time_step": 0.02}}),
    Case("a.EW", EW, b" 2Hz", b" 4Hz", {"samples": {"time_step": 0.25}}),
    Case("b.EW", EW, b"  2\n", b"  3\n", SAMPLES),
    Case("a.ASC", ASC, b"NDATA: 3", b"NDATA: 4", SAMPLES),
    Case("b.ASC", ASC, b"DURATION_S: 0.01", b"DURATION_S: 0.91", SAMPLES),
    Case("a.sac", SAC, SAC[:320], test_sac.sac(fields={test_sac.NPTS: 9})[:320], SAMPLES, IN_G),
    Case("b.sac", SAC, SAC[:12], test_sac.sac(fields={test_sac.DEPMAX: 0.75})[:12], VALUES, IN_G),
    Case("c.sac", SAC, b"HNE\0", b"HNN\0", {"component": {"azimuth": 0.0}, "azimuth": {}}, IN_G),
    Case("d.sac", SAC, SAC[:28], test_sac.sac(fields={24: 0.9})[:28], SAMPLES, IN_G),
    small("cwa", "RecordLength(sec): 0.2", "RecordLength(sec): 0.4", SAMPLES),
    small("cwa", "-3.200", "-3.300", {"values": {"peak_ratio": 1.0}}),
    small("unam", "/10/10/10", "/9/10/10", SAMPLES),
    small("unam", ": /0.20/", ": /0.40/", SAMPLES),
    small("unam", ": /50/", ": /25/", {"waveform": {}}),
    small("csmnc", "DURATION:  0.2", "DURATION:  0.4", SAMPLES),
    small("csmnc", "POINTS:  10", "POINTS:  12", SAMPLES),
    small("csmnc", "0.06 SEC", "0.10 SEC", VALUES),
    small("itaca", ": 10", ": 11", SAMPLES),
    small("bhrc", "POINTS =     10", "POINTS =     11", SAMPLES),
    small("bhrc", "DURATION =    .2", "DURATION =    .4", SAMPLES),
    small("usc", "POINTS=    10", "POINTS=     9", SAMPLES),
    small("bri", "    -3.200         4", "    -3.300         4", {"values": {"peak_ratio": 0.97}}),
    small("bri", "50    10 AAA", "50     9 AAA", SAMPLES),
    small("isesd", "samples:             10", "samples:             11", SAMPLES),
    small("isesd", "0.180s", "0.280s", SAMPLES),
    small("volume1_pairs", "POINTS =     10", "POINTS =     11", SAMPLES),
    small("volume1_pairs", "LENGTH =  0.180", "LENGTH =  0.280", SAMPLES),
    small("volume1_pairs", "RECORD = 0.", "RECORD = 0.9", VALUES),
    small("volume1_pairs", "0.060 SEC", "0.160 SEC", VALUES),
    Case("a.V0", RAW, b" 4.800000", b" 9.600000", {"sensitivity": {}, "full-scale": {"pga": 0.5}}),
    Case("b.V0", RAW, b"13.421773", b" 9.000000", {"sensitivity": {}}),
    Case("c.V0", RAW, b" 0.005000", b" 0.010000", {"header": {}, "waveform": {"time_step": 0.01}}),
    Case("a.V2c", COSMOS, b" 0.015000", b" 0.915000", SAMPLES),
    Case("b.V2c", COSMOS, b" 90 Deg", b"180 Deg", {"component": {"azimuth": 180.0}, "azimuth": {}}),
    Case("c.V2c", COSMOS, b"       3 acc", b"       4 acc", SAMPLES),
    Case("a.smc", SMC, b"         3", b"         4", SAMPLES),
    Case("b.smc", SMC, b"=    360", b"=    270", {"component": {"azimuth": 270.0}, "azimuth": {}}),
    Case("a.V1", V1, b"     3 Accel", b"     4 Accel", SAMPLES),
    Case("b.V1", V1, b"Length = 0.03", b"Length = 0.93", SAMPLES),
    Case("c.V1", V1, b"100 pts", b"200 pts", {"header": {}}),
    Case("a.V2", V2, b"    3 POINTS OF ACCEL", b"    4 POINTS OF ACCEL", SAMPLES),
    Case("b.V2", V2, b"  3 POINTS OF INST", b"  4 POINTS OF INST", SAMPLES),
    Case("c.V2", V2, b"OF    .020", b"OF    .040", {"waveform": {}, "header": {"time_step": 0.04}}),
    Case("a.V2A", GEONET, b"at 0.020", b"at 0.010", {"header": {}}),
    Case("b.V2A", GEONET, b"points  12", b"points  13", SAMPLES),
    Case("c.V2A", GEONET, b"Duration 0.22", b"Duration 2.22", SAMPLES),
    Case("d.V2A", GEONET, b"S16W", b"S36W", {"component": {"azimuth": 216.0}, "azimuth": {}}),
]


@pytest.mark.parametrize(
    "case", CASES, ids=lambda case: f"{case.name} {case.new.decode('latin-1')}"
)
def test_what_is_trusted_is_the_value_of_the_record(case: Case) -> None:
    sound = case.read(case.sound)[0]
    with pytest.raises(InputError) as refused:
        case.read(case.lie)
    assert all(f"--trust {word}" in refused.value.reason for word in case.words)
    for word, changes in case.words.items():
        record = case.read(case.lie, word)[0]
        expected = changes.get("pga", 1.0) * sound.acceleration
        assert record.acceleration == pytest.approx(expected, rel=1e-12, abs=0.0)
        for name in ("time_step", "azimuth"):
            must = changes.get(name, getattr(sound, name))
            assert getattr(record, name) == pytest.approx(must, rel=1e-12, nan_ok=True)
        if "peak_ratio" in changes:
            assert record.peak_ratio == pytest.approx(changes["peak_ratio"], rel=0.05)
        assert {note.partition(":")[0] for note in record.trusted} == {word}


@pytest.mark.parametrize(
    "case", CASES, ids=lambda case: f"{case.name} {case.new.decode('latin-1')}"
)
def test_other_words_settle_nothing(case: Case) -> None:
    others = {"stages", "scale", "samples", "values"} - set(case.words)
    with pytest.raises(InputError, match="Settled by --trust"):
        case.read(case.lie, *others)


STAGES = stage_xml(1, "0.5", "M/S**2", "V") + stage_xml(2, "8000.0", "V", "COUNTS")
CONTRADICTORY = station_xml(channel_xml(stages=STAGES))  # 1000 counts per m/s2, or 4000


@pytest.mark.parametrize(("word", "counts"), [("sensitivity", 1000.0), ("stages", 4000.0)])
def test_one_of_sensitivity_and_stages_is_trusted(write: Write, word: str, counts: float) -> None:
    """A StationXML whose stages repeat the gain of the digitizer: four times the sensitivity."""
    path = write(xml=CONTRADICTORY)
    with pytest.raises(InputError, match=r"Settled by --trust sensitivity or --trust stages\."):
        read_file(path)
    [record] = read_file(path, ReadOptions(trust=(word,)))
    expected = np.array([0.0, 1000.0, -3000.0, 2000.0]) / counts
    assert record.acceleration == pytest.approx(expected, rel=1e-12)
    [note] = record.trusted
    said = "sensitivity of CI.CLC..HNE is 1000 counts per m/s2, but the gains of its 2 stages"
    assert note == f"{word}: {said} multiply to 4000."


#: A sensor without dynamics below 1 MHz, and a digitizer of 100 Hz.
UNITS = "<InputUnits><Name>{}</Name></InputUnits><OutputUnits><Name>{}</Name></OutputUnits>"
FLAT = f"""<Stage number="1"><PolesZeros>{UNITS.format("M/S**2", "V")}
<PzTransferFunctionType>LAPLACE (RADIANS/SECOND)</PzTransferFunctionType>
<NormalizationFactor>1e6</NormalizationFactor><NormalizationFrequency>0.03</NormalizationFrequency>
<Pole number="0"><Real>-1e6</Real><Imaginary>0</Imaginary></Pole></PolesZeros>
<StageGain><Value>0.5</Value><Frequency>0.03</Frequency></StageGain></Stage>
<Stage number="2"><Coefficients>{UNITS.format("V", "COUNTS")}
<CfTransferFunctionType>DIGITAL</CfTransferFunctionType></Coefficients><Decimation>
<InputSampleRate>100</InputSampleRate><Factor>1</Factor><Offset>0</Offset><Delay>0</Delay>
<Correction>0</Correction></Decimation>
<StageGain><Value>8000.0</Value><Frequency>0.03</Frequency></StageGain></Stage>"""


@pytest.mark.parametrize("word", ["sensitivity", "stages"])
def test_the_full_response_has_the_trusted_gain(write: Write, word: str) -> None:
    """The response of stages that only multiply is their gain, so both conversions agree."""
    counts = (1e6 * np.sin(np.arange(400) * np.pi / 20.0)).astype(int)  # without a mean
    path = write(mseed(trace(counts)), station_xml(channel_xml(stages=FLAT)))
    [divided] = read_file(path, ReadOptions(trust=(word,)))
    [removed] = read_file(path, ReadOptions(trust=(word,), water_level=60.0))
    middle = slice(60, 340)  # the ends are tapered
    assert removed.acceleration[middle] == pytest.approx(
        divided.acceleration[middle], abs=1e-3 * divided.pga
    )


def test_the_rate_of_waveform_or_station_xml_is_trusted(write: Write) -> None:
    path = write(xml=station_xml(channel_xml(rate="200.0")))
    steps = {
        word: read_file(path, ReadOptions(trust=(word,)))[0].time_step
        for word in ("waveform", "header")
    }
    assert steps == pytest.approx({"waveform": 0.01, "header": 0.005}, rel=1e-12)


def test_scale_or_sensitivity_of_a_sac_file_is_trusted(tmp_path: Path) -> None:
    known = station_xml(channel_xml(rate="50.0")).replace("CLC", "T001230").replace('"CI"', '"CJ"')
    (tmp_path / "T001230.xml").write_text(known)
    path = tmp_path / "a.sac"
    path.write_bytes(test_sac.sac(fields={test_sac.SCALE: 500.0}))
    peaks = {
        word: read_file(path, ReadOptions(trust=(word,)))[0].pga
        for word in ("scale", "sensitivity")
    }
    assert peaks == pytest.approx({"scale": 0.5 / 500.0, "sensitivity": 0.5 / 1000.0}, rel=1e-12)


def test_both_statements_cannot_be_trusted(write: Write) -> None:
    path = write(xml=CONTRADICTORY)
    with pytest.raises(InputError, match=r"sensitivity and stages are both trusted\. Trust one"):
        read_file(path, ReadOptions(trust=("sensitivity", "stages")))


@pytest.mark.parametrize(
    "case",
    [
        small("cwa", "-3.200", "-3.300", VALUES),
        small("unam", "/-3.2000/", "/3.2000/", VALUES),
        Case("a.txt", test_afad.afad().encode(), b"(N-S) ", b"(N-S) 9", VALUES),
        Case("a.V2A", GEONET, b"-41.6", b"-42.6", VALUES),
    ],
    ids=lambda case: case.name,
)
def test_only_the_contradictory_channel_is_noted(case: Case) -> None:
    """A file of three components of which the peak of one differs."""
    assert [len(record.trusted) for record in case.read(case.lie, "values")] == [1, 0, 0]


def test_an_unknown_word_is_refused() -> None:
    with pytest.raises(
        ParameterError, match=r"Invalid trust 'sample'\. Must be one or more of: sam"
    ):
        ReadOptions(trust=("sample",))
    with pytest.raises(ParameterError, match=r"trust .*'sample'.* Must be"):
        IngestOptions(trust=("sample",))


def folder_of(tmp_path: Path, *rows: str) -> Path:
    """Return a folder with a file that states 4 samples of 3, and one that is sound."""
    motion = [f"{0.3 * (-1) ** k * min(k, 40 - k) / 20.0:.4f}" for k in range(41)]
    folder = tmp_path / "records"
    folder.mkdir()
    for name, count in (("short", 50), ("sound", 41)):
        title = "PEER\nEvent, 1/17/1994, Station, 090\nACCELERATION TIME SERIES IN UNITS OF G\n"
        text = f"{title}NPTS= {count}, DT= .01 SEC\n{' '.join(motion)}\n"
        (folder / f"{name}.AT2").write_text(text)
    if rows:
        (folder / "catalogue.csv").write_text("\n".join(["file,trust", *rows, ""]))
    return folder


def test_a_catalogue_states_what_to_trust_of_a_file(tmp_path: Path) -> None:
    folder = folder_of(tmp_path, "short.AT2,samples values")
    found = {one.record_id: one.trusted for one in collect([folder]) if isinstance(one, Record)}
    assert found == {
        "short": ("samples: NPTS 50 in the header, 41 samples in the file.",),
        "sound": (),
    }


def test_a_catalogue_overrides_the_option(tmp_path: Path, write: Write) -> None:
    path = write(xml=CONTRADICTORY)
    (tmp_path / "catalogue.csv").write_text(f"file,trust\n{path.name},stages\n")
    [record] = [
        one
        for one in collect([tmp_path], ReadOptions(trust=("sensitivity",)))
        if isinstance(one, Record)
    ]
    assert record.pga == pytest.approx(3000.0 / 4000.0, rel=1e-12)


def test_an_unknown_word_in_a_catalogue_is_refused(tmp_path: Path) -> None:
    folder = folder_of(tmp_path, "short.AT2,sample")
    with pytest.raises(InputError, match=r"catalogue\.csv:2: Invalid trust 'sample'\. Must be one"):
        list(collect([folder]))


def test_the_file_of_records_says_what_was_trusted(tmp_path: Path) -> None:
    output = tmp_path / "records.nc"
    done = ingest_stage([folder_of(tmp_path)], output, IngestOptions(trust=("samples",)), workers=0)
    note = "samples: NPTS 50 in the header, 41 samples in the file."
    assert [record.trusted for record in done.accepted] == [(note,), ()]
    assert [record.trusted for record in read_records(output)] == [(note,), ()]


def test_without_the_option_the_reason_names_it(tmp_path: Path) -> None:
    done = ingest_stage([folder_of(tmp_path)], tmp_path / "records.nc", workers=0)
    [rejected] = done.rejections
    assert (rejected.file, rejected.line) == ("short.AT2", 4)
    assert rejected.reason.endswith("41 samples in the file. Settled by --trust samples.")


def test_a_rotated_motion_has_the_notes_of_both_components() -> None:
    def component(name: str, azimuth: float, *trusted: str) -> Record:
        return Record(
            record_id=name,
            acceleration=np.array([0.0, 1.0]),
            time_step=0.01,
            orientation=Orientation.HORIZONTAL,
            azimuth=azimuth,
            trusted=trusted,
        )

    pair = HorizontalPair(component("e", 90.0, "samples: a."), component("n", 0.0, "values: b."))
    assert rotate(pair, 45.0).trusted == ("samples: a.", "values: b.")


def test_the_command_says_what_was_trusted_and_which_word_settled_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from rockframe.cli.main import main

    words = ["--trust", "samples", "stages", "--workers", "0"]
    output = str(tmp_path / "records.nc")
    assert main(["ingest", str(folder_of(tmp_path)), "--output", output, *words]) == 0
    printed = capsys.readouterr().out
    assert "\nshort: trusted samples: NPTS 50 in the header, 41 samples in the file.\n" in printed
    assert "\n--trust stages: no accepted record contradicts itself there\n" in printed
