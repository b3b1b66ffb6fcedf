"""obspy waveform plug-ins, one for each format: `obspy.read("RSN77.AT2", format="PEERAT2")`.

Traces hold accelerations in m s-2. Metadata for which obspy has no place are in `stats.peerat2`,
`stats.csmipv1` and so on, named after the format. obspy has its own plug-ins for K-NET, SAC and
miniSEED.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, Final

import numpy as np

from rockframe.errors import InputError
from rockframe.ingest.options import NO_OPTIONS, ReadOptions
from rockframe.ingest.reading.files import read_file
from rockframe.ingest.reading.registry import FORMATS, HEAD, Format, read_bytes, sniff_format
from rockframe.record import Record

with warnings.catch_warnings():
    # obspy 1.5 reads its entry points through an interface that Python 3.11 deprecates.
    warnings.simplefilter("ignore", DeprecationWarning)
    from obspy import Stream, Trace, UTCDateTime
    from obspy.core import AttribDict

Source = str | Path | BinaryIO

#: Longest SEED station code; longer names are only in the stats of the format.
_LONGEST_STATION: Final = 5


@dataclass(frozen=True)
class Plugin:
    r"""obspy plug-in that identifies and reads the files of one format.

    Examples
    --------
    >>> from io import BytesIO
    >>> lines = b"PEER\nTITLE\nACCELERATION TIME SERIES IN UNITS OF G\n2 .01 NPTS, DT\n .1 -.2"
    >>> PLUGINS["PEERAT2"].is_format(BytesIO(lines))
    True
    >>> PLUGINS["PEERAT2"].read_format(BytesIO(lines))[0].data
    array([ 0.981, -1.962])
    >>> table = BytesIO(b"1\n2\n")
    >>> PLUGINS["ACCTEXT"].read_format(table, units="gal", time_step=0.5)[0].stats.delta
    0.5
    """

    file_format: Format

    def is_format(self, file: Source) -> bool:
        """Return True if a file has the format; never raises an exception.

        At most 4096 bytes are read, and the position of a stream is restored.
        """
        try:
            return sniff_format(_head(file)) is self.file_format
        # obspy passes any input of the user here, and expects no exception.
        except (InputError, OSError, AttributeError, TypeError, ValueError):
            return False

    def read_format(
        self,
        file: Source,
        headonly: bool = False,
        units: str | None = None,
        time_step: float | None = None,
        **_: object,
    ) -> Stream:
        """Read a file into a stream with one trace per record.

        Parameters
        ----------
        file : str, Path or binary stream
            File to read.
        headonly : bool
            True to omit the samples.
        units : str, optional
            Acceleration units of a number table (``ACCTEXT``) that does not state them.
        time_step : float, optional
            Time step of a number table that does not state it [s].

        Raises
        ------
        InputError
            If the file cannot be read.
        """
        is_text = self.file_format.name == "acceleration_text"
        options = ReadOptions(units, time_step) if is_text else NO_OPTIONS
        if isinstance(file, str | Path):
            records = read_file(file, options, self.file_format)
        else:
            records = read_bytes("stream", file.read(), options, self.file_format)
        return Stream([_trace(record, self.file_format, headonly) for record in records])


#: Plug-ins by their name in obspy.
PLUGINS: Final = {known.obspy_name: Plugin(known) for known in FORMATS}


def __getattr__(name: str) -> Plugin:
    # Entry points name the plug-ins as attributes of this module.
    if name in PLUGINS:
        return PLUGINS[name]
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def _head(file: Source) -> bytes:
    if isinstance(file, str | Path):
        with Path(file).open("rb") as stream:
            return stream.read(HEAD)
    position = file.tell()
    try:
        return file.read(HEAD)
    finally:
        file.seek(position)


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
