"""Write tables as CSV, spreadsheets, Markdown, LaTeX or Parquet."""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Final

from rockframe.cells import TABLE_FORMATS, harmless, write_table
from rockframe.errors import InputError, ParameterError
from rockframe.provenance import whole_file

#: Largest number of rows in a spreadsheet.
_MOST_ROWS: Final = 1_048_575
#: Packages of the extra `tables` that formats need.
_PACKAGES: Final = {"xlsx": "openpyxl", "parquet": "pyarrow"}


def write_rows_as(path: Path, rows: Iterable[Mapping[str, Any]], table_format: str = "") -> int:
    """Write rows as a table, complete or not at all, and return the number of rows.

    Parameters
    ----------
    path : Path
        File to write, with the extension of the format.
    rows : iterable of mapping of str to object
        Rows with the same columns; NaN and None are blank.
    table_format : str
        One of `rockframe.cells.TABLE_FORMATS`; by default the format of the extension.

    Raises
    ------
    InputError
        If the file cannot be written, or if there are too many rows for a spreadsheet.
    ParameterError
        If the format has another extension, or needs packages that are missing.
    """
    table_format = table_format or _format_of(path)
    if path.suffix.lower() != TABLE_FORMATS[table_format]:
        raise ParameterError(
            f"{path}: name of a table as {table_format}. Must end in {TABLE_FORMATS[table_format]}."
        )
    if table_format == "csv":
        with whole_file(path) as partial, partial.open("w", newline="", encoding="utf-8") as stream:
            return write_table(stream, rows)
    require_format(path)
    import pandas as pd  # the import takes half a second

    frame = pd.DataFrame.from_records(list(rows))
    if table_format == "xlsx" and len(frame) > _MOST_ROWS:
        raise InputError(path, f"has {len(frame)} rows. Must be at most {_MOST_ROWS} for xlsx.")
    with whole_file(path) as partial:
        _write(frame, partial, table_format)
    return len(frame)


def require_format(path: Path) -> None:
    """Require the packages for the format of this extension.

    Raises
    ------
    ParameterError
        If a package is missing.
    """
    table_format = _format_of(path)
    try:
        importlib.import_module(_PACKAGES.get(table_format, "csv"))
    except ImportError:
        raise ParameterError(
            f"Tables as {table_format} need the package {_PACKAGES[table_format]}. "
            "Install it with: pip install 'rockframe[tables]'."
        ) from None


def columns_of(path: Path) -> list[str]:
    """Return the columns of a table of `write_rows_as`; for another file, any other words."""
    ending = path.suffix.lower()
    try:
        if ending == ".parquet":
            schema = importlib.import_module("pyarrow.parquet").read_schema(path)
            return list(schema.names)
        if ending == ".xlsx":
            import pandas as pd

            return [str(name) for name in pd.read_excel(path, nrows=0, engine="openpyxl")]
    except Exception:  # noqa: BLE001 -- any error means that it is no such table
        return []
    with path.open("rb") as stream:
        lines = [stream.readline(4096).decode("latin-1") for _ in range(3)]
    if ending == ".tex":
        return lines[2].replace(r"\_", "_").removesuffix("\\\\\n").strip().split(" & ")
    return lines[0].strip("| \r\n").split(" | " if ending == ".md" else ",")


def _format_of(path: Path) -> str:
    known = {ending: name for name, ending in TABLE_FORMATS.items()}
    return known.get(path.suffix.lower(), "csv")


def _write(frame: Any, path: Path, table_format: str) -> None:
    if table_format == "xlsx":
        texts = frame.select_dtypes(["object", "string"]).columns
        safe = frame.assign(**{name: [_safe(one) for one in frame[name]] for name in texts})
        safe.to_excel(path, index=False, engine="openpyxl")
    elif table_format == "parquet":
        frame.to_parquet(path, index=False, engine="pyarrow")
    elif table_format == "latex":
        content = frame.to_latex(index=False, escape=True, na_rep="--", float_format="%.4g")
        path.write_text(content, encoding="utf-8")
    else:
        path.write_text(_markdown(frame), encoding="utf-8")


def _safe(value: Any) -> Any:
    return harmless(value) if isinstance(value, str) else value


def _markdown(frame: Any) -> str:
    """Return a table of Markdown, with numbers to four digits."""
    rows = [list(frame.columns), ["---"] * len(frame.columns)]
    rows += [[_cell(value) for value in row] for row in frame.itertuples(index=False)]
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return "–" if value != value else f"{value:.4g}"
    return "" if value is None else str(value).replace("|", r"\|").replace("\n", " ")
