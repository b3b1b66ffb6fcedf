"""Metadata of one file or event in a catalogue."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rockframe.record import SiteType


@dataclass(frozen=True, kw_only=True)
class CatalogueEntry:
    """Metadata of one file from a catalogue; unknown values are NaN or empty.

    Parameters
    ----------
    file : str
        Name of the file.
    event, station, network : str
        Names of event, station and network.
    magnitude : float
        Magnitude of the event [1].
    epicentral_distance : float
        Distance to the epicentre [km].
    distance_rrup, distance_rjb, distance_hypocentral : float
        Distances to the rupture, to its surface projection, and to the hypocentre [km].
    vs30 : float
        Mean shear-wave velocity of the uppermost 30 m [m s-1].
    site_type : SiteType
        Free field, structure, borehole, or unknown.
    mechanism : str
        Mechanism of the event.
    lowest_usable_frequency, archive_pulse_period : float
        Lowest usable frequency [Hz] and period of the velocity pulse [s], as the archive states.
    origin_time : str
        Time of the event (ISO 8601, UTC). An entry with this time applies to the records that began
        then, at the station of the entry if it names one.
    source : str
        Source of the metadata.

    Examples
    --------
    >>> CatalogueEntry(file="PUL164.AT2", magnitude=6.6).magnitude
    6.6
    """

    file: str
    event: str = ""
    station: str = ""
    network: str = ""
    magnitude: float = math.nan
    epicentral_distance: float = math.nan
    distance_rrup: float = math.nan
    distance_rjb: float = math.nan
    distance_hypocentral: float = math.nan
    vs30: float = math.nan
    site_type: SiteType = SiteType.UNKNOWN
    mechanism: str = ""
    lowest_usable_frequency: float = math.nan
    archive_pulse_period: float = math.nan
    origin_time: str = ""
    source: str = ""
