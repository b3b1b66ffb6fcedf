"""Distributions of peaks with confidence bands, and ranks of motions by demand."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from itertools import islice
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rockframe.risk.fragility import CONFIDENCE
from rockframe.risk.ties import merged

Float = NDArray[np.float64]

#: Largest number of clusters whose draws are kept, which take 1 kB each.
_FEW: Final = 2**17
#: Number of bootstrap samples.
_REPLICATES: Final = 1000
#: Number of shares that are in memory together.
_SHARES: Final = 2**22
#: Number of clusters in the samples that are in memory together.
_DRAWN: Final = 2**20
#: Largest number of means that share their samples.
_COLUMNS: Final = 1024
_QUANTILE: Final = 1.6448536269514722


@dataclass(frozen=True, eq=False)
class Band:
    """Shares of the motions and members, such as those below each level, with 90 % confidence.

    Parameters
    ----------
    share, low, high : array, shape (levels,)
        Share [1], and its bounds.
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
    peaks : array_like, shape (motions,) or (motions, members)
        Peak of each motion, or of each member of an ensemble under it; infinite if the structure
        overturns.
    levels : array_like, shape (levels,)
        Levels of the same quantity.
    clusters : array_like of int, shape (motions,), optional
        Motions with the same number are drawn together in the bootstrap.
    seed : int
        Random seed of the bootstrap.

    Examples
    --------
    >>> band = peak_distribution([0.1, 0.2, 0.4, np.inf], [0.0, 0.3, 1.0])
    >>> band.share.tolist(), band.high.round(2).tolist()
    ([0.0, 0.5, 0.75], [0.4, 1.0, 1.0])
    """
    return mean_share(shares_at_most(peaks, levels), clusters=clusters, seed=seed)


def shares_at_most(peaks: ArrayLike, levels: ArrayLike) -> Float:
    """Return the share of the members under each motion whose peak is at most each level.

    Parameters
    ----------
    peaks, levels : array_like
        As for `peak_distribution`.

    Returns
    -------
    array, shape (motions, levels)

    Examples
    --------
    >>> shares_at_most([[0.1, 0.3], [0.2, np.inf]], [0.2, 1.0]).tolist()
    [[0.5, 1.0], [0.5, 0.5]]
    """
    values = np.asarray(peaks, dtype=np.float64)
    values = values.reshape(len(values), -1)
    if values.shape[1] == 1:
        return np.asarray(values <= np.asarray(levels), dtype=np.float64)
    below = [(values <= level).mean(axis=1) for level in np.asarray(levels)]
    return np.stack(below, axis=1)


def mean_share(shares: ArrayLike, *, clusters: ArrayLike | None = None, seed: int = 0) -> Band:
    """Return the mean of the shares of motions, with a bootstrap band.

    Parameters
    ----------
    shares : array_like, shape (motions, levels)
        Share of each motion [1]: 0 or 1, or a share of the members of an ensemble.
    clusters : array_like of int, shape (motions,), optional
        Motions with the same number are drawn together in the bootstrap.
    seed : int
        Random seed of the bootstrap.

    Notes
    -----
    The bootstrap draws motions, or clusters of them, with all their members: more members do not
    narrow the band. It has no width where all motions have the same share, 0 or 1. The band is
    therefore extended to Wilson's interval for the number of independent motions.

    Examples
    --------
    >>> band = mean_share([[0.0, 0.5], [0.5, 1.0]])
    >>> band.share.tolist(), band.low.round(2).tolist()
    ([0.25, 0.75], [0.0, 0.25])
    """
    (band,) = mean_shares([shares], clusters=clusters, seed=seed)
    return band


def mean_shares(
    shares: Iterable[ArrayLike], *, clusters: ArrayLike | None = None, seed: int = 0
) -> list[Band]:
    """Return `mean_share` of several structures under the same motions, which are drawn once.

    Parameters
    ----------
    shares : iterable of array_like, shape (motions, levels)
        Shares of each structure [1]; only some are in memory at a time.
    clusters, seed
        As for `mean_share`.

    Examples
    --------
    >>> one, other = mean_shares([[[0.0], [0.5]], [[0.5], [1.0]]])
    >>> one.share.tolist(), other.share.tolist()
    ([0.25], [0.75])
    """
    each = (np.asarray(share, dtype=np.float64) for share in shares)
    bands: list[Band] = []
    for first in each:
        motions, levels = first.shape
        together = max(1, min(_COLUMNS, _SHARES // motions) // levels)
        joined = np.concatenate([first, *islice(each, together - 1)], axis=1)
        band = _band(joined, clusters, seed)
        ends = range(levels, joined.shape[1], levels)
        parts = (np.split(end, ends) for end in (band.share, band.low, band.high))
        bands += [Band(*values) for values in zip(*parts, strict=True)]
    return bands


def _band(reached: Float, clusters: ArrayLike | None, seed: int) -> Band:
    """Return the means over the motions, with bands; equal neighbours are computed once.

    Neighbours are often equal: no peak is between two levels.
    """
    differs = np.append(True, (reached[:, 1:] != reached[:, :-1]).any(axis=0))
    different = reached if differs.all() else reached[:, differs]
    band, place = _band_of_each(different, clusters, seed), np.cumsum(differs) - 1
    return Band(band.share[place], band.low[place], band.high[place])


def _band_of_each(reached: Float, clusters: ArrayLike | None, seed: int) -> Band:
    """Return the means over the motions, with bands; motions of one cluster are drawn together."""
    motions = np.arange(len(reached)) if clusters is None else clusters
    _, belongs = np.unique(motions, return_inverse=True)
    count = int(belongs.max()) + 1
    if np.array_equal(belongs, np.arange(len(reached))):  # each motion is a cluster of its own
        total = np.ascontiguousarray(reached)
    else:
        total = np.zeros((count, reached.shape[1]))
        np.add.at(total, belongs, reached)
    sizes = np.bincount(belongs).astype(np.float64)
    drawn_shares = np.concatenate([(n @ total) / (n @ sizes)[:, None] for n in _draws(count, seed)])
    low, high = _tails(drawn_shares)
    share = reached.mean(axis=0)
    least, most = wilson(share, count)
    return Band(share, np.minimum(low, least), np.maximum(high, most))


def _tails(drawn: Float) -> tuple[Float, Float]:
    """Return the quantiles at both ends of the `CONFIDENCE` interval along the first axis.

    They are those of `numpy.quantile`, which takes three times as long: it does not sort rows.
    """
    ordered = np.ascontiguousarray(drawn.T)
    ordered.sort(axis=1)
    tail = 0.5 * (1.0 - CONFIDENCE)
    low, high = (
        np.quantile(ordered[:, math.floor(at) :][:, :2], at % 1.0, axis=1)
        for at in (tail * (len(drawn) - 1), (1.0 - tail) * (len(drawn) - 1))
    )
    return low, high


def _draws(count: int, seed: int) -> Iterable[Float]:
    """Return the number of draws of each cluster, in blocks of the bootstrap samples.

    The draws do not depend on the size of the blocks. They are kept for the next structures.
    """
    drawn = _kept_draws(count, seed) if count <= _FEW else _drawn(count, seed)
    return (draws.astype(np.float64) for draws in drawn)


@lru_cache(maxsize=2)  # motions in one plane, and in both directions
def _kept_draws(count: int, seed: int) -> list[NDArray[np.integer]]:
    return [draws.astype(np.min_scalar_type(draws.max())) for draws in _drawn(count, seed)]


def _drawn(count: int, seed: int) -> Iterator[NDArray[np.integer]]:
    chance, equal = np.random.default_rng(seed), np.full(count, 1.0 / count)
    together = max(1, _DRAWN // count)
    for done in range(0, _REPLICATES, together):
        yield chance.multinomial(count, equal, size=min(together, _REPLICATES - done))


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
    # slightly less, because round-off above a rank would give the next value
    percents = np.asarray(shares, dtype=np.float64) * (1.0 - 1e-12)
    # "higher", because interpolation between a number and infinity is not possible
    return np.stack(
        [
            np.percentile(values[belongs == recording], percents, axis=0, method="higher")
            for recording in np.unique(belongs)
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
    overturned : array_like, shape (motions, scales)
        True if the motion at this scale overturns the structure, or the share of an ensemble [1].
    classes : int
        Number of classes.

    Returns
    -------
    centre, share : array, shape (classes,)
        Geometric mean of the intensities of each class, and its share [1]; NaN for empty classes.
        Observations of equal intensity, also in two classes, count with their mean share.

    Examples
    --------
    >>> centre, share = observed_shares([1.0, 4.0], [1.0, 2.0], [[0, 0], [0, 1]], classes=2)
    >>> centre.round(3).tolist(), share.tolist()
    ([1.414, 5.657], [0.0, 0.5])
    """
    strength = np.asarray(intensity, dtype=np.float64)
    measured = np.isfinite(strength) & (strength > 0.0)
    x = merged(np.log(strength[measured])[:, None] + np.log(np.asarray(scales, dtype=np.float64)))
    fell = np.asarray(overturned, dtype=np.float64)[measured]
    values, place, often = np.unique(x.ravel(), return_inverse=True, return_counts=True)
    means = np.bincount(place, fell.ravel()) / often
    centre, share = np.full(classes, np.nan), np.full(classes, np.nan)
    for k, some in enumerate(np.array_split(np.sort(place), classes)):
        if some.size:
            centre[k] = np.exp(values[some].mean())
            share[k] = means[some].mean()
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


def demand_ranks(peaks: ArrayLike, shares: ArrayLike | None = None) -> Float:
    """Return the rank of each motion by the rotation of each structure: 1 is the most severe.

    Parameters
    ----------
    peaks : array_like, shape (motions, structures)
        Largest |theta| / alpha [1]; infinite if the structure overturns. Equal peaks share the
        mean rank.
    shares : array_like, shape (motions, structures), optional
        Share of an ensemble that overturns [1]. It decides first; equal shares are ranked by the
        peaks, which are then medians of the ensemble.

    Examples
    --------
    >>> demand_ranks([[0.2], [np.inf], [0.2], [0.7]]).ravel().tolist()
    [3.5, 1.0, 3.5, 2.0]
    >>> demand_ranks([[0.2], [0.3], [0.4]], [[0.25], [0.0], [0.0]]).ravel().tolist()
    [1.0, 3.0, 2.0]
    """
    values = -np.asarray(peaks, dtype=np.float64)
    first = values if shares is None else -np.asarray(shares, dtype=np.float64)
    ranks = np.empty_like(values)
    for pair, rank in zip(np.stack([first, values], axis=2).swapaxes(0, 1), ranks.T, strict=True):
        _, place, counts = np.unique(pair, axis=0, return_inverse=True, return_counts=True)
        rank[:] = (np.cumsum(counts) - 0.5 * (counts - 1.0))[place.ravel()]
    return ranks


class RelativeRanks:
    """Mean relative rank of each motion over the structures for which it counts.

    The relative rank is the share of the motions that count for a structure which are more severe;
    the motion itself and its ties count half. It is 0.5 on average, whatever the number of motions,
    so that structures for which different motions count can be compared.

    Examples
    --------
    >>> relative = RelativeRanks()
    >>> relative.add(np.array([[1.0, np.nan], [2.0, np.nan], [np.nan, 1.0], [np.nan, np.nan]]))
    >>> relative.mean.tolist()
    [0.25, 0.75, 0.5, nan]
    """

    def __init__(self) -> None:
        self._total: Float = np.zeros(())
        self._counts = np.zeros((), dtype=np.int64)

    def add(self, ranks: Float) -> None:
        """Add further structures.

        Parameters
        ----------
        ranks : array, shape (motions, structures)
            Ranks; NaN where a motion does not count.
        """
        ranked = np.isfinite(ranks)
        relative = (ranks - 0.5) / np.maximum(ranked.sum(axis=0), 1)
        for of_structure in relative.T:  # in this order, whatever is added together
            self._total = self._total + np.nan_to_num(of_structure)
        self._counts = self._counts + ranked.sum(axis=1)

    @property
    def mean(self) -> Float:
        """Mean relative ranks [1], shape (motions,).

        Small for the most severe motions; NaN for those that count for no structure.
        """
        means = self._total / np.maximum(self._counts, 1)
        return np.where(self._counts > 0, means, np.nan)
