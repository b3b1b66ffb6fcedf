"""Records of recorders and programs whose formats obspy decodes, each by its own reader of obspy.

Samples are counts unless the file states units of acceleration or the calibration of the sensor.
"""

from __future__ import annotations

import math
import re
import tempfile
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from rockframe.errors import InputError
from rockframe.ingest.formats.miniseed import _counts as finite_counts
from rockframe.ingest.formats.miniseed import record_of_counts
from rockframe.ingest.identify import direction, noted, record_ids, seed_letter
from rockframe.ingest.options import ReadOptions, factor_to_si, settle_time_step
from rockframe.ingest.parsing.obspy_reader import read_stream
from rockframe.record import Orientation, Record
from rockframe.units import ACCELERATION_UNITS, plain_units

#: Readers of obspy whose calibration is the acceleration of one count [m s-2].
_CALIBRATED: Final = frozenset(["KINEMETRICS_EVT"])
#: Formats of short lines, and the largest number of characters of a line with a stray blank.
_COMPRESSED_TEXT: Final = frozenset(["GSE1", "GSE2"])
_LONGEST_LINE: Final = 81
#: Number of samples in the header of a GSE2 waveform.
_SAMPLES: Final = re.compile(rb"^WID2\b.{0,60}?\b(?:CM6|INT)\s+(\d{1,12})\b", re.M)
#: Largest difference of two times of one channel that follow each other [samples].
_SAME_TIME: Final = 0.5


def read_recorder(obspy_name: str, path: Path, data: bytes, options: ReadOptions) -> list[Record]:
    """Return the channels of a file in m s-2.

    Numbers of channels are not read as azimuths.

    Parameters
    ----------
    obspy_name : str
        Name of the one reader of obspy that is used.

    Raises
    ------
    InputError
        If obspy cannot read the file; if a channel has a gap or an overlap; or if neither file,
        StationXML nor options state what a count means.

    Examples
    --------
    >>> read_recorder("SEG2", Path("a.seg2"), b"U:", ReadOptions())
    Traceback (most recent call last):
    rockframe.errors.InputError: a.seg2: obspy's SEG2 reader failed: ...
    """
    pieces = _waveforms(path, data) if obspy_name in _COMPRESSED_TEXT else [data]
    stream: list[Any] = []
    with tempfile.TemporaryDirectory(prefix="rockframe-") as folder:
        # some readers of obspy open the file by its name
        place = Path(folder, path.name or "record")
        for piece in pieces:
            place.write_bytes(piece)
            stream += read_stream(path, place, obspy_name)
    traces = _joined(path, stream)
    names = [_name(trace, number) for number, trace in enumerate(traces, 1)]
    return [
        noted(partial(_dated_record, obspy_name, path, trace, record_id, options))
        for trace, record_id in zip(traces, record_ids(path, names), strict=True)
    ]


def _waveforms(path: Path, data: bytes) -> list[bytes]:
    """Return the waveforms of a GSE file, each alone, after checking them against the format.

    Raises
    ------
    InputError
        If a line below the header of a waveform is too long.
    """
    before, *pieces = re.split(rb"^(?=WID[12] )", data, flags=re.M)
    top = before.count(b"\n") + 1
    for piece in pieces:
        for number, line in enumerate(piece.split(b"\n")[1:], top + 1):
            if len(line) > _LONGEST_LINE:
                message = f"{len(line)} characters. Must be at most {_LONGEST_LINE}, as in GSE."
                raise InputError(path, message, number)
        for stated in _SAMPLES.findall(piece):
            if int(stated) > len(piece):
                message = f"{int(stated)} samples stated in a waveform of {len(piece)} bytes."
                raise InputError(path, message)
        top += piece.count(b"\n")
    return pieces


def _joined(path: Path, stream: Any) -> list[Any]:
    """Return one trace for each channel; reject gaps and overlaps."""
    channels: dict[str, list[Any]] = {}
    for number, trace in enumerate(stream):
        # channels of files without codes all have the same identifier
        key = trace.id if trace.stats.channel else f"{trace.id}{number}"
        channels.setdefault(key, []).append(trace)
    if not channels:
        raise InputError(path, "no samples.")
    joined = []
    for pieces in channels.values():
        pieces.sort(key=lambda trace: trace.stats.starttime)
        first, *others = pieces
        for piece in others:
            step = first.stats.delta
            late = float(piece.stats.starttime - first.stats.endtime) / step - 1.0
            if piece.stats.delta != step or abs(late) > _SAME_TIME:
                kind = "gap" if late > 0.0 else "overlap"
                times = f"{first.stats.endtime} to {piece.stats.starttime}"
                message = f"{kind} in {first.id}: {times}. Only continuous records are read."
                raise InputError(path, message)
            first.data = np.concatenate([first.data, piece.data])
        if np.ma.isMaskedArray(first.data) and first.data.mask.any():
            raise InputError(path, f"gap in {first.id}. Only continuous records are read.")
        joined.append(first)
    return joined


def _name(trace: Any, number: int) -> str:
    parts = (trace.stats.station, trace.stats.location, trace.stats.channel)
    return ".".join(filter(None, parts)) or str(number)


def _dated_record(
    obspy_name: str, path: Path, trace: Any, record_id: str, options: ReadOptions
) -> Record:
    """Return the record of a trace; companies count the time of SEG-2 differently."""
    record = _record(obspy_name, path, trace, record_id, options)
    return replace(record, start_time="") if obspy_name == "SEG2" else record


def _record(
    obspy_name: str, path: Path, trace: Any, record_id: str, options: ReadOptions
) -> Record:
    """Return the record of a trace in units of acceleration, calibrated, or in counts."""
    stats = trace.stats
    stated = plain_units(str(stats.get("ascii", {}).get("unit", "")).strip())
    units = stated if stated in ACCELERATION_UNITS else None
    calibration = float(stats.calib) if obspy_name in _CALIBRATED else math.nan
    if units is None and options.units is None and options.factor is None:
        if options.sensitivity is None and math.isfinite(calibration) and calibration != 0.0:
            note = f"multiplied by the calibration of the header, {calibration:g} m/s2 a count"
            return _acceleration(path, trace, record_id, options, calibration, note)
        return record_of_counts(path, trace, record_id, options, ())
    factor = factor_to_si(path, units, options)
    return _acceleration(path, trace, record_id, options, factor, "")


def _acceleration(
    path: Path, trace: Any, record_id: str, options: ReadOptions, factor: float, note: str
) -> Record:
    stats = trace.stats
    orientation, azimuth = direction(seed_letter(stats.channel))
    if orientation is not Orientation.UNSTATED and stats.channel.isdigit():
        orientation, azimuth = Orientation.UNSTATED, math.nan
    return Record(
        record_id=record_id,
        acceleration=finite_counts(path, trace) * factor,
        time_step=settle_time_step(path, float(stats.delta), options),
        uncorrected=True,
        component=stats.channel,
        orientation=orientation,
        azimuth=azimuth,
        station=stats.station,
        network=stats.network,
        start_time=str(stats.starttime),
        processing=(note,) if note else (),
    )
