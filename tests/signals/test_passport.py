"""The record passport: measures match closed forms, damage is found, real records pass."""

from __future__ import annotations

import csv
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

from rockframe.errors import InputError, ParameterError
from rockframe.ingest import read_file
from rockframe.options.ingest import IngestOptions, PassportLimits
from rockframe.paper.pulses import paper_records
from rockframe.record import Record, SiteType
from rockframe.results.records import read_records
from rockframe.signals.measures import (
    arias_intensity,
    clipped_samples,
    cumulative_absolute_velocity,
    housner_intensity,
    longest_constant,
    opening_share,
    significant_duration,
    spectral_acceleration,
)
from rockframe.signals.noise import pre_event, signal_to_noise_band, usable_periods
from rockframe.signals.passport import CheckVerdict, Passport, passport
from rockframe.signals.processing import BandPass, correct, integrate
from rockframe.stages.ingest import ingest_stage
from rockframe.study.toml import read_limits
from rockframe.units import GRAVITY

Float = NDArray[np.float64]
STEP = 0.01
TIME: Float = STEP * np.arange(4001, dtype=np.float64)


def hum(level: float = 1e-3) -> Float:
    return level * np.random.default_rng(3).standard_normal(TIME.size)


def shake(frequency: float = 1.0) -> Float:
    """Return 10 s of rest, then a burst that starts and ends with zero acceleration."""
    since = np.clip(TIME - 10.0, 0.0, 20.0)
    return np.asarray(np.sin(2 * np.pi * frequency * since) * np.sin(np.pi * since / 20) ** 2)


def record_of(samples: Float, *, uncorrected: bool = False) -> Record:
    return Record(record_id="made", acceleration=samples, time_step=STEP, uncorrected=uncorrected)


def checked(samples: Float, **limits: float) -> Passport:
    record = record_of(samples)
    return passport(record, record, PassportLimits(**limits))


def verdict(result: Passport, name: str) -> CheckVerdict:
    (check,) = (check for check in result.checks if check.name == name)
    return check.verdict


def test_arias_intensity_of_a_sine_is_that_of_its_mean_square() -> None:
    sine = 3.0 * np.sin(2 * np.pi * TIME)
    assert arias_intensity(sine, STEP) == pytest.approx(math.pi / (2 * GRAVITY) * 4.5 * 40.0)


def test_arias_intensity_grows_with_the_square() -> None:
    assert arias_intensity(2 * shake(), STEP) == pytest.approx(4 * arias_intensity(shake(), STEP))


def test_cav_of_a_sine_is_two_over_pi_of_its_amplitude_times_the_duration() -> None:
    sine = 3.0 * np.sin(2 * np.pi * TIME)
    velocity = cumulative_absolute_velocity(sine, STEP)
    assert velocity == pytest.approx(2.0 / math.pi * 3.0 * 40.0, rel=1e-3)


def test_cav_grows_with_the_amplitude_and_does_not_depend_on_the_sign() -> None:
    velocity = cumulative_absolute_velocity(-2 * shake(), STEP)
    assert velocity == pytest.approx(2 * cumulative_absolute_velocity(shake(), STEP))
    assert checked(shake()).measures.cumulative_absolute_velocity == pytest.approx(velocity / 2)


def test_no_measure_changes_the_samples() -> None:
    """Some programs set weak seconds to zero in the caller's array, so that the order decides."""
    samples = shake() + hum()
    before = samples.copy()
    for measure in (
        arias_intensity,
        cumulative_absolute_velocity,
        significant_duration,
        housner_intensity,
        opening_share,
        longest_constant,
    ):
        measure(samples, STEP)
    spectral_acceleration(samples, STEP, [0.1, 1.0])
    clipped_samples(samples)
    pre_event(samples, STEP)
    correct(samples, STEP, BandPass())
    np.testing.assert_array_equal(samples, before)


def test_measures_of_a_scaled_motion_are_those_of_its_samples() -> None:
    """All of them, so that no new measure is forgotten."""
    samples = hum() + shake()
    scaled = checked(samples).measures.scaled(0.3)
    assert vars(scaled) == pytest.approx(vars(checked(0.3 * samples).measures), nan_ok=True)


@pytest.mark.parametrize(("end", "expected"), [(0.95, 36.0), (0.75, 28.0)])
def test_significant_duration_of_constant_shaking(end: float, expected: float) -> None:
    begin, finish = significant_duration(np.ones(4001), STEP, 0.05, end)
    assert begin == pytest.approx(2.0)
    assert finish - begin == pytest.approx(expected)


def test_significant_duration_forgets_the_scale_and_shifts_with_the_motion() -> None:
    now = np.array(significant_duration(shake(), STEP))
    later = significant_duration(1e200 * np.r_[np.zeros(100), shake()], STEP)
    np.testing.assert_allclose(later, now + 1.0)


def test_significant_duration_wants_shares_in_order() -> None:
    with pytest.raises(ParameterError, match=r"shares 0.95 and 0.05 .* the lower one first"):
        significant_duration(shake(), STEP, 0.95, 0.05)


@pytest.mark.parametrize("measure", [significant_duration, opening_share])
def test_stillness_is_no_motion(measure: object) -> None:
    with pytest.raises(ParameterError, match=r"all 10 samples are zero"):
        measure(np.zeros(10), STEP)  # type: ignore[operator]


@pytest.mark.parametrize(
    ("step", "expected"),
    [(0.1, CheckVerdict.OK), (0.25, CheckVerdict.WARN), (10.0, CheckVerdict.REJECT)],
)
def test_milliseconds_are_not_taken_for_seconds(step: float, expected: CheckVerdict) -> None:
    record = replace(record_of(shake()), time_step=step)
    assert verdict(passport(record, record, PassportLimits()), "time_step") is expected


@pytest.mark.parametrize(
    ("site", "expected"),
    [
        ("UNKNOWN", "NOT_MEASURED"),
        ("FREE_FIELD", "OK"),
        ("STRUCTURE", "WARN"),
        ("BOREHOLE", "WARN"),
    ],
)
def test_a_floor_or_a_borehole_is_not_the_free_field(site: str, expected: str) -> None:
    record = replace(record_of(hum() + shake()), site_type=SiteType[site])
    result = passport(record, record, PassportLimits())
    assert verdict(result, "not_free_field").name == expected
    refused = passport(record, record, PassportLimits(not_free_field_reject=0.0))
    assert bool(refused.rejections) == (expected == "WARN")


@pytest.mark.parametrize(
    ("component", "azimuth", "expected"),
    [
        *(("UP", math.nan, "NOT_MEASURED"), ("090", 90.0, "OK"), ("360", 360.0, "OK")),
        *(("HNE", 370.0, "WARN"), ("361", math.nan, "WARN")),
    ],
)
def test_azimuths_beyond_a_circle_warn(component: str, azimuth: float, expected: str) -> None:
    """370 comes from a header; 361 is in a name, and is therefore not taken as an azimuth."""
    record = replace(record_of(hum() + shake()), component=component, azimuth=azimuth)
    assert verdict(passport(record, record, PassportLimits()), "azimuth").name == expected


def test_clipping_is_found_where_it_was_done() -> None:
    sine = np.sin(2 * np.pi * TIME + 0.1)
    assert clipped_samples(sine) == 1
    run = clipped_samples(np.clip(sine, -0.8, 2.0) + 5.0)
    # The sine is below -0.8 for a share 2 acos(0.8) / 2 pi of its period of 100 samples.
    assert run == pytest.approx(100 * math.acos(0.8) / math.pi, abs=1)


def test_rest_after_a_one_sided_pulse_is_not_clipping() -> None:
    assert clipped_samples(np.r_[np.sin(np.pi * np.arange(0, 1, 0.013)), np.zeros(500)]) == 1


@pytest.mark.parametrize(("least", "run"), [(-0.51, 3), (-0.49, 1)])
def test_an_extreme_less_than_half_as_far_as_the_other_is_not_clipped(
    least: float, run: int
) -> None:
    around = np.zeros(50)
    assert clipped_samples(np.r_[around, 1.0, around, least, least, least, around] + 7.0) == run


def test_a_held_value_is_a_gap() -> None:
    held = shake()
    held[1500:1571] = held[1500]
    assert longest_constant(held[1200:1800], STEP) == pytest.approx(0.70)


@pytest.mark.parametrize(
    ("ratio", "expected"),
    [(1.004, "OK"), (math.nan, "NOT_MEASURED"), (0.98, "WARN"), (1.6, "REJECT"), (-1.0, "REJECT")],
)
def test_the_peak_is_held_to_the_stated_one(ratio: float, expected: str) -> None:
    record = replace(record_of(hum() + shake()), peak_ratio=ratio)
    result = passport(record, record, PassportLimits())
    assert verdict(result, "stated_peak").name == expected
    np.testing.assert_equal(result.measures.stated_peak, abs(ratio - 1.0))


def test_opening_share_is_that_of_a_record_cut_at_its_start() -> None:
    assert opening_share(shake(), STEP) == 0.0
    assert opening_share(shake()[1850:], STEP) > 0.5


@pytest.mark.parametrize(("place", "share"), [(9, 0.5), (10, 0.0)])
def test_the_opening_is_a_tenth_of_a_second(place: int, share: float) -> None:
    samples = np.zeros(1000)
    samples[[place, 500]] = 1.0, -2.0
    assert opening_share(samples, 0.01) == share


def test_closing_share_is_that_of_a_record_cut_at_its_end() -> None:
    assert opening_share(shake()[::-1], STEP) < 1e-9
    assert opening_share(shake()[:2150][::-1], STEP) > 0.5
    assert "closing_share" in checked(shake()[:2150]).warnings


def test_noise_before_the_event_has_the_level_that_was_put_in() -> None:
    length, level = pre_event(hum() + shake() + 0.2, STEP)
    assert length == pytest.approx(8.3, abs=0.5)
    assert level == pytest.approx(1e-3, rel=0.05)


@pytest.mark.parametrize(
    "samples",
    [
        shake()[1000:],
        shake(),
        hum(),
        hum() * np.clip(TIME / 10, 0, 1) ** 3 + 0.1 * shake(),
        np.r_[np.zeros(170), np.full(20, 1e-3), np.zeros(15), np.sin(TIME)],
    ],
    ids=["begins at once", "padded", "noise only", "grows", "padded but for a late flicker"],
)
def test_noise_is_unknown_where_nothing_shows_it(samples: Float) -> None:
    length, level = pre_event(samples, STEP)
    assert (length, math.isnan(level)) == (0.0, True)


def alternating(seconds: float, event: float) -> Float:
    """Return noise of level 1, at 100 Hz, before an event of two samples."""
    return np.concatenate([(-1.0) ** np.arange(round(100 * seconds)), [event, -event]])


@pytest.mark.parametrize(
    ("seconds", "event", "length"),
    [(2.5, 100.0, 2.0), (2.0, 100.0, 1.6), (1.9, 100.0, 0.0), (10.0, 8.1, 8.0), (10.0, 7.9, 0.0)],
)
def test_an_event_is_eight_times_the_level_of_the_first_two_seconds(
    seconds: float, event: float, length: float
) -> None:
    """The noise before it is known if it is longer than these, without its last fifth."""
    assert pre_event(alternating(seconds, event), 0.01)[0] == pytest.approx(length)


@pytest.mark.parametrize(("ratio", "length"), [(2.9, 8.0), (3.1, 0.0)])
def test_noise_is_steady_within_a_factor_of_three(ratio: float, length: float) -> None:
    """The window is 8 of the 10 s before the event; its last quarter has another level."""
    levels = np.repeat([1.0, 1.0, 1.0, ratio, ratio], 200)
    samples = np.r_[levels * (-1.0) ** np.arange(1000), 100.0, -100.0]
    assert pre_event(samples, 0.01)[0] == pytest.approx(length)
    assert pre_event(np.r_[samples[:800][::-1], samples[800:]], 0.01)[0] == pytest.approx(length)


def test_the_band_above_the_noise_holds_the_motion_and_ends_where_that_ends() -> None:
    low, high = signal_to_noise_band(hum(0.01) + shake(2.0), STEP, 9.5, (12.0, 28.0), 3.0)
    assert 0.5 < low < 2.0 < high < 8.0


@pytest.mark.parametrize("quiet", [5.0, 7.0, 9.5])
def test_bands_are_thirds_of_an_octave_from_two_cycles_of_the_noise(quiet: float) -> None:
    band = signal_to_noise_band(hum(0.01) + shake(2.0), STEP, quiet, (12.0, 28.0), 3.0)
    for thirds in 3.0 * np.log2(np.array(band) * quiet / 2.0):
        assert thirds == pytest.approx(round(thirds), abs=1e-9)


@pytest.mark.parametrize("quiet", [5.0, 7.0, 9.5, 20.0])
def test_noise_just_below_the_nyquist_frequency_ends_the_band(quiet: float) -> None:
    """A hiss at 49 Hz lasts during the motion, which reaches all frequencies up to 50 Hz."""
    hiss = 0.3 * np.sin(2 * np.pi * 49.0 * TIME)
    motion = np.where(TIME > 20.0, 50.0 * hum() + np.sin(2 * np.pi * 3.0 * TIME), 0.0)
    high = signal_to_noise_band(hum(1e-4) + hiss + motion, STEP, quiet, (20.0, 40.0), 3.0)[1]
    thirds = math.floor(3.0 * math.log2(50.0 * quiet / 2.0))
    assert high == pytest.approx(2.0 / quiet * 2.0 ** (thirds / 3.0))


@pytest.mark.parametrize("quiet", [5.0, 10.24, 10.25, 20.0])
def test_one_line_of_noise_at_the_nyquist_frequency_does_not_end_the_band(quiet: float) -> None:
    """It is weak beside all lines of the last band, which would hold no other line if it began at
    50 or 49.95 Hz, where thirds of an octave end for two of these windows.
    """
    line = 5e-3 * (-1.0) ** np.arange(TIME.size)
    motion = np.where(TIME > 20.0, 50.0 * hum(), 0.0)
    band = signal_to_noise_band(hum(1e-4) + line + motion, STEP, quiet, (20.0, 40.0), 3.0)
    assert band == (0.0, math.inf)


def test_no_band_without_motion() -> None:
    band = signal_to_noise_band(hum(), STEP, 10.0, (12.0, 28.0), 3.0)
    assert np.isnan(band).all()
    assert usable_periods(STEP, 40.0, (0.1, 40.0), band) == (0.0, 0.0)


def test_usable_periods_are_the_narrowest_of_all_bounds() -> None:
    assert usable_periods(STEP, 40.0, (0.1, 40.0), (0.25, 20.0)) == (0.05, 4.0)
    assert usable_periods(STEP, 5.0, (0.1, 40.0), (0.0, math.inf)) == (0.03125, 5.0)
    assert np.isnan(usable_periods(STEP, 40.0, (math.nan, math.nan), (0.0, math.inf))).all()


def test_the_archives_filter_bounds_the_usable_periods() -> None:
    record = replace(record_of(hum() + shake()), filter_low=0.5, filter_high=20.0)
    measures = passport(record, record, PassportLimits()).measures
    assert measures.usable_period_longest == pytest.approx(1.0 / (1.25 * 0.5))
    assert measures.usable_period_shortest >= 1.25 / 20.0
    assert "usable_period_longest" in passport(record, record, PassportLimits()).warnings


def test_a_corner_above_a_fifth_of_a_hertz_warns() -> None:
    """There shares that overturn are a quarter lower (tests.benchmarks.processing)."""
    limit, whole = PassportLimits().usable_period_longest_warn, (0.0, math.inf)
    assert usable_periods(STEP, 60.0, (0.2, 40.0), whole)[1] >= limit
    assert usable_periods(STEP, 60.0, (0.21, 40.0), whole)[1] < limit


def test_what_cannot_be_measured_is_not_ok() -> None:
    result = checked(shake()[1000:])
    for name in ("stated_peak", "signal_to_noise", "usable_period_longest"):
        assert verdict(result, name) is CheckVerdict.NOT_MEASURED
    assert result.verdict is not CheckVerdict.NOT_MEASURED


def test_drift_is_what_an_offset_makes_of_the_end() -> None:
    result = checked(hum() + shake() + 0.05)
    assert result.measures.end_velocity == pytest.approx(0.05 * 40.0, rel=0.01)
    assert result.measures.end_displacement == pytest.approx(0.05 * 40.0**2 / 2, rel=0.01)
    assert {"end_velocity_share", "end_displacement_share"} <= set(result.warnings)


def test_drift_begins_with_what_the_filter_put_before_the_record(
    bundled_records: Path, tmp_path: Path
) -> None:
    """The filter acts before the first sample too: integrated from rest, CLC-UP ends 0.09 m off."""
    records = read_file(bundled_records / "Ridgecrest2019-CLC.V1")
    (up,) = (record for record in records if record.orientation.upright)
    corrected, (velocity, displacement), _ = correct(up.acceleration, up.time_step, BandPass())
    path = displacement + integrate(velocity + integrate(corrected, STEP), STEP)
    assert np.abs(path).max() == pytest.approx(0.108, abs=5e-4)
    assert abs(path[-1]) < 0.005 * np.abs(path).max()
    from_rest = integrate(integrate(corrected, STEP), STEP)
    assert abs(from_rest[-1]) > 0.7 * np.abs(from_rest).max()
    same = IngestOptions(band_pass_hz=(0.1, 40.0))
    ingest_stage([bundled_records], tmp_path / "records.nc", same)
    with xr.open_dataset(tmp_path / "records.nc") as dataset:
        assert np.abs(dataset["end_displacement"]).max() < 0.01


def test_an_offset_before_correction_is_neither_drift_nor_late_trigger() -> None:
    before = record_of(hum() + shake() + 0.5, uncorrected=True)
    corrected, *_ = correct(before.acceleration, STEP, BandPass())
    result = passport(before, replace(before, acceleration=corrected), PassportLimits())
    assert "end_velocity_share" not in result.warnings
    assert not result.late_trigger


def test_a_whole_record_is_ok() -> None:
    assert checked(hum() + shake()).verdict is CheckVerdict.OK


def test_a_late_trigger_warns_and_says_so() -> None:
    result = checked(shake()[1850:])
    assert result.late_trigger
    assert "opening_share" in result.warnings


@pytest.mark.parametrize(
    ("samples", "words"),
    [
        (
            np.clip(hum() + shake(), -0.5, 0.5),
            r"^clipped_samples \d+. Must be at most 24.$",
        ),
        (
            np.where((TIME > 19) & (TIME < 20), 0.1, hum() + shake()),
            r"^constant_time 0.98 s. Must be at most 0.5 s.$",
        ),
        (
            981.0 * (hum() + shake()),
            r"^peak_acceleration 9\d\d(\.\d)? m s-2. Must be at most 98.1 m s-2.$",
        ),
    ],
)
def test_damage_rejects_with_its_name_value_and_limit(samples: Float, words: str) -> None:
    result = checked(samples)
    assert result.verdict is CheckVerdict.REJECT
    (check,) = result.rejections
    assert re.search(words, str(check))


def test_limits_decide() -> None:
    samples = hum() + shake()
    assert checked(samples, arias_intensity_warn=9.0).warnings == ("arias_intensity",)
    (check,) = checked(samples, arias_intensity_warn=9.0, arias_intensity_reject=8.0).rejections
    assert str(check).endswith("m s-1. Must be at least 8 m s-1.")


def test_each_limit_belongs_to_a_check_and_each_check_has_its_limits() -> None:
    names = {check.name for check in checked(shake()).checks}
    limits = {f"{name}_{kind}" for name in names for kind in ("warn", "reject")}
    assert set(PassportLimits.model_fields) == limits | {"signal_to_noise_ratio"}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("clipped_warn = 1", r"unknown key 'clipped_warn'. Must be one of: peak_accel"),
        ("clipped_samples_warn = -1", r"clipped_samples_warn -1. Must be zero or positive"),
        (
            "clipped_samples_warn = nan",
            r"clipped_samples_warn nan. Must be zero or positive",
        ),
        ("clipped_samples_warn = '1'", r"clipped_samples_warn '1'. Must be a number"),
        (
            "clipped_samples_warn = 30",
            r"clipped_samples_reject 24. Must be at least clipped_samples_warn, 30.",
        ),
        (
            "arias_intensity_reject = 1.0",
            r"arias_intensity_reject 1. Must be at most arias_intensity_warn, 0.0001.",
        ),
    ],
)
def test_each_mistake_in_the_limits_is_named(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "limits.toml"
    path.write_text(f"[passport]\n{text}\n")
    with pytest.raises(InputError, match=words) as caught:
        read_limits(path)
    assert "\n" not in str(caught.value)


def test_infinity_switches_a_limit_off_and_is_stated_as_none(tmp_path: Path) -> None:
    path = tmp_path / "limits.toml"
    path.write_text("[passport]\nclipped_samples_reject = inf\n")
    limits = read_limits(path)
    assert limits.stated()["clipped_samples_reject"] is None
    record = record_of(np.clip(hum() + shake(), -0.5, 0.5))
    assert passport(record, record, limits).verdict is CheckVerdict.WARN


@pytest.fixture
def two_files(tmp_path: Path) -> Path:
    """A folder with an intact and a clipped record, each of one column in g."""
    folder = tmp_path / "motions"
    folder.mkdir()
    whole = 0.1 * (hum() + shake())
    np.savetxt(folder / "whole.csv", whole, fmt="%.8f")
    np.savetxt(folder / "clipped.csv", np.clip(whole, -0.04, 0.04), fmt="%.8f")
    return folder


def test_the_stage_rejects_and_writes_what_it_measured(two_files: Path, tmp_path: Path) -> None:
    output = tmp_path / "records.nc"
    options = IngestOptions(units="g", time_step_s=STEP)
    result = ingest_stage([two_files], output, options=options)
    assert [record.record_id for record in result.accepted] == ["whole"]
    assert result.rejections[0].reason.startswith("record 'clipped': clipped_samples ")
    with output.with_suffix(".csv").open(newline="") as stream:
        whole, clipped = csv.DictReader(stream)
    assert list(whole)[:5] == ["file", "record_id", "status", "line", "reason"]
    assert (whole["status"], whole["passport"], clipped["status"]) == ("accepted", "ok", "rejected")
    assert (clipped["record_id"], clipped["clipped_samples_limit"]) == ("clipped", "24.0")
    assert clipped["clipped_samples_verdict"] == "reject"
    with xr.open_dataset(output) as dataset:
        assert dataset["passport"].attrs["flag_meanings"] == "ok warn reject not_measured"
        assert dataset["late_trigger"].attrs["flag_meanings"] == "in_time late"
        assert dataset["noise_level"].item() == pytest.approx(1e-4 * GRAVITY, rel=0.05)
        (record,) = read_records(output)
        intensity = arias_intensity(record.acceleration, STEP)
        assert dataset["arias_intensity"].item() == intensity
        velocity = integrate(record.acceleration, STEP)
        assert dataset["end_velocity"].item() == velocity[-1]
        for name in dataset.variables:
            assert {"units", "long_name"} <= set(dataset[name].attrs), name


def test_the_same_inputs_give_the_same_bytes(two_files: Path, tmp_path: Path) -> None:
    options = IngestOptions(units="g", time_step_s=STEP)
    for name in ("a", "b"):
        ingest_stage([two_files], tmp_path / f"{name}.nc", options=options)
    for suffix in (".nc", ".csv"):
        first, other = (tmp_path / f"{name}{suffix}" for name in ("a", "b"))
        assert first.read_bytes() == other.read_bytes()


def test_bundled_records_are_whole(bundled_records: Path, tmp_path: Path) -> None:
    result = ingest_stage([bundled_records], tmp_path / "records.nc")
    verdicts = {entry.passport.verdict for entry in result.entries if entry.passport}
    assert (len(result.accepted), verdicts) == (9, {CheckVerdict.OK})
    assert [entry.file for entry in result.entries if entry.status == "unread"] == ["catalogue.csv"]


def test_the_papers_records_are_not_rejected(peer_records: Path, tmp_path: Path) -> None:
    paths = (peer_records / f"{name}.csv" for file in paper_records() for name in file.files)
    files = [path for path in paths if path.is_file()]
    assert len(files) == 6
    assert ingest_stage(files, tmp_path / "records.nc").rejections == ()


def test_stated_peaks_of_archives(shared: Path, tmp_path: Path) -> None:
    names = ("csmip/CE89146.V2", "geonet/20180212_211557_WPWS_20.V2A", "knet/AOM0170806140843.EW")
    output = tmp_path / "records.nc"
    result = ingest_stage([shared / name for name in names], output)
    peaks = [record.passport.measures.stated_peak for record in result.accepted]
    assert len(peaks) == 7
    np.testing.assert_allclose(peaks[:6], 0.0, atol=1e-5)  # one unit of the last digit
    assert 0.0 < peaks[6] < 0.01  # the stated peak has another baseline
    ratios = [abs(record.peak_ratio - 1.0) for record in read_records(output)]
    np.testing.assert_array_equal(ratios, peaks)


@pytest.mark.parametrize("name", ["RSN77_SFERN_PUL164", "NIS090", "A-BPL160", "elCentro"])
def test_real_at2_records_are_not_rejected(shared: Path, name: str) -> None:
    (record,) = read_file(shared / "peer_at2" / f"{name}.AT2")
    assert passport(record, record, PassportLimits()).rejections == ()


@pytest.fixture(scope="session")
def shared() -> Path:
    folder = Path(__file__).resolve().parents[3] / "shared" / "records" / "formats"
    if not folder.is_dir():
        pytest.skip("no folder 'shared/records' beside the repository")
    return folder
