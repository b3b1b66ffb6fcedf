"""obspy plug-in that writes PEER AT2 files: `stream.write("a.AT2", format="PEERAT2")`."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, Final

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import InputError, ParameterError
from rockframe.ingest.formats import peer_at2
from rockframe.ingest.options import NO_OPTIONS
from rockframe.ingest.parsing.lines import are_finite
from rockframe.provenance import whole_file
from rockframe.units import GRAVITY, acceleration_factor

if TYPE_CHECKING:
    from obspy import Stream, Trace

#: Processing notes of obspy after which the samples are no longer the original quantity.
_OTHER_QUANTITY: Final = re.compile(r"\b(?:integrate|differentiate)\(")
_COLUMNS: Final = 5


def write_peer_at2(
    stream: Stream, filename: str | Path | BinaryIO, units: str | None = None, **_: object
) -> None:
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
    >>> from obspy import Stream, Trace
    >>> file = BytesIO()
    >>> write_peer_at2(Stream([Trace(np.array([0.0, 0.981]))]), file, units="m/s2")
    >>> print(file.getvalue().decode().splitlines()[-1])
      0.0000000E+00  1.0000000E-01
    """
    if len(stream) != 1:
        raise ParameterError(
            f"Invalid stream of {len(stream)} traces for one AT2 file. Must be one: "
            "write each trace to a file of its own."
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
            "Must be given: write(..., format='PEERAT2', units='m/s2')."
        )
    for step in trace.stats.get("processing", ()):
        if _OTHER_QUANTITY.search(step):
            raise ParameterError(
                f"Trace {trace.id!r} was processed by {step!r}. Must be acceleration; if it is, "
                "say so: write(..., format='PEERAT2', units='m/s2')."
            )
    return 1.0


def _package_stats(trace: Trace) -> dict[str, Any]:
    """Return the stats that a reader of this package stored in the trace."""
    found = trace.stats.get(str(trace.stats.get("_format", "")).lower())
    return dict(found) if isinstance(found, dict) or hasattr(found, "keys") else {}


def _content(trace: Trace, factor: float) -> bytes:
    samples = _samples(trace) * (factor / GRAVITY)
    step = np.format_float_positional(float(trace.stats.delta), trim="0")
    rows = [
        "".join(f" {sample:14.7E}" for sample in samples[start : start + _COLUMNS])
        for start in range(0, samples.size, _COLUMNS)
    ]
    title = _title(trace)
    lines = [
        "STRONG-MOTION RECORD IN THE FORMAT OF THE PEER DATABASE",
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


def _samples(trace: Trace) -> NDArray[np.float64]:
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
            f"Invalid name {name!r} of trace {trace.id!r}. Must have only Latin letters in "
            "an AT2 file."
        )
    return line
