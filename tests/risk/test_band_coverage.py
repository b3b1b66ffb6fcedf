"""Shares of fits whose bands contain the truth, where it is known.

``python -m tests.risk.test_band_coverage`` prints the shares for other numbers of recordings.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy.stats

from rockframe.risk.fitting import fit_fragility
from rockframe.risk.fragility import Outcome

MEDIAN, BETA, INTENSITY = 1.2, 0.5, 0.7
SCALES = np.array([0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0])
BANDS = ("median", "lognormal beta", f"probability at {INTENSITY:g}")


def coverage(motions: int, fits: int) -> np.ndarray:
    """Return the shares of fits whose bands contain median, lognormal beta, and probability."""
    random = np.random.default_rng(motions)
    probability = float(scipy.stats.norm.cdf(math.log(INTENSITY / MEDIAN) / BETA))
    held = []
    for _ in range(fits):
        intensity = np.exp(0.5 * random.normal(size=motions))
        capacity = MEDIAN * np.exp(BETA * random.normal(size=motions))
        fit = fit_fragility(intensity, SCALES, np.outer(intensity, SCALES) > capacity[:, None])
        if fit.outcome is Outcome.FITTED:
            low, high = fit.band([INTENSITY])
            bands = (fit.median_band, fit.lognormal_beta_band, (float(low[0]), float(high[0])))
            truth = (MEDIAN, BETA, probability)
            held.append([a <= x <= b for x, (a, b) in zip(truth, bands, strict=True)])
    assert len(held) > 0.9 * fits
    return np.asarray(np.mean(held, axis=0))


@pytest.mark.parametrize("motions", [10, 30])
def test_bands_of_few_recordings_are_nearly_wide_enough(motions: int) -> None:
    """Nine in ten should contain the truth."""
    shares = coverage(motions, 400)
    assert (shares > 0.83).all()
    assert (shares < 0.95).all()


if __name__ == "__main__":
    print("recordings  " + ", ".join(BANDS))
    for number in (6, 10, 20, 40, 80):
        print(f"{number:10}  " + ", ".join(f"{share:.2f}" for share in coverage(number, 1500)))
