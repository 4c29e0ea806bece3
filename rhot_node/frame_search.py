"""A search of frames beside that for markers: for tags, landmarks or edges. Its own thread delays no marker.

It takes the newest frame whenever it is done with the one before. Frames that come meanwhile are not searched, and
counted.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from rhot_node.capture.camera import Frame
from rhot_node.clock import NodeClock
from rhot_node.network.session import Stream
from rhot_node.threads import HANG_S, Worker
from rhot_node.wire.messages import U32_MAX, FrameHead, FrameMessage

Work = TypeVar("Work")


def frame_head(frame: Frame, node_id: int, session: int, sequence: int, t_send_node_ns: int) -> FrameHead:
    """What a message about a frame begins with that is sent at `t_send_node_ns`."""
    processing_ns = min(max(t_send_node_ns - frame.t_available_node_ns, 0), U32_MAX)
    return (node_id, session, sequence, frame.t_node_ns, t_send_node_ns, processing_ns, frame.exposure_ns,
            frame.row_time_ns, *frame.image.size, frame.number & U32_MAX)


class SearchSender(Protocol):
    """Where what is found goes; the UDP link or a fake."""

    def send(self, observations: FrameMessage, stream: Stream) -> bool:
        """Send it where the stream goes; False when it could not be sent."""
        ...


@dataclass(frozen=True, slots=True)
class Waiting(Generic[Work]):
    """A frame to be searched. `work`: a copy of what is searched, as the frame's own buffer is used again."""

    frame: Frame
    work: Work
    stream: Stream
    sender: SearchSender


class FrameSearch(Generic[Work]):
    """`step` searches one frame; after `start` a thread does so. The other methods belong to the daemon's thread. A
    search has `search`, which sends messages with `send`."""

    def __init__(self, node_id: int, clock: NodeClock) -> None:
        self.searched = self.skipped = self.sent = self.not_sent = 0
        self._node_id, self._clock = node_id, clock
        self._session, self._sequences = 0, dict[type, int]()
        self._changed = threading.Condition()
        self._waiting: Waiting[Work] | None = None
        self._busy = self._ending = False
        self._worker: Worker | None = None

    def search(self, waiting: Waiting[Work]) -> None:
        """Search one frame and send what is found."""
        raise NotImplementedError

    def start(self, what: str, hang_s: float = HANG_S) -> None:
        """Search in a thread from now on; `what` it does: see `Watch`. Once is enough."""
        if self._worker is None and not self._ending:
            self._worker = Worker(what, self.step, wait=self._await_frame, hang_s=hang_s)
            self._worker.start()

    def free(self) -> bool:
        """Whether nothing is being searched; counts the frame as skipped otherwise."""
        with self._changed:
            if self._busy or self._waiting is not None:
                self.skipped += 1
                return False
        return True

    def put(self, waiting: Waiting[Work]) -> None:
        """Have a frame searched."""
        with self._changed:
            self._waiting = waiting
            self._changed.notify()

    def step(self) -> bool:
        """Search the frame that waits; False without one."""
        with self._changed:
            waiting, self._waiting = self._waiting, None
            self._busy = waiting is not None
        if waiting is None:
            return False
        self.searched += 1
        try:
            self.search(waiting)
        finally:
            self._busy = False
        return True

    def head(self, waiting: Waiting[Work], kind: type) -> FrameHead:
        """What a message of this `kind` begins with, node to frame number."""
        frame, session = waiting.frame, waiting.stream.session
        if session != self._session:
            self._session, self._sequences = session, {}
        sequence = self._sequences.get(kind, 0)
        self._sequences[kind] = (sequence + 1) & U32_MAX
        return frame_head(frame, self._node_id, session, sequence, self._clock.now_ns())

    def send(self, message: FrameMessage, waiting: Waiting[Work]) -> None:
        """Send what was found in a frame."""
        if waiting.sender.send(message, waiting.stream):
            self.sent += 1
        else:
            self.not_sent += 1

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
