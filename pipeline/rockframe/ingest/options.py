"""Values that the user states for files that do not state them; they never override a file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from rockframe.errors import InputError, ParameterError, require_words
from rockframe.ingest.containers import Content
from rockframe.units import acceleration_factor, plain_units

#: Relative tolerance between two stated time steps.
_SAME_STEP: Final = 1e-9


@dataclass(frozen=True)
class ReadOptions:
    """Values that files may lack: units, time step, and instrument response.

    Parameters
    ----------
    units : str, optional
        Acceleration units: ``g``, ``gal``, ``cm/s2``, ``mm/s2`` or ``m/s2``.
    time_step : float, optional
        Interval between samples [s].
    station_xml : str or Path, optional
        StationXML file for miniSEED and SAC files (default: `archived`, and the files in `folder`).
    water_level : float, optional
        Remove the full response from miniSEED records with this water level [dB] (default: divide
        by the sensitivity).
    column : str, optional
        Name or number of the column of acceleration in text files, or ``all`` if the columns are
        one series, line by line.
    streams : str, optional
        Streams of ASDF files: ``processed``, ``raw``, or their label (default: ``processed``).
    trust : tuple of str
        Words of `rockframe.errors.TRUSTED`: which of two contradictory statements of a file is
        right (default: a file that contradicts itself is rejected).
    trust_of : mapping of str to tuple of str
        The same words by name of file; they take precedence.
    archived : tuple of Content
        StationXML files in the same archive.
    folder : Path, optional
        Folder of StationXML files (default: the folder of the file).

    Raises
    ------
    ParameterError
        If the units are unknown, if time step or water level are not positive and finite, or if
        a trusted word is unknown.

    Examples
    --------
    >>> ReadOptions(units="g", time_step=0.01).units
    'g'
    """

    units: str | None = None
    time_step: float | None = None
    station_xml: str | Path | None = None
    water_level: float | None = None
    column: str | None = None
    streams: str | None = None
    trust: tuple[str, ...] = ()
    trust_of: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    archived: tuple[Content, ...] = ()
    folder: Path | None = None

    def __post_init__(self) -> None:
        require_words(self.trust)
        if self.units is not None:
            object.__setattr__(self, "units", plain_units(self.units))
            acceleration_factor(self.units)
        numbers = (("time step", self.time_step, "s"), ("water level", self.water_level, "dB"))
        for name, value, unit in numbers:
            if value is not None and not 0.0 < value < math.inf:
                message = f"Invalid {name} {value!r} {unit}. Must be positive and finite."
                raise ParameterError(message)


#: Options without any values: files must state everything themselves.
NO_OPTIONS: Final = ReadOptions()


def factor_to_si(
    path: Path, stated: str | None, options: ReadOptions, line: int | None = None
) -> float:
    """Return the size [m s-2] of the units: those of the file or, if it states none, the user's.

    Parameters
    ----------
    stated : str or None
        Units stated in the file.
    line : int, optional
        Line number where the file states them.

    Raises
    ------
    InputError
        If neither the file nor the user states units, or if they disagree.

    Examples
    --------
    >>> factor_to_si(Path("motion.csv"), None, ReadOptions(units="gal"))
    0.01
    """
    given = options.units
    if stated is None and given is None:
        message = "acceleration units unstated. State them in the column name (as in 'acc_g') "
        raise InputError(path, f"{message}or with --units.", line)
    factor = acceleration_factor(stated or given or "")
    if given is not None and acceleration_factor(given) != factor:
        message = f"acceleration units {given!r} given, but the file states {stated!r}."
        raise InputError(path, message, line)
    return factor


def settle_time_step(
    path: Path, stated: float, options: ReadOptions, line: int | None = None
) -> float:
    """Return the time step that a header states [s], after comparing it with the user's.

    Raises
    ------
    InputError
        If the time step is not positive and finite, or if the user stated another time step.

    Examples
    --------
    >>> settle_time_step(Path("motion.AT2"), 0.005, ReadOptions())
    0.005
    """
    if not (math.isfinite(stated) and stated > 0.0):
        raise InputError(path, f"time step {stated!r} s. Must be positive and finite.", line=line)
    given = options.time_step
    if given is not None and not math.isclose(given, stated, rel_tol=_SAME_STEP):
        message = f"time step {given!r} s given, but the file states {stated!r} s."
        raise InputError(path, message, line)
    return stated
