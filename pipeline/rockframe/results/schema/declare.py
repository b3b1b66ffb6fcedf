"""Declare a kind of file and its variables."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import IntEnum, IntFlag
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from rockframe.results.schema.arrays import Array, Arrays

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class Variable:
    """One variable of a kind of file.

    Parameters
    ----------
    name : str
        Name in the file.
    along : str
        Dimensions, separated by spaces.
    dtype : type
        ``float``, a type of integers, ``str``, or the enumeration of a flag, stored as int8.
    units : str
        Unit as CF writes it; ``1`` for a ratio, a count, a flag or a text.
    long_name : str
        Description.
    source : str
        The object that has the value, and the attribute if its name differs: ``match.pulse.T_p``.
    valid : {"", "any", "finite", "positive", "finite or absent"}
        Allowed values; ``finite or absent`` allows NaN too. By default integers are zero or
        positive, and numbers may be NaN or infinite.
    key : bool
        The values identify the positions along the dimension: they are unique, and texts are safe
        as names of files.
    choices : tuple of str
        Allowed texts; empty if any text is allowed.
    refers_to : str
        The key whose values it contains; for integers, the dimension whose positions it contains.
    also_units : str
        Other allowed units: ``m or m s-1``.
    group : str
        Name of the optional group: a file has all variables of a group, or none. Empty for
        variables that every file has.
    of_files : {"", "all records", "one batch"}
        The files that have the variable: all files, only those of all records (the file of one
        batch does not), or only those of one batch.
    comment : str
        Further explanation.
    attrs : mapping of str to str
        Further attributes.
    """

    name: str
    along: str
    dtype: type[Any]
    units: str
    long_name: str
    source: str = ""
    valid: Literal["", "any", "finite", "positive", "finite or absent"] = ""
    key: bool = False
    choices: tuple[str, ...] = ()
    refers_to: str = ""
    also_units: str = ""
    group: str = ""
    of_files: Literal["", "all records", "one batch"] = ""
    comment: str = ""
    attrs: Mapping[str, str] = field(default_factory=dict)

    @cached_property
    def dims(self) -> tuple[str, ...]:
        """Its dimensions."""
        return tuple(self.along.split())

    @cached_property
    def holds(self) -> Literal["text", "flags", "integers", "numbers"]:
        """Kind of the values."""
        if self.dtype is str:
            return "text"
        if issubclass(self.dtype, IntEnum | IntFlag):
            return "flags"
        return "numbers" if self.dtype is float else "integers"

    @cached_property
    def holder(self) -> str:
        """The object that has the value, as `source` names it."""
        return self.source.partition(".")[0]

    @cached_property
    def attribute(self) -> str:
        """The attribute of this object with the value."""
        return self.source.partition(".")[2] or self.name

    def described(self, units: str = "") -> dict[str, Any]:
        """Return its attributes in a dataset, with this one of the allowed units."""
        flagged: type[IntEnum | IntFlag] = self.dtype
        return {
            "units": units or self.units,
            "long_name": self.long_name,
            **(_flag_attributes(flagged) if self.holds == "flags" else {}),
            **({"comment": self.comment} if self.comment else {}),
            **self.attrs,
        }

    def holding(self, data: Any, units: str = "") -> Array:
        """Return the variable with these values."""
        return Array.of(self.dims, self.array(data), self.described(units))

    @property
    def unknown(self) -> Any:
        """The value in place of one that is not there; a row of NaN for quantiles."""
        if self.holds == "numbers":
            return (math.nan,) * 3 if self.dims[-1:] == ("quantile",) else math.nan
        return "" if self.holds == "text" else 0

    def value_of(self, thing: object) -> Any:
        """Return this variable's value of an object; if the object has none, the value of unknowns.

        Examples
        --------
        >>> Variable("peak_u", "record", float, "m", "largest |u|").value_of(None)
        nan
        """
        for name in self.attribute.split("."):
            thing = getattr(thing, name, None)
        return self.unknown if thing is None else thing

    def array(self, data: Any) -> NDArray[Any]:
        """Return values as an array of the type in the file."""
        if self.holds == "text":
            texts = np.array(data, dtype=object)
            return np.array([str(text) for text in texts.flat], dtype=object).reshape(texts.shape)
        return np.asarray(data, dtype=np.int8 if self.holds == "flags" else self.dtype)


@cache
def _flag_attributes(kind: type[IntEnum | IntFlag]) -> Mapping[str, Any]:
    """Return the values (or bits) and the meanings of an enumeration."""
    members = list(kind)
    numbers = np.array([member.value for member in members], dtype=np.int8)
    return {
        "flag_masks" if issubclass(kind, IntFlag) else "flag_values": numbers,
        "flag_meanings": " ".join(str(member.name).lower() for member in members),
    }


def optional(group: str, *variables: Variable) -> tuple[Variable, ...]:
    """Declare an optional group of variables: a file has all of them or none."""
    return tuple(replace(variable, group=group) for variable in variables)


def of_all_records(*variables: Variable) -> tuple[Variable, ...]:
    """Declare variables that the file of one batch does not have."""
    return tuple(replace(variable, of_files="all records") for variable in variables)


@dataclass(frozen=True)
class FileKind:
    """A kind of file.

    Parameters
    ----------
    name : str
        Value of the attribute ``rockframe_kind``.
    stage : str
        The command that writes them.
    title : str
        The title of the dataset.
    variables : tuple of Variable
        In the order of the file.
    """

    name: str
    stage: str
    title: str
    variables: tuple[Variable, ...]

    def __getitem__(self, name: str) -> Variable:
        """Return the variable of this name."""
        return self._named[name]

    @cached_property
    def _named(self) -> dict[str, Variable]:
        return {variable.name: variable for variable in self.variables}

    def filled(self, source: str, thing: object) -> dict[str, Any]:
        """Return the value of each variable, read from the attributes of an object.

        For a list of objects, each value is a list. What an object does not have is unknown.

        Examples
        --------
        >>> from rockframe.results.schema.response import RESPONSE_NC
        >>> from rockframe import RockingFrame
        >>> RESPONSE_NC.filled("frame", [RockingFrame(height=8.0, width=2.0)])["height"]
        [8.0]
        """
        if isinstance(thing, list):
            rows = [self.filled(source, part) for part in thing]
            return {name: [row[name] for row in rows] for name in rows[0]}
        return {
            variable.name: variable.value_of(thing)
            for variable in self.variables
            if variable.holder == source
        }

    def arrays(self, values: Mapping[str, Any]) -> dict[str, NDArray[Any]]:
        """Return values by variable as arrays of the types in the file."""
        return {name: self[name].array(value) for name, value in values.items()}

    def joined(self, parts: Sequence[Mapping[str, NDArray[Any]]]) -> dict[str, NDArray[Any]]:
        """Return the arrays of parts of the records by variable, joined along ``record``."""
        return {
            name: np.concatenate([part[name] for part in parts])
            if "record" in self[name].dims
            else item
            for name, item in parts[0].items()
        }

    def dataset(self, values: Mapping[str, Any], **units: str) -> xr.Dataset:
        """Return `holding` as a dataset of xarray."""
        return self.holding(values, **units).dataset()

    def holding(self, values: Mapping[str, Any], **units: str) -> Arrays:
        """Return the variables with these values; `units` choose among several allowed units."""
        unknown = values.keys() - {variable.name for variable in self.variables}
        if unknown:
            raise KeyError(f"not declared for {self.name} files: {sorted(unknown)}")
        variables = {
            variable.name: variable.holding(values[variable.name], units.get(variable.name, ""))
            for variable in self.variables
            if variable.name in values
        }
        return Arrays(variables, {"title": self.title})
