"""The processes that read files also measure the records that need no correction."""

from __future__ import annotations

from dataclasses import astuple, replace
from pathlib import Path

import numpy as np
import pytest

from rockframe.ingest import Reading
from rockframe.ingest.collection import read_and_measured
from rockframe.ingest.options import ReadOptions
from rockframe.options.ingest import IngestOptions, PassportLimits
from rockframe.signals.passport import passport
from rockframe.stages.ingesting.acceptance import inspected

LIMITS = PassportLimits()
TEXT = ReadOptions(units="m/s2", time_step=0.01)


@pytest.fixture
def shake(tmp_path: Path) -> Path:
    """Return a file of one record that needs no correction."""
    path = tmp_path / "shake.txt"
    np.savetxt(path, np.sin(np.linspace(0.0, 40.0, 800)) * np.hanning(800))
    return path


def readings(
    path: Path, options: ReadOptions = TEXT, *, uncorrected: bool = False
) -> list[Reading]:
    """Return the readings of a file."""
    ratio = LIMITS.signal_to_noise_ratio
    [outcome] = read_and_measured(path, options, uncorrected=uncorrected, ratio=ratio)
    assert isinstance(outcome, list)
    return outcome


def test_the_measures_are_those_of_the_passport(shake: Path) -> None:
    [reading] = readings(shake)
    record = reading.completed()
    assert reading.measures is not None
    known = astuple(passport(record, record, LIMITS).measures)
    np.testing.assert_array_equal(astuple(reading.measures), known)  # some are NaN


def test_known_measures_are_not_measured_again(shake: Path) -> None:
    [reading] = readings(shake)
    assert reading.measures is not None
    reading = replace(reading, measures=replace(reading.measures, peak_acceleration=7.0))
    reading = replace(reading, facts={**reading.facts, "record_id": "shake"})
    [(_, outcome, _)] = inspected([reading], IngestOptions(), LIMITS)
    assert outcome.passport is not None
    assert outcome.passport.measures.peak_acceleration == 7.0


def test_records_that_are_corrected_later_are_not_measured(
    shake: Path, bundled_records: Path
) -> None:
    """Two horizontals get the same band-pass, so their correction needs both files."""
    raw = bundled_records / "Ridgecrest2019-CLC.V1"
    assert [one.measures for one in readings(raw, ReadOptions())] == [None] * 3
    assert [one.measures for one in readings(shake, uncorrected=True)] == [None]


@pytest.mark.parametrize("value", [0.0, 2.0])
def test_a_constant_is_left_to_the_check_that_rejects_it(tmp_path: Path, value: float) -> None:
    path = tmp_path / "still.txt"
    np.savetxt(path, np.full(100, value))
    assert [one.measures for one in readings(path)] == [None]


def test_a_file_that_cannot_be_read_is_an_outcome(tmp_path: Path) -> None:
    lost = tmp_path / "lost.AT2"
    [outcome] = read_and_measured(lost, TEXT, uncorrected=False, ratio=3.0)
    assert not isinstance(outcome, list)
    assert outcome.reason == "no such file."
