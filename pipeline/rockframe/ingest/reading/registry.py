"""The list of formats. A file is read if exactly one of them recognises it."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from rockframe.errors import InputError
from rockframe.ingest.formats import afad, esm, geonet, knet, miniseed, peer_at2, sac, smc
from rockframe.ingest.formats.cosmos import reader as cosmos
from rockframe.ingest.formats.csmip import v1 as csmip_v1
from rockframe.ingest.formats.csmip import v2 as csmip_v2
from rockframe.ingest.formats.text import reader as text
from rockframe.ingest.options import NO_OPTIONS, ReadOptions
from rockframe.ingest.parsing.lines import head_lines, is_utf16
from rockframe.record import Record

#: Number of bytes from which a format is identified.
HEAD: Final = 4096

#: First lines of Caltech tapes, which cannot be read: text, and record numbers such as IIA001.
_CALTECH_I: Final = re.compile(r"\bof uncorrected accelerogram data of\b", re.I)
_CALTECH_II: Final = re.compile(r"\bII[A-Z]{1,2}\d{3}\b")


@dataclass(frozen=True, kw_only=True)
class Format:
    """A file format and its reader.

    Parameters
    ----------
    name : str
        Name in `source_format`.
    obspy_name : str
        Name of the obspy plug-in.
    description : str
        One line of description.
    extensions : tuple of str
        Usual extensions of file names; not used for identification.
    sniff : callable
        Given at most the first 4096 bytes of a file, returns whether it has this format.
    read : callable
        Given the path of a file (for names and error messages), its bytes and the options, returns
        its records. Options must not contradict what the file states.

    Examples
    --------
    >>> [known.name for known in FORMATS][:3]
    ['peer_at2', 'csmip_v1', 'csmip_v2']
    """

    name: str
    obspy_name: str
    description: str
    extensions: tuple[str, ...]
    sniff: Callable[[bytes], bool]
    read: Callable[[Path, bytes, ReadOptions], list[Record]]


FORMATS: Final = (
    Format(
        name="peer_at2",
        obspy_name="PEERAT2",
        description="PEER strong-motion database, acceleration in g (all header styles)",
        extensions=(".AT2",),
        sniff=peer_at2.sniff,
        read=peer_at2.read,
    ),
    Format(
        name="csmip_v1",
        obspy_name="CSMIPV1",
        description="CSMIP/CDMG volume 1, uncorrected acceleration in g, several channels",
        extensions=(".V1", ".RAW"),
        sniff=csmip_v1.sniff,
        read=csmip_v1.read,
    ),
    Format(
        name="csmip_v2",
        obspy_name="CSMIPV2",
        description="CSMIP/CDMG volume 2, corrected acceleration in cm/s2, several channels",
        extensions=(".V2",),
        sniff=csmip_v2.sniff,
        read=csmip_v2.read,
    ),
    Format(
        name="cosmos",
        obspy_name="COSMOS",
        description="COSMOS V0 (counts with stated sensitivity), V1, V2 and V2c, several channels",
        extensions=(".V0", ".V1", ".V2", ".V0c", ".V1c", ".V2c"),
        sniff=cosmos.sniff,
        read=cosmos.read,
    ),
    Format(
        name="smc",
        obspy_name="SMC",
        description="USGS SMC, acceleration in cm/s2, evenly sampled or time-acceleration pairs",
        extensions=(".smc",),
        sniff=smc.sniff,
        read=smc.read,
    ),
    Format(
        name="acceleration_text",
        obspy_name="ACCTEXT",
        description="CSV or white-space text: time and acceleration, or acceleration alone",
        extensions=(".csv", ".txt"),
        sniff=text.sniff,
        read=text.read,
    ),
    Format(
        name="knet",
        obspy_name="KNET",
        description="K-NET and KiK-net ASCII, uncorrected, one component, offset left",
        extensions=(".EW", ".NS", ".UD", ".EW1", ".EW2"),
        sniff=knet.sniff,
        read=knet.read,
    ),
    Format(
        name="esm_dyna",
        obspy_name="ESMDYNA",
        description="ESM and ITACA, DYNA 1.2 ASCII in cm/s2",
        extensions=(".ASC",),
        sniff=esm.sniff,
        read=esm.read,
    ),
    Format(
        name="geonet",
        obspy_name="GEONET",
        description="GeoNet V1A and V2A in mm/s2, three components",
        extensions=(".V1A", ".V2A"),
        sniff=geonet.sniff,
        read=geonet.read,
    ),
    Format(
        name="afad",
        obspy_name="AFAD",
        description="AFAD (Turkish network), raw, three columns in gal",
        extensions=(".txt",),
        sniff=afad.sniff,
        read=afad.read,
    ),
    Format(
        name="sac",
        obspy_name="SAC",
        description="SAC, binary or alphanumeric; needs --units",
        extensions=(".sac",),
        sniff=sac.sniff,
        read=sac.read,
    ),
    Format(
        name="miniseed",
        obspy_name="MSEED",
        description="miniSEED 2 with StationXML beside it or in --station-xml",
        extensions=(".mseed",),
        sniff=miniseed.sniff,
        read=miniseed.read,
    ),
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
    claims = [known for known in FORMATS if known.sniff(head)]
    if len(claims) == 1:
        return claims[0]
    if claims:
        names = ", ".join(known.name for known in claims)
        raise InputError(source, f"ambiguous format: {names} all recognise it.")
    volume = _caltech_volume(head)
    if volume:
        raise InputError(
            source,
            f"is a Caltech/USC volume {volume} file, whose layout is not known for certain. "
            "Must be a copy of the record in another format, as PEER AT2, SMC or COSMOS.",
        )
    names = ", ".join(known.name for known in FORMATS)
    raise InputError(source, f"unknown format, begins {_beginning(head)}. Must be one of: {names}.")


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
    path = Path(path)
    if not data:
        raise InputError(path, "empty file.")
    if is_utf16(data):
        raise InputError(path, "text in UTF-16. Save it as ASCII or UTF-8.")
    chosen = sniff_format(data[:HEAD], path) if file_format is None else file_format
    digest, name = hashlib.sha256(data).hexdigest(), source_file or path.name
    return [
        replace(record, source_file=name, source_format=chosen.name, source_sha256=digest)
        for record in chosen.read(path, data, options)
    ]


def _caltech_volume(head: bytes) -> str:
    """Return the volume (I or II) of a Caltech/USC tape file; empty for other files."""
    first = "\n".join(head_lines(head)[:2])
    if _CALTECH_I.search(first):
        return "I"
    return "II" if _CALTECH_II.search(first) else ""


def _beginning(head: bytes) -> str:
    first = head.lstrip().split(b"\n", 1)[0].strip()[:50]
    text = first.decode("latin-1")
    return repr(text) if text.isascii() and text.isprintable() else repr(head[:16])
