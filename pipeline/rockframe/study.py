"""What a user states in TOML, as a strict model: an unknown key or a wrong type is an error."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import Annotated, Any, Final, Self, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator
from pydantic_core import PydanticCustomError

from rockframe.errors import InputError, ParameterError
from rockframe.frame import RockingFrame
from rockframe.units import GRAVITY

#: The structures that the package ships.
SHIPPED_STRUCTURES: Final = Path(__file__).parent / "data" / "structures.toml"


def bundled_records() -> Path:
    """Return the folder of the small real records that come with the package.

    Examples
    --------
    >>> bundled_records().name
    'ridgecrest2019'
    """
    installed = Path(__file__).parent / "data" / "ridgecrest2019"
    if installed.is_dir():
        return installed
    return Path(__file__).parents[2] / "records" / "ridgecrest2019"  # a source tree


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class StructureEntry(_Strict):
    """One ``[[structure]]`` of a file of structures.

    Parameters
    ----------
    name : str
        What tables call it: letters, digits, points, hyphens, underscores.
    height_m, width_m : float
        Height and width of a column [m].
    mass_ratio : float
        Mass of the beam over that of all columns [1]; 0 is a column alone.
    """

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$")]
    height_m: float
    width_m: float
    mass_ratio: float = 0.0


#: Not below zero, and a number; infinity switches a limit of what must be at most off, and 0 a
#: limit of what must be at least.
_Limit = Annotated[float, Field(ge=0.0)]


#: Checks whose value must be at least the limit; of all others it must be at most that.
_AT_LEAST: Final = frozenset(
    ["signal_to_noise", "usable_period_longest", "significant_duration", "arias_intensity"]
)


class PassportLimits(_Strict):
    """Limits of the record passport: the ``[passport]`` table.

    Of each check there is a limit that warns and one that rejects. Rejected by default is only what
    no whole record of ground motion shows: flat tops, filled gaps, a peak of 10 g or one that does
    not rise above the noise. The rest depends on the use,
    and old records and mathematical pulses are used with it knowingly: it warns. Each warning limit
    lies where the real records at hand that are whole and well processed mostly pass.

    Parameters
    ----------
    peak_acceleration_warn, peak_acceleration_reject : float
        Peak after processing [m s-2], at most. Few records pass 2 g and none in the archives 5 g;
        10 g are gal taken for g, or no ground motion.
    clipped_samples_warn, clipped_samples_reject : float
        Longest run of equal samples at an extreme [1], at most. Three or four come from rounding
        (few digits, many samples a period); a run of 25 is a flat top.
    constant_time_warn, constant_time_reject : float
        Longest time without any change within the strong motion [s], at most. Ground motion above
        the resolution changes with each sample; half a second of none takes out a whole cycle of
        what rocks a structure.
    opening_share_warn, opening_share_reject : float
        Peak of the first 0.1 s over the peak [1], at most. A tenth is no longer the first arrival:
        the trigger was late. Never rejects by default, for most analogue records are so, and
        pulses in closed form begin at once.
    end_velocity_share_warn, end_velocity_share_reject : float
        Absolute velocity at the end over the peak [1], at most. The ground ends at rest; a tenth of
        the peak shows a baseline that drifts. Never rejects by default: a half-sine ends moving.
    end_displacement_share_warn, end_displacement_share_reject : float
        Absolute displacement at the end over the peak [1], at most. A record near a fault may keep
        a true offset, so the limit is wide: above 0.9 the displacement is all drift, or all fling.
        Never rejects by default.
    signal_to_noise_warn, signal_to_noise_reject : float
        Peak over the root mean square of the noise before the event [1], at least. Noise itself
        peaks at about 4 times its root mean square; at 20 times, a fifth of the peak is noise.
    usable_period_longest_warn, usable_period_longest_reject : float
        Longest usable period [s], at least. Periods of pulses that overturn structures of some
        metres are 0.5 s to 2 s and more.
    significant_duration_warn, significant_duration_reject : float
        D5-95 [s], at least. What is over sooner is a spike or the cut of a record.
    arias_intensity_warn, arias_intensity_reject : float
        Arias intensity [m s-1], at least. A second at 0.003 g makes 1e-4 m/s: only instruments
        feel less.
    signal_to_noise_ratio : float
        Ratio of Fourier amplitudes above which a frequency is usable [1]; 3 is usual.

    References
    ----------
    Boore and Bommer (2005), Processing of strong-motion accelerograms, SDEE 25(2), 93-115: drift,
    corners, and the signal-to-noise ratio.

    Examples
    --------
    >>> PassportLimits(opening_share_reject=0.5).opening_share_reject
    0.5
    """

    peak_acceleration_warn: _Limit = 2.0 * GRAVITY
    peak_acceleration_reject: _Limit = 10.0 * GRAVITY
    clipped_samples_warn: _Limit = 4.0
    clipped_samples_reject: _Limit = 24.0
    constant_time_warn: _Limit = 0.1
    constant_time_reject: _Limit = 0.5
    opening_share_warn: _Limit = 0.1
    opening_share_reject: _Limit = math.inf
    end_velocity_share_warn: _Limit = 0.1
    end_velocity_share_reject: _Limit = math.inf
    end_displacement_share_warn: _Limit = 0.9
    end_displacement_share_reject: _Limit = math.inf
    signal_to_noise_warn: _Limit = 20.0
    signal_to_noise_reject: _Limit = 4.0
    usable_period_longest_warn: _Limit = 2.0
    usable_period_longest_reject: _Limit = 0.0
    significant_duration_warn: _Limit = 0.5
    significant_duration_reject: _Limit = 0.0
    arias_intensity_warn: _Limit = 1e-4
    arias_intensity_reject: _Limit = 0.0
    signal_to_noise_ratio: Annotated[float, Field(gt=1.0)] = 3.0

    def stated(self) -> dict[str, float | None]:
        """Return the limits as JSON has them: None for a limit that is switched off by infinity."""
        return {
            name: value if math.isfinite(value) else None
            for name, value in self.model_dump().items()
        }

    @model_validator(mode="after")
    def _warns_first(self) -> Self:
        """A value that is rejected must be one that would warn."""
        for name in type(self).model_fields:
            check, _, kind = name.rpartition("_")
            if kind != "warn":
                continue
            warn, reject = getattr(self, name), getattr(self, f"{check}_reject")
            at_least = check in _AT_LEAST
            if (reject > warn) if at_least else (reject < warn):
                bound = "at most" if at_least else "at least"
                raise PydanticCustomError(
                    "limits",
                    f"{check}_reject {reject:g}. Must be {bound} {check}_warn, {warn:g}",
                )
        return self


class _LimitsFile(_Strict):
    passport: PassportLimits = PassportLimits()


class _StructuresFile(_Strict):
    structure: Annotated[tuple[StructureEntry, ...], Field(min_length=1, strict=False)]


def read_structures(path: Path = SHIPPED_STRUCTURES) -> list[RockingFrame]:
    """Read the structures of a TOML file.

    Parameters
    ----------
    path : Path
        A file of ``[[structure]]`` tables; without it, the structures that are shipped.

    Returns
    -------
    list of RockingFrame
        In the order of the file.

    Raises
    ------
    InputError
        If the file is missing, is not TOML, has an unknown key or a wrong value, states a name
        twice, or a structure that does not rock.

    Examples
    --------
    >>> [frame.name for frame in read_structures()][:2]
    ['bridge-bent', 'apollo-column']
    """
    entries = _parse(path, _StructuresFile).structure
    frames: dict[str, RockingFrame] = {}
    for i, entry in enumerate(entries):
        where = f"structure[{i}]"
        if entry.name in frames:
            raise InputError(path, f"{where}.name {entry.name!r}. Must not be stated twice.")
        try:
            frames[entry.name] = RockingFrame(
                height=entry.height_m,
                width=entry.width_m,
                mass_ratio=entry.mass_ratio,
                name=entry.name,
            )
        except ParameterError as error:
            raise InputError(path, f"{where}: {error}") from None
    return list(frames.values())


def read_limits(path: Path) -> PassportLimits:
    r"""Read the limits of the record passport.

    Parameters
    ----------
    path : Path
        A TOML file with a ``[passport]`` table; what it does not state keeps its default.

    Raises
    ------
    InputError
        If the file is missing, is not TOML, has an unknown key or a wrong value, or a limit of
        rejection that is passed before that of the warning.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "limits.toml")
    ...     _ = path.write_text("[passport]\nend_velocity_share_reject = 0.5\n")
    ...     read_limits(path).end_velocity_share_reject
    0.5
    """
    return _parse(path, _LimitsFile).passport


_File = TypeVar("_File", bound=BaseModel)


def _parse(path: Path, model: type[_File]) -> _File:
    content = _read_toml(path)
    try:
        return model.model_validate(content)
    except ValidationError as error:
        first = error.errors()[0]
        raise InputError(path, _explain(first["type"], first, model)) from None


def _explain(kind: str, error: Any, model: type[BaseModel]) -> str:
    where = ""
    for part in error["loc"]:
        where += f"[{part}]" if isinstance(part, int) else f".{part}" if where else str(part)
    if kind == "extra_forbidden":
        table = PassportLimits if model is _LimitsFile else StructureEntry
        known = ", ".join(table.model_fields if "." in where else model.model_fields)
        return f"unknown key {where!r}. Must be one of: {known}."
    if kind == "missing":
        return f"missing key {where!r}. Must be stated."
    if kind == "limits":
        return f"{where}.{error['msg']}."
    message = error["msg"][0].lower() + error["msg"][1:]
    return f"{where} {error['input']!r}: {message}."


def _read_toml(path: Path) -> dict[str, Any]:
    try:
        with path.open("rb") as stream:
            return tomllib.load(stream)
    except OSError as error:
        raise InputError(path, f"cannot be read: {error.strerror}.") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(path, f"is not TOML: {error}.") from None
