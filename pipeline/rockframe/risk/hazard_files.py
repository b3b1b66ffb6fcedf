"""Read hazard curves: two columns, files of OpenQuake and of the USGS; and uniform spectra."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.cells import decimal, table_lines
from rockframe.errors import InputError
from rockframe.risk.hazard import HazardCurve
from rockframe.risk.hazard_points import RATE, Points, curve_of, rounding_of
from rockframe.risk.hazard_sites import (
    VELOCITY,
    Lines,
    Site,
    measure_named_by,
    measure_of_imt,
    nearest_site,
)
from rockframe.risk.measures import COLUMNS, Measure, measure_of_column, period_of
from rockframe.units import GRAVITY

Float = NDArray[np.float64]

#: Column of probabilities in a number of years.
_PROBABILITY: Final = re.compile(r"probability_in_(\d+(?:\.\d+)?)_years?")
#: Headings of the USGS hazard tools, in lower case.
_USGS: Final = re.compile(r"annual (frequency|rate) of exceed[ae]nce", re.IGNORECASE)
_GROUND_MOTION: Final = re.compile(r"ground motion \(g\)", re.IGNORECASE)
#: Number of characters of an invalid row that messages show.
_SHOWN: Final = 80
#: Number of characters of a list of files that messages show.
_LISTED: Final = 400
_MAPS: Final = "hazard maps (hazard_map)"
#: Files of OpenQuake that contain no hazard curves, by their columns.
_NO_CURVES: Final = (
    (re.compile(r"(?:^|,)\d[\d.]*~"), "uniform hazard spectra (hazard_uhs)"),
    (re.compile(r"(?:^|,)(?:PGA|PGV|SA\([\d.]+\))-\d"), _MAPS),
    (re.compile(r"(?:^|,)iml,poe(?:,|$)"), "a disaggregation"),
    (re.compile(r"(?:^|,)(?:event_id|eid),.*gmv_"), "ground-motion fields (gmf-data)"),
    (re.compile(r"^lon,lat,(?:depth,)?(?:PGA|PGV|SA\([\d.]+\))(?:,|$)"), _MAPS),
    (
        re.compile(r"(?:^|,)lon,lat,(?:depth,)?(?:gm[vs]_|gsd_)?(?:PGA|PGV|SA\([\d.]+\))(?:,|$)"),
        "mean ground-motion fields (avg_gmf)",
    ),
)
#: Names of hazard maps, whose columns are those of mean ground-motion fields if sites have names.
_NAMED_MAP: Final = re.compile(r"(?:hazard|quantile)_map")
#: Columns of hazard curves, which are no target spectra.
_CURVES: Final = re.compile(r"(?:^|,)poe-\d")
_EXPORT: Final = (
    "Export the hazard curves of the same calculation instead (`oq export hcurves`), such as "
    "hazard_curve-mean-PGA_1.csv"
)
_EXPORT_SPECTRA: Final = (
    "Export the uniform hazard spectra of the same calculation instead (`oq export uhs`), such as "
    "hazard_uhs-mean_1.csv; they need uniform_hazard_spectra = true in its job"
)
_FROM_FIELDS: Final = "; they need hazard_curves_from_gmfs = true in its job"
#: Kind and measure in the first line of a hazard curve of OpenQuake.
_KIND: Final = re.compile(r"kind=['\"]([^'\"]+)")
_IMT_OF: Final = re.compile(r"imt=['\"]([^'\"]+)")
#: Columns of a uniform hazard spectrum: probability of exceedance, and measure.
_ORDINATE: Final = re.compile(r"(\d[\d.]*)~(\S+)")
_LAST: Final = "It is the last intensity level of the job, and the true ordinate is larger."
_LEVELS: Final = (
    "Extend intensity_measure_types_and_levels of the job, or choose periods that do not need it "
    "with --periods-s."
)
#: Relative difference of periods that are equal.
_SAME_PERIOD: Final = 1e-6
#: Relative difference of probabilities that are equal: the columns print six decimals.
_SAME_PROBABILITY: Final = 1e-4


@dataclass(frozen=True, eq=False)
class UniformSpectrum:
    """A uniform hazard spectrum: every ordinate has the same probability of exceedance.

    Parameters
    ----------
    period : array, shape (periods,)
        Periods, increasing and above 0 [s].
    sa : array, shape (periods,)
        Pseudo-spectral acceleration, 5 % damped [m s-2].
    words : str
        The spectrum in words: its probability and its site.
    """

    period: Float
    sa: Float
    words: str


def hazard_file(path: Path, kind: str | None = None) -> Path:
    """Return the hazard curve of a kind in a folder of OpenQuake; a file is returned as it is.

    Parameters
    ----------
    path : Path
        A file, or a folder of exports.
    kind : str, optional
        ``mean`` (the default in a folder), ``max``, ``quantile-0.84`` or another that the files
        state.

    Raises
    ------
    InputError
        If the folder has no or several curves of this kind, or the file has another kind.

    Examples
    --------
    >>> hazard_file(Path("hazard_curve-mean-PGA_1.csv"))
    PosixPath('hazard_curve-mean-PGA_1.csv')
    """
    if not path.is_dir():
        kind_in_file = _stated(path).get("kind") if kind else None
        if kind and kind_in_file != kind:
            message = f"is of kind {kind_in_file!r}. Must be {kind!r}, as stated."
            raise InputError(path, message)
        return path
    curves = {file: _stated(file) for file in sorted(path.glob("*.csv"))}
    curves = {file: header for file, header in curves.items() if len(header) == 2}
    matches = [file for file, header in curves.items() if header["kind"] == (kind or "mean")]
    if len(matches) == 1:
        return matches[0]
    if not curves:
        raise InputError(path, f"no hazard curves of OpenQuake in the folder. {_EXPORT}.")
    names = ", ".join(file.name for file in (matches or curves))[:_LISTED]
    message = f"{len(matches)} hazard curves of kind {kind or 'mean'!r} in the folder. "
    raise InputError(path, f"{message}State one of its files: {names}.")


def _stated(file: Path) -> dict[str, str]:
    """Return kind and measure that the first line of a file of OpenQuake states."""
    try:
        with file.open(encoding="utf-8", errors="replace") as stream:
            first = stream.readline(4096)
    except OSError as error:
        raise InputError(file, f"cannot be read: {error.strerror}.") from None
    matches = {"kind": _KIND.search(first), "imt": _IMT_OF.search(first)}
    return {name: match[1] for name, match in matches.items() if match and first.startswith("#")}


def read_hazard(
    path: str | Path,
    site: Site | tuple[float, float] | None = None,
    kind: str | None = None,
    *,
    columns: Sequence[str] = (),
    measure: str | None = None,
) -> HazardCurve:
    r"""Read a hazard curve.

    Parameters
    ----------
    path : str or Path
        CSV of two columns, `annual_rate` or `probability_in_50_years` (or another number) and one
        of pga_g, pgv_m_s, a_p_g, L_p_m, sa_1s_g (or another period); hazard curves of OpenQuake
        (CSV, NRML) or of the USGS (CSV, JSON); or a folder of OpenQuake's curves.
    site : Site or (float, float), optional
        The site to read, by its name or by longitude and latitude [degree], of which the nearest
        site within 10 km is read. It is not needed if the file has one site.
    kind : str, optional
        Kind of the curve of OpenQuake, such as ``mean`` (the default in a folder) or ``max``.
    columns : sequence of str
        Columns of any other table, such as ``pga_g=PGA`` and ``return_period_years=TR``:
        `points_by_words`.
    measure : str, optional
        Name of the measure in a file of several, such as ``sa_1s``. With ``_rotd50`` or
        ``_rotd100`` at its end, it states that the curve is of this measure of both horizontals.

    Raises
    ------
    InputError
        If the file cannot be read, has other columns, invalid numbers or no curve; if an intensity
        or a rate is too large for any site, or the rates are level near 1; if no site is near, or
        the file has several sites and none is requested.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "site.csv")
    ...     _ = path.write_text("pga_g,annual_rate\n0.1,0.01\n1.0,0.0001\n")
    ...     read_hazard(path).measure
    'pga'
    """
    path = hazard_file(Path(path), kind)
    wanted = site if isinstance(site, Site) else Site(site)
    data = _content(path)
    spectrum = measure_of_column(f"{measure}_g")
    measure = spectrum.name if spectrum else measure  # sa_1.0s is sa_1s
    if columns or data.lstrip()[:1] in (b"{", b"<"):
        points, called = _of_other_formats(path, data, wanted, columns, measure)
    else:
        points, called = _of_table(path, wanted)
    if measure is not None:
        points = replace(points, measure=_restated(path, points.measure, measure))
    return curve_of(path, points, called)


def _content(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise InputError(path, f"cannot be read: {error.strerror}.") from None


def _of_other_formats(
    path: Path, data: bytes, site: Site, columns: Sequence[str], measure: str | None
) -> tuple[Points, str]:
    """Return the points of a file of NRML, of JSON, or of a table by the user's words."""
    from rockframe.risk import hazard_formats  # few hazard curves need it

    if not columns and data.lstrip().startswith(b"<"):
        curves = hazard_formats.curves_of_nrml(path, data, site)
        return hazard_formats.of_measure(path, curves, measure)
    if site.place is not None or site.name:
        raise InputError(path, "has no sites to choose from. Do not state a site for it.")
    if columns:
        return hazard_formats.points_by_words(path, data, columns), ""
    return hazard_formats.of_measure(path, hazard_formats.curves_of_usgs(path, data), measure)


def _of_table(path: Path, site: Site) -> tuple[Points, str]:
    """Return the points of a file of two columns, or of a table of OpenQuake or the USGS."""
    lines, header, comment = table_of(path)
    _refuse_other_files(path, lines, header)
    if "lon" in header and "lat" in header:
        return _at_site(path, lines, header, comment, site)
    if site.place is not None or site.name:
        raise InputError(path, "has no sites to choose from. Do not state a site for it.")
    return _of_two_columns(path, lines, header), ""


def _restated(path: Path, measure: Measure, name: str) -> Measure:
    """Return the measure with the stated name: that of the file, perhaps over both horizontals."""
    plain = name.removesuffix("_rotd50").removesuffix("_rotd100")
    wanted = measure_of_column(measure.column.replace(measure.name, name, 1))
    if wanted is None or measure.name not in (plain, name):
        message = f"is a hazard curve of {measure.name}. Must be of {name[:_SHOWN]!r}, as stated"
        raise InputError(path, f"{message} with --hazard-measure.")
    return wanted


def has_uniform_spectra(path: Path) -> bool:
    """Return True if a file has the columns of uniform hazard spectra of OpenQuake.

    Raises
    ------
    InputError
        If the file cannot be read as a table.
    """
    return any(map(_ORDINATE.fullmatch, table_of(path)[1]))


def read_uniform_spectrum(
    path: Path,
    site: Site | None = None,
    probability: float | None = None,
    periods: Sequence[float] | None = None,
) -> UniformSpectrum:
    r"""Read a uniform hazard spectrum of OpenQuake (hazard_uhs). PGA is not part of the spectrum.

    Parameters
    ----------
    path : Path
        The file.
    site : Site, optional
        The site to read; not needed if the file has one site.
    probability : float, optional
        Probability of exceedance in the years that the file states; not needed if the file has
        spectra of one probability.
    periods : sequence of float, optional
        Periods that are needed [s], by default all of the file: `_require_within_levels`.

    Raises
    ------
    InputError
        If the file cannot be read, has no such site or probability, or invalid numbers; if an
        ordinate that is needed is beyond the intensity levels of the calculation.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "hazard_uhs-mean_1.csv")
    ...     _ = path.write_text("#,\"investigation_time=50.0\"\nlon,lat,0.1~SA(0.5)\n0,0,0.2\n")
    ...     read_uniform_spectrum(path).words
    '10 % in 50 years, the only site, at 0 0'
    """
    lines, header, comment = table_of(path)
    columns: dict[float, dict[float, int]] = {}
    for index, name in enumerate(header):
        match = _ORDINATE.fullmatch(name)
        if match:
            period = period_of(measure_of_imt(path, match[2], lines[0][0]).name)
            columns.setdefault(float(match[1]), {})[period] = index
    selected = _with_probability(path, columns, probability)
    years = _investigation_time(path, comment, line=max(1, lines[0][0] - 1))
    (line, row), called = nearest_site(path, lines, header, site or Site())
    spectra = {
        p: {t: _cell(path, row, i, header[i], line) for t, i in sorted(places.items())}
        for p, places in columns.items()
    }
    available = np.array([period for period in spectra[selected] if period > 0.0])
    if not available.size:
        raise InputError(path, f"no SA(T) of probability {selected:g}. Must be one or more.", line)
    used = _used(available, periods)
    for period in used:
        why = _beyond_levels(spectra, selected, period)
        if why:
            value = f"{header[columns[selected][period]]} {spectra[selected][period]:g}"
            raise InputError(path, f"{value}. {why}", line=line)
    kept = [
        period for period in available.tolist() if period in used or spectra[selected][period] > 0.0
    ]
    sa = np.array([spectra[selected][period] for period in kept]) * GRAVITY
    return UniformSpectrum(
        np.array(kept), sa, f"{100.0 * selected:g} % in {years:g} years, {called}"
    )


def _used(available: Float, periods: Sequence[float] | None) -> list[float]:
    """Return the periods of a spectrum that are needed to interpolate it at other periods."""
    if not periods:
        return [*map(float, available)]
    wanted = np.asarray(periods)
    above = np.searchsorted(available * (1.0 + _SAME_PERIOD), wanted).clip(0, available.size - 1)
    equal = np.isclose(available[above], wanted, rtol=_SAME_PERIOD, atol=0.0)
    below = np.where(equal, above, above - 1).clip(0)
    return [*map(float, available[np.unique([above, below])])]


def _beyond_levels(
    spectra: Mapping[float, Mapping[float, float]], probability: float, period: float
) -> str:
    """Return why an ordinate cannot be used, with the cure; "" if nothing is wrong with it.

    Where the probability lies beyond the hazard curve, OpenQuake writes the last intensity level of
    its job, or 0 below the first. The last level shows by its equals: at another probability of
    the same period, or as the largest ordinate of several periods. Ordinates that are computed
    have seven digits, so that two are seldom equal.
    """
    own = spectra[probability]
    value = own[period]
    if not value >= 0.0:
        return "Must be above 0."
    if value == 0.0:
        return f"Its probability is above that of the first intensity level. {_LEVELS}"
    for other, ordinates in spectra.items():
        if other != probability and ordinates.get(period) == value:
            return f"The ordinate at probability {other:g} is the same. {_LAST} {_LEVELS}"
    if value == max(own.values()) and [*own.values()].count(value) > 1:
        return f"The largest ordinate is that of several periods. {_LAST} {_LEVELS}"
    return ""


def _with_probability(
    path: Path, columns: Mapping[float, object], probability: float | None
) -> float:
    """Return the probability of the file that is equal to the stated one, or its only one."""
    same = [p for p in columns if probability and abs(p / probability - 1.0) < _SAME_PROBABILITY]
    if probability is None:
        same = list(columns)
    if len(same) != 1:
        allowed = ", ".join(f"{level:g}" for level in columns)
        content = (
            "several probabilities" if probability is None else f"no probability {probability:g}"
        )
        raise InputError(path, f"has {content}. State one of {allowed} with --hazard-probability.")
    return same[0]


def table_of(path: Path) -> tuple[Lines, list[str], str]:
    """Return the lines of a file from its heading on, the heading, and OpenQuake's comment.

    Raises
    ------
    InputError
        If the file cannot be read as a table.
    """
    lines: Lines = table_lines(path)
    comment = " ".join(lines[0][1]) if lines and lines[0][1][0].startswith("#") else ""
    lines = lines[1:] if comment else lines
    return lines, [name.strip() for name in lines[0][1]] if lines else [], comment


def _without_curves(path: Path, header: Sequence[str]) -> str:
    """Return what a file of OpenQuake without hazard curves contains; "" for other files."""
    columns = ",".join(header)
    contents = next((text for pattern, text in _NO_CURVES if pattern.search(columns)), "")
    return _MAPS if "avg_gmf" in contents and _NAMED_MAP.match(path.name) else contents


def _refuse_other_files(path: Path, lines: Lines, header: Sequence[str]) -> None:
    """Reject files of OpenQuake that contain no hazard curves, and say what they contain."""
    contents = _without_curves(path, header)
    if contents:
        more = _FROM_FIELDS if "fields" in contents else ""
        raise InputError(path, f"contains {contents}. {_EXPORT}{more}.", line=lines[0][0])


def refuse_other_targets(path: Path, header: Sequence[str], line: int) -> None:
    """Reject files of OpenQuake that contain no uniform hazard spectra, and say what they contain.

    Raises
    ------
    InputError
        If the columns are those of such a file.
    """
    curves = _CURVES.search(",".join(header))
    contents = "hazard curves (hazard_curve)" if curves else _without_curves(path, header)
    if contents:
        raise InputError(path, f"contains {contents}. {_EXPORT_SPECTRA}.", line=line)


def _of_two_columns(path: Path, lines: Lines, header: Sequence[str]) -> Points:
    """Read a column of intensities and one of rates or probabilities."""
    line = lines[0][0] if lines else 1
    measures = [measure_of_column(name) for name in header]
    often = [i for i, name in enumerate(header) if _years(name) is not None]
    if len(header) == 2 and len(often) == 1 and _GROUND_MOTION.search(header[1 - often[0]]):
        measures[1 - often[0]] = measure_named_by(path)
    strong = [i for i, measure in enumerate(measures) if measure is not None]
    if len(header) != 2 or len(often) != 1 or len(strong) != 1:
        allowed = ", ".join((*COLUMNS, "sa_1s_g"))
        headings = ", ".join(header)[:_SHOWN] or "missing"
        raise InputError(
            path, f"columns {headings}. Must be {RATE} and one of {allowed}.", line=line
        )
    measure, years = measures[strong[0]], _years(header[often[0]])
    assert measure is not None  # noqa: S101  `strong` has only such columns
    rows = np.array([_numbers(path, row, at) for at, row in lines[1:]]).reshape(-1, 2)
    return Points(
        measure,
        [at for at, _ in lines[1:]],
        rows[:, strong[0]],
        rows[:, often[0]],
        years or 0.0,
        np.array([rounding_of(row[often[0]]) for _, row in lines[1:]]),
    )


def _years(heading: str) -> float | None:
    """Return the years of a column of probabilities, 0 for rates, None for another column."""
    match = _PROBABILITY.fullmatch(heading)
    if match:
        return float(match[1]) or None
    return 0.0 if heading == RATE or _USGS.search(heading) else None


def _at_site(
    path: Path, lines: Lines, header: Sequence[str], comment: str, site: Site
) -> tuple[Points, str]:
    """Read the row of a site from a table of OpenQuake (``poe-0.1``) or the USGS (``0.1``)."""
    imt, years = _IMT_OF.search(comment), 0.0
    measure = measure_of_imt(path, imt[1], 1) if imt else measure_named_by(path)
    if imt:
        years = _investigation_time(path, comment, line=lines[0][0] - 1)
    columns = {i: _intensity(name, "poe-" if imt else "") for i, name in enumerate(header)}
    used = {i: level for i, level in columns.items() if level is not None}
    (line, row), called = nearest_site(path, lines, header, site)
    values = np.array([_cell(path, row, i, header[i], line) for i in used])
    unit = VELOCITY if measure.name == "pgv" else 1.0  # m/s and g are the units of the columns
    levels = np.array([*used.values()]) * unit
    rounding = np.array([rounding_of(row[i]) for i in used])
    return Points(measure, [line] * len(used), levels, values, years, rounding), called


def _investigation_time(path: Path, comment: str, line: int) -> float:
    """Return the years of the probabilities in a file of OpenQuake."""
    match = re.search(r"investigation_time=([^,\s]*)", comment)
    text = match[1] if match else ""
    try:
        years = decimal(text)
    except ValueError:
        years = 0.0
    if not years > 0.0:
        problem = f"investigation_time {text!r}" if match else "no investigation_time"
        raise InputError(path, f"{problem}. Must be a number of years above 0.", line=line)
    return years


def _intensity(heading: str, before: str) -> float | None:
    try:
        return decimal(heading.removeprefix(before)) if heading.startswith(before) else None
    except ValueError:
        return None


def _numbers(path: Path, row: list[str], line: int) -> list[float]:
    numbers = []
    with suppress(ValueError):
        numbers = [decimal(cell) for cell in row]
    if len(numbers) != 2:
        shown = ", ".join(row)[:_SHOWN]
        raise InputError(path, f"{shown!r}. Must be two numbers.", line=line)
    return numbers


def _cell(path: Path, row: list[str], index: int, column: str, line: int) -> float:
    """Return the number in a cell of the row of a site."""
    cell = row[index] if index < len(row) else ""
    try:
        return decimal(cell)
    except ValueError:
        message = f"column {column!r}: {cell[:_SHOWN]!r}. Must be a number."
        raise InputError(path, message, line=line) from None
