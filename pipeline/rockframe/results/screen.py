"""screen.nc, and the finished batches from which the same command can resume."""

from __future__ import annotations

import json
import math
import re
import shutil
import zipfile
import zlib
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import chain, islice
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, TYPE_CHECKING, Any, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from rockframe.engines.engine import Engine, map_tasks
from rockframe.errors import InputError, ParameterError
from rockframe.provenance import key_of, whole_file
from rockframe.quantities import OF_SCENARIO, QUANTITIES
from rockframe.results.schema import SCREEN
from rockframe.results.schema.arrays import positions
from rockframe.results.schema.response import SCREEN_NC
from rockframe.results.stored import CHUNK, open_netcdf
from rockframe.results.tables.rows import columns_of, rows_along
from rockframe.results.writing import (
    as_os_error,
    create_variable,
    growing,
    named,
    put,
    slices,
)
from rockframe.risk import Fragility, HazardCurve, overturning_rate
from rockframe.rocking import Design
from rockframe.structures.contract import StructureResponse

if TYPE_CHECKING:
    import xarray as xr

Float = NDArray[np.float64]
Scenario = Mapping[str, NDArray[Any]]
#: Positions of record, structure and scale, and the response of that scenario with its nodes.
KeptHistory = tuple[tuple[int, int, int], StructureResponse]
#: For each structure and limit state, the fragility over each measure.
Fits = Sequence[Sequence[Mapping[str, Fragility]]]

#: Writes a part of a variable along motions and structures into the file.
WritePart = Callable[[str, tuple[slice, slice], NDArray[Any]], None]
#: Number of pairs of motion and structure of which values at one scale are in memory together.
_FEW_PAIRS: Final = 2**19

_SERIES: Final = ("time", "theta", "u", "v")
_INDICES: Final = ("history_record", "history_structure", "history_scale")
_PEAKS: Final = tuple(quantity.name for quantity in OF_SCENARIO)
#: Variables that are written motion by motion, and those that need an ensemble.
_NOMINAL: Final = ("verdict", *_PEAKS)
_OF_MEMBERS: Final = tuple(
    variable.name for variable in SCREEN_NC.variables if variable.group == "members"
)


def write_screening(
    scenarios: Iterable[Scenario],
    sizes: Mapping[str, int],
    reference: int,
    describe: Callable[[WritePart], tuple[Mapping[str, Any], Mapping[str, str]]],
    path: Path,
    *,
    input_sha256: Mapping[str, str],
    parameters: Mapping[str, Any],
    left_out: Mapping[str, str],
    filtered: Collection[str] = (),
    histories: Iterable[KeptHistory] | None = None,
) -> xr.Dataset:
    """Write the output of the screen stage, complete or not at all; one motion is in memory at a
    time. Return what `read_screening` reads of it, at the reference scale only.

    The same inputs give the same bytes.

    Parameters
    ----------
    scenarios : iterable of mapping of str to array, shape (structures, scales)
        The result of `quantities_of` for each motion, and the shares and bands of an ensemble.
    sizes : mapping of str to int
        Numbers of motions, structures and scales: ``record``, ``structure`` and ``scale``; with an
        ensemble also of limits and quantiles: ``limit_state`` and ``quantile``.
    reference : int
        Position of the reference scale.
    describe : callable
        Called after the last motion with a function that writes parts of variables into the file;
        returns the values of the other variables, and the units of variables that allow two units.
    path : Path
        The file to write; an older file is replaced.
    input_sha256, parameters, left_out : mapping
        As in `Origin`.
    filtered : collection of str
        Names in `left_out` that the user's filters reject; the others could not be screened.
    histories : iterable of KeptHistory, optional
        Histories of single scenarios, read after the last motion.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    source = iter(scenarios)
    # Validate everything before creating a folder or a file.
    first = tuple(islice(source, 1))
    filled = _NOMINAL + (_OF_MEMBERS if "quantile" in sizes else ())
    few = sizes["record"] * sizes["structure"] <= _FEW_PAIRS
    at_reference: dict[str, list[NDArray[Any]]] = {name: [] for name in filled if few}
    with named(path) as partial:
        with _filling(partial, filled, sizes) as fill:
            for row, scenario in enumerate(chain(first, source)):
                fill(row, scenario)
                for name, rows in at_reference.items():
                    rows.append(scenario[name][:, reference])
        kept = {} if histories is None else _append_histories(partial, histories)
        write = _PartsInFile(partial)
        values, units = describe(write)
        dataset = SCREEN_NC.dataset({**values, **kept}, **units).assign_attrs(
            filtered=json.dumps(sorted(filtered))
        )
        put(
            dataset,
            partial,
            SCREEN,
            input_sha256=input_sha256,
            parameters=parameters,
            left_out=left_out,
            mode="a",
        )
    if not few or write.names:
        return read_screening(path, every_scale=False)
    constants = {
        name: SCREEN_NC[name].holding(np.array(rows)[:, :, None]).isel(scale=0).variable()
        for name, rows in at_reference.items()
    }
    attributes = {"rockframe_kind": SCREEN, "parameters": json.dumps(dict(parameters))}
    attributes["left_out"] = json.dumps(dict(left_out), sort_keys=True)
    return dataset.assign(constants).assign_attrs(attributes).set_coords("record_id")


def rate_values(curve: HazardCurve, fits: Fits) -> dict[str, Any]:
    """Return the hazard curve, and the rate at which each structure reaches each limit state."""
    rates = [[overturning_rate(curve, fit[curve.measure]) for fit in each] for each in fits]
    return {
        "hazard_measure": curve.measure,
        "hazard_intensity": curve.intensity,
        "hazard_rate": curve.rate,
        "hazard_site": curve.site,
        "hazard_note": curve.note,
        **SCREEN_NC.filled("rate", rates),
    }


def design_values(design: Design, shares: Float, largest: Float) -> dict[str, Any]:
    """Return the scan of a design; shares and 84 % quantiles of shape (structures, steps)."""
    results = [design.result(*row) for row in zip(shares, largest, strict=True)]
    return {
        "design_dimension": design.dimension,
        "design_quantity": design.quantity,
        "design_limit": design.limit,
        "design_required_share": design.share,
        "design_value": design.values,
        "design_share": shares,
        "design_statistic": design.statistic,
        "design_quantile_84": largest,
        **SCREEN_NC.filled("found", results),
    }


def design_units(design: Design) -> dict[str, str]:
    """Return the units of the variables of a design that allow two units."""
    two = (variable for variable in SCREEN_NC.variables if variable.also_units == "1")
    ratio = design.dimension == "mass_ratio"
    of_quantity = QUANTITIES[design.quantity].units
    limit = dict.fromkeys(("design_limit", "design_quantile_84"), of_quantity)
    return {one.name: one.also_units if ratio else one.units for one in two} | limit


@contextmanager
def _filling(
    partial: Path, names: Sequence[str], sizes: Mapping[str, int]
) -> Iterator[Callable[[int, Scenario], None]]:
    """Yield a function that writes the scenarios of one motion."""
    width = min(sizes["scale"], CHUNK)
    file = open_netcdf(partial, "w")
    try:
        for dimension, size in sizes.items():
            file.createDimension(dimension, size)
        for name in names:
            declared = SCREEN_NC[name]
            further = [sizes[dimension] for dimension in declared.dims[3:]]
            each = sizes["structure"] * width * math.prod(further)
            rows = max(1, min(sizes["record"], CHUNK // each))
            like = declared.holding(np.empty((0,) * len(declared.dims)))
            chunk = (rows, sizes["structure"], width, *further)
            create_variable(file, name, like, chunk, chunks=2)

        def fill(row: int, scenario: Scenario) -> None:
            with as_os_error():
                for name in names:
                    file[name][row] = scenario[name]

        yield fill
    finally:
        with as_os_error():
            file.close()


class _PartsInFile:
    """Writes parts of variables along motions and structures into a partial file.

    The file has all structures of some motions in a chunk: so it is read. Parts of some structures
    are in a temporary file until that of the last ones is there.
    """

    def __init__(self, partial: Path) -> None:
        self._partial = partial
        self._columns: dict[str, IO[bytes]] = {}
        self.names: set[str] = set()

    def __call__(self, name: str, where: tuple[slice, slice], values: NDArray[Any]) -> None:
        """Write values at some motions or recordings and structures, in their order."""
        with as_os_error(), open_netcdf(self._partial, "a") as file:
            structures = len(file.dimensions["structure"])
            if name not in self.names:
                self._create(file, name, len(values), structures)
            if values.shape[1] == structures:
                self._put(file[name], where[0].start or 0, values)
                return
            if name not in self._columns:
                self._columns[name] = TemporaryFile(dir=self._partial.parent)  # noqa: SIM115
            self._columns[name].write(np.ascontiguousarray(values.T).data)
            if where[1].stop == structures:
                self._put_columns(file[name], values.dtype)

    def _put_columns(self, variable: Any, dtype: np.dtype[Any]) -> None:
        """Write the parts of all structures, some motions at a time."""
        motions, structures = variable.shape
        together, size = max(1, _FEW_PAIRS // structures), dtype.itemsize
        with self._columns.pop(variable.name) as columns:
            for start in range(0, motions, together):
                rows = np.empty((min(together, motions - start), structures), dtype)
                for k in range(structures):
                    columns.seek((k * motions + start) * size)
                    rows[:, k] = np.frombuffer(columns.read(len(rows) * size), dtype)
                self._put(variable, start, rows)

    def _create(self, file: Any, name: str, rows: int, structures: int) -> None:
        declared = SCREEN_NC[name]
        dimension = declared.dims[0]
        if dimension not in file.dimensions:  # recordings, all of which are in each part
            file.createDimension(dimension, rows)
        chunk = max(1, min(rows, CHUNK // structures)), structures
        create_variable(file, name, declared.holding(np.empty((0, 0))), chunk, chunks=2)
        self.names.add(name)

    def _put(self, variable: Any, start: int, rows: NDArray[Any]) -> None:
        variable.set_auto_maskandscale(False)
        variable[start : start + len(rows)] = rows


def _append_histories(partial: Path, kept: Iterable[KeptHistory]) -> dict[str, list[int]]:
    """Append histories to a partial file, one at a time; return the variables that locate them."""
    columns: dict[str, list[int]] = {name: [] for name in ("history_size", *_INDICES)}
    with growing(partial, {name: SCREEN_NC[name].holding([]) for name in _SERIES}, "a") as written:
        for where, response in kept:
            absent = np.full(response.time.size, np.nan)
            written.append({name: getattr(response, name, absent) for name in _SERIES})
            columns["history_size"].append(response.time.size)
            for name, at in zip(_INDICES, where, strict=True):
                columns[name].append(at)
    return columns


def read_screening(path: str | Path, *, every_scale: bool = True) -> xr.Dataset:
    """Read the output of the screen stage.

    Parameters
    ----------
    path : str or Path
        Output of ``rockframe screen``.
    every_scale : bool
        Read verdicts, peaks, and shares of an ensemble at every scale; False reads the reference
        scale only, to save memory, and values along many motions and structures when they are
        needed, from the file: it is open until the dataset is closed or not used any more.

    Returns
    -------
    xarray.Dataset
        Everything except histories, which `read_screen_history` reads one at a time. ``record_id``
        is a coordinate: after ``.set_index(record="record_id")`` records are selected by name.

    Raises
    ------
    InputError
        If the file is missing, corrupted, or of another kind.

    Examples
    --------
    >>> read_screening("no-such-file.nc")
    Traceback (most recent call last):
    rockframe.errors.InputError: no-such-file.nc: no such file. Must be a screen file.
    """
    from rockframe.results.reading import on_demand, opened  # loads xarray

    with opened(Path(path), SCREEN) as dataset:
        without_histories = dataset.drop_dims("obs", errors="ignore")
        if not every_scale:
            many, close = _of_many_pairs(without_histories), None
            without_histories = without_histories.drop_vars(many).load()
            if many:
                further, close = on_demand(Path(path), SCREEN, many)
                without_histories = without_histories.assign(further)
            scale = float(without_histories["reference_scale"])
            at = int(np.flatnonzero(without_histories["scale"].values == scale)[0])
            some = [name for name in (*_NOMINAL, *_OF_MEMBERS) if name in without_histories]
            without_histories = without_histories.assign(
                {name: without_histories[name].isel(scale=at, drop=True) for name in some}
            )
            at_reference = without_histories.set_coords("record_id")
            at_reference.set_close(close)
            return at_reference
        return without_histories.load().set_coords("record_id")


def _of_many_pairs(dataset: xr.Dataset) -> list[str]:
    """Return the variables along motions and structures, if these are many."""
    sizes = dataset.sizes
    if sizes.get("record", 0) * sizes.get("structure", 0) <= _FEW_PAIRS:
        return []
    pairs = ({"record", "structure"}, {"recording", "structure"})
    return [str(n) for n, v in dataset.variables.items() if any(p <= {*v.dims} for p in pairs)]


def pooled_fits(screening: xr.Dataset) -> xr.Dataset | None:
    """Return the fragilities of all free-standing structures together, as those of one structure;
    None if they were not asked for.

    Parameters
    ----------
    screening : Dataset
        Result of `read_screening`.
    """
    if "pooled" not in screening:
        return None
    start, name = "pooled_", f"one of {int(screening['pooled'].sum())} structures"
    names = {str(n): str(n).removeprefix(start) for n in screening.variables if start in str(n)}
    others = ("record_id", "cluster", "members", "scale", "fragility_curve")
    fits = screening[list(names)].rename(names).expand_dims(structure=[name])
    return fits.assign({other: screening[other] for other in others})


def read_screen_history(
    path: str | Path, *, record: str, structure: str, scale: float
) -> xr.Dataset:
    """Read the history of one scenario of a screening.

    Parameters
    ----------
    path : str or Path
        Output of ``rockframe screen`` with ``--histories``.
    record, structure : str
        Identifier of the motion, name of the structure.
    scale : float
        One of the scales [1].

    Returns
    -------
    xarray.Dataset
        ``theta`` [rad], ``u`` and ``v`` [m] on ``time`` [s].

    Raises
    ------
    InputError
        If the file is missing, corrupted, or of another kind.
    ParameterError
        If there is no such scenario, or if the history was not kept.
    """
    from rockframe.results.reading import opened  # loads xarray

    with opened(Path(path), SCREEN) as dataset:
        where = positions(dataset, record=record, structure=structure, scale=scale)
        nodes = np.empty(0, dtype=np.intp)
        if "history_size" in dataset:
            all_of = np.stack([dataset[name].values for name in _INDICES])
            nodes = np.flatnonzero((all_of == np.array([*where.values()])[:, None]).all(axis=0))
        if not nodes.size:
            raise ParameterError(
                f"no history of {structure!r} under {record!r} at scale {scale:g} was kept. "
                "Compute it with --histories selected or all."
            )
        rows = slices(dataset["history_size"].values)[nodes[0]]
        chosen = dataset[["theta", "u", "v"]].isel(obs=rows)
        return chosen.load().swap_dims(obs="time")


def screening_of(path: Path, record: str) -> list[dict[str, Any]]:
    """Return the results of the motions of a record, a row for each structure.

    Parameters
    ----------
    path : Path
        Output of the screen stage.
    record : str
        Identifier of the record.

    Returns
    -------
    list of dict
        ``structure``, ``azimuth_degree``, ``verdicts`` (the nominal outcome at each scale),
        ``shares_overturned`` (that of the members at each scale, with an ensemble), and
        ``critical_scale``, NaN if it was not searched or not found. Empty if the record is not
        among the motions.

    Raises
    ------
    InputError
        If the file cannot be read.
    """
    from rockframe.results.reading import opened  # loads xarray

    with opened(path, SCREEN) as dataset:
        rows = np.flatnonzero(dataset["record_id"].values == record)
        screening = dataset.isel(record=rows).drop_dims("obs", errors="ignore").load()
    scales = [f"{scale:g}" for scale in screening["scale"].values]
    columns = columns_of("structure azimuth_degree=azimuth verdicts=structure critical_scale")
    columns_at_scale = columns_of("verdict")
    if "share_reached" in screening:
        columns_at_scale |= {"share_overturned": "share_reached.0"}
    at_scales = rows_along(screening, "record structure scale", columns_at_scale)
    rows_of_it = list(rows_along(screening, "record structure", columns))
    for row in rows_of_it:
        each = {scale: next(at_scales) for scale in scales}
        row["verdicts"] = {scale: response["verdict"] for scale, response in each.items()}
        if "share_reached" in screening:
            shares = {scale: response["share_overturned"] for scale, response in each.items()}
            row["shares_overturned"] = shares
    return rows_of_it


Task = TypeVar("Task")
Arrays = dict[str, NDArray[Any]]

_KEY_LENGTH: Final = 16


class Batches:
    """Batches of arrays for one set of inputs and options, in a hidden folder beside an output.

    Parameters
    ----------
    output : Path
        File that the batches will be merged into.
    origin : mapping
        Inputs and options that the batches depend on, as JSON values.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     batches = Batches(Path(folder, "screen.nc"), {"scales": [1.0]})
    ...     batches.keep("peaks-1", {"theta": np.array([0.5])})
    ...     batches.kept("peaks-1"), batches.kept("peaks-2")
    ({'theta': array([0.5])}, None)
    """

    def __init__(self, output: Path, origin: Mapping[str, Any]) -> None:
        self._output = output
        key = key_of(dict(origin))[:_KEY_LENGTH]
        self.folder = output.parent / f".{output.stem}-{key}.batches"

    def keep(self, name: str, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Write a batch, complete or not at all.

        Raises
        ------
        InputError
            If the batch cannot be written.
        """
        with whole_file(self._path(name)) as partial, partial.open("wb") as stream:
            np.savez(stream, **arrays)  # type: ignore[arg-type]

    def kept(self, name: str) -> Arrays | None:
        """Return a batch; None if it is missing or corrupted."""
        try:
            with self._path(name).open("rb") as stream, np.load(stream) as file:
                return {key: file[key] for key in file.files}
        except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile, zlib.error):
            return None

    def map(
        self,
        function: Callable[[Task], Arrays],
        tasks: Iterable[tuple[str, Callable[[], Task]]],
        engine: Engine | None,
        done: Callable[[], None],
    ) -> Iterator[Arrays]:
        """Compute and keep the missing batches, and yield all batches in order.

        Parameters
        ----------
        function : callable
            The function to call, as in `map_tasks`.
        tasks : iterable of (str, callable)
            The name of each batch, and a function that makes its task if the batch must be
            computed.
        engine : Engine, optional
            Engine of the computation.
        done : callable
            Called for each finished batch.

        Raises
        ------
        InputError
            If a batch cannot be written, or is missing when it is read again.
        """
        names: list[str] = []
        missing: list[str] = []

        def to_do() -> Iterator[Task]:
            for name, make in tasks:
                names.append(name)
                if self.kept(name) is None:
                    missing.append(name)
                    yield make()
                else:
                    done()

        for number, arrays in enumerate(map_tasks(function, to_do(), engine=engine)):
            self.keep(missing[number], arrays)
            done()
        for name in names:
            batch = self.kept(name)
            if batch is None:
                raise InputError(
                    self._path(name), "missing or corrupted. Keep this folder until the end."
                )
            yield batch

    def sweep(self) -> None:
        """Remove all batches of this output, including those of earlier inputs and options."""
        pattern = re.compile(
            rf"\.{re.escape(self._output.stem)}-[0-9a-f]{{{_KEY_LENGTH}}}\.batches"
        )
        for folder in self._output.parent.iterdir():
            if pattern.fullmatch(folder.name):
                shutil.rmtree(folder, ignore_errors=True)

    def _path(self, name: str) -> Path:
        return self.folder / f"{name}.npz"
