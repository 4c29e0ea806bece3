"""Cameras from other packages: ``--camera plug:NAME:SPEC`` opens what the entry point NAME of ``rhot.cameras`` makes.

An entry point names a callable ``(spec, settings, clock) -> Camera`` (docs/plugins.md).
"""

from __future__ import annotations

import contextlib
from typing import Any, Final

from rhot_node.capture.camera import Camera, EndOfRecording, Frame, Reporting
from rhot_node.clock import NodeClock
from rhot_node.config import CameraSettings
from rhot_node.errors import CameraError, NodeError, PluginError
from rhot_node.plugins import PREFIX, about_plugin, load_plugin

GROUP: Final = "rhot.cameras"


class PluginCamera:
    """A camera of a plug-in. Whatever goes wrong in it becomes a CameraError: the node says so and opens it again."""

    def __init__(self, name: str, spec: str, settings: CameraSettings, clock: NodeClock) -> None:
        """Open the camera; raises CameraError."""
        self._name = name
        try:
            self._camera: Camera = load_plugin(GROUP, name)(spec, settings, clock)
            width, height = self._camera.size
            self._size = int(width), int(height)
        except CameraError:
            raise
        except PluginError as exc:
            raise CameraError(f"camera {PREFIX}{name}: {exc}") from exc
        except Exception as exc:
            raise self._failed("could not open its camera", exc) from exc

    @property
    def size(self) -> tuple[int, int]:
        """(width, height), px."""
        return self._size

    def read(self, timeout_s: float) -> Frame | None:
        """The next frame, as `Camera.read`."""
        try:
            frame = self._camera.read(timeout_s)
        except (CameraError, EndOfRecording):
            raise
        except Exception as exc:
            raise self._failed("failed over a frame", exc) from exc
        if frame is not None and (not isinstance(frame, Frame) or frame.image.size != self._size):
            raise CameraError(f"camera {PREFIX}{self._name}: {about_plugin(GROUP, self._name)} gave something else "
                              f"than a frame of {self._size[0]} x {self._size[1]} px.")
        return frame

    def report(self) -> dict[str, Any]:
        """What the camera says of itself, when it does."""
        if isinstance(self._camera, Reporting):
            with contextlib.suppress(Exception):
                return dict(self._camera.report())
        return {}

    def close(self) -> None:
        """Release the camera."""
        with contextlib.suppress(Exception):
            self._camera.close()

    def _failed(self, what: str, exc: Exception) -> CameraError:
        if isinstance(exc, NodeError):
            return CameraError(f"camera {PREFIX}{self._name}: {exc}")
        return CameraError(f"camera {PREFIX}{self._name}: {about_plugin(GROUP, self._name)} {what} "
                           f"({type(exc).__name__}: {exc}).")


def open_plugin_camera(spec: str, settings: CameraSettings, clock: NodeClock) -> PluginCamera:
    """Open ``plug:NAME:SPEC`` or ``plug:NAME``. Raises CameraError."""
    name, _, rest = spec.removeprefix(PREFIX).partition(":")
    return PluginCamera(name, rest, settings, clock)
