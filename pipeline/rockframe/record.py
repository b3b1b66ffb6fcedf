"""One component of a strong-motion record and its metadata."""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from hashlib import sha256
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.notebook import Shown
from rockframe.units import GRAVITY, acceleration_factor, plain_units

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

#: Largest number of characters in a record identifier.
LONGEST_ID: Final = 64
#: Identifiers of ASCII characters alone.
_ASCII_ID: Final = re.compile(rf"[A-Za-z0-9][A-Za-z0-9._-]{{0,{LONGEST_ID - 1}}}")


def is_record_id(name: str) -> bool:
    """Return whether a text is a valid record identifier: safe in file names, URLs and shells.

    Parameters
    ----------
    name : str
        1 to 64 letters, digits, points, hyphens and underscores. The first character must be a
        letter or digit. Letters of any script are allowed, including combining vowel signs.

    Examples
    --------
    >>> is_record_id("Αθήνα_1"), is_record_id("../a"), is_record_id("-a")
    (True, False, False)
    """
    if name.isascii():
        return _ASCII_ID.fullmatch(name) is not None
    kinds = [unicodedata.category(character) for character in name]
    return (
        0 < len(name) <= LONGEST_ID
        and (kinds[0][0] == "L" or kinds[0] == "Nd")
        and all(
            kind[0] in "LM" or kind == "Nd" or character in "._-"
            for kind, character in zip(kinds, name, strict=True)
        )
    )


class Orientation(IntEnum):
    """Direction of a component; the values of the flag variable `orientation`.

    ``VERTICAL`` is positive upwards; ``DOWNWARD`` is vertical and positive downwards.
    """

    HORIZONTAL = 0
    VERTICAL = 1
    UNSTATED = 2
    DOWNWARD = 3

    @property
    def upright(self) -> bool:
        """True if the component is vertical, whether positive upwards or downwards."""
        return self in (Orientation.VERTICAL, Orientation.DOWNWARD)


class SiteType(IntEnum):
    """Location of the sensor, if the header states it; the values of the flag `site_type`."""

    UNKNOWN = 0
    FREE_FIELD = 1
    STRUCTURE = 2
    BOREHOLE = 3

    @property
    def words(self) -> str:
        """Name for options and tables: ``free-field``."""
        return self.name.lower().replace("_", "-")

    @classmethod
    def named(cls, words: str) -> SiteType:
        """Return the site with a name.

        Examples
        --------
        >>> SiteType.named("free-field").words
        'free-field'
        """
        return cls[words.upper().replace("-", "_")]


@dataclass(frozen=True)
class Part:
    """One motion of a sequence.

    Parameters
    ----------
    record_id : str
        Identifier of its record.
    start, end : float
        Times of its first and last sample in the sequence [s].

    Examples
    --------
    >>> str(Part("main", 0.0, 39.995)), Part.of("main 0 39.995").end
    ('main 0 39.995', 39.995)
    """

    record_id: str
    start: float
    end: float

    def __str__(self) -> str:
        return f"{self.record_id} {self.start:.12g} {self.end:.12g}"

    @classmethod
    def of(cls, text: str) -> Part:
        """Return the motion that is stated as identifier, start and end."""
        name, start, end = text.split()
        return cls(name, float(start), float(end))


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Record(Shown):
    """One component of ground acceleration, evenly sampled. Unknown values are NaN or empty.

    Parameters
    ----------
    record_id : str
        Identifier that satisfies `is_record_id`.
    acceleration : array, shape (samples,)
        Ground acceleration [m s-2]; stored as a read-only copy.
    time_step : float
        Interval between samples [s].
    uncorrected : bool
        True if the archive publishes the record without baseline correction.
    component : str
        Name of the component in the archive.
    orientation : Orientation
        Horizontal, vertical (upwards or downwards), or unstated.
    azimuth : float
        Direction of positive acceleration, clockwise from north [degree].
    site_type : SiteType
        Free field, in a structure, in a borehole, or unknown.
    event, station, network, start_time : str
        Names from the file, and the time of the first sample (ISO 8601, UTC).
    magnitude : float
        Magnitude of the event [1].
    epicentral_distance : float
        Distance to the epicentre [km].
    distance_rrup, distance_rjb, distance_hypocentral : float
        Shortest distance to the rupture, Joyner-Boore distance, and distance to the hypocentre
        [km].
    mechanism : str
        Mechanism of the earthquake.
    lowest_usable_frequency, archive_pulse_period : float
        Lowest usable frequency [Hz] and period of the velocity pulse [s], as the archive states.
    vs30 : float
        Mean shear-wave velocity of the uppermost 30 m [m s-1].
    facts_source : str
        Source of event, magnitude and distance.
    source_file, source_format, source_sha256 : str
        Name, format and SHA-256 of the file.
    instrument_file, instrument_sha256 : str
        Name and SHA-256 of the StationXML file used to convert counts to acceleration.
    peak_ratio : float
        Peak of the samples in the file divided by the peak stated in its header [1]; negative if
        the header states a sign and it differs.
    filter_low, filter_high : float
        Corners of the filters applied, by the archive (as it states them) and by this package [Hz].
    processing : tuple of str
        Processing steps, in order.
    trusted : tuple of str
        Contradictions in the file that the user settled: the trusted word, and both statements.
    parts : tuple of Part
        Motions of a sequence, see `in_sequence`; empty for other records.

    Raises
    ------
    ParameterError
        If the identifier, the samples or the time step are invalid.

    Examples
    --------
    >>> Record(record_id="shake", acceleration=np.array([0.0, 1.0, 0.0]), time_step=0.01).duration
    0.02
    """

    record_id: str
    acceleration: NDArray[np.float64]
    time_step: float
    uncorrected: bool = False
    component: str = ""
    orientation: Orientation = Orientation.UNSTATED
    azimuth: float = math.nan
    site_type: SiteType = SiteType.UNKNOWN
    event: str = ""
    station: str = ""
    network: str = ""
    start_time: str = ""
    magnitude: float = math.nan
    epicentral_distance: float = math.nan
    distance_rrup: float = math.nan
    distance_rjb: float = math.nan
    distance_hypocentral: float = math.nan
    mechanism: str = ""
    lowest_usable_frequency: float = math.nan
    archive_pulse_period: float = math.nan
    vs30: float = math.nan
    facts_source: str = ""
    source_file: str = ""
    source_format: str = ""
    source_sha256: str = ""
    instrument_file: str = ""
    instrument_sha256: str = ""
    peak_ratio: float = math.nan
    filter_low: float = math.nan
    filter_high: float = math.nan
    processing: tuple[str, ...] = ()
    trusted: tuple[str, ...] = ()
    parts: tuple[Part, ...] = ()

    def __post_init__(self) -> None:
        if not is_record_id(self.record_id):
            raise ParameterError(
                f"Invalid record identifier {self.record_id!r}. Must be 1 to {LONGEST_ID} letters, "
                "digits, points, hyphens or underscores, and begin with a letter or digit."
            )
        # A read-only array that owns its data, such as that of another record, needs no copy.
        given = np.asarray(self.acceleration, dtype=np.float64)
        samples = given.copy() if given.flags.writeable or not given.flags.owndata else given
        if samples.ndim != 1 or samples.size < 2:
            raise ParameterError(
                f"Invalid acceleration of shape {samples.shape} in record {self.record_id!r}. "
                "Must be one row of two samples or more."
            )
        if not np.isfinite(samples).all():
            where = int(np.flatnonzero(~np.isfinite(samples))[0])
            raise ParameterError(
                f"Invalid acceleration {samples[where]} at sample {where} of record "
                f"{self.record_id!r}. Must be finite."
            )
        if not (math.isfinite(self.time_step) and self.time_step > 0.0):
            raise ParameterError(
                f"Invalid time step {self.time_step!r} s of record {self.record_id!r}. "
                "Must be positive and finite."
            )
        samples.flags.writeable = False
        object.__setattr__(self, "acceleration", samples)

    @property
    def time(self) -> NDArray[np.float64]:
        """Times of the samples since the first one [s], shape (samples,)."""
        return self.time_step * np.arange(self.acceleration.size, dtype=np.float64)

    @property
    def duration(self) -> float:
        """Time from the first to the last sample [s]."""
        return self.time_step * (self.acceleration.size - 1)

    def facts(self) -> dict[str, str]:
        """Return the known metadata and the PGA, for the table in notebooks."""
        said = {
            "record": self.record_id,
            "earthquake": self.event,
            "station": self.station,
            "component": self.component,
            "magnitude": "" if math.isnan(self.magnitude) else f"{self.magnitude:g}",
            "PGA": f"{self.pga / GRAVITY:.3f} g",
            "samples": f"{self.acceleration.size} at {self.time_step:g} s",
        }
        return {name: value for name, value in said.items() if value}

    def draw(self, axes: Axes) -> None:
        """Draw the acceleration over time."""
        axes.plot(self.time, self.acceleration / GRAVITY, linewidth=0.7)
        axes.set(xlabel="time [s]", ylabel="acceleration [g]", title=self.record_id)

    def to_xarray(self) -> xr.DataArray:
        """Return the acceleration [m s-2] over time [s], with the metadata as attributes."""
        import xarray as xr

        texts = {k: v for k, v in vars(self).items() if isinstance(v, str) and v}
        return xr.DataArray(
            self.acceleration,
            {"time": ("time", self.time, {"units": "s"})},
            name="acceleration",
            attrs={"units": "m s-2", "long_name": "ground acceleration", **texts},
        )

    @classmethod
    def from_trace(cls, trace: Any, *, units: str = "m/s2", **fields: Any) -> Record:
        """Return the record of an obspy trace of acceleration.

        Parameters
        ----------
        trace : obspy.Trace
            Samples without gaps. The third letter of a SEED channel code states the direction:
            Z is upwards, N and E are the azimuths 0 and 90; other letters and numbers state none.
        units : str
            Unit of the samples: g, gal, cm/s2, mm/s2 or m/s2.
        **fields
            Other parameters of `Record`, such as ``azimuth``, in place of those from the trace.

        Raises
        ------
        ParameterError
            If the trace has a gap, the unit is unknown, or the record is invalid.

        Examples
        --------
        >>> from obspy import Trace
        >>> header = {"network": "CI", "station": "CCC", "channel": "HNE", "delta": 0.01}
        >>> record = Record.from_trace(Trace(np.array([0.0, 0.1, 0.0]), header), units="g")
        >>> record.record_id, record.azimuth, round(record.pga, 3)
        ('CI.CCC..HNE', 90.0, 0.981)
        """
        stats = trace.stats
        if np.ma.is_masked(trace.data):
            raise ParameterError(
                f"Invalid trace {trace.id!r}: it has a gap. Must be without gaps: split it."
            )
        factor = acceleration_factor(plain_units(units))
        orientation, azimuth = _seed_direction(str(stats.channel))
        field_values: dict[str, Any] = {
            "record_id": trace.id.lstrip("._-") or "trace",
            "acceleration": factor * np.asarray(trace.data, dtype=np.float64),
            "time_step": float(stats.delta),
            "component": str(stats.channel),
            "orientation": orientation,
            "azimuth": azimuth,
            "station": str(stats.station),
            "network": str(stats.network),
            "start_time": str(stats.starttime) if stats.starttime.timestamp else "",
        }
        return cls(**field_values | fields)

    @classmethod
    def from_stream(cls, stream: Iterable[Any], *, units: str = "m/s2") -> list[Record]:
        """Return a record for each trace of an obspy stream, see `from_trace`.

        Examples
        --------
        >>> from obspy import Stream, Trace
        >>> Record.from_stream(Stream([Trace(np.ones(3), {"station": "CCC"})]))[0].station
        'CCC'
        """
        return [cls.from_trace(trace, units=units) for trace in stream]

    @property
    def pga(self) -> float:
        """Peak ground acceleration: the largest absolute sample [m s-2]."""
        return float(np.abs(self.acceleration).max())

    def scaled(self, factor: float) -> Record:
        """Return the record times a factor, and note it in `processing`.

        Examples
        --------
        >>> shake = Record(record_id="shake", acceleration=np.array([0.0, -2.0]), time_step=0.01)
        >>> shake.scaled(1.5).pga, shake.scaled(1.5).processing
        (3.0, ('scaled by 1.5',))
        """
        steps = (*self.processing, f"scaled by {factor:g}")
        return replace(self, acceleration=factor * self.acceleration, processing=steps)

    @property
    def samples_sha256(self) -> str:
        """SHA-256 of time step and samples; identifies the input of a computation."""
        step = np.array([self.time_step], dtype="<f8")
        return sha256(step.tobytes() + self.acceleration.astype("<f8").tobytes()).hexdigest()


def _seed_direction(channel: str) -> tuple[Orientation, float]:
    """Return the direction that the third letter of a SEED channel code states."""
    letter = channel[2:] if len(channel) == 3 else ""
    if letter == "Z":
        return Orientation.VERTICAL, math.nan
    azimuth = {"N": 0.0, "E": 90.0}.get(letter, math.nan)
    return Orientation.UNSTATED if math.isnan(azimuth) else Orientation.HORIZONTAL, azimuth


def within_length(name: str, longest: int = LONGEST_ID) -> str:
    """Return the name, shortened if necessary and then made unique by a hash."""
    if len(name) <= longest:
        return name
    mark = f"-{sha256(name.encode()).hexdigest()[:8]}"
    return name[: longest - len(mark)] + mark


#: Relative tolerance between time steps.
SAME_STEP: Final = 1e-9
#: Largest angle between components that are in one direction [degrees]: sensors are turned less.
_ONE_DIRECTION: Final = 1.0
#: Values that a sequence takes from its strongest motion.
_OF_STRONGEST: Final = (
    *("magnitude", "epicentral_distance", "distance_rrup", "distance_rjb", "distance_hypocentral"),
    *("mechanism", "vs30", "lowest_usable_frequency", "archive_pulse_period"),
)
#: Values that a sequence has if they are the same for all of its motions.
_COMMON: Final = (
    "station",
    "network",
    "component",
    "source_format",
    "source_sha256",
)


def in_sequence(records: Sequence[Record], rest: float) -> Record:
    """Return a mainshock and its aftershocks as one record: motions with still ground between them.

    A frame that responds to it comes to rest between the motions, and keeps what it cannot undo:
    the stretch of its dissipaters and the lost prestress of its tendons. The samples are joined by
    straight lines, also from the last sample of a motion to the still ground.

    Parameters
    ----------
    records : sequence of Record
        Components in one direction, in the order in which they shake the frame. The sequence of one
        record is the record itself.
    rest : float
        Time from the last sample of a motion to the first of the next one [s], rounded up to whole
        time steps. A frame must come to rest within it, which `with_parts` checks; 120 s are enough
        for most.

    Returns
    -------
    Record
        With the shortest time step of the records, and their times in `parts`. Magnitude, distances
        and the like are those of the strongest motion.

    Raises
    ------
    ParameterError
        If there is no record, if the rest is not positive and finite, if one record is vertical and
        another is not, if azimuths differ by more than 1 degree (unknown ones are not compared), or
        if a time step is no multiple of the shortest one.

    Examples
    --------
    >>> main, after = (Record(record_id=name, acceleration=[0.0, 2.0, 0.0], time_step=0.5)
    ...                for name in ("main", "after"))
    >>> both = in_sequence([main, after], rest=1.0)
    >>> both.record_id, both.acceleration.tolist()
    ('main-then-after', [0.0, 2.0, 0.0, 0.0, 0.0, 2.0, 0.0])
    >>> [str(part) for part in both.parts]
    ['main 0 1', 'after 2 3']
    """
    if not records:
        raise ParameterError("A sequence of no records. Must be one or more.")
    if not (math.isfinite(rest) and rest > 0.0):
        raise ParameterError(f"Invalid rest {rest!r} s. Must be positive and finite.")
    if len(records) == 1:
        return records[0]
    if len({record.orientation.upright for record in records}) > 1:
        raise ParameterError("A sequence of horizontal and vertical records. Must be of one kind.")
    _require_one_direction(records)
    step = min(record.time_step for record in records)
    still = np.zeros(max(math.ceil(rest / step * (1.0 - SAME_STEP)) - 1, 0))
    parts: list[Part] = []
    pieces: list[NDArray[np.float64]] = []
    count = 0
    for record in records:
        if pieces:
            pieces.append(still)
            count += still.size
        motions = record.parts or (Part(record.record_id, 0.0, record.duration),)
        parts += [Part(p.record_id, p.start + count * step, p.end + count * step) for p in motions]
        pieces.append(_refined(record, step))
        count += pieces[-1].size
    return _joined(records, np.concatenate(pieces), step, tuple(parts), rest)


def _require_one_direction(records: Sequence[Record]) -> None:
    directed = [record for record in records if not math.isnan(record.azimuth)]
    for other in directed[1:]:
        apart = abs((other.azimuth - directed[0].azimuth + 180.0) % 360.0 - 180.0)
        if apart > _ONE_DIRECTION:
            words = (
                f"{record.record_id!r} ({record.azimuth:g} degrees)"
                for record in (directed[0], other)
            )
            raise ParameterError(
                f"A sequence of {' and '.join(words)}. Must be of components in one direction; "
                "azimuth_degree (--azimuth-degree) rotates recordings into one."
            )


def _refined(record: Record, step: float) -> NDArray[np.float64]:
    """Return samples at a shorter time step, on the straight lines between those of the record."""
    ratio = record.time_step / step
    pieces = round(ratio)
    if not math.isclose(ratio, pieces, rel_tol=SAME_STEP):
        raise ParameterError(
            f"Time step {record.time_step:g} s of record {record.record_id!r}. Must be a multiple "
            f"of the shortest one of the sequence, {step:g} s."
        )
    if pieces == 1:
        return record.acceleration
    places = np.arange((record.acceleration.size - 1) * pieces + 1) / pieces
    return np.interp(places, np.arange(record.acceleration.size), record.acceleration)


def _joined(
    records: Sequence[Record],
    samples: NDArray[np.float64],
    step: float,
    parts: tuple[Part, ...],
    rest: float,
) -> Record:
    strongest = max(records, key=lambda record: record.pga)
    values = {name: getattr(strongest, name) for name in _OF_STRONGEST}
    for name in _COMMON:
        different = {getattr(record, name) for record in records}
        values[name] = different.pop() if len(different) == 1 else ""
    azimuths = {record.azimuth for record in records}
    directions = {record.orientation for record in records}
    sites = {record.site_type for record in records}
    names = [record.record_id for record in records]
    return Record(
        record_id=within_length("-then-".join(names)),
        acceleration=samples,
        time_step=step,
        uncorrected=any(record.uncorrected for record in records),
        orientation=directions.pop() if len(directions) == 1 else Orientation.UNSTATED,
        azimuth=azimuths.pop() if len(azimuths) == 1 else math.nan,
        site_type=sites.pop() if len(sites) == 1 else SiteType.UNKNOWN,
        event=", then ".join(dict.fromkeys(filter(None, (record.event for record in records)))),
        filter_low=float(np.fmax.reduce([record.filter_low for record in records])),
        filter_high=float(np.fmin.reduce([record.filter_high for record in records])),
        processing=(f"sequence: {', then '.join(names)}, with {rest:g} s of rest between them",),
        source_file=" ".join(dict.fromkeys(record.source_file for record in records)),
        trusted=tuple(dict.fromkeys(note for record in records for note in record.trusted)),
        parts=parts,
        **values,
    )
