"""The twin's end of a ``stream:`` camera: a Unix socket to which one node at a time may connect.

Frames go out; what the node tells its camera comes in.
"""

from __future__ import annotations

import contextlib
import select
import socket
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from rhot_app.errors import SimulatorError
from rhot_node.capture.stream import StreamHeader, pack_header, take_settings
from rhot_node.config import CameraSettings
from rhot_node.errors import CameraError

_SEND_TIMEOUT_S = 0.25  # a node that takes no bytes for so long is stuck; it may connect again
_BUFFER_BYTES = 1 << 20


class FrameSocket:
    """Listens at `path`; frames go to whichever node connected last and are lost while there is none."""

    def __init__(self, path: Path) -> None:
        """Raises SimulatorError when the socket cannot be made."""
        self._path = path
        self._peer: socket.socket | None = None
        self._received = bytearray()
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            path.unlink(missing_ok=True)
            self._listener.bind(str(path))
        except OSError as exc:
            raise SimulatorError(f"{path}: no socket for frames can be made there ({exc}).") from exc
        self._listener.setblocking(False)
        self._listener.listen(4)

    def hear(self) -> CameraSettings | None:
        """Let in a node that waits, and return what a node has told its camera since the last call; None: nothing."""
        self._accept()
        told = None
        if self._peer is not None:
            try:
                if select.select([self._peer], [], [], 0.0)[0]:
                    self._received += self._peer.recv(_BUFFER_BYTES)
                while (settings := take_settings(self._received)) is not None:
                    told = settings
            except (OSError, CameraError):
                self._drop()
        return told

    def send(self, header: StreamHeader, frame: NDArray[Any]) -> bool:
        """Send one packed I420 frame to the node that `hear` has let in; False when there is none to take it."""
        if self._peer is None:
            return False
        try:
            self._peer.sendall(pack_header(header))
            self._peer.sendall(frame.data)
        except OSError:
            self._drop()
            return False
        return True

    def _accept(self) -> None:
        """A new connection replaces the old one: the node has come back."""
        with contextlib.suppress(BlockingIOError):
            while True:
                peer, _ = self._listener.accept()
                self._drop()
                peer.settimeout(_SEND_TIMEOUT_S)
                peer.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _BUFFER_BYTES)
                self._peer = peer

    def _drop(self) -> None:
        if self._peer is not None:
            self._peer.close()
            self._peer = None
        self._received.clear()

    def close(self) -> None:
        """Close and remove the socket. May be called twice."""
        self._drop()
        self._listener.close()
        with contextlib.suppress(OSError):
            self._path.unlink()
