"""Bytes of a text file into lines and numbers, with the line of the first bad number."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.cells import decimal
from rockframe.errors import InputError

_UTF8_MARK: Final = b"\xef\xbb\xbf"
#: DOS ends a text with one or more of these, up to a whole sector.
_END_MARK: Final = b"\x1a"
_UTF16_MARKS: Final = (b"\xff\xfe", b"\xfe\xff")
#: No acceleration or time is as large in any unit; products of smaller ones stay finite.
_LARGEST: Final = 1e30
#: So many numbers of one form before the last show that it should have that form.
_ENOUGH: Final = 10
#: Numbers are parsed in pieces of this many bytes, so that memory stays flat.
_BLOCK: Final = 1 << 22


def is_utf16(head: bytes) -> bool:
    r"""Whether a file begins with the byte order mark of UTF-16.

    Examples
    --------
    >>> is_utf16("NPTS".encode("utf-16")), is_utf16(b"NPTS")
    (True, False)
    """
    return head.startswith(_UTF16_MARKS)


def unify_line_ends(data: bytes) -> bytes:
    r"""Return text whose lines end with LF, without the mark of UTF-8.

    CR-LF, CR-CR-LF (text sent twice through a DOS conversion) and CR alone are line ends.

    Examples
    --------
    >>> unify_line_ends(b"one\r\r\ntwo\r\nthree\rfour")
    b'one\ntwo\nthree\nfour'
    """
    data = data.removeprefix(_UTF8_MARK)
    if b"\r" in data:
        data = data.replace(b"\r\r\n", b"\n").replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    return data


def text_of(path: Path, data: bytes) -> bytes:
    r"""Return the text of a file with unified line ends, without the end marks of DOS.

    Parameters
    ----------
    path : Path
        The file, for the error.
    data : bytes
        Its contents.

    Raises
    ------
    InputError
        If it is UTF-16 or holds a NUL byte.

    Examples
    --------
    >>> text_of(Path("motion.csv"), b"time_s,acc_g\r\n0.00,0.1\r\n")
    b'time_s,acc_g\n0.00,0.1\n'
    """
    if is_utf16(data):
        raise InputError(path, "text in UTF-16. Must be ASCII or UTF-8.")
    data = unify_line_ends(data.rstrip(_END_MARK))
    where = data.find(b"\0")
    if where >= 0:
        line = data.count(b"\n", 0, where) + 1
        raise InputError(path, "NUL byte in a text file. Must be plain text.", line=line)
    return data


def head_lines(head: bytes) -> list[str]:
    r"""Return the first lines of a text file, or none if it is binary.

    Parameters
    ----------
    head : bytes
        The file's beginning; its last line may be cut.

    Examples
    --------
    >>> head_lines(b"NPTS= 3, DT= .01 SEC\r\n .1 .2 .3"), head_lines(b"\x00\x01")
    (['NPTS= 3, DT= .01 SEC', ' .1 .2 .3'], [])
    """
    if is_utf16(head) or b"\0" in head:
        return []
    return unify_line_ends(head).decode("latin-1").split("\n")


def is_number(token: bytes) -> bool:
    """Whether a token is a finite decimal number, below 1e30 in size.

    Examples
    --------
    >>> [is_number(token) for token in (b"-.12E-03", b"nan", b"1_0", b"0.1x")]
    [True, False, False, False]
    """
    try:
        return abs(decimal(token.decode("latin-1"))) < _LARGEST
    except ValueError:
        return False


def are_finite(values: NDArray[np.float64]) -> bool:
    """Whether all numbers of an array are finite, and below 1e30 in size.

    Parameters
    ----------
    values : array
        Numbers in any unit, any shape.

    Examples
    --------
    >>> are_finite(np.array([0.1, -0.2])), are_finite(np.array([0.1, np.nan]))
    (True, False)
    """
    return bool((np.abs(values) < _LARGEST).all())


def bad_number(path: Path, token: bytes, line: int, quantity: str = "acceleration") -> InputError:
    """Return the error for a token that is not a finite number.

    Examples
    --------
    >>> str(bad_number(Path("motion.csv"), b"nan", 12))
    "motion.csv:12: acceleration 'nan'. Must be a finite number below 1e30."
    """
    shown = token.decode("latin-1").strip()[:40]
    return InputError(path, f"{quantity} {shown!r}. Must be a finite number below 1e30.", line=line)


def blocks(body: bytes) -> Iterator[bytes]:
    r"""Cut a text into pieces of some megabytes that end with whole lines.

    Examples
    --------
    >>> list(blocks(b"1 2\n3 4\n"))
    [b'1 2\n3 4\n']
    """
    start = 0
    while start < len(body):
        end = body.find(b"\n", start + _BLOCK) + 1 or len(body)
        yield body[start:end]
        start = end


def parse_numbers(path: Path, body: bytes, first_line: int) -> NDArray[np.float64]:
    r"""Read all numbers of a text, separated by white space.

    Parameters
    ----------
    path : Path
        The file, for the error.
    body : bytes
        The text, with LF line ends.
    first_line : int
        Line number of its first line in the file.

    Returns
    -------
    array, shape (numbers,)

    Raises
    ------
    InputError
        With the line and the token, if one is not a finite number; if the text ends within one.

    Examples
    --------
    >>> parse_numbers(Path("motion.AT2"), b" .1 -.2\n 3E-1\n", 5)
    array([ 0.1, -0.2,  0.3])
    """
    try:
        pieces = [np.array(block.split(), dtype=np.float64) for block in blocks(body)]
    except ValueError:
        raise _first_bad_number(path, body, first_line) from None
    values = np.concatenate([np.empty(0), *pieces])
    # float() takes the underscores of Python's own literals; no archive writes them.
    if b"_" in body or not are_finite(values):
        raise _first_bad_number(path, body, first_line)
    require_whole_end(path, body, first_line)
    return values


def require_whole_end(path: Path, body: bytes, first_line: int, columns: int = 1) -> None:
    r"""Refuse a text that ends within its last number, which would read as another number.

    Only a text without a last line end is looked at, whose numbers before the last are all printed
    with as many digits, the last with fewer.

    Parameters
    ----------
    path : Path
        The file, for the error.
    body : bytes
        Numbers separated by white space or commas.
    first_line : int
        Line number of the first of them.
    columns : int
        Columns of a table; those of the last are compared.

    Raises
    ------
    InputError
        With the line and the number.

    Examples
    --------
    >>> require_whole_end(Path("motion.AT2"), b" 1.25E-02" * 20 + b" 1.25E-0", 5)
    Traceback (most recent call last):
    rockframe.errors.InputError: motion.AT2:5: the file ends within '1.25E-0'. Must have as many ...
    """
    if not body or body[-1:].isspace():
        return
    tokens = body[-4096:].replace(b",", b" ").split()[1:]
    last, *others = [_digits(token) for token in tokens[::-columns][: _ENOUGH + 1]] or [(0, 0)]
    if len(others) < _ENOUGH or len(set(others)) > 1:
        return
    if last[0] < others[0][0] or last[1] < others[0][1]:
        shown = tokens[-1].decode("latin-1")
        raise InputError(
            path,
            f"the file ends within {shown!r}. Must have as many digits as the numbers before it.",
            line=first_line + body.count(b"\n"),
        )


def _digits(token: bytes) -> tuple[int, int]:
    """Characters after the decimal point, and of the exponent."""
    number, _, exponent = token.lower().partition(b"e")
    return len(number.partition(b".")[2]), len(exponent)


def _first_bad_number(path: Path, body: bytes, first_line: int) -> InputError:
    for line, row in enumerate(body.split(b"\n"), first_line):
        for token in row.split():
            if not is_number(token):
                return bad_number(path, token, line)
    raise AssertionError("every token is a number, yet they could not be read together")
