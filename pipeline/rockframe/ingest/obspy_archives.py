"""The readers of national archives as obspy waveform plug-ins, for the formats that obspy lacks.

K-NET, SAC and miniSEED it reads by itself.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rockframe.ingest.obspy_streams import Source, is_format, read_stream

if TYPE_CHECKING:
    from obspy import Stream


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
    return is_format(file, "esm_dyna")


def read_esm(file: Source, headonly: bool = False, **_: object) -> Stream:
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
    return read_stream(file, "esm_dyna", headonly)


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
    return is_format(file, "geonet")


def read_geonet(file: Source, headonly: bool = False, **_: object) -> Stream:
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
    return read_stream(file, "geonet", headonly)


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
    return is_format(file, "afad")


def read_afad(file: Source, headonly: bool = False, **_: object) -> Stream:
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
    return read_stream(file, "afad", headonly)
