"""Good files, damaged copies of them, and the expected outcome of reading each copy."""

from __future__ import annotations

import gzip
import io
import pickle
import re
import zipfile
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Case:
    """A damaged file and the words of its rejection; no words if it must read as the good one."""

    damage: str
    name: str
    data: bytes
    words: str = ""


def numbers(count: int) -> list[str]:
    """Return samples as PEER prints them."""
    samples = np.random.default_rng(7).normal(0.0, 0.1, count)
    return [f"{sample:.7E}" for sample in samples]


def good_at2() -> bytes:
    """Return a PEER file of 203 samples, five a line, the last line short."""
    values = numbers(203)
    rows = ["".join(f"{v:>16}" for v in values[i : i + 5]) for i in range(0, 203, 5)]
    header = [
        "PEER NGA STRONG MOTION DATABASE RECORD",
        "Somewhere, 1/2/2003, Station, 090",
        "ACCELERATION TIME SERIES IN UNITS OF G",
        "NPTS=    203, DT=   .0050 SEC",
    ]
    return "\n".join([*header, *rows, ""]).encode()


def good_table() -> bytes:
    """Return a table of 203 rows of time and acceleration, with their number in a comment."""
    rows = [f"{0.005 * i:.3f},{value}" for i, value in enumerate(numbers(203))]
    return "\n".join(["# npts: 203", "time_s,acc_g", *rows, ""]).encode()


def zipped(name: str, data: bytes) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(name, data)
    return stream.getvalue()


def bomb() -> bytes:
    """Return a gzip file that expands to one gigabyte: the same member 64 times."""
    return gzip.compress(bytes(1 << 24), mtime=0) * 64


def without_line(data: bytes, number: int) -> bytes:
    lines = data.split(b"\n")
    return b"\n".join(lines[: number - 1] + lines[number:])


def edited(data: bytes, number: int, old: bytes, new: bytes) -> bytes:
    """Replace the first `old` in a line, which must contain it."""
    lines = data.split(b"\n")
    assert old in lines[number - 1], lines[number - 1]
    lines[number - 1] = lines[number - 1].replace(old, new, 1)
    return b"\n".join(lines)


def token_of(data: bytes, number: int) -> bytes:
    """Return the last number of a line."""
    return re.split(rb"[,\s]+", data.split(b"\n")[number - 1].strip())[-1]


def with_token(data: bytes, number: int, new: bytes) -> bytes:
    return edited(data, number, token_of(data, number), new)


def dressed(kind: str, data: bytes) -> list[Case]:
    """Return copies with the damage that can happen to any text file."""
    name = f"good.{kind}"
    lf = data.replace(b"\r\n", b"\n")
    text = lf.decode("ascii")
    return [
        Case("lf", name, lf),
        Case("cr-lf", name, lf.replace(b"\n", b"\r\n")),
        Case("cr-cr-lf", name, lf.replace(b"\n", b"\r\r\n")),
        Case("cr alone", name, lf.replace(b"\n", b"\r")),
        Case("byte order mark", name, b"\xef\xbb\xbf" + data),
        Case("utf-16", name, text.encode("utf-16"), "text in UTF-16"),
        Case("utf-16 unmarked", name, text.encode("utf-16-le"), "unknown format"),
        Case("zero bytes", name, b"", "empty file"),
        Case("nothing but NUL", name, bytes(len(data)), "unknown format"),
        Case("NUL late in the text", name, data[:5000] + b"\0" + data[5000:], "NUL byte|unknown"),
        Case("blank lines at the end", name, data + b"\n \n\n"),
        Case("no last line end", name, data.rstrip()),
        Case("DOS end of file", name, data + b"\x1a"),
        Case("twice in one file", name, data + data, "in the file|in the header|Must be"),
        Case("half of it", name, data[: len(data) // 2], "in the file|of data|Must be"),
        Case(
            "a page of the web", name, b"<!DOCTYPE html>\n<html>Log in</html>\n", "unknown format"
        ),
        Case("a pickle", name, pickle.dumps({"NPTS": 3, "DT": 0.01}), "unknown format"),
        Case("in a gzip", name + ".gz", gzip.compress(data)),
        Case("in a gzip cut short", name + ".gz", gzip.compress(data)[:-20], "corrupted gzip"),
        Case("in a ZIP", f"good {kind}.zip", zipped(name, data)),
        Case("in a ZIP, climbing", "a.zip", zipped(f"../{name}", data), "a path out of the folder"),
        Case(
            "in ZIPs three deep",
            "a.zip",
            zipped("c", zipped("b", zipped(name, data))),
            "archive in an archive",
        ),
        Case("blanks and brackets", f"good [1] (a).{kind}", data),
    ]


def at2_cases() -> list[Case]:
    """Return damaged PEER files. The function is long because it is a table."""
    good = good_at2()

    def size(old: bytes, new: bytes) -> bytes:
        return edited(good, 4, old, new)

    def token(new: bytes) -> bytes:
        return with_token(good, 9, new)

    own = [
        ("cut within the last exponent", good[:-2], "ends within"),
        ("cut within the last digits", good[:-7], "ends within"),
        ("cut after the last E", good[:-4], "acceleration"),
        ("cut before the last number", good[:-17], "NPTS 203 in the header, 202"),
        ("a line lost", without_line(good, 20), "NPTS 203 in the header, 198"),
        ("a line doubled", edited(good, 9, good.split(b"\n")[8], good.split(b"\n")[8] * 2), "208"),
        ("title line lost", without_line(good, 2), ""),
        ("units line lost", without_line(good, 3), "acceleration units unstated"),
        ("line of NPTS lost", without_line(good, 4), "no NPTS and DT"),
        ("NPTS one more", size(b"203", b"204"), "NPTS 204 in the header, 203 samples"),
        ("NPTS one less", size(b"203", b"202"), "NPTS 202 in the header, 203 samples"),
        ("NPTS zero", size(b"203", b"000"), "NPTS '000'"),
        ("NPTS negative", size(b"203", b"-203"), "NPTS '-203'"),
        ("NPTS in exponent form", size(b"203", b"2.03E2"), "NPTS '2.03E2'"),
        ("NPTS in words", size(b"203", b"many"), "NPTS 'many'"),
        ("DT in exponent form", size(b".0050", b"5.0000E-03"), ""),
        ("DT in Fortran's D form", size(b".0050", b"5.0D-03"), ""),
        ("DT zero", size(b".0050", b"0.0"), "time step '0.0' s"),
        ("DT negative", size(b".0050", b"-.005"), "time step '-.005' s"),
        ("DT no number", size(b".0050", b"NaN"), "time step 'NaN' s"),
        ("DT in milliseconds", size(b".0050 SEC", b"5.0 MSEC"), "DT in units of 'MSEC'"),
        ("DT lost", size(b".0050 SEC", b""), "time step '' s"),
        ("counts", edited(good, 3, b"OF G", b"OF COUNTS"), "acceleration units 'COUNTS'"),
        ("velocity", edited(good, 3, b"ACCELERATION", b"VELOCITY"), "is a velocity time series"),
        ("NaN", token(b"NaN"), "9: acceleration 'NaN'"),
        ("infinite", token(b"-inf"), "9: acceleration '-inf'"),
        ("out of range", token(b"1E999"), "9: acceleration '1E999'"),
        ("stars of Fortran", token(b"*******"), r"9: acceleration '\*{7}'"),
        ("letter O", token(b"O.1E-01"), "9: acceleration 'O.1E-01'"),
        ("underscore", token(b"1_0"), "9: acceleration '1_0'"),
        ("exponent without E", token(b".1234-101"), "9: acceleration '.1234-101'"),
        ("decimal comma", token(b"0,0123"), "9: acceleration '0,0123'"),
        ("numbers that touch", token(b".123E-01-.2E-01"), "9: acceleration '.123E-01-"),
        ("a blank in a number", token(b"1. 5E-01"), "NPTS 203 in the header, 204"),
        ("words behind", good + b"END OF RECORD\n", "acceleration 'END'"),
        ("tabs for blanks", good.replace(b"  ", b"\t"), ""),
        ("one column", good[: good.index(b"SEC") + 4] + b"\n".join(good.split()[-203:]), ""),
    ]
    return [
        *dressed("AT2", good),
        *(Case(damage, "good.AT2", data, words) for damage, data, words in own),
        Case("expands to 1 GB", "good.AT2.gz", bomb(), "expands to more than"),
    ]


def v1_cases(good: bytes) -> list[Case]:
    row = good.split(b"\n")[40]

    def samples(new: bytes) -> bytes:
        return edited(good, 41, row[9:18], new)

    own = [
        ("a line lost", without_line(good, 100), "10000 samples stated, 9992 in the file"),
        ("a header line lost", without_line(good, 9), "a line such as"),
        ("a title line lost", without_line(good, 1), "unknown format"),
        ("last line lost", good.rstrip()[: good.rstrip().rindex(b"\n") + 1], ""),
        ("a channel lost", good[: good.rindex(b"Uncorrected")], "3 channels in the header, 2"),
        ("column shifted right", edited(good, 41, row[:9], b" " + row[:9]), "73 characters"),
        ("column shifted left", edited(good, 41, row[:9], row[1:9]), "71 characters"),
        ("shifted within the line", edited(good, 41, row[:18], row[1:18] + b" "), ""),
        ("NaN", samples(b"      NaN"), "41: acceleration 'NaN'"),
        ("stars of Fortran", samples(b"*" * 9), "41: acceleration"),
        ("no decimal point", samples(b"   000026"), "41: acceleration '000026'"),
        ("underscore", samples(b"  .00_026"), "41: acceleration '.00_026'"),
        ("blank column", samples(b" " * 9), "41: acceleration ''"),
        ("count one more", edited(good, 28, b"10000", b"10001"), "10001 samples stated, but 10000"),
        ("count in words", edited(good, 11, b"10000", b" 9999"), "but 9999 in 'No. of Points'"),
        ("other rate", edited(good, 28, b"100 pts", b"200 pts"), "200 samples a second stated"),
        ("rate zero", edited(good, 28, b"at 100 pts", b"at 000 pts"), "'000' samples a second"),
        ("other units", edited(good, 28, b"units of g.", b"units of cm."), "units 'cm'"),
        ("no units", edited(good, 28, b"in units of g.", b"              "), "a line such as"),
        (
            "other columns",
            edited(good, 28, b"8f9.6", b"8f8.6"),
            "72 characters of samples. Must be 64",
        ),
    ]
    return [
        *dressed("V1", good),
        *(Case(damage, "good.V1", data, words) for damage, data, words in own),
    ]


def table_cases() -> list[Case]:
    good = good_table()
    bare = good.replace(b"# npts: 203\n", b"")
    own = [
        ("cut within the last exponent", good[:-2], "ends within"),
        ("cut within the last digits", good[:-7], "ends within"),
        ("cut after the last comma", good[:-16], "Must be 2|acceleration"),
        ("a row lost", without_line(bare, 50), "49 s after|Must be 0.2"),
        ("last row lost", good[: good.rstrip().rindex(b"\n") + 1], "npts 203 in the comment, 202"),
        ("a row doubled", edited(bare, 50, b"0.240", b"0.235"), "Must increase"),
        ("times in exponent form", re.sub(rb"(?m)^(\d\.\d{3}),", rb"\1E+00,", good), ""),
        ("NaN", with_token(good, 60, b"nan"), "60: acceleration 'nan'"),
        ("time NaN", edited(good, 60, b"0.285", b"nan"), "60: time 'nan'"),
        ("empty field", with_token(good, 60, b""), "60: acceleration ''"),
        ("a third column", with_token(good, 60, b"1,2"), "60: 3 columns"),
        ("no column names", without_line(good, 2), "units unstated"),
        ("units unstated", edited(good, 2, b"acc_g", b"acc"), "units unstated"),
        ("unknown units", edited(good, 2, b"acc_g", b"acc_km_s2"), "Must be"),
        (
            "velocity",
            edited(good, 2, b"acc_g", b"vel_m_s"),
            "unknown format|Must be|not an acceleration",
        ),
        ("semicolons", good.replace(b",", b";"), ""),
        ("decimal commas and tabs", good.replace(b",", b"\t").replace(b".", b","), ""),
        ("decimal commas", good.replace(b".", b","), "If commas are decimal commas"),
        ("blanks for commas", good.replace(b",", b" ").replace(b"s acc", b"s,acc"), ""),
        ("columns exchanged", edited(good, 2, b"time_s,acc_g", b"acc_g,time_s"), "Must"),
        ("npts one more", edited(good, 1, b"203", b"204"), "npts 204 in the comment, 203 rows"),
        ("one row", b"time_s,acc_g\n0.0,0.1\n", "1 row of numbers"),
        ("time still", b"time_s,acc_g\n0.0,0.1\n0.0,0.2\n", "Must increase"),
    ]
    return [
        *dressed("csv", good),
        *(Case(damage, "good.csv", data, words) for damage, data, words in own),
    ]
