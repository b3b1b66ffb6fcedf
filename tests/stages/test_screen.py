"""The screen stage: scenarios, selections, azimuths, engines, interruptions, messages."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose, assert_array_equal
from tests.screening import names, sine, site, stored, structures, three

from rockframe.cli.main import main
from rockframe.engines.engine import OneProcess, ProcessPool
from rockframe.errors import InputError, ParameterError
from rockframe.options.respond import DesignOptions, Ensemble, ScreenOptions
from rockframe.results.screen import read_screen_history, read_screening
from rockframe.rocking import as_ground, margins, respond, respond_many
from rockframe.stages.screen import screen_stage
from rockframe.study.structures import read_structures

Screen = Callable[..., xr.Dataset]
MEMBERS = ("--scenario-members", "4")


def test_scenarios_are_those_of_the_kernel(screen: Screen, tmp_path: Path) -> None:
    records = site(5)
    found = screen(records)
    frames = read_structures(tmp_path / "structures.toml")
    for i in range(len(records)):
        for k, frame in enumerate(frames):
            for s, scale in enumerate((0.5, 1.0, 2.0)):
                expected = respond(frame, sine("x", scale * (0.5 + 0.4 * i)))
                one = found.isel(record=i, structure=k, scale=s)
                assert int(one["verdict"]) == expected.verdict
                for name in ("peak_rotation_ratio", "peak_u", "peak_v"):
                    assert_allclose(float(one[name]), getattr(expected, name), atol=1e-9)
    assert found["verdict_count"].values.sum(axis=2).tolist() == [[5] * 3] * 2


def test_margins_are_those_of_the_kernel(screen: Screen, tmp_path: Path) -> None:
    records = site(3)[1:]
    ensemble = Ensemble(members=16)
    found = screen(records, margins="robust", ensemble=ensemble)
    expected = margins(records, read_structures(tmp_path / "structures.toml"), ensemble=ensemble)
    for i, row in enumerate(expected):
        for k, margin in enumerate(row):
            one = found.isel(record=i, structure=k)
            assert float(one["critical_scale"]) == margin.critical_scale
            assert int(one["safe_islands"]) == margin.safe_islands
            assert margin.robust is not None
            assert_array_equal(one["robust_scale_25"], margin.robust.s25)
            assert_array_equal(one["robust_error_50"], margin.robust.error50)


#: Several scales, of which each batch of these tests has some: see `few_in_a_batch`.
SCALES = np.linspace(0.5, 2.0, 16).tolist()


@pytest.fixture
def few_in_a_batch(monkeypatch: pytest.MonkeyPatch) -> None:
    """A batch contains four scales of one motion under the two structures."""
    monkeypatch.setattr("rockframe.stages.screening.tasks._RESPONSES", 8)


def test_any_engine_and_batches_write_the_same_bytes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> None:
    """One batch contains all motions; then each contains some of the scales of one motion, in this
    process and in two workers, of which one is killed.

    Only the strong motion has histories to keep, so that only one worker more is started.
    """
    records = [sine("weak", 0.5), sine("strong", 3.0), sine("weaker", 0.4)]
    options = ScreenOptions(scales=SCALES, margins="none", histories="selected")
    output, done = tmp_path / "screen.nc", list[int]()
    screened = partial(
        screen_stage,
        *(stored(records, tmp_path), output, options),
        structures_path=structures(tmp_path),
    )

    def written() -> tuple[bytes, bytes]:
        return output.read_bytes(), output.with_suffix(".csv").read_bytes()

    screened(engine=OneProcess(), progress=lambda _, total: done.append(total))
    files = {written()}
    assert set(done) == {1}
    request.getfixturevalue("few_in_a_batch")
    screened(engine=OneProcess(), progress=lambda _, total: done.append(total))
    files.add(written())
    assert max(done) == 12
    workers: list[subprocess.Popen[bytes]] = []

    def started(*words: Any, **how: Any) -> subprocess.Popen[bytes]:
        workers.append(subprocess.Popen(*words, **how))
        return workers[-1]

    def kill(done: int, _: int) -> None:
        if done == 3:
            workers[0].kill()

    module = SimpleNamespace(Popen=started, PIPE=subprocess.PIPE)
    monkeypatch.setattr("rockframe.engines.pool.subprocess", module)
    screened(engine=ProcessPool(2, patience=0.0), progress=kill)
    files.add(written())
    # two kinds of scenarios, histories, statistics, two tables; and one in place of the killed
    assert len(workers) == 6 + 1
    assert len(files) == 1
    assert read_screening(output).sizes["history"] > 1


@pytest.mark.usefixtures("few_in_a_batch")
def test_interrupted_run_leaves_batches_and_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A run stopped in its fifth batch keeps four; intact ones are not computed again."""
    records, calls = stored(site(3), tmp_path), list[Any]()
    options = ScreenOptions(scales=SCALES, margins="none")
    screened = partial(screen_stage, structures_path=structures(tmp_path), engine=OneProcess())

    def stop(*asked: Any) -> Any:
        calls.append(asked)
        if len(calls) - total == 5:
            raise KeyboardInterrupt
        return respond_many(*asked)

    monkeypatch.setattr("rockframe.structures.rocking.respond_many", stop)
    output, total = tmp_path / "screen.nc", 10**9
    screened(records, tmp_path / "whole.nc", options)
    total = len(calls)
    assert total > 9
    with pytest.raises(KeyboardInterrupt):
        screened(records, output, options)
    (folder,) = tmp_path.glob(".screen-*.batches")
    kept = sorted(folder.iterdir())
    assert len(kept) == 4
    assert not output.exists()
    kept[1].write_bytes(kept[1].read_bytes()[:-40])  # one of them is corrupted
    begun = len(calls)
    screened(records, output, options)
    assert total - 4 <= len(calls) - begun <= total - 2
    assert output.read_bytes() == (tmp_path / "whole.nc").read_bytes()
    assert not list(tmp_path.glob(".screen-*"))


def test_batches_of_other_inputs_are_not_taken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    output = tmp_path / "screen.nc"

    def stop(*_: Any, **__: Any) -> Any:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("rockframe.stages.screen.write_screen_tables", stop)
        with pytest.raises(KeyboardInterrupt):
            screen_stage(
                stored(site(2), tmp_path),
                output,
                options=ScreenOptions(scales=(1.0,), margins="none"),
            )
    assert len(list(tmp_path.glob(".screen-*.batches"))) == 1
    strong = [sine(f"s{n:02d}", 6.0) for n in range(2)]
    screen_stage(
        stored(strong, tmp_path), output, options=ScreenOptions(scales=(1.0,), margins="none")
    )
    assert (read_screening(output)["verdict"].sel(structure="slender-column") == 2).all()
    assert not list(tmp_path.glob(".screen-*.batches"))


def test_fragility_rate_and_design_are_in_the_file(screen: Screen, tmp_path: Path) -> None:
    hazard = tmp_path / "hazard.csv"
    hazard.write_text("pga_g,annual_rate\n0.01,1\n0.1,0.01\n1,0.0001\n", encoding="utf-8")
    design = DesignOptions(dimension="height", range=(2.0, 30.0), limit=0.5, share=0.5, steps=8)
    found = screen(site(12), scales=np.linspace(0.5, 2.0, 6), hazard=hazard, design=design)
    fit = found.sel(structure="slender", measure="pga", limit_state="overturning")
    assert int(fit["fragility_outcome"]) in (0, 3)
    assert int(fit["fragility_motions"]) == 12
    assert (found["annual_rate_low"] <= found["annual_rate_high"]).all()
    shares = found["design_share"].sel(structure="slender").values
    met = found["design_value"].values[shares >= 0.5]
    assert float(found["design_smallest"].sel(structure="slender")) == met[0]
    assert (found["fragility_outcome"].sel(measure="a_p") == 5).all()


def test_candidates_are_screened_as_structures_are(screen: Screen) -> None:
    """A candidate with the width of the structure has the structure's share below the limit."""
    design = DesignOptions(dimension="width", range=(0.45, 0.9), limit=0.4, steps=2)
    found = screen(site(6), design=design)
    ratio = found["peak_rotation_ratio"].sel(structure="slender", scale=1.0)
    stands = found["verdict"].sel(structure="slender", scale=1.0) != 2
    share = float(((ratio < 0.4) & stands).mean())
    assert float(found["design_share"].sel(structure="slender")[0]) == share


def test_ranks_put_the_strongest_first(screen: Screen) -> None:
    found = screen(site(6))
    assert int(np.argmin(found["mean_relative_rank"].values)) == 5
    assert (found["demand_rank"].sum("record") == 21.0).all()


@pytest.mark.parametrize("histories", ["selected", "all"])
def test_histories_of_scenarios_are_kept(screen: Screen, tmp_path: Path, histories: str) -> None:
    records = site(4)
    plain = screen(records)
    found = screen(records, histories=str(histories))
    assert_array_equal(found["peak_rotation_ratio"], plain["peak_rotation_ratio"])
    frame = read_structures(tmp_path / "structures.toml")[1]
    near = found["peak_rotation_ratio"].values >= 0.5
    assert found.sizes["history"] == (near.sum() if histories == "selected" else near.size)
    history = read_screen_history(
        tmp_path / "screen.nc", record="s03", structure="slender", scale=2.0
    )
    expected = respond(frame, as_ground(records[3]).scaled(2.0))
    assert_array_equal(history["theta"].values, expected.theta)
    assert_array_equal(history["time"].values, expected.time)


def test_history_that_was_not_kept_is_refused(screen: Screen, tmp_path: Path) -> None:
    screen(site(2), histories="selected")
    for record, structure, scale, message in (
        ("s00", "stout", 0.5, r"no history of 'stout' under 's00' at scale 0.5 was kept"),
        ("s09", "stout", 0.5, r"Invalid record 's09'. Must be one of: s00, s01"),
        ("s00", "stout", 0.7, r"Invalid scale 0.7. Must be one of: 0.5, 1.0, 2.0"),
    ):
        with pytest.raises(ParameterError, match=message):
            read_screen_history(
                tmp_path / "screen.nc", record=record, structure=structure, scale=scale
            )


def test_hazard_of_a_measure_that_is_not_known(screen: Screen, tmp_path: Path) -> None:
    hazard = tmp_path / "hazard.csv"
    hazard.write_text("a_p_g,annual_rate\n0.1,0.01\n1,0.0001\n", encoding="utf-8")
    with pytest.raises(ParameterError, match="State them with --pulses"):
        screen(site(2), hazard=hazard)


def test_strange_table_is_not_replaced(screen: Screen, tmp_path: Path) -> None:
    (tmp_path / "screen.csv").write_text("my,notes\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"screen.csv: is in the place of the table"):
        screen(site(2))


def test_every_variable_explains_itself(screen: Screen) -> None:
    found = screen(site(3), margins="first")
    for name, variable in found.variables.items():
        assert variable.attrs["long_name"], name
        assert variable.attrs["units"], name


def test_rate_over_pulses_of_turned_pairs_is_refused(tmp_path: Path) -> None:
    records, hazard = stored(three("a"), tmp_path), tmp_path / "site.csv"
    hazard.write_text("a_p_g,annual_rate\n0.1,0.01\n0.2,0.001\n", encoding="utf-8")
    with pytest.raises(ParameterError, match="Remove azimuths_degree"):
        screen_stage(
            records,
            tmp_path / "screen.nc",
            pulses_path=tmp_path / "pulses.nc",
            options=ScreenOptions(hazard=hazard, azimuths_degree=(10.0,)),
        )


def test_azimuths_of_one_name_do_not_share_batches(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An interrupted run left batches of an azimuth that rounds to the same name."""
    records = stored(three("a"), tmp_path)
    exact = ScreenOptions(margins="none", scales=(0.4, 0.6, 0.8), azimuths_degree=(10.0,))
    near = exact.replaced(azimuths_degree=(10.00004,))
    screen_stage(records, tmp_path / "whole.nc", exact, engine=OneProcess())

    def stop(*_: Any, **__: Any) -> Any:
        raise KeyboardInterrupt

    output = tmp_path / "screen.nc"
    with monkeypatch.context() as patched:
        patched.setattr("rockframe.stages.screen.statistics", stop)
        with pytest.raises(KeyboardInterrupt):
            screen_stage(records, output, near, engine=OneProcess())
    assert list(tmp_path.glob(".screen-*.batches"))
    screen_stage(records, output, exact, engine=OneProcess())
    found, whole = (read_screening(tmp_path / name) for name in ("screen.nc", "whole.nc"))
    assert_array_equal(found["peak_rotation_ratio"].values, whole["peak_rotation_ratio"].values)
    assert not list(tmp_path.glob(".screen-*.batches"))


def test_design_says_its_scale_and_what_is_nominal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    records, output = stored(site(1), tmp_path), tmp_path / "s.nc"
    words = ["--structures", str(structures(tmp_path)), "--structure", "slender", "--scales", "0.5"]
    words += ["--design-dimension", "height", "--design-range", "2", "3", "--design-steps", "2"]
    assert main(["screen", str(records), "--output", str(output), *words]) == 0
    told = capsys.readouterr().out
    assert "for 90 % of 1 motions, at scale 0.5 (nominal)" in told
    assert "Over all 1 motions at scale 0.5 (nominal)" in told
    assert main(["screen", str(records), "--output", str(output), *words, *MEMBERS]) == 0
    told = capsys.readouterr().out
    assert "for 90 % of 4 responses (1 motions, 4 members each), at scale 0.5\n" in told
    assert "nominal" not in told


def test_names_of_the_records_made_here() -> None:
    assert names(three("a")) == ["a-e", "a-n", "a-z"]
