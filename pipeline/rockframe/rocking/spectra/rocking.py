"""Rocking spectra: peak rotation and rate under a motion, over 2 pi / p of the columns.

They follow Makris and Konstantinidis (2003), with the restitution of eq (43), and with p-hat of the
frame if there is a beam.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rockframe.engines.engine import Engine, OneProcess, map_tasks
from rockframe.errors import ParameterError
from rockframe.frame import RockingFrame
from rockframe.notebook import Shown
from rockframe.rocking.response import Motion
from rockframe.rocking.scenarios import Scenarios, respond_scenarios
from rockframe.rocking.spectra.overturning import columns_of
from rockframe.rocking.verdict import Verdict

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

Float = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class RockingSpectrum(Shown):
    """Peaks over motion, slenderness, mass ratio and 2 pi / p.

    Parameters
    ----------
    slenderness, mass_ratio, column_period : array
        Coordinates of the last three dimensions [rad], [1], [s]. The first dimension is the motion.
    verdict : array of int8
        Values of `Verdict`.
    peak_rotation_ratio, peak_velocity : array
        Largest |theta| / slenderness [1] and |rate| [rad s-1], including free rocking after the end
        of the motion; for frames that overturn, until overturning.
    """

    slenderness: Float
    mass_ratio: Float
    column_period: Float
    verdict: NDArray[np.int8]
    peak_rotation_ratio: Float
    peak_velocity: Float

    def facts(self) -> dict[str, str]:
        """Return sizes and number of overturned frames, for the table in notebooks."""
        names = ("motions", "slendernesses", "mass ratios", "column periods")
        said = {name: str(size) for name, size in zip(names, self.verdict.shape, strict=True)}
        fallen = int((self.verdict == Verdict.OVERTURNS).sum())
        return {**said, "overturned": f"{fallen} of {self.verdict.size}"}

    def draw(self, axes: Axes) -> None:
        """Draw the largest theta / alpha under the first motion, over 2 pi / p of the columns."""
        for k, slenderness in enumerate(self.slenderness):
            for m, ratio in enumerate(self.mass_ratio):
                label = f"{math.degrees(slenderness):.3g}°, mass ratio {ratio:g}"
                axes.plot(self.column_period, self.peak_rotation_ratio[0, k, m], label=label)
        axes.set(xlabel="2π/p [s]", ylabel="largest θ/α", ylim=(0.0, 1.5))
        axes.legend(fontsize=8)

    def to_xarray(self) -> xr.Dataset:
        """Return verdicts and peaks over motion, slenderness, mass ratio and column period."""
        import xarray as xr

        dims = ("motion", "slenderness", "mass_ratio", "column_period")
        units = {"verdict": "1", "peak_rotation_ratio": "1", "peak_velocity": "rad s-1"}
        return xr.Dataset(
            {name: (dims, getattr(self, name), {"units": unit}) for name, unit in units.items()},
            {name: getattr(self, name) for name in dims[1:]},
        )


def rocking_spectrum(
    motions: Sequence[Motion],
    slendernesses: ArrayLike,
    mass_ratios: ArrayLike,
    column_periods: ArrayLike,
    *,
    engine: Engine | None = None,
) -> RockingSpectrum:
    """Compute the rocking spectra of motions.

    Parameters
    ----------
    motions : sequence of Record, Pulse or GroundAcceleration
        Ground motions, as for `respond`.
    slendernesses : array_like, shape (slenderness,)
        Slenderness of the columns, which are rectangular [rad].
    mass_ratios : array_like, shape (mass_ratio,)
        Mass of the beam over that of all columns [1].
    column_periods : array_like, shape (column_period,)
        2 pi / p of the columns alone [s].
    engine : Engine, optional
        Where to compute; by default in this process. The result has the same bits with any engine.

    Raises
    ------
    ParameterError
        If there is no motion, an array is empty, not increasing or not positive, or a column would
        be smaller than 1 mm or larger than 1 km.

    Examples
    --------
    >>> from rockframe import Pulse
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=0.4 * 9.81, T_p=1.0)
    >>> found = rocking_spectrum([pulse], [0.17453292519943295], [0.0, 4.0], [3.0, 6.0])
    >>> found.peak_rotation_ratio[0, 0].round(4).tolist()
    [[0.5527, 0.1271], [0.355, 0.0848]]
    """
    if not motions:
        raise ParameterError("Invalid number of motions, 0. Must be one or more.")
    frames = columns_of(slendernesses, mass_ratios, column_periods)
    slenderness, mass_ratio, period = (
        np.atleast_1d(np.asarray(row, dtype=np.float64))
        for row in (slendernesses, mass_ratios, column_periods)
    )
    tasks = [(motion, frames) for motion in motions]
    peaks = list(map_tasks(_respond, tasks, engine=OneProcess() if engine is None else engine))
    shape = (len(motions), slenderness.size, mass_ratio.size, period.size)
    return RockingSpectrum(
        slenderness,
        mass_ratio,
        period,
        *(
            np.stack([getattr(of_motion, name) for of_motion in peaks]).reshape(shape)
            for name in ("verdict", "peak_rotation_ratio", "peak_velocity")
        ),
    )


def _respond(task: tuple[Motion, tuple[RockingFrame, ...]]) -> Scenarios:
    motion, frames = task
    number = len(frames)
    return respond_scenarios(
        [motion], frames, np.zeros(number, dtype=int), np.arange(number), np.ones(number)
    )
