"""Selected recordings with both horizontals: one spectrum and one scale for both."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.screening import sine, stored, three

from rockframe.components import (
    HorizontalPair,
    pair_horizontals,
    rotate,
    rotd_spectral_acceleration,
)
from rockframe.errors import ParameterError
from rockframe.options.ingest import IngestOptions, SelectOptions
from rockframe.record import Record
from rockframe.results.records import open_records
from rockframe.signals.measures import spectral_acceleration
from rockframe.signals.processing import integrate, peak
from rockframe.stages.ingest import ingest_stage
from rockframe.stages.select import Selection, read_selection, select_stage

TARGET = "period_s,sa_g,sigma_ln_sa\n0.2,0.5,0.5\n0.5,0.6,0.5\n1,0.4,0.5\n2,0.2,0.6\n"


@pytest.fixture(scope="module")
def real(bundled_records: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    home = tmp_path_factory.mktemp("pairs")
    recordings = [bundled_records / f"Ridgecrest2019-{name}.V1" for name in ("CLC", "CCC")]
    ingest_stage(recordings, home / "records.nc", IngestOptions(), workers=0)
    return home


def selected(home: Path, **options: Any) -> Selection:
    target = home / "target.csv"
    target.write_text(TARGET, encoding="utf-8")
    wanted = SelectOptions(**{"target": target, "motions": 2, "pairs": "rotd50", **options})
    return select_stage(home / "records.nc", home / "selected.nc", wanted)


def of_selected(home: Path) -> dict[str, Record]:
    with open_records(home / "selected.nc") as file:
        return {record.record_id: record for record in file}


def levels(first: Record, second: Record, period: float) -> dict[str, float]:
    """Return Sa of two horizontals of known azimuths, by the public functions for each."""
    sweep = rotd_spectral_acceleration(HorizontalPair(first, second), period)
    alone = [spectral_acceleration(r.acceleration, r.time_step, [period]) for r in (first, second)]
    mean = float(np.sqrt(alone[0] * alone[1])[0])
    return {"rotd50": sweep.percentile(50), "rotd100": sweep.percentile(100)} | {
        "geometric-mean": mean
    }


@pytest.mark.parametrize("pairs", ["geometric-mean", "rotd50", "rotd100"])
def test_pairs_have_the_target_where_they_are_scaled(real: Path, pairs: str) -> None:
    """The spectrum of both written components is that of the target; both have one factor."""
    selection = selected(real, pairs=pairs, scale_period_s=0.7)
    records, scales = of_selected(real), read_selection(real / "selected.csv")
    aim = np.exp(selection.target.log_sa_at(0.7))
    seconds = {row["pair_of"]: row["record_id"] for row in selection.rows if row["pair_of"]}
    assert set(seconds) == {row["record_id"] for row in selection.motions}
    for row in selection.motions:
        first, second = records[row["record_id"]], records[seconds[row["record_id"]]]
        assert scales[first.record_id] == scales[second.record_id] == row["scale"]
        assert_allclose(levels(first, second, 0.7)[pairs], aim, rtol=5e-6)
    assert len(selection.rows) == 6  # two recordings, each with its vertical
    assert {scales[row["record_id"]] for row in selection.rows if row["vertical_of"]} == {
        row["scale"] for row in selection.motions
    }


def test_the_largest_direction_needs_the_smallest_factor(real: Path) -> None:
    """RotD100 is larger than RotD50 of a motion that is not the same in all directions."""
    scales = {}
    for pairs in ("rotd50", "rotd100"):
        motions = selected(real, pairs=pairs, scale_period_s=0.7).motions
        scales[pairs] = {row["record_id"]: row["scale"] for row in motions}
    for name, scale in scales["rotd100"].items():
        assert scale < scales["rotd50"][name]


def test_rotd_depends_on_neither_azimuths_nor_the_sense_of_a_component(
    real: Path, tmp_path: Path
) -> None:
    """The same motion, rotated by 37 degrees with one component reversed and no azimuths."""
    with open_records(real / "records.nc") as file:
        pairs, _ = pair_horizontals(file)
    turned = []
    for pair in pairs:
        first, second = rotate(pair, 37.0), rotate(pair, 127.0)
        for record, sign, name in ((first, 1.0, "a"), (second, -1.0, "b")):
            turned.append(
                replace(
                    record,
                    record_id=f"{record.station}-{name}",
                    acceleration=sign * record.acceleration,
                    azimuth=np.nan,
                )
            )
    stored(turned, tmp_path)
    before, after = selected(real), selected(tmp_path)
    by_station = {row["station"]: row["scale"] for row in before.motions}
    assert {row["station"] for row in after.motions} == set(by_station)
    for row in after.motions:
        assert_allclose(row["scale"], by_station[row["station"]], rtol=2e-3)  # whole degrees


def test_pairs_scaled_by_pgv_have_this_pgv(real: Path) -> None:
    selection = selected(real, pairs="geometric-mean", scale_pgv_m_s=0.4)
    records = of_selected(real)
    for row in selection.rows:
        if row["pair_of"]:
            both = [records[row["pair_of"]], records[row["record_id"]]]
            pgv = [peak(integrate(r.acceleration, r.time_step)) for r in both]
            assert_allclose(np.sqrt(pgv[0] * pgv[1]), 0.4, rtol=5e-6)


def test_a_component_alone_is_no_pair(tmp_path: Path) -> None:
    """One of three recordings lacks the other horizontal, so three cannot be selected."""
    stored([*three("a"), *three("b"), sine("c", 3.0)], tmp_path)
    selection = selected(tmp_path)
    assert (selection.records, selection.candidates) == (3, 2)
    assert selection.left_out["c"] == "pairs need both horizontals"
    with pytest.raises(
        ParameterError, match=r"only 2 can be selected of 3 recordings\. Left out: 1 by pairs\."
    ):
        selected(tmp_path, motions=3)
