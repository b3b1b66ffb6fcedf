"""Reader of miniSEED 2: counts, converted to acceleration with the StationXML of the instrument.

The reader of obspy silently skips invalid data records and drops a truncated last one. Therefore
the data records are checked and their samples counted before obspy reads them.
"""

from __future__ import annotations

import struct
import warnings
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from rockframe.errors import InputError, settle
from rockframe.ingest.identify import noted, record_ids, with_ending
from rockframe.ingest.options import ReadOptions, factor_to_si, settle_time_step
from rockframe.ingest.parsing import Float
from rockframe.ingest.parsing.lines import are_finite
from rockframe.ingest.parsing.obspy_reader import read_stream
from rockframe.ingest.stationxml import ChannelResponse, find_response
from rockframe.record import Record

DESCRIPTION = "miniSEED 2 with StationXML beside it or in --station-xml"

_ENDINGS: Final = (".mseed", ".miniseed", ".ms", ".msd", ".seed")
_FIXED_HEADER: Final = 48
#: Length of the sequence number of a data record [bytes].
_SEQUENCE: Final = 6
#: Offset of the data quality flags, and their bits: saturated or clipped; missing or padded.
_QUALITY, _CLIPPED, _PADDED = 38, 0b11, 0b10000
_LENGTH_BLOCKETTE: Final = 1000
#: Second letter of a channel code: high-gain seismometers, which record velocity.
_SEISMOMETER: Final = "H"
#: Relative tolerance of sample rates, whose last digits depend on clock corrections.
_SAME_RATE: Final = 1e-4
#: Share of the record that is tapered at each end before the response is removed.
_TAPER: Final = 0.05


def sniff(head: bytes) -> bool:
    """Return True if a file begins like a miniSEED 2 record.

    Examples
    --------
    >>> sniff(b"000001D CLC     HNECI" + bytes(43)), sniff(b"0.00 0.1")
    (True, False)
    """
    return (
        len(head) >= _FIXED_HEADER
        and head[:6].replace(b" ", b"0").isdigit()
        and head[6:7] in {b"D", b"R", b"Q", b"M"}
        and head[7:8] in {b" ", b"\0"}
    )


def read(path: Path, data: bytes, options: ReadOptions) -> list[Record]:
    """Return the channels of a miniSEED file in m s-2, using the StationXML of their instruments.

    Without `options.station_xml`, the ``*.xml`` files beside the file or in its archive are
    searched. The samples are divided by the sensitivity or, if `options.water_level` is given, the
    full response is removed.

    Raises
    ------
    InputError
        If a data record is corrupted, truncated or flagged as padded; or if a channel has a gap or
        an overlap, records velocity, has no StationXML for its time, or has another sample rate in
        its StationXML.

    Examples
    --------
    >>> read(Path("a.mseed"), b"000001D CLC     HNECI" + bytes(43), ReadOptions())
    Traceback (most recent call last):
    rockframe.errors.InputError: a.mseed: no length in the record at byte 0: blockette 1000 is ...
    """
    places = list(_records(path, data))
    counted, notes = sum(samples for _, samples in places), _header_notes(path, data, places)
    traces = list(read_stream(path, data, "MSEED"))
    decoded = sum(trace.data.size for trace in traces)
    if counted != decoded or not traces:
        message = f"{counted} samples in the headers, {decoded} decoded. Both must be the same, "
        message += "2 or more."
        raise InputError(path, message)
    _require_whole(path, traces)
    ids = record_ids(with_ending(path, _ENDINGS), [trace.id for trace in traces])
    return [
        noted(partial(record_of_counts, path, trace, record_id, options, notes))
        for trace, record_id in zip(traces, ids, strict=True)
    ]


def _records(path: Path, data: bytes) -> Iterator[tuple[int, int]]:
    """Yield offset and number of samples of each data record; reject incomplete records."""
    start = 0
    while start < len(data):
        header = data[start : start + _FIXED_HEADER]
        if not sniff(header) or not (
            header[8:20].isascii() and header[8:20].decode().isprintable()
        ):
            raise InputError(path, f"no miniSEED header at byte {start}: the file is corrupted.")
        order = ">" if 1900 <= struct.unpack_from(">H", header, 20)[0] <= 2100 else "<"
        length = _length(data, start, order)
        if length is None:
            message = f"no length in the record at byte {start}: blockette 1000 is missing."
            raise InputError(path, message)
        if start + length > len(data):
            message = (
                f"the record at byte {start} is cut off: {len(data) - start} of {length} bytes."
            )
            raise InputError(path, message)
        yield start, struct.unpack_from(f"{order}H", header, 30)[0]
        start += length


def _header_notes(path: Path, data: bytes, places: Sequence[tuple[int, int]]) -> tuple[str, ...]:
    """Return notes for `processing` about sequence number and data quality flags.

    A file does not state whether data records before its first or after its last one are missing.
    """
    first = data[:_SEQUENCE].decode("ascii").lstrip(" 0")
    notes = (
        [f"archive: begins with record {first} of its sequence"] if first not in ("", "1") else []
    )
    flags = [data[place + _QUALITY] for place, _ in places]
    if any(flag & _PADDED for flag in flags):
        raise InputError(path, "the headers flag missing or padded data.")
    return (*notes, *(["archive: clipping flagged"] if any(f & _CLIPPED for f in flags) else []))


def _length(data: bytes, start: int, order: str) -> int | None:
    """Return the length of a data record from its blockette 1000, or None."""
    offset = struct.unpack_from(f"{order}H", data, start + 46)[0]
    seen = 0
    while offset > seen and start + offset + 8 <= len(data):
        kind, following = struct.unpack_from(f"{order}HH", data, start + offset)
        if kind == _LENGTH_BLOCKETTE:
            exponent = data[start + offset + 6]
            return int(2**exponent) if 7 <= exponent <= 20 else None
        seen, offset = offset, following
    return None


def _require_whole(path: Path, traces: list[Any]) -> None:
    """Reject channels with gaps or overlaps."""
    last: dict[str, Any] = {}
    for trace in sorted(traces, key=lambda piece: (piece.id, piece.stats.starttime)):
        before = last.get(trace.id)
        if before is not None:
            ends, begins = before.stats.endtime, trace.stats.starttime
            what = "gap" if begins > ends else "overlap"
            raise InputError(
                path, f"{what} in {trace.id}: {ends} to {begins}. Only continuous records are read."
            )
        last[trace.id] = trace


def record_of_counts(
    path: Path, trace: Any, record_id: str, options: ReadOptions, notes: Sequence[str]
) -> Record:
    """Return the record of a trace of obspy with counts, using the StationXML of its instrument."""
    stats = trace.stats
    counts = _counts(path, trace)
    if stats.channel[1:2] == _SEISMOMETER:
        message = f"channel {stats.channel!r} is a velocity, of a seismometer."
        raise InputError(path, f"{message} Channels of accelerometers have codes such as 'HNE'.")
    instrument = find_response(path, trace, options)
    factor_to_si(path, "m/s2", options)
    rate = float(stats.sampling_rate)
    if abs(rate - instrument.sample_rate) > _SAME_RATE * rate:
        message = f"{rate:g} samples a second in the file, {instrument.sample_rate:g} in"
        rates = {"waveform": rate, "header": instrument.sample_rate}
        rate = settle(path, f"{message} {instrument.source}.", rates)
        trace = trace.copy()
        trace.stats.sampling_rate = rate
    acceleration, step = _converted(path, trace, counts, instrument, options.water_level)
    return Record(
        record_id=record_id,
        acceleration=acceleration,
        time_step=settle_time_step(path, float(trace.stats.delta), options),
        uncorrected=True,
        component=stats.channel,
        orientation=instrument.orientation,
        azimuth=instrument.azimuth,
        station=stats.station,
        network=stats.network,
        start_time=str(stats.starttime),
        **instrument.facts,
        processing=(*notes, step),
    )


def _counts(path: Path, trace: Any) -> Float:
    if trace.data.dtype.kind not in "iuf" or trace.data.size < 2 or not trace.stats.sampling_rate:
        held = f"{trace.data.size} of {trace.data.dtype} at {trace.stats.sampling_rate:g} Hz"
        message = f"{trace.id} contains {held}. Must be 2 numbers or more, evenly sampled."
        raise InputError(path, message)
    counts = trace.data.astype(np.float64)
    if not are_finite(counts):
        raise InputError(path, f"{trace.id} contains NaN or infinity.")
    return np.asarray(counts, dtype=np.float64)


def _converted(
    path: Path,
    trace: Any,
    counts: Float,
    instrument: ChannelResponse,
    water_level: float | None,
) -> tuple[Float, str]:
    """Return the acceleration [m s-2] and a note for `processing`."""
    if water_level is None:
        return counts / instrument.counts, instrument.division
    acceleration = _response_removed(path, trace, counts, instrument, water_level)
    return acceleration, (
        f"response removed: mean removed, {_TAPER:.0%} cosine taper, water level "
        f"{water_level:g} dB ({instrument.source})"
    )


def _response_removed(
    path: Path,
    trace: Any,
    counts: Float,
    instrument: ChannelResponse,
    water_level: float,
) -> Float:
    stages = instrument.response.response_stages
    if not stages:
        message = f"no stages of {trace.id} in {instrument.source}. The full response needs them."
        raise InputError(path, message)
    begins = str(stages[0].input_units)
    # obspy would differentiate if the first stage is a velocity, even if the sensitivity is not.
    if begins.lower() != instrument.units.lower():
        stated = f"{instrument.units!r} ({instrument.source})"
        message = f"first stage of {trace.id} is per {begins!r}, its sensitivity per {stated}."
        raise InputError(path, message)
    piece = trace.copy()
    piece.data = counts.copy()
    piece.stats.response = instrument.response
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            # obspy converts stages in nm/s**2 and similar units to SI.
            piece.remove_response(
                output="ACC", water_level=water_level, taper=True, taper_fraction=_TAPER
            )
        except (ValueError, TypeError, NotImplementedError) as error:
            raise _no_response(path, trace, str(error)) from error
    for warning in caught:
        if issubclass(warning.category, UserWarning | RuntimeWarning):
            raise _no_response(path, trace, str(warning.message))
    return np.asarray(piece.data, dtype=np.float64) * instrument.stages_over_counts


def _no_response(path: Path, trace: Any, words: str) -> InputError:
    shown = " ".join(words.split())[:120]
    return InputError(path, f"response of {trace.id} cannot be removed: {shown}.")
