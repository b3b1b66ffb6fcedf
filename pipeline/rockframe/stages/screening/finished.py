"""The results of finished tasks of a screening, from which the same command can resume."""

from __future__ import annotations

import re
import shutil
import zipfile
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from rockframe.engines.engine import Engine, map_tasks
from rockframe.errors import InputError
from rockframe.provenance import key_of, whole_file

Task = TypeVar("Task")
Arrays = dict[str, NDArray[Any]]

_KEY_LENGTH: Final = 16


class FinishedTasks:
    """Results of tasks for one set of inputs and options, in a hidden folder beside an output.

    Parameters
    ----------
    output : Path
        File that is made of the results.
    origin : mapping
        Inputs and options that the results depend on, as JSON values.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     finished = FinishedTasks(Path(folder, "screen.nc"), {"scales": [1.0]})
    ...     finished.keep("peaks-1", {"theta": np.array([0.5])})
    ...     finished.kept("peaks-1"), finished.kept("peaks-2")
    ({'theta': array([0.5])}, None)
    """

    def __init__(self, output: Path, origin: Mapping[str, Any]) -> None:
        self._output = output
        key = key_of(dict(origin))[:_KEY_LENGTH]
        self.folder = output.parent / f".{output.stem}-{key}.batches"

    def keep(self, name: str, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Write the result of a task, complete or not at all.

        Raises
        ------
        InputError
            If it cannot be written.
        """
        with whole_file(self._path(name)) as partial, partial.open("wb") as stream:
            np.savez(stream, **arrays)  # type: ignore[arg-type]

    def kept(self, name: str) -> Arrays | None:
        """Return the result of a task; None if it is missing or corrupted."""
        try:
            with self._path(name).open("rb") as stream, np.load(stream) as file:
                return {key: file[key] for key in file.files}
        except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile, zlib.error):
            return None

    def map(
        self,
        function: Callable[[Task], Arrays],
        tasks: Iterable[tuple[str, Callable[[], Task]]],
        engine: Engine | None,
        done: Callable[[], None],
    ) -> Iterator[Arrays]:
        """Compute and keep the missing results, and yield all results in order.

        Parameters
        ----------
        function : callable
            The function to call, as in `map_tasks`.
        tasks : iterable of (str, callable)
            The name of each task, and a function that makes it if it must be computed.
        engine : Engine, optional
            Engine of the computation.
        done : callable
            Called for each finished task.

        Raises
        ------
        InputError
            If a result cannot be written, or is missing when it is read again.
        """
        names: list[str] = []
        missing: list[str] = []

        def to_do() -> Iterator[Task]:
            for name, make in tasks:
                names.append(name)
                if self.kept(name) is None:
                    missing.append(name)
                    yield make()
                else:
                    done()

        for number, arrays in enumerate(map_tasks(function, to_do(), engine=engine)):
            self.keep(missing[number], arrays)
            done()
        for name in names:
            result = self.kept(name)
            if result is None:
                raise InputError(
                    self._path(name), "missing or corrupted. Keep this folder until the end."
                )
            yield result

    def sweep(self) -> None:
        """Remove all results for this output, including those of earlier inputs and options."""
        pattern = re.compile(
            rf"\.{re.escape(self._output.stem)}-[0-9a-f]{{{_KEY_LENGTH}}}\.batches"
        )
        for folder in self._output.parent.iterdir():
            if pattern.fullmatch(folder.name):
                shutil.rmtree(folder, ignore_errors=True)

    def _path(self, name: str) -> Path:
        return self.folder / f"{name}.npz"
