"""What a user states in TOML, as a strict model: an unknown key or a wrong type is an error."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Annotated, Final, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from rockframe.errors import InputError, ParameterError
from rockframe.frame import RockingFrame, inertia_ratio_of

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


_Location = tuple[str | int, ...]
_MUST_BE: Final = {
    "float_type": "a number",
    "literal_error": "rectangular or circular, in quotes",
    "string_type": "text in quotes",
    "string_pattern_mismatch": "1 to 64 letters, digits, points, hyphens or underscores",
}


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
    section : str
        Section of the columns: rectangular or circular.
    inertia_ratio : float, optional
        I_o / (m_c R^2) of a column of another shape [1], instead of the section.
    restitution_factor : float
        What the restitution of eq (43) is multiplied by [1].
    """

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$")]
    height_m: float
    width_m: float
    mass_ratio: float = 0.0
    section: Literal["rectangular", "circular"] | None = None
    inertia_ratio: float | None = None
    restitution_factor: float = 1.0

    def frame(self) -> RockingFrame:
        """Return the frame that it describes.

        Raises
        ------
        ParameterError
            If it does not rock, or both a section and an inertia ratio are stated.
        """
        if self.section is not None and self.inertia_ratio is not None:
            raise ParameterError(
                f"Invalid inertia_ratio {self.inertia_ratio!r} of frame {self.name!r}. Must not be "
                f"stated beside section {self.section!r}."
            )
        ratio = self.inertia_ratio
        if ratio is None:
            ratio = inertia_ratio_of(self.section or "rectangular", self.height_m, self.width_m)
        return RockingFrame(
            height=self.height_m,
            width=self.width_m,
            mass_ratio=self.mass_ratio,
            name=self.name,
            inertia_ratio=ratio,
            restitution_factor=self.restitution_factor,
        )


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
    text = _read_text(path)
    frames: dict[str, RockingFrame] = {}
    for i, entry in enumerate(_parse(path, text)):
        line = _line_of(text, ("structure", i, "name"))
        if entry.name in frames:
            raise InputError(path, f"name {entry.name!r}. Must not be stated twice.", line)
        try:
            frames[entry.name] = entry.frame()
        except ParameterError as error:
            raise InputError(path, str(error), _line_of(text, ("structure", i))) from None
    return list(frames.values())


def _parse(path: Path, text: str) -> tuple[StructureEntry, ...]:
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(path, f"is not TOML: {error}.") from None
    try:
        return _StructuresFile.model_validate(content).structure
    except ValidationError as invalid:
        # an unknown key explains the missing one beside it
        errors = sorted(invalid.errors(), key=lambda error: error["type"] != "extra_forbidden")
        message, where = _explain(errors[0]["type"], errors[0]["loc"], errors[0]["input"])
        raise InputError(path, message, _line_of(text, where)) from None


def _explain(kind: str, where: tuple[str | int, ...], value: object) -> tuple[str, _Location]:
    """What is wrong and what it must be, and where; the model's own words are for programmers."""
    key = where[-1]
    inside = len(where) > 2
    if kind == "extra_forbidden":
        known = ", ".join(StructureEntry.model_fields) if inside else "[[structure]]"
        return f"unknown key {key!r}. Must be one of: {known}.", where
    if kind == "missing" and inside:
        return f"key {key!r} missing. Must be stated for each structure.", where[:-1]
    if not inside:
        return "no structures. Must hold one [[structure]] table or more.", where[:1]
    must_be = _MUST_BE.get(kind, "valid")
    return f"{key} {value!r}. Must be {must_be}.", where


def _line_of(text: str, where: _Location) -> int | None:
    """Line of a key, counted from 1; of its table if the key is not found; else None."""
    table, wanted = None, where[1] if len(where) > 1 else None
    count = -1
    for number, line in enumerate(text.splitlines(), 1):
        if re.match(r"\s*\[\[\s*structure\s*\]\]", line):
            count += 1
            if count == wanted:
                table = number
        key = where[-1]
        if re.match(rf"\s*\[*\s*\"?{re.escape(str(key))}\"?\s*[=\]]", line) and (
            wanted is None or (count == wanted and len(where) > 2)
        ):
            return number
    return table


def _read_text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise InputError(path, f"cannot be read: {error.strerror}.") from None
    except UnicodeDecodeError as error:
        raise InputError(path, f"is not TOML: {error.reason} at byte {error.start}.") from None
