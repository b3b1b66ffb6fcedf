"""Values that the user states for files that do not state them; they never override a file."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from rockframe.cells import decimal
from rockframe.errors import InputError, ParameterError, require_known, require_words
from rockframe.ingest.containers import Content
from rockframe.units import acceleration_factor, plain_units

if TYPE_CHECKING:
    from rockframe.options.ingest import FileOptions

#: Relative tolerance between two stated time steps.
_SAME_STEP: Final = 1e-9


#: Separators of columns by the words that name them; None is any white space.
SEPARATORS: Final[Mapping[str, bytes | None]] = {
    "comma": b",",
    "semicolon": b";",
    "tab": b"\t",
    "blank": None,
}
#: Decimal marks by their names.
DECIMALS: Final = {"point": b".", "comma": b","}
#: Contents of the first line of a table, below comments and skipped lines.
FIRST_LINES: Final = ("names", "sizes", "numbers")
#: Word for a table whose times are not used.
NO_TIMES: Final = "none"


@dataclass(frozen=True)
class TextLayout:
    """Layout of a text table as the user states it; what is None is recognised from the file.

    Parameters
    ----------
    skip_lines : int
        Number of lines at the top that are not read.
    comment : str, optional
        Beginning of comment lines (default: ``#`` or ``%``).
    separator : str, optional
        Separator of columns: ``comma``, ``semicolon``, ``tab`` or ``blank``.
    decimal : str, optional
        Decimal mark: ``point`` or ``comma``.
    first_line : str, optional
        Contents of the first line that is read: ``names`` of the columns, ``sizes`` (the number of
        samples, and perhaps the time step), or ``numbers``.
    values_per_line : int, optional
        Number of values of one series in each line.
    time_column : str, optional
        Name or number of the column of times, in seconds, in parts of a second if its name says so
        (``time_ms``), or as clock times; or ``none`` if the times are not used.
    channels : tuple of str
        Columns of acceleration and their components, such as ``2=NS`` or ``acc_x=045``: number or
        name of the column, and an azimuth [degree], a compass name or a name of the vertical.

    Raises
    ------
    ParameterError
        If a word or number is not allowed.

    Examples
    --------
    >>> TextLayout(skip_lines=3, values_per_line=5).values_per_line
    5
    >>> TextLayout(separator="colon")
    Traceback (most recent call last):
    rockframe.errors.ParameterError: Invalid separator 'colon'. Must be one of: comma, semicolon...
    """

    skip_lines: int = 0
    comment: str | None = None
    separator: str | None = None
    decimal: str | None = None
    first_line: str | None = None
    values_per_line: int | None = None
    time_column: str | None = None
    channels: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name, words in (
            ("separator", SEPARATORS),
            ("decimal", DECIMALS),
            ("first_line", FIRST_LINES),
        ):
            if (value := getattr(self, name)) is not None:
                require_known(name, value, words)
        for name, least in (("skip_lines", 0), ("values_per_line", 1)):
            if (number := getattr(self, name)) is not None and number < least:
                raise ParameterError(f"Invalid {name} {number}. Must be {least} or more.")
        if self.comment is not None and not self.comment.strip():
            raise ParameterError(f"Invalid comment {self.comment!r}. Must be a mark such as #.")
        for channel in self.channels:
            if not all(part.strip() for part in channel.partition("=")):
                must = "Must be a column and its component, such as 2=NS or acc_x=045"
                raise ParameterError(f"Invalid channel {channel!r}. {must}.")
            _require_component(channel)

    @property
    def is_stated(self) -> bool:
        """True if the user states anything."""
        return self != _RECOGNISED


def _require_component(channel: str) -> None:
    """Require an azimuth, a compass name, a name of the vertical, a channel code, or a label."""
    from rockframe.ingest.identify import direction, seed_letter  # most layouts have no channels
    from rockframe.record import Orientation

    name = channel.rpartition("=")[2].strip()
    is_label = re.fullmatch(r"[HXYZLTR]\d?", name.upper(), re.ASCII)
    if direction(seed_letter(name) or name)[0] is Orientation.UNSTATED and not is_label:
        must = "Must be an azimuth from 000 to 360, a compass name, UP, or a label such as H1"
        raise ParameterError(f"Invalid component {name!r} of channel {channel!r}. {must}.")


#: A layout of which everything is recognised from the file.
_RECOGNISED: Final = TextLayout()


@dataclass(frozen=True)
class ReadOptions:
    """Values that files may lack: units, time step, layout of tables, and instrument response.

    Parameters
    ----------
    units : str, optional
        Acceleration units, of `rockframe.units.ACCELERATION_UNITS`.
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
    factor : float, optional
        Acceleration of the number 1 in a file that states no units [m s-2], instead of units.
    sensitivity : float, optional
        Counts per m s-2 of files with counts, instead of a StationXML [counts s2 m-1].
    layout : TextLayout
        Layout of text tables (default: recognised from the file).
    of_files : mapping of str to mapping
        Other values of these options by name of file, as a catalogue states them.

    Raises
    ------
    ParameterError
        If the units are unknown, if both units and factor are given, if time step or water level
        are not positive and finite, if factor or sensitivity are zero or not finite, or if a
        trusted word is unknown.

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
    factor: float | None = None
    sensitivity: float | None = None
    layout: TextLayout = _RECOGNISED
    of_files: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

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
        for name, value in (("factor", self.factor), ("sensitivity", self.sensitivity)):
            if value is not None and not (math.isfinite(value) and value):
                raise ParameterError(f"Invalid {name} {value!r}. Must be finite, and not zero.")
        if self.units is not None and self.factor is not None:
            message = f"units {self.units!r} and factor {self.factor:g} are both given. Give one."
            raise ParameterError(message)

    def of_file(self, names: Iterable[str]) -> ReadOptions:
        """Return the options for a file, with the values that a catalogue states for its names.

        Examples
        --------
        >>> ReadOptions("g", of_files={"a.csv": {"units": "gal"}}).of_file(["a.csv"]).units
        'gal'
        """
        options = self
        for words in (self.of_files[name] for name in names if name in self.of_files):
            fields = dict(words)
            layout = {name: fields.pop(name) for name in _LAYOUT if name in fields}
            if "factor" in fields:
                fields.setdefault("units", None)
            elif "units" in fields:
                fields["factor"] = None
            options = replace(options, layout=replace(options.layout, **layout), **fields)
        return options


#: Options without any values: files must state everything themselves.
NO_OPTIONS: Final = ReadOptions()

#: Field of `ReadOptions` or `TextLayout` that each column of a catalogue states, and the function
#: that returns its value from the text of a cell.
READING: Final[Mapping[str, tuple[str, Callable[[str], Any]]]] = {
    "units": ("units", str),
    "time_step_s": ("time_step", decimal),
    "factor_m_s2": ("factor", decimal),
    "sensitivity_counts_s2_m": ("sensitivity", decimal),
    "column": ("column", str),
    "skip_lines": ("skip_lines", int),
    "comment": ("comment", str),
    "separator": ("separator", str),
    "decimal": ("decimal", str),
    "first_line": ("first_line", str),
    "values_per_line": ("values_per_line", int),
    "time_column": ("time_column", str),
    "channels": ("channels", lambda text: tuple(text.split())),
}
_LAYOUT: Final = frozenset(vars(_RECOGNISED))


def parse_reading(path: Path, row: Mapping[str, str], line: int) -> dict[str, Any]:
    """Return the fields of `ReadOptions` and `TextLayout` that a row of a catalogue states.

    Raises
    ------
    InputError
        If a cell is no allowed value.

    Examples
    --------
    >>> parse_reading(Path("catalogue.csv"), {"units": "mg", "skip_lines": "2"}, 5)
    {'units': 'mg', 'skip_lines': 2}
    """
    fields: dict[str, Any] = {}
    for column, (name, convert) in READING.items():
        if token := row.get(column, ""):
            try:
                fields[name] = convert(token)
            except ValueError:
                message = f"{column} {token!r}. Must be a number."
                raise InputError(path, message, line) from None
    try:
        ReadOptions(of_files={"": fields}).of_file([""])
    except ParameterError as error:
        raise InputError(path, str(error), line) from None
    return fields


def read_options(options: FileOptions) -> ReadOptions:
    """Return the options of readers that options of commands and studies state.

    Examples
    --------
    >>> from rockframe.options.ingest import FileOptions
    >>> read_options(FileOptions(units="gal", skip_lines=3)).layout.skip_lines
    3
    """
    return ReadOptions(
        units=options.units,
        time_step=options.time_step_s,
        station_xml=options.station_xml,
        water_level=options.water_level_db,
        column=options.column,
        streams=options.streams,
        trust=options.trust or (),
        factor=options.factor_m_s2,
        sensitivity=options.sensitivity_counts_s2_m,
        layout=TextLayout(
            skip_lines=options.skip_lines,
            comment=options.comment,
            separator=options.separator,
            decimal=options.decimal,
            first_line=options.first_line,
            values_per_line=options.values_per_line,
            time_column=options.time_column,
            channels=options.channels or (),
        ),
    )


def factor_to_si(
    path: Path, stated: str | None, options: ReadOptions, line: int | None = None
) -> float:
    """Return the number of m s-2 in one unit of the samples.

    The file states the unit; if it does not, the user does.

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
    if stated is None and options.factor is not None:
        return options.factor
    if stated is None and given is None:
        message = "acceleration units unstated. State them in the column name (as in 'acc_g') "
        raise InputError(path, f"{message}or with --units.", line)
    factor = acceleration_factor(stated or given or "")
    if options.factor is not None and options.factor != factor:
        message = f"factor {options.factor:g} m/s2 given, but the file states {stated!r}."
        raise InputError(path, message, line)
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
