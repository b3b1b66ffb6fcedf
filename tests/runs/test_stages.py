"""Stages are declared once: what a run, a study, a command and `verify` need follows from there."""

from __future__ import annotations

import inspect
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from tests.runs.small import FEW, make_study, run

from rockframe.cli.main import main, parser
from rockframe.errors import ParameterError
from rockframe.options import STAGES, Stage, loaded
from rockframe.options.model import options_within
from rockframe.provenance import MANIFEST, sealed, sha256_of
from rockframe.record import Record
from rockframe.results.schema import KINDS
from rockframe.structures.comparison import Rivals, compare
from rockframe.structures.contract import Compared
from rockframe.study.study import StudyTables

RIVAL = """
[compare.isolated]
period_s = 2.0
strength_ratio = 0.05
[figures]"""
#: The bridge bent alone: a column has no beam that isolators could carry.
BENT = FEW.partition('[[structure]]\nname = "slender-column"')[0]


@pytest.mark.parametrize("stage", STAGES.values(), ids=list(STAGES))
def test_declared_function_takes_what_the_declaration_says(stage: Stage) -> None:
    taken = inspect.signature(loaded(stage.function)).parameters
    files = {f"{Path(name).stem}_path" for name in stage.inputs}
    assert {"output", "options", "written", *files} <= taken.keys()
    declared = {"batch": stage.batches, "engine": stage.engine, "progress": stage.progress}
    assert {name: name in taken for name in declared} == declared


@pytest.mark.parametrize("stage", STAGES.values(), ids=list(STAGES))
def test_declared_stage_has_its_table_its_kind_of_file_and_its_command(stage: Stage) -> None:
    table = StudyTables.model_fields[stage.name]
    within = options_within(table.annotation)
    assert within is not None
    assert issubclass(within, loaded(stage.options))
    assert (table.default is None) == stage.requested
    assert KINDS[stage.kind].name == stage.kind
    assert not stage.figures or callable(loaded(stage.figures))
    if stage.command:
        assert stage.summary in " ".join(parser(stage.name).format_help().split())


def test_record_that_compare_rejects_is_a_rejection_of_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def without_one(rivals: Rivals, record: Record, *further: Any) -> Sequence[Compared]:
        if record.record_id == "motion-1":
            raise ParameterError("cannot be compared")
        return compare(rivals, record, *further)

    monkeypatch.setattr("rockframe.stages.compare.compare", without_one)
    study = make_study(tmp_path, 2, BENT.replace("[figures]", RIVAL))
    assert run(study, tmp_path / "run") == 1
    assert "rockframe: rejected: motion-1: cannot be compared" in capsys.readouterr().err
    assert main(["show", str(tmp_path / "run"), "motion-1"]) == 0
    assert "not in compare.nc cannot be compared" in capsys.readouterr().out


def test_record_that_compare_has_lost_is_a_fault(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The comparison is replaced by one of the first record."""
    both = tmp_path / "run"
    assert run(make_study(tmp_path, 2, BENT.replace("[figures]", RIVAL)), both) == 0
    structure = "".join(BENT.partition("[[structure]]")[1:])
    (tmp_path / "bent.toml").write_text(structure + RIVAL.removesuffix("[figures]"))
    records, first = str(tmp_path / "records.nc"), str(tmp_path / "motions" / "motion-0.csv")
    assert main(["ingest", first, "--units", "g", "--time-step", "0.01", "--output", records]) == 0
    words = ["--structures", str(tmp_path / "bent.toml"), "--output", str(both / "compare.nc")]
    assert main(["compare", records, *words]) == 0
    manifest = json.loads((both / MANIFEST).read_text())
    manifest["outputs"]["compare.nc"] = sha256_of(both / "compare.nc")
    (both / MANIFEST).write_bytes(sealed(manifest))
    capsys.readouterr()
    assert main(["verify", str(both)]) == 1
    said = capsys.readouterr().err
    assert "compare.nc: was made from another records.nc" in said
    assert "compare.nc: neither contains 'motion-1' of records.nc nor states a reason" in said


def test_study_can_ask_for_the_rocking_spectrum_of_one_record(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The records that it does not ask for are not lost."""
    asked = "[rocking_spectrum]\nslenderness_degree = [14.0]\ncolumn_period_s = [6.0]\n"
    table = f'{asked}record = "motion-1"\n[figures]'
    study = make_study(tmp_path, 2, BENT.replace("[figures]", table))
    assert run(study, tmp_path / "run") == 0
    assert main(["verify", str(tmp_path / "run")]) == 0
    assert "rocking_spectrum.nc: 1 records" in capsys.readouterr().out
