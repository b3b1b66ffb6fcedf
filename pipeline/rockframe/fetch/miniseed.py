"""Read received miniSEED, and reject it if it is truncated or corrupted."""

from __future__ import annotations

import re
import struct
import warnings
from io import BytesIO
from typing import Final

from rockframe.errors import InputError
from rockframe.fetch.answers import one_line
from rockframe.fetch.obspy_parts import (
    ObsPyException,
    Stream,
    get_record_information,
    read,
)

#: Sequence number, quality, a reserved byte, and the codes of the channel.
_HEADER: Final = re.compile(rb"[0-9 \0]{6}[DRQM][ \0][A-Za-z0-9 ]{12}")


def read_whole(name: str, body: bytes) -> Stream:
    """Read miniSEED, and reject it if it is truncated or corrupted.

    Returns
    -------
    obspy.Stream

    Raises
    ------
    InputError
        If it is not miniSEED, ends within a record, or its samples cannot be unpacked.

    Examples
    --------
    >>> read_whole("CI.CLC.--.HNE.mseed", b"<html>")
    Traceback (most recent call last):
    rockframe.errors.InputError: CI.CLC.--.HNE.mseed: no sound miniSEED record at byte 0 of 6. \
Must be whole records.
    """
    offset = 0
    while offset < len(body):
        length = _record_length(body, offset)
        if length <= 0:
            raise InputError(
                name,
                f"no sound miniSEED record at byte {offset} of {len(body)}. Must be whole records.",
            )
        offset += length
    if offset > len(body):
        raise InputError(
            name,
            f"truncated: the last record ends at byte {offset}, the data at {len(body)}. "
            "Must be whole records.",
        )
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", UserWarning)
            return read(BytesIO(body), format="MSEED")
    except (ObsPyException, UserWarning, ValueError, TypeError) as error:
        words = one_line(str(error))
        raise InputError(
            name, f"samples cannot be unpacked ({words}). Must be sound miniSEED."
        ) from error


def _record_length(body: bytes, offset: int) -> int:
    """Return the length of the record at an offset [bytes], or 0 if none starts there."""
    head = body[offset : offset + 64]  # fixed header, and the blockette with the length
    if len(head) < 64 or not _HEADER.match(head):
        return 0
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", UserWarning)
            return int(get_record_information(BytesIO(body), offset=offset)["record_length"])
    except (ValueError, KeyError, OSError, ObsPyException, UserWarning, struct.error):
        return 0
