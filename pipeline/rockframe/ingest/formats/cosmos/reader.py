"""Reader of the COSMOS strong-motion format, version 1.20: V0 (counts), V1, V2 and V2c.

Item numbers of the integer and real headers follow the format description (COSMOS, 2001) and are
counted from 1. A file may hold several channels. Velocity and displacement are skipped if the file
also has acceleration, and rejected otherwise.
"""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from rockframe.errors import InputError, OtherQuantityError, settle
from rockframe.ingest.formats.cosmos import sections
from rockframe.ingest.formats.cosmos.sections import TOP, Channel, split_channels
from rockframe.ingest.identify import distinct_records, site_of_cosmos
from rockframe.ingest.options import ReadOptions, factor_to_si, settle_time_step
from rockframe.ingest.parsing import Float
from rockframe.ingest.parsing.lines import first_line, plain_text
from rockframe.ingest.parsing.samples import StatedPeak, read_columns, require_layout, require_peak
from rockframe.record import Record
from rockframe.units import GRAVITY

DESCRIPTION = "COSMOS V0 (counts with stated sensitivity), V1, V2 and V2c, several channels"

#: Items of the integer header.
_STAGE, _UNITS, _STATION_TYPE = 1, 3, 19
#: Items of the real header: magnitude (moment), epicentral distance [km], raw time step [s],
#: time step [ms], length [s], peak and its time [s].
_MAGNITUDE, _DISTANCE, _RAW_STEP = 13, 17, 34
_STEP, _LENGTH, _PEAK, _PEAK_TIME = 62, 63, 64, 65

_ACCELERATION: Final = 1
_RAW, _UNCORRECTED, _CORRECTED = 0, 1, 2
_COUNTS: Final = 50
_UNITS_OF: Final = {2: "g", 4: "cm/s2", 10: "gal"}

#: Items of the real header: one count [uV] and full scale [V] of the recorder; sensitivity [V/g],
#: full-scale output [V] and acceleration [g], and gain of the sensor.
_VOLTS, _RECORDER_SCALE = 22, 23
_SENSITIVITY, _SENSOR_OUTPUT, _SENSOR_SCALE, _GAIN = 42, 43, 44, 47
#: Item of the integer header with the sample length [bit], and the usual length.
_BITS: Final = 35
_USUAL_BITS: Final = 24
#: Largest relative difference between stated and derived values. Full scales are nominal values,
#: which differ by up to 0.5 % in real files.
_SAME_SCALE: Final = 0.02


def sniff(head: bytes) -> bool:
    r"""Return True if a file begins like a COSMOS file.

    Examples
    --------
    >>> sniff(b"Raw acceleration counts   (Format v01.20 with 13 text lines)\n")
    True
    """
    return bool(TOP.match(first_line(head)))


def read(path: Path, data: bytes, options: ReadOptions) -> list[Record]:
    """Return the acceleration channels of a COSMOS file.

    Raises
    ------
    InputError
        If a section differs from its heading, if no channel is an acceleration, if counts have no
        sensitivity, or if number, time step or peak of the samples differ from the header.

    Examples
    --------
    >>> read(Path("a.v2c"), b"Corrected acceleration", ReadOptions())
    Traceback (most recent call last):
    rockframe.errors.InputError: a.v2c:1: 'Corrected acceleration' is no heading of a ...
    """
    channels_here = split_channels(path, plain_text(path, data).split(b"\n"))
    for channel in channels_here:
        sections.require_quantity(channel)
    channels = [
        channel for channel in channels_here if channel.integer(sections.QUANTITY) == _ACCELERATION
    ]
    if not channels:
        code = channels_here[0].integer(sections.QUANTITY)
        name = sections.QUANTITIES.get(code or 0, "unknown")
        message = f"quantity {code} ({name}) in item {sections.QUANTITY} of the integer header. "
        message += f"Must be {_ACCELERATION} (acceleration)."
        raise OtherQuantityError(path, message, channels_here[0].first_line)
    for channel in (
        channel for channel in channels_here if channel.integer(sections.QUANTITY) != _ACCELERATION
    ):
        require_layout(
            path, channel.rows, channel.layout.columns, _samples(channel), channel.sample_line
        )
    names = [_component(channel) for channel in channels]
    return distinct_records(
        path, names, [(channel,) for channel in channels], partial(_record, options)
    )


def _samples(channel: Channel) -> int:
    count = int(channel.heading["count"])
    if count < 2:
        message = f"{count} samples stated. Must be 2 or more."
        raise InputError(channel.path, message, channel.sample_line)
    return count


def _record(options: ReadOptions, record_id: str, channel: Channel) -> Record:
    stage = channel.integer(_STAGE)
    if stage not in (_RAW, _UNCORRECTED, _CORRECTED):
        message = f"processing stage {stage} in item {_STAGE} of the integer header."
        must = "Must be 0 (raw), 1 (uncorrected) or 2 (corrected)."
        raise InputError(channel.path, f"{message} {must}", channel.first_line)
    factor, converted = _factor(channel, options)
    columns, line = channel.layout.columns, channel.sample_line
    samples = read_columns(channel.path, channel.rows, columns, _samples(channel), line)
    step = settle_time_step(
        channel.path, _time_step(channel, stage, options.time_step), options, channel.real_line
    )
    _require_length(channel, samples.size * step, step)
    resolution = _resolution(channel, samples)
    sections.require_agreement(channel, samples, step, resolution)
    peak_ratio = _peak_ratio(channel, samples, step, resolution, signed=stage != _RAW)
    named = sections.parse_station(channel.text[4]) or sections.seed_name(channel.comments)
    component = _component(channel)
    orientation, azimuth = sections.parse_direction(channel, component)
    low, high = sections.parse_corners(channel.text)
    return Record(
        record_id=record_id,
        acceleration=factor * samples,
        time_step=step,
        uncorrected=stage != _CORRECTED,
        component=component,
        orientation=orientation,
        azimuth=azimuth,
        site_type=site_of_cosmos(
            channel.text[8].partition("Location:")[2],
            channel.text[4],
            channel.integer(_STATION_TYPE),
        ),
        event=sections.parse_event(channel.text[1]),
        station=named.station,
        network=named.network,
        start_time=sections.parse_start_time(channel.text[7]),
        magnitude=channel.number(_MAGNITUDE),
        epicentral_distance=channel.number(_DISTANCE),
        peak_ratio=peak_ratio,
        filter_low=low,
        filter_high=high,
        processing=sections.filter_note(channel.text) + converted,
    )


def _factor(channel: Channel, options: ReadOptions) -> tuple[float, tuple[str, ...]]:
    """Return the factor from samples to m s-2, and a note for `processing`."""
    code = int(channel.heading["code"])
    if channel.integer(_UNITS) != code:
        message = f"units ({code}) stated, but {channel.integer(_UNITS)} in item {_UNITS} of the"
        raise InputError(channel.path, f"{message} integer header.", channel.sample_line)
    if code == _COUNTS:
        if options.sensitivity is not None:
            done = f"counts divided by the stated {options.sensitivity:g} counts per m/s2"
            return 1.0 / options.sensitivity, (done,)
        return _factor_of_counts(channel)
    if code not in _UNITS_OF:
        allowed = ", ".join(f"{number} ({name})" for number, name in _UNITS_OF.items())
        message = f"acceleration units {channel.heading['units']!r} ({code}). Must be {allowed}"
        raise InputError(channel.path, f"{message} or {_COUNTS} (counts).", channel.sample_line)
    return factor_to_si(channel.path, _UNITS_OF[code], options, channel.sample_line), ()


def _factor_of_counts(channel: Channel) -> tuple[float, tuple[str, ...]]:
    """Return the acceleration of one count [m s-2], and a note for `processing`."""
    count = _required(channel, _VOLTS, "microvolts a count")
    sensitivity = _required(channel, _SENSITIVITY, "sensitivity [V/g]")
    gain = channel.number(_GAIN)
    if gain <= 0.0:
        message = f"gain {gain:g} in item {_GAIN} of the real header. Must be positive."
        raise InputError(channel.path, message, channel.real_line)
    _require_recorder(channel, count)
    sensitivity = _sensor(channel, sensitivity)
    said = "gain unstated, taken as 1" if math.isnan(gain) else f"gain {gain:g}"
    amplified = 1.0 if math.isnan(gain) else gain
    done = f"counts converted with {count:g} uV a count, {sensitivity:g} V/g, {said}"
    return 1e-6 * count / amplified / sensitivity * GRAVITY, (done,)


def _required(channel: Channel, item: int, name: str) -> float:
    number = channel.number(item)
    if not number > 0.0:
        shown = "unknown" if math.isnan(number) else f"{number:g}"
        message = f"raw counts without a usable sensitivity: {name} {shown} in item {item} of the"
        must = "Must be positive. Otherwise state counts per m/s2 with --sensitivity-counts-s2-m."
        raise InputError(channel.path, f"{message} real header. {must}", channel.real_line)
    return number


def _require_recorder(channel: Channel, count: float) -> None:
    """Compare the range of counts with the full scale, which may be stated for one sign only."""
    scale = channel.number(_RECORDER_SCALE)
    bits = {_USUAL_BITS, channel.integer(_BITS) or _USUAL_BITS}
    spans = {length: 1e-6 * count * 2.0**length for length in sorted(bits) if 8 <= length <= 32}
    if scale > 0.0 and not any(
        _agree(span, scale) or _agree(span, 2.0 * scale) for span in spans.values()
    ):
        length, span = min(spans.items(), key=lambda pair: abs(pair[1] - scale))
        message = f"{count:g} uV a count in item {_VOLTS} of the real header make {span:g} V with "
        message += f"{length} bits, but a full scale of {scale:g} V in item {_RECORDER_SCALE}."
        # The full scale does not say whether it counts one sign or both, so it cannot be trusted.
        settle(channel.path, message, {"sensitivity": count}, channel.real_line)


def _sensor(channel: Channel, sensitivity: float) -> float:
    """Return the sensitivity of the sensor [V/g], after comparing it with the full scales."""
    output, scale = channel.number(_SENSOR_OUTPUT), channel.number(_SENSOR_SCALE)
    if output > 0.0 and scale > 0.0 and not _agree(sensitivity * scale, output):
        message = f"{sensitivity:g} V/g in item {_SENSITIVITY} of the real header and {scale:g} g "
        message += f"in item {_SENSOR_SCALE} make {sensitivity * scale:g} V, but {output:g} V in "
        values = {"sensitivity": sensitivity, "full-scale": output / scale}
        message += f"item {_SENSOR_OUTPUT}."
        return settle(channel.path, message, values, channel.real_line)
    return sensitivity


def _agree(found: float, stated: float) -> bool:
    return abs(found - stated) <= _SAME_SCALE * stated


def _time_step(channel: Channel, stage: int, given: float | None) -> float:
    """Return the time step [s]: item 34 [s] for raw data, item 62 [ms] for processed data."""
    raw, processed = channel.real(_RAW_STEP), channel.real(_STEP)
    if stage == _RAW and raw is not None:
        if processed and abs(1e-3 * processed.value - raw.value) > 1e-3 * processed.unit + raw.unit:
            message = f"time step {raw.value:g} s in item {_RAW_STEP} of the real header, but "
            message += f"{processed.value:g} ms in item {_STEP}."
            steps = {"waveform": raw.value, "header": 1e-3 * processed.value}
            return settle(channel.path, message, steps, channel.real_line)
        return raw.value
    if processed is None:
        if given is not None:
            return given
        message = f"no time step [ms] in item {_STEP} of the real header."
        raise InputError(channel.path, f"{message} State it with --time-step-s.", channel.real_line)
    return processed.value / 1e3


def _require_length(channel: Channel, length: float, step: float) -> None:
    """Compare the length with the stated one, which may be one step shorter."""
    seconds = channel.real(_LENGTH)
    if seconds is not None and abs(seconds.value - length) > 2.0 * step + seconds.unit:
        message = f"length {seconds.value:g} s in item {_LENGTH} of the real header, but "
        message += f"{length:g} s of samples in the file."
        settle(channel.path, message, {"samples": None}, channel.real_line)


def _resolution(channel: Channel, samples: Float) -> float:
    """Return one unit of the last printed digit of the largest sample, in file units."""
    largest = float(np.abs(samples).max())
    exponent = channel.layout.exponent and largest > 0.0
    power = math.floor(math.log10(largest)) + 1 if exponent else 0
    return float(10.0 ** (power - channel.layout.places))


def _peak_ratio(
    channel: Channel, samples: Float, step: float, resolution: float, *, signed: bool
) -> float:
    """Return the ratio of actual to stated peak; raise an error if they differ."""
    value = channel.real(_PEAK)
    if value is None or not samples.any():
        return math.nan
    peak = StatedPeak(
        value=value,
        time=channel.real(_PEAK_TIME),
        units=channel.heading["units"] or "counts",
        line=channel.real_line,
        # Raw files state the absolute value of the peak.
        signed=signed,
    )
    return require_peak(channel.path, samples, step, peak, resolution)


def _component(channel: Channel) -> str:
    return sections.parse_component(channel.text[8], sections.seed_name(channel.comments))
