"""Claims about parameters of frames, and about a single column."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from rockframe.column import inertia_ratio_of
from rockframe.frame import RockingFrame
from rockframe.paper.claim import Claim, Finding, judged, number_claim
from rockframe.rocking import GroundAcceleration, Response, respond
from rockframe.units import GRAVITY
from rockframe.wavelets.pulse import Pulse

TEMPLE: Final = RockingFrame(height=7.5, width=1.8)
BRIDGE: Final = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
#: Mass ratios for which identities are checked.
_MASS_RATIOS: Final = (0.0, 0.25, 0.3, 1.0, 4.0, 20.0, 1e3)


def temple_claims() -> list[Claim]:
    """Return the claims about the columns of the Temple of Apollo, sections 2 and 7."""
    p = TEMPLE.frequency_parameter
    tangent = TEMPLE.uplift_acceleration / GRAVITY
    return [
        number_claim(
            "temple-p", "sections 2, 7", "p of the 7.5 m x 1.8 m columns", "1.4", p, unit="rad/s"
        ),
        number_claim(
            "temple-slenderness", "section 7", "their slenderness", "13.5",
            math.degrees(TEMPLE.slenderness), unit="degrees",
        ),
        number_claim("temple-uplift", "section 7", "their tan α", "0.24", tangent),
        number_claim(
            "omega-0.6", "section 7", "ω_p / p for T_p = 0.6 s", "7.5", math.tau / (0.6 * p),
            remark="with p = 1.4 as rounded there it is "
            f"{math.tau / (0.6 * 1.4):.2f}",
        ),
        number_claim(
            "omega-0.9", "section 7", "ω_p / p for T_p = 0.9 s", "5", math.tau / (0.9 * p)
        ),
        number_claim("overturning-15", "section 7", "15 g tan α", "3.6", 15.0 * tangent, unit="g"),
        number_claim("overturning-5", "section 7", "5 g tan α", "1.2", 5.0 * tangent, unit="g"),
    ]  # fmt: skip


def block_claims() -> list[Claim]:
    """Return the claims about the block alone, section 2."""
    diagonal = 2.0 * 0.75 * GRAVITY / 8.0**2
    limit = math.degrees(TEMPLE.slenderness_limit)
    return [
        Claim(
            name="brick-p",
            where="section 2",
            says="p of a household brick is about 8 rad/s",
            printed="8 rad/s",
            ours=f"a block of {100.0 * diagonal:.1f} cm diagonal",
            finding=Finding.OPEN,
            remark="the brick's size is not stated",
        ),
        number_claim(
            "plastic-limit", "section 2, eq (6)", "slenderness at which the impact is plastic",
            "54.73", limit, unit="degrees", remark=f"rounds to {limit:.2f}",
        ),
        Claim(
            name="eq-6",
            where="eqs (6), (43)",
            says="the restitution of the frame without a beam is that of the block",
            printed="√r = 1 - (3/2) sin² α",
            ours=f"largest difference {_block_restitution():.1e}",
            finding=judged(_block_restitution() < 1e-14),
        ),
    ]  # fmt: skip


def frame_claims() -> list[Claim]:
    """Return the claims about size, frequency, uplift and restitution of frames."""
    heavy = RockingFrame(height=9.6, width=1.6, mass_ratio=1e15)
    ratio = (heavy.effective_frequency_parameter / heavy.frequency_parameter) ** 2
    forms = _size_forms()
    less, uplift = _least_loss(), _uplift_ratios()
    return [
        Claim(
            name="eq-28",
            where="eq (28)",
            says="the limit of (p̂/p)² under a very heavy beam",
            printed="2/3",
            ours=f"{ratio:.12f}",
            finding=judged(abs(ratio - 2.0 / 3.0) < 1e-12),
        ),
        Claim(
            name="eq-29",
            where="eq (29), Figure 5",
            says="both forms of R̂ / R give the size of the equivalent column",
            printed="(1 + 3γ)/(1 + 2γ) = 1 + γ/(1 + 2γ)",
            ours=f"largest difference from R p²/p̂² {forms:.1e}",
            finding=judged(forms < 1e-13),
            command="rockframe figure 5 --output figure-5.png",
        ),
        Claim(
            name="eq-36",
            where="section 4, eq (36)",
            says="uplift starts at g tan α whatever the beam's mass",
            printed="g tan α",
            ours=f"ground acceleration at uplift over g tan α, for γ = 0, 4, 100: {uplift}",
            finding=judged(all(part == "1.000000000" for part in uplift.split(", "))),
        ),
        Claim(
            name="restitution-order",
            where="section 5, Figure 7",
            says="the frame's largest restitution is always below the column's",
            printed="smaller for every γ > 0",
            ours=f"smaller by {less:.1e} or more for γ from 0.01, α from 1 to 44 degrees",
            finding=judged(less > 0.0),
            command="rockframe figure 7 --output figure-7.png",
        ),
    ]


def bridge_claims() -> list[Claim]:
    """Return the claims about the bridge bent of section 8."""
    round_piers = RockingFrame(
        height=9.6, width=1.6, inertia_ratio=inertia_ratio_of("circular", 9.6, 1.6)
    )
    tangent = BRIDGE.uplift_acceleration / GRAVITY
    return [
        number_claim(
            "bridge-slenderness", "section 8", "tan α of the piers", "0.166", tangent,
            remark=f"1/6 rounds to {tangent:.3f}",
        ),
        number_claim(
            "bridge-p", "section 8", "p of the piers", "1.23", BRIDGE.frequency_parameter,
            unit="rad/s", remark="by 3g/4R, which is of rectangular piers; of the cylindrical ones "
            f"it is {round_piers.frequency_parameter:.4f}",
        ),
        _drift_and_lift(),
    ]  # fmt: skip


def _drift_and_lift() -> Claim:
    theta = np.linspace(0.0, BRIDGE.slenderness, 100_001)
    drift = BRIDGE.horizontal_displacement(theta)
    lift = BRIDGE.vertical_displacement(theta)
    v_of_50 = 100.0 * float(np.interp(0.50, drift, lift))
    u_of_5 = 100.0 * float(np.interp(0.05, lift, drift))
    return Claim(
        name="drift-and-lift",
        where="section 8",
        says="drifts of 20 to 50 cm come with lifts of up to 5 cm",
        printed="v up to 5 cm at u up to 50 cm",
        ours=f"v = {v_of_50:.2f} cm at u = 50 cm; u = {u_of_5:.1f} cm at v = 5 cm",
        finding=judged(v_of_50 <= 5.5),
        remark="by eqs (7) and (10) alone: the two numbers do not fit each other",
    )


def _block_restitution() -> float:
    slendernesses = np.radians(np.linspace(1.0, 54.0, 54))
    return max(
        abs(_frame_of(alpha, 0.0).restitution - (1.0 - 1.5 * math.sin(alpha) ** 2))
        for alpha in slendernesses
    )


def _size_forms() -> float:
    worst = 0.0
    for gamma in _MASS_RATIOS:
        frame = RockingFrame(height=9.6, width=1.6, mass_ratio=gamma)
        size = (frame.frequency_parameter / frame.effective_frequency_parameter) ** 2
        one, other = (1.0 + 3.0 * gamma) / (1.0 + 2.0 * gamma), 1.0 + gamma / (1.0 + 2.0 * gamma)
        worst = max(worst, abs(one - size), abs(other - size))
    return worst


def _least_loss() -> float:
    return min(
        _frame_of(alpha, 0.0).restitution - _frame_of(alpha, gamma).restitution
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


def _frame_of(slenderness: float, mass_ratio: float) -> RockingFrame:
    return RockingFrame(height=5.0, width=5.0 * math.tan(slenderness), mass_ratio=mass_ratio)


#: A pulse under which the bridge does not overturn, and the time of free rocking after it [s].
_PULSE: Final = Pulse(wavelet="symmetric_ricker", a_p=0.5 * GRAVITY, T_p=1.5)
_AFTER: Final = 15.0
#: Number of the impact at which rates are compared.
_IMPACT: Final = 6
#: The column of the same slenderness and of size R-hat, eq (29).
_GROWTH: Final = BRIDGE.effective_size / BRIDGE.size
_COLUMN: Final = RockingFrame(height=_GROWTH * BRIDGE.height, width=_GROWTH * BRIDGE.width)


def one_column_claims() -> list[Claim]:
    """Return the claims about the equivalent column, with its own and with the frame's restitution.

    Examples
    --------
    >>> [claim.finding.value for claim in one_column_claims()]
    ['differs', 'agrees']
    """
    frame = respond(BRIDGE, _PULSE, free_rocking=_AFTER)
    own = respond(_COLUMN, _PULSE, free_rocking=_AFTER)
    losing = RockingFrame(
        height=_COLUMN.height,
        width=_COLUMN.width,
        restitution_factor=BRIDGE.restitution / _COLUMN.restitution,
    )
    lossy = respond(losing, _PULSE, free_rocking=_AFTER)
    under = f"of the bridge under a symmetric Ricker pulse of 0.5 g and {_PULSE.T_p:g} s"
    return [
        Claim(
            name="one-column",
            where="abstract, sections 3 and 4",
            says="the frame's response is identical to that of one column of its slenderness and "
            "larger size",
            printed="identical",
            ours=f"rotations differ by up to {_gap(frame, own):.1e} rad, {_rates(frame, own)}",
            finding=judged(_gap(frame, own) < 1e-9),
            remark=f"{under}; the column with its own restitution, eq (6): the equation of motion "
            "is the same, the impacts are not",
        ),
        Claim(
            name="one-column-losses",
            where="sections 5 and 9",
            says="the same with more energy loss during impacts",
            printed="identical",
            ours=f"rotations differ by up to {_gap(frame, lossy):.1e} rad",
            finding=judged(_gap(frame, lossy) < 1e-9),
            remark=f"{under}; the column with the frame's restitution, eq (43)",
        ),
    ]


def _gap(one: Response, other: Response) -> float:
    return float(np.abs(one.theta - other.theta).max())


def _rates(frame: Response, column: Response) -> str:
    rates = [abs(float(response.impact_velocities[_IMPACT - 1])) for response in (frame, column)]
    return f"rates at impact {_IMPACT}: frame {rates[0]:.4f} rad/s, column {rates[1]:.4f}"
