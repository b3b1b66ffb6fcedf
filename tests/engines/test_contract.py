"""The engines of the package, and executors of Python, keep the rules of engines."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

import pytest
from tests.engines.contract import keeps_the_rules

from rockframe.engines.dask import DaskScheduler
from rockframe.engines.engine import OneProcess, ProcessPool


@pytest.mark.parametrize("engine", [OneProcess(), ProcessPool(2), ProcessPool(2, patience=0.0)])
def test_engines_of_this_machine(engine: OneProcess | ProcessPool) -> None:
    keeps_the_rules(engine)


def test_executors_of_python() -> None:
    with ThreadPoolExecutor(2) as threads:
        keeps_the_rules(threads)
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(2, mp_context=context) as processes:
        keeps_the_rules(processes)


def test_dask() -> None:
    pytest.importorskip("distributed", reason="needs the extra dask: make test-dask")
    from tests.engines.clusters import local_cluster

    with local_cluster(2, threads_per_worker=1) as cluster:
        keeps_the_rules(DaskScheduler(cluster.scheduler_address))


class _Backwards:
    """Returns the results in the order in which they end."""

    def map(self, function: Callable[..., Any], tasks: Iterable[Any]) -> Iterator[Any]:
        yield from reversed([function(task) for task in tasks])


class _Rounding:
    """Sends numbers in single precision."""

    def map(self, function: Callable[..., Any], tasks: Iterable[Any]) -> Iterator[Any]:
        for result in map(function, tasks):
            yield result.astype("f4") if hasattr(result, "astype") else result


class _ReadingAhead:
    """Reads the tasks in another thread."""

    def map(self, function: Callable[..., Any], tasks: Iterable[Any]) -> Iterator[Any]:
        with ThreadPoolExecutor(1) as other:
            yield from map(function, other.submit(list, tasks).result())


class _Wrapping:
    """Wraps the errors of functions."""

    def map(self, function: Callable[..., Any], tasks: Iterable[Any]) -> Iterator[Any]:
        with _wrapped():
            yield from map(function, tasks)


@contextmanager
def _wrapped() -> Iterator[None]:
    try:
        yield
    except Exception as error:
        raise RuntimeError(str(error)) from error


@pytest.mark.parametrize(
    ("engine", "fault"),
    [
        (_Backwards(), AssertionError),
        (_Rounding(), AssertionError),
        (_ReadingAhead(), AssertionError),
        (_Wrapping(), RuntimeError),
    ],
)
def test_engines_that_break_a_rule_are_found(engine: Any, fault: type[Exception]) -> None:
    with pytest.raises(fault):
        keeps_the_rules(engine)
