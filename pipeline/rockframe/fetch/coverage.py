"""Compare received waveforms with the request: gaps, overlaps, and missing time."""

from __future__ import annotations

import math
import re
import struct
import warnings
from dataclasses import dataclass
from io import BytesIO
from typing import Any, Final

from obspy import Stream, UTCDateTime, read
from obspy.core.util.obspy_types import ObsPyException
from obspy.io.mseed.util import get_record_information

from rockframe.errors import InputError
from rockframe.fetch.metadata import Channel, Event
from rockframe.fetch.service import one_line

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
        If the data are not miniSEED, end within a record, or cannot be unpacked.

    Examples
    --------
    >>> read_whole("CI.CLC.--.HNE.mseed", b"<html>")
    Traceback (most recent call last):
    rockframe.errors.InputError: CI.CLC.--.HNE.mseed: no valid miniSEED record at byte 0 of 6.
    """
    offset = 0
    while offset < len(body):
        length = _record_length(body, offset)
        if length <= 0:
            raise InputError(
                name,
                f"no valid miniSEED record at byte {offset} of {len(body)}.",
            )
        offset += length
    if offset > len(body):
        message = f"truncated: the last record ends at byte {offset}, the data at {len(body)}."
        raise InputError(name, message)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", UserWarning)
            return read(BytesIO(body), format="MSEED")
    except (ObsPyException, UserWarning, ValueError, TypeError) as error:
        words = one_line(str(error))
        message = f"samples cannot be unpacked ({words})."
        raise InputError(name, message) from error


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


@dataclass(frozen=True)
class Break:
    """A gap or an overlap in the samples of a channel.

    Parameters
    ----------
    time : str
        End of the gap or overlap, where the next samples start (ISO 8601, UTC).
    seconds : float
        Length of the gap or overlap [s].

    Examples
    --------
    >>> Break("2019-07-06T03:20:00.000000Z", 2.0).seconds
    2.0
    """

    time: str
    seconds: float


@dataclass(frozen=True, kw_only=True)
class Coverage:
    """The received data of one channel, or of the StationXML of one station.

    Parameters
    ----------
    what : str
        ``NET.STA.LOC.CHA`` for a channel, ``NET.STA`` for StationXML, or a code that is not listed.
    file : str
        Name of the file; empty if nothing was received.
    requested_start, requested_end, received_start, received_end : str
        Spans (ISO 8601, UTC); empty if nothing was received.
    samples : int
        Number of samples received.
    missing_start, missing_end : float
        Time missing at the ends of the requested span [s].
    gaps, overlaps : tuple of Break
        Gaps and overlaps between the first and the last sample.
    distance : float, optional
        Distance from the epicentre [km].
    reason : str
        Reason why nothing was received, or why the data cannot be used.

    Examples
    --------
    >>> Coverage(what="CI.CLC.--.HNE", reason="answered 204: no data.").complete
    False
    """

    what: str
    file: str = ""
    requested_start: str = ""
    requested_end: str = ""
    received_start: str = ""
    received_end: str = ""
    samples: int = 0
    missing_start: float = 0.0
    missing_end: float = 0.0
    gaps: tuple[Break, ...] = ()
    overlaps: tuple[Break, ...] = ()
    distance: float | None = None
    reason: str = ""

    @property
    def complete(self) -> bool:
        """True if every requested sample was received exactly once."""
        return self.verdict == "complete"

    @property
    def verdict(self) -> str:
        """Description of all faults, or ``complete``."""
        faults = [self.reason] if self.reason else []
        if self.missing_start:
            faults.append(f"starts {self.missing_start:g} s late")
        if self.missing_end:
            faults.append(f"ends {self.missing_end:g} s early")
        faults += [f"gap of {gap.seconds:g} s before {gap.time}" for gap in self.gaps]
        faults += [f"overlap of {over.seconds:g} s at {over.time}" for over in self.overlaps]
        return "; ".join(faults) or "complete"


@dataclass(frozen=True)
class Fetched:
    """The result of a download.

    Parameters
    ----------
    event : Event or None
        The event.
    channels : tuple of Channel
        Channels with received waveforms.
    coverage : tuple of Coverage
        One row for each channel, and one for each other missing item.

    Examples
    --------
    >>> Fetched(None, (), ()).complete
    True
    """

    event: Event | None
    channels: tuple[Channel, ...]
    coverage: tuple[Coverage, ...]

    @property
    def complete(self) -> bool:
        """True if everything requested was received."""
        return all(row.complete for row in self.coverage)

    def facts(self) -> list[dict[str, Any]]:
        """Return the catalogue row of each waveform file."""
        event = self.event
        return [
            {
                "file": f"{channel.name}.mseed",
                "event": event.name if event else "",
                "station": channel.station,
                "network": channel.network,
                "magnitude": event.magnitude if event else math.nan,
                "epicentral_distance": round(channel.distance, 1),
                "source": f"{event.source}; distance: WGS84 geodesic" if event else "",
            }
            for channel in self.channels
        ]


def measure(channel: str, span: tuple[str, str], stream: Stream) -> Coverage:
    """Compare the samples of one channel with the requested span.

    Parameters
    ----------
    channel : str
        ``NET.STA.LOC.CHA``, with ``--`` for a blank location.
    span : tuple of str
        Requested start and end (ISO 8601, UTC).
    stream : obspy.Stream
        Received samples. Services send whole miniSEED records, so they may start earlier and end
        later than requested.

    Returns
    -------
    Coverage
        The comparison; a span is complete if it agrees with the request within one sample.

    Examples
    --------
    >>> import numpy as np
    >>> from obspy import Trace
    >>> stream = Stream([Trace(np.zeros(101, dtype=np.int32))])
    >>> measure("..--.", ("1970-01-01T00:00:00Z", "1970-01-01T00:01:45Z"), stream).verdict
    'ends 5 s early'
    """
    start, end = UTCDateTime(span[0]), UTCDateTime(span[1])
    ids = {_channel_name(trace) for trace in stream}
    if ids != {channel}:
        return Coverage(
            what=channel,
            requested_start=str(start),
            requested_end=str(end),
            reason=f"{', '.join(sorted(ids))} received, but {channel} alone was requested",
        )
    first = min(trace.stats.starttime for trace in stream)
    last = max(trace.stats.endtime for trace in stream)
    step = max(trace.stats.delta for trace in stream)
    rates = sorted({trace.stats.sampling_rate for trace in stream})
    breaks = stream.get_gaps()  # rows of [..., time before, time after, seconds, samples]
    return Coverage(
        what=channel,
        requested_start=str(start),
        requested_end=str(end),
        received_start=str(first),
        received_end=str(last),
        samples=sum(trace.stats.npts for trace in stream),
        missing_start=_missing_seconds(first - start, step),
        missing_end=_missing_seconds(end - last, step),
        gaps=tuple(Break(str(row[5]), round(row[6], 6)) for row in breaks if row[6] > 0.0),
        overlaps=tuple(Break(str(row[5]), round(-row[6], 6)) for row in breaks if row[6] < 0.0),
        reason="" if len(rates) == 1 else f"{len(rates)} sampling rates: {rates} Hz",
    )


def _channel_name(trace: object) -> str:
    network, station, location, channel = trace.id.split(".")  # type: ignore[attr-defined]
    return f"{network}.{station}.{location or '--'}.{channel}"


def _missing_seconds(seconds: float, step: float) -> float:
    return round(seconds, 6) if seconds > step else 0.0
