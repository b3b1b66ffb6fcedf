"""Expand archives in memory, within size limits, one member at a time."""

from __future__ import annotations

import bz2
import gzip
import re
import stat
import tarfile
import zipfile
import zlib
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Final, TypeAlias

from rockframe.errors import InputError
from rockframe.ingest.parsing.lines import unreadable

#: Size limit of a file, and of an archive member after expansion [bytes].
LARGEST: Final = 256_000_000
#: Largest number of members in an archive, including members of archives in it.
MOST_MEMBERS: Final = 1000
#: Size limit of all members of an archive together, after expansion [bytes].
LARGEST_TOTAL: Final = 2_000_000_000
#: Largest expansion ratio; text of samples reaches 3 to 10, a record of zeros 80.
LARGEST_RATIO: Final = 100
#: The ratio is not checked below this size [bytes].
_SMALL: Final = 1_000_000
#: Size of the blocks in which data are expanded [bytes].
_BLOCK: Final = 1 << 20

_GZIP: Final = b"\x1f\x8b"
_DRIVE: Final = re.compile(r"[A-Za-z]:")
#: Size of a block of a tar archive, which ends with a block of zeros.
_TAR_BLOCK: Final = 512
#: Exceptions that the standard library raises on corrupted archives.
_DAMAGE: Final = (
    zipfile.BadZipFile,
    tarfile.TarError,
    zlib.error,
    EOFError,
    OSError,
    ArithmeticError,
    LookupError,
    RecursionError,
    RuntimeError,  # NotImplementedError too
    ValueError,
)


@dataclass(frozen=True)
class Content:
    """The bytes of one record file, or the reason why it was rejected or skipped.

    Parameters
    ----------
    where : Path
        The file, or ``archive:member``; for error messages.
    name : str
        The name without the folder, with escaped unprintable characters; for tables.
    path : Path
        The file, or the member without the archive; for record identifiers.
    data : bytes
        Expanded contents.
    refusal : str
        Reason why a member was not expanded, or "".

    Examples
    --------
    >>> Content(Path("a.zip:b.csv"), "a.zip:b.csv", Path("b.csv"), b"1 2").path.stem
    'b'
    """

    where: Path
    name: str
    path: Path
    data: bytes = b""
    refusal: str = ""


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
    if name.isprintable():
        return name
    return "".join(
        c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in name
    )


def folder_names(paths: Iterable[Path]) -> list[str]:
    r"""Return a unique display name for each folder: its name, with a number if it is repeated.

    A link keeps its own name, not that of its target.

    Examples
    --------
    >>> folder_names([Path("near/records"), Path("far/records"), Path("near")])
    ['records', 'records-2', 'near']
    """
    names: list[str] = []
    for path in paths:
        plain = path.name not in {"", ".."}
        name = called = printable(path.name if plain else path.resolve().name)
        number = 1
        while called in names:
            number += 1
            called = f"{name}-{number}"
        names.append(called)
    return names


def decompressed(content: Content) -> Content:
    """Return the file in a gzip or bzip2; reject a corrupted or too large file."""
    is_gzip = content.data.startswith(_GZIP)
    kind = "gzip" if is_gzip else "bzip2"
    path, compressed, cap = content.where, len(content.data), _cap(len(content.data))
    pieces: list[bytes] = []
    size = 0
    source = BytesIO(content.data)
    try:
        with gzip.GzipFile(fileobj=source) if is_gzip else bz2.BZ2File(source) as stream:
            while piece := stream.read(_BLOCK):
                pieces.append(piece)
                size += len(piece)
                if size > cap:
                    message = f"{kind} of {compressed} bytes that expands to more than {cap}."
                    raise InputError(path, f"{message} {_must(cap)}")
    except _DAMAGE as error:
        raise _corrupted(path, kind, error) from None
    name = re.sub(r"\.(gz|bz2)$", "", content.path.name, flags=re.I)
    return _member(content, name, b"".join(pieces))


def zip_members(outer: Content, data: bytes) -> Iterator[Content]:
    """Yield the members of a ZIP archive; reject a corrupted or too large file."""
    try:
        archive = zipfile.ZipFile(BytesIO(data))
    except _DAMAGE as error:
        raise _corrupted(outer.where, "ZIP", error) from None
    with archive:
        members = [member for member in archive.infolist() if not _is_folder(member)]
        total = sum(member.file_size for member in members)
        _require_limits(outer, "ZIP", len(members), total)
        for member in members:
            yield _zip_member(outer, archive, member)


def _is_folder(member: zipfile.ZipInfo) -> bool:
    return member.orig_filename.endswith("/") and not member.file_size


def _zip_member(outer: Content, archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> Content:
    name, mode = member.orig_filename, member.external_attr >> 16
    refusal = _refused_name(name) or _first(
        (stat.S_ISLNK(mode), "a link", "a regular file"),
        (stat.S_IFMT(mode) not in {0, stat.S_IFREG}, "a special file", "a regular file"),
        (member.flag_bits & 1, "encrypted", "readable without a password"),
        (
            member.compress_type not in {zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED},
            f"compressed by method {member.compress_type}",
            "stored or deflated",
        ),
    )
    cap = _cap(member.compress_size)
    if not refusal and member.file_size > cap:
        refusal = f"{member.compress_size} bytes that expand to {member.file_size}. {_must(cap)}"
    if refusal:
        return _member(outer, name, refusal=refusal)
    try:
        with archive.open(member) as stream:
            return _member(outer, name, stream.read(member.file_size + 1))
    except _DAMAGE as error:
        return _member(outer, name, refusal=_corrupted(outer.where, "member", error).reason)


def tar_members(outer: Content, data: bytes) -> Iterator[Content]:
    """Yield the members of a tar archive; reject a corrupted or too large file."""
    try:
        with tarfile.open(fileobj=BytesIO(data), mode="r:") as archive:
            entries = archive.getmembers()
            # tarfile treats a corrupted header as the end.
            rest = data[archive.offset :]
            if len(rest) < _TAR_BLOCK or rest.strip(b"\0"):
                raise tarfile.ReadError("it ends early")
            members = [entry for entry in entries if not entry.isdir()]
            _require_limits(outer, "tar", len(members), sum(entry.size for entry in members))
            for entry in members:
                yield _tar_member(outer, archive, entry)
    except _DAMAGE as error:
        raise _corrupted(outer.where, "tar", error) from None


def _tar_member(outer: Content, archive: tarfile.TarFile, member: tarfile.TarInfo) -> Content:
    refusal = _refused_name(member.name) or _first(
        (member.issym() or member.islnk(), "a link", "a regular file"),
        (not member.isreg() or member.issparse(), "a special file", "a regular file"),
    )
    if not refusal and member.size > LARGEST:
        refusal = f"{member.size} bytes. Must be at most {LARGEST}."
    stream = None if refusal else archive.extractfile(member)
    return _member(outer, member.name, stream.read() if stream else b"", refusal)


def _require_limits(outer: Content, kind: str, members: int, total: int) -> None:
    if not members:
        raise InputError(outer.where, f"{kind} archive without files.")
    if members > MOST_MEMBERS:
        message = f"{kind} archive of {members} members. Must be at most {MOST_MEMBERS}."
        raise InputError(outer.where, message)
    if total > LARGEST_TOTAL:
        message = f"{kind} archive that expands to {total} bytes. Must be at most {LARGEST_TOTAL}."
        raise InputError(outer.where, message)


def _refused_name(name: str) -> str:
    """Return the reason why a member with this name must not be expanded, or ""."""
    must = "a path within the archive"
    return _first(
        (name.startswith("/") or _DRIVE.match(name), "an absolute path", must),
        (".." in re.split(r"[/\\]", name), "a path out of the folder", must),
        ("\\" in name, "a path with backslashes", must),
        (not name or "\0" in name, "a name that is empty or holds NUL", must),
        (name.endswith("/"), "a folder in the archive", "a file"),
    )


def _first(*causes: tuple[object, str, str]) -> str:
    """Return the message of the first cause that applies, or ""."""
    return next((f"{fault}. Must be {must}." for holds, fault, must in causes if holds), "")


def _member(outer: Content, name: str, data: bytes = b"", refusal: str = "") -> Content:
    shown = printable(name)
    path = Path(f"{outer.where}:{shown}")
    return Content(path, f"{outer.name}:{shown}", Path(shown), data, refusal)


def _cap(compressed: int) -> int:
    """Return the expanded size that is allowed for a compressed size [bytes]."""
    return min(LARGEST, max(_SMALL, LARGEST_RATIO * compressed))


def _must(cap: int) -> str:
    return f"Must be at most {cap}: {LARGEST_RATIO} times the packed size, and at most {LARGEST}."


def _corrupted(path: Path, kind: str, error: Exception) -> InputError:
    reason = printable(str(error)).rstrip(".") or type(error).__name__
    return InputError(path, f"corrupted {kind}: {reason}.")


#: Largest nesting depth of archives, such as a ZIP of ZIPs.
_DEEPEST: Final = 2
#: Bytes of a file that suffice to recognise an archive.
ARCHIVE_HEAD: Final = 512

_ZIP: Final = (b"PK\x03\x04", b"PK\x05\x06")
_BZIP2: Final = re.compile(rb"BZh[1-9]1AY&SY")
#: A ZIP archive that is a document of LibreOffice: its first member says so.
_OPEN_DOCUMENT: Final = re.compile(rb"PK\x03\x04.{26}mimetypeapplication/vnd\.oasis", re.S)
#: Archives that are recognised but not read, by their first bytes.
_OTHER_ARCHIVES: Final = {
    b"\xfd7zXZ\0": "an archive of xz (.xz)",
    b"7z\xbc\xaf\x27\x1c": "an archive of 7-Zip (.7z)",
    b"Rar!\x1a\x07": "an archive of RAR (.rar)",
    b"\x28\xb5\x2f\xfd": "an archive of Zstandard (.zst)",
    b"\x5d\0\0\x80\0": "an archive of LZMA (.lzma)",
    b"\x04\x22\x4d\x18": "an archive of LZ4 (.lz4)",
    b"\x1f\x9d": "an archive of compress (.Z)",
    b"LZIP\x01": "an archive of lzip (.lz)",
    b"MSCF\0\0\0\0": "a cabinet of Windows (.cab)",
}


def is_archive(head: bytes) -> bool:
    r"""Return True if a file begins like a ZIP, tar, gzip or bzip2 archive.

    Parameters
    ----------
    head : bytes
        At least the first 512 bytes, or all of a shorter file.

    Examples
    --------
    >>> is_archive(b"\x1f\x8b\x08\x00"), is_archive(b"time_s,acc_g")
    (True, False)
    """
    return head.startswith(_ZIP) or _is_compressed(head) or _is_tar(head)


def contents(path: Path, data: bytes) -> Iterator[Content]:
    r"""Yield the contents of a file, or of each member if it is an archive.

    Archives may contain archives, to a depth of two; gzip and bzip2 around a file do not count.

    Parameters
    ----------
    path : Path
        The file, for names and error messages.
    data : bytes
        Contents of the file.

    Yields
    ------
    Content
        The contents in the order of the archive, without folders. A rejected member has a `refusal`
        and no data.

    Raises
    ------
    InputError
        If an archive is corrupted, has no members or too many, or exceeds the size limits.

    Examples
    --------
    >>> import gzip
    >>> [member] = contents(Path("shake.csv.gz"), gzip.compress(b"0.0 0.1\n"))
    >>> member.name, member.data
    ('shake.csv.gz:shake.csv', b'0.0 0.1\n')
    """
    yield from _expand(Content(path, printable(path.name), path, data), _DEEPEST, _Budget(path))


#: Reads the tables of a file.
_TableReader: TypeAlias = "Callable[[Path, bytes], Iterable[tuple[str, bytes]]]"


@dataclass
class _Budget:
    """Members and bytes expanded so far from one file."""

    path: Path
    count: int = 0
    size: int = 0

    def spend(self, size: int) -> None:
        """Count a member; too many members, or too many bytes in total, are an error."""
        self.count += 1
        self.size += size
        if self.count > MOST_MEMBERS:
            raise InputError(
                self.path,
                f"archive of {self.count} members or more. Must be at most {MOST_MEMBERS}.",
            )
        if self.size > LARGEST_TOTAL:
            message = f"archive that expands to {self.size} bytes or more."
            raise InputError(self.path, f"{message} Must be at most {LARGEST_TOTAL}.")


def _expand(content: Content, depth: int, budget: _Budget) -> Iterator[Content]:
    """Yield the members of an archive and of archives in it, or the content itself."""
    head, outermost = content.data[:ARCHIVE_HEAD], depth == _DEEPEST
    if not content.refusal and (read := _reader_of_tables(content.data)):
        yield from _tables(content, read, budget, outermost=outermost)
        return
    if content.refusal or not (is_archive(head) or _other_archive(head)):
        yield content
        return
    try:
        if other := _other_archive(head):
            raise InputError(content.where, other)
        compressed = _is_compressed(head)
        inner = decompressed(content) if compressed else content
        if compressed:
            budget.spend(len(inner.data))
        archive = inner.data[:ARCHIVE_HEAD]
        if not is_archive(archive) and not _other_archive(archive):
            yield inner
        elif depth == 0 or _is_compressed(archive) or _other_archive(archive):
            yield _refused(inner, "an archive in an archive is not read. Unpack it first.")
        else:
            expand = tar_members if _is_tar(archive) else zip_members
            for member in expand(content if compressed else inner, inner.data):
                budget.spend(len(member.data))
                yield from _expand(member, depth - 1, budget)
    except InputError as error:
        if outermost or error.path == budget.path:
            raise
        yield _refused(content, error.reason)


def is_of_tables(data: bytes) -> bool:
    """Return True if a file is a workbook or a MATLAB file, which hold tables.

    Examples
    --------
    >>> is_of_tables(b"time_s,acc_g")
    False
    """
    return _reader_of_tables(data) is not None


def _reader_of_tables(data: bytes) -> _TableReader | None:
    """Return the function that reads a workbook or a MATLAB file; None for other files."""
    if not data.startswith((*_ZIP, b"MATLAB")):
        return None
    from rockframe.ingest.tables import arrays, is_matlab, is_workbook, sheets  # only where needed

    if is_matlab(data[:ARCHIVE_HEAD]):
        return arrays
    return sheets if is_workbook(data) else None


def _tables(
    content: Content,
    read: _TableReader,
    budget: _Budget,
    *,
    outermost: bool,
) -> Iterator[Content]:
    """Yield the tables of a workbook or of a MATLAB file, each as a file of text."""
    try:
        if content.data.startswith(_ZIP):  # the limits of an archive hold for a workbook, too
            for member in zip_members(content, content.data):
                budget.spend(len(member.data))
                if member.refusal:
                    raise InputError(content.where, f"{member.path}: {member.refusal}")
        tables = list(read(content.where, content.data))
    except InputError as error:
        if outermost or error.path == budget.path:
            raise
        yield _refused(content, error.reason)
        return
    stem = content.path.stem
    for name, text in tables:
        shown = printable(name)
        own = stem if len(tables) == 1 else f"{stem}-{shown}"
        where = Path(f"{content.where}:{shown}")
        yield Content(where, f"{content.name}:{shown}", Path(f"{own}.csv"), text)


def _refused(content: Content, refusal: str) -> Content:
    return Content(content.where, content.name, content.path, b"", refusal)


def _is_compressed(head: bytes) -> bool:
    return head.startswith(_GZIP) or _BZIP2.match(head) is not None


def _is_tar(head: bytes) -> bool:
    return head[257:262] == b"ustar"


def _other_archive(head: bytes) -> str:
    """Return the reason why an archive is not read, with what to do, or ""."""
    if _OPEN_DOCUMENT.match(head):
        return "OpenDocument is not read. Save the sheet as .xlsx or CSV."
    names = (name for mark, name in _OTHER_ARCHIVES.items() if head.startswith(mark))
    return next((f"{name} is not read. Unpack it first." for name in names), "")


def load(path: Path) -> bytes:
    """Return the bytes of a regular file of at most 256 MB.

    Parameters
    ----------
    path : Path
        File to load.

    Raises
    ------
    InputError
        If the file is missing, not a regular file, too large, or cannot be read.

    Examples
    --------
    >>> load(Path("lost.AT2"))
    Traceback (most recent call last):
    rockframe.errors.InputError: lost.AT2: no such file.
    """
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):
            raise InputError(path, "not a regular file.")
        if status.st_size > LARGEST:
            raise InputError(path, f"{status.st_size} bytes. Must be at most {LARGEST}.")
        return path.read_bytes()
    except (FileNotFoundError, NotADirectoryError, ValueError):  # a name with a null character
        raise InputError(path, "no such file.") from None
    except OSError as error:
        raise unreadable(path, error) from error
