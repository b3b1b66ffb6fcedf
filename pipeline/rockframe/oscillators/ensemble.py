"""Plausible isolated decks and monolithic frames, and their responses."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.options.respond import BridgeEnsemble, Ensemble
from rockframe.oscillators.response import (
    Oscillator,
    OscillatorResponse,
    respond_oscillator,
)
from rockframe.rivals import FixedFrame, IsolatedDeck
from rockframe.rocking.assessments import Band, Bands, EnsembleResponse
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.margins.ensemble import quantiles
from rockframe.rocking.margins.members import (
    Versions,
    corner_factors,
    correlations_of,
    draws,
    hypercube,
    require_members,
    turned_degrees,
)
from rockframe.rocking.response import Motion, as_ground
from rockframe.rocking.verdict import ModelEnd, Verdict

Float = NDArray[np.float64]


def bridge_ensemble(ensemble: Ensemble) -> BridgeEnsemble:
    """Return an ensemble with the spreads of bridges that do not rock: their defaults, if it has
    none.
    """
    if isinstance(ensemble, BridgeEnsemble):
        return ensemble
    # not validated: scenarios of a screening may have few members
    return BridgeEnsemble().model_copy(update=ensemble.model_dump())


@lru_cache(maxsize=64)
def bridge_draws(ensemble: BridgeEnsemble) -> dict[str, tuple[float, ...]]:
    """Return the factors of the members on each property of bridges that do not rock [1].

    Examples
    --------
    >>> friction = bridge_draws(BridgeEnsemble())["friction"]
    >>> len(friction), round(friction[0], 4)  # the same in each version
    (64, 0.8539)
    """
    rng = np.random.default_rng([ensemble.seed, 1])  # not the draws of the rocking bridges
    drawn = hypercube(rng, ensemble.members, len(_SPREADS))
    return {
        name: tuple((1.0 + getattr(ensemble, name) * (2.0 * drawn[:, k] - 1.0)).tolist())
        for k, name in enumerate(_SPREADS)
    }


#: Spreads of bridges that do not rock.
_SPREADS: Final = (
    *("friction", "isolator_strength", "isolator_stiffness", "cracked_stiffness"),
    "yield_strength",
)


def bridge_members(
    ensemble: BridgeEnsemble, model: IsolatedDeck | FixedFrame
) -> Sequence[IsolatedDeck | FixedFrame]:
    """Return each member of the ensemble of a bridge that does not rock.

    Raises
    ------
    ParameterError
        If a member is impossible; it names the spread and the value of the member.

    Examples
    --------
    >>> deck = IsolatedDeck.friction_pendulum(radius=2.0, friction=0.06)
    >>> ratios = [one.strength_ratio for one in bridge_members(BridgeEnsemble(), deck)]
    >>> 0.051 < min(ratios) < 0.052 < 0.068 < max(ratios) < 0.069
    True
    """
    factors = bridge_draws(ensemble)
    if isinstance(model, IsolatedDeck):
        pendulum = model.yield_displacement == 0.0
        strength = factors["friction" if pendulum else "isolator_strength"]
        stiffness = (1.0,) * ensemble.members if pendulum else factors["isolator_stiffness"]
        return [
            replace(
                model,
                strength_ratio=model.strength_ratio * strong,
                period=model.period / math.sqrt(stiff),
            )
            for strong, stiff in zip(strength, stiffness, strict=True)
        ]
    bridges = []
    for number, (stiff, strong) in enumerate(
        zip(factors["cracked_stiffness"], factors["yield_strength"], strict=True), 1
    ):
        try:
            bridges.append(
                replace(
                    model,
                    period=model.period / math.sqrt(stiff),
                    stability_coefficient=model.stability_coefficient / stiff,
                    strength_ratio=model.strength_ratio * strong,
                )
            )
        except ParameterError as error:
            raise ParameterError(
                f"Invalid spread cracked_stiffness {ensemble.cracked_stiffness:g} of the ensemble "
                f"of {model.name!r}: member {number} has {stiff:.4g} times the stiffness. {error} "
                "State a smaller spread."
            ) from None
    return bridges


def shaken_members(
    model: Oscillator, motion: Motion, ensemble: BridgeEnsemble, versions: Versions | None = None
) -> list[tuple[Oscillator, GroundAcceleration]]:
    """Return each member of the ensemble of a model, with the ground motion that shakes it."""
    every = [as_ground(motion)] * ensemble.members
    if versions is not None:
        every = [versions.grounds[k] for k in versions.of_member]
    scales = draws(ensemble)[:, 3].tolist()
    grounds = [ground.scaled(scale) for ground, scale in zip(every, scales, strict=True)]
    return list(zip(bridge_members(ensemble, model), grounds, strict=True))


def oscillator_ensemble(
    model: Oscillator,
    motion: Motion,
    ensemble: BridgeEnsemble | None = None,
    versions: Versions | None = None,
) -> EnsembleResponse:
    """Return the response of the ensemble of a bridge that does not rock.

    Parameters
    ----------
    model : IsolatedDeck or FixedFrame
        The bridge as stated.
    motion : Record, Pulse or GroundAcceleration
        Ground acceleration; a vertical component is ignored.
    ensemble : BridgeEnsemble, optional
        Number of members, spreads and seed.
    versions : Versions, optional
        Versions of the motion, one of which shakes each member; by default the motion itself.

    Raises
    ------
    ParameterError
        If the ensemble has no members, or a member is impossible.

    Examples
    --------
    >>> from rockframe import Pulse
    >>> deck = IsolatedDeck.friction_pendulum(radius=2.0, friction=0.06)
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=2.0, T_p=1.5)
    >>> found = oscillator_ensemble(deck, pulse)
    >>> [round(one, 2) for one in found.bands.peak_u], list(found.rank_correlations)
    ([0.15, 0.17, 0.19], ['friction', 'amplitude', 'corner'])
    """
    chosen = ensemble or BridgeEnsemble()
    require_members(chosen)
    each = [respond_oscillator(*pair) for pair in shaken_members(model, motion, chosen, versions)]
    fallen = np.array([response.verdict is Verdict.OVERTURNS for response in each])
    peaks = {
        name: np.where(fallen, np.inf, [getattr(response, name) for response in each])
        for name in _BANDED
    }
    limited = model.abutment is not None or isinstance(model, FixedFrame)
    return EnsembleResponse(
        members=chosen.members,
        uplifted=None,
        overturned=int(fallen.sum()),
        model_ends=sum(response.model_end is not ModelEnd.NONE for response in each)
        if limited
        else None,
        bands=Bands({name: _band(values) for name, values in peaks.items()}),
        rank_correlations=correlations_of(
            peaks["peak_u"],
            bridge_spreads(chosen, model),
            () if versions is None else versions.varied,
        ),
        model_end=_commonest(each),
    )


def _commonest(responses: Sequence[OscillatorResponse]) -> ModelEnd:
    """Return the event that ends the model of most members."""
    ends = [response.model_end for response in responses if response.model_end is not ModelEnd.NONE]
    return max(ends, key=lambda end: (ends.count(end), -end), default=ModelEnd.NONE)


def bridge_spreads(ensemble: BridgeEnsemble, model: Oscillator) -> Mapping[str, Float]:
    """Return the draws of the spreads of a bridge that are not switched off, by name.

    Examples
    --------
    >>> list(bridge_spreads(BridgeEnsemble(corner=1.0), FixedFrame(period=0.5)))
    ['cracked_stiffness', 'amplitude']
    """
    own = bridge_draws(ensemble)
    drawn: dict[str, tuple[float, Float]] = {
        name: (0.0, np.array(own[name])) for name in _spreads_of(model)
    }
    drawn |= {
        "amplitude": (0.0, draws(ensemble)[:, 3]),
        "corner": (1.0, corner_factors(ensemble)),
        "orientation_degree": (0.0, turned_degrees(ensemble)),
    }
    return {name: values for name, (off, values) in drawn.items() if getattr(ensemble, name) != off}


def _spreads_of(model: Oscillator) -> tuple[str, ...]:
    """Return the spreads of the properties that a bridge has."""
    if isinstance(model, IsolatedDeck):
        pendulum = model.yield_displacement == 0.0
        return ("friction",) if pendulum else ("isolator_strength", "isolator_stiffness")
    yields = ("yield_strength",) if math.isfinite(model.strength_ratio) else ()
    return ("cracked_stiffness", *yields)


def _band(peaks: Float) -> Band:
    low, middle, high = quantiles(peaks).tolist()
    return low, middle, high


#: Quantities with bands of bridges that do not rock.
_BANDED: Final = ("peak_u", "peak_v", "peak_base_shear")
