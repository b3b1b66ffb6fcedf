"""Formats of which no real file may be bundled: small files in their layouts, with invented facts.

Each file has ten samples, of which the fourth is the largest. Facts that a file states of its
samples are computed here from the samples, so each can be made wrong alone. The real files of the
same formats are read by test_more_formats, where they are at hand.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from rockframe.errors import InputError
from rockframe.ingest import FORMATS, read_bytes, sniff_format
from rockframe.record import Orientation, Record

SAMPLES = (0.4, -0.8, 1.6, -3.2, 1.2, 2.0, -1.6, 0.4, 0.8, -0.4)
#: Samples of a second and third component: their peaks differ, so that no two can be swapped.
OTHERS = (tuple(-0.5 * x for x in SAMPLES), tuple(0.25 * x for x in SAMPLES))
THREE = (SAMPLES, *OTHERS)
STEP, GAL, TENTH_G = 0.02, 0.01, 0.981


def rows(values: Iterable[float], form: str, columns: int) -> list[str]:
    """Return numbers in lines of a number of columns."""
    texts = [format(value, form) for value in values]
    return ["".join(texts[k : k + columns]) for k in range(0, len(texts), columns)]


def cwa() -> list[str]:
    extremes = [f"{max(part):9.3f}~{min(part):9.3f}" for part in THREE]
    return [
        "#Earthquake Information",
        "#Origin Time(GMT+08): 2021/03/04-05:06:07",
        "#EpicenterLongitude(E): 121.0",
        "#EpicenterLatitude(N): 24.0",
        "#Depth(km): 10.0",
        "#Magnitude(Ml): 6.5",
        "#StationCode: AAA",
        "#StationLongitude(E): 121.0",
        "#StationLatitude(N): 24.5",
        "#StartTime(GMT+08): 2021/03/04-05:06:00.500",
        "#RecordLength(sec): 0.2",
        "#SampleRate(Hz): 50",
        "#AmplitudeUnit:  gal. DCoffset(corr)",
        *(f"#AmplitudeMAX. {name}: {both}" for name, both in zip("UNE", extremes, strict=True)),
        "#DataSequence: Time U(+); N(+); E(+)",
        "#Data: 4F10.3",
        *(
            "".join(f"{value:10.3f}" for value in (STEP * k, *row))
            for k, row in enumerate(zip(*THREE, strict=True))
        ),
    ]


def unam() -> list[str]:
    peaks = "/".join(f"{part[3]:.4f}" for part in THREE)
    return [
        "*" * 60,
        "ARCHIVO ESTANDAR DE ACELERACION:",
        "CLAVE DE LA ESTACION                   : AAAA",
        "COORDENADAS DE LA ESTACION             : 18.0 LAT. N",
        "                                       : 101.0 LONG. W",
        "ORIENTACION C1-C6 (rumbo;orientacion)  : /N00E/N90E/V",
        "VEL. DE MUESTREO, C1-C6 (muestras/s)   : /50/50/50",
        "INTERVALO DE MUESTREO, C1-C6 (s)       : /0.02/0.02/0.02",
        "FECHA DEL SISMO [GMT]                  : 2021/03/04",
        "HORA EPICENTRO (GMT)                   : 05:06:07",
        "MAGNITUD(ES)                           : /M=6.5",
        "COORDENADAS DEL EPICENTRO              : 18.5 LAT. N",
        "                                       : 101.0 LONG. W",
        "PROFUNDIDAD FOCAL (Km)                 : 10.0",
        "HORA DE LA PRIMERA MUESTRA (GMT)       : 05:06:10.500",
        "DURACION DEL REGISTRO (s), C1-C6       : /0.20/0.20/0.20",
        "NUM. TOTAL DE MUESTRAS, C1-C6          : /10/10/10",
        f"ACEL. MAX.(Gal), C1-C6                 : /{peaks}",
        "ACEL. MAX., C1-C6, EN LA MUESTRA       : /4/4/4",
        "UNIDADES DE LOS DATOS                  : Gal (cm/s/s)",
        "FACTOR DE DECIMACION                   : 1",
        "FORMATO DATOS (FORTRAN,10 campos/dato) : 3F10.4",
        "---------+---------+---------+",
        "      N00E      N90E         V",
        "---------+---------+---------+",
        *("".join(f"{value:10.4f}" for value in row) for row in zip(*THREE, strict=True)),
    ]


def csmnc() -> list[str]:
    return [
        "000AAA210304050607",
        "0210304050607 2021-03-04 05:06:07 BTM",
        "SOMEWHERE EARTHQUAKE",
        "EPICENTER  39.5N 77.0E DEPTH 9 KM",
        "MAGNITUDE  6.5(Ms)",
        "STATION: AAA 39.0N 77.0E",
        "SITE CONDITION: SOIL",
        "INSTRUMENT TYPE: NONE",
        "OBSERVING POINT: GROUND",
        "COMP. EW",
        "UNCORRECTED ACCELERATION          UNIT: CM/SEC/SEC",
        f"NO. OF POINTS:  10  EQUALLY SPACED INTERVALS OF:  {STEP}  SEC",
        f"PEAK VALUE:    {SAMPLES[3]}   AT   0.06 SEC    DURATION:  0.2 SEC",
        "PRE-EVENT TIME:  20  SEC",
        "CSMNC",
        "",
        *rows(SAMPLES, "14.6E", 8),
    ]


def itaca() -> list[str]:
    return [
        "Event Date & Time             : 2021-03-04 05:06:07",
        "Station Code / Name           : 0001 / Somewhere",
        "Network                       : None",
        "Orientation                   : UP",
        "Processing Info               : none",
        "Filter Cut-off Frequency (Hz) : 0.100 - 20.000",
        f"Time Increment (s)            : {STEP}",
        "Number of Data                : 10",
        f"PGA (m/s/s)                   : {SAMPLES[3]:.7E}",
        "Accelaration time series in m/s/s",
        *rows(SAMPLES, "14.7E", 5),
    ]


def bhrc() -> list[str]:
    lines = []
    for name, part in zip(("L1", "V2", "T3"), THREE, strict=True):
        lines += [
            "* VOL1DS FILE:  0001/01",
            "Inst Type = SSA-2",
            "Origin Time : 2021/03/04   05:06:07",
            *("", "L", ""),
            f"COMP {name}",
            "AAA    Station   38.000 N 46.000 E   Altitude 1000m   Azimuth L 177   T 267",
            "Epicenter 38.500 N 46.000 E   FD 10 Km mb      Ms      Mw6.5",
            "INSTR PERIOD =  .020 SEC   DAMPING =  .600",
            "NO. OF POINTS =     10      DURATION =    .200",
            "UNITS ARE SECONDS AND G/10",
            "",
            *["    0" * 16] * 7,
            "  .200000E-01  .600000E+00",
            "  .500000E+02  .000000E+00",
            *["  .000000E+00"] * 5,
            *rows(part, "13.5E", 10),
            "/&",
        ]
    return lines


def usc() -> list[str]:
    lines = []
    for quantity in ("AC", "VL", "DP"):
        lines += [
            " SOMEWHERE, GROUND FLOOR",
            " 090 DEGREES",
            " EARTHQUAKE OF MARCH 4, 2021",
            " BUTTERWORTH AT .25 HZ, ORDER 4",
            " YEAR=2021",
            f" SAMPLES/SEC= 50 FILTER TYPE=BUTTERWORTH  CORNER= 0.25 ORDER=4 DATA TYPE={quantity}",
            " NO OF POINTS=    10, UNITS=CM/SEC**2, CM/SEC, AND CM",
            *rows(SAMPLES, "8.3f", 10),
        ]
    return lines


def volume1_pairs() -> list[str]:
    pairs = [value for k, sample in enumerate(SAMPLES) for value in (STEP * k, sample)]
    between = np.interp(np.linspace(0.0, 9.0, 9001), np.arange(10), SAMPLES)
    return [
        "UNCORRECTED ACCELEROGRAM DATA",
        "SOMEWHERE EARTHQUAKE",
        "03/04/2021 05:06:07 (GMT)",
        "TRIGGER TIME: 03/04/2021 05:06:07.000 GMT",
        "STATION NO. 14403   33.000N, 118.000W     SMA-1  S/N 1  (1 CHNS OF 1 AT STA)",
        "SOMEWHERE - A SCHOOL",
        "CHAN  1:  90 DEG",
        "",
        "HYPOCENTER:   33.500N  118.000W  H=  10.0KM   ML= 6.50",
        "INSTR PERIOD = 0.0400 SEC,  DAMPING =0.6000",
        "NO. OF POINTS =     10  RECORD LENGTH =  0.180 SEC",
        "UNITS OF UNCOR ACCEL ARE SEC AND G/10.     "
        f"MAX  = {0.1 * SAMPLES[3]:.3f} G, AT   0.060 SEC",
        f"RMS ACCEL OF COMPLETE RECORD = {0.1 * np.sqrt(np.mean(between**2)):.4f} G",
        *["    0" * 16] * 6,
        "    0" * 4,
        *["     0.000" * 8] * 6,
        "     0.000" * 2,
        *rows(pairs, "7.3f", 10),
    ]


def bri() -> list[str]:
    lines = ["2021/03/04 05:06:07   3  50    10 AAA: Somewhere, a hall"]
    for label, part in zip(("063-GL", "153-GL", "UP-GL"), THREE, strict=True):
        lines.append(f"{label:10}{part[3]:10.3f}{4:10d}{0.013:10.3f}{'3.00e-2':>10}")
        lines += rows(part, "10.3f", 8)
    return lines


def isesd() -> list[str]:
    return [
        "file:                         000001xa.cor",
        "earthquake code:                 990",
        "station code:                    694",
        "waveform code:                     1",
        "total number of channels:     3",
        "orientation of transducer:    EW ",
        "sensitivity:                  20.00V/g",
        "fc of anti-alias filter:       30Hz",
        "time of first sample:          4. 3.2021 05:06:07.500UTC ",
        f"sampling period:               {STEP:.6f}s ",
        "number of samples:             10 ",
        "record length:                 0.180s ",
        "units:                        m/s*s, m/s, m & s ",
        "reference: ",
        "Somebody (2021): Written communication: by letter ",
        "comments & processing history: ",
        "%- 8th order elliptical bandpass-filter (0.25-25.00Hz) ",
        "%- Butterworth low cut filter (0.5000Hz) ",
        "-> corrected acceleration time histories ",
        *rows(SAMPLES, "13.5E", 6),
        "-> corrected velocity time histories ",
        *rows(OTHERS[0], "13.5E", 6),
        "STOP ",
    ]


@dataclass(frozen=True)
class Small:
    """A small file, the unit of its samples, and what its header says of the first component."""

    lines: Callable[[], list[str]]
    unit: float
    component: str
    azimuth: float
    station: str
    magnitude: float = 6.5
    distance: float = 55.6  # half a degree of latitude [km]
    start: str = ""

    @property
    def data(self) -> bytes:
        return "\r\n".join([*self.lines(), ""]).encode()


SMALL = {
    "cwa": Small(cwa, GAL, "U", math.nan, "AAA", start="2021-03-03T21:06:00.500Z"),
    "unam": Small(unam, GAL, "N00E", 0.0, "AAAA", start="2021-03-04T05:06:10.500Z"),
    "csmnc": Small(csmnc, GAL, "EW", 90.0, "AAA"),
    "itaca": Small(itaca, 1.0, "UP", math.nan, "Somewhere", math.nan, math.nan),
    "bhrc": Small(bhrc, TENTH_G, "L", 177.0, "AAA"),
    "usc": Small(usc, GAL, "090", 90.0, "SOMEWHERE, GROUND FLOOR", math.nan, math.nan),
    "volume1_pairs": Small(volume1_pairs, TENTH_G, "090", 90.0, "14403"),
    "bri": Small(bri, GAL, "063-GL", 63.0, "AAA GL", math.nan, math.nan),
    "isesd": Small(
        isesd, 1.0, "EW", 90.0, "694", math.nan, math.nan, start="2021-03-04T05:06:07.500Z"
    ),
}
COMPONENTS = {"cwa": 3, "unam": 3, "bhrc": 3, "bri": 3}


def read(name: str, data: bytes) -> list[Record]:
    return read_bytes(Path(f"small.{name}"), data)


@pytest.mark.parametrize("name", SMALL)
def test_samples_and_facts_are_those_that_were_written(name: str) -> None:
    small = SMALL[name]
    records = read(name, small.data)
    assert len(records) == COMPONENTS.get(name, 1)
    for record, written in zip(records, THREE, strict=False):
        assert record.acceleration == pytest.approx(small.unit * np.array(written), rel=1e-6)
        assert record.time_step == STEP
    first = records[0]
    assert (first.component, first.station, first.start_time) == (
        small.component, small.station, small.start,
    )  # fmt: skip
    found = (first.azimuth, first.magnitude, first.epicentral_distance)
    assert found == pytest.approx(
        (small.azimuth, small.magnitude, small.distance), abs=0.1, nan_ok=True
    )
    vertical = small.component in ("U", "UP")
    assert (first.orientation is Orientation.VERTICAL) == vertical


@pytest.mark.parametrize("name", SMALL)
def test_only_its_own_reader_claims_a_file(name: str) -> None:
    assert [entry.name for entry in FORMATS if entry.sniff(SMALL[name].data)] == [name]


@pytest.mark.parametrize("name", [name for name in SMALL if name != "isesd"])
def test_a_file_without_its_end_is_rejected(name: str) -> None:
    """The header states more samples than are left, or the last component has no end."""
    lines = SMALL[name].data.splitlines(keepends=True)
    for fewer in (1, 2):
        with pytest.raises(InputError):
            read(name, b"".join(lines[:-fewer]))


@pytest.mark.parametrize(
    ("name", "old", "new", "message"),
    [
        ("cwa", b"-3.200", b"-3.300", "peak -3.3 gal stated, but -3.2"),
        ("cwa", b"RecordLength(sec): 0.2", b"RecordLength(sec): 0.4", "20 samples stated"),
        ("cwa", b"SampleRate(Hz): 50", b"SampleRate(Hz): 49", "49 samples a second stated"),
        ("unam", b"/-3.2000/", b"/3.2000/", "peak 3.2 gal N00E stated, but -3.2"),
        ("unam", b"/4/4/4", b"/7/4/4", "peak stated at 0.12 s, but at 0.06 s"),
        ("unam", b"/10/10/10", b"/9/10/10", "10 samples|9 samples stated"),
        ("csmnc", b"VALUE:    -3.2", b"VALUE:    -4.2", "peak -4.2 cm/s2 stated"),
        ("csmnc", b"0.06 SEC", b"0.10 SEC", "peak stated at 0.1 s"),
        ("csmnc", b"DURATION:  0.2", b"DURATION:  0.4", "0.4 s stated, but 10 samples"),
        ("itaca", b"-3.2000000E+00\r\nAcc", b"-3.1000000E+00\r\nAcc", "peak -3.1"),
        ("itaca", b": 10", b": 11", "10 samples|11 samples stated"),
        ("bhrc", b".500000E+02", b".100000E+03", "at 100 samples a second stated"),
        ("bhrc", b"COMP V2", b"COMP T2", "components L, T, T"),
        ("usc", b"DATA TYPE=VL", b"DATA TYPE=DP", "block of DP. Must be VL"),
        ("usc", b"POINTS=    10", b"POINTS=    11", "11 samples stated|10 samples"),
        ("volume1_pairs", b"-0.320 G", b"-0.420 G", "peak -0.42 g stated"),
        ("volume1_pairs", b"0.060 SEC", b"0.160 SEC", "peak stated at 0.16 s"),
        ("volume1_pairs", b"0.060 SEC", b"0.100 SEC", "peak stated at 0.1 s"),  # the highest sample
        ("volume1_pairs", b"LENGTH =  0.180", b"LENGTH =  0.220", "length 0.220 s stated"),
        ("volume1_pairs", b"LENGTH =  0.180", b"LENGTH =  0.140", "length 0.140 s stated"),
        ("volume1_pairs", b"RECORD = 0.", b"RECORD = 0.9", "root mean square 0.9"),
        ("bri", b"    -3.200         4", b"    -3.300         4", "peak -3.3 cm/s2 stated"),
        ("bri", b"    -3.200         4", b"     3.200         4", "peak 3.2 cm/s2 stated"),
        ("bri", b"         4     0.013", b"         7     0.013", "peak stated at 0.12 s, but"),
        ("bri", b"50    10 AAA", b"50     9 AAA", "9 samples stated, 10 in the file"),
        ("bri", b"50    10 AAA", b"50  1 10 AAA", "where a line such as '1993/01/15"),
        ("bri", b"50    10 AAA", b"50    17 AAA", "of 17 samples stated, which need 13 lines: 10"),
        ("bri", b"  3  50 ", b"  2  50 ", "2 channels of 10 samples stated, which need 7 lines"),
        ("isesd", b"samples:             10", b"samples:             11", "11 samples stated"),
        ("isesd", b"0.180s", b"0.280s", "0.28 s stated, but 10 samples at 0.02 s"),
        ("isesd", b"0.020000s", b"0.010000s", "0.18 s stated, but 10 samples at 0.01 s"),
        ("isesd", b"0.020000s", b"20ms", "period '20ms'. Must be a number of seconds"),
        ("isesd", b"0.180s", b"180ms", "length '180ms'. Must be a number of seconds"),
        ("isesd", b"m/s*s,", b"m/s,", "units 'm/s, m/s, m & s'. Must be m/s.s for accel"),
        ("isesd", b"m/s*s,", b"cm/s*s,", "units 'cm/s.s, m/s, m & s'. Must be m/s.s for accel"),
    ],
)  # fmt: skip
def test_a_lie_in_the_header_is_found(name: str, old: bytes, new: bytes, message: str) -> None:
    data = SMALL[name].data
    assert old in data
    with pytest.raises(InputError, match=message):
        read(name, data.replace(old, new, 1))


def test_a_root_mean_square_may_be_off_by_three_percent() -> None:
    """Archives take the mean over samples, or over time, and drop digits."""
    before, stated, after = re.split(rb"(?<=RECORD = )(\S+)", SMALL["volume1_pairs"].data)
    for factor in (0.98, 1.02):
        assert read("volume1_pairs", before + b"%.4f" % (factor * float(stated)) + after)
    for factor in (0.96, 1.04):
        with pytest.raises(InputError, match="root mean square"):
            read("volume1_pairs", before + b"%.4f" % (factor * float(stated)) + after)


def test_a_peak_may_be_timed_from_the_trigger() -> None:
    """The first time states when samples begin, the trigger is later: 0.06 s before the peak."""
    data = SMALL["volume1_pairs"].data
    late = data.replace(b"05:06:07.000 GMT", b"05:06:07.040 GMT").replace(
        b"0.060 SEC", b"0.020 SEC"
    )
    assert len(read("volume1_pairs", late)) == 1
    with pytest.raises(InputError, match="peak stated at"):
        read("volume1_pairs", data.replace(b"0.060 SEC", b"0.010 SEC"))


def test_the_title_of_a_unam_file_is_in_its_first_ten_lines() -> None:
    """Letters and tables that quote the title further down are no record."""
    [unam_format] = [entry for entry in FORMATS if entry.name == "unam"]
    title = b"ARCHIVO ESTANDAR DE ACELERACION:\n"
    assert unam_format.sniff(b"*\n" * 9 + title)
    assert not unam_format.sniff(b"*\n" * 10 + title)


def test_an_isesd_file_is_complete_with_its_accelerations() -> None:
    """Velocity and displacement, which follow them, may be missing, but no sample may be."""
    data = SMALL["isesd"].data
    before, line, rest = data.partition(b"-> corrected velocity")
    [whole], [cut] = read("isesd", data), read("isesd", before)
    np.testing.assert_array_equal(cut.acceleration, whole.acceleration)
    assert (whole.filter_low, whole.filter_high) == (0.5, 25.0)
    assert (whole.event, whole.uncorrected) == ("ISESD 990", False)
    with pytest.raises(InputError, match="10 samples stated, 9 in the file"):
        read("isesd", before.rstrip()[:-13] + b"\r\n" + line + rest)


@pytest.mark.parametrize(
    ("section", "message"),
    [
        (b"-> FREQ, FAS", "is 'FREQ, FAS', not corrected acceleration"),
        (b"-> PER, SA, SV, SD, PSV at  5.0% damping", "is 'PER, SA, SV, SD, PSV at  5.0% damping'"),
        (b"-> uncorrected acceleration, time", "describes files of corrected acceleration only"),
        (b"Accelerations:", "is 'corrected velocity time histories'"),
    ],
)
def test_other_files_of_isesd_are_named(section: bytes, message: str) -> None:
    data = SMALL["isesd"].data
    with pytest.raises(InputError, match=message):
        read("isesd", data.replace(b"-> corrected acceleration time histories", section))


@pytest.mark.parametrize("units", [b"m/s2", b"m/s^2", b"m/s**2", b"m/s/s", b"M/S2", b"m/s.s"])
def test_the_units_of_isesd_have_one_meaning_in_each_spelling(units: bytes) -> None:
    data = SMALL["isesd"].data
    [usual], [record] = read("isesd", data), read("isesd", data.replace(b"m/s*s,", units + b","))
    np.testing.assert_array_equal(record.acceleration, usual.acceleration)


def test_capitals_of_a_section_of_isesd_do_not_matter() -> None:
    data = SMALL["isesd"].data
    titled = data.replace(b"-> corrected acceleration", b"-> Corrected Acceleration")
    [usual], [record] = read("isesd", data), read("isesd", titled)
    np.testing.assert_array_equal(record.acceleration, usual.acceleration)


def test_blanks_after_a_channel_header_of_bri_do_not_matter() -> None:
    data = SMALL["bri"].data
    padded = b"\r\n".join(
        line + b"   " if b"-GL " in line else line for line in data.split(b"\r\n")
    )
    assert padded != data
    for usual, record in zip(read("bri", data), read("bri", padded), strict=True):
        np.testing.assert_array_equal(record.acceleration, usual.acceleration)


def test_a_start_of_unknown_second_is_unknown() -> None:
    [record] = read("isesd", SMALL["isesd"].data.replace(b"07.500UTC", b"-9.999UTC"))
    assert record.start_time == ""


@pytest.mark.parametrize("encoding", ["latin-1", "utf-8"])
def test_a_mexican_file_with_accents_blanks_and_a_last_stroke(encoding: str) -> None:
    """Networks write the keys of the standard with Spanish accents, and values with blanks."""
    data = SMALL["unam"].data
    [plain, *_] = read("unam", data)
    for bare, accented in (("DURACION", "DURACIÓN"), ("ORIENTACION", "ORIENTACIÓN"),
                           ("ESTANDAR DE ACELERACION", "ESTÁNDAR DE ACELERACIÓN")):  # fmt: skip
        assert bare.encode() in data
        data = data.replace(bare.encode(), accented.encode(encoding))
    data = data.replace(b"/10/10/10", b"/ 10 / 10 / 10 /")
    assert sniff_format(data).name == "unam"
    [again, *_] = read("unam", data)
    assert again.acceleration == pytest.approx(plain.acceleration)
    assert (again.station, again.azimuth) == (plain.station, plain.azimuth)
    with pytest.raises(InputError, match="Must be a value for each of 3 channels"):
        read("unam", SMALL["unam"].data.replace(b"/10/10/10", b"/10/10"))
