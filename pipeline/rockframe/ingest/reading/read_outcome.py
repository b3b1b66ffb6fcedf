"""Read one file or archive into records or rejections, without raising errors."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from rockframe.errors import InputError, OtherQuantityError, RockframeError
from rockframe.ingest.metadata.catalogue import CATALOGUE, facts_of, read_catalogue
from rockframe.ingest.metadata.entry import CatalogueEntry
from rockframe.ingest.metadata.stationxml import is_station_xml
from rockframe.ingest.options import ReadOptions
from rockframe.ingest.reading.containers import contents
from rockframe.ingest.reading.files import (
    companions,
    load,
    note_of_member,
    read_content,
    with_archived,
)
from rockframe.ingest.reading.members import Content, printable
from rockframe.record import Record


@dataclass(frozen=True)
class Rejection:
    """A file that was rejected.

    Parameters
    ----------
    file : str
        Name of the file.
    reason : str
        Reason for the rejection, as a sentence.
    line : int, optional
        Line number in the file, counted from 1.

    Examples
    --------
    >>> Rejection("FSD172.VT2", "is a velocity time series. Must be an acceleration.", line=3).line
    3
    """

    file: str
    reason: str
    line: int | None = None


@dataclass(frozen=True)
class Unread:
    """A file that was skipped because it contains no acceleration, such as a catalogue.

    Parameters
    ----------
    file : str
        Name of the file.
    reason : str
        What the file is, as a sentence.
    line : int, optional
        Line number in the file, counted from 1.

    Examples
    --------
    >>> Unread("catalogue.csv", "catalogue: facts about the files beside it.").file
    'catalogue.csv'
    """

    file: str
    reason: str
    line: int | None = None


#: Records, each with the fields from the `catalogue.csv` of its archive; or a reason without
#: records.
ReadOutcome = list[tuple[Record, dict[str, Any]]] | Rejection | Unread
#: Catalogues in an archive, by the folder or inner archive whose files they describe.
_Catalogues = dict[str, dict[str, CatalogueEntry]]


def read_outcomes(path: Path, options: ReadOptions) -> Iterator[ReadOutcome]:
    r"""Read a file; yield a rejection or a note instead of raising an error.

    Yields
    ------
    list of Record, Rejection or Unread
        One for the file, or one for each member of the archive, in order.

    Examples
    --------
    >>> from rockframe.ingest.options import NO_OPTIONS
    >>> list(read_outcomes(Path("lost.AT2"), NO_OPTIONS))
    [Rejection(file='lost.AT2', reason='no such file.', line=None)]
    """
    try:
        data = load(path)
        within = companions(path, data)
        options = with_archived(options, path, within)
        catalogues, faults = _catalogues(within)
        names = []
        for content in contents(path, data):
            names.append(content.name)
            yield faults.get(content.name) or _outcome(content, options, catalogues)
        yield from _missing(catalogues, names)
    except RockframeError as error:
        yield rejection(printable(path.name), error)


def _catalogues(within: Iterable[Content]) -> tuple[_Catalogues, dict[str, Rejection]]:
    """Return the catalogues in an archive in order of precedence, and the corrupted catalogues."""
    found: _Catalogues = {}
    faults: dict[str, Rejection] = {}
    for content in within:
        if not is_station_xml(content.path, content.data):
            is_own = content.path.name == CATALOGUE
            folder = content.name.removesuffix(CATALOGUE) if is_own else ""
            try:
                entries = read_catalogue(content.where, content.data)
            except InputError as error:
                faults[content.name] = rejection(content.name, error)
            else:
                found[folder] = {**found.get(folder, {}), **entries}
    return dict(sorted(found.items())), faults


def _missing(catalogues: _Catalogues, names: Iterable[str]) -> Iterator[Rejection]:
    """Yield a rejection for each missing file that the `catalogue.csv` of an archive names."""
    for folder, entries in catalogues.items():
        within = [name.removeprefix(folder) for name in names if name.startswith(folder)]
        present = {part for name in within for part in re.split("[:/]", name)}
        for missing in entries if folder else ():
            if missing not in present:
                yield Rejection(folder + printable(missing), "no such file.")


def rejection(name: str, error: RockframeError) -> Rejection:
    """Return the rejection of a file that could not be read.

    Examples
    --------
    >>> rejection("a.csv", InputError("/records/a.csv", "empty file.", line=1))
    Rejection(file='a.csv', reason='empty file.', line=1)
    """
    if isinstance(error, InputError):
        return Rejection(name, error.reason, error.line)
    return Rejection(name, str(error))


def _outcome(content: Content, options: ReadOptions, catalogues: _Catalogues) -> ReadOutcome:
    try:
        if note := note_of_member(content):
            return Unread(content.name, note)
        records = read_content(content, options)
    except OtherQuantityError as error:
        return Unread(content.name, error.reason, error.line)
    except RockframeError as error:
        return rejection(content.name, error)
    own: dict[str, CatalogueEntry] = {}
    for folder, entries in catalogues.items():
        own |= entries if folder and content.name.startswith(folder) else {}
    names, others = dict.fromkeys(re.split("[:/]", content.name)), catalogues.get("", {})
    return [
        (replace(record, **facts_of(others, record, names)), facts_of(own, record, names))
        for record in records
    ]
