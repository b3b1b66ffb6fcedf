"""A commented study file, and the JSON schema for editors: both follow from the model."""

from __future__ import annotations

import json
import textwrap
from typing import Any, Final

from pydantic_core import PydanticUndefined

from rockframe.study.study import StudyTables
from rockframe.study.toml import Strict, tables_of

#: What is put behind ``#`` for keys without a default.
_EXAMPLES: Final[dict[str, str]] = {
    "paths": '["motions"]',
    "units": '"g"',
    "time_step_s": "0.01",
    "station_xml": '"station.xml"',
    "water_level_db": "60.0",
    "catalogue": '"catalogue.csv"',
    "limits": '"limits.toml"',
    "structures": '"structures.toml"',
    "magnitude": "[6.0, 8.0]",
    "epicentral_distance_km": "[0.0, 50.0]",
    "vs30_m_s": "[360.0, 1500.0]",
    "pga_g": "[0.1, 3.0]",
    "pgv_m_s": "[0.1, 3.0]",
    "azimuth_degree": "30.0",
    "strike_degree": "120.0",
    "wavelet": '["antisymmetric_ricker"]',
    "pulse_wavelet": '"symmetric_ricker"',
    "azimuths_degree": "{ from = 0.0, to = 170.0, count = 18 }",
    "pulse_period_s": "[0.5, 5.0]",
    "pulse_length_m": "[0.1, 9.0]",
    "pulse_like": "true",
    "hazard": '"hazard.csv"',
    "dimension": '"height"',
    "range": "[4.0, 12.0]",
    "slenderness_degree": "[10.0, 14.0]",
    "frequency_ratio": "{ from = 1.0, to = 8.0, count = 71 }",
    "amplitude_step": "0.005",
    "half_cycles": "2.0",
    "column_period_s": "[2.0, 3.0, 4.0]",
}
#: Name of the schema, in the folder of the studies that point to it.
SCHEMA: Final = "study.schema.json"
_STRUCTURE: Final = """\
# Structures of this study; without any, those that rockframe ships.
# [[structure]]
# name = "bridge-bent"
# height_m = 9.6     # of a column
# width_m = 1.6
# mass_ratio = 4.0   # mass of the beam over that of all columns; 0: a column alone
"""


def commented_study(name: str) -> str:
    """Return the text of a study of the bundled records with every key, its meaning and default.

    Examples
    --------
    >>> commented_study("mine").splitlines()[2]
    'name = "mine"'
    """
    lines = [f"#:schema ./{SCHEMA}", "# A study: rockframe run FILE --output FOLDER", ""]
    lines[2:] = [f'name = "{name}"', "", *_keys(StudyTables, skip=("name",))]
    for key, field in StudyTables.model_fields.items():
        table = tables_of(field.annotation)
        if table is None or key == "structure":
            continue
        keys = _keys(table)
        for inner, nested in table.model_fields.items():
            below = tables_of(nested.annotation)
            if below is not None:
                keys += ["", *_comment(below.__doc__ or ""), f"[{key}.{inner}]", *_keys(below)]
        heading = [f"[{key}]", *keys]
        if field.default is None and key != "records":  # a stage that is only done if it is asked
            heading = [line if line[:1] in ("#", "") else f"# {line}" for line in heading]
        lines += ["", *_comment(table.__doc__ or ""), *heading]
    return "\n".join([*lines, "", _STRUCTURE])


def schema() -> str:
    """Return the JSON schema of study files, as text.

    Examples
    --------
    >>> json.loads(schema())["additionalProperties"]
    False
    """
    return json.dumps(StudyTables.model_json_schema(), indent=2, sort_keys=True) + "\n"


def _keys(table: type[Strict], skip: tuple[str, ...] = ()) -> list[str]:
    lines: list[str] = []
    for key, field in table.model_fields.items():
        if key in skip or tables_of(field.annotation) is not None:
            continue
        lines += _comment(field.description or "")
        if field.default is None or field.default is PydanticUndefined:
            lines.append(f"# {key} = {_EXAMPLES[key]}")
        else:
            lines.append(f"{key} = {_toml(field.default)}")
    return lines


def _comment(text: str) -> list[str]:
    first = " ".join(text.split("\n\n")[0].split())
    return [f"# {line}" for line in textwrap.wrap(first, 98)]


def _toml(value: Any) -> str:
    """JSON is TOML for texts, numbers, true, false, and lists of them."""
    return json.dumps(list(value) if isinstance(value, tuple) else value, ensure_ascii=False)
