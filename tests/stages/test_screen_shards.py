"""A screening in batches has the values and tables of a screening of all records at once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_array_equal
from tests.screening import (
    RESTRAINED,
    ROUND,
    SCALES,
    STRUCTURES,
    all_results,
    sine,
    site,
    stored,
    structures,
    three,
)

from rockframe import index_stage
from rockframe.engines.engine import OneProcess
from rockframe.errors import InputError, ParameterError
from rockframe.options.ingest import Filters
from rockframe.options.respond import ScreenOptions
from rockframe.record import Record
from rockframe.results.screen import read_screen_history, read_screening, screening_of
from rockframe.stages.common import Batch
from rockframe.stages.screen import Screening, screen_stage


class Case(NamedTuple):
    records: list[Record]
    options: ScreenOptions
    batches: int
    text: str = STRUCTURES
    filters: Filters | None = None


def of_all_results(folder: Path) -> Case:
    return Case(site(5), all_results(folder), 3, STRUCTURES + RESTRAINED)


def of_azimuths(_folder: Path) -> Case:
    """A recording without a partner is rejected, in a batch that has nothing else."""
    options = ScreenOptions(
        scales=SCALES, margins="none", scenario_members=4, azimuths_degree=(0.0, 30.0)
    )
    records = [*three("a"), sine("alone", 2.0), *three("b", 1.0)]
    return Case(records, options, 3, STRUCTURES + RESTRAINED)


def station(name: str, later: int) -> list[Record]:
    east, north, up = three(name)
    return [east, replace(north, acceleration=np.roll(north.acceleration, later)), up]


def of_both_directions(_folder: Path) -> Case:
    """The second component of each station is filtered out, and is in the batch after the first."""
    options = ScreenOptions(
        scales=(0.4, 1.0),
        margins="robust",
        scenario_members=4,
        measures=("pgv_rotd50", "cav", "sa_rotd100"),
        spectral_periods_s=(0.5, 1.0),
    )
    records = [*station("a", 25), *station("b", 30), sine("c-n", 3.5, station="c")]
    weaker = replace(records[3], acceleration=0.9 * records[3].acceleration)
    records = [sine("0-e", 3.0), *records[:3], weaker, *records[4:]]
    return Case(records, options, 3, ROUND, Filters(pga_g=(0.0, 0.39)))


def of_verticals(_folder: Path) -> Case:
    """At the largest scale the ground of one station falls faster than gravity."""
    options = ScreenOptions(scales=(0.5, 1.0), margins="none", vertical=True, histories="all")
    return Case([*three("a"), *three("b", 12.0), *three("c")], options, 4)


def whole_and_in_batches(folder: Path, case: Case) -> tuple[Screening, Screening]:
    """Screen all records at once, and in batches; nothing remains in the folders."""
    records, kinds = stored(case.records, folder), structures(folder, case.text)
    screened = {}
    for name in ("whole", "joined"):
        (folder / name).mkdir()
        output, shards = folder / name / "screen.nc", list[Path]()
        call: Callable[..., Screening]

        def call(output: Path, **further: Any) -> Screening:
            return screen_stage(
                *(records, output, case.options),
                structures_path=kinds,
                filters=case.filters,
                engine=OneProcess(),
                **further,
            )

        if name == "joined":
            (folder / name / "shards").mkdir()
            for number in range(1, case.batches + 1):
                shards.append(output.parent / "shards" / f"screen-{number:03d}.nc")
                assert call(shards[-1], batch=Batch(number, case.batches)).tables == {}
        screened[name] = call(output, shards=shards)
        inside = {path.name for path in output.parent.rglob("*") if path.is_file()}
        tables = screened[name].tables.values()
        assert inside == {path.name for path in (output, *shards, *tables)}
    return screened["whole"], screened["joined"]


@pytest.mark.parametrize(
    "make_case", [of_all_results, of_azimuths, of_both_directions, of_verticals]
)
def test_batches_give_the_values_and_tables_of_all_records_at_once(
    tmp_path: Path, make_case: Callable[[Path], Case]
) -> None:
    case = make_case(tmp_path)
    whole, joined = whole_and_in_batches(tmp_path, case)
    assert (joined.motions, joined.scenarios) == (whole.motions, whole.scenarios)
    assert joined.left_out == whole.left_out
    by_name = [sorted(map(str, each.rejections)) for each in (joined, whole)]
    assert by_name[0] == by_name[1]
    for kind, path in whole.tables.items():
        assert joined.tables[kind].read_bytes() == path.read_bytes(), kind
    both = [tmp_path / name / "screen.nc" for name in ("whole", "joined")]
    for every_scale in (True, False):
        expected, values = (read_screening(path, every_scale=every_scale) for path in both)
        assert {*values.variables} == {*expected.variables}
        for name, variable in expected.variables.items():
            assert_array_equal(values[name].values, variable.values, err_msg=str(name))
            assert values[name].attrs == variable.attrs
    for name in ("parameters", "left_out", "filtered", "input_sha256"):
        assert values.attrs[name] == expected.attrs[name]
    first = str(expected["record_id"].values[0])
    assert repr(screening_of(both[1], first)) == repr(screening_of(both[0], first))
    if case.options.histories != "none":
        of_whole, of_batches = (read_histories(path) for path in both)
        assert of_whole.keys() == of_batches.keys()
        for place, history in of_whole.items():
            assert of_batches[place].equals(history)


def read_histories(path: Path) -> dict[tuple[str, str, float], xr.Dataset]:
    screening, histories = read_screening(path), {}
    for record in screening["record_id"].values.tolist():
        for structure in screening["structure"].values.tolist():
            for scale in screening["scale"].values.tolist():
                place = {"record": record, "structure": structure, "scale": scale}
                try:
                    histories[record, structure, scale] = read_screen_history(path, **place)
                except ParameterError:  # not kept
                    continue
    assert histories
    return histories


def test_xarray_opens_batches_as_one_file_and_not_a_batch_alone(tmp_path: Path) -> None:
    """The outcomes of members, which only files of batches have, are in no result."""
    case = Case(site(4), ScreenOptions(scales=SCALES, margins="none"), 2)
    whole_and_in_batches(tmp_path, case)
    path = tmp_path / "joined" / "screen.nc"
    with xr.open_dataset(path, engine="rockframe") as screening:
        assert screening["peak_u"].encoding["preferred_chunks"] == {"record": (2, 2)}
        assert "reached" not in screening
        expected = read_screening(path)["peak_u"].values
        assert_array_equal(screening["peak_u"].values, expected)
    shard = tmp_path / "joined" / "shards" / "screen-001.nc"
    alone = "is batch 1/2 alone, without the results of all records. State the file of all batches."
    with pytest.raises(InputError, match=alone):
        read_screening(shard)
    with pytest.raises(InputError, match=alone):
        xr.open_dataset(shard, engine="rockframe")
    shard.unlink()
    with pytest.raises(InputError, match=r"screen-001.nc: missing: screen.nc names it as batch 1"):
        read_screening(path)


def test_batches_of_another_screening_or_out_of_order_are_named(tmp_path: Path) -> None:
    records, kinds = stored(site(3), tmp_path), structures(tmp_path)
    paths = [tmp_path / f"{name}.nc" for name in ("first", "second", "other")]
    options = ScreenOptions(scales=SCALES, margins="none")
    changed = options.replaced(scales=(1.0,))
    numbers = (1, 2, 2)
    for path, number, some in zip(paths, numbers, (options, options, changed), strict=True):
        screen_stage(records, path, some, structures_path=kinds, batch=Batch(number, 2))
    output = tmp_path / "screen.nc"

    def joined(*shards: Path, **changes: Any) -> Screening:
        stated = options.replaced(**changes)
        return screen_stage(records, output, stated, structures_path=kinds, shards=shards)

    with pytest.raises(InputError, match=r"other.nc: not the parameters of .*first.nc"):
        joined(paths[0], paths[2])
    with pytest.raises(InputError, match=r"second.nc: is batch 2/2. Must be batch 1/2 here"):
        joined(paths[1], paths[0])
    with pytest.raises(InputError, match=r"first.nc: not the parameters of .*screen.nc"):
        joined(*paths[:2], limit_peak_u_m=(0.1,))
    assert not output.exists()
    # the random seed concerns the statistics alone
    assert joined(*paths[:2], seed=1).motions == 3
    with pytest.raises(ParameterError, match="State the files as shards of `screen_stage`"):
        index_stage(paths[:2], output)
    with pytest.raises(ParameterError, match="batch 1/2 and shards both stated"):
        screen_stage(records, output, options, shards=paths[:2], batch=Batch(1, 2))
    alone = options.replaced(measures=("pgv_rotd50",))
    with pytest.raises(ParameterError, match="pgv_rotd50 is unknown for all motions"):
        screen_stage(records, paths[0], alone, structures_path=kinds, batch=Batch(1, 2))


def test_a_record_without_any_motion_is_an_error_of_the_index(tmp_path: Path) -> None:
    """A batch whose motions are all filtered out is a file; without any motion there is none."""
    records, kinds = stored(site(3), tmp_path), structures(tmp_path)
    paths = [tmp_path / f"{number}.nc" for number in (1, 2)]
    options = ScreenOptions(scales=(1.0,), margins="none")
    call = {"structures_path": kinds, "filters": Filters(pga_g=(9.0, 10.0))}
    for number, path in enumerate(paths, 1):
        done = screen_stage(records, path, options, batch=Batch(number, 2), **call)  # type: ignore[arg-type]
        assert (done.motions, done.scenarios) == (0, 0)
    with pytest.raises(InputError, match=r"no batch contains a record; 's00': pga_g 0.05\d+"):
        screen_stage(records, tmp_path / "screen.nc", options, shards=paths, **call)  # type: ignore[arg-type]
