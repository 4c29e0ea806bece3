"""Pictures of cameras that hang upside down, or whose program mirrors them, as they should be."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import cv2
import numpy as np

from rhot_node.capture.camera import Camera, Frame, Reporting, Rewindable
from rhot_node.config import CameraSettings
from rhot_node.detect.image import Plane, YuvImage
from rhot_node.errors import CameraError

_BOTH_AXES, _AROUND_X, _AROUND_Y = -1, 0, 1  # of cv2.flip


class OrientedCamera:
    """A camera whose pictures are turned by 180 degrees (`settings.turned`), mirrored (`settings.mirrored`), or both.

    The rows of a rolling shutter would then be exposed from the last to the first, which no message can say: such
    frames are refused.
    """

    def __init__(self, camera: Camera, settings: CameraSettings) -> None:
        self._camera = camera
        self._turned = settings.turned
        self._way = (_AROUND_X if settings.mirrored else _BOTH_AXES) if settings.turned else _AROUND_Y

    @property
    def size(self) -> tuple[int, int]:
        """(width, height), px."""
        return self._camera.size

    def read(self, timeout_s: float) -> Frame | None:
        """The next frame, as `Camera.read`."""
        frame = self._camera.read(timeout_s)
        if frame is None:
            return None
        if self._turned and frame.row_time_ns:
            raise CameraError("a picture whose rows are exposed one after the other cannot be turned here. Take "
                              "\"turned\" out of the settings and mount the camera upright, or set row_time_us to 0.")
        image = frame.image
        return replace(frame, image=YuvImage(self._flip(image.y), self._flip(image.u), self._flip(image.v)))

    def rewind(self) -> None:
        """Go before the first frame, where the camera can."""
        if isinstance(self._camera, Rewindable):
            self._camera.rewind()

    def report(self) -> dict[str, Any]:
        """What the camera says of itself."""
        return self._camera.report() if isinstance(self._camera, Reporting) else {}

    def close(self) -> None:
        """Release the camera."""
        self._camera.close()

    def _flip(self, plane: Plane) -> Plane:
        return np.asarray(cv2.flip(plane, self._way), np.uint8)
