"""What a user states in TOML, as a strict model: an unknown key or a wrong type is an error."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Annotated, Any, Final

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from rockframe.errors import InputError, ParameterError
from rockframe.frame import RockingFrame

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
    entries = _parse(path)
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


def _parse(path: Path) -> tuple[StructureEntry, ...]:
    try:
        return _StructuresFile.model_validate(_read_toml(path)).structure
    except ValidationError as error:
        first = error.errors()[0]
        raise InputError(path, _explain(first["type"], first)) from None


def _explain(kind: str, error: Any) -> str:
    where = ""
    for part in error["loc"]:
        where += f"[{part}]" if isinstance(part, int) else f".{part}" if where else str(part)
    if kind == "extra_forbidden":
        known = ", ".join(StructureEntry.model_fields if "." in where else ["structure"])
        return f"unknown key {where!r}. Must be one of: {known}."
    if kind == "missing":
        return f"missing key {where!r}. Must be stated."
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
