"""Argument types of outputs, whose names must fit what is written; the manifest of a folder."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Final

from rockframe.cli.options import path

if TYPE_CHECKING:
    from rockframe.options import Options
    from rockframe.stages import Ingested

#: Endings of files, which suggest that a name is not meant for a folder.
_OF_FILES: Final = (
    *(".csv", ".html", ".json", ".nc", ".ods", ".pdf", ".png"),
    *(".svg", ".toml", ".tsv", ".txt", ".xls", ".xlsx", ".zip"),
)


def file_to_write(*endings: str) -> Callable[[str], Path]:
    """Return the type of an option that names a file with one of these endings.

    Examples
    --------
    >>> file_to_write(".csv")("table.xlsx")
    Traceback (most recent call last):
    argparse.ArgumentTypeError: 'table.xlsx'. Must end in .csv
    """

    def named(text: str) -> Path:
        if path(text).suffix.lower() not in endings:
            known = " or ".join(filter(None, [", ".join(endings[:-1]), endings[-1]]))
            raise argparse.ArgumentTypeError(f"{text!r}. Must end in {known}")
        return Path(text)

    return named


def folder_to_write(text: str) -> Path:
    """Return the folder that a word names. Names with the ending of a file are errors.

    Examples
    --------
    >>> folder_to_write("outputs/v1.2").name
    'v1.2'
    """
    if path(text).suffix.lower() in _OF_FILES:
        raise argparse.ArgumentTypeError(f"{text!r}, named like a file. Must name a folder")
    return Path(text)


def finish(
    folder: Path, ingested: Ingested, structures: Path, stated: Mapping[str, Options]
) -> int:
    """Write the manifest of a folder. Return the number of its files."""
    from rockframe.provenance import sha256_of
    from rockframe.results import write_manifest

    outputs = sorted(file for file in folder.rglob("*") if file.is_file())
    write_manifest(
        folder,
        inputs={**ingested.inputs, structures.name: sha256_of(structures)},
        parameters={table: options.stated() for table, options in stated.items()},
        outputs=outputs,
    )
    return len(outputs) + 1
