"""A lock that allows one run at a time in a folder."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from filelock import lock_descriptor

from rockframe.errors import InputError
from rockframe.runs.plan import KEPT

#: Retries, because `is_locked` holds the lock for a moment.
_TRIES: Final = 5
_PAUSE: Final = 0.02


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold the lock of a run's folder during the block; the system frees it if the process dies.

    Raises
    ------
    InputError
        If another run holds the lock, or the folder cannot be written to.
    """
    descriptor = _opened(folder)
    try:
        if not _acquired(descriptor):
            raise InputError(folder, "in use by another run. Wait until it ends.")
        yield
    finally:
        os.close(descriptor)


def is_locked(folder: Path) -> bool:
    """Return True if a run is using a folder.

    Examples
    --------
    >>> is_locked(Path("no-such-folder"))
    False
    """
    path = folder / KEPT / "lock"
    if not path.is_file():
        return False
    try:
        try:
            descriptor = os.open(path, os.O_RDWR)  # NFS locks only files opened for writing
        except OSError:  # in a folder of another user
            descriptor = os.open(path, os.O_RDONLY)
    except OSError as error:
        raise InputError(path, f"cannot be read: {error.strerror}.") from None
    try:
        return not _acquired(descriptor)
    finally:
        os.close(descriptor)


def _opened(folder: Path) -> int:
    path = folder / KEPT / "lock"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        return os.open(path, os.O_RDWR | os.O_CREAT, 0o644)  # child processes do not inherit it
    except OSError as error:
        raise InputError(folder, f"cannot be written to: {error.strerror}.") from None


def _acquired(descriptor: int) -> bool:
    """Take the lock. Retry for a moment, because `is_locked` briefly holds it too."""
    for _ in range(_TRIES):
        try:
            if lock_descriptor(descriptor, blocking=False):
                return True
        except OSError:  # a file system without locks: the user must avoid two runs at once
            return True
        time.sleep(_PAUSE)
    return False
