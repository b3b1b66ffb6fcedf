"""The files between the stages: complete, self-describing, identical bytes for equal inputs."""

from __future__ import annotations

import gc
import json
import weakref
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from tests.conftest import examples
from xarray.core import indexing

import rockframe
from rockframe.errors import InputError, ParameterError
from rockframe.matching.record_pulses import find_pulses
from rockframe.options.pulse import PulseOptions
from rockframe.provenance import whole_file
from rockframe.record import Orientation, Record, SiteType
from rockframe.results.pulses import best_pulses, write_pulses
from rockframe.results.records import open_records, read_records, write_records
from rockframe.results.response import open_response, write_responses
from rockframe.results.tables.rows import columns_of, rows_along
from rockframe.results.writing import write
from rockframe.rocking import respond
from rockframe.rocking.contact import with_contact
from rockframe.rocking.response import Response
from rockframe.units import GRAVITY
from rockframe.wavelets.pulse import Pulse

FRAMES = [
    rockframe.RockingFrame(height=9.6, width=1.6, mass_ratio=4.0, name="bridge"),
    rockframe.RockingFrame(height=3.0, width=0.3, name="column"),
]


def shaken(name: str, a_p: float, samples: int = 1500) -> Record:
    pulse = Pulse(wavelet="symmetric_ricker", a_p=a_p, T_p=1.2, time=4.0)
    return Record(
        record_id=name,
        acceleration=pulse.acceleration(0.01 * np.arange(samples)),
        time_step=0.01,
        station="Ärgerhöhe",
        orientation=Orientation.HORIZONTAL,
        azimuth=90.0,
        site_type=SiteType.FREE_FIELD,
        processing=("one step", "another"),
    )


RECORDS_MADE = [shaken("weak", 0.5), shaken("strong", 6.0, 1201)]


def save(dataset: xr.Dataset, path: Path, kind: str) -> Path:
    write(dataset, path, kind, input_sha256={"made.csv": "0" * 64}, parameters={"a": 1.5})
    return path


def save_records(records: Iterable[Record], path: Path) -> Path:
    made = ((record, None) for record in records)
    write_records(made, path, input_sha256={"made.csv": "0" * 64}, parameters={"a": 1.5})
    return path


@pytest.fixture
def response_path(tmp_path: Path) -> Path:
    responses = [[respond(frame, record) for frame in FRAMES] for record in RECORDS_MADE]
    answers = zip((record.record_id for record in RECORDS_MADE), responses, strict=True)
    path = tmp_path / "response.nc"
    write_responses(
        answers, FRAMES, path, input_sha256={"made.csv": "0" * 64}, parameters={"a": 1.5}
    )
    return path


@examples(15)
@given(
    samples=hnp.arrays(
        np.float64,
        st.integers(2, 40),
        elements=st.floats(-50, 50, allow_nan=False, allow_subnormal=False),
    ),
    step=st.floats(1e-4, 1.0),
    event=st.text(st.characters(exclude_categories=("C", "Z")), max_size=20),
)
def test_a_record_comes_back_as_it_went(
    tmp_path_factory: pytest.TempPathFactory, samples: np.ndarray, step: float, event: str
) -> None:
    record = Record(record_id="a-1", acceleration=samples, time_step=step, event=event)
    path = save_records([record], tmp_path_factory.mktemp("r") / "records.nc")
    (back,) = read_records(path)
    np.testing.assert_array_equal(back.acceleration, record.acceleration)
    assert (back.record_id, back.time_step, back.event) == ("a-1", step, event)
    assert np.isnan(back.magnitude)
    assert back.processing == ()


def test_ragged_rows_are_cut_at_the_right_places(tmp_path: Path) -> None:
    path = save_records(RECORDS_MADE, tmp_path / "records.nc")
    for back, record in zip(read_records(path), RECORDS_MADE, strict=True):
        np.testing.assert_array_equal(back.acceleration, record.acceleration)
        assert back.processing == record.processing
        assert (back.station, back.site_type) == (record.station, record.site_type)


def test_records_are_read_one_by_one(tmp_path: Path) -> None:
    with open_records(save_records(RECORDS_MADE, tmp_path / "records.nc")) as records:
        assert records.names == ["weak", "strong"]
        assert records.orientations == [Orientation.HORIZONTAL] * 2
        assert [record.record_id for record in records] == ["weak", "strong"]
        strong = records.read("strong").acceleration
        with pytest.raises(ParameterError, match=r"record 'x'. Must be one of: weak, strong"):
            records.read("x")
    np.testing.assert_array_equal(strong, RECORDS_MADE[1].acceleration)


def test_demands_of_a_written_record_are_numbers_without_objects(tmp_path: Path) -> None:
    """A batch of an archive has 100,000 of them."""
    made_of: list[weakref.ref[Any]] = []
    most = 0

    def one_after_the_other() -> Iterator[tuple[str, list[Response]]]:
        nonlocal most
        for number in range(20):
            found = with_contact(respond(FRAMES[0], RECORDS_MADE[0]), RECORDS_MADE[0])
            made_of.append(weakref.ref(found.contact))
            most = max(most, sum(one() is not None for one in made_of))
            yield f"r{number}", [found]

    answers, path = one_after_the_other(), tmp_path / "response.nc"
    made = write_responses(answers, FRAMES[:1], path, input_sha256={}, parameters={})
    assert made["base_friction_demand"].shape == (20, 1)
    assert most <= 3


def test_records_are_not_held_while_they_are_written(tmp_path: Path) -> None:
    alive: weakref.WeakSet[Record] = weakref.WeakSet()
    most = 0

    def one_after_the_other() -> Iterator[Record]:
        nonlocal most
        for number in range(20):
            record = shaken(f"r{number}", 1.0, 5000)
            alive.add(record)
            most = max(most, len(alive))
            yield record

    path = save_records(one_after_the_other(), tmp_path / "records.nc")
    assert most <= 3
    assert len(read_records(path)) == 20


def test_an_error_among_the_records_leaves_nothing(tmp_path: Path) -> None:
    def broken() -> Iterator[Record]:
        yield RECORDS_MADE[0]
        raise InputError("b.AT2", "is damaged.")

    with pytest.raises(InputError, match=r"b\.AT2: is damaged"):
        save_records(broken(), tmp_path / "records.nc")
    assert list(tmp_path.iterdir()) == []


def test_no_record_makes_no_folder(tmp_path: Path) -> None:
    broken = (read_records(tmp_path / name)[0] for name in ["lost.nc"])
    with pytest.raises(InputError, match=r"lost\.nc: no such file"):
        save_records(broken, tmp_path / "new" / "records.nc")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("share", [0.1, 0.5, 0.95])
def test_a_file_that_is_too_large_is_said_and_leaves_nothing(tmp_path: Path, share: float) -> None:
    resource = pytest.importorskip("resource", reason="no limits of file size on this system")
    noise = np.random.default_rng(1).standard_normal(40_000)
    records = [Record(record_id="noise", acceleration=noise, time_step=0.01)]
    size = save_records(records, tmp_path / "whole.nc").stat().st_size
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (int(share * size), hard))
    try:
        with pytest.raises(InputError, match=r"records\.nc: cannot be written: File too large: "):
            save_records(records, tmp_path / "records.nc")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    # netCDF could not close the file. If a thread of a later test collected it, while that test
    # writes a file, HDF5 would fail.
    gc.collect()
    assert [file.name for file in tmp_path.iterdir()] == ["whole.nc"]


def test_the_same_inputs_give_the_same_bytes(tmp_path: Path) -> None:
    first = save_records(RECORDS_MADE, tmp_path / "a.nc").read_bytes()
    second = save_records(RECORDS_MADE, tmp_path / "b.nc").read_bytes()
    assert first == second


@pytest.mark.parametrize("name", ["LazilyIndexedArray", "IndexingSupport"])
def test_another_xarray_reads_the_same(
    response_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """Without the parts that read on demand, all values are read at once."""
    with open_response(response_path) as response:
        known = response.dataset.load()
    monkeypatch.delattr(indexing, name)
    with open_response(response_path) as response:
        assert response.dataset.identical(known)


def test_every_variable_explains_itself(response_path: Path) -> None:
    with xr.open_dataset(response_path) as bare:
        assert bare.attrs["Conventions"] == "CF-1.11"
        assert json.loads(bare.attrs["parameters"]) == {"a": 1.5}
        for name, variable in bare.variables.items():
            assert {"units", "long_name"} <= set(variable.attrs), name
        assert bare["row_size"].attrs["sample_dimension"] == "obs"
        assert bare["record_id"].attrs["cf_role"] == "timeseries_id"
        meanings = bare["verdict"].attrs["flag_meanings"].split()
        assert meanings == ["no_uplift", "stands", "overturns", "not_computed"]


def test_every_variable_is_compressed_and_checksummed(response_path: Path) -> None:
    with xr.open_dataset(response_path) as bare:
        for name, variable in bare.variables.items():
            assert variable.encoding["fletcher32"], name
            assert variable.encoding["zlib"], name


def test_selecting_gives_the_history_that_was_computed(response_path: Path) -> None:
    with open_response(response_path) as response:
        assert response.records == ["weak", "strong"]
        assert response.structures == ["bridge", "column"]
        history = response.sel(record="strong", structure="column")
    computed = respond(FRAMES[1], RECORDS_MADE[1])
    assert history.sizes == {"time": 1201}
    for name in ("theta", "u", "v"):
        np.testing.assert_array_equal(history[name], getattr(computed, name))
    assert int(history["verdict"]) == computed.verdict == rockframe.Verdict.OVERTURNS
    assert float(history["overturning_time"]) == computed.overturning_time


def test_histories_are_missing_after_overturning_only(response_path: Path) -> None:
    with open_response(response_path) as response:
        fallen = response.sel(record="strong", structure="column")
        standing = response.sel(record="weak", structure="bridge")
    after = fallen["time"] > float(fallen["overturning_time"])
    assert bool(np.isnan(fallen["theta"][after]).all())
    assert bool(np.isfinite(fallen["theta"][~after]).all())
    assert bool(np.isfinite(standing["theta"]).all())


def test_unknown_names_are_refused_with_those_there_are(response_path: Path) -> None:
    with open_response(response_path) as response:
        with pytest.raises(ParameterError, match=r"record 'x'. Must be one of: weak, strong"):
            response.sel(record="x", structure="bridge")
        with pytest.raises(ParameterError, match=r"structure 'x'. Must be one of: bridge, column"):
            response.sel(record="weak", structure="x")


def test_best_pulses_come_back(tmp_path: Path) -> None:
    options = PulseOptions(pulse_wavelet="mavroeidis_papageorgiou", surrogates=19)
    found = [find_pulses(record.acceleration, 0.01, options) for record in RECORDS_MADE]
    path = tmp_path / "pulses.nc"
    answers = zip(RECORDS_MADE, found, strict=True)
    write_pulses(answers, path, input_sha256={}, parameters={"runners_up": 2})
    expected = {
        record.record_id: one.matches[one.used]
        for record, one in zip(RECORDS_MADE, found, strict=True)
    }
    assert best_pulses(path) == expected


def test_residual_and_pulse_motion_are_beside_the_pulses(tmp_path: Path) -> None:
    options = PulseOptions(surrogates=0)
    record = RECORDS_MADE[0]
    found = find_pulses(record.acceleration, 0.01, options)
    path = tmp_path / "pulses.nc"
    write_pulses([(record, found)], path, input_sha256={}, parameters={"runners_up": 2})
    pulse = found.matches[found.used].pulse
    with xr.open_dataset(path) as dataset:
        whole = dataset["residual"] + pulse.acceleration(record.time)
        np.testing.assert_allclose(whole, record.acceleration, atol=1e-15)
        np.testing.assert_array_equal(dataset["pulse_velocity"], pulse.velocity(record.time))
        displacement = pulse.displacement(record.time)
        np.testing.assert_array_equal(dataset["pulse_displacement"], displacement)
        assert dataset["pulse_verdict"].attrs["flag_meanings"] == "untested pulse noise at_bound"


def test_a_file_of_another_kind_is_refused(response_path: Path) -> None:
    with pytest.raises(
        InputError, match=r"of kind 'response'. Must be the output of `rockframe ing"
    ):
        read_records(response_path)


def test_a_subset_of_records_with_all_samples_is_refused(tmp_path: Path) -> None:
    """Cut at the stated row sizes, a record would get the samples of another one."""
    path = save_records(RECORDS_MADE, tmp_path / "records.nc")
    with xr.open_dataset(path) as bare:
        bare.load().isel(record=[1]).to_netcdf(tmp_path / "subset.nc")
    with pytest.raises(InputError, match=r"1201 samples in row_size, 2701 along obs. Must be eq"):
        read_records(tmp_path / "subset.nc")


def test_an_identifier_twice_is_refused(tmp_path: Path) -> None:
    path = save_records(RECORDS_MADE[:1] * 2, tmp_path / "records.nc")
    with pytest.raises(InputError, match=r"record_id 'weak' occurs twice. Must be unique"):
        read_records(path)


def test_a_file_that_does_not_end_in_nc_is_not_written(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"ends in '.csv'. Must end in .nc"):
        save_records(RECORDS_MADE, tmp_path / "records.csv")
    assert list(tmp_path.iterdir()) == []


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none.nc: no such file. Must be a records file"):
        read_records(tmp_path / "none.nc")


@pytest.mark.parametrize(
    ("function", "arguments"),
    [
        *((f"read_{name}", ["lost"]) for name in ("structures", "hazard", "spectrum", "screening")),
        ("read_rocking_spectrum", ["lost"]),
        ("verify_run", ["lost"]),
        ("ingest_stage", [["lost"], "out.nc"]),
        ("index_stage", [["lost.nc"], "out.nc"]),
        ("compare_stage", ["lost.nc", "out.nc", "lost.toml"]),
        (
            "rocking_spectrum_stage",
            ["lost.nc", "out.nc", rockframe.RockingSpectrumOptions(slenderness_degree=(9.0,))],
        ),
        *((f"{name}_stage", ["lost.nc", "out.nc"]) for name in ("pulse", "respond", "screen")),
    ],
)
def test_a_path_may_be_text(function: str, arguments: list[object]) -> None:
    with pytest.raises(rockframe.RockframeError, match=r"lost|missing"):
        getattr(rockframe, function)(*arguments)


def test_something_that_is_no_netcdf_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "records.nc"
    path.write_text("not netCDF")
    with pytest.raises(InputError, match=r"is not a netCDF file. Run `rockframe ingest` first"):
        read_records(path)


@pytest.mark.parametrize("share", [0.3, 0.6, 0.9])
def test_a_flipped_byte_of_the_samples_is_found(tmp_path: Path, share: float) -> None:
    """Noise cannot be compressed, so nearly all of the file is samples in checksummed blocks."""
    samples = np.random.default_rng(0).normal(size=200_000)
    noise = Record(record_id="noise", acceleration=samples, time_step=0.01)
    path = save_records([noise], tmp_path / "records.nc")
    content = bytearray(path.read_bytes())
    content[int(share * len(content))] ^= 0xFF
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"records\.nc"):
        read_records(path)


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "result.txt"
    path.write_text("old")

    def interrupted() -> None:
        with whole_file(path) as partial:
            partial.write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert [entry.name for entry in tmp_path.iterdir()] == ["result.txt"]
    assert path.read_text() == "old"


def test_a_folder_that_cannot_be_made_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with (
        pytest.raises(InputError, match=r"file: is a file. Must be a folder, because below\.nc is"),
        whole_file(tmp_path / "file" / "below.nc"),
    ):
        pass


def test_columns_of_rows_name_their_units() -> None:
    """Values are converted to the unit in the name of the column; a scalar is in every row."""
    dataset = xr.Dataset(
        {
            "pga": ("record", [GRAVITY, 0.5 * GRAVITY]),
            "alpha": ("structure", [np.pi, np.pi / 2.0]),
            "fell": (("structure", "record"), [[0, 1], [1, 0]], {
                "flag_values": np.array([0, 1]), "flag_meanings": "no yes"}),
            "scale": ((), 2.0),
        }
    )  # fmt: skip
    columns = columns_of("pga_g=pga alpha_deg=alpha fell scale")
    assert [tuple(row.values()) for row in rows_along(dataset, "record structure", columns)] == [
        *((1.0, 180.0, False, 2.0), (1.0, 90.0, True, 2.0)),
        *((0.5, 180.0, True, 2.0), (0.5, 90.0, False, 2.0)),
    ]
