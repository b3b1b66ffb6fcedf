"""Expand ZIP and gzip archives in memory, one member at a time, within size limits."""

from __future__ import annotations

import gzip
import re
import stat
import zipfile
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Final

from rockframe.errors import InputError

#: Size limit of a file, and of an archive member after expansion [bytes].
LARGEST: Final = 256_000_000
#: Largest number of members in an archive.
MOST_MEMBERS: Final = 1000
#: Size limit of all members of an archive together, after expansion [bytes].
LARGEST_TOTAL: Final = 2_000_000_000
#: Largest expansion ratio; text of samples has 3 to 10, a record of zeros 80.
LARGEST_RATIO: Final = 100
#: The ratio is not checked below this size [bytes].
_SMALL: Final = 1_000_000
#: Size of the blocks in which data are expanded [bytes].
_BLOCK: Final = 1 << 20

_ZIP: Final = (b"PK\x03\x04", b"PK\x05\x06")
_GZIP: Final = b"\x1f\x8b"
_OTHER_ARCHIVES: Final = (b"BZh", b"\xfd7zXZ", b"7z\xbc\xaf", b"Rar!", b"\x28\xb5\x2f\xfd")
_DRIVE: Final = re.compile(r"[A-Za-z]:")
#: Exceptions that the standard library raises on corrupted archives.
_DAMAGE: Final = (zipfile.BadZipFile, zlib.error, EOFError, OSError, NotImplementedError)


@dataclass(frozen=True)
class Content:
    """The bytes of one record file, or the reason why it was rejected.

    Parameters
    ----------
    where : Path
        The file, or ``archive:member``; for error messages.
    name : str
        The same without the folder and with escaped unprintable characters; for tables.
    path : Path
        The file, or the member without the archive; for record identifiers.
    data : bytes
        Expanded contents.
    refusal : str
        Reason why a member was not expanded; empty if it was.

    Examples
    --------
    >>> next(contents(Path("records/shake.csv"), b"1 2")).name
    'shake.csv'
    """

    where: Path
    name: str
    path: Path
    data: bytes = b""
    refusal: str = ""


def is_archive(head: bytes) -> bool:
    r"""Return whether the head of a file is that of a ZIP or gzip archive.

    Parameters
    ----------
    head : bytes
        At least the first 4 bytes.

    Examples
    --------
    >>> is_archive(b"\x1f\x8b\x08\x00"), is_archive(b"time_s,acc_g")
    (True, False)
    """
    return head.startswith((*_ZIP, _GZIP))


def printable(name: str) -> str:
    r"""Return a file name in which unprintable characters are escaped, for tables.

    Parameters
    ----------
    name : str
        Name from the file system or an archive; may contain line ends and invalid Unicode.

    Examples
    --------
    >>> printable("El Centro\n(NS).AT2")
    'El Centro\\n(NS).AT2'
    """
    return "".join(
        c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in name
    )


def contents(path: Path, data: bytes) -> Iterator[Content]:
    r"""Yield the contents of a file, or of each member if it is an archive.

    Parameters
    ----------
    path : Path
        The file, for names and error messages.
    data : bytes
        Contents of the file.

    Yields
    ------
    Content
        In the order of the archive. A rejected member has a `refusal` and no data.

    Raises
    ------
    InputError
        If an archive is corrupted, has no members or too many, or exceeds the size limits.

    Examples
    --------
    >>> [member] = contents(Path("shake.csv.gz"), gzip.compress(b"0.0 0.1\n"))
    >>> member.name, member.data
    ('shake.csv.gz:shake.csv', b'0.0 0.1\n')
    """
    if data.startswith(_GZIP):
        yield _gzip_member(path, data)
    elif data.startswith(_ZIP):
        yield from _zip_members(path, data)
    else:
        yield Content(path, printable(path.name), path, data)


def _gzip_member(path: Path, data: bytes) -> Content:
    name = re.sub(r"\.gz$", "", path.name, flags=re.I)
    cap = _cap(len(data))
    pieces: list[bytes] = []
    size = 0
    try:
        with gzip.GzipFile(fileobj=BytesIO(data)) as stream:
            while piece := stream.read(_BLOCK):
                pieces.append(piece)
                size += len(piece)
                if size > cap:
                    raise InputError(
                        path,
                        f"gzip of {len(data)} bytes that expands to more than {cap}. {_must(cap)}",
                    )
    except _DAMAGE as error:
        raise _damaged(path, "gzip", error) from None
    return _member(path, name, b"".join(pieces))


def _zip_members(path: Path, data: bytes) -> Iterator[Content]:
    try:
        archive = zipfile.ZipFile(BytesIO(data))
    except (*_DAMAGE, ValueError) as error:
        raise _damaged(path, "ZIP", error) from None
    with archive:
        members = archive.infolist()
        if not members:
            raise InputError(path, "ZIP archive without files.")
        if len(members) > MOST_MEMBERS:
            raise InputError(
                path, f"ZIP archive of {len(members)} members. Must be at most {MOST_MEMBERS}."
            )
        total = sum(member.file_size for member in members)
        if total > LARGEST_TOTAL:
            raise InputError(
                path,
                f"ZIP archive that expands to {total} bytes. Must be at most {LARGEST_TOTAL}.",
            )
        for member in members:
            yield _zip_member(path, archive, member)


def _zip_member(path: Path, archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> Content:
    refusal = _refusal(member)
    if refusal:
        return _member(path, member.orig_filename, refusal=refusal)
    try:
        with archive.open(member) as stream:
            data = stream.read(member.file_size + 1)
    except (*_DAMAGE, RuntimeError, ValueError) as error:
        reason = _damaged(path, "member", error).reason
        return _member(path, member.orig_filename, refusal=reason)
    return _member(path, member.orig_filename, data)


def _refusal(member: zipfile.ZipInfo) -> str:
    """Return why a member must not be expanded; empty if it may be."""
    name = member.orig_filename
    mode = member.external_attr >> 16
    cap = _cap(member.compress_size)
    for refused, what, must in (
        (name.startswith("/") or _DRIVE.match(name), "an absolute path", "a bare file name"),
        (".." in re.split(r"[/\\]", name), "a path out of the folder", "a bare file name"),
        ("\\" in name, "a path with backslashes", "a bare file name"),
        (name.endswith("/"), "a folder in the archive", "a file"),
        ("/" in name, "a path with folders", "a bare file name"),
        (not name or "\0" in name, "a name that is empty or holds NUL", "a bare file name"),
        (stat.S_ISLNK(mode), "a link", "a regular file"),
        (stat.S_IFMT(mode) not in {0, stat.S_IFREG}, "a special file", "a regular file"),
        (member.flag_bits & 1, "encrypted", "readable without a password"),
        (
            member.compress_type not in {zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED},
            f"compressed by method {member.compress_type}",
            "stored or deflated",
        ),
    ):
        if refused:
            return f"{what}. Must be {must}."
    if member.file_size > cap:
        return f"{member.compress_size} bytes that expand to {member.file_size}. {_must(cap)}"
    return ""


def _member(path: Path, name: str, data: bytes = b"", refusal: str = "") -> Content:
    if not refusal and (is_archive(data) or _is_other_archive(data)):
        data, refusal = b"", "an archive in an archive. Must be a record file."
    shown = printable(name)
    return Content(
        Path(f"{path}:{shown}"), f"{printable(path.name)}:{shown}", Path(shown), data, refusal
    )


def _is_other_archive(data: bytes) -> bool:
    return data.startswith(_OTHER_ARCHIVES) or data[257:262] == b"ustar"


def _cap(compressed: int) -> int:
    """Return the expanded size that is allowed for a compressed size [bytes]."""
    return min(LARGEST, max(_SMALL, LARGEST_RATIO * compressed))


def _must(cap: int) -> str:
    return f"Must be at most {cap}: {LARGEST_RATIO} for each byte, and {LARGEST} in all."


def _damaged(path: Path, what: str, error: Exception) -> InputError:
    reason = printable(str(error)).rstrip(".") or type(error).__name__
    return InputError(path, f"corrupted {what}: {reason}.")
