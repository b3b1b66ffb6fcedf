"""The section of the report on a screening: its paths compared with the plotted numbers."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose
from tests.screening import site

from rockframe.options.respond import DesignOptions
from rockframe.report.page import screening_content
from rockframe.rocking import Verdict
from rockframe.units import GRAVITY
from rockframe.web import PLOT_SIZE, Plot

Screen = Callable[..., xr.Dataset]
WIDTH, HEIGHT = PLOT_SIZE


def points_of(path: str) -> np.ndarray:
    return np.array([pair.split() for pair in path.strip("MZ").split("L")], dtype=float)


def test_curves_are_the_probabilities(screen: Screen, tmp_path: Path) -> None:
    hazard = tmp_path / "hazard.csv"
    hazard.write_text("pga_g,annual_rate\n0.01,1\n0.1,0.01\n1,0.0001\n", encoding="utf-8")
    design = DesignOptions(dimension="height", range=(2.0, 30.0), steps=4)
    asked = {"hazard": hazard, "design": design, "limit_peak_u_m": (0.1,)}
    found = screen(site(6), scales=np.geomspace(0.5, 3.0, 8), **asked)
    content = screening_content(found)
    states: list[tuple[str, list[Plot]]] = dict(content["fragility"])["slender"]
    assert [title for title, _ in states] == ["overturning", "u ≥ 0.1 m"]
    fits = found.sel(structure="slender", measure="pga")
    for k, (title, plots) in enumerate(states):
        pga, fit = plots[0], fits.isel(limit_state=k)
        assert [name for name, _ in pga.curves] == [title, "overturning"][: 1 + k]
        if np.isfinite(fit["fragility"]).all():
            x, y = points_of(pga.curves[0][1]).T
            assert_allclose(1.0 - y / HEIGHT, fit["fragility"], atol=1e-3)
            assert_allclose(np.diff(x), WIDTH / 100.0, atol=0.11)
            assert pga.title == f"PGA [g], median {float(fit['fragility_median']) / GRAVITY:.3g}"
            assert pga.median is not None
            assert_allclose(np.interp(pga.median, x, y), 0.5 * HEIGHT, atol=0.5)
        band = points_of(pga.bands[0])[:, 1]
        assert_allclose(1.0 - band[:101] / HEIGHT, fit["fragility_low"], atol=1e-3)
    shares = points_of(dict(content["design"]["plot"].curves)["stout"])[:, 1]
    assert_allclose(1.0 - shares / HEIGHT, found["design_share"].sel(structure="stout"), atol=1e-3)
    assert [len(one["rates"]) for one in content["summary"]] == [2, 2]
    ranks = [motion[0]["mean_relative_rank"] for motion in content["ranking"]]
    assert ranks == sorted(found["mean_relative_rank"].values)


def test_of_many_structures_the_first_are_shown(
    screen: Screen, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The plots of a thousand structures would be a page of 20 MB."""
    found = screen(site(6), scales=[2.0])
    whole = screening_content(found)
    monkeypatch.setattr("rockframe.report.page._MOST_STRUCTURES", 1)
    first = screening_content(found)
    assert (first["structures"], first["all_structures"]) == (["stout"], 2)
    assert str(first["summary"]) == str(whole["summary"][:1])  # NaN is not equal to itself
    assert [len(motion) for motion in first["ranking"]] == [1] * 6


def test_the_ranking_says_which_motions_overturn(screen: Screen) -> None:
    """A peak of a structure that overturns only describes its fall."""
    found = screen(site(6), scales=[2.0])
    peaks = found["peak_rotation_ratio"].isel(scale=0)
    stands = peaks.where(found["verdict"].isel(scale=0) != Verdict.OVERTURNS)
    wanted = ["overturns" if np.isnan(one) else f"{one:.3f}" for one in stands.values.ravel()]
    ranking = screening_content(found)["ranking"]
    assert sorted(row["demand"] for motion in ranking for row in motion) == sorted(wanted)
    assert 0 < wanted.count("overturns") < len(wanted)
