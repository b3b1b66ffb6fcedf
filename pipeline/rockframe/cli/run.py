"""rockframe run: run all stages of a study; the same command goes on where it was stopped."""

from __future__ import annotations

import argparse
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Final

from rockframe.cli.computing import add_engine
from rockframe.cli.plan import add_study, warn

if TYPE_CHECKING:
    from rockframe.runs import Outcome, Task


#: Status of a command that Ctrl-C ended.
_INTERRUPTED: Final = 130


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The study, the folder of its run, and where it is computed."""
    add_study(parser)
    add_engine(parser)


def run(options: argparse.Namespace) -> int:
    """Do what is left to do, and say what was done."""
    from rockframe.cli.computing import engine
    from rockframe.cli.console import progress_bar, show_json
    from rockframe.runs import Watch, make_plan, run_plan
    from rockframe.study import read_study

    study = read_study(options.study)
    plan = make_plan(study, options.output)
    try:
        with progress_bar(study.name) as progress:
            outcome = run_plan(
                plan,
                options.output,
                perform_apart if options.scheduler else perform,
                engine=engine(options),
                replace=options.replace,
                watch=Watch(warn, lambda _name, done, total: progress(done, total)),
            )
    except KeyboardInterrupt:
        again = "what is done stays done, the same command goes on from there"
        raise KeyboardInterrupt(again) from None
    rejected = _rejected(options.output)
    if options.json:
        show_json(
            {
                "study": study.name,
                "output": str(options.output),
                "steps_done": list(outcome.done),
                "made_again": list(outcome.faults),
                "rejected": rejected,
            }
        )
    else:
        _show(options.output, outcome, rejected)
    return 1 if rejected else 0


def _show(folder: Path, outcome: Outcome, rejected: dict[str, str]) -> None:
    from rockframe.provenance import MANIFEST, listed_outputs

    files = len(listed_outputs(folder / MANIFEST)) + 1
    did = f"{len(outcome.done)} steps done" if outcome.done else "nothing to do"
    print(f"{did}; {files} files in {folder}")
    for what, reason in rejected.items():
        print(f"rockframe: rejected: {what}: {reason}", file=sys.stderr)


def _rejected(folder: Path) -> dict[str, str]:
    """What did not go through, and why, of whatever step; empty of a study without records."""
    from rockframe.results import rejections_of

    return rejections_of(folder)


def perform(task: Task) -> int:
    """Perform a step in this process; what it prints goes into its log."""
    from rockframe.cli.main import call
    from rockframe.errors import RockframeError

    path = _log(task)
    try:
        with path.open("w", encoding="utf-8") as log, redirect_stdout(log), redirect_stderr(log):
            status = call(task.words)
    except SystemExit as refused:  # its words were not understood; its log says why
        status = int(refused.code or 0)
    except RockframeError as error:
        # the reason may be that the disk is full: then it is said on the terminal alone
        with suppress(OSError), path.open("a", encoding="utf-8") as log:
            log.write(f"rockframe: error: {error}\n")
        raise
    return _ended(task, status)


def perform_apart(task: Task) -> int:
    """Perform a step in a process of its own: a Dask worker may run several in threads."""
    with _log(task).open("w", encoding="utf-8") as log:
        ended = subprocess.run(
            [sys.executable, "-P", "-m", "rockframe.cli.main", *task.words],
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=log,
            check=False,
        )
    return _ended(task, ended.returncode)


def _log(task: Task) -> Path:
    from rockframe.errors import InputError

    path = task.folder / "logs" / f"{task.step.name}.log"
    try:
        path.parent.mkdir(exist_ok=True)
        path.touch()
    except OSError as error:
        raise InputError(path, f"cannot be written: {error.strerror}.") from None
    return path


def _ended(task: Task, status: int) -> int:
    from rockframe.errors import InputError
    from rockframe.runs import stamp

    if status == _INTERRUPTED:
        raise KeyboardInterrupt
    if status > (1 if task.step.may_reject else 0) or status < 0:
        log = task.folder / "logs" / f"{task.step.name}.log"
        lines = log.read_text(encoding="utf-8").splitlines() or [f"status {status}"]
        last = lines[-1].removeprefix("rockframe: ").removeprefix("error: ")
        raise InputError(log, f"step {task.step.name} failed: {last}")
    stamp(task.step, task.key, task.folder)
    return status
