"""Which of many records belong together."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, replace

from rockframe.components.pair import HorizontalPair, sampling
from rockframe.errors import ParameterError
from rockframe.record import Orientation, Record


@dataclass(frozen=True)
class Unpaired:
    """A horizontal record without a partner.

    Parameters
    ----------
    record_id : str
        Of the record.
    reason : str
        Why it has none, in words.
    """

    record_id: str
    reason: str


def pair_horizontals(
    records: Iterable[Record],
) -> tuple[tuple[HorizontalPair, ...], tuple[Unpaired, ...]]:
    """Find the horizontal records that are two components of one motion.

    Parameters
    ----------
    records : iterable of Record
        Of any number of stations and events. Two belong together if they agree in event, station,
        network, start time, time step and length, and their azimuths are 90 degrees apart.

    Returns
    -------
    pairs : tuple of HorizontalPair
        In the order of their first records; with the vertical of the same motion, if it is alone.
    unpaired : tuple of Unpaired
        Every other record that is not vertical, with the reason.

    Examples
    --------
    >>> from rockframe import bundled_records, read_file
    >>> pairs, unpaired = pair_horizontals(
    ...     read_file(bundled_records() / "Ridgecrest2019-CCC.V1")
    ... )
    >>> [(pair.first.component, pair.second.component) for pair in pairs], unpaired
    ([('090', '360')], ())
    """
    pairs: list[HorizontalPair] = []
    unpaired: list[Unpaired] = []
    for motion in _motions(records):
        known = [r for r in motion if r.orientation is Orientation.HORIZONTAL]
        unpaired += [
            Unpaired(r.record_id, "direction unstated. Must be a horizontal of stated azimuth.")
            for r in motion
            if r.orientation is Orientation.UNSTATED
        ]
        try:
            if known:
                pairs.append(_pair(known, motion))
        except ParameterError as error:
            unpaired += [Unpaired(r.record_id, str(error)) for r in known]
    return tuple(pairs), tuple(unpaired)


def vertical_beside(records: Iterable[Record]) -> dict[str, Record]:
    """Find the vertical record of the same motion for each record that is not vertical.

    Parameters
    ----------
    records : iterable of Record
        As `pair_horizontals` takes them.

    Returns
    -------
    dict of str to Record
        By the identifier of the other record; without those that have none, or more than one, of
        the same event, station, network, start time, time step and length.

    Examples
    --------
    >>> from rockframe import bundled_records, read_file
    >>> records = read_file(bundled_records() / "Ridgecrest2019-CCC.V1")
    >>> [vertical.component for vertical in vertical_beside(records).values()]
    ['UP', 'UP']
    """
    found: dict[str, Record] = {}
    for motion in _motions(records):
        verticals = [r for r in motion if r.orientation.upright]
        for record in motion:
            beside = [r for r in verticals if sampling(r) == sampling(record)]
            if not record.orientation.upright and len(beside) == 1:
                found[record.record_id] = beside[0]
    return found


def _motions(records: Iterable[Record]) -> list[list[Record]]:
    motions: defaultdict[tuple[str, ...], list[Record]] = defaultdict(list)
    for record in records:
        # Without a station nothing says that two records belong together.
        alone = "" if record.station else record.record_id
        same = (record.event, record.network, record.station, record.start_time, alone)
        # A raw and a corrected file of one record are two motions.
        motions[*same, record.source_format].append(record)
    return list(motions.values())


def _pair(known: list[Record], motion: list[Record]) -> HorizontalPair:
    """The pair of a motion, or the reason why there is none."""
    names = ", ".join(record.record_id for record in known)
    where = f"of station {known[0].station!r}" if known[0].station else "without a stated station"
    if len(known) == 1:
        raise ParameterError(
            f"{names} is the only horizontal {where} with this event and start time. Must be two."
        )
    if len(known) > 2:
        raise ParameterError(f"{len(known)} horizontals {where}: {names}. Must be two.")
    pair = HorizontalPair(*known)
    verticals = [r for r in motion if r.orientation.upright]
    if len(verticals) != 1 or sampling(verticals[0]) != sampling(known[0]):
        return pair
    return replace(pair, vertical=verticals[0])
