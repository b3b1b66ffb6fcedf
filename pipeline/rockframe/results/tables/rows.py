"""Rows of tables and labelled values, and the columns that terminal and pages print."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache, partial
from itertools import product
from typing import TYPE_CHECKING, Any, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from rockframe.cells import DASH, Cells, Column, number, rows_of_columns
from rockframe.options.ingest import PassportLimits
from rockframe.quantities import BANDED, PEAKS, QUANTITIES, Quantity
from rockframe.results.schema import KINDS
from rockframe.rocking.verdict import MODEL_ENDS, ModelEnd, SpreadVerdict, Verdict
from rockframe.signals.passport import implausible_peak
from rockframe.study.kinds import declared_kind
from rockframe.units import GRAVITY

if TYPE_CHECKING:
    import xarray as xr

    from rockframe.results.schema.arrays import Array, Dataset
    from rockframe.rocking.assessments import EnsembleResponse

AnyCells = TypeVar("AnyCells", bound=Cells)

#: Short names of wavelets.
_SHORT: Final = {
    "symmetric_ricker": "sym",
    "antisymmetric_ricker": "antisym",
    "ricker_any_phase": "any phase",
    "": DASH,
}


def spread_verdict(row: Cells) -> SpreadVerdict:
    """Return the verdict of a row, computed or read from ``table.csv``.

    Examples
    --------
    >>> row = {"verdict": "stands", "share_overturned": "0.3125"}
    >>> spread_verdict(row).words
    'may overturn (31 %)'
    """

    def scale(name: str, searched: str) -> float | None:
        return number(row.get(name)) if math.isfinite(number(row.get(searched))) else None

    return SpreadVerdict(
        Verdict[row["verdict"].upper()],
        overturning_time=number(row.get("overturning_time_s")),
        share_overturned=number(row.get("share_overturned")),
        share_uplifted=number(row.get("share_uplifted")),
        share_model_ends=number(row.get("share_model_ends")),
        robust_scale=scale("robust_scale_10", "largest_robust_scale"),
        critical_scale=scale("critical_scale", "largest_scale"),
        largest_scale=number(row.get("largest_scale")),
        model_ends={name: number(row.get(f"{name}_s")) for name in MODEL_ENDS},
        model_end=ModelEnd[(row.get("model_end") or "none").upper()],
        fails=declared_kind(row.get("kind") or "").fails,
    )


def verdict_words(row: Cells, _key: str = "") -> str:
    """Return the verdict of a row in words, which rows of this version state themselves, and a peak
    that suggests wrong units.

    Examples
    --------
    >>> verdict_words({"verdict": "stands", "pga_g": 3.4})
    'stands; PGA 3.4 g: check the units'
    """
    words = str(row.get("verdict_words") or spread_verdict(row).words)
    return "; ".join(filter(None, (words, peak_words(row))))


def peak_words(row: Cells) -> str:
    """Return words for a peak acceleration that suggests wrong units; empty otherwise."""
    return _implausible(number(row.get("pga_g")))


@lru_cache(maxsize=1024)  # all structures of a record have its peak
def _implausible(peak_g: float) -> str:
    return implausible_peak(GRAVITY * peak_g, PassportLimits())


def standing(row: Cells, key: str) -> float | str:
    """Return a peak, or ``overturns`` for structures that do: their peak only describes the fall.

    Examples
    --------
    >>> fallen = {"verdict": "overturns", "peak_u_m": "2.9"}
    >>> standing(fallen, "peak_u_m"), standing({"verdict": "stands", "peak_u_m": "0.4"}, "peak_u_m")
    ('overturns', 0.4)
    """
    verdict = Verdict[row["verdict"].upper()]
    return verdict.label if verdict is Verdict.OVERTURNS else number(row[key])


def rocks(row: Cells) -> bool:
    """Return True if the structure of a row is of a kind that rocks."""
    return declared_kind(row.get("kind") or "").rocks


def in_verb_of(row: Cells, words: str) -> str:
    """Return words about overturning in the verb of the kind of a row: overturn, or collapse.

    Examples
    --------
    >>> in_verb_of({"kind": "fixed"}, "20 of 64 plausible structures overturn")
    '20 of 64 plausible structures collapse'
    """
    return declared_kind(row.get("kind") or "").in_its_verb(words)


def is_computed(row: Cells) -> bool:
    """Return False for a response that was not computed, which is neither safe nor unsafe."""
    return Verdict[row["verdict"].upper()] is not Verdict.NOT_COMPUTED


def that_count(rows: Iterable[AnyCells]) -> list[AnyCells]:
    """Return the rows that answer whether structures stand.

    For a structure that is computed in both directions of the ground motion these are the rows in
    both, for others the rows of one record, in one plane.

    Examples
    --------
    >>> stands = {"structure": "bent", "verdict": "stands"}
    >>> that_count([{**stands, "record": "A/090"}, {**stands, "components": "a b", "record": "A"}])
    [{'structure': 'bent', 'verdict': 'stands', 'components': 'a b', 'record': 'A'}]
    """
    held = list(rows)
    both = {row["structure"] for row in held if row.get("components") and is_computed(row)}
    return [row for row in held if bool(row.get("components")) is (row["structure"] in both)]


def magnitude_words(row: Cells, key: str) -> str:
    """Return a magnitude with the decimals that it was stated with, one at least and two at most.

    Examples
    --------
    >>> [magnitude_words({"magnitude": one}, "magnitude") for one in (6.95, "7.1", 7.0, "")]
    ['6.95', '7.1', '7.0', '–']
    """
    value = number(row.get(key))
    return DASH if math.isnan(value) else f"{value:.2f}".removesuffix("0")


def critical_scale(row: Cells, key: str = "critical_scale") -> float | str:
    """Return a critical or robust scale, or its lower bound as text if none was found.

    Examples
    --------
    >>> critical_scale({"critical_scale": "", "largest_scale": 10.0})
    '> 10'
    """
    searched = "largest_scale" if key == "critical_scale" else "largest_robust_scale"
    scale, largest = number(row.get(key)), number(row.get(searched))
    return f"> {largest:.3g}" if math.isnan(scale) and math.isfinite(largest) else scale


def share_words(row: Cells, _key: str = "") -> str:
    """Return the share of the ensemble that overturns, with its 90 % interval.

    Examples
    --------
    >>> share_words({"share_overturned": "0.3125", "share_overturned_low": "0.217",
    ...     "share_overturned_high": "0.422"})
    '31 % (22 to 42)'
    """
    share, low, high = (number(row.get(f"share_overturned{end}")) for end in ("", "_low", "_high"))
    if math.isnan(share):
        return DASH
    return f"{100.0 * share:.0f} % ({100.0 * low:.0f} to {100.0 * high:.0f})"


def band_words(row: Cells, key: str) -> str:
    """Return the 16, 50 and 84 % quantiles of a quantity.

    `key` is its column with a star in the place of the quantile.

    Examples
    --------
    >>> row = {"peak_u_16_m": "0.1", "peak_u_50_m": "0.25", "peak_u_84_m": "inf"}
    >>> band_words(row, "peak_u_*_m")
    '10.0 25.0 overturns'
    """
    quantity, columns = _OF_KEY[key]
    numbers = [number(row.get(column)) for column in columns]
    if any(map(math.isnan, numbers)):
        return DASH
    words = [quantity.text(number) for number in numbers if math.isfinite(number)]
    return " ".join([*words, *(["overturns"] if math.isinf(numbers[-1]) else [])])


def wavelet_name(row: Cells, key: str = "wavelet") -> str:
    """Return the short name of the wavelet, marked if the match could be noise.

    Examples
    --------
    >>> wavelet_name({"wavelet": "symmetric_ricker", "pulse_verdict": "noise"})
    'sym†'
    """
    name = str(row[key])
    return _SHORT.get(name, name) + pulse_mark(row)


def stated_pulse(row: Cells) -> str:
    """Return the result of the test against noise for the pulse of a row; "" without a pulse.

    Examples
    --------
    >>> stated_pulse({"pulse_verdict": "noise", "pulse_p_value": "0.32"})
    'best match, could be noise (p = 0.32)'
    """
    if not row.get("pulse_verdict"):
        return ""
    from rockframe.matching.verdict import PulseVerdict, pulse_words

    p_value = number(row.get("pulse_p_value"))
    return pulse_words(PulseVerdict[row["pulse_verdict"].upper()], p_value)


def pulse_mark(row: Cells) -> str:
    """Return the mark of a pulse that does not pass the test against noise; "" for other pulses.

    Examples
    --------
    >>> pulse_mark({"pulse_verdict": "noise"}), pulse_mark({"pulse_verdict": "pulse"})
    ('†', '')
    """
    return "†" if row.get("pulse_verdict") == "noise" else ""


#: Shares of the ensemble.
SHARES: Final = tuple(
    f"share_{share}"
    for share in ("overturned", "overturned_low", "overturned_high", "uplifted", "model_ends")
)
#: Quantity of each key with a star in place of the quantile, and the columns of its quantiles.
_OF_KEY: Final = {each.column("*"): (each, tuple(each.band_columns)) for each in BANDED}
#: Columns of the bands of the ensemble, with their variables.
OF_BANDS: Final = {
    column: variable for quantity in BANDED for column, variable in quantity.band_columns.items()
}
#: Distances of records, with their symbols.
DISTANCES: Final = {
    "epicentral_distance": "Repi",
    "distance_rrup": "Rrup",
    "distance_rjb": "Rjb",
    "distance_hypocentral": "Rhyp",
}


def ensemble_cells(response: EnsembleResponse) -> Row:
    """Return the columns of the shares and bands of an ensemble."""
    shares = {name: getattr(response, name) for name in SHARES}
    bands = {
        column: value
        for quantity in BANDED
        for column, value in zip(quantity.band_columns, response.bands[quantity.name], strict=True)
    }
    return shares | bands


def _band_column(quantity: Quantity) -> Column:
    """Return the column of the bands of a quantity."""
    head = f"{quantity.symbol}, 16 50 84 %"
    return Column(
        head,
        quantity.column("*"),
        rule=band_words,
        unit=quantity.shown_unit,
        priority=quantity.priority,
    )


def _nominal_column(quantity: Quantity) -> Column:
    """Return the column of the values of a quantity for the structures as given."""
    return Column(
        f"{quantity.symbol}, nominal",
        quantity.column(),
        quantity.form,
        quantity.factor,
        rule=standing,
        unit=quantity.shown_unit,
        priority=quantity.priority + 1,
    )


#: Quantities that every table of responses has, with their bands.
_LEADING: Final = (QUANTITIES["peak_rotation_ratio"], QUANTITIES["peak_u"])
#: Columns of the overview of a run in the order of the page, results first.
OVERVIEW: Final = (
    Column("Record", "record", wraps=True, priority=0),
    Column("Structure", "structure", priority=0),
    Column("Verdict", "verdict", rule=verdict_words, wraps=True, priority=0),
    Column("Overturn", "share_overturned", rule=share_words, priority=2),
    Column("10 % overturn at", "robust_scale_10", ".2f", rule=critical_scale),
    Column("Critical scale", "critical_scale", ".2f", rule=critical_scale),
    *(_band_column(quantity) for quantity in _LEADING),
    *(_nominal_column(quantity) for quantity in PEAKS),
    Column("Earthquake", "event", priority=4, wraps=True),
    Column("M", "magnitude", ".2f", rule=magnitude_words, priority=3),
    *(
        Column(head, f"{name}_km", ".1f", unit="km", priority=4)
        for name, head in DISTANCES.items()
        if name != "distance_hypocentral"
    ),
    Column("PGA", "pga_g", ".2f", unit="g", priority=3),
    Column("PGV", "pgv_m_s", ".2f", unit="m/s", priority=4),
    Column("a_p", "a_p_g", ".2f", unit="g", priority=3),
    Column("T_p", "T_p_s", ".2f", unit="s", priority=3),
    Column("Pulse", "wavelet", rule=wavelet_name, priority=4),
)
_BY_KEY: Final = {
    column.key: column
    for column in (
        *OVERVIEW,
        Column("record", "record_id", priority=0),
    )
}


#: Headings of a table of responses: with an ensemble, without one, and of the nominal values.
_SPREAD: Final = {
    "verdict": "Verdict",
    "share_overturned": "Overturn\n(90 %)>",
    "robust_scale_10": "10 %\noverturn at>",
    **{quantity.column("*"): f"{quantity.heading}\n16 50 84 %>" for quantity in _LEADING},
}
_STATED: Final = {
    "verdict": "Nominal verdict",
    **{
        quantity.column(): f"{quantity.heading}\nnominal>"
        for quantity in PEAKS
        if quantity not in _LEADING
    },
}
_NOMINAL: Final = {quantity.column(): f"{quantity.heading}\nnominal>" for quantity in _LEADING}


def response_columns(row: Cells, first: Mapping[str, str], **changes: Any) -> list[Column]:
    """Return the columns of a table of responses, after the columns in `first`.

    If `row`, one of its rows, has an ensemble, they are the verdict, the share that overturns, the
    margin and the bands, then the nominal peaks. Without an ensemble, all columns are nominal.
    """
    ensemble = math.isfinite(number(row.get("share_overturned")))
    robust = math.isfinite(number(row.get("largest_robust_scale")))
    heads = {**first, "structure": "Structure", **(_SPREAD if ensemble else _STATED), **_NOMINAL}
    if not robust:
        heads.pop("robust_scale_10", "")
        if math.isfinite(number(row.get("largest_scale"))):
            heads["critical_scale"] = "critical\nscale>"
    return titled(heads, **changes)


def titled(heads: Mapping[str, str], **changes: Any) -> list[Column]:
    """Return columns of the overview by key, with new headings and other changes.

    Examples
    --------
    >>> titled({"peak_u_m": "u_max [cm]>"})[0].cell({"peak_u_m": 0.135, "verdict": "stands"})
    '13.5'
    """
    return [replace(_BY_KEY[key], head=head, **changes) for key, head in heads.items()]


Row = dict[str, Any]


def flag_words(attrs: Mapping[str, Any]) -> Callable[[int], str] | None:
    """Return a function from flag values to meanings; None for variables that are not flags."""
    if "flag_meanings" not in attrs:
        return None
    masks = "flag_masks" in attrs
    numbers = np.atleast_1d(attrs["flag_masks" if masks else "flag_values"]).tolist()
    pairs = list(zip(numbers, attrs["flag_meanings"].split(), strict=True))

    def words(number: int) -> str:
        return ", ".join(word for n, word in pairs if (number & n if masks else number == n))

    return words


def columns_of(*texts: str) -> dict[str, str]:
    """Return the variable of each column; ``column=variable`` if the names differ.

    Examples
    --------
    >>> columns_of("record_id pga_g=pga")
    {'record_id': 'record_id', 'pga_g': 'pga'}
    """
    words = (word.partition("=") for text in texts for word in text.split())
    return {key: name or key for key, _, name in words}


#: Largest numbers of pairs of record and structure, and of records, in a block.
_PAIRS: Final = 2**14
_RECORDS: Final = 1024


def blocks(dataset: Dataset) -> Iterator[Dataset]:
    """Yield the dataset in blocks of records, so that not all values have to be in memory.

    Examples
    --------
    >>> import xarray as xr
    >>> [part.sizes["record"] for part in blocks(xr.Dataset({"a": ("record", [1, 2])}))]
    [2]
    """
    together = max(1, min(_RECORDS, _PAIRS // dataset.sizes.get("structure", 1)))
    for start in range(0, dataset.sizes["record"], together):
        yield dataset.isel(record=slice(start, start + together))


def rows_along(dataset: Dataset, along: str, columns: Mapping[str, str]) -> Iterator[Row]:
    """Return an iterator over a row for each position along the dimensions.

    The parameters are those of `columns_along`.
    """
    return rows_of_columns(columns_along(dataset, along, columns))


def columns_along(
    dataset: Dataset, along: str, columns: Mapping[str, str]
) -> Iterator[dict[str, list[Any]]]:
    """Return an iterator over the columns of the rows at each position of the first dimension.

    For optional variables that the file does not have, numbers are NaN and texts are empty.

    Parameters
    ----------
    dataset : Arrays or xarray.Dataset
        A variable with fewer dimensions gives the same value in many rows.
    along : str
        The dimensions, separated by spaces; the first varies slowest.
    columns : mapping of str to str
        Variable of each column; ``peak_u_band.0`` is the first value along its last dimension.
        Accelerations in columns that end in ``_g`` are in g, angles in
        columns that end in ``_deg`` in degrees. A flag with two values becomes a bool, another flag
        its meaning.
    """
    sizes = {dim: dataset.sizes[dim] for dim in along.split()}
    cells = {key: _cells(dataset, sizes, key, name) for key, name in columns.items()}
    return (
        {key: column(i) for key, column in cells.items()} for i in range(next(iter(sizes.values())))
    )


def _cells(
    dataset: Dataset, sizes: Mapping[str, int], key: str, name: str
) -> Callable[[int], list[Any]]:
    """Return a function that gives the cells of a column at a position of the slowest dimension."""
    place = ""
    if name not in dataset.variables:  # a name may have a point itself, such as sa_0.5s
        name, _, place = name.partition(".")
    if name not in dataset.variables:
        declared = KINDS[dataset.attrs["rockframe_kind"]][name]
        unknown = "" if declared.holds in ("text", "flags") else np.nan
        together = math.prod([*sizes.values()][1:])
        return lambda _: [unknown] * together
    variable = dataset.variables[name]
    dims, values = [*variable.dims], variable.values
    if place:
        dims, values = dims[:-1], values[..., int(place)]
    values = values.transpose([dims.index(dim) for dim in sizes if dim in dims])
    values = values[tuple(slice(None) if dim in dims else None for dim in sizes)]
    values = np.broadcast_to(values, [*sizes.values()])
    plain = _plain(key, variable.attrs)
    return lambda i: plain(values[i : i + 1].ravel())


def _plain(key: str, attrs: Mapping[str, Any]) -> Callable[[NDArray[Any]], list[Any]]:
    words = flag_words(attrs)
    if words is not None:
        meaning = bool if np.size(attrs.get("flag_values", ())) == 2 else cache(words)
        return lambda block: list(map(meaning, block.tolist()))
    if key.endswith("_g"):
        return lambda block: list((block / GRAVITY).tolist())
    if key.endswith("_deg"):
        return lambda block: list(np.degrees(block).tolist())
    return lambda block: list(block.tolist())


Key = TypeVar("Key", bound=Hashable)


@dataclass(frozen=True)
class LabelledValue:
    """A number or text of a dataset, with its description.

    Parameters
    ----------
    name : str
        Name of the variable.
    label : str
        Long name of the variable.
    value : float or str
        Value; a flag is given by its meaning, an unknown value as NaN or an empty text.
    units : str
        Unit as CF writes it; ``1`` for a ratio, a count or a text.
    """

    name: str
    label: str
    value: float | str
    units: str


LabelledValues = tuple[LabelledValue, ...]


class LabelledValuesOf(Mapping[Key, LabelledValues]):
    """Labelled values of each record, structure or pair of them, from one or several datasets.

    Parameters
    ----------
    *parts : Arrays or xarray.Dataset
        The first dataset defines the keys; the others add values for keys that they also have.
    keys : sequence of str
        Variables that contain the names: one variable, or one for each part of a pair.

    Examples
    --------
    >>> import xarray as xr
    >>> words = {"long_name": "peak ground acceleration", "units": "m s-2"}
    >>> dataset = xr.Dataset({"name": ("record", ["a", "b"]), "pga": ("record", [1.5, 2.5], words)})
    >>> LabelledValuesOf(dataset, keys=["name"])["b"][0].value
    2.5
    """

    def __init__(self, *parts: Dataset, keys: Sequence[str]) -> None:
        self._parts = [
            (
                [{str(name): i for i, name in enumerate(part[key].values)} for key in keys],
                _columns_along(part, keys),
            )
            for part in parts
        ]

    def __getitem__(self, key: Key) -> LabelledValues:
        """Return the values for a name, or for a pair of names."""
        names: Any = (key,) if isinstance(key, str) else key
        values: list[LabelledValue] = []
        for place, (positions, columns) in enumerate(self._parts):
            rows = [of.get(name) for of, name in zip(positions, names, strict=True)]
            if None not in rows:
                values += [column(rows) for column in columns.values()]
            elif place == 0:
                raise KeyError(key)
        return tuple(values)

    def value(self, key: Sequence[str], name: str) -> float | str:
        """Return a value of the first dataset for the name, or the pair of names, in a key."""
        positions, columns = self._parts[0]
        return columns[name]([of[part] for of, part in zip(positions, key, strict=True)]).value

    def __iter__(self) -> Iterator[Any]:
        """Yield the names, or the pairs of names."""
        positions, _ = self._parts[0]
        return iter(positions[0]) if len(positions) == 1 else product(*positions)

    def __len__(self) -> int:
        """Return the number of names or pairs."""
        return sum(1 for _ in self)


def _columns_along(dataset: Dataset, keys: Sequence[str]) -> dict[str, partial[LabelledValue]]:
    """Return a function from a position to the value, for each variable on the keys' dimensions."""
    dims = tuple(dim for key in keys for dim in dataset[key].dims)
    return {
        str(name): partial(
            _labelled, str(name), variable, variable.values, flag_words(variable.attrs)
        )
        for name, variable in dataset.variables.items()
        if variable.dims == dims and name not in keys
    }


def _labelled(
    name: str,
    array: Array | xr.Variable,
    values: NDArray[Any],
    words: Callable[[int], str] | None,
    at: Sequence[int],
) -> LabelledValue:
    value = values.item(*at)
    if words is not None:
        value = words(value).replace("_", " ")
    value = float(value) if isinstance(value, int | float) else str(value)
    return LabelledValue(name, array.attrs["long_name"], value, array.attrs["units"])
