"""Claims about equations (sections 3 to 5), about frames, and about pulses on frames."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.frame import RockingFrame
from rockframe.paper.claim import Finding, Judgement, judged, judgement, number
from rockframe.parts import inertia_ratio_of
from rockframe.rocking import (
    GroundAcceleration,
    Verdict,
    overturning_spectrum,
    respond,
    respond_many,
    restoring_moment,
)
from rockframe.units import GRAVITY
from rockframe.wavelets.family import RICKERS
from rockframe.wavelets.pulse import Pulse

Float = NDArray[np.float64]

TEMPLE: Final = RockingFrame(height=7.5, width=1.8)
BRIDGE: Final = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
#: Mass ratios for which identities are checked.
_MASS_RATIOS: Final = (0.0, 0.25, 0.3, 1.0, 4.0, 20.0, 1e3)


def number_checks() -> dict[str, Judgement]:
    """Check the numbers printed for the brick, the block, the temple and the bridge."""
    p, bridge_p = TEMPLE.frequency_parameter, BRIDGE.frequency_parameter
    tangent = TEMPLE.uplift_acceleration / GRAVITY
    cylinder = inertia_ratio_of("circular", BRIDGE.height, BRIDGE.width)
    round_piers = RockingFrame(height=BRIDGE.height, width=BRIDGE.width, inertia_ratio=cylinder)
    return {
        "brick-p": judgement(Finding.OPEN, diagonal=100.0 * 2.0 * 0.75 * GRAVITY / 8.0**2),
        "plastic-limit": number(math.degrees(TEMPLE.slenderness_limit)),
        "temple-p": number(p),
        "temple-slenderness": number(math.degrees(TEMPLE.slenderness)),
        "temple-uplift": number(tangent),
        "omega-0.6": number(math.tau / (0.6 * p), rounded=math.tau / (0.6 * 1.4)),
        "omega-0.9": number(math.tau / (0.9 * p)),
        "overturning-15": number(15.0 * tangent),
        "overturning-5": number(5.0 * tangent),
        "bridge-slenderness": number(BRIDGE.uplift_acceleration / GRAVITY),
        "bridge-p": number(bridge_p, cylindrical=round_piers.frequency_parameter),
        "drift-and-lift": _drift_and_lift(),
    }


def frame_checks() -> dict[str, Judgement]:
    """Check the claims about size, frequency, uplift and restitution of frames."""
    heavy = RockingFrame(height=9.6, width=1.6, mass_ratio=1e15)
    ratio = (heavy.effective_frequency_parameter / heavy.frequency_parameter) ** 2
    block, forms, less = _block_restitution(), _size_forms(), _least_loss()
    uplift = _uplift_ratios()
    at_once = all(part == "1.000000000" for part in uplift.split(", "))
    return {
        "eq-6": judgement(block < 1e-14, worst=block),
        "eq-28": judgement(abs(ratio - 2.0 / 3.0) < 1e-12, ratio=ratio),
        "eq-29": judgement(forms < 1e-13, worst=forms),
        "eq-36": judgement(at_once, ratios=uplift),
        "restitution-order": judgement(less > 0.0, least=less),
    }


def _drift_and_lift() -> Judgement:
    theta = np.linspace(0.0, BRIDGE.slenderness, 100_001)
    drift = BRIDGE.horizontal_displacement(theta)
    lift = BRIDGE.vertical_displacement(theta)
    v_of_50 = 100.0 * float(np.interp(0.50, drift, lift))
    u_of_5 = 100.0 * float(np.interp(0.05, lift, drift))
    return judgement(v_of_50 <= 5.5, lift=v_of_50, drift=u_of_5)


def _block_restitution() -> float:
    slendernesses = np.radians(np.linspace(1.0, 54.0, 54))
    return max(
        abs(_slender_frame(alpha, 0.0).restitution - (1.0 - 1.5 * math.sin(alpha) ** 2))
        for alpha in slendernesses
    )


def _size_forms() -> float:
    worst = 0.0
    for gamma in _MASS_RATIOS:
        frame = RockingFrame(height=9.6, width=1.6, mass_ratio=gamma)
        size = (frame.frequency_parameter / frame.effective_frequency_parameter) ** 2
        ratio, other = (1.0 + 3.0 * gamma) / (1.0 + 2.0 * gamma), 1.0 + gamma / (1.0 + 2.0 * gamma)
        worst = max(worst, abs(ratio - size), abs(other - size))
    return worst


def _least_loss() -> float:
    return min(
        _slender_frame(alpha, 0.0).restitution - _slender_frame(alpha, gamma).restitution
        for alpha in np.radians(np.arange(1.0, 45.0))
        for gamma in (0.01, *_MASS_RATIOS[1:])
    )


def _uplift_ratios() -> str:
    """Return ground acceleration at uplift over g tan(alpha), for a ramp to twice it in 1 s."""
    ratios = []
    for gamma in (0.0, 4.0, 100.0):
        frame = RockingFrame(height=9.6, width=1.6, mass_ratio=gamma)
        ramp = [0.0, 2.0 * frame.uplift_acceleration]
        uplift = respond(frame, GroundAcceleration.from_samples(ramp, 1.0)).uplift_time
        ratios.append(f"{2.0 * uplift:.9f}")
    return ", ".join(ratios)


def _slender_frame(slenderness: float, mass_ratio: float) -> RockingFrame:
    return RockingFrame(height=5.0, width=5.0 * math.tan(slenderness), mass_ratio=mass_ratio)


#: A pulse under which the bridge does not overturn, and the time of free rocking after it [s].
_PULSE: Final = Pulse(wavelet="symmetric_ricker", a_p=0.5 * GRAVITY, T_p=1.5)
_AFTER: Final = 15.0
#: Number of the impact at which rates are compared.
_IMPACT: Final = 6
#: The column of the same slenderness and of size R-hat, eq (29).
_GROWTH: Final = BRIDGE.effective_size / BRIDGE.size
_COLUMN: Final = RockingFrame(height=_GROWTH * BRIDGE.height, width=_GROWTH * BRIDGE.width)


def one_column_checks() -> dict[str, Judgement]:
    """Check the equivalent column, with its own and with the frame's restitution.

    Examples
    --------
    >>> [found.finding.value for found in one_column_checks().values()]
    ['differs', 'agrees']
    """
    losses = BRIDGE.restitution / _COLUMN.restitution
    losing = RockingFrame(height=_COLUMN.height, width=_COLUMN.width, restitution_factor=losses)
    frame, own, lossy = (
        respond(each, _PULSE, free_rocking=_AFTER) for each in (BRIDGE, _COLUMN, losing)
    )
    rate, of_column = (abs(each.impact_velocities[_IMPACT - 1]) for each in (frame, own))
    apart, apart_losing = (np.abs(frame.theta - each.theta).max() for each in (own, lossy))
    return {
        "one-column": judgement(
            bool(apart < 1e-9),
            apart=apart,
            T_p=_PULSE.T_p,
            impact=_IMPACT,
            rate=rate,
            of_column=of_column,
        ),
        "one-column-losses": judgement(
            bool(apart_losing < 1e-9), apart=apart_losing, T_p=_PULSE.T_p
        ),
    }


#: Slendernesses of Figure 9 [degrees], and the mass ratios used for it here.
_SLENDERNESSES: Final = (10.0, 14.0)
_BEAMS: Final = (0.0, 0.25, 1.0, 4.0)
#: Frequency ratios for which the paper calls the gain marginal, and higher ratios.
_LOW: Final = (2.0, 3.0, 4.0)
_HIGH: Final = (5.0, 6.0, 7.0)
#: Step and largest value of the scans of amplitude, a_p / (g tan alpha) [1].
_STEP: Final = 0.02
_LARGEST: Final = 15.0
#: Smallest gain that does not count as marginal [1].
_MARGINAL: Final = 0.1
#: Amplitude that overturns the frame but not the column, a_p / (g tan alpha) [1].
_ISLAND: Final = 2.45


def stability_checks() -> dict[str, Judgement]:
    """Check the claims about overturning."""
    least = _least(_SLENDERNESSES, _BEAMS, (*_LOW, *_HIGH), _LARGEST)
    return {
        "temple-column-stands": _no_overturning(0.0, 7.5, 15.0),
        "temple-frame-stands": _no_overturning(0.25, 5.0, 5.0),
        "marginal": _marginal(least[..., : len(_LOW)]),
        "enhanced": _enhanced(least[..., len(_LOW) - 1 :]),
        "heavier": _heavier_is_safer(least),
        "every-amplitude": _every_amplitude(),
    }


def _no_overturning(mass_ratio: float, frequency_ratio: float, bound: float) -> Judgement:
    """Check that no pulse up to a bound overturns the temple (section 7), by a scan to 60."""
    least = _least((14.0,), (mass_ratio,), (frequency_ratio,), 60.0)[:, 0, 0, 0]
    least_amplitudes = f"{least[0]:.4f} (symmetric), {least[1]:.4f} (antisymmetric)"
    if np.isnan(least).all():
        least_amplitudes = "no pulse up to 60 g tan α overturns"
    return judgement(not (least <= bound).any(), found=least_amplitudes, step=_STEP)


def _marginal(least: Float) -> Judgement:
    """Compare the heaviest beam with the column alone in the four panels."""
    gain = least[:, :, -1] / least[:, :, 0] - 1.0
    at_4, below = _span(gain[..., -1]), _span(gain[..., :-1])
    small = bool((gain < _MARGINAL).all())
    return judgement(small, at_4=at_4, below=below, step=_STEP, largest=_LARGEST)


def _enhanced(least: Float) -> Judgement:
    """Compare the heaviest beam with the column alone from a frequency ratio of 4 on."""
    alone = least[:, :, 0]
    frame = np.where(np.isnan(least[:, :, -1]), np.inf, least[:, :, -1])
    gain = np.where(np.isnan(alone), np.inf, frame / alone - 1.0)
    grows = bool((gain[..., 1:] >= gain[..., :-1]).all())
    at_5 = gain[..., 1]
    return judgement(
        grows and bool((gain[..., 1:] > 0.0).all()),
        at_5=_span(at_5[np.isfinite(at_5)]),
        never=np.isinf(gain[..., 2]).sum(),
        panels=gain[..., 2].size,
        step=_STEP,
        largest=_LARGEST,
    )


def _heavier_is_safer(least: Float) -> Judgement:
    lighter, heavier = least[:, :, :-1], least[:, :, 1:]  # NaN: nothing up to the largest overturns
    falls = int((heavier < lighter).sum() + (np.isnan(lighter) & ~np.isnan(heavier)).sum())
    edges = ", ".join(f"{edge:.2f}" for edge in least[0, 0, :, 1])
    return judgement(falls == 0, falls=falls, steps=(~np.isnan(lighter)).sum(), edges=edges)


def _every_amplitude() -> Judgement:
    """Compare a column that does not overturn under a pulse with a frame that does."""
    falls = {}
    for gamma in (0.0, 0.25):
        frame = RockingFrame(height=5.0, width=5.0 * math.tan(math.radians(10.0)), mass_ratio=gamma)
        pulse = Pulse(
            wavelet="antisymmetric_ricker",
            a_p=_ISLAND * frame.uplift_acceleration,
            T_p=math.pi / frame.frequency_parameter,
        )
        falls[gamma] = respond_many([pulse], [frame]).verdict.item() == Verdict.OVERTURNS
    words = {True: "overturns", False: "stands"}
    return judgement(
        falls[0.0] or not falls[0.25],
        amplitude=_ISLAND,
        column=words[falls[0.0]],
        frame=words[falls[0.25]],
    )


#: Frequency ratios at which the scale effects are checked: a larger block, or a shorter pulse.
_SCALES: Final = tuple(np.linspace(1.0, 8.0, 29).tolist())
#: Mass ratio of the temple without its frieze, as the paper states it.
_NO_FRIEZE: Final = 0.3


def scale_checks() -> dict[str, Judgement]:
    """Check Housner's scale effects, the safe region above the spectrum, and gamma of the temple.

    By eq (47) a similar block of another size under one pulse, and one block under a pulse of
    another duration, differ in omega_p / p alone.
    """
    spectrum = overturning_spectrum(
        [Pulse(wavelet=name, a_p=1.0, T_p=1.0) for name in RICKERS],
        np.radians(_SLENDERNESSES),
        (0.0,),
        _SCALES,
        np.arange(1.0, _LARGEST + 0.5 * _STEP, _STEP),
        tolerance=1e-6,
    )
    least = np.nan_to_num(spectrum.minimum_overturning_amplitude[:, :, 0], nan=np.inf)
    maps = (*least.shape, spectrum.amplitude.size)  # by pulse, slenderness, ratio, amplitude
    falls = spectrum.found.verdict.reshape(maps) == Verdict.OVERTURNS
    at_once = falls & (spectrum.found.impacts.reshape(maps) == 0)
    both_stand = np.isinf(least[..., 1:]) & np.isinf(least[..., :-1])
    drops = int(((least[..., 1:] < least[..., :-1]) & ~both_stand).sum())
    steps = int((~both_stand).sum())
    shorter_alone = falls[:, :, 1:] & ~falls[:, :, :-1]
    share = float(shorter_alone.sum() / falls[:, :, 1:].sum())
    effect = {"steps": steps, "drops": drops, "step": _STEP, "largest": _LARGEST}
    column = TEMPLE.height * TEMPLE.width**2 * math.pi / 4.0
    return {
        "larger-block": judgement(drops == 0, **effect),
        "longer-pulse": judgement(drops == 0, **effect),
        "scale-every-amplitude": judgement(not shorter_alone.any(), share=100.0 * share),
        "safe-region": _safe_region(falls, at_once, spectrum.amplitude > least[..., None] + _STEP),
        "temple-gamma": judgement(Finding.OPEN, volume=_NO_FRIEZE * column, column=column),
    }


def _safe_region(
    falls: NDArray[np.bool_], at_once: NDArray[np.bool_], above: NDArray[np.bool_]
) -> Judgement:
    """Check that frames stand above the least amplitude, and that both modes of overturning occur:
    at once, without an impact, and later.
    """
    islands: NDArray[np.bool_] = above & ~falls
    modes = bool(at_once.any() and (falls & ~at_once).any())
    ratios = np.asarray(islands.any(axis=-1))
    where = np.array(_SCALES)[ratios.reshape(-1, len(_SCALES)).any(axis=0)]
    span = f"{where.min():g} to {where.max():g}" if where.size else "none"
    panels = int(ratios.any(axis=-1).sum())
    return judgement(
        bool(islands.any()) and modes,
        panels=panels,
        of=ratios.shape[0] * ratios.shape[1],
        span=span,
        step=_STEP,
        largest=_LARGEST,
    )


def _least(
    degrees: tuple[float, ...],
    mass_ratios: tuple[float, ...],
    frequency_ratios: tuple[float, ...],
    largest: float,
) -> Float:
    """Return smallest overturning amplitudes by pulse, slenderness, mass and frequency ratio."""
    spectrum = overturning_spectrum(
        [Pulse(wavelet=name, a_p=1.0, T_p=1.0) for name in RICKERS],
        np.radians(degrees),
        mass_ratios,
        frequency_ratios,
        np.arange(1.0, largest + 0.5 * _STEP, _STEP),
        tolerance=1e-6,
    )
    return spectrum.minimum_overturning_amplitude


def _span(gains: Float) -> str:
    return f"{100.0 * gains.min():+.0f} % to {100.0 * gains.max():+.0f} %"


#: Rotation [rad] and ground acceleration [m s-2] at which misprints are evaluated.
_THETA: Final = 0.5 * BRIDGE.slenderness
_GROUND: Final = 0.1 * GRAVITY
#: Rotation [rad], its rate [rad s-1] and acceleration [rad s-2] for the beam's rates.
_TURNED: Final = 0.05
_OMEGA: Final = 0.3
_RATE: Final = -0.8
#: Step of finite differences, in rotation [rad] and time [s].
_DIFFERENCE: Final = 1e-4


def motion_checks() -> dict[str, Judgement]:
    """Check the claims about kinematics and the equation of motion, section 3."""
    residual, frequency = _kinematic_residual(), _frequency_difference()
    push = GroundAcceleration.from_samples([0.0, 4.0, 4.0], 0.2)
    theta = float(respond(BRIDGE, push).theta[-1])
    return {
        "eq-7-11": judgement(residual < 1e-6, worst=residual),
        "eq-26": judgement(frequency < 1e-13, worst=frequency),
        "energy": _energy_check(),
        "sign": judgement(theta < 0.0, theta=theta),
        "eq-47": _similarity_check(),
    }


def misprint_checks() -> dict[str, Judgement]:
    """Check the misprinted equations, with values of both forms."""
    alpha = BRIDGE.slenderness
    printed = _work_slope(math.cos(alpha + _THETA), math.sin(alpha + _THETA))
    meant = _work_slope(math.cos(alpha - _THETA), math.sin(alpha - _THETA))
    slope = (_work(_THETA + _DIFFERENCE) - _work(_THETA - _DIFFERENCE)) / (2.0 * _DIFFERENCE)
    return {
        "eq-12": _lift_check(),
        "eq-23": judgement(Finding.MISPRINT, printed=8.0 + 2.0, meant=8.0 + 0.5 * 2.0),
        "eq-24": _misprint(printed, slope, meant),
        "eq-34": _uplift_check(),
    }


def impact_checks() -> dict[str, Judgement]:
    """Check eq (43) against the solution of eqs (37) to (41), section 5."""
    worst = 0.0
    for gamma in (0.0, 0.3, 1.0, 4.0, 100.0):
        for alpha in np.radians([5.0, 10.0, 14.0, 30.0]):
            frame = RockingFrame(height=5.0, width=5.0 * math.tan(alpha), mass_ratio=gamma)
            worst = max(worst, abs(_impact(alpha, gamma) - frame.restitution))
    return {"eq-43": judgement(worst < 1e-13, worst=worst)}


def _kinematic_residual() -> float:
    """Compare finite differences of the displacements with (8), (9), (11) as printed."""
    worst = 0.0
    for side in (1.0, -1.0):
        u, v = (_differences(place, side) for place in (
            BRIDGE.horizontal_displacement, BRIDGE.vertical_displacement,
        ))  # fmt: skip
        printed = _printed_rates(side)
        worst = max(worst, *(abs(rate / other - 1.0) for rate, other in
                             zip((*u, v[0]), printed[:3], strict=True)))  # fmt: skip
    return worst


def _differences(place: Callable[[Float], Float], side: float) -> tuple[float, float]:
    """Return the first and second time derivative of a displacement, by finite differences."""
    time = _DIFFERENCE * np.arange(-1, 2)
    values = place(side * (_TURNED + _OMEGA * time + 0.5 * _RATE * time**2))
    first = (values[2] - values[0]) / (2.0 * _DIFFERENCE)
    return float(first), float((values[2] - 2.0 * values[1] + values[0]) / _DIFFERENCE**2)


def _printed_rates(side: float) -> tuple[float, float, float, float]:
    """Evaluate (8), (9), (11), (12) as printed; a printed ± means -side, and ∓ means side."""
    omega, rate, twice = side * _OMEGA, side * _RATE, 2.0 * BRIDGE.size
    phi = BRIDGE.slenderness - _TURNED  # alpha -+ theta, for both sides
    sine, cosine = math.sin(phi), math.cos(phi)
    return (
        twice * cosine * omega,
        twice * (side * sine * omega**2 + cosine * rate),
        twice * side * sine * omega,
        -twice * (cosine * omega**2 + sine * rate),
    )


def _lift_check() -> Judgement:
    """Check eq (12) for theta > 0, where one of its signs contradicts (11)."""
    _, right = _differences(BRIDGE.vertical_displacement, 1.0)
    printed = _printed_rates(1.0)[3]
    meant = printed + 4.0 * BRIDGE.size * math.sin(BRIDGE.slenderness - _TURNED) * _RATE
    return _misprint(printed, right, meant, theta=_TURNED, rate=_OMEGA, acceleration=_RATE)


def _frequency_difference() -> float:
    worst = 0.0
    for columns in (2, 5, 12):
        for gamma in (0.0, 0.3, 1.0, 4.0, 100.0):
            frame = RockingFrame(height=9.6, width=1.6, mass_ratio=gamma)
            size, beam = frame.size, gamma * columns  # m_c = 1
            inertia = columns * 4.0 / 3.0 * size**2 + 4.0 * beam * size**2  # twice (17)
            p_hat_2 = 2.0 * size * (beam + 0.5 * columns) * GRAVITY / inertia  # (21)
            worst = max(worst, abs(p_hat_2 / frame.effective_frequency_parameter**2 - 1.0))
    return worst


def _energy_check() -> Judgement:
    ground = GroundAcceleration.from_samples(np.zeros(2001), 0.005)
    response = respond(BRIDGE, ground, initial_rotation=0.8 * BRIDGE.slenderness)
    energy = 0.5 * response.omega**2 + BRIDGE.effective_frequency_parameter**2 * (
        np.cos(BRIDGE.slenderness - np.abs(response.theta)) - math.cos(BRIDGE.slenderness)
    )
    flights = np.split(energy, np.searchsorted(response.time, response.impact_times))
    drift = max(np.ptp(flight) for flight in flights if flight.size) / energy[0]
    moment = restoring_moment(BRIDGE, np.array([1e-15, BRIDGE.slenderness]))
    first, last = moment[0], abs(moment[1])
    holds = drift < 1e-12 and abs(first - 1.0) < 1e-12 and last < 1e-12
    return judgement(bool(holds), drift=drift, first=first, last=last)


def _similarity_check() -> Judgement:
    """Compare two sizes of frame with the same five products of eq (47)."""
    scale = 0.3
    small = RockingFrame(height=scale * 9.6, width=scale * 1.6, mass_ratio=4.0)
    full = respond(BRIDGE, Pulse(wavelet="symmetric_ricker", a_p=5.0, T_p=1.6))
    reduced = respond(small, Pulse(wavelet="symmetric_ricker", a_p=5.0, T_p=1.6 * math.sqrt(scale)))
    apart = float(np.abs(full.theta - reduced.theta).max())
    return judgement(apart < 1e-11, scale=scale, apart=apart)


def _uplift_check() -> Judgement:
    """Check eq (34) at theta > 0, where the printed equation treats the columns as unrotated."""
    alpha, gamma = BRIDGE.slenderness, BRIDGE.mass_ratio
    beam = alpha - _THETA
    printed = (2.0 * gamma * math.sin(beam) + math.sin(alpha)) / (
        2.0 * gamma * math.cos(beam) + math.cos(alpha)
    )
    return _misprint(printed, math.tan(beam), math.tan(beam))


def _misprint(printed: float, right: float, meant: float, **further: float) -> Judgement:
    """Return MISPRINT if the printed value is wrong and the intended value is right."""
    near = math.isclose(meant, right, rel_tol=1e-6)
    wrong = near and not math.isclose(printed, right, rel_tol=1e-3)
    finding = Finding.MISPRINT if wrong else judged(near)
    return judgement(finding, printed=printed, right=right, meant=meant, **further)


def _work(theta: float) -> float:
    """Return the integral of eq (18), divided by N m_c g R."""
    weight = BRIDGE.mass_ratio + 0.5
    u = float(BRIDGE.horizontal_displacement(theta))
    v = float(BRIDGE.vertical_displacement(theta))
    return weight * (_GROUND * u + GRAVITY * v) / (GRAVITY * BRIDGE.size)


def _work_slope(cosine: float, sine: float) -> float:
    """Return eq (24) divided by N m_c g R, given the cosine and sine of its argument."""
    return 2.0 * (BRIDGE.mass_ratio + 0.5) * (_GROUND / GRAVITY * cosine + sine)


def _impact(alpha: float, gamma: float) -> float:
    """Solve eqs (37) to (41) for the rate after an impact: two columns of unit mass and size."""
    columns, inertia = 2.0, 4.0 / 3.0
    beam = gamma * columns
    b, h = math.sin(alpha), math.cos(alpha)
    across = 2.0 * beam * h / columns  # (39), times (rate before - rate after)
    upwards = 2.0 * beam * b / columns  # (40), times (rate before + rate after)
    before = inertia - 2.0 * b * math.sin(alpha) - 2.0 * b * upwards + 2.0 * h * across
    return before / (inertia + 2.0 * b * upwards + 2.0 * h * across)
