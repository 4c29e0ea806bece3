"""The live twin's control door: a ZeroMQ REP socket in the twin's directory, served by a thread of its own."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import zmq

from rhot_app.errors import RhotError, SimulatorError
from rhot_app.simulator.nodes.twin_requests import SERVER_NAME, Request, decode_request, refusal, server_address
from rhot_node.errors import NodeError

Perform = Callable[[Request], dict[str, Any]]

_REQUEST_MAX = 1 << 16
_POLL_MS = 200


class TwinServer:
    """Answers requests with what `perform` returns, in a thread, so that building a show never holds up the cameras."""

    def __init__(self, directory: Path, perform: Perform) -> None:
        """Open the door; raises SimulatorError when it cannot be opened there."""
        self._path = directory / SERVER_NAME
        self._perform = perform
        self._context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        self._socket = self._context.socket(zmq.REP)
        self._socket.linger = 0
        self._socket.maxmsgsize = _REQUEST_MAX
        try:
            self._path.unlink(missing_ok=True)
            self._socket.bind(server_address(directory))
        except (zmq.ZMQError, OSError) as exc:
            self._context.destroy(0)
            raise SimulatorError(f"{self._path}: the twin's door cannot be opened there ({exc}).") from exc
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, name="twin door", daemon=True)

    def start(self) -> None:
        """Serve from now on."""
        self._thread.start()

    def step(self, timeout_ms: int) -> bool:
        """Answer one request; False when none came in time."""
        if not self._socket.poll(timeout_ms):
            return False
        self._socket.send(msgspec.json.encode(self._answer(self._socket.recv())))
        return True

    def close(self) -> None:
        """Close and remove the door. May be called twice."""
        self._ending.set()
        if self._thread.is_alive():
            self._thread.join()
        self._context.destroy(0)
        with contextlib.suppress(OSError):
            self._path.unlink()

    def _run(self) -> None:
        while not self._ending.is_set():
            self.step(_POLL_MS)

    def _answer(self, data: bytes) -> dict[str, Any]:
        try:
            return {"ok": True, **self._perform(decode_request(data))}
        except msgspec.DecodeError as exc:
            return refusal(f"the simulated rig cannot do that: {exc}")
        except (RhotError, NodeError) as exc:
            return refusal(str(exc))
