"""Numbers in columns of one form are those that `float` reads, or are left to it."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rockframe.errors import InputError
from rockframe.ingest.parsing.aligned import aligned_numbers, numbers_of_columns
from rockframe.ingest.parsing.lines import require_even_lines

FORMS = ("%15.7E", "%12.4e", "%14.6f", "%9d", "%14.6E", "%+13.5e", "%20.3f")

SIZES = st.one_of(st.just(0.0), st.just(-0.0), st.floats(1e-4, 9e4), st.floats(-9e4, -1e-4))


def block(form: str, values: list[float], count: int) -> bytes:
    """Return the values as Fortran and C print them, `count` in a line."""
    printed = [form % value for value in values]
    lines = ["".join(printed[start : start + count]) for start in range(0, len(printed), count)]
    return "\n".join(lines).encode()


@given(
    st.sampled_from(FORMS),
    st.lists(SIZES, min_size=1, max_size=40),
    st.integers(1, 8),
)
def test_aligned_numbers_are_those_of_float(form: str, values: list[float], count: int) -> None:
    text = block(form, values, count)
    found = numbers_of_columns(text)
    assert found is not None
    expected = np.array([float(token) for token in text.split()])
    np.testing.assert_array_equal(found, expected)
    np.testing.assert_array_equal(np.signbit(found), np.signbit(expected))


@pytest.mark.parametrize("power", [-29, -16, -1, 0, 7, 14, 28])
def test_large_and_small_powers_are_rounded_once_or_left_to_float(power: int) -> None:
    """A power of ten up to 22 is exact, so the quotient or product has one rounding."""
    tokens = [f"{mantissa}E{power:+03d}" for mantissa in ("1.2345671", "9.9999999", "-3.0000001")]
    found = numbers_of_columns("".join(f" {token:>15}" for token in tokens).encode())
    if -15 <= power <= 29:
        assert found is not None
        assert found.tolist() == [float(token) for token in tokens]
    else:
        assert found is None


@pytest.mark.parametrize(
    "text",
    [
        b" 1.0 2.0\n 1.0-2.0",  # numbers that touch are one token for `float`
        b" 1.0 2.0\n 1 0 2.0",
        b" 1.0 2.0\n -.0 -+0",
        b" 1.0 2.0\n 1.0 .20",
        b" 1.0 2.0\n 1.0 nan",
        b" 1.0 2.0\n 1.0 2.",
        b" 1.0 2.0 \n 1.0 2.0",
        b" 1.0 2.0\n 1.0   -",
        b" 1.0 2.0\n\n 1.0 2.0",
        b" 1E+02 2E+02\n 1E+02 2D+02",
        b" 1E+02 2E+02\n 1E+02 2E 02",
        b" 1E+02 2E+02\n 1E+02 2E+ 2",
        b" 12_45 67890\n 12345 67890",
        b" 1234567890123456 1234567890123457",
        b" 5. 6.",
        b"",
        b" \n \n",
    ],
)
def test_numbers_of_another_form_are_left_to_float(text: bytes) -> None:
    assert numbers_of_columns(text) is None


@pytest.mark.parametrize("count", [4095, 4096, 4097, 10_001])
def test_numbers_read_in_blocks_are_those_of_float(count: int) -> None:
    """The last block may have another number of fields; a fault in it concerns all numbers."""
    values = np.random.default_rng(7).standard_normal(count)
    text = block("%15.7E", values.tolist(), 5)
    found = numbers_of_columns(text)
    assert found is not None
    assert found.tolist() == [float(token) for token in text.split()]
    assert numbers_of_columns(text[:-1] + b"x") is None


@pytest.mark.parametrize("digits", range(1, 16))
def test_any_number_of_digits_is_added_up_exactly(digits: int) -> None:
    tokens = [
        "9" * digits,
        "8" * (digits - 1) + "7",
        "-" + "1" * (digits - 1) if digits > 1 else "0",
    ]
    text = "".join(f" {token:>16}" for token in tokens).encode()
    found = numbers_of_columns(text)
    assert found is not None
    assert found.tolist() == [float(token) for token in tokens]


@pytest.mark.parametrize("text", ["  1E.5", "  1.E5", "  1E5.", "   E.5", "   15."])
def test_an_exponent_before_a_point_is_left_to_float(text: str) -> None:
    assert aligned_numbers(np.array([list(text.encode())], dtype=np.uint8)) is None


def test_a_minus_before_zero_is_kept() -> None:
    fields = np.array([list(b"-0.0"), list(b" 0.0")], dtype=np.uint8)
    found = aligned_numbers(fields)
    assert found is not None
    assert [math.copysign(1.0, value) for value in found.tolist()] == [-1.0, 1.0]


def test_a_long_exponent_that_hides_a_lost_digit_is_found() -> None:
    """The line is as wide as the others only because its exponent has a further digit."""
    rows = [b" .12E-02 .34E-02"] * 30
    require_even_lines(Path("motion.AT2"), b"\n".join(rows), 5)
    with pytest.raises(InputError, match="A number may be corrupted"):
        require_even_lines(Path("motion.AT2"), b"\n".join([*rows, b" .1E-002 .34E-02", *rows]), 5)
