"""The tables of a screening: motions, scenarios, fragility, rates and design."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import xarray as xr

from rockframe.cells import TABLE_FORMATS
from rockframe.results.reading import opened
from rockframe.results.schema import SCREEN
from rockframe.results.screening.screen import read_screening
from rockframe.results.screening.table import screen_rows, screen_summary
from rockframe.results.tables.entries import refuse_other_table
from rockframe.results.tables.formats import write_rows_as
from rockframe.results.tables.rows import columns_of, rows_along
from rockframe.risk import measure_of

Rows = Iterator[dict[str, Any]]

#: Number of scenarios that are read together.
_TOGETHER: Final = 2**18


def fragility_rows(screening: xr.Dataset) -> Rows:
    """Yield a row for each structure, limit state and known measure.

    Parameters
    ----------
    screening : Dataset
        As returned by `read_screening`.
    """
    for structure in screen_summary(screening):
        for fit in structure["fragility"]:
            if fit["outcome"] != "unknown":
                left = ("words", "symbol", "said")
                said = {name: value for name, value in fit.items() if name not in left}
                said["reached"] = said.pop("overturned")
                said["reached_from"] = said.pop("overturned_from")
                yield {"structure": structure["structure"], **said}


def rate_rows(screening: xr.Dataset) -> Rows:
    """Yield a row for each structure and limit state, with its rate and return period."""
    for structure in screen_summary(screening):
        for rate in structure["rates"]:
            left = ("words", "disaggregation")
            said = {name: value for name, value in rate.items() if name not in left}
            measure = measure_of(str(screening["hazard_measure"].item())).name
            yield {"structure": structure["structure"], "measure": measure, **said}


def design_rows(screening: xr.Dataset) -> Rows:
    """Return a row for each structure and value tried in the design."""
    unit = screening["design_value"].attrs["units"]
    columns = columns_of(
        "structure dimension=design_dimension value=design_value unit quantity=design_quantity",
        "limit=design_limit share_below=design_share required_share=design_required_share",
        "smallest=design_smallest sure_from=design_sure_from",
    )
    return rows_along(screening.assign(unit=unit), "structure design_step", columns)


def scenario_rows(screening: xr.Dataset) -> Rows:
    """Yield a row for each motion, structure and scale, with the intensity at that scale."""
    columns = columns_of(
        "record_id structure scale verdict peak_rotation_ratio u_max_m=peak_u v_max_m=peak_v",
        "impact_velocity_m_s=peak_impact_velocity pga_g=pga pgv_m_s=pgv",
    )
    for row in rows_along(screening, "record structure scale", columns):
        intensities = {name: row[name] * row["scale"] for name in ("pga_g", "pgv_m_s")}
        yield row | intensities


def _scenarios(path: Path) -> Rows:
    """Yield the rows of all scenarios; only some motions are in memory at a time."""
    with opened(path, SCREEN) as dataset:
        known = dataset.drop_dims("obs", errors="ignore")
        together = max(1, _TOGETHER // (known.sizes["structure"] * known.sizes["scale"]))
        for first in range(0, known.sizes["record"], together):
            yield from scenario_rows(known.isel(record=slice(first, first + together)).load())


#: Functions that make the rows of each table, by the end of the table's name.
_ROWS: Final[Mapping[str, Callable[[xr.Dataset], Rows]]] = MappingProxyType(
    {
        "": screen_rows,
        "fragility": fragility_rows,
        "rates": rate_rows,
        "design": design_rows,
    }
)
#: First columns, by which an earlier table is recognised.
_FIRST: Final[Mapping[str, tuple[str, ...]]] = MappingProxyType(
    {
        "": ("record_id", "structure", "scale", "verdict"),
        "scenarios": ("record_id", "structure", "scale", "verdict"),
        "fragility": ("structure", "limit_state", "measure"),
        "rates": ("structure", "measure", "limit_state"),
        "design": ("structure", "dimension", "value"),
    }
)


def screen_table_paths(
    output: Path, *, rates: bool, design: bool, table_format: str = "csv"
) -> dict[str, Path]:
    """Return the paths of the tables beside a screening, by kind; the table of motions has kind "".

    Examples
    --------
    >>> [p.name for p in screen_table_paths(Path("screen.nc"), rates=True, design=False).values()]
    ['screen.csv', 'scenarios.csv', 'fragility.csv', 'rates.csv']
    >>> screen_table_paths(Path("site.nc"), rates=False, design=False)["fragility"].name
    'site-fragility.csv'
    """
    ending, stem = TABLE_FORMATS[table_format], output.stem
    kinds = ["", "scenarios", "fragility", *["rates"] * rates, *["design"] * design]
    names = {kind: kind if stem == "screen" else f"{stem}-{kind}" for kind in kinds} | {"": stem}
    return {kind: output.with_name(name + ending) for kind, name in names.items()}


def write_screen_tables(
    screen_path: Path, output: Path | None = None, table_format: str = "csv"
) -> dict[str, Path]:
    """Write the tables of a screening, and return their paths by kind.

    Parameters
    ----------
    screen_path : Path
        Output of the screen stage.
    output : Path, optional
        Path beside which the tables are written (default: `screen_path`).
    table_format : str
        One of `TABLE_FORMATS`.

    Raises
    ------
    InputError
        If the screening cannot be read, or a table cannot be written.
    """
    screening = read_screening(screen_path, every_scale=False)
    rates, design = "annual_rate" in screening, "design_share" in screening
    beside = output or screen_path
    paths = screen_table_paths(beside, rates=rates, design=design, table_format=table_format)
    for kind, path in paths.items():
        rows = _scenarios(screen_path) if kind == "scenarios" else _ROWS[kind](screening)
        write_rows_as(path, rows, table_format)
    return paths


def refuse_strange_tables(paths: Mapping[str, Path]) -> None:
    """Raise an error if a file has the name of a table but other contents.

    Raises
    ------
    InputError
        If there is such a file.
    """
    for kind, path in paths.items():
        refuse_other_table(path, _FIRST[kind], "the table of the screening")
