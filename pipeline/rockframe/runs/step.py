"""A step of a run: a command as a person types it, what it reads and what it writes."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Step:
    """One command of a run.

    Parameters
    ----------
    name : str
        What tables and logs call it: ``respond-002``.
    rule : str
        What it is one of: ``respond``.
    command : tuple of str
        Words behind ``rockframe``, typed in the folder of the run: files of the run are relative
        to it, others absolute.
    inputs, outputs : tuple of str
        Files of the run that it reads and writes; a name that ends in ``/`` is a folder.
    temporary : bool
        Its outputs go when the step that reads them is done.
    may_reject : bool
        Exit status 1 means that records were rejected; else that it failed.
    threads : int
        Most processes that it uses.
    workers : bool
        Its command takes ``--workers``: it computes in a pool of its own.
    memory : int
        What it may need [MB].
    minutes : int
        What it may take [min].

    Examples
    --------
    >>> Step("pulse", "pulse", ("pulse", "records.nc"), ("records.nc",), ("pulses.nc",)).key({})
    Traceback (most recent call last):
    KeyError: 'records.nc'
    """

    name: str
    rule: str
    command: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    temporary: bool = False
    may_reject: bool = True
    threads: int = 1
    workers: bool = False
    memory: int = 1000
    minutes: int = 60

    def key(self, known: Mapping[str, str], *further: str) -> str:
        """Return what stands for all that its outputs depend on, wherever the files are.

        Parameters
        ----------
        known : mapping of str to str
            Of each of its inputs the key of the step that writes it, or the hash of the file.
        *further : str
            Hashes of the source code, of the versions of libraries, and of files that are no
            part of the run.
        """
        words = [Path(word).name if Path(word).is_absolute() else word for word in self.command]
        parts = [words, [known[name] for name in self.inputs], list(further)]
        return hashlib.sha256(json.dumps(parts).encode()).hexdigest()

    def words(self, folder: Path) -> list[str]:
        """Return the command with the files of the run where they are."""
        own = {*self.inputs, *self.outputs, "."}
        return [str(folder / word) if word in own else word for word in self.command]


def waves(steps: Sequence[Step]) -> list[list[Step]]:
    """Return the steps in groups: each needs only those of earlier groups.

    Parameters
    ----------
    steps : sequence of Step
        Each behind those whose outputs it reads.

    Examples
    --------
    >>> first = Step("a", "a", (), (), ("x",))
    >>> second = Step("b", "b", (), ("x",), ("y",))
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
