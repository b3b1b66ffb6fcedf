"""Hashes of files, versions of packages, atomic writing of files and folders, the manifest."""

from __future__ import annotations

import errno
import hashlib
import importlib.metadata
import json
import math
import os
import platform
import shutil
import tempfile
import time
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from functools import cache, lru_cache
from pathlib import Path, PureWindowsPath
from typing import Any, Final, Self

from rockframe.errors import InputError, RockframeError
from rockframe.interruption import raise_if_interrupted, undoing

#: Version of the package; the wheel and `rockframe --version` read it from here.
__version__ = "1.0.0"
#: Suffixes of the package's own files on which results depend, and of those that only pages show.
_SOURCES: Final = frozenset([".py", ".toml", ".mplstyle"])
_PAGE_SOURCES: Final = frozenset([".html", ".css", ".js"])
#: Time after which a further change of a file shows in its times on any file system [ns].
_SETTLED: Final = 3_000_000_000
#: A disk with less free space than this counts as full [bytes].
_FULL: Final = 65536
#: Message for a file that was changed after it was written.
DAMAGED: Final = "is corrupted"
#: Message for a file that was removed.
MISSING: Final = "missing"
#: File that completes a run.
MANIFEST: Final = "manifest.json"
#: Hidden file in a folder of figures, with the hashes of the files from which each was drawn.
DRAWN: Final = ".drawn.json"
#: Other distributions whose versions can change results.
_DISTRIBUTIONS: Final = (
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

    A file is read once: while its size and times stay the same, its hash does too. A file that
    changed less than `_SETTLED` ago is read each time, because another change could leave its
    times as they are.

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
    raise_if_interrupted()
    try:
        if not (path.is_file() or path.is_dir()) and path.exists():  # reading a pipe would hang
            raise InputError(path, "is not a regular file.")
        with path.open("rb") as stream:  # a network file system states present times when it opens
            status = os.fstat(stream.fileno())
        times = status.st_mtime_ns, status.st_ctime_ns
        settled = time.time_ns() - max(times) > _SETTLED
        digest = _digest if settled else _digest.__wrapped__
        return digest(path, status.st_dev, status.st_ino, status.st_size, *times)
    except OSError as error:
        raise InputError(path, f"cannot be read: {error.strerror}.") from None


@lru_cache(maxsize=4096)
def _digest(path: Path, *_version: int) -> str:
    """Read a file and return its hash; its place on the disk, size and times state its version."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def sealed(content: Mapping[str, Any]) -> bytes:
    """Return JSON that starts with the hash of the rest, so that corruption can be detected.

    Examples
    --------
    >>> is_sealed(sealed({"name": "whole"}))
    True
    """
    return _sealed(json.dumps(content, indent=1, sort_keys=True)[1:].encode() + b"\n")


def is_sealed(text: bytes) -> bool:
    """Return True if the content of a file is an unchanged result of `sealed`.

    Examples
    --------
    >>> is_sealed(sealed({"name": "whole"}).replace(b"whole", b"while"))
    False
    """
    return text == _sealed(text.partition(b'",')[2])


def _sealed(rest: bytes) -> bytes:
    return b'{\n "sha256_of_the_rest": "%b",%b' % (hashlib.sha256(rest).hexdigest().encode(), rest)


#: Around the hash in the last line of a page.
_BEFORE: Final = b"<!-- SHA-256 of all above this line: "
_AFTER: Final = b" -->\n"


def sealed_page(page: str) -> bytes:
    """Encode a page in UTF-8 and append the line with its hash.

    Examples
    --------
    >>> is_whole_page(sealed_page("<p>Whole.</p>"))
    True
    """
    content = page.rstrip().encode() + b"\n"
    return content + _last_line(content)


def is_whole_page(content: bytes) -> bool:
    """Return True if the hash in the last line of a page is correct.

    Examples
    --------
    >>> is_whole_page(sealed_page("<p>Whole.</p>").replace(b"Whole", b"Hole"))
    False
    """
    page, before, _ = content.rpartition(_BEFORE)
    return bool(before) and content == page + _last_line(page)


def _last_line(content: bytes) -> bytes:
    return _BEFORE + hashlib.sha256(content).hexdigest().encode() + _AFTER


def read_json(content: str | bytes) -> Any:
    """Parse a JSON text.

    Raises
    ------
    ValueError
        If it is not JSON, is nested too deeply, or has an integer of thousands of digits.

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
    """Return the SHA-256 of the source and data files on which results depend, with their names."""
    return _hash_of_package(_SOURCES)


@cache
def page_source_hash() -> str:
    """Return the SHA-256 of the templates, style sheets and scripts, on which only pages depend."""
    return _hash_of_package(_PAGE_SOURCES)


def _hash_of_package(suffixes: Collection[str]) -> str:
    root = Path(__file__).parent
    digest = hashlib.sha256()
    for path in sorted(root.rglob("*")):
        if path.is_file() and path.suffix in suffixes:
            digest.update(path.relative_to(root).as_posix().encode() + b"\0")
            digest.update(path.read_bytes() + b"\0")
    return digest.hexdigest()


_version = cache(importlib.metadata.version)


def package_versions() -> dict[str, str]:
    """Return the versions of the packages that results depend on.

    Examples
    --------
    >>> "numpy" in package_versions()
    True
    """
    return {"rockframe": __version__} | {name: _version(name) for name in _DISTRIBUTIONS}


def key_of(*parts: Any) -> str:
    """Return a hash of everything that kept work depends on.

    Parameters
    ----------
    *parts : JSON value
        Its inputs and options. The source code and the versions of packages are included, so that
        the manifest states those that computed a file.

    Examples
    --------
    >>> key_of({"scales": [1.0]}) == key_of({"scales": [1.0]}) != key_of({"scales": [2.0]})
    True
    """
    text = json.dumps([source_code_hash(), package_versions(), *parts], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


@dataclass(frozen=True)
class Stamp:
    """The stamp of finished work, by which a later run recognises it: its key and its files.

    Parameters
    ----------
    key : str
        Hash of everything that the work depended on.
    outputs : mapping of str to str
        SHA-256 of each file, by its name in the folder.
    origin : mapping
        What the key is a hash of, for the step of a run; empty if it is unknown.
    """

    key: str
    outputs: Mapping[str, str]
    origin: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def of(cls, key: str, names: Iterable[str], folder: Path) -> Self:
        """Return the stamp of files in a folder.

        Raises
        ------
        InputError
            If a file is missing.
        """
        return cls(key, {name: sha256_of(folder / name) for name in names})

    def faults(self, folder: Path) -> Iterator[tuple[Path, str]]:
        """Yield each file that is not as it was, and `MISSING` or `DAMAGED`."""
        for name, sha256 in self.outputs.items():
            path = folder / name
            if not path.is_file():
                yield path, MISSING
            elif sha256_of(path) != sha256:
                yield path, DAMAGED


def processor() -> str:
    """Return the architecture of this processor and the extensions that numpy uses.

    numpy uses these extensions for some functions (`exp`, `tan`), which changes the last bits.

    Examples
    --------
    >>> import platform
    >>> processor().split()[0] == platform.machine()
    True
    """
    import numpy as np  # loaded here, because hashing files does not need it

    extensions: Any = np.show_config(mode="dicts").get("SIMD Extensions", {})
    used = [*extensions.get("baseline", ()), *extensions.get("found", ())]
    return " ".join([platform.machine(), *used])


#: Folders that are in use, and are not made anew if they vanish.
_IN_USE: ContextVar[tuple[Path, ...]] = ContextVar("folders in use", default=())


@contextmanager
def staying(folder: Path) -> Iterator[None]:
    """Use a folder within the block; it is not made anew if it is renamed or removed meanwhile.

    Raises
    ------
    InputError
        If it is.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as home:
    ...     (folder := Path(home, "run")).mkdir()
    ...     with staying(folder):
    ...         _ = folder.rename(Path(home, "elsewhere"))
    ...         make_folder(folder / "figures")
    Traceback (most recent call last):
    rockframe.errors.InputError: ...run: was renamed or removed during this command. Restore ...
    """
    folder = folder.absolute()
    before = _IN_USE.set((*_IN_USE.get(), folder))
    try:
        yield
    except (OSError, RockframeError) as error:
        if folder.is_dir():
            raise
        raise _vanished(folder) from error
    finally:
        _IN_USE.reset(before)


def _vanished(folder: Path) -> InputError:
    gone = "was renamed or removed during this command"
    return InputError(folder, f"{gone}. Restore its name, or repeat the command.")


def make_folder(folder: Path) -> None:
    """Make a folder and the folders above it, unless one of them was in use and has vanished.

    Raises
    ------
    InputError
        If one has.
    OSError
        If the folder cannot be made.
    """
    for used in _IN_USE.get():
        if folder.absolute().is_relative_to(used) and not used.is_dir():
            raise _vanished(used)
    folder.mkdir(parents=True, exist_ok=True)


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Yield a temporary path beside `path`; if the block succeeds, move the file to `path`.

    Readers see the old file, the new file, or no file. A missing folder is created.

    Raises
    ------
    InputError
        If the folder cannot be created or written to.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with whole_file(Path(folder) / "note.txt") as partial:
    ...         _ = partial.write_text("done")
    ...     [entry.name for entry in Path(folder).iterdir()]
    ['note.txt']
    """
    raise_if_interrupted()
    refuse_obstacles([path])
    try:
        make_folder(path.parent)
        handle, name = tempfile.mkstemp(
            prefix=f".{path.stem}-", suffix=f".partial{path.suffix}", dir=path.parent
        )
    except OSError as error:
        raise InputError(path, f"cannot be written: {error.strerror}.") from None
    os.close(handle)
    partial = Path(name)
    try:
        with undoing(lambda: partial.unlink(missing_ok=True)):
            yield partial
            _put_in_place(partial, path)
    except OSError as error:
        raise InputError(path, f"cannot be written: {_why(error, partial)}.") from error
    finally:
        partial.unlink(missing_ok=True)


def _why(error: OSError, partial: Path) -> str:
    """Return the system's message; netCDF hides it, so that likely causes are checked here."""
    if not partial.parent.is_dir():
        return "its folder was renamed or removed meanwhile"
    if error.errno in (None, errno.EFBIG) or error.strerror is None:
        limit = _largest_file()
        if partial.is_file() and partial.stat().st_size >= limit - _FULL:
            return f"{os.strerror(errno.EFBIG)}: the limit of this process is {limit} bytes"
        if shutil.disk_usage(partial.parent).free < _FULL:
            return os.strerror(errno.ENOSPC)
    return error.strerror or str(error)


def _largest_file() -> float:
    """Return the largest size of a file that this process may write [bytes]."""
    try:
        import resource
    except ImportError:  # Windows has no such limit
        return math.inf
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)[0]
    return math.inf if limit == resource.RLIM_INFINITY else limit


def _put_in_place(partial: Path, path: Path) -> None:
    with partial.open("r+b") as stream:  # Windows flushes only files that are open for writing
        os.fsync(stream.fileno())
    umask = os.umask(0)
    os.umask(umask)
    partial.chmod(0o666 & ~umask)  # mkstemp's 0600 would hide results from other users
    partial.replace(path)


def refuse_obstacles(files: Iterable[Path]) -> None:
    """Raise an error if a folder is in the place of a file to write, or a file in that of a folder.

    Raises
    ------
    InputError
        If there is such an obstacle.

    Examples
    --------
    >>> refuse_obstacles([Path("/table.csv")])
    """
    for path in files:
        try:
            is_folder = path.is_dir()
            above = next((parent for parent in path.parents if parent.exists()), path.parent)
        except OSError as error:  # such as a name that is too long
            raise InputError(path, f"cannot be written: {error.strerror}.") from None
        if is_folder:
            raise InputError(
                path, "is a folder, in the place of a file to write. Move it, or use another name."
            )
        if above.exists() and not above.is_dir():
            raise InputError(
                above, f"is a file. Must be a folder, because {path.name} is written into it."
            )


def remove_file(path: Path) -> None:
    """Remove a file of a run if it exists.

    Raises
    ------
    InputError
        If a folder is in its place.
    """
    refuse_obstacles([path])
    path.unlink(missing_ok=True)


def refuse_overwriting(
    outputs: Iterable[Path], inputs: Iterable[Path], beside: Path | None = None
) -> None:
    """Raise an error if an output would overwrite an input, or cannot take its place.

    `beside` is the output that the user named, if other files are written beside it.

    Raises
    ------
    InputError
        If an output is one of the inputs, even under another path, or a folder.

    Examples
    --------
    >>> refuse_overwriting([Path("motion.csv")], [Path("./motion.csv")])
    Traceback (most recent call last):
    rockframe.errors.InputError: motion.csv: is an input of this command. Choose another file.
    """
    read = {path.resolve() for path in inputs}
    outputs = list(outputs)
    refuse_obstacles(outputs)
    for output in outputs:
        if output.resolve() in read:
            said = "Choose another file."
            if beside is not None and output != beside:
                said = f"The table beside {beside.name} would replace it. Choose another name."
            raise InputError(output, f"is an input of this command. {said}")


@contextmanager
def scratch_folder() -> Iterator[Path]:
    """Yield a temporary folder, which is removed at the end of the block.

    Examples
    --------
    >>> with scratch_folder() as folder:
    ...     folder.is_dir()
    True
    """
    with tempfile.TemporaryDirectory() as name, _removed(Path(name)):
        yield Path(name)


def _removed(folder: Path) -> AbstractContextManager[None]:
    """Remove a temporary folder also if the process is forced to end within the block."""
    return undoing(lambda: shutil.rmtree(folder, ignore_errors=True))


@contextmanager
def _partial_folder(folder: Path, parent: Path, prefix: str, suffix: str = "") -> Iterator[Path]:
    """Yield a temporary folder in `parent`; errors name `folder`, the final place."""
    raise_if_interrupted()
    is_new = not parent.exists()
    try:
        make_folder(parent)
        partial = Path(tempfile.mkdtemp(prefix=prefix, suffix=suffix, dir=parent))
    except OSError as error:
        raise InputError(folder, f"cannot be written to: {error.strerror}.") from None
    try:
        with staying(parent):
            yield partial
    except OSError as error:
        raise InputError(folder, f"cannot be written: {error.strerror or error}.") from error
    finally:
        shutil.rmtree(partial, ignore_errors=True)
        if is_new and parent.is_dir() and not any(parent.iterdir()):
            parent.rmdir()


def listed_outputs(manifest: Path) -> set[Path]:
    """Return the outputs in a manifest that are inside its folder."""
    try:
        names = read_json(manifest.read_text(encoding="utf-8"))["outputs"]
    except (OSError, ValueError, KeyError, TypeError):
        return set()
    return {Path(name) for name in names if is_within(name)}


def is_within(name: str) -> bool:
    """Return True if a relative name stays inside its folder.

    Examples
    --------
    >>> is_within("figures/a.png"), is_within("../a.png"), is_within("/a.png"), is_within("C:a")
    (True, False, False, False)
    """
    path = PureWindowsPath(name)  # it parses both kinds of slashes, and drives
    return not path.anchor and ".." not in path.parts


@contextmanager
def replaced_folder(folder: Path) -> Iterator[Path]:
    """Yield a temporary folder beside `folder`; if the block succeeds, move it to `folder`.

    An existing folder is removed with all its files: the caller must check that this is right.

    Raises
    ------
    InputError
        If `folder` is a file, or cannot be written.
    """
    if folder.exists() and not folder.is_dir():
        raise InputError(folder, "is a file, not a folder.")
    with _partial_folder(folder, folder.parent, f".{folder.name}-", ".partial") as partial:
        new = partial / "new"
        new.mkdir()
        with _removed(partial):
            yield new
        if folder.exists():
            folder.replace(partial / "old")
        new.replace(folder)


#: Required keys of a manifest, and the types of their values.
_PARTS: Final = {
    "inputs": dict,
    "outputs": dict,
    "parameters": dict,
    "source_code_hash": str,
    "versions": dict,
}


def write_manifest(
    folder: Path,
    *,
    inputs: Mapping[str, str],
    parameters: Mapping[str, Any],
    outputs: Sequence[Path],
    steps: Mapping[str, str] | None = None,
) -> None:
    """Write ``manifest.json``, the last file of a run: hashes of all inputs and outputs.

    Parameters
    ----------
    folder : Path
        The run's folder.
    inputs : mapping
        Name and SHA-256 of each input.
    parameters : mapping
        Options of the run; JSON values.
    outputs : sequence of Path
        The files of the run, inside the folder.
    steps : mapping of str to str, optional
        For the run of a study, the hash of everything that each step depended on.

    Raises
    ------
    InputError
        If an output is missing or the manifest cannot be written.
    """
    content: dict[str, Any] = {
        "inputs": dict(inputs),
        "outputs": {path.relative_to(folder).as_posix(): sha256_of(path) for path in outputs},
        "parameters": dict(parameters),
        "processor": processor(),
        "source_code_hash": source_code_hash(),
        "versions": package_versions(),
    }
    if steps is not None:
        content["steps"] = dict(steps)
    with whole_file(folder / MANIFEST) as partial:
        partial.write_bytes(sealed(content))


def read_manifest(folder: Path) -> dict[str, Any]:
    """Read the manifest of the run in a folder.

    Parameters
    ----------
    folder : Path
        Folder of a complete run.

    Returns
    -------
    dict of str to Any
        The manifest, with ``inputs``, ``outputs``, ``parameters``, ``source_code_hash`` and
        ``versions``. Each output lies within the folder.

    Raises
    ------
    InputError
        If the manifest is missing, invalid or corrupted.

    Examples
    --------
    >>> read_manifest(Path("no-such-folder"))
    Traceback (most recent call last):
    rockframe.errors.InputError: no-such-folder: no such folder. Must be the folder of a run.
    """
    path = folder / MANIFEST
    if not folder.is_dir():
        problem = "is a file" if folder.exists() else "no such folder"
        raise InputError(folder, f"{problem}. Must be the folder of a run.")
    if not path.is_file():
        raise InputError(
            path, "missing: the run is not complete. State the folder of a complete run."
        )
    try:
        text = path.read_bytes()
        content = read_json(text)
    except (OSError, ValueError) as error:
        raise InputError(path, f"cannot be read: {error}. Must be JSON.") from None
    manifest: dict[str, Any] = content if isinstance(content, dict) else {}
    wrong = next((p for p, kind in _PARTS.items() if not isinstance(manifest.get(p), kind)), "")
    if wrong:
        problem = "another" if wrong in manifest else "no"
        raise InputError(
            path, f"contains {problem} {wrong!r}. Restore the file as the run wrote it."
        )
    if not all(map(is_within, manifest["outputs"])):
        raise InputError(path, "names outputs outside its folder. Must be names within it.")
    if not is_sealed(text):  # its hashes cannot be trusted
        raise InputError(path, f"{DAMAGED}. Repeat the command that made the run.")
    return dict(manifest)
