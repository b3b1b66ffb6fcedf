"""Study files with arbitrary values are either read or rejected in one line."""

from __future__ import annotations

import json
import string
from pathlib import Path
from typing import get_args

from hypothesis import given
from hypothesis import strategies as st
from tests.conftest import examples

from rockframe.errors import InputError
from rockframe.matching.signal import Weighting
from rockframe.options.model import Wavelet, option_fields, options_within
from rockframe.options.pulse import PulseOptions
from rockframe.study.study import StudyTables, schema
from rockframe.study.toml import parse
from rockframe.wavelets.family import WAVELETS

#: TOML values: of right and wrong types, huge, infinite or NaN, dates and texts.
SCALARS = st.sampled_from(
    [
        "true",
        "0",
        "-1",
        "3",
        f"1{400 * '0'}",
        "1e400",
        "-inf",
        "nan",
        "0.5",
        "1979-05-27",
        "07:32:00",
    ]
) | st.text(string.printable + "é\N{SNOWMAN}", max_size=9).map(json.dumps)
LISTS = st.lists(SCALARS, max_size=4).map(lambda parts: f"[{', '.join(parts)}]")
TABLES = st.dictionaries(st.sampled_from(["from", "to", "count", "x"]), SCALARS, max_size=4).map(
    lambda table: "{" + ", ".join(f"{key} = {value}" for key, value in table.items()) + "}"
)
VALUES = st.one_of(SCALARS, LISTS, TABLES, LISTS.map(lambda inner: f"[{inner}]"))


def keys_of(model: type, before: str = "") -> list[str]:
    keys = []
    for name, field in option_fields(model).items():
        inner = options_within(field.annotation)
        keys += [f"{before}{name}"] + (keys_of(inner, f"{before}{name}.") if inner else [])
    return keys


@examples(400)
@given(stated=st.dictionaries(st.sampled_from(keys_of(StudyTables)), VALUES, max_size=4))
def test_anything_is_read_or_refused_in_one_line(stated: dict[str, str]) -> None:
    text = "\n".join(f"{key} = {value}" for key, value in stated.items())
    said = refusal(text)
    assert len(said.splitlines()) <= 1
    assert not said or said.startswith("study.toml")
    assert "Must be valid" not in said


def refusal(text: str) -> str:
    try:
        parse(Path("study.toml"), text, StudyTables)
    except InputError as error:
        return str(error)
    return ""


def test_words_of_a_study_are_those_of_the_rooms() -> None:
    assert get_args(Wavelet) == tuple(WAVELETS)
    known = get_args(PulseOptions.model_fields["weighting"].annotation)
    assert set(known) == {str(weighting) for weighting in Weighting}


def test_schema_is_strict_json() -> None:
    """JSON has no Infinity, which Python would write."""

    def refuse(constant: str) -> None:
        raise ValueError(constant)

    assert json.loads(schema(), parse_constant=refuse)
