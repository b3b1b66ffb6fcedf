"""Arguments that several commands share."""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from rockframe.cells import TABLE_FORMATS
from rockframe.cli.console import complain, show_rejections
from rockframe.cli.options import Once, chosen, file_to_write, path
from rockframe.errors import InputError
from rockframe.options.model import ExecutionOptions
from rockframe.provenance import scratch_folder
from rockframe.quantities import MATRICES

if TYPE_CHECKING:
    from rockframe.engines.engine import Engine
    from rockframe.stages.common import Batch


#: Which record files a command reads that has no options of reading them.
_WITHOUT_WORDS: Final = "`rockframe ingest` reads files that need units, a time step or a layout"
#: Title of the filters in help texts.
FILTERS: Final = "filters (records outside the range are listed as filtered out)"


def bundled() -> list[Path]:
    """Return the folder of the bundled records, which commands read if no file is named."""
    from rockframe.study.structures import bundled_records

    return [bundled_records()]


def add_structures(parser: argparse.ArgumentParser, *, one: bool = True) -> None:
    """Add ``--structures`` and, unless a model of options has it, ``--structure``."""
    parser.add_argument(
        "--structures",
        type=path,
        metavar="FILE",
        help="TOML file of [[structure]] tables with name, height_m, width_m, mass_ratio "
        "(default: the shipped structures)",
    )
    if one:
        parser.add_argument(
            "--structure", metavar="NAME", action=Once, help="only the structure of this name"
        )


def add_records(parser: argparse.ArgumentParser, *, ready: bool = True) -> None:
    """Add ``--records``; if `ready`, the records may have been read by ingest."""
    parser.add_argument(
        "--records",
        nargs="+",
        type=path,
        metavar="PATH",
        help=f"record files or folders{f', or one records.nc; {_WITHOUT_WORDS}' if ready else ''} "
        "(default: the bundled 2019 Ridgecrest records)",
    )


def add_motions(parser: argparse.ArgumentParser, *, flatfiles: bool = False) -> None:
    """Add what commands that choose among motions take: records, ``--output`` and ``--pulses``."""
    further = "; or a flatfile (CSV, Excel), which has spectra alone" if flatfiles else ""
    parser.add_argument(
        "records",
        type=path,
        nargs="+",
        help=f"output of `rockframe ingest`, or record files and folders; {_WITHOUT_WORDS}"
        f"{further}",
    )
    if flatfiles:
        add_output(
            parser, ".nc", ".csv", words="netCDF file to write; of a flatfile the list, .csv"
        )
    else:
        add_output(parser)
    parser.add_argument("--pulses", type=path, metavar="FILE", help="output of `rockframe pulse`")


def add_output(
    parser: argparse.ArgumentParser, *suffixes: str, words: str = "netCDF file to write"
) -> None:
    """Add ``--output`` of a stage, by default a netCDF file."""
    kind = file_to_write(*(suffixes or (".nc",)))
    parser.add_argument("--output", "-o", type=kind, required=True, help=words)


def add_format(
    parser: argparse.ArgumentParser,
    default: str | None = "csv",
    otherwise: str = "no table is written",
) -> None:
    """Add the option of the format of tables; `otherwise` says what happens without it."""
    parser.add_argument(
        "--format",
        choices=tuple(TABLE_FORMATS),
        default=default,
        help="format of the tables; xlsx is one workbook with named sheets; xlsx and parquet need "
        f"the extra `tables` (default: {default or otherwise})",
    )


def refuse_tables(
    options: argparse.Namespace, first: Mapping[str, Sequence[str]], main: str
) -> None:
    """Refuse to replace other files by the tables of ``--format``, which have these columns."""
    from rockframe.results.tables.entries import PARAMETERS, refuse_other_tables

    if options.format:
        columns = {**first, "parameters": PARAMETERS}
        refuse_other_tables(options.output, columns, main, options.format)


def write_tables(
    options: argparse.Namespace, tables: Mapping[str, Sequence[Mapping[str, Any]]], main: str
) -> list[str]:
    """Write the tables of ``--format`` beside the output, with its options; return their names."""
    from rockframe.results.stored import kind_of
    from rockframe.results.tables import entries

    if not options.format:
        return []
    parameters = entries.parameter_rows((options.output, kind_of(options.output)))
    named = {**tables, "parameters": parameters}
    return [
        str(table) for table in entries.write_tables(options.output, named, main, options.format)
    ]


def add_matrix(parser: argparse.ArgumentParser) -> None:
    """Add ``--matrix``."""
    parser.add_argument(
        "--matrix",
        choices=MATRICES,
        nargs="+",
        default=(),
        metavar="QUANTITY",
        help="print records by structures in one quantity, instead of a row for each pair: "
        f"{', '.join(MATRICES)}",
    )


def add_batch(parser: argparse.ArgumentParser) -> None:
    """Add ``--batch``."""
    parser.add_argument(
        "--batch",
        type=_batch,
        default=(1, 1),
        metavar="K/N",
        help="only the K-th of N batches of the records; `rockframe.index_stage` joins the files",
    )


def _batch(text: str) -> tuple[int, int]:
    number, _, count = text.partition("/")
    if not re.fullmatch(r"[0-9]{1,9}/[0-9]{1,9}", text):
        raise argparse.ArgumentTypeError(f"Invalid batch {text[:30]!r}. State K/N, such as 2/10")
    return int(number), int(count)


def chosen_batch(options: argparse.Namespace) -> Batch:
    """Return the stated batch of the records."""
    from rockframe.stages.common import Batch

    return Batch(*options.batch)


def chosen_structures(options: argparse.Namespace) -> Path:
    """Return the stated file of structures, or the shipped one."""
    from rockframe.study.structures import SHIPPED_STRUCTURES

    return options.structures or SHIPPED_STRUCTURES


def chosen_engine(options: argparse.Namespace, *, shares_folder: bool = True) -> Engine:
    """Return the stated engine, which computes tasks."""
    from rockframe.engines.choice import choose_engine

    execution = chosen(options, ExecutionOptions)
    return choose_engine(execution.workers, execution.scheduler, shares_folder=shares_folder)


@contextmanager
def records_file(
    given: Sequence[Path] | None, workers: int | None = None
) -> Iterator[tuple[Path, int]]:
    """Yield the stated records.nc, or a temporary one made from files, and the exit status.

    Files that need options, such as units, are rejected; the message names the command that has
    these options.
    """
    from rockframe.stages.ingest import ingest_stage

    given = given or bundled()
    if len(given) == 1 and given[0].suffix == ".nc":
        yield given[0], 0
        return
    with scratch_folder() as folder:
        file = folder / "records.nc"
        try:
            ingested = ingest_stage(given, file, workers=workers)
        except InputError as error:
            raise _pointing_to_ingest(error) from None
        status = show_rejections(ingested.rejections)
        if any(_OPTION.search(rejection.reason) for rejection in ingested.rejections):
            complain(_OF_INGEST)
        yield file, status


#: An option in the reason of a rejection, and where such options are.
_OPTION: Final = re.compile(r"(?<!\S)--[a-z]")
_OF_INGEST: Final = (
    "State such options to `rockframe ingest`, and give its records.nc to this command."
)


def _pointing_to_ingest(error: InputError) -> InputError:
    """Return the error; if its reason names options, with the command that has them."""
    if not _OPTION.search(error.reason):
        return error
    return InputError(error.path, f"{error.reason} {_OF_INGEST}", error.line)


def refuse_folder_of_records(options: argparse.Namespace) -> None:
    """Raise an error if the output folder contains records to read."""
    for source in options.records or []:
        home = source if source.is_dir() else source.parent
        if home.resolve() == options.output.resolve():
            raise InputError(options.output, "contains the records. Choose another folder.")
