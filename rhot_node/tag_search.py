"""The search for fiducial tags beside that for markers."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rhot_node.capture.camera import NS_PER_S, Frame
from rhot_node.clock import NodeClock
from rhot_node.config import NodeSettings, TagSettings
from rhot_node.frame_search import FrameSearch, Waiting
from rhot_node.network.session import Stream
from rhot_node.wire.messages import FAMILIES, Fiducials

if TYPE_CHECKING:
    from rhot_node.detect.tags import TagDetector

WARM_UP_PX = 96  # side of the tag that compiles what refines corners

Luma = NDArray[np.uint8]


class TagSearch(FrameSearch[Luma]):
    """Searches frames and sends what it finds, a message without fiducials included."""

    names = "tag", "tags_found", "fiducials"

    def __init__(self, settings: NodeSettings, clock: NodeClock) -> None:
        """Nothing is loaded before `prepare`."""
        super().__init__(settings.node_id, clock)
        self._settings: TagSettings = settings.tags
        self._detector: TagDetector | None = None
        self._made_for: tuple[str, ...] = ()
        self._due_ns = 0

    def prepare(self) -> None:
        """Compile the detector, because tags may be asked for while frames come, and start the thread if they are."""
        self._detector_of(self._settings.dictionaries)
        self._begin()

    def configure(self, settings: NodeSettings) -> None:
        """Go on with other settings."""
        self._settings = settings.tags
        self._begin()

    def due(self, frame: Frame, stream: Stream) -> bool:
        """Whether tags are sought, and it is time by `rate_hz`."""
        if not self._settings.enabled or self._settings.rate_hz is None:
            return self._settings.enabled
        period_ns = round(NS_PER_S / self._settings.rate_hz)
        late_ns = frame.t_node_ns - self._due_ns
        if -period_ns <= late_ns < 0:
            return False
        self._due_ns = (self._due_ns if 0 <= late_ns < period_ns else frame.t_node_ns) + period_ns
        return True

    def work(self, frame: Frame) -> Luma:
        """Its luma."""
        return frame.image.y.copy()

    def search(self, waiting: Waiting[Luma]) -> None:
        """Search one frame."""
        detector = self._detector_of(self._settings.sought)
        if detector is not None:  # not switched off meanwhile
            found = detector.detect(waiting.work)
            self.found += len(found)
            self.send(Fiducials(*self.head(waiting, Fiducials), found), waiting)

    def _begin(self) -> None:
        if self._settings.enabled:
            self.start("searches for tags")

    def _detector_of(self, dictionaries: tuple[str, ...]) -> TagDetector | None:
        """The detector of these dictionaries, None of none."""
        if dictionaries != self._made_for:
            from rhot_node.detect.tags import TagDetector
            self._made_for, self._detector = dictionaries, TagDetector(dictionaries) if dictionaries else None
            if self._detector is not None:
                self._detector.detect(warm_up_picture(dictionaries[0]))
        return self._detector


def warm_up_picture(dictionary: str) -> Luma:
    """(H, W) tag 0 of a dictionary on white paper."""
    import cv2
    number = FAMILIES.index(dictionary)
    tag = cv2.aruco.generateImageMarker(cv2.aruco.getPredefinedDictionary(number), 0, WARM_UP_PX)
    return np.pad(np.asarray(tag, np.uint8), WARM_UP_PX // 4, constant_values=255)
