"""Types of the options that name what a command writes: a name must fit what is written."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Final

from rockframe.cli.options import path

#: Endings of files, which a folder is hardly meant to have.
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
    """Return the folder that a word names, unless its name is that of a file.

    Examples
    --------
    >>> folder_to_write("outputs/v1.2").name
    'v1.2'
    """
    if path(text).suffix.lower() in _OF_FILES:
        raise argparse.ArgumentTypeError(f"{text!r}, named like a file. Must name a folder")
    return Path(text)
