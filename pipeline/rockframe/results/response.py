"""response.nc, compare.nc, spectrum.nc and rocking_spectrum.nc."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass
from functools import cache, cached_property, partial
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Self, Unpack

import numpy as np
from numpy.typing import NDArray

from rockframe.components import BothDirections
from rockframe.errors import ParameterError
from rockframe.frame import RockingFrame
from rockframe.quantities import QUANTILES, QUANTITIES
from rockframe.results.schema import RESPONSE, FileKind
from rockframe.results.schema.arrays import Arrays, positions
from rockframe.results.schema.response import (
    ABUTMENT,
    COMPARE_NC,
    ENVELOPES,
    ISLANDS,
    OF_KIND,
    RESPONSE_NC,
    ROBUST,
    ROCKING_SPECTRUM_NC,
    SPECTRUM_NC,
    FateUnderPulse,
    Overturning,
    Validity,
)
from rockframe.results.shards import opened_arrays
from rockframe.results.stored import damage_named
from rockframe.results.tables.forces import kilonewtons
from rockframe.results.tables.rows import (
    OF_BANDS,
    SHARES,
    Row,
    columns_of,
    rows_along,
)
from rockframe.results.writing import Origin, slices, write_rows
from rockframe.results.writing import Row as WrittenRow
from rockframe.rocking import (
    EnsembleResponse,
    Margin,
    NominalResponses,
    PartResponse,
    ToPulse,
    correlation_by_chance,
)
from rockframe.rocking.spectra.overturning import column_of
from rockframe.rocking.spectra.rocking import RockingSpectrum
from rockframe.rocking.spectra.scan import OverturningSpectrum, islands
from rockframe.rocking.verdict import Strip, Verdict, strip_of
from rockframe.structures.contract import Compared, Structure, StructureResponse, kind_of

if TYPE_CHECKING:
    import xarray as xr

    from rockframe.results.schema.arrays import Dataset

_HISTORIES: Final = ("theta", "u", "v")
#: Histories of motions in both directions.
_OF_BOTH: Final = ("phi", "u_x", "u_y")
_ENVELOPES: Final = tuple(variable.name for variable in ENVELOPES)
#: Optional parts of a response.
_PARTS: Final = (
    *("to_pulse", "margin", "ensemble", "contact", "restraint"),
    *("forces", "force_bands", "column_forces", "column_bands", "parts"),
)


#: Column of the rank correlations between spreads and peaks.
_CORRELATIONS: Final = "correlations"


#: Those that are kept as arrays.
_AS_ARRAYS: Final = (
    *("ensemble", "contact", "forces", "force_bands", "column_forces", "column_bands"),
)


class Components(NamedTuple):
    """The records of both components of a motion, and how they differ from those at right angles.

    Both are empty for a motion in one plane.
    """

    records: tuple[str, ...] = ()
    remark: str = ""

    @classmethod
    def of(cls, both: BothDirections) -> Self:
        """Return those of a motion in both directions."""
        return cls((both.first.record_id, both.second.record_id), both.remark)


NO_COMPONENTS: Final = Components()


def component_values(components: Sequence[Components]) -> dict[str, list[str]]:
    """Return the variables of the components of motions.

    Examples
    --------
    >>> component_values([NO_COMPONENTS, Components(("a", "b"))])["components"]
    ['', 'a b']
    """
    return {
        "components": [" ".join(each.records) for each in components],
        "components_remark": [each.remark for each in components],
    }


def write_responses(
    answers: Iterable[tuple[str, Sequence[StructureResponse]]],
    structures: Sequence[Structure],
    path: Path,
    *,
    batch: str = "",
    motions: int = 0,
    **origin: Unpack[Origin],
) -> Arrays:
    """Write the output of the respond stage, complete or not at all; one record is in memory at a
    time. Return what was written, without the histories.

    Parameters
    ----------
    answers : iterable of (str, sequence of Response)
        For each record, its identifier and the responses in the order of the structures. Responses
        without nodes have no history in the file. If the iterable raises an error, no file is left.
    structures : sequence of Structure
        At least one, with different names.
    path : Path
        The file to write; an older file is replaced.
    batch : str
        The batch of the records, ``2/3``; empty for all records.
    motions : int
        Largest number of motions of a sequence; 0 without sequences.
    **origin
        Keywords of `Origin`. If the parameter ``pulses`` is true, the file includes the responses
        to the pulses alone.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    parameters = origin["parameters"]
    rows = (response_row(name, responses, parameters) for name, responses in answers)
    return write_response_rows(rows, structures, path, batch=batch, motions=motions, **origin)


def write_response_rows(
    rows: Iterable[WrittenRow],
    structures: Sequence[Structure],
    path: Path,
    *,
    batch: str = "",
    motions: int = 0,
    **origin: Unpack[Origin],
) -> Arrays:
    """Write what `response_row` returned for each record; the rest is as for `write_responses`."""
    parameters = origin["parameters"]
    pulses, pairs = bool(parameters.get("pulses")), bool(parameters.get("pairs"))
    complete = partial(
        _complete, structures=structures, pulses=pulses, motions=motions, pairs=pairs
    )
    return write_rows(RESPONSE_NC, rows, path, complete, batch=batch, **origin)


def responses_arrays(
    answers: Mapping[str, Sequence[StructureResponse]],
    structures: Sequence[Structure],
    *,
    pulses: bool = False,
    motions: int = 0,
) -> Arrays:
    """Return the variables of a response file for responses in memory, without the histories.

    Parameters
    ----------
    answers : mapping of str to sequence of Response
        For each record, the responses in the order of the structures.
    structures : sequence of Structure
        At least one, with different names.
    pulses : bool
        Include the responses to the pulses alone.
    motions : int
        Largest number of motions of a sequence; 0 without sequences.
    """
    rows = [_values(name, responses) for name, responses in answers.items()]
    columns = {name: [row[name] for row in rows] for name in rows[0]}
    arrays = RESPONSE_NC.holding(_complete(columns, structures, pulses, motions))
    return arrays.with_attrs(rockframe_kind=RESPONSE_NC.name)


def response_row(
    name: str,
    responses: Sequence[StructureResponse],
    parameters: Mapping[str, Any],
    components: Components = NO_COMPONENTS,
) -> WrittenRow:
    """Return the histories and the other values of a record; workers do, which is less to send.

    If the parameter ``pairs`` is true, the file has motions in both directions, of which
    `components` are the records.
    """
    names = _HISTORIES + (_OF_BOTH if parameters.get("pairs") else ())
    names += _ENVELOPES if _has_envelopes(parameters) else ()
    return _histories(responses, names), _values(name, responses, components)


def nominal_row(name: str, responses: NominalResponses) -> WrittenRow:
    """Return what `response_row` returns, for responses without histories that are in arrays."""
    count = len(responses.frames)
    none = [None] * count
    beside = {part: none for part in _PARTS if part not in _AS_ARRAYS}
    alone = responses.to_pulse and _of_arrays(
        "to_pulse", SimpleNamespace(**responses.to_pulse), count
    )
    values = {
        "record_id": name,
        "components": "",
        "components_remark": "",
        "row_size": 0,
        "history": [False] * count,
        **{key: row[0] for key, row in _of_arrays("response", responses, count).items()},
        **beside,
        **dict.fromkeys(_AS_ARRAYS),
        "to_pulse": alone or _without_pulse(count),
        "contact": _of_arrays("contact", SimpleNamespace(**responses.contact), count),
        _CORRELATIONS: _Correlations.of(none),
    }
    return {"time": np.empty(0), **{key: np.empty((count, 0)) for key in _HISTORIES}}, values


@cache
def _without_pulse(count: int) -> dict[str, NDArray[Any]]:
    return RESPONSE_NC.arrays(to_pulse_values([[None] * count]))


def _of_arrays(source: str, arrays: object, count: int) -> dict[str, NDArray[Any]]:
    """Return the values of one record by variable, shape (1, structures), from arrays that are
    attributes; unknown where there is none.
    """
    filled = RESPONSE_NC.arrays(RESPONSE_NC.filled(source, arrays))
    return {name: np.broadcast_to(values, (1, count)) for name, values in filled.items()}


def _values(
    name: str, responses: Sequence[StructureResponse], components: Components = NO_COMPONENTS
) -> dict[str, Any]:
    """Return the values of a record by the names of the objects that hold them in its responses."""
    return {
        "record_id": name,
        "components": " ".join(components.records),
        "components_remark": components.remark,
        "row_size": max(response.time.size for response in responses),
        "history": [response.time.size > 0 for response in responses],
        **RESPONSE_NC.arrays(RESPONSE_NC.filled("response", list(responses))),
        **{part: _of_part(part, responses) for part in _PARTS},
        _CORRELATIONS: _Correlations.of([response.ensemble for response in responses]),
    }


def _of_part(part: str, responses: Sequence[StructureResponse]) -> Any:
    """Return a part of the responses to a record: its objects, or as arrays, which need a tenth of
    their memory; None if no response has it.
    """
    objects = [getattr(response, part, None) for response in responses]
    if part == "to_pulse":
        return RESPONSE_NC.arrays(to_pulse_values([objects]))
    if part not in _AS_ARRAYS:
        return objects
    if all(one is None for one in objects):
        return None
    return RESPONSE_NC.arrays(RESPONSE_NC.filled(part, [objects]))


def _has_envelopes(parameters: Mapping[str, Any]) -> bool:
    """Return True if histories have envelopes: with robust margins, for their ensemble."""
    return parameters.get("margins") == "robust" and parameters["ensemble"]["members"] > 0


def _histories(
    responses: Sequence[StructureResponse], names: Sequence[str]
) -> dict[str, NDArray[np.float64]]:
    """Return the histories of the frames under one record; NaN if they are not kept."""
    time = max((response.time for response in responses), key=len)
    series = {"time": time}
    for name in names:
        series[name] = np.full((len(responses), time.size), np.nan)
        for row, response in zip(series[name], responses, strict=True):
            if response.time.size:
                row[:] = getattr(response, name, math.nan)
    return series


def _complete(
    columns: Mapping[str, list[Any]],
    structures: Sequence[Structure],
    pulses: bool,
    motions: int,
    pairs: bool = False,
) -> dict[str, Any]:
    """Return the values of all variables except the histories."""
    beside = (*_PARTS, _CORRELATIONS)
    values = dict[str, Any]((key, column) for key, column in columns.items() if key not in beside)
    if all(getattr(structure, "abutment", None) is None for structure in structures):
        values = {name: column for name, column in values.items() if name not in ABUTMENT}
    of_kinds = {name for structure in structures for name in kind_of(structure).quantities}
    for name in {variable.name for variable in OF_KIND} - of_kinds:
        del values[name]
    values |= structure_values(RESPONSE_NC, structures)
    if pulses:
        values |= RESPONSE_NC.joined(columns["to_pulse"])
    for name in _without(columns, pairs):
        del values[name]
    if any(margin is not None for row in columns["margin"] for margin in row):
        values |= margin_values(columns["margin"])
    for part in _AS_ARRAYS:
        if any(row is not None for row in columns[part]):
            values |= _joined(part, columns[part], len(structures))
            values |= {"quantile": [*QUANTILES]} if part == "ensemble" else {}
    values |= _sensitivity(columns[_CORRELATIONS], _SPREADS_OF_PAIRS if pairs else ())
    if motions:
        values |= _part_values(columns["parts"], motions)
    if any(getattr(structure, "restrained", False) for structure in structures):
        values |= RESPONSE_NC.filled("restraint", columns["restraint"])
    return values


def structure_values(kind: FileKind, structures: Sequence[Structure]) -> dict[str, Any]:
    """Return names, properties and kinds of structures by variable of a kind of file."""
    values = kind.filled("frame", list(structures))
    before = [getattr(structure, "before_crushing", None) for structure in structures]
    values |= kind.filled("before_crushing", before) if any(before) else {}
    values["mass_ratio"] = [
        ratio if ratio < math.inf else math.nan for ratio in values["mass_ratio"]
    ]
    return values | _kinds(structures) | {"structure": [structure.name for structure in structures]}


def _kinds(structures: Sequence[Structure]) -> dict[str, Any]:
    """Return kinds and properties of structures; none if all are rocking frames."""
    kinds = [structure.kind for structure in structures]
    if {*kinds} == {RockingFrame.kind}:
        return {}
    each = [
        {parameter.name: parameter for parameter in kind_of(of).parameters(of)} for of in structures
    ]
    named = {name: parameter for parameters in each for name, parameter in parameters.items()}
    return {
        "kind": kinds,
        "parameter": [*named],
        "parameter_units": [parameter.units for parameter in named.values()],
        "parameter_label": [parameter.label for parameter in named.values()],
        "parameter_value": [
            [of[name].value if name in of else math.nan for name in named] for of in each
        ],
    }


def _without(columns: Mapping[str, list[Any]], pairs: bool) -> list[str]:
    """Return the variables that a file does not need, whatever the batch of the records."""
    missing = pairs or any(reason for row in columns["not_computed"] for reason in row)
    both = [] if pairs else [name for name in columns if name.startswith("components")]
    return both if missing else [*both, "not_computed"]


def _joined(part: str, rows: Sequence[Mapping[str, Any] | None], structures: int) -> dict[str, Any]:
    """Return a part of the responses to all records; unknown where a record does not have it."""
    unknown = RESPONSE_NC.arrays(RESPONSE_NC.filled(part, [[None] * structures]))
    return RESPONSE_NC.joined([row if row is not None else unknown for row in rows])


def _part_values(
    rows: Sequence[Sequence[Sequence[PartResponse] | None]], motions: int
) -> dict[str, Any]:
    """Return the values of the motions of sequences; NaN beyond those of a record."""
    shape = len(rows), len(rows[0]), motions
    values = {name: np.full(shape, np.nan) for name in RESPONSE_NC.filled("part", None)}
    for i, k in np.ndindex(*shape[:2]):
        for j, part in enumerate(rows[i][k] or ()):
            for name, value in RESPONSE_NC.filled("part", part).items():
                values[name][i, k, j] = value
    sequences = [next(filter(None, row), ()) for row in rows]
    return {"parts": ["; ".join(str(part.part) for part in parts) for parts in sequences], **values}


@dataclass(frozen=True)
class _Correlations:
    """Number of members of the ensembles of a record, and their rank correlations.

    The names of the spreads are those of all its structures; structures without a spread have NaN.
    """

    members: int
    spreads: tuple[str, ...]
    values: NDArray[np.float64]

    @classmethod
    def of(cls, ensembles: Sequence[EnsembleResponse | None]) -> Self:
        each = [{} if ensemble is None else ensemble.rank_correlations for ensemble in ensembles]
        spreads = tuple(dict.fromkeys(name for of in each for name in of))
        rows = [[of.get(name, math.nan) for name in spreads] for of in each]
        members = max(
            (ensemble.members for ensemble in ensembles if ensemble is not None), default=0
        )
        return cls(members, spreads, np.array(rows).reshape(len(each), len(spreads)))


#: Spreads that only motions in both directions have.
_SPREADS_OF_PAIRS: Final = ("contact_shortening",)


def _sensitivity(records: Sequence[_Correlations], further: Sequence[str] = ()) -> dict[str, Any]:
    """Return the values of the variables of sensitivity; none without a spread.

    The file has `further` spreads even if no record of this batch does.
    """
    if not any(record.members for record in records):
        return {}
    named = (name for record in records for name in record.spreads if name not in further)
    spreads = [*dict.fromkeys(named), *further]
    if not spreads:
        return {}
    values = np.full((len(records), len(records[0].values), len(spreads)), math.nan)
    for row, record in zip(values, records, strict=True):
        row[:, [spreads.index(name) for name in record.spreads]] = record.values
    chance = correlation_by_chance(max(record.members for record in records))
    return {
        "spread": spreads,
        "rank_correlation": values,
        "rank_correlation_by_chance": [chance] * len(spreads),
    }


class ResponseFile:
    """An open response file, for selecting histories; a ``with`` block closes it.

    Parameters
    ----------
    path : str or Path
        Output of ``rockframe respond``.

    Raises
    ------
    InputError
        If the file is missing, corrupted, or of another kind.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        with ExitStack() as stack:
            self.arrays = stack.enter_context(opened_arrays(self.path, RESPONSE))
            self._rows = slices(self.arrays["row_size"].values)
            self._open = stack.pop_all()

    def __enter__(self) -> ResponseFile:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self._open.close()

    @cached_property
    def dataset(self) -> xr.Dataset:
        """The file as a dataset of xarray, which reads histories on demand."""
        from rockframe.results.reading import opened

        return self._open.enter_context(opened(self.path, RESPONSE))

    @cached_property
    def records(self) -> list[str]:
        """Identifiers of the records."""
        return [str(name) for name in self.arrays["record_id"].values]

    @cached_property
    def structures(self) -> list[str]:
        """Names of the structures."""
        return [str(name) for name in self.arrays["structure"].values]

    def kept(self, record: str) -> list[str]:
        """Return the names of the structures whose histories under a record are in the file."""
        with self._damage_named():
            where = positions(self.arrays, record=record)
            kept = self.arrays["history"].isel(**where).values
        return [name for name, there in zip(self.structures, kept, strict=True) if there]

    def components(self, record: str) -> list[str]:
        """Return the records of both components of a motion; empty for a motion in one plane."""
        if "components" not in self.arrays:
            return []
        where = positions(self.arrays, record=record)["record"]
        return str(self.arrays["components"].values[where]).split()

    def strips(self, record: str) -> dict[str, Strip]:
        """Return the strip of each structure under a record; empty without margins."""
        with self._damage_named():
            strips = strips_of(self.arrays, [record])
        return {structure: strip for (_, structure), strip in strips.items()}

    def sel(self, *, record: str, structure: str) -> xr.Dataset:
        """Return the histories of one record and structure on ``time``, with their verdict.

        Raises
        ------
        ParameterError
            If there is no such record or structure, or if the history was not kept.
        """
        where = self._place(record, structure)
        with self._damage_named():
            chosen = self.dataset.isel(where).drop_vars("row_size").load()
        return chosen.swap_dims(obs="time").set_coords("record_id")

    def history(self, *, record: str, structure: str) -> Arrays:
        """Return the variables of `sel` as arrays, along ``obs``; the errors are the same."""
        where = self._place(record, structure)
        with self._damage_named():
            return self.arrays.isel(**where).loaded()

    def _place(self, record: str, structure: str) -> dict[str, Any]:
        """Return the indexes of a history that was kept."""
        with self._damage_named():
            where = positions(self.arrays, record=record, structure=structure)
            if not self.arrays["history"].isel(**where).values:
                raise ParameterError(
                    f"no history of {structure!r} under {record!r} was kept. Compute it with "
                    "--histories all."
                )
        return {**where, "obs": self._rows[where["record"]]}

    def _damage_named(self) -> AbstractContextManager[None]:
        return damage_named(self.path, RESPONSE)


def open_response(path: str | Path) -> ResponseFile:
    """Open the output of the respond stage.

    Parameters
    ----------
    path : str or Path
        The file.

    Raises
    ------
    InputError
        If the file is missing, corrupted, or of another kind.

    Examples
    --------
    >>> import tempfile
    >>> from rockframe import Record, respond
    >>> record = Record(record_id="shake", acceleration=np.array([0.0, 3.0, 0.0]), time_step=0.1)
    >>> frame = RockingFrame(height=9.6, width=1.6, name="bent")
    >>> answers = [("shake", [respond(frame, record)])]
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "response.nc")
    ...     _ = write_responses(answers, [frame], path, input_sha256={}, parameters={})
    ...     with open_response(path) as response:
    ...         history = response.sel(record="shake", structure="bent")
    >>> history["theta"].dims, bool(history["theta"][-1] < 0.0)
    (('time',), True)
    """
    return ResponseFile(path)


def to_pulse_values(rows: list[list[ToPulse | None]]) -> dict[str, Any]:
    """Return the values by variable, (records, structures); rows have None without a pulse."""
    values = RESPONSE_NC.filled("to_pulse", rows)
    values["verdict_to_pulse"] = [
        [FateUnderPulse.NO_PULSE if fate is None else fate.verdict for fate in row] for row in rows
    ]
    return values


def margin_values(margins: list[list[Margin | None]]) -> dict[str, Any]:
    """Return the values of margins by variable, from those of the structures of each record."""
    islands = np.full((len(margins), len(margins[0]), ISLANDS, 2), np.nan)
    for i, row in enumerate(margins):
        for k, margin in enumerate(row):
            kept = np.array(margin.islands[:ISLANDS] if margin else ()).reshape(-1, 2)
            islands[i, k, : len(kept)] = kept
    robust = [[margin and margin.robust for margin in row] for row in margins]
    searched = [[margin.largest_scale for margin in row if margin] for row in margins]
    return {
        **RESPONSE_NC.filled("margin", margins),
        **(RESPONSE_NC.filled("robust", robust) if any(map(any, robust)) else {}),
        "largest_scale": [max(row, default=math.nan) for row in searched],
        "safe_island_start": islands[..., 0],
        "safe_island_width": islands[..., 1] - islands[..., 0],
    }


def strips_of(response: Dataset, records: Collection[str]) -> dict[tuple[str, str], Strip]:
    """Return the strips of computed responses by record and structure; empty without margins.

    Motions in both directions have none, because the outcome of the structure as given is not
    computed at other scales.
    """
    if "critical_scale" not in response:
        return {}
    names = [str(name) for name in response["record_id"].values]
    both = map(str, response["components"].values) if "components" in response else ()
    pairs = {name for name, records in zip(names, both, strict=False) if records}
    rows = [i for i, name in enumerate(names) if name in records]
    structures = [str(name) for name in response["structure"].values]
    wanted = ["critical_scale", "largest_scale", "safe_islands"]
    wanted += ["safe_island_start", "safe_island_width"]
    robust = [name for name in ROBUST if name in response and "scale" in name]
    some = {name: response[name].isel(record=rows).values for name in (*wanted, *robust)}
    start, width = some["safe_island_start"], some["safe_island_width"]
    verdicts = response["verdict"].values
    return {
        (names[row], structure): strip_of(
            float(some["critical_scale"][i, k]),
            float(some["largest_scale"][i]),
            [
                (a, a + b)
                for a, b in zip(start[i, k].tolist(), width[i, k].tolist(), strict=True)
                if a > 0.0
            ],
            tuple(float(some[name][i, k]) for name in robust),
            further=int(some["safe_islands"][i, k]) > ISLANDS,
        )
        for i, row in enumerate(rows)
        for k, structure in enumerate(structures)
        if verdicts[row, k] != Verdict.NOT_COMPUTED and names[row] not in pairs
    }


_COMPARED_HISTORIES: Final = ("u", "v", "base_shear")
_COLUMNS: Final = columns_of(
    "record_id structure model peak_u_m=peak_u peak_v_m=peak_v residual_u_m=residual_u",
    "peak_rotation_ratio ductility peak_base_shear peak_tendon_force_n=peak_tendon_force",
    "friction_demand validity valid_until_s=valid_until gap_closed_time_s=gap_closed_time",
    "closing_velocity_m_s=closing_velocity weight",
    *SHARES,
    *(f"{column}={variable}" for column, variable in OF_BANDS.items()),
)


def write_comparison(
    answers: Iterable[tuple[str, Sequence[Sequence[Compared]]]],
    frames: Sequence[RockingFrame],
    path: Path,
    *,
    batch: str = "",
    **origin: Unpack[Origin],
) -> Arrays:
    """Write the output of the compare stage, complete or not at all; one record is in memory at a
    time. Return what was written, without the histories.

    Parameters
    ----------
    answers : iterable of (str, sequence of sequence of Compared)
        For each record, its identifier and the variants of each structure.
    frames : sequence of RockingFrame
        The structures, in their order.
    path : Path
        The file to write; an older file is replaced.
    batch : str
        The batch of the records, ``2/3``; empty for all records.
    **origin
        Keywords of `Origin`.

    Raises
    ------
    InputError
        If the file cannot be written.
    """

    def row(answer: tuple[str, Sequence[Sequence[Compared]]]) -> Any:
        name, responses = answer
        time = responses[0][0].time
        series = {
            key: np.array(
                [[getattr(variant, key) for variant in variants] for variants in responses]
            )
            for key in _COMPARED_HISTORIES
        }
        every = [variant for variants in responses for variant in variants]
        peaks = COMPARE_NC.filled("compared", every)
        peaks["validity"] = [Validity.of(compared.model_end) for compared in every]
        if every[0].ensemble is not None:
            peaks |= COMPARE_NC.filled("ensemble", [compared.ensemble for compared in every])
        shape = len(responses), len(responses[0])
        values = {
            key: np.reshape(column, (*shape, *np.shape(column)[1:]))
            for key, column in peaks.items()
        }
        models = [response.model for response in responses[0]]
        return {"time": time, **series}, {
            "record_id": name, "row_size": time.size, "model": models, **values
        }  # fmt: skip

    return write_rows(
        *(COMPARE_NC, map(row, answers), path, partial(_compared, frames=frames)),
        batch=batch,
        **origin,
    )


def _compared(columns: Mapping[str, list[Any]], frames: Sequence[RockingFrame]) -> dict[str, Any]:
    names = [frame.name for frame in frames]
    bands = {"quantile": QUANTILES} if "share_overturned" in columns else {}
    frame = COMPARE_NC.filled("frame", list(frames))
    return {**columns, **bands, **frame, "model": columns["model"][0], "structure": names}


def comparison_rows(comparison: Path | Dataset) -> list[Row]:
    """Return a row for each record, structure and model; units in the names of columns.

    Parameters
    ----------
    comparison : Path or Dataset
        Output of the compare stage, or what `write_comparison` returned.

    Raises
    ------
    InputError
        If the file is missing, corrupted, or of another kind.
    """
    if isinstance(comparison, Path):
        with opened_arrays(comparison, COMPARE_NC.name) as dataset:
            return comparison_rows(dataset)
    return list(map(_in_kilonewtons, rows_along(comparison, "record structure model", _COLUMNS)))


def _in_kilonewtons(row: Row) -> Row:
    """Return a row with its base shear in kN too; NaN where the weight is not known."""
    weight = row.pop("weight")
    shear = QUANTITIES["peak_base_shear"]
    names = (shear.column(), *shear.band_columns)
    forces = {f"{name}_kn": kilonewtons(row[name], weight) for name in names}
    return row | {"weight_kn": kilonewtons(1.0, weight)} | forces


def read_histories(path: Path, record: str, structure: str) -> Arrays:
    """Return the histories and peaks of all models of one structure under one record.

    Raises
    ------
    InputError
        If the file is missing, corrupted, or of another kind.
    ParameterError
        If there is no such record or structure.
    """
    with opened_arrays(path, COMPARE_NC.name) as dataset:
        where = positions(dataset, record=record, structure=structure)
        obs = slices(dataset["row_size"].values)[where["record"]]
        return dataset.isel(**where, obs=obs).loaded()


def furthest_pairs(path: Path, most: int) -> list[tuple[str, str]]:
    """Return the pairs of the `most` records with the largest drifts of free bridges, and all their
    structures.
    """
    with opened_arrays(path, COMPARE_NC.name) as dataset:
        drift = dataset["peak_u"].isel(model=0).values.max(axis=1)
        chosen = sorted(np.argsort(-drift, kind="stable")[:most].tolist())
        names = [str(dataset["record_id"].values[k]) for k in chosen]
        return [
            (name, str(structure)) for name in names for structure in dataset["structure"].values
        ]


def spectrum_dataset(spectrum: OverturningSpectrum) -> xr.Dataset:
    """Return the dataset of an overturning spectrum: maps, smallest amplitudes, intervals."""
    scan = spectrum.found
    maps = (*spectrum.shape, spectrum.amplitude.size)
    fallen = scan.verdict == Verdict.OVERTURNS
    how = np.where(scan.impacts == 0, Overturning.WITHOUT_IMPACT, Overturning.AFTER_IMPACT)
    frames = [
        [column_of(float(alpha), float(gamma)) for gamma in spectrum.mass_ratio]
        for alpha in spectrum.slenderness
    ]
    return SPECTRUM_NC.dataset(
        {
            "verdict": scan.verdict.reshape(maps),
            "overturning": np.where(fallen, how, Overturning.NONE).reshape(maps),
            **SPECTRUM_NC.filled("spectrum", spectrum),
            **_intervals(spectrum),
            **SPECTRUM_NC.filled("frame", frames),
            "effective_frequency_ratio": [
                [f.effective_frequency_parameter / f.frequency_parameter for f in row]
                for row in frames
            ],
            **SPECTRUM_NC.filled("pulse", list(spectrum.pulses)),
        }
    )


def _intervals(spectrum: OverturningSpectrum) -> dict[str, Any]:
    """Return the intervals along ``interval``, padded to the largest number of intervals."""
    scan = spectrum.found
    counts = np.bincount(scan.line, minlength=len(scan.verdict))
    rank = np.arange(scan.line.size) - np.searchsorted(scan.line, scan.line)
    size = max(1, int(counts.max()))
    lower, upper = np.full((2, counts.size, size), np.nan)
    impacts = np.full((counts.size, size), -1, dtype=np.int32)
    lower[scan.line, rank], upper[scan.line, rank] = scan.lower, scan.upper
    impacts[scan.line, rank] = scan.impacts_at_lower
    end = float(spectrum.amplitude[-1])
    stand = np.array([len(islands(bounds, end)) for bounds in scan.intervals()])
    shape = (*spectrum.shape, size)
    return {
        "overturning_intervals": counts.reshape(spectrum.shape),
        "safe_islands": stand.reshape(spectrum.shape),
        "interval_lower": lower.reshape(shape),
        "interval_upper": upper.reshape(shape),
        "interval_impacts": impacts.reshape(shape),
    }


def rocking_spectrum_dataset(names: Sequence[str], spectrum: RockingSpectrum) -> xr.Dataset:
    """Return the dataset of the rocking spectra of the records with these names."""
    values = ROCKING_SPECTRUM_NC.filled("spectrum", spectrum)
    return ROCKING_SPECTRUM_NC.dataset({"record_id": list(names), **values})


def read_spectrum(path: str | Path) -> xr.Dataset:
    """Return the dataset of a file of overturning spectra; its variables state their units.

    Parameters
    ----------
    path : str or Path
        Output of `rockframe.spectrum_stage`.

    Raises
    ------
    InputError
        If the file is missing, corrupted, or of another kind.
    """
    from rockframe.results.reading import opened

    with opened(Path(path), SPECTRUM_NC.name) as dataset:
        return dataset.load()


def read_rocking_spectrum(path: str | Path) -> xr.Dataset:
    """Return the dataset of a file of rocking spectra; its variables state their units.

    Parameters
    ----------
    path : str or Path
        Output of `rockframe.rocking_spectrum_stage`.

    Raises
    ------
    InputError
        If the file is missing, corrupted, or of another kind.
    """
    from rockframe.results.reading import opened

    with opened(Path(path), ROCKING_SPECTRUM_NC.name) as dataset:
        return dataset.load()
