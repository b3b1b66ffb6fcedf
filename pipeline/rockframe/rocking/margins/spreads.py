"""Rank correlations between the spreads of an ensemble and the peaks of its members."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from typing import Final

import numpy as np
import scipy
from numpy.typing import NDArray

from rockframe.options.respond import Ensemble
from rockframe.rocking.margins.members import draws
from rockframe.rocking.margins.versions import Versions, corner_factors, turned_degrees

Float = NDArray[np.float64]

#: Spreads of rocking frames, and the value that switches each off.
_OFF: Final = {
    **{"height": 0.0, "width": 0.0, "impact_loss": 1.0, "amplitude": 0.0},
    **{"corner": 1.0, "orientation_degree": 0.0},
}
#: Share of independent spreads whose rank correlation is larger than that by chance [1].
_BY_CHANCE: Final = 0.05


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
    drawn, peak = _drawn_ranks(ensemble), _centred(ranks(peaks))
    varied = () if versions is None else versions.varied
    found = {}
    for name in spreads_of(ensemble):
        known = name in varied or name not in ("corner", "orientation_degree")
        size = math.sqrt(float(np.square(drawn[name]).sum() * np.square(peak).sum()))
        product = float((drawn[name] * peak).sum())
        found[name] = product / size if known and size > 0.0 else math.nan
    return found


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
    freedom = members - 2
    quantile = float(scipy.special.stdtrit(freedom, 1.0 - 0.5 * _BY_CHANCE))
    return quantile / math.sqrt(freedom + quantile**2)
