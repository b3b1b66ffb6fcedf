from __future__ import annotations

import hashlib
import pickle
from collections.abc import Callable
from pathlib import Path

import pytest

from rockframe.errors import InputError
from rockframe.ingest import (
    FORMATS,
    ReadOptions,
    containers,
    read_bytes,
    read_file,
    registry,
    sniff_format,
)
from rockframe.ingest.identify import direction, record_ids
from rockframe.record import Orientation, is_record_id


def test_provenance(tmp_path: Path, at2: Callable[..., bytes]) -> None:
    path = tmp_path / "RSN77 PUL[164].AT2"
    path.write_bytes(at2())
    [record] = read_file(path)
    assert record.record_id == "RSN77_PUL_164_"
    assert (record.source_file, record.source_format) == (path.name, "peer_at2")
    assert record.source_sha256 == hashlib.sha256(at2()).hexdigest()


def test_missing(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"lost\.AT2: no such file\."):
        read_file(tmp_path / "lost.AT2")


def test_folder(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"not a regular file\."):
        read_file(tmp_path)


def test_empty(tmp_path: Path) -> None:
    (tmp_path / "none.AT2").touch()
    with pytest.raises(InputError, match=r"none\.AT2: empty file\."):
        read_file(tmp_path / "none.AT2")


def test_too_large(tmp_path: Path) -> None:
    with (tmp_path / "huge.AT2").open("wb") as stream:
        stream.truncate(containers.LARGEST + 1)
    with pytest.raises(InputError, match=r"256000001 bytes\. Must be at most 256000000"):
        read_file(tmp_path / "huge.AT2")


def test_unknown_format() -> None:
    with pytest.raises(
        InputError, match=r"unknown format, begins '# Records'\. `rockframe formats` lists"
    ):
        read_bytes("README.md", b"# Records\nSix of them.\n")


@pytest.mark.parametrize(
    ("text", "line", "cell"),
    [
        (
            "time,acc_g\n07/06/2019 03:19:53.01,0.1\n07/06/2019 03:19:53.02,0.2\n",
            2,
            "07/06/2019 03",
        ),
        ("time,acc_g\n03:19:53.01 PM,0.1\n03:19:53.02 PM,0.2\n", 2, "03:19:53.01 PM"),
        ("time;acc_g\n03:19:53,01 JST;0,1\n", 2, "03:19:53.01 JST"),
        ("station,latitude\nCLC,35.8\nTOW2,35.8\n", 2, "CLC"),
        ("# Records\n\nSix of them.\n", 3, "Six"),
    ],
)
def test_a_text_of_no_format_has_the_cell_that_is_no_number(
    text: str, line: int, cell: str
) -> None:
    with pytest.raises(InputError, match=rf"unknown format, .*'{cell}.*' in line {line} is no num"):
        read_bytes("a.csv", text.encode())


def test_a_pickle_is_not_opened() -> None:
    with pytest.raises(InputError, match="unknown format: a pickle of Python"):
        read_bytes("evil.AT2", pickle.dumps({"NPTS": 3}))


def test_several_claims(monkeypatch: pytest.MonkeyPatch) -> None:
    text_format = next(known for known in FORMATS if known.name == "acceleration_text")
    monkeypatch.setattr(registry, "FORMATS", (text_format, text_format))
    with pytest.raises(InputError, match="ambiguous format: acceleration_text, acceleration_text"):
        sniff_format(b"0.1\n0.2\n")


@pytest.mark.parametrize(
    "first",
    [
        "CORRECTED ACCELEROGRAM IIA001 COMP S00E FILE 1",
        "IIC048  71.019.0",
        "OF UNCORRECTED ACCELEROGRAM DATA OF VOL. I",
    ],
)
def test_tapes_of_unknown_layout_are_named(first: str) -> None:
    words = r"is a Caltech/USC tape in a layout .*Use a copy of the record in another format"
    with pytest.raises(InputError, match=words) as caught:
        sniff_format(f"{first}\nIMPERIAL VALLEY EARTHQUAKE\nMAY 18, 1940\n  1  2  3\n".encode())
    assert "\n" not in str(caught.value)


def test_names_are_unique() -> None:
    assert len({known.name for known in FORMATS}) == len(FORMATS)
    named = [known.obspy_name for known in FORMATS if known.obspy_name]
    assert len({*named}) == len(named)


@pytest.mark.parametrize(
    "stem", ["x" * 200, "...", "äöü", "-a", "a b", "_", "Αθήνα 1", "दिल्ली", "𠮷" * 64]
)
@pytest.mark.parametrize("components", [[""], ["090", "UP"], ["", ""], ["N" * 20, "n" * 20]])
def test_identifiers_are_sound_and_differ(stem: str, components: list[str]) -> None:
    ids = record_ids(Path(stem + ".V1"), components)
    assert all(is_record_id(record_id) for record_id in ids)
    # File names of figures contain the identifier, and a file name has at most 255 bytes.
    assert all(len(record_id.encode()) <= 192 for record_id in ids)
    assert len({record_id.casefold() for record_id in ids}) == len(components)


@pytest.mark.parametrize(
    ("name", "record_id"),
    [
        ("Αθήνα 1.csv", "Αθήνα_1"),
        ("Αθήνα.csv", "Αθήνα"),
        ("Erzincan İstasyonu.csv", "Erzincan_İstasyonu"),
        ("神戸 NS.AT2", "神戸_NS"),
        ("दिल्ली.csv", "दिल्ली"),
        ("Pe\u0301rou.csv", "P\xe9rou"),  # as macOS writes it
        ("x² (½).csv", "x_____"),
        ("bidi\u202e.csv", "bidi_"),
        ("broken\udc80.csv", "broken_"),
    ],
)
def test_letters_of_any_script_stay(name: str, record_id: str) -> None:
    assert record_ids(Path(name), [""]) == [record_id]


@pytest.mark.parametrize(
    ("component", "azimuth"),
    [("0", 0), ("090", 90), ("360", 360), ("EW", 90), ("N-S", 0), ("W", 270), ("S74E", 106),
     ("N21W", 339), ("S16W", 196), ("N90E", 90)],
)  # fmt: skip
def test_horizontal(component: str, azimuth: float) -> None:
    assert direction(component) == (Orientation.HORIZONTAL, azimuth)


@pytest.mark.parametrize("component", ["UP", "Up", "V", "VERT", "Z", "-UP", "U-D"])
def test_vertical(component: str) -> None:
    assert direction(component)[0] is Orientation.VERTICAL


@pytest.mark.parametrize("component", ["DWN", "DN", "Down"])
def test_a_name_says_which_way_is_positive(component: str) -> None:
    assert direction(component)[0] is Orientation.DOWNWARD


@pytest.mark.parametrize("component", ["", "361", "L", "H1", "FN", "N95E", "500"])
def test_unstated(component: str) -> None:
    assert direction(component)[0] is Orientation.UNSTATED


@pytest.mark.parametrize(
    ("head", "words"),
    [
        (
            b'<?xml version="1.0"?>\n<FDSNStationXML xmlns="a">',
            "StationXML. Put it beside its records",
        ),
        (b'<?xml version="1.0"?>\n<q:quakeml xmlns:q="a">', "QuakeML. Put it beside the records"),
        (b"<html><body>Not found</body></html>", "XML or HTML. Must be a record"),
        (b'{"dt": 0.01, "record": [0.1]}', "JSON. Save its samples as CSV"),
        (b"000001V 010008402.4121950,001", "SEED. Put dataless SEED beside its miniSEED"),
        (b"#\t\t<< IRIS SEED Reader >>\nB050F03     Station:     ANMO\n", "RESP. Put it beside"),
        (b"\x93NUMPY\x01\x00v\x00", "an array of NumPy. Save it as text by numpy.savetxt"),
        (b"\x80\x04\x95\x86\x00", "a pickle of Python. Save its samples as text"),
        (
            b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1",
            "a former Office file. Save the sheet as .xlsx or CSV",
        ),
        (b"%PDF-1.4\n", "a picture or PDF. Must be a record"),
        (b"SQLite format 3\x00", "a database. Export the record as CSV"),
        (b"RIFF\x00\x00\x00\x00WAVEfmt ", "sound. Save its samples as text"),
    ],
)
def test_files_that_are_no_records_are_named(head: bytes, words: str) -> None:
    """A download that failed is HTML, and programs save records in files that are not read."""
    with pytest.raises(InputError) as error:
        read_bytes("a.dat", head)
    assert f"unknown format: {words}" in str(error.value)


def test_a_table_in_brackets_or_with_a_comment_is_no_other_file() -> None:
    """Only what no program of records writes is named: the comment of RESP has its blockettes."""
    text = b"# B050F03 is not at the start of a line\n" + b"0.1 -0.2\n" * 9
    records = read_bytes("a.txt", text, ReadOptions(units="g", time_step=0.01, column="1"))
    assert records[0].acceleration.size == 9
