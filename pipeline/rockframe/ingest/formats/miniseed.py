"""Reader of miniSEED: counts, converted to acceleration with the StationXML of the instrument.

The reader of obspy silently skips invalid data records and drops a truncated last one. Therefore
the data records are checked and their samples counted before obspy reads them.
"""

from __future__ import annotations

import struct
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import date
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

DESCRIPTION = "miniSEED 2 and 3 with StationXML beside it or in --station-xml"

_ENDINGS: Final = (".mseed", ".miniseed", ".ms", ".msd", ".seed", ".mseed3", ".ms3")
#: Beginning of a data record of miniSEED 3.
_THIRD: Final = b"MS\x03"
_FIXED_HEADER: Final = 48
#: Length of the sequence number of a data record [bytes].
_SEQUENCE: Final = 6
#: Location code in the fixed header.
_LOCATION: Final = slice(13, 15)
#: Offset of the data quality flags, and their bits: saturated or clipped; missing or padded.
_QUALITY, _CLIPPED, _PADDED = 38, 0b11, 0b10000
#: Offset of the activity flags, and their bit: the time correction is in the time already.
_ACTIVITY, _CORRECTED = 36, 0b10
#: Blockettes: length of the record, and microseconds of its time.
_LENGTH, _MICROSECONDS = 1000, 1001
#: Second letter of a channel code: high-gain seismometers, which record velocity.
_SEISMOMETER: Final = "H"
#: Relative tolerance of sample rates, whose last digits depend on clock corrections.
_SAME_RATE: Final = 1e-4
#: Largest distance of a data record from its place, which a clock may cause by jitter [samples].
_LATE: Final = 0.5
#: Share of the record that is tapered at each end before the response is removed.
_TAPER: Final = 0.05


def sniff(head: bytes) -> bool:
    """Return True if a file begins like a data record of miniSEED 2 or 3.

    Examples
    --------
    >>> sniff(b"000001D CLC     HNECI" + bytes(43)), sniff(b"0.00 0.1")
    (True, False)
    """
    return head.startswith(_THIRD) or _is_second(head)


def _is_second(head: bytes) -> bool:
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
    if data.startswith(_THIRD):
        from rockframe.ingest.formats.rare.miniseed3 import converted  # few files are miniSEED 3

        data = converted(path, data)
    data = _clean(data)
    records = list(_records(path, data))
    data, records = _in_order(data, records)
    counted, notes = sum(record.samples for record in records), _header_notes(path, data, records)
    traces = list(read_stream(path, data, "MSEED"))
    decoded = sum(trace.data.size for trace in traces)
    if counted != decoded or not traces:
        message = f"{counted} samples in the headers, {decoded} decoded. Both must be the same, "
        message += "2 or more."
        raise InputError(path, message)
    _require_whole(path, traces)
    for trace in traces:
        if (rate := _even_rate(path, trace, records)) != trace.stats.sampling_rate:
            trace.stats.sampling_rate = rate
    ids = record_ids(with_ending(path, _ENDINGS), [trace.id for trace in traces])
    return [
        noted(partial(record_of_counts, path, trace, record_id, options, notes))
        for trace, record_id in zip(traces, ids, strict=True)
    ]


@dataclass(frozen=True)
class _DataRecord:
    """A data record: its place in the file [byte], its channel, time [1e-6 s] and samples."""

    begin: int
    end: int
    channel: str
    time: int
    samples: int


def _clean(data: bytes) -> bytes:
    """Return a file whose location codes are ASCII.

    Some recorders leave other bytes in this field, which they do not use. The length of the first
    data record is that of all, unless `_records` finds another one.
    """
    if data[_LOCATION].isascii() or not data[8:13].isascii() or len(data) < _FIXED_HEADER:
        return data
    order = ">" if 1900 <= struct.unpack_from(">H", data, 20)[0] <= 2100 else "<"
    place = _blockettes(data, 0, order).get(_LENGTH, -7)
    exponent = data[place + 6] if place + 6 < len(data) else 0
    length = 2**exponent if 7 <= exponent <= 20 else len(data)
    code = data[_LOCATION]
    cleaned = bytearray(data)
    for start in range(0, len(data), length):
        if data[start + 13 : start + 15] == code:
            plain = bytes(byte for byte in code if byte < 128 and chr(byte).isalnum())
            cleaned[start + 13 : start + 15] = plain.ljust(2)
    return bytes(cleaned)


def _records(path: Path, data: bytes) -> Iterator[_DataRecord]:
    """Yield the data records; reject incomplete ones."""
    start = 0
    while start < len(data):
        header = data[start : start + _FIXED_HEADER]
        if not _is_second(header) or not (
            header[8:20].isascii() and header[8:20].decode().isprintable()
        ):
            raise InputError(path, f"no miniSEED header at byte {start}: the file is corrupted.")
        order = ">" if 1900 <= struct.unpack_from(">H", header, 20)[0] <= 2100 else "<"
        blockettes = _blockettes(data, start, order)
        exponent = data[blockettes[_LENGTH] + 6] if _LENGTH in blockettes else 0
        if not 7 <= exponent <= 20:
            message = f"no length in the record at byte {start}: blockette 1000 is missing."
            raise InputError(path, message)
        length = 2**exponent
        if start + length > len(data):
            message = (
                f"the record at byte {start} is cut off: {len(data) - start} of {length} bytes."
            )
            raise InputError(path, message)
        station, location, channel, network = (
            header[place].decode().strip()
            for place in (slice(8, 13), slice(13, 15), slice(15, 18), slice(18, 20))
        )
        yield _DataRecord(
            begin=start,
            end=start + length,
            channel=f"{network}.{station}.{location}.{channel}",
            time=_start_time(path, data, start, order, blockettes),
            samples=struct.unpack_from(f"{order}H", header, 30)[0],
        )
        start += length


def _blockettes(data: bytes, start: int, order: str) -> dict[int, int]:
    """Return the places of the blockettes of a data record, by their type."""
    places: dict[int, int] = {}
    offset = struct.unpack_from(f"{order}H", data, start + 46)[0]
    seen = 0
    while offset > seen and start + offset + 8 <= len(data):
        kind, following = struct.unpack_from(f"{order}HH", data, start + offset)
        places.setdefault(kind, start + offset)
        seen, offset = offset, following
    return places


def _start_time(
    path: Path, data: bytes, start: int, order: str, blockettes: Mapping[int, int]
) -> int:
    """Return the time of the first sample since the year 1 [1e-6 s]."""
    year, day, hour, minute, second, parts = struct.unpack_from(f"{order}HHBBBxH", data, start + 20)
    try:
        days = date(year, 1, 1).toordinal() + day - 1
    except ValueError:
        message = f"year {year} in the record at byte {start}. Must be 1 to 9999."
        raise InputError(path, message) from None
    seconds = ((24 * days + hour) * 60 + minute) * 60 + second
    applied = data[start + _ACTIVITY] & _CORRECTED
    correction = 0 if applied else struct.unpack_from(f"{order}i", data, start + 40)[0]
    micro = 0
    if _MICROSECONDS in blockettes:
        micro = struct.unpack_from("b", data, blockettes[_MICROSECONDS] + 5)[0]
    return int(1_000_000 * seconds + 100 * (parts + correction) + micro)


def _in_order(data: bytes, records: list[_DataRecord]) -> tuple[bytes, list[_DataRecord]]:
    """Return data and records in the order of time, with one quality code for each channel.

    obspy makes several traces of a channel whose records are not in order, or whose code changes:
    data centres replace D by Q or M after a check.
    """
    ordered = sorted(records, key=lambda record: (record.channel, record.time))
    codes: dict[str, set[int]] = {}
    for record in records:
        codes.setdefault(record.channel, set()).add(data[record.begin + _SEQUENCE])
    in_order = sorted(records, key=lambda record: record.channel) == ordered
    if in_order and all(len(code) == 1 for code in codes.values()):
        return data, records
    pieces = (data[segment.begin : segment.end] for segment in ordered)
    whole = b"".join(piece[:_SEQUENCE] + b"D" + piece[_SEQUENCE + 1 :] for piece in pieces)
    ends = np.cumsum([segment.end - segment.begin for segment in ordered]).tolist()
    moved = [
        replace(segment, begin=end - (segment.end - segment.begin), end=end)
        for segment, end in zip(ordered, ends, strict=True)
    ]
    return whole, moved


def _even_rate(path: Path, trace: Any, records: Sequence[_DataRecord]) -> float:
    """Return the sampling rate of a trace [Hz]; reject one whose data records drift away from it.

    obspy compares each data record with the one before it, so that small differences add up.
    """
    rate = float(trace.stats.sampling_rate)
    own = [record for record in records if record.channel == trace.id and record.samples]
    own.sort(key=lambda record: record.time)
    times = np.array([1e-6 * (segment.time - own[0].time) for segment in own])
    counts = np.cumsum([0, *(segment.samples for segment in own[:-1])])[: times.size]
    late = np.abs(times * rate - counts)
    if not rate or not times.any() or (late <= _LATE + _SAME_RATE * counts).all():
        return rate
    actual = float(counts[-1] / times[-1])
    message = f"the times of the data records of {trace.id} state {actual:.7g} samples a second, "
    message += f"their headers {rate:g}: {late.max():.1f} samples apart."
    rates = {"waveform": actual, "header": rate}
    if (np.abs(times * actual - counts) > _LATE + _SAME_RATE * counts).any():
        del rates["waveform"]
    return settle(path, message, rates)


def _header_notes(path: Path, data: bytes, records: Sequence[_DataRecord]) -> tuple[str, ...]:
    """Return notes for `processing` about sequence number and data quality flags.

    A file does not state whether data records before its first or after its last one are missing.
    """
    first = data[:_SEQUENCE].decode("ascii").lstrip(" 0")
    notes = (
        [f"archive: begins with record {first} of its sequence"] if first not in ("", "1") else []
    )
    flags = [data[record.begin + _QUALITY] for record in records]
    if any(flag & _PADDED for flag in flags):
        raise InputError(path, "the headers flag missing or padded data.")
    return (*notes, *(["archive: clipping flagged"] if any(f & _CLIPPED for f in flags) else []))


def _require_whole(path: Path, traces: list[Any]) -> None:
    """Reject channels with gaps or overlaps."""
    last: dict[str, Any] = {}
    for trace in sorted(traces, key=lambda piece: (piece.id, piece.stats.starttime)):
        before = last.get(trace.id)
        if before is not None:
            rates = before.stats.sampling_rate, trace.stats.sampling_rate
            if rates[0] != rates[1]:
                message = f"{trace.id} has {rates[0]:g} samples a second, and {rates[1]:g} from"
                raise InputError(path, f"{message} {trace.stats.starttime}.")
            ends, begins = before.stats.endtime, trace.stats.starttime
            fault = "gap" if begins > ends else "overlap"
            raise InputError(
                path,
                f"{fault} in {trace.id}: {ends} to {begins}. Only continuous records are read.",
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
        units = f"{instrument.units!r} ({instrument.source})"
        message = f"first stage of {trace.id} is per {begins!r}, its sensitivity per {units}."
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
