"""Options of figures and of the report."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from rockframe.options.model import Options


class FigureOptions(Options):
    """The figures of single records, of screenings and of spectra."""

    most: Annotated[int, Field(ge=0)] = 24
    """Largest number of figures of single records; of more, those under which a structure stands
    with the largest rotation. 0 for no figures at all."""


class ReportOptions(Options):
    """The page of the run."""

    histories: Annotated[int, Field(ge=1)] = 150
    """Largest number of histories in the page; of more, those that stand with the largest
    rotation come first."""
    rows: Annotated[int, Field(ge=1)] = 5000
    """Largest number of rows of the table in the page; of more, the same come first, and all are
    counted."""
