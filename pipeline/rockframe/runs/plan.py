"""Steps of a run, and its plan: the inputs with their hashes, and the steps."""

from __future__ import annotations

import hashlib
import io
import json
import os
import re
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Final

from rockframe.cells import write_rows
from rockframe.errors import InputError, ParameterError
from rockframe.ingest import folder_names, is_catalogue, printable, read_catalogue
from rockframe.options import STAGES, STRUCTURES, Stage, loaded
from rockframe.options.model import BatchOptions, Options
from rockframe.provenance import (
    MANIFEST,
    is_sealed,
    package_versions,
    page_source_hash,
    read_json,
    refuse_obstacles,
    refuse_overwriting,
    sha256_of,
    source_code_hash,
)
from rockframe.study.structures import read_bridges
from rockframe.study.study import Study, structures_text
from rockframe.study.toml import line_of, read_limits, read_text


@dataclass(frozen=True)
class Step:
    """One stage of a run, on all records or on a batch of them.

    Parameters
    ----------
    name : str
        Name in tables and logs: ``respond-002``.
    stage : str
        The stage: ``respond``.
    inputs, outputs : tuple of str
        Files of the run that the step reads and writes; a name that ends in ``/`` is a folder.
    options : mapping of str to Any
        Options of the stage as JSON values; files outside the run have absolute paths.
    batch : (int, int)
        Number of the batch of records, and number of all batches.
    may_reject : bool
        True if the step may reject records without failing.
    threads : int
        Largest number of processes that the step uses.
    workers : bool
        True if the step computes in a process pool of its own.
    memory : int
        Memory that the step may need [MB].
    minutes : int
        Time that the step may take [min].

    Examples
    --------
    >>> Step("pulse", "pulse", ("records.nc",), ("pulses.nc",)).origin({}, {})
    Traceback (most recent call last):
    KeyError: 'records.nc'
    """

    name: str
    stage: str
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    options: Mapping[str, Any] = field(default_factory=dict)
    batch: tuple[int, int] = (1, 1)
    may_reject: bool = True
    threads: int = 1
    workers: bool = False
    memory: int = 1000
    minutes: int = 60

    def origin(self, keys: Mapping[str, str], outside: Mapping[str, str]) -> dict[str, Any]:
        """Return everything that the outputs depend on; locations of files do not matter.

        Parameters
        ----------
        keys : mapping of str to str
            For each input, the key of the step that writes it, or the hash of the file.
        outside : mapping of str to str
            Hashes of whatever else the step depends on, by what it is.
        """
        return {
            "code": source_code_hash(),
            "packages": package_versions(),
            "stage": self.stage,
            "options": _without_folders(self.options),
            "batch": list(self.batch),
            "inputs": {name: keys[name] for name in self.inputs},
            "outside": dict(outside),
        }


def key_of_step(origin: Mapping[str, Any]) -> str:
    """Return a hash of everything that a step depends on (`Step.origin`)."""
    return _digest(json.dumps(origin, sort_keys=True))


def _without_folders(options: Any) -> Any:
    """Return options with files outside the run reduced to their names."""
    if isinstance(options, Mapping):
        return {key: _without_folders(value) for key, value in options.items()}
    if isinstance(options, list | tuple):
        return [_without_folders(value) for value in options]
    is_file = isinstance(options, str) and Path(options).is_absolute()
    return Path(options).name if is_file else options


def waves(steps: Sequence[Step]) -> list[list[Step]]:
    """Return the steps in groups; a step needs only steps of earlier groups.

    Parameters
    ----------
    steps : sequence of Step
        The steps, each after the steps whose outputs it reads.

    Examples
    --------
    >>> first = Step("a", "a", (), ("x",))
    >>> second = Step("b", "b", ("x",), ("y",))
    >>> [[step.name for step in wave] for wave in waves([first, second])]
    [['a'], ['b']]
    """
    level: dict[str, int] = {}
    groups: list[list[Step]] = []
    for step in steps:
        depth = max((level[name] + 1 for name in step.inputs if name in level), default=0)
        level |= dict.fromkeys(step.outputs, depth)
        groups += [[] for _ in range(depth + 1 - len(groups))]
        groups[depth].append(step)
    return groups


#: The list of the record files with their hashes; written first, it makes the graph static.
INPUTS: Final = "inputs.csv"
#: Outputs of ingest, pulse and respond, from which tables and figures of records are made.
OF_RECORDS: Final = ("records.nc", "pulses.nc", "response.nc")
#: The page of the run.
PAGE: Final = "report.html"
#: Folder of the files of batches, which their index names.
SHARD_FOLDER: Final = "shards"
#: Largest number of batches of the default size: a scheduler gets some 160 jobs for each stage.
_MOST_BATCHES: Final = 150
#: Number of record files that are worth a step of ingest, and largest number of these steps: each
#: starts in a second and lists all files.
_FILES_OF_A_STEP: Final = 1000
_MOST_STEPS_OF_INGEST: Final = 32
#: End of the name of an input, if another one that is stated has the same name.
_NUMBERED: Final = re.compile(r" \(\d+\)$")
#: Folder of batches of records that were read again because of files in others.
_AGAIN: Final = f"{SHARD_FOLDER}/again/"
#: Largest memory of a batch [MB]; a stage may need more for the results of all records.
_MEMORY_OF_BATCH: Final = 2000
#: Processes of a step that computes in a pool of its own.
_THREADS: Final = 8


def steps_of(
    study: Study, files: int, then: Sequence[Step] | None = None, opened: int = 1
) -> list[Step]:
    """Return the steps of a study, each after the steps that it needs.

    Parameters
    ----------
    study : Study
        The study.
    files : int
        Number of record files of the study, with those in archives.
    then : sequence of Step, optional
        Steps in place of table, figures and page.
    opened : int
        Number of files with records that can be divided; an archive is one.
    """
    options_of_batches = study.tables.batches
    batches = -(-files // options_of_batches.records)
    if options_of_batches == BatchOptions():
        batches = min(_MOST_BATCHES, batches)
    table = study.tables.records
    if batches > 1 and table is not None and table.sequence:
        raise ParameterError(
            f"a sequence needs all {files} record files in one batch. State [batches] records of "
            f"{files} or more."
        )
    options = {name: study.options(name) for name in ("records", "filters", *STAGES)}
    parts = min(batches, opened // _FILES_OF_A_STEP, _MOST_STEPS_OF_INGEST)
    steps = _ingest(options, study.records, parts) if study.records else []
    for stage in STAGES.values():
        if options[stage.name] is not None and (study.records or not stage.of_records):
            steps += _steps(stage, _json(options[stage.name]), batches)
    if then is not None:
        return [*steps, *then, *_last(study, [*steps, *then], page=False)]
    if study.records:
        outputs = ("table.csv", "summary.csv")
        steps.append(Step("table", "table", OF_RECORDS, outputs, threads=_THREADS, workers=True))
    steps += _figures(study, steps)
    return [*steps, *_last(study, steps, page=bool(study.records))]


def _json(options: Options) -> dict[str, Any]:
    return options.model_dump(mode="json")


def _ingest(tables: Mapping[str, Any], records: Sequence[Path], batches: int) -> list[Step]:
    """Return the steps that read records: one, or batches followed by their index."""
    read = _json(tables["records"])
    options = {
        "paths": [str(path) for path in records],
        "records": {key: value for key, value in read.items() if key != "paths"},
        "filters": _json(tables["filters"]),
    }
    outputs = ("records.nc", "records.csv")
    whole = Step("ingest", "ingest", (INPUTS,), outputs, options, memory=4000)
    if batches <= 1 or tables["records"].azimuths:  # a rotation needs both records of a motion
        return [replace(whole, threads=_THREADS, workers=True)]
    shards = [f"{SHARD_FOLDER}/records-{k:03d}.nc" for k in range(1, batches + 1)]
    steps = [
        replace(whole, name=f"ingest-{k:03d}", outputs=(shard,), batch=(k, batches), memory=2000)
        for k, shard in enumerate(shards, 1)
    ]
    index = replace(
        whole, name="index-ingest", stage="index-ingest", threads=_THREADS, workers=True
    )
    return [*steps, replace(index, inputs=(INPUTS, *shards), outputs=(*outputs, _AGAIN))]


def _steps(stage: Stage, options: dict[str, Any], batches: int) -> list[Step]:
    """Return the steps of a stage: one on all records, or batches followed by their index."""
    inputs, outputs = (stage.files(names, options) for names in (stage.inputs, stage.outputs))
    # that a file is read is no option of the function
    files = set(map(stage.asked.get, stage.inputs))
    whole = Step(
        *(stage.name, stage.name, inputs, outputs),
        options={key: value for key, value in options.items() if key not in files},
        memory=stage.memory,
        minutes=stage.minutes,
    )
    if batches <= 1 or not stage.batches:
        return [replace(whole, threads=_THREADS, workers=True) if stage.engine else whole]
    shards = tuple(f"{SHARD_FOLDER}/{stage.kind}-{k:03d}.nc" for k in range(1, batches + 1))
    of_batch = {k: value for k, value in whole.options.items() if k not in stage.of_all_records}
    steps = [
        replace(
            replace(whole, name=f"{stage.name}-{k:03d}", outputs=(shard,)),
            options=of_batch,
            batch=(k, batches),
            memory=min(stage.memory, _MEMORY_OF_BATCH),
        )
        for k, shard in enumerate(shards, 1)
    ]
    name = f"index-{stage.name}"
    if not stage.of_all_records:
        return [*steps, Step(name, "index", shards, outputs)]
    read = (*inputs, *shards)
    return [*steps, replace(whole, name=name, inputs=read, threads=_THREADS, workers=True)]


def _figures(study: Study, steps: list[Step]) -> list[Step]:
    """Return the step that draws the results, if the study asks for figures."""
    most = study.tables.figures.most
    outputs = [name for step in steps for name in step.outputs]
    of_records = study.records and study.tables.respond.histories != "none"
    files = list(OF_RECORDS) if of_records else []
    files += [stage.file for stage in STAGES.values() if stage.figures and stage.file in outputs]
    if not files or not most:
        return []
    step = Step("draw", "draw", tuple(files), ("figures/",), _json(study.tables.figures))
    return [replace(step, threads=_THREADS, workers=True) if of_records else step]


def _last(study: Study, steps: Sequence[Step], *, page: bool) -> list[Step]:
    """Return the last steps: manifest, report, verification."""
    written = tuple(name for step in steps for name in step.outputs)
    last = [Step("manifest", "manifest", written, (MANIFEST,))]
    if page:
        options = _json(study.tables.report)
        last.append(Step("report", "report", (MANIFEST,), (PAGE,), options))
    outputs = tuple(name for step in last for name in step.outputs)
    verify = Step("verify", "verify", outputs, (), may_reject=False, threads=_THREADS, workers=True)
    return [*last, verify]


#: Hidden folder of a run for its internal files: plan, stamps, lock.
KEPT: Final = ".rockframe"
#: Suffixes of metadata files, which contain no records.
_BESIDE: Final = frozenset([".xml", ".json", ".quakeml", ".stationxml"])


@dataclass(frozen=True)
class Input:
    """A file that a study reads.

    Parameters
    ----------
    name : str
        Name in lists: the stated folder, followed by the path inside it.
    path : Path
        The file.
    sha256 : str
        Hash of the file when the run was planned.
    """

    name: str
    path: Path
    sha256: str


@dataclass(frozen=True)
class Plan:
    """The inputs, steps and files of a run.

    Parameters
    ----------
    study : str
        Name of the study.
    parameters : mapping
        The contents of the study file.
    inputs : tuple of Input
        Every file that the study reads.
    steps : tuple of Step
        The steps, each after the steps whose outputs it reads.
    origins : mapping of str to mapping
        Everything that a step depends on (`Step.origin`), by the name of the step.
    files : mapping of str to str
        Texts of the files that the plan itself writes into the folder, by name.
    source : str
        Hash of the package's source code that made the plan.
    study_files : tuple of Input
        The study file and its structures, whose contents are in `parameters` and `files`.
    of_command : bool
        True if the command of a shipped study changed its contents, which are in no file.
    """

    study: str
    parameters: Mapping[str, Any]
    inputs: tuple[Input, ...]
    steps: tuple[Step, ...]
    origins: Mapping[str, Mapping[str, Any]]
    files: Mapping[str, str]
    source: str
    study_files: tuple[Input, ...] = ()
    of_command: bool = False

    @cached_property
    def keys(self) -> Mapping[str, str]:
        """Hash of everything that a step depends on, by the name of the step."""
        return {name: key_of_step(origin) for name, origin in self.origins.items()}

    @property
    def outputs(self) -> list[str]:
        """Files and folders that the run writes."""
        return [*self.files, *(name for step in self.steps for name in step.outputs)]


def make_plan(study: Study, folder: Path, then: Sequence[Step] | None = None) -> Plan:
    """Return the plan of a study, without writing anything.

    Parameters
    ----------
    study : Study
        The study to plan.
    folder : Path
        The folder of the run.
    then : sequence of Step, optional
        Steps in place of table, figures and page.

    Raises
    ------
    InputError
        If the folder lies among the records, if an output would replace or contain an input, if a
        file cannot be read, or if a stage cannot compute what the study states.
    ParameterError
        If a stage cannot compute what the command of a shipped study states.
    """
    inputs = tuple(_inputs(study, folder))
    _validate_inputs(study)
    with_records = [file for file in inputs if _may_have_records(file)]
    # the hash of one file would stand for both
    are_named = not any(_NUMBERED.search(file.name) for file in inputs)
    opened = len(with_records) if are_named else 1
    steps = tuple(steps_of(study, _count(with_records), then, opened))
    files = {INPUTS: _listed(inputs)}
    if study.records:
        files[STRUCTURES] = structures_text(study)
    keys = {name: _digest(text) for name, text in files.items()}
    origins: dict[str, dict[str, Any]] = {}
    places = {str(file.path): place for place, file in enumerate(inputs)}
    for step in steps:
        read = _external_inputs(step, inputs, places)
        outside = {f"input {file.name}": file.sha256 for file in read}
        if step.stage == "manifest":
            outside = {"study": _digest(json.dumps(study.parameters(), sort_keys=True))}
        if step.stage == "report":
            outside = {"templates, style or scripts of the page": page_source_hash()}
        origins[step.name] = step.origin(keys, outside)
        keys |= dict.fromkeys(step.outputs, key_of_step(origins[step.name]))
    own = (study.path, study.structures)  # one file, if the study has structures of its own
    hashes = {path: sha256_of(path) for path in dict.fromkeys(own)}
    study_files = tuple(Input(path.name, path, hashes[path]) for path in own)
    plan = Plan(
        *(study.name, study.parameters(), inputs, steps, origins, files, source_code_hash()),
        study_files=study_files,
        of_command=study.home is not None,
    )
    _refuse_inputs(plan, study, folder)
    if not _is_planned(plan, folder):
        _foresee(study)
    return plan


def _is_planned(plan: Plan, folder: Path) -> bool:
    """Return True if the folder has the plan of these steps, which were possible then."""
    try:
        text = (folder / KEPT / "plan.json").read_bytes()
        return is_sealed(text) and read_json(text)["origins"] == plan.origins
    except (OSError, ValueError, KeyError, TypeError):
        return False


def _external_inputs(step: Step, inputs: Sequence[Input], places: Mapping[str, int]) -> list[Input]:
    """Return the files outside the run that a step reads; `places` has them by path."""
    if step.stage in ("ingest", "index-ingest"):  # of batches, the index stands for all
        return list(inputs) if step.batch == (1, 1) else []
    values = {value for value in step.options.values() if isinstance(value, str)}
    return [
        inputs[place] for place in sorted(places[location] for location in values & places.keys())
    ]


def _refuse_inputs(plan: Plan, study: Study, folder: Path) -> None:
    """Refuse to overwrite an input, even with ``--replace``."""
    read = [*(file.path for file in plan.inputs), study.path, study.structures]
    folders = sorted(name for name in plan.outputs if name.endswith("/"))
    refuse_obstacles(folder / name / "figures.csv" for name in folders)
    refuse_overwriting((folder / name for name in sorted({*plan.outputs} - {*folders})), read)
    for name in folders:
        for path in read:
            if path.resolve().is_relative_to((folder / name).resolve()):
                raise InputError(path, f"lies in {name} of the run. Move it elsewhere.")


def _validate_inputs(study: Study) -> None:
    """Validate inputs that stages would reject only after hours, or after removing an older run."""
    files = study.files()
    if ("records", "limits") in files:
        read_limits(files["records", "limits"])
    if ("records", "catalogue") in files:
        columns = getattr(study.tables.records, "catalogue_columns", None) or ()
        read_catalogue(files["records", "catalogue"], columns=columns)
    if ("records", "selection") in files:
        from rockframe.stages.select import read_selection  # it imports scipy too

        read_selection(files["records", "selection"])
    if ("screen", "hazard") in files:
        from rockframe.stages.screen import stated_hazard  # scipy is slow, and only needed here

        path, screen = files["screen", "hazard"], study.options("screen")
        measure = stated_hazard(path, screen).measure
        if screen.azimuths_degree and measure in ("a_p", "L_p"):
            unknown = f"is for {measure}, which is unknown for rotated motions"
            raise InputError(path, f"{unknown}. Must be of PGA or PGV.")


def _foresee(study: Study) -> None:
    """Raise the errors of later stages that follow from options and structures alone."""
    entries = study.tables.structure or read_bridges(study.structures)[0]
    for stage in STAGES.values():
        options = study.options(stage.name)
        if stage.foreseen and options is not None and (study.records or not stage.of_records):
            try:
                loaded(stage.foreseen)(options, entries)
            except ParameterError as error:
                if study.home is not None:  # the option is no line of the file
                    raise
                line = line_of(read_text(study.path), (stage.name,))
                raise InputError(study.path, f"[{stage.name}]: {error}", line) from None


def _inputs(study: Study, folder: Path) -> Iterator[Input]:
    """Yield every input file once, under a unique name."""
    names: set[str] = set()
    paths: set[Path] = set()
    for name, path in _named(study, folder):
        if path in paths:
            continue
        called, number = printable(name), 1
        while called in names:
            number += 1
            called = f"{printable(name)} ({number})"
        names.add(called)
        paths.add(path)
        yield Input(called, path, sha256_of(path))


def _named(study: Study, folder: Path) -> Iterator[tuple[str, Path]]:
    for source, called in zip(study.records, folder_names(study.records), strict=True):
        if source.is_dir():
            if folder.resolve().is_relative_to(source.resolve()):
                raise InputError(folder, "lies among the records. Choose another folder.")
            yield from _files_within(source, called)
        else:
            yield source.name, source
            metadata = sorted(source.parent.glob("*.xml"))  # of a miniSEED file
            yield from ((path.name, path) for path in metadata if path.is_file())
    for where, path in study.files().items():
        if where == ("screen", "hazard"):
            from rockframe.risk import hazard_file

            path = hazard_file(path, study.options("screen").hazard_curve)
        if where != ("structures",):
            yield path.name, path


def _files_within(folder: Path, called: str) -> Iterator[tuple[str, Path]]:
    """Yield every file in a folder and its subfolders that is readable and not hidden; sorted."""
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder)
        if not any(part.startswith(".") for part in name.parts) and _is_readable(path):
            yield f"{called}/{name.as_posix()}", path


def _is_readable(path: Path) -> bool:
    try:
        return path.is_file() and os.access(path, os.R_OK)
    except OSError:  # folder not readable: the list of records has a row for it
        return False


def _may_have_records(file: Input) -> bool:
    """Return False for a file beside records: metadata, or a catalogue."""
    return file.path.suffix.lower() not in _BESIDE and not is_catalogue(file.path)


def _count(files: Sequence[Input]) -> int:
    """Return the approximate number of records, which limits the number of batches."""
    return max(1, sum(_count_archived(file.path) for file in files))


def _count_archived(path: Path) -> int:
    """Return the number of files in an archive; 1 for other files and corrupted archives."""
    try:
        if zipfile.is_zipfile(path):
            with zipfile.ZipFile(path) as archive:
                return len(archive.infolist())
    except (OSError, ValueError, NotImplementedError, zipfile.BadZipFile):
        pass
    return 1


def _listed(inputs: tuple[Input, ...]) -> str:
    stream = io.StringIO()
    rows = ([i.name, i.path.stat().st_size, i.sha256] for i in inputs)
    write_rows(stream, [["file", "bytes", "sha256"], *rows])
    return stream.getvalue()


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
