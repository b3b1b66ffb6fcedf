"""Overturning spectra: verdicts, and the least amplitude that overturns."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rockframe.notebook import Shown
from rockframe.rocking.spectra.scan import Scan
from rockframe.wavelets.pulse import Pulse

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

Float = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class OverturningSpectrum(Shown):
    """Verdicts over pulse, slenderness, mass ratio, frequency ratio and amplitude.

    A line is one combination of pulse, slenderness, mass ratio and frequency ratio; lines are
    sorted in the order of these dimensions.

    Parameters
    ----------
    pulses : tuple of Pulse
        The pulses. Only their forms are used, not amplitude, period or time.
    slenderness, mass_ratio, frequency_ratio, amplitude : array
        Coordinates of these dimensions [rad], [1], [1], [1].
    found : Scan
        Verdicts, impacts and intervals of the lines.
    """

    pulses: tuple[Pulse, ...]
    slenderness: Float
    mass_ratio: Float
    frequency_ratio: Float
    amplitude: Float
    found: Scan

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """Number of pulses, slendernesses, mass ratios and frequency ratios."""
        sizes = (self.slenderness.size, self.mass_ratio.size, self.frequency_ratio.size)
        return len(self.pulses), *sizes

    @property
    def minimum_overturning_amplitude(self) -> Float:
        """Least amplitude that overturns, a_p / (g tan slenderness) [1]; NaN if none does."""
        least = [bounds[0, 0] if len(bounds) else math.nan for bounds in self.found.intervals()]
        return np.array(least).reshape(self.shape)

    def facts(self) -> dict[str, str]:
        """Return the sizes of the dimensions, for the table in notebooks."""
        names = ("pulses", "slendernesses", "mass ratios", "frequency ratios")
        said = {name: str(size) for name, size in zip(names, self.shape, strict=True)}
        return {**said, "amplitudes": f"{self.amplitude.size} up to {self.amplitude[-1]:g}"}

    def draw(self, axes: Axes) -> None:
        """Draw the least amplitude that overturns, for the first pulse."""
        least = self.minimum_overturning_amplitude[0]
        for k, slenderness in enumerate(self.slenderness):
            for m, ratio in enumerate(self.mass_ratio):
                label = f"{math.degrees(slenderness):.3g}°, mass ratio {ratio:g}"
                axes.plot(self.frequency_ratio, least[k, m], label=label)
        axes.set(xlabel="ω_p/p", ylabel="least a_p/(g tan α)")
        axes.legend(fontsize=8)

    def to_xarray(self) -> xr.DataArray:
        """Return the least amplitude that overturns, a_p / (g tan alpha) [1]."""
        import xarray as xr

        dims = ("slenderness", "mass_ratio", "frequency_ratio")
        return xr.DataArray(
            self.minimum_overturning_amplitude,
            {name: getattr(self, name) for name in dims},
            ("pulse", *dims),
            name="minimum_overturning_amplitude",
            attrs={"units": "1"},
        )
