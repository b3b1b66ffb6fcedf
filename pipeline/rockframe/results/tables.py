"""Tables beside the datasets: what stands in their place is not replaced unless it is one."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rockframe.errors import InputError


def refuse_other_table(path: Path, first: Sequence[str], what: str) -> None:
    """Refuse to replace a file that has the name of a table and is something else.

    Parameters
    ----------
    path : Path
        Where the table is to be.
    first : sequence of str
        Its first columns.
    what : str
        What it is, in words.

    Raises
    ------
    InputError
        If there is a file of other columns.
    """
    if not path.is_file():
        return
    with path.open("rb") as stream:
        head = stream.readline().decode("latin-1").strip()
    if head.split(",")[: len(first)] != list(first):
        raise InputError(path, f"is in the place of {what}, and is not one. Must be moved away.")
