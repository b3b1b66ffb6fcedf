"""The last line of a page: a hash of the rest, which shows if the page was changed."""

from __future__ import annotations

import hashlib
from typing import Final

_BEFORE: Final = b"<!-- SHA-256 of all above this line: "
_AFTER: Final = b" -->\n"


def sealed(page: str) -> bytes:
    """Encode a page in UTF-8 and append the line with its hash.

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
    """Return True if the hash in the last line of a page is correct.

    Parameters
    ----------
    content : bytes
        Content of the file.

    Examples
    --------
    >>> is_whole(sealed("<p>Whole.</p>").replace(b"Whole", b"Hole"))
    False
    """
    page, before, _ = content.rpartition(_BEFORE)
    return bool(before) and content == page + _line(page)


def _line(content: bytes) -> bytes:
    return _BEFORE + hashlib.sha256(content).hexdigest().encode() + _AFTER
