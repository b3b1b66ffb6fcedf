"""Reader of ASDF (Adaptable Seismic Data Format), such as the workspaces of gmprocess.

An ASDF file is HDF5 with a fixed layout: waveforms and StationXML of each station, events, and
documents of processing. netCDF's library opens it. Each stream (the channels of one instrument) is
read or left out on its own, with the reason.

References
----------
Krischer et al. (2016), An Adaptable Seismic Data Format, GJI 207(2), 1003-1011.
"""

from __future__ import annotations

import html
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from rockframe.cells import decimal
from rockframe.errors import InputError, OtherQuantityError, settle
from rockframe.ingest.containers import Content, printable
from rockframe.ingest.formats import miniseed
from rockframe.ingest.formats.asdf.workspace import Trace, Workspace, opened, traces_in
from rockframe.ingest.identify import (
    directed,
    distances,
    noted,
    record_ids,
    seed_letter,
    site_of_depth,
)
from rockframe.ingest.options import ReadOptions, factor_to_si, settle_time_step
from rockframe.ingest.parsing.lines import are_finite, is_number
from rockframe.ingest.stationxml import channels_in, stated_direction
from rockframe.outcome import InputOutcome
from rockframe.record import Orientation, Record
from rockframe.units import ACCELERATION_UNITS, plain_units

DESCRIPTION = "ASDF (HDF5), such as workspaces of gmprocess"

_SIGNATURE: Final = b"\x89HDF\r\n\x1a\n"
#: Labels of streams that are as recorded: gmprocess's, and that of pyasdf's documentation.
_RAW: Final = frozenset(["unprocessed", "raw", "raw_recording"])
_PROCESSED_OR_RAW: Final = ("processed", "raw")
_ACTIVITY: Final = re.compile(r"<prov:activity\b.*?</prov:activity>", re.S)
_STEP: Final = re.compile(r"<prov:label\b[^>]*>([^<]*)</prov:label>")
_DETAIL: Final = re.compile(r"<seis_prov:(\w+)[^>]*>([^<]*)</seis_prov:\1>")
#: Units of gmprocess's accelerations, and its acceleration of gravity [m s-2].
_GMPROCESS: Final = "cm/s2"
_STANDARD_GRAVITY: Final = 9.80665
#: Names of a dataset end at a whole second, which may be rounded or cut [s].
_WHOLE_SECOND: Final = 1.01
#: Largest deviation from north or east of a component with the letter N or E [degree].
_ASKEW: Final = 5.0
_DISTANCES: Final = {
    "epicentral": "epicentral_distance",
    "hypocentral": "distance_hypocentral",
    "rupture": "distance_rrup",
    "joyner_boore": "distance_rjb",
}
_DISTANCE: Final = re.compile(rf'<({"|".join(_DISTANCES)}) units="km">([^<]*)</')
_PGA: Final = re.compile(r'<pga units="%g">(.*?)</pga>', re.S)
_PEAK: Final = re.compile(r"<(H1|H2|Z)\b[^>]*>([^<]*)</")
_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)
#: Longest note of a processing step.
_LONGEST_NOTE: Final = 200


def sniff(head: bytes) -> bool:
    r"""Return True if a file begins like HDF5; only its content tells whether it is ASDF.

    Examples
    --------
    >>> sniff(b"\x89HDF\r\n\x1a\n"), sniff(b"0.00 0.1")
    (True, False)
    """
    return head.startswith(_SIGNATURE)


def read(path: Path, data: bytes, options: ReadOptions) -> list[Record]:
    r"""Return the records of the chosen streams; streams that cannot be used are left out.

    Raises
    ------
    InputError
        If the file is corrupted, is not ASDF or contains no waveforms, if the labels of its streams
        do not settle which are meant, or if no stream can be used.

    Examples
    --------
    >>> read(Path("a.h5"), b"\x89HDF\r\n\x1a\n", ReadOptions())
    Traceback (most recent call last):
    rockframe.errors.InputError: a.h5: corrupted HDF5: ...
    """
    records, left_out = read_streams(path, data, options)
    if not records:
        raise InputError(path, f"no stream can be used. {left_out[0].file}: {left_out[0].reason}")
    return records


def read_streams(
    path: Path, data: bytes, options: ReadOptions
) -> tuple[list[Record], list[InputOutcome]]:
    """Return the records of the chosen streams, and the other streams with the reason.

    The arguments and errors are those of `read`; it is no error if no stream can be used. A stream
    that failed the checks of gmprocess, and one of a seismometer, counts as unread.
    """
    records: list[Record] = []
    left_out: list[InputOutcome] = []
    with opened(path, data) as workspace:
        for name, traces in _streams(workspace, options.streams).items():
            try:
                records += _read_stream(workspace, traces, options)
            except OtherQuantityError as error:
                left_out.append(InputOutcome(name, error.reason, status="unread"))
            except InputError as error:
                left_out.append(InputOutcome(name, error.reason))
    return records, left_out


def _streams(workspace: Workspace, chosen: str | None) -> dict[str, list[Trace]]:
    """Return the traces of the chosen label by stream; reject an unclear choice."""
    traces = list(traces_in(workspace))
    if not traces:
        raise InputError(workspace.path, "ASDF without waveforms.")
    labels = sorted({trace.label for trace in traces})
    if (chosen or "processed") in _PROCESSED_OR_RAW:
        wanted = {label for label in labels if (label in _RAW) == (chosen == "raw")}
    else:
        wanted = {label for label in labels if chosen == label}
    if len(wanted) != 1:
        kind = f"{len(wanted)} labels" if wanted else "no streams"
        message = f"{kind} for --streams {chosen or 'processed'}. The file contains: "
        message += f"{', '.join(labels)}. Choose one label with --streams."
        raise InputError(workspace.path, message)
    streams: dict[str, list[Trace]] = {}
    several = len({trace.event for trace in traces}) > 1
    for trace in traces:
        if trace.label in wanted:
            name = f"{trace.stream} {trace.event}" if several else trace.stream
            streams.setdefault(name, []).append(trace)
    return streams


def _read_stream(
    workspace: Workspace, traces: Sequence[Trace], options: ReadOptions
) -> list[Record]:
    """Return the records of a stream; reject it if its traces failed or have gaps."""
    channels = [trace.channel for trace in traces]
    for channel in channels:
        if channels.count(channel) > 1:
            message = f"{channels.count(channel)} traces of channel {channel!r}, so it has gaps."
            raise InputError(workspace.path, f"{message} Only continuous records are read.")
    passed = _passed(workspace, traces)
    records = [noted(partial(_record, workspace, trace, options)) for trace in passed]
    return _with_peaks(workspace, passed, records)


def _passed(workspace: Workspace, traces: Sequence[Trace]) -> list[Trace]:
    """Return the traces that passed gmprocess's checks; unless the user chose, all must pass."""
    failures = {trace.channel: _failure(workspace, trace) for trace in traces}
    stream = workspace.table("StreamProcessingParameters", traces[0], traces[0].stream)
    passed = [trace for trace in traces if not failures[trace.channel]]
    if passed and (len(passed) == len(traces) or stream.get("any_trace_failures") is False):
        return passed
    channel, reason = next((channel, why) for channel, why in failures.items() if why)
    raise OtherQuantityError(workspace.path, f"left out by gmprocess ({channel}): {reason}")


def _failure(workspace: Workspace, trace: Trace) -> str:
    """Return the reason why gmprocess or its user left a trace out, or ""."""
    review = ("AuxiliaryData", "review", trace.place, f"{trace.name}_{trace.tag}", "accepted")
    accepted = workspace.variable(*review)
    if accepted is not None:
        return "" if np.all(workspace.values(accepted)) else "rejected in a manual review."
    failure = workspace.table("TraceProcessingParameters", trace, trace.name).get("failure")
    if not failure:
        return ""
    reason = failure.get("reason", "") if isinstance(failure, dict) else failure
    return f"{printable(str(reason))[:_LONGEST_NOTE].rstrip('.') or 'no reason stated'}."


def _record(workspace: Workspace, trace: Trace, options: ReadOptions) -> Record:
    """Return the record of a trace, from counts or from physical units."""
    wave = _waveform(workspace, trace)
    steps = _provenance(workspace, trace)
    level = _process_level(workspace, trace)
    units = _units(workspace.path, steps, level, wave.data)
    station = _station_xml(workspace, trace)
    channel = next(iter(channels_in(station, wave)), None) if station.data else None
    # An identifier has the channel even if the file contains only one.
    stem = Path(f"{trace.event or workspace.path.stem}.h5")
    record_id = record_ids(stem, [trace.name, ""])[0]
    if units == "counts":
        beside = replace(options, archived=(station,))
        record = miniseed.record_of_counts(workspace.path, wave, record_id, beside, ())
    else:
        factor = factor_to_si(workspace.path, units, options)
        high_pass = _corner(steps, "highpass")
        record = Record(
            record_id=record_id,
            acceleration=np.asarray(wave.data, dtype=np.float64) * factor,
            time_step=settle_time_step(workspace.path, float(wave.stats.delta), options),
            uncorrected=math.isnan(high_pass) and not level.startswith("corrected"),
            component=trace.channel,
            station=trace.station,
            network=trace.network,
            start_time=str(wave.stats.starttime),
            filter_low=high_pass,
            filter_high=_corner(steps, "lowpass"),
            processing=tuple(map(_note, steps)),
        )
    return replace(
        record, **_direction(workspace.path, trace, channel), **_facts(workspace, trace, channel)
    )


def _waveform(workspace: Workspace, trace: Trace) -> Any:
    """Return a trace of obspy; reject samples that contradict the times in the name."""
    from obspy import Trace as Waveform
    from obspy import UTCDateTime

    samples = workspace.values(trace.variable)
    rate = workspace.attribute(trace.variable, "sampling_rate")
    start = workspace.attribute(trace.variable, "starttime")
    sound = isinstance(rate, int | float) and 0.0 < rate < math.inf and isinstance(start, int)
    if samples.ndim != 1 or samples.size < 2 or samples.dtype.kind not in "iuf" or not sound:
        held = f"{samples.size} of {samples.dtype} at {rate!r} Hz from {start!r}"
        message = f"{trace.name} contains {held}. Must be 2 numbers or more, evenly sampled"
        raise InputError(workspace.path, f"{message}, from a time in nanoseconds.")
    if not are_finite(samples):
        raise InputError(workspace.path, f"{trace.name} contains NaN or infinity.")
    begins = start / 1e9
    ends = begins + (samples.size - 1) / rate
    for there, here in ((trace.first, begins), (trace.last, ends)):
        if not abs(_seconds(there) - here) <= _WHOLE_SECOND:
            message = f"{trace.name} of {samples.size} samples at {rate:g} Hz from "
            message += f"{_utc(begins)} to {_utc(ends)}, but {there} in its name."
            if math.isnan(_seconds(there)):
                raise InputError(workspace.path, message)
            settle(workspace.path, message, {"samples": None})
    header = {
        "network": trace.network,
        "station": trace.station,
        "location": trace.location.strip("-"),
        "channel": trace.channel,
        "sampling_rate": float(rate),
        "starttime": UTCDateTime(ns=start),
    }
    return Waveform(samples, header)


def _seconds(time: str) -> float:
    try:
        return datetime.fromisoformat(time[:26]).replace(tzinfo=UTC).timestamp()
    except ValueError:
        return math.nan


def _utc(seconds: float) -> str:
    try:
        return (_EPOCH + timedelta(seconds=seconds)).strftime("%Y-%m-%dT%H:%M:%S")
    except OverflowError:
        return f"{seconds:g} s"


def _process_level(workspace: Workspace, trace: Trace) -> str:
    """Return what gmprocess states of the samples, such as "raw counts"; empty if it does not."""
    standard = workspace.table("StreamSupplementalStats", trace, trace.stream).get("standard")
    return str(standard.get("process_level", "")) if isinstance(standard, dict) else ""


def _provenance(workspace: Workspace, trace: Trace) -> list[dict[str, str]]:
    """Return the processing steps in the provenance of a trace, in order."""
    text = workspace.text("Provenance", f"{trace.name}_{trace.tag}")
    steps = []
    for activity in _ACTIVITY.findall(text):
        label = _STEP.search(activity)
        details = {name: html.unescape(value) for name, value in _DETAIL.findall(activity)}
        steps.append({"label": label[1].lower() if label else "", **details})
    return steps


def _note(step: Mapping[str, str]) -> str:
    """Return a note for `processing`.

    Examples
    --------
    >>> _note({"label": "taper", "side": "both", "taper_width": "0.0500000001"})
    'archive: taper (side both, taper_width 0.05)'
    """
    details = [f"{name} {_shown(value)}" for name, value in step.items() if name != "label"]
    listed = f" ({', '.join(details)})" if details else ""
    return printable(f"archive: {step['label']}{listed}")[:_LONGEST_NOTE]


def _shown(value: str) -> str:
    return f"{decimal(value):g}" if is_number(value.encode()) else value


def _corner(steps: Sequence[Mapping[str, str]], kind: str) -> float:
    """Return the corner of the last filter of a kind [Hz]; NaN if there is none."""
    texts = [
        step.get("corner_frequency", "") for step in steps if step["label"] == f"{kind} filter"
    ]
    corners = [float(text) for text in texts if is_number(text.encode()) and float(text) > 0.0]
    return corners[-1] if corners else math.nan


def _units(path: Path, steps: Sequence[Mapping[str, str]], level: str, samples: Any) -> str | None:
    """Return the units of the samples; None if nothing states them."""
    unit_names = [step["output_units"] for step in steps if "output_units" in step]
    if unit_names:
        units = plain_units(unit_names[-1])
        if units not in ACCELERATION_UNITS and units != "counts":
            raise OtherQuantityError(path, f"samples in {printable(units)}, not accelerations.")
        return units
    if "counts" in level or (not level and samples.dtype.kind in "iu"):
        return "counts"
    return _GMPROCESS if level else None


def _station_xml(workspace: Workspace, trace: Trace) -> Content:
    """Return the StationXML of a station; without data if there is none."""
    name = f"{printable(workspace.path.name)}:{trace.place}.StationXML"
    document = workspace.data("Waveforms", trace.place, "StationXML")
    return Content(Path(name), name, Path(name), document)


def _direction(path: Path, trace: Trace, channel: Any) -> dict[str, Any]:
    """Return the direction from the StationXML, whose dip gmprocess leaves out, and the letter."""
    letter = seed_letter(trace.channel)
    named = directed(trace.channel, letter)
    if channel is None:
        return named
    orientation, azimuth = stated_direction(channel)
    if orientation is Orientation.UNSTATED and letter != "Z" and channel.azimuth is not None:
        orientation, azimuth = Orientation.HORIZONTAL, float(channel.azimuth)
    if orientation is Orientation.UNSTATED:
        return named
    # Positive motion may be in the opposite direction.
    askew = abs((azimuth - named["azimuth"] + 90.0) % 180.0 - 90.0)
    if askew > _ASKEW:
        message = f"channel {trace.channel!r}, but azimuth {azimuth:g} in its StationXML."
        angles = {"component": float(named["azimuth"]), "azimuth": azimuth}
        azimuth = settle(path, message, angles)
    return {"component": trace.channel, "orientation": orientation, "azimuth": azimuth}


def _facts(workspace: Workspace, trace: Trace, channel: Any) -> dict[str, Any]:
    """Return event, magnitude, distances and site, as fields of a record."""
    facts: dict[str, Any] = {}
    if channel is not None:
        facts["site_type"] = site_of_depth(math.nan if channel.depth is None else channel.depth)
    events = workspace.events
    name = trace.event or (next(iter(events)) if len(events) == 1 else "")
    sources = []
    if name in events:
        origin, event_facts = events[name]
        facts |= event_facts
        sources.append("QuakeML")
        if channel is not None and origin is not None:
            depth = math.nan if origin.depth is None else origin.depth / 1000.0
            place = channel.latitude, channel.longitude
            facts |= distances((origin.latitude or 0.0, origin.longitude or 0.0), place, depth)
    metrics = workspace.auxiliary("StationMetrics", trace, trace.stream, name)
    measured = {
        _DISTANCES[kind]: float(value)
        for kind, value in _DISTANCE.findall(metrics)
        if is_number(value.encode()) and math.isfinite(float(value))
    }
    if measured:
        sources.append("StationMetrics")
    listed = " and ".join(sources)
    source = {"facts_source": f"{listed} of the ASDF file"} if listed else {}
    return {**facts, **measured, **source}


def _with_peaks(
    workspace: Workspace, traces: Sequence[Trace], records: Sequence[Record]
) -> list[Record]:
    """Return the records with the ratios of their peaks to those that gmprocess states.

    Its two horizontals are called H1 and H2, so the peaks are compared in the order of their size.
    """
    first = traces[0]
    metrics = workspace.auxiliary("WaveFormMetrics", first, first.stream, first.tag)
    pga = _PGA.search(metrics)
    peaks = dict(_PEAK.findall(pga[1])) if pga else {}
    peak_metrics = {
        name: float(value) * 0.01 * _STANDARD_GRAVITY
        for name, value in peaks.items()
        if is_number(value.encode()) and float(value) > 0.0
    }
    checked = list(records)
    for names, upright in ((("H1", "H2"), False), (("Z",), True)):
        places = [k for k, record in enumerate(records) if record.orientation.upright is upright]
        if all(name in peak_metrics for name in names) and len(places) == len(names):
            sizes = sorted(peak_metrics[name] for name in names)
            for size, k in zip(sizes, sorted(places, key=lambda k: records[k].pga), strict=True):
                checked[k] = replace(records[k], peak_ratio=records[k].pga / size)
    return checked
