"""Where a result comes from, and files that are either whole or absent."""

from __future__ import annotations

import errno
import hashlib
import importlib.metadata
import json
import os
import platform
import shutil
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from pathlib import Path, PurePosixPath
from typing import Any, Final

from rockframe.errors import InputError

#: Suffixes of the files that make up the package.
_SOURCES: Final = frozenset([".py", ".toml", ".mplstyle", ".html", ".css", ".js"])
#: A disk with less room than this has no more [bytes].
_FULL: Final = 65536
#: What is said of a file that something else than this package changed.
DAMAGED: Final = "is damaged: not as it was written"
#: The last file of a run.
MANIFEST: Final = "manifest.json"
#: Distributions whose versions can change a number in a result.
_DISTRIBUTIONS: Final = (
    "rockframe",
    "matplotlib",
    "netCDF4",
    "numba",
    "numpy",
    "obspy",
    "PyWavelets",
    "scipy",
    "xarray",
)


def sha256_of(path: Path) -> str:
    """Return the SHA-256 of a file, in hexadecimal.

    Raises
    ------
    InputError
        If the file cannot be read, or is a pipe or a device.

    Examples
    --------
    >>> sha256_of(Path("no-such-file"))
    Traceback (most recent call last):
    rockframe.errors.InputError: no-such-file: cannot be read: No such file or directory.
    """
    try:
        if not (path.is_file() or path.is_dir()) and path.exists():  # a pipe would be waited for
            raise InputError(path, "is not a regular file. Must be one.")
        with path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError as error:
        raise InputError(path, f"cannot be read: {error.strerror}.") from None


def sealed(content: Mapping[str, Any]) -> bytes:
    """Return JSON that begins with the hash of the rest, so that damage to the file can be found.

    Parameters
    ----------
    content : mapping
        JSON values; at least one.

    Examples
    --------
    >>> is_sealed(sealed({"name": "whole"}))
    True
    """
    return _sealed(json.dumps(content, indent=1, sort_keys=True)[1:].encode() + b"\n")


def is_sealed(text: bytes) -> bool:
    """Return whether the content of a file is as `sealed` gave it.

    Examples
    --------
    >>> is_sealed(sealed({"name": "whole"}).replace(b"whole", b"while"))
    False
    """
    return text == _sealed(text.partition(b'",')[2])


def _sealed(rest: bytes) -> bytes:
    return b'{\n "sha256_of_the_rest": "%b",%b' % (hashlib.sha256(rest).hexdigest().encode(), rest)


def read_json(content: str | bytes) -> Any:
    """Return what a JSON text says.

    Raises
    ------
    ValueError
        If it is not JSON, lists and tables are within each other too often, or a whole number has
        thousands of digits.

    Examples
    --------
    >>> read_json("[" * 100_000)
    Traceback (most recent call last):
    ValueError: nested too deeply
    """
    try:
        return json.loads(content)
    except RecursionError:
        raise ValueError("nested too deeply") from None


@cache
def source_code_hash() -> str:
    """Return the SHA-256 of the package's own source and data files, names included."""
    root = Path(__file__).parent
    digest = hashlib.sha256()
    for path in sorted(root.rglob("*")):
        if path.is_file() and path.suffix in _SOURCES:
            digest.update(path.relative_to(root).as_posix().encode() + b"\0")
            digest.update(path.read_bytes() + b"\0")
    return digest.hexdigest()


def versions() -> dict[str, str]:
    """Return the versions of the packages that a result depends on.

    Examples
    --------
    >>> "numpy" in versions()
    True
    """
    return {name: importlib.metadata.version(name) for name in _DISTRIBUTIONS}


def processor() -> str:
    """Return the kind of this processor: its architecture, and the extensions that numpy uses.

    numpy computes some functions (`exp`, `tan`) by other instructions where there are better ones,
    which changes the last bits.

    Examples
    --------
    >>> import platform
    >>> processor().split()[0] == platform.machine()
    True
    """
    import numpy as np  # what only hashes files does not wait for it

    extensions: Any = np.show_config(mode="dicts").get("SIMD Extensions", {})
    used = [*extensions.get("baseline", ()), *extensions.get("found", ())]
    return " ".join([platform.machine(), *used])


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Give a temporary path beside `path`, and put it in its place only if the block succeeds.

    A reader sees the old file, the new file, or none; on failure nothing is left behind.

    Parameters
    ----------
    path : Path
        Where the file is to be. Its folder is made if it is missing.

    Raises
    ------
    InputError
        If the folder cannot be made or written to.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with whole_file(Path(folder) / "note.txt") as partial:
    ...         _ = partial.write_text("done")
    ...     [entry.name for entry in Path(folder).iterdir()]
    ['note.txt']
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(
            prefix=f".{path.stem}-", suffix=f".partial{path.suffix}", dir=path.parent
        )
    except OSError as error:
        raise InputError(path, f"cannot be written: {error.strerror}.") from None
    os.close(handle)
    partial = Path(name)
    try:
        yield partial
        _settle(partial, path)
    except OSError as error:
        raise InputError(path, f"cannot be written: {_why(error, partial)}.") from error
    finally:
        partial.unlink(missing_ok=True)


def _why(error: OSError, partial: Path) -> str:
    """What is wrong in the system's words; netCDF keeps to itself that a disk is full."""
    if error.strerror is None and shutil.disk_usage(partial.parent).free < _FULL:
        return os.strerror(errno.ENOSPC)
    return error.strerror or str(error)


def _settle(partial: Path, path: Path) -> None:
    umask = os.umask(0)
    os.umask(umask)
    partial.chmod(0o666 & ~umask)  # mkstemp's 0600 would hide results from colleagues
    with partial.open("rb") as stream:
        os.fsync(stream.fileno())
    partial.replace(path)


def refuse_overwriting(
    outputs: Iterable[Path], inputs: Iterable[Path], beside: Path | None = None
) -> None:
    """Refuse to write over a file that is read.

    Parameters
    ----------
    outputs, inputs : iterable of Path
        What is to be written, and what is read.
    beside : Path, optional
        The output that the user named, where others are written beside it.

    Raises
    ------
    InputError
        If an output is one of the inputs, by whatever path.

    Examples
    --------
    >>> refuse_overwriting([Path("motion.csv")], [Path("./motion.csv")])
    Traceback (most recent call last):
    rockframe.errors.InputError: motion.csv: is an input of this command. Must be another file.
    """
    read = {path.resolve() for path in inputs}
    for output in outputs:
        if output.resolve() in read:
            said = "Must be another file."
            if beside is not None and output != beside:
                said = f"The table beside {beside.name} would take its place. Must be another name."
            raise InputError(output, f"is an input of this command. {said}")


@contextmanager
def whole_folder(folder: Path) -> Iterator[Path]:
    """Give a temporary folder for the files of a run, and move them in only if the block succeeds.

    An older run in the folder stays as it was until then; of it, the files that its manifest lists
    are replaced or removed. ``manifest.json`` goes first and comes last: without it a run is not
    complete.

    Parameters
    ----------
    folder : Path
        Where the files are to be; made if it is missing.

    Raises
    ------
    InputError
        If the folder cannot be made or written to.
    """
    is_new = not folder.exists()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        partial = Path(tempfile.mkdtemp(prefix=".partial-", dir=folder))
    except OSError as error:
        raise InputError(folder, f"cannot be written to: {error.strerror}.") from None
    try:
        yield partial
        _move_in(partial, folder)
    except OSError as error:
        message = f"cannot be written: {error.strerror or error}."
        raise InputError(folder, message) from error
    finally:
        shutil.rmtree(partial, ignore_errors=True)
        if is_new and not any(folder.iterdir()):
            folder.rmdir()


def _move_in(partial: Path, folder: Path) -> None:
    manifest = folder / MANIFEST
    old = listed_outputs(manifest)
    manifest.unlink(missing_ok=True)
    new = sorted(path.relative_to(partial) for path in partial.rglob("*") if path.is_file())
    for name in sorted(old - set(new)):
        (folder / name).unlink(missing_ok=True)
    for name in sorted(new, key=lambda path: path.name == MANIFEST):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (partial / name).replace(folder / name)


def listed_outputs(manifest: Path) -> set[Path]:
    """Return the outputs that a manifest names, those that are inside its folder."""
    try:
        names = read_json(manifest.read_text(encoding="utf-8"))["outputs"]
    except (OSError, ValueError, KeyError, TypeError):
        return set()
    return {Path(name) for name in names if is_within(name)}


def is_within(name: str) -> bool:
    """Return whether a name that a file states is of something inside its folder.

    Examples
    --------
    >>> is_within("figures/a.png"), is_within("../a.png"), is_within("/a.png")
    (True, False, False)
    """
    path = PurePosixPath(name)
    return not path.is_absolute() and ".." not in path.parts


@contextmanager
def replaced_folder(folder: Path) -> Iterator[Path]:
    """Give a temporary folder beside `folder`, and put it in its place if the block succeeds.

    Parameters
    ----------
    folder : Path
        Where it is to be. An older one there is removed with all that is in it: the caller makes
        sure that this is nobody else's.

    Raises
    ------
    InputError
        If it is a file, or cannot be written.
    """
    if folder.exists() and not folder.is_dir():
        raise InputError(folder, "is a file. Must be a folder.")
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        partial = Path(
            tempfile.mkdtemp(prefix=f".{folder.name}-", suffix=".partial", dir=folder.parent)
        )
    except OSError as error:
        raise InputError(folder, f"cannot be written to: {error.strerror}.") from None
    try:
        new = partial / "new"
        new.mkdir()
        yield new
        if folder.exists():
            folder.replace(partial / "old")
        new.replace(folder)
    except OSError as error:
        raise InputError(folder, f"cannot be written: {error.strerror or error}.") from error
    finally:
        shutil.rmtree(partial, ignore_errors=True)
