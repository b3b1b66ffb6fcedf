"""Excursions of a frame and their distances from the separatrix of the linear theory.

An excursion is the motion from one zero of theta to the next. A linear frame that leaves zero
towards the side s at time t, at the rate omega, overturns without another impact if the distance
D = [omega / p_hat - s I(t)] / alpha - 1 is positive, where
I(t) = p_hat * integral over tau > t of (a(tau) / g) exp(-p_hat (tau - t)) d tau
is the effect of the ground motion after t. At D = 0 the growing solution of
theta'' = p_hat^2 (theta - s alpha - a / g) vanishes. For slender frames D > 0 predicts overturning
nearly exactly; for others it still shows which excursions come near overturning. A vertical
acceleration a_v is included as for small rotations: s a becomes s a + alpha a_v.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.compiled import compiled, inlined

Float = NDArray[np.float64]

# Slots of an excursion.
START: Final = 0  # when it begins [s]
SIDE: Final = 1  # +1 or -1
DISTANCE: Final = 2  # D [1], minus infinity where there are fewer excursions than slots
EXCURSION_SIZE: Final = 3

#: Excursions that begin further below the separatrix are not kept.
LEAST_DISTANCE: Final = -0.5


@inlined
def keep(excursions: Float, who: int, start: float, side: float, distance: float) -> None:
    """Store an excursion in the place of the scenario's lowest one, if its distance is larger."""
    if distance > LEAST_DISTANCE:
        least = 0
        for k in range(1, excursions.shape[1]):
            if excursions[who, k, DISTANCE] < excursions[who, least, DISTANCE]:
                least = k
        if distance > excursions[who, least, DISTANCE]:
            excursions[who, least, START] = start
            excursions[who, least, SIDE] = side
            excursions[who, least, DISTANCE] = distance


@compiled
def fill_ahead(ground: Float, powers: int, rate: float, ahead: Float) -> None:
    """Compute I(t) [1] at the nodes of a ground motion, from its end backwards.

    Parameters
    ----------
    ground : array, shape (intervals, components * powers)
        Coefficients of the acceleration [g] in powers of the time over the interval's length: the
        horizontal component, then the vertical one if there is one.
    powers : int
        Number of powers.
    rate : float
        p_hat times the length of an interval.
    ahead : array, shape (intervals + 1, components)
        Filled with I of the components.
    """
    moments = np.empty(powers)  # rate times the integral of x^j exp(-rate x) over an interval
    for j in range(powers):
        term = rate
        moments[j] = term / (j + 1)
        for k in range(1, 20):
            term *= -rate / k
            moments[j] += term / (j + k + 1)
    decay = math.exp(-rate)
    for c in range(ahead.shape[1]):
        after = 0.0
        ahead[ground.shape[0], c] = 0.0
        for i in range(ground.shape[0] - 1, -1, -1):
            within = 0.0
            for j in range(powers):
                within += moments[j] * ground[i, c * powers + j]
            after = decay * after + within
            ahead[i, c] = after


@compiled
def compare(
    excursions: Float, window: float, tolerance: float, alone: Float, paired: Float
) -> None:
    """Search for the counterparts of each response's excursions in the next response.

    Parameters
    ----------
    excursions : array, shape (responses, kept, EXCURSION_SIZE)
        Excursions of neighbouring responses, the largest distance first.
    window, tolerance : float
        Counterparts are on the same side; their starts differ by less than `window` [s], their
        distances by less than `tolerance` [1].
    alone : array, shape (responses - 1,)
        Filled with the largest distance among the excursions without a counterpart in the other
        response of the pair.
    paired : array, shape (responses - 1,)
        Filled with the largest sum of two numbers: an excursion's distance, and the difference
        between it and its counterpart's.
    """
    for i in range(excursions.shape[0] - 1):
        alone[i] = -math.inf
        paired[i] = -math.inf
        for turn in range(2):
            own, other = excursions[i + turn], excursions[i + 1 - turn]
            for k in range(own.shape[0]):
                distance = own[k, DISTANCE]
                if distance == -math.inf:
                    break
                nearest = math.inf
                for j in range(other.shape[0]):
                    if other[j, DISTANCE] <= distance - tolerance:
                        break
                    if (
                        other[j, SIDE] == own[k, SIDE]
                        and abs(other[j, START] - own[k, START]) < window
                    ):
                        apart = abs(other[j, DISTANCE] - distance)
                        if apart < tolerance:
                            nearest = min(nearest, apart)
                if nearest == math.inf:
                    alone[i] = max(alone[i], distance)
                else:
                    paired[i] = max(paired[i], distance + nearest)
