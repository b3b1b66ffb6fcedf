"""Record the output of ``--json``: keys and types of each command, for the bundled records.

``python -m tests.recorded.shapes`` writes ``json.json`` beside this file. It omits `fetch`, which
needs a service, `explore`, which runs one, `step`, which prints nothing, and most claims of
`paper`.
"""

from __future__ import annotations

import io
import json
import tempfile
from collections.abc import Iterator
from contextlib import chdir, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

from tests.recorded.record import write

from rockframe.cli.main import main
from rockframe.study.structures import bundled_records

_BRIDGE = """
[[structure]]
name = "bent"
height_m = 9.6
width_m = 1.6
section = "circular"
mass_ratio = 4.0
density_kg_m3 = 2500.0
[compare.isolated]
period_s = 3.0
strength_ratio = 0.05
"""
_STUDY = """
name = "small"
[records]
paths = ["{record}"]
[pulse]
surrogates = 0
[respond]
margins = "none"
[respond.ensemble]
members = 16
[figures]
most = 0
"""
_FEW = "--structure bridge-bent --ensemble-members 16"
#: Arguments of each command, in an order in which their input files exist.
_COMMANDS = """
formats
ingest {record} --output records.nc
select records.nc --target target.csv --motions 1 --output selected.nc
pulse records.nc --surrogates 0 --output pulses.nc
respond records.nc {few} --output response.nc
screen records.nc --margins none --pooled --measures cav --output screen.nc
compare records.nc --structures bridge.toml --output compare.nc
spectrum --wavelet symmetric_ricker --slenderness-degree 14 --frequency-ratio 3 --output spectrum.nc
spectrum --records records.nc --column-period-s 4 --slenderness-degree 14 --output r.nc
table records.nc pulses.nc response.nc --output table.csv
figure spectrum.nc --output drawn
figure 5 --output figure.png
paper --claim eq-43
init mine
run small.toml --output run --plan
run small.toml --output run
status run
show run Ridgecrest2019-CLC-360
verify run
report run --output report.html
table1 --records {record} {few} --surrogates 0 --histories none --output t
"""


def lines(value: Any, at: str = "") -> Iterator[str]:
    """Yield the path and the type of each value; elements of a list share a path."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from lines(inner, f"{at}.{key}")
    elif isinstance(value, list):
        for inner in value:
            yield from lines(inner, f"{at}[]")
    else:
        number = isinstance(value, int | float) and not isinstance(value, bool)
        yield f"{at} {'number' if number else type(value).__name__}"


def shapes(home: Path) -> dict[str, list[str]]:
    """Return the paths and types that each command prints; run in an empty folder."""
    record = bundled_records() / "Ridgecrest2019-CLC.V1"
    (home / "bridge.toml").write_text(_BRIDGE)
    (home / "target.csv").write_text("period_s,sa_g\n0.5,0.6\n1,0.3\n2,0.1\n")
    (home / "small.toml").write_text(_STUDY.format(record=record))
    found: dict[str, set[str]] = {}
    for line in _COMMANDS.strip().splitlines():
        words = line.format(record=record, few=_FEW).split()
        printed, said = io.StringIO(), io.StringIO()
        with chdir(home), redirect_stdout(printed), redirect_stderr(said):
            assert main([*words, "--json"]) == 0, (words, said.getvalue())
        found.setdefault(words[0], set()).update(lines(json.loads(printed.getvalue())))
    return {verb: sorted(types) for verb, types in found.items()}


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        write("json", shapes(Path(folder)))
