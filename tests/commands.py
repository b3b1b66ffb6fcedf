"""Helpers for the tests of several commands."""

from __future__ import annotations

from pathlib import Path

from rockframe.cli.main import main

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
