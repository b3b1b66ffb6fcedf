"""screen.nc: the file of a screening, of a batch of it, or of all batches."""

from __future__ import annotations

import json
import math
from collections.abc import (
    Callable,
    Collection,
    Container,
    Iterable,
    Iterator,
    Mapping,
    Sequence,
)
from contextlib import contextmanager
from itertools import chain, islice
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, TYPE_CHECKING, Any, Final, TypeAlias, Unpack

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.quantities import OF_SCENARIO, QUANTITIES
from rockframe.results.schema import SCREEN, Variable
from rockframe.results.schema.arrays import Arrays, positions
from rockframe.results.schema.response import SCREEN_NC
from rockframe.results.shards import BatchFiles
from rockframe.results.stored import (
    CHUNK,
    SHARDS,
    WITHOUT_RECORDS,
    open_netcdf,
)
from rockframe.results.tables.rows import columns_of, rows_along
from rockframe.results.writing import (
    Origin,
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

#: The values of variables, and the units of those that allow two units.
Described: TypeAlias = tuple[Mapping[str, Any], Mapping[str, str]]

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
    describe: Callable[[WritePart], Described],
    path: Path,
    *,
    reference: int,
    batch: str = "",
    histories: Iterable[KeptHistory] | None = None,
    filtered: Collection[str] = (),
    **origin: Unpack[Origin],
) -> xr.Dataset | None:
    """Write the output of the screen stage, complete or not at all; one motion is in memory at a
    time. Return what `read_screening` reads of it, at the reference scale only; nothing of a batch.

    The same inputs give the same bytes.

    Parameters
    ----------
    scenarios : iterable of mapping of str to array
        The variables of the scenarios of each motion, without their first dimension.
    sizes : mapping of str to int
        Sizes of the dimensions: ``record``, ``structure``, ``scale``, ``limit_state`` and
        ``member``; with an ensemble also ``quantile``.
    describe : callable
        Called after the last motion with a function that writes parts of variables into the file;
        returns the values of the other variables, and the units of variables that allow two units.
    path : Path
        The file to write; an older file is replaced.
    reference : int
        Position of the reference scale.
    batch : str
        The batch of the records, ``2/3``; empty for all records. Its file has the outcomes of all
        members, of which the results of all records are made.
    histories : iterable of KeptHistory, optional
        Histories of single scenarios, read after the last motion.
    filtered : collection of str
        Names in `left_out` that the user's filters reject; the others could not be screened.
    **origin
        Keywords of `Origin`.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    source = iter(scenarios)
    # Validate everything before creating a folder or a file.
    first = tuple(islice(source, 1))
    filled = [
        variable.name
        for variable in SCREEN_NC.variables
        if first and variable.name in first[0] and (batch or not is_of_batch(variable))
    ]
    few = not batch and sizes["record"] * sizes["structure"] <= _FEW_PAIRS
    at_reference: dict[str, list[NDArray[Any]]] = {name: [] for name in filled if few}
    attrs = {"filtered": json.dumps(sorted(filtered))} | ({"batch": batch} if batch else {})
    with named(path) as partial:
        if not first:
            put(Arrays({}, attrs | {"title": WITHOUT_RECORDS}), partial, SCREEN, **origin)
            return None
        with _filling(partial, filled, sizes) as fill:
            for scenario in chain(first, source):
                fill(scenario)
                for name, rows in at_reference.items():
                    rows.append(scenario[name][:, reference])
        write = _PartsInFile(partial, sizes["structure"])
        dataset = _completed(partial, write, describe, histories, attrs, origin)
    if batch:
        return None
    if not few or write.names:
        return read_screening(path, every_scale=False)
    constants = {
        name: SCREEN_NC[name].holding(np.array(rows)[:, :, None]).isel(scale=0).variable()
        for name, rows in at_reference.items()
    }
    attributes = {"rockframe_kind": SCREEN, "parameters": json.dumps(dict(origin["parameters"]))}
    attributes["left_out"] = json.dumps(dict(origin["left_out"] or {}), sort_keys=True)
    return dataset.assign(constants).assign_attrs(attributes).set_coords("record_id")


def write_screening_index(
    files: BatchFiles,
    describe: Callable[[WritePart], Described],
    path: Path,
    *,
    histories: Iterable[KeptHistory] | None = None,
    filtered: Collection[str] = (),
    **origin: Unpack[Origin],
) -> xr.Dataset:
    """Write the output of the screen stage for all records, whose scenarios are in the files of
    batches. Return what `read_screening` reads of it, at the reference scale only.

    Parameters
    ----------
    files : BatchFiles
        The files of the batches.
    path : Path
        The file to write; an older file is replaced.
    describe, histories, filtered, **origin
        As for `write_screening`.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    attrs = {SHARDS: files.index.attrs[SHARDS], "filtered": json.dumps(sorted(filtered))}
    with named(path) as partial:
        put(files.index, partial, SCREEN, **origin)
        write = _PartsInFile(partial, files.index.sizes["structure"])
        _completed(partial, write, describe, histories, attrs, origin, files.index.variables)
    return read_screening(path, every_scale=False)


def _completed(
    partial: Path,
    write: WritePart,
    describe: Callable[[WritePart], Described],
    histories: Iterable[KeptHistory] | None,
    attrs: Mapping[str, Any],
    origin: Origin,
    written: Container[str] = (),
) -> xr.Dataset:
    """Add histories and the described variables to a partial file; return the latter."""
    values, units = describe(write)
    kept = {} if histories is None else _append_histories(partial, histories)
    further = {n: v for n, v in {**values, **kept}.items() if n not in written}
    dataset = SCREEN_NC.dataset(further, **units).assign_attrs(attrs)
    put(dataset, partial, SCREEN, mode="a", **origin)
    return dataset


def is_of_batch(variable: Variable) -> bool:
    """Return True for a variable that only the file of a batch has."""
    return variable.of_files == "one batch"


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
) -> Iterator[Callable[[Scenario], None]]:
    """Yield a function that writes the scenarios of the next motion.

    Motions are written some at a time, because netCDF takes 0.1 ms for each part.
    """
    width = min(sizes["scale"], CHUNK)
    file = open_netcdf(partial, "w")
    try:
        needed = {dimension for name in names for dimension in SCREEN_NC[name].dims}
        for dimension, size in sizes.items():
            if dimension in needed:
                file.createDimension(dimension, size)
        for name in names:
            declared = SCREEN_NC[name]
            further = [width if n == "scale" else sizes[n] for n in declared.dims[2:]]
            each = sizes["structure"] * math.prod(further)
            rows = max(1, min(sizes["record"], CHUNK // each))
            like = declared.holding(np.empty((0,) * len(declared.dims)))
            chunk = (rows, sizes["structure"], *further)
            create_variable(file, name, like, chunk, chunks=2)
        held: dict[str, list[NDArray[Any]]] = {name: [] for name in names}
        together = max(1, CHUNK // (sizes["structure"] * sizes["scale"]))
        written = 0

        def write() -> None:
            nonlocal written
            some = slice(written, written + len(held[names[0]]))
            with as_os_error():
                for name, rows in held.items():
                    file[name][some] = np.array(rows)
                    rows.clear()
            written = some.stop

        def fill(scenario: Scenario) -> None:
            for name, rows in held.items():
                rows.append(scenario[name])
            if len(held[names[0]]) == together:
                write()

        yield fill
        if held[names[0]]:
            write()
    finally:
        with as_os_error():
            file.close()


class _PartsInFile:
    """Writes parts of variables along motions and structures into a partial file.

    The file has all structures of some motions in a chunk: so it is read. Parts of some structures
    are in a temporary file until that of the last ones is there.
    """

    def __init__(self, partial: Path, structures: int) -> None:
        self._partial, self._structures = partial, structures
        self._columns: dict[str, IO[bytes]] = {}
        self.names: set[str] = set()

    def __call__(self, name: str, where: tuple[slice, slice], values: NDArray[Any]) -> None:
        """Write values at some motions or recordings and structures, in their order."""
        are_some = values.shape[1] < self._structures
        if are_some:
            if name not in self._columns:
                self._columns[name] = TemporaryFile(dir=self._partial.parent)  # noqa: SIM115
            self._columns[name].write(np.ascontiguousarray(values.T).data)
            if where[1].stop < self._structures:
                return
        with as_os_error(), open_netcdf(self._partial, "a") as file:
            if name not in self.names:
                self._create(file, name, len(values))
            if are_some:
                self._put_columns(file[name], values.dtype)
            else:
                self._put(file[name], where[0].start or 0, values)

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

    def _create(self, file: Any, name: str, rows: int) -> None:
        declared = SCREEN_NC[name]
        dimension = declared.dims[0]
        if dimension not in file.dimensions:  # recordings, all of which are in each part
            file.createDimension(dimension, rows)
        chunk = max(1, min(rows, CHUNK // self._structures)), self._structures
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
