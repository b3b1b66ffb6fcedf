"""Numbers of one form in columns: all numbers are read together, a character at a time."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.ingest.parsing import Float

_ZERO: Final = np.uint8(ord("0"))
_LINE_END: Final = np.uint8(ord("\n"))
#: Whole numbers up to here, and these powers of ten, are exact in double precision.
EXACT: Final = 1e15
POWERS: Final = np.array([float(f"1e{power}") for power in range(23)])
#: Most characters of an exponent without its letter and sign.
_EXPONENT: Final = 3
#: Numbers that are read together: larger arrays are allocated by the system, which costs more time.
_BLOCK: Final = 4096
#: Size of the end of a text that may be white space [bytes].
_TAIL: Final = 256
#: Digits of a mantissa that are added up together.
_TOGETHER: Final = 4
#: Turns a letter into a lower-case one.
_LOWER: Final = np.uint8(ord("a") - ord("A"))
#: Place of the sign in a number of 64 bits.
_SIGN: Final = np.uint64(63)


def numbers_of_columns(block: bytes) -> Float | None:
    r"""Read numbers that white space separates, if they are right-aligned in columns of one width.

    Parameters
    ----------
    block : bytes
        Whole lines, of which all but the last are full.

    Returns
    -------
    array, shape (numbers,), or None
        The values that `float` returns; None if the numbers are not of one form, or not valid.

    Examples
    --------
    >>> numbers_of_columns(b"  .12E-02 -.34E-02\n  .56E-02")
    array([ 0.0012, -0.0034,  0.0056])
    >>> numbers_of_columns(b"  .12E-02 -.34E-02\n  .56") is None
    True
    """
    length = len(block) - len(block[-_TAIL:]) + len(block[-_TAIL:].rstrip())
    end = block.find(b"\n", 0, length)
    size = length if end < 0 else end
    count = len(block[:size].split())
    if not count or size % count:
        return None
    width = size // count
    ended = block if block[length : length + 1] == b"\n" else block[:length] + b"\n"
    characters = np.frombuffer(ended, dtype=np.uint8, count=length + 1)
    whole = characters.size // (size + 1)
    rows = characters[: whole * (size + 1)].reshape(whole, size + 1)
    last = characters[whole * (size + 1) : -1]
    ends = np.count_nonzero(characters[:-1] == _LINE_END) + (not last.size)
    if ends != whole or (rows[:, size] != _LINE_END).any() or last.size % width:
        return None
    fields = rows[:, :size].reshape(-1, width)
    fields = np.append(fields, last.reshape(-1, width), axis=0) if last.size else fields
    touching = fields[:, 0] != ord(" ")
    touching[::count] = False
    return None if touching.any() else aligned_numbers(fields)


def aligned_numbers(fields: NDArray[np.uint8]) -> Float | None:
    """Read numbers whose points, and exponents if they have any, are at one place.

    The digits form a whole number below 1e15. It is divided by, or multiplied with, a power of ten
    up to 1e22, and so rounded once, as in `float` (Clinger 1990).

    Parameters
    ----------
    fields : array of uint8, shape (numbers, width)
        Characters of each number.

    Returns
    -------
    array, shape (numbers,), or None
        None if a number has another form, or needs more digits.

    Examples
    --------
    >>> aligned_numbers(np.array([list(b"-1.5"), list(b"  .2")], dtype=np.uint8))
    array([-1.5,  0.2])
    """
    first = fields[0].tobytes().upper()
    end, point = first.find(b"E") % (len(first) + 1), first.find(b".")
    if point >= end - 1:
        return None
    values: Float = np.empty(len(fields))
    for start in range(0, len(fields), _BLOCK):
        within = slice(start, start + _BLOCK)
        if not _read_block(fields[within], point, end, values[within]):
            return None
    return values


def _read_block(fields: NDArray[np.uint8], point: int, end: int, values: Float) -> bool:
    """Write the numbers of some fields to `values`; return False if one has another form.

    Parameters
    ----------
    point, end : int
        Places of the point, -1 if there is none, and of the exponent's letter or of the end.
    """
    places = np.ascontiguousarray(fields.T)  # all first characters, all second characters, ...
    negative = _mantissas(places[:end], point if point >= 0 else end, values)
    power = _exponents(places[end:])
    if negative is None or power is None:
        return False
    power -= end - 1 - point if point >= 0 else 0
    lowest, highest = int(power.min()), int(power.max())
    if values.max() >= EXACT or max(-lowest, highest) >= POWERS.size:
        return False
    scale = POWERS[np.abs(power)]
    if highest <= 0:
        values /= scale
    else:
        values[:] = np.where(power < 0, values / scale, values * scale)
    values.view(np.uint64)[:] |= negative.astype(np.uint64) << _SIGN
    return True


def _mantissas(places: NDArray[np.uint8], point: int, sizes: Float) -> NDArray[np.bool_] | None:
    """Write the digits as whole numbers; return True for each with a minus, or None if invalid.

    Before the point come blanks, a sign or none, and digits; the last place has a digit.
    """
    before, after = places[:point], places[point + 1 :]
    minus = before == ord("-")
    sign = minus | (before == ord("+"))
    added = -(point + len(after)) % _TOGETHER
    digits = np.zeros((added + point + len(after), places.shape[1]), dtype=np.uint8)
    np.subtract(before, _ZERO, out=digits[added : added + point])
    np.subtract(after, _ZERO, out=digits[added + point :])
    is_digit = digits[added:] < 10
    order = sign.view(np.uint8) + 2 * is_digit[:point].view(np.uint8)  # 0 for a blank
    plain = is_digit[:point] | sign | (before == ord(" "))
    rising = (order[1:] >= order[:-1]) & ~(sign[1:] & sign[:-1])
    right = plain.all() and rising.all() and is_digit[point:].all() and is_digit[-1].all()
    if not right or (places[point : point + 1] != ord(".")).any():
        return None
    digits[added : added + point] *= is_digit[:point]
    # The types of two and of four digits are the smallest ones: arrays stay in the cache.
    twos = digits[::2] * np.uint8(10) + digits[1::2]
    fours = twos[::2] * np.uint16(100) + twos[1::2]
    sizes[:] = fours[0]
    for four in fours[1:]:
        sizes *= 10.0**_TOGETHER
        sizes += four
    return np.asarray(np.logical_or.reduce(minus))


def _exponents(places: NDArray[np.uint8]) -> NDArray[np.int16] | None:
    """Return the numbers after the E, or one zero if there are none."""
    if not len(places):
        return np.zeros(1, dtype=np.int16)
    letters, signs, digits = places[0], places[1:2], places[2:] - _ZERO
    if not 1 <= len(digits) <= _EXPONENT:
        return None
    minus = signs[0] == ord("-")
    right = (letters | _LOWER) == ord("e")
    right &= minus | (signs[0] == ord("+"))
    if not right.all() or (digits > 9).any():
        return None
    size = digits[0].astype(np.int16)
    for digit in digits[1:]:
        size *= 10
        size += digit
    size *= 1 - 2 * minus.view(np.int8)
    return np.asarray(size)
