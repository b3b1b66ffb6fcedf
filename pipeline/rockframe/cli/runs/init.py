"""rockframe init: write a commented study file and its schema for editors."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the argument: the name of the study."""
    parser.add_argument(
        "name", help="name of the study; NAME.toml is written to the current folder"
    )


def run(options: argparse.Namespace) -> int:
    """Write both files, unless the study file exists."""
    from pydantic import TypeAdapter, ValidationError

    from rockframe.cli.console import show_json
    from rockframe.errors import InputError, ParameterError
    from rockframe.options.fields import Name
    from rockframe.provenance import whole_file
    from rockframe.study.commented import SCHEMA, commented_study, schema

    if options.name.endswith(".toml"):
        bare = options.name.removesuffix(".toml")
        raise ParameterError(f"Invalid name {options.name!r}. Must be without .toml: {bare}.")
    try:
        name = TypeAdapter(Name).validate_python(options.name)
    except ValidationError:
        raise ParameterError(
            f"Invalid name {options.name!r}. Must be 1 to 64 letters, digits, points, hyphens or "
            "underscores."
        ) from None
    study, beside = Path(f"{name}.toml"), Path(SCHEMA)
    if study.exists():
        raise InputError(study, "is there already. Must be another name.")
    for path, text in ((study, commented_study(name)), (beside, schema())):
        with whole_file(path) as partial:
            partial.write_text(text, encoding="utf-8")
    if options.json:
        show_json({"study": str(study), "schema": str(beside)})
    else:
        print(f"{study}, {beside}")
        print(f"rockframe run {study} --output {name}")
    return 0
