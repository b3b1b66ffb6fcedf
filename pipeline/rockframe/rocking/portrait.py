"""Paths of a frame in the planes of moment over rotation and of rate over rotation."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rockframe.errors import ParameterError
from rockframe.frame import RockingFrame
from rockframe.rocking.response import Response

Float = NDArray[np.float64]


def restoring_moment(frame: RockingFrame, theta: ArrayLike) -> Float:
    """Return the restoring moment of the frame over the moment at which it uplifts [1].

    That moment is N m_c g R (1 + 2 gamma) sin(alpha): the weight of the columns at their half
    height and that of the beam at the full one. The curve of the paper's Figure 4.

    Parameters
    ----------
    frame : RockingFrame
        The frame.
    theta : array_like
        Rotation [rad]; at 0 any moment between -1 and 1 is taken, and 0 is returned.

    Examples
    --------
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    >>> restoring_moment(bent, [1e-12, bent.slenderness, -bent.slenderness]).round(9) + 0.0
    array([1., 0., 0.])
    """
    _refuse_restrained(frame)
    theta = np.asarray(theta, dtype=np.float64)
    alpha = frame.slenderness
    moment: Float = np.sin(alpha * np.sign(theta) - theta) / math.sin(alpha)
    return moment


def barrier_rate(frame: RockingFrame, theta: ArrayLike) -> Float:
    """Return the rate beyond which a frame on still ground overturns, moving outwards [rad s-1].

    Parameters
    ----------
    frame : RockingFrame
        The frame.
    theta : array_like
        Rotation [rad].

    Notes
    -----
    theta'^2 / 2 = p_hat^2 (1 - cos(alpha - |theta|)): eq (26) on still ground, integrated once.

    Examples
    --------
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    >>> barrier_rate(bent, [0.0, bent.slenderness]).round(4)
    array([0.1688, 0.    ])
    """
    _refuse_restrained(frame)
    left = frame.slenderness - np.abs(np.asarray(theta, dtype=np.float64))
    rate: Float = 2.0 * frame.effective_frequency_parameter * np.abs(np.sin(0.5 * left))
    return rate


def _refuse_restrained(frame: RockingFrame) -> None:
    if frame.restrained:
        raise ParameterError(
            f"Frame {frame.name!r} has tendons or dissipaters. Must be free: with them the moment "
            "and the barrier are other ones."
        )


def trajectory(response: Response) -> tuple[Float, Float]:
    """Return rotation [rad] and rate [rad s-1] with both ends of the jump at each impact.

    Parameters
    ----------
    response : Response
        What `respond` returned; of its impacts the first 4096 are known.

    Returns
    -------
    theta, omega : array, shape (nodes + 2 impacts,)
        In the order of time.

    Examples
    --------
    >>> from rockframe.rocking.response import respond
    >>> from rockframe import Pulse
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=0.5 * 9.81, T_p=1.5)
    >>> response = respond(bent, pulse)
    >>> trajectory(response)[0].size - response.theta.size == 2 * response.impact_times.size
    True
    """
    # the rate at a node that is an impact is the one after it, so the impact goes before the node
    before = np.searchsorted(response.time, response.impact_times, side="left")
    places = np.repeat(before, 2)
    after = response.frame.restitution * response.impact_velocities
    jumps = np.column_stack([response.impact_velocities, after]).ravel()
    return np.insert(response.theta, places, 0.0), np.insert(response.omega, places, jumps)
