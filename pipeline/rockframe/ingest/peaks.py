"""The peak that a header states, against that of the samples."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import InputError
from rockframe.ingest.lines import bad_number, is_number


def require_peak(
    path: Path,
    stated: str,
    samples: NDArray[np.float64],
    units: str,
    line: int,
    *,
    signed: bool = False,
    share: float = 0.0,
) -> None:
    """Refuse samples whose peak is not that which the header states.

    The two may differ by one of the last decimal place that is printed.

    Parameters
    ----------
    path : Path
        The file, for the error.
    stated : str
        The peak as printed in the header.
    samples : array, shape (samples,)
        Acceleration, in the units of the stated peak.
    units : str
        These units, for the error.
    line : int
        Line of the header.
    signed : bool
        Whether the sign of the stated peak is that of the sample; otherwise it says nothing.
    share : float
        Relative difference that is allowed besides [1].

    Raises
    ------
    InputError
        If the stated peak is no number, or is another one.

    Examples
    --------
    >>> require_peak(Path("a.ASC"), "0.31", np.array([0.1, -0.4]), "cm/s2", 38)
    Traceback (most recent call last):
    rockframe.errors.InputError: a.ASC:38: peak 0.31 cm/s2 stated, -0.4 cm/s2 in the samples. ...
    """
    if not is_number(stated.encode("latin-1", "replace")):
        raise bad_number(path, stated.encode("latin-1", "replace"), line, "peak acceleration")
    value = float(stated)
    slack = 1.001 * 10.0 ** -len(stated.partition(".")[2]) + share * abs(value)
    peak = float(samples[np.abs(samples).argmax()])
    found = [float(samples.max()), float(samples.min())] if signed else [abs(peak)]
    expected = value if signed else abs(value)
    near = any(abs(expected - extreme) <= slack for extreme in found)
    if not near or abs(abs(expected) - abs(peak)) > slack:
        raise InputError(
            path,
            f"peak {stated} {units} stated, {peak:.6g} {units} in the samples. Must be equal.",
            line=line,
        )
