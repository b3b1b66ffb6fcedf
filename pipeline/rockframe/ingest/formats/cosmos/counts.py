"""Convert the counts of COSMOS V0 files to acceleration with the sensitivity in the real header."""

from __future__ import annotations

from typing import Final

from rockframe.errors import InputError
from rockframe.ingest.formats.cosmos.sections import Channel
from rockframe.units import GRAVITY

#: Items of the real header: one count [uV] and full scale [V] of the recorder; sensitivity [V/g],
#: full-scale output [V] and acceleration [g], and gain of the sensor.
_COUNT, _RECORDER_SCALE = 22, 23
_SENSITIVITY, _SENSOR_OUTPUT, _SENSOR_SCALE, _GAIN = 42, 43, 44, 47
#: Item of the integer header with the sample length [bit], and the usual length.
_BITS: Final = 35
_USUAL_BITS: Final = 24
#: Largest relative difference between stated and derived values. Full scales are nominal values,
#: which differ by up to 0.5 % in real files.
_SAME_SCALE: Final = 0.02


def factor_of_counts(channel: Channel) -> tuple[float, tuple[str, ...]]:
    """Return the acceleration of one count [m s-2], and a note for `processing`.

    Raises
    ------
    InputError
        If a value is missing or not positive, or contradicts the full scale of recorder or sensor.
    """
    count = _required(channel, _COUNT, "microvolts a count")
    sensitivity = _required(channel, _SENSITIVITY, "sensitivity [V/g]")
    gain = channel.real(_GAIN)
    if gain is not None and gain.value <= 0.0:
        message = f"gain {gain.value:g} in item {_GAIN} of the real header. Must be positive."
        raise InputError(channel.path, message, channel.real_line)
    _require_recorder(channel, count)
    _require_sensor(channel, sensitivity)
    amplified = gain.value if gain else 1.0
    said = f"gain {amplified:g}" if gain else "gain unstated, taken as 1"
    done = f"counts converted with {count:g} uV a count, {sensitivity:g} V/g, {said}"
    return 1e-6 * count / amplified / sensitivity * GRAVITY, (done,)


def _required(channel: Channel, item: int, name: str) -> float:
    number = channel.real(item)
    if number is None or number.value <= 0.0:
        shown = "unknown" if number is None else f"{number.value:g}"
        raise InputError(
            channel.path,
            f"raw counts without a usable sensitivity: {name} {shown} in item {item} of the "
            "real header. Must be positive.",
            line=channel.real_line,
        )
    return number.value


def _require_recorder(channel: Channel, count: float) -> None:
    """Compare the range of counts with the full scale, which may be stated for one sign only."""
    stated = _stated(channel, _RECORDER_SCALE)
    bits = {_USUAL_BITS, channel.integer(_BITS) or _USUAL_BITS}
    spans = {length: 1e-6 * count * 2.0**length for length in sorted(bits) if 8 <= length <= 32}
    if stated and not any(
        _agree(span, stated) or _agree(span, 2.0 * stated) for span in spans.values()
    ):
        length, span = min(spans.items(), key=lambda one: abs(one[1] - stated))
        raise InputError(
            channel.path,
            f"{count:g} uV a count in item {_COUNT} of the real header make {span:g} V with "
            f"{length} bits, but a full scale of {stated:g} V in item {_RECORDER_SCALE}. "
            "Must agree.",
            line=channel.real_line,
        )


def _require_sensor(channel: Channel, sensitivity: float) -> None:
    output, scale = _stated(channel, _SENSOR_OUTPUT), _stated(channel, _SENSOR_SCALE)
    if output and scale and not _agree(sensitivity * scale, output):
        raise InputError(
            channel.path,
            f"{sensitivity:g} V/g in item {_SENSITIVITY} of the real header and {scale:g} g in "
            f"item {_SENSOR_SCALE} make {sensitivity * scale:g} V, but {output:g} V in item "
            f"{_SENSOR_OUTPUT}. Must agree.",
            line=channel.real_line,
        )


def _stated(channel: Channel, item: int) -> float:
    """Return a full scale; 0 if unknown."""
    number = channel.real(item)
    return max(number.value, 0.0) if number else 0.0


def _agree(found: float, stated: float) -> bool:
    return abs(found - stated) <= _SAME_SCALE * stated
