"""Merge the files of batches of records into one file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rockframe.ingest import Rejection
from rockframe.provenance import refuse_overwriting
from rockframe.results.merging import merge
from rockframe.results.reading import kind_of


def merge_stage(parts: Sequence[Path], output: Path) -> tuple[Rejection, ...]:
    """Merge the files of all batches of a stage.

    Parameters
    ----------
    parts : sequence of Path
        Outputs of one stage with ``batch``, in the order of the batches.
    output : Path
        The netCDF file to write, with the same content as for all records at once.

    Returns
    -------
    tuple of Rejection
        The rejected records.

    Raises
    ------
    InputError
        If a part cannot be read or is of another run, no record is in any, or the output cannot
        be written.
    """
    refuse_overwriting([output], parts)
    left_out = merge(parts, output, kind_of(parts[0]))
    return tuple(Rejection(file=name, reason=reason) for name, reason in left_out.items())
