"""Files in the layout of an archive with made-up samples, for tests beside which no real file is.

Each header states what the header of the real file of this name states, so that the same changes
of a value contradict the same other values.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.ingest.conftest import ROOT
from tests.ingest.test_afad import afad as afad_of
from tests.ingest.test_cosmos import channel as cosmos_channel
from tests.ingest.test_geonet import component as geonet_component

from rockframe.ingest import read_bytes, read_file
from rockframe.record import Record

Float = NDArray[np.float64]


def motion(count: int, peak: float, place: int, decimals: int) -> Float:
    """Return smooth noise that fades in and out, rounded, with its largest value at a place."""
    noise = np.random.default_rng((count, place)).uniform(-1.0, 1.0, count)
    smooth = np.convolve(noise, np.hanning(21) / 10.0, "same") * np.hanning(count)
    samples = 0.4 * abs(peak) * smooth / np.abs(smooth).max()
    rise = np.exp(-(((np.arange(count) - place) / 4.0) ** 2))
    rounded: Float = np.round(samples + (peak - samples[place]) * rise, decimals)
    return rounded


def lines_of(cells: Sequence[str], columns: int) -> list[str]:
    return ["".join(cells[k : k + columns]) for k in range(0, len(cells), columns)]


def joined(lines: Sequence[str], end: str = "\r\n") -> bytes:
    return end.join([*lines, ""]).encode("latin-1")


def fields(count: int, width: int, form: str, values: Mapping[int, float]) -> list[str]:
    """Return numbered cells, 0 by default, without the zero before a point."""
    cells = (f"{values.get(k, 0):{form}}" for k in range(1, count + 1))
    bare = (cell[1:] if cell.startswith("0.") else cell for cell in cells)
    return [cell[:width].rjust(width) for cell in bare]


def at2() -> bytes:
    samples = motion(7818, 0.48431, 1500, 7)
    return joined(
        [
            "PACIFIC ENGINEERING AND ANALYSIS STRONG-MOTION DATA",
            "SOMEWHERE 10/15/79 2316, Array #4, 140",
            "ACCELERATION TIME HISTORY IN UNITS OF G,  PGA=   .48431 G, PGV=   39.6246 CM/SEC",
            "NPTS=   7818, DT=   .0050 SEC,   0 POLE @    40.00000 HZ,  -5 POLE @      .05000 HZ",
            *lines_of([f"{sample:16.7E}" for sample in samples], 5),
        ]
    )


def csmip_head(label: str, number: int, azimuth: int, v2: bool) -> tuple[list[str], list[str]]:
    """Return the lines of text and of numbers in the header of a channel.

    The peak of the first is 0.0791795 g, or 77.28 cm/s2; those of the others are smaller.
    """
    raw, peak = 0.0791795 / number, 77.28 / number
    largest = f"Max  = {raw:6.3f} g , at  30.590 sec.".replace(" 0.", "  .")
    integers = {27: azimuth, 28: 13200, 32: 360, 33: 13200, 24: 2012}
    reals = {1: 0.0108814, 2: 0.67, 3: 66.0, 7: raw, 8: 30.59}
    uncorrected = "Uncorrected Accelerogram Data             Processed: 02/13/12, CGS  146be002"
    station = [
        "Record of Mon Feb 13, 2012 13:06:45.0 PST             (Avol1 v9.2,12/11 CSMIP)",
        "CSMIP Preliminary Processing            (Origin:  To be determined)",
        "89146-L2500-12044.02                 Start time:  2/13/12, 21:06:45.0 UTC (GPS)",
        "Station No. 89146   40.941N, 123.633W      Etna  s/n 2500  (3 Chns of  3 at Sta)",
        "Somewhere                                 CGS",
        f"Chan  {number}: {label:<8}",
        "Record of Mon Feb 13, 2012 13:06:45.0 PST    Mon Feb 13, 2012 13:06:45.0 PST",
        "Hypocenter:  To be determined.               ML:  To be determined.",
        "Instr Period =  .0109 sec,  Damping =  .670,  Sensitivity =  .63  v/g",
    ]
    if v2:
        integers |= {53: 12000, 64: 12000, 66: 12000}
        reals |= {53: 0.005, 54: 60.0, 61: 0.005, 60: 60.0, 65: 30.585, 66: peak}
        text = [
            "Corrected accelerogram   89146-L2500-12044.02       "
            f"Chan  {number}: {label:<8}    from",
            uncorrected,
            *station,
            "                        Record length = 60.000 sec.",
            f"                                     Uncor {largest}",
            "RMS accel of (uncor) record  =        .   Chn. metadata effective date: 08/10/05",
            "Accelerogram bandpass filtered with 3 dB pts at   .30 and 40.00 cyc/sec",
            " 12000 points of instrument- and baseline-corrected accel, veloc and displ data",
            "At equally-spaced intervals of    .005  sec.",
            f"Peak acceleration = {peak:9.3f}    cm/sec/sec  at   30.585   sec.",
            "Peak   velocity   =     3.150      cm/sec    at   30.650   sec.",
            "Peak displacement =      .165        cm      at   30.765   sec.",
            "Initial velocity  =      .000   cm/sec;   Initial displacement =     .000   cm",
            *["Record of Mon Feb 13, 2012 13:06:45.0 PST"] * 4,
        ]
    else:
        text = [
            uncorrected,
            *station,
            "No. of Points =  13200  Record Length = 66.000 sec   at 200 Samples/sec",
            f"Units of uncor data are sec and g .        {largest}",
            "RMS calc for complete record =        .   Chn. metadata effective date: 08/10/05",
        ]
    numbers = lines_of(fields(100, 5, "d", integers), 16)
    return text, [*numbers, *lines_of(fields(100 if v2 else 50, 10, ".7f", reals), 8)]


def csmip(channels: Sequence[tuple[str, int]], v2: bool) -> bytes:
    lines: list[str] = []
    for number, (label, azimuth) in enumerate(channels, 1):
        lines += [line for part in csmip_head(label, number, azimuth, v2) for line in part]
        if v2:
            samples = motion(12000, 77.28 / number, 6117, 6)
            for kind in ("accel", "veloc", "displ"):
                unit = {"accel": "cm/sec2", "veloc": "cm/sec", "displ": "cm"}[kind]
                head = f" 12000 points of {kind} data equally spaced at  .005 sec, in {unit}."
                lines += [f"{head} (8f10.6)", *lines_of([f"{x:10.6f}" for x in samples], 8)]
        else:
            samples = motion(13200, 0.07918 / number, 6118, 6)
            head = " 13200 Accelerogram points at 200 pts/sec in units of g .      Format: (8f9.6)"
            lines += [head, *lines_of([f"{x:9.6f}" for x in samples], 8)]
        lines.append(f"/&  ----------  End of Data for Chan  {number}  ----------")
    return joined(lines)


CHANNELS = (("360 Deg", 360), (" Up", 500), (" 90 Deg", 90))


def v0() -> bytes:
    counts = motion(20000, 985881.0, 9058, 0)
    reals = {22: 0.794729, 23: 13.4, 34: 0.005, 42: 1.2, 43: 4.116, 44: 3.43, 63: 100.0}
    lines = cosmos_channel(
        counts.tolist(),
        stage=0,
        units="counts (50)",
        integers={35: 24, 36: 24},
        reals=reals | {65: 45.29, 64: 985881.0},
    )
    texts = ["Processed:" if line.startswith("Processed:") else line for line in lines]
    return joined(texts, "\n").replace(b"Location:", b"Location:Ground")


def v2c() -> bytes:
    samples = motion(42000, -6.852, 15243, 6)
    reals = {54: 0.03, 57: 20.0, 63: 210.0, 64: -6.852, 65: 76.215}
    lines = cosmos_channel(samples.tolist(), reals=reals)
    lines[9] = "Raw record length = 210.000 sec, Uncor max =    101730, at  82.680 sec."
    head = next(k for k, line in enumerate(lines) if "pts, approx" in line)
    rows = [f"{sample:15.6e}" for sample in samples]
    return joined([*lines[:head], lines[head].replace("8F10.3", "1E15.6"), *rows, lines[-1]], "\n")


def fortran(value: float) -> str:
    """Return a number in Fortran's E15.7, with the point before the first digit."""
    mantissa, _, exponent = f"{value:.6E}".partition("E")
    return f"{float(mantissa) / 10.0:.7f}E{int(exponent) + 1:+03d}".rjust(15)


def smc() -> bytes:
    samples = motion(7183, -222.5194, 1510, 4)
    integers = dict.fromkeys(range(1, 49), -32768) | {2: 1989, 13: 90, 14: 133, 16: 1, 17: 7183}
    reals = dict.fromkeys(range(1, 51), 1.7e38)
    reals |= {2: 200.0, 6: 7.1, 17: 63.0, 31: 7.55, 32: -222.5194}
    cells = [f"{sample:.4E}".replace("E-0", "E-").replace("E+0", "E+") for sample in samples]
    return joined(
        [
            "2 CORRECTED ACCELEROGRAM",
            "*",
            "A020A",
            "     1989  10  18    0004 Somewhere, CA",
            "Moment Mag=      7.1 Ms=      7.1 Ml=      7.0",
            "station = Array #2                       component=    133",
            "epicentral dist =     63.0       pk     =   -222.5",
            "inst type=SMA-1      data source = USGS",
            *["*"] * 3,
            *lines_of([f"{integers[k]:10d}" for k in range(1, 49)], 8),
            *lines_of([fortran(reals[k]) for k in range(1, 51)], 5),
            "|",
            *lines_of([cell.rjust(10) for cell in cells], 8),
        ]
    )


def knet_heading(rate: int, seconds: float, direction: str, scale: str, peak: str) -> list[str]:
    """Return the heading of a K-NET file, with its last line."""
    return [
        "Origin Time       2008/06/14 08:43:00",
        "Lat.              39.028",
        "Long.             140.880",
        "Depth. (km)       8",
        "Mag.              7.2",
        "Station Code      AOM017",
        "Station Lat.      40.6363",
        "Station Long.     139.9284",
        "Station Height(m) 42",
        "Record Time       2008/06/14 08:44:18",
        f"Sampling Freq(Hz) {rate}Hz",
        f"Duration Time(s)  {seconds:g}",
        f"Dir.              {direction}",
        f"Scale Factor      {scale}",
        f"Max. Acc. (gal)   {peak}",
        "Last Correction   2008/06/14 08:44:03",
        "Memo.             ",
    ]


def knet() -> bytes:
    """The peak is stated without the offset, which is the mean of all samples."""
    counts = motion(11500, 1000.0, 3000, 0)
    above, rest = 16.452 * 6182761 / 3920, counts.sum() - counts[3000]
    counts[3000] = np.round((above + rest / counts.size) / (1.0 - 1.0 / counts.size))
    return joined(
        [
            *knet_heading(100, 115, "E-W", "3920(gal)/6182761", "16.452"),
            *lines_of([f"{count - 8100:8.0f} " for count in counts], 8),
        ],
        "\n",
    )


def esm() -> bytes:
    samples = motion(19128, 0.300022, 4134, 6)
    facts = {
        **{"EVENT_NAME": "SOMEWHERE", "EVENT_ID": "E-1", "MAGNITUDE_W": "", "MAGNITUDE_L": "4.6"},
        **{"NETWORK": "HI", "STATION_CODE": "ARS1", "EPICENTRAL_DISTANCE_KM": "88.1"},
        "DATE_TIME_FIRST_SAMPLE_YYYYMMDD_HHMMSS": "20190728_160919.870",
        **{"SAMPLING_INTERVAL_S": "0.005000", "NDATA": "19128", "DURATION_S": "95.640"},
        **{"STREAM": "HNE", "UNITS": "cm/s^2", "PGA_CM/S^2": "0.300022"},
        **{"TIME_PGA_S": "20.670000", "BASELINE_CORRECTION": "BASELINE REMOVED"},
        **{"LOW_CUT_FREQUENCY_HZ": "0.100", "HIGH_CUT_FREQUENCY_HZ": "30.000"},
        **{"HEADER_FORMAT": "DYNA 1.2", "DATA_TYPE": "ACCELERATION", "PROCESSING": "manual"},
    }
    rows = [f"{sample:.6f}" for sample in samples]
    return joined([*(f"{key}: {value}" for key, value in facts.items()), "USER1: ", *rows], "\n")


def geonet() -> bytes:
    """The samples begin 5 s before the time to which that of the peak refers."""
    lines: list[str] = []
    for name, bearing in (("S16W", 196), ("S74E", 106), ("Up", 0)):
        samples = tuple(motion(5800, -41.6, 2434, 1).tolist())
        component = geonet_component(name, samples, "C", 0, bearing)
        component[19] = f"{21200:8d}{250:8d}{250:8d}{component[19][24:]}"
        lines += component
    text = "\n".join(lines).replace("48.68 sec", "43.68 sec")
    return joined(text.split("\n"), "\n")


def afad() -> bytes:
    peaks = ((13.200332, 9000), (-12.163827, 9100), (9.840572, 9200))
    columns = [motion(28683, peak, place, 6) for peak, place in peaks]
    return afad_of(tuple(zip(*(column.tolist() for column in columns), strict=True))).encode(
        "latin-1"
    )


#: How each file is made, by its name among the shared files.
IMITATIONS: dict[str, Callable[[], bytes]] = {
    "peer_at2/IMPVALL_E04-140_example1.AT2": at2,
    "csmip/CE89146.V1": lambda: csmip(CHANNELS, v2=False),
    "csmip/CE89146.V2": lambda: csmip(CHANNELS, v2=True),
    "cosmos/NP1795-n.305.v0c": v0,
    "cosmos/us1000hyfh_akbmrp_AKBMR--n.1000hyfh.BNZ.--.acc.V2c": v2c,
    "smc/np01002p_4225a_a.smc": smc,
    "knet/AOM0170806140843.EW": knet,
    "esm/HI.ARS1..HNE.D.20190728.160908.C.ACC.ASC": esm,
    "geonet/20180212_211557_WPWS_20.V2A": geonet,
    "afad/20170720223109_0921.txt": afad,
}


@cache
def imitation(file: str) -> bytes:
    """Return the imitation of a shared file."""
    return IMITATIONS[file]()


def content(file: str) -> bytes:
    """Return the shared file of this name, else its imitation; skip if there is none."""
    shared = ROOT.parent / "shared" / "records" / "formats" / file
    if shared.is_file():
        return shared.read_bytes()
    if file not in IMITATIONS:
        pytest.skip("no folder 'shared/records' beside the repository")
    return imitation(file)


def records_of(file: str) -> list[Record]:
    """Return the records of a file of `content`, with what lies beside it."""
    shared = ROOT.parent / "shared" / "records" / "formats" / file
    return read_file(shared) if shared.is_file() else read_bytes(Path(file), content(file))


#: The components NS, EW, UD of the layouts below [g], 2500 samples at 0.01 s.
NS, EW, UD = (
    motion(2500, peak, place, 6) for peak, place in ((0.4704, 2248), (0.5636, 2137), (0.3612, 2000))
)
TIMES: Float = np.arange(2500) / 100.0


def table(columns: Sequence[Float], between: str, form: str = ".6f", end: str = "") -> list[str]:
    rows = zip(*columns, strict=True)
    return [between.join(f"{value:{form}}" for value in row) + end for row in rows]


def clock(time: float) -> str:
    minutes, seconds = divmod(19 * 60 + 53 + time, 60)
    return f"03:{int(minutes):02d}:{seconds:09.6f}"


def knet_csv() -> bytes:
    """A K-NET CSV of three components with offsets, which end at -11.28 gal."""
    columns = [
        100.0 * motion(11500, peak, 3000, 4) + offset
        for peak, offset in ((0.20, -11.72), (0.16, -5.26), (-0.07, -11.28))
    ]
    columns[1][1] = -5.13
    columns[2][-41:-1] = -11.20 - 0.01 * (np.arange(40) % 12)
    head = [
        *("#K-NET CSV", "#Event", "#OriginTime,Latitude,Longitude,Depth(km),Magnitude"),
        *("#2008/06/14 08:43:00,39.028,140.880,8,7.2", "#Station"),
        *("#Code,Latitude,Longitude,Height(m)", "#AOM017,40.6363,139.9284,42", "#Record"),
        *("#SamplingFrequency(Hz)", "#100", "#DurationTime(s)", "#115"),
        *("#Offset", "#N-S(gal),E-W(gal),U-D(gal)", "#-11.72,-5.26,-11.28"),
        "#Time,RelativeTime(s),N-S(gal),E-W(gal),U-D(gal)",
    ]
    seconds: Float = np.arange(11500) / 100.0
    rows = table([seconds, *columns], ",", ".2f")
    start = 8 * 3600 + 44 * 60 + 3
    stamps = (divmod(start + 0.01 * k, 60) for k in range(11500))
    times = (f"{int(m) // 60:02d}:{int(m) % 60:02d}:{s:05.2f}" for m, s in stamps)
    lines = [f"2008/06/14 {time},{row}" for time, row in zip(times, rows, strict=True)]
    return joined([*head, *lines], "\n")


def jma_csv() -> bytes:
    head = [
        *("SITE CODE=  47662東京,,", " LAT.=  35.69,,", " LON.= 139.76,,"),
        *("SAMPLING RATE= 100Hz,,", "UNIT  = gal(cm/s/s),,"),
        *("INITIAL TIME = 2011 03 11 14 46 40,,", "NS,EW,UD"),
    ]
    rows = table([981.0 * part for part in (NS, EW, UD)], ",", ".3f")
    return "\n".join([*head, *rows[:-1], "125.333,51.678,42.112", ""]).encode("shift_jis")


#: Tables in layouts that people of this field hold.
LAYOUTS: dict[str, Callable[[], list[str]]] = {
    "01_eight_channels.csv": lambda: table([(1.0 + 0.1 * k) * EW for k in range(8)], ","),
    "01_pairs4_gal.th": lambda: lines_of(
        [f"{t:10.4f}{x:10.4f}" for t, x in zip(TIMES, 981.0 * EW, strict=True)], 4
    ),
    "02_savetxt_header.txt": lambda: ["# time_s NS_g EW_g", *table([TIMES, NS, EW], " ")],
    "03_two_components.txt": lambda: table([NS, EW], " "),
    "04_values5perline.txt": lambda: lines_of([f"{x:14.6e}" for x in EW], 5),
    "05_clock_time.csv": lambda: [
        "time,acc_g",
        *(f"{clock(t)},{x:.6f}" for t, x in zip(TIMES, EW, strict=True)),
    ],
    "06_pandas_index.csv": lambda: [
        ",time_s,acc_g",
        *(f"{k},{t:.2f},{x:.6f}" for k, (t, x) in enumerate(zip(TIMES, EW, strict=True))),
    ],
    "06_trailing_comma.csv": lambda: ["time_s,acc_g", *table([TIMES, EW], ",", end=",")],
    "07_deepsoil.txt": lambda: ["2500 0.010", *table([TIMES, EW], " ")],
    "07_names_then_units.csv": lambda: [
        *("Time,NS,EW,UD", "s,g,g,g"),
        *table([TIMES, NS, EW, UD], ","),
    ],
    "07_nees.txt": lambda: [
        *("Active channels: Time, ACC01, ACC02", "Sample rate: 100", "Channel units: sec,g,g"),
        *("", "Time\tACC01\tACC02", *table([TIMES, NS, EW], "\t")),
    ],
    "09_h1h2v.csv": lambda: ["time_s,H1,H2,V", *table([TIMES, EW, NS, UD], ",")],
    "09_mg.csv": lambda: [
        "Time (s),Acceleration (mg)",
        *table([TIMES, 1000.0 * EW], ",", ".3f"),
    ],
}


def layout(name: str) -> bytes:
    """Return a table in a layout."""
    return joined(LAYOUTS[name](), "\n")
