"""Search for the records that are components of one motion."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Hashable, Iterable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from rockframe.components.pair import HorizontalPair
from rockframe.errors import ParameterError
from rockframe.record import Orientation, Record

#: Largest difference in length of channels of one motion, as a share of the longest. They are cut
#: or padded with zeros to one length; a larger difference means that they do not belong together.
_SPARE: Final = 0.05


@dataclass(frozen=True)
class Unpaired:
    """A horizontal record without a partner.

    Parameters
    ----------
    record_id : str
        Identifier of the record.
    reason : str
        Why it has no partner, as a sentence.
    """

    record_id: str
    reason: str


def pair_horizontals(
    records: Iterable[Record],
) -> tuple[tuple[HorizontalPair, ...], tuple[Unpaired, ...]]:
    """Return the pairs of horizontal records that are components of one motion.

    Parameters
    ----------
    records : iterable of Record
        Records of any number of stations and events. Two form a pair if they have the same event,
        station, network, start time, format and time step, and their azimuths are 90 degrees apart.
        Channels whose lengths differ by at most 5 %, including the vertical, are cut to the
        shortest.

    Returns
    -------
    pairs : tuple of HorizontalPair
        Pairs in the order of their first records, with the vertical of the same motion if there is
        exactly one.
    unpaired : tuple of Unpaired
        All other records that are not vertical, with the reason.

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
    """Return the vertical record of the same motion for each record that is not vertical.

    Parameters
    ----------
    records : iterable of Record
        Records of any number of stations and events.

    Returns
    -------
    dict of str to Record
        Vertical records by the identifier of the other record. Each is cut or padded with zeros to
        the length of that record, by at most 5 %. Records without exactly one vertical of the same
        event, station, network, start time, format and time step are omitted.

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
            beside = [r for r in verticals if _fits(r, record)]
            if not record.orientation.upright and len(beside) == 1:
                found[record.record_id] = _of_length(beside[0], record.acceleration.size)
    return found


def motion_of(record: Record) -> Hashable:
    """Return the key that all components of one motion share.

    Parameters
    ----------
    record : Record
        Any component.

    Examples
    --------
    >>> one = Record(record_id="a", acceleration=[0.0, 1.0], time_step=0.1, station="CCC")
    >>> motion_of(one) == motion_of(replace(one, record_id="b", component="090"))
    True
    """
    # A record without a station has a key of its own: it cannot be matched. The format is part of
    # the key because a raw and a corrected file of one record are two motions.
    alone = "" if record.station else record.record_id
    same = (record.event, record.network, record.station, record.start_time)
    return *same, record.source_format, alone


def _motions(records: Iterable[Record]) -> list[list[Record]]:
    motions: defaultdict[Hashable, list[Record]] = defaultdict(list)
    for record in records:
        motions[motion_of(record)].append(record)
    return list(motions.values())


def _fits(one: Record, other: Record) -> bool:
    """Return whether time steps are equal and lengths within 5 % of each other."""
    sizes = one.acceleration.size, other.acceleration.size
    return one.time_step == other.time_step and min(sizes) >= (1.0 - _SPARE) * max(sizes)


def _of_length(record: Record, count: int) -> Record:
    """Cut a record or pad it with zeros to a length, and note it in `processing`."""
    size = record.acceleration.size
    if size == count:
        return record
    more = np.zeros(max(count - size, 0))
    what = f"cut to {count} of {size}" if size > count else f"continued with zeros to {count}"
    return replace(
        record,
        acceleration=np.r_[record.acceleration[:count], more],
        processing=(*record.processing, f"length: {what} samples, as of the motion"),
    )


def _pair(known: list[Record], motion: list[Record]) -> HorizontalPair:
    """Return the pair of a motion, or raise a ParameterError with the reason why there is none."""
    names = ", ".join(record.record_id for record in known)
    where = f"of station {known[0].station!r}" if known[0].station else "without a stated station"
    if len(known) == 1:
        raise ParameterError(
            f"{names} is the only horizontal {where} with this event and start time. Must be two."
        )
    if len(known) > 2:
        raise ParameterError(f"{len(known)} horizontals {where}: {names}. Must be two.")
    if not _fits(*known):
        return HorizontalPair(*known)  # raises an error that states the difference
    verticals = [r for r in motion if r.orientation.upright]
    beside = verticals if len(verticals) == 1 and _fits(verticals[0], known[0]) else []
    count = min(record.acceleration.size for record in (*known, *beside))
    one, other, *vertical = (_of_length(record, count) for record in (*known, *beside))
    return HorizontalPair(one, other, vertical[0] if vertical else None)
