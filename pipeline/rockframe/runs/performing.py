"""Perform steps: call their stages on the files of their run. Recompute a run's results."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, Final

from rockframe.engines.choice import choose_engine
from rockframe.engines.engine import Engine, Resources, at_once, map_tasks, resources_of, serve
from rockframe.errors import InputError, RockframeError
from rockframe.interruption import raise_if_interrupted
from rockframe.options import STAGES, Stage, loaded
from rockframe.options.ingest import Filters, IngestOptions
from rockframe.options.model import FigureOptions, ReportOptions
from rockframe.outcome import InputOutcome
from rockframe.provenance import (
    make_folder,
    refuse_obstacles,
    scratch_folder,
    sha256_of,
    staying,
)
from rockframe.runs.plan import KEPT, SHARD_FOLDER, Plan, Step, waves
from rockframe.runs.state import finish, read_plan, remove_partials, stamp
from rockframe.stages.common import Batch
from rockframe.stages.ingest import ingest_stage
from rockframe.stages.ingesting.acceptance import Ingested
from rockframe.stages.ingesting.batches import index_batches, ingest_batch
from rockframe.stages.table import index_stage, shipped_table_stage, table_stage

#: Callback that takes the name of a step under way, the number of its finished parts, and of all.
Report = Callable[[str, int, int | None], None]


def unreported(_name: str, _done: int, _total: int | None) -> None:
    """Ignore the progress within a step."""


@dataclass(frozen=True)
class Work:
    """A step, with the folder and the processes to use.

    Outputs are written into `into`, by default the folder of the run. `workers` is the largest
    number of processes that read files, draw, or compute without a given engine, by default one for
    each core; `origin` is everything that the step depends on. `given` is the engine of the run, if
    the step is performed outside it. `report` is called in this process only.
    """

    step: Step
    folder: Path
    workers: int | None = None
    origin: Mapping[str, Any] = field(default_factory=dict)
    into: Path | None = None
    given: Engine | None = None
    report: Report = unreported

    @property
    def inputs(self) -> list[Path]:
        """Files that the step reads."""
        return [self.folder / name for name in self.step.inputs]

    @property
    def output(self) -> Path:
        """The first file or folder that the step writes."""
        return (self.into or self.folder) / self.step.outputs[0]

    @property
    def batch(self) -> Batch:
        """The batch of the records."""
        return Batch(*self.step.batch)

    @property
    def engine(self) -> Engine:
        """The engine of the step's tasks; on this machine, one batch is computed in one process."""
        if self.given is None or (resources_of(self.given).local and not self.step.workers):
            return choose_engine(self.workers if self.step.workers else 1)
        return self.given


def perform(work: Work) -> int:
    """Perform a step in this process, with a log, and stamp it as done.

    Returns 1 if records were rejected, else 0.

    Raises
    ------
    RockframeError
        If the log cannot be written, or the user must correct something: the log contains the same
        message.
    """
    with staying(work.folder):
        return _perform_there(work)


def _perform_there(work: Work) -> int:
    log = work.folder / "logs" / f"{work.step.name}.log"
    try:
        refuse_obstacles([log])
        make_folder(log.parent)
        log.touch()
    except OSError as error:
        raise InputError(log, f"cannot be written: {error.strerror}.") from None
    try:
        rejections = _rejections(do(work))
        lines = [
            f"rockframe: rejected: {rejection.file}: {rejection.reason}\n"
            for rejection in rejections
        ]
        log.write_text("".join(lines) or "done\n", encoding="utf-8")
    except RockframeError as error:
        # if the disk is full, only the terminal shows the error
        with suppress(OSError):
            log.write_text(f"rockframe: error: {error}\n", encoding="utf-8")
        raise
    stamp(work.step, work.origin, work.folder)
    return 1 if rejections else 0


def perform_apart(work: Work) -> int:
    """Perform a step in a separate process, which ends when the calling process ends.

    The worker of an engine may run several steps in threads. If the worker is killed, another
    worker repeats its steps, so the first attempt must end with the worker.
    """
    [status] = serve(perform, [work], workers=1)
    return status


def perform_outside(run: int, work: Work) -> int:
    """Perform a step in this process, or in a separate one if this is the process of the run.

    What a step has loaded or allocated, such as kernels, a process keeps until it ends.
    """
    return perform_apart(work) if os.getpid() == run else perform(work)


def perform_all(
    plan: Plan,
    todo: Sequence[Step],
    folder: Path,
    engine: Engine | None,
    on_step: Callable[..., None],
    on_progress: Report = unreported,
) -> None:
    """Perform steps of a plan, each after the steps whose outputs it reads.

    Parameters
    ----------
    plan : Plan
        The plan of the run, whose lock must be held.
    todo : sequence of Step
        The steps.
    folder : Path
        The folder of the run.
    engine : Engine, optional
        Gets the steps or their tasks, as rule 9 of `Engine` says; by default a process pool.
    on_step : callable
        Called with the name of each finished step, its number, and the number of all steps.
    on_progress : callable, optional
        Called with the name of a step under way, the number of its finished parts, and of all parts
        (None while that is unknown), unless the step is performed in another process.
    """
    try:
        chosen = choose_engine() if engine is None else engine
        _perform(plan, todo, folder, chosen, on_step, on_progress)
    except BaseException:
        remove_partials(plan, folder)  # workers that ended with this run left partial files
        raise


def _perform(
    plan: Plan,
    todo: Sequence[Step],
    folder: Path,
    engine: Engine,
    on_step: Callable[..., None],
    on_progress: Report,
) -> None:
    done = 0
    for works, how, where in _parallel_work(plan, todo, folder, engine, on_progress):
        raise_if_interrupted()
        names = [work.step.name for work in works]
        for work, _ in zip(works, map_tasks(how, works, engine=where, names=names), strict=True):
            done += 1
            on_step(work.step.name, done, len(todo))
        remove_partials(plan, folder)  # killed workers left partial files


def _parallel_work(
    plan: Plan, todo: Sequence[Step], folder: Path, engine: Engine, report: Report
) -> Iterator[tuple[list[Work], Callable[[Work], int], Engine]]:
    """Yield groups of independent work, the function that performs it, and the engine that calls
    the function.
    """
    here, resources = choose_engine(1), resources_of(engine)
    outside = partial(perform_outside, os.getpid()) if _is_large(plan, resources) else perform
    for wave in waves(plan.steps):
        works = [
            Work(step, folder, resources.workers, plan.origins[step.name])
            for step in wave
            if step in todo
        ]
        if resources.shares_folder and not resources.local:
            yield works, perform_apart, engine
            continue
        batches = [work for work in works if resources.local and not work.step.workers]
        if len(batches) > 1:  # one step needs no worker
            are_long = all(work.step.stage == "ingest" for work in batches)  # a thousand files
            yield batches, outside, at_once(engine) if are_long else engine
            works = [work for work in works if work.step.workers]
        for work in works:
            if outside is not perform and work.step.stage in _OUTSIDE:
                yield [replace(work, given=engine)], outside, here
            else:
                yield [replace(work, given=engine, report=report)], perform, here


#: Number of files that a run in batches reads from which it is large.
_MANY_FILES: Final = 400
#: Steps of a large run, besides batches, that its own process does not perform.
_OUTSIDE: Final = frozenset(["index-ingest", "screen", "table", "report"])


def _is_large(plan: Plan, resources: Resources) -> bool:
    """Return True if other processes of this machine perform steps, so that a run needs 300 MB."""
    batches = max(step.batch[1] for step in plan.steps)
    several = resources.local and resources.workers != 1
    return several and batches > 1 and len(plan.inputs) >= _MANY_FILES


def do(work: Work) -> Any:
    """Perform a step, and return what its function returns."""
    stage = work.step.stage
    return _compute(STAGES[stage], work) if stage in STAGES else _AROUND[stage](work)


def _rejections(done: Any) -> Sequence[InputOutcome]:
    """Return the rejected records: what a stage returns, or what an object of it states."""
    rejections: Sequence[InputOutcome] = getattr(done, "rejections", done) or ()
    return rejections


def _compute(stage: Stage, work: Work) -> Any:
    """Call the function of a stage."""
    options = loaded(stage.options)(**work.step.options)
    shards = [work.folder / name for name in work.step.inputs if name.startswith(SHARD_FOLDER)]
    values: dict[str, Any] = {
        f"{path.stem}_path": path for path in work.inputs if path not in shards
    }
    if shards:
        values["shards"] = shards
    if stage.batches:
        values["batch"] = work.batch
    if stage.engine:
        values["engine"] = work.engine
    if stage.progress:
        values["progress"] = partial(work.report, work.step.name)
    return loaded(stage.function)(output=work.output, options=options, **values)


def _ingest(work: Work) -> Ingested | Sequence[InputOutcome]:
    paths, options, filters = _asked(work)

    def progress(file: str) -> None:
        work.report(f"{work.step.name} {file}", 0, None)

    if work.batch.whole:
        return ingest_stage(
            *(paths, work.output, options),
            filters=filters,
            workers=work.workers,
            progress=progress,
        )
    return ingest_batch(
        *(paths, work.output, options, filters, work.batch),
        workers=1 if work.given is None else work.workers,  # batches are performed side by side
        progress=progress,
    )


def _index_ingest(work: Work) -> Sequence[InputOutcome]:
    again = work.folder / work.step.outputs[-1]
    return index_batches(
        *(work.inputs[1:], work.output, *_asked(work), again),
        progress=lambda file: work.report(f"{work.step.name} {file}", 0, None),
        workers=work.workers,
    )


def _asked(work: Work) -> tuple[list[Path], IngestOptions, Filters]:
    """Return the record files of a run, the options of reading them, and the filters."""
    asked = work.step.options
    paths = [Path(path) for path in asked["paths"]]
    return paths, IngestOptions(**asked["records"]), Filters(**asked["filters"])


def _table(work: Work) -> None:
    records, pulses, response = work.inputs
    table_stage(records, pulses, response, work.output, engine=work.engine)


def _table1(work: Work) -> None:
    records, pulses, response, _ = work.inputs
    shipped_table_stage(records, pulses, response, work.output.parent, **work.step.options)


def _paper(work: Work) -> None:
    from rockframe.stages.named_figures.paper import paper_stage  # it draws

    records, pulses, response = work.inputs
    paper_stage(records, pulses, response, work.output.parent, **work.step.options)


def _draw(work: Work) -> None:
    from rockframe.stages.figures import figures_stage  # workers that compute draw nothing

    options = FigureOptions(**work.step.options)
    progress = partial(work.report, work.step.name)
    figures_stage(work.inputs, work.output, options, progress=progress, workers=work.workers)


def _manifest(work: Work) -> None:
    finish(work.folder)


def _report(work: Work) -> None:
    from rockframe.stages.report import report_stage

    report_stage(work.folder, work.output, ReportOptions(**work.step.options), verified=True)


def _verify(work: Work) -> None:
    from rockframe.stages.report import require_whole

    require_whole(work.folder, work.workers)


#: Functions of the steps around the stages that compute: they read, index, show and check.
_AROUND: Final[dict[str, Callable[..., Any]]] = {
    "ingest": _ingest,
    "index-ingest": _index_ingest,
    "index": lambda work: index_stage(work.inputs, work.output),
    "table": _table,
    "table1": _table1,
    "paper": _paper,
    "draw": _draw,
    "manifest": _manifest,
    "report": _report,
    "verify": _verify,
}


def recompute(folder: Path, sample: int) -> tuple[list[str], list[str]]:
    """Recompute steps of a run in a temporary folder, and compare the results.

    Parameters
    ----------
    folder : Path
        The folder of the run of a study.
    sample : int
        Approximate number of records for each stage.

    Returns
    -------
    list of str, list of str
        The recomputed results, and the differences.
    """
    if not (folder / KEPT / "plan.json").is_file():
        return [], [f"{folder}: contains no study plan, so it cannot be recomputed."]
    steps = read_plan(folder).steps
    done: list[str] = []
    faults: list[str] = []
    with scratch_folder() as elsewhere:
        for stage in STAGES.values():
            of_stage = [step for step in steps if step.stage == stage.name]
            if not of_stage:
                continue
            # the last one has the options of all records
            step = of_stage[-1 if stage.of_all_records else 0]
            try:
                summary, differing = _recomputed(stage, step, folder.resolve(), elsewhere, sample)
            except RockframeError as error:  # an input is missing
                faults.append(f"{folder}: {stage.name} cannot be recomputed: {error}")
                continue
            done.append(summary)
            faults += differing
    if not done:
        faults.append(f"{folder}: contains nothing that can be recomputed.")
    return done, faults


def _recomputed(
    stage: Stage, step: Step, folder: Path, elsewhere: Path, sample: int
) -> tuple[str, list[str]]:
    """Recompute a step; of a stage that computes batches, only a batch of the records."""
    from rockframe.results.contents import describe, differences

    whole, kind, batch = folder / stage.file, stage.kind, (1, 1)
    in_batches = stage.batches and not stage.of_all_records
    if in_batches:
        count = max(1, len(describe(whole, kind).records) // sample)
        batch = ((count + 1) // 2, count)
    outputs = (whole.name, *step.outputs[1:])
    inputs = tuple(name for name in step.inputs if not name.startswith(SHARD_FOLDER))
    again = replace(step, batch=batch, inputs=inputs, outputs=outputs, workers=True)
    do(Work(again, folder, into=elsewhere))
    records, apart, differing = differences(elsewhere / whole.name, whole, kind)
    summary = f"{stage.name}: {records} records" if in_batches else stage.name
    how = f"within {apart:.1g} of the largest of each variable" if apart else "to the last bit"
    faults = [f"{whole}: {name}: differs when recomputed." for name in differing]
    faults += _differing_tables(step, folder, elsewhere)
    return (summary if faults else f"{summary}, equal {how}"), faults


def _differing_tables(step: Step, folder: Path, elsewhere: Path) -> Iterator[str]:
    """Compare the tables of a screening with those made from the screening in the folder."""
    from rockframe.results.screen_tables import write_screen_tables

    if step.stage == "screen":
        for path in write_screen_tables(folder / "screen.nc", elsewhere / "screen.nc").values():
            if sha256_of(path) != sha256_of(folder / path.name):
                yield f"{folder / path.name}: differs when written again."
