"""Numbers of one form in columns: all numbers are read together, a character at a time."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.ingest.parsing import Float

_ZERO: Final = np.uint8(ord("0"))
_LINE_END: Final = np.uint8(ord("\n"))
#: Whole numbers up to here, and these powers of ten, are exact in double precision.
_LARGEST: Final = 1e15
_POWERS: Final = np.array([float(f"1e{power}") for power in range(23)])
#: Most characters of an exponent without its letter and sign.
_EXPONENT: Final = 3


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
    block = block.rstrip()
    end = block.find(b"\n")
    size = len(block) if end < 0 else end
    count = len(block[:size].split())
    if not count or size % count:
        return None
    width = size // count
    characters = np.frombuffer(block + b"\n", dtype=np.uint8)  # the last full line lost its end
    whole = characters.size // (size + 1)
    rows = characters[: whole * (size + 1)].reshape(whole, size + 1)
    last = characters[whole * (size + 1) : -1]
    if (rows[:, size] != _LINE_END).any() or (rows[:, :size] == _LINE_END).any():
        return None
    if last.size % width or (last == _LINE_END).any():
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
    places = np.ascontiguousarray(fields.T)  # all first characters, all second characters, ...
    first = fields[0].tobytes().upper()
    end, point = first.find(b"E") % (len(first) + 1), first.find(b".")
    if point == end - 1:
        return None
    signed = _mantissas(places[:end], point if point >= 0 else end)
    power = _exponents(places[end:])
    if signed is None or power is None:
        return None
    sizes, negative = signed
    power = power - (end - 1 - point if point >= 0 else 0)
    if sizes.max() >= _LARGEST or np.abs(power).max() >= _POWERS.size:
        return None
    scale = _POWERS[np.abs(power)]
    values: Float = sizes / scale
    if power.max() > 0:
        values = np.where(power < 0, values, sizes * scale)
    np.negative(values, out=values, where=negative)
    return values


def _mantissas(places: NDArray[np.uint8], point: int) -> tuple[Float, NDArray[np.bool_]] | None:
    """Return the digits as whole numbers, and True for each number with a minus.

    Before the point come blanks, a sign or none, and digits; the last place has a digit.
    """
    before, after = places[:point], places[point + 1 :]
    minus = before == ord("-")
    sign = minus | (before == ord("+"))
    digits = np.concatenate([before, after]) - _ZERO
    is_digit = digits < 10
    order = sign.view(np.uint8) + 2 * is_digit[:point].view(np.uint8)  # 0 for a blank
    plain = is_digit[:point] | sign | (before == ord(" "))
    rising = (order[1:] >= order[:-1]) & ~(sign[1:] & sign[:-1])
    right = plain.all() and rising.all() and is_digit[point:].all() and is_digit[-1].all()
    if not right or (places[point : point + 1] != ord(".")).any():
        return None
    digits[:point][~is_digit[:point]] = 0
    weights = 10.0 ** np.arange(len(digits))[::-1]
    sizes = weights @ digits.astype(np.float64)
    return np.asarray(sizes), np.asarray(minus.any(axis=0))


def _exponents(places: NDArray[np.uint8]) -> NDArray[np.int16] | None:
    """Return the numbers after the E, or one zero if there are none."""
    if not len(places):
        return np.zeros(1, dtype=np.int16)
    letters, *rest = places
    if not 2 <= len(rest) <= 1 + _EXPONENT:
        return None
    digits = np.array(rest[1:]) - _ZERO
    minus = rest[0] == ord("-")
    letter = (letters == ord("E")) | (letters == ord("e"))
    if not ((minus | (rest[0] == ord("+"))) & letter).all() or (digits > 9).any():
        return None
    size = digits[0].astype(np.int16)
    for digit in digits[1:]:
        size = 10 * size + digit
    return np.asarray(np.where(minus, -size, size))
