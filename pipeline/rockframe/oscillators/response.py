"""Responses of isolated decks and monolithic frames to ground motions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from rockframe.engines.engine import on_threads
from rockframe.notebook import Shown, history_dataset
from rockframe.oscillators import kernel
from rockframe.rivals import COLUMN_SHARE, FixedFrame, IsolatedDeck
from rockframe.rocking.assessments import EnsembleResponse, Margin, PartResponse, verdict_of
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.response import Motion, ToPulse, as_ground, first_crossing
from rockframe.rocking.scenarios import scales_of
from rockframe.rocking.verdict import (
    MODEL_ENDS,
    ModelEnd,
    SpreadVerdict,
    Verdict,
    first_end,
    sometime,
)
from rockframe.units import GRAVITY

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

Float = NDArray[np.float64]
Oscillator = IsolatedDeck | FixedFrame


@dataclass(frozen=True)
class BaseShear:
    """Largest base shear over the weight of deck and columns [1]."""

    peak_base_shear: float


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
    base_shear : array, shape (nodes,)
        Force of the ground to the right over the weight of deck and columns [1].
    peak_base_shear : float
        Largest |base shear| at the nodes [1], until the model ends.
    model_end : ModelEnd
        Event that first ends the model: the gap of the abutment closes, or the ductility exceeds
        its limit.
    model_end_time : float
        Time of this event [s]; NaN if there is none, or if it occurs after the motion or between
        two nodes.
    gap_closed_time, closing_velocity, ductility_exceeded_time : float
        Time [s] and velocity [m s-1] at which the gap first closes, and time at which the limit of
        ductility is first exceeded; NaN if never during the motion, or without such a limit.
    overturning_time : float
        Time after which no ground acceleration of the motion prevents collapse [s]; NaN if none.
    to_pulse : ToPulse, optional
        Response to the record's pulse alone, if it was requested.
    margin : Margin, optional
        Margin against collapse, if it was requested.
    ensemble : EnsembleResponse, optional
        Response of the ensemble, if it was requested.
    forces : BaseShear, optional
        The peak base shear, if forces were requested.
    parts : tuple of PartResponse
        Responses to the motions of a sequence.
    """

    #: Names of the histories.
    HISTORIES: ClassVar = ("time", "u", "velocity", "force_ratio", "base_shear")

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
    base_shear: Float
    peak_base_shear: float = math.nan
    model_end: ModelEnd = ModelEnd.NONE
    model_end_time: float = math.nan
    gap_closed_time: float = math.nan
    closing_velocity: float = math.nan
    ductility_exceeded_time: float = math.nan
    overturning_time: float = math.nan
    to_pulse: ToPulse | None = None
    margin: Margin | None = None
    ensemble: EnsembleResponse | None = None
    forces: BaseShear | None = None
    parts: tuple[PartResponse, ...] = ()

    @property
    def structure(self) -> Oscillator:
        """The oscillator."""
        return self.model

    @property
    def verdict(self) -> Verdict:
        """Stands or, if it collapses, overturns."""
        return Verdict.OVERTURNS if math.isinf(self.peak_displacement) else Verdict.STANDS

    @property
    def peak_u(self) -> float:
        """Largest |u| [m]; infinite if the oscillator collapses."""
        return self.peak_displacement

    @property
    def peak_v(self) -> float:
        """Lift of the deck [m]: none."""
        return 0.0

    @property
    def v(self) -> Float:
        """Lift of the deck [m]: none."""
        return np.zeros_like(self.u)

    @property
    def residual_u(self) -> float:
        """Size of the residual displacement [m]; infinite if the oscillator collapses."""
        return abs(self.residual_displacement)

    @property
    def spread_verdict(self) -> SpreadVerdict:
        """The verdict, from the ensemble if the response has one, with the margin if it has one."""
        events = {name: getattr(self, name) for name in MODEL_ENDS if hasattr(self, name)}
        return replace(verdict_of(self, events), fails="collapse")

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
    >>> from rockframe import Pulse
    >>> response = respond_oscillator(deck, Pulse(wavelet="symmetric_ricker", a_p=4.9, T_p=1.5))
    >>> round(response.peak_displacement, 4), round(response.residual_displacement, 4)
    (0.6035, -0.0011)
    """
    ground = as_ground(motion).followed_by_rest(free_vibration)
    histories = np.empty((3, ground.coefficients.shape[0] + 1))
    summary = np.empty(kernel.SUMMARY_SIZE)
    kernel.integrate(*_prepared(ground), 1.0, model.constants, histories, summary)
    peaks = _peaks(summary, np.array(model.yield_displacement))
    force_ratio = histories[2] / GRAVITY
    response = OscillatorResponse(
        model=model,
        time=ground.time,
        u=histories[0],
        velocity=histories[1],
        force_ratio=force_ratio,
        base_shear=_base_shear(model, force_ratio, ground.at_nodes()[0] / GRAVITY),
        **{key: value.item() for key, value in vars(peaks).items()},
    )
    return _until_it_ends(response)


def _base_shear(model: Oscillator, force_ratio: Float, ground: Float) -> Float:
    """Return the force of the ground over the weight of deck and columns [1].

    `ground` is its acceleration [g]. It moves the mass that does not move with the deck.
    """
    gamma = model.mass_ratio
    if math.isinf(gamma):
        return -force_ratio
    moved = gamma + (COLUMN_SHARE if isinstance(model, FixedFrame) else 0.0)
    return (ground * (1.0 + gamma - moved) - moved * force_ratio) / (1.0 + gamma)


def _until_it_ends(response: OscillatorResponse) -> OscillatorResponse:
    """Add the events that end the model, and the base shear until the first of them."""
    model = response.model
    closed = closing = exceeded = math.nan
    ends: dict[ModelEnd, float] = {}
    history = response.time, response.u, response.velocity
    if model.abutment is not None:
        closed, closing = first_crossing(*history, model.abutment.gap)
        if response.peak_displacement >= model.abutment.gap:
            ends[ModelEnd.GAP_CLOSES] = sometime(closed)
    limit = model.limit_ductility * model.yield_displacement
    if response.peak_displacement >= limit:
        exceeded = first_crossing(*history, limit)[0]
        ends[ModelEnd.DUCTILITY_EXCEEDED] = sometime(exceeded)
    end, until = first_end(ends)
    lost = np.flatnonzero(np.isnan(response.u))
    return replace(
        response,
        overturning_time=float(response.time[lost[0]]) if lost.size else math.nan,
        peak_base_shear=largest_until(until, response.time, response.base_shear),
        model_end=end,
        model_end_time=until,
        gap_closed_time=closed,
        closing_velocity=closing,
        ductility_exceeded_time=exceeded,
    )


def largest_until(end: float, time: Float, shear: Float) -> float:
    """Return the largest |shear| at the nodes until the model ends; NaN if it does not."""
    count = time.size if math.isnan(end) else max(1, int(np.searchsorted(time, end, "right")))
    return float(np.nanmax(np.abs(shear[:count])))


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
    >>> from rockframe import Pulse
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

    peaks = np.stack(on_threads(answer, motions))
    yielding = np.array([model.yield_displacement for model in models])[:, None]
    shape = (len(motions), len(models), factors.size, kernel.SUMMARY_SIZE)
    return _peaks(peaks.reshape(shape), yielding)


def respond_pairs(
    models: Sequence[Oscillator], motion: Motion, model: ArrayLike, scale: ArrayLike
) -> OscillatorPeaks:
    """Compute the peaks of ``models[model[k]]`` under a motion at ``scale[k]``, for each k.

    The results have the same bits as those of `respond_oscillator`.

    Examples
    --------
    >>> frame = FixedFrame(period=0.5, strength_ratio=0.2)
    >>> from rockframe import Pulse
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=4.9, T_p=1.5)
    >>> respond_pairs([frame], pulse, [0, 0], [0.1, 1.0]).ductility.round(2).tolist()
    [0.31, 30.54]
    """
    which, scales = np.asarray(model, dtype=np.intp), np.asarray(scale, dtype=np.float64)
    constants = np.array([model.constants for model in models])[which]
    out = np.empty((scales.size, kernel.SUMMARY_SIZE))
    kernel.integrate_many(*_prepared(as_ground(motion)), scales, constants, out)
    return _peaks(out, np.array([model.yield_displacement for model in models])[which])


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
