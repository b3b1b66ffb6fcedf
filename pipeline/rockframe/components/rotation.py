"""Components of a motion toward an azimuth, and normal and parallel to a fault."""

from __future__ import annotations

import math
from dataclasses import replace
from hashlib import sha256

import numpy as np

from rockframe.components.pair import HorizontalPair
from rockframe.errors import ParameterError
from rockframe.record import LONGEST_ID, Orientation, Record


def rotate(pair: HorizontalPair, azimuth: float) -> Record:
    """Return the component of a motion toward an azimuth.

    Parameters
    ----------
    pair : HorizontalPair
        The two recorded components.
    azimuth : float
        Direction of positive acceleration, clockwise from north [degree]; 450 is 90.

    Returns
    -------
    Record
        The rotated component with the metadata of both.

    Raises
    ------
    ParameterError
        If the azimuth is not finite.

    Examples
    --------
    >>> east, north = (
    ...     Record(record_id=name, acceleration=samples, time_step=0.01, azimuth=azimuth)
    ...     for name, samples, azimuth in (("e", [3.0, 0.0], 90.0), ("n", [4.0, 1.0], 0.0))
    ... )
    >>> southeast = rotate(HorizontalPair(east, north), 135.0)
    >>> southeast.record_id, southeast.acceleration.round(3).tolist()
    ('e-rotated-135', [-0.707, -0.707])
    """
    if not np.isfinite(azimuth):
        raise ParameterError(f"Invalid azimuth {azimuth!r} degrees. Must be finite.")
    azimuth %= 360.0
    one, other = pair.first, pair.second
    end = f"-rotated-{azimuth:g}"
    step = (
        f"rotation: toward azimuth {azimuth:g} degrees, from {one.record_id} "
        f"({one.azimuth:g}) and {other.record_id} ({other.azimuth:g})"
    )
    same_file = one.source_sha256 == other.source_sha256
    return replace(
        one,
        record_id=_within_length(one.record_id, LONGEST_ID - len(end)) + end,
        acceleration=pair.toward([azimuth])[0],
        component=f"{azimuth:g}",
        orientation=Orientation.HORIZONTAL,
        azimuth=azimuth,
        uncorrected=one.uncorrected or other.uncorrected,
        peak_ratio=math.nan,
        filter_low=float(np.fmax(one.filter_low, other.filter_low)),
        filter_high=float(np.fmin(one.filter_high, other.filter_high)),
        source_file=one.source_file if same_file else f"{one.source_file} {other.source_file}",
        source_sha256=one.source_sha256 if same_file else "",
        processing=(*one.processing, step),
    )


def _within_length(name: str, longest: int) -> str:
    """Return the name, shortened if necessary and then made unique by a hash."""
    if len(name) <= longest:
        return name
    mark = f"-{sha256(name.encode()).hexdigest()[:8]}"
    return name[: longest - len(mark)] + mark


def fault_components(pair: HorizontalPair, strike: float) -> tuple[Record, Record]:
    """Return the components normal and parallel to a fault.

    Parameters
    ----------
    pair : HorizontalPair
        The two recorded components.
    strike : float
        Azimuth of the fault, clockwise from north [degree].

    Returns
    -------
    normal, parallel : Record
        Positive toward strike + 90 degrees, and toward the strike.

    Raises
    ------
    ParameterError
        If the strike is not finite.

    Examples
    --------
    >>> east, north = (
    ...     Record(record_id=name, acceleration=samples, time_step=0.01, azimuth=azimuth)
    ...     for name, samples, azimuth in (("e", [3.0, 0.0], 90.0), ("n", [4.0, 1.0], 0.0))
    ... )
    >>> normal, parallel = fault_components(HorizontalPair(east, north), strike=320.0)
    >>> normal.azimuth, parallel.azimuth
    (50.0, 320.0)
    """
    return rotate(pair, (strike + 90.0) % 360.0), rotate(pair, strike)
