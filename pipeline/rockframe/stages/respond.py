"""respond: from records.nc and a file of structures to response.nc."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from rockframe.components import vertical_beside
from rockframe.errors import ParameterError
from rockframe.frame import RockingFrame
from rockframe.ingest import Rejection
from rockframe.provenance import refuse_overwriting
from rockframe.record import Orientation, Record
from rockframe.results import (
    RESPONSE,
    input_hash,
    no_records,
    open_records,
    response_dataset,
    write,
)
from rockframe.rocking import GroundAcceleration, Response, respond
from rockframe.stages.common import WHOLE, Batch, Progress, horizontal, silent
from rockframe.study import SHIPPED_STRUCTURES, read_structures


def respond_stage(
    records_path: Path,
    output: Path,
    *,
    structures_path: Path = SHIPPED_STRUCTURES,
    structure: str | None = None,
    vertical: bool = False,
    histories: bool = True,
    batch: Batch = WHOLE,
    progress: Progress = silent,
) -> tuple[Rejection, ...]:
    """Compute the response of each structure to each horizontal record: ``response.nc``.

    Parameters
    ----------
    records_path, output : Path
        Output of `ingest_stage`, and the netCDF file to write.
    structures_path : Path
        TOML file of ``[[structure]]`` tables; by default the shipped ones.
    structure : str, optional
        Only the structure of this name.
    vertical : bool
        Let the ground move vertically too, as the vertical record of the same motion says.
    histories : bool
        Write rotation and displacements at each sample, not their peaks alone.
    batch : Batch
        Which of the records; `merge_stage` puts the files of all batches together.
    progress : callable
        Called with the number of records done and in all.

    Returns
    -------
    tuple of Rejection
        Records without a vertical that was asked for, or with one that falls faster than gravity;
        they are left out.

    Raises
    ------
    InputError
        If the records or structures cannot be read, or the output not written.
    ParameterError
        If there is no structure of that name, no record is horizontal, or none is left.
    """
    refuse_overwriting([output], [records_path, structures_path])
    frames = choose_structures(structures_path, structure)
    with open_records(records_path) as file:
        beside = vertical_beside(file) if vertical else {}
        records = [file.read(name) for name in batch.of(horizontal(file))]
    answered: list[tuple[Record, list[Response]]] = []
    rejections: list[Rejection] = []
    for i, record in enumerate(records):
        try:
            motion = with_vertical(record, beside) if vertical else record
            answered.append((record, [respond(frame, motion) for frame in frames]))
        except ParameterError as error:
            rejections.append(Rejection(file=record.record_id, reason=str(error)))
        progress(i + 1, len(records))
    if not answered and batch.whole:
        raise ParameterError(f"record {rejections[0].file!r}: {rejections[0].reason}")
    found = no_records()
    if answered:
        found = response_dataset(
            [record for record, _ in answered],
            frames,
            [responses for _, responses in answered],
            histories=histories,
        )
    write(
        found,
        output,
        RESPONSE,
        input_sha256=input_hash(records_path) | input_hash(structures_path),
        parameters={"structures": [frame.name for frame in frames], "vertical": vertical},
        left_out={rejection.file: rejection.reason for rejection in rejections},
    )
    return tuple(rejections)


def with_vertical(record: Record, beside: Mapping[str, Record]) -> GroundAcceleration:
    """Return the ground motion of a record with the vertical one that was recorded beside it.

    Parameters
    ----------
    record : Record
        The horizontal record.
    beside : mapping of str to Record
        What `vertical_beside` found.

    Raises
    ------
    ParameterError
        If there is none.

    Examples
    --------
    >>> record = Record(record_id="shake", acceleration=[0.0, 1.0], time_step=0.1)
    >>> upwards = Record(record_id="up", acceleration=[0.0, 2.0], time_step=0.1)
    >>> with_vertical(record, {"shake": upwards}).vertical.tolist()
    [[0.0, 20.0]]
    """
    upward = beside.get(record.record_id)
    if upward is None:
        raise ParameterError(
            "no vertical record of the same event, station, start, time step and length. "
            "Must be one, to let the ground move vertically."
        )
    sign = -1.0 if upward.orientation is Orientation.DOWNWARD else 1.0
    across = GroundAcceleration.from_samples(record.acceleration, record.time_step)
    return across.with_vertical(
        GroundAcceleration.from_samples(sign * upward.acceleration, upward.time_step)
    )


def choose_structures(path: Path, name: str | None) -> list[RockingFrame]:
    """Return the structures of a file, or the one of that name.

    Raises
    ------
    InputError
        If the file cannot be read.
    ParameterError
        If there is no structure of that name.

    Examples
    --------
    >>> [frame.name for frame in choose_structures(SHIPPED_STRUCTURES, "apollo-frame")]
    ['apollo-frame']
    """
    frames = read_structures(path)
    if name is None:
        return frames
    chosen = [frame for frame in frames if frame.name == name]
    if not chosen:
        known = ", ".join(frame.name for frame in frames)
        raise ParameterError(f"Invalid structure {name!r}. Must be one of: {known}.")
    return chosen
