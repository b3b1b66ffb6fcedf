"""Which of several measures of intensity tells better what overturns."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
import scipy  # what is used of it is loaded then
from numpy.typing import NDArray

from rockframe.risk.fragility import Fragility, Outcome

Float = NDArray[np.float64]

#: With fewer independent motions no measure is called the better one.
FEWEST_MOTIONS: Final = 10
#: Between two measures that are equally good, one is named with this probability: half of it for
#: each, as the leading one is known only from the data.
_LEVEL: Final = 0.05


@dataclass(frozen=True)
class Preference:
    """The measure that tells better what overturns, if one can be named.

    Parameters
    ----------
    measure : str
        Its name; empty if none can be named.
    reason : str
        Why, or why not, in words.
    """

    measure: str
    reason: str


def better_measure(fits: Mapping[str, Fragility]) -> Preference:
    """Compare fits to the same verdicts by the likelihood of each independent motion.

    Parameters
    ----------
    fits : mapping of str to Fragility
        By the name of the measure; all of the same motions.

    Notes
    -----
    Vuong's (1989) test: the mean difference of log-likelihood over motions, over its standard
    error, against Student's t at 5 %, two-sided. The scales of a motion are one observation here:
    more of them are no more evidence. Chance alone names a measure with a probability of 5 % where
    the differences are normal. Two equally noisy copies of what decides, each with its own fit, had
    a better one in 9, 8 and 5 % of simulations with 10, 20 and 60 motions: of few, it is a hint.

    Examples
    --------
    >>> from rockframe.risk import fit_fragility
    >>> overturned = [[0, 0, 1]] * 3
    >>> fit = fit_fragility([1.0, 1.1, 1.2], [1.0, 1.3, 2.0], overturned)
    >>> better_measure({"pga": fit, "pgv": fit}).reason
    '3 independent motions are too few: at least 10 are needed to name a better measure'
    """
    useful = {
        name: fit
        for name, fit in fits.items()
        if fit.outcome in (Outcome.FITTED, Outcome.SEPARATED)
    }
    if len(useful) < 2:
        return Preference("", f"{len(useful)} measures have a fit: there is nothing to compare")
    motions = next(iter(useful.values())).motions
    if motions < FEWEST_MOTIONS:
        return Preference(
            "",
            f"{motions} independent motions are too few: at least {FEWEST_MOTIONS} are needed to "
            "name a better measure",
        )
    ranked = sorted(useful, key=lambda name: -float(useful[name].log_likelihood.sum()))
    first, second = ranked[:2]
    lead = useful[first].log_likelihood - useful[second].log_likelihood
    error = math.sqrt(motions) * float(lead.std(ddof=1))
    total = float(lead.sum())
    needed = float(scipy.special.stdtrit(motions - 1, 1.0 - 0.5 * _LEVEL))
    if not total > needed * error or total < 1e-9:
        return Preference(
            "", f"{first} and {second} tell it equally well: their difference is within chance"
        )
    return Preference(
        first,
        f"ln L of {first} is above that of {second} by {total:.3g} ± {error:.2g} over {motions} "
        "independent motions",
    )


def compared_motions(intensities: Mapping[str, Float]) -> NDArray[np.bool_]:
    """Return which motions have every measure that any of them has, shape (motions,).

    Examples
    --------
    >>> compared_motions({"pga": np.array([1.0, 2.0]), "a_p": np.array([np.nan, 1.0])}).tolist()
    [False, True]
    """
    useful = [values for values in intensities.values() if np.isfinite(values).any()]
    known = [np.isfinite(values) & (values > 0.0) for values in useful]
    return np.asarray(np.logical_and.reduce(known), dtype=bool)
