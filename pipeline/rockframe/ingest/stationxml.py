"""Instrument response of a channel from StationXML, dataless SEED or RESP."""

from __future__ import annotations

import hashlib
import math
import re
import warnings
from dataclasses import dataclass
from functools import lru_cache
from io import BytesIO
from pathlib import Path
from typing import Any, Final

from rockframe.errors import InputError, settle
from rockframe.ingest.containers import Content, printable
from rockframe.ingest.identify import direction, seed_letter, site_of_depth
from rockframe.ingest.options import ReadOptions
from rockframe.ingest.parsing.lines import HEAD, read_head, unreadable
from rockframe.record import Orientation, SiteType
from rockframe.units import GRAVITY

#: Text that identifies a StationXML file, a dataless SEED volume, and a RESP file.
_MARK: Final = b"<FDSNStationXML"
_DATALESS: Final = re.compile(rb"\d{6}V[ *]")
_RESP: Final = re.compile(rb"^B05[02]F03\s+Station:", re.M)
#: Largest StationXML file that is read [bytes].
_LARGEST: Final = 64_000_000
#: Size of a unit [m s-2], by the prefix of the metre.
_PREFIXES: Final = {"": 1.0, "c": 1e-2, "m": 1e-3, "u": 1e-6, "n": 1e-9}
_UNITS: Final = re.compile(
    r"(?P<prefix>[cmun]?)m/(?P<per>s(?:ec)?(?P<square>\*\*2|\^2|2|/s(?:ec)?)?|\(s\*\*2\))", re.I
)
_COUNTS: Final = frozenset(["count", "counts"])
#: Largest relative difference between the sensitivity and the product of the stage gains. Rounding
#: causes at most 1e-3, and the gain of an accelerometer is the same at all stated frequencies; a
#: wrong digit or a missing gain causes more.
_SAME_GAIN: Final = 0.01
#: Exceptions on corrupted XML, in addition to those of obspy; lxml raises syntax errors.
_JUNK: Final = (SyntaxError, ValueError, TypeError, LookupError, AttributeError, ArithmeticError)
#: Largest dip of a horizontal, and smallest dip of a vertical component [degree].
_FLAT: Final = 10.0
_STEEP: Final = 80.0


@dataclass(frozen=True, kw_only=True)
class ChannelResponse:
    """Description of a channel in StationXML.

    Parameters
    ----------
    source, sha256 : str
        Name and SHA-256 of the StationXML file.
    counts : float
        Sensitivity [counts s2 m-1].
    stages_over_counts : float
        Product of the stage gains over the sensitivity [1], if they contradict each other and the
        sensitivity is trusted; otherwise 1.
    units : str
        Acceleration units as stated.
    sample_rate : float
        Sampling rate [Hz]; NaN if unstated.
    orientation : Orientation
        Orientation according to the dip.
    azimuth : float
        Clockwise from north [degree]; NaN unless horizontal.
    site_type : SiteType
        Site type according to the depth of the sensor.
    response : obspy.core.inventory.Response
        Response with all stages.

    Examples
    --------
    >>> ChannelResponse(source="CI.CLC.xml", counts=213945.0, units="M/S**2").counts
    213945.0
    """

    source: str
    sha256: str = ""
    counts: float
    stages_over_counts: float = 1.0
    units: str
    sample_rate: float = math.nan
    orientation: Orientation = Orientation.UNSTATED
    azimuth: float = math.nan
    site_type: SiteType = SiteType.UNKNOWN
    response: Any = None

    @property
    def facts(self) -> dict[str, Any]:
        """Fields of a record that the channel states."""
        return {
            "instrument_file": printable(self.source),
            "instrument_sha256": self.sha256,
            "site_type": self.site_type,
        }

    @property
    def division(self) -> str:
        """Note for `processing` of samples that were divided by the sensitivity."""
        counts = f"{self.counts:g} counts per m/s2"
        return f"divided by the sensitivity of {counts} ({self.source or 'as stated'})"


def is_station_xml(path: Path, head: bytes | None = None) -> bool:
    """Return True if a file is StationXML, dataless SEED or RESP; False if it cannot be read.

    Examples
    --------
    >>> is_station_xml(Path("CI.CLC..HNE.mseed"))
    False
    """
    return _kind_of(path, read_head(path) if head is None else head[:HEAD]) != ""


def _kind_of(path: Path, head: bytes) -> str:
    """Return obspy's name of the format of station metadata; empty for other files."""
    if path.suffix.lower() == ".xml":
        return "STATIONXML" if _MARK in head else ""
    if _DATALESS.match(head):
        return "SEED"
    return "RESP" if path.name.upper().startswith("RESP") and _RESP.search(head) else ""


def find_response(path: Path, trace: Any, options: ReadOptions) -> ChannelResponse:
    """Return the response of the channel of an obspy trace at the time of the trace.

    Parameters
    ----------
    path : Path
        File of the waveform.
    trace : obspy.Trace
        The waveform.
    options : ReadOptions
        The StationXML file to use, or the archive and the folder to search.

    Raises
    ------
    InputError
        If no file describes the channel at that time, if several files describe it differently, if
        the sensitivity is not in counts per acceleration, or if the stage gains contradict it.

    Examples
    --------
    >>> from obspy import Trace
    >>> find_response(Path("lost/CLC.mseed"), Trace(header={"station": "CLC"}), ReadOptions())
    Traceback (most recent call last):
    rockframe.errors.InputError: lost/CLC.mseed: no StationXML of .CLC.. at 1970-01-01T00:00:00...
    """
    if options.sensitivity is not None:
        return _given(trace, options.sensitivity)
    try:
        return _find(path, trace, _files(path, trace.stats.station, options))
    except InputError as error:
        if error.path == path:
            raise
        # The rejected file is the waveform, not the StationXML.
        raise InputError(path, f"StationXML {error.path.name}: {error.reason}") from error


def _given(trace: Any, sensitivity: float) -> ChannelResponse:
    """Return the response of the sensitivity that the user states [counts s2 m-1]."""
    orientation, azimuth = direction(seed_letter(trace.stats.channel))
    return ChannelResponse(
        source="", counts=sensitivity, units="M/S**2", orientation=orientation, azimuth=azimuth
    )


def _find(path: Path, trace: Any, files: list[Content]) -> ChannelResponse:
    epochs = [(file, channel) for file in files for channel in _epochs(file, trace)]
    covering = [epoch for epoch in epochs if _covers(epoch[1], trace)]
    crossed = [] if covering else [epoch for epoch in epochs if _touches(epoch[1], trace)]
    if not covering and not _adjoin([channel for _, channel in crossed], trace):
        raise _none_found(path, trace, files, epochs)
    (file, channel), *others = covering or crossed
    for other_file, other in others:
        if _summary(other) != _summary(channel) or other.response != channel.response:
            where = f"in {file.name} and {other_file.name}"
            if file is other_file:
                where = f"in two epochs of {file.name}: {_period(channel)}, and {_period(other)}"
            do = "Cut the record where they meet." if crossed else "Keep one."
            message = f"{trace.id} is described differently {where}."
            raise InputError(path, f"{message} {do}")
    return _channel_response(file, channel, trace)


def _none_found(
    path: Path, trace: Any, files: list[Content], epochs: list[tuple[Content, Any]]
) -> InputError:
    """Return the error for a trace that no epoch covers."""
    begins, ends = trace.stats.starttime, trace.stats.endtime
    if epochs:
        periods = "; ".join(f"{_period(channel)} ({file.name})" for file, channel in epochs[:3])
        message = f"StationXML describes {trace.id} for other times: {periods}."
        return InputError(path, f"{message} The record lasts from {begins} to {ends}.")
    looked = ", ".join(dict.fromkeys(file.name for file in files)) or "none that names the station"
    message = f"no StationXML of {trace.id} at {begins} (looked at: {looked})."
    return InputError(
        path,
        f"{message} Put its *.xml beside the file, name it with --station-xml, or state the "
        "counts per m/s2 with --sensitivity-counts-s2-m.",
    )


def _covers(channel: Any, trace: Any) -> bool:
    begins, ends = trace.stats.starttime, trace.stats.endtime
    return (channel.start_date is None or channel.start_date <= begins) and (
        channel.end_date is None or ends <= channel.end_date
    )


def _touches(channel: Any, trace: Any) -> bool:
    begins, ends = trace.stats.starttime, trace.stats.endtime
    return (channel.start_date is None or channel.start_date <= ends) and (
        channel.end_date is None or begins <= channel.end_date
    )


def _adjoin(channels: list[Any], trace: Any) -> bool:
    """Return True if epochs together cover a trace; one begins at most a second after another."""
    start = trace.stats.starttime
    if not channels:
        return False
    for channel in sorted(channels, key=lambda channel: channel.start_date or start):
        if channel.start_date is not None and channel.start_date > start + 1.0:
            return False
        start = max(start, channel.end_date or trace.stats.endtime)
    return bool(start >= trace.stats.endtime)


def _period(channel: Any) -> str:
    begins = f"from {channel.start_date}" if channel.start_date else ""
    ends = f"to {channel.end_date}" if channel.end_date else ""
    return f"{begins} {ends}".strip() or "at all times"


def _files(path: Path, station: str, options: ReadOptions) -> list[Content]:
    """Return the given StationXML file, or the files beside a waveform that name its station."""
    if options.station_xml is not None:
        return [_loaded(Path(options.station_xml))]
    try:
        beside = sorted((options.folder or path.parent).iterdir())
    except OSError:  # no such folder, or no permission
        beside = []
    files = [_loaded(file) for file in beside if file.is_file() and is_station_xml(file)]
    code = re.escape(station.encode())
    named = re.compile(rb"code\s*=\s*[\"']" + code + rb"[\"']")
    plain = re.compile(rb"(?<![A-Z0-9])" + code + rb"(?![A-Z0-9])")  # dataless SEED and RESP
    return [
        file
        for file in (*options.archived, *files)
        if (named if _MARK in file.data[:HEAD] else plain).search(file.data)
    ]


def _loaded(file: Path) -> Content:
    try:
        size = file.stat().st_size
        if size > _LARGEST:
            raise InputError(file, f"{size} bytes. Must be at most {_LARGEST}.")
        return Content(file, file.name, file, file.read_bytes())
    except OSError as error:
        raise unreadable(file, error) from error


@lru_cache(maxsize=8)
def _inventory(file: Path, content: bytes) -> Any:
    if b"<!DOCTYPE" in content or b"<!ENTITY" in content:
        raise InputError(file, "XML with a document type is not read. Save it as plain StationXML.")
    with warnings.catch_warnings():
        # obspy warns about unusual but harmless entries; Python warns about obspy's entry points.
        warnings.simplefilter("ignore")
        from obspy import read_inventory
        from obspy.core.util.obspy_types import ObsPyException

        kind = _kind_of(file, content[:HEAD]) or "STATIONXML"
        try:
            return read_inventory(BytesIO(content), format=kind)
        except (*_JUNK, ObsPyException) as error:
            shown = " ".join(str(error).split())[:120]
            words = "StationXML" if kind == "STATIONXML" else f"station metadata ({kind})"
            raise InputError(file, f"cannot be read as {words}: {shown}.") from error


@lru_cache(maxsize=8)
def _sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def channels_in(file: Content, trace: Any) -> list[Any]:
    """Return the channels with the four codes of the trace whose epoch covers it."""
    return [channel for channel in _epochs(file, trace) if _covers(channel, trace)]


def _epochs(file: Content, trace: Any) -> list[Any]:
    """Return the channels with the four codes of the trace; the location ``--`` is blank."""
    stats = trace.stats
    return [
        channel
        for network in _inventory(file.where, file.data)
        if network.code == stats.network
        for station in network
        if station.code == stats.station
        for channel in station
        if channel.code == stats.channel
        and (channel.location_code or "").replace("--", "").strip() == stats.location
    ]


def _summary(channel: Any) -> tuple[object, ...]:
    return channel.azimuth, channel.dip, channel.sample_rate


def _channel_response(content: Content, channel: Any, trace: Any) -> ChannelResponse:
    file = content.where
    response = channel.response
    sensitivity = response.instrument_sensitivity if response else None
    if sensitivity is None or sensitivity.value is None:
        raise InputError(file, f"{trace.id} has no sensitivity.")
    value, units = float(sensitivity.value), str(sensitivity.input_units or "")
    if not math.isfinite(value) or value == 0.0:
        message = f"sensitivity {value:g} of {trace.id}. Must be finite, and not zero."
        raise InputError(file, f"{message} Otherwise state it with --sensitivity-counts-s2-m.")
    if value < 0.0:
        message = f"sensitivity {value:g} of {trace.id} is negative: the counts have the opposite"
        value = settle(file, f"{message} sign.", {"sensitivity": value})
    outputs = [sensitivity.output_units]
    if _stage_gain(file, trace.id, response) is not None:  # which is compared with the sensitivity
        outputs.append(response.response_stages[-1].output_units)
    if not any(str(units).strip().lower() in _COUNTS for units in outputs):
        message = f"sensitivity of {trace.id} to {sensitivity.output_units!r}. Must be to counts."
        raise InputError(file, f"{message} Otherwise state it with --sensitivity-counts-s2-m.")
    counts = value / _metres_per_second_squared(file, trace.id, units)
    counts, stages_over_counts = _settled_gain(file, trace.id, response, counts)
    orientation, azimuth = stated_direction(channel)
    if _kind_of(file, content.data[:HEAD]) == "RESP":  # which states no direction
        orientation, azimuth = direction(seed_letter(channel.code))
    return ChannelResponse(
        source=content.name,
        sha256=_sha256(content.data),
        counts=counts,
        stages_over_counts=stages_over_counts,
        units=units,
        sample_rate=float(channel.sample_rate or math.nan),
        orientation=orientation,
        azimuth=azimuth,
        site_type=site_of_depth(math.nan if channel.depth is None else float(channel.depth)),
        response=response,
    )


def _metres_per_second_squared(file: Path, name: str, units: str) -> float:
    if units.strip().lower() == "g":
        return GRAVITY
    match = _UNITS.fullmatch(units.strip())
    if not match:
        message = f"sensitivity of {name} per {units!r}. Must be per m/s**2 or g."
        raise InputError(file, f"{message} Otherwise state it with --sensitivity-counts-s2-m.")
    if not (match["square"] or match["per"].startswith("(")):
        message = f"sensitivity of {name} per {units!r}, a velocity, not an acceleration."
        raise InputError(file, message)
    return _PREFIXES[match["prefix"].lower()]


def _stage_gain(file: Path, name: str, response: Any) -> float | None:
    """Return the product of the stage gains [counts s2 m-1]; None if they are incomplete."""
    stages = response.response_stages
    gains = [stage.stage_gain for stage in stages]
    if not stages or None in gains:  # the gains are incomplete
        return None
    input_units = str(response.instrument_sensitivity.input_units)
    units = str(stages[0].input_units or input_units)
    try:
        return float(math.prod(gains)) / _metres_per_second_squared(file, name, units)
    except InputError:
        message = f"first stage of {name} is per {units!r}, its sensitivity per {input_units!r}."
        raise InputError(file, f"{message} Both must be accelerations.") from None


def _settled_gain(file: Path, name: str, response: Any, counts: float) -> tuple[float, float]:
    """Return the trusted sensitivity [counts s2 m-1], and the stage gains over it [1].

    The latter is 1 unless the two contradict each other.
    """
    product = _stage_gain(file, name, response)
    if product is None or abs(product - counts) <= _SAME_GAIN * abs(counts):
        return counts, 1.0
    message = f"sensitivity of {name} is {counts:.7g} counts per m/s2, but the gains of its "
    message += f"{len(response.response_stages)} stages multiply to {product:.7g}."
    values = {"sensitivity": (counts, product / counts), "stages": (product, 1.0)}
    if not math.isfinite(product) or product == 0.0:
        del values["stages"]
    return settle(file, message, values, must=f"Must agree within {_SAME_GAIN:.0%}.")


def stated_direction(channel: Any) -> tuple[Orientation, float]:
    """Return orientation and azimuth [degree] of a channel according to its dip."""
    if channel.dip is None:
        return Orientation.UNSTATED, math.nan
    if abs(channel.dip) >= _STEEP:  # dip is positive downwards
        return Orientation.DOWNWARD if channel.dip > 0.0 else Orientation.VERTICAL, math.nan
    if abs(channel.dip) <= _FLAT:
        azimuth = math.nan if channel.azimuth is None else float(channel.azimuth)
        return Orientation.HORIZONTAL, azimuth
    return Orientation.UNSTATED, math.nan
