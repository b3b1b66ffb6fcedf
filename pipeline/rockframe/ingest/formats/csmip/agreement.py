"""Compare direction, number and length, which a CSMIP channel states twice."""

from __future__ import annotations

import re
from typing import Final

from rockframe.errors import InputError
from rockframe.ingest.formats.csmip.header import CHANNEL, Header
from rockframe.ingest.metadata.identify import direction, upright_sense
from rockframe.ingest.parsing.lines import is_number
from rockframe.record import Orientation

#: Item of the integer header with the azimuth [degree], or a code above 360 for a vertical.
_DIRECTION: Final = 27
_UPRIGHT: Final = {500: Orientation.VERTICAL, 600: Orientation.DOWNWARD}
_LENGTH: Final = re.compile(r"Record Length\s*=\s*(?P<length>[\d.]+)\s*sec", re.I)
_CHANNEL_IN_LINE: Final = re.compile(r"\bChan\s+(?P<number>\d+)\s*:", re.I)


def require_agreement(header: Header, length_index: int, length: float, step: float) -> None:
    """Reject a channel whose header contradicts itself or the samples.

    Parameters
    ----------
    length_index : int
        Index of the line that states the length of the record.
    length, step : float
        Number of samples times time step, and time step [s].

    Raises
    ------
    InputError
        If two channel numbers differ, or the stated length differs from that of the samples by more
        than two steps.
    """
    _require_number(header)
    stated = _LENGTH.search(header.lines[length_index])
    token = stated["length"] if stated else ""
    if is_number(token.encode()) and abs(float(token) - length) > 2.0 * step + 0.001:
        raise InputError(
            header.path,
            f"record length {token} s stated, but {length:g} s of samples. Must agree.",
            line=header.line(length_index),
        )


def direction_of(header: Header) -> tuple[Orientation, float]:
    """Return orientation and azimuth [degree] of a channel from its name and the integer header.

    Raises
    ------
    InputError
        If name and integer header contradict each other.
    """
    stated = header.item(_DIRECTION)
    orientation, azimuth = direction(header.component)
    # 0 and -999 mean that the item is not filled in.
    if stated is None or stated <= 0 or orientation is Orientation.UNSTATED:
        return orientation, azimuth
    sense: Orientation | None = orientation
    if stated in _UPRIGHT and orientation.upright:
        sense = upright_sense(header.component, _UPRIGHT[stated])
    elif stated <= 360 if orientation.upright else (stated - azimuth) % 360.0 != 0.0:
        sense = None
    if sense is None:
        raise InputError(
            header.path,
            f"channel {header.component!r}, but {stated} in item {_DIRECTION} of the integer "
            "header. Must be the same direction.",
            line=header.line(header.name_index),
        )
    return sense, azimuth


def _require_number(header: Header) -> None:
    first = _CHANNEL_IN_LINE.search(header.lines[0])
    named = CHANNEL.match(header.lines[header.name_index])
    if first and named and first["number"] != named["number"]:
        raise InputError(
            header.path,
            f"channel {named['number']}, but channel {first['number']} in line "
            f"{header.first_line}. Must be equal.",
            line=header.line(header.name_index),
        )
