"""Channels of one motion, and of one recording."""

from __future__ import annotations

import math
import re
from collections import defaultdict
from collections.abc import Hashable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Final, NamedTuple, Self

from rockframe.record import Orientation, Part, Record
from rockframe.units import utc_seconds

#: Largest time between samples that count as simultaneous, as a share of the time step. It turns
#: the phase by 2 degrees at a tenth of the sampling rate.
SAME_TIME: Final = 0.05
#: Least share of the shorter of two records that lies within the other if they are of one motion.
_OVERLAP: Final = 0.5
#: Band and instrument of the SEED code of an accelerometer's channel, and its direction.
_CODE: Final = r"(?P<instrument>[FGDCESHBML][NLG])[ZNE1-3A-CR-W]"
#: The same in an identifier, after its location: ``CI.CCC.00.HNE``.
_LOCATED: Final = re.compile(rf"\.(?P<location>\w{{0,2}})\.{_CODE}(?![^\W_])")
#: Reason why a horizontal is no pair, if nothing else is beside it.
ALONE: Final = "no other horizontal of the same event and stated station overlaps it in time."


class Channel(NamedTuple):
    """Metadata of a record from which `motions_of` finds the other components of its motion.

    ``samples`` is the number of samples; the other fields are those of `Record`.
    """

    event: str
    network: str
    station: str
    start_time: str
    source_format: str
    record_id: str
    orientation: Orientation
    time_step: float
    samples: int
    component: str = ""

    @classmethod
    def of(cls, record: Record) -> Self:
        """Return the metadata of a record."""
        names = (name for name in cls._fields if name != "samples")
        fields = {name: getattr(record, name) for name in names}
        return cls(**fields, samples=record.acceleration.size)

    @property
    def place(self) -> Hashable:
        """Event, station and format; a record without a station has a place of its own."""
        # The format is included because a raw and a corrected file of one record are two motions.
        alone = "" if self.station else self.record_id
        return self.event, self.network, self.station, self.source_format, alone

    @property
    def instrument(self) -> tuple[str | None, str]:
        """Location, None if unknown, and band and instrument code, "" if unknown."""
        if match := _LOCATED.search(self.record_id):
            return match["location"], match["instrument"]
        coded = re.fullmatch(_CODE, self.component)
        return None, coded["instrument"] if coded else ""

    @property
    def span(self) -> tuple[float, float]:
        """Times of the first and last sample [s]; NaN without a start time."""
        start = utc_seconds(self.start_time)
        return start, start + self.time_step * (self.samples - 1)

    def overlaps(self, other: Channel) -> bool:
        """Return whether both begin at one time, or at least half of the shorter is within the
        other.
        """
        if self.place != other.place:
            return False
        if self.start_time == other.start_time:
            return True
        (start, end), (begin, finish) = self.span, other.span
        if math.isnan(start) or math.isnan(begin):
            return False
        shorter = min(end - start, finish - begin)
        return min(end, finish) - max(start, begin) >= _OVERLAP * shorter


def motions_of(channels: Sequence[Channel]) -> list[list[int]]:
    """Group the channels that recorded the same motion; return their numbers for each motion.

    Channels belong to one motion if they are of one event, station and format, overlap in time, and
    are of one instrument (as far as SEED codes and locations tell). An instrument has two
    horizontals and a vertical; if there are more channels, those that begin together are one
    motion. Motions are in the order of their first channels.

    Parameters
    ----------
    channels : sequence of Channel
        Channels of any number of stations and events.

    Examples
    --------
    >>> east = Channel("", "CE", "89146", "2019-07-06T03:19:40Z", "miniseed", "e",
    ...                Orientation.HORIZONTAL, 0.01, 9000)
    >>> north = east._replace(record_id="n", start_time="2019-07-06T03:19:45Z")
    >>> later = east._replace(record_id="l", start_time="2019-07-06T09:00:00Z")
    >>> motions_of([east, later, north])
    [[0, 2], [1]]
    """
    chains = _overlapping(channels)
    return sorted(sorted(motion) for chain in chains for motion in _motions_in(channels, chain))


def _overlapping(channels: Sequence[Channel]) -> Iterator[list[int]]:
    """Yield the numbers of channels that overlap in time, each with the next one at least, in the
    order of their start times.
    """

    def order(numbers: list[int]) -> tuple[bool, float]:
        start, _ = channels[numbers[0]].span
        return math.isnan(start), start

    together: defaultdict[Hashable, list[int]] = defaultdict(list)
    for number, channel in enumerate(channels):
        together[channel.place, channel.start_time].append(number)
    places: defaultdict[Hashable, list[list[int]]] = defaultdict(list)
    for numbers in together.values():
        places[channels[numbers[0]].place].append(numbers)
    for groups in places.values():
        chain: list[int] = []
        last = channels[groups[0][0]]
        for numbers in sorted(groups, key=order):
            longest = max(
                (channels[number] for number in numbers), key=lambda channel: channel.span[1]
            )
            if chain and not last.overlaps(longest):
                yield chain
                chain = []
            last = max(last, longest, key=lambda channel: channel.span[1]) if chain else longest
            chain = [*chain, *numbers]
        yield chain


def _motions_in(channels: Sequence[Channel], chain: Sequence[int]) -> Iterator[list[int]]:
    """Yield the motions of channels that overlap in time."""
    for numbers in _by_instrument(channels, chain):
        vertical = sum(channels[number].orientation.upright for number in numbers)
        if vertical <= 1 and len(numbers) - vertical <= 2:
            yield numbers
        else:  # instruments that cannot be distinguished, or windows of several shocks
            yield from _by_start(channels, numbers)


def _by_instrument(channels: Sequence[Channel], chain: Sequence[int]) -> list[list[int]]:
    """Return the channels of each instrument. A location counts if it is known of all channels. A
    channel of unknown code is of the only known instrument, or else of one of its own.
    """
    instruments = [channels[number].instrument for number in chain]
    located = all(location is not None for location, _ in instruments)
    stated_codes = {(location if located else None, code) for location, code in instruments if code}
    groups: defaultdict[Hashable, list[int]] = defaultdict(list)
    for number, (location, code) in zip(chain, instruments, strict=True):
        own = (location if located else None, code)
        groups[next(iter(stated_codes)) if len(stated_codes) == 1 else own].append(number)
    return list(groups.values())


def _by_start(channels: Sequence[Channel], numbers: Sequence[int]) -> list[list[int]]:
    """Return the channels that begin together, of channels in the order of their start times."""
    groups = [[numbers[0]]]
    for before, number in pairwise(numbers):
        earlier, other = channels[before], channels[number]
        late = other.span[0] - earlier.span[0]
        if earlier.start_time == other.start_time or late <= SAME_TIME * earlier.time_step:
            groups[-1].append(number)
        else:
            groups.append([number])
    return groups


def reasons_alone(channels: Sequence[Channel]) -> dict[str, str]:
    """Return why a channel is no pair if its motion has no other horizontal, by its identifier.

    Parameters
    ----------
    channels : sequence of Channel
        Channels of any number of stations and events.

    Examples
    --------
    >>> east = Channel("", "CE", "89146", "2019-07-06T03:19:40Z", "miniseed", "CE.89146.00.HNE",
    ...                Orientation.HORIZONTAL, 0.01, 9000, "HNE")
    >>> north = east._replace(record_id="CE.89146.10.HNN", component="HNN")
    >>> reasons_alone([east])["CE.89146.00.HNE"] == ALONE
    True
    >>> reasons_alone([east, north])["CE.89146.00.HNE"][:64]
    'of the horizontals that overlap in time (CE.89146.00.HNE, CE.891'
    """
    reasons: dict[str, str] = {}
    # A raw and a corrected file overlap too.
    for chain in _overlapping([channel._replace(source_format="") for channel in channels]):
        level = [n for n in sorted(chain) if channels[n].orientation is Orientation.HORIZONTAL]
        names = ", ".join(channels[number].record_id for number in level)
        beside = (
            f"of the horizontals that overlap in time ({names}), no other is of the same "
            "instrument, window and file format. A pair has two."
        )
        for number in chain:
            others = [channel for channel in level if channel != number]
            reasons[channels[number].record_id] = beside if others else ALONE
    return reasons


def recordings_of_channels(
    channels: Sequence[Channel], parts: Mapping[str, Sequence[Part]]
) -> list[tuple[str, ...]]:
    """Return the recording of each channel: a key that records which are not independent share.

    Channels of one event and station that overlap in time share it, whatever their instrument and
    format, and so do a sequence and all the motions that it consists of.

    Parameters
    ----------
    channels : sequence of Channel
        Channels of any number of stations and events.
    parts : mapping of str to sequence of Part
        Motions of each sequence, by its identifier.

    Examples
    --------
    >>> main = Channel("", "", "", "", "", "main", Orientation.HORIZONTAL, 0.01, 9000)
    >>> after, both = main._replace(record_id="after"), main._replace(record_id="both")
    >>> joined = {"both": (Part("main", 0.0, 90.0), Part("after", 210.0, 300.0))}
    >>> len(set(recordings_of_channels([main, after, both], joined)))
    1
    """
    named: dict[str, tuple[str, ...]] = {}
    for numbers in _overlapping([channel._replace(source_format="") for channel in channels]):
        first = channels[numbers[0]]
        alone = "" if first.station else first.record_id
        key = (first.event, first.network, first.station, first.start_time, alone)
        named |= {channels[number].record_id: key for number in numbers}
    for name, motions in parts.items():
        # A part that is not among the channels is known by its name alone.
        joined = [named.get(part.record_id, (part.record_id,)) for part in motions]
        named |= {part.record_id: joined[0] for part in motions}
        shared = {*joined}
        named |= {motion: joined[0] for motion, key in named.items() if key in shared}
        named[name] = joined[0]
    return [named[channel.record_id] for channel in channels]
