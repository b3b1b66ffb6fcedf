"""netCDF files that differ from those of rockframe: read correctly or rejected in one line."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tracemalloc
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, Final, Literal

import netCDF4
import numpy as np
import pytest
import xarray as xr
from tests.cli.test_verify import restated
from tests.commands import run

from rockframe.errors import InputError
from rockframe.results import stored
from rockframe.results.reading import opened
from rockframe.results.records import open_records
from rockframe.results.schema import KINDS, Variable
from rockframe.results.stored import open_netcdf

#: For each declared unit, an equivalent one and how many of it make one declared unit.
OTHER_UNITS: Final = {
    "m s-2": ("cm/s2", 100.0),
    "m s-1": ("mm s-1", 1000.0),
    "m": ("km", 0.001),
    "km": ("m", 1000.0),
    "s": ("ms", 1000.0),
    "rad": ("degree", 180.0 / np.pi),
    "degree": ("rad", np.pi / 180.0),
    "Hz": ("s^-1", 1.0),
    "rad s-1": ("degree/s", 180.0 / np.pi),
}


# Damages to one variable of an open file. Each returns True if the file must be rejected, False if
# it must still be read, and None if the damage does not apply to this variable.
Damage = Callable[[netCDF4.Dataset, Variable], bool | None]


def renamed(file: netCDF4.Dataset, one: Variable) -> bool | None:
    """Rename a variable; None if it is alone in its optional group, which older files lack."""
    groups = [each.group for each in KINDS[file.rockframe_kind].variables]
    file.renameVariable(one.name, f"{one.name}_of_somebody")
    return True if not one.group or groups.count(one.group) > 1 else None


def of_unknown_units(file: netCDF4.Dataset, one: Variable) -> bool:
    file[one.name].units = "furlong"
    return True


def of_units_that_are_a_number(file: netCDF4.Dataset, one: Variable) -> bool:
    file[one.name].setncattr("units", np.int32(7))
    return True


def without_units(file: netCDF4.Dataset, one: Variable) -> bool:
    file[one.name].delncattr("units")
    return one.units != "1"


def of_other_units(file: netCDF4.Dataset, one: Variable) -> bool | None:
    if one.units not in OTHER_UNITS:
        return None
    units, factor = OTHER_UNITS[one.units]
    file[one.name][...] = file[one.name][...] * factor
    file[one.name].units = units
    return False


def without_words(file: netCDF4.Dataset, one: Variable) -> bool:
    file[one.name].delncattr("long_name")
    return False


def packed(file: netCDF4.Dataset, one: Variable) -> bool:
    file[one.name].scale_factor = 2.0
    return True


def of_other_type(file: netCDF4.Dataset, one: Variable) -> bool:
    """Replace text with numbers, and the reverse."""
    file.renameVariable(one.name, f"{one.name}_of_somebody")
    file.createVariable(one.name, float if one.holds == "text" else str, one.dims)
    return True


def of_reals(file: netCDF4.Dataset, one: Variable) -> bool | None:
    if one.holds not in ("integers", "flags"):
        return None
    file.renameVariable(one.name, f"{one.name}_of_somebody")
    file.createVariable(one.name, float, one.dims)[...] = np.nan
    return True


def of_single_precision(file: netCDF4.Dataset, one: Variable) -> bool | None:
    if one.holds != "numbers":
        return None
    values = file[one.name][...]
    file.renameVariable(one.name, f"{one.name}_of_somebody")
    file.createVariable(one.name, "f4", one.dims)[...] = values
    file[one.name].units = file[f"{one.name}_of_somebody"].units
    return False


def along_another_dimension(file: netCDF4.Dataset, one: Variable) -> bool:
    file.renameVariable(one.name, f"{one.name}_of_somebody")
    file.createDimension("somebody", 2)
    file.createVariable(one.name, str if one.holds == "text" else "i1", (*one.dims, "somebody"))
    return True


def not_known(file: netCDF4.Dataset, one: Variable) -> bool | None:
    if one.holds != "numbers":
        return None
    file[one.name][...] = np.nan
    return bool(one.valid not in ("", "any") or one.key or one.refers_to)


def negative(file: netCDF4.Dataset, one: Variable) -> bool | None:
    counted = one.holds in ("integers", "flags") and one.valid != "any"
    if not (counted or one.valid == "positive"):
        return None
    file[one.name][...] = -7
    return True


def beyond(file: netCDF4.Dataset, one: Variable) -> bool | None:
    """Refer to rows and positions that do not exist, or use undeclared flags."""
    tied = one.holds == "flags" or one.refers_to or "sample_dimension" in one.attrs
    if one.holds == "text" or not tied:
        return None
    file[one.name][...] = 99
    return True


def of_other_meanings(file: netCDF4.Dataset, one: Variable) -> bool | None:
    if one.holds != "flags":
        return None
    words = file[one.name].flag_meanings.split()
    file[one.name].flag_meanings = " ".join([*words[1:], words[0]])
    return True


def twice_the_same(file: netCDF4.Dataset, one: Variable) -> bool | None:
    if not one.key or file[one.name].shape[0] < 2:
        return None
    values = file[one.name][...]
    file[one.name][...] = values[[0] * len(values)]
    return True


def of_broken_letters(file: netCDF4.Dataset, one: Variable) -> bool | None:
    if one.holds != "text":
        return None
    file[one.name].set_auto_chartostring(False)
    file[one.name][...] = np.full(file[one.name].shape, b"\xff", dtype="S1")
    return True


def of_hostile_names(file: netCDF4.Dataset, one: Variable) -> bool | None:
    """Use a name that is a path outside the folder of the figures."""
    if not (one.key or one.choices or one.refers_to) or one.holds != "text":
        return None
    file[one.name].set_auto_chartostring(False)
    file[one.name][...] = np.full(file[one.name].shape, b"/", dtype="S1")
    return True


DAMAGES: Final[tuple[Damage, ...]] = (
    *(renamed, of_unknown_units, of_units_that_are_a_number, without_units, of_other_units),
    *(without_words, packed, of_other_type, of_reals, of_single_precision),
    *(along_another_dimension, not_known, negative, beyond, of_other_meanings),
    *(twice_the_same, of_broken_letters, of_hostile_names),
)


def read(path: Path, kind: str) -> xr.Dataset:
    with opened(path, kind) as dataset:
        return dataset.load()


undamaged = cache(read)


def sorts(kind: str) -> list[Variable]:
    """Return one variable of each declaration; the reader treats equal declarations alike."""
    found = {
        (v.holds, v.valid, v.key, v.refers_to, v.choices, v.units, v.also_units, v.group): v
        for v in reversed(KINDS[kind].variables)
    }
    return list(found.values())


def refused(path: Path, kind: str) -> bool:
    """Return True if the file is rejected with one line that names it."""
    try:
        with opened(path, kind):
            return False
    except InputError as error:
        line = str(error)
        return line.startswith(f"{path}: ") and line.endswith(".") and "\n" not in line


def next_damaged(
    path: Path, damage: Damage, variables: Iterator[Variable]
) -> tuple[Variable, bool] | None:
    """Damage the next variable to which a damage applies; return it, and if it must be rejected."""
    with netCDF4.Dataset(path, "a") as file:
        for one in variables:
            must_fail = damage(file, one) if one.name in file.variables else None
            if must_fail is not None:
                return one, must_fail
    return None


@pytest.mark.parametrize(
    "most", [2, pytest.param(1000, marks=pytest.mark.faults)], ids=["two", "all"]
)
@pytest.mark.parametrize("damage", DAMAGES, ids=lambda damage: damage.__name__)
@pytest.mark.parametrize("kind", KINDS)
def test_each_variable_is_as_declared_or_refused(
    made: Path, tmp_path: Path, kind: str, damage: Damage, most: int
) -> None:
    """Unless all are asked for, each damage is done to two variables, mostly to other ones."""
    whole, path = made / f"{kind}.nc", tmp_path / "damaged.nc"
    harmless = tmp_path / "harmless.nc"
    variables = KINDS[kind].variables if damage is renamed else sorts(kind)
    start = 7 * DAMAGES.index(damage) % len(variables)
    rest, spared = iter([*variables[start:], *variables[:start]]), list[Variable]()
    for _ in range(most):
        shutil.copyfile(whole, path)
        damaged = next_damaged(path, damage, rest)
        if damaged is None:
            break
        one, must_fail = damaged
        if must_fail:
            assert refused(path, kind), one.name
        else:
            spared.append(one)
    if not spared:
        return
    shutil.copyfile(whole, harmless)
    with netCDF4.Dataset(harmless, "a") as file:  # all at once must not change what is read
        for one in spared:
            damage(file, one)
    back, before = read(harmless, kind), undamaged(whole, kind)
    assert {n: str(v.attrs) for n, v in back.variables.items()} == {
        n: str(v.attrs) for n, v in before.variables.items()
    }
    if damage is not not_known:  # not_known replaces the values with NaN
        xr.testing.assert_allclose(back, before, rtol=1e-6)


# Damages to a whole file of any kind.


def empty(path: Path, _kind: str) -> None:
    path.write_bytes(b"")


def cut_off(path: Path, _kind: str) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def hdf5_of_another_program(path: Path, _kind: str) -> None:
    path.write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(2000))


def of_netcdf_3(path: Path, kind: str) -> None:
    xr.Dataset({"pga": ("record", [1.0, 2.0])}, attrs={"rockframe_kind": kind}).to_netcdf(
        path, format="NETCDF3_CLASSIC"
    )


def of_groups_only(path: Path, kind: str) -> None:
    with xr.open_dataset(path, decode_times=False) as whole:
        attrs, inner = whole.attrs, whole.load()
    xr.Dataset(attrs=attrs).to_netcdf(path)
    inner.to_netcdf(path, group=kind, mode="a")


def of_another_kind(path: Path, kind: str) -> None:
    other = next(name for name in KINDS if name != kind)
    with netCDF4.Dataset(path, "a") as file:
        file.rockframe_kind = other


def of_two_kinds(path: Path, _kind: str) -> None:
    with netCDF4.Dataset(path, "a") as file:
        file.rockframe_kind = np.array([1, 2])


def without_its_inputs(path: Path, _kind: str) -> None:
    with netCDF4.Dataset(path, "a") as file:
        file.delncattr("input_sha256")


def with_inputs_that_are_none(path: Path, _kind: str) -> None:
    with netCDF4.Dataset(path, "a") as file:
        file.input_sha256 = "[" * 100_000


def with_left_out_that_is_none(path: Path, _kind: str) -> None:
    with netCDF4.Dataset(path, "a") as file:
        file.left_out = "[1]"


def of_more_than_there_is(path: Path, kind: str) -> None:
    """Write a small file that states 3e7 values of each variable, which it does not contain."""
    attrs = dict.fromkeys(("input_sha256", "parameters", "left_out"), "{}")
    with netCDF4.Dataset(path, "w") as file:
        file.setncatts({"rockframe_kind": kind, "source_code_hash": "", **attrs})
        for one in KINDS[kind].variables:
            for dim in one.dims:
                if dim not in file.dimensions:
                    # 3e7 along the first dimension
                    file.createDimension(dim, 2 if file.dimensions else 3 * 10**7)
            chunks = [min(1000, file.dimensions[dim].size) for dim in one.dims]
            kinds: dict[str, Any] = {"text": str, "numbers": "f8", "flags": "i1"}
            dtype: Any = kinds.get(one.holds, "i4")
            made = file.createVariable(one.name, dtype, one.dims, chunksizes=chunks or None)
            made.units = one.units


WHOLE: Final[tuple[Callable[[Path, str], None], ...]] = (
    *(empty, cut_off, hdf5_of_another_program, of_netcdf_3, of_groups_only, of_another_kind),
    *(of_two_kinds, without_its_inputs, with_inputs_that_are_none, with_left_out_that_is_none),
    of_more_than_there_is,
)


@pytest.mark.parametrize("damage", WHOLE, ids=lambda damage: damage.__name__)
@pytest.mark.parametrize("kind", KINDS)
def test_a_file_that_is_something_else_is_refused(
    made: Path, tmp_path: Path, kind: str, damage: Callable[[Path, str], None]
) -> None:
    path = tmp_path / f"{kind}.nc"
    shutil.copyfile(made / f"{kind}.nc", path)
    damage(path, kind)
    assert refused(path, kind)


@pytest.mark.parametrize("kind", KINDS)
def test_no_memory_is_allocated_for_values_that_a_file_does_not_contain(
    tmp_path: Path, kind: str
) -> None:
    """One variable of 3e7 numbers would take 30 MB or more, as bytes, and 240 MB as reals."""
    path = tmp_path / "claims.nc"
    of_more_than_there_is(path, kind)
    tracemalloc.start()
    try:
        with pytest.raises(InputError, match="bytes of values, but has"), opened(path, kind):
            pass
        _, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert most < 10e6


def test_a_file_may_be_compressed_as_far_as_netcdf_can(made: Path, tmp_path: Path) -> None:
    """A record of zeros: a million samples take some kilobytes."""
    path = tmp_path / "still.nc"
    with xr.open_dataset(made / "records.nc", decode_times=False) as whole:
        records = whole.load()
    one = records.isel(record=[0], obs=np.zeros(10**6, dtype=int))
    one["acceleration"][:] = 0.0
    one["row_size"][:] = 10**6
    packed = {"acceleration": {"zlib": True, "complevel": 9, "chunksizes": (10**6,)}}
    one.to_netcdf(path, encoding=packed)
    assert path.stat().st_size < 0.05 * one["acceleration"].nbytes
    with opened(path, "records") as file:
        assert file.sizes["obs"] == 10**6


def set_values(path: Path, name: str, values: Any) -> None:
    with netCDF4.Dataset(path, "a") as file:
        file[name][...] = values


def with_rows_exchanged(path: Path) -> None:
    """Exchange the row sizes: the sum stays the same, but records get each other's samples."""
    set_values(path, "row_size", [101, 701])


def with_negative_rows(path: Path) -> None:
    set_values(path, "row_size", [-1, 803])


def with_samples_not_known(path: Path) -> None:
    with netCDF4.Dataset(path, "a") as file:
        file["acceleration"][200] = np.nan


def with_units_that_are_not_its_own(path: Path) -> None:
    """State units that are known but are not those of the numbers."""
    with netCDF4.Dataset(path, "a") as file:
        file["acceleration"].units = "g"


def with_time_steps_that_are_not_its_own(path: Path) -> None:
    with netCDF4.Dataset(path, "a") as file:
        file["time_step"].units = "ms"


@pytest.mark.parametrize(
    ("damage", "must"),
    [
        (with_rows_exchanged, "peak acceleration of .*, stated as .* Must be equal."),
        (with_negative_rows, "row_size -1. Must be 0 or more."),
        (with_samples_not_known, "acceleration nan at sample 200 of record 'one'. Must be finite."),
        (with_units_that_are_not_its_own, "peak acceleration of .*, stated as .* Must be equal."),
        (with_time_steps_that_are_not_its_own, "peak velocity of .*, stated as .* Must be equal."),
    ],
    ids=lambda value: getattr(value, "__name__", ""),
)
def test_samples_that_contradict_what_is_known_of_them_are_refused(
    made: Path, tmp_path: Path, damage: Callable[[Path], None], must: str
) -> None:
    path = Path(shutil.copy(made / "records.nc", tmp_path))
    damage(path)
    with pytest.raises(InputError, match=rf"records\.nc: .*{must}"), open_records(path) as file:
        list(file)


#: Arguments of each command; the names of input files stand for the files of `made`.
COMMANDS: Final = {
    "pulse": "pulse records.nc --output out.nc",
    "respond": "respond records.nc --pulses pulses.nc --output out.nc",
    "screen": "screen records.nc --pulses pulses.nc --scales 1 --output out.nc",
    "spectrum": "spectrum --records records.nc --slenderness-deg 9 --column-period 5 --output o.nc",
    "table": "table records.nc pulses.nc response.nc --output out.csv",
    "draw": "figure records.nc pulses.nc response.nc --output out",
    "draw_screen": "figure screen.nc --output out",
    "draw_spectrum": "figure spectrum.nc --output out",
    "draw_rocking": "figure rocking_spectrum.nc --output out",
    "figure_8": "figure 8 --records records.nc --output out.png",
    "figure_11": "figure 11 --records records.nc --output out.png",
    "scalogram": "figure scalogram --records records.nc --output out.png",
    "joints": "figure joints --records records.nc --output out.png",
    "explore": "explore --records records.nc --no-browser --port 0",
}
CASES: Final = [
    (name, kind)
    for name, words in COMMANDS.items()
    for kind in KINDS
    if f"{kind}.nc" in words.split()
]


def of_strange_units(path: Path, kind: str) -> None:
    one = next(v for v in KINDS[kind].variables if v.holds == "numbers" and not v.group)
    with netCDF4.Dataset(path, "a") as file:
        of_unknown_units(file, one)


@pytest.mark.parametrize(
    "damage",
    [empty, of_another_kind, of_more_than_there_is, of_strange_units],
    ids=lambda damage: damage.__name__,
)
@pytest.mark.parametrize(("name", "kind"), CASES, ids=["-".join(case) for case in CASES])
def test_every_command_says_it_in_one_line(
    made: Path,
    tmp_path: Path,
    name: str,
    kind: str,
    damage: Callable[[Path, str], None],
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = Path(shutil.copy(made / f"{kind}.nc", tmp_path))
    damage(path, kind)
    files = {f"{other}.nc": made / f"{other}.nc" for other in KINDS} | {path.name: path}
    words = [files.get(word, Path(word)) for word in COMMANDS[name].split()]
    if "--output" in COMMANDS[name]:
        words[-1] = tmp_path / words[-1]
    assert run(*words) == 2
    message = capsys.readouterr().err
    assert message.startswith("rockframe: error: ")
    assert str(path) in message
    assert message.count("\n") == 1
    assert [file.name for file in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize("verb", ["show", "report", "verify"])
@pytest.mark.parametrize("name", ["records.nc", "pulses.nc", "response.nc"])
def test_of_the_files_of_a_run_too(
    made: Path, tmp_path: Path, name: str, verb: str, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = Path(shutil.copytree(made / "run", tmp_path / "run"))
    of_strange_units(folder / name, name.removesuffix(".nc"))
    restated(folder, name)
    status = run(verb, folder, *(["one"] if verb == "show" else []))
    message = capsys.readouterr().err
    assert status == (1 if verb == "verify" else 2)
    assert f"{folder / name}: variable " in message
    assert "Traceback" not in message


@pytest.mark.skipif(os.name != "posix", reason="other systems refuse to open such a file")
@pytest.mark.parametrize("mode", ["r", "a"])
def test_a_lock_that_ends_soon_is_waited_for(
    made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, mode: Literal["r", "a"]
) -> None:
    """A process that is just starting holds the locks of this one until its own program begins: a
    run that had closed records.nc could not open it again.
    """
    path = tmp_path / "records.nc"
    shutil.copy(made / "records.nc", path)
    fcntl = pytest.importorskip("fcntl", reason="the system has no such locks")
    pauses = []
    with path.open("rb") as stream:
        fcntl.flock(stream, fcntl.LOCK_EX)

        def pause(_seconds: float) -> None:
            pauses.append(mode)
            if len(pauses) == 3:
                fcntl.flock(stream, fcntl.LOCK_UN)

        monkeypatch.setattr(stored, "sleep", pause)
        with open_netcdf(path, mode) as file:
            assert file.variables
    assert len(pauses) == 3


@pytest.mark.skipif(os.name != "posix", reason="other systems refuse to open such a file")
def test_a_file_that_another_program_writes_is_named_as_such(made: Path, tmp_path: Path) -> None:
    """HDF5 says no more than `NetCDF: HDF error`, as of a corrupted file."""
    path = tmp_path / "records.nc"
    shutil.copy(made / "records.nc", path)
    program = "import netCDF4, sys; f = netCDF4.Dataset(sys.argv[1], 'a'); print(1); input()"
    with subprocess.Popen(
        [sys.executable, "-uc", program, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as other:
        assert other.stdout
        assert other.stdin
        other.stdout.readline()
        with pytest.raises(InputError, match="another program has it open for writing"):
            open_records(path)
        other.stdin.close()
    assert open_records(path).names
