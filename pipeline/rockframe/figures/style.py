"""The one style of all figures, and saving them whole with the same bytes each time."""

from __future__ import annotations

from contextlib import AbstractContextManager
from pathlib import Path
from typing import Final

import matplotlib as mpl
from matplotlib.figure import Figure

from rockframe.provenance import whole_file

_STYLE: Final = Path(__file__).parent / "style.mplstyle"


def styled() -> AbstractContextManager[None]:
    """Return the context in which a figure is drawn and saved."""
    return mpl.rc_context(fname=_STYLE)


def save(figure: Figure, path: Path) -> None:
    """Write a figure as PNG, whole or not at all.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    with styled(), whole_file(path) as partial:
        figure.savefig(partial, format="png", metadata={"Software": None})
