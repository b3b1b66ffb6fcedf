"""A quantity is declared once: files, tables, workbooks, pages and the explorer follow."""

from __future__ import annotations

import csv
import json
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import netCDF4
import openpyxl
import pytest
import xarray as xr

from rockframe import Pulse, RespondOptions, RockingFrame, assess, bundled_records
from rockframe.options.respond import ScreenOptions
from rockframe.quantities import (
    BANDED,
    FORCES,
    IN_MATRICES,
    LIMITED,
    PEAKS,
    QUANTILES,
    QUANTITIES,
)
from rockframe.results.reading import opened
from rockframe.results.response import write_responses
from rockframe.results.schema import KINDS
from rockframe.results.tables.table import response_rows
from rockframe.results.writing import write
from rockframe.rocking import JointForces, Response

PULSE = Pulse(wavelet="symmetric_ricker", a_p=3.0, T_p=1.2)
#: Declares a further quantity and says how a response gives it; then runs commands.
ADDS = """
import json, sys
from pathlib import Path
import rockframe.quantities as quantities

text = Path(quantities.__file__).read_text(encoding="utf-8")
new = '''_DECLARED: Final = (
    Quantity(name="peak_path", units="m", long_name="longest way of the deck", symbol="path",
             shown_unit="cm", factor=100.0, form=".1f", taken="response",
             later=True),'''
before = "_DECLARED: Final = ("
assert before in text
exec(compile(text.replace(before, new), quantities.__file__, "exec"), vars(quantities))

from rockframe.rocking import Response

Response.peak_path = property(lambda response: 2.0 * response.peak_u)

from rockframe.cli.main import main

folder, record = sys.argv[1:]
table = ("--margins", "none", "--ensemble-members", "0", "--surrogates", "0", "--format", "xlsx")
assert main(["table1", "--records", record, "--output", folder, *table]) == 0
assert main(["report", folder]) == 0

from rockframe import open_records
from rockframe.explorer.answer import ExploredMotion, answer, read_settings
from rockframe.rocking import as_ground

with open_records(Path(folder, "records.nc")) as file:
    record = file.read(file.names[0])
sizes = {"height": "9.6", "width": "1.6", "mass_ratio": "4", "restitution_factor": "1"}
asked = {"section": "rectangular", "scale": "1", "vertical": "0", "pulse": "0"}
times = {"from": "0", "to": "100", "record": record.record_id}
motions = {record.record_id: ExploredMotion(record, as_ground(record))}
facts = answer(motions, read_settings({**sizes, **asked, **times})).facts()
print(json.dumps(facts["peaks"]))

import math
from rockframe.results.reading import opened
from rockframe.results.tables.table import response_rows
from rockframe.results.writing import write

earlier = Path(folder, "earlier.nc")
with opened(Path(folder, "response.nc"), "response") as file:
    rest = file.load().drop_vars("peak_path")
    write(rest, earlier, "response", input_sha256={}, parameters={})
rows = response_rows(earlier)
assert rows and all(math.isnan(row["peak_path_m"]) for row in rows)
"""


def test_a_further_quantity_takes_a_declaration_and_a_property(tmp_path: Path) -> None:
    """It is in file, table, workbook, page and explorer, and no other place names it."""
    record, folder = bundled_records() / "Ridgecrest2019-CCC.V1", tmp_path / "run"
    script = [sys.executable, "-c", ADDS, str(folder), str(record)]
    done = subprocess.run(script, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    with netCDF4.Dataset(folder / "response.nc") as file:
        plane = file["components"][:] == ""  # responses in both directions do not have it
        path, u = (file[name][:][plane] for name in ("peak_path", "peak_u"))
        assert file["peak_path"].units == "m"
    assert path.tolist() == pytest.approx(2.0 * u)
    with (folder / "table.csv").open(newline="", encoding="utf-8") as stream:
        rows = [row for row in csv.DictReader(stream) if not row["components"]]
    assert [float(row["peak_path_m"]) for row in rows] == pytest.approx(path.ravel().tolist())
    sheet = openpyxl.load_workbook(folder / "table.xlsx")["responses"]
    assert "peak_path [m]" in [cell.value for cell in sheet[1]]
    assert "path, nominal" in (folder / "report.html").read_text(encoding="utf-8")
    peaks = dict(json.loads(done.stdout.splitlines()[-1]))
    assert peaks["nominal path"].endswith(" cm")
    assert "peak_path" not in {one.name for one in PEAKS}


def test_a_file_without_a_later_quantity_opens(tmp_path: Path) -> None:
    """Files of an earlier build lack the bands of later quantities; tables leave them unknown."""
    frame = RockingFrame(height=8.0, width=1.0, name="column")
    found = assess(frame, PULSE, RespondOptions(margins="none")).sel()
    origin: dict[str, Any] = {"input_sha256": {}, "parameters": {}}
    whole, path = tmp_path / "whole.nc", tmp_path / "response.nc"
    write_responses([("motion", [found])], [frame], whole, **origin)
    later = BANDED[-1].band
    with opened(whole, "response") as dataset:
        write(dataset.load().drop_vars(later), path, "response", **origin)
    with xr.open_dataset(path, engine="rockframe") as earlier:
        assert later not in earlier
        assert "peak_u_band" in earlier
    (row,) = response_rows(path)
    assert math.isnan(row[BANDED[-1].column(0.5)])


def test_names_derive_from_one_declaration() -> None:
    for name, quantity in QUANTITIES.items():
        assert quantity.name == name
        assert quantity.column().startswith(name)
        columns = list(quantity.band_columns)
        assert columns == [quantity.column(share) for share in QUANTILES]
    assert QUANTITIES["peak_impact_velocity"].column(0.84) == "peak_impact_velocity_84_m_s"
    assert QUANTITIES["peak_tendon_force"].column() == "peak_tendon_force_n"


def test_python_and_files_have_the_names_of_the_quantities() -> None:
    response = KINDS["response"]
    for quantity in PEAKS:
        assert isinstance(getattr(Response, quantity.name), property)
        assert response[quantity.name].units == quantity.units
    for quantity in BANDED:
        assert response[quantity.band].source == f"ensemble.bands.{quantity.name}"
    joints = set(JointForces.__dataclass_fields__)
    assert {one.name for one in FORCES if one.taken == "forces"} == joints
    for quantity in LIMITED:
        assert f"limit_{quantity.column()}" in ScreenOptions.model_fields
    assert {one.name for one in IN_MATRICES} <= {one.name for one in PEAKS}
