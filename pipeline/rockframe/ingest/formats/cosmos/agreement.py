"""Check that the text and the numeric headers of a COSMOS channel agree."""

from __future__ import annotations

import math
import re
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import InputError
from rockframe.ingest.formats.cosmos.names import corners_of, seed_name
from rockframe.ingest.formats.cosmos.sections import Channel
from rockframe.ingest.metadata.identify import direction, upright_sense
from rockframe.ingest.parsing.peaks import Printed, StatedPeak, require_peak
from rockframe.record import Orientation

#: Item of the integer header that states the processing stage, and the names of the stages.
_STAGE: Final = 1
_STAGES: Final = {"raw": 0, "uncorrected": 1, "corrected": 2}
#: Item of the integer header with the quantity, and the meaning of its codes.
QUANTITY: Final = 2
QUANTITIES: Final = {
    1: "acceleration",
    2: "velocity",
    3: "displacement",
    4: "relative displacement",
    10: "angular acceleration",
    11: "angular velocity",
    12: "angular displacement",
}
_QUANTITY_WORD: Final = re.compile(r"\b(accel|veloc|displ)", re.I)
#: Item of the integer header with the azimuth [degree], or a code for up or down.
_AZIMUTH: Final = 54
_UPRIGHT: Final = {400: Orientation.VERTICAL, 401: Orientation.DOWNWARD}
#: Codes of units, by their names in the line above the samples.
_GAL: Final = ("cm/sec2", "cm/sec/sec", "cm/s/s", "cm/s2", "gal", "gals")
_CODES: Final = {"g": {2}, "counts": {50}, **{name: {4, 10} for name in _GAL}}
#: Items of the real header with the corners of high-pass and low-pass [Hz].
_CORNERS: Final = (54, 57)
#: Indices of the text lines with the largest raw and the largest processed sample.
_RAW_MAX, _MAX = 9, 10
_MAXIMUM: Final = re.compile(
    r"\bmax\s*=\s*(?P<peak>[-+]?\d+\.?\d*)\s*(?P<units>[^\s,]*?)\s*,?\s+at\s+"
    r"(?P<time>\d+\.?\d*)\s*sec",
    re.I,
)


def require_quantity(channel: Channel) -> None:
    """Reject a channel whose title or heading contradicts the quantity in the integer header.

    Raises
    ------
    InputError
        If they differ. Otherwise an acceleration that one header calls a velocity would be skipped.
    """
    code = channel.integer(QUANTITY)
    name = QUANTITIES.get(code or 0, "unknown")
    stated = name if code is None else f"{code} ({name})"
    title = channel.text[0].partition("(")[0].strip()
    heading = channel.heading["what"]
    for said, line in ((title, channel.first_line), (heading, channel.sample_line)):
        word = _QUANTITY_WORD.search(said)
        if word and word[1].lower() not in name:
            message = f"{said!r}, but quantity {stated} in item {QUANTITY} of the integer header."
            raise InputError(channel.path, f"{message} Must agree.", line)


def require_agreement(
    channel: Channel, samples: NDArray[np.float64], step: float, resolution: float
) -> None:
    """Reject an acceleration channel whose text and numeric headers contradict each other.

    Parameters
    ----------
    samples : array, shape (samples,)
        Samples in file units.
    step : float
        Time step [s].
    resolution : float
        One unit of the last printed digit of the samples.

    Raises
    ------
    InputError
        If stage, units, filter corners, or the largest sample and its time differ.
    """
    path = channel.path
    word = channel.text[0].split()[0].lower() if channel.text[0].split() else ""
    stage = channel.integer(_STAGE)
    if _STAGES.get(word, stage) != stage:
        message = f"{word!r}, but stage {stage} in item {_STAGE} of the integer header."
        raise InputError(path, f"{message} Must agree.", line=channel.first_line)
    name, code = channel.heading["units"].strip().lower(), int(channel.heading["code"])
    if code not in _CODES.get(name, {code}):
        message = f"units {channel.heading['units']!r}, but code {code}. Must agree."
        raise InputError(path, message, line=channel.sample_line)
    _require_corners(channel)
    _require_maximum(channel, samples, step, resolution, raw=stage == 0)


def direction_of(channel: Channel, component: str) -> tuple[Orientation, float]:
    """Return orientation and azimuth [degree] of a channel from its name and the integer header.

    Raises
    ------
    InputError
        If name and integer header contradict each other.
    """
    orientation, azimuth = direction(component)
    if orientation is Orientation.UNSTATED and component == seed_name(channel.comments).channel:
        # In a SEED channel code, only the letter Z states a direction for certain.
        orientation, azimuth = direction(component[-1] if component.endswith("Z") else "")
    stated = channel.integer(_AZIMUTH)
    sense: Orientation | None = orientation
    if stated in _UPRIGHT and orientation.upright:
        sense = upright_sense(component, _UPRIGHT[stated])
    if stated is not None and orientation is Orientation.HORIZONTAL:
        sense = None if (stated - azimuth) % 360.0 != 0.0 else orientation
    if sense is None:
        raise InputError(
            channel.path,
            f"component {component} stated, but {stated} in item {_AZIMUTH} of the integer header. "
            "Must be equal.",
            line=channel.first_line + 8,
        )
    return sense, azimuth


def _require_corners(channel: Channel) -> None:
    for item, words in zip(_CORNERS, corners_of(channel.text), strict=True):
        stated = channel.real(item)
        if stated is None or stated.value <= 0.0 or math.isnan(words):
            continue
        if abs(stated.value - words) > 0.05 * words:
            message = (
                f"filter corner {words:g} Hz in words, but {stated.value:g} Hz in item {item} of "
                "the real header. Must agree."
            )
            raise InputError(channel.path, message, line=channel.first_line + 11)


def _require_maximum(
    channel: Channel, samples: NDArray[np.float64], step: float, resolution: float, *, raw: bool
) -> None:
    index = _RAW_MAX if raw else _MAX
    stated = _MAXIMUM.search(channel.text[index])
    if not stated:
        return
    name, code = stated["units"].lower(), int(channel.heading["code"])
    if code not in _CODES.get(name, set()):  # stated in other units, or without units
        return
    peak = StatedPeak(
        value=Printed.of(stated["peak"]),
        time=Printed.of(stated["time"]),
        units=stated["units"],
        line=channel.first_line + index,
        # For raw counts the header states the absolute value.
        signed=not raw,
    )
    require_peak(channel.path, samples, step, peak, resolution)
