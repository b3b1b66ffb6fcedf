"""Claims that a frame rocks like one larger column: abstract, sections 3 to 5 and 9."""

from __future__ import annotations

from typing import Final

import numpy as np

from rockframe.frame import RockingFrame
from rockframe.paper.claim import Claim, judged
from rockframe.paper.parameters import BRIDGE
from rockframe.rocking import Response, respond
from rockframe.units import GRAVITY
from rockframe.wavelets.pulse import Pulse

#: A pulse that the bridge survives, and the duration of free rocking after it [s].
_PULSE: Final = Pulse(wavelet="symmetric_ricker", a_p=0.5 * GRAVITY, T_p=1.5)
_AFTER: Final = 15.0
#: Number of the impact at which rates are compared.
_IMPACT: Final = 6
#: The column of the same slenderness and of size R-hat, eq (29).
_GROWTH: Final = BRIDGE.effective_size / BRIDGE.size
_COLUMN: Final = RockingFrame(height=_GROWTH * BRIDGE.height, width=_GROWTH * BRIDGE.width)


def one_column_claims() -> list[Claim]:
    """Return the claims about the equivalent column, with its own restitution and the frame's.

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
            ours=f"rotations differ by up to {_apart(frame, own):.1e} rad, {_rates(frame, own)}",
            finding=judged(_apart(frame, own) < 1e-9),
            remark=f"{under}; the column with its own restitution, eq (6): the equation of motion "
            "is the same, the impacts are not",
        ),
        Claim(
            name="one-column-losses",
            where="sections 5 and 9",
            says="the same with more energy loss during impacts",
            printed="identical",
            ours=f"rotations differ by up to {_apart(frame, lossy):.1e} rad",
            finding=judged(_apart(frame, lossy) < 1e-9),
            remark=f"{under}; the column with the frame's restitution, eq (43)",
        ),
    ]


def _apart(one: Response, other: Response) -> float:
    return float(np.abs(one.theta - other.theta).max())


def _rates(frame: Response, column: Response) -> str:
    rates = [abs(float(response.impact_velocities[_IMPACT - 1])) for response in (frame, column)]
    return f"rates at impact {_IMPACT}: frame {rates[0]:.4f} rad/s, column {rates[1]:.4f}"
