from __future__ import annotations

import gzip
import io
import re
import stat
import tracemalloc
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from rockframe.errors import InputError
from rockframe.ingest import collect, read_file, sorted_out
from rockframe.ingest.reading import containers
from rockframe.ingest.reading.containers import contents, printable

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
    path.write_bytes(zipped(("RSN77.AT2", at2()), ("notes.md", b"Words.\n"), ("b.csv", TABLE)))
    records, [rejection] = sorted_out(collect([path]))
    assert [record.record_id for record in records] == ["RSN77", "b"]
    assert [r.source_file for r in records] == [f"{path.name}:RSN77.AT2", f"{path.name}:b.csv"]
    assert rejection.file == "download (1).zip:notes.md"
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
        ("folder/x.AT2", "a path with folders"),
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
    data[6] |= 1  # the flag stands in the member's own header and in the directory
    data[data.index(b"PK\x01\x02") + 8] |= 1
    [member] = contents(Path("a.zip"), bytes(data))
    assert member.refusal == "encrypted. Must be readable without a password."


def test_other_compression() -> None:
    [member] = contents(Path("a.zip"), zipped(("x.csv", TABLE), how=zipfile.ZIP_LZMA))
    assert member.refusal == "compressed by method 14. Must be stored or deflated."


@pytest.mark.parametrize(
    "inner",
    [
        zipped(("x.csv", TABLE)),
        gzip.compress(TABLE, mtime=0),
        b"BZh9",
        b"\0" * 257 + b"ustar",
    ],
    ids=["zip", "gzip", "bzip2", "tar"],
)
def test_archives_in_archives(inner: bytes) -> None:
    for outer in (zipped(("inner", inner)), gzip.compress(inner)):
        [member] = contents(Path("outer.gz"), outer)
        assert member.refusal == "an archive in an archive. Must be a record file."


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
    stream = io.BytesIO()
    with gzip.GzipFile(fileobj=stream, mode="wb", compresslevel=9) as file:
        for _ in range(size >> 24):
            file.write(bytes(1 << 24))
    return stream.getvalue()


@pytest.fixture(scope="module")
def bomb() -> bytes:
    """A gzip of a megabyte that expands to one gigabyte."""
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
