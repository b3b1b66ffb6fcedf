"""rockframe formats: list the supported formats of records."""

from __future__ import annotations

import argparse


def add_arguments(_parser: argparse.ArgumentParser) -> None:
    """Add no arguments."""


def run(options: argparse.Namespace) -> int:
    """Print the table of formats."""
    from rockframe.cli.console import show_json, show_table
    from rockframe.ingest import FORMATS

    if options.json:
        show_json(
            [
                {
                    "name": entry.name,
                    "obspy_name": entry.obspy_name,
                    "extensions": entry.extensions,
                    "description": entry.description,
                }
                for entry in FORMATS
            ]
        )
        return 0
    rows = [
        [entry.name, entry.obspy_name, " ".join(entry.extensions), entry.description]
        for entry in FORMATS
    ]
    show_table(
        "Formats of strong-motion records", ["name", "obspy", "usual endings", "what it is"], rows
    )
    return 0
