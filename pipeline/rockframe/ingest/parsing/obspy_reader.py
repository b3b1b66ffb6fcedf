"""Read bytes with the readers of obspy, and turn their exceptions into an InputError."""

from __future__ import annotations

import os
import struct
import warnings
from collections.abc import Callable
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

#: Warnings of obspy that do not concern samples and calibration: settings of a trigger, numbers as
#: names of channels, and a start time that `recorders` leaves unknown.
_HARMLESS: Final = (
    "Unmatched raw value",
    "No channel code specified in the data file",
    "Non-zero value found in Trace's 'DELAY' field",
    "Many companies use custom defined SEG2 header variables",
)
#: Size of a block of GCF [bytes], and kinds of packets of a REF TEK 130.
_BLOCK_GCF: Final = 16
_PACKETS: Final = frozenset([b"AD", b"CD", b"DS", b"DT", b"EH", b"ET", b"OM", b"SC", b"SH", b"FD"])


def read_stream(path: Path, data: bytes | Path, obspy_name: str) -> Any:
    """Return the obspy stream in a file.

    Parameters
    ----------
    data : bytes or Path
        Contents of the file, or a copy of it.
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
            source = str(data) if isinstance(data, Path) else BytesIO(data)
            stream = read(source, format=obspy_name)
        except Exception as error:
            # obspy has classes of its own, and libmseed raises bare Exceptions. Any other class is
            # an internal error.
            bare = type(error) is Exception
            own = type(error).__module__.startswith("obspy.")
            if not (bare or own or isinstance(error, _JUNK)):
                raise
            said = str(error) if bare else f"{type(error).__name__}: {error}"
            raise _failed(path, obspy_name, _without_folder(said, data)) from error
    for warning in caught:
        harmless = any(words in str(warning.message) for words in _HARMLESS)
        if issubclass(warning.category, UserWarning) and not harmless:
            raise _failed(path, obspy_name, _without_folder(str(warning.message), data))
    return stream


def is_evt(head: bytes) -> bool:
    r"""Return True if a file begins with the tag of a Kinemetrics EVT file.

    Examples
    --------
    >>> is_evt(b"K\x01\x01\x09\x00\x00"), is_evt(b"KP")
    (True, False)
    """
    return head[:1] == b"K" and head[1:2] in (b"\0", b"\1") and head[2:3] == b"\1"


def is_gcf(head: bytes) -> bool:
    """Return True if a file begins with a block of Guralp's compressed format, with its rate.

    Examples
    --------
    >>> is_gcf(bytes(1024))
    False
    """
    if len(head) < _BLOCK_GCF or b"\0" not in head[:1024]:  # a text
        return False
    system, stream = struct.unpack_from(">II", head)
    ttl, rate, kind, count = head[12:16]
    words = count * {1: 4, 2: 2, 4: 1}.get(kind & 0b111, 0)
    plain = system and stream and 0 < rate <= 250 and ttl < 128 and 0 < count <= 250
    return bool(plain and words and _base_36(stream & 0x7FFFFFFF)) and _adds_up_gcf(head)


def _adds_up_gcf(head: bytes) -> bool:
    """Return True if first value and differences of a block add up to its last value."""
    kind, count = head[14] & 0b111, head[15]
    if len(head) < _BLOCK_GCF + 4 * count + 8:
        return True  # cut, which the reader reports
    places = {1: "i", 2: "h", 4: "b"}
    first, *differences, last = struct.unpack_from(f">i{count * kind}{places[kind]}i", head, 16)
    return bool((first + sum(differences) - last) % 2**32 == 0)


def _base_36(number: int) -> bool:
    """Return True if a number in base 36 has the six characters of a stream of GCF."""
    return 36**5 <= number < 36**6


def is_reftek(head: bytes) -> bool:
    """Return True if a file begins with packets of a REF TEK 130.

    Examples
    --------
    >>> is_reftek(b"EH" + bytes(1022)), is_reftek(b"EH")
    (True, False)
    """
    kinds = [head[start : start + 2] for start in range(0, len(head) - 1, 1024)]
    return len(head) >= 1024 and all(kind in _PACKETS for kind in kinds)


def is_seg2(head: bytes) -> bool:
    r"""Return True if a file begins like SEG-2, revision 1, in either order of bytes.

    Examples
    --------
    >>> is_seg2(b"\x55\x3a\x01\x00"), is_seg2(b"\x55\x3a\x02\x00")
    (True, False)
    """
    return head[:4] in (b"\x55\x3a\x01\x00", b"\x3a\x55\x00\x01")


def is_gse2(head: bytes) -> bool:
    r"""Return True if a line at the top of a text is the header of a GSE2 waveform.

    Examples
    --------
    >>> is_gse2(b"WID2 2005/08/31"), is_gse2(b"BEGIN GSE2.0\nWID2 2005/08/31")
    (True, True)
    """
    return head.startswith((b"WID2 ", b"BEGIN GSE2")) and b"WID2 " in head[:2048]


def is_gse1(head: bytes) -> bool:
    """Return True if a file begins like a GSE1 waveform."""
    return head.startswith((b"WID1 ", b"XW01")) and b"WID1 " in head[:1024]


def is_slist(head: bytes) -> bool:
    """Return True if a file begins like a list of samples of IRIS (SLIST)."""
    return head.startswith(b"TIMESERIES ") and b", SLIST," in head.split(b"\n", 1)[0]


def is_tspair(head: bytes) -> bool:
    """Return True if a file begins like pairs of time and sample of IRIS (TSPAIR)."""
    return head.startswith(b"TIMESERIES ") and b", TSPAIR," in head.split(b"\n", 1)[0]


def is_seisan(head: bytes) -> bool:
    """Return True if a file begins with Fortran records of 80 characters, as SEISAN writes them."""
    if len(head) < 960:
        return False
    short = head[:2] == b"KP" and head[82:83] == b"P"
    word = head[:4] in (b"\0\0\0P", b"P\0\0\0") and head[84:88] == head[:4]
    wide = head[:8] in (bytes(7) + b"P", b"P" + bytes(7)) and head[88:96] == head[:8]
    return short or word or wide


def is_win(head: bytes) -> bool:
    """Return True if a file begins with a block of WIN, whose time is coded in decimal digits.

    Examples
    --------
    >>> is_win(bytes(18))
    False
    """
    if len(head) < 18 or b"\0" not in head[:1024]:
        return False
    size, parts = struct.unpack_from(">I", head)[0], [f"{byte:02x}" for byte in head[4:10]]
    if not all(part.isdigit() for part in parts) or not 18 <= size < 1 << 24:
        return False
    _, month, day, hour, minute, second = map(int, parts)
    rate = (head[12] & 0x0F) << 8 | head[13]
    valid = 1 <= month <= 12 and 1 <= day <= 31 and hour < 24 and minute < 60 and second < 60
    return valid and head[12] >> 4 <= 4 and 1 <= rate <= 2000


#: Recorders whose files begin with no mark of their own: other formats are asked first.
UNMARKED: Final = frozenset(["gcf", "win"])
#: Formats that obspy decodes and this package converts: name, name of the one reader of obspy,
#: description, usual extensions, and the function that recognises a file.
RECORDERS: Final[tuple[tuple[str, str, str, str, Callable[[bytes], bool]], ...]] = (
    ("evt", "KINEMETRICS_EVT", "Kinemetrics EVT, by the calibration of its header", ".evt", is_evt),
    ("gcf", "GCF", "Guralp compressed format", ".gcf", is_gcf),
    ("reftek", "REFTEK130", "REF TEK 130", ".rt130", is_reftek),
    ("seg2", "SEG2", "SEG-2", ".seg2", is_seg2),
    ("gse2", "GSE2", "GSE2", ".gse2", is_gse2),
    ("gse1", "GSE1", "GSE1", ".gse1", is_gse1),
    ("slist", "SLIST", "lists of samples of IRIS", ".ascii", is_slist),
    ("tspair", "TSPAIR", "pairs of time and sample of IRIS", ".ascii", is_tspair),
    ("seisan", "SEISAN", "SEISAN", ".seisan", is_seisan),
    ("win", "WIN", "WIN and WIN32 (Japan)", ".win", is_win),
)


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


def _without_folder(words: str, data: bytes | Path) -> str:
    """Return a message without the folder of the copy that obspy read."""
    return words.replace(f"{data.parent}{os.sep}", "") if isinstance(data, Path) else words


def _failed(path: Path, obspy_name: str, words: str) -> InputError:
    shown = " ".join(words.split())[:160]
    return InputError(path, f"obspy's {obspy_name} reader failed: {shown.rstrip('.')}.")
