"""Turn an invalid reply of a service into an error that says what to do."""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import UTC, datetime
from email.message import Message
from email.utils import parsedate_to_datetime
from enum import Enum, auto
from typing import Final

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
    DAMAGED = auto()
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
    >>> Problem(Kind.NO_DATA, "answered 204: no data. Must be in its archive.").passing
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
            Kind.DAMAGED,
            f"answered with content type {given!r} (a page for people, or a login?). "
            f"Must be {content.pattern.split('|')[0]}: check the address of the service.",
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
    return Problem(Kind.MISTAKE, f"answered {status}{said}. Must be 200: check the address.")


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
