"""A camera that somebody looks at before it is chosen: its newest picture, the rate that it reaches, and its faults."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rhot_app.sources.cameras.camera_set import CameraSource, camera_controls
from rhot_node.capture.camera import FIRST_FRAME_S, READ_S, Camera, EndOfRecording, Rewindable, report_of
from rhot_node.capture.open import open_camera
from rhot_node.clock import NodeClock
from rhot_node.config import CameraSettings
from rhot_node.detect.image import YuvImage, to_bgr
from rhot_node.errors import CameraError
from rhot_node.health.camera import RateMeter, brightness, camera_troubles
from rhot_node.health.checks import STEP_PX, Check, is_black
from rhot_node.threads import OneShotThread

Picture = NDArray[np.uint8]

PICTURE_S: Final = 1.0 / 15.0
"""s: from one picture for the screen to the next."""

ONE_COLOUR: Final = 1.5
"""Grey levels: standard deviation of luma and chroma below which a picture shows nothing. A sensor's noise has more."""



class CameraPreview:
    """Reads a source in a thread of its own until `stop`. The rest may be asked by any thread."""

    def __init__(self, source: CameraSource, after: CameraPreview | None = None,
                 open_source: Callable[[str, CameraSettings, NodeClock], Camera] = open_camera) -> None:
        """`after`: one that was stopped, whose camera may be the same; it is waited for."""
        self.source = source
        self.picture: Picture | None = None
        """(H, W, 3) BGR, the newest one."""
        self._after, self._open = after, open_source
        self._rate = RateMeter()
        self._troubles: list[Check] = []
        self._fault = self._lost = ""
        self._ending = threading.Event()
        self._task = OneShotThread(f"shows the picture of {source.title}", self._run)

    @property
    def problem(self) -> str:
        """Why there is no picture, a sentence; "" while there may be one."""
        return self._lost or self._task.failure

    @property
    def rate_hz(self) -> float | None:
        """Frames/s that come; None until that is measured."""
        return self._rate.rate_hz

    @property
    def remark(self) -> str:
        """What is wrong with the pictures that come, a sentence; "" for nothing."""
        if self._fault or self.problem:
            return self._fault
        return " ".join(check.sentence for check in self._troubles)

    def stop(self) -> None:
        """Let go of the source soon; `wait` says when."""
        self._ending.set()

    def wait(self, timeout_s: float = FIRST_FRAME_S) -> bool:
        """Whether the source was let go of in time."""
        self._task.join(timeout_s)
        return not self._task.running

    def _run(self) -> None:
        if self._after is not None:
            self._after.wait()
            self._after = None
        if self._ending.is_set():
            return
        try:
            camera = self._open(self.source.spec, camera_controls(self.source), NodeClock())
        except CameraError as exc:
            self._lost = str(exc)
            return
        shown_s = 0.0
        try:
            while not self._ending.is_set():
                try:
                    frame = camera.read(READ_S)
                except EndOfRecording:
                    if isinstance(camera, Rewindable):
                        camera.rewind()
                    continue
                if frame is None:
                    continue
                now_s = time.monotonic()
                self._rate.add(frame.number, round(1e9 * now_s))
                if now_s - shown_s >= PICTURE_S:
                    shown_s = now_s
                    self._fault = fault_of(frame.image)
                    self._troubles = camera_troubles(report_of(camera), self.rate_hz, brightness(frame.image.y),
                                                     self.source.fps)
                    self.picture = to_bgr(frame.image)
        except CameraError as exc:
            self._lost = str(exc)
        finally:
            camera.close()


def fault_of(image: YuvImage) -> str:
    """What a picture alone says against its camera; "" for nothing."""
    if is_black(image.y):
        return "The picture is black. Is the lens covered, or a shutter closed?"
    spread = max(float(np.std(plane[::STEP_PX, ::STEP_PX])) for plane in (image.y, image.u, image.v))
    if spread < ONE_COLOUR:
        return ("The picture has one colour only: the camera sends nothing useful. Choose another size, or plug it in "
                "again.")
    return ""
