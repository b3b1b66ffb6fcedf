"""A step of a run: a stage with its options, the files that it reads, and those that it writes."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Step:
    """One stage of a run, on all records or on a batch of them.

    Parameters
    ----------
    name : str
        Its name in tables and logs: ``respond-002``.
    stage : str
        The stage: ``respond``.
    inputs, outputs : tuple of str
        Files of the run that it reads and writes; a name that ends in ``/`` is a folder.
    options : mapping of str to Any
        Options of the stage, as JSON has them; files outside the run have absolute paths.
    batch : (int, int)
        Number of its batch of the records, and of all batches.
    temporary : bool
        Its outputs are removed when the step that reads them is done.
    may_reject : bool
        Whether it may reject records without having failed.
    threads : int
        Largest number of processes that it uses.
    workers : bool
        Whether it computes in a pool of its own.
    memory : int
        Memory that it may need [MB].
    minutes : int
        Time that it may take [min].

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
        """Return a hash of all that its outputs depend on, wherever the files are.

        Parameters
        ----------
        known : mapping of str to str
            For each of its inputs the key of the step that writes it, or the hash of the file.
        *others : str
            Hashes of the source code, of the versions of libraries, and of files outside the run.
        """
        options = _without_folders(self.options)
        parts = [self.stage, options, self.batch, [known[name] for name in self.inputs], others]
        return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()


def _without_folders(stated: Any) -> Any:
    """Return options in which files outside the run have their names alone."""
    if isinstance(stated, Mapping):
        return {key: _without_folders(value) for key, value in stated.items()}
    if isinstance(stated, list | tuple):
        return [_without_folders(value) for value in stated]
    return Path(stated).name if isinstance(stated, str) and Path(stated).is_absolute() else stated


def waves(steps: Sequence[Step]) -> list[list[Step]]:
    """Return the steps in groups: each needs only those of earlier groups.

    Parameters
    ----------
    steps : sequence of Step
        Each after those whose outputs it reads.

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
