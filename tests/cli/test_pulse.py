"""`rockframe pulse` as a user types it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from rockframe.cli.main import main
from rockframe.engines.engine import OneProcess, ProcessPool
from rockframe.options.ingest import PassportLimits
from rockframe.options.pulse import PulseOptions
from rockframe.record import Record
from rockframe.results.records import open_records, write_records
from rockframe.signals.passport import passport
from rockframe.stages.pulse import pulse_stage
from rockframe.wavelets.pulse import Pulse

TIME = 0.01 * np.arange(1500, dtype=np.float64)


def run(*words: str | Path) -> int:
    return main([str(word) for word in words])


def motion(seed: int) -> np.ndarray:
    planted = Pulse(wavelet="symmetric_ricker", a_p=3.0, T_p=1.0, time=6.0).acceleration(TIME)
    noise = np.random.default_rng(seed).normal(0.0, 0.3, TIME.size)
    return np.asarray(planted + noise * np.exp(-(((TIME - 7.0) / 3.0) ** 2)))


def records_of(folder: Path, samples: list[np.ndarray], **facts: str) -> Path:
    path = folder / "records.nc"
    made = [
        Record(record_id=f"m{i}", acceleration=a, time_step=0.01, **facts)  # type: ignore[arg-type]
        for i, a in enumerate(samples)
    ]
    write_records([(one, None) for one in made], path, input_sha256={}, parameters={})
    return path


def test_json_has_all_wavelets_and_the_runners_up(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    records = records_of(tmp_path, [motion(1)])
    assert run("pulse", records, "--output", tmp_path / "pulses.nc", "--json") == 0
    rows = json.loads(capsys.readouterr().out)["pulses"]
    assert [row["wavelet"] for row in rows] == [
        *("symmetric_ricker", "antisymmetric_ricker"),
        *("ricker_any_phase", "mavroeidis_papageorgiou"),
    ]
    (used,) = (row for row in rows if row["best"])
    assert used["wavelet"] == "symmetric_ricker"
    assert used["pulse_verdict"] == "pulse"
    assert used["T_p_s"] == pytest.approx(1.0, rel=0.02)
    assert len(used["runners_up"]) == 2
    assert rows[0]["half_cycles"] is None
    assert rows[3]["half_cycles"] >= 1.0


def test_another_wavelet_can_be_the_one_that_is_used(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    records = records_of(tmp_path, [motion(1)])
    words = ("--pulse-wavelet", "mavroeidis_papageorgiou", "--surrogates", "0")
    assert run("pulse", records, "--output", tmp_path / "pulses.nc", *words) == 0
    assert "→ mavroeidis_papageorgiou" in capsys.readouterr().out
    with xr.open_dataset(tmp_path / "pulses.nc") as dataset:
        assert dataset["best_wavelet"].item() == "mavroeidis_papageorgiou"
        assert dataset["a_p_best"].item() == dataset["a_p"].values[0, 3]
        assert json.loads(dataset.attrs["parameters"])["weighting"] == "energy"


def test_the_file_is_the_same_for_any_number_of_workers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A worker computes the second of two tasks."""
    monkeypatch.setattr("rockframe.stages.pulse._TOGETHER", 2)
    records = records_of(tmp_path, [motion(seed) for seed in range(3)])
    options = PulseOptions(wavelet=("symmetric_ricker",), surrogates=19)
    files = []
    for name, engine in (("one", OneProcess()), ("two", ProcessPool(2, patience=1e-9))):
        output = tmp_path / f"{name}.nc"
        assert not pulse_stage(records, output, options=options, engine=engine)
        files.append(output.read_bytes())
    assert files[0] == files[1]


def test_periods_are_cut_to_the_usable_ones(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    record = Record(
        record_id="m", acceleration=motion(1), time_step=0.01, filter_low=1.25, filter_high=40.0
    )
    path = tmp_path / "records.nc"
    made = passport(record, record, PassportLimits())
    write_records([(record, made)], path, input_sha256={}, parameters={})
    with open_records(path) as file:
        shortest, longest = file.usable_periods("m")
    assert longest == pytest.approx(0.64)
    assert run("pulse", path, "--output", tmp_path / "pulses.nc", "--json") == 0
    row = json.loads(capsys.readouterr().out)["pulses"][0]
    assert row["at_period_bound"]
    assert row["pulse_verdict"] == "at_bound"
    with xr.open_dataset(tmp_path / "pulses.nc") as dataset:
        assert dataset["longest_period"].item() == longest
        assert dataset["shortest_period"].item() == max(0.2, shortest)
    words = ("pulse", path, "--output", tmp_path / "pulses.nc", "--periods", "2", "5")
    assert run(*words) == 2
    assert "Must overlap with the usable periods of the record" in capsys.readouterr().err


def test_the_paper_is_set_beside_every_way(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    records = records_of(tmp_path, [motion(1)], source_file="RSN77_SFERN_PUL164.AT2")
    assert run("pulse", records, "--paper") == 0
    printed = capsys.readouterr().out
    for words in (
        "Weighting energy",
        "Weighting velocity",
        "Pacoima Dam/164",
        "1.27",
        "smallest distance",
    ):
        assert words in printed
    assert run("pulse", records, "--paper", "--json") == 0
    found = json.loads(capsys.readouterr().out)
    assert len(found["pulses"]) == 16
    distances = [way["distance"] for way in found["overall"]]
    assert distances == sorted(distances)


@pytest.mark.parametrize(
    ("words", "error"),
    [
        ((), "--output is missing. Name the netCDF file to write."),
        (("--output", "p.nc", "--surrogates", "5"), "surrogates 5. Must be 0, or 19 to 9999"),
        (("--output", "p.nc", "--most-half-cycles", "0"), "half-cycles 0.0. Must be at least 1"),
        (("--output", "p.nc", "--surrogates", "10000"), "--surrogates 10000. Must be at most 9999"),
        (("--output", "p.nc", "--runners-up", "-1"), "runners-up -1. Must be zero or positive"),
        (("--output", "p.nc", "--runners-up", "101"), "runners-up 101. Must be at most 100"),
        (
            ("--output", "p.nc", "--wavelet", "symmetric_ricker", "--pulse-wavelet",
             "ricker_any_phase"),
            "--pulse-wavelet 'ricker_any_phase' is not matched. Must be one of: symmetric_ricker",
        ),
        (("--paper",), "contains no record named as in the paper. Include at least one."),
    ],
)  # fmt: skip
def test_mistakes_are_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: tuple[str, ...], error: str
) -> None:
    records = records_of(tmp_path, [motion(1)])
    named = [str(tmp_path / word) if word == "p.nc" else word for word in words]
    assert run("pulse", records, *named) == 2
    said = capsys.readouterr().err
    assert error in said
    assert said.count("\n") == 1
    assert not (tmp_path / "p.nc").exists()


def test_a_constant_record_is_listed_and_the_others_go_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    records = records_of(tmp_path, [np.full(1500, 0.4), motion(1)])
    assert run("pulse", records, "--output", tmp_path / "pulses.nc", "--surrogates", "0") == 1
    assert "rejected: m0: Invalid acceleration: all samples are equal" in capsys.readouterr().err


def test_in_a_narrow_terminal_a_record_has_a_line_of_its_own(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    records = records_of(tmp_path, [motion(1)])
    assert run("pulse", records, "--output", tmp_path / "p.nc", "--surrogates", "0") == 0
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert ["m0"] in lines
    assert ["→", "symmetric_ricker"] in [line[:2] for line in lines]


def test_a_disagreement_with_bakers_indicator_is_explained(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A slow ramp of the velocity under noise: a pulse of the velocity, noise for the test."""
    slow = Pulse(wavelet="symmetric_ricker", a_p=0.5, T_p=6.0, time=7.5).acceleration(TIME)
    noise = np.random.default_rng(3).normal(0.0, 1.0, TIME.size)
    records = records_of(tmp_path, [np.asarray(slow + noise), motion(1)])
    words = ("--wavelet", "symmetric_ricker", "--periods-s", "0.2", "8", "--surrogates", "19")
    assert run("pulse", records, *words, "--output", tmp_path / "pulses.nc", "--json") == 0
    rows = json.loads(capsys.readouterr().out)["pulses"]
    apart = [
        row["record_id"]
        for row in rows
        if (row["velocity_indicator"] > 0.85) != (row["pulse_verdict"] == "pulse")
    ]
    assert len(apart) == 1
    assert run("pulse", records, *words, "--output", tmp_path / "pulses.nc") == 0
    assert f"disagree for {apart[0]}.\n" in capsys.readouterr().out
