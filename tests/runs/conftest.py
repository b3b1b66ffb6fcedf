"""Runs draw figures that no test here looks at."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from tests.conftest import coarse


@pytest.fixture(scope="module", autouse=True)
def coarse_figures() -> Iterator[None]:
    """Draw the figures of all tests here coarsely."""
    with coarse():
        yield
