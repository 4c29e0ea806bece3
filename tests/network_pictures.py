"""Programs that send pictures on loopback: motion JPEG by HTTP, a page instead of pictures, and silence."""

from __future__ import annotations

import contextlib
import socket
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import cv2
import numpy as np


class Sender(BaseHTTPRequestHandler):
    """``/video``: motion JPEG, 30 pictures a second until the server's `ending` is set; anything else: a page."""

    def log_message(self, *_args: object) -> None:
        """Nobody reads it."""

    def do_GET(self) -> None:
        self.send_response(200)
        if not self.path.startswith("/video"):
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(b"<html>a page about the pictures</html>")
            return
        self.send_header("Content-Type", "multipart/x-mixed-replace; boundary=frame")
        self.end_headers()
        ending: threading.Event = self.server.ending  # type: ignore[attr-defined]
        with contextlib.suppress(OSError):
            for number in range(100_000):
                picture = np.full((48, 64, 3), number % 256, np.uint8)
                data = cv2.imencode(".jpg", picture)[1].tobytes()
                self.wfile.write(b"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n" % len(data)
                                 + data + b"\r\n")
                if ending.wait(1.0 / 30.0):
                    return


@contextlib.contextmanager
def sending(port: int = 0) -> Iterator[tuple[str, threading.Event]]:
    """The server's address, and what ends its pictures. `port` 0: any free one."""
    with ThreadingHTTPServer(("127.0.0.1", port), Sender) as server:
        server.daemon_threads = True
        server.ending = threading.Event()  # type: ignore[attr-defined]
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02})
        thread.start()
        try:
            yield f"http://127.0.0.1:{server.server_port}", server.ending  # type: ignore[attr-defined]
        finally:
            server.ending.set()  # type: ignore[attr-defined]
            server.shutdown()
            thread.join()


@contextlib.contextmanager
def silent() -> Iterator[str]:
    """The address of a server that accepts connections and says nothing, ``HOST:PORT``."""
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        listener.listen()
        yield f"127.0.0.1:{listener.getsockname()[1]}"


def nobody() -> str:
    """``HOST:PORT`` where nobody listens."""
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return f"127.0.0.1:{listener.getsockname()[1]}"
