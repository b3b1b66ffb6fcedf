"""Hazard curves in NRML, in JSON of the USGS, and in any table by the user's words."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from rockframe.cells import decimal, with_point
from rockframe.errors import InputError
from rockframe.provenance import read_json
from rockframe.risk.hazard_points import RATE, Points, rounding_of
from rockframe.risk.hazard_sites import VELOCITY, Site, measure_of_imt, nearest_site
from rockframe.risk.measures import COLUMNS, Measure, measure_of_column
from rockframe.units import GRAVITY, acceleration_factor

Float = NDArray[np.float64]
#: Curves of several measures: points and the site in words, by the name of the measure.
Curves = dict[str, tuple[Points, str]]

#: Columns of frequencies that the user can name, besides annual rates.
_PROBABILITY: Final = re.compile(r"probability_in_(\d+(?:\.\d+)?)_years?")
_RETURN_PERIOD: Final = "return_period_years"
#: Further units of accelerations and velocities in words, at the end of a column.
_UNITS: Final = {"_m_s2": "m/s2", "_cm_s2": "cm/s2", "_percent_g": "%g"}
_CM_S: Final = "_cm_s"
_SEPARATORS: Final = (";", "\t", ",", None)  # None: blanks
#: Largest number of characters of a line or of names that messages show.
_SHOWN: Final = 80


def curves_of_nrml(path: Path, data: bytes, site: Site) -> Curves:
    """Return the hazard curves of a file in NRML, at a site.

    Parameters
    ----------
    path : Path
        The file, for messages.
    data : bytes
        Its content.
    site : Site
        The requested site.

    Raises
    ------
    InputError
        If it is no NRML with hazard curves, has invalid numbers, several curves of a measure, or no
        such site.
    """
    if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
        raise InputError(path, "XML with a document type. Must have none.")
    try:
        root = ElementTree.fromstring(data)  # noqa: S314  without entities, above
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise InputError(path, f"is no XML ({error}). Must be NRML.") from None
    curves: Curves = {}
    for table in _elements(root, "hazardCurves"):
        points, called = _points_of_nrml(path, table, site)
        if points.measure.name in curves:
            raise _several(path, f"hazardCurves of {points.measure.name}")
        curves[points.measure.name] = points, called
    if not curves:
        raise InputError(path, "no hazardCurves. Must be hazard curves in NRML.")
    return curves


def _several(path: Path, curves: str) -> InputError:
    return InputError(path, f"several {curves}. Must be one of each measure.")


def _points_of_nrml(path: Path, table: ElementTree.Element, site: Site) -> tuple[Points, str]:
    """Return the points of one measure at the site, and the site in words."""
    imt = table.get("IMT", "")
    measure = measure_of_imt(path, f"SA({table.get('saPeriod', '')})" if imt == "SA" else imt)
    levels = _numbers(path, table, "IMLs").split()
    rows = [
        [*_numbers(path, curve, "pos").split()[:2], *_numbers(path, curve, "poEs").split()]
        for curve in _elements(table, "hazardCurve")
    ]
    header = ["lon", "lat", *levels]
    if len(levels) < 2 or not rows or any(len(row) != len(header) for row in rows):
        message = f"{len(rows)} hazard curves of {len(levels)} IMLs"
        raise InputError(path, f"{message}. Must have a place and as many poEs as IMLs each.")
    years = _decimal(path, "investigationTime", table.get("investigationTime", ""))
    if not years > 0.0:
        raise InputError(path, f"investigationTime {years:g}. Must be above 0 years.")
    (_, row), called = nearest_site(path, [(1, header), *((1, row) for row in rows)], header, site)
    unit = VELOCITY if measure.name == "pgv" else 1.0
    points = Points(
        measure,
        [1] * len(levels),
        unit * np.array([_decimal(path, "IMLs", cell) for cell in levels]),
        np.array([_decimal(path, "poEs", cell) for cell in row[2:]]),
        years,
        np.array([rounding_of(cell) for cell in row[2:]]),
    )
    return points, called


def _elements(root: ElementTree.Element, name: str) -> Iterator[ElementTree.Element]:
    """Yield the elements with this name in any namespace."""
    return (element for element in root.iter() if element.tag.rpartition("}")[2] == name)


def _numbers(path: Path, parent: ElementTree.Element, name: str) -> str:
    for element in _elements(parent, name):
        return element.text or ""
    raise InputError(path, f"no {name}. Must be hazard curves in NRML.")


def _decimal(path: Path, name: str, text: str) -> float:
    try:
        return decimal(text)
    except ValueError:
        raise InputError(path, f"{name} {text[:_SHOWN]!r}. Must be a number.") from None


def curves_of_usgs(path: Path, data: bytes) -> Curves:
    """Return the hazard curves in an answer of the web services of the USGS (JSON): the totals.

    Parameters
    ----------
    path : Path
        The file, for messages.
    data : bytes
        Its content: ``response.hazardCurves`` of today's service, or ``response`` of the former one
        (nshmp-haz-ws). Both state annual frequencies of exceedance.

    Raises
    ------
    InputError
        If it is anything else, has invalid numbers, or several curves of a measure.
    """
    try:
        answer = read_json(data)
    except (ValueError, RecursionError):
        raise InputError(path, "is no JSON. Must be hazard curves of the USGS.") from None
    response = answer.get("response") if isinstance(answer, Mapping) else None
    inside = response.get("hazardCurves") if isinstance(response, Mapping) else response
    curves: Curves = {}
    for curve in inside if isinstance(inside, list) else []:
        metadata = _at(curve, "metadata")
        imt = _at(curve, "imt", "value") or _at(metadata, "imt", "value")
        total = _total(_at(curve, "data"))
        levels = _at(total, "values", "xs") or _at(metadata, "xvalues")
        rates = _at(total, "values", "ys") or _at(total, "yvalues")
        if not isinstance(imt, str) or not _are_numbers(levels) or not _are_numbers(rates):
            raise InputError(path, "a curve without imt, xs and ys of its total. Must have them.")
        if len(levels) != len(rates):
            message = f"{imt}: {len(levels)} ground motions and {len(rates)} frequencies"
            raise InputError(path, f"{message}. Must be as many.")
        measure = measure_of_imt(path, imt)
        if measure.name in curves:
            raise _several(path, f"curves of {measure.name}")
        unit = VELOCITY if measure.name == "pgv" else 1.0
        x, rate = np.array([levels, rates], dtype=np.float64)
        x, rate = unit * x[rate > 0.0], rate[rate > 0.0]  # a frequency of 0 has no information
        points = Points(measure, [1] * x.size, x, rate, 0.0, np.zeros(x.size))
        curves[measure.name] = points, ""
    if not curves:
        raise InputError(path, "no response.hazardCurves. Must be hazard curves of the USGS.")
    return curves


def _at(value: Any, *names: str) -> Any:
    """Return the value below these names of nested objects; None if there is none."""
    for name in names:
        value = value.get(name) if isinstance(value, Mapping) else None
    return value


def _total(data: Any) -> Any:
    """Return the total of the components of a curve."""
    components = data if isinstance(data, list) else []
    totals = [curve for curve in components if _at(curve, "component") == "Total"]
    alone = totals or components
    return alone[0] if len(alone) == 1 else None


def _are_numbers(values: Any) -> bool:
    return isinstance(values, list) and all(
        isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
        for value in values
    )


def points_by_words(path: Path, data: bytes, columns: Sequence[str]) -> Points:
    r"""Return the points of a table whose two columns the user names.

    Parameters
    ----------
    path : Path
        The file, for messages.
    data : bytes
        Its content. Lines above the heading are skipped.
    columns : sequence of str
        Two of the form WORD=COLUMN: a measure with its unit, such as ``pga_g`` or ``sa_1s_cm_s2``,
        and ``annual_rate``, ``probability_in_50_years`` (or another number) or
        ``return_period_years``. COLUMN is a name, or a number from 1 in tables without names.

    Raises
    ------
    InputError
        If a word is unknown, a column is missing, or a row has no two numbers.

    Examples
    --------
    >>> table = b"Hazard of Athens\nSa(g);TR\n0,1;100\n0,3;1000\n"
    >>> points = points_by_words(Path("a"), table, ["sa_1s_g=Sa(g)", "return_period_years=TR"])
    >>> points.intensity.tolist(), points.values.tolist()
    ([0.1, 0.3], [0.01, 0.001])
    """
    words = dict(_word(path, column) for column in columns)
    strong = {word: _measured(word) for word in words}
    strong = {word: measured for word, measured in strong.items() if measured}
    often = [word for word in words if word not in strong]
    if len(words) != 2 or len(strong) != 1:
        message = f"hazard_columns {', '.join(words)}. Must be one measure and one of {RATE},"
        raise InputError(path, f"{message} probability_in_50_years and {_RETURN_PERIOD}.")
    [(word, (measure, factor))] = [(w, m) for w, m in strong.items() if m]
    rows = list(_rows_by_words(path, data, [words[word], words[often[0]]]))
    if len(rows) < 2:
        raise InputError(path, f"{len(rows)} rows of numbers. Must be two or more.")
    rows.sort(key=lambda row: float(row[1]))
    lines = [line for line, _, _ in rows]
    values = np.array([float(frequency) for _, _, frequency in rows])
    rounding = np.array([rounding_of(frequency) for _, _, frequency in rows])
    probability = _PROBABILITY.fullmatch(often[0])
    if often[0] == _RETURN_PERIOD:
        if not (values > 0.0).all():
            line = lines[int(np.argmin(values))]
            raise InputError(path, f"return period {values.min():g}. Must be above 0 years.", line)
        values, rounding = 1.0 / values, np.zeros(values.size)
    intensity = factor * np.array([float(level) for _, level, _ in rows])
    years = float(probability[1]) if probability else 0.0
    return Points(measure, lines, intensity, values, years, rounding)


def _word(path: Path, column: str) -> tuple[str, str]:
    """Return word and column; the word must be known."""
    word, _, own = (part.strip() for part in column.partition("="))
    is_known = _measured(word) or word in (RATE, _RETURN_PERIOD)
    probability = _PROBABILITY.fullmatch(word)
    if not is_known and not (probability and float(probability[1]) > 0.0):
        allowed = ", ".join((RATE, "probability_in_50_years", _RETURN_PERIOD, *COLUMNS, "sa_1s_g"))
        message = f"hazard_columns: {word[:_SHOWN]!r} unknown. Must be one of {allowed}"
        raise InputError(path, f"{message} (or in _m_s2, _cm_s2, _percent_g, _cm_s).")
    if not own:
        raise InputError(path, f"hazard_columns: no column after {word}=. State its name.")
    return word, own


def _measured(word: str) -> tuple[Measure, float] | None:
    """Return the measure of a word, and the factor that gives the unit of its column."""
    measure = measure_of_column(word)
    if measure is not None:
        return measure, 1.0
    for end, units in _UNITS.items():
        measure = measure_of_column(word.removesuffix(end) + "_g") if word.endswith(end) else None
        if measure is not None:
            return measure, acceleration_factor(units) / GRAVITY
    if word.endswith(_CM_S):
        measure = measure_of_column(f"{word.removesuffix(_CM_S)}_m_s")
        return (measure, VELOCITY) if measure is not None else None
    return None


def _rows_by_words(path: Path, data: bytes, names: Sequence[str]) -> Iterator[tuple[int, str, str]]:
    """Yield line number and both cells of each row, below the first line that has both names; or,
    of numbers of columns, of each row with numbers.
    """
    try:
        lines = data.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise InputError(path, f"is no text in UTF-8 ({error.reason}).") from None
    by_number = all(name.isdecimal() for name in names)
    places, separator, first = (
        ([int(name) - 1 for name in names], None, 0)
        if by_number
        else (_heading(path, lines, names))
    )
    begun = not by_number
    for number, line in enumerate(lines[first:], first + 1):
        if by_number:
            separator = next((mark for mark in _SEPARATORS if mark and mark in line), None)
        cells = _split(line, separator)
        if not any(cells):
            continue
        try:
            if min(places) < 0:
                raise IndexError
            both = [_plain(cells[place], separator) for place in places]
        except (ValueError, IndexError):
            if not begun:
                continue  # a title
            message = f"{line[:_SHOWN]!r}. Must have numbers in columns {' and '.join(names)}."
            raise InputError(path, message, number) from None
        begun = True
        yield number, both[0], both[1]


def _heading(
    path: Path, lines: Sequence[str], names: Sequence[str]
) -> tuple[list[int], str | None, int]:
    """Return the places of the columns, the separator, and the number of lines above the rows."""
    wanted = [name.lower() for name in names]
    for number, line in enumerate(lines):
        for separator in _SEPARATORS:
            cells = [cell.lower() for cell in _split(line.lstrip("#% "), separator)]
            if all(cells.count(name) == 1 for name in wanted):
                return [cells.index(name) for name in wanted], separator, number + 1
    shown = next((line for line in lines if line.strip()), "")[:_SHOWN]
    message = f"no line with columns {' and '.join(map(repr, names))}. The first line is {shown!r}."
    raise InputError(path, message)


def _split(line: str, separator: str | None) -> list[str]:
    try:
        cells = line.split() if separator is None else next(csv.reader([line], delimiter=separator))
    except (csv.Error, StopIteration):
        cells = []
    return [cell.strip().strip('"').strip() for cell in cells]


def _plain(cell: str, separator: str | None) -> str:
    """Return the text of a number, with a decimal point."""
    text = with_point(cell, separator)
    decimal(text)
    return text


def of_measure(path: Path, curves: Curves, name: str | None) -> tuple[Points, str]:
    """Return the curve of a measure, or the only one.

    Parameters
    ----------
    path : Path
        The file, for messages.
    curves : Curves
        The curves of the file.
    name : str, optional
        Name of the measure, such as ``sa_1s``; ``sa_1s_rotd50`` states that its curve is of RotD50.

    Raises
    ------
    InputError
        If there is no such curve, or several and none is requested.
    """
    available = ", ".join(curves)[:_SHOWN]
    if name is None:
        if len(curves) != 1:
            message = f"has curves of {available}. State one with --hazard-measure"
            raise InputError(path, f"{message}.")
        return next(iter(curves.values()))
    plain = name.removesuffix("_rotd50").removesuffix("_rotd100")
    if name in curves:
        return curves[name]
    if plain not in curves:
        raise InputError(path, f"no curve of {name[:_SHOWN]!r}. Must be one of: {available}.")
    return curves[plain]
