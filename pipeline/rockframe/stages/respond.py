"""respond: from records.nc and a file of structures to response.nc."""

from __future__ import annotations

from pathlib import Path

from rockframe.errors import ParameterError
from rockframe.frame import RockingFrame
from rockframe.provenance import refuse_overwriting
from rockframe.results import RESPONSE, input_hash, open_records, response_dataset, write
from rockframe.rocking.response import Response, respond
from rockframe.stages.common import Progress, horizontal, silent
from rockframe.study import SHIPPED_STRUCTURES, read_structures


def respond_stage(
    records_path: Path,
    output: Path,
    *,
    structures_path: Path = SHIPPED_STRUCTURES,
    structure: str | None = None,
    progress: Progress = silent,
) -> None:
    """Compute the response of each structure to each horizontal record: ``response.nc``.

    Parameters
    ----------
    records_path, output : Path
        Output of `ingest_stage`, and the netCDF file to write.
    structures_path : Path
        TOML file of ``[[structure]]`` tables; by default the shipped ones.
    structure : str, optional
        Only the structure of this name.
    progress : callable
        Called with the number of records done and in all.

    Raises
    ------
    InputError
        If the records or structures cannot be read, or the output not written.
    ParameterError
        If there is no structure of that name, or no record is horizontal.
    """
    refuse_overwriting([output], [records_path, structures_path])
    frames = choose_structures(structures_path, structure)
    with open_records(records_path) as file:
        records = [file.read(name) for name in horizontal(file)]
    responses: list[list[Response]] = []
    for i, record in enumerate(records):
        responses.append([respond(frame, record) for frame in frames])
        progress(i + 1, len(records))
    write(
        response_dataset(records, frames, responses),
        output,
        RESPONSE,
        input_sha256=input_hash(records_path) | input_hash(structures_path),
        parameters={"structures": [frame.name for frame in frames]},
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
