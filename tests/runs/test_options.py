"""Every option of a study reaches its stage, and defaults are those of the stages."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from tests.runs.small import STUDY, make_study

from rockframe.cli.main import main
from rockframe.engines.dask import DaskScheduler
from rockframe.engines.engine import Engine, OneProcess, ProcessPool
from rockframe.options.ingest import Filters, IngestOptions
from rockframe.options.pulse import PulseOptions
from rockframe.options.respond import RespondOptions, ScreenOptions
from rockframe.runs.performing import Work
from rockframe.runs.plan import Plan, make_plan
from rockframe.runs.run import run_plan
from rockframe.study.study import commented_study, read_study


def everything(folder: Path, rotation: str) -> Plan:
    """Return the plan of the commented study with all its commented-out keys stated."""
    lines = []
    for line in commented_study("everything").splitlines():
        bare = line.removeprefix("# ")
        is_key = " = " in bare and line.startswith("# ") and bare.split(" = ")[0].isidentifier()
        lines.append(bare if is_key or bare.startswith("[") else line)
    text = "\n".join(lines).replace('structures = "structures.toml"\n', "")
    text = re.sub(rf"(?m)^(?!{rotation})(azimuth|strike)_degree = .*\n", "", text)
    in_plane = "pulse_(period_s|length_m|like)|both_directions"
    beside = "azimuths_degree" if rotation == "azimuth" else in_plane
    text = re.sub(rf"(?m)^({beside}) = .*\n", "", text)  # these exclude each other
    joined = "sequence" if rotation == "azimuth" else "selection"
    text = re.sub(rf"(?m)^{joined} = .*\n", "", text)  # and these
    other = "radius_m|friction|effective_period_s|design_displacement_m|moment_capacity_nm"
    text = re.sub(rf"(?m)^({other}) = .*\n", "", text)  # alternative keys of rivals
    text = text.replace("= false", "= yes").replace("= true", "= false").replace("= yes", "= true")
    # Each needs a structure that this study does not have: a second one, a tendon that yields.
    text = re.sub(
        r"(?m)^(?:pooled|limit_(?:peak_tendon_ratio|peak_gap_ratio|ductility)) = .*\n",
        "",
        text,
    )
    # The hazard file is a single curve of one site and measure.
    text = re.sub(r"(?m)^hazard_(?:site|site_id|curve|measure|columns) = .*\n", "", text)
    # Alternatives of reading files.
    alternatives = "factor_m_s2|values_per_line|time_column|channels|catalogue_columns"
    text = re.sub(rf"(?m)^(?:{alternatives}) = .*\n", "", text)
    for name in ("station.xml", "limits.toml", "logo.png"):
        (folder / name).write_text("")
    heads = "file,event,station,network,magnitude,epicentral_distance_km,source\n"
    (folder / "catalogue.csv").write_text(heads)
    (folder / "hazard.csv").write_text("pga_g,annual_rate\n0.1,0.01\n1.0,0.0001\n")
    (folder / "selected.csv").write_text("record_id,scale\nmotion,2.0\n")
    (folder / "motions").mkdir(exist_ok=True)
    (folder / "motions" / "motion.csv").write_text("0.1\n")
    (folder / "everything.toml").write_text(text)
    return make_plan(read_study(folder / "everything.toml"), folder / "run")


@pytest.mark.parametrize("rotation", ["azimuth", "strike"])
def test_options_of_each_step_are_those_that_the_study_states(
    tmp_path: Path, rotation: str
) -> None:
    plan = everything(tmp_path, rotation)
    tables = read_study(tmp_path / "everything.toml").tables
    by_stage = {step.stage: step.options for step in plan.steps}
    models = {
        "pulse": tables.pulse,
        "screen": tables.screen,
        "spectrum": tables.spectrum,
        "rocking_spectrum": tables.rocking_spectrum,
        "compare": tables.compare,
        "draw": tables.figures,
        "report": tables.report,
    }
    for stage, model in models.items():
        assert model is not None
        again = type(model)(**by_stage[stage])
        assert again.stated() == model.stated()
    assert IngestOptions(**by_stage["ingest"]["records"]).azimuths
    assert Filters(**by_stage["ingest"]["filters"]) == tables.filters
    assert RespondOptions(**by_stage["respond"]).vertical is tables.respond.vertical


def test_pools_of_steps_are_as_large_as_the_run_is_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan, seen = everything(tmp_path, "azimuth"), list[Work]()

    def note(work: Work) -> int:
        seen.append(work)
        return 0

    monkeypatch.setattr("rockframe.runs.performing.perform", note)
    run_plan(plan, tmp_path / "run", engine=ProcessPool(3))
    assert {work.step.name for work in seen} == {step.name for step in plan.steps}
    for work in seen:
        assert work.engine == (ProcessPool(3) if work.step.workers else OneProcess())


@pytest.mark.parametrize(
    ("words", "engine"),
    [
        (["--workers", "1"], OneProcess()),
        (["--workers", "3"], ProcessPool(3)),
        (["--scheduler", "tcp://one:1"], DaskScheduler("tcp://one:1")),
    ],
)
def test_a_step_alone_is_computed_where_the_command_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: list[str], engine: Engine
) -> None:
    folder = tmp_path / "run"
    assert main(["run", str(make_study(tmp_path, 1)), "--output", str(folder), "--plan"]) == 0
    seen = list[Work]()

    def note(work: Work) -> int:
        seen.append(work)
        return 0

    monkeypatch.setattr("rockframe.runs.performing.perform", note)
    assert main(["step", str(folder), "ingest", *words]) == 0
    (work,) = seen
    assert work.engine == engine


@pytest.mark.parametrize("histories", ["none", "all"])
def test_figures_of_records_are_drawn_in_a_pool(tmp_path: Path, histories: str) -> None:
    """There may be hundreds of them; curves are few."""
    text = STUDY.replace("[respond]", f'[screen]\n[respond]\nhistories = "{histories}"')
    assert f'histories = "{histories}"' in text
    plan = make_plan(read_study(make_study(tmp_path, 1, text)), tmp_path / "run")
    (step,) = (step for step in plan.steps if step.stage == "draw")
    assert (step.workers, step.threads > 1) == (histories == "all", histories == "all")


def test_what_a_study_does_not_state_is_the_default_of_the_stage(tmp_path: Path) -> None:
    tables = '[records]\npaths = ["motions"]\n[screen]\n'
    structures = STUDY[STUDY.index("[[structure]]") :]
    study = make_study(tmp_path, 1, f'name = "bare"\n{tables}{structures}')
    by_stage = {s.stage: s.options for s in make_plan(read_study(study), tmp_path / "run").steps}
    assert PulseOptions(**by_stage["pulse"]) == PulseOptions()
    assert RespondOptions(**by_stage["respond"]) == RespondOptions()
    assert ScreenOptions(**by_stage["screen"]) == ScreenOptions()
    assert IngestOptions(**by_stage["ingest"]["records"]) == IngestOptions()
