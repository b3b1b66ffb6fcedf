"""The last line of a page: the hash of all above it, so that damage to the page can be found."""

from __future__ import annotations

import hashlib
from typing import Final

_BEFORE: Final = b"<!-- SHA-256 of all above this line: "
_AFTER: Final = b" -->\n"


def sealed(page: str) -> bytes:
    """Return a page as it is written: in UTF-8, with the line of its hash.

    Parameters
    ----------
    page : str
        HTML.

    Examples
    --------
    >>> is_whole(sealed("<p>Whole.</p>"))
    True
    """
    content = page.rstrip().encode() + b"\n"
    return content + _line(content)


def is_whole(content: bytes) -> bool:
    """Return whether a page is as it was written.

    Parameters
    ----------
    content : bytes
        All of its file.

    Examples
    --------
    >>> is_whole(sealed("<p>Whole.</p>").replace(b"Whole", b"Hole"))
    False
    """
    page, before, _ = content.rpartition(_BEFORE)
    return bool(before) and content == page + _line(page)


def _line(content: bytes) -> bytes:
    return _BEFORE + hashlib.sha256(content).hexdigest().encode() + _AFTER
