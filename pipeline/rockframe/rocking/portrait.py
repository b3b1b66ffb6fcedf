"""Moment-rotation curve, overturning barrier and phase portrait of a frame."""

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

    The moment at uplift is N m_c g R (1 + 2 gamma) sin(alpha). The weight of the columns acts at
    half their height, that of the beam at their full height. Figure 4 of the paper shows the curve.

    Parameters
    ----------
    frame : RockingFrame
        The frame.
    theta : array_like
        Rotation [rad]. At 0 the moment can be any value from -1 to 1; 0 is returned.

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
    """Return the outward rate above which a frame on still ground overturns [rad s-1].

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
            f"Frame {frame.name!r} has tendons or dissipaters. The moment and the barrier are "
            "available only for frames without them."
        )


def trajectory(response: Response) -> tuple[Float, Float]:
    """Return rotation [rad] and rate [rad s-1], with the rates before and after each impact.

    Parameters
    ----------
    response : Response
        A response from `respond`. Only its first 4096 impacts are included.

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
    # at an impact on a node, the node has the rate after it, so the impact is inserted before it
    before = np.searchsorted(response.time, response.impact_times, side="left")
    places = np.repeat(before, 2)
    after = response.frame.restitution * response.impact_velocities
    jumps = np.column_stack([response.impact_velocities, after]).ravel()
    return np.insert(response.theta, places, 0.0), np.insert(response.omega, places, jumps)
