"""Send requests to an FDSN service with obspy's client, which reads only checked replies.

An invalid reply becomes an error that says what to do.
"""

from __future__ import annotations

import re
import time
import urllib.request
import urllib.response
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from email.message import Message
from email.utils import parsedate_to_datetime
from enum import Enum, auto
from http.client import HTTPException, HTTPResponse, IncompleteRead
from importlib.metadata import version
from io import BytesIO
from typing import Any, Final

from obspy.clients.fdsn import Client
from obspy.clients.fdsn.header import FDSNException

from rockframe.errors import ParameterError, RockframeWarning
from rockframe.interruption import raising
from rockframe.provenance import __version__

#: Longest quotation of a service's own message in an error [characters].
_LONGEST_WORDS: Final = 200
#: HTTP statuses for which a retry may succeed.
_PASSING: Final = frozenset([429, 500, 502, 503, 504])
_AGAIN: Final = "Try again later: the same command resumes."
_BY_HAND: Final = (
    "needs a login or a permission, which rockframe does not send. "
    "Download by hand from the archive's site, then use `rockframe ingest`."
)


class Kind(Enum):
    """Kind of problem with a reply."""

    NO_DATA = auto()
    WITHHELD = auto()
    TOO_MUCH = auto()
    CORRUPTED = auto()
    MISTAKE = auto()
    UNAVAILABLE = auto()


@dataclass(frozen=True)
class Problem:
    """The reason why a reply cannot be used.

    Parameters
    ----------
    kind : Kind
        Kind of problem.
    reason : str
        The reply of the service, and what to do.
    passing : bool
        True if a retry may succeed.
    wait : float
        Pause before the retry that the service asks for [s].

    Examples
    --------
    >>> Problem(Kind.NO_DATA, "answered 204: no data.").passing
    False
    """

    kind: Kind
    reason: str
    passing: bool = False
    wait: float = 0.0


@dataclass(frozen=True)
class ServiceReply:
    """One reply of a service as received.

    Parameters
    ----------
    url : str
        Complete URL of the request.
    status : int
        HTTP status; 0 without a reply.
    headers : Message
        Headers of the reply.
    body : bytes
        Body as received.
    problem : Problem, optional
        Problem during the transfer.
    """

    url: str
    status: int
    headers: Message
    body: bytes
    problem: Problem | None = None


def judge(reply: ServiceReply, content: re.Pattern[str]) -> Problem | None:
    """Return the problem of a reply, or None.

    Examples
    --------
    >>> reply = ServiceReply("http://127.0.0.1/query", 413, Message(), b"")
    >>> judge(reply, re.compile("application/xml")).reason[:31]
    'answered 413: too much at once.'
    """
    if reply.problem is not None:
        return reply.problem
    if reply.status != 200:
        return _of_status(reply)
    if not reply.body:
        return Problem(Kind.NO_DATA, "answered 200 with nothing: no data. " + _HELD)
    # Without the header, Message returns text/plain, which the service did not state.
    given = reply.headers.get_content_type() if "Content-Type" in reply.headers else ""
    if given and not content.fullmatch(given):
        return Problem(
            Kind.CORRUPTED,
            f"answered with content type {given!r} (a page for people, or a login?) "
            f"in place of {content.pattern.split('|')[0]}. Check the address of the service.",
        )
    return None


_HELD: Final = "Request codes and times that the service has."


def _of_status(reply: ServiceReply) -> Problem:
    status, said = reply.status, _words(reply.body)
    if status in {204, 404}:
        service = " (or no such service at this address)" if status == 404 else ""
        return Problem(Kind.NO_DATA, f"answered {status}: no data{service}. {_HELD}")
    if status in {401, 403}:
        return Problem(Kind.WITHHELD, f"answered {status}: {_BY_HAND}")
    if status in {413, 414}:
        return Problem(
            Kind.TOO_MUCH,
            f"answered {status}: too much at once. Request less: fewer stations or channels, "
            "or a shorter span of time.",
        )
    if status in _PASSING:
        wait = _retry_after(reply.headers)
        asked = f" and asks to wait {wait:g} s" if wait else ""
        reason = f"answered {status}{said}{asked}. {_AGAIN}"
        return Problem(Kind.UNAVAILABLE, reason, passing=True, wait=wait)
    if status == 400:
        return Problem(Kind.MISTAKE, f"answered 400, bad request{said}. Change the request.")
    return Problem(Kind.MISTAKE, f"answered {status}{said}. Check the address.")


def unreachable(reason: str) -> Problem:
    """Return the problem of a service that did not reply.

    Examples
    --------
    >>> unreachable("connection refused").reason[:31]
    'no answer (connection refused).'
    """
    return Problem(Kind.UNAVAILABLE, f"no answer ({one_line(reason)}). {_AGAIN}", passing=True)


def slow(seconds: float) -> Problem:
    """Return the problem of a reply that timed out.

    Examples
    --------
    >>> slow(60.0).passing
    True
    """
    return Problem(
        Kind.UNAVAILABLE, f"not answered in full within {seconds:g} s. {_AGAIN}", passing=True
    )


def _words(body: bytes) -> str:
    said = one_line(re.sub("<[^>]*>", " ", body.decode("utf-8", "replace")))
    return f" ({said})" if said else ""


def one_line(text: str) -> str:
    r"""Return a text from elsewhere as one line, without control characters, shortened if long.

    Examples
    --------
    >>> one_line("Error 400:\n\tno such channel")
    'Error 400: no such channel'
    """
    line = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    return line if len(line) <= _LONGEST_WORDS else line[: _LONGEST_WORDS - 3] + "..."


def _retry_after(headers: Message) -> float:
    """Return the seconds of the header Retry-After, a number or a date; 0 without it."""
    text = headers.get("Retry-After", "").strip()
    if text.isascii() and text.isdecimal():
        return float(text)
    try:
        until = parsedate_to_datetime(text)
        # Prefer the service's clock, because the local one may be wrong.
        now = parsedate_to_datetime(headers["Date"]) if "Date" in headers else datetime.now(UTC)
        return max((until - now).total_seconds(), 0.0)
    except (ValueError, TypeError):  # not a date, or only one of the two dates has a time zone
        return 0.0


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
_AGENT: Final = f"rockframe/{__version__} (obspy {version('obspy')})"
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
    announced = response.headers.get("Content-Length", "")
    if announced.isdecimal() and int(announced) != len(body) and response.status != 204:
        return b"", _cut_off(len(body), announced)
    if response.headers.get("Content-Encoding", "identity").lower() != "identity":
        return b"", Problem(
            Kind.CORRUPTED,
            f"answered in {response.headers['Content-Encoding']!r}, which was not requested.",
        )
    return bytes(body), None


def _cut_off(received: int, announced: str) -> Problem:
    return Problem(
        Kind.CORRUPTED,
        f"answer truncated: {received} of {announced} bytes received. Try again.",
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
    opener = getattr(client, "_url_opener", None)  # obspy does not pass headers on
    if opener is None:
        warnings.warn(
            "this version of obspy hides the replies of data centres: their headers are not "
            "checked, and their size is not limited.",
            RockframeWarning,
            stacklevel=2,
        )
    else:
        opener.add_handler(witness)
    return Service(name, client.base_url, client, witness, sleep)
