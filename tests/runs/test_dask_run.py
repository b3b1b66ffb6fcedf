"""A run on a Dask cluster, by its address; `make test-dask` installs what it needs."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.runs.small import contents, make_study, run

from rockframe.cli.main import main

distributed = pytest.importorskip("distributed", reason="needs the extra dask: make test-dask")


def test_cluster_gives_the_bytes_of_one_process(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The workers are elsewhere: not in the folder in which the command is typed."""
    study = make_study(tmp_path, 3)
    assert run(study, tmp_path / "here") == 0
    cluster = distributed.LocalCluster(
        n_workers=2, threads_per_worker=2, dashboard_address=":0", silence_logs=50
    )
    monkeypatch.chdir(tmp_path)
    with cluster:
        words = ["run", "small.toml", "--output", "there"]
        assert main([*words, "--scheduler", cluster.scheduler_address]) == 0
    assert contents(tmp_path / "there") == contents(tmp_path / "here")


def test_scheduler_that_is_not_there_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    study = make_study(tmp_path, 1)
    words = ["run", str(study), "--output", str(tmp_path / "run")]
    assert main([*words, "--scheduler", "tcp://127.0.0.1:9"]) == 2
    assert "Must be the address of a running Dask" in capsys.readouterr().err
