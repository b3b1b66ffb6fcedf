"""A large screening keeps its outcomes in a file, and has some structures in memory at a time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import pytest
from numpy.testing import assert_array_equal
from tests.screening import (
    RESTRAINED,
    SCALES,
    STRUCTURES,
    all_results,
    site,
    stored,
    structures,
    three,
)

from rockframe.engines.engine import OneProcess
from rockframe.frame import RockingFrame
from rockframe.options.respond import ScreenOptions
from rockframe.record import Record
from rockframe.report.page import screening_content
from rockframe.results.screen import read_screening
from rockframe.stages.screen import Screening, screen_stage
from rockframe.stages.screening.outcomes import OF_MEMBERS, AllOutcomes
from rockframe.stages.screening.request import ScreeningRequest
from rockframe.stages.screening.statistics import _shared


@pytest.fixture
def small_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing but the outcomes of one structure, and of one motion, fits into memory."""
    monkeypatch.setattr("rockframe.stages.screening.outcomes._TOGETHER", 4)
    monkeypatch.setattr("rockframe.stages.screening.statistics._SHARES", 300)
    monkeypatch.setattr("rockframe.results.tables.number_store._IN_MEMORY", 200)
    monkeypatch.setattr("rockframe.results.screen._FEW_PAIRS", 0)
    monkeypatch.setattr("rockframe.results.screen_tables._TOGETHER", 5)


def of_all_kinds(folder: Path) -> ScreenOptions:
    return all_results(folder).replaced(margins="first")


def of_members(_folder: Path) -> ScreenOptions:
    """Return options of members, and of azimuths, of which each recording has percentiles."""
    return ScreenOptions(
        scales=SCALES,
        margins="none",
        scenario_members=16,
        azimuths_degree=(0.0, 30.0, 90.0),
    )


def screened(folder: Path, records: list[Record], options: ScreenOptions) -> Screening:
    folder.mkdir()
    text = STRUCTURES + RESTRAINED
    return screen_stage(
        stored(records, folder),
        folder / "screen.nc",
        options,
        structures_path=structures(folder, text),
        engine=OneProcess(),
    )


@pytest.mark.parametrize("make_options", [of_all_kinds, of_members])
def test_a_large_screening_has_the_values_and_tables_of_a_small_one(
    tmp_path: Path, make_options: Any, request: pytest.FixtureRequest
) -> None:
    options = make_options(tmp_path)
    records = site(4) if make_options is of_all_kinds else [*three("a"), *three("b", 1.0)]
    small = screened(tmp_path / "small", records, options)
    expected = read_screening(tmp_path / "small" / "screen.nc")
    at_reference = read_screening(tmp_path / "small" / "screen.nc", every_scale=False)
    page = repr(screening_content(at_reference))
    request.getfixturevalue("small_memory")
    large = screened(tmp_path / "large", records, options)
    assert (large.motions, large.scenarios) == (small.motions, small.scenarios)
    assert small.tables.keys() == large.tables.keys()
    for kind, path in large.tables.items():
        assert path.read_bytes() == small.tables[kind].read_bytes(), kind
    assert len(small.tables) > 2
    whole = read_screening(tmp_path / "large" / "screen.nc")
    assert {*whole.variables} == {*expected.variables}
    for name, values in expected.variables.items():
        assert_array_equal(whole[name].values, values.values, err_msg=str(name))
        assert whole[name].attrs == values.attrs
    path = tmp_path / "large" / "screen.nc"
    with netCDF4.Dataset(path, "a") as file:  # HDF5 refuses this while the process reads the file
        rows, columns = file["demand_rank"].chunking()
        # a block of motions that are not neighbours unpacks what else is in their chunks
        assert columns == len(file.dimensions["structure"])
        assert rows == file["verdict"].chunking()[0]
    with read_screening(path, every_scale=False) as on_demand:
        one_structure = on_demand.isel(structure=0)
        assert repr(screening_content(on_demand)) == page
        with pytest.raises(OSError, match="HDF error"):
            netCDF4.Dataset(path, "a")
    netCDF4.Dataset(path, "a").close()
    del on_demand, one_structure
    one_structure = read_screening(path, every_scale=False).isel(structure=0)
    assert_array_equal(one_structure["demand_rank"], whole["demand_rank"].isel(structure=0))
    del one_structure
    netCDF4.Dataset(path, "a").close()


@pytest.mark.usefixtures("small_memory")
@pytest.mark.parametrize("together", [1, 528])  # one motion, and two
def test_outcomes_return_as_they_were_filled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, together: int
) -> None:
    monkeypatch.setattr("rockframe.stages.screening.outcomes._TOGETHER", together)
    random = np.random.default_rng(4)
    options = ScreenOptions(
        scales=(0.5, 1.0),
        scenario_members=4,
        limit_peak_u_m=(0.1,),
        hazard=Path("hazard.csv"),
        return_period_years=(475.0,),
    )
    frames = [RockingFrame(height=h, width=1.0, name=f"h{h}") for h in (6.0, 7.0, 8.0)]
    request = ScreeningRequest.of(options, (*frames,))
    shape, members = (21, 3, 2), request.members
    every = AllOutcomes(request, shape[0], tmp_path)
    assert every.is_large
    values = {
        "verdict": random.integers(4, size=shape),
        "reached": random.integers(members + 1, size=(*shape, 2)),
        **{f"members_{n}": random.uniform(size=(*shape[:2], members)) for n in OF_MEMBERS},
        **{
            f"members_{n}_at_scales": random.uniform(size=(*shape, members))
            for n in request.demands
        },
    }
    for motion in range(shape[0]):
        every.add({name: array[motion] for name, array in values.items()})
    in_both = np.zeros(shape[0], dtype=bool)
    seen: list[int] = []
    for some, part in every.parts(in_both):
        outcomes = part.outcomes
        seen += range(shape[1])[some]
        assert part.request.structures == tuple(frames[some])
        assert_array_equal(outcomes.verdicts, values["verdict"][:, some])
        assert_array_equal(np.moveaxis(outcomes.reached, 0, -1), values["reached"][:, some])
        for name in OF_MEMBERS:
            assert_array_equal(outcomes.peaks[name], values[f"members_{name}"][:, some])
        for name in request.demands:
            assert_array_equal(outcomes.demands[name], values[f"members_{name}_at_scales"][:, some])
    assert seen == [0, 1, 2]


def test_structures_that_alternate_keep_the_places_of_motions_once() -> None:
    """A round column counts motions in both directions, a frame beside it those in one plane."""
    different: dict[bytes, Any] = {}
    parts = [[np.arange(3), np.arange(4)], [np.arange(3)], [np.arange(4), np.arange(3)]]
    counting = [places for part in parts for places in _shared(part, different)]
    assert [places.tolist() for places in counting] == [p.tolist() for part in parts for p in part]
    assert len({id(places) for places in counting}) == 2
