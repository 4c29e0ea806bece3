"""What a node says about frames: one stream of messages for each thread that sends them, and the searches of frames
beside that for markers: for tags, landmarks or edges. Their own threads delay no marker.

A search takes the newest frame whenever it is done with the one before. Frames that come meanwhile are not searched,
and counted.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import ClassVar, Generic, Protocol, TypeVar

from rhot_node.capture.camera import Frame
from rhot_node.clock import NodeClock
from rhot_node.config import NodeSettings
from rhot_node.network.session import Stream
from rhot_node.threads import HANG_S, Worker
from rhot_node.wire.messages import U32_MAX, FrameHead, FrameMessage

Work = TypeVar("Work")


class Sender(Protocol):
    """Where messages about frames go; the UDP link or a fake. Several threads call it."""

    def send(self, observations: FrameMessage, stream: Stream) -> bool:
        """Send it where the stream goes; False when it could not be sent."""
        ...


class FrameMessages:
    """Numbers the messages that one thread sends about frames, and counts them."""

    def __init__(self, node_id: int, clock: NodeClock) -> None:
        self.sent = self.not_sent = 0  # not sent: refused by the network
        self._node_id, self._clock = node_id, clock
        self._session, self._sequences = 0, dict[type, int]()

    def head(self, frame: Frame, stream: Stream, kind: type) -> FrameHead:
        """What the next message of this `kind` begins with, node to frame number; it is sent now."""
        if stream.session != self._session:
            self._session, self._sequences = stream.session, {}
        sequence, now_ns = self._sequences.get(kind, 0), self._clock.now_ns()
        self._sequences[kind] = (sequence + 1) & U32_MAX
        processing_ns = min(max(now_ns - frame.t_available_node_ns, 0), U32_MAX)
        return (self._node_id, stream.session, sequence, frame.t_node_ns, now_ns, processing_ns, frame.exposure_ns,
                frame.row_time_ns, *frame.image.size, frame.number & U32_MAX)

    def send(self, message: FrameMessage, stream: Stream, sender: Sender) -> None:
        """Send a message."""
        if sender.send(message, stream):
            self.sent += 1
        else:
            self.not_sent += 1


@dataclass(frozen=True, slots=True)
class Waiting(Generic[Work]):
    """A frame to be searched. `work`: a copy of what is searched, as the frame's own buffer is used again."""

    frame: Frame
    work: Work
    stream: Stream
    sender: Sender


class FrameSearch(Generic[Work]):
    """`step` searches one frame; after `start` a thread does so. The other methods belong to the daemon's thread. A
    kind of search has the methods that raise NotImplementedError."""

    names: ClassVar[tuple[str, str, str]]
    """What its counters call a frame that is searched, what is found, and a message."""

    def __init__(self, node_id: int, clock: NodeClock) -> None:
        self.searched = self.skipped = self.found = 0
        self._node_id, self._clock = node_id, clock
        self._messages = FrameMessages(node_id, clock)
        self._changed = threading.Condition()
        self._waiting: Waiting[Work] | None = None
        self._busy = self._ending = False
        self._worker: Worker | None = None

    def prepare(self) -> None:
        """Have all ready that a search needs, and start the thread if one is asked for."""
        raise NotImplementedError

    def configure(self, settings: NodeSettings) -> None:
        """Go on with other settings."""

    def due(self, frame: Frame, stream: Stream) -> bool:
        """Whether this frame is to be searched."""
        raise NotImplementedError

    def work(self, frame: Frame) -> Work:
        """A copy of what is searched of a frame that is due."""
        raise NotImplementedError

    def search(self, waiting: Waiting[Work]) -> None:
        """Search one frame and send what is found."""
        raise NotImplementedError

    def offer(self, frame: Frame, stream: Stream, sender: Sender) -> bool:
        """Have a frame searched if it is due and nothing else is being searched. False when it was due and is not."""
        if not self.due(frame, stream):
            return True
        with self._changed:
            if self._busy or self._waiting is not None:
                self.skipped += 1
                return False
            self._waiting = Waiting(frame, self.work(frame), stream, sender)
            self._changed.notify()
        return True

    def start(self, what: str, hang_s: float = HANG_S) -> None:
        """Search in a thread from now on; `what` it does: see `Watch`. Once is enough."""
        if self._worker is None and not self._ending:
            self._worker = Worker(what, self.step, wait=self._await_frame, hang_s=hang_s)
            self._worker.start()

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
        return self._messages.head(waiting.frame, waiting.stream, kind)

    def send(self, message: FrameMessage, waiting: Waiting[Work]) -> None:
        """Send what was found in a frame."""
        self._messages.send(message, waiting.stream, waiting.sender)

    def count(self) -> dict[str, int]:
        """Counters, for the control channel."""
        frames, found, messages = self.names
        return {f"{frames}_frames": self.searched, f"{frames}_frames_skipped": self.skipped, found: self.found,
                f"{messages}_sent": self._messages.sent, f"{messages}_not_sent": self._messages.not_sent}

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
