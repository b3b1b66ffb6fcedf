"""Repeating what a run computed: a sample of pulses and responses, screenings and spectra whole."""

from __future__ import annotations

import io
import tempfile
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from rockframe.runs import Step

#: Stages of which a sample of records can be repeated.
_SAMPLED: Final = {"pulse": "pulses", "respond": "response"}
#: Stages that are repeated whole: what they give is of all records together, or of none.
_WHOLE: Final = ("screen", "spectrum", "rocking_spectrum")


def recompute(folder: Path, sample: int) -> tuple[list[str], list[str]]:
    """Repeat steps of a run elsewhere, and compare.

    Parameters
    ----------
    folder : Path
        Of the run of a study.
    sample : int
        About how many records of each stage.

    Returns
    -------
    list of str, list of str
        What was repeated, and what differs.
    """
    from rockframe.errors import RockframeError
    from rockframe.runs import KEPT, read_plan

    if not (folder / KEPT / "plan.json").is_file():
        return [], [f"{folder}: holds no plan of a study. Must, to be computed again."]
    steps = {step.rule: step for step in reversed(read_plan(folder).steps)}
    done: list[str] = []
    faults: list[str] = []
    with tempfile.TemporaryDirectory() as elsewhere:
        for rule in (*_SAMPLED, *_WHOLE):
            if rule not in steps:
                continue
            try:
                what, found = _again(steps[rule], folder, Path(elsewhere), sample)
            except RockframeError as error:  # a file that it needs is not there any more
                faults.append(f"{folder}: {rule} cannot be computed again: {error}")
                continue
            done.append(what)
            faults += found
    if not done:
        faults.append(f"{folder}: holds nothing that can be computed again.")
    return done, faults


def _again(step: Step, folder: Path, elsewhere: Path, sample: int) -> tuple[str, list[str]]:
    from rockframe.results import describe, differences

    kind = _SAMPLED.get(step.rule, step.rule)
    whole, output = folder / f"{kind}.nc", elsewhere / f"{kind}.nc"
    words = [*_without(step.words(folder), "--batch", "--output"), "--output", str(output)]
    if step.rule in _SAMPLED:
        count = max(1, len(describe(whole, kind).records) // sample)
        words += ["--batch", f"{(count + 1) // 2}/{count}"]
    _call(words)
    records, apart, found = differences(output, whole, kind)
    what = f"{step.rule}: {records} records" if step.rule in _SAMPLED else step.rule
    how = f"within {apart:.1g} of the largest of each variable" if apart else "to the last bit"
    faults = [f"{whole}: {name}: computed again, it differs." for name in found]
    faults += _strange_table(step, folder, elsewhere)
    return (what if faults else f"{what}, equal {how}"), faults


def _strange_table(step: Step, folder: Path, elsewhere: Path) -> Iterator[str]:
    """The table of a screening, made again of the screening that is in the folder."""
    from rockframe.provenance import sha256_of
    from rockframe.results import write_screen_table

    if step.rule == "screen":
        write_screen_table(folder / "screen.nc", elsewhere / "screen.csv")
        if sha256_of(elsewhere / "screen.csv") != sha256_of(folder / "screen.csv"):
            yield f"{folder / 'screen.csv'}: made again, it differs."


def _without(words: list[str], *options: str) -> list[str]:
    """The words but for these options and their values."""
    kept: list[str] = []
    skipped = False
    for word in words:
        if not skipped and word not in options:
            kept.append(word)
        skipped = word in options
    return kept


def _call(words: list[str]) -> None:
    from rockframe.cli.main import call

    said = io.StringIO()
    with redirect_stdout(said), redirect_stderr(said):
        call(words)
