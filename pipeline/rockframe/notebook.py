"""Display of objects in notebooks, as a small table and a drawing."""

from __future__ import annotations

import base64
import io
from abc import ABC, abstractmethod
from collections.abc import Mapping
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes


class Shown(ABC):
    """Base class of objects that notebooks show as a table and a drawing."""

    @abstractmethod
    def facts(self) -> Mapping[str, str]:
        """Return the rows of the table: name, and value with its unit."""

    @abstractmethod
    def draw(self, axes: Axes) -> None:
        """Draw the object into axes."""

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the object, and return the axes.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Axes to draw into; by default those of a new figure.
        """
        if ax is None:
            from matplotlib import pyplot as plt

            ax = plt.subplots(figsize=(6.4, 2.6), layout="constrained")[1]
        self.draw(ax)
        return ax

    def __repr__(self) -> str:
        """Return the name of the class and the rows of the table, in one line."""
        rows = "; ".join(f"{name} {value}" for name, value in self.facts().items())
        return f"<{type(self).__name__}: {rows}>"

    def _repr_html_(self) -> str:
        from matplotlib.figure import Figure

        figure, stream = Figure(figsize=(6.4, 2.6), layout="constrained"), io.BytesIO()
        self.draw(figure.subplots())
        figure.savefig(stream, format="png", dpi=100)
        cells = (
            f"<tr><th>{escape(name)}</th><td>{escape(value)}</td></tr>"
            for name, value in self.facts().items()
        )
        image = base64.b64encode(stream.getvalue()).decode()
        return (
            f"<table><caption>{type(self).__name__}</caption>{''.join(cells)}</table>"
            f'<img alt="{type(self).__name__}" src="data:image/png;base64,{image}">'
        )


def history_dataset(
    time: NDArray[np.float64],
    histories: Mapping[str, tuple[NDArray[np.float64], str, str]],
    **attrs: Any,
) -> xr.Dataset:
    """Return a dataset of histories over time [s]; each is (values, unit, long name)."""
    import xarray as xr

    return xr.Dataset(
        {
            name: ("time", values, {"units": units, "long_name": words})
            for name, (values, units, words) in histories.items()
        },
        {"time": ("time", time, {"units": "s"})},
        attrs,
    )
