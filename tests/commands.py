"""Helpers for the tests of several commands."""

from __future__ import annotations

import argparse
from pathlib import Path

from rockframe.cli.main import main, parser

STRUCTURE = """
[[structure]]
name = "portico"
height_m = 4.0
width_m = 0.8
mass_ratio = 0.5
"""


def run(*words: str | Path) -> int:
    return main([str(word) for word in words])


def ingested(motion: Path) -> Path:
    output = motion.with_name("records.nc")
    stated = ("--units", "g", "--time-step", "0.01", "--workers", "0")
    assert run("ingest", motion, *stated, "--output", output) == 0
    return output


def commands() -> dict[str, argparse.ArgumentParser]:
    """Return the parser of each command."""
    (verbs,) = (a for a in parser()._actions if isinstance(a, argparse._SubParsersAction))  # noqa: SLF001
    return dict(verbs.choices)


def options_of(command: str) -> list[argparse.Action]:
    """Return the arguments of a command, as its parser states them."""
    return list(commands()[command]._actions)  # noqa: SLF001
