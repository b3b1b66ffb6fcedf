"""Bytes through one of obspy's own readers; what these raise on junk becomes our error here."""

from __future__ import annotations

import struct
import warnings
from io import BytesIO
from pathlib import Path
from typing import Any, Final

from rockframe.errors import InputError

#: What obspy's readers are seen to raise on damaged files, beside their own exceptions: numbers
#: that are none, headers that end too soon, sizes that overflow, bytes that are no text.
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
    """Read a file's bytes with one named reader of obspy.

    Parameters
    ----------
    path : Path
        The file, for the error; it is not opened.
    data : bytes
        Its contents.
    obspy_name : str
        The reader, as obspy names it. Left to itself, obspy would try pickles too.

    Returns
    -------
    obspy.Stream

    Raises
    ------
    InputError
        With obspy's words, if it cannot read them or warns of them.

    Examples
    --------
    >>> read_stream(Path("a.EW"), b"Memo.", "KNET")
    Traceback (most recent call last):
    rockframe.errors.InputError: a.EW: obspy's KNET reader fails (KNETException: ...
    """
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        from obspy import read
        from obspy.core.util.obspy_types import ObsPyException
        from obspy.io.nied.knet import KNETException

        try:
            stream = read(BytesIO(data), format=obspy_name)
        except (*_JUNK, ObsPyException, KNETException) as error:
            raise _failed(path, obspy_name, f"{type(error).__name__}: {error}") from error
        except Exception as error:
            # libmseed's errors come as the bare class; anything more special is a bug.
            if type(error) is not Exception:
                raise
            raise _failed(path, obspy_name, str(error)) from error
    for warning in caught:
        if issubclass(warning.category, UserWarning):
            raise _failed(path, obspy_name, str(warning.message))
    return stream


def _failed(path: Path, obspy_name: str, words: str) -> InputError:
    shown = " ".join(words.split())[:160]
    return InputError(
        path, f"obspy's {obspy_name} reader fails ({shown}). Must be an undamaged file."
    )
