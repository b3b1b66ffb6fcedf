"""Flipped bytes in our netCDF files: each reader reads on, or names the file in one line."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Final

import pytest

from rockframe.errors import InputError
from rockframe.results.contents import describe
from rockframe.results.pulses import best_pulses, pulse_rows
from rockframe.results.records import open_records
from rockframe.results.response import (
    comparison_rows,
    furthest_pairs,
    open_response,
    read_histories,
    read_rocking_spectrum,
    read_spectrum,
)
from rockframe.results.screen import read_screening
from rockframe.results.screen_tables import screen_rows, screen_summary

#: Numbers of places in each file.
PLACES: Final = (12, pytest.param(96, marks=pytest.mark.faults))


def _records(path: Path) -> None:
    with open_records(path) as file:
        list(file)


def _response(path: Path) -> None:
    """Read all histories, as `draw` and a notebook do: outside a ``with`` block."""
    file = open_response(path)
    try:
        for record in file.records:
            file.strips(record)
            for structure in file.kept(record):
                file.sel(record=record, structure=structure)
    finally:
        file.close()


def _pulses(path: Path) -> None:
    best_pulses(path)
    list(pulse_rows(path))


def _screening(path: Path) -> None:
    dataset = read_screening(path)
    list(screen_rows(dataset))
    screen_summary(dataset)


def _comparison(path: Path) -> None:
    comparison_rows(path)
    for record, structure in furthest_pairs(path, 1):
        read_histories(path, record, structure)


READERS: Final[dict[str, Callable[[Path], object]]] = {
    "records": _records,
    "pulses": _pulses,
    "response": _response,
    "screen": _screening,
    "spectrum": read_spectrum,
    "rocking_spectrum": read_rocking_spectrum,
    "compare": _comparison,
}


@pytest.mark.parametrize("places", PLACES)
@pytest.mark.parametrize("kind", READERS)
def test_flipped_bytes_are_read_over_or_named(
    kind: str, places: int, made: Path, tmp_path: Path
) -> None:
    """A byte may be unused; every other one is found by a checksum, a check, or netCDF."""
    good, path = (made / f"{kind}.nc").read_bytes(), tmp_path / f"{kind}.nc"
    said: list[str] = []
    for place in range(7, len(good), len(good) // places):
        path.write_bytes(good[:place] + bytes([good[place] ^ 0x10]) + good[place + 1 :])
        for read in (READERS[kind], lambda path: describe(path, kind)):
            try:
                read(path)
            except InputError as error:
                said.append(str(error))
    assert said
    assert all(one.startswith(f"{path}: ") and "\n" not in one for one in said)


def test_histories_that_are_read_late_are_checked_too(made: Path, tmp_path: Path) -> None:
    """The file opens; its histories are read afterwards, without a ``with`` block."""
    good, path = (made / "response.nc").read_bytes(), tmp_path / "response.nc"
    late = set()
    for place in range(0, len(good), len(good) // 24):
        path.write_bytes(good[:place] + bytes([good[place] ^ 0x10]) + good[place + 1 :])
        try:
            file = open_response(path)
        except InputError:
            continue
        try:
            file.sel(record="one", structure=file.structures[0])
        except InputError as error:
            late.add(error.reason.partition(" ")[0])
        finally:
            file.close()
    assert "is" in late
