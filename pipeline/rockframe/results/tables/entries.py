"""records.csv with the reasons why stages rejected records, and the formats of all tables."""

from __future__ import annotations

import csv
import importlib
import json
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from itertools import chain, islice, zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TextIO

from rockframe.cells import (
    TABLE_FORMATS,
    read_column,
    read_rows,
    write_table,
)
from rockframe.errors import InputError, ParameterError
from rockframe.options import STAGES
from rockframe.outcome import InputOutcome
from rockframe.provenance import package_versions, whole_file
from rockframe.results.stored import attributes_of

if TYPE_CHECKING:
    from rockframe.signals.passport import Passport

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
    table_format = format_of(path, table_format)
    if table_format == "csv":
        with whole_file(path) as partial, partial.open("w", newline="", encoding="utf-8") as stream:
            return write_table(stream, rows)
    require_format(path)
    if table_format == "xlsx":
        from rockframe.results.tables.workbook import write_workbook

        return write_workbook(path, {path.stem: rows})
    if table_format == "parquet":
        with whole_file(path) as partial:
            return _write_parquet(path, partial, rows)
    import pandas as pd  # the import takes half a second

    frame = pd.DataFrame.from_records(list(rows))
    with whole_file(path) as partial:
        _write(frame, partial, table_format)
    return len(frame)


def format_of(path: Path, table_format: str = "") -> str:
    """Return the stated format of a table, by default that of its extension.

    Raises
    ------
    ParameterError
        If the extension is that of another format.
    """
    table_format = table_format or _format_of(path)
    if path.suffix.lower() != TABLE_FORMATS[table_format]:
        raise ParameterError(
            f"{path}: name of a table as {table_format}. Must end in {TABLE_FORMATS[table_format]}."
        )
    return table_format


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


def beside(output: Path, kind: str, plain: str) -> Path:
    """Return the path of a further table beside a table or file.

    Examples
    --------
    >>> [beside(Path(one), "summary", plain="table").name for one in ("table.csv", "mine.csv")]
    ['summary.csv', 'mine-summary.csv']
    >>> beside(Path("design.csv"), "design", plain="screen").name  # not design-design.csv
    'design-table.csv'
    """
    further = "table" if output.stem.endswith(kind) else kind
    stem = kind if output.stem == plain else f"{output.stem}-{further}"
    return output.with_name(stem + output.suffix)


def table_paths(
    output: Path, kinds: Iterable[str], main: str, table_format: str
) -> dict[str, Path]:
    """Return the path of each table of `write_tables`, by kind.

    Examples
    --------
    >>> paths = table_paths(Path("response.nc"), ["summary", "responses"], "responses", "csv")
    >>> [path.name for path in paths.values()]
    ['response-summary.csv', 'response.csv']
    """
    path = output.with_suffix(TABLE_FORMATS[table_format])
    in_workbook = table_format == "xlsx"
    return {
        kind: path
        if in_workbook or kind == main
        else beside(path, kind.replace(" ", "-"), plain="")
        for kind in kinds
    }


def write_tables(
    output: Path, tables: Mapping[str, Sequence[Mapping[str, Any]]], main: str, table_format: str
) -> list[Path]:
    """Write tables beside the file of a stage: as sheets of one workbook, or a file for each.

    Parameters
    ----------
    output : Path
        The file of the stage; the workbook and the main table have its name.
    tables : mapping of str to sequence of mapping
        Rows of each table, by kind, in the order of the sheets.
    main : str
        Kind of the main table.
    table_format : str
        One of `rockframe.cells.TABLE_FORMATS`.

    Returns
    -------
    list of Path
        The written files.

    Raises
    ------
    InputError
        If a file cannot be written.
    ParameterError
        If the format needs packages that are missing.
    """
    paths = table_paths(output, tables, main, table_format)
    require_format(paths[main])
    if table_format == "xlsx":
        from rockframe.results.tables.workbook import write_workbook  # only for this format

        write_workbook(paths[main], tables)
    else:
        for kind, path in paths.items():
            write_rows_as(path, tables[kind], table_format)
    return list(dict.fromkeys(paths.values()))


def refuse_other_tables(
    output: Path, first: Mapping[str, Sequence[str]], main: str, table_format: str
) -> None:
    """Refuse to replace files that have the names of tables but other contents.

    Parameters
    ----------
    output, main, table_format
        As for `write_tables`.
    first : mapping of str to sequence of str
        First columns of each table, by kind.

    Raises
    ------
    InputError
        If there is such a file.
    ParameterError
        If the format needs packages that are missing.
    """
    checked: set[Path] = set()
    for kind, path in table_paths(output, first, main, table_format).items():
        if path not in checked:  # of a workbook, the first sheet decides
            refuse_other_table(path, first[kind], "a table of this command")
        checked.add(path)


#: Columns of `parameter_rows`.
PARAMETERS: Final = ("part", "name", "value")


def parameter_rows(*files: tuple[Path, str]) -> list[dict[str, Any]]:
    """Return the options, input hashes and versions of files, and the versions of libraries here.

    Parameters
    ----------
    *files : (Path, str)
        netCDF files of stages, and their kinds.

    Raises
    ------
    InputError
        If a file cannot be read.
    """
    rows: list[tuple[str, str, Any]] = []
    for path, kind in files:
        attributes = attributes_of(path, kind)
        attribute_names = ("rockframe_version", "source_code_hash", "gravity")
        rows += [(kind, name, attributes[name]) for name in attribute_names]
        hashes = json.loads(attributes["input_sha256"])
        rows += [(f"{kind}: SHA-256 of inputs", *entry) for entry in hashes.items()]
        options = _flat(json.loads(attributes["parameters"]))
        rows += [(f"{kind}: options", *option) for option in options]
    rows += [
        ("versions of libraries", *package_version)
        for package_version in package_versions().items()
    ]
    return [dict(zip(PARAMETERS, row, strict=True)) for row in rows]


def _flat(options: Mapping[str, Any], within: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the options of nested tables by their names with points; lists become text."""
    for name, value in options.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{within}{name}.")
        else:
            plain = value is None or isinstance(value, str | int | float)
            yield f"{within}{name}", value if plain else json.dumps(value)


def columns_of(path: Path) -> list[str]:
    """Return the columns of a table of `write_rows_as`; for another file, any other words."""
    ending = path.suffix.lower()
    try:
        if ending == ".parquet":
            schema = importlib.import_module("pyarrow.parquet").read_schema(path)
            return list(schema.names)
        if ending == ".xlsx":
            from rockframe.results.tables.workbook import heads_of

            return heads_of(path)
    except Exception:  # noqa: BLE001 -- any error means that it is no such table
        return []
    with path.open("rb") as stream:
        lines = [stream.readline(4096).decode("latin-1") for _ in range(3)]
    if ending == ".tex":
        return lines[2].replace(r"\_", "_").removesuffix("\\\\\n").strip().split(" & ")
    return lines[0].strip("| \r\n").split(" | " if ending == ".md" else ",")


def _format_of(path: Path) -> str:
    formats = {ending: name for name, ending in TABLE_FORMATS.items()}
    return formats.get(path.suffix.lower(), "csv")


#: Number of rows of a row group of a parquet file, which are in memory together.
_ROW_GROUP: Final = 2**16


def _write_parquet(path: Path, partial: Path, rows: Iterable[Mapping[str, Any]]) -> int:
    """Write rows as parquet in groups, few of which are in memory, and return their number."""
    import pandas as pd

    arrow = importlib.import_module("pyarrow")
    count, schema, remaining = 0, None, iter(rows)
    with ExitStack() as stack:
        writer: Any = None
        while (group := list(islice(remaining, _ROW_GROUP))) or writer is None:
            frame = pd.DataFrame.from_records(group)
            try:
                table = arrow.Table.from_pandas(frame, schema=schema, preserve_index=False)
            except (arrow.ArrowInvalid, arrow.ArrowTypeError) as error:
                raise InputError(path, f"{error} after row {count}. Write CSV instead.") from None
            if writer is None:
                # a column that is empty in the first rows may have texts later
                texts = [arrow.string() if t == arrow.null() else t for t in table.schema.types]
                schema = arrow.schema(zip(table.schema.names, texts, strict=True))
                writer = importlib.import_module("pyarrow.parquet").ParquetWriter(partial, schema)
                stack.enter_context(writer)
            writer.write_table(table.cast(schema))
            count += len(group)
    return count


def _write(frame: Any, path: Path, table_format: str) -> None:
    if table_format == "latex":
        content = frame.to_latex(index=False, escape=True, na_rep="--", float_format="%.4g")
        path.write_text(content, encoding="utf-8")
    else:
        path.write_text(_markdown(frame), encoding="utf-8")


def _markdown(frame: Any) -> str:
    """Return a table of Markdown, with numbers to four digits."""
    rows = [list(frame.columns), ["---"] * len(frame.columns)]
    rows += [[_cell(value) for value in row] for row in frame.itertuples(index=False)]
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return "–" if value != value else f"{value:.4g}"
    return "" if value is None else str(value).replace("|", r"\|").replace("\n", " ")


#: First columns of records.csv.
_COLUMNS: Final = ("file", "record_id", "status", "line", "reason")


def write_entries(entries: Sequence[InputOutcome], path: Path) -> None:
    """Write the table, with value, limit and verdict of each check; unknown values are empty.

    Parameters
    ----------
    entries : sequence of InputOutcome
        Rows of the table.
    path : Path
        File to write; its extension states the format.

    Raises
    ------
    InputError
        If the file cannot be written.
    ParameterError
        If the format needs packages that are missing.
    """
    write_rows_as(path, entry_rows(entries))


def entry_rows(entries: Sequence[InputOutcome]) -> Iterator[dict[str, object]]:
    """Yield the rows of the table of `write_entries`."""
    passports = [entry.passport for entry in entries if entry.passport is not None]
    names = [check.name for check in passports[0].checks] if passports else []
    heads = [
        *("passport", "corner_hz", "corner_source"),
        *(f"{name}{part}" for name in names for part in ("", "_limit", "_verdict")),
    ]
    for entry in entries:
        yield {
            "file": entry.file,
            "record_id": entry.record_id,
            "status": entry.status,
            "line": entry.line,
            "reason": entry.reason,
            **dict(zip_longest(heads, _cells(entry.passport))),
        }


#: Columns of records.csv that are texts, besides the verdicts of the checks.
_TEXTS: Final = frozenset([*_COLUMNS, "passport", "corner_source"]) - {"line"}


def copy_entries(path: Path, output: Path) -> None:
    """Write the table of `write_entries` again, in another format.

    Parameters
    ----------
    path : Path
        The table, in CSV.
    output : Path
        File to write; its extension states the format.

    Raises
    ------
    InputError
        If the table cannot be read, or the file cannot be written.
    ParameterError
        If the format needs packages that are missing.
    """
    write_rows_as(
        output,
        ({name: _entry_cell(name, text) for name, text in row.items()} for row in rows_of(path)),
    )


def _entry_cell(column: str, text: str) -> object:
    """Return the value of a cell of records.csv; None if it is blank."""
    if column in _COLUMNS and column != "line":
        return text
    if column in _TEXTS or column.endswith("_verdict") or not text:
        return text or None
    return int(text) if column == "line" else float(text)


def refuse_strange_entries(path: Path) -> None:
    """Refuse to replace a file that has the name of the table but other contents.

    Raises
    ------
    InputError
        If there is such a file.
    ParameterError
        If the format needs packages that are missing.
    """
    refuse_other_table(path, _COLUMNS, "the list of inputs")


def _cells(passport: Passport | None) -> list[object]:
    if passport is None:
        return []
    checks = [(check.value, check.limit, check.verdict.name.lower()) for check in passport.checks]
    corner = passport.corner
    values = [passport.verdict.name.lower(), corner.frequency, corner.source.name.lower()]
    return [*values, *chain.from_iterable(checks)]


def refuse_other_table(path: Path, first: Sequence[str], what: str) -> None:
    """Refuse to replace a file that has the name of a table but other contents.

    The list of inputs of an ingest without records, which wrote no netCDF file, may be replaced.

    Parameters
    ----------
    path : Path
        Path of the table.
    first : sequence of str
        First columns of the table.
    what : str
        Description of the table for the message.

    Raises
    ------
    InputError
        If there is a file with other columns.
    ParameterError
        If the format needs packages that are missing.
    """
    require_format(path)
    columns = columns_of(path) if path.is_file() else list(first)
    left = columns[: len(_COLUMNS)] == list(_COLUMNS) and not path.with_suffix(".nc").exists()
    if columns[: len(first)] != list(first) and not left:
        raise InputError(path, f"is in the place of {what}, but is another file. Move it away.")


#: Files of the stages that may reject records, and their kinds.
_MAY_REJECT: Final = {stage.file: stage.kind for stage in STAGES.values() if stage.of_records}


def rejected_inputs(folder: Path) -> list[InputOutcome]:
    """Return the rejected files and records of a run, each with its reason and its line.

    Records outside the user's filters are not included. A record that several stages rejected has
    the reason of the last one.

    Parameters
    ----------
    folder : Path
        Folder of the run.

    Raises
    ------
    InputError
        If a file of the run cannot be read.
    """
    rejected = [
        InputOutcome(
            *(row["file"], row["reason"], int(row["line"]) if row["line"] else None),
            record_id=row["record_id"],
        )
        for row in rows_of(folder / "records.csv")
        if row["status"] == "rejected"
    ]
    reasons: dict[str, str] = {}
    for attributes in _attributes(folder).values():
        filtered = json.loads(attributes.get("filtered", "[]"))
        left_out = json.loads(attributes["left_out"])
        reasons |= {record: reason for record, reason in left_out.items() if record not in filtered}
    return [*rejected, *(InputOutcome(record, reason) for record, reason in reasons.items())]


def rejections_of(folder: Path) -> dict[str, str]:
    """Return the reasons of `rejected_inputs`, all reasons of a file together, by its name.

    Raises
    ------
    InputError
        If a file of the run cannot be read.
    """
    reasons: dict[str, str] = {}
    for rejection in rejected_inputs(folder):
        reasons[rejection.file] = f"{reasons.get(rejection.file, '')} {rejection.reason}".lstrip()
    return reasons


def left_out_of(folder: Path) -> dict[str, dict[str, str]]:
    """Return the reasons why stages rejected records, for each file of a stage by record.

    Raises
    ------
    InputError
        If one of the files cannot be read.
    """
    of_files = _attributes(folder).items()
    return {name: dict(json.loads(attributes["left_out"])) for name, attributes in of_files}


def _attributes(folder: Path) -> dict[str, Mapping[str, str]]:
    """Return the global attributes of the file of each stage that may reject records."""
    return {
        name: attributes_of(folder / name, kind)
        for name, kind in _MAY_REJECT.items()
        if (folder / name).is_file()
    }


def rows_of(path: Path) -> Iterator[dict[str, str]]:
    """Yield the rows of a list of a run; none if the list does not exist.

    Raises
    ------
    InputError
        If the list cannot be read.
    """
    if not path.is_file():
        return
    try:
        with path.open(newline="", encoding="utf-8") as stream:
            yield from rows_in(stream, path)
    except OSError as error:
        raise InputError(path, f"cannot be read: {error}.") from None


def count_values(path: Path, column: str) -> dict[str, int]:
    """Return how often each text stands in a column of a list of a run; none if it does not exist.

    Raises
    ------
    InputError
        If the list cannot be read, or has no such column.
    """
    if not path.is_file():
        return {}
    try:
        with path.open(newline="", encoding="utf-8") as stream:
            return dict(Counter(read_column(stream, column)))
    except (OSError, ValueError, IndexError, csv.Error) as error:
        raise InputError(path, f"cannot be read: {error}.") from None


def rows_in(stream: TextIO, path: Path) -> Iterator[dict[str, str]]:
    """Yield the rows of a list of a run from an open file; errors name the path.

    Raises
    ------
    InputError
        If the list cannot be read.
    """
    try:
        rows = read_rows(stream)
        _, columns = next(rows, (1, []))
        for line, row in rows:
            if len(row) != len(columns):
                message = f"{len(row)} columns. Must be {len(columns)}."
                raise InputError(path, message, line=line)
            yield dict(zip(columns, row, strict=True))
    except (ValueError, csv.Error) as error:
        raise InputError(path, f"cannot be read: {error}.") from None
