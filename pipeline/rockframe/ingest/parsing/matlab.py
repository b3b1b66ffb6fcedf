"""Numeric arrays of MATLAB files of version 5 to 7.

A file is a header of 128 bytes and then elements, each of which is a matrix, or a compressed one.
All lengths are checked against the bytes that are there, because a damaged file must not end the
process: readers in compiled code may trust them.
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

#: Length of the header, and where the order of bytes is stated in it.
_HEADER, _ORDER = 128, 126
#: Types of elements.
_MATRIX, _COMPRESSED = 14, 15
#: Types of numbers, as NumPy names them.
_NUMBERS: Final = {
    **{1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4"},
    **{7: "f4", 9: "f8", 12: "i8", 13: "u8"},
}
#: First and last class of numeric matrices that are not sparse; the bit of complex numbers.
_NUMERIC, _COMPLEX = (6, 15), 0x0800


class _Element(NamedTuple):
    """An element: the type that it states, and its bytes."""

    type: int
    data: memoryview


def numeric_arrays(data: bytes, largest: int) -> dict[str, NDArray[Any]]:
    """Return the real numeric arrays of a file by their names; others are left out.

    Parameters
    ----------
    data : bytes
        The file, with its header.
    largest : int
        Limit of all expanded elements together [bytes].

    Raises
    ------
    ValueError
        If the file is damaged, or its arrays are larger than the limit.

    Notes
    -----
    The format is that of MathWorks, MAT-File Format (R2023b), chapter 1.

    Examples
    --------
    >>> import io
    >>> from scipy.io import savemat
    >>> file = io.BytesIO()
    >>> savemat(file, {"acc": [1.0, 2.0], "name": "north"})
    >>> numeric_arrays(file.getvalue(), 1000)
    {'acc': array([[1., 2.]])}
    """
    order = {b"IM": "<", b"MI": ">"}.get(data[_ORDER:_HEADER], "")
    if not order:
        raise ValueError("the header states no order of bytes")
    arrays, left = {}, largest
    for element in _elements(memoryview(data)[_HEADER:], order):
        left -= len(element.data)
        expanded = b""
        if element.type == _COMPRESSED:
            expanded = zlib.decompressobj().decompress(element.data, max(left, 0) + 1)
            left -= len(expanded)
        if left < 0:
            raise ValueError(f"arrays of more than {largest} bytes. Must be at most {largest}")
        matrix = next(_elements(memoryview(expanded), order), element)
        if matrix.type == _MATRIX and (named := _array(matrix.data, order)):
            arrays[named[0]] = named[1]
    return arrays


def _elements(data: memoryview, order: str) -> Iterator[_Element]:
    """Yield the elements one after another; each begins at a multiple of 8 bytes."""
    place = 0
    while place < len(data):
        if len(data) - place < 8:
            raise ValueError("it ends within an element")
        kind, size = struct.unpack_from(f"{order}2I", data, place)
        start = place + 8
        if kind >> 16:  # a short element has its length, its type and its data in 8 bytes
            kind, size, start = kind & 0xFFFF, kind >> 16, place + 4
        if size > (len(data) - start if start == place + 8 else 4):
            raise ValueError("it ends within an element")
        yield _Element(kind, data[start : start + size])
        aligned = size if kind == _COMPRESSED else -8 * (-size // 8)
        place = start + aligned if start == place + 8 else place + 8


def _array(data: memoryview, order: str) -> tuple[str, NDArray[Any]] | None:
    """Return the name and the values of a matrix; None if it is not real and numeric."""
    parts = _elements(data, order)
    flags, sizes = next(parts, None), next(parts, None)
    name, values = next(parts, None), next(parts, None)
    if flags is None or len(flags.data) < 4:
        raise ValueError("a matrix states no class")
    (flag,) = struct.unpack_from(f"{order}I", flags.data)
    if not _NUMERIC[0] <= flag & 0xFF <= _NUMERIC[1] or flag & _COMPLEX:
        return None
    if sizes is None or name is None or values is None or values.type not in _NUMBERS:
        raise ValueError("a numeric matrix has no numbers")
    shape = _numbers(sizes._replace(type=5), order).tolist()
    numbers = _numbers(values, order)
    if min(shape, default=-1) < 0 or numbers.size != math.prod(shape):
        raise ValueError(f"{numbers.size} numbers in an array of shape {shape}")
    return bytes(name.data).decode("latin-1"), numbers.reshape(shape, order="F")


def _numbers(element: _Element, order: str) -> NDArray[Any]:
    stated = np.dtype(_NUMBERS[element.type]).newbyteorder(order)  # type: ignore[arg-type]
    values = np.frombuffer(element.data, stated)
    return values.astype(stated.newbyteorder("="))
