"""Nominal responses of many frames to many motions at once, without histories."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.engines.engine import on_threads, threads
from rockframe.frame import RockingFrame
from rockframe.parts import Lever
from rockframe.rocking.assessments import ContactDemand
from rockframe.rocking.contact import impact_friction_demand, least_spacing
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.kernels import kernel
from rockframe.rocking.reactions import levers_of
from rockframe.rocking.response import Motion, Response, ToPulse, as_ground, require_some
from rockframe.rocking.scenarios import (
    Prepared,
    Results,
    ScenarioPacker,
    constants_of,
    respond_scenarios,
)
from rockframe.rocking.verdict import Verdict
from rockframe.wavelets.pulse import Pulse

Float = NDArray[np.float64]

#: Number of coefficients of a piecewise linear motion: contact is weighed at its samples.
_LINEAR: Final = 2


@dataclass(frozen=True, eq=False)
class NominalResponses:
    """Nominal responses of frames to one motion, without histories.

    Parameters
    ----------
    frames : tuple of RockingFrame
        The frames.
    verdict : array of int8, shape (frames,)
        Values of `Verdict`.
    peak_rotation, peak_rotation_ratio, peak_u, peak_v, peak_time : array, shape (frames,)
        As for `Response`.
    uplift_time, overturning_time : array, shape (frames,)
        As for `Response`.
    impacts : array of int32, shape (frames,)
        As for `Response`.
    contact : mapping of str to array
        The values of `ContactDemand` by name, shape (frames,).
    to_pulse : mapping of str to array
        The values of `ToPulse` by name, shape (frames,); empty without a pulse.
    """

    frames: tuple[RockingFrame, ...]
    verdict: NDArray[np.int8]
    peak_rotation: Float
    peak_rotation_ratio: Float
    peak_u: Float
    peak_v: Float
    peak_time: Float
    uplift_time: Float
    overturning_time: Float
    impacts: NDArray[np.int32]
    contact: Mapping[str, Float]
    to_pulse: Mapping[str, NDArray[np.generic]]

    def responses(self) -> list[Response]:
        """Return the response of each frame."""
        none = np.empty(0)
        contacts = zip(*(self.contact[name].tolist() for name in self.contact), strict=True)
        alone = zip(*(values.tolist() for values in self.to_pulse.values()), strict=True)
        pulses = [ToPulse(Verdict(verdict), ratio, error) for verdict, ratio, error in alone]
        return [
            Response(
                frame=frame,
                time=none,
                theta=none,
                omega=none,
                verdict=Verdict(self.verdict[k]),
                peak_rotation=float(self.peak_rotation[k]),
                peak_time=float(self.peak_time[k]),
                uplift_time=float(self.uplift_time[k]),
                overturning_time=float(self.overturning_time[k]),
                impacts=int(self.impacts[k]),
                impact_times=none,
                impact_velocities=none,
                to_pulse=pulses[k] if pulses else None,
                contact=ContactDemand(*contact),
            )
            for k, (frame, contact) in enumerate(zip(self.frames, contacts, strict=True))
        ]


def nominal_responses(
    motions: Sequence[Motion],
    frames: Sequence[RockingFrame],
    pulses: Sequence[Pulse | None] = (),
) -> list[NominalResponses] | None:
    """Return the nominal responses of frames to each motion, or None if they need `respond`.

    They need it if a frame has tendons, dissipaters or an abutment, if a motion is vertical too or
    not piecewise linear, or if a motion is sampled so coarsely that the scalar kernel computes it.

    Parameters
    ----------
    motions : sequence of Record, Pulse or GroundAcceleration
        The motions.
    frames : sequence of RockingFrame
        The frames.
    pulses : sequence of Pulse or None
        The pulse of each motion, whose responses are added; empty without pulses.

    Returns
    -------
    list of NominalResponses or None
        For each motion the responses, with the contact demand. They equal those of `respond` and
        `with_contact` up to round-off, which impacts amplify, and do not depend on the other
        motions and frames.

    Raises
    ------
    ParameterError
        If there is no frame, or a motion is not finite.

    Examples
    --------
    >>> from rockframe import Record
    >>> record = Record(record_id="shake", acceleration=[0.0, 3.0, -3.0, 0.0], time_step=0.2)
    >>> [found] = nominal_responses([record], [RockingFrame(height=9.6, width=1.6)])
    >>> found.verdict.tolist(), found.peak_rotation_ratio.round(4).tolist()
    ([1], [0.0752])
    """
    grounds = [as_ground(motion) for motion in motions]
    require_some(frames=frames)
    linear = all(
        ground.vertical is None and ground.coefficients.shape[1] == _LINEAR for ground in grounds
    )
    if not linear or any(frame.restrained or frame.abutment is not None for frame in frames):
        return None
    verdicts, summaries = _computed(grounds, frames)
    if np.isnan(summaries[..., kernel.BASE_SHEAR]).any():  # the scalar kernel computed some
        return None
    beam = Lever(*_each(frames, lambda frame: (frame.beam.length, frame.beam.angle)))  # type: ignore[arg-type]  # arrays
    peak = summaries[..., kernel.PEAK]
    u, v = beam.shift(peak), beam.lift(np.minimum(peak, beam.angle))
    ratio = peak / np.array([frame.slenderness for frame in frames])
    contact = _contact(verdicts, summaries, frames)
    return [
        NominalResponses(
            frames=tuple(frames),
            verdict=verdicts[i],
            peak_rotation=peak[i],
            peak_rotation_ratio=ratio[i],
            peak_u=u[i],
            peak_v=v[i],
            peak_time=summaries[i, :, kernel.PEAK_TIME],
            uplift_time=summaries[i, :, kernel.UPLIFT_TIME],
            overturning_time=summaries[i, :, kernel.OVERTURNING_TIME],
            impacts=summaries[i, :, kernel.IMPACTS].astype(np.int32),
            contact={name: values[i] for name, values in contact.items()},
            to_pulse=_to_pulse(pulses[i], frames, verdicts[i], peak[i]) if pulses else {},
        )
        for i in range(len(grounds))
    ]


def _computed(
    grounds: Sequence[GroundAcceleration], frames: Sequence[RockingFrame]
) -> tuple[NDArray[np.int8], Float]:
    """Return verdicts and summaries of frames under motions, shape (motions, frames, ...)."""
    constants, levers = (
        np.array([numbers(frame) for frame in frames]) for numbers in (constants_of, levers_of)
    )
    count = len(frames)
    results = Results(len(grounds) * count, demands=True)

    def compute(some: NDArray[np.intp]) -> None:
        packer = ScenarioPacker(results)
        for i in some.tolist():
            places = np.arange(i * count, (i + 1) * count)
            packer.add(places, Prepared(grounds[i]), np.ones(count), constants, levers)
        packer.complete()

    on_threads(compute, np.array_split(np.arange(len(grounds)), min(threads(), len(grounds))))
    shape = len(grounds), count
    return results.verdicts.reshape(shape), results.summaries.reshape(*shape, -1)


def _contact(
    verdicts: NDArray[np.int8], summaries: Float, frames: Sequence[RockingFrame]
) -> dict[str, Float]:
    """Return the values of `ContactDemand` by name, shape (motions, frames)."""
    rested, lifting = summaries[..., kernel.RESTED], summaries[..., kernel.LIFTING]
    most, least = summaries[..., kernel.TOP_MOST], summaries[..., kernel.TOP_LEAST]
    capped = np.array([frame.mass_ratio > 0.0 for frame in frames])
    impact = np.array([impact_friction_demand(frame) for frame in frames])
    still = np.maximum(rested, lifting)  # under the beam, while no joint is open
    pressed = np.where(rested >= 0.0, 1.0, math.inf)  # at rest: the static force
    unknown = np.where(capped, 0.0, math.nan)
    has_impacts = summaries[..., kernel.IMPACTS] > 0.0
    width, centre, apart = _each(frames, _spacing_of)
    rocking = np.maximum(
        *(
            np.where(np.isinf(end) & (end == none), 0.0, np.abs(0.5 * width - centre * end))
            for end, none in ((most, -math.inf), (least, math.inf))
        )
    )
    during = 2.0 * np.maximum(rocking, centre * still)
    demands = {
        "base_friction_demand": np.maximum(summaries[..., kernel.FRICTION], rested),
        "top_friction_demand": np.maximum(np.maximum(most, -least), still) + unknown,
        "impact_friction_demand": np.where(has_impacts, impact, math.nan),
        "least_base_vertical": np.minimum(summaries[..., kernel.PRESS], pressed),
        "least_top_vertical": np.minimum(summaries[..., kernel.PRESS_TOP], pressed) + unknown,
        "least_spacing": np.where(has_impacts, np.maximum(during, apart), during),
    }
    falls = verdicts == Verdict.OVERTURNS
    return {name: np.where(falls, math.nan, values) for name, values in demands.items()}


def _spacing_of(frame: RockingFrame) -> tuple[float, float, float]:
    """Return the width under the beam, the height of its centre, and the spacing for impacts [m].

    They are NaN for frames of which no spacing is computed.
    """
    if frame.beam_depth is None or frame.mass_ratio == 0.0:
        return math.nan, math.nan, math.nan
    centre = 0.5 * frame.beam_depth
    return frame.top_contact_width, centre, least_spacing(frame, centre)


def _to_pulse(
    pulse: Pulse | None, frames: Sequence[RockingFrame], verdict: NDArray[np.int8], peak: Float
) -> dict[str, NDArray[np.generic]]:
    """Return the values of `ToPulse` by name, shape (frames,); empty without a pulse."""
    if pulse is None:
        return {}
    count = len(frames)
    alone = respond_scenarios([pulse], frames, [0] * count, range(count), np.ones(count))
    stands = (verdict != Verdict.OVERTURNS) & (alone.verdict != Verdict.OVERTURNS) & (peak > 0.0)
    error = np.full(count, math.nan)
    error[stands] = alone.peak_rotation[stands] / peak[stands] - 1.0
    return {
        "verdict": alone.verdict,
        "peak_rotation_ratio": alone.peak_rotation_ratio,
        "error": error,
    }


def _each(
    frames: Sequence[RockingFrame], numbers: Callable[[RockingFrame], tuple[float, ...]]
) -> Iterator[Float]:
    """Yield the columns of numbers of frames."""
    yield from np.array([numbers(frame) for frame in frames]).T
