"""A WebSocket server in a thread of its own, which only ever sends. Each client has a short queue: who reads too slowly
misses messages, who never reads is let go, and who says anything is turned away."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import ipaddress
import logging
import socket
import ssl
import threading
from collections import deque
from collections.abc import Callable
from typing import Final
from urllib.parse import SplitResult, urlsplit

from websockets.asyncio.server import ServerConnection, serve
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from rhot_app.errors import OutputError
from rhot_node.threads import FOREIGN, OneShotThread

CLIENTS_MAX: Final = 32
CLIENT_QUEUE: Final = 4  # messages that wait for one client
WRITE_BUFFER: Final = 65536  # bytes on their way to one client
SILENT_S: Final = 10.0  # a client that answers no ping and takes nothing for so long is let go
OPEN_S: Final = 10.0
READ_ONLY: Final = 1008  # close code: policy violation

HttpAnswer = Callable[[Request], Response | None]

_log = logging.getLogger("rhot_app.outputs.web_server.library")
_log.setLevel(logging.CRITICAL)  # what strangers send at a port is no news


class _Client:
    """One connection, and what waits for it."""

    def __init__(self) -> None:
        self.queue: deque[bytes] = deque(maxlen=CLIENT_QUEUE)
        self.wake = asyncio.Event()


class WebServer:
    """Listens from `open` to `close`; `broadcast` may be called in between, by any thread."""

    def __init__(self, host: str, port: int, answer: HttpAnswer,
                 tls: Callable[[], ssl.SSLContext] | None = None) -> None:
        """`answer`: the HTTP answer to a request; None lets it become a WebSocket. It must not block. `tls`: makes what
        encrypts the connections; may raise OutputError."""
        self._host, self._port, self._answer, self._tls = host, port, answer, tls
        self._clients: set[_Client] = set()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._ending: asyncio.Event | None = None
        self._opened = threading.Event()
        self._failure: OutputError | None = None
        self._task: OneShotThread | None = None

    @property
    def clients(self) -> int:
        """How many are connected."""
        return len(self._clients)

    def open(self) -> None:
        """Listen; raises OutputError when the port cannot be had."""
        self._opened.clear()
        self._failure = None
        self._task = OneShotThread(f"serves port {self._port}", self._run)
        if not self._opened.wait(OPEN_S):
            raise OutputError(f"port {self._port} of {self._host} could not be opened within {OPEN_S:g} s.")
        if self._failure is not None:
            raise self._failure

    def require_running(self) -> None:
        """Raises OutputError when the server has ended by itself."""
        if self._task is not None and not self._task.running:
            raise OutputError(f"the server on port {self._port} has ended ({self._task.failure or 'unasked'}).")

    def broadcast(self, message: bytes) -> None:
        """Send a text message, UTF-8, to whoever is connected. Never blocks."""
        loop = self._loop
        if loop is not None and self._clients:
            with contextlib.suppress(RuntimeError):  # it has just ended
                loop.call_soon_threadsafe(self._spread, message)

    def close(self) -> None:
        """Close all connections and the port. May be called twice."""
        loop, ending, self._loop = self._loop, self._ending, None
        if loop is not None and ending is not None:
            with contextlib.suppress(RuntimeError):
                loop.call_soon_threadsafe(ending.set)
        if self._task is not None:
            self._task.join(OPEN_S)
            self._task = None

    def _run(self) -> None:
        try:
            asyncio.run(self._serve())
        except OutputError as exc:
            self._failure = exc
        except OSError as exc:
            self._failure = OutputError(self._why(exc))
        except FOREIGN as exc:
            self._failure = OutputError(f"port {self._port} cannot be served ({type(exc).__name__}: {exc}).")
            raise
        finally:
            self._clients = set()
            self._opened.set()

    async def _serve(self) -> None:
        self._ending = asyncio.Event()
        context = None if self._tls is None else self._tls()
        async with serve(self._handle, self._host, self._port, ssl=context, process_request=self._process,
                         compression=None, max_size=1024, ping_interval=SILENT_S, ping_timeout=SILENT_S,
                         close_timeout=1.0, write_limit=WRITE_BUFFER, server_header=None, logger=_log):
            self._loop = asyncio.get_running_loop()
            self._opened.set()
            await self._ending.wait()

    def _process(self, _connection: ServerConnection, request: Request) -> Response | None:
        if getattr(request, "method", "GET") != "GET":  # older versions of the library refuse others themselves
            return text_answer(405, "Nothing can be written here.")
        if not self._asked_by_its_name(request) or not _of_this_origin(request):
            return text_answer(403, "This server is spoken to by its own address, and by its own pages only.")
        answer = self._answer(request)
        if answer is None and len(self._clients) >= CLIENTS_MAX:
            return text_answer(503, "There are too many clients.")
        return answer

    def _asked_by_its_name(self, request: Request) -> bool:
        """Whether Host is an address or a name of this computer: a name that somebody else may point here is not."""
        hosts = request.headers.get_all("Host")
        name = (_split(f"//{hosts[0]}").hostname or "") if len(hosts) == 1 else ""
        here = socket.gethostname().lower()
        if name in ("localhost", self._host.lower(), here, f"{here}.local"):
            return True
        with contextlib.suppress(ValueError):
            ipaddress.ip_address(name)
            return True
        return False

    async def _handle(self, connection: ServerConnection) -> None:
        client = _Client()
        self._clients.add(client)
        sending = asyncio.create_task(_send_all(connection, client))
        try:
            await connection.recv()  # a client has nothing to say
            await connection.close(READ_ONLY, "this stream is read only")
        except ConnectionClosed:
            pass
        finally:
            self._clients.discard(client)
            sending.cancel()

    def _spread(self, message: bytes) -> None:
        for client in self._clients:
            client.queue.append(message)
            client.wake.set()

    def _why(self, exc: OSError) -> str:
        if exc.errno == errno.EADDRINUSE:
            return f"port {self._port} of {self._host} is in use by another program; choose another one."
        if exc.errno in (errno.EACCES, errno.EPERM):
            return f"port {self._port} of {self._host} may not be opened by this user; choose one above 1023."
        return (f"port {self._port} of {self._host!r} cannot be opened ({exc.strerror or exc}); is that an address of "
                "this computer?")


def _of_this_origin(request: Request) -> bool:
    """Whether no page of another server asks: a browser says in Origin which one does, a program says nothing."""
    hosts, origins = request.headers.get_all("Host"), request.headers.get_all("Origin")
    return all(_split(origin).netloc.lower() == hosts[0].lower() for origin in origins)


def _split(url: str) -> SplitResult:
    try:
        return urlsplit(url)
    except ValueError:  # brackets that do not match
        return SplitResult("", "", "", "", "")


async def _send_all(connection: ServerConnection, client: _Client) -> None:
    """Send what waits, as fast as the client takes it; let go of one that takes nothing."""
    with contextlib.suppress(ConnectionClosed):
        while True:
            await client.wake.wait()
            client.wake.clear()
            while client.queue:
                try:
                    async with asyncio.timeout(SILENT_S):
                        await connection.send(client.queue.popleft(), text=True)
                except TimeoutError:
                    connection.transport.abort()
                    return


def text_answer(status: int, text: str) -> Response:
    """A short HTTP answer for people."""
    return http_answer(status, text.encode() + b"\n", "text/plain; charset=utf-8")


def http_answer(status: int, body: bytes, kind: str, headers: tuple[tuple[str, str], ...] = ()) -> Response:
    """An HTTP answer with its length, which nobody keeps or takes for anything else."""
    reasons = {200: "OK", 403: "Forbidden", 404: "Not Found", 405: "Method Not Allowed",
               426: "Upgrade Required", 503: "Service Unavailable"}
    always = (("Content-Type", kind), ("Content-Length", str(len(body))), ("Cache-Control", "no-store"),
              ("X-Content-Type-Options", "nosniff"), ("Connection", "close"))
    return Response(status, reasons[status], Headers([*always, *headers]), body)
