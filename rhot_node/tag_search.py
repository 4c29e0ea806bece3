"""The search for fiducial tags beside that for markers: in a thread of its own, so that it delays no marker.

It takes the newest frame whenever it is done with the one before. Frames that come meanwhile are not searched, and
counted.
"""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from rhot_node.capture.camera import NS_PER_S, Frame
from rhot_node.clock import NodeClock
from rhot_node.config import NodeSettings, TagSettings
from rhot_node.network.session import Stream
from rhot_node.threads import Worker
from rhot_node.wire.messages import FAMILIES, Fiducials

if TYPE_CHECKING:
    from rhot_node.detect.tags import TagDetector

U32_MAX = 2**32 - 1
WARM_UP_PX = 96  # side of the tag that compiles what refines corners


class FiducialSender(Protocol):
    """Where fiducials go; the UDP link or a fake."""

    def send(self, observations: Fiducials, stream: Stream) -> bool:
        """Send them where the stream goes; False when they could not be sent."""
        ...


class _Waiting:
    """A frame to be searched: its luma is a copy, as the frame's own buffer is used again."""

    def __init__(self, frame: Frame, stream: Stream, sender: FiducialSender) -> None:
        self.frame, self.luma, self.stream, self.sender = frame, frame.image.y.copy(), stream, sender


class TagSearch:
    """Searches frames and sends what it finds, a message without fiducials included. `step` searches one frame; after
    `prepare` a thread does so. The other methods belong to the daemon's thread."""

    def __init__(self, settings: NodeSettings, clock: NodeClock) -> None:
        """Nothing is loaded before `prepare`."""
        self.searched = self.skipped = self.found = self.sent = self.not_sent = 0
        self._node_id, self._clock = settings.node_id, clock
        self._settings: TagSettings = settings.tags
        self._detector: TagDetector | None = None
        self._made_for: tuple[str, ...] = ()
        self._session = self._sequence = 0
        self._due_ns = 0
        self._changed = threading.Condition()
        self._waiting: _Waiting | None = None
        self._busy = self._ending = False
        self._worker: Worker | None = None

    def prepare(self) -> None:
        """Compile the detector, because tags may be asked for while frames come, and start the thread if they are."""
        self._detector_of(self._settings.dictionaries)
        self._start()

    def configure(self, settings: NodeSettings) -> None:
        """Go on with other settings."""
        self._settings = settings.tags
        self._start()

    def offer(self, frame: Frame, stream: Stream, sender: FiducialSender) -> None:
        """Have a frame searched if it is due and nothing else is being searched; costs a copy of its luma."""
        if not self._settings.enabled or not self._due(frame.t_node_ns):
            return
        with self._changed:
            if self._busy or self._waiting is not None:
                self.skipped += 1
                return
            self._waiting = _Waiting(frame, stream, sender)
            self._changed.notify()

    def step(self) -> bool:
        """Search the frame that waits; False without one."""
        with self._changed:
            waiting, self._waiting = self._waiting, None
            self._busy = waiting is not None
        if waiting is None:
            return False
        try:
            self._search(waiting)
        finally:
            self._busy = False
        return True

    def count(self) -> dict[str, int]:
        """Counters, for the control channel."""
        return {"tag_frames": self.searched, "tag_frames_skipped": self.skipped, "tags_found": self.found,
                "fiducials_sent": self.sent, "fiducials_not_sent": self.not_sent}

    def close(self) -> None:
        """End the thread. May be called twice."""
        with self._changed:
            self._ending = True
            self._changed.notify()
        if self._worker is not None:
            self._worker.close()

    def _start(self) -> None:
        if self._settings.enabled and self._worker is None and not self._ending:
            self._worker = Worker("searches for tags", self.step, wait=self._await_frame)
            self._worker.start()

    def _await_frame(self) -> None:
        with self._changed:
            while self._waiting is None and not self._ending:
                self._changed.wait()

    def _due(self, t_node_ns: int) -> bool:
        if self._settings.rate_hz is None:
            return True
        period_ns = round(NS_PER_S / self._settings.rate_hz)
        late_ns = t_node_ns - self._due_ns
        if -period_ns <= late_ns < 0:
            return False
        self._due_ns = (self._due_ns if 0 <= late_ns < period_ns else t_node_ns) + period_ns
        return True

    def _detector_of(self, dictionaries: tuple[str, ...]) -> TagDetector | None:
        """The detector of these dictionaries, None of none."""
        if dictionaries != self._made_for:
            from rhot_node.detect.tags import TagDetector
            self._made_for, self._detector = dictionaries, TagDetector(dictionaries) if dictionaries else None
            if self._detector is not None:
                self._detector.detect(warm_up_picture(dictionaries[0]))
        return self._detector

    def _search(self, waiting: _Waiting) -> None:
        detector = self._detector_of(self._settings.sought)
        if detector is None:  # switched off meanwhile
            return
        frame, stream = waiting.frame, waiting.stream
        found = detector.detect(waiting.luma)
        self.searched += 1
        self.found += len(found)
        if stream.session != self._session:
            self._session, self._sequence = stream.session, 0
        height, width = waiting.luma.shape
        t_send_node_ns = self._clock.now_ns()
        processing_ns = min(max(t_send_node_ns - frame.t_available_node_ns, 0), U32_MAX)
        message = Fiducials(self._node_id, stream.session, self._sequence, frame.t_node_ns, t_send_node_ns,
                            processing_ns, frame.exposure_ns, frame.row_time_ns, width, height,
                            frame.number & U32_MAX, found)
        self._sequence = (self._sequence + 1) & U32_MAX
        if waiting.sender.send(message, stream):
            self.sent += 1
        else:
            self.not_sent += 1


def warm_up_picture(dictionary: str) -> NDArray[np.uint8]:
    """(H, W) tag 0 of a dictionary on white paper."""
    import cv2
    number = FAMILIES.index(dictionary)
    tag = cv2.aruco.generateImageMarker(cv2.aruco.getPredefinedDictionary(number), 0, WARM_UP_PX)
    return np.pad(np.asarray(tag, np.uint8), WARM_UP_PX // 4, constant_values=255)
