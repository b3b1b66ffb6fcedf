"""Further stages: fetch files, index batches, write the table."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rockframe.cells import TABLE_FORMATS, block_lines, write_rows
from rockframe.engines.engine import Engine, map_tasks
from rockframe.errors import ParameterError
from rockframe.ingest import CATALOGUE, CatalogueEntry, write_catalogue
from rockframe.options.fetch import FetchOptions
from rockframe.outcome import InputOutcome
from rockframe.paper.pulses import (
    COMPARED,
    paper_comparisons,
    with_paper_columns,
    with_paper_facts,
)
from rockframe.provenance import refuse_obstacles, refuse_overwriting, whole_file
from rockframe.results.pulses import pulse_rows, recordings_of
from rockframe.results.schema import KINDS, PULSES, RECORDS, RESPONSE
from rockframe.results.stored import attributes_of, kind_of
from rockframe.results.tables.entries import (
    beside,
    copy_entries,
    format_of,
    parameter_rows,
    refuse_other_table,
    write_rows_as,
    write_tables,
)
from rockframe.results.tables.notes import left_out_reasons, with_directions
from rockframe.results.tables.rows import Row
from rockframe.results.tables.summary import SUMMARY_COLUMNS, Summary, summary_rows, tables_of
from rockframe.results.tables.table import TableBlock, table_blocks, table_rows
from rockframe.results.writing import write_index

if TYPE_CHECKING:
    from rockframe.fetch.coverage import Fetched
    from rockframe.results.schema.arrays import Dataset


def table_stage(
    records: Path,
    pulses: Path,
    response: Path,
    output: Path,
    table_format: str = "",
    *,
    engine: Engine | None = None,
) -> int:
    """Write a row for each record and structure, ``table.csv``, and their summary, ``summary.csv``.

    Parameters
    ----------
    records, pulses, response : Path
        Outputs of `ingest_stage`, `pulse_stage` and `respond_stage` for the same records.
    output : Path
        File to write. The summary of another table than ``table.csv`` has its name, as in
        ``mine-summary.csv``; a workbook (xlsx) has the summary as its first sheet.
    table_format : str
        One of `rockframe.cells.TABLE_FORMATS`; by default the format of the extension.
    engine : Engine, optional
        Engine that makes the rows of CSV; by default a `ProcessPool`. Every engine gives the same
        bytes.

    Returns
    -------
    int
        Number of rows.

    Raises
    ------
    InputError
        If a file cannot be read or belongs to other records, or the table cannot be written.
    """
    summary = beside(output, "summary", plain="table")
    refuse_overwriting([output, summary], (records, pulses, response))
    over_records, recordings = Summary(output.parent), recordings_of(records)
    left_out = left_out_reasons(attributes_of(response, RESPONSE))

    def summarised() -> list[Row]:
        rows = over_records.rows(recordings, left_out)
        return with_directions(rows, attributes_of(response, RESPONSE))

    if format_of(output, table_format) == "csv":
        refuse_other_table(summary, SUMMARY_COLUMNS, "the summary of the table")
        tasks = table_blocks(records, pulses, response)
        with whole_file(output) as partial, partial.open("wb") as stream:
            count = 0
            for header, lines, rows_of_text, part in map_tasks(_in_csv, tasks, engine=engine):
                if not count:
                    stream.write(header)
                stream.write(lines)
                count += rows_of_text
                over_records.join(part)
        write_rows_as(summary, summarised(), table_format)
        return count
    rows = over_records.passed(table_rows_of(records, pulses, response))
    if format_of(output, table_format) == "xlsx":
        held = list(rows)
        files = ((records, RECORDS), (pulses, PULSES), (response, RESPONSE))
        write_table_workbook(output, held, summarised(), *files)
        return len(held)
    refuse_other_table(summary, SUMMARY_COLUMNS, "the summary of the table")
    count = write_rows_as(output, rows, table_format)
    write_rows_as(summary, summarised(), table_format)
    return count


def _in_csv(block: TableBlock) -> tuple[bytes, bytes, int, Summary]:
    """Return the header and the rows of some motions as CSV, their number, and their summary."""
    summary, counts = Summary(), list[int]()

    def counted() -> Iterator[Mapping[str, Sequence[Any]]]:
        for columns in summary.included(map(with_paper_columns, block.columns())):
            counts.append(len(columns["structure"]))
            yield columns

    header, *lines = [*block_lines(counted())] or [""]
    summary.keep()  # here, not by the process that joins them
    return header.encode(), "".join(lines).encode(), sum(counts), summary


def shipped_table_stage(
    records: Path, pulses: Path, response: Path, folder: Path, table_format: str = "csv"
) -> None:
    """Write what `rockframe table1` adds to its run: tables, and the comparison with the paper.

    These are ``table.csv`` and ``summary.csv`` as `table_stage` writes them, both also in the
    format; the list of inputs in the format, from the ``records.csv`` beside the records; and
    ``paper.csv``, which has no rows unless a record is one of the paper's.

    Parameters
    ----------
    records, pulses, response : Path
        Outputs of `ingest_stage`, `pulse_stage` and `respond_stage` for the same records.
    folder : Path
        Folder to write.
    table_format : str
        One of `rockframe.cells.TABLE_FORMATS`.

    Raises
    ------
    InputError
        If a file cannot be read, or a table cannot be written.
    ParameterError
        If the format needs packages that are missing.
    """
    rows = list(table_rows_of(records, pulses, response))
    left_out = left_out_reasons(attributes_of(response, RESPONSE))
    summary = summary_rows(rows, recordings_of(records), left_out)
    write_rows_as(folder / "table.csv", rows)
    write_rows_as(folder / "summary.csv", summary)
    compared = [row.values() for row in paper_comparisons(rows, pulse_rows(pulses))]
    with (
        whole_file(folder / "paper.csv") as partial,
        partial.open("w", newline="", encoding="utf-8") as stream,
    ):
        write_rows(stream, [COMPARED, *compared])
    if table_format == "csv":
        return
    ending = TABLE_FORMATS[table_format]
    copy_entries(records.with_suffix(".csv"), folder / f"records{ending}")
    if table_format == "xlsx":
        files = ((records, RECORDS), (pulses, PULSES), (response, RESPONSE))
        write_table_workbook(folder / "table.xlsx", rows, summary, *files)
        return
    for name, content in (("table", rows), ("summary", summary)):
        write_rows_as(folder / f"{name}{ending}", content, table_format)


def write_table_workbook(
    path: Path, rows: Sequence[Row], summary: Sequence[Row], *files: tuple[Path, str]
) -> None:
    """Write a workbook of a summary, its matrices, the rows, and the options of the files.

    Raises
    ------
    InputError
        If the workbook cannot be written.
    ParameterError
        If packages are missing, or the name does not end in ``.xlsx``.
    """
    tables = tables_of(rows, summary, "responses")
    write_tables(path, {**tables, "parameters": parameter_rows(*files)}, "responses", "xlsx")


def table_rows_of(
    records: Path | Dataset, pulses: Path | Dataset, response: Path | Dataset
) -> Iterator[Row]:
    """Return the rows of `table_rows`, with the paper's values for the paper's records."""
    return map(with_paper_facts, table_rows(records, pulses, response))


def index_stage(parts: Sequence[str | Path], output: str | Path) -> tuple[InputOutcome, ...]:
    """Write the index that opens the files of all batches of a stage as one file.

    Parameters
    ----------
    parts : sequence of str or Path
        Outputs of one stage with ``batch``, in the order of the batches.
    output : str or Path
        The netCDF file to write. Readers of this package, and xarray with the engine ``rockframe``,
        open it as the file of all records at once. The files of the batches, its shards, must stay
        where they are from it: move the folder that contains them all.

    Returns
    -------
    tuple of InputOutcome
        The rejected records.

    Raises
    ------
    InputError
        If a file cannot be read or belongs to another run, if a record is in two files or none is
        in any, or if the output cannot be written.
    ParameterError
        If there are no parts, or parts of a screening: `screen_stage` joins these.
    """
    output, files = Path(output), [Path(part) for part in parts]
    if not files:
        raise ParameterError("No batches named. Must be the outputs of at least one.")
    kind = kind_of(files[0])
    if any(variable.of_files == "all records" for variable in KINDS[kind].variables):
        must = f"State the files as shards of `{kind}_stage`."
        raise ParameterError(f"{files[0]}: an index alone lacks the results of all records. {must}")
    refuse_overwriting([output], files)
    left_out = write_index(files, output, kind)
    return tuple(InputOutcome(name, reason) for name, reason in left_out.items())


def fetch_stage(
    options: FetchOptions,
    folder: str | Path,
    *,
    progress: Callable[[str], None] | None = None,
) -> Fetched:
    """Fetch records into a folder for `ingest_stage`, with a `catalogue.csv` of the event.

    Parameters
    ----------
    options : FetchOptions
        The data to fetch.
    folder : str or Path
        A new or empty folder, or the folder of an earlier run of the same request.
    progress : callable, optional
        Called with the name of each requested file.

    Raises
    ------
    InputError
        If the folder contains other files, or cannot be written to.
    ServiceError
        If nothing was received, or a service does not reply or rejects a request.
    """
    from rockframe.fetch.run import fetch

    refuse_obstacles([Path(folder, CATALOGUE)])
    fetched = fetch(options, Path(folder), progress=progress)
    entries = [CatalogueEntry(**facts) for facts in fetched.facts()]
    write_catalogue(Path(folder, CATALOGUE), entries)
    return fetched
