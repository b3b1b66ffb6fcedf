"""Lines about batches that take much longer than others, while they are computed."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from itertools import count
from threading import Event, Timer
from time import monotonic
from typing import Final, TypeVar, cast

Result = TypeVar("Result")

#: A batch is named once it takes this many times as long as the median of those before it [1],
_LONGER: Final = 100.0
#: but not before this time [s]; the first batch, which has none before it, after the second time.
_LEAST: Final = 10.0
_FIRST: Final = 60.0
#: Functions that print a line; the last one is called.
_TELL: Final[list[Callable[[str], None]]] = []
#: In place of a result after the last one.
_NOTHING: Final = object()


@contextmanager
def telling(tell: Callable[[str], None]) -> Iterator[None]:
    """Call a function, within a ``with`` block, with a line about each batch that takes long."""
    _TELL.append(tell)
    try:
        yield
    finally:
        _TELL.remove(tell)


def watched(
    results: Iterator[Result], total: int | None, names: Sequence[str] = ()
) -> Generator[Result, None, None]:
    """Yield the results of batches, and report those that take long while they are awaited.

    Parameters
    ----------
    results : iterator
        The results, in the order of the batches; closed at the end, if it can be closed.
    total : int, optional
        Number of batches, if it is known.
    names : sequence of str, optional
        Names of the batches in reports, by default their numbers.

    Examples
    --------
    >>> list(watched((abs(one) for one in (-1, 2)), 2))
    [1, 2]
    """
    spent: list[float] = []
    try:
        if not _TELL:
            yield from results
            return
        for number in count(1):
            name = f"batch {number}" + (f" of {total}" if total else "")
            name = names[number - 1] if number <= len(names) else name
            began = monotonic()
            with _alarm(name, spent):
                result = next(results, _NOTHING)
            if result is _NOTHING:
                return
            spent.append(monotonic() - began)
            yield cast("Result", result)
    finally:
        if isinstance(results, Generator):
            results.close()


@contextmanager
def _alarm(name: str, spent: Sequence[float]) -> Iterator[None]:
    """Report, within a ``with`` block, that a batch takes long; again each time it doubles."""
    usual = sorted(spent)[len(spent) // 2] if spent else 0.0
    timers: list[Timer] = []
    done = Event()

    def start(after: float, passed: float) -> None:
        timers[:] = [Timer(after, report, (passed + after,))]
        timers[0].daemon = True
        timers[0].start()

    def report(passed: float) -> None:
        if not done.is_set():
            others = f"; others took {usual:.2g} s" if spent else ""
            _TELL[-1](f"{name} is still being computed, after {passed:.0f} s{others}")
            start(passed, passed)

    start(max(_LEAST, _LONGER * usual) if spent else _FIRST, 0.0)
    try:
        yield
    finally:
        done.set()
        timers[0].cancel()
