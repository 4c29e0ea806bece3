"""The search for edges along slices that the master asks for, in a thread of its own: it delays no marker.

A request is in force until the next one, or for `VALID_S`. Every frame is searched with the newest request; a frame
that comes while one is being searched is left out and counted.
"""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rhot_node.capture.camera import Frame
from rhot_node.clock import NodeClock
from rhot_node.detect.edges import Edges, find_edges, noise_of
from rhot_node.detect.foreground import foreground_map
from rhot_node.detect.image import YuvImage
from rhot_node.foreground_store import ForegroundStore, rgb_of
from rhot_node.network.session import Stream
from rhot_node.threads import Worker
from rhot_node.wire.codec import EDGES_FIT, FOREGROUND_FIT
from rhot_node.wire.edges import pack_edges
from rhot_node.wire.foreground_map import pack_map
from rhot_node.wire.messages import ForegroundPart, SliceEdges, Slices
from rhot_node.wire.slices import unpack_slices

VALID_S = 1.0
"""How long a request is in force: a hand has moved on by then."""

U32_MAX = 2**32 - 1
_NOISE_S = 1.0  # between two measurements of the image's noise


class EdgeSender(Protocol):
    """Where edges and foreground maps go; the UDP link or a fake."""

    def send(self, observations: SliceEdges | ForegroundPart, stream: Stream) -> bool:
        """Send them where the stream goes; False when they could not be sent."""
        ...


@dataclass(frozen=True, slots=True)
class _Order:
    """A whole request: `slices` (N, 5) as `find_edges` takes them."""

    session: int
    request: int
    size: tuple[int, int]
    map_step: int
    slices: NDArray[np.float64]
    until_s: float


class _Waiting:
    """A frame to be searched: its planes are copies, as the frame's own buffer is used again."""

    def __init__(self, frame: Frame, order: _Order, stream: Stream, sender: EdgeSender) -> None:
        image = frame.image
        self.image = YuvImage(image.y.copy(), image.u.copy(), image.v.copy())
        self.frame, self.order, self.stream, self.sender = frame, order, stream, sender


class SliceSearch:
    """`take` belongs to the link's thread, `offer` to the daemon's; `step` searches one frame, a thread does so after
    `prepare`."""

    def __init__(self, node_id: int, clock: NodeClock, foreground: ForegroundStore) -> None:
        self.searched = self.skipped = self.requests = self.sent = self.not_sent = 0
        self._node_id, self._clock, self._foreground = node_id, clock, foreground
        self._order: _Order | None = None
        self._parts: dict[int, Slices] = {}
        self._collected = (0, 0)  # session and request whose parts are being collected
        self._numbers: dict[type, int] = {}
        self._session = 0  # whose numbers these are
        self._noise, self._noise_due_s = 1.0, 0.0
        self._changed = threading.Condition()
        self._waiting: _Waiting | None = None
        self._busy = self._ending = False
        self._worker: Worker | None = None

    def prepare(self) -> None:
        """Compile, because slices may be asked for while frames come, and start the thread."""
        self.warm_up()
        self._worker = Worker("searches along slices", self.step, wait=self._await_frame)
        self._worker.start()

    def warm_up(self) -> None:
        """Have everything compiled that a search needs."""
        image = np.zeros((32, 32, 3), np.uint8)
        model = self._foreground.of_size(32, 32)
        find_edges(image, np.array([[16.0, 16.0, 1.0, 0.0, 4.0]]), model, noise_of(image))
        foreground_map(image, model, 4)

    def take(self, message: Slices, session: int) -> str:
        """Take a part of a request in, while `session` runs (0: none). Returns why it was dropped, or nothing."""
        if message.node_id != self._node_id:
            return "foreign_node"
        if not session or message.session != session:
            return "session"
        behind = (self._collected[1] - message.request) & U32_MAX
        if self._collected[0] == session and 0 < behind < 1 << 31:
            return "late"
        if self._collected != (session, message.request):
            self._collected, self._parts = (session, message.request), {}
        self._parts[message.part] = message
        if len(self._parts) < message.parts:
            return ""
        records = b"".join(self._parts[part].records for part in sorted(self._parts))
        slices = unpack_slices(records)
        if len(slices) != message.slice_count:
            return "count"
        self.requests += 1
        self._order = _Order(session, message.request, (message.width, message.height), message.map_step, slices,
                             time.monotonic() + VALID_S)
        return ""

    def offer(self, frame: Frame, stream: Stream, sender: EdgeSender) -> bool:
        """Have a frame searched if slices are asked for and nothing else is being searched; costs a copy of it. False
        when it was asked for and is not done."""
        order = self._order
        if (order is None or order.session != stream.session or time.monotonic() > order.until_s
                or order.size != frame.image.size):
            return True
        with self._changed:
            if self._busy or self._waiting is not None:
                self.skipped += 1
                return False
        waiting = _Waiting(frame, order, stream, sender)
        with self._changed:
            self._waiting = waiting
            self._changed.notify()
        return True

    def step(self) -> bool:
        """Search the frame that waits; False when there is none."""
        with self._changed:
            waiting, self._waiting = self._waiting, None
            self._busy = waiting is not None
        if waiting is None:
            return False
        try:
            self._search(waiting)
        finally:
            with self._changed:
                self._busy = False
        return True

    def count(self) -> dict[str, int]:
        """Counters, for the control channel."""
        return {"slice_requests": self.requests, "slice_frames": self.searched, "slice_frames_skipped": self.skipped,
                "edges_sent": self.sent, "edges_not_sent": self.not_sent}

    def close(self) -> None:
        """End the thread. May be called twice."""
        with self._changed:
            self._ending = True
            self._changed.notify()
        if self._worker is not None:
            self._worker.close()

    def _await_frame(self) -> None:
        with self._changed:
            while self._waiting is None and not self._ending:
                self._changed.wait()

    def _search(self, waiting: _Waiting) -> None:
        order, image = waiting.order, rgb_of(waiting.image)
        model = self._foreground.of_size(*order.size)
        now_s = time.monotonic()
        if now_s >= self._noise_due_s:
            self._noise, self._noise_due_s = noise_of(image), now_s + _NOISE_S
        self.searched += 1
        if len(order.slices):
            self._send_edges(waiting, find_edges(image, order.slices, model, self._noise))
        if order.map_step:
            self._send_map(waiting, pack_map(foreground_map(image, model, order.map_step)))

    def _send_edges(self, waiting: _Waiting, edges: Edges) -> None:
        """The edges of one frame in as many datagrams as they need."""
        valid = np.arange(edges.offset.shape[1]) < edges.number[:, None]
        indices = np.nonzero(valid)[0]
        values = np.column_stack([column[valid] for column in (edges.offset, edges.sd, edges.strength, edges.inside,
                                                               edges.outside)])
        parts = max(1, -(-len(indices) // EDGES_FIT))
        for part in range(parts):
            own = slice(part * EDGES_FIT, (part + 1) * EDGES_FIT)
            head = self._head(waiting, SliceEdges)
            self._send(SliceEdges(*head, waiting.order.request, len(waiting.order.slices), part, parts,
                                  pack_edges(indices[own], values[own])), waiting)

    def _send_map(self, waiting: _Waiting, data: bytes) -> None:
        """A compressed map in as many datagrams as it needs."""
        parts = -(-len(data) // FOREGROUND_FIT)
        for part in range(parts):
            head = self._head(waiting, ForegroundPart)
            self._send(ForegroundPart(*head, waiting.order.request, waiting.order.map_step, part, parts,
                                      data[part * FOREGROUND_FIT:(part + 1) * FOREGROUND_FIT]), waiting)

    def _head(self, waiting: _Waiting, kind: type) -> tuple[int, int, int, int, int, int, int, int, int, int, int]:
        """What both messages begin with, node to frame number, with the next number of this kind of message."""
        frame, session = waiting.frame, waiting.stream.session
        if session != self._session:
            self._session, self._numbers = session, {}
        sequence = self._numbers.get(kind, 0)
        self._numbers[kind] = (sequence + 1) & U32_MAX
        t_send_node_ns = self._clock.now_ns()
        processing_ns = min(max(t_send_node_ns - frame.t_available_node_ns, 0), U32_MAX)
        width, height = waiting.order.size
        return (self._node_id, session, sequence, frame.t_node_ns, t_send_node_ns, processing_ns, frame.exposure_ns,
                frame.row_time_ns, width, height, frame.number & U32_MAX)

    def _send(self, message: SliceEdges | ForegroundPart, waiting: _Waiting) -> None:
        if waiting.sender.send(message, waiting.stream):
            self.sent += 1
        else:
            self.not_sent += 1
