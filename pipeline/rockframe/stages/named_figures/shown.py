"""Records, structures and pulses that figures show: the requested or the default ones."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from rockframe.components import vertical_beside
from rockframe.errors import ParameterError, require_known
from rockframe.frame import RockingFrame
from rockframe.matching.match import PulseMatch, best_ricker, match_pulses
from rockframe.matching.record_pulses import likeness
from rockframe.options.pulse import PulseOptions
from rockframe.outcome import InputOutcome
from rockframe.paper.pulses import find_paper_record
from rockframe.parts import RECTANGULAR
from rockframe.record import Record
from rockframe.results.records import RecordsFile, open_records
from rockframe.rocking import GroundAcceleration, Verdict, respond
from rockframe.stages.common import choose_structures, horizontal, only_frames
from rockframe.stages.pulse import usable
from rockframe.stages.respond import WITHOUT_VERTICAL, pairs_of, with_vertical
from rockframe.study.structures import SHIPPED_STRUCTURES
from rockframe.unequal import UnequalBent, respond_bent
from rockframe.wavelets.family import RICKERS
from rockframe.wobbling import PairAcceleration

#: The arguments of the function that draws a figure, and the exit status.
Shown = tuple[tuple[Any, ...], int]
#: Largest numbers of records on a page, with their histories and with their pulses.
_MOST_HISTORIES: Final = 12
_MOST_PULSES: Final = 6
#: Distance between the columns of a frame over their height, where none is stated [1].
_SPACING: Final = 1.25
#: Records of the paper's Figure 8, by their names in its Table 1, and their wavelets.
_PAPER: Final = {"Erzincan/EW": "symmetric_ricker", "Pacoima Dam/164": "antisymmetric_ricker"}


def _ignore(_rejected: Sequence[InputOutcome]) -> int:
    """Report nothing, and return exit status 0."""
    return 0


@dataclass(frozen=True, kw_only=True)
class FigureRequest:
    """The records and the structure of a figure, and the numbers with which it is drawn.

    Parameters
    ----------
    records : callable
        Opens a records.nc, which may be made from other files, and states the exit status.
    report : callable
        Called with the rejected records; returns the exit status.
    record : tuple of str
        Names of the records; by default all.
    structures : Path
        File of structures.
    structure : str, optional
        Name of the structure; by default the first, in the shipped file the paper's bridge bent.
    vertical : bool
        True to include vertical components.
    friction, spacing, beam_centre : float
        Coefficient of friction [1], distance between columns and height of the beam's centre of
        mass [m].
    grid : int
        Points along each side of a map.

    Raises
    ------
    ParameterError
        If friction or grid is not allowed, or a beam's centre is stated without a spacing.
    """

    records: Callable[[], AbstractContextManager[tuple[Path, int]]]
    report: Callable[[Sequence[InputOutcome]], int] = _ignore
    record: tuple[str, ...] = ()
    structures: Path = SHIPPED_STRUCTURES
    structure: str | None = None
    vertical: bool = False
    friction: float | None = None
    spacing: float | None = None
    beam_centre: float | None = None
    grid: int = 400

    def __post_init__(self) -> None:
        if self.friction is not None and not self.friction > 0.0:
            raise ParameterError(f"Invalid friction {self.friction!r}. Must be positive.")
        if not 2 <= self.grid <= 4000:
            raise ParameterError(f"Invalid grid {self.grid}. Must be 2 to 4000.")
        if self.beam_centre is not None and self.spacing is None:
            raise ParameterError(
                f"--beam-centre {self.beam_centre:g} has no effect without --spacing. State the "
                "spacing, or leave it out."
            )

    @property
    def frame(self) -> RockingFrame:
        """The structure."""
        chosen = choose_structures(self.structures, self.structure)
        return only_frames(chosen[:1], "this figure")[0]

    @property
    def frame_or_bent(self) -> RockingFrame | UnequalBent:
        """The structure, which may have two columns that differ."""
        chosen = choose_structures(self.structures, self.structure)[0]
        return chosen if isinstance(chosen, UnequalBent) else self.frame

    def chosen(self, file: RecordsFile) -> list[str]:
        """Return the names of the requested records, or of all horizontal records."""
        names = horizontal(file)
        for name in self.record:
            require_known("record", name, names)
        return list(self.record or names)

    def require_at_most(self, most: int) -> None:
        """Raise an error if a figure cannot show that many records."""
        allowed = "one for this figure" if most == 1 else f"at most {most}"
        if len(self.record) > most:
            raise ParameterError(
                f"Invalid number of records, {len(self.record)}. Must be {allowed}."
            )


def nothing(_request: FigureRequest) -> Shown:
    """Return no arguments, for figures without records."""
    return (), 0


def one_record(request: FigureRequest) -> Shown:
    """Return a record, the frame, and the motion with the vertical component if requested."""
    return _one(request, request.frame)


def one_of_any(request: FigureRequest) -> Shown:
    """Return what `one_record` returns; the structure may have two columns that differ."""
    return _one(request, request.frame_or_bent)


def _one(request: FigureRequest, structure: RockingFrame | UnequalBent) -> Shown:
    request.require_at_most(1)
    with request.records() as (path, status), open_records(path) as file:
        motions, rejected = _motions(request, file, request.chosen(file))
    record = _largest_rotation(motions, structure)
    motion = motions[record.record_id][1] if request.vertical else None
    return (record, structure, motion), request.report(rejected) or status


def one_or_both(request: FigureRequest) -> Shown:
    """Return what `one_of_any` returns, or the motion in both directions that is named.

    A motion in both directions has the name that `respond` gives it, such as CCC-both.
    """
    with request.records() as (path, status), open_records(path) as file:
        named = [pair for pair in pairs_of(file).values() if pair.name in request.record]
        if named:
            request.require_at_most(1)
            both = file.in_both(named[0].records)
            if request.vertical and both.vertical is None:
                raise ParameterError(f"record {request.record[0]!r}: {WITHOUT_VERTICAL}")
            ground = PairAcceleration.from_pair(both, vertical=True) if request.vertical else None
            return (both, request.frame_or_bent, ground), status
    return one_of_any(request)


def one_recorded(request: FigureRequest) -> Shown:
    """Return the requested record; by default the first horizontal one."""
    request.require_at_most(1)
    with request.records() as (path, status), open_records(path) as file:
        name, *_ = request.chosen(file)
        return (file.read(name),), status


#: Records by name, each with its motion: the record itself, or also its vertical component.
_Motions = dict[str, tuple[Record, Record | GroundAcceleration]]


def _motions(
    request: FigureRequest, file: RecordsFile, names: list[str]
) -> tuple[_Motions, list[InputOutcome]]:
    """Return the motions of records, and the records without a requested vertical component.

    Raises
    ------
    ParameterError
        If no record has a vertical component.
    """
    beside = vertical_beside(file) if request.vertical else {}
    motions: _Motions = {}
    rejected = []
    for record in map(file.read, names):
        try:
            motion = with_vertical(record, beside) if request.vertical else record
            motions[record.record_id] = record, motion
        except ParameterError as error:
            rejected.append(InputOutcome(record.record_id, str(error)))
    if not motions:
        raise ParameterError(f"record {rejected[0].file!r}: {rejected[0].reason}")
    return motions, rejected


def _largest_rotation(motions: _Motions, structure: RockingFrame | UnequalBent) -> Record:
    """Return the record with the largest rotation without overturning, or the first."""
    (best, _), *_ = motions.values()
    furthest = 0.0
    for record, motion in motions.values() if len(motions) > 1 else ():
        response: Any = (
            respond_bent(structure, motion)
            if isinstance(structure, UnequalBent)
            else respond(structure, motion)
        )
        if response.verdict is Verdict.STANDS and response.peak_rotation > furthest:
            best, furthest = record, response.peak_rotation
    return best


def records(request: FigureRequest) -> Shown:
    """Return the requested records, by default all, the structure, and motions if requested."""
    frame = request.frame
    with request.records() as (path, status), open_records(path) as file:
        motions, rejected = _motions(request, file, request.chosen(file))
    shown = [record for record, _ in motions.values()]
    wanted = [motion for _, motion in motions.values()] if request.vertical else None
    return (shown, frame, wanted), request.report(rejected) or status


def unequal(request: FigureRequest) -> Shown:
    """Return the requested records, by default all, and the bent of two columns.

    A rocking frame counts as a bent of two equal columns, 1.25 times their height apart unless the
    spacing is stated.
    """
    structure = choose_structures(request.structures, request.structure)[0]
    if isinstance(structure, UnequalBent):
        bent = structure if request.spacing is None else replace(structure, spacing=request.spacing)
    else:
        frame = request.frame
        other_shape = not frame.prismatic or frame.inertia_ratio != RECTANGULAR
        if frame.restrained or frame.abutment or other_shape:
            raise ParameterError(
                f"Invalid structure {frame.name!r}. Must be a free frame of rectangular, prismatic "
                "columns for this figure, or of kind 'unequal'."
            )
        height, spacing = frame.height, request.spacing or _SPACING * frame.height
        bent = UnequalBent(
            heights=(height, height),
            widths=(frame.width, frame.width),
            spacing=spacing,
            mass_ratio=frame.mass_ratio,
            beam_depth=frame.beam_depth or 0.0,
            restitution_factor=frame.restitution_factor,
            name=frame.name,
        )
    with request.records() as (path, status), open_records(path) as file:
        return ([file.read(name) for name in request.chosen(file)], bent), status


def responses(request: FigureRequest) -> Shown:
    """Return records, the responses of the structure, and titles."""
    frame = request.frame
    with request.records() as (path, status), open_records(path) as file:
        names = request.chosen(file)
        if len(names) > _MOST_HISTORIES:
            raise ParameterError(
                f"Invalid number of records, {len(names)}. Must be at most {_MOST_HISTORIES}: "
                "choose with --record."
            )
        motions, rejected = _motions(request, file, names)
        chosen_responses = []
        for record, motion in motions.values():
            try:
                chosen_responses.append((record, respond(frame, motion)))
            except ParameterError as error:
                rejected.append(InputOutcome(record.record_id, str(error)))
    if not chosen_responses:
        raise ParameterError(f"record {rejected[0].file!r}: {rejected[0].reason}")
    shown = [record for record, _ in chosen_responses]
    drawn = (
        shown,
        [response for _, response in chosen_responses],
        [_title(record) for record in shown],
    )
    return drawn, request.report(rejected) or status


def best_matched(request: FigureRequest) -> Shown:
    """Return the requested record; by default the record that a Ricker wavelet matches best."""
    request.require_at_most(1)
    records, status = _searchable(request)

    def index(pair: tuple[Record, PulseOptions]) -> float:
        matches = _rickers(*pair)
        return matches[best_ricker(matches)].match_index

    return max(records, key=index) if len(records) > 1 else records[0], status


def pulses(request: FigureRequest) -> Shown:
    """Return the requested records with their pulses, titles, and how many are left out.

    By default the records are the paper's two, or the best match of each of its wavelets.
    """
    request.require_at_most(_MOST_PULSES)
    records, status = _searchable(request)
    matches = [_rickers(*pair) for pair in records]
    chosen = [(i, best_ricker(match)) for i, match in enumerate(matches)]
    if not request.record:
        chosen = _default([record for record, _ in records], matches)
    tested, titles = [], []
    for i, wavelet in chosen:
        record, options = records[i]
        samples, step = record.acceleration, record.time_step
        matches_of = match_pulses(samples, step, options)
        noise = likeness(samples, step, matches_of, options, record.record_id)
        tested.append((record, matches[i][wavelet], noise[wavelet]))
        titles.append(_title(record).replace("\n", ", "))
    count, remark = len({i for i, _ in chosen}), ""
    if count < len(records):
        remark = f"{count} of {len(records)} records are shown; --record names others."
    return (tested, titles, remark), status


def _searchable(request: FigureRequest) -> tuple[list[tuple[Record, PulseOptions]], int]:
    """Return the requested records with their usable options, and the exit status."""
    with request.records() as (path, status), open_records(path) as file:
        names = request.chosen(file)
        return [(file.read(name), usable(name, file, PulseOptions())) for name in names], status


def _rickers(record: Record, options: PulseOptions) -> dict[str, PulseMatch]:
    alone = options.of_wavelets(*RICKERS)
    return match_pulses(record.acceleration, record.time_step, alone)


def _default(records: list[Record], matches: list[dict[str, PulseMatch]]) -> list[tuple[int, str]]:
    """Return the paper's two records if available, otherwise the best record for each wavelet."""
    printed = [find_paper_record(record.source_file) for record in records]
    named = {paper.record: i for i, paper in enumerate(printed) if paper is not None}
    if all(name in named for name in _PAPER):
        return [(named[name], wavelet) for name, wavelet in _PAPER.items()]
    return [
        (max(range(len(matches)), key=lambda i: matches[i][wavelet].match_index), wavelet)
        for wavelet in _PAPER.values()
    ]


def _title(record: Record) -> str:
    """Return the names of event and record in two lines."""
    printed = find_paper_record(record.source_file)
    if printed is not None:
        return f"{printed.event}\n{printed.record}"
    place = "/".join(part for part in (record.station, record.component) if part)
    return "\n".join(part for part in (record.event, place or record.record_id) if part)
