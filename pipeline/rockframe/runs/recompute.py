"""Recompute a sample of a run's pulses and responses, and all screenings and spectra."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Final

from rockframe.errors import RockframeError
from rockframe.provenance import sha256_of
from rockframe.runs.performing import Work, do
from rockframe.runs.plan import KEPT
from rockframe.runs.plan_file import read_plan
from rockframe.runs.step import Step

#: Stages that can be recomputed for a sample of the records, and their files.
_SAMPLED: Final = {"pulse": "pulses", "respond": "response"}
#: Stages that are recomputed in full: their results need all records together, or none.
_WHOLE: Final = ("screen", "spectrum", "rocking_spectrum", "compare")


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
    steps = {step.stage: step for step in reversed(read_plan(folder).steps)}
    done: list[str] = []
    faults: list[str] = []
    with tempfile.TemporaryDirectory() as elsewhere:
        for stage in (*_SAMPLED, *_WHOLE):
            if stage not in steps:
                continue
            try:
                what, found = _recomputed(steps[stage], folder.resolve(), Path(elsewhere), sample)
            except RockframeError as error:  # an input is missing
                faults.append(f"{folder}: {stage} cannot be recomputed: {error}")
                continue
            done.append(what)
            faults += found
    if not done:
        faults.append(f"{folder}: contains nothing that can be recomputed.")
    return done, faults


def _recomputed(step: Step, folder: Path, elsewhere: Path, sample: int) -> tuple[str, list[str]]:
    from rockframe.results.merging import differences
    from rockframe.results.reading import describe

    kind, batch = _SAMPLED.get(step.stage, step.stage), (1, 1)
    whole = folder / f"{kind}.nc"
    if step.stage in _SAMPLED:
        count = max(1, len(describe(whole, kind).records) // sample)
        batch = ((count + 1) // 2, count)
    outputs = (whole.name, *step.outputs[1:])
    do(Work(replace(step, batch=batch, outputs=outputs, workers=True), folder, into=elsewhere))
    records, apart, found = differences(elsewhere / whole.name, whole, kind)
    what = f"{step.stage}: {records} records" if step.stage in _SAMPLED else step.stage
    how = f"within {apart:.1g} of the largest of each variable" if apart else "to the last bit"
    faults = [f"{whole}: {name}: differs when recomputed." for name in found]
    faults += _differing_tables(step, folder, elsewhere)
    return (what if faults else f"{what}, equal {how}"), faults


def _differing_tables(step: Step, folder: Path, elsewhere: Path) -> Iterator[str]:
    """Compare the tables of a screening with those made from the screening in the folder."""
    from rockframe.results.screening.tables import write_screen_tables

    if step.stage == "screen":
        for path in write_screen_tables(folder / "screen.nc", elsewhere / "screen.nc").values():
            if sha256_of(path) != sha256_of(folder / path.name):
                yield f"{folder / path.name}: differs when written again."
