"""Edges of a bare hand and its foreground: what one node was asked to search in its images, and its answers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from rhot_app.barehand.observations import EdgeFrame, ForegroundFrame, SliceRequest, edges_of
from rhot_app.tracking.kinds.kind import FrameTimes, Kind
from rhot_node.errors import WireError
from rhot_node.wire.messages import U32_MAX, ForegroundPart, SliceEdges, Slices
from rhot_node.wire.search import SLICES_FIT, SLICES_MAX, EdgeTable, pack_slices, unpack_map, unpack_slices

REMEMBERED = 64
"""Requests whose answers may still come: a second of 60 Hz."""

FRAMES = 4
"""Frames of which some parts have come and others may follow."""

Answer = SliceEdges | ForegroundPart
_Key = tuple[type, int, int]


class EdgeKind(Kind):
    """See `Kind`. Their residual is `barehand.contour_residual`. An answer comes in several datagrams.

    Requests are made by one thread at a time, answers are taken by one.
    """

    name = "edges"
    messages = (SliceEdges, ForegroundPart)

    def __init__(self) -> None:
        self._requests: dict[int, SliceRequest] = {}
        self._records: dict[int, dict[int, Slices]] = {}  # of a log, not whole yet
        self._parts: dict[_Key, dict[int, Answer]] = {}
        self._number = self._sequence = 0

    def restart(self) -> None:
        """Another session: what is on its way is of none."""
        self._parts.clear()

    def ask(self, request: SliceRequest, node_id: int, session: int, size: tuple[int, int]) -> list[Slices]:
        """The messages of a request, which is remembered; slices beyond SLICES_MAX must not be asked for."""
        assert len(request.slices) <= SLICES_MAX
        self._number = (self._number + 1) & U32_MAX
        self._remember(self._number, request)
        parts = max(1, -(-len(request.slices) // SLICES_FIT))
        found = []
        for part in range(parts):
            own = request.slices[part * SLICES_FIT:(part + 1) * SLICES_FIT]
            self._sequence = (self._sequence + 1) & U32_MAX
            found.append(Slices(node_id, session, self._sequence, self._number, *size, len(request.slices), part, parts,
                                request.map_step, pack_slices(own)))
        return found

    def read(self, message: Slices) -> None:
        """Take a recorded request in: its answers follow in the log."""
        parts = self._records.setdefault(message.request, {})
        parts[message.part] = message
        if len(parts) == message.parts:
            records = b"".join(parts[part].records for part in sorted(parts))
            self._remember(message.request, SliceRequest(self.camera, unpack_slices(records), message.map_step))
            self._records.clear()

    def collect(self, message: Any, times: FrameTimes) -> EdgeFrame | ForegroundFrame | None:
        """The frame that a message completes. Raises WireError 'request' when nobody asked, 'count' or 'range' when the
        parts do not make one."""
        if message.request not in self._requests:
            raise WireError("request", f"an answer to the request {message.request}, which was not made of late")
        key = type(message), message.frame_number, message.request
        parts = self._parts.setdefault(key, {})
        parts[message.part] = message
        while len(self._parts) > 2 * FRAMES:
            del self._parts[next(iter(self._parts))]
        if len(parts) < message.parts:
            return None
        del self._parts[key]
        return self._frame([parts[part] for part in sorted(parts)], times)

    def observe(self, collected: Any, times: FrameTimes) -> EdgeFrame | ForegroundFrame:
        """See `Kind`."""
        found: EdgeFrame | ForegroundFrame = collected
        return found

    def _frame(self, parts: Sequence[Answer], times: FrameTimes) -> EdgeFrame | ForegroundFrame:
        """The frame of a whole answer."""
        last = parts[-1]
        request = self._requests.get(last.request)
        if isinstance(last, ForegroundPart):
            data = b"".join(part.data for part in parts if isinstance(part, ForegroundPart))
            return ForegroundFrame(self.camera, times.t_row0_ns, last.row_time_ns, times.t_receive_ns, last.step,
                                   unpack_map(data, last.width, last.height, last.step))
        if request is None or any(not isinstance(part, SliceEdges) or part.slice_count != len(request.slices)
                                  for part in parts):
            raise WireError("count", f"edges of {last.slice_count} slices, which were not asked for so")
        columns = [part.edges.columns() for part in parts if isinstance(part, SliceEdges)
                   and isinstance(part.edges, EdgeTable)]
        indices = np.concatenate([one for one, _ in columns])
        values = np.concatenate([one for _, one in columns])
        return EdgeFrame(self.camera, times.t_row0_ns, last.row_time_ns, times.t_receive_ns, 1e-9 * last.processing_ns,
                         1e-9 * (times.t_receive_ns - times.t_send_ns), request,
                         edges_of(len(request.slices), indices, values), last.t_frame_node_ns)

    def _remember(self, number: int, request: SliceRequest) -> None:
        self._requests[number] = request
        while len(self._requests) > REMEMBERED:
            del self._requests[next(iter(self._requests))]
