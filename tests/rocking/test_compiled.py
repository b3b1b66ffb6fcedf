"""Compiled code is found again only while all its sources are the same."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any, cast

from rockframe.rocking import kernel, lanes


def test_names_of_cached_files_hold_the_hash_of_every_source() -> None:
    """Numba compares the time and size of one file; a function inlined from another may differ."""
    room = Path(kernel.__file__).parent
    digest = hashlib.sha256()
    for name in ("compiled.py", "kernel.py", "vectors.py", "lanes.py"):
        digest.update((room / name).read_bytes())
    for function in (kernel.integrate, lanes.integrate_lanes):
        assert digest.hexdigest()[:12] in cast("Any", function).py_func.__qualname__
