"""Convert records to obspy streams. Only this module imports obspy at module level."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import BinaryIO, Final

import numpy as np

from rockframe.errors import InputError
from rockframe.ingest.options import NO_OPTIONS, ReadOptions
from rockframe.ingest.reading import read_file
from rockframe.ingest.registry import FORMATS, HEAD, Format, read_bytes, sniff_format
from rockframe.record import Record

with warnings.catch_warnings():
    # obspy 1.5 reads its entry points through an interface that Python 3.11 deprecates.
    warnings.simplefilter("ignore", DeprecationWarning)
    from obspy import Stream, Trace, UTCDateTime
    from obspy.core import AttribDict

Source = str | Path | BinaryIO

_BY_NAME: Final = {known.name: known for known in FORMATS}
#: Longest SEED station code. A longer name is kept in the stats of the format.
_LONGEST_STATION: Final = 5


def is_format(file: Source, name: str) -> bool:
    r"""Return whether a file has a format; never raises an exception.

    Parameters
    ----------
    file : str, Path or binary stream
        The file; at most 4096 bytes are read. The position of a stream is restored.
    name : str
        Name of the format in `FORMATS`.

    Examples
    --------
    >>> from io import BytesIO
    >>> is_format(BytesIO(b"3 0.01 NPTS, DT"), "peer_at2")
    True
    """
    try:
        return sniff_format(_head(file)).name == name
    # obspy calls this with whatever the user passes to it, and expects no exception.
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


def read_stream(
    file: Source, name: str, headonly: bool = False, options: ReadOptions = NO_OPTIONS
) -> Stream:
    r"""Read a file of a format into a stream with one trace per record.

    Parameters
    ----------
    file : str, Path or binary stream
        The file.
    name : str
        Name of the format in `FORMATS`.
    headonly : bool
        True to omit the samples.
    options : ReadOptions
        Values that the file does not state.

    Raises
    ------
    InputError
        If the file cannot be read.

    Examples
    --------
    >>> from io import BytesIO
    >>> options = ReadOptions(units="gal", time_step=0.02)
    >>> read_stream(BytesIO(b"0.1\n-0.2\n"), "acceleration_text", options=options)[0].stats.delta
    0.02
    """
    file_format = _BY_NAME[name]
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
            processing=record.processing,
            source_file=record.source_file,
            source_format=record.source_format,
            source_sha256=record.source_sha256,
        ),
    }
    if record.start_time:
        header["starttime"] = UTCDateTime(record.start_time)
    # obspy modifies arrays in place; those of a record are read-only.
    data = np.empty(0) if headonly else record.acceleration.copy()
    trace = Trace(data=data, header=header)
    trace.stats.npts = record.acceleration.size
    return trace
