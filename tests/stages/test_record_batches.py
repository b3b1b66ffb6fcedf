"""Batches of record files and their index are, value by value, one ingest of all files."""

from __future__ import annotations

import json
import shutil
import zipfile
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

from rockframe.errors import InputError, ParameterError
from rockframe.options.ingest import Filters, IngestOptions
from rockframe.results.records import open_records
from rockframe.results.shards import shards_of
from rockframe.stages.common import Batch
from rockframe.stages.ingest import ingest_stage
from rockframe.stages.ingesting.batches import index_batches, ingest_batch

RNG = np.random.default_rng(1906)


def motion(samples: int = 800, before: int = 60) -> NDArray[np.float64]:
    """Return an acceleration [g] that begins with noise and is at rest in the end."""
    time = 0.02 * np.arange(samples)
    shape = np.exp(-(((time - 6.0) / 2.0) ** 2))
    quiet = 1e-4 * RNG.standard_normal(samples)
    values = 0.2 * shape * RNG.standard_normal(samples) + quiet
    return np.asarray(values - values[before:].mean())


def at2(
    path: Path, station: str, component: str, values: NDArray[np.float64] | None = None
) -> None:
    values = motion() if values is None else values
    lines = [
        "PEER NGA STRONG MOTION DATABASE RECORD",
        f"Somewhere, 4/18/1906, {station}, {component}",
        "ACCELERATION TIME SERIES IN UNITS OF G",
        f"NPTS=  {values.size}, DT=   .0200 SEC,",
        *(" ".join(f"{value:15.7E}" for value in row) for row in values.reshape(-1, 5)),
    ]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(lines) + "\n")


@pytest.fixture(scope="module")
def archive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Files of all sorts, whose batches depend on each other."""
    home = tmp_path_factory.mktemp("archive") / "records"
    for number in range(3):  # pairs that some batch boundary divides
        for component in ("000", "090", "UP")[: 3 - number % 2]:
            at2(
                home / f"RSN{number}_SOME_ST{number}{component}.AT2", f"Station {number}", component
            )
    at2(home / "north" / "RSN7_SOME_FAR000.AT2", "Far", "000")
    at2(home / "west" / "RSN7_SOME_FAR090.AT2", "Far", "090")  # a pair in two folders
    same = home / "RSN0_SOME_ST0000.AT2"
    shutil.copy(same, home / "west" / same.name)  # a copy
    at2(home / "west" / "RSN1_SOME_ST1000.AT2", "Elsewhere", "000")  # another of the same name
    (home / "notes.dat").write_text("no record at all\n")
    (home / "README.txt").write_text("read me\n")
    flat = np.zeros(800)
    at2(home / "yard" / "RSN8_SOME_FLAT000.AT2", "Flat", "000", flat)
    at2(home / "yard" / "RSN8_SOME_FLAT090.AT2", "Flat", "090", flat)
    with zipfile.ZipFile(home / "yard" / "more.zip", "w") as more:
        for path in (same, home / "north" / "RSN7_SOME_FAR000.AT2"):
            more.write(path, f"inside-{path.name}")
        more.write(same, same.name)
    (home / "catalogue.csv").write_text(
        "file,magnitude\nRSN0_SOME_ST0000.AT2,7.9\nRSN2_SOME_ST2000.AT2,6.5\nlost.AT2,5.0\n"
    )
    return home


def divided(
    home: Path, folder: Path, count: int, options: IngestOptions, filters: Filters
) -> tuple[Path, list[Path]]:
    """Ingest in batches; return the index and the files of the batches that it names."""
    parts = [folder / "shards" / f"records-{k:03d}.nc" for k in range(1, count + 1)]
    for number, part in enumerate(parts, 1):
        ingest_batch([home], part, options, filters, Batch(number, count), workers=0)
    index = folder / "records.nc"
    index_batches(parts, index, [home], options, filters, folder / "again")
    with netCDF4.Dataset(index) as file:
        named = shards_of({"shards": file.shards})
    return index, [folder / shard.name for shard in named]


def equal(index: Path, whole: Path) -> None:
    """Assert that all variables, attributes and rows are equal, to the last bit."""
    with (
        xr.open_dataset(index, engine="rockframe") as joined,
        xr.open_dataset(whole, engine="rockframe") as one,
    ):
        attrs = {name: value for name, value in joined.attrs.items() if name != "shards"}
        assert attrs == one.attrs
        assert list(joined.variables) == list(one.variables)
        xr.testing.assert_identical(joined.assign_attrs(shards=""), one.assign_attrs(shards=""))
    table, other = (path.with_suffix(".csv").read_bytes() for path in (index, whole))
    assert table == other


CASES = {
    "plain": ({}, {}, 3),
    "each file by itself": ({}, {}, 40),  # more batches than files
    "spectra": ({"spectral_periods_s": (0.5, 1.0)}, {}, 5),
    "filtered": ({}, {"magnitude": (7.0, 9.0)}, 9),
}


@pytest.mark.parametrize("case", CASES)
def test_batches_together_are_one_ingest(archive: Path, tmp_path: Path, case: str) -> None:
    stated, bounds, count = CASES[case]
    options, filters = IngestOptions(**stated), Filters(**bounds)
    whole = tmp_path / "whole.nc"
    ingest_stage([archive], whole, options, filters=filters, workers=0)
    index, parts = divided(archive, tmp_path / "run", count, options, filters)
    equal(index, whole)
    # copies and files of one name are in other batches than the first of them
    assert any("again" in part.parts for part in parts)
    with open_records(index) as joined, open_records(whole) as one:
        assert joined.motions == one.motions
        for record, other in zip(joined, one, strict=True):
            np.testing.assert_array_equal(record.acceleration, other.acceleration)


@pytest.fixture(scope="module")
def noisy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Pairs whose first components, alone, would get another corner than the second ones."""
    home = tmp_path_factory.mktemp("noisy") / "records"
    time = 0.02 * np.arange(4000)
    since = np.maximum(time - 30.0, 0.0)
    shape = 0.2 * np.sin(2 * np.pi * since) * since * np.exp(-since / 4)
    for number in range(3):
        for component, hum in (("000", 2e-5), ("090", 1.5e-3)):
            values = shape + hum * RNG.standard_normal(time.size)
            name = f"RSN{number}_NOISY{component}.AT2"
            at2(home / name, f"Noisy {number}", component, values)
    return home


def test_horizontals_in_two_batches_share_their_corner(noisy: Path, tmp_path: Path) -> None:
    """Else the rotations of a pair would mix two filters, by the place of a boundary."""
    options = IngestOptions(uncorrected=True)
    ingest_stage([noisy], tmp_path / "whole.nc", options, workers=0)
    index, parts = divided(noisy, tmp_path / "run", 2, options, Filters())
    equal(index, tmp_path / "whole.nc")
    assert [part.parent.name for part in parts] == ["again", "shards"]
    with open_records(tmp_path / "run" / "shards" / "records-001.nc") as alone:
        before = alone.corner("RSN1_NOISY000")
    with open_records(index) as joined:
        corners = [joined.corner(name) for name in joined.names]
    assert before.frequency < corners[2].frequency
    assert corners[0::2] == corners[1::2]


def test_only_the_batch_with_the_wanted_samples_is_opened(noisy: Path, tmp_path: Path) -> None:
    """A job of one batch of pulses reads its own records; the index has all other values."""
    index, parts = divided(noisy, tmp_path, 3, IngestOptions(), Filters())
    parts[2].unlink()
    with open_records(index) as records:
        assert len(records.names) == 6
        assert records.motions == [[f"RSN{k}_NOISY{c}" for c in ("000", "090")] for k in range(3)]
        records.read("RSN1_NOISY090")
        with pytest.raises(InputError, match=r"003.nc: missing: records.nc names it as batch 3 of"):
            records.read("RSN2_NOISY000")


def both(home: Path, folder: Path, count: int, **stated: Any) -> tuple[Exception, Exception]:
    """Return the errors of an ingest of all files at once and of batches of them."""
    options = IngestOptions(**stated)
    with pytest.raises((InputError, ParameterError)) as at_once:
        ingest_stage([home], folder / "whole.nc", options, workers=0)
    with pytest.raises((InputError, ParameterError)) as in_batches:
        divided(home, folder / "run", count, options, Filters())
    assert not (folder / "run" / "records.nc").exists()
    return at_once.value, in_batches.value


def test_strictness_refuses_the_first_rejection_of_all_batches(
    archive: Path, tmp_path: Path
) -> None:
    home = Path(shutil.copytree(archive, tmp_path / "home"))
    for name in ("notes.dat", "catalogue.csv"):
        (home / name).unlink()
    at_once, in_batches = both(home, tmp_path, 4, strict=True)
    assert str(at_once) == str(in_batches)
    assert "is in use by" in str(in_batches)  # a copy of a file in an earlier batch


def test_without_an_accepted_record_the_list_says_why(tmp_path: Path) -> None:
    home = tmp_path / "home"
    home.mkdir()
    for number in range(5):
        (home / f"words-{number}.dat").write_text(f"word {number}\n")
    at_once, in_batches = both(home, tmp_path, 3)
    assert str(at_once) == str(in_batches)
    assert (tmp_path / "run" / "records.csv").read_bytes() == (tmp_path / "whole.csv").read_bytes()


def test_a_selection_may_choose_from_all_batches(noisy: Path, tmp_path: Path) -> None:
    selection = tmp_path / "selected.csv"
    selection.write_text("record_id,scale\nRSN2_NOISY090,2.0\nRSN0_NOISY000,0.5\n")
    options = IngestOptions(selection=selection)
    ingest_stage([noisy], tmp_path / "whole.nc", options, workers=0)
    index, _ = divided(noisy, tmp_path / "few", 3, options, Filters())
    equal(index, tmp_path / "whole.nc")
    selection.write_text("record_id,scale\nRSN9,2.0\n")
    at_once, in_batches = both(noisy, tmp_path, 3, selection=selection)
    assert str(at_once) == str(in_batches)


@pytest.fixture(scope="module")
def few(noisy: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The index of three batches."""
    return divided(noisy, tmp_path_factory.mktemp("few"), 3, IngestOptions(), Filters())[0]


def joined_again(few: Path, home: Path) -> None:
    parts = sorted((few.parent / "shards").glob("*.nc"))
    index_batches(parts, few, [home], IngestOptions(), Filters(), few.parent / "again")


def test_a_file_that_comes_between_two_batches_is_in_one(
    few: Path, noisy: Path, tmp_path: Path
) -> None:
    """The batches read before it were divided at other places: they are read again."""
    home = Path(shutil.copytree(noisy, tmp_path / "home"))
    index = Path(shutil.copytree(few.parent, tmp_path / "run")) / "records.nc"
    shutil.copy(home / "RSN0_NOISY000.AT2", home / "RSN0_LATER.AT2")
    last = index.parent / "shards" / "records-003.nc"
    ingest_batch([home], last, IngestOptions(), Filters(), Batch(3, 3), workers=0)
    joined_again(index, home)
    ingest_stage([home], tmp_path / "whole.nc", workers=0)
    equal(index, tmp_path / "whole.nc")


def _without_notes(folder: Path) -> None:
    with netCDF4.Dataset(folder / "shards" / "records-002.nc", "a") as file:
        file.delncattr("ingested")


def _damaged_notes(folder: Path) -> None:
    with netCDF4.Dataset(folder / "shards" / "records-002.nc", "a") as file:
        file.ingested = json.dumps({**json.loads(file.ingested), "order": [5]})


def _out_of_order(folder: Path) -> None:
    first, second = (folder / "shards" / f"records-00{k}.nc" for k in (1, 2))
    shutil.copy(first, second)


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (_without_notes, "002.nc: says nothing of its record files"),
        (_damaged_notes, "002.nc: says nothing of its record files"),
        (_out_of_order, "002.nc: is batch 1/3. Must be batch 2/3"),
    ],
)
def test_a_batch_that_cannot_be_joined_is_named(
    few: Path, noisy: Path, tmp_path: Path, damage: Any, said: str
) -> None:
    folder = Path(shutil.copytree(few.parent, tmp_path / "run"))
    damage(folder)
    with pytest.raises(InputError, match=said):
        joined_again(folder / "records.nc", noisy)


def _of_other_inputs(folder: Path) -> None:
    with netCDF4.Dataset(folder / "shards" / "records-001.nc", "a") as file:
        file.input_sha256 = '{"RSN0_NOISY000.AT2": "0"}'


def _of_fewer_samples(folder: Path) -> None:
    with netCDF4.Dataset(folder / "records.nc", "a") as file:
        file["row_size"][0] = 3999


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (_of_other_inputs, "001.nc: not the input_sha256 of"),
        (_of_fewer_samples, "records.nc: names shards of other records than its own"),
    ],
)
def test_an_index_refuses_the_shards_of_other_records(
    few: Path, tmp_path: Path, damage: Any, said: str
) -> None:
    folder = Path(shutil.copytree(few.parent, tmp_path / "run"))
    damage(folder)
    with pytest.raises(InputError, match=said), open_records(folder / "records.nc") as records:
        records.read("RSN0_NOISY000")


def test_shards_of_records_are_the_chunks_of_dask(few: Path) -> None:
    pytest.importorskip("dask")
    with xr.open_dataset(few, engine="rockframe", chunks={}) as lazy:
        assert lazy.chunks["record"] == (2, 2, 2)
        assert lazy.chunks["obs"] == (8000, 8000, 8000)
        peaks = abs(lazy["acceleration"]).max().compute()
        assert float(peaks) == float(lazy["pga"].max().compute())
