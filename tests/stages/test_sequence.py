"""Sequences through the stages: from files of records to a row for each motion."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rockframe.cli.main import main
from rockframe.errors import ParameterError, RockframeWarning
from rockframe.options.ingest import IngestOptions
from rockframe.options.respond import Ensemble, RespondOptions
from rockframe.results.reading import opened
from rockframe.results.records import open_records
from rockframe.results.tables.table import part_rows
from rockframe.runs.plan import steps_of
from rockframe.stages.ingest import ingest_stage
from rockframe.stages.respond import respond_stage
from rockframe.study.study import read_study

BOTH = "main-then-after"
STRUCTURES = """
[[structure]]
name = "free"
height_m = 9.6
width_m = 1.6
mass_ratio = 4.0

[[structure]]
name = "held"
height_m = 9.6
width_m = 1.6
mass_ratio = 4.0
section = "circular"
density_kg_m3 = 2500.0
dissipater = { stiffness_n_m = 5.0e7, yield_force_n = 1.0e5, lever_arm_m = 0.8 }
"""


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with two motions, structures, and a study of their sequence."""
    folder = tmp_path_factory.mktemp("sequence")
    (folder / "motions").mkdir()
    time = 0.02 * np.arange(601)
    for name, size, period in (("main", 0.5, 1.5), ("after", 0.4, 1.2)):
        phase = (np.pi * (time - 6.0) / period) ** 2
        shape = size * (1.0 - 2.0 * phase) * np.exp(-phase)
        rows = [f"{a:.2f},{b:.6f}" for a, b in zip(time, shape, strict=True)]
        (folder / "motions" / f"{name}.csv").write_text("\n".join(["time_s,acc_g", *rows, ""]))
    (folder / "structures.toml").write_text(STRUCTURES)
    return folder


@pytest.fixture(scope="module")
def records(home: Path) -> Path:
    options = IngestOptions(sequence=("main", "after"), rest_s=90.0)
    done = ingest_stage([home / "motions"], home / "records.nc", options, workers=0)
    assert [record.record_id for record in done.accepted] == ["after", "main", BOTH]
    return home / "records.nc"


def test_the_file_of_records_has_the_sequence_and_its_motions(records: Path) -> None:
    with open_records(records) as file:
        both, main, after = (file.read(name) for name in (BOTH, "main", "after"))
    assert [str(part) for part in both.parts] == ["main 0 12", "after 102 114"]
    assert main.parts == ()
    size = main.acceleration.size
    assert both.acceleration[:size].tolist() == main.acceleration.tolist()
    assert both.acceleration[-size:].tolist() == after.acceleration.tolist()
    assert not both.acceleration[size:-size].any()


def test_a_rest_of_years_is_refused() -> None:
    """Its still ground would not fit into memory."""
    with pytest.raises(ParameterError, match=r"rest_s .*Must be at most 3600"):
        IngestOptions(sequence=("main", "after"), rest_s=1e9)


def test_a_row_for_each_motion_and_structure(home: Path, records: Path) -> None:
    output = home / "response.nc"
    options = RespondOptions(margins="none", ensemble=Ensemble(members=0))
    respond_stage(records, output, options, structures_path=home / "structures.toml")
    with opened(output, "response") as response:
        rows = part_rows(response)
        peaks_of = response["peak_rotation_ratio"].values
        alone = dict(zip(response["record_id"].values, peaks_of, strict=True))
    assert [(row["structure"], row["motion"], row["motion_id"]) for row in rows] == [
        (structure, k, name)
        for structure in ("free", "held")
        for k, name in ((1, "main"), (2, "after"))
    ]
    peaks = [row["peak_rotation_ratio"] for row in rows]
    assert peaks[:3] == pytest.approx([alone["main"][0], alone["after"][0], alone["main"][1]])
    assert abs(peaks[3] - alone["after"][1]) > 1e-3  # the bars are stretched
    assert [row["start_rotation_ratio"] for row in rows] == [0.0] * 4
    forces = [row["dissipater_force_n"] for row in rows]
    assert forces == pytest.approx([np.nan, np.nan, 0.0, -1e5], nan_ok=True)


def test_a_structure_that_still_moves_causes_a_warning(home: Path, tmp_path: Path) -> None:
    options = IngestOptions(sequence=("main", "after"), rest_s=0.1)
    ingest_stage([home / "motions"], tmp_path / "records.nc", options, workers=0)
    stated = RespondOptions(margins="none", ensemble=Ensemble(members=0), structure="free")
    with pytest.warns(RockframeWarning, match=r"'free' does not rest when motion 'after' begins"):
        respond_stage(
            tmp_path / "records.nc",
            tmp_path / "response.nc",
            stated,
            structures_path=home / "structures.toml",
        )


def test_an_unknown_record_is_refused_and_no_file_is_left(home: Path, tmp_path: Path) -> None:
    options = IngestOptions(sequence=("main", "other"))
    with pytest.raises(ParameterError, match=r"'other' of the sequence\. .* accepted: after, main"):
        ingest_stage([home / "motions"], tmp_path / "records.nc", options, workers=0)
    assert not (tmp_path / "records.nc").exists()


def test_a_sequence_of_one_is_refused_as_an_option() -> None:
    with pytest.raises(ParameterError, match=r"sequence .* Must be a list of 2 or more"):
        IngestOptions(sequence=("main",))


def test_a_sequence_of_a_selection_is_refused() -> None:
    with pytest.raises(ParameterError, match="sequence and selection both stated"):
        IngestOptions(sequence=("main", "after"), selection=Path("selected.csv"))


def test_a_study_has_its_sequence_in_one_batch(home: Path) -> None:
    path = home / "study.toml"
    stated = 'name = "s"\n[records]\npaths = ["motions"]\nsequence = ["main", "after"]\n'
    path.write_text(stated)
    assert steps_of(read_study(path), 2)
    path.write_text(f"{stated}[batches]\nrecords = 1\n")
    with pytest.raises(ParameterError, match=r"needs all 2 record files in one batch\. State \[b"):
        steps_of(read_study(path), 2)


def test_the_command_prints_the_motions(
    home: Path, records: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["--structures", str(home / "structures.toml"), "--structure", "held"]
    words += [
        "--margins",
        "none",
        "--ensemble-members",
        "0",
        "--output",
        str(tmp_path / "response.nc"),
    ]
    assert main(["respond", str(records), *words]) == 0
    printed = capsys.readouterr().out
    assert "Motions of the sequences" in printed
    assert "2 after" in printed
