"""What a killed run leaves half-written, and how it is known from other people's files."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

from rockframe.runs.plan import KEPT, Plan

#: What mkstemp puts between the name of a file and ``.partial``.
_RANDOM = r"-[A-Za-z0-9_]{8}\.partial"
#: What a screening keeps until all of it is there.
_BATCHES = re.compile(r"\.screen-[0-9a-f]{16}\.batches")


def sweep(plan: Plan, folder: Path) -> list[str]:
    """Remove half-written outputs of a plan; the lock must be held.

    Parameters
    ----------
    plan : Plan
        The plan of the run; files of other names stay.
    folder : Path
        The folder of the run.

    Returns
    -------
    list of str
        Names of what was removed.
    """
    outputs = {Path(name) for step in plan.steps for name in step.outputs} | {
        Path(name) for name in plan.files
    }
    kept = [path.relative_to(folder) for path in (folder / KEPT).rglob("*.json")]
    kept += [Path(KEPT, "plan.json"), *(Path(KEPT, "steps", f"{s.name}.json") for s in plan.steps)]
    swept = []
    for output in sorted({*outputs, *kept, Path("records.csv")}):
        parent = folder / output.parent
        if not parent.is_dir():
            continue
        wanted = re.compile(re.escape(f".{output.stem}") + _RANDOM + re.escape(output.suffix))
        for path in sorted(parent.iterdir()):
            if wanted.fullmatch(path.name):
                _remove(path)
                swept.append(path.relative_to(folder).as_posix())
    return swept + _sweep_batches(plan, folder)


def _sweep_batches(plan: Plan, folder: Path) -> list[str]:
    """Remove the batches of a screening, unless the plan has one: then it resumes from them."""
    if any(step.stage == "screen" for step in plan.steps):
        return []
    left = [path for path in folder.iterdir() if _BATCHES.fullmatch(path.name)]
    for path in left:
        _remove(path)
    return [path.name for path in left]


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink()
