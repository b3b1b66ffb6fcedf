"""Steps of a run, and the list of the steps of a study."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from rockframe.options.model import Options
from rockframe.provenance import MANIFEST
from rockframe.study.study import Study


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
    temporary : bool
        True if the outputs are removed when the step that reads them is done.
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
    >>> Step("pulse", "pulse", ("records.nc",), ("pulses.nc",)).key({})
    Traceback (most recent call last):
    KeyError: 'records.nc'
    """

    name: str
    stage: str
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    options: Mapping[str, Any] = field(default_factory=dict)
    batch: tuple[int, int] = (1, 1)
    temporary: bool = False
    may_reject: bool = True
    threads: int = 1
    workers: bool = False
    memory: int = 1000
    minutes: int = 60

    def key(self, known: Mapping[str, str], *others: str) -> str:
        """Return a hash of everything that the outputs depend on; locations of files do not matter.

        Parameters
        ----------
        known : mapping of str to str
            For each input, the key of the step that writes it, or the hash of the file.
        *others : str
            Hashes of the source code, of the versions of libraries, and of files outside the run.
        """
        options = _without_folders(self.options)
        parts = [self.stage, options, self.batch, [known[name] for name in self.inputs], others]
        return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()


def _without_folders(stated: Any) -> Any:
    """Return options with files outside the run reduced to their names."""
    if isinstance(stated, Mapping):
        return {key: _without_folders(value) for key, value in stated.items()}
    if isinstance(stated, list | tuple):
        return [_without_folders(value) for value in stated]
    return Path(stated).name if isinstance(stated, str) and Path(stated).is_absolute() else stated


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
#: The structures of the study, as the stages read them.
STRUCTURES: Final = "structures.toml"
#: The page of the run.
PAGE: Final = "report.html"
#: Largest number of batches: more would only add starts, and three stages stay below 500 jobs.
_MOST_BATCHES: Final = 150
#: Resources of a step that computes in a pool of its own.
_POOL: Final[Mapping[str, Any]] = {"threads": 8, "workers": True}
_LONG: Final[Mapping[str, Any]] = {**_POOL, "memory": 4000, "minutes": 720}


def steps_of(study: Study, files: int) -> list[Step]:
    """Return the steps of a study, each after the steps that it needs.

    Parameters
    ----------
    study : Study
        The study.
    files : int
        Number of record files of the study.
    """
    tables, steps = study.tables, list[Step]()
    if study.records:
        batches = min(_MOST_BATCHES, -(-files // tables.batches.records))
        needs = ("records.nc", STRUCTURES, *(["pulses.nc"] if tables.respond.pulses else []))
        respond = _json(tables.respond)
        del respond["pulses"]  # an input
        steps += [
            _ingest(study),
            *_in_batches("pulse", ("records.nc",), "pulses.nc", _json(tables.pulse), batches),
            *_in_batches("respond", needs, "response.nc", respond, batches),
        ]
    if tables.screen is not None:
        inputs, stated = ("records.nc", "pulses.nc", STRUCTURES), tables.screen
        outputs = ["screen.nc", "screen.csv", "scenarios.csv", "fragility.csv"]
        outputs += ["rates.csv"] if stated.hazard else []
        outputs += ["design.csv"] if stated.design else []
        options = _json(study.options("screen"))
        steps.append(Step("screen", "screen", inputs, tuple(outputs), options, **_LONG))
    if tables.spectrum is not None:
        options = _json(tables.spectrum)
        steps.append(Step("spectrum", "spectrum", (), ("spectrum.nc",), options, **_LONG))
    if tables.rocking_spectrum is not None:
        name, options = "rocking_spectrum", _json(tables.rocking_spectrum)
        steps.append(Step(name, name, ("records.nc",), (f"{name}.nc",), options, **_LONG))
    if tables.compare is not None:
        read, options = ("records.nc", STRUCTURES), _json(tables.compare)
        steps.append(Step("compare", "compare", read, ("compare.nc",), options, memory=2000))
    if study.records:
        made = ("records.nc", "pulses.nc", "response.nc")
        steps.append(Step("table", "table", made, ("table.csv",)))
    steps += _figures(study, steps)
    return [*steps, *_last(study, steps)]


def _json(options: Options) -> dict[str, Any]:
    return options.model_dump(mode="json")


def _ingest(study: Study) -> Step:
    read = _json(study.options("records"))
    options = {
        "paths": [str(path) for path in study.records],
        "records": {key: value for key, value in read.items() if key != "paths"},
        "filters": _json(study.tables.filters),
    }
    outputs = ("records.nc", "records.csv")
    return Step("ingest", "ingest", (INPUTS,), outputs, options, **_POOL, memory=4000)


def _in_batches(
    stage: str, inputs: tuple[str, ...], output: str, options: dict[str, Any], batches: int
) -> list[Step]:
    """Return the steps of a stage: one on all records, or batches followed by a merge."""
    if batches <= 1:
        return [Step(stage, stage, inputs, (output,), options, **_POOL, memory=2000)]
    parts = [f"batches/{output.removesuffix('.nc')}-{k:03d}.nc" for k in range(1, batches + 1)]
    steps = [
        Step(
            *(f"{stage}-{k:03d}", stage, inputs, (part,), options, (k, batches)),
            temporary=True,
            memory=2000,
        )
        for k, part in enumerate(parts, 1)
    ]
    name = f"merge-{stage}"
    return [*steps, Step(name, "merge", tuple(parts), (output,), memory=4000)]


def _figures(study: Study, steps: list[Step]) -> list[Step]:
    """Return the step that draws the results, if the study asks for figures."""
    most = study.tables.figures.most
    made = [name for step in steps for name in step.outputs]
    of_records = study.records and study.tables.respond.histories != "none"
    files = ["records.nc", "pulses.nc", "response.nc"] if of_records else []
    curves = ("screen.nc", "spectrum.nc", "rocking_spectrum.nc", "compare.nc")
    files += [name for name in curves if name in made]
    if not files or not most:
        return []
    return [Step("draw", "draw", tuple(files), ("figures/",), _json(study.tables.figures))]


def _last(study: Study, steps: list[Step]) -> list[Step]:
    """Return the last steps: manifest, report, verification."""
    kept = tuple(name for step in steps if not step.temporary for name in step.outputs)
    last = [Step("manifest", "manifest", kept, (MANIFEST,))]
    if study.records:
        options = _json(study.tables.report)
        last.append(Step("report", "report", (MANIFEST,), (PAGE,), options))
    made = tuple(name for step in last for name in step.outputs)
    return [*last, Step("verify", "verify", made, (), may_reject=False)]
