"""The response to a record's pulse alone, compared with the response to the record."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from rockframe.cli.main import main
from rockframe.errors import InputError
from rockframe.frame import RockingFrame
from rockframe.options.pulse import PulseOptions
from rockframe.options.respond import RespondOptions
from rockframe.record import Record
from rockframe.results.tables.table import response_rows
from rockframe.rocking import Verdict, respond, with_pulse
from rockframe.stages.pulse import pulse_stage
from rockframe.stages.respond import respond_stage
from rockframe.wavelets.pulse import Pulse

BENT = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
PLANTED = Pulse(wavelet="symmetric_ricker", a_p=0.5 * 9.81, T_p=1.5, time=6.0)
QUICK = PulseOptions(wavelet=("symmetric_ricker",), surrogates=0)


def test_a_record_that_is_its_pulse_has_no_error() -> None:
    samples = PLANTED.acceleration(0.002 * np.arange(6000))
    record = Record(record_id="pulse", acceleration=samples, time_step=0.002)
    beside = with_pulse(respond(BENT, record), PLANTED).to_pulse
    assert beside is not None
    assert abs(beside.error) < 1e-4
    assert beside.verdict is Verdict.STANDS


def test_a_fall_leaves_no_error_to_state() -> None:
    strong = Pulse(wavelet="symmetric_ricker", a_p=3.0 * 9.81, T_p=1.5)
    beside = with_pulse(respond(BENT, PLANTED), strong).to_pulse
    assert beside is not None
    assert beside.verdict is Verdict.OVERTURNS
    assert math.isnan(beside.error)


def test_a_record_that_lifts_nothing_leaves_none_either() -> None:
    weak = Pulse(wavelet="symmetric_ricker", a_p=0.5, T_p=1.5)
    beside = with_pulse(respond(BENT, weak), PLANTED).to_pulse
    assert beside is not None
    assert math.isnan(beside.error)


@pytest.fixture(scope="module")
def stages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with records and pulses of `a` and `b`; `other` has records of `a` times 0.9."""
    folder = tmp_path_factory.mktemp("stages")
    time = 0.01 * np.arange(1500)
    for name, scale in (("a", 1.0), ("b", 0.8)):
        np.savetxt(folder / f"{name}.csv", scale * PLANTED.acceleration(time) / 9.81, fmt="%.8f")
    (folder / "other").mkdir()
    np.savetxt(folder / "other" / "a.csv", 0.9 * PLANTED.acceleration(time) / 9.81, fmt="%.8f")
    options = ["--units", "g", "--time-step", "0.01"]
    for source in (folder, folder / "other"):
        words = ["ingest", *map(str, sorted(source.glob("*.csv"))), *options]
        assert main([*words, "--output", str(source / "records.nc")]) == 0
    pulse_stage(folder / "records.nc", folder / "pulses.nc", options=QUICK)
    return folder


def test_response_file_holds_the_second_opinion(stages: Path, tmp_path: Path) -> None:
    output = tmp_path / "response.nc"
    respond_stage(
        stages / "records.nc",
        output,
        options=RespondOptions(structure="bridge-bent"),
        pulses_path=stages / "pulses.nc",
    )
    with xr.open_dataset(output) as dataset:
        np.testing.assert_allclose(dataset["surrogate_error"], 0.0, atol=2e-3)
        assert (dataset["verdict_to_pulse"] == dataset["verdict"]).all()
    assert next(response_rows(output))["verdict_to_pulse"] == "stands"


def test_without_pulses_there_is_none(stages: Path, tmp_path: Path) -> None:
    output = tmp_path / "response.nc"
    respond_stage(stages / "records.nc", output, options=RespondOptions(structure="bridge-bent"))
    assert math.isnan(next(response_rows(output))["surrogate_error"])


def test_pulses_of_other_samples_are_refused(stages: Path, tmp_path: Path) -> None:
    output = tmp_path / "response.nc"
    with pytest.raises(
        InputError,
        match=r"the pulse of 'a' was computed from other samples. Compute the pulses of th",
    ):
        respond_stage(stages / "other" / "records.nc", output, pulses_path=stages / "pulses.nc")
    assert not output.exists()


def test_pulses_of_none_of_the_records_are_refused(stages: Path, tmp_path: Path) -> None:
    np.savetxt(tmp_path / "c.csv", PLANTED.acceleration(0.01 * np.arange(1500)), fmt="%.8f")
    records = tmp_path / "records.nc"
    assert main(["ingest", str(tmp_path / "c.csv"), "--units", "m/s2", "--time-step", "0.01",
                 "--output", str(records)]) == 0  # fmt: skip
    with pytest.raises(InputError, match=r"contains no pulse of these records. Use the pulses"):
        respond_stage(records, tmp_path / "response.nc", pulses_path=stages / "pulses.nc")


@pytest.mark.parametrize("variable", ["outside", "samples_sha256", "best_wavelet"])
def test_pulses_of_another_version_are_refused(
    stages: Path, tmp_path: Path, variable: str, capsys: pytest.CaptureFixture[str]
) -> None:
    old = tmp_path / "old.nc"
    with xr.open_dataset(stages / "pulses.nc") as dataset:
        dataset.drop_vars(variable).to_netcdf(old)
    words = ["respond", str(stages / "records.nc"), "--pulses", str(old)]
    assert main([*words, "--output", str(tmp_path / "response.nc")]) == 2
    assert f"without variable '{variable}'. Use a file that this version" in capsys.readouterr().err
