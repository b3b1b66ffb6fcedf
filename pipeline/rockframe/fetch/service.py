"""Send requests to an FDSN service with obspy's client, which reads only checked replies."""

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

from obspy.clients.fdsn import Client
from obspy.clients.fdsn.header import FDSNException

from rockframe.errors import ParameterError
from rockframe.fetch.answers import Kind, Problem, ServiceReply, judge, slow, unreachable
from rockframe.interruption import raising

#: Number of attempts at one request.
ATTEMPTS: Final = 4
#: First pause between attempts, doubled each time [s].
_FIRST_PAUSE: Final = 2.0
#: Default of the longest time for one reply [s].
TIMEOUT: Final = 120.0
#: Longest pause that a service may ask for [s].
LONGEST_PAUSE: Final = 120.0
#: Largest reply [bytes]: five days of 3 components at 200 Hz.
_MOST_BYTES: Final = 512 * 1024 * 1024
_CHUNK: Final = 65536
_AGENT: Final = f"rockframe/{version('rockframe')} (obspy {version('obspy')})"
#: Allowed content types of each service; the first is the standard one.
_CONTENT: Final = {
    "dataselect": re.compile(
        r"application/vnd.fdsn.mseed|application/octet-stream|application/x-mseed"
    ),
    "station": re.compile(r"application/xml|text/xml|application/[a-z.-]+\+xml"),
    "event": re.compile(r"application/xml|text/xml|application/[a-z.-]+\+xml"),
}

Sleep = Callable[[float], None]


class _Witness(urllib.request.BaseHandler):
    """Reads each reply within limits, and keeps headers and transfer faults, which obspy drops."""

    handler_order = 100  # before urllib raises an error for a status

    def __init__(self, timeout: float) -> None:
        self.timeout = timeout
        self.reply: ServiceReply | None = None

    def take(self) -> ServiceReply | None:
        """Return the last reply and forget it."""
        reply, self.reply = self.reply, None
        return reply

    def http_response(self, request: urllib.request.Request, response: HTTPResponse) -> Any:
        body, problem = _read(response, self.timeout)
        self.reply = ServiceReply(
            request.full_url, response.status, response.headers, body, problem
        )
        passed = BytesIO(b"" if problem else body)
        again = urllib.response.addinfourl(
            passed, response.headers, request.full_url, response.status
        )
        again.msg = response.reason  # type: ignore[attr-defined]  # urllib reads it
        return again

    https_response = http_response


def _read(response: HTTPResponse, timeout: float) -> tuple[bytes, Problem | None]:
    """Return the body, and the problem of the transfer if any."""
    body = bytearray()
    deadline = time.monotonic() + timeout
    try:
        while chunk := response.read1(_CHUNK):
            body += chunk
            if time.monotonic() > deadline:
                return b"", slow(timeout)
            if len(body) > _MOST_BYTES:
                return b"", Problem(
                    Kind.TOO_MUCH, f"more than {_MOST_BYTES} bytes. Request them in parts."
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
            f"answered in {response.headers['Content-Encoding']!r}, not requested. Must be plain.",
        )
    return bytes(body), None


def _cut_off(received: int, stated: str) -> Problem:
    return Problem(
        Kind.DAMAGED,
        f"answer truncated: {received} of {stated} bytes received. Try again.",
        passing=True,
    )


@dataclass(frozen=True)
class Service:
    """One service of a data centre, with a limited number of retries.

    Parameters
    ----------
    name : str
        ``dataselect``, ``station`` or ``event``.
    address : str
        Address of the data centre.
    client : obspy.clients.fdsn.Client
        Sends the requests.
    witness : handler
        Keeps each reply.
    sleep : callable
        Waits for a number of seconds.

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
            return ""  # useful, but not required
        finally:
            self.witness.take()

    def ask(self, request: Callable[[Client, BytesIO], None]) -> ServiceReply:
        """Send a request, retry if the problem may pass, and return the last reply."""
        pause = _FIRST_PAUSE
        for attempt in range(1, ATTEMPTS + 1):
            reply = self._ask_once(request)
            problem = judge(reply, _CONTENT[self.name])
            reply = replace(reply, problem=problem)
            if problem is None or not problem.passing or problem.wait > LONGEST_PAUSE:
                break
            if attempt < ATTEMPTS:
                with raising():
                    self.sleep(max(pause, problem.wait))
                pause *= 2.0
        return reply

    def _ask_once(self, request: Callable[[Client, BytesIO], None]) -> ServiceReply:
        reason = "nothing was received"
        try:
            with raising():
                request(self.client, BytesIO())
        except (FDSNException, HTTPException, OSError, NotImplementedError) as error:
            reason = str(error)
        return self.witness.take() or ServiceReply(
            self.address, 0, Message(), b"", unreachable(reason)
        )


def open_service(
    name: str, url: str, timeout: float = TIMEOUT, sleep: Sleep = time.sleep
) -> Service:
    """Return a service, without sending a request.

    Raises
    ------
    ParameterError
        If the address is neither a URL nor a name that obspy knows.

    Examples
    --------
    >>> open_service("event", "moon")
    Traceback (most recent call last):
    rockframe.errors.ParameterError: Invalid address 'moon' of the event service. Must begin with \
http:// or https://, or be a short name that obspy knows (as SCEDC, INGV).
    """
    try:
        # No discovery, so that each reply is checked here. No gzip, so that files are kept as
        # received and nothing expands without limit.
        client = Client(
            url, timeout=timeout, user_agent=_AGENT, use_gzip=False, _discover_services=False
        )
    except ValueError:
        raise ParameterError(
            f"Invalid address {url!r} of the {name} service. Must begin with http:// or "
            "https://, or be a short name that obspy knows (as SCEDC, INGV)."
        ) from None
    witness = _Witness(timeout)
    client._url_opener.add_handler(witness)  # noqa: SLF001  # obspy does not pass headers on
    return Service(name, client.base_url, client, witness, sleep)
