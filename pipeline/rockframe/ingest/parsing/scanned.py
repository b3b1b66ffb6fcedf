"""Tables of numbers of any form: a compiled scan of their characters."""

from __future__ import annotations

import sys
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.compiled import compiled, inlined
from rockframe.ingest.parsing import Float
from rockframe.ingest.parsing.aligned import EXACT, POWERS

#: Number of bytes of tables from which importing numba takes less time than it saves, and those
#: that this process has read.
_MANY: Final = 1 << 25
_READ: Final = [0]

_TAB: Final = 9
_LINE_END: Final = 10
_BLANK: Final = 32
_PLUS: Final = 43
_MINUS: Final = 45
_POINT: Final = 46
_ZERO: Final = 48
_LETTER: Final = 101  # e, in lower case


def scanned_table(text: bytes, columns: int, separator: bytes | None) -> Float | None:
    r"""Read a table of decimal numbers, if the compiled scan is worth while.

    It is where numba is loaded already, and after many tables.

    Parameters
    ----------
    text : bytes
        Whole lines, each with as many numbers as there are columns.
    columns : int
        Number of columns.
    separator : bytes or None
        The character between two numbers; None for blanks and tabs.

    Returns
    -------
    array, shape (rows, columns), or None
        The values that `float` returns; None if a line is not such a row, or has a
        number of more than 15 digits or beyond 1e22, which one rounding may not read.

    Examples
    --------
    >>> import numba
    >>> scanned_table(b"0.00,-1.5e-2\n0.01,.25\n", 2, b",")
    array([[ 0.   , -0.015],
           [ 0.01 ,  0.25 ]])
    >>> scanned_table(b"0.00,nan\n0.01,.25\n", 2, b",") is None
    True
    """
    _READ[0] += len(text)
    if "numba" not in sys.modules and _READ[0] < _MANY:
        return None
    if separator is not None and len(separator) != 1:
        return None
    characters = np.frombuffer(text, dtype=np.uint8)
    values = np.empty((text.count(b"\n"), columns))
    between = _BLANK if separator in (None, b" ") else separator[0]
    rows = scan(characters, between, POWERS, values)
    return values if rows == len(values) else None


@compiled
def scan(text: NDArray[np.uint8], between: int, powers: Float, values: Float) -> int:
    """Read rows of numbers, each ended by a line end; return their number, or -1 if one is none.

    The digits of a number form a whole number, which is multiplied with or divided by a power of
    ten once, and so rounded once, as `float` rounds (Clinger 1990).

    Parameters
    ----------
    text : array of uint8, shape (characters,)
        The text.
    between : int
        Character between two numbers; a blank for any number of blanks and tabs.
    powers : array, shape (powers,)
        Powers of ten that are exact, from the power 0.
    values : array, shape (rows, columns)
        Filled with the numbers.
    """
    at, size = 0, text.size
    rows, columns = values.shape
    skipped = _BLANK if between == _TAB else _TAB
    for row in range(rows):
        for column in range(columns):
            at = _after_blanks(text, at, skipped)
            at, values[row, column] = _number(text, at, powers)
            if at < 0:
                return -1
            ended, at = at, _after_blanks(text, at, skipped)
            if column == columns - 1:
                continue
            if between != _BLANK and at < size and text[at] == between:
                at += 1
            elif between != _BLANK or at == ended:
                return -1
        if at >= size or text[at] != _LINE_END:
            return -1
        at += 1
    return rows if at == size else -1


@inlined
def _after_blanks(text: NDArray[np.uint8], at: int, skipped: int) -> int:
    """Return the place after blanks, and characters that are skipped as blanks are."""
    while at < text.size and (text[at] == _BLANK or text[at] == skipped):
        at += 1
    return at


@inlined
def _number(text: NDArray[np.uint8], at: int, powers: Float) -> tuple[int, float]:
    """Return the place after a number, and its value; -1 and 0 if there is none."""
    size = text.size
    negative = at < size and text[at] == _MINUS
    if at < size and (text[at] == _MINUS or text[at] == _PLUS):
        at += 1
    whole, digits, decimals, pointed = 0.0, 0, 0, False
    while at < size:
        digit = int(text[at]) - _ZERO
        if 0 <= digit <= 9:
            whole = 10.0 * whole + digit
            digits += 1
            decimals += pointed
        elif text[at] == _POINT and not pointed:
            pointed = True
        else:
            break
        at += 1
    power = -decimals
    if digits > 0 and at < size and (text[at] | 32) == _LETTER:
        at, exponent = _exponent(text, at + 1)
        power += exponent
    if at < 0 or digits == 0 or whole >= EXACT or abs(power) >= powers.size:
        return -1, 0.0
    value = whole / powers[-power] if power < 0 else whole * powers[power]
    return at, -value if negative else value


@inlined
def _exponent(text: NDArray[np.uint8], at: int) -> tuple[int, int]:
    """Return the place after an exponent, and its value; -1 and 0 if it has no digits or many."""
    size = text.size
    negative = at < size and text[at] == _MINUS
    if at < size and (text[at] == _MINUS or text[at] == _PLUS):
        at += 1
    value, digits = 0, 0
    while at < size and 0 <= int(text[at]) - _ZERO <= 9 and digits < 5:
        value = 10 * value + int(text[at]) - _ZERO
        digits += 1
        at += 1
    if digits == 0 or digits == 5:
        return -1, 0
    return at, -value if negative else value
