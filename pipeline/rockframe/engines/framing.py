"""Messages over a pipe: eight bytes of length, then the bytes."""

from __future__ import annotations

import struct
from typing import IO, Final

_LENGTH: Final = struct.Struct("<Q")


def put(stream: IO[bytes], message: bytes) -> None:
    """Write a message and flush.

    Raises
    ------
    OSError
        If nobody reads any more.

    Examples
    --------
    >>> import io
    >>> pipe = io.BytesIO()
    >>> put(pipe, b"rocking")
    >>> _ = pipe.seek(0)
    >>> take(pipe)
    b'rocking'
    """
    stream.write(_LENGTH.pack(len(message)))
    stream.write(message)
    stream.flush()


def take(stream: IO[bytes]) -> bytes:
    """Read a message.

    Raises
    ------
    EOFError
        If the stream ends before its end.
    """
    (length,) = _LENGTH.unpack(_exactly(stream, _LENGTH.size))
    return _exactly(stream, length)


def _exactly(stream: IO[bytes], count: int) -> bytes:
    data = stream.read(count)
    if len(data) < count:
        raise EOFError
    return data
