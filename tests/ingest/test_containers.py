from __future__ import annotations

import bz2
import csv
import gzip
import io
import lzma
import re
import stat
import tarfile
import tracemalloc
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
from tests.commands import run

from rockframe.errors import InputError
from rockframe.ingest import ReadOptions, collect, containers, read_file, sorted_out
from rockframe.ingest.containers import contents, printable
from rockframe.ingest.files import read_outcomes
from rockframe.outcome import InputOutcome

TABLE = b"time_s,acc_g\n0.00,0.1\n0.01,0.2\n"
At2 = Callable[..., bytes]


def zipped(*members: tuple[str | zipfile.ZipInfo, bytes], how: int = zipfile.ZIP_DEFLATED) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", how) as archive:
        for member, data in members:
            archive.writestr(member, data)
    return stream.getvalue()


def refusal(*members: tuple[str | zipfile.ZipInfo, bytes]) -> str:
    [member] = contents(Path("a.zip"), zipped(*members))
    assert member.data == b""
    return member.refusal


def test_members_are_records_of_their_own(tmp_path: Path, at2: At2) -> None:
    path = tmp_path / "download (1).zip"
    path.write_bytes(zipped(("RSN77.AT2", at2()), ("notes.dat", b"Words.\n"), ("b.csv", TABLE)))
    records, [rejection] = sorted_out(collect([path]))
    assert [record.record_id for record in records] == ["RSN77", "b"]
    assert [r.source_file for r in records] == [f"{path.name}:RSN77.AT2", f"{path.name}:b.csv"]
    assert rejection.file == "download (1).zip:notes.dat"
    assert "unknown format, begins 'Words.'" in rejection.reason


def test_a_member_reads_as_the_file_does(tmp_path: Path, at2: At2) -> None:
    (tmp_path / "RSN77.AT2").write_bytes(at2())
    (tmp_path / "a.zip").write_bytes(zipped(("RSN77.AT2", at2())))
    (tmp_path / "RSN77.AT2.gz").write_bytes(gzip.compress(at2()))
    plain, *others = (read_file(tmp_path / n)[0] for n in ("RSN77.AT2", "a.zip", "RSN77.AT2.gz"))
    for other in others:
        assert other.record_id == plain.record_id
        assert other.source_sha256 == plain.source_sha256
        assert other.acceleration.tobytes() == plain.acceleration.tobytes()


def test_error_names_archive_member_and_line(tmp_path: Path, at2: At2) -> None:
    (tmp_path / "a.zip").write_bytes(zipped(("x.AT2", at2(["nan", "1", "2"]))))
    with pytest.raises(InputError, match=r"a\.zip:x\.AT2:5: acceleration 'nan'"):
        read_file(tmp_path / "a.zip")


def test_shared_archive(shared_records: Path) -> None:
    path = shared_records / "formats" / "csmip" / "ce14196p.zip"
    assert [(member.name, len(member.data)) for member in contents(path, path.read_bytes())] == [
        ("ce14196p.zip:INGLEWOO.V2", 194304),
        ("ce14196p.zip:INGLEWOO.V3", 123776),
    ]


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("../../etc/x.AT2", "a path out of the folder"),
        ("a/../x.AT2", "a path out of the folder"),
        ("..\\x.AT2", "a path out of the folder"),
        ("/etc/x.AT2", "an absolute path"),
        ("C:\\x.AT2", "an absolute path"),
        ("a\\x.AT2", "a path with backslashes"),
        ("folder/", "a folder in the archive"),
    ],
)
def test_names_that_are_paths(name: str, reason: str) -> None:
    assert refusal((name, TABLE)).startswith(reason + ". Must be ")


def test_links_and_devices() -> None:
    for kind, words in ((stat.S_IFLNK, "a link. Must"), (stat.S_IFIFO, "a special file. Must")):
        link = zipfile.ZipInfo("x.AT2")
        link.external_attr = (kind | 0o777) << 16
        assert refusal((link, b"/etc/passwd")).startswith(words)


def test_encrypted() -> None:
    data = bytearray(zipped(("x.csv", TABLE)))
    data[6] |= 1  # the flag is set in the member's own header and in the directory
    data[data.index(b"PK\x01\x02") + 8] |= 1
    [member] = contents(Path("a.zip"), bytes(data))
    assert member.refusal == "encrypted. Must be readable without a password."


def test_other_compression() -> None:
    [member] = contents(Path("a.zip"), zipped(("x.csv", TABLE), how=zipfile.ZIP_LZMA))
    assert member.refusal == "compressed by method 14. Must be stored or deflated."


def tarred(*members: tuple[str | tarfile.TarInfo, bytes], how: str = "w:gz") -> bytes:
    stream = io.BytesIO()
    with tarfile.open(fileobj=stream, mode=how) as archive:  # type: ignore[call-overload]
        for member, data in members:
            info = member if isinstance(member, tarfile.TarInfo) else tarfile.TarInfo(member)
            info.size = len(data) if info.isreg() else 0
            archive.addfile(info, io.BytesIO(data))
    return stream.getvalue()


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("a.zip", zipped(("event/", b""), ("event/x.csv", TABLE))),
        ("a.zip", zipped(("event/b.zip", zipped(("x.csv", TABLE))))),
        ("a.zip", zipped(("b.tar.gz", tarred(("x.csv", TABLE))))),
        ("a.tar", tarred(("event/x.csv", TABLE), how="w:")),
        ("a.tgz", tarred(("event/x.csv", TABLE))),
        ("a.tar.bz2", tarred(("x.csv", TABLE), how="w:bz2")),
        ("a.tar", tarred(("b.tar.gz", tarred(("x.csv.gz", gzip.compress(TABLE)))), how="w:")),
        ("x.csv.bz2", bz2.compress(TABLE)),
    ],
)
def test_archives_as_delivered(name: str, data: bytes) -> None:
    [member] = contents(Path(name), data)
    assert (member.data, member.refusal, member.path.stem) == (TABLE, "", "x")


def test_members_with_one_name_in_different_folders_keep_their_own(tmp_path: Path) -> None:
    other = TABLE.replace(b"0.2", b"0.3")
    (tmp_path / "a.zip").write_bytes(zipped(("p/x.csv", TABLE), ("q/x.csv", other)))
    records, rejections = sorted_out(collect([tmp_path / "a.zip"]))
    assert not rejections
    assert [record.source_file for record in records] == ["a.zip:p/x.csv", "a.zip:q/x.csv"]
    assert [record.record_id for record in records] == ["x", "a.zip-q-x"]


@pytest.mark.parametrize("third", [zipped(("x.csv", TABLE)), tarred(("x.csv", TABLE))])
def test_an_archive_three_deep_is_refused(third: bytes) -> None:
    [member] = contents(Path("a.zip"), zipped(("b.zip", zipped(("c", third)))))
    assert member.refusal == "an archive in an archive is not read. Unpack it first."


@pytest.mark.parametrize(
    ("ending", "data"),
    [
        (".7z", b"7z\xbc\xaf\x27\x1c and more"),
        (".rar", b"Rar!\x1a\x07\x01\0 and more"),
        (".xz", lzma.compress(TABLE)),
        (".lzma", lzma.compress(TABLE, lzma.FORMAT_ALONE)),
        (".zst", b"\x28\xb5\x2f\xfd and more"),
        (".lz4", b"\x04\x22\x4d\x18 and more"),
        (".Z", b"\x1f\x9d\x90 and more"),
    ],
)
def test_other_archives_are_named(ending: str, data: bytes, tmp_path: Path) -> None:
    path = tmp_path / f"a{ending}"
    path.write_bytes(data)
    with pytest.raises(InputError, match=rf"an archive of .*\({ending}\) is not read\. Unpack it"):
        read_file(path)
    [outcome] = read_outcomes(path, ReadOptions())
    assert isinstance(outcome, InputOutcome)
    assert outcome.reason.startswith("an archive of")
    [member] = contents(Path("a.zip"), zipped((f"b{ending}", data)))
    assert member.refusal == outcome.reason


def test_tar_links_devices_and_paths_are_refused() -> None:
    link, device, outside = (tarfile.TarInfo(name) for name in ("a.csv", "b.csv", "../c.csv"))
    link.type, link.linkname, device.type = tarfile.SYMTYPE, "/etc/passwd", tarfile.CHRTYPE
    data = tarred((link, b""), (device, b""), (outside, TABLE))
    reasons = [member.refusal for member in contents(Path("a.tgz"), data)]
    assert [reason.split(".")[0] for reason in reasons] == [
        "a link", "a special file", "a path out of the folder",
    ]  # fmt: skip


@pytest.mark.parametrize("cut", [600, 1024, 1100, 2000, 2048])
def test_tar_cut_short_loses_no_member_silently(cut: int) -> None:
    data = tarred(("x.csv", TABLE), ("y.csv", TABLE), how="w:")
    with pytest.raises(InputError, match=r"corrupted tar|tar archive"):
        list(contents(Path("a.tar"), data[:cut]))


def test_nested_archives_share_one_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    """A ZIP of small ZIPs must not expand to more than one ZIP may."""
    monkeypatch.setattr(containers, "MOST_MEMBERS", 5)
    inner = zipped(("x.csv", TABLE), ("y.csv", TABLE))
    with pytest.raises(InputError, match=r"6 members or more\. Must be at most 5"):
        list(contents(Path("a.zip"), zipped(("b.zip", inner), ("c.zip", inner))))


def test_a_corrupted_inner_archive_costs_only_itself() -> None:
    data = zipped(("b.zip", zipped(("x.csv", TABLE))[:-30]), ("y.csv", TABLE))
    first, second = contents(Path("a.zip"), data)
    assert first.refusal.startswith("corrupted ZIP: File is not a zip file")
    assert second.data == TABLE


def test_what_lies_beside_the_accelerations_is_unread(shared_records: Path, tmp_path: Path) -> None:
    """PEER adds velocity files to its archives, and macOS adds hidden files."""
    velocity = shared_records / "formats" / "peer_at2" / "RSN88_SFERN_FSD172.VT2"
    inside = ("PEER/RSN88.VT2", velocity.read_bytes()), ("__MACOSX/._x.csv", b"\0")
    data = zipped(*inside, ("x.csv", TABLE), ("PEER/README.txt", b"Read me."))
    (tmp_path / "a.zip").write_bytes(data)
    outcomes = list(collect([tmp_path / "a.zip"]))
    unread = {
        o.file[6:]: o.reason
        for o in outcomes
        if isinstance(o, InputOutcome) and o.status == "unread"
    }
    assert unread == {
        "PEER/RSN88.VT2": "is a velocity time series, not an acceleration.",
        "__MACOSX/._x.csv": "hidden file: not read.",
        "PEER/README.txt": "document: not a record.",
    }
    assert sum(isinstance(o, InputOutcome) and o.status == "rejected" for o in outcomes) == 0
    # The same file is rejected when the user names it.
    [], [outcome] = sorted_out(collect([velocity]))
    assert outcome.line == 3


def test_ingest_lists_the_members_of_an_archive_in_an_archive(
    shared_records: Path, tmp_path: Path
) -> None:
    folder = shared_records / "formats" / "csmip"
    path = tmp_path / "download.zip"
    names = ("CE89146.V2", "CE89146.V3")
    inner = zipped(*((f"CE89146/{name}", (folder / name).read_bytes()) for name in names))
    path.write_bytes(zipped(("CE89146p.zip", inner)))
    assert run("ingest", path, "--output", tmp_path / "records.nc") == 0
    rows = list(csv.DictReader((tmp_path / "records.csv").read_text().splitlines()))
    assert [row["status"] for row in rows] == ["accepted"] * 3 + ["unread"]


def test_empty_archive() -> None:
    with pytest.raises(InputError, match=r"ZIP archive without files\."):
        list(contents(Path("a.zip"), zipped()))


def test_too_many_members() -> None:
    data = zipped(*((f"{i}.csv", b"1") for i in range(containers.MOST_MEMBERS + 1)))
    with pytest.raises(InputError, match=r"1001 members\. Must be at most 1000"):
        list(contents(Path("a.zip"), data))


def test_total_size(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(containers, "LARGEST_TOTAL", 50)
    with pytest.raises(InputError, match=r"expands to 62 bytes\. Must be at most 50"):
        list(contents(Path("a.zip"), zipped(("a.csv", TABLE), ("b.csv", TABLE))))


def test_member_that_expands_too_much() -> None:
    reason = refusal(("x.csv", bytes(20_000_000)))
    assert re.match(
        r"194\d\d bytes that expand to 20000000\. Must be at most 194\d{4}: 100", reason
    )


def gzip_of_zeros(size: int) -> bytes:
    return gzip.compress(bytes(1 << 24), mtime=0) * (size >> 24)


@pytest.fixture(scope="module")
def bomb() -> bytes:
    """Return a gzip file of one megabyte that expands to one gigabyte."""
    return gzip_of_zeros(1 << 30)


def test_bomb_is_not_expanded(bomb: bytes) -> None:
    tracemalloc.start()
    with pytest.raises(InputError, match="expands to more than 104"):
        next(contents(Path("x.AT2.gz"), bomb))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 256_000_000


@pytest.mark.parametrize("cut", [5, 15, -6, -1])
def test_gzip_cut_short(cut: int) -> None:
    with pytest.raises(InputError, match=r"corrupted gzip: .*\."):
        next(contents(Path("x.csv.gz"), gzip.compress(TABLE)[:cut]))


def test_gzip_with_a_flipped_bit() -> None:
    data = bytearray(gzip.compress(TABLE))
    data[-6] ^= 1
    with pytest.raises(InputError, match=r"corrupted gzip: CRC check failed"):
        next(contents(Path("x.csv.gz"), bytes(data)))


def test_zip_cut_short() -> None:
    with pytest.raises(InputError, match=r"corrupted ZIP: File is not a zip file"):
        next(contents(Path("a.zip"), zipped(("x.csv", TABLE))[:-30]))


def test_damaged_member_leaves_the_others() -> None:
    data = zipped(("x.csv", TABLE), ("y.csv", TABLE), how=zipfile.ZIP_STORED)
    first, second = contents(Path("a.zip"), data.replace(b"0.1", b"0.3", 1))
    assert first.refusal.startswith("corrupted member: Bad CRC-32")
    assert second.data == TABLE


@pytest.mark.parametrize(
    ("name", "shown"), [("a\nb", "a\\nb"), ("\udcff", "\\udcff"), ("é.AT2", "é.AT2")]
)
def test_names_in_tables(name: str, shown: str) -> None:
    assert printable(name) == shown


def test_a_sheet_of_libreoffice_in_a_folder_is_named_once(tmp_path: Path) -> None:
    """It is a ZIP archive whose first member, stored as it is, names its kind."""
    kind = ("mimetype", b"application/vnd.oasis.opendocument.spreadsheet")
    data = zipped(kind, ("content.xml", b"<a/>"), how=zipfile.ZIP_STORED)
    (tmp_path / "sheet.ods").write_bytes(data)
    (tmp_path / "a.csv").write_bytes(TABLE)
    records, rejections = sorted_out(collect([tmp_path], ReadOptions("g", 0.01)))
    reason = "OpenDocument is not read. Save the sheet as .xlsx or CSV."
    assert len(records) == 1
    assert [(outcome.file, outcome.reason) for outcome in rejections] == [("sheet.ods", reason)]
    [member] = contents(Path("a.zip"), zipped(("sheet.ods", data)))
    assert member.refusal == reason
