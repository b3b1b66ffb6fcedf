"""Margins: scaling of critical scales, and verdicts that small changes reverse."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rockframe.errors import ParameterError
from rockframe.frame import RockingFrame
from rockframe.ingest import read_file
from rockframe.options.ingest import IngestOptions
from rockframe.options.respond import Ensemble
from rockframe.record import Record
from rockframe.results.records import read_records
from rockframe.rocking import (
    GroundAcceleration,
    Margin,
    Verdict,
    ensemble_responses,
    margins,
    respond,
    respond_many,
    robust_margins,
)
from rockframe.rocking.margins.first_overturning import least_scale_of
from rockframe.rocking.margins.robust import resampled
from rockframe.stages.ingest import ingest_stage
from rockframe.study.structures import SHIPPED_STRUCTURES, read_structures
from rockframe.units import GRAVITY
from rockframe.wavelets.pulse import Pulse

from .motions import BENT, noise

COLUMN = RockingFrame(height=9.6, width=1.6)
PULSE = Pulse(wavelet="symmetric_ricker", a_p=0.5 * GRAVITY, T_p=1.5)


def margin(frame: RockingFrame, motion: Record | Pulse | GroundAcceleration) -> Margin:
    return margins([motion], [frame])[0][0]


def stronger(factor: float) -> Pulse:
    return Pulse(wavelet=PULSE.wavelet, a_p=factor * PULSE.a_p, T_p=PULSE.T_p)


def test_the_critical_scale_overturns_and_what_is_below_does_not() -> None:
    critical = margin(BENT, PULSE).critical_scale
    assert respond(BENT, stronger(critical)).verdict is Verdict.OVERTURNS
    assert respond(BENT, stronger(critical * (1.0 - 2e-6))).verdict is Verdict.STANDS


def test_a_motion_twice_as_strong_has_half_the_critical_scale() -> None:
    once, twice = margin(BENT, PULSE), margin(BENT, stronger(2.0))
    assert_allclose(2.0 * twice.critical_scale, once.critical_scale, rtol=2e-6)


def test_islands_are_those_of_the_verdict() -> None:
    """The edges of islands are half-way between samples at most 2.56 % apart."""
    searched = margin(BENT, PULSE)
    (start, end), *_ = searched.islands
    assert searched.safe_islands == len(searched.islands)
    assert respond(BENT, stronger(0.5 * (start + end))).verdict is Verdict.STANDS
    assert respond(BENT, stronger(1.013 * end)).verdict is Verdict.OVERTURNS


@pytest.mark.parametrize("number", range(0, 30, 3))
def test_the_first_edge_under_pulses(expected: Callable[[str], Any], number: int) -> None:
    """For regular responses the search finds the known edge."""
    row = expected("b_fig9")["rows"][number]
    frame = RockingFrame(
        height=4.0,
        width=4.0 * math.tan(math.radians(row["alpha_deg"])),
        mass_ratio=row["gamma"],
    )
    motion = Pulse(
        wavelet=f"{row['pulse']}_ricker",
        a_p=frame.uplift_acceleration,
        T_p=math.tau / (row["omega_p_over_p"] * frame.frequency_parameter),
    )
    [[margin_of_frame]] = margins([motion], [frame], largest_scale=60.0)
    first = row["first_overturning"]
    assert_allclose(
        margin_of_frame.critical_scale, math.nan if first is None else first, rtol=1.01e-6
    )


#: Record, structure, ends of a sliver in which it overturns, and the edge above the sliver that a
#: scan in steps of 0.5 % finds. Another solver found the slivers in steps of 1e-4.
SLIVERS = (
    ("Ridgecrest2019-CCC-090", "slender-column", 0.60499, 0.60552, 0.6886),
    ("Ridgecrest2019-CLC-360", "slender-column", 0.88765, 0.88840, 0.9702),
    ("Ridgecrest2019-CCC-360", "slender-frame", 0.48160, 0.48207, 0.5074),
)


@pytest.fixture(scope="module")
def ridgecrest(
    bundled_records: Path, tmp_path_factory: pytest.TempPathFactory
) -> dict[str, Record]:
    path = tmp_path_factory.mktemp("ridgecrest") / "records.nc"
    files = [bundled_records / f"Ridgecrest2019-{name}.V1" for name in ("CCC", "CLC", "TOW2")]
    # The slivers were found in records with this corner.
    ingest_stage(files, path, IngestOptions(band_pass_hz=(0.1, 40.0)))
    return {record.record_id: record for record in read_records(path)}


@pytest.mark.parametrize(("name", "structure", "lower", "upper", "edge"), SLIVERS)
def test_slivers_are_found(
    ridgecrest: dict[str, Record],
    name: str,
    structure: str,
    lower: float,
    upper: float,
    edge: float,
) -> None:
    frame = {
        structure_named.name: structure_named
        for structure_named in read_structures(SHIPPED_STRUCTURES)
    }[structure]
    within = np.linspace(lower + 1e-5, upper - 1e-5, 9)
    assert (respond_many([ridgecrest[name]], [frame], within).verdict == Verdict.OVERTURNS).all()
    [[margin_of_record]] = margins([ridgecrest[name]], [frame])
    assert margin_of_record.critical_scale < lower + 2e-5
    first = margin_of_record.first
    assert first.lower <= first.upper < edge < first.prevails_from
    assert 0.0 < first.share_before < 0.5
    assert 0.0 < first.standing_share < 1.0
    assert first.responses < 1500


def test_a_sliver_between_two_excursions_that_have_counterparts_is_found(
    ridgecrest: dict[str, Record],
) -> None:
    """The response is regular on both sides of this sliver, but close to the separatrix."""
    height, slenderness = 3.784993696130941, 0.14224387154105694
    frame = RockingFrame(height=height, width=height * math.tan(slenderness))
    record = ridgecrest["Ridgecrest2019-CLC-360"]
    within = np.linspace(0.97672, 0.97687, 9)
    assert (respond_many([record], [frame], within).verdict == Verdict.OVERTURNS).all()
    assert margins(record, frame).critical_scale == pytest.approx(0.97671, abs=1e-5)


def test_an_overturning_that_is_regular_prevails_from_the_first() -> None:
    """Under this pulse the samples show a single interval of overturning."""
    first = margin(BENT, PULSE).first
    assert first.prevails_from == first.lower
    assert math.isnan(first.share_before)


@pytest.mark.parametrize("a_p", [0.0, 0.01])
def test_a_motion_that_overturns_at_no_scale(a_p: float) -> None:
    searched = margin(BENT, Pulse(wavelet="symmetric_ricker", a_p=a_p, T_p=1.5))
    assert math.isnan(searched.critical_scale)
    assert (searched.safe_islands, searched.largest_scale) == (0, 10.0)


def test_an_ensemble_warns_where_the_frame_as_given_stands() -> None:
    """At 3 % below the critical scale the frame stands, but 10 % of an ensemble overturn."""
    motion = stronger(0.97 * margin(BENT, PULSE).critical_scale)
    [[searched]] = margins([motion], [BENT], ensemble=Ensemble())
    assert searched.robust == robust_margins([motion], [BENT])[0][0]
    assert searched.robust.s10 < 1.0 < searched.critical_scale


def test_members_that_change_sides_with_finer_samples_are_counted() -> None:
    """Straight lines over a quarter of a second cut off the top of the pulse: with the samples
    given no member overturns, and with finer ones some do.
    """
    pulse = Pulse(wavelet="symmetric_ricker", a_p=1.16 * PULSE.a_p, T_p=PULSE.T_p, time=5.0)
    coarse = GroundAcceleration.from_samples(pulse.acceleration(np.arange(0.0, 10.1, 0.25)), 0.25)
    [[given]] = ensemble_responses([coarse], [BENT])
    [[finer]] = ensemble_responses([resampled(coarse)], [BENT])
    [[margins]] = robust_margins([coarse], [BENT])
    assert given.overturned == 0
    assert margins.sampling_changes == finer.overturned > 0
    assert robust_margins([PULSE], [BENT])[0][0].sampling_changes == 0  # it has no samples


def test_a_continuous_pulse_has_no_time_step_to_change() -> None:
    ground = GroundAcceleration.from_pulse(PULSE)
    assert resampled(ground) is ground


def test_finer_samples_lie_on_the_band_limited_function() -> None:
    time = 0.5 * np.arange(400)
    for frequency in (0.05, 0.4, 0.8):  # half the sampling rate is 1 Hz
        coarse = GroundAcceleration.from_samples(np.cos(math.tau * frequency * time), 0.5)
        finer = resampled(coarse)
        inner = slice(100, -100)
        exact = np.cos(math.tau * frequency * finer.time)
        assert_allclose(finer.acceleration()[inner], exact[inner], rtol=0, atol=1e-4)
        assert_allclose(finer.acceleration()[::2], coarse.acceleration(), rtol=0, atol=0)


def test_finer_samples_of_both_components() -> None:
    across, upwards = (
        GroundAcceleration.from_samples(noise(seed, 50, 0.1), 0.01) for seed in (1, 2)
    )
    finer = resampled(across.with_vertical(upwards))
    assert finer.vertical is not None
    assert_allclose(finer.vertical, resampled(upwards).coefficients, rtol=0, atol=1e-12)


def test_a_vertical_acceleration_ends_the_scan() -> None:
    """At 1 / 0.4 times this motion the ground would fall faster than gravity."""
    across = GroundAcceleration.from_samples(noise(3, 400, 0.5), 0.01)
    upwards = GroundAcceleration.from_samples(np.full(401, -0.4 * GRAVITY)[:400], 0.01)
    searched = margin(BENT, across.with_vertical(upwards))
    assert_allclose(searched.largest_scale, 2.5, rtol=1e-8)


@pytest.mark.parametrize("upwards", [-0.4, 0.4])
def test_no_frame_uplifts_below_its_least_scale(upwards: float) -> None:
    """Over constant ground accelerations a and b, frames uplift at s a = tan alpha (g + s b)."""
    held = GroundAcceleration.from_samples(np.full(200, upwards * GRAVITY), 0.01)
    ground = GroundAcceleration.from_samples(np.full(200, 0.6 * GRAVITY), 0.01).with_vertical(held)
    tangent = BENT.uplift_acceleration / GRAVITY
    uplifts = tangent / (0.6 - tangent * upwards)
    least = least_scale_of(ground, BENT)
    assert least <= uplifts * (1.0 + 1e-12)
    assert_allclose(least, tangent / (0.6 + tangent * abs(upwards)), rtol=1e-12)
    assert respond(BENT, ground.scaled(0.999 * uplifts)).peak_rotation == 0.0
    assert respond(BENT, ground.scaled(1.001 * uplifts)).peak_rotation > 0.0


def test_bounds_of_a_vertical_acceleration_contain_it() -> None:
    """Between its nodes, a curved acceleration dips below both."""
    span: dict[str, Any] = {"start_time": 0.0, "end_time": 4.0, "intervals": 5, "degree": 4}
    across = GroundAcceleration.from_function(np.zeros_like, **span)
    assert across.upward_bounds() == (0.0, 0.0)
    curved = GroundAcceleration.from_function(lambda t: np.cos(7.0 * t), **span)
    for upwards in (curved, curved.scaled(-1.0)):
        low, high = across.with_vertical(upwards).upward_bounds()
        inside = np.linspace(0.0, upwards.time_step, 50)
        values = np.polynomial.polynomial.polyval(inside, upwards.coefficients.T)
        assert low <= values.min() < -0.9
        assert high >= values.max() > 0.9


def test_the_same_whatever_is_beside() -> None:
    motions = [GroundAcceleration.from_samples(noise(k, 600, 0.9), 0.02) for k in (1, 2)]
    together = margins(motions, [BENT, COLUMN])
    assert repr(margins([motions[1]], [COLUMN])) == repr([[together[1][1]]])


@pytest.mark.parametrize("largest", [0.9, math.inf, math.nan])
def test_refused_largest_scale(largest: float) -> None:
    with pytest.raises(ParameterError, match=r"Invalid largest scale .*\. Must be 1 or more"):
        margins([PULSE], [BENT], largest_scale=largest)


def test_one_archives_copy_of_a_record_decides_nothing(peer_records: Path) -> None:
    """The paper's column stands by 0.03 %; another archive's copy of the record reverses this."""
    (record,) = read_file(peer_records / "northridge1994_Jensen-022.csv")
    of_frame, of_column = margins([record], [BENT, COLUMN])[0]
    assert_allclose(of_column.critical_scale, 1.0003, rtol=0, atol=1e-4)
    assert_allclose(respond(COLUMN, record).peak_rotation_ratio, 0.907, rtol=0, atol=1e-3)
    assert_allclose(of_frame.critical_scale, 1.302, rtol=0, atol=1e-3)


def test_nothing_to_shake_is_an_error() -> None:
    with pytest.raises(ParameterError, match="Invalid number of motions, 0"):
        margins([], [RockingFrame(height=2.0, width=0.4)])
