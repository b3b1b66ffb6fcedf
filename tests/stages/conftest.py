"""Stages and their commands draw figures that few tests here look at, and those not as pictures."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from tests.conftest import coarse


@pytest.fixture(scope="module", autouse=True)
def coarse_figures() -> Iterator[None]:
    """Draw the figures of all tests here coarsely."""
    with coarse():
        yield
