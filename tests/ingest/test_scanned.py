"""The compiled scan of tables reads what `float` reads, or leaves the text to others."""

from __future__ import annotations

import sys

import numba
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rockframe.ingest.parsing import scanned
from rockframe.ingest.parsing.scanned import scanned_table

assert numba.__name__ in sys.modules  # without it, the scan is not worth while

FORMS = ("%.6f", "%.3e", "%g", "%+.9g", "%15.7E", "%.0f", "%.1f")


@given(
    st.lists(
        st.tuples(st.floats(-1e6, 1e6).filter(lambda x: abs(x) > 1e-9), st.sampled_from(FORMS)),
        min_size=1,
        max_size=40,
    ),
    st.sampled_from([b",", b";", b"\t", None]),
)
def test_numbers_have_the_bits_of_float(
    numbers: list[tuple[float, str]], separator: bytes | None
) -> None:
    """One rounding, as in `float`, for numbers in any form that programs print."""
    tokens = [form % value for value, form in numbers]
    between = (separator or b"  ").decode()
    text = "".join(f"{token}{between} {token} \n" for token in tokens).encode()
    table = scanned_table(text, 2, separator)
    assert table is not None
    expected = np.array([[float(token)] * 2 for token in tokens])
    assert table.tobytes() == expected.tobytes()


@pytest.mark.parametrize(
    "text",
    [
        *(b"1,2\n3\n", b"1,2,3\n", b"1,\n", b",1\n", b"1 2\n", b"1,2", b"1,2\n\n", b"\n1,2\n"),
        *(b"1e,2\n", b"1e+,2\n", b".,2\n", b"-,2\n", b"--1,2\n", b"1.2.3,4\n", b"1e5.0,2\n"),
        *(b"1_0,2\n", b"0x1,2\n", b"nan,2\n", b"inf,2\n", b"1d2,3\n", b"1,2x\n", b"1\r,2\n"),
        *(b"1e99999999999,2\n", b"1e-23,2\n", b"1234567890123456,2\n", b"\xb2,2\n"),
    ],
)
def test_all_else_is_left_to_the_reader_that_names_the_fault(text: bytes) -> None:
    """Wrong rows, what is no number, and what one rounding may not read."""
    assert scanned_table(text, 2, b",") is None


def test_a_command_that_reads_few_tables_does_without_the_compiler(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Importing numba takes longer than reading hundreds of tables."""
    monkeypatch.delitem(sys.modules, "numba")
    monkeypatch.setattr(scanned, "_READ", [0])
    assert scanned_table(b"1,2\n", 2, b",") is None
    monkeypatch.setattr(scanned, "_MANY", 8)
    assert scanned_table(b"1,2\n", 2, b",") is not None
