"""The respond stage: stored histories, and byte-identical files from all engines."""

from __future__ import annotations

import pickle
from collections.abc import Generator, Iterable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from rockframe.cli.main import main
from rockframe.engines.engine import OneProcess, ProcessPool
from rockframe.errors import ParameterError
from rockframe.options.pulse import PulseOptions
from rockframe.options.respond import Ensemble, RespondOptions
from rockframe.record import Record
from rockframe.results import pulses, records, shards
from rockframe.results.pulses import pulse_rows
from rockframe.results.records import write_records
from rockframe.results.response import open_response
from rockframe.results.schema.arrays import Arrays
from rockframe.results.tables import table
from rockframe.results.tables.table import response_rows
from rockframe.stages.common import Batch
from rockframe.stages.pulse import pulse_stage
from rockframe.stages.respond import respond_stage


@pytest.fixture(scope="module")
def records_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file of sines of increasing amplitude; shipped structures stand or overturn."""
    path = tmp_path_factory.mktemp("sines") / "records.nc"
    time = 0.01 * np.arange(600)
    records = (
        Record(
            record_id=f"sine-{n}", acceleration=0.8 * n * np.sin(2.0 * np.pi * time), time_step=0.01
        )
        for n in (1, 2, 4, 6, 9, 12)
    )
    made = ((record, None) for record in records)
    write_records(made, path, input_sha256={}, parameters={})
    return path


#: Without margins, and with the smallest ensemble.
PLAIN = RespondOptions(margins="none", ensemble=Ensemble(members=16))


@pytest.fixture(scope="module")
def all_file(records_file: Path) -> Path:
    """The responses to all records, with all histories."""
    path = records_file.with_name("all.nc")
    respond_stage(records_file, path, PLAIN, engine=OneProcess())
    return path


@pytest.fixture(scope="module")
def some_file(records_file: Path) -> Path:
    """The responses to all records, with selected histories."""
    path = records_file.with_name("some.nc")
    respond_stage(records_file, path, PLAIN.replaced(histories="selected"))
    return path


def test_what_was_written_has_the_rows_of_the_file(records_file: Path, tmp_path: Path) -> None:
    """Commands print these rows: the file is not read again, so both must agree to the last bit."""
    written: list[Arrays] = []
    matched, response = tmp_path / "pulses.nc", tmp_path / "response.nc"
    part = Batch(2, 3)  # two of the six records
    wanted = PulseOptions(surrogates=0, runners_up=1)
    pulse_stage(records_file, matched, wanted, batch=part, written=written.append)
    options = PLAIN.replaced(margins="robust", structure="bridge-bent")
    respond_stage(
        *(records_file, response, options),
        pulses_path=matched,
        batch=part,
        written=written.append,
    )
    assert len(found := pulse_rows(written[0])) > 2
    assert str(found) == str(pulse_rows(matched))
    rows = list(response_rows(written[1]))
    assert len({row["record_id"] for row in rows}) == 2
    assert str(rows) == str(list(response_rows(response)))


def test_workers_return_what_is_written(records_file: Path, tmp_path: Path) -> None:
    """Arrays are a few kB; responses would have their frames and ensembles with them."""
    sent: list[bytes] = []

    class Noting(OneProcess):
        def map(self, function: Any, batches: Iterable[Any]) -> Generator[Any, None, None]:
            for result in super().map(function, batches):
                sent.append(pickle.dumps(result))
                yield result

    options = RespondOptions(histories="none", margins="none")
    part = Batch(2, 3)
    respond_stage(records_file, tmp_path / "r.nc", options, batch=part, engine=Noting())
    assert not any(b"rocking.response" in one or b"rockframe.frame" in one for one in sent)
    assert 0 < sum(map(len, sent)) < 2 * 20_000


def test_commands_print_rows_without_opening_what_they_wrote(
    records_file: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    opened: list[Path] = []
    whole = shards.opened_arrays

    def noted(path: Path, kind: str, **options: bool) -> AbstractContextManager[Arrays]:
        opened.append(path)
        return whole(path, kind, **options)

    for module in (records, pulses, table):
        monkeypatch.setattr(module, "opened_arrays", noted)
    for command, words in (("pulse", ["--surrogates", "0"]), ("respond", ["--margins", "none"])):
        output = tmp_path / f"{command}.nc"
        argv = [command, str(records_file), "--output", str(output), "--batch", "1/6", *words]
        assert main(argv) == 0
        assert "sine-1" in capsys.readouterr().out
    assert set(opened) == {records_file}


def test_engines_write_the_same_bytes(
    records_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A worker computes the second of two batches, with histories, ensembles and robust margins."""
    monkeypatch.setattr("rockframe.stages.respond._NODES", 2000)
    options = PLAIN.replaced(structure="bridge-bent", margins="robust")
    files = set()
    for engine in (OneProcess(), ProcessPool(2, patience=1e-9)):
        path = tmp_path / "response.nc"
        assert respond_stage(records_file, path, options, engine=engine) == ()
        files.add(path.read_bytes())
    assert len(files) == 1


def equal_but_for_histories(one: Path, other: Path) -> bool:
    names = ("verdict", "peak_rotation_ratio", "peak_u", "impacts", "overturning_time")
    with open_response(one) as full, open_response(other) as some:
        return bool(full.dataset[[*names]].equals(some.dataset[[*names]]))


def test_verdicts_are_the_same_whatever_is_kept(
    records_file: Path, all_file: Path, some_file: Path, tmp_path: Path
) -> None:
    none_file = tmp_path / "none.nc"
    respond_stage(records_file, none_file, PLAIN.replaced(histories="none"))
    assert equal_but_for_histories(all_file, some_file)
    assert_agree_but_for_histories(all_file, none_file)


def assert_agree_but_for_histories(one: Path, other: Path) -> None:
    """Without histories the vectorised kernel computes the responses: equal up to round-off."""
    with xr.open_dataset(one) as first, xr.open_dataset(other) as second:
        kept = {"time", "theta", "u", "v", "history", "row_size"}
        names = {str(name) for name in first.variables} - kept
        for name in sorted(names):
            mine, theirs = first[name].values, second[name].values
            if mine.dtype.kind == "f":
                np.testing.assert_allclose(theirs, mine, rtol=0, atol=5e-10, err_msg=name)
            else:
                assert (mine == theirs).all(), name


def test_selected_histories_are_those_that_overturn_or_come_near(
    all_file: Path, some_file: Path
) -> None:
    with open_response(all_file) as full, open_response(some_file) as some:
        near = full.dataset["peak_rotation_ratio"].values >= 0.5
        kept = some.dataset["history"].values == 1
        np.testing.assert_array_equal(kept, near)
        assert 3 < kept.sum() < kept.size
        for i, k in np.argwhere(kept)[::3]:
            where = {"record": full.records[i], "structure": full.structures[k]}
            for name in ("time", "theta", "u", "v"):
                expected = full.sel(**where)[name].values
                np.testing.assert_array_equal(some.sel(**where)[name].values, expected)


def test_history_that_was_not_kept_is_refused(records_file: Path, tmp_path: Path) -> None:
    path = tmp_path / "response.nc"
    respond_stage(records_file, path, options=RespondOptions(histories="none", margins="none"))
    with (
        open_response(path) as response,
        pytest.raises(ParameterError, match=r"no history of 'bridge-bent' under 'sine-1' was kept"),
    ):
        response.sel(record="sine-1", structure="bridge-bent")


def test_command_without_histories(records_file: Path, tmp_path: Path) -> None:
    output = tmp_path / "response.nc"
    words = [
        "--histories",
        "none",
        "--workers",
        "1",
        "--structure",
        "bridge-bent",
        "--margins",
        "none",
    ]
    assert main(["respond", str(records_file), "--output", str(output), *words]) == 0
    with open_response(output) as response:
        assert response.dataset.sizes["obs"] == 0


def test_scheduler_that_is_not_there(
    records_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "response.nc"
    words = ["--output", str(output), "--scheduler", "tcp://127.0.0.1:1"]
    assert main(["respond", str(records_file), *words]) == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert "refused" in told or "Dask is not installed" in told
    assert not list(tmp_path.iterdir())
