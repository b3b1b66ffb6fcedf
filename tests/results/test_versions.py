"""Versions of records whose processing is uncertain: they are records processed anew."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose, assert_array_equal

from rockframe import (
    Ensemble,
    RespondOptions,
    RockingFrame,
    ingest_stage,
    respond,
    respond_many,
    respond_stage,
)
from rockframe.components import placed, vertical_beside
from rockframe.errors import RockframeWarning
from rockframe.options.ingest import IngestOptions, PassportLimits
from rockframe.options.respond import BridgeEnsemble
from rockframe.oscillators.ensemble import bridge_members
from rockframe.oscillators.response import respond_oscillator
from rockframe.outcome import InputOutcome
from rockframe.results.records import RecordsFile, open_records, write_records
from rockframe.results.versions import Uncertain, VersionSources
from rockframe.rivals import IsolatedDeck
from rockframe.rocking import (
    Versions,
    as_ground,
    corner_factors,
    ensemble_responses,
    member_peaks,
    turned_degrees,
    with_envelope,
)
from rockframe.rocking.margins.ensemble import quantiles
from rockframe.rocking.margins.members import draws, members
from rockframe.signals.corner import Corner, CornerSource
from rockframe.signals.passport import passport
from rockframe.signals.processing import AsRead, BandPass
from rockframe.stages.common import horizontal
from rockframe.stages.ingest import rotated
from rockframe.stages.respond import with_vertical
from rockframe.structures.comparison import Rivals, compare

BENT = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
NAMES = ["Ridgecrest2019-CCC-090", "Ridgecrest2019-CCC-360"]
SMALL = Ensemble(members=16, seed=3)


@pytest.fixture(scope="module")
def file(bundled_records: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Records of one uncorrected file, with a lower corner of 0.063 Hz."""
    path = tmp_path_factory.mktemp("versions") / "records.nc"
    ingest_stage([bundled_records / "Ridgecrest2019-CCC.V1"], path, workers=0)
    return path


def sources(records: RecordsFile, ensemble: Ensemble) -> VersionSources:
    return VersionSources.of(records, ensemble, horizontal(records))


def made_of(path: Path, name: str = NAMES[0], ensemble: Ensemble = SMALL) -> Uncertain:
    with open_records(path) as records:
        found = sources(records, ensemble).uncertain(records.read(name))
    assert found is not None
    return found


def test_versions_are_the_file_processed_with_other_corners(
    bundled_records: Path, file: Path, tmp_path: Path
) -> None:
    one = made_of(file)
    versions = one.versions(SMALL, one.record)
    assert versions.varied == ("corner",)
    root = 2.0**0.5
    for ground, factor in zip(versions.grounds, (0.5, 1 / root, 1.0, root, 2.0), strict=True):
        band = (0.063 * factor, 40.0)
        ingest_stage(
            [bundled_records / "Ridgecrest2019-CCC.V1"],
            tmp_path / "anew.nc",
            IngestOptions(band_pass_hz=band),
            workers=0,
        )
        with open_records(tmp_path / "anew.nc") as records:
            anew = records.read(NAMES[0])
        assert_array_equal(ground.coefficients, as_ground(anew).coefficients)


def test_rotated_records_have_versions_of_their_own(
    bundled_records: Path, file: Path, tmp_path: Path
) -> None:
    """Correction and rotation are linear, so that their order changes the round-off alone.

    A recursive filter amplifies round-off, here to 1e-11 m/s2 of 5 m/s2.
    """
    path = tmp_path / "rotated.nc"
    options = IngestOptions(azimuth_degree=30.0)
    ingest_stage([bundled_records / "Ridgecrest2019-CCC.V1"], path, options, workers=0)
    one = made_of(path, f"{NAMES[0]}-rotated-30")
    both = [made_of(file, name).versions(SMALL, made_of(file, name).record) for name in NAMES]
    turned = np.radians([90.0 - 30.0, 360.0 - 30.0])
    for k, ground in enumerate(one.versions(SMALL, one.record).grounds):
        parts = [
            of.grounds[k].acceleration() * np.cos(a) for of, a in zip(both, turned, strict=True)
        ]
        assert_allclose(ground.acceleration(), sum(parts), rtol=0, atol=1e-10)


def test_records_without_samples_as_read_have_one_version(file: Path, tmp_path: Path) -> None:
    corrected = tmp_path / "shake.csv"
    corrected.write_text("time_s,acc_g\n0,0.1\n0.1,0.2\n0.2,-0.3\n")
    ingest_stage([corrected], tmp_path / "corrected.nc", workers=0)
    with xr.open_dataset(file) as dataset:  # as earlier versions wrote it
        dataset.drop_vars(["acceleration_as_read", "corner_frequency_high"]).to_netcdf(
            tmp_path / "older.nc"
        )
    for path in ("corrected.nc", "older.nc"):
        with open_records(tmp_path / path) as records:
            for record in records:
                assert sources(records, SMALL).uncertain(record) is None
    with open_records(file) as records:
        record = records.read(NAMES[0])
        assert sources(records, Ensemble(corner=1.0)).uncertain(record) is None
        assert sources(records, Ensemble(members=0)).uncertain(record) is None


def test_each_member_is_shaken_by_its_version(file: Path) -> None:
    one = made_of(file)
    versions = one.versions(SMALL, one.record)
    frames = [BENT, RockingFrame(height=7.5, width=1.8, name="column")]
    peaks = member_peaks([one.record, one.record], frames, SMALL, [versions, None])
    alone = member_peaks([one.record], frames, SMALL)
    assert_array_equal(peaks.peaks["peak_u"][1], alone.peaks["peak_u"][0])
    for k, frame in enumerate(frames):
        for m, member in enumerate(members(SMALL, frame)):
            # by the same kernel: another one differs in the last bit, which a rocking amplifies
            ground, scale = versions.grounds[versions.of_member[m]], float(draws(SMALL)[m, 3])
            expected = respond_many([ground], [member], [scale]).peak_rotation_ratio.item()
            assert peaks.peaks["peak_rotation_ratio"][0, k, m] == expected
    low, high = versions.of_member.argmin(), versions.of_member.argmax()
    assert peaks.peaks["peak_u"][0, 0, low] != alone.peaks["peak_u"][0, 0, low]
    assert peaks.peaks["peak_u"][0, 0, high] != alone.peaks["peak_u"][0, 0, high]


def test_versions_that_equal_the_motion_change_nothing(file: Path) -> None:
    one = made_of(file)
    same = Versions((as_ground(one.record),) * 3, np.arange(16) % 3, ("corner",))
    alone, shaken = (
        member_peaks([one.record], [BENT], SMALL, versions) for versions in (None, [same])
    )
    for name, values in alone.peaks.items():
        assert_array_equal(shaken.peaks[name], values)


@pytest.mark.parametrize("count", [16, 64, 100])
def test_all_versions_are_equally_frequent(count: int) -> None:
    factors = corner_factors(Ensemble(members=count, corner=4.0))
    values, numbers = np.unique(factors, return_counts=True)
    assert values.tolist() == [0.25, 0.5, 1.0, 2.0, 4.0]
    assert numbers.max() - numbers.min() <= 1
    # no structure with less height is shaken with a lower corner more often than by chance
    ranks = np.argsort(np.argsort(factors + 1e-9 * np.arange(count)))
    heights = np.argsort(np.argsort(draws(Ensemble(members=count))[:, 0]))
    assert abs(np.corrcoef(ranks, heights)[0, 1]) < 2.5 / count**0.5


def test_the_vertical_component_is_the_same_in_all_versions(file: Path) -> None:
    one = made_of(file)
    with open_records(file) as records:
        motion = with_vertical(one.record, vertical_beside(records))
    versions = one.versions(SMALL, motion)
    for ground in versions.grounds:
        assert_array_equal(ground.vertical, motion.vertical)
    across = [ground.coefficients for ground in one.versions(SMALL, one.record).grounds]
    assert_array_equal([ground.coefficients for ground in versions.grounds], across)


def test_bridges_that_do_not_rock_are_shaken_by_the_same_versions(file: Path) -> None:
    ensemble = BridgeEnsemble(members=16)
    one = made_of(file, ensemble=ensemble)
    versions = one.versions(ensemble, one.record)
    deck = IsolatedDeck.lead_rubber(strength_ratio=0.05, period=3.0)
    _, found = compare(Rivals(BENT, isolated=deck), one.record, ensemble, versions)
    peaks = [
        respond_oscillator(member, versions.grounds[k].scaled(scale)).peak_displacement
        for member, k, scale in zip(
            bridge_members(ensemble, deck),
            versions.of_member,
            draws(ensemble)[:, 3].tolist(),
            strict=True,
        )
    ]
    assert found.ensemble is not None
    assert_allclose(found.ensemble.bands.peak_u, quantiles(np.array(peaks)))


def test_the_stage_varies_the_corner_unless_it_is_switched_off(file: Path, tmp_path: Path) -> None:
    found = {}
    for corner in (1.0, 2.0):
        options = RespondOptions(
            structure="bridge-bent", margins="none", ensemble=replaced(corner), histories="none"
        )
        respond_stage(file, tmp_path / "response.nc", options)
        with xr.open_dataset(tmp_path / "response.nc") as dataset:
            found[corner] = dataset["peak_u_band"].load()
    one = made_of(file, ensemble=replaced(2.0))
    frame = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    for corner, versions in ((1.0, None), (2.0, one.versions(replaced(2.0), one.record))):
        [[expected]] = ensemble_responses([one.record], [frame], replaced(corner), [versions])
        stored = found[corner].sel(record=0).values[0]
        assert_allclose(stored, expected.bands.peak_u, rtol=1e-12)
    assert (found[1.0] != found[2.0]).any()


TURNED = Ensemble(members=16, corner=1.0, orientation_degree=5.0, seed=3)


def test_turned_versions_are_the_records_rotated_toward_other_azimuths(
    bundled_records: Path, file: Path, tmp_path: Path
) -> None:
    one = made_of(file, ensemble=TURNED)
    versions = one.versions(TURNED, one.record)
    assert versions.varied == ("orientation_degree",)
    assert len(versions.grounds) == 5  # from -5 to 5 degrees
    for ground, degrees in ((versions.grounds[0], -5.0), (versions.grounds[3], 2.5)):
        options = IngestOptions(azimuth_degree=90.0 + degrees)
        source = bundled_records / "Ridgecrest2019-CCC.V1"
        ingest_stage([source], tmp_path / "turned.nc", options, workers=0)
        with open_records(tmp_path / "turned.nc") as records:
            turned = records.read(f"{NAMES[0]}-rotated-{90.0 + degrees:g}")
        assert_allclose(ground.acceleration(), turned.acceleration, rtol=0, atol=1e-12)


def test_turned_versions_with_other_corners_are_those_of_both_components(file: Path) -> None:
    both = Ensemble(members=16, orientation_degree=5.0, seed=3)
    one, alone = made_of(file, ensemble=both), made_of(file)
    other = made_of(file, NAMES[1])
    versions = one.versions(both, one.record)
    assert versions.varied == ("corner", "orientation_degree")
    for m, (factor, degrees) in enumerate(
        zip(corner_factors(both).tolist(), turned_degrees(both).tolist(), strict=True)
    ):
        own, across = (x.as_read.corrected(0.01, factor) for x in (alone, other) if x.as_read)
        angle = np.radians(degrees)
        expected = own * np.cos(angle) - across * np.sin(angle)  # toward 90 + angle
        ground = versions.grounds[versions.of_member[m]]
        assert_allclose(ground.acceleration(), expected, rtol=0, atol=1e-12)


def test_a_record_without_its_partner_is_not_turned_and_named_once(
    file: Path, tmp_path: Path
) -> None:
    with open_records(file) as records:
        alone = [(records.read(name), None) for name in (NAMES[0], "Ridgecrest2019-CCC-UP")]
    write_records(alone, tmp_path / "alone.nc", input_sha256={}, parameters={})
    options = RespondOptions(structure="bridge-bent", margins="none", ensemble=TURNED)
    with pytest.warns(
        RockframeWarning, match=r"concern 1 of 1 records, .*: Ridgecrest2019-CCC-090"
    ):
        respond_stage(tmp_path / "alone.nc", tmp_path / "response.nc", options)
    with open_records(file) as records:
        found = VersionSources.of(records, TURNED, NAMES)
        assert dict(found.others) == {NAMES[0]: NAMES[1], NAMES[1]: NAMES[0]}


def replaced(corner: float) -> Ensemble:
    return Ensemble(members=16, corner=corner)


def test_the_envelope_is_that_of_members_shaken_by_their_versions(file: Path) -> None:
    one = made_of(file)
    versions = one.versions(SMALL, one.record)
    found = with_envelope(respond(BENT, one.record), one.record, SMALL, versions)
    rotations = [
        respond(member, versions.grounds[version].scaled(scale)).theta
        for member, version, scale in zip(
            members(SMALL, BENT), versions.of_member, draws(SMALL)[:, 3].tolist(), strict=True
        )
    ]
    low, _, high = quantiles(np.stack(rotations, axis=-1)).T
    assert_array_equal(found.theta_low, low)
    assert_array_equal(found.theta_high, high)


@pytest.mark.parametrize(
    ("corner", "longer", "known"), [(0.063, 0, True), (0.08, 0, False), (0.063, 5, False)]
)
def test_rotated_records_have_one_band_and_length_or_no_samples_as_read(
    file: Path, tmp_path: Path, corner: float, longer: int, known: bool
) -> None:
    """The other component has another corner, or more samples, which rotation cuts off."""
    limits = PassportLimits()
    with open_records(file) as records:
        one, other = (records.read(name) for name in NAMES)
        before = [records.as_read(name) for name in NAMES]
    more = np.zeros(longer)
    other = replace(other, acceleration=np.r_[other.acceleration, more])
    rows = []
    for record, as_read, low in zip((one, other), before, (0.063, corner), strict=True):
        assert as_read is not None
        samples = placed(as_read.samples, 0, record.acceleration.size)
        stated = replace(passport(record, record, limits), corner=Corner(low, CornerSource.STATED))
        rows.append((record, stated, AsRead(samples, BandPass(low, 40.0))))
    write_records(rows, tmp_path / "two.nc", input_sha256={}, parameters={})
    outcomes = [
        InputOutcome("a", status="accepted", record_id=row[0].record_id, passport=row[1])
        for row in rows
    ]
    with open_records(tmp_path / "two.nc") as records:
        turned = [
            as_read
            for record, _, as_read in rotated(records, outcomes, [30.0], limits, {})
            if record
        ]
    assert [as_read is not None for as_read in turned] == [known]
