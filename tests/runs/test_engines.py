"""Any engine gets each step of a run that computes, and gives the same bytes."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import Any, Final

import pytest
from tests.runs.small import FEW, contents, make_study, run

from rockframe.engines.engine import Engine, OneProcess, ProcessPool, Resources
from rockframe.options import STAGES
from rockframe.options.pulse import PulseOptions
from rockframe.runs.performing import _parallel_work, perform, unreported
from rockframe.runs.plan import make_plan, waves
from rockframe.runs.run import run_plan
from rockframe.stages.common import Batch
from rockframe.stages.pulse import pulse_stage
from rockframe.study.study import read_study

#: Options of all stages, at their smallest; a column alone cannot be compared.
_STAGES: Final = """
[screen]
scales = [1.0]
margins = "none"
[spectrum]
wavelet = ["symmetric_ricker"]
slenderness_degree = [10.0]
frequency_ratio = [2.0]
amplitude_step = 0.5
[rocking_spectrum]
slenderness_degree = [10.0]
column_period_s = [3.0]
[compare.isolated]
strength_ratio = 0.05
period_s = 3.0
"""
EVERY: Final = (
    FEW[: FEW.rindex("[[structure]]")]
    .replace("[figures]", f"{_STAGES}[figures]")
    .replace("records = 9", "records = 1")
)
APART: Final = Resources(shares_folder=False)


@dataclass(frozen=True)
class Noting:
    """An engine of one's own, whose workers cannot open files; it notes the tasks that arrive."""

    executor: Executor
    resources: Resources = APART
    tasks: list[Any] = field(default_factory=list)

    def map(self, function: Callable[..., Any], tasks: Iterable[Any]) -> Iterator[Any]:
        self.tasks.extend(given := list(tasks))
        return self.executor.map(function, given)


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a study of all stages, and its run in one process in `here`."""
    home = tmp_path_factory.mktemp("engines")
    assert run(make_study(home, 2, EVERY), home / "here") == 0
    return home


def test_an_executor_of_python_gets_every_step(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its workers are threads, in which a step could open no file: each step has a process."""
    study, tasks = make_study(tmp_path, 2, FEW), list[Any]()
    assert run(study, tmp_path / "here") == 0
    plan = make_plan(read_study(study), tmp_path / "there")
    with ThreadPoolExecutor(2) as executor:
        submit = executor.submit

        def note(function: Callable[..., Any], task: Any) -> Future[Any]:
            tasks.append(task)
            return submit(function, task)

        monkeypatch.setattr(executor, "submit", note)
        run_plan(plan, tmp_path / "there", engine=executor)
    assert [work.step for work in tasks] == list(chain.from_iterable(waves(plan.steps)))
    assert contents(tmp_path / "there") == contents(tmp_path / "here")


def test_of_a_large_run_others_perform_what_needs_memory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its process loads no kernels and opens no shards. Small runs, and runs that have one process,
    perform all steps themselves.
    """
    text = FEW.replace("records = 9", "records = 1")
    plan = make_plan(read_study(make_study(tmp_path, 2, text)), tmp_path / "run")

    def outside(engine: Engine) -> list[str]:
        groups = _parallel_work(plan, plan.steps, tmp_path / "run", engine, unreported)
        return [work.step.name for works, how, _ in groups if how is not perform for work in works]

    assert outside(ProcessPool(2)) == []
    monkeypatch.setattr("rockframe.runs.performing._MANY_FILES", 2)
    assert outside(OneProcess()) == []
    batches = {f"{stage}-{k:03d}" for stage in ("pulse", "respond") for k in (1, 2)}
    assert {*batches, "table", "report"} <= {*outside(ProcessPool(2))}
    assert {"ingest", "manifest", "verify"}.isdisjoint(outside(ProcessPool(2)))


def test_an_engine_elsewhere_gets_tasks_of_every_stage(home: Path) -> None:
    """The run performs the steps, because only it can read and write the folder; so it hears of
    the progress of each.
    """
    plan = make_plan(read_study(home / "small.toml"), home / "there")
    counts: dict[str, int] = {}
    reports: dict[str, list[tuple[int, int | None]]] = {}
    with ThreadPoolExecutor(2) as executor:
        engine = Noting(executor)

        def note(name: str, _number: int, _total: int) -> None:
            counts[name] = len(engine.tasks)
            engine.tasks.clear()

        def hear(name: str, done: int, total: int | None) -> None:
            reports.setdefault(name, []).append((done, total))

        run_plan(plan, home / "there", engine=engine, on_step=note, on_progress=hear)
    computing = {step.name: step.stage for step in plan.steps if step.stage in STAGES}
    assert set(computing.values()) == STAGES.keys()
    assert [name for name in computing if not counts[name]] == []
    reporting = {name for name, stage in computing.items() if STAGES[stage].progress}
    for done, total in (reports.pop(name)[-1] for name in reporting):
        assert done == total
    assert reports.pop("ingest motion-0.csv") == [(0, None)]
    assert contents(home / "there") == contents(home / "here")


def test_a_stage_takes_an_executor_of_python(home: Path, tmp_path: Path) -> None:
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=context) as executor:
        options = PulseOptions(surrogates=0)
        given: dict[str, Any] = {"batch": Batch(1, 2), "engine": executor}
        pulse_stage(home / "here" / "records.nc", tmp_path / "pulses.nc", options, **given)
    shard = home / "here" / "shards" / "pulses-001.nc"
    assert (tmp_path / "pulses.nc").read_bytes() == shard.read_bytes()
