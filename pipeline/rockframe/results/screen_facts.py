"""The variables of screen.nc besides the scenarios: of motions and statistics of verdicts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import IntEnum
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from rockframe.results.variables import flags, record_ids, texts, variable
from rockframe.risk import MEASURES, Band, Fragility, Outcome

Float = NDArray[np.float64]

#: Numbers of a motion, by variable: unit, long name.
_OF_MOTION: Final = {
    "magnitude": ("1", "magnitude of the earthquake"),
    "epicentral_distance": ("km", "distance to the epicentre"),
    "vs30": ("m s-1", "mean velocity of shear waves in the uppermost 30 m"),
    "azimuth": ("degree", "direction of positive acceleration, clockwise from north"),
    "pga": ("m s-2", "peak ground acceleration"),
    "pgv": ("m s-1", "peak ground velocity, at rest before the record"),
    "a_p": ("m s-2", "amplitude of the best acceleration pulse"),
    "T_p": ("s", "period of the best acceleration pulse"),
    "L_p": ("m", "length scale of the best pulse, a_p T_p^2"),
}
_UNITS: Final = {name: _OF_MOTION[name][0] for name in MEASURES}
#: Numbers of a fragility curve, by variable: long name.
_OF_FIT: Final = {
    "median": "intensity at which half overturn, in the unit of the measure",
    "logistic_scale": "scale of the logistic distribution of the logarithm of the intensity",
    "lognormal_beta": "standard deviation of that logarithm, pi / sqrt(3) times logistic_scale",
    "intercept": "logit at an intensity of one unit",
    "slope": "slope of the logit over the logarithm of the intensity",
    "pseudo_r2": "McFadden's 1 - ln L / ln L_0",
    "concordance": "share of pairs, one overturned and one not, of which the first is stronger",
    "brier": "mean squared error of the probability",
    "lowest": "weakest intensity tried, in the unit of the measure",
    "highest": "strongest intensity tried, in the unit of the measure",
    "safe_to": "strongest intensity that stands, in the unit of the measure",
    "overturned_from": "weakest intensity that overturns, in the unit of the measure",
}
_COUNTS: Final = {
    "motions": "independent motions",
    "observations": "motions times scales",
    "overturned": "how many of these overturn",
}


class _Known(IntEnum):
    DECIDED = 0
    UNDECIDED = 1


def motion_variables(
    names: Sequence[str],
    sources: Sequence[tuple[str, str]],
    clusters: NDArray[np.int64],
    numbers: Mapping[str, Float],
) -> dict[str, xr.Variable]:
    """Return what is known of each motion, along ``record``.

    Parameters
    ----------
    names : sequence of str
        Identifiers.
    sources : sequence of (str, str)
        Event and station of each.
    clusters : array of int, shape (motions,)
        Motions of one number are not independent.
    numbers : mapping of str to array, shape (motions,)
        As in `Facts.numbers`.
    """
    return {
        "record_id": record_ids(names),
        "event": texts("record", [event for event, _ in sources], "name of the earthquake"),
        "station": texts("record", [s for _, s in sources], "code or name of the station"),
        "cluster": variable(
            "record",
            clusters.astype(np.int32),
            "1",
            "number of the recording that the motion is a component or an azimuth of",
        ),
        **{
            name: variable("record", numbers[name], units, long_name)
            for name, (units, long_name) in _OF_MOTION.items()
        },
    }


def margin_variables(columns: Mapping[str, NDArray[Any]]) -> dict[str, xr.Variable]:
    """Return critical scales, safe islands and what is undecided; arrays (motions, structures)."""
    pairs = ("record", "structure")
    return {
        "critical_scale": variable(
            pairs, columns["critical_scale"], "1", "least multiple of the motion that overturns"
        ),
        "safe_islands": variable(
            pairs, columns["safe_islands"], "1", "number of safe intervals above it"
        ),
        "undecided": flags(
            pairs,
            columns["undecided"],
            _Known,
            "whether the verdict under the motion as recorded changes with small perturbations",
        ),
    }


def demand_variables(
    reference: float, ranks: Float, levels: Float, bands: Sequence[Band], counts: NDArray[np.int64]
) -> dict[str, xr.Variable]:
    """Return ranks, distributions of peaks and counts of verdicts.

    Parameters
    ----------
    reference : float
        Scale that ranks and distributions are of [1].
    ranks : array, shape (motions, structures)
        1 is the most severe.
    levels : array, shape (levels,)
        Of |theta| / alpha [1].
    bands : sequence of Band
        Of each structure.
    counts : array of int, shape (structures, scales, verdicts)
        How many motions have each verdict.
    """
    of_level = ("structure", "level")
    return {
        "reference_scale": variable((), reference, "1", "scale of ranks and distributions"),
        "demand_rank": variable(
            ("record", "structure"),
            ranks,
            "1",
            "rank of the motion by peak rotation, 1 the largest",
        ),
        "mean_rank": variable("record", ranks.mean(axis=1), "1", "mean rank over the structures"),
        "level": variable("level", levels, "1", "level of |theta| / slenderness"),
        **{
            name: variable(
                of_level, np.stack([getattr(band, part) for band in bands]), "1", long_name
            )
            for name, part, long_name in (
                ("peak_share", "share", "share of motions whose peak is at most the level"),
                ("peak_share_low", "low", "its lower bound of 90 % confidence"),
                ("peak_share_high", "high", "its upper bound of 90 % confidence"),
            )
        },
        "verdict_count": variable(
            ("structure", "scale", "outcome"), counts, "1", "number of motions of each verdict"
        ),
        "outcome": texts("outcome", ["no_uplift", "safe", "overturned"], "verdict"),
    }


def azimuth_variables(names: Sequence[str], percentiles: Float) -> dict[str, xr.Variable]:
    """Return the percentiles over azimuths of each recording.

    Parameters
    ----------
    names : sequence of str
        Its first motion.
    percentiles : array, shape (3, recordings, structures)
        RotD00, RotD50 and RotD100 of |theta| / alpha [1]; infinite where it overturns.
    """
    words = ("the least over the azimuths", "their median", "the largest over the azimuths")
    return {
        "recording": texts("recording", names, "first motion of the recording"),
        **{
            f"{name}_peak_rotation_ratio": variable(
                ("recording", "structure"),
                values,
                "1",
                f"largest |theta| / slenderness at the reference scale, {said}",
                comment="infinite: it overturns",
            )
            for name, values, said in zip(
                ("rotd00", "rotd50", "rotd100"), percentiles, words, strict=True
            )
        },
    }


def fragility_variables(
    fits: Sequence[Mapping[str, Fragility]],
    better: Sequence[tuple[str, str]],
    points: Mapping[str, Float],
) -> dict[str, xr.Variable]:
    """Return fragility curves of each structure over each measure.

    Parameters
    ----------
    fits : sequence of mapping of str to Fragility
        Of each structure, by measure.
    better : sequence of (str, str)
        The better measure for each structure, if one can be named, and why (not).
    points : mapping of str to array, shape (points,)
        Intensities of each measure at which the curves are given; NaN if it is unknown.
    """
    rows = [[fit[name] for name in MEASURES] for fit in fits]
    pairs = ("structure", "measure")

    def of_fit(name: str, words: str, kind: type[Any] = np.float64) -> xr.Variable:
        data = np.array([[getattr(fit, name) for fit in row] for row in rows], dtype=kind)
        return variable(pairs, data, "1", words)

    return {
        "measure": texts("measure", list(MEASURES), "measure of intensity"),
        "measure_units": texts(
            "measure", [_UNITS[name] for name in MEASURES], "unit of the measure"
        ),
        "fragility_outcome": flags(
            pairs, [[fit.outcome for fit in row] for row in rows], Outcome, "what can be said"
        ),
        **{f"fragility_{name}": of_fit(name, words) for name, words in _OF_FIT.items()},
        **{f"fragility_{name}": of_fit(name, words, np.int64) for name, words in _COUNTS.items()},
        "log_likelihood": variable(
            pairs,
            np.array([[_total(fit) for fit in row] for row in rows]),
            "1",
            "largest logarithm of the likelihood",
        ),
        **_curves(rows, [points[name] for name in MEASURES]),
        "better_measure": texts(
            "structure", [name for name, _ in better], "measure that tells better what overturns"
        ),
        "better_measure_reason": texts("structure", [why for _, why in better], "why, or why not"),
    }


def _curves(rows: list[list[Fragility]], grid: list[Float]) -> dict[str, xr.Variable]:
    dims = ("structure", "measure", "point")
    bands = [[fit.band(x) for fit, x in zip(row, grid, strict=True)] for row in rows]
    share = [[fit.probability(x) for fit, x in zip(row, grid, strict=True)] for row in rows]
    low, high = (np.array([[band[part] for band in row] for row in bands]) for part in (0, 1))
    return {
        "fragility_intensity": variable(
            ("measure", "point"), np.stack(grid), "1", "intensity, in the unit of the measure"
        ),
        "fragility": variable(dims, np.array(share), "1", "probability of overturning"),
        "fragility_low": variable(dims, low, "1", "its lower bound"),
        "fragility_high": variable(dims, high, "1", "its upper bound"),
    }


def observed_variables(
    observed: Sequence[Mapping[str, tuple[Float, Float]]],
) -> dict[str, xr.Variable]:
    """Return the shares that overturn in classes of intensity, of each structure, by measure."""
    dims = ("structure", "measure", "bin")
    centre, share = (
        np.array([[row[name][part] for name in MEASURES] for row in observed]) for part in (0, 1)
    )
    return {
        "bin_intensity": variable(
            dims, centre, "1", "mean intensity of the class, in the unit of the measure"
        ),
        "bin_share": variable(dims, share, "1", "share of the class that overturns"),
    }


def _total(fit: Fragility) -> float:
    return float(fit.log_likelihood.sum()) if fit.log_likelihood.size else float("nan")
