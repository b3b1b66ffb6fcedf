"""Ensembles of plausible structures and amplitudes of the motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.frame import RockingFrame
from rockframe.options.respond import Ensemble, RespondOptions, ScreenOptions

Float = NDArray[np.float64]


def draws(ensemble: Ensemble) -> Float:
    """Return factors of height, width, restitution and amplitude [1], shape (members, 4).

    The four factors are drawn by Latin hypercube sampling.

    Examples
    --------
    >>> draws(Ensemble(seed=1)).shape
    (64, 4)
    """
    rng = np.random.default_rng(ensemble.seed)
    strata = np.column_stack([rng.permutation(ensemble.members) for _ in range(4)])
    drawn = (strata + rng.random(strata.shape)) / ensemble.members
    both = np.array([ensemble.height, ensemble.width, 0.0, ensemble.amplitude])
    down = np.array([0.0, 0.0, ensemble.restitution, 0.0])
    factors: Float = 1.0 + both * (2.0 * drawn - 1.0) - down * drawn
    return factors


def members(ensemble: Ensemble, frame: RockingFrame) -> list[RockingFrame]:
    """Return the structure of each member.

    Raises
    ------
    ParameterError
        If a member cannot rock.
    """
    try:
        return [
            replace(
                frame.resized(height * frame.height, width * frame.width),
                restitution_factor=loss * frame.restitution_factor,
            )
            for height, width, loss, _ in draws(ensemble).tolist()
        ]
    except ParameterError as error:
        raise ParameterError(
            f"Invalid spreads of an ensemble of frame {frame.name!r}: {error}"
        ) from None


def chosen_ensemble(
    options: RespondOptions | ScreenOptions, frames: Sequence[RockingFrame] = ()
) -> Ensemble | None:
    """Return the ensemble of the robust margins; None if the options do not request them.

    Raises
    ------
    ParameterError
        If a member of the ensemble of one of the frames cannot rock.
    """
    if options.margins != "robust":
        return None
    for frame in frames:
        members(options.ensemble, frame)
    return options.ensemble
