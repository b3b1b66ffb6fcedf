"""Runs draw figures that no test here looks at."""

from __future__ import annotations

import pytest


@pytest.fixture(scope="module", autouse=True)
def _coarse(coarse_figures: None) -> None:
    pass
