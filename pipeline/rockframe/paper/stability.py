"""Claims about overturning under pulses: sections 6, 7 and 9."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.frame import RockingFrame
from rockframe.paper.claim import Claim, Finding, judged
from rockframe.rocking import Verdict, overturning_spectrum, respond_many
from rockframe.wavelets.family import RICKERS
from rockframe.wavelets.pulse import Pulse

Float = NDArray[np.float64]

#: Slendernesses of Figure 9 [degrees], and the mass ratios used for it here.
_SLENDERNESSES: Final = (10.0, 14.0)
_MASS_RATIOS: Final = (0.0, 0.25, 1.0, 4.0)
#: Frequency ratios for which the paper calls the gain marginal, and higher ratios.
_LOW: Final = (2.0, 3.0, 4.0)
_HIGH: Final = (5.0, 6.0, 7.0)
#: Step and largest value of the scans of amplitude, a_p / (g tan alpha) [1].
_STEP: Final = 0.02
_LARGEST: Final = 15.0
#: Smallest gain that does not count as marginal [1].
_MARGINAL: Final = 0.1
_COMMAND: Final = "rockframe spectrum"


def stability_claims() -> list[Claim]:
    """Return the claims about overturning."""
    least = _least(_SLENDERNESSES, _MASS_RATIOS, (*_LOW, *_HIGH), _LARGEST)
    return [
        _no_overturning("temple-column-stands", 0.0, 7.5, 15.0),
        _no_overturning("temple-frame-stands", 0.25, 5.0, 5.0),
        _marginal(least[..., : len(_LOW)]),
        _enhanced(least[..., len(_LOW) - 1 :]),
        _heavier_is_safer(least),
        _every_amplitude(),
    ]


def _no_overturning(name: str, mass_ratio: float, frequency_ratio: float, bound: float) -> Claim:
    """Check that no pulse up to a bound overturns the temple (section 7), by a scan to 60."""
    least = _least((14.0,), (mass_ratio,), (frequency_ratio,), 60.0)[:, 0, 0, 0]
    if np.isnan(least).all():
        ours = "no pulse up to 60 g tan α overturns"
    else:
        ours = f"{least[0]:.4f} (symmetric), {least[1]:.4f} (antisymmetric)"
    return Claim(
        name=name,
        where="section 7, Figure 9",
        says=f"α = 14 degrees, γ = {mass_ratio:g}, ω_p/p = {frequency_ratio:g}: the least "
        f"overturning amplitude is above {bound:g} g tan α",
        printed=f"> {bound:g}",
        ours=ours,
        finding=judged(not (least <= bound).any()),
        remark=f"both pulses; {_scanned(60.0)}",
        command=f"{_COMMAND} --wavelet {' '.join(RICKERS)} --slenderness-deg 14 "
        f"--mass-ratio {mass_ratio:g} --frequency-ratio {frequency_ratio:g} --max-amplitude 60 "
        "--output spectrum.nc",
    )


def _marginal(least: Float) -> Claim:
    """Compare the heaviest beam with the column alone in the four panels."""
    gain = least[:, :, -1] / least[:, :, 0] - 1.0
    at_4, below = gain[..., -1], gain[..., :-1]
    return Claim(
        name="marginal",
        where="section 6, Figure 9",
        says="up to ω_p/p = 4 the beam adds little stability",
        printed="marginal",
        ours=f"{_span(at_4)} at ω_p/p = 4; {_span(below)} at 2 and 3",
        finding=judged(bool((gain < _MARGINAL).all())),
        remark="both pulses, α = 10 and 14 degrees, γ from 0 to 4; a tenth or more is taken as not "
        f"marginal; {_scanned(_LARGEST)}",
    )


def _enhanced(least: Float) -> Claim:
    """Compare the heaviest beam with the column alone from a frequency ratio of 4 on."""
    alone = least[:, :, 0]
    frame = np.where(np.isnan(least[:, :, -1]), np.inf, least[:, :, -1])
    gain = np.where(np.isnan(alone), np.inf, frame / alone - 1.0)
    grows = bool((gain[..., 1:] >= gain[..., :-1]).all())
    at_5 = gain[..., 1]
    finite = at_5[np.isfinite(at_5)]
    never = int(np.isinf(gain[..., 2]).sum())
    return Claim(
        name="enhanced",
        where="section 6, Figure 9",
        says="above ω_p/p = 4 the spectra of the frame are higher than that of the column",
        printed="higher",
        ours=f"{_span(finite)} at ω_p/p = 5, growing; at 6 nothing up to {_LARGEST:g} g tan α "
        f"overturns the frame in {never} of {gain[..., 2].size} panels",
        finding=judged(grows and bool((gain[..., 1:] > 0.0).all())),
        remark=f"both pulses, α = 10 and 14 degrees, γ from 0 to 4; {_scanned(_LARGEST)}",
        command="rockframe figure 9 --output figure-9.png",
    )


def _heavier_is_safer(least: Float) -> Claim:
    lighter, heavier = least[:, :, :-1], least[:, :, 1:]  # NaN: nothing up to the largest overturns
    falls = int((heavier < lighter).sum() + (np.isnan(lighter) & ~np.isnan(heavier)).sum())
    edges = ", ".join(f"{edge:.2f}" for edge in least[0, 0, :, 1])
    return Claim(
        name="heavier",
        where="abstract, sections 6 and 9",
        says="the heavier the beam, the more stable: the least overturning amplitude rises",
        printed="more stable",
        ours=f"it falls in {falls} of {(~np.isnan(lighter)).sum()} steps from one γ to the next; "
        f"for the symmetric pulse at α = 10 degrees, ω_p/p = 3: {edges} g tan α",
        finding=judged(falls == 0),
        remark="both pulses, α = 10 and 14 degrees, ω_p/p from 2 to 7, γ = 0, 0.25, 1, 4",
        command="rockframe figure 9 --output figure-9.png",
    )


def _every_amplitude() -> Claim:
    """Compare a column that does not overturn under a pulse with a frame that does."""
    pulse_of = {}
    for gamma in (0.0, 0.25):
        frame = RockingFrame(height=5.0, width=5.0 * math.tan(math.radians(10.0)), mass_ratio=gamma)
        pulse = Pulse(
            wavelet="antisymmetric_ricker",
            a_p=2.45 * frame.uplift_acceleration,
            T_p=math.pi / frame.frequency_parameter,
        )
        verdict = respond_many([pulse], [frame]).verdict.item()
        pulse_of[gamma] = verdict == Verdict.OVERTURNED
    words = {True: "overturns", False: "stands"}
    other, one = pulse_of[0.25], pulse_of[0.0]
    return Claim(
        name="every-amplitude",
        where="abstract, sections 6 and 9",
        says="the heavier the beam, the more stable: read of every pulse, not of the least one",
        printed="more stable",
        ours=f"under 2.45 g tan α the column {words[one]}, the frame with γ = 0.25 {words[other]}",
        finding=Finding.DIFFERS if other and not one else Finding.AGREES,
        remark="antisymmetric pulse, α = 10 degrees, ω_p/p = 2: beyond the least amplitude there "
        "are islands of safety",
    )


def _least(
    degrees: tuple[float, ...],
    mass_ratios: tuple[float, ...],
    frequency_ratios: tuple[float, ...],
    largest: float,
) -> Float:
    """Return smallest overturning amplitudes by pulse, slenderness, mass and frequency ratio."""
    found = overturning_spectrum(
        [Pulse(wavelet=name, a_p=1.0, T_p=1.0) for name in RICKERS],
        np.radians(degrees),
        mass_ratios,
        frequency_ratios,
        np.arange(1.0, largest + 0.5 * _STEP, _STEP),
        tolerance=1e-6,
    )
    return found.minimum_overturning_amplitude


def _span(gains: Float) -> str:
    return f"{100.0 * gains.min():+.0f} % to {100.0 * gains.max():+.0f} %"


def _scanned(largest: float) -> str:
    return f"amplitudes every {_STEP:g} to {largest:g}, edges refined"
