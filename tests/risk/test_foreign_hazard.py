"""Hazard curves with errors: one line with the file, the line, the value and what is allowed."""

from __future__ import annotations

from pathlib import Path

import pytest

from rockframe.errors import InputError
from rockframe.risk import read_hazard

_OPENQUAKE = "#,,\"generated_by='OpenQuake', investigation_time={years}, imt='{imt}'\"\n"
_SITE = "lon,lat,depth,poe-0.1,poe-0.5\n1.0,2.0,0.0,{first},0.01\n"

#: Text of the file, and the message after its name. Each was a traceback, or lacked place or value.
CASES = {
    "power of ten without digits": (
        _OPENQUAKE.format(years="1e", imt="PGA") + _SITE.format(first="0.1"),
        ":1: investigation_time '1e'. Must be a number of years above 0.",
    ),
    "no time": (
        "#,,\"imt='PGA'\"\n" + _SITE.format(first="0.1"),
        ":1: no investigation_time. Must be a number of years above 0.",
    ),
    "other measure": (
        _OPENQUAKE.format(years="50", imt="CAV") + _SITE.format(first="0.1"),
        ":1: is of imt 'CAV'. Must be PGA, PGV or SA(T).",
    ),
    "no number": (
        _OPENQUAKE.format(years="50", imt="PGA") + _SITE.format(first="nan"),
        ":3: column 'poe-0.1': 'nan'. Must be a number.",
    ),
    "short row": (
        _OPENQUAKE.format(years="50", imt="PGA") + "lon,lat,depth,poe-0.1,poe-0.5\n1,2,0,0.1\n",
        ":3: column 'poe-0.5': ''. Must be a number.",
    ),
    "no place": (
        _OPENQUAKE.format(years="50", imt="PGA") + "lon,lat,poe-0.1,poe-0.5\neast,2,0.1,0.01\n",
        ":3: row 'east, 2, 0.1, 0.01' without longitude and latitude [degree].",
    ),
    "overflow": (
        "pga_g,annual_rate\n0.1,0.01\n1e308,0.001\n",
        ":3: pga_g 1e+308. Must be above 0 and at most 50.",
    ),
    "unsorted": (
        "pga_g,annual_rate\n0.2,0.01\n0.1,0.001\n",
        ":3: pga_g 0.1 after 0.2. Must be larger.",
    ),
    "twice": (
        "pga_g,annual_rate\n0.2,0.01\n0.2,0.001\n",
        ":3: pga_g 0.2 after 0.2. Must be larger.",
    ),
    "rising": (
        "pga_g,annual_rate\n0.1,0.01\n0.2,0.02\n",
        ":3: annual_rate 0.02 after 0.01. Must be smaller.",
    ),
    "zero": (
        "pga_g,annual_rate\n0.1,0.01\n0.2,0\n",
        ":3: annual_rate 0. Must be above 0.",
    ),
    "one point": ("pga_g,annual_rate\n0.1,0.01\n", ":2: 1 points. Must be two or more."),
    "equal": (
        "pga_g,probability_in_50_years\n0.1,0.01\n0.2,0.01\n0.3,0.01\n",
        ":4: 1 different rates at this site. Must be two or more.",
    ),
    "no years": (
        "pga_g,probability_in_0_years\n0.1,0.01\n0.2,0.001\n",
        ":1: columns pga_g, probability_in_0_years. Must be annual_rate and one of ",
    ),
    "quote": ('"', ": not a table (line 1: unexpected end of data). Must be CSV in UTF-8."),
    "huge line": ("x" * 200_000, ": not a table (line 1: field larger than field limit "),
    "many columns": (
        "1," * 100_000,
        ":1: columns " + "1, " * 26 + "1,. Must be annual_rate and one of ",
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_an_error_names_line_value_and_what_is_allowed(case: str, tmp_path: Path) -> None:
    text, message = CASES[case]
    path = tmp_path / "curve.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_hazard(path)
    assert str(caught.value).startswith(f"{path}{message}")
    assert len(caught.value.reason) < 300


def test_probabilities_as_rates_are_named_with_their_line(tmp_path: Path) -> None:
    path = tmp_path / "curve.csv"
    path.write_text("pga_g,annual_rate\n0.001,0.99\n0.01,0.98\n")
    with pytest.raises(InputError, match=r"csv:3: annual_rate 0\.99, then 0\.98: level near 1"):
        read_hazard(path)
