"""Draw the figures of records, and the curves of screenings, spectra and comparisons."""

from __future__ import annotations

import gc
import shutil
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from rockframe.cells import write_rows
from rockframe.components import BothDirections
from rockframe.engines.engine import Engine, OneProcess, ProcessPool
from rockframe.errors import InputError, ParameterError
from rockframe.figures.captioned import Captioned, caption_path, save, save_captioned
from rockframe.figures.histories import draw_response_history
from rockframe.figures.joints import draw_forces
from rockframe.figures.margins import draw_margin_strips
from rockframe.figures.paths import draw_paths
from rockframe.figures.sensitivity import draw_sensitivity
from rockframe.matching.match import Float, PulseMatch
from rockframe.options import STAGES, loaded
from rockframe.options.model import FigureOptions
from rockframe.provenance import (
    DRAWN,
    Stamp,
    is_sealed,
    key_of,
    make_folder,
    read_json,
    refuse_obstacles,
    replaced_folder,
    sealed,
    sha256_of,
    staying,
)
from rockframe.results.pulses import best_pulses
from rockframe.results.records import open_records
from rockframe.results.response import open_response
from rockframe.results.schema.arrays import Arrays
from rockframe.results.stored import kind_of
from rockframe.results.tables.entries import rows_of
from rockframe.results.tables.forces import force_rows
from rockframe.results.tables.rows import Row, stated_pulse
from rockframe.results.tables.sensitivity import sensitivity_rows
from rockframe.rocking import Strip
from rockframe.stages.common import Progress, silent
from rockframe.stages.table import table_rows_of

#: File in the folder of figures that lists them.
_INDEX: Final = "figures.csv"
#: Time that one process draws alone [s]. Workers need a second and 100 MB each to start.
_ALONE: Final = 6.0
#: Files from which the figure of a record is drawn.
_OF_RECORDS: Final = ("records", "pulses", "response")


def figures_stage(
    files: Sequence[Path],
    output: Path,
    options: FigureOptions | None = None,
    *,
    progress: Progress = silent,
    workers: int | None = None,
) -> dict[str, str]:
    """Draw a figure of each record with its responses, and all curves.

    Figures in the folder that would be drawn alike are kept.

    Parameters
    ----------
    files : sequence of Path
        Outputs of stages, one of each kind: ingest, pulse and respond together for figures of
        records; screen for fragility and peaks; spectrum for its curves.
    output : Path
        The folder to write; an earlier folder of this stage is replaced.
    options : FigureOptions, optional
        Number of figures.
    progress : callable
        Called with the number of records drawn and in total.
    workers : int, optional
        Largest number of processes that draw figures of records; by default one for each core.

    Returns
    -------
    dict of str to str
        Description of each figure by its file, relative to the folder.

    Raises
    ------
    InputError
        If a file cannot be read, if two files are of one kind, if one of ingest, pulse and respond
        is missing, or if the folder contains other files.
    ParameterError
        If the number of figures is below 1.
    """
    most = (options or FigureOptions()).most
    if most < 1:
        raise ParameterError(f"Invalid number of figures {most}. Must be at least 1.")
    given = _by_kind(files)
    _require_own_folder(output)
    drawn: dict[str, str] = {}
    drawn_before = _read_drawn(output)
    kept: dict[str, dict[str, Any]] = {}
    with replaced_folder(output) as partial:
        for group, files_of in _groups(given).items():
            key = key_of([sha256_of(file) for file in files_of], most)
            if not _keep(drawn_before.get(group, {}), key, output, partial):
                if group == "response":
                    shows = _draw_most_rotated(given, partial, most, progress, workers)
                else:
                    shows = draw_curves({group: given[group]}, partial, most)
                pairs = [list(pair) for pair in shows.items()]  # in their order
                new_stamp = Stamp.of(key, _files_of(shows, partial), partial)
                drawn_before[group] = {"key": key, "shows": pairs, "sha256": new_stamp.outputs}
            kept[group] = drawn_before[group]
            drawn |= dict(kept[group]["shows"])
        (partial / DRAWN).write_bytes(sealed(kept))
        with (partial / _INDEX).open("w", newline="", encoding="utf-8") as stream:
            write_rows(stream, [("file", "shows"), *drawn.items()])
    return drawn


def _groups(given: Mapping[str, Path]) -> dict[str, list[Path]]:
    """Return the files from which figures are drawn together: records first, then each curve."""
    curves = [stage.kind for stage in STAGES.values() if stage.figures and stage.kind in given]
    records = {"response": [given[kind] for kind in _OF_RECORDS]} if "response" in given else {}
    return records | {kind: [given[kind]] for kind in curves}


def _files_of(drawn: Iterable[str], folder: Path) -> list[str]:
    """Return each figure, and its caption if it has one, by its path in the folder."""
    files = [path for name in drawn for path in (Path(name), caption_path(Path(name)))]
    return [file.as_posix() for file in files if (folder / file).is_file()]


def _read_drawn(folder: Path) -> dict[str, dict[str, Any]]:
    """Return what is known of the figures in a folder; empty if nothing is, or it is corrupted."""
    path = folder / DRAWN
    content = path.read_bytes() if path.is_file() else b""
    return dict(read_json(content)) if is_sealed(content) else {}


def _keep(known: Mapping[str, Any], key: str, before: Path, folder: Path) -> bool:
    """Copy the figures of an earlier run if they would be drawn alike and are whole.

    Returns
    -------
    bool
        False if they must be drawn.
    """
    if known.get("key") != key or any(Stamp(key, known["sha256"]).faults(before)):
        return False
    for name in known["sha256"]:
        make_folder((folder / name).parent)
        shutil.copyfile(before / name, folder / name)
    return True


def _require_own_folder(folder: Path) -> None:
    """Refuse to replace a folder that contains other files than figures."""
    index = folder / _INDEX
    refuse_obstacles([index])
    figures = [folder / row["file"] for row in rows_of(index) if row.get("file")]
    ours = {index, *figures, *(figure.with_suffix(".caption.txt") for figure in figures)}
    for file in sorted(folder.rglob("*")):
        mark = file.name.startswith(".") and index.is_file()  # hidden file of a workflow
        if file not in ours and not mark and (file.is_symlink() or not file.is_dir()):
            unlisted = f"is not a figure of this stage: {_INDEX} does not list it."
            raise InputError(file, f"{unlisted} Move it elsewhere.")


def _by_kind(files: Sequence[Path]) -> dict[str, Path]:
    """Return the files by kind, after checking that none is missing or stated twice."""
    given: dict[str, Path] = {}
    for file in files:
        kind = kind_of(file)
        if kind in given:
            raise InputError(
                file, f"is of the same kind as {given[kind]}: {kind}. State one file of each kind."
            )
        given[kind] = file
    missing = [kind for kind in _OF_RECORDS if kind not in given]
    if 0 < len(missing) < len(_OF_RECORDS):
        of_records = next(given[kind] for kind in _OF_RECORDS if kind in given)
        raise InputError(
            of_records,
            f"stated without {' and '.join(missing)}. Figures of records need three files: the "
            "records, their pulses and their responses.",
        )
    return given


def _draw_most_rotated(
    given: Mapping[str, Path], folder: Path, most: int, progress: Progress, workers: int | None
) -> dict[str, str]:
    """Draw the records with the largest rotations; return the description of each file."""
    files = tuple(given[kind] for kind in _OF_RECORDS)
    first: dict[str, Row] = {}

    def rows() -> Iterator[Row]:
        for row in table_rows_of(*files):  # keeps one row per record in memory
            first.setdefault(row["record_id"], row)
            yield row

    chosen = _most_rotated(rows(), given["response"], most)
    return draw_records(first.values(), files, folder, chosen, progress, _engine(workers))


def _engine(workers: int | None) -> Engine:
    """Return the engine that draws records, with at most this number of workers."""
    return OneProcess() if workers in (0, 1) else ProcessPool(workers, patience=_ALONE)


@dataclass(frozen=True)
class _OfRecord:
    """The content of the figures of one record, and the folder to write them into."""

    folder: Path
    name: str
    title: str
    acceleration: Float
    pulse: PulseMatch | None
    tested: str
    histories: list[Arrays]
    strips: dict[str, Strip]
    spreads: list[Row]
    forces: list[Row]
    both: bool = False


def _length(motion: BothDirections) -> Float:
    """Return the length of the vector of both horizontal accelerations [m s-2]."""
    return np.hypot(motion.first.acceleration, motion.second.acceleration)


def draw_records(
    rows: Iterable[Row],
    files: Sequence[Path],
    folder: Path,
    chosen: Sequence[str],
    progress: Progress,
    engine: Engine,
) -> dict[str, str]:
    """Draw each chosen record with the histories that were kept, and its margins, the sensitivity
    to the spreads of the ensemble and the forces at the joints if they are known.

    Returns
    -------
    dict of str to str
        The record of each figure by its file, relative to the folder.
    """
    drawn: dict[str, str] = {}
    make_folder(folder)  # workers draw into a folder that exists, so they notice if it vanishes
    asked = _Chosen(rows, files, folder, chosen)
    for i, names in enumerate(engine.map(_draw_record, asked)):
        drawn |= dict.fromkeys(names, chosen[i])
        progress(i + 1, len(chosen))
    return drawn


@dataclass(frozen=True)
class _Chosen:
    """The content of the figures of each chosen record; it is read when the record is drawn."""

    rows: Iterable[Row]
    files: Sequence[Path]
    folder: Path
    names: Sequence[str]

    def __len__(self) -> int:
        return len(self.names)

    def __iter__(self) -> Iterator[_OfRecord]:
        by_record = {row["record_id"]: row for row in self.rows}
        pulses = best_pulses(self.files[1])
        with open_records(self.files[0]) as records, open_response(self.files[2]) as response:
            for name in self.names:
                row = by_record[name]
                kept, both = response.kept(name), response.components(name)
                yield _OfRecord(
                    folder=self.folder,
                    name=name,
                    title=f"{row['event']}, {row['record']}".removeprefix(", "),
                    acceleration=_length(records.in_both(both))
                    if both
                    else records.read(name).acceleration,
                    pulse=pulses.get(name),
                    tested=stated_pulse(row),
                    histories=[response.history(record=name, structure=s) for s in kept],
                    strips=response.strips(name),
                    spreads=list(sensitivity_rows(response.arrays, name)),
                    forces=list(force_rows(response.arrays, name)),
                    both=bool(both),
                )


def _draw_record(shown: _OfRecord) -> list[str]:
    """Draw the figures of a record; return their files, relative to the folder."""
    with staying(shown.folder.parent):  # which exists before the first figure
        files = list(_figures_of_record(shown))
    gc.collect()  # a figure refers to itself, and takes several megabytes
    return files


def _figures_of_record(shown: _OfRecord) -> Iterator[str]:
    """Draw each figure of a record, then yield its file."""
    file = f"{shown.name}.png"
    if shown.histories:
        figure = draw_response_history(
            *(shown.acceleration, shown.pulse, shown.histories, shown.title), tested=shown.tested
        )
        save(figure, shown.folder / file)
        yield file
    captioned: list[tuple[str, Callable[..., Captioned], Collection[Any]]] = [
        ("margins", draw_margin_strips, shown.strips),
        ("sensitivity", draw_sensitivity, shown.spreads),
        ("forces", draw_forces, shown.forces),
        ("paths", draw_paths, shown.histories if shown.both else ()),
    ]
    for kind, draw, content in captioned:
        if content:
            save_captioned(draw(content, shown.title), shown.folder / kind / file)
            yield f"{kind}/{file}"


def _most_rotated(rows: Iterable[Row], response: Path, most: int) -> list[str]:
    """Return at most `most` records with histories, those with the largest rotations."""
    furthest: dict[str, float] = {}
    for row in rows:
        ratio = row["peak_rotation_ratio"] if row["verdict"] == "stands" else 0.0
        furthest[row["record_id"]] = max(ratio, furthest.get(row["record_id"], 0.0))
    with open_response(response) as file:
        furthest = {name: ratio for name, ratio in furthest.items() if file.kept(name)}
    chosen = set(sorted(furthest, key=lambda name: -furthest[name])[:most])
    return [name for name in furthest if name in chosen]


def draw_curves(given: Mapping[str, Path], folder: Path, most: int) -> dict[str, str]:
    """Draw the curves of files; each kind of file has its own folder.

    Parameters
    ----------
    given : mapping of str to Path
        Files by kind; kinds without curves are ignored.
    folder : Path
        Folder for the new folders.
    most : int
        Largest number of figures of single records.

    Returns
    -------
    dict of str to str
        Description of each figure by its file, relative to the folder.
    """
    drawn: dict[str, str] = {}
    for stage in STAGES.values():
        if stage.figures and stage.kind in given:
            for name, shows, figure in loaded(stage.figures)(given[stage.kind], most):
                file = f"{stage.kind}/{name}.png"
                save_captioned(figure, folder / file)
                drawn[file] = shows
    return drawn
