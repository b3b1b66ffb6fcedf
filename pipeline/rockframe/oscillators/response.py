"""Responses of isolated decks and monolithic frames to ground motions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from rockframe.engines.engine import on_threads
from rockframe.notebook import Shown, history_dataset
from rockframe.oscillators import kernel
from rockframe.record import Record
from rockframe.rivals import FixedFrame, IsolatedDeck
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.response import as_ground
from rockframe.rocking.scenarios import scales_of
from rockframe.units import GRAVITY
from rockframe.wavelets.pulse import Pulse

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

Float = NDArray[np.float64]
Oscillator = IsolatedDeck | FixedFrame
Motion = Record | Pulse | GroundAcceleration


@dataclass(frozen=True, eq=False)
class OscillatorPeaks:
    """Peaks of oscillators, including free vibration after the end of the motion.

    All arrays have the same shape.

    Parameters
    ----------
    peak_displacement : array
        Largest |u| [m], located between the nodes; infinite if the oscillator collapses, which only
        P-delta can cause.
    peak_time : array
        Time of the largest |u| [s]; NaN if the oscillator never moves, or collapses.
    peak_force_ratio : array
        Largest sum of restoring and damping force over the weight [1], located between the nodes.
        It is the largest absolute acceleration [g] and the shear of the piers. NaN if the
        oscillator collapses.
    residual_displacement : array
        Displacement at which the oscillator stays, or about which it vibrates without yielding [m];
        infinite if it collapses. It is 0 if the oscillator still yields 1,000,000 steps after the
        motion, because its strength is a tiny share of its restoring force and it has little or no
        damping; it will then rest within strength / stiffness of 0.
    ductility : array
        Peak displacement over yield displacement [1]; NaN without a yield displacement.
    first_yield_time : array
        Time of the first yielding or sliding [s]; NaN if never.
    yields : array of int
        Number of excursions into yielding, or of slides in one direction, at most 1,000,000 steps
        after the motion.
    dissipated_energy : array
        Energy lost in yielding or friction in that time, over the weight [m].
    """

    peak_displacement: Float
    peak_time: Float
    peak_force_ratio: Float
    residual_displacement: Float
    ductility: Float
    first_yield_time: Float
    yields: NDArray[np.int64]
    dissipated_energy: Float


@dataclass(frozen=True, eq=False, repr=False)
class OscillatorResponse(Shown):
    """Histories of an oscillator under one motion, and their peaks.

    Parameters
    ----------
    model : IsolatedDeck or FixedFrame
        The oscillator.
    time, u, velocity : array, shape (nodes,)
        Time [s], displacement relative to the ground [m] and its rate [m s-1]; NaN once no ground
        acceleration of the motion can prevent collapse.
    force_ratio : array, shape (nodes,)
        Sum of restoring and damping force over the weight [1]: minus the absolute acceleration [g].
    peak_displacement, peak_time, peak_force_ratio, residual_displacement : float
        See `OscillatorPeaks`.
    ductility, first_yield_time, yields, dissipated_energy : float
        See `OscillatorPeaks`.
    """

    model: Oscillator
    time: Float
    u: Float
    velocity: Float
    force_ratio: Float
    peak_displacement: float
    peak_time: float
    peak_force_ratio: float
    residual_displacement: float
    ductility: float
    first_yield_time: float
    yields: int
    dissipated_energy: float

    def facts(self) -> dict[str, str]:
        """Return the peaks, for the table in notebooks."""
        said = {
            "bridge": self.model.name,
            "largest u": f"{self.peak_displacement:.3f} m",
            "left u": f"{self.residual_displacement:.3f} m",
            "largest force over weight": f"{self.peak_force_ratio:.3f}",
        }
        if math.isfinite(self.ductility):
            said["ductility"] = f"{self.ductility:.2f}"
        if math.isfinite(self.first_yield_time):
            said["first yields at"] = f"{self.first_yield_time:.2f} s"
        return said

    def draw(self, axes: Axes) -> None:
        """Draw u over time."""
        axes.plot(self.time, self.u, linewidth=0.9)
        axes.set(xlabel="time [s]", ylabel="u [m]")
        axes.set_title(self.model.name)

    def to_xarray(self) -> xr.Dataset:
        """Return the histories over time, with the peaks as attributes."""
        histories = {
            "u": (self.u, "m", "displacement relative to the ground"),
            "velocity": (self.velocity, "m s-1", "rate of u"),
            "force_ratio": (self.force_ratio, "1", "force, restoring and damping, over the weight"),
        }
        peaks = {field.name: getattr(self, field.name) for field in fields(OscillatorPeaks)}
        return history_dataset(self.time, histories, bridge=self.model.name, **peaks)


def respond_oscillator(
    model: Oscillator, motion: Motion, *, free_vibration: float = 0.0
) -> OscillatorResponse:
    """Return the response of an oscillator from rest, integrated to round-off.

    Parameters
    ----------
    model : IsolatedDeck or FixedFrame
        The oscillator.
    motion : Record, Pulse or GroundAcceleration
        Ground acceleration, as for `respond`; a vertical component is ignored.
    free_vibration : float
        Time after the end of the motion for which the histories continue [s]. The peaks and the
        residual displacement do not depend on it.

    Returns
    -------
    OscillatorResponse
        Histories at the nodes of the motion, and their peaks.

    Raises
    ------
    ParameterError
        If the free vibration is negative or not finite.

    Notes
    -----
    Peaks and changes of branch (start and end of yielding or sliding) are located between nodes, to
    round-off.

    Examples
    --------
    >>> deck = IsolatedDeck.friction_pendulum(radius=2.0, friction=0.06)
    >>> response = respond_oscillator(deck, Pulse(wavelet="symmetric_ricker", a_p=4.9, T_p=1.5))
    >>> round(response.peak_displacement, 4), round(response.residual_displacement, 4)
    (0.6035, -0.0011)
    """
    ground = as_ground(motion).followed_by_rest(free_vibration)
    histories = np.empty((3, ground.coefficients.shape[0] + 1))
    summary = np.empty(kernel.SUMMARY_SIZE)
    kernel.integrate(*_prepared(ground), 1.0, model.constants, histories, summary)
    peaks = _peaks(summary, np.array(model.yield_displacement))
    return OscillatorResponse(
        model=model,
        time=ground.time,
        u=histories[0],
        velocity=histories[1],
        force_ratio=histories[2] / GRAVITY,
        **{key: value.item() for key, value in vars(peaks).items()},
    )


def respond_oscillators(
    models: Sequence[Oscillator], motions: Sequence[Motion], scales: ArrayLike = (1.0,)
) -> OscillatorPeaks:
    """Compute the peaks of each oscillator under each motion at each scale.

    Parameters
    ----------
    models : sequence of IsolatedDeck or FixedFrame
        The oscillators.
    motions : sequence of Record, Pulse or GroundAcceleration
        Ground motions, as for `respond_oscillator`.
    scales : array_like, shape (scales,)
        Factor of the acceleration [1].

    Returns
    -------
    OscillatorPeaks
        Arrays of shape (motions, models, scales), with the same bits as from `respond_oscillator`.

    Raises
    ------
    ParameterError
        If there is no model, motion or scale, or a scale is not finite.

    Examples
    --------
    >>> frame = FixedFrame(period=0.5, strength_ratio=0.2)
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=4.9, T_p=1.5)
    >>> respond_oscillators([frame], [pulse], [0.1, 1.0]).ductility.round(2).tolist()
    [[[0.31, 30.54]]]
    """
    factors = scales_of(scales, models=models, motions=motions)
    constants = np.repeat([model.constants for model in models], factors.size, axis=0)
    every_scale = np.tile(factors, len(models))

    def answer(motion: Motion) -> Float:
        out = np.empty((every_scale.size, kernel.SUMMARY_SIZE))
        kernel.integrate_many(*_prepared(as_ground(motion)), every_scale, constants, out)
        return out

    found = np.stack(on_threads(answer, motions))
    yielding = np.array([model.yield_displacement for model in models])[:, None]
    shape = (len(motions), len(models), factors.size, kernel.SUMMARY_SIZE)
    return _peaks(found.reshape(shape), yielding)


def _prepared(ground: GroundAcceleration) -> tuple[Float, Float, float, float]:
    """Return rows, bounds, time step and start of a motion for the kernel."""
    step, coefficients = ground.time_step, ground.coefficients
    powers = np.arange(2 if coefficients.shape[1] <= 2 else 6)
    padded = np.pad(coefficients, ((0, 0), (0, powers.size - coefficients.shape[1])))
    rows = np.ascontiguousarray(padded)  # the kernel is compiled for one memory layout
    parts = rows * step**powers
    bounds = np.column_stack(
        [
            np.abs(parts) @ (scipy.special.perm(powers, order) / step**order)
            for order in range(kernel.BOUNDS)
        ]
    )
    if powers.size == 2:  # piecewise linear: the larger end is exact
        bounds[:, 0] = np.abs(np.cumsum(parts, axis=1)).max(axis=1)
    return rows, bounds, step, ground.start_time


def _peaks(summary: Float, yielding: Float) -> OscillatorPeaks:
    """Return the peaks in the kernel's summaries; `yielding` are the yield displacements."""
    peak = summary[..., kernel.PEAK]
    yields_at = (yielding > 0.0) & np.isfinite(yielding)
    ductility = np.divide(peak, yielding, out=np.full(peak.shape, np.nan), where=yields_at)
    return OscillatorPeaks(
        peak_displacement=peak,
        peak_time=summary[..., kernel.PEAK_TIME],
        peak_force_ratio=summary[..., kernel.PEAK_FORCE] / GRAVITY,
        residual_displacement=summary[..., kernel.RESIDUAL],
        ductility=ductility,
        first_yield_time=summary[..., kernel.FIRST_YIELD],
        yields=summary[..., kernel.YIELDS].astype(np.int64),
        dissipated_energy=summary[..., kernel.DISSIPATED] / GRAVITY,
    )
