"""Impulses at the joints during an impact, eqs (39) and (40), and the friction they require."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rockframe.frame import RockingFrame

Float = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Impulses:
    """Impulses on all columns together, over their mass N m_c [m s-1].

    Parameters
    ----------
    base_horizontal, base_vertical : array
        Impulse of the ground on the columns: against the motion, and upwards.
    top_horizontal, top_vertical : array
        Impulse of the beam on the columns: with the motion, and downwards; eqs (39) and (40).
    """

    base_horizontal: Float
    base_vertical: Float
    top_horizontal: Float
    top_vertical: Float


def impact_impulses(frame: RockingFrame, velocity: ArrayLike) -> Impulses:
    """Return the impulses of impacts.

    Parameters
    ----------
    frame : RockingFrame
        The frame.
    velocity : array_like
        Rate of rotation just before each impact [rad s-1]; its sign does not matter.

    Notes
    -----
    Makris and Vassiliou (2013), eqs (39) and (40), with the rate after the impact from eq (43). At
    the base, the change of momentum of the columns is added.

    Examples
    --------
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    >>> impulses = impact_impulses(bent, 0.2)
    >>> round(float(impulses.top_horizontal), 4), round(float(impulses.top_vertical), 4)
    (0.4072, 2.4921)
    """
    speed = np.abs(np.asarray(velocity, dtype=np.float64))
    loss = (1.0 - frame.restitution) * speed
    turn = (1.0 + frame.restitution) * speed
    gamma = frame.mass_ratio
    reach = 0.5 * (frame.width + frame.top_contact_width)
    return Impulses(
        base_horizontal=(frame.centre_height + gamma * frame.height) * loss,
        base_vertical=(0.5 * frame.width + gamma * reach) * turn,
        top_horizontal=gamma * frame.height * loss,
        top_vertical=gamma * reach * turn,
    )


def impact_friction_demand(frame: RockingFrame) -> float:
    """Return the coefficient of friction that base and top joints need in each impact [1].

    It is cot(alpha) (1 - sqrt(r)) / (1 + sqrt(r)) at any speed. With the restitution of eq (43) it
    is below tan(alpha), the friction needed for uplift. If the columns are not prismatic, the
    larger value of the two joints is returned.

    Examples
    --------
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    >>> round(impact_friction_demand(bent), 5)
    0.16337
    """
    loss = (1.0 - frame.restitution) / (1.0 + frame.restitution)
    base = loss / math.tan(frame.slenderness)
    return max(base, loss / math.tan(frame.beam.angle)) if frame.mass_ratio > 0.0 else base


def least_spacing(frame: RockingFrame, beam_centre: float) -> float:
    """Return the spacing of two columns beyond which impacts do not lift the beam off a column [m].

    Parameters
    ----------
    frame : RockingFrame
        The frame.
    beam_centre : float
        Height of the beam's centre of mass above its underside [m].

    Examples
    --------
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    >>> round(least_spacing(bent, 1.0), 3)
    1.927
    """
    loss = (1.0 - frame.restitution) / (1.0 + frame.restitution)
    return frame.top_contact_width + 2.0 * beam_centre * loss / math.tan(frame.beam.angle)
