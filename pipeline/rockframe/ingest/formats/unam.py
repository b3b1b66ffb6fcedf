"""Reader of UNAM files (Mexico, standard format 2.0): columns of channels in gal."""

from __future__ import annotations

import re
import unicodedata
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from rockframe.errors import InputError, settle
from rockframe.ingest.identify import directed, distances, noted, place_in, record_ids
from rockframe.ingest.options import ReadOptions, factor_to_si, settle_time_step
from rockframe.ingest.parsing.lines import (
    KeyedHeader,
    head_lines,
    keyed_header,
    numbers_in,
    parse_number,
    plain_text,
    require_sample_count,
)
from rockframe.ingest.parsing.samples import Columns, read_table, require_printed_peak
from rockframe.record import Record

DESCRIPTION = "UNAM, CICESE and others (Mexico), standard format 2.0, columns in gal"

_TOP: Final = "ARCHIVO ESTANDAR DE ACELERACION"
_RULE: Final = "---------+"
_LONGEST_HEADER: Final = 200
_NAMES: Final = "ORIENTACION C1-C6 (rumbo;orientacion)"
_STEP: Final = "INTERVALO DE MUESTREO, C1-C6 (s)"
_RATE: Final = "VEL. DE MUESTREO, C1-C6 (muestras/s)"
_COUNT: Final = "NUM. TOTAL DE MUESTRAS, C1-C6"
_LENGTH: Final = "DURACION DEL REGISTRO (s), C1-C6"
_PEAK, _PEAK_AT = "ACEL. MAX.(Gal), C1-C6", "ACEL. MAX., C1-C6, EN LA MUESTRA"
_UNITS, _FORMAT = "UNIDADES DE LOS DATOS", "FORMATO DATOS (FORTRAN,10 campos/dato)"
_DECIMATION: Final = "FACTOR DE DECIMACION"
_DAY, _FIRST = "FECHA DEL SISMO [GMT]", "HORA DE LA PRIMERA MUESTRA (GMT)"
_DEPTH: Final = "PROFUNDIDAD FOCAL (Km)"
#: Keys as UNAM writes them; other networks set commas, blanks, brackets and capitals otherwise.
_KEYS: Final = (
    *(_NAMES, _STEP, _RATE, _COUNT, _LENGTH, _PEAK, _PEAK_AT, _UNITS, _FORMAT, _DECIMATION),
    *(_DAY, _FIRST, _DEPTH),
)
_MONTHS: Final = (
    *("ENERO", "FEBRERO", "MARZO", "ABRIL", "MAYO", "JUNIO", "JULIO", "AGOSTO"),
    *("SEPTIEMBRE", "OCTUBRE", "NOVIEMBRE", "DICIEMBRE"),
)


def sniff(head: bytes) -> bool:
    r"""Return True if a file begins like a UNAM file.

    Examples
    --------
    >>> sniff(b"****\nARCHIVO ESTANDAR DE ACELERACION:\n")
    True
    """
    return any(
        line.startswith(_TOP) or (not line.isascii() and _is_top(line))
        for line in head_lines(head)[:10]
    )


def _is_top(line: str) -> bool:
    """Return True for the title with accents, of a line that was decoded as Latin-1."""
    return _without_accents(_decoded(line.encode("latin-1", "replace"))).startswith(_TOP)


def read(path: Path, data: bytes, options: ReadOptions) -> list[Record]:
    """Read every channel of a UNAM file.

    Raises
    ------
    InputError
        If a header line is missing, or number, rate or peaks of a channel differ from the samples.

    Examples
    --------
    >>> read(Path("CANA1709.191"), b"ARCHIVO ESTANDAR DE ACELERACION:", ReadOptions())
    Traceback (most recent call last):
    rockframe.errors.InputError: CANA1709.191: no line '---------+' above and below the names of ...
    """
    lines = plain_text(path, data).rstrip().split(b"\n")
    words = [_without_accents(_decoded(line)) for line in lines[:_LONGEST_HEADER]]
    rules = [number for number, line in enumerate(words) if line.startswith(_RULE)]
    if len(rules) != 2:
        raise InputError(path, f"no line {_RULE!r} above and below the names of the channels.")
    header = _usual(keyed_header(path, words[: rules[1]]))
    names = _values(header, _NAMES)
    if names != words[rules[1] - 1].split():
        raise header.invalid(_NAMES, "the names above the columns")
    names = [_component(name) for name in names]
    if not header.required(_UNITS).startswith("Gal") or header.required(_DECIMATION) != "1":
        raise header.invalid(_UNITS, "Gal (cm/s/s), with a factor of decimation of 1")
    layout = re.fullmatch(r"(\d)F10\.\d", header.required(_FORMAT))
    if not layout or int(layout[1]) != len(names):
        raise header.invalid(_FORMAT, f"{len(names)}F10.4")
    factor = factor_to_si(path, "gal", options, header.lines[_UNITS])
    rows = lines[rules[1] + 1 :]
    table = read_table(path, rows, Columns(len(names), 10), rules[1] + 1)
    return [
        noted(partial(_record, header, table[:, k] * 1.0, k, factor, record_id, options))
        for k, record_id in enumerate(record_ids(path, names))
    ]


def _record(
    header: KeyedHeader,
    gal: np.ndarray[tuple[int, ...], np.dtype[np.float64]],
    channel: int,
    factor: float,
    record_id: str,
    options: ReadOptions,
) -> Record:
    path, stated_name = header.path, _values(header, _NAMES)[channel]
    name = _component(stated_name)
    peaks = {
        key: _values(header, key)[channel]
        for key in (_STEP, _RATE, _COUNT, _LENGTH, _PEAK, _PEAK_AT)
    }
    lines = header.lines
    line = lines[_RATE]
    require_sample_count(path, peaks[_COUNT], lines[_COUNT], gal.size)
    step, rate, length, at = (
        parse_number(path, peaks[key], lines[key], key) for key in (_STEP, _RATE, _LENGTH, _PEAK_AT)
    )
    if not (step > 0.0 and rate > 0.0):
        raise InputError(path, f"{rate:g} samples a second, {step:g} s. Must be positive.", line)
    message = f"{rate:g} samples a second and {length:g} s stated, but {gal.size} samples at "
    message += f"{step:g} s."
    if abs(step * rate - 1.0) > 1e-3:
        step = settle(path, message, {"waveform": step, "header": 1.0 / rate}, line)
    if abs(length - gal.size * step) > 1.5 * step + 0.005:
        settle(path, message, {"samples": gal.size}, line)
    ratio = require_printed_peak(
        path, peaks[_PEAK], gal, f"gal {name}", lines[_PEAK],
        signed=True, time=f"{(at - 1.0) * step:.4f}", time_step=step,
    )  # fmt: skip
    # Latitude and longitude are in two lines.
    places = [
        place_in(re.sub(r"\bO\b", "W", f"{header.get(key)} {header.get(f'{key} (2)')}"))
        for key in ("COORDENADAS DEL EPICENTRO", "COORDENADAS DE LA ESTACION")
    ]
    day, first = _day(header.get(_DAY)), header.get(_FIRST)
    timed = re.fullmatch(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d(\.\d{1,6})?", f"{day} {first}")
    (depth,) = numbers_in(r"^(\d+\.?\d*)$", header.get(_DEPTH))
    return Record(
        record_id=record_id,
        acceleration=factor * gal,
        time_step=settle_time_step(path, step, options, lines[_STEP]),
        uncorrected=True,
        **directed(name, "DOWN" if stated_name == "V;-" else name),
        event=f"{day} {header.get('HORA EPICENTRO (GMT)')} GMT",
        station=header.get("CLAVE DE LA ESTACION"),
        start_time=f"{day}T{first}Z" if timed else "",
        magnitude=numbers_in(r"/M\w?=(\d+\.?\d*)", header.get("MAGNITUD(ES)"))[0],
        peak_ratio=ratio,
        **distances(places[0], places[1], depth),
    )


def _usual(header: KeyedHeader) -> KeyedHeader:
    """Return a header with the keys as UNAM writes them."""
    usual = {_plain(key): key for key in _KEYS}
    keys = {key: usual.get(_plain(key), key) for key in header.values}
    return KeyedHeader(
        header.path,
        {keys[key]: value for key, value in header.values.items()},
        {keys[key]: line for key, line in header.lines.items()},
        header.count,
    )


def _plain(key: str) -> str:
    """Return a key without blanks, commas and points, with round brackets, in capitals."""
    return re.sub(r"[\s,.]", "", key.upper()).replace("[", "(").replace("]", ")")


def _component(name: str) -> str:
    """Return the name of a component without the sense after a semicolon: `V;+`, `N90E;`."""
    return name.partition(";")[0]


def _day(text: str) -> str:
    """Return a date as `2010-04-04`, also of `04 de ABRIL del 2010`."""
    words = re.fullmatch(r"(\d{1,2}) DE ([A-Z]+) DEL? (\d{4})", text.upper())
    if words and words[2] in _MONTHS:
        return f"{words[3]}-{_MONTHS.index(words[2]) + 1:02d}-{int(words[1]):02d}"
    return text.replace("/", "-")


def _values(header: KeyedHeader, key: str) -> list[str]:
    """Return the values of the channels: `/200/200/200`, perhaps with blanks and a last stroke."""
    first, *values = _split(header.required(key))
    count = len(_split(header.required(_NAMES))) - 1
    if first or len(values) != count:
        raise header.invalid(key, f"a value for each of {count} channels, after /")
    return values


def _split(text: str) -> list[str]:
    values = [value.strip() for value in text.split("/")]
    return values[:-1] if len(values) > 2 and not values[-1] else values


def _decoded(line: bytes) -> str:
    """Return a line of UTF-8 or, as most files have it, of Latin-1."""
    try:
        return line.decode()
    except UnicodeDecodeError:
        return line.decode("latin-1")


def _without_accents(text: str) -> str:
    """Return a text without accents, with which some networks write the keys."""
    if text.isascii():
        return text
    letters = unicodedata.normalize("NFD", text)
    return "".join(letter for letter in letters if not unicodedata.combining(letter))
