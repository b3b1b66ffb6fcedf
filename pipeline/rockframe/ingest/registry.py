"""The list of formats. A file is read if exactly one of them recognises it."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Final, Protocol

from rockframe.errors import InputError, OtherQuantityError, trusting
from rockframe.ingest.formats import (
    afad,
    bhrc,
    csmnc,
    cwa,
    esm,
    geonet,
    knet,
    miniseed,
    peer_at2,
    sac,
    smc,
    text,
    unam,
    usc,
)
from rockframe.ingest.formats.asdf import reader as asdf
from rockframe.ingest.formats.cosmos import reader as cosmos
from rockframe.ingest.formats.csmip import pairs as csmip_pairs
from rockframe.ingest.formats.csmip import v1 as csmip_v1
from rockframe.ingest.formats.csmip import v2 as csmip_v2
from rockframe.ingest.identify import with_trusted
from rockframe.ingest.options import NO_OPTIONS, ReadOptions
from rockframe.ingest.parsing.columns import split_fields
from rockframe.ingest.parsing.lines import (
    decoded,
    head_lines,
    is_number,
    is_utf16,
    unify_line_ends,
)
from rockframe.ingest.parsing.obspy_reader import RECORDERS, UNMARKED
from rockframe.ingest.parsing.timing import is_clock
from rockframe.outcome import InputOutcome
from rockframe.record import Record

#: Number of bytes that identify a format.
HEAD: Final = 4096
#: First lines of Caltech tapes: text, and record numbers such as IIA001.
_CALTECH: Final = re.compile(r"\bof uncorrected accelerogram data of\b|\bII[A-Z]{1,2}\d{3}\b", re.I)
#: First two lines of BRI files: time, whole numbers and station, and a label with four numbers.
_BRI: Final = re.compile(
    r"\d{4}/\d\d/\d\d \d\d[:/]\d\d[:/]\d\d [ \d]{2}\d [ \d]{2}\d [ \d]{4}\d +\S.*\n"
    r"\S.{9} *[-.\d]+ +\d+ +[-.\d]+ +[-+.\deE]+ *\n"
)
#: First lines of ISESD files: keys in this order, each with a value.
_ISESD: Final = re.compile(r"file: .*\nearthquake code: .*\nstation code: .*\nwaveform code: ")
#: Files that are no records, by their beginning, with what to do; the first match counts.
_OTHERS: Final = tuple(
    (re.compile(mark, re.S), words)
    for mark, words in (
        (rb"\A\s*<.{0,400}?<FDSNStationXML", "StationXML. Put it beside its records"),
        (rb"\A\s*<.{0,400}?<(?:\w+:)?quakeml\b", "QuakeML. Put it beside the records"),
        (rb"\A\s*<.{0,400}?<seiscomp\b", "SeisComP XML. Convert it to StationXML or QuakeML"),
        (rb"\A\s*<", "XML or HTML. Must be a record"),
        (rb"\A\s*[\[{]\s*[\"\[{\d-]", "JSON. Save its samples as CSV"),
        (
            rb"\A\d{6}V ",
            "SEED. Put dataless SEED beside its miniSEED; convert full SEED to miniSEED and "
            "StationXML",
        ),
        (rb"\A#.{0,1000}\nB05[02]F03", "RESP. Put it beside its records"),
        (
            rb"\A\* \*{20}.{0,400}\* NETWORK",
            "a file of poles and zeros. Put a StationXML beside its records",
        ),
        (rb"\A\x93NUMPY", "an array of NumPy. Save it as text by numpy.savetxt"),
        (rb"\A\x80[\x02-\x05]", "a pickle of Python. Save its samples as text"),
        (rb"\A\xd0\xcf\x11\xe0", "a former Office file. Save the sheet as .xlsx or CSV"),
        (rb"\A(?:\x89PNG|\xff\xd8\xff|GIF8|%PDF)", "a picture or PDF. Must be a record"),
        (rb"\ASQLite format 3", "a database. Export the record as CSV"),
        (rb"\APAR1", "parquet. Save the table as CSV"),
        (rb"\A(?:ARROW1|FEA1)", "Arrow or Feather. Save the table as CSV"),
        (rb"\ATDSm", "TDMS of LabVIEW. Export the record as text"),
        (rb"\ARIFF.{4}WAVE", "sound. Save its samples as text, in units of acceleration"),
        (rb"\A\x00\x00\x27\x0a", "a shapefile. Must be a record"),
    )
)


@dataclass(frozen=True)
class Format:
    """A file format and its reader.

    Parameters
    ----------
    name : str
        Name in `source_format`.
    obspy_name : str
        Name of the obspy plug-in; empty if there is none.
    description : str
        One line of description.
    extensions : tuple of str
        Usual extensions of file names; not used for identification.
    sniff : callable
        Takes at most the first 4096 bytes of a file, and returns True if it has this format.
    read : callable
        Takes the path of a file (for names and error messages), its bytes and the options, and
        returns the records. Options must not contradict the file.
    read_streams : callable, optional
        Takes the same, and returns the records, and the streams that were left out with the reason;
        of formats whose files contain many stations.

    Examples
    --------
    >>> [known.name for known in FORMATS][:3]
    ['peer_at2', 'csmip_v1', 'volume1_pairs']
    """

    name: str
    obspy_name: str
    description: str
    extensions: tuple[str, ...]
    sniff: Callable[[bytes], bool]
    read: Callable[[Path, bytes, ReadOptions], list[Record]]
    read_streams: (
        Callable[[Path, bytes, ReadOptions], tuple[list[Record], list[InputOutcome]]] | None
    ) = None


class _Reader(Protocol):
    """A module of `rockframe.ingest.formats`."""

    DESCRIPTION: str

    def sniff(self, head: bytes) -> bool: ...

    def read(self, path: Path, data: bytes, options: ReadOptions) -> list[Record]: ...


def _format(name: str, obspy_name: str, reader: _Reader, *extensions: str) -> Format:
    return Format(name, obspy_name, reader.DESCRIPTION, extensions, reader.sniff, reader.read)


def _read_recorder(obspy_name: str, path: Path, data: bytes, options: ReadOptions) -> list[Record]:
    from rockframe.ingest.formats.rare.recorders import read_recorder  # most folders have none

    return read_recorder(obspy_name, path, data, options)


def _read_bri(path: Path, data: bytes, options: ReadOptions) -> list[Record]:
    from rockframe.ingest.formats.rare import bri

    return bri.read(path, data, options)


def _read_isesd(path: Path, data: bytes, options: ReadOptions) -> list[Record]:
    from rockframe.ingest.formats.rare import isesd

    return isesd.read(path, data, options)


def _begins(pattern: re.Pattern[str], head: bytes) -> bool:
    """Return True if the first lines of a text match a pattern."""
    return bool(pattern.match("\n".join(head_lines(head)[:5])))


FORMATS: Final = (
    _format("peer_at2", "PEERAT2", peer_at2, ".AT2"),
    _format("csmip_v1", "CSMIPV1", csmip_v1, ".V1", ".RAW"),
    _format("volume1_pairs", "VOL1PAIRS", csmip_pairs, ".v1", ".RAW"),
    _format("csmip_v2", "CSMIPV2", csmip_v2, ".V2"),
    _format("cosmos", "COSMOS", cosmos, ".V0", ".V1", ".V2", ".V0c", ".V1c", ".V2c"),
    _format("smc", "SMC", smc, ".smc"),
    _format("acceleration_text", "ACCTEXT", text, ".csv", ".txt"),
    _format("knet", "KNET", knet, ".EW", ".NS", ".UD", ".EW1", ".EW2"),
    Format("knet_csv", "", knet.CSV, (".csv",), knet.sniff_csv, knet.read_csv),
    Format("jma", "", knet.JMA, (".csv",), knet.sniff_jma, knet.read_jma),
    _format("esm_dyna", "ESMDYNA", esm, ".ASC"),
    _format("geonet", "GEONET", geonet, ".V1A", ".V2A"),
    _format("afad", "AFAD", afad, ".txt"),
    _format("cwa", "CWA", cwa, ".dat"),
    _format("unam", "UNAM", unam, ".191"),
    _format("bhrc", "BHRC", bhrc, ".V1"),
    _format("csmnc", "CSMNC", csmnc, ".dat"),
    Format("itaca", "ITACA", esm.OLDER, (".cor.acc",), esm.sniff_older, esm.read_older),
    _format("usc", "USC", usc, ".s0a"),
    _format("sac", "SAC", sac, ".sac"),
    _format("miniseed", "MSEED", miniseed, ".mseed"),
    replace(_format("asdf", "ASDF", asdf, ".h5"), read_streams=asdf.read_streams),
    Format(
        "bri",
        "",
        "BRI (Japan), all channels of an instrument in cm/s2",
        (".ac",),
        partial(_begins, _BRI),
        _read_bri,
    ),
    Format(
        "isesd",
        "",
        "ISESD (Europe), corrected, one component in m/s2",
        (".cor",),
        partial(_begins, _ISESD),
        _read_isesd,
    ),
    *(
        Format(name, "", description, (ending,), sniff, partial(_read_recorder, obspy_name))
        for name, obspy_name, description, ending, sniff in RECORDERS
    ),
)


def _read_unclaimed(path: Path, data: bytes, options: ReadOptions) -> list[Record]:
    """Read a table that no format claims; the error says so."""
    try:
        return text.read(path, data, options)
    except OtherQuantityError:
        raise
    except InputError as error:
        message = f"unknown format; taken as a table of numbers: {error.reason}"
        raise InputError(path, message, error.line) from None


_TABLE: Final = replace(
    next(reader for reader in FORMATS if reader.name == "acceleration_text"), read=_read_unclaimed
)


def sniff_format(head: bytes, source: str | Path = "<bytes>") -> Format:
    r"""Return the one format that recognises a file.

    Parameters
    ----------
    head : bytes
        Beginning of the file, of which at most 4096 bytes are used.
    source : str or Path
        The file, for error messages.

    Raises
    ------
    InputError
        If no format or more than one recognises the file.

    Examples
    --------
    >>> sniff_format(b"time_s,acc_g\n0.00,0.1\n0.01,0.2\n").name
    'acceleration_text'
    """
    head = head[:HEAD]
    return _only_one(_claims(head), head, source)


def _only_one(claims: list[Format], head: bytes, source: str | Path) -> Format:
    """Return the only format that recognises a file; none or several are an error."""
    if len(claims) == 1:
        return claims[0]
    if claims:
        names = ", ".join(claim.name for claim in claims)
        raise InputError(source, f"ambiguous format: {names} all recognise it.")
    if _is_caltech(head):
        raise InputError(
            source,
            "is a Caltech/USC tape in a layout that cannot be read. "
            "Use a copy of the record in another format, such as PEER AT2, SMC or COSMOS.",
        )
    if words := _other_kind(head):
        raise InputError(source, f"unknown format: {words}.")
    supported = "`rockframe formats` lists the supported ones."
    do = "Save the samples of others as a table."
    if word := _first_word(head):
        do = f"As a table of numbers, {word[1]!r} in line {word[0]} is no number and no clock time"
        do += " such as 2019-07-06T03:19:53.01."
    raise InputError(source, f"unknown format, begins {_beginning(head)}. {supported} {do}")


def _first_word(head: bytes) -> tuple[int, str] | None:
    """Return the line and the first cell below the first line that is no number and no clock time.

    None if there is none, or if the file is no text. Lines of comments do not count, and a text of
    one line has its own first cell.
    """
    lines = enumerate(head_lines(head), 1)
    content = [(k, line) for k, line in lines if line.strip() and not line.lstrip().startswith("#")]
    for line, row in content[1:] or content:
        cells = [cell.strip().strip('"') for cell in split_fields(row)]
        for cell in filter(None, cells):
            if not is_number(cell) and not is_clock(cell):
                return (line, cell[:40]) if cell.isprintable() else None
    return None


def read_bytes(
    path: str | Path,
    data: bytes,
    options: ReadOptions = NO_OPTIONS,
    file_format: Format | None = None,
    *,
    source_file: str = "",
) -> list[Record]:
    r"""Return the records in the bytes of a file.

    Parameters
    ----------
    path : str or Path
        The file, for names and error messages; it is not opened.
    data : bytes
        Contents of the file.
    options : ReadOptions
        Values that the file does not state, such as units and time step.
    file_format : Format, optional
        Format of the file (default: identified from its contents).
    source_file : str
        Name for `Record.source_file` (default: the name of the file).

    Raises
    ------
    InputError
        If there are no bytes, or they do not follow the format.

    Examples
    --------
    >>> read_bytes("shake.csv", b"time_s,acc_g\n0.00,0.0\n0.01,0.2\n")[0].record_id
    'shake'
    """
    options = options.of_file([Path(path).name])
    chosen, source = identified(Path(path), data, file_format, options)
    whole = replace(chosen, read_streams=None)  # an error if no stream can be used
    records, _ = read_format(whole, Path(path), data, options, [Path(path).name])
    return [
        replace(record, source_file=source_file or Path(path).name, **source) for record in records
    ]


def read_format(
    chosen: Format, path: Path, data: bytes, options: ReadOptions, names: Iterable[str]
) -> tuple[list[Record], list[InputOutcome]]:
    """Return the records of a file, and its streams that were left out with the reason.

    Contradictions that the user settles are noted in the records.

    Parameters
    ----------
    names : iterable of str
        Names by which a catalogue may state what to trust: of the archive, and of the file.
    """
    by_name = [word for name in names for word in options.trust_of.get(name, ())]
    left_out: list[InputOutcome] = []
    with trusting(by_name, options.trust) as settled:
        if chosen.read_streams is None:
            records = chosen.read(path, data, options)
        else:
            records, left_out = chosen.read_streams(path, data, options)
    return [with_trusted(record, settled) for record in records], left_out


def identified(
    path: Path,
    data: bytes,
    file_format: Format | None = None,
    options: ReadOptions = NO_OPTIONS,
) -> tuple[Format, dict[str, Any]]:
    """Return the format of a file, and the fields of its records that name their source.

    Raises
    ------
    InputError
        If there are no bytes, or if they are of no known format.
    """
    if not data:
        raise InputError(path, "empty file.")
    if is_utf16(data):
        raise InputError(path, "text in UTF-16. Save it as ASCII or UTF-8.")
    chosen = file_format or _recognised(path, data, options)
    source = {"source_format": chosen.name, "source_sha256": hashlib.sha256(data).hexdigest()}
    return chosen, source


def _recognised(path: Path, data: bytes, options: ReadOptions) -> Format:
    """Return the format of a file; that of tables if rows of numbers follow title lines."""
    head = data[:HEAD]
    claims = _claims(head)
    unclaimed = not claims and not _is_caltech(head) and not _other_kind(head)
    if unclaimed and text.reads(data, options):
        return _TABLE
    return _only_one(claims, head, path)


def _claims(head: bytes) -> list[Format]:
    """Return the formats that recognise a file; those without a mark only if no other does."""
    marked = [reader for reader in FORMATS if reader.name not in UNMARKED and reader.sniff(head)]
    return marked or [
        reader for reader in FORMATS if reader.name in UNMARKED and reader.sniff(head)
    ]


def _other_kind(head: bytes) -> str:
    """Return what a file is that is no record, and what to do, or ""."""
    return next((words for mark, words in _OTHERS if mark.search(head)), "")


def _is_caltech(head: bytes) -> bool:
    return bool(_CALTECH.search("\n".join(head_lines(head)[:2])))


def _beginning(head: bytes) -> str:
    first = unify_line_ends(head).lstrip().split(b"\n", 1)[0].strip()[:50]
    text = decoded(first)
    return repr(text) if text.isprintable() else repr(head[:16])
