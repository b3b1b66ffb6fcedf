"""The page and its server, which listens on this machine only and requires a random token."""

from __future__ import annotations

import asyncio
import secrets
import socket
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import h11
import uvicorn
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import MutableHeaders
from starlette.requests import Request
from starlette.responses import JSONResponse, PlainTextResponse, Response
from starlette.routing import Route
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from uvicorn.protocols.http.h11_impl import H11Protocol

from rockframe.errors import ParameterError
from rockframe.explorer.answer import ExploredMotion, Settings, answer, margin, read_settings
from rockframe.structures.contract import Structure, kind_of
from rockframe.web import render_page

#: The only address that the server listens on.
LOOPBACK: Final = "127.0.0.1"
#: Last part of the paths that return a response.
_FORMS: Final = ("response", "margin", "history.csv")
#: Longest time for a request to arrive [s], and largest number of open connections; a browser opens
#: six.
_REQUEST_TIME: Final = 10.0
_MOST_CONNECTIONS: Final = 64
#: Longest time for a client to read a response that waits for it [s], and largest number of
#: responses that are computed at once.
_READING_TIME: Final = 30.0
_MOST_COMPUTED: Final = 2
#: Headers of every response. The page has a Content-Security-Policy of its own.
_HEADERS: Final = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": "default-src 'none'",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}


def application(
    motions: Sequence[ExploredMotion], structures: Sequence[Structure], token: str, port: int
) -> ASGIApp:
    """Return the application that serves the page and its requests.

    Parameters
    ----------
    motions : sequence of ExploredMotion
        Records to choose from.
    structures : sequence of Structure
        Structures to choose from.
    token : str
        First part of every path; all other paths return 404.
    port : int
        Port that the server listens on; requests for another host return 403.
    """
    page, rules = render(motions, structures)
    searching, computing = asyncio.Lock(), asyncio.Semaphore(_MOST_COMPUTED)
    by_record = {motion.record.record_id: motion for motion in motions}

    def has_token(request: Request) -> bool:
        return secrets.compare_digest(request.path_params["token"].encode(), token.encode())

    async def show(request: Request) -> Response:
        if not has_token(request):
            return _not_found()
        headers = {"Content-Security-Policy": rules}
        return Response(page, media_type="text/html", headers=headers)

    async def compute(request: Request) -> Response:
        if not has_token(request) or request.path_params["form"] not in _FORMS:
            return _not_found()
        form = request.path_params["form"]
        try:
            settings = read_settings(_once(request))
            # margins one at a time; the page cancels requests that it no longer needs
            async with searching if form == "margin" else computing:
                if await request.is_disconnected():
                    return Response()
                return await run_in_threadpool(_computed, form, by_record, settings)
        except ParameterError as error:
            return JSONResponse({"error": str(error)}, status_code=400)

    routes = [Route("/{token}/", show), Route("/{token}/{form:path}", compute)]
    return _Guard(Starlette(routes=routes), port)


def _computed(form: str, motions: Mapping[str, ExploredMotion], settings: Settings) -> Response:
    """Compute a response in the form that was requested; not in the event loop, which serves all.

    Raises
    ------
    ParameterError
        As `answer` and `margin`.
    """
    if form == "margin":
        return JSONResponse(margin(motions, settings))
    computed = answer(motions, settings)
    if form == "history.csv":
        return Response(computed.table(), media_type="text/csv")
    return Response(computed.packed(), media_type="application/octet-stream")


def configured(app: ASGIApp) -> uvicorn.Config:
    """Return the configuration of the server: it logs only errors and stops within a second."""
    return uvicorn.Config(
        app,
        http=_Connection,
        log_level="error",
        access_log=False,
        lifespan="off",
        server_header=False,
        timeout_graceful_shutdown=1,
        ws="none",
    )


def run_server(app: ASGIApp, listening: socket.socket) -> None:
    """Serve until the process is interrupted.

    Raises
    ------
    KeyboardInterrupt
        When the process is interrupted.
    """
    uvicorn.Server(configured(app)).run(sockets=[listening])


class _Connection(H11Protocol):
    """A connection that closes if its request is late, its client does not read, or too many
    connections are open.
    """

    _deadline: asyncio.TimerHandle | None = None
    _reading: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        if len(self.connections) > _MOST_CONNECTIONS:
            transport.abort()
        self._watch()

    def data_received(self, data: bytes) -> None:
        super().data_received(data)
        self._watch()

    def pause_writing(self) -> None:
        super().pause_writing()
        self._reading = self.loop.call_later(_READING_TIME, self.transport.abort)

    def resume_writing(self) -> None:
        self._unwatch_reading()
        super().resume_writing()

    def connection_lost(self, exc: Exception | None) -> None:
        self._unwatch()
        self._unwatch_reading()
        super().connection_lost(exc)

    def _unwatch_reading(self) -> None:
        if self._reading is not None:
            self._reading.cancel()
            self._reading = None

    def _watch(self) -> None:
        """Start the timeout while a request is received; cancel it when the request is complete."""
        if self.conn.their_state not in (h11.IDLE, h11.SEND_BODY):
            self._unwatch()
        elif self._deadline is None:
            self._deadline = self.loop.call_later(_REQUEST_TIME, self.transport.abort)

    def _unwatch(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None


class _Guard:
    """Rejects requests for other hosts or from other pages (DNS rebinding), and adds headers.

    Responses by Starlette itself get the headers too.
    """

    def __init__(self, app: ASGIApp, port: int) -> None:
        self._app = app
        self._hosts = frozenset(f"{name}:{port}" for name in (LOOPBACK, "localhost"))
        self._origins = frozenset(f"http://{host}" for host in self._hosts)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        async def secured(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in _HEADERS.items():
                    headers.setdefault(name, value)
            await send(message)

        await self._answering(Request(scope))(scope, receive, secured)

    def _answering(self, request: Request) -> ASGIApp:
        if request.headers.getlist("host") not in ([host] for host in self._hosts):
            return _refused("host")
        if not set(request.headers.getlist("origin")) <= self._origins:
            return _refused("origin")
        return self._app


def _once(request: Request) -> Mapping[str, str]:
    pairs = request.query_params.multi_items()
    if len({name for name, _ in pairs}) < len(pairs):
        raise ParameterError("Invalid settings: one is stated twice. Must state each setting once.")
    return dict(pairs)


def _not_found() -> Response:
    return PlainTextResponse("not found\n", status_code=404)


def _refused(quantity: str) -> Response:
    return PlainTextResponse(f"Invalid {quantity}.\n", status_code=403)


def render(motions: Sequence[ExploredMotion], structures: Sequence[Structure]) -> tuple[str, str]:
    """Return the page and its Content-Security-Policy; the page only calls its own server.

    Parameters
    ----------
    motions : sequence of ExploredMotion
        Records to choose from.
    structures : sequence of Structure
        Structures to choose from; the first is shown.
    """
    records = [_record(motion) for motion in motions]
    facts = {"records": records, "structures": [_structure(structure) for structure in structures]}
    parts = ("settings", "main")
    return render_page(Path(__file__).parent, parts, connect="'self'", facts=facts)


def _record(motion: ExploredMotion) -> dict[str, Any]:
    record = motion.record
    place = "/".join(part for part in (record.station, record.component) if part)
    return {
        "id": record.record_id,
        "title": ", ".join(part for part in (record.event, place) if part),
        "duration": record.duration,
        "vertical": motion.has_vertical,
        "both": motion.in_both,
    }


def _structure(structure: Structure) -> dict[str, Any]:
    sliders = kind_of(structure).sliders(structure)
    return {"name": structure.name, "kind": structure.kind, **sliders}
