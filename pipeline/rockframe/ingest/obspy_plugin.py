"""obspy waveform plug-ins, one for each format: `obspy.read("RSN77.AT2", format="PEERAT2")`.

Traces hold accelerations in m s-2. Metadata for which obspy has no place are in `stats.peerat2`,
`stats.csmipv1` and so on, named after the format. obspy has its own plug-ins for K-NET, SAC and
miniSEED. `stream.write("a.AT2", format="PEERAT2")` writes PEER AT2 files.
"""

from __future__ import annotations

import re
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, Final

import numpy as np

from rockframe.errors import InputError, ParameterError
from rockframe.ingest.files import read_file
from rockframe.ingest.formats import peer_at2, text
from rockframe.ingest.options import NO_OPTIONS, ReadOptions
from rockframe.ingest.parsing import Float
from rockframe.ingest.parsing.lines import are_finite
from rockframe.ingest.registry import FORMATS, HEAD, Format, read_bytes, sniff_format
from rockframe.provenance import whole_file
from rockframe.record import Record
from rockframe.units import GRAVITY, acceleration_factor

with warnings.catch_warnings():
    # obspy 1.5 reads its entry points through an interface that Python 3.11 deprecates.
    warnings.simplefilter("ignore", DeprecationWarning)
    from obspy import Stream, Trace, UTCDateTime
    from obspy.core import AttribDict

Source = str | Path | BinaryIO

#: Longest SEED station code; longer names are only in the stats of the format.
_LONGEST_STATION: Final = 5
#: Processing notes of obspy after which the samples are no longer the original quantity.
_OTHER_QUANTITY: Final = re.compile(r"\b(?:integrate|differentiate)\(")
_COLUMNS: Final = 5


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
    >>> table = BytesIO(b"0.1\n0.2\n")
    >>> PLUGINS["ACCTEXT"].read_format(table, units="gal", time_step=0.5)[0].stats.delta
    0.5
    """

    file_format: Format

    @property
    def _is_text(self) -> bool:
        return self.file_format.name == "acceleration_text"

    def is_format(self, file: Source) -> bool:
        """Return True if a file has the format; never raises an exception.

        A number table (``ACCTEXT``) must state units of acceleration: obspy offers every file to
        each of its plug-ins, and many tables of numbers are no records. ``format="ACCTEXT"`` reads
        the others. At most 4096 bytes are read, and the position of a stream is restored.
        """
        try:
            head = _head(file)
            # Most files are none of the format's own, which one call tells.
            if not self.file_format.sniff(head) or (self._is_text and not text.states_units(head)):
                return False
            return sniff_format(head) is self.file_format
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
        options = ReadOptions(units, time_step) if self._is_text else NO_OPTIONS
        if isinstance(file, str | Path):
            records = read_file(file, options, self.file_format)
        else:
            records = read_bytes("stream", file.read(), options, self.file_format)
        return Stream([_trace(record, self.file_format, headonly) for record in records])


#: Plug-ins by their name in obspy.
PLUGINS: Final = {reader.obspy_name: Plugin(reader) for reader in FORMATS if reader.obspy_name}


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


def write_peer_at2(stream: Stream, filename: Source, units: str | None = None, **_: object) -> None:
    """Write a stream with one acceleration trace as a PEER AT2 file, with eight digits per sample.

    The title contains event, station and component if the trace was read by this package, otherwise
    station and channel of the trace. If the event has no date, the start date of the trace is
    added. AT2 files cannot store other metadata.

    Parameters
    ----------
    stream : Stream
        One trace without gaps.
    filename : str, Path or binary stream
        Output file; an incomplete file is never left behind.
    units : str, optional
        Acceleration units of the trace; required unless it was read by a plug-in of this package.

    Raises
    ------
    ParameterError
        If there is not exactly one trace, if the samples are not known to be accelerations, if a
        sample is missing or not finite, or if a name cannot be written in the title.
    InputError
        If the file cannot be written.

    Examples
    --------
    >>> from io import BytesIO
    >>> file = BytesIO()
    >>> write_peer_at2(Stream([Trace(np.array([0.0, 0.981]))]), file, units="m/s2")
    >>> print(file.getvalue().decode().splitlines()[-1])
      0.0000000E+00  1.0000000E-01
    """
    if len(stream) != 1:
        raise ParameterError(
            f"Invalid stream of {len(stream)} traces: an AT2 file has one. "
            "Write each trace to a file of its own."
        )
    (trace,) = stream
    content = _content(trace, _factor(trace, units))
    if isinstance(filename, str | Path):
        with whole_file(Path(filename)) as partial:
            partial.write_bytes(content)
    else:
        filename.write(content)


def _factor(trace: Trace, units: str | None) -> float:
    """Return the size of one unit of the samples [m s-2]."""
    if units is not None:
        return acceleration_factor(units)
    if _package_stats(trace).get("units") != "m s-2":
        raise ParameterError(
            f"Trace {trace.id!r} states no acceleration units. "
            "State them: write(..., format='PEERAT2', units='m/s2')."
        )
    for step in trace.stats.get("processing", ()):
        if _OTHER_QUANTITY.search(step):
            raise ParameterError(
                f"Trace {trace.id!r} was processed by {step!r}. If it is an acceleration, "
                "state its units: write(..., format='PEERAT2', units='m/s2')."
            )
    return 1.0


def _package_stats(trace: Trace) -> dict[str, Any]:
    """Return the stats that a reader of this package stored in the trace."""
    header = trace.stats.get(str(trace.stats.get("_format", "")).lower())
    return dict(header) if isinstance(header, dict) or hasattr(header, "keys") else {}


def _content(trace: Trace, factor: float) -> bytes:
    samples = _samples(trace) * (factor / GRAVITY)
    step = np.format_float_positional(float(trace.stats.delta), trim="0")
    rows = [
        "".join(f" {sample:14.7E}" for sample in samples[start : start + _COLUMNS])
        for start in range(0, samples.size, _COLUMNS)
    ]
    title = _title(trace)
    lines = [
        peer_at2.WRITTEN,
        title,
        "ACCELERATION TIME SERIES IN UNITS OF G",
        f"NPTS= {samples.size:6d}, DT= {step} SEC",
        *rows,
        "",
    ]
    content = "\n".join(lines).encode("latin-1")
    try:
        peer_at2.read(Path("a.AT2"), content, NO_OPTIONS)
    except InputError as error:
        raise ParameterError(
            f"Trace {trace.id!r}, titled {title!r}, could not be read again: {error.reason}"
        ) from None
    return content


def _samples(trace: Trace) -> Float:
    if np.ma.is_masked(trace.data):
        raise ParameterError(f"Trace {trace.id!r} has gaps.")
    samples = np.asarray(trace.data, dtype=np.float64)
    if samples.size < 2:
        raise ParameterError(f"Trace {trace.id!r} has {samples.size} samples. Must have 2 or more.")
    if not are_finite(samples):
        bad = next(i for i, sample in enumerate(samples) if not are_finite(sample))
        raise ParameterError(
            f"Sample {bad} of trace {trace.id!r} is {samples[bad]}. Must be finite, below 1e30."
        )
    return samples


def _title(trace: Trace) -> str:
    own, stats = _package_stats(trace), trace.stats
    event = _printable(trace, own.get("event", ""))
    station = _printable(trace, own.get("station") or stats.station)
    component = _printable(trace, stats.channel)
    if component.isdecimal() and own.get("azimuth") == float(component):
        component = component.zfill(3)  # or it would be read as the number of a channel
    if not peer_at2.read_title(event).event and stats.starttime.timestamp != 0.0:
        date = f"{stats.starttime.month}/{stats.starttime.day}/{stats.starttime.year}"
        event = ", ".join(part for part in (event, date) if part)
    return ", ".join((event, station, component))


def _printable(trace: Trace, name: str) -> str:
    """Return a name on one line; reject a name that is not printable Latin-1."""
    line = " ".join(name.split())
    try:
        line.encode("latin-1")
    except UnicodeEncodeError:
        line = "\0"
    if line and not line.isprintable():
        raise ParameterError(
            f"Invalid name {name!r} of trace {trace.id!r}. An AT2 file has Latin letters only."
        )
    return line
