"""Stages run in batches: the merged files equal those of one run over all records."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import pytest
import xarray as xr
from tests.screening import site, stored, structures, three

from rockframe.cli.main import main
from rockframe.errors import InputError
from rockframe.results import merging, writing
from rockframe.results.merging import merge
from rockframe.results.pulses import best_pulses, recordings_of
from rockframe.results.response import open_response
from rockframe.results.tables.entries import write_rows_as
from rockframe.results.tables.summary import summary_rows
from rockframe.results.tables.table import response_rows
from rockframe.stages.table import merge_stage, table_rows_of, table_stage

VERBS = {"pulse": "pulses", "respond": "response"}


def run(*words: object) -> int:
    return main([str(word) for word in words])


@pytest.fixture(scope="module")
def records(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Six horizontal records; the first two and the last two have a vertical."""
    return stored(
        [*three("a"), *site(2), *three("z", 0.2)],
        tmp_path_factory.mktemp("batches"),
    )


def options(verb: str, records: Path) -> list[object]:
    """Return options for a quick run; five structures would take longer and run the same code."""
    few = [
        "--structures",
        structures(records.parent),
        "--margins",
        "first",
        "--ensemble-members",
        "16",
    ]
    return few if verb == "respond" else ["--surrogates", "19"]


@pytest.fixture(scope="module")
def wholes(records: Path) -> dict[str, Path]:
    """The file that each command writes for all records at once."""
    made = {verb: records.with_name(f"{verb}-whole.nc") for verb in VERBS}
    for verb, whole in made.items():
        assert run(verb, records, "--output", whole, *options(verb, records)) == 0
    return made


def in_batches(verb: str, records: Path, count: int, *words: str) -> tuple[Path, list[Path]]:
    """Run a command in batches; return the merged file and the files of the batches."""
    folder = records.parent / f"{verb}-{count}"
    parts = [folder / f"{k}.nc" for k in range(1, count + 1)]
    for k, part in enumerate(parts, 1):
        batch = ("--batch", f"{k}/{count}", "--output", part)
        if not part.exists():
            run(verb, records, *batch, *options(verb, records), *words)
    merged = folder / f"{VERBS[verb]}.nc"
    merge_stage(parts, merged)
    return merged, parts


def equal(one: Path, other: Path) -> None:
    """Assert that all variables and attributes are equal, to the last bit."""
    with netCDF4.Dataset(one) as a, netCDF4.Dataset(other) as b:
        assert set(a.variables) == set(b.variables)
        assert a.__dict__ == b.__dict__
        for name, variable in a.variables.items():
            np.testing.assert_array_equal(variable[:], b[name][:])
            assert variable.dimensions == b[name].dimensions
            assert {k: str(v) for k, v in variable.__dict__.items()} == {
                k: str(v) for k, v in b[name].__dict__.items()
            }


@pytest.mark.parametrize("verb", VERBS)
@pytest.mark.parametrize("count", [2, 7])  # one batch of 7 is empty: there are six records
def test_batches_together_are_the_whole(
    records: Path, wholes: dict[str, Path], verb: str, count: int
) -> None:
    equal(in_batches(verb, records, count)[0], wholes[verb])


def test_a_merge_holds_few_matrices_at_a_time(
    records: Path, wholes: dict[str, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Here groups are of a kilobyte, and matrices have several blocks: neither changes a value."""
    held: list[list[int]] = []

    def counted(dataset: xr.Dataset, *where: Any, **origin: Any) -> None:
        matrices = (one for one in dataset.values() if {"record", "structure"} <= {*one.dims})
        held.append([one.nbytes for one in matrices])
        writing.put(dataset, *where, **origin)

    monkeypatch.setattr(merging, "_GROUP", 1000)
    monkeypatch.setattr(merging, "put", counted)
    monkeypatch.setattr(writing, "_ONE_BLOCK", 0)
    monkeypatch.setattr(writing, "CHUNK", 4)
    merged, _ = in_batches("respond", records, 2)
    assert len(held) > 5
    assert all(0 < sum(sizes) <= 1000 or len(sizes) == 1 for sizes in held)
    # no group is written before the next matrix would not fit, since each reads all batches
    assert all(sum(one) + other[0] > 1000 for one, other in pairwise(held))
    equal(merged, wholes["respond"])
    with netCDF4.Dataset(merged) as file:
        assert file["peak_u"].shape == (6, 2)
        assert file["peak_u"].chunking() == [2, 2]


def test_a_table_is_written_in_blocks_of_records(
    records: Path, wholes: dict[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A block of one record has the rows that it has among all records, and no row is held."""
    files = records, wholes["pulse"], wholes["respond"]
    rows = list(table_rows_of(*files))
    held: list[Iterable[Any]] = []

    def kept(path: Path, some: Iterable[Any], table_format: str = "") -> int:
        held.append(some)
        return write_rows_as(path, some, table_format)

    monkeypatch.setattr("rockframe.results.tables.rows._RECORDS", 1)
    monkeypatch.setattr("rockframe.stages.table.write_rows_as", kept)
    assert table_stage(*files, tmp_path / "table.csv") == len(rows)
    assert not isinstance(held[0], Sequence)
    np.testing.assert_equal(held[1], summary_rows(rows, recordings_of(records)))
    write_rows_as(tmp_path / "at-once.csv", rows)
    assert (tmp_path / "table.csv").read_bytes() == (tmp_path / "at-once.csv").read_bytes()


def test_without_histories_the_verdicts_are_the_same(
    records: Path, wholes: dict[str, Path]
) -> None:
    whole = wholes["respond"]
    merged, _ = in_batches("respond", records, 3, "--histories", "none")
    for row, other in zip(response_rows(merged), response_rows(whole), strict=True):
        assert row == {
            name: pytest.approx(value, rel=1e-9, nan_ok=True) if isinstance(value, float) else value
            for name, value in other.items()
        }
    with open_response(merged) as response, pytest.raises(ValueError, match="no history of"):
        response.sel(record=response.records[0], structure="slender")


def test_what_no_batch_could_do_is_said(records: Path) -> None:
    """No record is long enough for these periods: each batch is empty, so merging fails."""
    parts = [records.with_name(f"none-{k}.nc") for k in (1, 2)]
    for k, part in enumerate(parts, 1):
        words = ("--periods", "500", "900", "--batch", f"{k}/2")
        assert run("pulse", records, *words, "--output", part) == 1
        assert best_pulses(part) == {}
    with pytest.raises(InputError, match="no batch contains a record: Invalid range of periods"):
        merge_stage(parts, records.with_name("none.nc"))


def test_batches_of_other_options_are_refused(records: Path) -> None:
    parts = [records.with_name(f"odd-{k}.nc") for k in (1, 2)]
    few = ("--surrogates", 0, "--output")
    assert run("pulse", records, "--batch", "1/2", *few, parts[0]) == 0
    words = ("--periods", "0.3", "4", "--batch", "2/2")
    assert run("pulse", records, *words, *few, parts[1]) == 0
    with pytest.raises(InputError, match="not the parameters of"):
        merge(parts, records.with_name("odd.nc"), "pulses")


@pytest.mark.parametrize("batch", ["0/2", "3/2", "2", "a/b", "1/0"])
def test_a_batch_that_is_none_is_refused(
    records: Path, batch: str, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ("--batch", batch, "--output", records.with_name("no.nc"))
    try:
        status = run("pulse", records, *words)
    except SystemExit as end:  # argparse exits this way
        status = int(str(end.code))
    assert status == 2
    assert "Invalid batch" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("order", "wanted"), [((1, 3), "1/2"), ((2, 1, 3), "1/3"), ((1, 1, 2), "2/3")]
)
def test_batch_that_is_missing_or_not_in_its_place_is_said(
    records: Path, order: tuple[int, ...], wanted: str
) -> None:
    """A merge without the missing batch would silently lose its records."""
    parts = []
    for k in (1, 2, 3):
        part = records.with_name(f"apart-{k}.nc")
        words = ("--batch", f"{k}/3", "--output", part, "--surrogates", 0, "--runners-up", 0)
        assert part.exists() or run("pulse", records, *words) == 0
        parts.append(part)
    output = records.with_name("apart.nc")
    with pytest.raises(InputError, match=f"Must be batch {wanted}"):
        merge_stage([parts[k - 1] for k in order], output)
    assert not output.exists()


def test_table_of_responses_to_other_records_is_refused(
    wholes: dict[str, Path],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    few, table = stored(three("a"), tmp_path), tmp_path / "table.csv"
    assert run("table", few, wholes["pulse"], wholes["respond"], "--output", table) == 2
    assert f"which {few} does not. Must be of the same records." in capsys.readouterr().err
    assert not table.exists()
