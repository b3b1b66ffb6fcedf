"""Threads: as many as the process may use, and none inside another thread."""

from __future__ import annotations

import threading

import numpy as np
import pytest

from rockframe import Pulse, RockingFrame, respond_scenarios
from rockframe.engines.engine import cores, on_threads, threads


def test_results_come_in_the_order_of_the_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    assert on_threads(abs, [-3, 2, -1, 0]) == [3, 2, 1, 0]


@pytest.mark.parametrize(
    ("setting", "number"), [("3", 3), ("2,4", 2), ("", cores()), ("many", cores()), ("0", cores())]
)
def test_number_is_the_one_that_is_stated_or_that_of_the_cores(
    monkeypatch: pytest.MonkeyPatch, setting: str, number: int
) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", setting)
    assert threads() == number


def test_threads_start_no_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    assert on_threads(lambda _part: threads(), [0, 1, 2]) == [1, 1, 1]
    assert threads() == 2


def test_one_thread_is_the_one_that_asks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    here = threading.get_ident()
    assert on_threads(lambda _part: threading.get_ident(), [0, 1]) == [here, here]


def test_responses_have_the_same_bits_on_any_number_of_threads(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    frames = [RockingFrame(height=9.6, width=1.6, mass_ratio=mass) for mass in (0.0, 4.0)]
    pulses = [Pulse(wavelet="symmetric_ricker", a_p=9.81, T_p=period) for period in (0.5, 1.5)]
    number = np.arange(1500)
    counts = []
    for count in ("1", "2", "3"):
        monkeypatch.setenv("OMP_NUM_THREADS", count)
        answer = respond_scenarios(pulses, frames, number % 2, number // 2 % 2, number / 1000.0)
        counts.append([values.tobytes() for values in vars(answer).values()])
    assert counts[0] == counts[1] == counts[2]
