"""Complete batches of an interrupted screening, so that the same command resumes it."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import zipfile
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from rockframe.engines.engine import Engine, map_batches
from rockframe.errors import InputError
from rockframe.provenance import source_code_hash, versions, whole_file

Task = TypeVar("Task")
Arrays = dict[str, NDArray[Any]]

_KEY_LENGTH: Final = 16


class Batches:
    """Batches of arrays in a hidden folder beside an output, of one set of inputs and options.

    Parameters
    ----------
    output : Path
        File that the batches will be merged into.
    origin : mapping
        Inputs and options that they depend on, as JSON values.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     batches = Batches(Path(folder, "screen.nc"), {"scales": [1.0]})
    ...     batches.keep("peaks-1", {"theta": np.array([0.5])})
    ...     batches.kept("peaks-1"), batches.kept("peaks-2")
    ({'theta': array([0.5])}, None)
    """

    def __init__(self, output: Path, origin: Mapping[str, Any]) -> None:
        text = json.dumps([source_code_hash(), versions(), dict(origin)], sort_keys=True)
        key = hashlib.sha256(text.encode()).hexdigest()[:_KEY_LENGTH]
        self._output = output
        self.folder = output.parent / f".{output.stem}-{key}.batches"

    def keep(self, name: str, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Write a batch, whole or not at all.

        Raises
        ------
        InputError
            If it cannot be written.
        """
        with whole_file(self._path(name)) as partial, partial.open("wb") as stream:
            np.savez(stream, **arrays)  # type: ignore[arg-type]

    def kept(self, name: str) -> Arrays | None:
        """Return a batch; None if there is none, or it is corrupted."""
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
        """Compute the batches that are not kept, keep them, and give all in their order.

        Parameters
        ----------
        function : callable
            As `map_batches` takes it.
        tasks : iterable of (str, callable)
            The name of each batch, and what makes its task if it is to be computed.
        engine : Engine, optional
            Where.
        done : callable
            Called for each batch that is there.

        Raises
        ------
        InputError
            If a batch cannot be written, or is gone when it is read back.
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

        for number, arrays in enumerate(map_batches(function, to_do(), engine=engine)):
            self.keep(missing[number], arrays)
            done()
        for name in names:
            batch = self.kept(name)
            if batch is None:
                raise InputError(
                    self._path(name), "missing or corrupted. Must stay until the run is done."
                )
            yield batch

    def sweep(self) -> None:
        """Remove all batches of this output, those of earlier inputs and options too."""
        pattern = re.compile(
            rf"\.{re.escape(self._output.stem)}-[0-9a-f]{{{_KEY_LENGTH}}}\.batches"
        )
        for folder in self._output.parent.iterdir():
            if pattern.fullmatch(folder.name):
                shutil.rmtree(folder, ignore_errors=True)

    def _path(self, name: str) -> Path:
        return self.folder / f"{name}.npz"
