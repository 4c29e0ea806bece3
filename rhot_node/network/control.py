"""The node's ZeroMQ sockets and the thread that serves them: requests (REP), the preview stream (PUB), and the
reception of strangers (REP). Unless the node is open, the first two are encrypted and stand behind a `Gate`.

A preview is two message parts: a JSON header (`node_id`, `number`, `t_node_ns`, `width` and `height` of the camera,
`preview_width`, `preview_height`) and a JPEG. It is encoded only while somebody is subscribed.
"""

from __future__ import annotations

import contextlib
import logging
import os
import time

import msgspec
import zmq

from rhot_node.config import NodeSettings
from rhot_node.errors import NAME_LIMIT, LinkError, printable
from rhot_node.files import MIB
from rhot_node.keys import NodeTrust, serve_with
from rhot_node.network.context import Context
from rhot_node.network.pairing import REQUEST_MAX as STRANGERS_REQUEST_MAX
from rhot_node.network.pairing import Reception
from rhot_node.network.pictures import PictureBox, encode_preview
from rhot_node.network.requests import Responder
from rhot_node.terminal import LogLimit
from rhot_node.threads import Worker

log = logging.getLogger(__name__)

REQUEST_MAX = MIB  # bytes; the longest honest request is a marker set
PREVIEWS_QUEUED = 2  # a slow viewer misses pictures instead of piling them up
NOT_PAIRED = b'{"ok": false, "error": "this master is not paired with the node any more."}'
_REBIND_S = 0.02
_HANG_S = 5.0  # a request for a still waits two seconds for a frame


class ControlServer:
    """Serves one `Responder`, one `Reception` and one `PictureBox`. `step` serves what has come; `start` runs it in a
    thread."""

    def __init__(self, settings: NodeSettings, trust: NodeTrust | None) -> None:
        """Open the ports; raises LinkError. Requests wait until `start` says who answers them. `trust` None: the node
        is open, nothing is encrypted and whoever reaches a port is answered."""
        self._node_id = settings.node_id
        self._address = settings.bind_address
        self._context = Context()
        self._wake = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self._worker: Worker | None = None
        self._subscribed = 0
        self._closed = False
        self.pictures = PictureBox(settings.preview_hz, self.wake)
        self._gate = None if trust is None else Gate(self._context, trust)
        try:
            self._strangers, self.pairing_port = self._open(zmq.REP, settings.pairing_port, "pairing_port", None)
            self._open_guarded(settings.control_port, settings.preview_port)
        except LinkError:
            self.close()
            raise

    @property
    def refused(self) -> int:
        """Encrypted connections that strangers were not let in by."""
        return 0 if self._gate is None else self._gate.refused

    def wake(self) -> None:
        """Have the thread look for a preview, or for its end. Any thread may call it."""
        with contextlib.suppress(OSError):
            os.eventfd_write(self._wake, 1)

    def start(self, responder: Responder, reception: Reception) -> None:
        """Serve both in a thread of its own until `close`."""
        self._worker = Worker("answers masters' requests", lambda: self.step(responder, reception, 1.0),
                              hang_s=_HANG_S)
        self._worker.start()

    def close(self) -> None:
        """End the thread and close the ports. May be called twice."""
        if self._worker is not None:
            self._worker.ending.set()
            self.wake()
            self._worker.close()
        if not self._closed:
            self._closed = True
            self._context.destroy(linger=0)
            os.close(self._wake)

    def step(self, responder: Responder, reception: Reception, timeout_s: float) -> None:
        """Wait up to `timeout_s`, then let masters in, answer requests, note subscriptions, publish a preview."""
        ready = dict(self._poller.poll(round(timeout_s * 1000)))
        if self._wake in ready:
            with contextlib.suppress(OSError):
                os.eventfd_read(self._wake)
        if self._gate is not None and self._gate.trust.refresh():
            self._reopen(responder, self._gate.trust)
            return
        if self._gate is not None and self._gate.socket in ready:
            self._gate.step()
        if self._requests in ready:
            self._answer(responder)
        if self._strangers in ready:
            self._strangers.send(reception.answer(self._strangers.recv_multipart()[0]))
        if self._previews in ready:
            self._take_subscription(self._previews.recv())
        self._publish_preview()
        reception.expire(time.monotonic())

    def _answer(self, responder: Responder) -> None:
        frames = self._requests.recv_multipart(copy=False)
        master = master_of(frames[0])
        if self._gate is not None and not self._gate.trust.admits(master):  # its connection is older than the change
            self._requests.send(NOT_PAIRED)
            return
        self._requests.send_multipart(responder.answer([frame.bytes for frame in frames], master))

    def _publish_preview(self) -> None:
        picture = self.pictures.take_preview()
        if picture is not None and self._subscribed:
            preview = encode_preview(picture)
            width, height = picture.image.size
            header = {"node_id": self._node_id, "number": picture.number, "t_node_ns": picture.t_node_ns,
                      "width": width, "height": height, "preview_width": preview.width,
                      "preview_height": preview.height}
            self._previews.send_multipart([msgspec.json.encode(header), preview.data])

    def _reopen(self, responder: Responder, trust: NodeTrust) -> None:
        """The keys have changed: end every connection that the old ones let in, and begin anew on the same ports."""
        log.warning("the keys have changed: all connections are closed, %d masters are paired", len(trust.masters))
        responder.revoke(trust.admits)
        self._requests.close()
        self._previews.close()
        self._subscribed = 0
        self.pictures.wanted = False
        while self._worker is None or not self._worker.ending.is_set():
            try:
                self._open_guarded(self.control_port, self.preview_port)
                return
            except LinkError as exc:  # libzmq frees a closed port a moment later
                log.debug("%s", exc)
                time.sleep(_REBIND_S)

    def _take_subscription(self, message: bytes) -> None:
        if message[:1] == b"\x01":
            self._subscribed += 1
        elif message[:1] == b"\x00":
            self._subscribed = max(0, self._subscribed - 1)
        self.pictures.wanted = self._subscribed > 0

    def _open_guarded(self, control_port: int, preview_port: int) -> None:
        """Open the ports of masters. Raises LinkError; then none of the two is open."""
        requests, self.control_port = self._open(zmq.REP, control_port, "control_port", self._gate)
        try:
            self._previews, self.preview_port = self._open(zmq.XPUB, preview_port, "preview_port", self._gate)
        except LinkError:
            requests.close()
            raise
        self._requests = requests
        self._poller = zmq.Poller()
        sources = [self._requests, self._previews, self._strangers, self._wake]
        for source in sources if self._gate is None else [*sources, self._gate.socket]:
            self._poller.register(source, zmq.POLLIN)

    def _open(self, kind: int, port: int, setting: str, gate: Gate | None) -> tuple[zmq.Socket[bytes], int]:
        sock = self._context.socket(kind)  # options hold for connections of a port that is opened after they were set
        sock.maxmsgsize = STRANGERS_REQUEST_MAX if setting == "pairing_port" else REQUEST_MAX
        sock.sndhwm = PREVIEWS_QUEUED
        try:
            if gate is not None:
                gate.guard(sock)
            sock.bind(f"tcp://{self._address}:{port or '*'}")
        except zmq.ZMQError as exc:
            sock.close()
            raise LinkError(f"{setting}: TCP port {port} on {self._address} cannot be opened ({exc.strerror}). Stop "
                            f"the program that uses it, or choose another {setting} in the settings.") from exc
        endpoint = sock.getsockopt_string(zmq.LAST_ENDPOINT)
        return sock, int(endpoint.rsplit(":", 1)[1])


# -- authentication of encrypted connections ---------------------------------------------------------------------------

_ENDPOINT = "inproc://zeromq.zap.01"
_DOMAIN = b"rhot-node"
_VERSION = b"1.0"


class Gate:
    """The ZAP handler of one context. `step` belongs to the thread that serves the guarded sockets."""

    def __init__(self, context: Context, trust: NodeTrust) -> None:
        """Must be there before a socket is guarded."""
        self.trust = trust
        self.refused = 0  # handshakes of strangers
        self._limit = LogLimit()
        self.socket = context.socket(zmq.REP)
        self.socket.bind(_ENDPOINT)

    def guard(self, sock: zmq.Socket[bytes]) -> None:
        """Encrypt what goes through `sock`, which is not bound yet, and let only masters in."""
        serve_with(sock, self.trust.own)
        sock.setsockopt(zmq.ZAP_DOMAIN, _DOMAIN)
        sock.setsockopt(zmq.ZAP_ENFORCE_DOMAIN, 1)

    def step(self) -> None:
        """Decide about one handshake that waits."""
        _, request_id, domain, address, _, mechanism, *credentials = self.socket.recv_multipart()
        key = credentials[0].hex() if mechanism == b"CURVE" and credentials else ""
        admitted = domain == _DOMAIN and self.trust.admits(key)
        if not admitted:
            self.refused += 1
            self._tell(printable(address.decode(errors="replace"), NAME_LIMIT), key)
        status = (b"200", b"OK", key.encode()) if admitted else (b"400", b"not paired with this node", b"")
        self.socket.send_multipart([_VERSION, request_id, *status, b""])

    def _tell(self, address: str, key: str) -> None:
        count = self._limit.due(address, time.monotonic())
        if count:
            again = "" if count == 1 else f", {count} times since this was last said"
            log.info("a stranger at %s was not let in, key %s%s", address, key, again)


def master_of(frame: zmq.Frame) -> str:
    """The public key of the master whose connection a message came through; empty without encryption."""
    try:
        return str(frame.get("User-Id"))
    except zmq.ZMQError:
        return ""
