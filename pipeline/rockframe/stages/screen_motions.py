"""The motions of a screening: chosen records, or pairs of them turned toward azimuths."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.components import (
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
from rockframe.results.versions import Uncertain, VersionSources
from rockframe.risk import spectral
from rockframe.rocking import GroundAcceleration, refuse_flight, require_motion
from rockframe.signals.measures import (
    arias_intensity,
    cumulative_absolute_velocity,
    housner_intensity,
    spectral_acceleration,
)
from rockframe.signals.processing import integrate, peak
from rockframe.stages.common import filtered_by, filtered_by_pulse, horizontal
from rockframe.stages.respond import with_vertical

Float = NDArray[np.float64]

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
        The record, or the two rotated ones.
    azimuth : float
        Direction of the motion [degree].
    numbers : mapping of str to float
        Metadata, as in `RecordMetadata.numbers`, and further measures of intensity [SI].
    """

    name: str
    row: int
    cluster: int
    records: tuple[str, ...]
    azimuth: float
    numbers: Mapping[str, float]


class Motions:
    """The motions of a file that pass the filters and can be scaled, read on demand.

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
    ) -> None:
        self._file = file
        self._metadata = metadata
        self._options = options
        self.filters = filters
        self._vertical = options.vertical
        self._periods = periods
        self._measures = measures
        self._of_pairs: dict[str, dict[str, float]] = {}
        self._beside: dict[str, Record] = {}
        self._pair: tuple[tuple[str, ...], HorizontalPair] | None = None
        self.rejections: list[InputOutcome] = []
        self.left_out: dict[str, str] = {}
        self.motions: list[Motion] = []
        self._choose()
        ensemble, names = options.scenario_ensemble(), [motion.name for motion in self.motions]
        versions = None if ensemble is None or options.azimuths_degree else ensemble
        self._sources = None if versions is None else VersionSources.of(file, versions, names)

    def _choose(self) -> None:
        # azimuths from 0 to 360 degrees
        azimuths = [azimuth % 360.0 for azimuth in self._options.azimuths_degree or ()]
        ensemble, scale = self._options.scenario_ensemble(), self._options.scales[-1]
        rows = {name: row for row, name in enumerate(self._metadata.names)}
        names = horizontal(self._file)
        if self._vertical and not azimuths:
            self._beside = vertical_beside(self._file)
        motions = self._turned(rows, azimuths) if azimuths else self._recorded(rows, names)
        for motion in motions:
            like = None if azimuths else self._metadata.pulse_like[motion.row]
            site = self._metadata.texts["site"][motion.row]
            reason = self._filtered_by(motion.numbers, like, site)
            if reason:
                self.left_out[motion.name] = reason
                continue
            try:
                if self._vertical:
                    refuse_flight(self._ground_motion(motion), scale)
                if self._vertical and ensemble is not None:
                    require_motion(ensemble, self._ground_motion(motion), scale)
            except ParameterError as error:
                self.rejections.append(InputOutcome(motion.name, str(error)))
                continue
            self.motions.append(self._with_measures(motion))
        if not self.motions:
            raise ParameterError(self._why_none())
        for name in self._rotd(None):
            if all(math.isnan(motion.numbers[name]) for motion in self.motions):
                raise ParameterError(
                    f"{name} is unknown for all motions. It needs both horizontals of a recording, "
                    "with their azimuths."
                )

    def _with_measures(self, motion: Motion) -> Motion:
        """Return the motion with its spectral accelerations and further measures."""
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

    def _of_pair(self, motion: Motion) -> dict[str, float]:
        """Return the measures of both horizontals of a motion; NaN without a partner."""
        name = motion.records[0]
        if name not in self._of_pairs:
            together = self._recordings[self._metadata.recordings[motion.row]]
            self._of_pairs |= dict.fromkeys(together, self._rotd(None))
            for pair in pair_horizontals(map(self._file.read, together))[0]:
                measures = self._rotd(pair)
                self._of_pairs |= {
                    component.record_id: measures for component in (pair.first, pair.second)
                }
        return self._of_pairs[name]

    def _rotd(self, pair: HorizontalPair | None) -> dict[str, float]:
        """Return the measures of both horizontals by name; NaN without a pair."""
        wanted: defaultdict[tuple[str, float], list[str]] = defaultdict(list)
        for name in self._measures:
            quantity, _, share = name.partition("_")
            if share in _SHARES:
                for period in self._periods if quantity == "sa" else (0.0,):
                    wanted[quantity, period].append(share)
        sweeps: list[Sweep] = []
        if pair is not None:
            sweeps = on_threads(lambda quantity: _sweep(pair, *quantity), list(wanted))
        measures: dict[str, float] = {}
        for number, ((quantity, period), shares) in enumerate(wanted.items()):
            for share in shares:
                name = spectral(period, share).name if period else f"{quantity}_{share}"
                measures[name] = sweeps[number].percentile(_SHARES[share]) if sweeps else math.nan
        return measures

    def _filtered_by(self, numbers: Mapping[str, float], pulse_like: bool | None, site: str) -> str:
        """Return the reason why a motion is filtered out, or ""."""
        reason = filtered_by(self.filters, numbers, site)
        if reason:
            return reason
        for name, number in (("pulse_period_s", "T_p"), ("pulse_length_m", "L_p")):
            bounds, value = getattr(self._options, name), numbers[number]
            if bounds is not None and not bounds[0] <= value <= bounds[1]:
                printed = "unknown" if math.isnan(value) else f"{value:g}"
                return f"{name} {printed}. Must be from {bounds[0]:g} to {bounds[1]:g}"
        return filtered_by_pulse(self._options.pulse_like, pulse_like)

    def read(self, motion: Motion) -> Record | GroundAcceleration:
        """Read a motion.

        Raises
        ------
        InputError
            If a record of the motion is corrupted.
        """
        return self._ground_motion(motion) if self._vertical else self._component(motion)

    def uncertain(self, motion: Motion) -> Uncertain | None:
        """Return what versions of a motion for the members are made of; None if it has only one."""
        sources = self._sources
        return None if sources is None else sources.uncertain(self._file.read(motion.name))

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
            row = self._metadata.names.index(names[0])
            together = self._recordings[self._metadata.recordings[row]]
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
        for name, recording in zip(self._metadata.names, self._metadata.recordings, strict=True):
            together[recording].append(name)
        return together

    def _recorded(self, rows: Mapping[str, int], names: Sequence[str]) -> Iterator[Motion]:
        """Yield each horizontal record; the components of one recording form a cluster."""
        clusters: dict[tuple[str, ...], int] = {}
        for name in names:
            row = rows[name]
            cluster = clusters.setdefault(self._metadata.recordings[row], len(clusters))
            numbers = {key: float(values[row]) for key, values in self._metadata.numbers.items()}
            yield Motion(name, row, cluster, (name,), numbers["azimuth"], numbers)

    def _turned(self, rows: Mapping[str, int], azimuths: Sequence[float]) -> Iterator[Motion]:
        """Yield each pair of horizontals toward each azimuth; these motions have no pulse."""
        cluster = 0
        for together in self._recordings.values():
            pairs, unpaired = pair_horizontals(map(self._file.read, together))
            for alone in unpaired:
                self.rejections.append(InputOutcome(alone.record_id, alone.reason))
            for pair in pairs:
                names = pair.first.record_id, pair.second.record_id
                row = rows[names[0]]
                numbers = {
                    key: float(values[row]) for key, values in self._metadata.numbers.items()
                }
                numbers |= dict.fromkeys(("a_p", "T_p", "L_p"), math.nan)
                for azimuth in azimuths:
                    record = rotate(pair, azimuth)
                    peaks = {
                        "pga": peak(record.acceleration),
                        "pgv": peak(integrate(record.acceleration, record.time_step)),
                        "azimuth": azimuth,
                    }
                    yield Motion(record.record_id, row, cluster, names, azimuth, numbers | peaks)
                cluster += 1

    def _why_none(self) -> str:
        reasons = {r.file: r.reason for r in self.rejections} | self.left_out
        name, reason = next(iter(reasons.items()))
        return f"no record is left to screen; {name!r}: {reason.rstrip('.')}."


def _sweep(pair: HorizontalPair, quantity: str, period: float) -> Sweep:
    """Return PGA, PGV, or the spectral acceleration at a period, over the azimuths of a pair."""
    if quantity == "sa":
        return rotd_spectral_acceleration(pair, period)
    return rotd(pair, transform=integrate if quantity == "pgv" else None)
