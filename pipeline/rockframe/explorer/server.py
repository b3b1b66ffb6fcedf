"""The server of the page: this machine only, behind a token that nobody can guess."""

from __future__ import annotations

import secrets
import socket
from collections.abc import Mapping, Sequence
from typing import Final

import uvicorn
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import JSONResponse, PlainTextResponse, Response
from starlette.routing import Route
from starlette.types import ASGIApp, Receive, Scope, Send

from rockframe.errors import ParameterError
from rockframe.explorer.answer import Shaking, answer
from rockframe.explorer.page import render
from rockframe.explorer.settings import read_settings
from rockframe.frame import RockingFrame

#: The only address it listens at.
LOOPBACK: Final = "127.0.0.1"
#: Ways in which an answer can be had.
_FORMS: Final = ("response", "history.csv")
#: Of every answer: nothing is kept, guessed at, framed or told on.
_HEADERS: Final = {
    "Cache-Control": "no-store",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}


def application(
    shakings: Sequence[Shaking], frames: Sequence[RockingFrame], token: str, port: int
) -> ASGIApp:
    """Return what answers the page.

    Parameters
    ----------
    shakings : sequence of Shaking
        Records to choose.
    frames : sequence of RockingFrame
        Structures to begin with.
    token : str
        First part of every path; what lacks it is not found.
    port : int
        Where it listens: what is asked of another host is refused.
    """
    page, rules = render(shakings, frames)
    held = {shaking.record.record_id: shaking for shaking in shakings}

    def known(request: Request) -> bool:
        return secrets.compare_digest(request.path_params["token"].encode(), token.encode())

    async def show(request: Request) -> Response:
        if not known(request):
            return _not_found()
        headers = {**_HEADERS, "Content-Security-Policy": rules}
        return Response(page, media_type="text/html", headers=headers)

    async def compute(request: Request) -> Response:
        if not known(request) or request.path_params["form"] not in _FORMS:
            return _not_found()
        try:
            found = answer(held, read_settings(_once(request)))
        except ParameterError as error:
            return JSONResponse({"error": str(error)}, status_code=400, headers=_HEADERS)
        if request.path_params["form"] == "history.csv":
            return Response(found.table(), media_type="text/csv", headers=_HEADERS)
        return Response(found.packed(), media_type="application/octet-stream", headers=_HEADERS)

    routes = [Route("/{token}/", show), Route("/{token}/{form:path}", compute)]
    return _Guard(Starlette(routes=routes), port)


def configured(app: ASGIApp) -> uvicorn.Config:
    """Return how the server runs: it says nothing of its own, and stops within a second."""
    return uvicorn.Config(
        app,
        log_level="error",
        access_log=False,
        lifespan="off",
        server_header=False,
        timeout_graceful_shutdown=1,
        ws="none",
    )


def serve(app: ASGIApp, listening: socket.socket) -> None:
    """Answer until the process is interrupted.

    Raises
    ------
    KeyboardInterrupt
        When it is.
    """
    uvicorn.Server(configured(app)).run(sockets=[listening])


class _Guard:
    """Refuses what is asked of another host or by another page: names can be made to point here."""

    def __init__(self, app: ASGIApp, port: int) -> None:
        self._app = app
        self._hosts = frozenset(f"{name}:{port}" for name in (LOOPBACK, "localhost"))
        self._origins = frozenset(f"http://{host}" for host in self._hosts)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "http":
            request = Request(scope)
            origins = request.headers.getlist("origin")
            if request.headers.getlist("host") not in ([host] for host in self._hosts):
                await _refused("host")(scope, receive, send)
                return
            if not set(origins) <= self._origins:
                await _refused("origin")(scope, receive, send)
                return
        await self._app(scope, receive, send)


def _once(request: Request) -> Mapping[str, str]:
    pairs = request.query_params.multi_items()
    if len({name for name, _ in pairs}) < len(pairs):
        raise ParameterError("Invalid settings: one is stated twice. Must state each setting once.")
    return dict(pairs)


def _not_found() -> Response:
    return PlainTextResponse("not found\n", status_code=404, headers=_HEADERS)


def _refused(what: str) -> Response:
    return PlainTextResponse(f"Invalid {what}.\n", status_code=403, headers=_HEADERS)
