"""JSON over WebSocket: programs connect to this port and get every state as a text message."""

from __future__ import annotations

from websockets.http11 import Request, Response

from rhot_app.outputs.joints import Sample, json_message
from rhot_app.outputs.spec import host_and_port
from rhot_app.outputs.web_server import WebServer, text_answer
from rhot_app.project import OutputSettings


class WebSocketSink:
    """A server that anybody who reaches its port may listen to."""

    def __init__(self, settings: OutputSettings) -> None:
        """Raises OutputError when the target is not [HOST:]PORT. Nothing is opened yet."""
        host, port = host_and_port(settings, "127.0.0.1")
        self.url = f"ws://{f'[{host}]' if ':' in host else host}:{port}/"
        self._server = WebServer(host, port, _answer)

    @property
    def clients(self) -> int:
        """How many are connected."""
        return self._server.clients

    def open(self) -> None:
        """Listen; raises OutputError when the port cannot be had."""
        self._server.open()

    def write(self, sample: Sample) -> None:
        """Send one state to whoever is connected."""
        self._server.require_running()
        if self._server.clients:
            self._server.broadcast(json_message(sample))

    def close(self) -> None:
        """Close all connections and the port."""
        self._server.close()


def _answer(request: Request) -> Response | None:
    if "websocket" in request.headers.get("Upgrade", "").lower():
        return None
    return text_answer(426, "This port speaks WebSocket: connect to it with a WebSocket client.")
