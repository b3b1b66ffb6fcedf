"""The readers as obspy waveform plug-ins: `obspy.read("RSN77.AT2", format="PEERAT2")`.

Traces hold accelerations in m s-2; what obspy has no place for stands in `stats.peerat2`,
`stats.csmipv1` and `stats.acctext`. This file alone imports obspy.
"""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import BinaryIO, Final

import numpy as np

from rockframe.errors import InputError
from rockframe.ingest.options import ReadOptions
from rockframe.ingest.reading import read_file
from rockframe.ingest.registry import FORMATS, HEAD, Format, read_bytes, sniff_format
from rockframe.record import Record

with warnings.catch_warnings():
    # obspy 1.5 looks up its entry points in a way that Python 3.11 deprecates.
    warnings.simplefilter("ignore", DeprecationWarning)
    from obspy import Stream, Trace, UTCDateTime
    from obspy.core import AttribDict

Source = str | Path | BinaryIO

_BY_NAME: Final = {known.name: known for known in FORMATS}
_PEER_AT2: Final = _BY_NAME["peer_at2"]
_CSMIP_V1: Final = _BY_NAME["csmip_v1"]
_TEXT: Final = _BY_NAME["acceleration_text"]
#: Longest station code of SEED; a longer one is a name, and stands in the format's own stats.
_LONGEST_STATION: Final = 5


def is_peer_at2(file: Source) -> bool:
    """Whether a file is a PEER file.

    Parameters
    ----------
    file : str, Path or binary stream
        Read up to 4096 bytes; a stream is left where it was.

    Examples
    --------
    >>> from io import BytesIO
    >>> is_peer_at2(BytesIO(b"3 0.01 NPTS, DT"))
    True
    """
    return _is(file, _PEER_AT2)


def read_peer_at2(file: Source, headonly: bool = False, **_: object) -> Stream:
    r"""Read a PEER AT2 file into a stream of one trace.

    Parameters
    ----------
    file : str, Path or binary stream
        The file.
    headonly : bool
        Leave out the samples.

    Raises
    ------
    InputError
        As `rockframe.ingest.peer_at2.read`.

    Examples
    --------
    >>> from io import BytesIO
    >>> lines = b"PEER\nTITLE\nACCELERATION TIME SERIES IN UNITS OF G\n2 .01 NPTS, DT\n .1 -.2"
    >>> read_peer_at2(BytesIO(lines))[0].data
    array([ 0.981, -1.962])
    """
    return _stream(file, _PEER_AT2, ReadOptions(), headonly)


def is_csmip_v1(file: Source) -> bool:
    """Whether a file is a CSMIP volume 1 file.

    Parameters
    ----------
    file : str, Path or binary stream
        Read up to 4096 bytes; a stream is left where it was.

    Examples
    --------
    >>> from io import BytesIO
    >>> is_csmip_v1(BytesIO(b"Corrected accelerogram"))
    False
    """
    return _is(file, _CSMIP_V1)


def read_csmip_v1(file: Source, headonly: bool = False, **_: object) -> Stream:
    """Read a CSMIP volume 1 file into a stream of one trace a channel.

    Parameters
    ----------
    file : str, Path or binary stream
        The file.
    headonly : bool
        Leave out the samples.

    Raises
    ------
    InputError
        As `rockframe.ingest.csmip_v1.read`.

    Examples
    --------
    >>> from io import BytesIO
    >>> read_csmip_v1(BytesIO(b"Corrected accelerogram"))
    Traceback (most recent call last):
    rockframe.errors.InputError: stream:1: 'Corrected accelerogram'. Must be 'Uncorrected ...
    """
    return _stream(file, _CSMIP_V1, ReadOptions(), headonly)


def is_text(file: Source) -> bool:
    r"""Whether a file is a table of one or two columns of numbers.

    Parameters
    ----------
    file : str, Path or binary stream
        Read up to 4096 bytes; a stream is left where it was.

    Examples
    --------
    >>> from io import BytesIO
    >>> is_text(BytesIO(b"time_s,acc_g\n0.00,0.1\n0.01,0.2\n"))
    True
    """
    return _is(file, _TEXT)


def read_text(
    file: Source,
    headonly: bool = False,
    units: str | None = None,
    time_step: float | None = None,
    **_: object,
) -> Stream:
    r"""Read a number table into a stream of one trace.

    Parameters
    ----------
    file : str, Path or binary stream
        The file.
    headonly : bool
        Leave out the samples.
    units : str, optional
        Acceleration units, if the file does not state them.
    time_step : float, optional
        Time step [s], if the file does not state it.

    Raises
    ------
    InputError
        As `rockframe.ingest.text.read`.

    Examples
    --------
    >>> from io import BytesIO
    >>> read_text(BytesIO(b"0.1\n-0.2\n"), units="gal", time_step=0.02)[0].stats.delta
    0.02
    """
    return _stream(file, _TEXT, ReadOptions(units, time_step), headonly)


def _is(file: Source, file_format: Format) -> bool:
    try:
        return sniff_format(_head(file)) is file_format
    # obspy asks this of whatever its user hands it, and wants no exception.
    except (InputError, OSError, AttributeError, TypeError, ValueError):
        return False


def _head(file: Source) -> bytes:
    if isinstance(file, str | Path):
        with Path(file).open("rb") as stream:
            return stream.read(HEAD)
    position = file.tell()
    try:
        return file.read(HEAD)
    finally:
        file.seek(position)


def _stream(file: Source, file_format: Format, options: ReadOptions, headonly: bool) -> Stream:
    if isinstance(file, str | Path):
        records = read_file(file, options, file_format)
    else:
        records = read_bytes("stream", file.read(), options, file_format)
    return Stream([_trace(record, file_format, headonly) for record in records])


def _trace(record: Record, file_format: Format, headonly: bool) -> Trace:
    short = len(record.station) <= _LONGEST_STATION
    header: dict[str, object] = {
        "delta": record.time_step,
        "npts": record.acceleration.size,
        "network": record.network,
        "station": record.station if short else "",
        "channel": record.component,
        file_format.obspy_name.lower(): AttribDict(
            units="m s-2",
            record_id=record.record_id,
            event=record.event,
            station=record.station,
            azimuth=record.azimuth,
            orientation=record.orientation.name.lower(),
            uncorrected=record.uncorrected,
            source_file=record.source_file,
            source_format=record.source_format,
            source_sha256=record.source_sha256,
        ),
    }
    if record.start_time:
        header["starttime"] = UTCDateTime(record.start_time)
    # obspy works on its arrays in place; a record's are read-only.
    data = np.empty(0) if headonly else record.acceleration.copy()
    trace = Trace(data=data, header=header)
    trace.stats.npts = record.acceleration.size
    return trace
