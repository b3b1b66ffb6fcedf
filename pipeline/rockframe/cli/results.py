"""Commands on results: table, export, report and verify."""

from __future__ import annotations

import argparse
import re
from pathlib import Path
from typing import Final

from rockframe.cells import TABLE_FORMATS
from rockframe.cli import arguments, console
from rockframe.cli.options import add_options, chosen, file_to_write, path
from rockframe.errors import InputError, ParameterError
from rockframe.options.model import ReportOptions
from rockframe.options.respond import ExportOptions


def add_table(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: three files of stages, and the table to write."""
    for stage, name in (("ingest", "records"), ("pulse", "pulses"), ("respond", "response")):
        parser.add_argument(name, type=path, help=f"output of `rockframe {stage}`")
    endings = tuple(TABLE_FORMATS.values())
    parser.add_argument(
        "--output", "-o", type=file_to_write(*endings), required=True, help="file to write"
    )
    arguments.add_format(parser, default=None, otherwise="by the ending of the file")


def run_table(options: argparse.Namespace) -> None:
    """Write the table and print its length."""
    from rockframe.stages.table import table_rows_of, table_stage

    files = (options.records, options.pulses, options.response)
    count = table_stage(*files, options.output, options.format or "")
    if options.json:
        rows = list(table_rows_of(*files))
        console.show_json({"rows": rows, "output": str(options.output)})
    else:
        print(f"{count} rows in {options.output}")


def add_export(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: a screening, the file to write, and what it contains."""
    parser.add_argument("screening", type=path, help="output of `rockframe screen`")
    parser.add_argument(
        "--output",
        "-o",
        type=file_to_write(".xml"),
        required=True,
        help="NRML file to write; the tables of oq-vmtk and Pelicun are written beside it",
    )
    add_options(parser, ExportOptions)


def run_export(options: argparse.Namespace) -> None:
    """Write the files, and print what they contain."""
    from rockframe.results.fragility_models import all_notes, export_fragility

    wanted = chosen(options, ExportOptions)
    model, paths = export_fragility(options.screening, options.output, wanted)
    files = {kind: str(path) for kind, path in paths.items()}
    notes = all_notes(model)
    if options.json:
        summary = {"imt": model.imt, "taxonomies": model.taxonomies, "limit_states": model.states}
        console.show_json({**summary, "notes": notes, "files": files})
        return
    for taxonomy, levels in zip(model.taxonomies, model.levels, strict=True):
        print(
            f"{taxonomy}: {model.imt} from {levels[0]:.3g} to {levels[-1]:.3g}, "
            f"{levels.size} levels; {', '.join(model.states)}"
        )
    for note in notes:
        print(f"{note}.")
    if "pelicun" not in paths:
        print(f"No table of Pelicun: it needs lognormal curves, and these are {model.curve}.")
    for file in files.values():
        print(file)


def add_report(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: the folder of a run, and the page to write."""
    parser.add_argument(
        "folder",
        nargs="+",
        type=path,
        metavar="PATH",
        help="folder of a run, written by `rockframe table1` or `rockframe run`; or the outputs of "
        "`rockframe ingest`, `pulse` and `respond`, and of `screen` and `compare`",
    )
    parser.add_argument(
        "--output",
        "-o",
        type=file_to_write(".html", ".pdf"),
        help="page to write (default: report.html in the folder, or beside the responses)",
    )
    parser.add_argument(
        "--client",
        action="store_true",
        help="write one or two pages for a client instead, made to print: client.html, and "
        "client.pdf where Chromium or WeasyPrint is present; --output may end in .pdf",
    )
    add_options(parser, ReportOptions)


def run_report(options: argparse.Namespace) -> None:
    """Verify the run, write the page, and print what it contains."""
    from rockframe.stages.report import files_as_run

    first: Path = options.folder[0]
    _refuse_letterhead(options)
    if len(options.folder) == 1 and first.suffix != ".nc":
        _write_pages(options, first, first)
        return
    with files_as_run(options.folder) as folder:
        _write_pages(options, folder, first.parent, verified=True)


#: Options of the report that only the client's page has.
_LETTERHEAD: Final = ("company", "project", "question", "logo")


def _refuse_letterhead(options: argparse.Namespace) -> None:
    """Raise an error if an option is stated that the page does not take."""
    for name in _LETTERHEAD:
        if not options.client and hasattr(options, name):
            raise ParameterError(f"--{name} has no effect without --client. State --client too.")
    if not options.client and options.output and options.output.suffix == ".pdf":
        raise ParameterError("Only the page of --client can be a .pdf. Name a file in .html.")


def _write_pages(
    options: argparse.Namespace, folder: Path, beside: Path, *, verified: bool = False
) -> None:
    """Write the report of a run, or its client's page, and print what was written."""
    from rockframe.stages.report import CLIENT_PAGE, PAGE, client_stage, report_stage

    wanted, output = chosen(options, ReportOptions), options.output
    if options.client:
        place = output or (None if folder == beside else beside / CLIENT_PAGE)
        files = client_stage(folder, place, wanted, verified=verified)
        if options.json:
            console.show_json({"output": str(files[0]), "files": [str(file) for file in files]})
        else:
            print(*files, sep="\n")
        return
    output = output or beside / PAGE
    counts = report_stage(folder, output, wanted, verified=verified)
    size = output.stat().st_size
    if options.json:
        console.show_json({"output": str(output), "bytes": size, **counts})
    else:
        total = counts["histories"] + counts["left_out"]
        print(f"{output}: {size / 1e6:.1f} MB, {counts['histories']} of {total} histories")


def add_verify(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: the folder of a run, and the sample to recompute."""
    parser.add_argument(
        "folder", nargs="?", type=path, help="folder of a run, which contains its manifest.json"
    )
    parser.add_argument(
        "--recompute",
        nargs="?",
        const="3",
        metavar="N",
        help="recompute results and compare numbers, to 1e-6 of the largest value of their "
        "variable: pulses and responses of about N records (default: 3), screenings and spectra in "
        "full, which takes as long as in the run",
    )


def run_verify(options: argparse.Namespace) -> int:
    """Verify the run and print the result. Return 0 only if there are no faults."""
    from rockframe.stages.report import strange_report, verify_run

    _find_folder(options)
    run = verify_run(options.folder)
    faults = [*run.faults, *strange_report(options.folder), *_plan_faults(options.folder)]
    repeated = _recomputed(options, faults)
    if options.json:
        console.show_json(
            {
                "files": run.files,
                "records": {name: len(content.records) for name, content in run.datasets.items()},
                "faults": faults,
                "computed_again": repeated,
                "same_source": run.same_source,
                "other_versions": dict(run.other_versions),
                "other_processor": run.other_processor,
                "whole": not faults,
            }
        )
    else:
        for name, content in run.datasets.items():
            both = f", {len(content.pairs)} motions in both directions" if content.pairs else ""
            print(f"{name}: {len(content.records)} records{both}")
        if not run.same_source:
            print("made by another version of the source code")
        if run.other_versions:
            others = ", ".join(f"{name} {number}" for name, number in run.other_versions.items())
            print(f"made with other versions of libraries: {others}")
        if run.other_processor:
            print(
                f"made on another kind of processor ({run.other_processor}): recomputed "
                "here, numbers may differ in their last digits"
            )
        for result in repeated:
            print(f"recomputed: {result}")
        if not faults:
            print(f"{options.folder}: complete; all {run.files} files match the manifest")
    for fault in faults:
        console.complain(f"fault: {fault}")
    return 1 if faults else 0


def _find_folder(options: argparse.Namespace) -> None:
    """Take the folder that ``--recompute FOLDER`` reads as the number of records."""
    if options.folder is None and options.recompute and not options.recompute.isdigit():
        options.folder, options.recompute = path(options.recompute), "3"  # --recompute FOLDER
    if options.folder is None:
        raise ParameterError("Folder of the run missing. Use rockframe verify FOLDER.")


def _plan_faults(folder: Path) -> list[str]:
    """Return the faults of the plan and of other internal files of the run."""
    from rockframe.runs.plan import KEPT
    from rockframe.runs.state import damaged, read_plan

    faults = [f"{path}: {fault}." for path, fault in damaged(folder, {}).items()]
    plan = folder / KEPT / "plan.json"
    if plan.is_file():
        try:
            read_plan(folder)
        except InputError as error:
            faults.append(str(error))
    elif plan.parent.is_dir():
        faults.append(f"{plan}: missing. Repeat the command that computed the run.")
    return faults


def _recomputed(options: argparse.Namespace, faults: list[str]) -> list[str]:
    """Recompute results if this is requested and all files are correct; append new faults."""
    if options.recompute is None:
        return []
    if not re.fullmatch("0*[1-9][0-9]{0,8}", options.recompute):
        message = f"Invalid --recompute {options.recompute}. Must be a whole number, at least 1."
        raise ParameterError(message)
    if faults:
        return []
    from rockframe.runs.performing import recompute  # imports all stages

    done, differences = recompute(options.folder, int(options.recompute))
    faults += differences
    return done
