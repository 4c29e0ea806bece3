"""The node's ZeroMQ sockets and the thread that serves them: requests (REP) and the preview stream (PUB).

A preview is two message parts: a JSON header (`node_id`, `number`, `t_node_ns`, `width` and `height` of the camera,
`preview_width`, `preview_height`) and a JPEG. It is encoded only while somebody is subscribed.
"""

from __future__ import annotations

import contextlib
import os
import threading

import msgspec
import zmq

from rhot_node.config import NodeSettings
from rhot_node.errors import LinkError
from rhot_node.pictures import PictureBox, encode_preview
from rhot_node.requests import Responder

REQUEST_MAX = 1 << 20  # bytes; the longest honest request is a marker set
PREVIEWS_QUEUED = 2  # a slow viewer misses pictures instead of piling them up


def configure_socket(sock: zmq.Socket[bytes]) -> None:
    """What every socket of the node has in common, keys included once there are any."""
    sock.linger = 0
    sock.maxmsgsize = REQUEST_MAX


class ControlServer:
    """Serves one `Responder` and one `PictureBox`. `step` serves what has come; `start` runs it in a thread."""

    def __init__(self, settings: NodeSettings) -> None:
        """Open the ports; raises LinkError. Requests wait until `start` says who answers them."""
        self._node_id = settings.node_id
        self._context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        self._wake = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self._ending = threading.Event()
        self._thread: threading.Thread | None = None
        self._subscribed = 0
        self._closed = False
        self.pictures = PictureBox(settings.preview_hz, self.wake)
        try:
            self._requests, self.control_port = self._open(zmq.REP, settings.bind_address, settings.control_port,
                                                           "control_port")
            self._previews, self.preview_port = self._open(zmq.XPUB, settings.bind_address, settings.preview_port,
                                                           "preview_port")
        except LinkError:
            self.close()
            raise
        self._previews.sndhwm = PREVIEWS_QUEUED
        self._poller = zmq.Poller()
        for source in (self._requests, self._previews, self._wake):
            self._poller.register(source, zmq.POLLIN)

    def wake(self) -> None:
        """Have the thread look for a preview, or for its end. Any thread may call it."""
        with contextlib.suppress(OSError):
            os.eventfd_write(self._wake, 1)

    def start(self, responder: Responder) -> None:
        """Serve `responder` in a thread of its own until `close`."""
        self._thread = threading.Thread(target=self._run, args=(responder,), name="control", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread and close the ports. May be called twice."""
        self._ending.set()
        self.wake()
        if self._thread is not None:
            self._thread.join()
        if not self._closed:
            self._closed = True
            self._context.destroy(linger=0)
            os.close(self._wake)

    def step(self, responder: Responder, timeout_s: float) -> None:
        """Wait up to `timeout_s`, then answer one request, note subscriptions, publish a preview."""
        ready = dict(self._poller.poll(round(timeout_s * 1000)))
        if self._wake in ready:
            with contextlib.suppress(OSError):
                os.eventfd_read(self._wake)
        if self._requests in ready:
            self._requests.send_multipart(responder.answer(self._requests.recv_multipart()))
        if self._previews in ready:
            self._take_subscription(self._previews.recv())
        picture = self.pictures.take_preview()
        if picture is not None and self._subscribed:
            preview = encode_preview(picture)
            width, height = picture.image.size
            header = {"node_id": self._node_id, "number": picture.number, "t_node_ns": picture.t_node_ns,
                      "width": width, "height": height, "preview_width": preview.width,
                      "preview_height": preview.height}
            self._previews.send_multipart([msgspec.json.encode(header), preview.data])

    def _run(self, responder: Responder) -> None:
        while not self._ending.is_set():
            self.step(responder, 1.0)

    def _take_subscription(self, message: bytes) -> None:
        if message[:1] == b"\x01":
            self._subscribed += 1
        elif message[:1] == b"\x00":
            self._subscribed = max(0, self._subscribed - 1)
        self.pictures.wanted = self._subscribed > 0

    def _open(self, kind: int, address: str, port: int, setting: str) -> tuple[zmq.Socket[bytes], int]:
        sock = self._context.socket(kind)
        configure_socket(sock)
        try:
            sock.bind(f"tcp://{address}:{port or '*'}")
        except zmq.ZMQError as exc:
            raise LinkError(f"{setting}: TCP port {port} on {address} cannot be opened ({exc.strerror}). Stop the "
                            f"program that uses it, or choose another {setting} in the settings.") from exc
        endpoint = sock.getsockopt_string(zmq.LAST_ENDPOINT)
        return sock, int(endpoint.rsplit(":", 1)[1])
