"""The search for edges along slices that the master asks for, in a thread of its own: it delays no marker.

A request is in force until the next one, or for `VALID_S`. Every frame is searched with the newest request; a frame
that comes while one is being searched is left out and counted.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_node.capture.camera import Frame
from rhot_node.clock import NodeClock
from rhot_node.detect.edges import Edges, find_edges, noise_of
from rhot_node.detect.foreground import foreground_map
from rhot_node.detect.image import YuvImage
from rhot_node.foreground_store import ForegroundStore, rgb_of
from rhot_node.frame_search import FrameSearch, Waiting
from rhot_node.network.session import Stream
from rhot_node.wire.messages import U32_MAX, ForegroundPart, SliceEdges, Slices
from rhot_node.wire.search import EDGES_FIT, FOREGROUND_FIT, MAP_STEPS, pack_edges, pack_map, unpack_slices

VALID_S = 1.0
"""How long a request is in force: a hand has moved on by then."""

_NOISE_S = 1.0  # between two measurements of the image's noise


@dataclass(frozen=True, slots=True)
class _Order:
    """A whole request: `slices` (N, 5) as `find_edges` takes them."""

    session: int
    request: int
    size: tuple[int, int]
    map_step: int
    slices: NDArray[np.float64]
    until_s: float


Work = tuple[YuvImage, _Order]


class SliceSearch(FrameSearch[Work]):
    """`take` belongs to the link's thread."""

    names = "slice", "slice_requests", "edges"

    def __init__(self, node_id: int, clock: NodeClock, foreground: ForegroundStore) -> None:
        super().__init__(node_id, clock)
        self._foreground = foreground
        self._order: _Order | None = None  # the newest one; the one that a frame is due by is the daemon's own
        self._due_by: _Order | None = None
        self._parts: dict[int, Slices] = {}
        self._collected = (0, 0)  # session and request whose parts are being collected
        self._noise, self._noise_due_s = 1.0, 0.0

    def prepare(self) -> None:
        """Compile, because slices may be asked for while frames come, and start the thread."""
        self.warm_up()
        self.start("searches along slices")

    def warm_up(self) -> None:
        """Have everything compiled that a search needs."""
        step = MAP_STEPS.start
        side = step * step
        image, model = np.zeros((side, side, 3), np.uint8), self._foreground.of_size(side, side)
        find_edges(image, np.array([[0.5 * side, 0.5 * side, 1.0, 0.0, step]]), model, noise_of(image))
        foreground_map(image, model, step)

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
        self.found += 1
        self._order = _Order(session, message.request, (message.width, message.height), message.map_step, slices,
                             time.monotonic() + VALID_S)
        return ""

    def due(self, frame: Frame, stream: Stream) -> bool:
        """Whether a request for frames like this one is in force."""
        self._due_by = order = self._order
        return (order is not None and order.session == stream.session and time.monotonic() <= order.until_s
                and order.size == frame.image.size)

    def work(self, frame: Frame) -> Work:
        """The whole picture, and the request."""
        assert self._due_by is not None
        return frame.image.copy(), self._due_by

    def search(self, waiting: Waiting[Work]) -> None:
        """Search one frame."""
        order, image = waiting.work[1], rgb_of(waiting.work[0])
        model = self._foreground.of_size(*order.size)
        now_s = time.monotonic()
        if now_s >= self._noise_due_s:
            self._noise, self._noise_due_s = noise_of(image), now_s + _NOISE_S
        if len(order.slices):
            self._send_edges(waiting, find_edges(image, order.slices, model, self._noise))
        if order.map_step:
            self._send_map(waiting, pack_map(foreground_map(image, model, order.map_step)))

    def _send_edges(self, waiting: Waiting[Work], edges: Edges) -> None:
        """The edges of one frame in as many datagrams as they need."""
        order = waiting.work[1]
        valid = np.arange(edges.offset.shape[1]) < edges.number[:, None]
        indices = np.nonzero(valid)[0]
        values = np.column_stack([column[valid] for column in (edges.offset, edges.sd, edges.strength, edges.inside,
                                                               edges.outside)])
        parts = max(1, -(-len(indices) // EDGES_FIT))
        for part in range(parts):
            own = slice(part * EDGES_FIT, (part + 1) * EDGES_FIT)
            self.send(SliceEdges(*self.head(waiting, SliceEdges), order.request, len(order.slices), part, parts,
                                 pack_edges(indices[own], values[own])), waiting)

    def _send_map(self, waiting: Waiting[Work], data: bytes) -> None:
        """A compressed map in as many datagrams as it needs."""
        order, parts = waiting.work[1], -(-len(data) // FOREGROUND_FIT)
        for part in range(parts):
            self.send(ForegroundPart(*self.head(waiting, ForegroundPart), order.request, order.map_step, part, parts,
                                     data[part * FOREGROUND_FIT:(part + 1) * FOREGROUND_FIT]), waiting)
