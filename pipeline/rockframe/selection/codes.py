"""Elastic spectra of design codes, from their parameters or from the maps of the USGS."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Final, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, model_validator

from rockframe.cells import plain
from rockframe.errors import InputError, ParameterError, require_known
from rockframe.options.model import Options, rule
from rockframe.provenance import read_json
from rockframe.selection.models import GroundMotionModels
from rockframe.study.toml import parse, read_text
from rockframe.units import GRAVITY

Float = NDArray[np.float64]

#: Soil factor S and corner periods T_B, T_C, T_D [s] of ground types: EN 1998-1:2004, Table 3.2.
_TYPE_1: Final = {
    "A": (1.0, 0.15, 0.4, 2.0),
    "B": (1.2, 0.15, 0.5, 2.0),
    "C": (1.15, 0.2, 0.6, 2.0),
    "D": (1.35, 0.2, 0.8, 2.0),
    "E": (1.4, 0.15, 0.5, 2.0),
}
#: The same, Table 3.3: for earthquakes with surface-wave magnitudes up to 5.5.
_TYPE_2: Final = {
    "A": (1.0, 0.05, 0.25, 1.2),
    "B": (1.35, 0.05, 0.25, 1.2),
    "C": (1.5, 0.1, 0.25, 1.2),
    "D": (1.8, 0.1, 0.3, 1.2),
    "E": (1.6, 0.05, 0.25, 1.2),
}
#: Periods of a target from a code, if none are stated [s]: from 0.05 s to the 4 s of Eurocode 8.
PERIODS: Final = tuple(round(float(p), 4) for p in np.geomspace(0.05, 4.0, 40))


def asce7_spectrum(periods: ArrayLike, sds: float, sd1: float, long_period: float) -> Float:
    """Return the two-period design response spectrum of ASCE 7 [m s-2].

    Parameters
    ----------
    periods : array_like, shape (periods,)
        Periods [s].
    sds, sd1 : float
        Design spectral accelerations S_DS at short periods and S_D1 at 1 s [m s-2].
    long_period : float
        Long-period transition period T_L [s].

    Raises
    ------
    ParameterError
        Unless all are positive, and the corner S_D1 / S_DS is below T_L.

    Notes
    -----
    ASCE/SEI 7-22, 11.4.5.2, as in 11.4.6 of ASCE/SEI 7-16. The accelerations are those of the
    direction in which they are largest.

    Examples
    --------
    >>> asce7_spectrum([0.0, 0.1, 0.3, 1.0, 16.0], 10.0, 6.0, 8.0).round(3).tolist()
    [4.0, 9.0, 10.0, 6.0, 0.188]
    """
    t = _valid(periods)
    _require_positive(sds=sds, sd1=sd1, long_period=long_period)
    corner = sd1 / sds
    if corner >= long_period:
        raise ParameterError(
            f"Invalid long_period {long_period:g} s. Must be above S_D1 / S_DS, {corner:.3g} s."
        )
    rising = sds * (0.4 + 0.6 * t / (0.2 * corner))
    later = np.maximum(t, corner)
    falling = sd1 / later * np.minimum(1.0, long_period / later)
    return np.where(t < 0.2 * corner, rising, np.minimum(sds, falling))


def eurocode8_spectrum(
    periods: ArrayLike, ground_acceleration: float, ground: str, spectrum_type: int = 1
) -> Float:
    """Return the horizontal elastic response spectrum of Eurocode 8 for 5 % damping [m s-2].

    Parameters
    ----------
    periods : array_like, shape (periods,)
        Periods, up to 4 s.
    ground_acceleration : float
        Design ground acceleration a_g on ground of type A [m s-2], with the importance factor.
    ground : {"A", "B", "C", "D", "E"}
        Ground type.
    spectrum_type : {1, 2}
        Type of the spectrum; 2 is for earthquakes with surface-wave magnitudes up to 5.5.

    Raises
    ------
    ParameterError
        Unless the acceleration is positive, periods are at most 4 s, and type and ground are known.

    Notes
    -----
    EN 1998-1:2004, 3.2.2.2, equations (3.2) to (3.5), with the recommended values of Tables 3.2
    and 3.3; national annexes may state others.

    Examples
    --------
    >>> eurocode8_spectrum([0.0, 0.3, 1.0, 4.0], 2.5, "B").round(4).tolist()
    [3.0, 7.5, 3.75, 0.4688]
    """
    t = _valid(periods)
    _require_positive(ground_acceleration=ground_acceleration)
    require_known("ground", ground, _TYPE_1)
    require_known("spectrum_type", spectrum_type, {1: _TYPE_1, 2: _TYPE_2})
    if t.size and t.max() > 4.0:
        raise ParameterError(
            f"Invalid period {t.max():g} s. Must be at most 4 s for the spectrum of Eurocode 8."
        )
    soil, t_b, t_c, t_d = (_TYPE_1 if spectrum_type == 1 else _TYPE_2)[ground]
    later = np.maximum(t, t_c)
    shape = 2.5 * t_c / later * np.minimum(1.0, t_d / later)
    return ground_acceleration * soil * np.where(t < t_b, 1.0 + 1.5 * t / t_b, shape)


def _valid(periods: ArrayLike) -> Float:
    t = np.atleast_1d(np.asarray(periods, dtype=np.float64))
    if not (np.isfinite(t).all() and (t >= 0.0).all()):
        raise ParameterError("Invalid periods. Must be zero or positive, in seconds.")
    return t


def _require_positive(**values: float) -> None:
    for name, value in values.items():
        if not 0.0 < value < np.inf:
            raise ParameterError(f"Invalid {name} {value!r}. Must be positive.")


_Positive = Annotated[float, Field(gt=0.0, lt=100.0)]


#: Spectra in the answers of the USGS, by level.
_LEVELS: Final = {"design": "multiPeriodDesignSpectrum", "mcer": "multiPeriodMCErSpectrum"}
_WORDS: Final = {"design": "design spectrum", "mcer": "MCE_R spectrum"}
#: Longest text in a file of the USGS that messages and words show, and largest ordinate [g].
_SHOWN, _LARGEST = 60, 20.0


class Asce7(Options):
    """The spectrum of ASCE 7: two-period, from the accelerations that its maps give for a site, or
    multi-period, from the answer of the USGS.
    """

    sds_g: _Positive | None = None
    sd1_g: _Positive | None = None
    long_period_s: _Positive | None = None
    design_maps: str | None = None
    level: Literal["design", "mcer"] = "design"
    scale: _Positive = 1.0

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        two = {"sds_g": self.sds_g, "sd1_g": self.sd1_g, "long_period_s": self.long_period_s}
        missing = [name for name, value in two.items() if value is None]
        if self.design_maps is None and missing:
            raise rule(f"{', '.join(missing)} missing. State them, or design_maps alone")
        if self.design_maps is not None and len(missing) < len(two):
            raise rule("design_maps has the accelerations. Remove the others")
        if self.design_maps is None and self.level != "design":
            raise rule("level has no effect without design_maps. State scale = 1.5 for MCE_R")
        return self

    def at(self, path: Path, periods: ArrayLike) -> tuple[Float, str]:
        """Return the spectrum [m s-2], and its name."""
        if self.design_maps is not None:
            sa, words = design_maps_spectrum(path.parent / self.design_maps, periods, self.level)
            return self.scale * sa, words
        assert self.sds_g and self.sd1_g and self.long_period_s  # noqa: S101, PT018  validated
        values = (self.sds_g * GRAVITY, self.sd1_g * GRAVITY, self.long_period_s)
        return self.scale * asce7_spectrum(periods, *values), "ASCE 7"


class Eurocode8(Options):
    """The elastic spectrum of Eurocode 8, from the acceleration and the type of the ground."""

    ground_acceleration_g: _Positive
    ground: Literal["A", "B", "C", "D", "E"]
    spectrum_type: Literal[1, 2] = 1
    scale: _Positive = 1.0

    def at(self, _path: Path, periods: ArrayLike) -> tuple[Float, str]:
        """Return the spectrum [m s-2], and its name."""
        acceleration = self.ground_acceleration_g * GRAVITY
        sa = eurocode8_spectrum(periods, acceleration, self.ground, self.spectrum_type)
        return self.scale * sa, "Eurocode 8"


class _TargetFile(Options):
    asce_7: Asce7 | None = None
    eurocode_8: Eurocode8 | None = None
    ground_motion_models: GroundMotionModels | None = None


def read_target_file(path: Path) -> Asce7 | Eurocode8 | GroundMotionModels:
    r"""Read the parameters of a target spectrum.

    Parameters
    ----------
    path : Path
        TOML file with one table: ``[asce_7]`` with ``sds_g``, ``sd1_g`` and ``long_period_s`` or
        ``design_maps`` and ``level``; ``[eurocode_8]`` with ``ground_acceleration_g``, ``ground``
        and ``spectrum_type``; or ``[ground_motion_models]`` (`GroundMotionModels`). ``scale``
        multiplies the spectrum, such as 1.5 for MCE_R. Or JSON of the USGS, as `design_maps`.

    Raises
    ------
    InputError
        If the file cannot be read, has no table or two, an unknown key, or an invalid value.

    Examples
    --------
    >>> import tempfile
    >>> text = '[asce_7]\nsds_g = 1.0\nsd1_g = 0.6\nlong_period_s = 8.0\n'
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "site.toml")
    ...     _ = path.write_text(text)
    ...     sa, words = read_target_file(path).at(path, [1.0])
    >>> (sa / GRAVITY).round(3).tolist(), words
    ([0.6], 'ASCE 7')
    """
    if path.suffix.lower() == ".json":
        return Asce7(design_maps=path.name)
    file = parse(path, read_text(path), _TargetFile)
    tables = (file.asce_7, file.eurocode_8, file.ground_motion_models)
    targets = [table for table in tables if table is not None]
    if len(targets) != 1:
        must = "Must be one table, [asce_7], [eurocode_8] or [ground_motion_models]."
        raise InputError(path, f"{len(targets)} targets. {must}")
    return targets[0]


def design_maps_spectrum(path: Path, periods: ArrayLike, level: str) -> tuple[Float, str]:
    """Return the multi-period spectrum of ASCE 7-22 that the USGS states for a site [m s-2].

    Parameters
    ----------
    path : Path
        Answer of the seismic design web service of the USGS for ASCE 7-22 (JSON).
    periods : array_like, shape (periods,)
        Periods, up to the longest of the file [s].
    level : {"design", "mcer"}
        Design level, or MCE_R.

    Returns
    -------
    sa : array, shape (periods,)
        Pseudo-spectral acceleration [m s-2].
    words : str
        The spectrum in words, with the title of the request.

    Raises
    ------
    InputError
        If the file cannot be read, has no such spectrum, or does not cover the periods.

    Notes
    -----
    Between the periods of the file, Sa is linear in the period: ASCE/SEI 7-22, 11.4.5.1. The
    accelerations are those of the direction in which they are largest.
    """
    try:
        answer = read_json(path.read_bytes())
    except OSError as error:
        raise InputError(path, f"cannot be read: {error.strerror}.") from None
    except (ValueError, RecursionError):
        raise InputError(
            path, "is no JSON. Must be the answer of the USGS for ASCE 7-22."
        ) from None
    spectrum = _within(answer, "response", "data", _LEVELS[level])
    listed, sa = (_numbers(spectrum, name) for name in ("periods", "ordinates"))
    if not 2 <= listed.size == sa.size:
        must = "Must be the answer of the USGS design maps for ASCE 7-22"
        raise InputError(
            path, f"no response.data.{_LEVELS[level]} of periods and ordinates. {must}."
        )
    if not (
        (np.diff(listed) > 0.0).all() and listed[0] >= 0.0 and 0.0 < sa.min() <= sa.max() < _LARGEST
    ):
        must = f"Must be increasing periods [s], and ordinates above 0 and below {_LARGEST:g} g"
        raise InputError(path, f"invalid {_LEVELS[level]}. {must}.")
    wanted = _valid(periods)
    for period in wanted:
        if not listed[0] <= period <= listed[-1]:
            covers = f"covers periods from {listed[0]:g} to {listed[-1]:g} s, not {period:g} s"
            raise InputError(path, f"{covers}. State periods within this range.")
    title = _within(answer, "request", "parameters", "title")
    named = f" of {plain(title)[:_SHOWN]}" if isinstance(title, str) and title else ""
    words = f"ASCE 7-22 multi-period {_WORDS[level]}{named}"
    return np.interp(wanted, listed, sa) * GRAVITY, words


def _within(value: Any, *names: str) -> Any:
    """Return the value below these names of nested objects; None if there is none."""
    for name in names:
        value = value.get(name) if isinstance(value, Mapping) else None
    return value


def _numbers(spectrum: Any, name: str) -> Float:
    """Return a list of numbers; empty if it is anything else."""
    values = spectrum.get(name) if isinstance(spectrum, Mapping) else None
    if not isinstance(values, list) or not all(
        isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
        for value in values
    ):
        return np.empty(0)
    return np.array(values, dtype=np.float64)
