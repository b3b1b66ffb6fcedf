"""Compute a screening: motions one at a time, in batches kept on disk until all are done."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Final, Self

import numpy as np
from numpy.typing import NDArray

from rockframe.components import HorizontalPair, pair_horizontals, rotate, vertical_beside
from rockframe.engines.engine import Engine, map_batches
from rockframe.errors import ParameterError, invalid
from rockframe.frame import RockingFrame
from rockframe.options.ingest import Filters
from rockframe.options.respond import ScreenOptions
from rockframe.outcome import InputOutcome
from rockframe.record import Record
from rockframe.results.pulses import RecordMetadata
from rockframe.results.records import RecordsFile
from rockframe.results.screen import Batches, KeptHistory
from rockframe.risk import OVERTURNING, LimitState, spectral
from rockframe.risk.fragility import limited_in, peaks_of_frames
from rockframe.rocking import (
    Design,
    GroundAcceleration,
    Histories,
    Scenario,
    ScreeningBatch,
    Verdict,
    as_ground,
    chosen_ensemble,
    margins_of,
    peaks_of,
    refuse_flight,
    responses_of,
)
from rockframe.signals.measures import spectral_acceleration
from rockframe.signals.processing import integrate, peak
from rockframe.stages.common import Progress, horizontal
from rockframe.stages.respond import with_vertical
from rockframe.units import GRAVITY

Float = NDArray[np.float64]


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
        Metadata, as in `RecordMetadata.numbers`, and spectral accelerations [m s-2].
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
        If no motion is left.
    """

    def __init__(
        self,
        file: RecordsFile,
        metadata: RecordMetadata,
        options: ScreenOptions,
        filters: Filters,
        periods: Sequence[float] = (),
    ) -> None:
        self._file = file
        self._metadata = metadata
        self._options = options
        self.filters = filters
        self._vertical = options.vertical
        self._periods = periods
        self._beside: dict[str, Record] = {}
        self._pair: tuple[tuple[str, ...], HorizontalPair] | None = None
        self.rejections: list[InputOutcome] = []
        self.left_out: dict[str, str] = {}
        self.motions: list[Motion] = []
        self._choose()

    def _choose(self) -> None:
        # azimuths from 0 to 360 degrees
        azimuths = [azimuth % 360.0 for azimuth in self._options.azimuths_degree or ()]
        scale = self._options.scales[-1]
        rows = {name: row for row, name in enumerate(self._metadata.names)}
        names = horizontal(self._file)
        if self._vertical and not azimuths:
            self._beside = vertical_beside(self._file)
        found = self._turned(rows, azimuths) if azimuths else self._recorded(rows, names)
        for motion in found:
            like = None if azimuths else self._metadata.pulse_like[motion.row]
            site = self._metadata.texts["site"][motion.row]
            reason = self._filtered_by(motion.numbers, like, site)
            if reason:
                self.left_out[motion.name] = reason
                continue
            try:
                if self._vertical:
                    refuse_flight(self._ground_motion(motion), scale)
            except ParameterError as error:
                self.rejections.append(InputOutcome(motion.name, str(error)))
                continue
            self.motions.append(self._with_spectrum(motion))
        if not self.motions:
            raise ParameterError(self._why_none())

    def _with_spectrum(self, motion: Motion) -> Motion:
        if not self._periods:
            return motion
        record = self._component(motion)
        found = spectral_acceleration(record.acceleration, record.time_step, self._periods)
        named = {spectral(t).name: float(a) for t, a in zip(self._periods, found, strict=True)}
        return replace(motion, numbers={**motion.numbers, **named})

    def _filtered_by(self, numbers: Mapping[str, float], pulse_like: bool | None, site: str) -> str:
        """Return the reason why a motion is filtered out, or ""."""
        reason = self.filters.refusal(
            site=site,
            magnitude=numbers["magnitude"],
            epicentral_distance_km=numbers["epicentral_distance"],
            distance_rrup_km=numbers["distance_rrup"],
            distance_rjb_km=numbers["distance_rjb"],
            distance_hypocentral_km=numbers["distance_hypocentral"],
            vs30_m_s=numbers["vs30"],
            pga_g=numbers["pga"] / GRAVITY,
            pgv_m_s=numbers["pgv"],
        )
        if reason:
            return reason
        for name, number in (("pulse_period_s", "T_p"), ("pulse_length_m", "L_p")):
            bounds, value = getattr(self._options, name), numbers[number]
            if bounds is not None and not bounds[0] <= value <= bounds[1]:
                known = "unknown" if math.isnan(value) else f"{value:g}"
                return f"{name} {known}. Must be from {bounds[0]:g} to {bounds[1]:g}"
        wanted = self._options.pulse_like
        if wanted is not None and pulse_like is not wanted:
            known = "unknown" if pulse_like is None else "yes" if pulse_like else "no"
            return f"pulse_like {known}. Must be {'yes' if wanted else 'no'}"
        return ""

    def read(self, motion: Motion) -> Record | GroundAcceleration:
        """Read a motion.

        Raises
        ------
        InputError
            If a record of the motion is corrupted.
        """
        return self._ground_motion(motion) if self._vertical else self._component(motion)

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
            together = self._recordings()[self._recording(row)]
            pairs, _ = pair_horizontals(map(self._file.read, together))
            self._pair = (
                names,
                next(
                    pair for pair in pairs if (pair.first.record_id, pair.second.record_id) == names
                ),
            )
        return self._pair[1]

    def _recording(self, row: int) -> tuple[str, ...]:
        """Return the key of a recording; a record without a station is its own recording."""
        texts = self._metadata.texts
        alone = "" if texts["station"][row] else self._metadata.names[row]
        return (*(texts[n][row] for n in ("event", "network", "station", "start_time")), alone)

    def _recordings(self) -> dict[tuple[str, ...], list[str]]:
        together: defaultdict[tuple[str, ...], list[str]] = defaultdict(list)
        for row, name in enumerate(self._metadata.names):
            together[self._recording(row)].append(name)
        return together

    def _recorded(self, rows: Mapping[str, int], names: Sequence[str]) -> Iterator[Motion]:
        """Yield each horizontal record; the components of one recording form a cluster."""
        clusters: dict[tuple[str, ...], int] = {}
        for name in names:
            row = rows[name]
            cluster = clusters.setdefault(self._recording(row), len(clusters))
            numbers = {key: float(values[row]) for key, values in self._metadata.numbers.items()}
            yield Motion(name, row, cluster, (name,), numbers["azimuth"], numbers)

    def _turned(self, rows: Mapping[str, int], azimuths: Sequence[float]) -> Iterator[Motion]:
        """Yield each pair of horizontals toward each azimuth; these motions have no pulse."""
        cluster = 0
        for together in self._recordings().values():
            pairs, unpaired = pair_horizontals(map(self._file.read, together))
            for alone in unpaired:
                self.rejections.append(InputOutcome(alone.record_id, alone.reason))
            for pair in pairs:
                names = pair.first.record_id, pair.second.record_id
                row = rows[names[0]]
                known = {key: float(values[row]) for key, values in self._metadata.numbers.items()}
                known |= dict.fromkeys(("a_p", "T_p", "L_p"), math.nan)
                for azimuth in azimuths:
                    record = rotate(pair, azimuth)
                    peaks = {
                        "pga": peak(record.acceleration),
                        "pgv": peak(integrate(record.acceleration, record.time_step)),
                        "azimuth": azimuth,
                    }
                    yield Motion(record.record_id, row, cluster, names, azimuth, known | peaks)
                cluster += 1

    def _why_none(self) -> str:
        reasons = {r.file: r.reason for r in self.rejections} | self.left_out
        name, reason = next(iter(reasons.items()))
        return f"no record is left to screen; {name!r}: {reason.rstrip('.')}."


Arrays = dict[str, NDArray[Any]]
Task = tuple[str, Callable[[], ScreeningBatch]]

#: Arrays of a batch of peaks.
_PEAKS: Final = ("verdict", "peak_rotation", "impact_velocity")
#: Quantities of restraints, each with the key that it needs and the owner of the key.
_RESTRAINED: Final = (
    ("tendon_ratio", "yield_stress_pa", "tendons"),
    ("gap_ratio", "gap_m", "abutments"),
)
#: Approximate number of scenarios per batch, of some 0.1 s each; an interruption loses no more.
_SCENARIOS: Final = 2048
#: Largest number of motions per batch, which are in memory together.
_TOGETHER: Final = 64
#: Approximate number of history nodes per batch.
_NODES: Final = 200_000


@dataclass(frozen=True, eq=False)
class ScreeningRequest:
    """The computation for each motion.

    Parameters
    ----------
    options : ScreenOptions
        Options of the screening.
    frames : tuple of RockingFrame
        The structures.
    design : Design, optional
        The design problem.
    candidates : tuple of RockingFrame
        Candidate frames of the design, structure by structure.
    scales : array, shape (scales,)
        Multiples of the motions [1].
    """

    options: ScreenOptions
    frames: tuple[RockingFrame, ...]
    design: Design | None
    candidates: tuple[RockingFrame, ...]
    scales: NDArray[np.float64]

    @classmethod
    def of(cls, options: ScreenOptions, frames: tuple[RockingFrame, ...]) -> Self:
        """Return the request of these options for these structures.

        Raises
        ------
        ParameterError
            If a candidate of the design or a member of the ensemble cannot rock, if no structure
            has the restraint of a stated limit, or if a structure lacks the restraint that the
            design limits.
        """
        chosen_ensemble(options, frames)
        for quantity, key, owner in _RESTRAINED:
            without = [frame.name for frame in frames if not limited_in(frame, quantity)]
            if getattr(options, f"limit_{quantity}") and len(without) == len(frames):
                raise invalid(key, None, owner, f"stated for limit_{quantity}")
            if without and options.design is not None and options.design.quantity == quantity:
                stated = f"stated for a design of quantity {quantity}"
                raise invalid(key, None, f"frame {without[0]!r}", stated)
        design = None
        if options.design is not None:
            lowest, highest = options.design.range
            others = {k: v for k, v in options.design if k != "range"}
            design = Design(lowest=lowest, highest=highest, **others)
        candidates = tuple(c for one in frames for c in (design.candidates(one) if design else ()))
        return cls(options, frames, design, candidates, np.array(options.scales))

    @property
    def histories(self) -> Histories:
        """Scenarios whose histories are written."""
        return Histories(self.options.histories)

    @property
    def reference(self) -> int:
        """Position of the scale nearest to 1."""
        return int(np.argmin(np.abs(np.log(self.scales))))

    def scenarios(self) -> dict[str, Any]:
        """Return everything that the scenarios depend on, as JSON values."""
        return {
            "frames": [asdict(frame) for frame in self.frames],
            "candidates": [asdict(frame) for frame in self.candidates],
            "scales": self.scales.tolist(),
            "margins": self.options.model_dump(mode="json", include={"margins", "ensemble"}),
        }


class ScreeningRun:
    """The batches of a screening, which share the chosen motions.

    `rows` fills three arrays: ``verdicts``, shape (motions, structures, scales); ``ratio``, the
    largest |theta| / alpha at the scale nearest to 1, infinite if the structure overturns, shape
    (motions, structures); and ``reached``, True for scenarios that reach a limit state, shape
    (limits, motions, structures, scales).
    """

    def __init__(
        self,
        chosen: Motions,
        request: ScreeningRequest,
        batches: Batches,
        engine: Engine | None,
        progress: Progress,
    ) -> None:
        self._chosen = chosen
        self.motions = chosen.motions
        self.request = request
        self._batches = batches
        self._engine = engine
        self._progress = progress
        self._done = 0
        shape = (len(chosen.motions), len(request.frames), request.scales.size)
        self.verdicts = np.empty(shape, dtype=np.int8)
        self.ratio = np.empty(shape[:2])
        self.limits = [OVERTURNING, *(LimitState(*limit) for limit in request.options.limits())]
        self.reached = np.empty((len(self.limits), *shape), dtype=bool)
        self._kept: list[NDArray[np.intp]] = []

    def rows(self) -> Iterator[Arrays]:
        """Yield the scenarios motion by motion, and fill `verdicts` and `ratio`."""
        frames, at = self.request.frames, self.request.reference
        for i, (verdict, *peaks) in enumerate(self._peaks()):
            row = peaks_of_frames(frames, verdict, *peaks)
            self.verdicts[i] = verdict
            fell = verdict[:, at] == Verdict.OVERTURNS
            for limit, reached in zip(self.limits, self.reached, strict=True):
                reached[i] = limit.reached(row, verdict == Verdict.OVERTURNS)
            ratio = row["peak_rotation_ratio"]
            self.ratio[i] = np.where(fell, np.inf, ratio[:, at])
            self._kept.append(np.argwhere(self.request.histories.mask(verdict, ratio)))
            yield row

    def histories(self) -> Iterator[KeptHistory]:
        """Yield the kept histories motion by motion; call after `rows`."""
        where = self._where()
        for responses in map_batches(responses_of, self._scenarios(), engine=self._engine):
            for response in responses:
                yield next(where), response

    def _where(self) -> Iterator[tuple[int, int, int]]:
        for i, kept in enumerate(self._kept):
            for k, s in kept.tolist():
                yield i, k, s

    def _scenarios(self) -> Iterator[tuple[Scenario, ...]]:
        """Yield groups of scenarios of limited size; each motion is read once."""
        frames, scales = self.request.frames, self.request.scales
        for motion, kept in zip(self.motions, self._kept, strict=True):
            if not len(kept):
                continue
            ground = as_ground(self._chosen.read(motion))
            together = max(1, _NODES // ground.coefficients.shape[0])
            for start in range(0, len(kept), together):
                yield tuple(
                    Scenario(ground, frames[k], float(scales[s]))
                    for k, s in kept[start : start + together].tolist()
                )

    def margins(self) -> Arrays:
        """Return margins, shape (motions, structures); empty if they were not requested."""
        if self.request.options.margins == "none":
            return {}
        found = list(self._map(margins_of, "margins"))
        return {name: np.concatenate([part[name] for part in found]) for name in found[0]}

    def candidates_reach(self) -> NDArray[np.bool_] | None:
        """Return a mask of motions that bring candidates to the limit, (motions, candidates)."""
        design = self.request.options.design
        if design is None:
            return None
        limit = LimitState(design.quantity, design.limit)
        rows = []
        for part in self._map(peaks_of, "design"):
            for verdict, *peaks in zip(*(part[name] for name in _PEAKS), strict=True):
                row = peaks_of_frames(self.request.candidates, verdict, *peaks)
                rows.append(limit.reached(row, verdict == Verdict.OVERTURNS)[:, 0])
        return np.array(rows)

    def _peaks(self) -> Iterator[tuple[NDArray[Any], ...]]:
        """Yield verdict, peaks and so on of each motion, each of shape (structures, scales)."""
        held: list[Arrays] = []
        width = 0
        for part in self._map(peaks_of, "peaks"):
            held.append(part)
            width += part["verdict"].shape[2]
            if width < self.request.scales.size:
                continue
            whole = (np.concatenate([one[name] for one in held], axis=2) for name in _PEAKS)
            yield from zip(*whole, strict=True)
            held, width = [], 0

    def _map(self, function: Callable[[ScreeningBatch], Arrays], kind: str) -> Iterator[Arrays]:
        return self._batches.map(function, self._tasks(kind), self._engine, self._step)

    def _tasks(self, kind: str) -> Iterator[Task]:
        """Yield the batches of one kind: several motions, or some scales of one motion."""
        frames = self.request.candidates if kind == "design" else self.request.frames
        scales = self.request.scales
        if kind != "peaks":
            scales = scales[self.request.reference :][:1]
        each = len(frames) * scales.size
        together = 1 if kind == "margins" else min(max(1, _SCENARIOS // each), _TOGETHER)
        width = scales.size if each <= _SCENARIOS else max(1, _SCENARIOS // len(frames))
        motions = self.motions
        for first in range(0, len(motions), together):
            for start in range(0, scales.size, width):
                some = motions[first : first + together]
                part = tuple(scales[start : start + width].tolist())
                yield f"{kind}-{first}-{start}", self._maker(some, frames, part)

    def _maker(
        self, motions: Sequence[Motion], frames: tuple[RockingFrame, ...], scales: tuple[float, ...]
    ) -> Callable[[], ScreeningBatch]:
        ensemble = chosen_ensemble(self.request.options)
        return lambda: ScreeningBatch(
            tuple(map(self._chosen.read, motions)), frames, scales, ensemble
        )

    def _step(self) -> None:
        self._done += 1
        kinds = ["peaks", *(["margins"] if self.request.options.margins != "none" else [])]
        kinds += ["design"] if self.request.candidates else []
        self._progress(self._done, sum(1 for kind in kinds for _ in self._tasks(kind)))
