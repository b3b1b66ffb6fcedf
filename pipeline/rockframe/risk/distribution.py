"""Distributions of peaks with confidence bands, and ranks of motions by demand."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rockframe.risk.fragility import CONFIDENCE

Float = NDArray[np.float64]

#: Number of bootstrap samples.
_REPLICATES: Final = 1000
_QUANTILE: Final = 1.6448536269514722


@dataclass(frozen=True, eq=False)
class Band:
    """A cumulative distribution with its 90 % confidence band.

    Parameters
    ----------
    share, low, high : array, shape (levels,)
        Share of motions whose peak is at most the level, and its bounds [1].
    """

    share: Float
    low: Float
    high: Float


def peak_distribution(
    peaks: ArrayLike, levels: ArrayLike, *, clusters: ArrayLike | None = None, seed: int = 0
) -> Band:
    """Return the share of motions whose peak is at most each level, with a bootstrap band.

    Parameters
    ----------
    peaks : array_like, shape (motions,)
        Peak of each motion; infinite if the structure overturns.
    levels : array_like, shape (levels,)
        Levels of the same quantity.
    clusters : array_like of int, shape (motions,), optional
        Motions with the same number are drawn together in the bootstrap.
    seed : int
        Random seed of the bootstrap.

    Notes
    -----
    The bootstrap band has no width where none or all of the motions are below a level. The band is
    therefore extended to Wilson's interval for the number of independent motions.

    Examples
    --------
    >>> band = peak_distribution([0.1, 0.2, 0.4, np.inf], [0.0, 0.3, 1.0])
    >>> band.share.tolist(), band.high.round(2).tolist()
    ([0.0, 0.5, 0.75], [0.4, 1.0, 1.0])
    """
    values = np.asarray(peaks, dtype=np.float64)
    reached = values[:, None] <= np.asarray(levels, dtype=np.float64)
    _, belongs = np.unique(
        np.arange(values.size) if clusters is None else clusters, return_inverse=True
    )
    count = int(belongs.max()) + 1
    below = np.zeros((count, reached.shape[1]))
    np.add.at(below, belongs, reached)
    sizes = np.bincount(belongs).astype(np.float64)
    drawn = np.random.default_rng(seed).multinomial(
        count, np.full(count, 1.0 / count), size=_REPLICATES
    )
    shares = (drawn @ below) / (drawn @ sizes)[:, None]
    tail = 0.5 * (1.0 - CONFIDENCE)
    low, high = np.quantile(shares, [tail, 1.0 - tail], axis=0)
    share = reached.mean(axis=0)
    least, most = wilson(share, count)
    return Band(share, np.minimum(low, least), np.maximum(high, most))


def over_azimuths(
    peaks: ArrayLike, clusters: ArrayLike, shares: ArrayLike = (0.0, 50.0, 100.0)
) -> Float:
    """Return percentiles of the peaks over the azimuths of each recording, such as RotD50.

    Parameters
    ----------
    peaks : array_like, shape (motions, structures)
        Largest |theta| / alpha [1]; infinite if the structure overturns.
    clusters : array_like of int, shape (motions,)
        Motions with the same number are azimuths of one recording.
    shares : array_like, shape (shares,)
        Percentiles [percent]; the median of an even number of azimuths is the larger middle value.

    Returns
    -------
    array, shape (shares, recordings, structures)
        Recordings in the order of their numbers.

    Examples
    --------
    >>> over_azimuths([[0.1], [np.inf], [0.3]], [0, 0, 0]).ravel().tolist()
    [0.1, 0.3, inf]
    """
    values, belongs = np.asarray(peaks, dtype=np.float64), np.asarray(clusters)
    # "higher", because interpolation between a number and infinity is not possible
    return np.stack(
        [
            np.percentile(values[belongs == one], np.asarray(shares), axis=0, method="higher")
            for one in np.unique(belongs)
        ],
        axis=1,
    )


def observed_shares(
    intensity: ArrayLike, scales: ArrayLike, overturned: ArrayLike, classes: int
) -> tuple[Float, Float]:
    """Return the share that overturns in classes with equal numbers of observations.

    Parameters
    ----------
    intensity : array_like, shape (motions,)
        Intensity of each motion as recorded; motions without a positive value are skipped.
    scales : array_like, shape (scales,)
        Multiples of the motions [1].
    overturned : array_like of bool, shape (motions, scales)
        True if the motion at this scale overturns the structure.
    classes : int
        Number of classes.

    Returns
    -------
    centre, share : array, shape (classes,)
        Geometric mean of the intensities of each class, and its share [1]; NaN for empty classes.

    Examples
    --------
    >>> centre, share = observed_shares([1.0, 4.0], [1.0, 2.0], [[0, 0], [0, 1]], classes=2)
    >>> centre.round(3).tolist(), share.tolist()
    ([1.414, 5.657], [0.0, 0.5])
    """
    strength = np.asarray(intensity, dtype=np.float64)
    known = np.isfinite(strength) & (strength > 0.0)
    x = np.log(strength[known])[:, None] + np.log(np.asarray(scales, dtype=np.float64))
    fell = np.asarray(overturned, dtype=bool)[known]
    order = np.argsort(x, axis=None, kind="stable")
    centre, share = np.full(classes, np.nan), np.full(classes, np.nan)
    for k, some in enumerate(np.array_split(order, classes)):
        if some.size:
            centre[k] = np.exp(x.ravel()[some].mean())
            share[k] = fell.ravel()[some].mean()
    return centre, share


def wilson(share: ArrayLike, count: int) -> tuple[Float, Float]:
    """Return Wilson's 90 % confidence interval for a share of `count` motions [1].

    Examples
    --------
    >>> [bound.round(3).tolist() for bound in wilson([0.0, 0.5], 10)]
    [[0.0, 0.269], [0.213, 0.731]]
    """
    p = np.asarray(share, dtype=np.float64)
    squared = _QUANTILE**2 / count
    middle = (p + 0.5 * squared) / (1.0 + squared)
    half = np.sqrt(squared * p * (1.0 - p) + 0.25 * squared**2) / (1.0 + squared)
    return np.maximum(middle - half, 0.0), np.minimum(middle + half, 1.0)


def demand_ranks(peaks: ArrayLike) -> Float:
    """Return the rank of each motion by the rotation of each structure: 1 is the most severe.

    Parameters
    ----------
    peaks : array_like, shape (motions, structures)
        Largest |theta| / alpha [1]; infinite if the structure overturns. Equal peaks share the
        mean rank.

    Examples
    --------
    >>> demand_ranks([[0.2], [np.inf], [0.2], [0.7]]).ravel().tolist()
    [3.5, 1.0, 3.5, 2.0]
    """
    values = -np.asarray(peaks, dtype=np.float64)
    ranks = np.empty_like(values)
    for column, rank in zip(values.T, ranks.T, strict=True):
        ordered = np.sort(column)
        first = np.searchsorted(ordered, column, side="left")
        last = np.searchsorted(ordered, column, side="right")
        rank[:] = 0.5 * (first + last + 1)
    return ranks
