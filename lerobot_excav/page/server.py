"""The server of the page: its files, and one socket to every page that is open."""

import asyncio
import contextlib
import itertools
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import uvicorn
from starlette.applications import Starlette
from starlette.requests import HTTPConnection, Request
from starlette.responses import FileResponse, PlainTextResponse, RedirectResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from lerobot_excav.errors import DeviceError
from lerobot_excav.page.access import Access
from lerobot_excav.page.drivers_seat import DriversSeat
from lerobot_excav.page.feed import Feed
from lerobot_excav.page.wishes import (
    MOST_BYTES,
    LeaveMessage,
    ResponseMessage,
    SeenMessage,
    SticksMessage,
    TakeMessage,
    Wish,
    read_message,
)

STATIC = Path(__file__).parent / "static"

_START_LIMIT_S = 15.0
_POLICY = "default-src 'self'; img-src 'self' blob: data:; connect-src 'self' ws: wss:"
_HEADERS = {"Content-Security-Policy": _POLICY, "Referrer-Policy": "no-referrer", "Cache-Control": "no-store"}
_REFUSED, _BAD = 4401, 4400  # closing codes of sockets


class PageServer:
    """Serves the page until its block ends, in a thread of its own.

    Args:
        access: Where it listens, and who may come in.
        feed: What the pages show.
        seat: Who drives.
    """

    def __init__(self, access: Access, feed: Feed, seat: DriversSeat) -> None:
        self.access, self._feed, self._seat = access, feed, seat
        self._pages = itertools.count()
        self.open_pages: set[int] = set()
        routes = [Route("/", self._index), Route("/{name}", self._file), WebSocketRoute("/live", self._live)]
        self.app = Starlette(routes=routes)

    @contextmanager
    def running(self) -> Iterator["PageServer"]:
        """Serve while the block runs.

        Raises:
            DeviceError: The address or the port is taken or not ours.
        """
        config = uvicorn.Config(
            self.app, host=self.access.host, port=self.access.port, log_level="critical", ws="websockets-sansio",
            ws_max_size=MOST_BYTES, ws_max_queue=64, timeout_graceful_shutdown=1, lifespan="off",
        )  # fmt: skip
        server = uvicorn.Server(config)
        thread = threading.Thread(target=_serve, args=(server,), name="page", daemon=True)
        thread.start()
        deadline = time.monotonic() + _START_LIMIT_S
        while not server.started and thread.is_alive() and time.monotonic() < deadline:
            time.sleep(0.01)
        if not server.started:
            raise DeviceError(
                f"the page cannot be served at {self.access.host}:{self.access.port}: the port is taken, or the "
                "address is not of this machine; give another --port or --host"
            )
        try:
            yield self
        finally:
            server.should_exit = True
            thread.join(timeout=5.0)

    async def _index(self, request: Request) -> Response:
        if refusal := self._refusal(request):
            return refusal
        if "token" in request.query_params:  # keep it out of the history and of what others see on the screen
            response: Response = RedirectResponse("/", headers=_HEADERS)
            response.set_cookie(self.access.cookie, self.access.token, httponly=True, samesite="lax")
            return response
        return FileResponse(STATIC / "index.html", headers=_HEADERS)

    async def _file(self, request: Request) -> Response:
        if refusal := self._refusal(request):
            return refusal
        path = STATIC / request.path_params["name"]
        if path.parent != STATIC or not path.is_file():
            return PlainTextResponse("there is no such file", status_code=404)
        return FileResponse(path, headers=_HEADERS)

    def _refusal(self, connection: HTTPConnection) -> Response | None:
        if not self.access.is_for_us(connection.headers):
            return PlainTextResponse("this address is not the page's; open the one that the command printed", 403)
        if not self.access.knows_token(connection.query_params, connection.cookies):
            words = "the token is missing or old; open the address that the command printed, all of it"
            return PlainTextResponse(words, 401)
        return None

    async def _live(self, socket: WebSocket) -> None:
        is_ours = self.access.is_for_us(socket.headers) and "origin" in socket.headers
        if not (is_ours and self.access.knows_token(socket.query_params, socket.cookies)):
            await socket.close(_REFUSED)
            return
        await socket.accept()
        page = next(self._pages)
        self.open_pages.add(page)
        drawn = _Drawn()
        sending = asyncio.create_task(self._send(socket, page, drawn))
        try:
            await self._receive(socket, page, drawn)
        except (WebSocketDisconnect, RuntimeError):
            pass  # closed; a socket that closes while it is written to raises the latter
        finally:
            self._seat.leave(page)
            self.open_pages.discard(page)
            sending.cancel()
            with contextlib.suppress(asyncio.CancelledError, WebSocketDisconnect, RuntimeError):
                await sending

    async def _send(self, socket: WebSocket, page: int, drawn: "_Drawn") -> None:
        """Send the newest moment as soon as the page has drawn the one before the last."""
        number, pictures = 0, None
        while True:
            moment = await self._feed.newer_than(number)
            number = moment.number
            message = moment.message(with_pictures=moment.pictures is not pictures, **self._own(page))
            pictures = moment.pictures
            await socket.send_bytes(message)
            await drawn.wait(number - 1)

    def _own(self, page: int) -> dict[str, Any]:
        driver = self._seat.driver
        return {"driver": "nobody" if driver is None else "you" if driver == page else "another page"}

    async def _receive(self, socket: WebSocket, page: int, drawn: "_Drawn") -> None:
        while True:
            try:
                message = read_message(await socket.receive_text())
            except (ValueError, KeyError):  # no message of ours, or no text
                await socket.close(_BAD)
                return
            match message:
                case SticksMessage():
                    self._seat.report(page, message.axes, message.number, lost=message.lost)
                case SeenMessage():
                    drawn.note(message.number)
                    if message.delay_ms is not None:
                        self._seat.note_delay(page, message.delay_ms)
                case TakeMessage():
                    self._seat.take(page, force=message.force)
                case LeaveMessage():
                    self._seat.leave(page)
                case ResponseMessage():
                    self._seat.respond(page, message)
                case Wish():
                    self._seat.wish(page, message)


class _Drawn:
    """What a page says that it has drawn."""

    def __init__(self) -> None:
        self._number = 0
        self._news = asyncio.Event()

    def note(self, number: int) -> None:
        self._number = max(self._number, number)
        self._news.set()

    async def wait(self, number: int) -> None:
        """Wait until a moment, or a later one, is drawn: two are under way at most, and none waits in a buffer."""
        while self._number < number:
            self._news.clear()
            await self._news.wait()


def _serve(server: uvicorn.Server) -> None:
    with contextlib.suppress(SystemExit):  # the port is taken
        server.run()
