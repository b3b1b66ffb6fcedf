"""Members of an ensemble: structures, amplitudes, versions of the motion; their correlations."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.frame import RockingFrame
from rockframe.options.respond import LEAST_MEMBERS, Ensemble, RespondOptions, ScreenOptions
from rockframe.record import Record
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
    powers: Float = np.exp(share * np.log(np.longdouble(factor))).astype(np.float64)
    return powers


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
    structures = []
    for number, row in enumerate(draws(ensemble)[:, :3].tolist(), 1):
        try:
            structures.append(_member(frame, *row))
            ties_of(structures[-1])
        except ParameterError as error:
            raise _impossible(ensemble, frame, number, row, error) from None
    return tuple(structures)


#: Limits within those of every `RockingFrame`: of lengths [m], inertia ratios, velocity ratios of
#: impacts, masses [kg], and moments of ties over that of gravity [1].
_LENGTHS: Final = (0.002, 500.0)
_INERTIA_RATIOS: Final = (1.0 + 1e-6, 99.0)
_RESTITUTIONS: Final = (1e-6, 1.0 - 1e-6)
_MASSES: Final = (1e-99, 1e99)
_MOMENTS: Final = (-1.0, 1e3)


def surely_rock(ensemble: Ensemble, frame: RockingFrame) -> bool:
    """Return True if `members` can certainly make each member; near a limit False.

    All members are checked together, without making them, in a small part of the time. The loss at
    an impact is a power of at most 10 of a velocity ratio within these limits, so it is possible.

    Examples
    --------
    >>> stocky = RockingFrame(height=3.0, width=2.9)
    >>> [surely_rock(Ensemble(width=spread), stocky) for spread in (0.01, 0.9)]
    [True, False]
    """
    taller, wider = draws(ensemble)[:, :2].T
    height, width = taller * frame.height, wider * frame.width
    across = wider * 0.5 * (frame.width + frame.top_contact_width)
    inertia_ratio = frame.resized_inertia(taller, wider)
    column = inertia_ratio * ((taller * frame.centre_height) ** 2 + 0.25 * width**2)
    inertia = column + frame.mass_ratio * (across**2 + height**2)
    lost = (0.5 * width**2 + 2.0 * frame.mass_ratio * across**2) / inertia  # eq (43)
    kept = frame.restitution_factor * (1.0 - lost)
    sizes = (height, width, wider * frame.top_contact_width, taller * frame.centre_height)
    # moments of ties grow with less than the eighth power of a factor
    most = float(max(taller.max(), wider.max(), 1.0 / taller.min(), 1.0 / wider.min())) ** 8
    parts = [part for tie in ties_of(frame) for part in tie[:3] if math.isfinite(part)]
    mass = 1.0 if frame.column_mass is None else frame.column_mass
    return all(
        low < np.min(values) and np.max(values) < high
        for (low, high), values in (
            (_LENGTHS, sizes),
            (_INERTIA_RATIOS, inertia_ratio),
            (_RESTITUTIONS, kept),
            (_MASSES, (mass / most, mass * most)),
            (_MOMENTS, [0.0, *(most * part for part in parts)]),
        )
    )


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
    reasons_in_words = " and ".join(values[name] for name in reasons)
    return ParameterError(
        f"Invalid spread {spreads} of the ensemble of frame {frame.name!r}: member {number} has "
        f"{reasons_in_words}. {error} State a smaller spread."
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


#: Number of values of a spread that takes versions of the motion.
VALUES: Final = 5


@dataclass(frozen=True, eq=False)
class Versions:
    """The versions of one motion, which all structures share.

    Parameters
    ----------
    grounds : tuple of GroundAcceleration
        The versions.
    of_member : array of int, shape (members,)
        Index of the version of each member.
    varied : tuple of str
        The spreads in which the versions differ.
    """

    grounds: tuple[GroundAcceleration, ...]
    of_member: NDArray[np.int64]
    varied: tuple[str, ...]

    def scaled(self, factor: float) -> Self:
        """Return the versions of the motion multiplied by a factor [1]."""
        return replace(self, grounds=tuple(ground.scaled(factor) for ground in self.grounds))


class MakesVersions(Protocol):
    """A motion from which versions can be made."""

    def versions(self, ensemble: Ensemble, motion: Record | GroundAcceleration) -> Versions:
        """Return the versions that the members of an ensemble need."""


@lru_cache(maxsize=16)
def corner_factors(ensemble: Ensemble) -> Float:
    """Return the factor of the lower corner of the band-pass of each member [1].

    The factors are the same for all motions and structures.

    Examples
    --------
    >>> factors = corner_factors(Ensemble())
    >>> sorted({round(one, 3) for one in factors.tolist()})
    [0.5, 0.707, 1.0, 1.414, 2.0]
    """
    largest, root = ensemble.corner, math.sqrt(ensemble.corner)
    factors: Float = np.array([1.0 / largest, 1.0 / root, 1.0, root, largest])[_drawn(ensemble)[0]]
    factors.flags.writeable = False  # the cache returns this array again
    return factors


@lru_cache(maxsize=16)
def turned_degrees(ensemble: Ensemble) -> Float:
    """Return the angle by which the motion of each member is turned clockwise [degree].

    The angles are the same for all motions and structures.

    Examples
    --------
    >>> sorted(set(turned_degrees(Ensemble(orientation_degree=3.0)).tolist()))
    [-3.0, -1.5, 0.0, 1.5, 3.0]
    """
    degrees: Float = ensemble.orientation_degree * np.linspace(-1.0, 1.0, VALUES)
    turned: Float = degrees[_drawn(ensemble)[1]]
    turned.flags.writeable = False
    return turned


def _drawn(ensemble: Ensemble) -> NDArray[np.int64]:
    """Return the values that each member has, counted from 0, shape (2, members).

    The values are as equally frequent as their number allows, and symmetric about the middle one.
    """
    rng = np.random.default_rng([ensemble.seed, 2])  # not the draws of the structures
    values = (2 * np.arange(ensemble.members) + 1) * VALUES // (2 * ensemble.members)
    return np.array([rng.permutation(values) for _ in range(2)])


#: Spreads of rocking frames, and the value that switches each off.
_OFF: Final = {
    **{"height": 0.0, "width": 0.0, "impact_loss": 1.0, "amplitude": 0.0},
    **{"corner": 1.0, "orientation_degree": 0.0},
}
#: Share of independent spreads whose rank correlation is larger than that by chance [1].
_BY_CHANCE: Final = 0.05
#: Number of times that the range of a correlation is halved to find it.
_HALVINGS: Final = 50


def spreads_of(ensemble: Ensemble) -> tuple[str, ...]:
    """Return the names of the spreads of rocking frames that are not switched off.

    Examples
    --------
    >>> spreads_of(Ensemble(height=0.0, corner=1.0))
    ('width', 'impact_loss', 'amplitude')
    """
    return tuple(name for name, off in _OFF.items() if getattr(ensemble, name) != off)


def rank_correlations(
    peaks: Float, ensemble: Ensemble, versions: Versions | None = None
) -> dict[str, float]:
    """Return Spearman's rank correlation between each spread and the peaks of the members [1].

    Parameters
    ----------
    peaks : array, shape (members,)
        Peaks of the members. Those of members that overturn are infinite, the largest ranks.
    ensemble : Ensemble
        The ensemble.
    versions : Versions, optional
        Versions of the motion.

    Returns
    -------
    dict of str to float
        By the names of `spreads_of`. NaN for a spread in which the motion is not varied, and for
        all spreads if all peaks are equal.

    Examples
    --------
    >>> chosen = Ensemble(corner=1.0)
    >>> found = rank_correlations(draws(chosen)[:, 3], chosen)
    >>> round(found["amplitude"], 3), abs(found["height"]) < 0.3
    (1.0, True)
    """
    drawn = _drawn_ranks(ensemble)
    varied = () if versions is None else versions.varied
    return _correlated(peaks, {name: drawn[name] for name in spreads_of(ensemble)}, varied)


def correlations_of(
    peaks: Float, drawn: Mapping[str, Float], varied: Sequence[str] = ()
) -> dict[str, float]:
    """Return Spearman's rank correlation between spreads of any kind and peaks of members [1].

    Parameters
    ----------
    peaks : array, shape (members,)
        Peaks of the members; infinite for members that overturn or collapse.
    drawn : mapping of str to array, shape (members,)
        Draws of each spread.
    varied : sequence of str
        Those of ``corner`` and ``orientation_degree`` in which the versions of the motion differ;
        the others have NaN.
    """
    centred = {name: _centred(ranks(values)) for name, values in drawn.items()}
    return _correlated(peaks, centred, varied)


def _correlated(
    peaks: Float, drawn: Mapping[str, Float], varied: Sequence[str]
) -> dict[str, float]:
    """Return the correlations of peaks with the ranks of draws, less their mean."""
    peak = _centred(ranks(peaks))
    correlations = {}
    for name, values in drawn.items():
        is_varied = name in varied or name not in ("corner", "orientation_degree")
        size = math.sqrt(float(np.square(values).sum() * np.square(peak).sum()))
        product = float((values * peak).sum())
        correlations[name] = product / size if is_varied and size > 0.0 else math.nan
    return correlations


@lru_cache(maxsize=16)
def _drawn_ranks(ensemble: Ensemble) -> Mapping[str, Float]:
    """Return the ranks of the members in each spread, less their mean."""
    columns = (*draws(ensemble).T, corner_factors(ensemble), turned_degrees(ensemble))
    return {name: _centred(ranks(drawn)) for name, drawn in zip(_OFF, columns, strict=True)}


def _centred(values: Float) -> Float:
    return np.asarray(values - values.mean())


def ranks(values: Float) -> Float:
    """Return the ranks of values, counted from 1; equal values have their mean rank.

    Examples
    --------
    >>> ranks(np.array([0.3, np.inf, 0.1, np.inf])).tolist()
    [2.0, 3.5, 1.0, 3.5]
    """
    ordered = np.sort(values)
    below = np.searchsorted(ordered, values, "left")
    return np.asarray(0.5 * (below + np.searchsorted(ordered, values, "right") + 1.0))


@lru_cache(maxsize=16)
def correlation_by_chance(members: int) -> float:
    """Return the rank correlation, up or down, that 5 % of independent spreads exceed [1].

    Examples
    --------
    >>> round(correlation_by_chance(64), 3)
    0.246
    """
    low, high = 0.0, 1.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        rare = _share_within(middle, members) > 1.0 - _BY_CHANCE
        low, high = (low, middle) if rare else (middle, high)
    return high


def _share_within(correlation: float, members: int) -> float:
    """Return the share of independent spreads with a smaller correlation, up or down.

    Correlation is the sine of an angle with a density of the cosine to the power of ``members - 3``
    (the distribution of Student's t). `scipy.special` returns the same, but its import takes a
    tenth of the time of a command.
    """
    cosine, odd = math.sqrt(1.0 - correlation**2), members % 2 == 0
    within, whole = (correlation, 1.0) if odd else (math.asin(correlation), 0.5 * math.pi)
    for power in range(3 if odd else 2, members - 2, 2):  # integration by parts
        within = (cosine ** (power - 1) * correlation + (power - 1) * within) / power
        whole *= (power - 1) / power
    return within / whole
