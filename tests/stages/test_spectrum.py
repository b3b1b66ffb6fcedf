"""`rockframe spectrum`: the files it writes, its printed output, and its error messages."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose, assert_array_equal

from rockframe.cli.main import main
from rockframe.record import Record
from rockframe.results.records import write_records
from rockframe.results.response import read_rocking_spectrum, read_spectrum
from rockframe.results.tables.entries import rows_of
from rockframe.rocking import Verdict, respond
from rockframe.rocking.spectra.overturning import column_of

ASKED = (
    *("--wavelet", "symmetric_ricker", "antisymmetric_ricker", "--slenderness-deg", "14"),
    *("--mass-ratio", "0", "0.25", "--frequency-ratio", "2", "5", "--amplitude-step", "0.02"),
)


@pytest.fixture(scope="module")
def spectrum_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("spectrum") / "spectrum.nc"
    assert main(["spectrum", *ASKED, "--max-amplitude", "12", "--output", str(path)]) == 0
    return path


@pytest.fixture(scope="module")
def spectrum(spectrum_file: Path) -> xr.Dataset:
    return read_spectrum(spectrum_file)


def test_least_amplitudes_by_name(spectrum: xr.Dataset) -> None:
    least = spectrum["minimum_overturning_amplitude"]
    assert least.dims == ("wavelet", "slenderness", "mass_ratio", "frequency_ratio")
    symmetric = least.sel(wavelet="symmetric_ricker", mass_ratio=0.25).squeeze()
    assert_allclose(symmetric.sel(frequency_ratio=5.0), 5.7565202580704256, rtol=0, atol=1e-6)
    assert_allclose(symmetric.sel(frequency_ratio=2.0), 1.9153, rtol=0, atol=1e-4)


def test_a_half_sine_overturns_a_slender_column_as_the_linear_solution_says(tmp_path: Path) -> None:
    """Its growing part, integrated over the pulse from uplift, must reach the unstable balance."""

    def balance(amplitude: float, ratio: float) -> float:
        lift = math.asin(1.0 / amplitude)
        time = np.linspace(0.0, (math.pi - lift) / ratio, 20001)
        push = np.exp(-time) * np.sin(ratio * time + lift)
        return amplitude * float(np.trapezoid(push, time)) - 1.0

    path = tmp_path / "half.nc"
    words = ("--slenderness-degree", "0.1", "--frequency-ratio", "2", "4", "--output", str(path))
    assert main(["spectrum", "--wavelet", "half_sine", *words]) == 0
    for least in read_spectrum(path)["minimum_overturning_amplitude"].squeeze():
        assert_allclose(balance(float(least), float(least["frequency_ratio"])), 0.0, atol=1e-4)


def test_intervals_with_and_without_impact(spectrum: xr.Dataset) -> None:
    """At ratio 2, the symmetric pulse overturns in four intervals with impacts and one without."""
    line = spectrum.sel(wavelet="symmetric_ricker", mass_ratio=0.25, frequency_ratio=2.0).squeeze()
    assert int(line["overturning_intervals"]) == 5
    assert int(line["safe_islands"]) == 4
    assert line["interval_impacts"].values[:5].tolist() == [1, 3, 1, 2, 0]
    assert math.isnan(line["interval_upper"][4])
    highest = float(line["amplitude"][-1])
    assert int(line["overturning"].sel(amplitude=highest)) == 2
    assert line["overturning"].attrs["flag_meanings"] == "none after_impact without_impact"


def test_maps_agree_with_intervals(spectrum: xr.Dataset) -> None:
    fallen = spectrum["verdict"] == Verdict.OVERTURNS
    inside = (
        (spectrum["amplitude"] >= spectrum["interval_lower"])
        & ~(spectrum["amplitude"] > spectrum["interval_upper"])
    ).any("interval")
    assert_array_equal(fallen, inside.transpose(*fallen.dims))
    assert_array_equal(fallen, spectrum["overturning"] > 0)


def test_everything_says_what_it_is(spectrum: xr.Dataset) -> None:
    for name, variable in spectrum.variables.items():
        assert variable.attrs["units"], name
        assert variable.attrs["long_name"], name
    assert spectrum.attrs["rockframe_kind"] == "spectrum"


def test_the_same_bytes_with_any_number_of_workers(spectrum_file: Path, tmp_path: Path) -> None:
    path = tmp_path / "spectrum.nc"
    words = ["--max-amplitude", "12", "--workers", "1", "--output", str(path)]
    assert main(["spectrum", *ASKED, *words]) == 0
    assert path.read_bytes() == spectrum_file.read_bytes()


def test_what_is_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = [
        *("spectrum", "--wavelet", "symmetric_ricker", "--slenderness-deg", "14"),
        *("--mass-ratio", "0", "--frequency-ratio", "3", "7.5", "--max-amplitude", "4"),
        *("--output", str(tmp_path / "spectrum.nc")),
    ]
    assert main(words) == 0
    table = capsys.readouterr().out
    assert "2.7044" in table
    assert "> 4" in table
    assert "Above 0 of these 2 points" in table
    assert main([*words, "--json"]) == 0
    lines = json.loads(capsys.readouterr().out)["spectrum"]
    assert lines[1]["minimum_overturning_amplitude"] is None
    assert lines[1]["intervals"] == []
    assert lines[0]["intervals"][0]["upper"] is None
    assert lines[0]["intervals"][0]["impacts"] == 1
    assert main([*words, "--format", "csv"]) == 0
    for row, line in zip(rows_of(tmp_path / "spectrum.csv"), lines, strict=True):
        assert [*row] == [key for key in line if key != "intervals"]
        least = line["minimum_overturning_amplitude"]
        assert row["minimum_overturning_amplitude"] == ("" if least is None else f"{least!r}")


def test_a_wavelet_with_phase_and_half_cycles(tmp_path: Path) -> None:
    path = tmp_path / "spectrum.nc"
    words = [
        *("--wavelet", "mavroeidis_papageorgiou", "--phase-deg", "90", "--half-cycles", "1.5"),
        *("--slenderness-deg", "14", "--frequency-ratio", "2", "--max-amplitude", "3"),
    ]
    assert main(["spectrum", *words, "--amplitude-step", "0.05", "--output", str(path)]) == 0
    found = read_spectrum(path)
    assert found["half_cycles"].item() == 1.5
    assert 1.0 < found["minimum_overturning_amplitude"].item() < 3.0


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--frequency-ratio", "3", "2"], "--frequency-ratio 2 after 3. Must increase"),
        ([], "--frequency-ratio is missing"),
        (
            ["--frequency-ratio", "3", "--max-amplitude", "0.5"],
            "amplitude 0.5. Must be above 1",
        ),
        (
            ["--frequency-ratio", "3", "--amplitude-step", "0"],
            "step 0.0. Must be above 0",
        ),
        (
            ["--frequency-ratio", "3", "--mass-ratio", "-1"],
            "ratio with -1. Must be zero or pos",
        ),
    ],
)
def test_refused_in_one_line(
    words: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "spectrum.nc"
    asked = ["--wavelet", "symmetric_ricker", "--slenderness-deg", "14", "--output", str(path)]
    assert main(["spectrum", *asked, *words]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not path.exists()


def test_an_unknown_wavelet_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = [
        "--slenderness-deg",
        "14",
        "--frequency-ratio",
        "3",
        "--output",
        str(tmp_path / "a.nc"),
    ]
    with pytest.raises(SystemExit, match="2"):
        main(["spectrum", "--wavelet", "morlet", *words])
    assert "invalid choice: 'morlet' (choose from 'symmetric_ricker'" in capsys.readouterr().err


# Rocking spectra


@pytest.fixture(scope="module")
def records_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file of two records, one with half the amplitude of the other."""
    path = tmp_path_factory.mktemp("records") / "records.nc"
    time = 0.02 * np.arange(400)
    wave = 4.0 * np.sin(2.0 * np.pi * time) * np.exp(-((time - 4.0) ** 2))
    records = [
        Record(record_id=name, acceleration=factor * wave, time_step=0.02)
        for name, factor in (("strong", 1.0), ("weak", 0.5))
    ]
    write_records(((record, None) for record in records), path, input_sha256={}, parameters={})
    return path


def test_rocking_spectra_of_records(
    records_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "rocking.nc"
    words = [
        *("--records", str(records_file), "--slenderness-deg", "8", "14"),
        *("--column-period", "2", "4", "8", "--output", str(path)),
    ]
    assert main(["spectrum", *words, "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["spectra"]
    assert [row["record_id"] for row in rows] == ["strong", "strong", "weak", "weak"]
    found = read_rocking_spectrum(path)
    assert found["peak_rotation_ratio"].dims == (
        *("record", "slenderness", "mass_ratio", "column_period"),
    )
    record = Record(
        record_id="strong",
        acceleration=4.0
        * np.sin(2.0 * np.pi * 0.02 * np.arange(400))
        * np.exp(-((0.02 * np.arange(400) - 4.0) ** 2)),
        time_step=0.02,
    )
    alone = respond(column_of(math.radians(14.0), 0.0, 8.0), record)
    assert_allclose(found["peak_rotation_ratio"][0, 1, 0, 2], alone.peak_rotation_ratio, rtol=1e-12)
    assert main(["spectrum", *words, "--record", "nobody"]) == 2
    assert "Invalid record 'nobody'. Must be one of: strong, weak." in capsys.readouterr().err
