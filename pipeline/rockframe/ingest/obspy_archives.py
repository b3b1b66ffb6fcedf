"""The readers of national archives as obspy waveform plug-ins, for the formats that obspy lacks.

K-NET, SAC and miniSEED it reads by itself.
"""

from __future__ import annotations

from typing import Any, Final

from rockframe.ingest.obspy_plugin import Source, _is, _stream
from rockframe.ingest.options import ReadOptions
from rockframe.ingest.registry import FORMATS

_BY_NAME: Final = {known.name: known for known in FORMATS}
_ESM: Final = _BY_NAME["esm_dyna"]
_GEONET: Final = _BY_NAME["geonet"]
_AFAD: Final = _BY_NAME["afad"]


def is_esm(file: Source) -> bool:
    r"""Whether a file is an ESM or ITACA file.

    Parameters
    ----------
    file : str, Path or binary stream
        Read up to 4096 bytes; a stream is left where it was.

    Examples
    --------
    >>> from io import BytesIO
    >>> is_esm(BytesIO(b"EVENT_NAME: GREECE\nNDATA: 3\n"))
    True
    """
    return _is(file, _ESM)


def read_esm(file: Source, headonly: bool = False, **_: object) -> Any:
    """Read an ESM or ITACA file into a stream of one trace.

    Parameters
    ----------
    file : str, Path or binary stream
        The file.
    headonly : bool
        Leave out the samples.

    Raises
    ------
    InputError
        As `rockframe.ingest.esm.read`.

    Examples
    --------
    >>> from io import BytesIO
    >>> read_esm(BytesIO(b"EVENT_NAME: GREECE"))
    Traceback (most recent call last):
    rockframe.errors.InputError: stream: no HEADER_FORMAT in 1 lines of header. Must be stated.
    """
    return _stream(file, _ESM, ReadOptions(), headonly)


def is_geonet(file: Source) -> bool:
    r"""Whether a file is a GeoNet V1A or V2A file.

    Parameters
    ----------
    file : str, Path or binary stream
        Read up to 4096 bytes; a stream is left where it was.

    Examples
    --------
    >>> from io import BytesIO
    >>> is_geonet(BytesIO(b"Corrected accelerogram 20180212_211554_WPWS_20\nSite WPWS\n"))
    True
    """
    return _is(file, _GEONET)


def read_geonet(file: Source, headonly: bool = False, **_: object) -> Any:
    """Read a GeoNet file into a stream of three traces of acceleration.

    Parameters
    ----------
    file : str, Path or binary stream
        The file.
    headonly : bool
        Leave out the samples.

    Raises
    ------
    InputError
        As `rockframe.ingest.geonet.read`.

    Examples
    --------
    >>> from io import BytesIO
    >>> read_geonet(BytesIO(b"Corrected accelerogram"))
    Traceback (most recent call last):
    rockframe.errors.InputError: stream:1: the file ends after 1 lines of a component's header...
    """
    return _stream(file, _GEONET, ReadOptions(), headonly)


def is_afad(file: Source) -> bool:
    r"""Whether a file is an AFAD file of three columns.

    Parameters
    ----------
    file : str, Path or binary stream
        Read up to 4096 bytes; a stream is left where it was.

    Examples
    --------
    >>> from io import BytesIO
    >>> is_afad(BytesIO(b"STRONG GROUND MOTION RECORDS OF TURKIYE\n"))
    True
    """
    return _is(file, _AFAD)


def read_afad(file: Source, headonly: bool = False, **_: object) -> Any:
    """Read an AFAD file into a stream of three traces.

    Parameters
    ----------
    file : str, Path or binary stream
        The file.
    headonly : bool
        Leave out the samples.

    Raises
    ------
    InputError
        As `rockframe.ingest.afad.read`.

    Examples
    --------
    >>> from io import BytesIO
    >>> read_afad(BytesIO(b"STRONG GROUND MOTION RECORDS OF TURKIYE"))
    Traceback (most recent call last):
    rockframe.errors.InputError: stream: no line 'N-S E-W U-D' in the first 30 lines. Must stand...
    """
    return _stream(file, _AFAD, ReadOptions(), headonly)
