"""What came in of a request, and what it tells a catalogue."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from rockframe.fetch.coverage import Coverage
from rockframe.fetch.facts import Channel
from rockframe.fetch.request import Event


@dataclass(frozen=True)
class Fetched:
    """What came in.

    Parameters
    ----------
    event : Event or None
        Facts of the event.
    channels : tuple of Channel
        The channels whose waveforms came in.
    coverage : tuple of Coverage
        One row for each channel, and one for whatever else is missing.

    Examples
    --------
    >>> Fetched(None, (), ()).complete
    True
    """

    event: Event | None
    channels: tuple[Channel, ...]
    coverage: tuple[Coverage, ...]

    @property
    def complete(self) -> bool:
        """Whether all that was asked for came in."""
        return all(row.complete for row in self.coverage)

    def facts(self) -> list[dict[str, Any]]:
        """Return what is known of each file of waveforms, by the names of a catalogue."""
        event = self.event
        return [
            {
                "file": f"{channel.name}.mseed",
                "event": event.name if event else "",
                "station": channel.station,
                "network": channel.network,
                "magnitude": event.magnitude if event else math.nan,
                "epicentral_distance": round(channel.distance, 1),
                "source": f"{event.source}; distance: WGS84 geodesic" if event else "",
            }
            for channel in self.channels
        ]
