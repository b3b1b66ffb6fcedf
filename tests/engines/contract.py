"""The rules of `rockframe.Engine` as a test that any engine can be put through."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from rockframe.engines.engine import Engine, Resources, map_tasks, resources_of
from rockframe.errors import InputError
from rockframe.provenance import sha256_of


def keeps_the_rules(engine: Engine) -> None:
    """Assert that an engine keeps the rules in the docstring of `Engine`, by their numbers."""
    # 1, 2: the first task takes longest, and its result still comes first
    tasks = ["__import__('time').sleep(0.1) or 0", *map(str, range(1, 8))]
    assert list(engine.map(eval, tasks)) == list(range(8))
    # 3: sums in another order, or in single precision, would differ in the last bits
    arrays = [np.linspace(0.0, n, 50) for n in range(1, 8)]
    sums = list(engine.map(partial(np.cumsum, axis=0), arrays))
    assert [array.tobytes() for array in sums] == [np.cumsum(a).tobytes() for a in arrays]
    # 4: no tasks; an iterator without a length, which only the caller's thread reads
    assert list(engine.map(abs, [])) == []
    readers = set[int]()
    assert list(engine.map(abs, _noting_thread(readers))) == [3, 2, 1]
    assert readers == {threading.get_ident()}
    # 6: the user's error has its type, its file and its words; 8: and does not end the engine
    with pytest.raises(InputError, match="no-such-file: cannot be read") as caught:
        list(engine.map(sha256_of, [Path("no-such-file")]))
    assert caught.value.path == Path("no-such-file")
    # 7, 8: results may be left unread
    results = map_tasks(abs, [-1, -2, -3], engine=engine)
    assert next(results) == 1
    results.close()
    assert list(engine.map(abs, [-4, -5])) == [4, 5]
    # 9
    assert isinstance(resources_of(engine), Resources)


def _noting_thread(readers: set[int]) -> Iterator[int]:
    for task in (-3, -2, -1):
        readers.add(threading.get_ident())
        yield task
