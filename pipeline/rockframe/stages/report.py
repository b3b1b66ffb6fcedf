"""Verify a run, and write its page."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any, Final

from rockframe.errors import InputError, ParameterError
from rockframe.options import RECORDS_FILE, STAGES
from rockframe.options.model import ReportOptions
from rockframe.provenance import (
    MANIFEST,
    is_whole_page,
    package_versions,
    processor,
    read_manifest,
    refuse_obstacles,
    refuse_overwriting,
    scratch_folder,
    sealed_page,
    sha256_of,
    source_code_hash,
    whole_file,
    write_manifest,
)
from rockframe.results.contents import Described, describe
from rockframe.results.schema import KINDS, SCREEN
from rockframe.results.shards import copy_file
from rockframe.results.stored import attributes_of, kind_of, require_all_records, require_file
from rockframe.results.tables.entries import count_values, rows_of

#: Files of a run with datasets, in the order of the stages.
_DATASETS: Final = {f"{kind}.nc": kind for kind in KINDS}
_STAGE_OF: Final = {stage.file: stage for stage in STAGES.values()}
#: Those that state a result or a reason for each record. Motions of a screening may be rotated.
_OF_EACH_RECORD: Final = [
    stage.file for stage in STAGES.values() if stage.of_records and stage.kind != SCREEN
]
#: Files of a run from which other files are computed.
_MADE_FROM: Final = tuple(dict.fromkeys(name for stage in STAGES.values() for name in stage.inputs))


@dataclass(frozen=True)
class Verification:
    """Result of the verification of a run.

    Parameters
    ----------
    files : int
        Number of files hashed.
    datasets : mapping of str to Described
        Contents of each valid netCDF file.
    faults : tuple of str
        All problems found, one line each; empty if the run is complete and unchanged.
    same_source : bool
        True if the run was computed with this source code.
    other_versions : mapping of str to str
        Versions of libraries in the run, if another version is installed here.
    other_processor : str
        Kind of processor of the run, if it differs from this one; otherwise empty. The same source
        code, libraries and kind of processor repeat a run to the last bit.
    """

    files: int
    datasets: Mapping[str, Described]
    faults: tuple[str, ...]
    same_source: bool
    other_versions: Mapping[str, str]
    other_processor: str


def verify_run(folder: str | Path, *, workers: int | None = None) -> Verification:
    """Compare the files of a run with its manifest, and its datasets with each other.

    Parameters
    ----------
    folder : str or Path
        The folder of a run, with its ``manifest.json``.
    workers : int, optional
        Largest number of processes that read the shards of a large run; by default one for each
        core.

    Returns
    -------
    Verification
        The result; nothing is changed.

    Raises
    ------
    InputError
        If the folder or a readable manifest is missing, because no run was completed there.
    """
    folder = Path(folder)
    manifest = read_manifest(folder)
    outputs: dict[str, str] = manifest["outputs"]
    changed = dict(_changed(folder, outputs))
    faults = list(changed.values())
    datasets: dict[str, Described] = {}
    for name, kind in _DATASETS.items():
        if name not in outputs or name in changed:
            continue
        try:
            datasets[name] = describe(folder / name, kind, workers)
        except InputError as error:
            faults.append(str(error))
    faults += _files_of_other_runs(folder, manifest, datasets)
    faults += _lost_records(folder, datasets)
    faults += _miscounted_tables(folder, datasets, set(outputs) - set(changed))
    faults += [
        f"{path}: left by an interrupted run. Remove it."
        for path in sorted(folder.rglob(".*partial*"))
    ]
    same = manifest["source_code_hash"] == source_code_hash()
    made_on, here = str(manifest.get("processor", "")), processor()
    return Verification(
        *(len(outputs), datasets, tuple(faults), same, _other_versions(manifest)),
        other_processor="" if made_on == here else made_on,
    )


def _other_versions(manifest: Mapping[str, Any]) -> dict[str, str]:
    here, then = package_versions(), manifest["versions"]
    return {
        name: str(version) for name, version in then.items() if here.get(name, version) != version
    }


def _changed(folder: Path, outputs: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    """Yield the names of files that differ from the manifest, and a message for each."""
    for name, output in outputs.items():
        path = folder / name
        if not path.is_file():
            yield name, f"{path}: missing, although the manifest lists it."
        elif (digest := sha256_of(path)) != output:
            hashes = f"SHA-256 {digest[:12]}…, the manifest says {str(output)[:12]}…"
            yield name, f"{path}: {hashes}. Must be equal."


def _miscounted_tables(
    folder: Path, datasets: Mapping[str, Described], sound: Collection[str]
) -> Iterator[str]:
    """Yield a message for each table whose rows do not match the datasets."""
    records = datasets.get("records.nc")
    if records is not None and "records.csv" in sound:
        entries = rows_of(folder / "records.csv")
        listed = [row["record_id"] for row in entries if row["status"] == "accepted"]
        if sorted(listed) != sorted(records.records):
            yield (
                f"{folder / 'records.csv'}: {len(listed)} accepted, {len(records.records)} in "
                "records.nc. Must be the same records."
            )
    response = datasets.get("response.nc")
    if response is not None and "table.csv" in sound:
        rows = count_values(folder / "table.csv", "record_id")
        motions = (*response.records, *response.pairs)
        count, answered = sum(rows.values()), len(motions) * response.structures
        if count != answered:
            yield f"{folder / 'table.csv'}: {count} rows, {answered} responses. Must be equal."
        elif rows != dict.fromkeys(motions, response.structures):
            yield f"{folder / 'table.csv'}: other records than response.nc. Must be the same."


def _files_of_other_runs(
    folder: Path, manifest: Mapping[str, Any], datasets: Mapping[str, Described]
) -> Iterator[str]:
    """Yield a message for each file that was computed from files of another run."""
    own_hashes = {**manifest["inputs"], **manifest["outputs"]}
    hashes = {str(sha256) for sha256 in manifest["inputs"].values()}
    for name, held in datasets.items():
        for shard, sha256 in held.shards.items():
            if manifest["outputs"].get(shard) != sha256:
                yield f"{folder / name}: is the index of another {shard}. Must be of the same run."
        if name == "records.nc":
            strange = next((k for k, v in held.inputs.items() if v not in hashes), "")
            if strange:
                yield (
                    f"{folder / name}: was made from a {strange!r} that the manifest does not "
                    "list. Must be of the same run."
                )
            continue
        for source in _MADE_FROM:
            needed = source == RECORDS_FILE and _STAGE_OF[name].of_records
            hash_of_source = held.inputs.get(source)
            if (needed or hash_of_source is not None) and hash_of_source != own_hashes.get(source):
                yield f"{folder / name}: was made from another {source}. Must be of the same run."


def _lost_records(folder: Path, datasets: Mapping[str, Described]) -> Iterator[str]:
    """Yield a message for each record that is missing in records.nc or in a later file."""
    if "records.nc" not in datasets:
        return
    names, horizontal = set(datasets["records.nc"].records), datasets["records.nc"].horizontal
    for name in _OF_EACH_RECORD:
        if name not in datasets:
            continue
        held = datasets[name].records
        both = chain(*datasets[name].pairs.values())
        strange = [record for record in (*held, *both) if record not in names]
        if strange:
            yield (
                f"{folder / name}: holds {strange[0]!r}, which is not in records.nc. "
                "Must be of the same run."
            )
        listed = {*held, *datasets[name].left_out}
        asked = [datasets[name].only] if datasets[name].only else horizontal
        lost = [record for record in asked if record not in listed]
        if lost:
            yield (
                f"{folder / name}: neither contains {lost[0]!r} of records.nc nor states a reason. "
                "Must do one of them."
            )


#: File name of the page, in the folder of its run.
PAGE: Final = "report.html"
#: Size of a page above which it has fewer histories [bytes].
_MOST_BYTES: Final = 20_000_000


def report_stage(
    folder: Path,
    output: Path | None = None,
    options: ReportOptions | None = None,
    *,
    verified: bool = False,
) -> dict[str, int]:
    """Write one HTML page about a run: ``report.html``.

    Parameters
    ----------
    folder : Path
        The folder of the run.
    output : Path, optional
        The page to write; by default in the folder.
    options : ReportOptions, optional
        Number of rows and histories on the page.
    verified : bool
        Do not verify the run first. A step of a run does not, because the last step does.

    Returns
    -------
    dict of str to int
        Numbers of ``histories`` on the page, of histories ``left_out``, and of ``rows``.

    Raises
    ------
    InputError
        If the run is incomplete or changed, or the page cannot be written.
    """
    from rockframe.report.comparison import comparison_content  # verify imports none of these
    from rockframe.report.page import choose, render
    from rockframe.results.pulses import recordings_of
    from rockframe.results.response import comparison_rows
    from rockframe.results.run import read_histories, read_run
    from rockframe.results.screen import read_screening
    from rockframe.results.stored import attributes_of
    from rockframe.results.tables.notes import comparison_note, left_out_reasons
    from rockframe.results.tables.sentences import members_of

    limits, output = options or ReportOptions(), output or folder / PAGE
    refuse_obstacles([output])
    for fault in () if verified else verify_run(folder).faults:
        raise InputError(folder, f"is not a complete run: {fault}")
    content = read_run(folder, most=limits.rows)
    outputs = [folder / name for name in content.manifest["outputs"]]
    refuse_overwriting([output], [folder / MANIFEST, *outputs])
    shown = choose(content, limits.histories)
    screened = folder / "screen.nc"
    screening = read_screening(screened, every_scale=False) if screened in outputs else None
    compared = folder / "compare.nc"
    comparison = None
    if compared in outputs:
        recordings = recordings_of(folder / RECORDS_FILE)
        attributes = attributes_of(compared, "compare")
        beside = (limits.rows, left_out_reasons(attributes), comparison_note(attributes))
        comparison = comparison_content(comparison_rows(compared), recordings, *beside)
    parameters = json.loads(attributes_of(folder / "response.nc", "response")["parameters"])
    others = (screening, comparison, members_of(parameters))
    page = sealed_page(render(content, read_histories(folder, shown), *others))
    while len(page) > _MOST_BYTES and shown:  # histories are the part that can be any size
        shown = choose(content, len(shown) * _MOST_BYTES // len(page))
        page = sealed_page(render(content, read_histories(folder, shown), *others))
    with whole_file(output) as partial:
        partial.write_bytes(page)
    total = sum(content.counts.values())
    return {"histories": len(shown), "left_out": total - len(shown), "rows": len(content.rows)}


#: File name of the client's page, in the folder of its run.
CLIENT_PAGE: Final = "client.html"
#: Programs that print a page, in the order in which they are tried.
_BROWSERS: Final = ("chromium", "chromium-browser", "google-chrome", "chrome")
#: Time after which a program that prints a page is stopped [s].
_PATIENCE: Final = 120


def client_stage(
    folder: Path,
    output: Path | None = None,
    options: ReportOptions | None = None,
    *,
    verified: bool = False,
) -> list[Path]:
    """Write the client's page of a run: HTML made to print, and PDF where a program can print it.

    Parameters
    ----------
    folder : Path
        The folder of the run.
    output : Path, optional
        The page, ``.html`` or ``.pdf``; by default ``client.html`` in the folder, with a PDF
        where Chromium or WeasyPrint is present.
    options : ReportOptions, optional
        Company, project, question and logo; those that are not stated are those of the study.
    verified : bool
        Do not verify the run first.

    Returns
    -------
    list of Path
        The files that were written.

    Raises
    ------
    InputError
        If the run is incomplete or changed, a file cannot be read or written, or a PDF is asked for
        and no program can print it.
    """
    from rockframe.report.client import Letterhead, client_page
    from rockframe.results.run import read_run
    from rockframe.results.screen import read_screening
    from rockframe.results.stored import attributes_of
    from rockframe.results.tables.sentences import members_of

    page = output or folder / CLIENT_PAGE
    refuse_obstacles([page])
    for fault in () if verified else verify_run(folder).faults:
        raise InputError(folder, f"is not a complete run: {fault}")
    content = read_run(folder)
    refuse_overwriting([page], [folder / name for name in content.manifest["outputs"]])
    study = content.manifest["parameters"].get("study") or content.manifest["parameters"]
    given = options.model_dump(exclude_unset=True) if options else {}
    wanted = ReportOptions(**{**(study.get("report") or {}), **given})
    screened = folder / "screen.nc"
    is_of_run = screened.name in content.manifest["outputs"]
    screening = read_screening(screened, every_scale=False) if is_of_run else None
    parameters = json.loads(attributes_of(folder / "response.nc", "response")["parameters"])
    letterhead = Letterhead(wanted.company, wanted.project, wanted.question, wanted.logo)
    text = client_page(content, letterhead, members_of(parameters), screening)
    if page.suffix == ".pdf":
        _print_page(text, page)
        return [page]
    with whole_file(page) as partial:
        partial.write_text(text, encoding="utf-8")
    if output is not None:
        return [page]
    with suppress(InputError):  # no program can print it: the page is there to be printed by hand
        _print_page(text, page.with_suffix(".pdf"))
        return [page, page.with_suffix(".pdf")]
    return [page]


def _print_page(text: str, output: Path) -> None:
    """Print a page as PDF with Chromium, or with WeasyPrint.

    Raises
    ------
    InputError
        If neither is present, or the program fails.
    """
    browser = next(filter(None, map(shutil.which, _BROWSERS)), None)
    if browser is None:
        _print_without_browser(text, output)
        return
    with scratch_folder() as folder:
        page, printed = folder / "page.html", folder / "page.pdf"
        page.write_text(text, encoding="utf-8")
        words = [browser, "--headless", "--disable-gpu", "--no-pdf-header-footer", "--no-first-run"]
        words += [f"--user-data-dir={folder / 'profile'}", f"--print-to-pdf={printed}"]
        if getattr(os, "geteuid", lambda: 1)() == 0:
            words.append("--no-sandbox")  # Chromium has none for the superuser
        with suppress(subprocess.TimeoutExpired, OSError):
            subprocess.run(
                [*words, page.as_uri()], capture_output=True, check=False, timeout=_PATIENCE
            )
        if not printed.is_file():
            raise InputError(output, f"cannot be printed: {browser} failed. Write .html instead.")
        with whole_file(output) as partial:
            shutil.copyfile(printed, partial)


def _print_without_browser(text: str, output: Path) -> None:
    try:
        from weasyprint import HTML
    except (ImportError, OSError):  # OSError: a library of the system is missing
        raise InputError(
            output,
            "cannot be printed: neither Chromium nor WeasyPrint is present. Write .html, and print "
            "it from a browser.",
        ) from None
    with whole_file(output) as partial:
        HTML(string=text).write_pdf(partial)


#: Files that a page without a run needs, and those that it shows too if they are named.
_OF_PAGE: Final = ("records", "pulses", "response")
_BESIDE_PAGE: Final = ("screen", "compare")


@contextmanager
def files_as_run(files: Sequence[Path]) -> Iterator[Path]:
    """Yield a temporary folder like that of a run, made of the outputs of single stages.

    Parameters
    ----------
    files : sequence of Path
        Outputs of `ingest_stage`, `pulse_stage` and `respond_stage`, in any order, and if present
        of `screen_stage` and `compare_stage`. ``records.csv`` must lie beside ``records.nc``.

    Raises
    ------
    InputError
        If a kind of file is missing or named twice, or the files are not of the same records.

    Examples
    --------
    >>> with files_as_run([]):  # doctest: +ELLIPSIS
    ...     pass
    Traceback (most recent call last):
    rockframe.errors.ParameterError: No records file named. Name the outputs of ...
    """
    from rockframe.stages.table import table_stage

    of_kind: dict[str, Path] = {}
    for path in files:
        kind = kind_of(path)
        if kind in of_kind or kind not in (*_OF_PAGE, *_BESIDE_PAGE):
            of = f"is a second {kind} file" if kind in of_kind else f"is a {kind} file"
            allowed = ", ".join((*_OF_PAGE, *_BESIDE_PAGE))
            raise InputError(path, f"{of}. A page shows one file of each of: {allowed}.")
        require_all_records(path, kind, attributes_of(path, kind))
        of_kind[kind] = path
    for kind in _OF_PAGE:
        if kind not in of_kind:
            raise ParameterError(
                f"No {kind} file named. Name the outputs of `rockframe ingest`, `pulse` and "
                "`respond`, or the folder of a run."
            )
    entries = of_kind["records"].with_suffix(".csv")
    require_file(entries, "the table that `rockframe ingest` writes beside its output")
    with scratch_folder() as folder:
        for kind, path in of_kind.items():
            copy_file(path, folder / f"{kind}.nc")
        shutil.copyfile(entries, folder / "records.csv")
        records, pulses, response = (of_kind[kind] for kind in _OF_PAGE)
        table_stage(records, pulses, response, folder / "table.csv")
        write_manifest(
            folder,
            inputs={path.name: sha256_of(path) for path in of_kind.values()},
            parameters={"study": {"name": of_kind["response"].stem}},
            outputs=sorted(path for path in folder.rglob("*") if path.is_file()),
        )
        yield folder


def require_whole(folder: Path, workers: int | None = None) -> None:
    """Raise an error if a run is incomplete or changed.

    A page that is no step of the run, but was written by `rockframe report`, does not matter. The
    parameters are those of `verify_run`.

    Raises
    ------
    InputError
        If the run has a fault; the message states the first one.
    """
    faults = verify_run(folder, workers=workers).faults
    for fault in (*faults, *(strange_report(folder) if _has_page(folder) else ())):
        raise InputError(folder, f"is not a complete run: {fault}")


def strange_report(folder: Path) -> Sequence[str]:
    """Return the reasons why the page in a folder does not belong to its run; empty if none."""
    page = folder / PAGE
    if not page.is_file():
        missing = f"{page}: missing. Write it with `rockframe report {folder}`."
        return [missing] if _has_page(folder) else []
    again = f"Write it again with `rockframe report {folder}`."
    if not is_whole_page(page.read_bytes()):
        return [f"{page}: is corrupted. {again}"]
    return [f"{page}: shows another run. {again}"] if shows_another_run(folder) else []


def shows_another_run(folder: Path) -> bool:
    """Return True if the page in a folder is intact, but not of the run there."""
    content = (folder / PAGE).read_bytes()
    return is_whole_page(content) and sha256_of(folder / MANIFEST).encode() not in content


def _has_page(folder: Path) -> bool:
    """Return True if the page is a step of the run in a folder."""
    return "report" in json.loads((folder / MANIFEST).read_text(encoding="utf-8")).get("steps", {})
