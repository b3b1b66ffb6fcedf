"""Numbers in fixed columns read exactly as `float` reads them, in every printed form."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rockframe.errors import InputError
from rockframe.ingest.parsing.samples import Columns, read_columns

FORMS = ("9.6f", "12.3f", "15.7E", "+12.5f", "16.13f", "25.15f")


def printed(values: list[float], form: str, *, leading_zero: bool) -> tuple[list[bytes], int]:
    """Return lines of three numbers each, as Fortran prints them, and the width of a number."""
    width = int(form.strip("+").split(".")[0])
    fields = [format(value, form).rjust(width) for value in values]
    if not leading_zero:
        fields = [text.replace("0.", ".", 1).rjust(width) for text in fields]
    rows = ["".join(fields[start : start + 3]) for start in range(0, len(fields), 3)]
    return [row.encode() for row in rows], width


@given(
    st.lists(st.floats(-9.0, 9.0), min_size=1, max_size=20), st.sampled_from(FORMS), st.booleans()
)
def test_each_number_is_what_float_reads(values: list[float], form: str, zero: bool) -> None:
    rows, width = printed(values, form, leading_zero=zero)
    found = read_columns(Path("a.v1"), rows, Columns(3, width), len(values), 1)
    fields = [row[k : k + width] for row in rows for k in range(0, len(row), width)]
    expected = np.array([float(text) for text in fields])
    np.testing.assert_array_equal(found, expected)
    np.testing.assert_array_equal(np.signbit(found), np.signbit(expected))


@pytest.mark.parametrize(
    "field",
    ["- .12", "1 .12", "-+.12", "  . 1", " 1.-2", " x.12", " 1212", " 1_.1", "1.1.1"],
)
def test_a_field_that_is_no_number_is_refused(field: str) -> None:
    rows = [b"  .10-1.20" + field.encode()]
    with pytest.raises(InputError, match="characters 11 to 15"):
        read_columns(Path("a.v1"), [*rows, b"  .10"], Columns(3, 5), 4, 1)
