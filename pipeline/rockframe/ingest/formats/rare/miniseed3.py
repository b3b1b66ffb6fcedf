"""miniSEED 3 as miniSEED 2: the same samples in data records of the older header.

A data record of miniSEED 3 has a header of 40 bytes, a source identifier such as
``FDSN:CI_CCC__H_N_E``, extra headers, and samples in one of the encodings of miniSEED 2. Numbers
are little-endian except in Steim's compression.

Source: FDSN, miniSEED 3 specification, https://docs.fdsn.org/projects/miniseed3.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from rockframe.errors import InputError

#: Fixed header: flags, time (nanosecond, year, day, hour, minute, second), encoding, rate, number
#: of samples, checksum, version, length of identifier, of extra headers, and of samples [bytes].
_HEADER: Final = struct.Struct("<2sBBIHHBBBBdIIBBHI")
_CHECKSUM: Final = slice(28, 32)
#: Encodings that miniSEED 2 has too, and whether their numbers are little-endian.
_ENCODINGS: Final = {1: True, 3: True, 4: True, 5: True, 10: False, 11: False}
#: Bytes before the samples in miniSEED 2.
_BEFORE: Final = 64
_LARGEST_POWER: Final = 20
_CASTAGNOLI: Final = 0x82F63B78


def _crc_table() -> list[int]:
    table = []
    for byte in range(256):
        for _ in range(8):
            byte = byte >> 1 ^ (_CASTAGNOLI if byte & 1 else 0)
        table.append(byte)
    return table


@dataclass(frozen=True)
class _Piece:
    """A data record of miniSEED 3: its header values, identifier, and samples."""

    time: tuple[int, int, int, int, int, int]
    encoding: int
    rate: float
    count: int
    codes: tuple[str, str, str, str]
    payload: bytes


def converted(path: Path, data: bytes) -> bytes:
    r"""Return the data records of miniSEED 2 with the samples of a miniSEED 3 file.

    Raises
    ------
    InputError
        If a data record is cut off or its checksum differs, or if it has an identifier, an encoding
        or a size that miniSEED 2 cannot hold.

    Examples
    --------
    >>> converted(Path("a.ms3"), b"MS\x03")
    Traceback (most recent call last):
    rockframe.errors.InputError: a.ms3: the record at byte 0 is cut off: 3 of 40 bytes.
    """
    return b"".join(_older(path, number, piece) for number, piece in enumerate(_pieces(path, data)))


def _pieces(path: Path, data: bytes) -> Iterator[_Piece]:
    table = _crc_table()
    start = 0
    while start < len(data):
        rest = len(data) - start
        if rest < _HEADER.size:
            message = f"the record at byte {start} is cut off: {rest} of {_HEADER.size} bytes."
            raise InputError(path, message)
        values = _HEADER.unpack_from(data, start)
        mark, version, _, nano, year, day, hour, minute, second = values[:9]
        encoding, rate, count, checksum, _, of_code, of_extra, of_samples = values[9:]
        if mark != b"MS" or version != 3:
            raise InputError(path, f"no miniSEED 3 header at byte {start}: the file is corrupted.")
        length = _HEADER.size + of_code + of_extra + of_samples
        if rest < length:
            raise InputError(
                path, f"the record at byte {start} is cut off: {rest} of {length} bytes."
            )
        record = bytearray(data[start : start + length])
        record[_CHECKSUM] = bytes(4)
        if _crc(table, bytes(record)) != checksum:
            raise InputError(
                path, f"the record at byte {start} is corrupted: its checksum differs."
            )
        code = data[start + _HEADER.size : start + _HEADER.size + of_code]
        yield _Piece(
            (year, day, hour, minute, second, nano),
            encoding,
            rate,
            count,
            _codes(path, code.decode("ascii", "replace")),
            data[start + length - of_samples : start + length],
        )
        start += length


def _crc(table: list[int], data: bytes) -> int:
    """Return CRC-32C."""
    value = 0xFFFFFFFF
    for byte in data:
        value = table[(value ^ byte) & 0xFF] ^ value >> 8
    return value ^ 0xFFFFFFFF


def _codes(path: Path, identifier: str) -> tuple[str, str, str, str]:
    """Return network, station, location and channel of `FDSN:NET_STA_LOC_BAND_SOURCE_SUB`."""
    name, _, rest = identifier.partition(":")
    parts = rest.split("_")
    if name == "FDSN" and len(parts) == 6:
        network, station, location = parts[:3]
        codes = (network, station, location, "".join(parts[3:]))
        fits = all(len(code) <= most for code, most in zip(codes, (2, 5, 2, 3), strict=True))
        if fits and all(code.isascii() for code in codes):
            return codes
    message = f"source identifier {identifier[:60]!r}. Must be codes of at most 2, 5, 2 and 3"
    raise InputError(path, f"{message} characters, as in 'FDSN:CI_CCC__H_N_E'.")


def _older(path: Path, number: int, piece: _Piece) -> bytes:
    """Return a data record of miniSEED 2."""
    if piece.encoding not in _ENCODINGS:
        allowed = ", ".join(map(str, _ENCODINGS))
        raise InputError(path, f"encoding {piece.encoding} of samples. Must be one of: {allowed}.")
    rate = piece.rate if piece.rate > 0.0 else -1.0 / piece.rate if piece.rate < 0.0 else 0.0
    if not 0.0 < rate < 32_000.0 or piece.count > 0xFFFF:
        message = f"record {number + 1} has {piece.count} samples at {rate:g} Hz."
        raise InputError(path, f"{message} Must be at most 65535, at less than 32000 Hz.")
    power = max(7, int(np.ceil(np.log2(_BEFORE + len(piece.payload)))))
    if power > _LARGEST_POWER:
        raise InputError(path, f"record {number + 1} has {len(piece.payload)} bytes of samples.")
    year, day, hour, minute, second, nano = piece.time
    network, station, location, channel = piece.codes
    micro = round(nano / 1000.0)
    parts, rest = divmod(micro, 100)
    little = _ENCODINGS[piece.encoding]
    samples = piece.payload
    if little:  # the older header states one order for header and samples
        samples = _swapped(piece.payload, {1: 2, 3: 4, 4: 4, 5: 8}[piece.encoding])
    factor, multiplier = _rational(rate)
    header = f"{(number + 1) % 1_000_000:06d}D {station:<5}{location:<2}{channel:<3}{network:<2}"
    fixed = struct.pack(
        ">HHBBBxHHhhBBBBiHH",
        *(year, day, hour, minute, second, min(parts, 9999), piece.count, factor, multiplier),
        *(0, 0, 0, 2, 0, _BEFORE, 48),
    )
    blockettes = struct.pack(">HHBBBB", 1000, 56, piece.encoding, 1, power, 0)
    blockettes += struct.pack(">HHBbBB", 1001, 0, 0, rest, 0, 0)
    record = header.encode("ascii") + fixed + blockettes + samples
    return record.ljust(2**power, b"\0")


def _swapped(payload: bytes, size: int) -> bytes:
    whole = payload[: len(payload) // size * size]
    return np.frombuffer(whole, dtype=f"<u{size}").byteswap().tobytes()


def _rational(rate: float) -> tuple[int, int]:
    """Return factor and multiplier of a rate [Hz] in a header of miniSEED 2."""
    if rate == round(rate):
        return round(rate), 1
    if 1.0 / rate == round(1.0 / rate) and 1.0 / rate < 32_000.0:
        return -round(1.0 / rate), 1
    for divisor in (10, 100, 1000, 10_000):
        if rate * divisor == round(rate * divisor) and rate * divisor < 32_000.0:
            return round(rate * divisor), -divisor
    divisor = max(1, int(32_000.0 / rate))
    return round(rate * divisor), -divisor
