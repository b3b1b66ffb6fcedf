"""Expand archives, and archives in archives, one member at a time."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from rockframe.errors import InputError
from rockframe.ingest import members
from rockframe.ingest.members import (
    Content,
    decompressed,
    printable,
    tar_members,
    zip_members,
)

#: Largest nesting depth of archives, such as a ZIP of ZIPs.
_DEEPEST: Final = 2
#: Bytes of a file that suffice to recognise an archive.
ARCHIVE_HEAD: Final = 512

_ZIP: Final = (b"PK\x03\x04", b"PK\x05\x06")
_GZIP, _BZIP2 = b"\x1f\x8b", re.compile(rb"BZh[1-9]1AY&SY")
_OTHER_ARCHIVES: Final = (b"\xfd7zXZ", b"7z\xbc\xaf", b"Rar!", b"\x28\xb5\x2f\xfd")


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
        if self.count > members.MOST_MEMBERS:
            raise InputError(
                self.path,
                f"archive of {self.count} members or more. Must be at most {members.MOST_MEMBERS}.",
            )
        if self.size > members.LARGEST_TOTAL:
            message = f"archive that expands to {self.size} bytes or more."
            raise InputError(self.path, f"{message} Must be at most {members.LARGEST_TOTAL}.")


def _expand(content: Content, depth: int, budget: _Budget) -> Iterator[Content]:
    """Yield the members of an archive and of archives in it, or the content itself."""
    head, outermost = content.data[:ARCHIVE_HEAD], depth == _DEEPEST
    if content.refusal or not (is_archive(head) or (_is_other(head) and not outermost)):
        yield content
        return
    try:
        compressed = _is_compressed(head)
        inner = decompressed(content) if compressed else content
        if compressed:
            budget.spend(len(inner.data))
        archive = inner.data[:ARCHIVE_HEAD]
        if not is_archive(archive) and not _is_other(archive):
            yield inner
        elif depth == 0 or _is_compressed(archive) or _is_other(archive):
            yield _refused(inner, "an archive in an archive. Must be a record file.")
        else:
            expand = tar_members if _is_tar(archive) else zip_members
            for member in expand(content if compressed else inner, inner.data):
                budget.spend(len(member.data))
                yield from _expand(member, depth - 1, budget)
    except InputError as error:
        if outermost or error.path == budget.path:
            raise
        yield _refused(content, error.reason)


def _refused(content: Content, refusal: str) -> Content:
    return Content(content.where, content.name, content.path, b"", refusal)


def _is_compressed(head: bytes) -> bool:
    return head.startswith(_GZIP) or _BZIP2.match(head) is not None


def _is_tar(head: bytes) -> bool:
    return head[257:262] == b"ustar"


def _is_other(head: bytes) -> bool:
    return head.startswith(_OTHER_ARCHIVES)
