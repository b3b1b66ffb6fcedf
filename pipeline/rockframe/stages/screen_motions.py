"""The motions of a screening: chosen records, or pairs of them turned toward azimuths."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from rockframe.components import (
    BothDirections,
    HorizontalPair,
    Sweep,
    pair_horizontals,
    rotate,
    rotd,
    rotd_spectral_acceleration,
    vertical_beside,
)
from rockframe.engines.engine import on_threads
from rockframe.errors import ParameterError
from rockframe.options.ingest import Filters
from rockframe.options.respond import ScreenOptions
from rockframe.outcome import InputOutcome
from rockframe.record import Record
from rockframe.results.pulses import RecordMetadata
from rockframe.results.records import RecordsFile
from rockframe.results.response import NO_COMPONENTS, Components
from rockframe.results.versions import Uncertain, VersionSources
from rockframe.risk import spectral
from rockframe.rocking import GroundAcceleration, draws, refuse_flight, require_motion
from rockframe.signals.measures import (
    arias_intensity,
    cumulative_absolute_velocity,
    housner_intensity,
    spectral_acceleration,
)
from rockframe.signals.processing import integrate, peak
from rockframe.stages.common import (
    WHOLE,
    Batch,
    filtered_by,
    filtered_by_pulse,
    horizontal,
    in_one_plane_alone,
)
from rockframe.stages.respond import Pair, in_both, with_vertical
from rockframe.structures.contract import Structure
from rockframe.units import GRAVITY

if TYPE_CHECKING:
    from rockframe.wobbling import PairAcceleration

Float = NDArray[np.float64]

#: The option that leaves out motions in both directions, for messages.
IN_ONE_PLANE: Final = "--no-both-directions (both_directions = false in a study)"
#: Functions of the further measures of a component.
_OF_COMPONENT: Final = MappingProxyType(
    {
        "cav": cumulative_absolute_velocity,
        "arias_intensity": arias_intensity,
        "housner_intensity": housner_intensity,
    }
)
#: Percentiles over the azimuths, by the ends of the names of measures of both horizontals.
_SHARES: Final = MappingProxyType({"rotd50": 50.0, "rotd100": 100.0})


@dataclass(frozen=True, eq=False)
class Motion:
    """One motion of a screening.

    Parameters
    ----------
    name : str
        Identifier.
    row : int
        Row of the (first) record in the file.
    cluster : int
        Motions with the same number are azimuths of one pair, or components of one recording.
    records : tuple of str
        The record, the two rotated ones, or all records of a motion in both directions.
    azimuth : float
        Direction of the motion [degree].
    numbers : mapping of str to float
        Metadata, as in `RecordMetadata.numbers`, and further measures of intensity [SI]. Those of
        motions in both directions are RotD50, or the geometric mean of both components.
    components : Components
        Both components of a motion in both directions.
    """

    name: str
    row: int
    cluster: int
    records: tuple[str, ...]
    azimuth: float
    numbers: Mapping[str, float]
    components: Components = NO_COMPONENTS

    @property
    def in_both(self) -> bool:
        """Return True for a motion in both directions."""
        return bool(self.components.records)


class Motions:
    """The motions of a file that pass the filters and can be scaled, read on demand.

    A motion in both directions of `pairs` is among them, after its components, if one of these is.
    Of a `batch`, only those of its share of the horizontal records, or with azimuths of the
    recordings, are; it may have none.

    Raises
    ------
    ParameterError
        If no motion is left, or a measure of both horizontals is unknown for all.
    """

    def __init__(
        self,
        file: RecordsFile,
        metadata: RecordMetadata,
        options: ScreenOptions,
        filters: Filters,
        periods: Sequence[float] = (),
        measures: Sequence[str] = (),
        *,
        pairs: Mapping[str, Pair] = MappingProxyType({}),
        batch: Batch = WHOLE,
    ) -> None:
        self._file = file
        self.metadata = metadata
        self._options = options
        self.filters = filters
        self._vertical = options.vertical
        self._periods = periods
        self._measures = measures
        self._of_pairs: dict[str, dict[str, float]] = {}
        self._beside: dict[str, Record] = {}
        self._pair: tuple[tuple[str, ...], HorizontalPair] | None = None
        self._pairs = pairs
        #: True if the file has motions in both directions, chosen or not.
        self.pairs = bool(self._pairs)
        self._batch = batch
        self.rejections: list[InputOutcome] = []
        self.left_out: dict[str, str] = {}
        self.motions: list[Motion] = []
        self._refusals: dict[str, tuple[str, str]] = {}
        self._choose()
        ensemble = options.scenario_ensemble()
        names = [motion.name for motion in self.motions if not motion.in_both]
        versions = None if ensemble is None or options.azimuths_degree else ensemble
        self._sources = None if versions is None else VersionSources.of(file, versions, names)

    def _choose(self) -> None:
        # azimuths from 0 to 360 degrees
        azimuths = [azimuth % 360.0 for azimuth in self._options.azimuths_degree or ()]
        rows = {name: row for row, name in enumerate(self.metadata.names)}
        names = horizontal(self._file)
        if self._vertical and not azimuths:
            self._beside = vertical_beside(self._file)
        motions = self._turned(rows, azimuths) if azimuths else self._recorded(rows, names)
        for motion in motions:
            filtered, impossible = self._refusal(motion)
            if filtered:
                self.left_out[motion.name] = filtered
            elif impossible:
                self.rejections.append(InputOutcome(motion.name, impossible))
            else:
                self.motions.append(self._with_measures(motion))
        further = rotd_names(self._periods, self._measures)
        if not self._batch.whole:
            if max(map(len, self._recordings.values())) < 2:  # no record has a partner
                for name in further:
                    require_some(name, ())
            return
        if not self.motions:
            raise ParameterError(self._why_none())
        for name in further:
            require_some(name, [motion.numbers[name] for motion in self.motions])

    def _refusal(self, motion: Motion) -> tuple[str, str]:
        """Return why a motion is filtered out, and why it cannot be screened; "" if it is not."""
        if motion.name not in self._refusals:
            filtered, impossible = self._filtered_by(motion), ""
            try:
                if self._vertical and not filtered:
                    self._require_possible(motion)
            except ParameterError as error:
                impossible = str(error)
            self._refusals[motion.name] = filtered, impossible
        return self._refusals[motion.name]

    def _require_possible(self, motion: Motion) -> None:
        """Raise a `ParameterError` if the ground falls faster than gravity at a scale."""
        ensemble, scale = self._options.scenario_ensemble(), self._options.scales[-1]
        if motion.in_both:
            from rockframe.wobbling.response import require_no_flight

            spread = 1.0 if ensemble is None else float(draws(ensemble)[:, 3].max())
            require_no_flight(self._pair_acceleration(motion), scale * spread)
            return
        ground = self._ground_motion(motion)
        refuse_flight(ground, scale)
        if ensemble is not None:
            require_motion(ensemble, ground, scale)

    def _with_measures(self, motion: Motion) -> Motion:
        """Return the motion with its spectral accelerations and further measures."""
        if motion.in_both:
            return self._with_measures_of_both(motion)
        measures: dict[str, float] = {}
        of_component = [name for name in self._measures if name in _OF_COMPONENT]
        if self._periods or of_component:
            record = self._component(motion)
            samples = record.acceleration, record.time_step
            spectrum = spectral_acceleration(*samples, self._periods) if self._periods else ()
            for period, value in zip(self._periods, spectrum, strict=True):
                measures[spectral(period).name] = float(value)
            measures |= {name: _OF_COMPONENT[name](*samples) for name in of_component}
        if len(of_component) < len(self._measures):
            measures |= self._of_pair(motion)
        return replace(motion, numbers={**motion.numbers, **measures})

    def _with_measures_of_both(self, motion: Motion) -> Motion:
        both = self._file.in_both(motion.records)
        pair = at_right_angles(both)
        measures = {
            spectral(period).name: _sweep(pair, "sa", period).percentile(50.0)
            for period in self._periods
        }
        for name in filter(_OF_COMPONENT.__contains__, self._measures):
            of_each = [
                _OF_COMPONENT[name](record.acceleration, record.time_step)
                for record in (both.first, both.second)
            ]
            measures[name] = math.sqrt(of_each[0] * of_each[1])
        return replace(motion, numbers={**motion.numbers, **measures, **self._rotd(pair)})

    def _of_pair(self, motion: Motion) -> dict[str, float]:
        """Return the measures of both horizontals of a motion; NaN without a partner."""
        name = motion.records[0]
        if name not in self._of_pairs:
            together = self._recordings[self.metadata.recordings[motion.row]]
            self._of_pairs |= dict.fromkeys(together, self._rotd(None))
            for pair in pair_horizontals(map(self._file.read, together))[0]:
                measures = self._rotd(pair)
                self._of_pairs |= {
                    component.record_id: measures for component in (pair.first, pair.second)
                }
        return self._of_pairs[name]

    def _rotd(self, pair: HorizontalPair | None) -> dict[str, float]:
        """Return the measures of both horizontals by name; NaN without a pair."""
        wanted = _over_azimuths(self._periods, self._measures)
        sweeps: list[Sweep] = []
        if pair is not None:
            sweeps = on_threads(lambda quantity: _sweep(pair, *quantity), list(wanted))
        measures: dict[str, float] = {}
        for number, ((quantity, period), shares) in enumerate(wanted.items()):
            for share in shares:
                name = _name_over_azimuths(quantity, period, share)
                measures[name] = sweeps[number].percentile(_SHARES[share]) if sweeps else math.nan
        return measures

    def _filtered_by(self, motion: Motion) -> str:
        """Return the reason why a motion is filtered out, or "".

        Of a motion in both directions a component has passed the filters; its own PGA and PGV must
        pass them, too.
        """
        numbers = motion.numbers
        if motion.in_both:
            pga_g = numbers["pga"] / GRAVITY
            return self.filters.refusal(pga_g=pga_g, pgv_m_s=numbers["pgv"])
        azimuths = self._options.azimuths_degree
        pulse_like = None if azimuths else self.metadata.pulse_like[motion.row]
        if reason := filtered_by(self.filters, numbers, self.metadata.texts["site"][motion.row]):
            return reason
        for name, number in (("pulse_period_s", "T_p"), ("pulse_length_m", "L_p")):
            bounds, value = getattr(self._options, name), numbers[number]
            if bounds is not None and not bounds[0] <= value <= bounds[1]:
                printed = "unknown" if math.isnan(value) else f"{value:g}"
                return f"{name} {printed}. Must be from {bounds[0]:g} to {bounds[1]:g}"
        return filtered_by_pulse(self._options.pulse_like, pulse_like)

    def read(self, motion: Motion) -> Record | GroundAcceleration | PairAcceleration:
        """Read a motion.

        Raises
        ------
        InputError
            If a record of the motion is corrupted.
        """
        if motion.in_both:
            return self._pair_acceleration(motion)
        return self._ground_motion(motion) if self._vertical else self._component(motion)

    def _pair_acceleration(self, motion: Motion) -> PairAcceleration:
        from rockframe.wobbling import PairAcceleration  # not needed for motions in one plane

        both = self._file.in_both(motion.records)
        return PairAcceleration.from_pair(both, vertical=self._vertical)

    def in_one_plane_alone(self, structures: Sequence[Structure]) -> dict[str, list[str]]:
        """Return the parameter of a file of `in_one_plane_alone`; nothing if it is not wanted."""
        wanted = self._options.both_directions and not self._options.azimuths_degree
        return in_one_plane_alone(
            structures, wanted and not any(each.in_both for each in self.motions)
        )

    def uncertain(self, motion: Motion) -> Uncertain | None:
        """Return what versions of a motion for the members are made of; None if it has only one."""
        sources = self._sources
        if sources is None or motion.in_both:
            return None
        return sources.uncertain(self._file.read(motion.name))

    def _ground_motion(self, motion: Motion) -> GroundAcceleration:
        record = self._component(motion)
        if len(motion.records) == 1:
            return with_vertical(record, self._beside)
        upward = self._paired(motion.records).vertical
        return with_vertical(record, {} if upward is None else {record.record_id: upward})

    def _component(self, motion: Motion) -> Record:
        if len(motion.records) == 1:
            return self._file.read(motion.name)
        return rotate(self._paired(motion.records), motion.azimuth)

    def _paired(self, names: tuple[str, ...]) -> HorizontalPair:
        """Return the pair of two records with its vertical record; the last pair is cached."""
        if self._pair is None or self._pair[0] != names:
            row = self.metadata.names.index(names[0])
            together = self._recordings[self.metadata.recordings[row]]
            pairs, _ = pair_horizontals(map(self._file.read, together))
            self._pair = (
                names,
                next(
                    pair for pair in pairs if (pair.first.record_id, pair.second.record_id) == names
                ),
            )
        return self._pair[1]

    @cached_property
    def _recordings(self) -> dict[tuple[str, ...], list[str]]:
        together: defaultdict[tuple[str, ...], list[str]] = defaultdict(list)
        for name, recording in zip(self.metadata.names, self.metadata.recordings, strict=True):
            together[recording].append(name)
        return together

    def _recorded(self, rows: Mapping[str, int], names: Sequence[str]) -> Iterator[Motion]:
        """Yield each horizontal record, and after the second component of a station both, if one of
        them is chosen; they form a cluster.
        """
        recordings = self.metadata.recordings
        together = dict.fromkeys(recordings[rows[name]] for name in names)
        clusters = {recording: cluster for cluster, recording in enumerate(together)}
        level = {*names}

        def motion_of(name: str) -> Motion:
            row = rows[name]
            numbers = {key: float(values[row]) for key, values in self.metadata.numbers.items()}
            cluster = clusters[recordings[row]]
            return Motion(name, row, cluster, (name,), numbers["azimuth"], numbers)

        def is_chosen(name: str) -> bool:
            return name in level and not any(self._refusal(motion_of(name)))

        for name in self._batch.of(names):
            yield motion_of(name)
            pair = self._pairs.get(name)
            # the first component may be of the batch before
            if pair is not None and any(map(is_chosen, pair.records)):
                yield from self._in_both(pair, rows, clusters[recordings[rows[name]]])

    def _in_both(self, pair: Pair, rows: Mapping[str, int], cluster: int) -> Iterator[Motion]:
        """Yield a motion in both directions, which has no pulse."""
        try:
            both = in_both(self._file, pair, vertical=self._vertical)
        except ParameterError as error:
            self.rejections.append(InputOutcome(pair.name, str(error)))
            return
        row, level = rows[both.first.record_id], at_right_angles(both)
        numbers = {key: float(values[row]) for key, values in self.metadata.numbers.items()}
        numbers |= dict.fromkeys(("a_p", "T_p", "L_p", "azimuth"), math.nan)
        numbers |= {name: _sweep(level, name, 0.0).percentile(50.0) for name in ("pga", "pgv")}
        components = Components.of(both)
        yield Motion(pair.name, row, cluster, pair.records, math.nan, numbers, components)

    def _turned(self, rows: Mapping[str, int], azimuths: Sequence[float]) -> Iterator[Motion]:
        """Yield each pair of horizontals toward each azimuth; these motions have no pulse."""
        recordings = [*enumerate(self._recordings.values())]
        for cluster, together in self._batch.of(recordings):
            pairs, unpaired = pair_horizontals(map(self._file.read, together))
            for alone in unpaired:
                self.rejections.append(InputOutcome(alone.record_id, alone.reason))
            for pair in pairs:
                names = pair.first.record_id, pair.second.record_id
                row = rows[names[0]]
                numbers = {key: float(values[row]) for key, values in self.metadata.numbers.items()}
                numbers |= dict.fromkeys(("a_p", "T_p", "L_p"), math.nan)
                for azimuth in azimuths:
                    record = rotate(pair, azimuth)
                    peaks = {
                        "pga": peak(record.acceleration),
                        "pgv": peak(integrate(record.acceleration, record.time_step)),
                        "azimuth": azimuth,
                    }
                    yield Motion(record.record_id, row, cluster, names, azimuth, numbers | peaks)

    def _why_none(self) -> str:
        reasons = {r.file: r.reason for r in self.rejections} | self.left_out
        name, reason = next(iter(reasons.items()))
        return f"no record is left to screen; {name!r}: {reason.rstrip('.')}."


def further_names(periods: Sequence[float], measures: Sequence[str]) -> list[str]:
    """Return the names of the further measures of a motion, in their order.

    Examples
    --------
    >>> further_names([1.0], ["sa_rotd50", "cav"])
    ['sa_1s', 'cav', 'sa_1s_rotd50']
    """
    of_component = [name for name in measures if name in _OF_COMPONENT]
    spectra = [spectral(period).name for period in periods]
    return [*spectra, *of_component, *rotd_names(periods, measures)]


def rotd_names(periods: Sequence[float], measures: Sequence[str]) -> list[str]:
    """Return the names of the measures of both horizontals, in their order."""
    return [
        _name_over_azimuths(quantity, period, share)
        for (quantity, period), shares in _over_azimuths(periods, measures).items()
        for share in shares
    ]


def _over_azimuths(
    periods: Sequence[float], measures: Sequence[str]
) -> dict[tuple[str, float], list[str]]:
    """Return the percentiles that are wanted of each quantity and period."""
    wanted: defaultdict[tuple[str, float], list[str]] = defaultdict(list)
    for name in measures:
        quantity, _, share = name.partition("_")
        if share in _SHARES:
            for period in periods if quantity == "sa" else (0.0,):
                wanted[quantity, period].append(share)
    return wanted


def _name_over_azimuths(quantity: str, period: float, share: str) -> str:
    return spectral(period, share).name if period else f"{quantity}_{share}"


def require_some(name: str, values: Iterable[float]) -> None:
    """Require a measure of both horizontals of some motion.

    Raises
    ------
    ParameterError
        If all values are NaN.
    """
    if all(map(math.isnan, values)):
        raise ParameterError(
            f"{name} is unknown for all motions. It needs both horizontals of a recording, "
            "with their azimuths."
        )


def at_right_angles(both: BothDirections) -> HorizontalPair:
    """Return both components as a pair of stated azimuths, which its RotD do not depend on."""
    first, second = replace(both.first, azimuth=0.0), replace(both.second, azimuth=90.0)
    return HorizontalPair(first, second)


def _sweep(pair: HorizontalPair, quantity: str, period: float) -> Sweep:
    """Return PGA, PGV, or the spectral acceleration at a period, over the azimuths of a pair."""
    if quantity == "sa":
        return rotd_spectral_acceleration(pair, period)
    return rotd(pair, transform=integrate if quantity == "pgv" else None)
