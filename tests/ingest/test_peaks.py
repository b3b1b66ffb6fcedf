from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from rockframe.errors import InputError
from rockframe.ingest.parsing.samples import Printed, StatedPeak, require_peak

SAMPLES = np.array([0.1, -0.52, 0.3])


def check(value: str, time: str | None = None, *, signed: bool = True) -> float:
    stated = StatedPeak(
        value=Printed.of(value),
        time=None if time is None else Printed.of(time),
        units="g",
        line=7,
        signed=signed,
    )
    return require_peak(Path("a.V2"), SAMPLES, 0.01, stated, 0.01)


@pytest.mark.parametrize("value", ["-0.52", "-.5200", "-0.5", "-5.2E-1", "-0.53"])
def test_printed_digits_decide(value: str) -> None:
    check(value)


@pytest.mark.parametrize("value", ["0.52", "-0.55", "-5.2", "0.0"])
def test_both_numbers_are_said(value: str) -> None:
    with pytest.raises(InputError, match=r"a\.V2:7: peak .* g stated, but -0\.52 g in the file"):
        check(value)


def test_sizes_have_no_sign() -> None:
    check("0.52", signed=False)


@pytest.mark.parametrize("time", ["0.01", "0.020", "0.00"])
def test_time_counts_from_the_first_sample_or_step(time: str) -> None:
    check("-0.52", time)


@pytest.mark.parametrize(
    ("value", "signed", "ratio"), [("-0.53", True, 0.52 / 0.53), ("0.52", False, 1.0)]
)
def test_ratio_of_what_was_found(value: str, signed: bool, ratio: float) -> None:
    assert check(value, signed=signed) == pytest.approx(ratio)


def test_a_stated_peak_of_zero_has_no_ratio() -> None:
    stated = StatedPeak(value=Printed.of("0.0"), units="g", line=7)
    assert math.isnan(require_peak(Path("a.V2"), np.array([0.004, 0.0]), 0.01, stated, 0.0))


def test_other_time() -> None:
    with pytest.raises(InputError, match=r"stated at 0\.5 s, but at 0\.01 s in the file"):
        check("-0.52", "0.50")


def test_equal_peaks_of_either_sign() -> None:
    stated = StatedPeak(value=Printed.of("0.52"), time=Printed.of("0.02"), units="g", line=1)
    both = np.array([0.0, -0.52, 0.52])
    assert require_peak(Path("a.V2"), both, 0.01, stated, 0.01) == pytest.approx(1.0)


def test_exponents_beyond_doubles() -> None:
    assert Printed.of("1.0E-9999").value == 0.0
