"""One FDSN service: obspy's client asks, and every answer is seen before obspy takes it apart."""

from __future__ import annotations

import re
import time
import urllib.request
import urllib.response
from collections.abc import Callable
from dataclasses import dataclass, replace
from email.message import Message
from http.client import HTTPException, HTTPResponse, IncompleteRead
from importlib.metadata import version
from io import BytesIO
from typing import Any, Final

from rockframe.errors import ParameterError
from rockframe.fetch.answers import Heard, Kind, Problem, judge, slow, unreachable
from rockframe.fetch.obspy_parts import Client, FDSNException

#: Attempts at one request, the first included.
ATTEMPTS: Final = 4
#: First pause between attempts, doubled each time [s].
_FIRST_PAUSE: Final = 2.0
#: Longest time for one answer, unless told otherwise [s].
TIMEOUT: Final = 120.0
#: Longest pause that a service may ask for [s].
LONGEST_PAUSE: Final = 120.0
#: Most bytes of one answer: a day of 3 components at 200 Hz is a fifth of it.
_MOST_BYTES: Final = 512 * 1024 * 1024
_CHUNK: Final = 65536
_AGENT: Final = f"rockframe/{version('rockframe')} (obspy {version('obspy')})"
#: What a service may answer with; the first is what the standard says.
_CONTENT: Final = {
    "dataselect": re.compile(
        r"application/vnd.fdsn.mseed|application/octet-stream|application/x-mseed"
    ),
    "station": re.compile(r"application/xml|text/xml|application/[a-z.-]+\+xml"),
    "event": re.compile(r"application/xml|text/xml|application/[a-z.-]+\+xml"),
}

Sleep = Callable[[float], None]


class _Witness(urllib.request.BaseHandler):
    """Reads each answer within bounds, and keeps what obspy drops: headers, what is missing."""

    handler_order = 100  # before urllib turns an answer into an error

    def __init__(self, timeout: float) -> None:
        self.timeout = timeout
        self.heard: Heard | None = None

    def take(self) -> Heard | None:
        """Return the last answer, once."""
        heard, self.heard = self.heard, None
        return heard

    def http_response(self, request: urllib.request.Request, response: HTTPResponse) -> Any:
        body, problem = _read(response, self.timeout)
        self.heard = Heard(request.full_url, response.status, response.headers, body, problem)
        passed = BytesIO(b"" if problem else body)
        again = urllib.response.addinfourl(
            passed, response.headers, request.full_url, response.status
        )
        again.msg = response.reason  # type: ignore[attr-defined]  # urllib reads it
        return again

    https_response = http_response


def _read(response: HTTPResponse, timeout: float) -> tuple[bytes, Problem | None]:
    """The body, and what is wrong with how it came in."""
    body = bytearray()
    deadline = time.monotonic() + timeout
    try:
        while chunk := response.read1(_CHUNK):
            body += chunk
            if time.monotonic() > deadline:
                return b"", slow(timeout)
            if len(body) > _MOST_BYTES:
                return b"", Problem(
                    Kind.TOO_MUCH, f"more than {_MOST_BYTES} bytes. Must be asked in parts."
                )
    except TimeoutError:
        return b"", slow(timeout)
    except IncompleteRead:
        return b"", _cut_off(len(body), "unknown")
    finally:
        response.close()
    stated = response.headers.get("Content-Length", "")
    if stated.isdecimal() and int(stated) != len(body) and response.status != 204:
        return b"", _cut_off(len(body), stated)
    if response.headers.get("Content-Encoding", "identity").lower() != "identity":
        return b"", Problem(
            Kind.DAMAGED,
            f"answered in {response.headers['Content-Encoding']!r}, unasked. Must be plain.",
        )
    return bytes(body), None


def _cut_off(received: int, stated: str) -> Problem:
    return Problem(
        Kind.DAMAGED,
        f"answer truncated: {received} of {stated} bytes came in. Must be whole: try again.",
        passing=True,
    )


@dataclass(frozen=True)
class Service:
    """One service of a data centre, asked with patience but not without end.

    Parameters
    ----------
    name : str
        ``dataselect``, ``station`` or ``event``.
    address : str
        Address of the data centre.
    client : obspy.clients.fdsn.Client
        Knows how to ask.
    witness : handler
        Sees each answer.
    sleep : callable
        Waits a number of seconds.

    Examples
    --------
    >>> open_service("dataselect", "SCEDC").address
    'https://service.scedc.caltech.edu'
    """

    name: str
    address: str
    client: Client
    witness: _Witness
    sleep: Sleep

    def version(self) -> str:
        """Return the version that the service states, or an empty string."""
        try:
            return ".".join(map(str, self.client.get_webservice_version(self.name)))
        except (FDSNException, HTTPException, OSError, ValueError):
            return ""  # worth knowing, but no reason to stop
        finally:
            self.witness.take()

    def ask(self, request: Callable[[Client, BytesIO], None]) -> Heard:
        """Ask, again if the problem may pass, and return the last answer with its problem.

        Parameters
        ----------
        request : callable
            Called with obspy's client and a buffer for the answer.
        """
        pause = _FIRST_PAUSE
        for attempt in range(1, ATTEMPTS + 1):
            heard = self._ask_once(request)
            problem = judge(heard, _CONTENT[self.name])
            heard = replace(heard, problem=problem)
            if problem is None or not problem.passing or problem.wait > LONGEST_PAUSE:
                break
            if attempt < ATTEMPTS:
                self.sleep(max(pause, problem.wait))
                pause *= 2.0
        return heard

    def _ask_once(self, request: Callable[[Client, BytesIO], None]) -> Heard:
        reason = "nothing came in"
        try:
            request(self.client, BytesIO())
        except (FDSNException, HTTPException, OSError, NotImplementedError) as error:
            reason = str(error)
        return self.witness.take() or Heard(self.address, 0, Message(), b"", unreachable(reason))


def open_service(
    name: str, url: str, timeout: float = TIMEOUT, sleep: Sleep = time.sleep
) -> Service:
    """Return a service, without asking it anything yet.

    Parameters
    ----------
    name : str
        ``dataselect``, ``station`` or ``event``.
    url : str
        Address, or a short name that obspy knows.
    timeout : float
        Longest time for one answer [s].
    sleep : callable
        Waits a number of seconds.

    Raises
    ------
    ParameterError
        If the address is none, or obspy does not know the name.

    Examples
    --------
    >>> open_service("event", "moon")
    Traceback (most recent call last):
    rockframe.errors.ParameterError: Invalid address 'moon' of the event service. Must begin with \
http:// or https://, or be a short name that obspy knows (as SCEDC, INGV).
    """
    try:
        # Without discovery: every request is one of ours, and each answer is judged. Without
        # gzip: the bytes are kept as received, and nothing expands without bound.
        client = Client(
            url, timeout=timeout, user_agent=_AGENT, use_gzip=False, _discover_services=False
        )
    except ValueError:
        raise ParameterError(
            f"Invalid address {url!r} of the {name} service. Must begin with http:// or "
            "https://, or be a short name that obspy knows (as SCEDC, INGV)."
        ) from None
    witness = _Witness(timeout)
    client._url_opener.add_handler(witness)  # noqa: SLF001  # obspy hands out no headers
    return Service(name, client.base_url, client, witness, sleep)
