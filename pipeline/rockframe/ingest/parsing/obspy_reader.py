"""Read bytes with the readers of obspy, and turn their exceptions into an InputError."""

from __future__ import annotations

import struct
import warnings
from io import BytesIO
from pathlib import Path
from typing import Any, Final

from rockframe.errors import InputError

#: Exceptions that the readers of obspy raise on corrupted files, in addition to those of obspy:
#: invalid numbers, truncated headers, sizes that overflow, undecodable text.
_JUNK: Final = (
    ValueError,
    LookupError,
    TypeError,
    AttributeError,
    ArithmeticError,
    AssertionError,
    NotImplementedError,
    MemoryError,
    EOFError,
    OSError,
    struct.error,
)


def read_stream(path: Path, data: bytes, obspy_name: str) -> Any:
    """Return the obspy stream in the bytes of a file.

    Parameters
    ----------
    obspy_name : str
        Format in obspy. Without it, obspy would also try to unpickle the file.

    Returns
    -------
    obspy.Stream

    Raises
    ------
    InputError
        If obspy raises an error or a warning; the message quotes obspy.

    Examples
    --------
    >>> read_stream(Path("a.EW"), b"Memo.", "KNET")
    Traceback (most recent call last):
    rockframe.errors.InputError: a.EW: obspy's KNET reader failed: KNETException: ...
    """
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        from obspy import read

        try:
            stream = read(BytesIO(data), format=obspy_name)
        except Exception as error:
            # obspy has classes of its own, and libmseed raises bare Exceptions. Any other class is
            # an internal error.
            bare = type(error) is Exception
            own = type(error).__module__.startswith("obspy.")
            if not (bare or own or isinstance(error, _JUNK)):
                raise
            said = str(error) if bare else f"{type(error).__name__}: {error}"
            raise _failed(path, obspy_name, said) from error
    for warning in caught:
        if issubclass(warning.category, UserWarning):
            raise _failed(path, obspy_name, str(warning.message))
    return stream


def quakeml_events(path: Path, data: bytes) -> Any:
    """Return the events of a QuakeML document, as obspy's; ValueError if it cannot be read."""
    if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
        raise InputError(path, "XML with a document type is not read. Save it as plain QuakeML.")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from obspy import read_events

        try:
            return read_events(BytesIO(data), format="QUAKEML")
        except Exception as error:  # lxml and obspy raise classes of their own
            raise ValueError(str(error)) from error


def _failed(path: Path, obspy_name: str, words: str) -> InputError:
    shown = " ".join(words.split())[:160]
    return InputError(path, f"obspy's {obspy_name} reader failed: {shown}.")
