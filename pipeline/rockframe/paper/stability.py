"""Claims about overturning under pulses: sections 6, 7 and 9."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from rockframe.frame import RockingFrame
from rockframe.paper.claim import Claim, Finding, judged
from rockframe.rocking import Verdict, respond_many
from rockframe.wavelets import RICKERS, Pulse

#: Steps of amplitude, in g tan(alpha), of scans that find none or the first overturning.
_COARSE: Final = 0.02
_FINE: Final = 0.005
#: What a reader would not call marginal: a difference of a tenth.
_MARGINAL: Final = 0.1


def stability_claims() -> list[Claim]:
    """Return the claims about overturning."""
    return [
        _no_overturning("temple-column-stands", 14.0, 0.0, 7.5, 15.0),
        _no_overturning("temple-frame-stands", 14.0, 0.25, 5.0, 5.0),
        _marginal(),
        _heavier_is_safer(),
        _every_amplitude(),
    ]


def _no_overturning(
    name: str, degrees: float, mass_ratio: float, frequency_ratio: float, bound: float
) -> Claim:
    amplitudes = np.arange(1.0, bound + 0.5 * _COARSE, _COARSE)
    overturned = [
        _scan(degrees, mass_ratio, frequency_ratio, wavelet, amplitudes) for wavelet in RICKERS
    ]
    number = int(np.sum(overturned))
    return Claim(
        name=name,
        where="section 7, Figure 9",
        says=f"α = {degrees:g} degrees, γ = {mass_ratio:g}, ω_p/p = {frequency_ratio:g}: the least "
        f"overturning amplitude is above {bound:g} g tan α",
        printed=f"> {bound:g}",
        ours=f"{number} of {2 * amplitudes.size} pulses up to {amplitudes[-1]:g} g tan α overturn",
        finding=judged(number == 0),
        remark=f"both pulses, amplitudes every {_COARSE:g}",
    )


def _marginal() -> Claim:
    alone, heavy = (_first(14.0, gamma, 4.0, "symmetric_ricker") for gamma in (0.0, 4.0))
    gain = heavy / alone - 1.0
    return Claim(
        name="marginal",
        where="section 6, Figure 9",
        says="up to ω_p/p = 4 the beam adds little stability",
        printed="marginal",
        ours=f"{100.0 * gain:+.0f} %: {alone:.2f} to {heavy:.2f} g tan α",
        finding=judged(gain < _MARGINAL),
        remark="symmetric pulse, α = 14 degrees, ω_p/p = 4, γ from 0 to 4; first overturning in "
        f"steps of {_FINE:g}; a tenth or more is taken as not marginal",
    )


def _heavier_is_safer() -> Claim:
    rising, stated = True, []
    for wavelet in RICKERS:
        edges = [_first(10.0, gamma, 3.0, wavelet) for gamma in (0.0, 0.25, 1.0, 4.0)]
        rising &= all(np.diff(edges) > 0.0)
        stated.append(", ".join(f"{edge:.2f}" for edge in edges))
    return Claim(
        name="heavier",
        where="abstract, sections 6 and 9",
        says="the heavier the beam, the more stable: the least overturning amplitude rises",
        printed="more stable",
        ours=f"{stated[0]} (symmetric); {stated[1]} g tan α (antisymmetric)",
        finding=judged(rising),
        remark="α = 10 degrees, ω_p/p = 3, γ = 0, 0.25, 1, 4; first overturning in steps of "
        f"{_FINE:g}",
    )


def _every_amplitude() -> Claim:
    """A block that a pulse spares, and the frame that it overturns."""
    one, other = (
        _scan(10.0, gamma, 2.0, "antisymmetric_ricker", np.array([2.45]))[0]
        for gamma in (0.0, 0.25)
    )
    words = {True: "overturns", False: "stands"}
    return Claim(
        name="every-amplitude",
        where="abstract, sections 6 and 9",
        says="the heavier the beam, the more stable: read of every pulse, not of the least one",
        printed="more stable",
        ours=f"under 2.45 g tan α the column {words[bool(one)]}, the frame with γ = 0.25 "
        f"{words[bool(other)]}",
        finding=Finding.DIFFERS if other and not one else Finding.AGREES,
        remark="antisymmetric pulse, α = 10 degrees, ω_p/p = 2: beyond the least amplitude there "
        "are islands of safety",
    )


def _first(degrees: float, mass_ratio: float, frequency_ratio: float, wavelet: str) -> float:
    """The first amplitude that overturns, in steps; NaN if none does up to 6 g tan(alpha)."""
    amplitudes = np.arange(1.0, 6.0, _FINE)
    overturned = _scan(degrees, mass_ratio, frequency_ratio, wavelet, amplitudes)
    return float(amplitudes[int(np.argmax(overturned))]) if overturned.any() else math.nan


def _scan(
    degrees: float,
    mass_ratio: float,
    frequency_ratio: float,
    wavelet: str,
    amplitudes: np.ndarray[tuple[int], np.dtype[np.float64]],
) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Whether each amplitude, in g tan(alpha), overturns; p of the ratio is the column's."""
    frame = RockingFrame(
        height=5.0, width=5.0 * math.tan(math.radians(degrees)), mass_ratio=mass_ratio
    )
    period = math.tau / (frequency_ratio * frame.frequency_parameter)
    pulse = Pulse(wavelet=wavelet, a_p=frame.uplift_acceleration, T_p=period)
    verdicts = respond_many([pulse], [frame], amplitudes).verdict[0, 0]
    return np.asarray(verdicts == Verdict.OVERTURNED)
