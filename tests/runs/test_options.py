"""What a study can state, and what the commands of its stages can be told, is the same."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from tests.runs.small import STUDY, make_study

from rockframe.cli.main import parser
from rockframe.engines import ProcessPool
from rockframe.runs import Plan, Task, make_plan, run_plan
from rockframe.study import commented_study, read_study

#: Options that a plan gives by itself, or that only say where and how to compute and to show.
_BESIDE = {
    *("--output", "--json", "--help", "--workers", "--scheduler", "--batch", "--record"),
    *("--structures", "--structure", "--pulses", "--paper", "--figures", "--records"),
}
#: Options of reading: a screening of a run takes its records as the run read them.
_READING = {
    *("--units", "--time-step", "--station-xml", "--water-level", "--band-pass", "--uncorrected"),
    *("--catalogue", "--strict", "--limits"),
    *("--magnitude", "--distance-km", "--vs30", "--pga-g", "--pgv"),
}
#: What must be typed of each command.
_LEAST = {
    "ingest": "ingest x",
    "pulse": "pulse x",
    "respond": "respond x",
    "screen": "screen x --scales 1.0",
    "rocking_spectrum": "spectrum --records x --slenderness-deg 10.0",
    "draw": "draw x",
}


def everything(folder: Path, rotation: str) -> Plan:
    """The plan of the commented study, all that it shows behind a mark stated."""
    lines = []
    for line in commented_study("everything").splitlines():
        bare = line.removeprefix("# ")
        is_key = " = " in bare and line.startswith("# ") and bare.split(" = ")[0].isidentifier()
        lines.append(bare if is_key or bare.startswith("[") else line)
    text = "\n".join(lines).replace('structures = "structures.toml"\n', "")
    text = re.sub(rf"(?m)^(?!{rotation})(azimuth|strike)_degree = .*\n", "", text)
    beside = "azimuths_degree" if rotation == "azimuth" else "pulse_(period_s|length_m|like)"
    text = re.sub(rf"(?m)^{beside} = .*\n", "", text)  # each refuses the other
    text = text.replace('["antisymmetric_ricker"]', '["mavroeidis_papageorgiou"]')
    text = text.replace("= false", "= yes").replace("= true", "= false").replace("= yes", "= true")
    for name in ("station.xml", "limits.toml"):
        (folder / name).write_text("")
    heads = "file,event,station,network,magnitude,epicentral_distance_km,source\n"
    (folder / "catalogue.csv").write_text(heads)
    (folder / "hazard.csv").write_text("pga_g,annual_rate\n0.1,0.01\n1.0,0.0001\n")
    (folder / "motions").mkdir(exist_ok=True)
    (folder / "motions" / "motion.csv").write_text("0.1\n")
    (folder / "everything.toml").write_text(text)
    return make_plan(read_study(folder / "everything.toml"), folder / "run")


@pytest.mark.parametrize("rotation", ["azimuth", "strike"])
def test_every_command_of_a_plan_is_one_that_can_be_typed(tmp_path: Path, rotation: str) -> None:
    for step in everything(tmp_path, rotation).steps:
        assert parser().parse_args(list(step.command)).run


def test_pools_of_steps_are_as_large_as_the_run_is_asked_for(tmp_path: Path) -> None:
    plan, seen = everything(tmp_path, "azimuth"), list[Task]()

    def perform(task: Task) -> int:
        seen.append(task)
        return 0

    run_plan(plan, tmp_path / "run", perform, engine=ProcessPool(3))
    assert {task.step.name for task in seen} == {step.name for step in plan.steps}
    for task in seen:
        if task.step.workers:
            assert parser().parse_args(task.words).workers == 3
        else:
            assert getattr(parser().parse_args(task.words), "workers", None) in (None, 1)


def test_every_option_of_a_stage_can_be_stated_in_a_study(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    stated = set[str]()
    plans = [everything(tmp_path, rotation) for rotation in ("azimuth", "strike")]
    for step in (step for plan in plans for step in plan.steps):
        stated |= {f"{step.command[0]} {word}" for word in step.command if word.startswith("--")}
    for verb in ("ingest", "pulse", "respond", "screen", "spectrum", "table", "draw"):
        with pytest.raises(SystemExit):
            parser().parse_args([verb, "--help"])
        known = set(re.findall(r"(?m)^  (--[a-z0-9-]+)", capsys.readouterr().out)) - _BESIDE
        known -= _READING if verb == "screen" else set()
        assert {f"{verb} {option}" for option in known} <= stated


def test_what_a_study_does_not_state_is_the_default_of_the_command(tmp_path: Path) -> None:
    tables = '[records]\npaths = ["motions"]\n[screen]\nscales = [1.0]\n[rocking_spectrum]\n'
    structures = STUDY[STUDY.index("[[structure]]") :]
    study = make_study(
        tmp_path, 1, f'name = "bare"\n{tables}slenderness_degree = [10.0]\n{structures}'
    )
    for step in make_plan(read_study(study), tmp_path / "run").steps:
        if step.rule in _LEAST:
            words = [*_LEAST[step.rule].split(), "--output", step.outputs[0]]
            plain = vars(parser().parse_args(words))
            given = vars(parser().parse_args(list(step.command)))
            differ = {key for key in plain if plain_of(given[key]) != plain_of(plain[key])}
            assert differ <= {"output", "records", "paths", "structures", "pulses", "files"}


def plain_of(value: object) -> object:
    return list(value) if isinstance(value, tuple) else value
