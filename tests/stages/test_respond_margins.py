"""Margins in response.nc: they equal those of the margins module and are described."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from rockframe.cli.main import main
from rockframe.errors import ParameterError
from rockframe.frame import RockingFrame
from rockframe.options.respond import Ensemble, RespondOptions
from rockframe.record import Orientation, Record
from rockframe.results.records import write_records
from rockframe.results.response import open_response
from rockframe.results.tables.table import response_rows
from rockframe.rocking import (
    MARGIN_LEGEND,
    VERDICT_RULE,
    Margin,
    ensemble_responses,
    margins,
    respond,
    with_envelope,
)
from rockframe.stages.common import Batch
from rockframe.stages.respond import respond_stage
from rockframe.stages.table import index_stage
from rockframe.study.structures import SHIPPED_STRUCTURES, read_structures

BENT = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)


@pytest.fixture(scope="module")
def records() -> list[Record]:
    """A pulse that nearly overturns the bridge bent, one that overturns it, and a weak one."""
    time = 0.02 * np.arange(500)
    y = (math.pi * (time - 5.0) / 1.5) ** 2
    pulse = 9.81 * (1.0 - 2.0 * y) * np.exp(-y)
    critical = margins([Record(record_id="a", acceleration=pulse, time_step=0.02)], [BENT])[0][0]
    factors = {"near": 0.995 * critical.critical_scale, "fallen": 1.1, "weak": 0.05}
    return [
        Record(record_id=name, acceleration=factor * pulse, time_step=0.02)
        for name, factor in factors.items()
    ]


@pytest.fixture(scope="module")
def records_file(records: list[Record], tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("near") / "records.nc"
    write_records(((record, None) for record in records), path, input_sha256={}, parameters={})
    return path


@pytest.fixture(scope="module")
def response_file(records_file: Path) -> Path:
    path = records_file.with_name("response.nc")
    assert respond_stage(records_file, path, options=RespondOptions(structure="bridge-bent")) == ()
    return path


def test_the_file_holds_what_was_found(records: list[Record], response_file: Path) -> None:
    found: list[list[Margin]] = margins(records, [BENT], ensemble=Ensemble())
    with open_response(response_file) as response:
        dataset = response.dataset
        for i, (margin,) in enumerate(found):
            one = dataset.isel(record=i, structure=0)
            assert_array_equal(one["critical_scale"], margin.critical_scale)
            assert int(one["safe_islands"]) == margin.safe_islands
            assert margin.robust is not None
            assert int(one["sampling_changes"]) == margin.robust.sampling_changes
            for name in ("10", "25", "50"):
                for stored, prefix in (("scale", "s"), ("error", "error")):
                    value = getattr(margin.robust, f"{prefix}{name}")
                    assert_array_equal(one[f"robust_{stored}_{name}"], value)
            starts = one["safe_island_start"].values
            assert np.isfinite(starts).sum() == margin.safe_islands
            ends = starts + one["safe_island_width"].values
            assert tuple(zip(starts, ends, strict=True))[: margin.safe_islands] == margin.islands


def test_the_verdict_is_that_of_the_ensemble_and_the_file_keeps_the_nominal_one(
    response_file: Path,
) -> None:
    rows = {row["record_id"]: row for row in response_rows(response_file)}
    assert {name: row["verdict"] for name, row in rows.items()} == {
        "near": "stands",
        "fallen": "overturns",
        "weak": "no_uplift",
    }
    near = rows["near"]
    assert 0.05 < near["share_overturned"] < 0.95
    assert near["verdict_words"] == f"may overturn ({100.0 * near['share_overturned']:.0f} %)"
    assert rows["fallen"]["verdict_words"] == "overturns"
    assert rows["weak"]["verdict_words"] == "no uplift"
    with open_response(response_file) as response:
        assert response.dataset["verdict"].attrs["flag_meanings"] == (
            "no_uplift stands overturns not_computed"
        )


def test_the_file_has_the_envelopes_of_kept_histories(
    records: list[Record], response_file: Path
) -> None:
    with open_response(response_file) as response:
        for record in records:
            found = with_envelope(respond(BENT, record), record)
            history = response.sel(record=record.record_id, structure="bridge-bent")
            assert_array_equal(history["theta_low"], found.theta_low)
            assert_array_equal(history["theta_high"], found.theta_high)


@pytest.mark.parametrize("changes", [{"margins": "none"}, {"ensemble": Ensemble(members=0)}])
def test_without_robust_margins_there_are_no_envelopes(
    records_file: Path, tmp_path: Path, changes: dict[str, Any]
) -> None:
    output = tmp_path / "response.nc"
    respond_stage(records_file, output, RespondOptions(structure="bridge-bent", **changes))
    with open_response(output) as response:
        assert "theta_low" not in response.dataset


def test_the_command_says_it(
    records_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["--structure", "bridge-bent", "--output", str(tmp_path / "response.nc")]
    assert main(["respond", str(records_file), *words]) == 0
    out = capsys.readouterr().out
    lines = {line.split()[0]: line for line in out.splitlines() if line.strip()}
    near, fallen, weak = (lines[name] for name in ("near", "fallen", "weak"))
    assert "may overturn (" in near
    assert VERDICT_RULE in " ".join(out.split())
    assert MARGIN_LEGEND in " ".join(out.split())
    assert "overturns 100 % (95 to 100)" in " ".join(fallen.split())
    assert "no uplift" in weak
    assert main(["respond", str(records_file), *words, "--margins", "none", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["responses"]
    assert [row["verdict"] for row in rows] == ["stands", "overturns", "no_uplift"]
    assert {row["critical_scale"] for row in rows} == {None}


def test_batches_are_joined(records_file: Path, response_file: Path, tmp_path: Path) -> None:
    parts = [tmp_path / f"part-{k}.nc" for k in (1, 2)]
    options = RespondOptions(structure="bridge-bent")
    for k, part in enumerate(parts, start=1):
        respond_stage(records_file, part, options, batch=Batch(k, 2))
    index_stage(parts, tmp_path / "whole.nc")
    with open_response(tmp_path / "whole.nc") as joined, open_response(response_file) as whole:
        assert joined.dataset.load().equals(whole.dataset.load())


def test_table1_without_margins(tmp_path: Path) -> None:
    record = tmp_path / "motion.csv"
    np.savetxt(record, np.sin(np.arange(400.0)), fmt="%.6f")
    words = [
        "--units",
        "m/s2",
        "--time-step",
        "0.01",
        "--output",
        str(tmp_path / "run"),
        *("--surrogates", "0", "--structure", "bridge-bent", "--ensemble-members", "16"),
    ]
    assert main(["table1", "--records", str(record), "--margins", "none", *words]) == 0
    with (tmp_path / "run" / "table.csv").open(newline="") as stream:
        for row in csv.DictReader(stream):
            assert (row["critical_scale"], row["safe_islands"]) == ("", "")


def test_shipped_structures_are_those_of_the_test() -> None:
    bent = next(f for f in read_structures(SHIPPED_STRUCTURES) if f.name == "bridge-bent")
    assert (bent.height, bent.width, bent.mass_ratio) == (9.6, 1.6, 4.0)


BANDS = ("peak_rotation_ratio", "peak_u", "peak_v", "peak_impact_velocity", "friction_demand")


def test_shares_and_bands_are_in_the_file_and_the_table(
    records: list[Record], response_file: Path
) -> None:
    frame = read_structures(SHIPPED_STRUCTURES)[0]
    found = [row[0] for row in ensemble_responses(records, [frame])]
    rows = list(response_rows(response_file))
    with open_response(response_file) as response:
        dataset = response.dataset
        assert dataset["quantile"].values.tolist() == [0.16, 0.5, 0.84]
        for i, (one, row) in enumerate(zip(found, rows, strict=True)):
            stored = dataset.isel(record=i, structure=0)
            for end in ("", "_low", "_high"):
                share = getattr(one, f"share_overturned{end}")
                assert float(stored[f"share_overturned{end}"]) == share
                assert row[f"share_overturned{end}"] == share
            assert float(stored["share_uplifted"]) == one.share_uplifted
            for name in (*BANDS, "peak_base_shear"):
                assert_array_equal(stored[f"{name}_band"], getattr(one.bands, name))
            columns = [row[f"peak_u_{quantile}_m"] for quantile in (16, 50, 84)]
            assert_array_equal(columns, one.bands.peak_u)
            assert np.isnan(stored["share_model_ends"]), "no limit is stated"
    near, fallen, weak = found
    assert 0.0 < near.share_overturned < 0.9 < fallen.share_overturned
    assert weak.share_uplifted == 0.0
    assert fallen.bands.peak_u[2] == math.inf


def test_without_members_there_are_no_shares(records_file: Path, tmp_path: Path) -> None:
    path = tmp_path / "response.nc"
    options = RespondOptions(structure="bridge-bent", ensemble=Ensemble(members=0))
    respond_stage(records_file, path, options=options)
    with open_response(path) as response:
        names = set(map(str, response.dataset.variables))
    assert not {"quantile", "share_overturned", "robust_scale_10"} & names
    assert "critical_scale" in names
    assert all(math.isnan(row["share_overturned"]) for row in response_rows(path))


def test_the_command_prints_shares_and_bands(
    records_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["--structure", "bridge-bent", "--output", str(tmp_path / "response.nc")]
    words += ["--margins", "none"]
    assert main(["respond", str(records_file), *words, "--ensemble-members", "16"]) == 0
    lines = capsys.readouterr().out.splitlines()
    [fallen] = [line for line in lines if line.strip().startswith("fallen")]
    assert " 100 % (83 to 100) " in fallen
    assert " overturns  " in fallen
    assert main(["respond", str(records_file), *words, "--ensemble-members", "15"]) == 2
    error = "rockframe: error: --ensemble-members 15. Must be 0, or at least 16"
    assert error in capsys.readouterr().err


def test_a_spread_that_lets_the_ground_fall_rejects_the_record(tmp_path: Path) -> None:
    time = 0.02 * np.arange(500)
    across = Record(
        record_id="e1-n", acceleration=np.sin(time), time_step=0.02, station="e1", component="n"
    )
    up = Record(
        record_id="e1-up",
        acceleration=-9.7 * np.abs(np.sin(time)),
        time_step=0.02,
        station="e1",
        component="up",
        orientation=Orientation.VERTICAL,
    )
    path = tmp_path / "records.nc"
    write_records(((one, None) for one in (across, up)), path, input_sha256={}, parameters={})
    options = RespondOptions(vertical=True, margins="none", ensemble=Ensemble(amplitude=0.1))
    with pytest.raises(ParameterError, match=r"spread amplitude 0\.1 .* times the motion"):
        respond_stage(path, tmp_path / "response.nc", options=options)
