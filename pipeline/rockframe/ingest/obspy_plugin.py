"""The readers as obspy waveform plug-ins: `obspy.read("RSN77.AT2", format="PEERAT2")`.

Traces hold accelerations in m s-2; what obspy has no place for stands in `stats.peerat2`,
`stats.csmipv1` and so on, named as the format.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rockframe.ingest.obspy_streams import Source, is_format, read_stream
from rockframe.ingest.options import ReadOptions

if TYPE_CHECKING:
    from obspy import Stream


def is_peer_at2(file: Source) -> bool:
    """Whether a file is a PEER file.

    Parameters
    ----------
    file : str, Path or binary stream
        Read up to 4096 bytes; a stream is left where it was.

    Examples
    --------
    >>> from io import BytesIO
    >>> is_peer_at2(BytesIO(b"3 0.01 NPTS, DT"))
    True
    """
    return is_format(file, "peer_at2")


def read_peer_at2(file: Source, headonly: bool = False, **_: object) -> Stream:
    r"""Read a PEER AT2 file into a stream of one trace.

    Parameters
    ----------
    file : str, Path or binary stream
        The file.
    headonly : bool
        Leave out the samples.

    Raises
    ------
    InputError
        As `rockframe.ingest.peer_at2.read`.

    Examples
    --------
    >>> from io import BytesIO
    >>> lines = b"PEER\nTITLE\nACCELERATION TIME SERIES IN UNITS OF G\n2 .01 NPTS, DT\n .1 -.2"
    >>> read_peer_at2(BytesIO(lines))[0].data
    array([ 0.981, -1.962])
    """
    return read_stream(file, "peer_at2", headonly)


def is_csmip_v1(file: Source) -> bool:
    """Whether a file is a CSMIP volume 1 file.

    Parameters
    ----------
    file : str, Path or binary stream
        Read up to 4096 bytes; a stream is left where it was.

    Examples
    --------
    >>> from io import BytesIO
    >>> is_csmip_v1(BytesIO(b"Corrected accelerogram"))
    False
    """
    return is_format(file, "csmip_v1")


def read_csmip_v1(file: Source, headonly: bool = False, **_: object) -> Stream:
    """Read a CSMIP volume 1 file into a stream of one trace a channel.

    Parameters
    ----------
    file : str, Path or binary stream
        The file.
    headonly : bool
        Leave out the samples.

    Raises
    ------
    InputError
        As `rockframe.ingest.csmip_v1.read`.

    Examples
    --------
    >>> from io import BytesIO
    >>> read_csmip_v1(BytesIO(b"Corrected accelerogram"))
    Traceback (most recent call last):
    rockframe.errors.InputError: stream:1: 'Corrected accelerogram'. Must be 'Uncorrected ...
    """
    return read_stream(file, "csmip_v1", headonly)


def is_csmip_v2(file: Source) -> bool:
    r"""Whether a file is a CSMIP volume 2 file, or of its siblings that are refused.

    Parameters
    ----------
    file : str, Path or binary stream
        Read up to 4096 bytes; a stream is left where it was.

    Examples
    --------
    >>> from io import BytesIO
    >>> is_csmip_v2(BytesIO(b"Response and Fourier amplitude spectra"))
    True
    """
    return is_format(file, "csmip_v2")


def read_csmip_v2(file: Source, headonly: bool = False, **_: object) -> Stream:
    r"""Read a CSMIP volume 2 file into a stream of one trace a channel.

    Parameters
    ----------
    file : str, Path or binary stream
        The file.
    headonly : bool
        Leave out the samples.

    Raises
    ------
    InputError
        As `rockframe.ingest.csmip_v2.read`.

    Examples
    --------
    >>> from io import BytesIO
    >>> read_csmip_v2(BytesIO(b"Response and Fourier amplitude spectra"))
    Traceback (most recent call last):
    rockframe.errors.InputError: stream:1: response and Fourier spectra (CSMIP volume 3). ...
    """
    return read_stream(file, "csmip_v2", headonly)


def is_cosmos(file: Source) -> bool:
    r"""Whether a file is a COSMOS file, or of its siblings that are refused.

    Parameters
    ----------
    file : str, Path or binary stream
        Read up to 4096 bytes; a stream is left where it was.

    Examples
    --------
    >>> from io import BytesIO
    >>> is_cosmos(BytesIO(b"Raw acceleration counts   (Format v01.20 with 13 text lines)"))
    True
    """
    return is_format(file, "cosmos")


def read_cosmos(file: Source, headonly: bool = False, **_: object) -> Stream:
    r"""Read a COSMOS file into a stream of one trace a channel.

    Parameters
    ----------
    file : str, Path or binary stream
        The file.
    headonly : bool
        Leave out the samples.

    Raises
    ------
    InputError
        As `rockframe.ingest.cosmos.read`.

    Examples
    --------
    >>> from io import BytesIO
    >>> read_cosmos(BytesIO(b"Raw acceleration counts"))
    Traceback (most recent call last):
    rockframe.errors.InputError: stream:1: 'Raw acceleration counts'. Must be as in ...
    """
    return read_stream(file, "cosmos", headonly)


def is_smc(file: Source) -> bool:
    r"""Whether a file is an SMC file, or of its siblings that are refused.

    Parameters
    ----------
    file : str, Path or binary stream
        Read up to 4096 bytes; a stream is left where it was.

    Examples
    --------
    >>> from io import BytesIO
    >>> is_smc(BytesIO(b"3 VELOCITY"))
    True
    """
    return is_format(file, "smc")


def read_smc(file: Source, headonly: bool = False, **_: object) -> Stream:
    r"""Read an SMC file into a stream of one trace.

    Parameters
    ----------
    file : str, Path or binary stream
        The file.
    headonly : bool
        Leave out the samples.

    Raises
    ------
    InputError
        As `rockframe.ingest.smc.read`.

    Examples
    --------
    >>> from io import BytesIO
    >>> read_smc(BytesIO(b"3 VELOCITY"))
    Traceback (most recent call last):
    rockframe.errors.InputError: stream:1: is a velocity file. Must be an accelerogram.
    """
    return read_stream(file, "smc", headonly)


def is_text(file: Source) -> bool:
    r"""Whether a file is a table of one or two columns of numbers.

    Parameters
    ----------
    file : str, Path or binary stream
        Read up to 4096 bytes; a stream is left where it was.

    Examples
    --------
    >>> from io import BytesIO
    >>> is_text(BytesIO(b"time_s,acc_g\n0.00,0.1\n0.01,0.2\n"))
    True
    """
    return is_format(file, "acceleration_text")


def read_text(
    file: Source,
    headonly: bool = False,
    units: str | None = None,
    time_step: float | None = None,
    **_: object,
) -> Stream:
    r"""Read a number table into a stream of one trace.

    Parameters
    ----------
    file : str, Path or binary stream
        The file.
    headonly : bool
        Leave out the samples.
    units : str, optional
        Acceleration units, if the file does not state them.
    time_step : float, optional
        Time step [s], if the file does not state it.

    Raises
    ------
    InputError
        As `rockframe.ingest.text.read`.

    Examples
    --------
    >>> from io import BytesIO
    >>> read_text(BytesIO(b"0.1\n-0.2\n"), units="gal", time_step=0.02)[0].stats.delta
    0.02
    """
    return read_stream(file, "acceleration_text", headonly, ReadOptions(units, time_step))
