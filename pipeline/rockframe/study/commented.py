"""A commented study file and the JSON schema for editors, both derived from the model."""

from __future__ import annotations

import json
import textwrap
from typing import Any, Final

from pydantic_core import PydanticUndefined

from rockframe.options.model import Options, options_within
from rockframe.study.study import StudyTables

#: File name of the schema, beside the studies that refer to it.
SCHEMA: Final = "study.schema.json"
_STRUCTURE: Final = """\
# Structures of this study; without any, those that rockframe ships.
# [[structure]]
# name = "bridge-bent"
# height_m = 9.6     # of a column
# width_m = 1.6
# mass_ratio = 4.0   # mass of the beam over that of all columns; 0: a column alone
# Columns of other shapes: section, top_width_m, inner_width_m, depth_m, inner_depth_m,
# inertia_ratio, centre_of_gravity_m. Impacts that lose more: restitution_factor.
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
        table = options_within(field.annotation)
        if table is None or key == "structure":
            continue
        keys = _keys(table)
        for inner, nested in table.model_fields.items():
            below = options_within(nested.annotation)
            if below is not None:
                keys += ["", *_comment(below.__doc__ or ""), f"[{key}.{inner}]", *_keys(below)]
        heading = [f"[{key}]", *keys]
        if field.default is None and key != "records":  # a stage that runs only if requested
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


def _keys(table: type[Options], skip: tuple[str, ...] = ()) -> list[str]:
    lines: list[str] = []
    for key, field in table.model_fields.items():
        if key in skip or options_within(field.annotation) is not None:
            continue
        lines += _comment(field.description or "")
        if field.default is None or field.default is PydanticUndefined:
            lines.append(f"# {key} = {_toml((field.examples or [''])[0])}")
        else:
            lines.append(f"{key} = {_toml(field.default)}")
    return lines


def _comment(text: str) -> list[str]:
    first = " ".join(text.split("\n\n")[0].split())
    return [f"# {line}" for line in textwrap.wrap(first, 98)]


def _toml(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_toml(inner)}" for key, inner in value.items()) + " }"
    return json.dumps(value, ensure_ascii=False)  # JSON is TOML for texts, numbers, and lists
