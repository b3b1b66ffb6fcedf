"""Stages run in batches: the index of their files opens as the file of one run over all records."""

from __future__ import annotations

import json
import pickle
import shutil
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import netCDF4
import numpy as np
import pytest
import xarray as xr
from tests.screening import sine, site, stored, structures, three

from rockframe.cli.main import main
from rockframe.engines.engine import OneProcess
from rockframe.errors import InputError, ParameterError
from rockframe.options.respond import RespondOptions, ScreenOptions
from rockframe.results.contents import describe
from rockframe.results.pulses import best_pulses, recordings_of
from rockframe.results.response import open_response
from rockframe.results.shards import OpenShards, opened_arrays, shards_of
from rockframe.results.stored import alone, open_netcdf, opened_one
from rockframe.results.tables.entries import write_rows_as
from rockframe.results.tables.summary import summary_rows
from rockframe.results.tables.table import response_rows
from rockframe.results.writing import write_index
from rockframe.stages.common import Batch
from rockframe.stages.respond import respond_stage
from rockframe.stages.screen import screen_stage
from rockframe.stages.table import index_stage, table_rows_of, table_stage

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
    """Run a command in batches; return the index and the files of the batches."""
    folder = records.parent / f"{verb}-{count}"
    parts = [folder / f"{k}.nc" for k in range(1, count + 1)]
    for k, part in enumerate(parts, 1):
        batch = ("--batch", f"{k}/{count}", "--output", part)
        if not part.exists():
            run(verb, records, *batch, *options(verb, records), *words)
    index = folder / f"{VERBS[verb]}.nc"
    index_stage(parts, index)
    return index, parts


def equal(one: Path, other: Path) -> None:
    """Assert that all variables and attributes are equal, to the last bit."""
    with opened_as_one(one) as index, opened_as_one(other) as whole:
        attrs = dict(index.attrs)
        assert len(shards_of(attrs)) > 1
        assert {name: value for name, value in attrs.items() if name != "shards"} == whole.attrs
        assert list(index.variables) == list(whole.variables)
        xr.testing.assert_identical(index.assign_attrs(shards=""), whole.assign_attrs(shards=""))


def opened_as_one(path: Path) -> xr.Dataset:
    return xr.open_dataset(path, engine="rockframe")


@pytest.mark.parametrize("verb", VERBS)
@pytest.mark.parametrize("count", [2, 7])  # one batch of 7 is empty: there are six records
def test_batches_together_are_the_whole(
    records: Path, wholes: dict[str, Path], verb: str, count: int
) -> None:
    equal(in_batches(verb, records, count)[0], wholes[verb])


def test_only_the_shards_that_have_the_wanted_records_are_opened(
    records: Path, wholes: dict[str, Path], tmp_path: Path
) -> None:
    """So one record of a large run is shown as quickly as one of a small run."""
    index, parts = in_batches("respond", records, 2)
    folder = tmp_path / "copy"
    shutil.copytree(index.parent, folder)
    rows = (slice(1, 5), [5, 0, 3], slice(None, None, -5), -2, slice(3, 3))
    in_first = (slice(0, 2), [2, 0], 1)
    with opened_as_one(wholes["respond"]) as whole:
        peaks = whole["peak_u"].load()
    with opened_as_one(folder / index.name) as joined:
        for some in rows:
            xr.testing.assert_identical(joined["peak_u"].isel(record=some), peaks.isel(record=some))
    (folder / parts[1].name).unlink()
    with opened_as_one(folder / index.name) as joined:
        for some in in_first:
            xr.testing.assert_identical(joined["peak_u"].isel(record=some), peaks.isel(record=some))
        with pytest.raises(InputError, match=r"2.nc: missing: response.nc names it as batch 2 of"):
            joined["peak_u"].isel(record=4).compute()
    with pytest.raises(InputError, match=r"2.nc: missing"):
        describe(folder / index.name, "response")


def test_few_shards_are_open_while_an_index_is_read_from_end_to_end(records: Path) -> None:
    """NetCDF keeps 3 MB for each open file, so that a thousand shards would fill the memory."""
    index, _ = in_batches("pulse", records, 7)
    with open_netcdf(index) as file:
        attrs = {name: file.getncattr(name) for name in file.ncattrs()}
    shards = OpenShards(index, "pulses", attrs, alone)
    most = 0
    for together in (1, 1, 3):
        for number in range(len(shards.all)):
            shards.variables(number, together)
            most = max(most, len(shards))
        assert most == max(2, together)
    shards.close()
    assert len(shards) == 0


def test_a_shard_stays_open_for_each_thread_that_reads(records: Path) -> None:
    """Each thread of Dask reads its own shard, one variable after the other."""
    index, _ = in_batches("pulse", records, 7)
    with open_netcdf(index) as file:
        attrs = {name: file.getncattr(name) for name in file.ncattrs()}
    shards = OpenShards(index, "pulses", attrs, alone)
    with ExitStack() as stack:
        threads = [stack.enter_context(ThreadPoolExecutor(1)) for _ in range(3)]
        first, second = (
            [thread.submit(shards.variables, k).result() for k, thread in enumerate(threads)]
            for _ in range(2)
        )
    assert all(before is after for before, after in zip(first, second, strict=True))
    shards.close()


def test_a_shard_is_not_opened_again_for_each_small_variable(
    records: Path, wholes: dict[str, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    """If more are read together than may be open, their small variables are kept."""
    index, _ = in_batches("respond", records, 7)
    monkeypatch.setattr("rockframe.results.shards._MOST_OPEN", 2**22)  # one shard and its file
    opened: list[Path] = []

    def counted(path: Path, *arguments: Any, **named: Any) -> Any:
        opened.append(path)
        return opened_one(path, *arguments, **named)

    monkeypatch.setattr("rockframe.results.shards.opened_one", counted)
    with (
        opened_arrays(index, "response") as joined,
        opened_arrays(wholes["respond"], "response") as whole,
    ):
        for name, variable in whole.without("obs").variables.items():
            np.testing.assert_array_equal(joined[name].values, variable.values)
    # the index and the whole file, the shards once, and again the two that were still open
    assert len(opened) <= 2 + 6 + 2


def test_no_large_variable_of_a_closed_shard_displaces_small_ones(records: Path) -> None:
    """Verdicts were read to be checked; those of a hundred shards would fill what is kept."""
    index, _ = in_batches("pulse", records, 7)
    with open_netcdf(index) as file:
        attrs = {name: file.getncattr(name) for name in file.ncattrs()}
    shards = OpenShards(index, "pulses", attrs, alone)
    few, many = np.zeros(2), np.zeros((2, 2**14), dtype=np.int8)
    read = {
        name: SimpleNamespace(
            values=values, bytes=values.nbytes, along_records=along, is_read=True, dims=()
        )
        for name, values, along in (("a_p", few, 0), ("verdict", many, 0), ("height", few, None))
    }
    shards.keep_small(0, cast("Any", read))
    assert shards.small_values(0, "a_p") is few
    read["verdict"].bytes = 2**17
    shards.keep_small(1, cast("Any", read))
    kept = [[shards.small_values(k, name) is None for name in read] for k in (0, 1)]
    assert kept == [[False, False, True], [False, True, True]]


def test_shards_are_the_chunks_of_dask(records: Path, wholes: dict[str, Path]) -> None:
    dask = pytest.importorskip("dask")
    index, _ = in_batches("respond", records, 7)
    lazy = xr.open_dataset(index, engine="rockframe", chunks={})
    with lazy, opened_as_one(wholes["respond"]) as whole:
        assert lazy.chunks["record"] == (1,) * 6
        with dask.config.set(scheduler="threads"):
            xr.testing.assert_identical(lazy["peak_u"].compute(), whole["peak_u"].load())
            # as the worker of another process gets it
            mean = pickle.loads(pickle.dumps(lazy["u"])).mean().compute()  # noqa: S301
        assert float(mean) == pytest.approx(float(whole["u"].mean()))


def test_an_index_without_histories_is_one_of_dask_too(records: Path) -> None:
    pytest.importorskip("dask")
    folder = records.with_name("no-histories")
    parts = [folder / f"{k}.nc" for k in (1, 2)]
    words = ("--histories", "none", *options("respond", records))
    for k, part in enumerate(parts, 1):
        assert run("respond", records, *words, "--batch", f"{k}/2", "--output", part) == 0
    index_stage(parts, folder / "response.nc")
    with xr.open_dataset(folder / "response.nc", engine="rockframe", chunks={}) as lazy:
        assert lazy.chunks["record"] == (3, 3)
        assert np.isfinite(lazy["peak_u"].max().compute())


def test_values_that_were_not_read_can_be_sent_to_another_process(wholes: dict[str, Path]) -> None:
    with opened_as_one(wholes["respond"]) as whole:
        sent = pickle.loads(pickle.dumps(whole["u"]))  # noqa: S301
    with opened_as_one(wholes["respond"]) as whole:
        xr.testing.assert_identical(sent.load(), whole["u"].load())


def _swap(folder: Path) -> None:
    shutil.copyfile(folder / "1.nc", folder / "3.nc")


def _cut(folder: Path) -> None:
    content = (folder / "3.nc").read_bytes()
    (folder / "3.nc").write_bytes(content[: len(content) // 2])


def _of_other_options(folder: Path) -> None:
    with netCDF4.Dataset(folder / "3.nc", "a") as file:
        file.parameters = '{"surrogates": 5}'


def _with_fewer_records(folder: Path) -> None:
    words = ("--batch", "3/3", "--output", folder / "3.nc", "--surrogates", 19)
    with netCDF4.Dataset(folder / "3.nc") as file:
        parameters = file.parameters
    (few := folder / "few").mkdir()
    run("pulse", stored(three("a"), few), *words)
    with netCDF4.Dataset(folder / "3.nc", "a") as file:
        file.parameters = parameters


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (_swap, r"3.nc: is batch 1/3 of 2 records. Must be batch 3/3 of 2, as pulses.nc says"),
        (_cut, r"3.nc: cannot be read as netCDF|3.nc: is corrupted"),
        (_of_other_options, r"3.nc: not the parameters of .*pulses.nc. Must be batches of one run"),
        (_with_fewer_records, r"3.nc: not the input_sha256 of"),
    ],
)
def test_a_damaged_shard_is_named(
    records: Path, tmp_path: Path, damage: Callable[[Path], None], said: str
) -> None:
    index, _ = in_batches("pulse", records, 3)
    folder = Path(shutil.copytree(index.parent, tmp_path / "copy"))
    damage(folder)
    with opened_as_one(folder / index.name) as joined, pytest.raises(InputError, match=said):
        joined.load()


@pytest.mark.parametrize(
    "shards", ["half", '{"a": 1}', "[]", '[["3.nc"]]', '[["3.nc", "", "2", 0]]', "[3]"]
)
def test_a_damaged_index_is_named(records: Path, tmp_path: Path, shards: str) -> None:
    index, _ = in_batches("pulse", records, 3)
    damaged = Path(shutil.copy(index, tmp_path / "pulses.nc"))
    with netCDF4.Dataset(damaged, "a") as file:
        file.shards = shards
    for read in (opened_as_one, lambda path: describe(path, "pulses")):
        with pytest.raises(InputError, match=r"pulses.nc: .*'shards' that (can|does not)"):
            read(damaged)


def test_an_index_of_other_records_than_its_shards_is_refused(
    records: Path, tmp_path: Path
) -> None:
    index, _ = in_batches("pulse", records, 3)
    damaged = Path(shutil.copy(index, tmp_path / "pulses.nc"))
    with netCDF4.Dataset(damaged, "a") as file:
        file.shards = json.dumps(json.loads(file.shards)[:2])
    with pytest.raises(InputError, match=r"pulses.nc: names shards of other records than its own"):
        opened_as_one(damaged)


def test_a_record_in_two_shards_is_refused(records: Path, tmp_path: Path) -> None:
    index, _ = in_batches("pulse", records, 3)
    folder = Path(shutil.copytree(index.parent, tmp_path / "copy"))
    shutil.copyfile(folder / "1.nc", folder / "2.nc")
    with netCDF4.Dataset(folder / "2.nc", "a") as file:
        file.batch = "2/3"
    with pytest.raises(InputError, match=r"pulses.nc: is an index of batches. Must be the file of"):
        index_stage([index], folder / "twice.nc")
    with pytest.raises(ParameterError, match="No batches named"):
        index_stage([], folder / "twice.nc")
    with pytest.raises(InputError, match=r"is in two batches. Must be in one"):
        write_index([folder / f"{k}.nc" for k in (1, 2, 3)], folder / "twice.nc", "pulses")
    assert not (folder / "twice.nc").exists()


def test_a_table_is_written_in_blocks_of_records(
    records: Path, wholes: dict[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Blocks of one record, each made by a task of its own, give the rows and the summary of all
    records at once.
    """
    files = records, wholes["pulse"], wholes["respond"]
    rows = list(table_rows_of(*files))
    tasks: list[object] = []

    class Counting(OneProcess):
        def map(self, function: Any, tasks_of: Any) -> Any:
            for task in tasks_of:
                tasks.append(pickle.dumps(task))
                result = function(task)
                assert pickle.dumps(result)
                yield result

    monkeypatch.setattr("rockframe.results.tables.rows._RECORDS", 1)
    count = table_stage(*files, tmp_path / "table.csv", engine=Counting())
    assert count == len(rows) > len(tasks) == 6
    write_rows_as(tmp_path / "at-once.csv", rows)
    assert (tmp_path / "table.csv").read_bytes() == (tmp_path / "at-once.csv").read_bytes()
    summary = summary_rows(rows, recordings_of(records))
    write_rows_as(tmp_path / "summary-at-once.csv", summary)
    at_once = (tmp_path / "summary-at-once.csv").read_bytes()
    assert (tmp_path / "summary.csv").read_bytes() == at_once


@pytest.mark.filterwarnings("ignore:The inplace keyword")  # of Dask with a newer pandas
def test_a_parquet_table_is_written_in_groups_of_rows(
    records: Path, wholes: dict[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A column that is empty in the first rows may have texts later; other programs read them."""
    parquet = pytest.importorskip("pyarrow.parquet")
    pandas = pytest.importorskip("pandas")
    rows = list(table_rows_of(records, wholes["pulse"], wholes["respond"]))
    rows = [{**row, "remark": None if k < 6 else "late"} for k, row in enumerate(rows)]
    write_rows_as(tmp_path / "whole.parquet", rows)
    monkeypatch.setattr("rockframe.results.tables.entries._ROW_GROUP", 5)
    assert write_rows_as(tmp_path / "groups.parquet", iter(rows)) == len(rows) == 12
    whole, groups = (pandas.read_parquet(tmp_path / f"{n}.parquet") for n in ("whole", "groups"))
    pandas.testing.assert_frame_equal(whole, groups)
    assert parquet.ParquetFile(tmp_path / "groups.parquet").num_row_groups == 3
    assert groups["peak_u_m"].tolist() == [row["peak_u_m"] for row in rows]
    changing = [{**row, "impacts": 0.5 if k > 6 else 1} for k, row in enumerate(rows)]
    with pytest.raises(InputError, match=r"other.parquet: .* after row 5. Write CSV instead"):
        write_rows_as(tmp_path / "other.parquet", changing)
    assert not (tmp_path / "other.parquet").exists()
    frames = pytest.importorskip("dask.dataframe")
    mean = frames.read_parquet(tmp_path / "groups.parquet")["peak_u_m"].mean().compute()
    assert mean == pytest.approx(groups["peak_u_m"].mean())


def test_duckdb_reads_the_parquet_table(
    records: Path, wholes: dict[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A query over the groups of rows gives what the rows give; blank texts are NULL."""
    duckdb = pytest.importorskip("duckdb", reason="needs DuckDB, of the extra bench")
    pytest.importorskip("pyarrow", reason="needs the extra tables")
    rows = list(table_rows_of(records, wholes["pulse"], wholes["respond"]))
    rows = [{**row, "remark": None if k < 6 else "late"} for k, row in enumerate(rows)]
    monkeypatch.setattr("rockframe.results.tables.entries._ROW_GROUP", 5)
    path = tmp_path / "table.parquet"
    write_rows_as(path, iter(rows))
    table = duckdb.read_parquet(str(path))
    names = ("record", "peak_u_m", "remark")
    chosen = table.project(", ".join(names)).fetchall()
    assert chosen == [tuple(row[name] for name in names) for row in rows]
    largest = table.aggregate("structure, max(peak_u_m), count(remark)", "structure").fetchall()
    assert {name: found for name, *found in largest} == {
        name: [
            max(row["peak_u_m"] for row in rows if row["structure"] == name),
            sum(row["remark"] is not None for row in rows if row["structure"] == name),
        ]
        for name in {row["structure"] for row in rows}
    }


def test_without_histories_the_verdicts_are_the_same(
    records: Path, wholes: dict[str, Path]
) -> None:
    whole = wholes["respond"]
    index, _ = in_batches("respond", records, 3, "--histories", "none")
    for row, other in zip(response_rows(index), response_rows(whole), strict=True):
        assert row == {
            name: pytest.approx(value, rel=1e-9, nan_ok=True) if isinstance(value, float) else value
            for name, value in other.items()
        }
    with open_response(index) as response, pytest.raises(ValueError, match="no history of"):
        response.sel(record=response.records[0], structure="slender")


def test_what_no_batch_could_do_is_said(records: Path) -> None:
    """No record is long enough for these periods: each batch is empty, and so is the index."""
    parts = [records.with_name(f"none-{k}.nc") for k in (1, 2)]
    for k, part in enumerate(parts, 1):
        words = ("--periods", "500", "900", "--batch", f"{k}/2")
        assert run("pulse", records, *words, "--output", part) == 1
        assert best_pulses(part) == {}
    with pytest.raises(
        InputError, match="no batch contains a record; 'a-e': Invalid range of periods"
    ):
        index_stage(parts, records.with_name("none.nc"))


def test_a_batch_of_rejected_records_has_an_empty_table(
    records: Path, wholes: dict[str, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    """The two records of the second batch have no vertical."""
    words = ("--vertical", "--batch", "2/3", *options("respond", records))
    part = records.with_name("no-vertical.nc")
    assert run("respond", records, *words, "--output", part) == 1
    assert "no vertical" in capsys.readouterr().err
    table = part.with_suffix(".csv")
    assert table_stage(records, wholes["pulse"], part, table) == 0
    assert table.read_bytes() == b""


def test_batches_of_other_options_are_refused(records: Path) -> None:
    parts = [records.with_name(f"odd-{k}.nc") for k in (1, 2)]
    few = ("--surrogates", 0, "--output")
    assert run("pulse", records, "--batch", "1/2", *few, parts[0]) == 0
    words = ("--periods", "0.3", "4", "--batch", "2/2")
    assert run("pulse", records, *words, *few, parts[1]) == 0
    with pytest.raises(InputError, match="not the parameters of"):
        write_index(parts, records.with_name("odd.nc"), "pulses")


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


def test_a_batch_reads_the_pulses_of_its_records_alone(records: Path, tmp_path: Path) -> None:
    """Otherwise a thousand batches would read the pulses of all records a thousand times."""
    index, parts = in_batches("pulse", records, 2)
    pulses, kinds = tmp_path / "pulses.nc", structures(tmp_path)
    shutil.copy(parts[0], tmp_path / "1.nc")
    shutil.copy(parts[1], tmp_path / "2.nc")
    shutil.copy(index, pulses)
    (tmp_path / "2.nc").unlink()
    given: dict[str, Any] = {
        "structures_path": kinds,
        "pulses_path": pulses,
        "engine": OneProcess(),
    }
    for number in (1, 2):
        for stage, name, some in (
            (respond_stage, "response", RespondOptions(histories="none", margins="none")),
            (screen_stage, "screen", ScreenOptions(scales=(1.0,), margins="none")),
        ):
            output = tmp_path / f"{name}-{number}.nc"
            call = partial(stage, records, output, some, batch=Batch(number, 2), **given)  # type: ignore[arg-type]
            if number == 1:
                call()
            else:
                with pytest.raises(InputError, match=r"2\.nc: missing: pulses\.nc names it"):
                    call()
    others = stored([sine("other", 1.0)], tmp_path)
    with pytest.raises(InputError, match="contains no pulse of these records"):
        respond_stage(others, tmp_path / "none.nc", batch=Batch(1, 2), **given)


@pytest.mark.parametrize(
    ("order", "wanted"), [((1, 3), "1/2"), ((2, 1, 3), "1/3"), ((1, 1, 2), "2/3")]
)
def test_batch_that_is_missing_or_not_in_its_place_is_said(
    records: Path, order: tuple[int, ...], wanted: str
) -> None:
    """An index without the missing batch would silently lose its records."""
    parts = []
    for k in (1, 2, 3):
        part = records.with_name(f"apart-{k}.nc")
        words = ("--batch", f"{k}/3", "--output", part, "--surrogates", 0, "--runners-up", 0)
        assert part.exists() or run("pulse", records, *words) == 0
        parts.append(part)
    output = records.with_name("apart.nc")
    with pytest.raises(InputError, match=f"Must be batch {wanted}"):
        index_stage([parts[k - 1] for k in order], output)
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
