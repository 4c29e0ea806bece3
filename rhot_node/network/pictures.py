"""Pictures for people: small previews and full stills, copied out of the frame loop only when somebody wants them."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import cv2

from rhot_node.capture.camera import Frame
from rhot_node.detect.image import YuvImage, to_bgr
from rhot_node.errors import NodeError

STILL_S = 2.0  # how long a still may take; a node in fault has no frames
PREVIEW_WIDTH = 320  # px, at most
JPEG_QUALITY = 80

StillFormat = Literal["png", "jpeg"]
_STILL: dict[str, tuple[str, list[int]]] = {
    "png": (".png", [cv2.IMWRITE_PNG_COMPRESSION, 1]), "jpeg": (".jpg", [cv2.IMWRITE_JPEG_QUALITY, 98])}


@dataclass(frozen=True, slots=True)
class Picture:
    """A copy of one frame, with its time and number."""

    image: YuvImage
    number: int
    t_node_ns: int


@dataclass(frozen=True, slots=True)
class Encoded:
    """A picture as a file's bytes; `width` and `height` are those of the bytes, px."""

    data: bytes
    width: int
    height: int


class PictureBox:
    """The frame loop offers every frame; a thread takes previews, requests take stills. Nothing is encoded here."""

    def __init__(self, preview_hz: float, wake: Callable[[], object] = lambda: None) -> None:
        """`wake` is called when a preview has been put in."""
        self.preview_hz = preview_hz
        self.wanted = False  # whether somebody looks at the preview
        self._wake = wake
        self._changed = threading.Condition()
        self._preview: Picture | None = None
        self._due_s = 0.0
        self._waiting = 0  # requests that wait for a still
        self._still: Picture | None = None

    def offer(self, frame: Frame, *, searched: bool = True) -> None:
        """Copy the frame if a still is asked for or a preview is due; else cost nothing. A preview waits up to its
        period for a frame that is `searched`, so that there is something to draw over it."""
        now_s = time.monotonic()
        wait_s = 0.0 if searched else 1.0 / self.preview_hz
        preview_due = self.wanted and now_s >= self._due_s + wait_s
        if not preview_due and not self._waiting:
            return
        picture = Picture(frame.image.copy(), frame.number, frame.t_node_ns)
        with self._changed:
            if preview_due:
                self._preview = picture
                period_s = 1.0 / self.preview_hz
                self._due_s = self._due_s + period_s if now_s < self._due_s + period_s else now_s + period_s
            if self._waiting:
                self._still = picture
                self._changed.notify_all()
        if preview_due:
            self._wake()

    def take_preview(self) -> Picture | None:
        """The newest preview that was not taken yet."""
        with self._changed:
            preview, self._preview = self._preview, None
            return preview

    def next_still(self, timeout_s: float) -> Picture | None:
        """Wait for the next frame; None when none comes in time."""
        with self._changed:
            self._waiting += 1
            self._still = None
            self._changed.wait_for(lambda: self._still is not None, timeout_s)
            self._waiting -= 1
            return self._still

    def still(self) -> Picture:
        """The next frame. Raises NodeError when none comes within STILL_S."""
        picture = self.next_still(STILL_S)
        if picture is None:
            raise NodeError(f"no frame came within {STILL_S:.0f} s; ask for the state to see what the camera does.")
        return picture


def encode_preview(picture: Picture) -> Encoded:
    """JPEG, at most PREVIEW_WIDTH wide."""
    bgr = to_bgr(picture.image)
    height, width = bgr.shape[:2]
    if width > PREVIEW_WIDTH:
        height, width = max(1, round(height * PREVIEW_WIDTH / width)), PREVIEW_WIDTH
        bgr = cv2.resize(bgr, (width, height), interpolation=cv2.INTER_AREA)  # type: ignore[assignment]
    _, data = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return Encoded(data.tobytes(), width, height)


def encode_still(picture: Picture, kind: StillFormat = "png") -> Encoded:
    """The full size: PNG without loss, or JPEG in a twentieth of the time, which moves an edge by some 0.001 px."""
    bgr = to_bgr(picture.image)
    suffix, options = _STILL[kind]
    _, data = cv2.imencode(suffix, bgr, options)
    return Encoded(data.tobytes(), bgr.shape[1], bgr.shape[0])
