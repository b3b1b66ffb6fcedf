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

from rockframe.errors import InputError, settle
from rockframe.ingest.formats.miniseed import _counts as finite_counts
from rockframe.ingest.formats.miniseed import record_of_counts
from rockframe.ingest.identify import direction, noted, record_ids, seed_letter
from rockframe.ingest.options import ReadOptions, factor_to_si, settle_time_step
from rockframe.ingest.parsing.lines import decoded, plain_text, require_whole_end
from rockframe.ingest.parsing.obspy_reader import read_stream
from rockframe.ingest.parsing.timing import clock_seconds, even_time_step
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
#: Formats of text, whose header lines state the number of samples and the sampling rate.
_TEXTS: Final = frozenset(["SLIST", "TSPAIR"])
#: Relative tolerance between the time step of a header and that of the times below it.
_SAME_STEP: Final = 1e-3
#: Units of a text without sensor, and quantities that no factor makes an acceleration.
_COUNTS: Final = frozenset(["", "count", "counts"])
_OTHER: Final = re.compile(r"([kcmnu]?m|in|ft)(/s(ec)?|\*?s(\*\*|\^)?-1)?", re.I)


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
        If obspy cannot read the file; if a channel has a gap or an overlap; if the header of a text
        states other samples, another rate or another quantity; or if neither file, StationXML nor
        options state what a count means.

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
            # the reader of SEG-2 does not close the file of a name
            stream += read_stream(path, piece if obspy_name == "SEG2" else place, obspy_name)
    if obspy_name in _TEXTS:
        _require_headers(path, data, stream)
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
        If a line below the header of a waveform is too long, or if it states more samples than
        it can have.
    """
    before, *pieces = re.split(rb"^(?=WID[12] )", data, flags=re.M)
    top = before.count(b"\n") + 1
    for piece in pieces:
        for number, line in enumerate(piece.split(b"\n")[1:], top + 1):
            if len(line) > _LONGEST_LINE:
                message = f"{len(line)} characters. Must be at most {_LONGEST_LINE}, as in GSE."
                raise InputError(path, message, number)
        for samples in _SAMPLES.findall(piece):
            if int(samples) > len(piece):
                message = f"{int(samples)} samples stated in a waveform of {len(piece)} bytes."
                raise InputError(path, message)
        top += piece.count(b"\n")
    return pieces


def _require_headers(path: Path, data: bytes, stream: Any) -> None:
    """Compare each header line of a text with the rows below it; obspy does not."""
    lines = [line.strip() for line in plain_text(path, data).split(b"\n")]
    heads = [k for k, line in enumerate(lines) if line.startswith(b"TIMESERIES")]
    for head, end, trace in zip(heads, [*heads[1:], len(lines)], stream, strict=True):
        fields = decoded(lines[head]).replace(",", "").split()
        trace.stats.ascii.unit = " ".join(fields[9:])  # obspy takes the type if there is no unit
        if int(fields[2]) != trace.data.size:
            message = f"{fields[2]} samples in the header, {trace.data.size} in the file."
            settle(path, message, {"samples": trace.data.size}, head + 1)
        if fields[7] == "TSPAIR":
            _require_times(path, lines[head + 1 : end], head + 2, trace)
    columns = 2 if b"TSPAIR" in lines[heads[-1]] else 1
    body = plain_text(path, data).split(b"\n", heads[-1] + 1)[-1]
    require_whole_end(path, body, heads[-1] + 2, columns)


def _require_times(path: Path, rows: list[bytes], line: int, trace: Any) -> None:
    """Require even times of the samples, at the rate that the header states."""
    texts = [" ".join(decoded(row).split()[:-1]) for row in rows if row]
    if len(texts) < 2:
        return
    seconds = clock_seconds(texts)
    try:
        times = np.array(seconds, dtype=np.float64)
    except ValueError:
        bad = next(k for k, text in enumerate(texts) if seconds[k] == text)
        message = f"time {texts[bad]!r}. Must be a date and a clock time."
        raise InputError(path, message, line + bad) from None
    printed = [text.encode() for text in seconds]
    step = even_time_step(path, times, lambda: printed, line, single=False)
    step_stated = float(trace.stats.delta)
    if not math.isclose(step_stated, step, rel_tol=_SAME_STEP):
        message = f"{1.0 / step_stated:g} sps in the header, time step {step:g} s of the times."
        trace.stats.delta = settle(
            path, message, {"waveform": step, "header": step_stated}, line - 1
        )


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
    units = _stated_units(path, str(stats.get("ascii", {}).get("unit", "")).strip(), options)
    calibration = float(stats.calib) if obspy_name in _CALIBRATED else math.nan
    if units is None and options.units is None and options.factor is None:
        if options.sensitivity is None and math.isfinite(calibration) and calibration != 0.0:
            note = f"multiplied by the calibration of the header, {calibration:g} m/s2 a count"
            return _acceleration(path, trace, record_id, options, calibration, note)
        return record_of_counts(path, trace, record_id, options, ())
    if options.sensitivity is not None:
        given = "units of the header" if units else "units and factor"
        message = f"a sensitivity of {options.sensitivity:g} counts s2/m is given beside {given}."
        raise InputError(path, f"{message} Give one of them.")
    factor = factor_to_si(path, units, options)
    return _acceleration(path, trace, record_id, options, factor, "")


def _stated_units(path: Path, printed: str, options: ReadOptions) -> str | None:
    """Return the units of acceleration that a header states; None for counts and unstated units.

    A factor makes volts and the like accelerations, but no velocity or displacement.
    """
    units = plain_units(printed)
    if units in ACCELERATION_UNITS:
        return units
    if printed.lower() in _COUNTS:
        if printed and options.units is not None:
            message = f"units {options.units!r} given, but the header states {printed!r}."
            do = "State the acceleration of a count with --factor-m-s2, or its sensitivity"
            raise InputError(path, f"{message} {do} with --sensitivity-counts-s2-m.", 1)
        return None
    if options.factor is not None and not _OTHER.fullmatch(printed):
        return None
    must = f"Must be counts, or one of: {', '.join(ACCELERATION_UNITS)}."
    if not _OTHER.fullmatch(printed):
        must = f"{must} Otherwise state its acceleration with --factor-m-s2."
    raise InputError(path, f"units {printed!r} in the header. {must}", 1)


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
