"""A batch that takes long is named while it is computed."""

from __future__ import annotations

from collections.abc import Generator
from threading import Event

import pytest

from rockframe import watch
from rockframe.engines.engine import OneProcess, map_tasks


@pytest.mark.parametrize(
    ("slow", "names", "name"),
    [(1, (), "batch 1 of 3"), (3, (), "batch 3 of 3"), (2, ("a", "ingest", "b"), "ingest")],
)
def test_a_batch_that_takes_long_is_named_while_it_is_computed(
    monkeypatch: pytest.MonkeyPatch, slow: int, names: tuple[str, ...], name: str
) -> None:
    """The batch ends only after it was named, again and again."""
    monkeypatch.setattr(watch, "_LEAST", 0.05)
    monkeypatch.setattr(watch, "_FIRST", 0.05)
    lines: list[str] = []
    named = Event()

    def tell(line: str) -> None:
        lines.append(line)
        if sum(one.startswith(f"{name} is ") for one in lines) == 2:
            named.set()

    def compute(number: int) -> int:
        if number == slow:
            assert named.wait(60.0)
        return number

    with watch.telling(tell):
        assert list(map_tasks(compute, [1, 2, 3], engine=OneProcess(), names=names)) == [1, 2, 3]
    first = next(line for line in lines if line.startswith(f"{name} is "))
    assert "is still being computed, after" in first
    assert ("others took" in first) == (slow > 1)


def test_without_a_listener_there_are_no_timers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Workers and callers from Python hear nothing; errors and early ends pass through."""
    monkeypatch.setattr(watch, "Timer", None)
    assert list(map_tasks(abs, [-1, 2], engine=OneProcess())) == [1, 2]


def test_a_caller_that_stops_early_closes_the_engine() -> None:
    closed = []

    def results() -> Generator[int, None, None]:
        try:
            yield from range(9)
        finally:
            closed.append(True)

    with watch.telling(print):
        found = watch.watched(results(), None)
        assert next(found) == 0
        found.close()
    assert closed == [True]
