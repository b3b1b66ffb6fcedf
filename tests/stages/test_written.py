"""A stage passes on what it wrote, and its command prints that: it does not read the file again."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from tests.commands import run
from tests.screening import site, stored
from xarray.backends import NetCDF4DataStore

from rockframe.options import STAGES, Stage, loaded
from rockframe.results.reading import opened

#: So slender that the records uplift it, and other peaks belong to other scales.
BRIDGE = """
[[structure]]
name = "bent"
height_m = 4.0
width_m = 0.25
mass_ratio = 2.0
[compare.isolated]
period_s = 2.0
strength_ratio = 0.05
"""
OPTIONS: dict[str, dict[str, Any]] = {
    "pulse": {"surrogates": 0},
    "respond": {"margins": "first"},
    "screen": {
        "scales": [0.5, 0.9, 2.0],
        "margins": "first",
        "histories": "all",
        "scenario_members": 3,
        "spectral_periods_s": [1.0],
        "design": {"dimension": "height", "range": (3.0, 6.0), "steps": 3},
    },
    "spectrum": {
        "wavelet": ["symmetric_ricker"],
        "slenderness_degree": [14.0],
        "frequency_ratio": [3.0],
        "max_amplitude": 4.0,
    },
    "rocking_spectrum": {"slenderness_degree": [14.0], "column_period_s": [3.0, 6.0]},
    "compare": {"isolated": {"period_s": 2.0, "strength_ratio": 0.05}},
}


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with three records, their pulses, and a structure with a rival."""
    folder = tmp_path_factory.mktemp("written")
    records = stored(site(3), folder)
    (folder / "structures.toml").write_text(BRIDGE, encoding="utf-8")
    pulse = STAGES["pulse"]
    options = loaded(pulse.options)(**OPTIONS["pulse"])
    loaded(pulse.function)(records, folder / "pulses.nc", options)
    return folder


@pytest.mark.parametrize("stage", STAGES.values(), ids=list(STAGES))
def test_what_is_passed_on_is_what_the_file_holds(home: Path, tmp_path: Path, stage: Stage) -> None:
    """Without series; of a screening, peaks and verdicts at the reference scale only."""
    written: list[xr.Dataset] = []
    output = tmp_path / stage.file
    loaded(stage.function)(
        output=output,
        options=loaded(stage.options)(**OPTIONS[stage.name]),
        written=written.append,
        **{f"{Path(name).stem}_path": home / name for name in stage.inputs},
    )
    (made,) = written
    with opened(output, stage.kind) as dataset:
        stored = dataset.drop_dims("obs", errors="ignore")
        if stage.name == "screen":
            at = stored["scale"].values.tolist().index(stored["reference_scale"].item())
            scenarios = [name for name in stored if stored[name].dims[2:3] == ("scale",)]
            stored = stored.assign({n: stored[n].isel(scale=at, drop=True) for n in scenarios})
        assert set(made.variables) == set(stored.variables)
        for name, variable in stored.variables.items():
            assert made[name].dims == variable.dims
            np.testing.assert_array_equal(made[name].values, variable.values)
            assert {key: str(value) for key, value in made[name].attrs.items()} == {
                key: str(value) for key, value in variable.attrs.items()
            }


FRAME = ("--slenderness-degree", "14")
WORDS = {
    "pulse": ("pulse", "records.nc", "--surrogates", "0"),
    "respond": ("respond", "records.nc", "--structures", "structures.toml", "--margins", "none"),
    "screen": ("screen", "records.nc", "--structures", "structures.toml", "--margins", "none"),
    "spectrum": ("spectrum", *FRAME, "--wavelet", "full_sine", "--frequency-ratio", "3"),
    "rocking_spectrum": ("spectrum", "--records", "records.nc", *FRAME, "--column-period-s", "3"),
    "compare": ("compare", "records.nc", "--structures", "structures.toml"),
}


@pytest.mark.parametrize("stage", STAGES)
def test_a_command_does_not_read_what_it_wrote(
    home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, stage: str
) -> None:
    """Only all scenarios of a screening are read, in parts: they may not fit in memory together."""
    read: list[Path] = []
    opening = NetCDF4DataStore.open

    def noted(path: str, mode: str = "r", **options: Any) -> NetCDF4DataStore:
        if mode == "r":
            read.append(Path(path))
        return opening(path, mode, **options)  # type: ignore[no-untyped-call, no-any-return]

    monkeypatch.setattr(NetCDF4DataStore, "open", noted)
    output = tmp_path / "output.nc"
    with contextlib.chdir(home):
        assert run(*WORDS[stage], "--output", output) == 0
    assert read.count(output) == (1 if stage == "screen" else 0)
