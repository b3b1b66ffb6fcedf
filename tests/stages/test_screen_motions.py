"""Selection of the motions of a screening: filters, azimuths, vertical components, pulses."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose, assert_array_equal
from pydantic import ValidationError
from tests.screening import sine, site, stored, three

from rockframe.cli.main import main
from rockframe.components import pair_horizontals, rotate
from rockframe.errors import InputError, ParameterError, RockframeWarning
from rockframe.options.ingest import Filters
from rockframe.options.pulse import PulseOptions
from rockframe.options.respond import Ensemble, RespondOptions, ScreenOptions
from rockframe.record import SiteType
from rockframe.results.records import read_records
from rockframe.results.screen import read_screening
from rockframe.results.screen_tables import site_note
from rockframe.rocking import draws, respond
from rockframe.stages.pulse import pulse_stage
from rockframe.stages.respond import respond_stage
from rockframe.stages.screen import screen_stage
from rockframe.study.structures import read_structures
from rockframe.units import GRAVITY
from rockframe.wavelets.pulse import Pulse

Screen = Callable[..., xr.Dataset]
#: Which motions are chosen does not depend on the structures.
QUICK = ScreenOptions(scales=(1.0,), margins="none", structure="slender-column")


def test_selection_leaves_out_and_says_why(tmp_path: Path) -> None:
    records = [*site(10), sine("unknown", 2.0)]
    done = screen_stage(
        stored(records, tmp_path),
        tmp_path / "screen.nc",
        filters=Filters(magnitude=(5.25, 9.0), vs30_m_s=(0.0, 330.0)),
        options=QUICK,
    )
    found = read_screening(tmp_path / "screen.nc")
    assert found["record_id"].values.tolist() == ["s03", "s04", "s05", "s06"]
    assert done.left_out["s00"] == "magnitude 5. Must be from 5.25 to 9"
    assert done.left_out["s09"] == "vs30_m_s 380. Must be from 0 to 330"
    assert done.left_out["unknown"] == "magnitude unknown. Must be from 5.25 to 9"
    assert len(done.left_out) == 7
    assert done.rejections == ()
    assert json.loads(found.attrs["left_out"]) == done.left_out


def test_only_the_free_field(tmp_path: Path) -> None:
    places = (SiteType.FREE_FIELD, SiteType.STRUCTURE, SiteType.UNKNOWN)
    records = [replace(one, site_type=place) for one, place in zip(site(3), places, strict=True)]
    done = screen_stage(
        stored(records, tmp_path),
        tmp_path / "screen.nc",
        filters=Filters(site=("free-field",)),
        options=QUICK,
    )
    found = read_screening(tmp_path / "screen.nc")
    assert found["record_id"].values.tolist() == ["s00"]
    assert done.left_out == {
        "s01": "site structure. Must be free-field",
        "s02": "site unknown. Must be free-field",
    }


@pytest.mark.parametrize(
    ("filters", "kept"),
    [
        (Filters(site=("free-field", "unknown")), ["s00", "s02"]),
        (Filters(not_site=("structure", "borehole")), ["s00", "s02"]),
        (Filters(site=("free-field", "borehole"), not_site=("borehole",)), ["s00"]),
    ],
)
def test_sites_are_kept_and_left_out(tmp_path: Path, filters: Filters, kept: list[str]) -> None:
    places = (SiteType.FREE_FIELD, SiteType.STRUCTURE, SiteType.UNKNOWN, SiteType.BOREHOLE)
    records = [replace(one, site_type=place) for one, place in zip(site(4), places, strict=True)]
    screen_stage(
        stored(records, tmp_path),
        tmp_path / "screen.nc",
        filters=filters,
        options=QUICK,
    )
    found = read_screening(tmp_path / "screen.nc")
    assert found["record_id"].values.tolist() == kept
    assert site_note(found) == ""


def test_a_site_may_be_stated_alone_as_in_older_studies() -> None:
    assert Filters.model_validate({"site": "unknown"}).site == ("unknown",)
    with pytest.raises(ValidationError):
        Filters.model_validate({"site": "roof"})


def test_a_screening_says_that_motions_are_not_of_free_ground(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    places = (SiteType.STRUCTURE, SiteType.FREE_FIELD, SiteType.BOREHOLE)
    records = [replace(one, site_type=place) for one, place in zip(site(3), places, strict=True)]
    screen_stage(
        stored(records, tmp_path),
        tmp_path / "screen.nc",
        options=QUICK,
    )
    note = site_note(read_screening(tmp_path / "screen.nc"))
    assert note.startswith(
        "2 of 3 motions are not of free ground: s00 (structure), s02 (borehole). --not-site"
    )
    words = ["screen", str(tmp_path / "records.nc"), "--margins", "none", "--scales", "1"]
    assert main([*words, "--output", str(tmp_path / "again.nc")]) == 0
    assert note in capsys.readouterr().out


def test_flight_of_a_member_names_the_spread_and_the_member(tmp_path: Path) -> None:
    """At scale 2 the motion itself falls at 0.95 g, and a member with an amplitude above 1.05
    faster than gravity."""
    upward = 0.475 * GRAVITY
    options = ScreenOptions(
        scales=(2.0,), margins="none", vertical=True, scenario_members=16,
        ensemble=Ensemble(amplitude=0.2),
    )  # fmt: skip
    with pytest.raises(ParameterError) as caught:
        screen_stage(stored(three("s", upward), tmp_path), tmp_path / "screen.nc", options)
    message = str(caught.value)
    found = re.search(r"spread amplitude 0.2 of the ensemble: member (\d+) has ([\d.]+) times "
                      r"the motion at scale 2", message)  # fmt: skip
    assert found is not None, message
    ensemble = options.scenario_ensemble()
    assert ensemble is not None
    drawn = draws(ensemble)[:, 3]
    assert float(found[2]) == pytest.approx(drawn[int(found[1]) - 1], rel=1e-3)
    assert float(found[2]) == pytest.approx(drawn.max(), rel=1e-3)


def test_empty_selection_is_named(screen: Screen) -> None:
    with pytest.raises(ParameterError, match=r"no record is left to screen; 's00': pga_g 0.05"):
        screen(site(3), filters=Filters(pga_g=(5.0, 6.0)))


def test_range_that_is_none() -> None:
    with pytest.raises(ParameterError, match=r"pulse_length_m \[2, 1\]. The lower bound must"):
        ScreenOptions(pulse_length_m=(2.0, 1.0))


@pytest.mark.parametrize("like", [True, False])
def test_a_filter_of_pulses_needs_pulses_of_the_motions(
    screen: Screen, tmp_path: Path, like: bool
) -> None:
    with pytest.raises(ParameterError, match=r"pulse_like needs pulses"):
        screen(site(1), pulse_like=like)
    with pytest.raises(ParameterError, match=r"pulse_like and azimuths_degree"):
        screen(
            site(1),
            pulse_like=like,
            pulses_path=tmp_path / "pulses.nc",
            azimuths_degree=[10.0],
        )


@pytest.mark.parametrize(
    ("scales", "message"),
    [
        ([1.0, 0.5], "scales 0.5 after 1. Must increase"),
        ([1.0, 1.0], "scales 1 after 1. Must increase"),
        ([0.0, 1.0], "scales with 0. Must be above 0"),
        ([1.0, math.inf], "scales with an infinite number"),
        ([], "scales .*Must be a list of one or more"),
    ],
)
def test_scales_must_increase(screen: Screen, scales: list[float], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        screen(site(2), scales=scales)


def test_azimuths_turn_the_pairs(screen: Screen, tmp_path: Path) -> None:
    records = [*three("a"), *three("b")]
    found = screen(records, azimuths_degree=[0.0, 30.0, 90.0])
    assert found.sizes["record"] == 6
    assert found["cluster"].values.tolist() == [0, 0, 0, 1, 1, 1]
    assert found["azimuth"].values.tolist() == [0.0, 30.0, 90.0] * 2
    (pair, _), _ = pair_horizontals(read_records(tmp_path / "records.nc"))
    turned = rotate(pair, 30.0)
    frame = read_structures(tmp_path / "structures.toml")[1]
    one = found.sel(structure="slender", scale=1.0).isel(record=1)
    assert str(one["record_id"].item()) == turned.record_id
    assert float(one["pga"]) == float(np.abs(turned.acceleration).max())
    assert_allclose(float(one["peak_rotation_ratio"]), respond(frame, turned).peak_rotation_ratio)
    at = found.sel(scale=1.0).isel(record=slice(3))
    ratios = np.where(at["verdict"] == 2, math.inf, at["peak_rotation_ratio"])
    for name, expected in (("00", ratios.min(axis=0)), ("100", ratios.max(axis=0))):
        assert_array_equal(found[f"rotd{name}_peak_rotation_ratio"].values[0], expected)
    assert found["recording"].size == 2


def test_azimuths_without_a_pair_are_named(tmp_path: Path) -> None:
    records = stored([*three("a"), sine("alone", 3.0)], tmp_path)
    output = tmp_path / "screen.nc"
    done = screen_stage(
        records,
        output,
        options=QUICK.replaced(azimuths_degree=(45.0,)),
    )
    assert [(r.file, "no other horizontal" in r.reason) for r in done.rejections] == [
        ("alone", True)
    ]
    assert json.loads(read_screening(output).attrs["left_out"])["alone"]
    with pytest.raises(ParameterError, match=r"left to screen; 'alone': no other horizontal"):
        screen_stage(
            stored([sine("alone", 3.0)], tmp_path),
            output,
            options=ScreenOptions(azimuths_degree=(45.0,)),
        )


def test_vertical_is_felt_and_turned_with_its_pair(screen: Screen) -> None:
    still, felt = (screen(three("a"), vertical=vertical) for vertical in (False, True))
    turned = screen(three("a"), vertical=True, azimuths_degree=[0.0, 90.0])
    name = "peak_rotation_ratio"
    assert (still[name].values != felt[name].values).any()
    assert_array_equal(turned[name].values[::-1], felt[name].values)  # east is recorded first


def test_vertical_of_another_length_is_named(tmp_path: Path) -> None:
    east, north, up = three("a")
    short = sine("a-z", 0.5, station="a", orientation=up.orientation, time_step=0.005)
    with pytest.raises(ParameterError, match=r"no vertical record of the same .*time step"):
        screen_stage(
            stored([east, north, short], tmp_path),
            tmp_path / "s.nc",
            options=ScreenOptions(vertical=True),
        )


def test_vertical_that_would_fall_at_the_largest_scale_is_left_out(tmp_path: Path) -> None:
    records = stored([*three("a"), *three("b", upward=6.0)], tmp_path)
    options = QUICK.replaced(vertical=True, scales=(1.0, 2.0))
    done = screen_stage(records, tmp_path / "s.nc", options)
    assert [r.file for r in done.rejections] == ["b-e", "b-n"]
    assert "lose contact" in done.rejections[0].reason


def test_pulses_are_measures_and_must_be_of_the_same_records(tmp_path: Path) -> None:
    records, output = stored(site(4), tmp_path), tmp_path / "screen.nc"
    pulses = tmp_path / "pulses.nc"
    pulse_stage(records, pulses, PulseOptions(wavelet=("symmetric_ricker",), surrogates=0))
    options = QUICK.replaced(pulse_period_s=(0.5, 2.0))
    screen_stage(records, output, options, pulses_path=pulses)
    found = read_screening(output)
    assert_allclose(found["L_p"], found["a_p"] * found["T_p"] ** 2, rtol=1e-12)
    for others, words in (
        ([one.scaled(1.1) for one in site(4)], "pulse of 's00' was computed from other samples"),
        ([sine("other", 1.0)], "contains no pulse of these records"),
    ):
        with pytest.raises(InputError, match=rf"pulses.nc: .*{words}"):
            screen_stage(stored(others, tmp_path), output, options, pulses_path=pulses)


def test_pulses_hold_for_the_same_samples_in_another_file(tmp_path: Path) -> None:
    """Ingesting a motion again with a catalogue changes the file, but not its pulse."""
    records, output = stored(site(4), tmp_path), tmp_path / "screen.nc"
    pulses = tmp_path / "pulses.nc"
    pulse_stage(records, pulses, PulseOptions(wavelet=("symmetric_ricker",), surrogates=0))
    again = [replace(one, magnitude=6.5) for one in site(5)[1:]]
    screen_stage(stored(again, tmp_path), output, QUICK, pulses_path=pulses)
    found = read_screening(output)
    assert found["magnitude"].values.tolist() == [6.5] * 4
    assert np.isfinite(found["T_p"].values).tolist() == [True, True, True, False]
    respond_stage(
        tmp_path / "records.nc",
        tmp_path / "response.nc",
        RespondOptions(margins="none", structure="slender-column"),
        pulses_path=pulses,
    )


def test_motions_are_selected_by_the_likeness_of_their_pulse(tmp_path: Path) -> None:
    """A Ricker pulse is pulse-like; noise of the same length is not."""
    time = 0.01 * np.arange(2000)
    pulse = Pulse(wavelet="symmetric_ricker", a_p=4.0, T_p=1.0, time=10.0)
    noise = np.random.default_rng(3).normal(size=time.size)
    records = [
        sine("pulse", 0.0, acceleration=pulse.acceleration(time)),
        sine("noise", 0.0, acceleration=noise),
    ]
    path, pulses = stored(records, tmp_path), tmp_path / "pulses.nc"
    pulse_stage(path, pulses, PulseOptions(wavelet=("symmetric_ricker",)))
    for like, name in ((True, "pulse"), (False, "noise")):
        done = screen_stage(
            path,
            tmp_path / "screen.nc",
            pulses_path=pulses,
            options=QUICK.replaced(pulse_like=like),
        )
        found = read_screening(tmp_path / "screen.nc")
        assert found["record_id"].values.tolist() == [name]
        assert len(done.left_out) == 1


def test_azimuths_beyond_a_circle_warn() -> None:
    with pytest.warns(
        RockframeWarning, match="azimuth 370 degrees is beyond 360: taken modulo 360, as 10"
    ):
        ScreenOptions(azimuths_degree=(0.0, 370.0))
