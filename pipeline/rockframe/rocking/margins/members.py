"""Members of an ensemble of plausible structures and amplitudes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.frame import RockingFrame
from rockframe.options.respond import LEAST_MEMBERS, Ensemble, RespondOptions, ScreenOptions
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.response import refuse_flight, ties_of

Float = NDArray[np.float64]

#: The spreads of a structure, in the order of `draws`.
_OF_STRUCTURE: Final = ("height", "width", "impact_loss")


@lru_cache(maxsize=16)
def draws(ensemble: Ensemble) -> Float:
    """Return factors of height, width, impact loss and amplitude [1], shape (members, 4).

    The four factors are drawn by Latin hypercube sampling. They are the same for all motions and
    structures.

    Examples
    --------
    >>> draws(Ensemble(seed=1)).shape
    (64, 4)
    """
    drawn = hypercube(np.random.default_rng(ensemble.seed), ensemble.members, 4)
    spreads = np.array([ensemble.height, ensemble.width, 0.0, ensemble.amplitude])
    factors: Float = 1.0 + spreads * (2.0 * drawn - 1.0)
    factors[:, 2] = powers_within(ensemble.impact_loss, drawn[:, 2])
    factors.flags.writeable = False  # the cache returns this array again
    return factors


def powers_within(factor: float, drawn: Float) -> Float:
    """Return numbers from 1 / factor to factor, uniform in their logarithm, of draws from 0 to 1.

    The last bits are the same on every processor, because extended precision is rounded: a rocking
    response would amplify their difference.

    Examples
    --------
    >>> powers_within(2.0, np.array([0.0, 0.5, 1.0])).tolist()
    [0.5, 1.0, 2.0]
    """
    share = 2.0 * drawn.astype(np.longdouble) - 1.0
    found: Float = np.exp(share * np.log(np.longdouble(factor))).astype(np.float64)
    return found


def hypercube(rng: np.random.Generator, members: int, columns: int) -> Float:
    """Return a Latin hypercube of numbers from 0 to 1, shape (members, columns)."""
    strata = np.column_stack([rng.permutation(members) for _ in range(columns)])
    drawn: Float = (strata + rng.random(strata.shape)) / members
    return drawn


@lru_cache(maxsize=1024)
def members(ensemble: Ensemble, frame: RockingFrame) -> tuple[RockingFrame, ...]:
    """Return the structure of each member.

    Raises
    ------
    ParameterError
        If a member cannot rock; it names the spread and the value of the member.
    """
    found = []
    for number, row in enumerate(draws(ensemble)[:, :3].tolist(), 1):
        try:
            found.append(_member(frame, *row))
            ties_of(found[-1])
        except ParameterError as error:
            raise _impossible(ensemble, frame, number, row, error) from None
    return tuple(found)


def _member(frame: RockingFrame, height: float, width: float, loss: float) -> RockingFrame:
    """Return a frame of another size, of which an impact counts as `loss` impacts.

    The logarithm of the velocity ratio is `loss` times that of the frame. It is rounded from
    extended precision, so that it is the same on every processor.
    """
    resized = frame.resized(height * frame.height, width * frame.width)
    kept = np.log(np.longdouble(resized.restitution))
    more = float(np.exp((np.longdouble(loss) - 1.0) * kept))
    return replace(resized, restitution_factor=more * resized.restitution_factor)


def _impossible(
    ensemble: Ensemble, frame: RockingFrame, number: int, row: list[float], error: ParameterError
) -> ParameterError:
    """Return the error of a member that cannot rock, with the spreads that are the reason."""
    reasons = []
    for k, name in enumerate(_OF_STRUCTURE):
        alone = [1.0, 1.0, 1.0]
        alone[k] = row[k]
        try:
            ties_of(_member(frame, *alone))
        except ParameterError:
            reasons.append(name)
    reasons = reasons or [
        name for name, factor in zip(_OF_STRUCTURE, row, strict=True) if factor != 1.0
    ]
    values = {
        "height": f"height {row[0] * frame.height:.4g} m",
        "width": f"width {row[1] * frame.width:.4g} m",
        "impact_loss": f"a velocity ratio of impacts of {frame.restitution ** row[2]:.4g}",
    }
    spreads = " and ".join(f"{name} {getattr(ensemble, name):g}" for name in reasons)
    stated = " and ".join(values[name] for name in reasons)
    return ParameterError(
        f"Invalid spread {spreads} of the ensemble of frame {frame.name!r}: member {number} has "
        f"{stated}. {error} State a smaller spread."
    )


def require_members(ensemble: Ensemble) -> None:
    """Require an ensemble that has members.

    Raises
    ------
    ParameterError
        If it has none.
    """
    if not ensemble.members:
        least = f"Must be at least {LEAST_MEMBERS}."
        raise ParameterError(f"Invalid number of members 0 of an ensemble. {least}")


def require_motion(ensemble: Ensemble, ground: GroundAcceleration, scale: float = 1.0) -> None:
    """Require that the ground falls more slowly than gravity at the amplitude of each member.

    Parameters
    ----------
    ensemble : Ensemble
        The ensemble.
    ground : GroundAcceleration
        The motion, with its vertical acceleration.
    scale : float
        Multiple of the motion to which the members respond [1].

    Raises
    ------
    ParameterError
        If it does not. The message names the spread and the member if the motion itself does.
    """
    refuse_flight(ground, scale)
    if not ensemble.members:
        return
    amplitudes = draws(ensemble)[:, 3]
    member = int(amplitudes.argmax())
    try:
        refuse_flight(ground, scale * float(amplitudes[member]))
    except ParameterError as error:
        at = "" if scale == 1.0 else f" at scale {scale:g}"
        raise ParameterError(
            f"Invalid spread amplitude {ensemble.amplitude:g} of the ensemble: member {member + 1} "
            f"has {amplitudes[member]:.4g} times the motion{at}. {error} State a smaller spread."
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
    if options.margins != "robust" or not options.ensemble.members:
        return None
    for frame in frames:
        members(options.ensemble, frame)
    return options.ensemble
