"""What the records' pulses alone do, as values of response.nc."""

from __future__ import annotations

from typing import Any

from rockframe.results.schema import RESPONSE_NC
from rockframe.results.schema.response import FateUnderPulse
from rockframe.rocking import ToPulse


def to_pulse_values(rows: list[list[ToPulse | None]]) -> dict[str, Any]:
    """Return the values, records by structures, by variable; None where a record has no pulse."""
    values = RESPONSE_NC.filled("to_pulse", rows)
    values["verdict_to_pulse"] = [
        [FateUnderPulse.NO_PULSE if fate is None else fate for fate in row]
        for row in values["verdict_to_pulse"]
    ]
    return values
