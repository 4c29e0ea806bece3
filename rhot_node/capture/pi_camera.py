"""Raspberry Pi cameras through picamera2: native YUV420, mapped and not copied, with the sensor's own times.

What only the hardware can verify is listed in docs/pi.md.
"""

from __future__ import annotations

import contextlib
import logging
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from rhot_node.capture.camera import FIRST_FRAME_S, SILENCE_S, Frame, Newest
from rhot_node.capture.sensors import Box, choose_preset, make_controls, mid_exposure_ns, read_out
from rhot_node.clock import NodeClock
from rhot_node.config import CameraSettings
from rhot_node.detect.image import from_i420
from rhot_node.errors import CameraError

log = logging.getLogger(__name__)

BUFFERS = 6
BIT_DEPTH = 10  # of the sensor's mode
STREAM = "main"
HOW_TO_INSTALL = ("Install it with `sudo apt install --no-install-recommends python3-picamera2` and make the node's "
                  "environment with `python3 -m venv --system-site-packages`; docs/pi.md has all steps.")


@dataclass(frozen=True, slots=True)
class CameraStack:
    """The two modules that a Pi camera is reached through."""

    picamera2: Any
    libcamera: Any


def load_stack() -> CameraStack:
    """Import picamera2 and libcamera; raises CameraError saying how to install them."""
    try:
        import libcamera
        import picamera2
    except ModuleNotFoundError as exc:
        raise CameraError(f"a Pi camera needs picamera2, which is not here (no module {exc.name}). "
                          f"{HOW_TO_INSTALL}") from exc
    except (ImportError, ValueError, AttributeError, OSError) as exc:
        raise CameraError(f"picamera2 is installed but does not load ({exc}). Where this speaks of numpy: Bookworm's "
                          "picamera2 was built for numpy 1; install the node with requirements/node-bookworm.txt as "
                          "constraints (docs/pi.md).") from exc
    return CameraStack(picamera2, libcamera)


class PiCamera:
    """One Pi camera. `report` tells what the sensor really does."""

    def __init__(self, number: int, settings: CameraSettings, clock: NodeClock,
                 load: Callable[[], CameraStack] = load_stack) -> None:
        """Open camera `number`, start it and wait for a first frame. Raises CameraError when there is none, it is in
        use, does not know the preset, or stays silent."""
        self._settings = settings
        self._clock = clock
        self._where = f"Pi camera {number}"
        self._stack = load()
        self._newest = Newest[Arrival]()
        self._arrivals = 0
        self._heard_s = 0.0
        self._held: contextlib.ExitStack | None = None  # what the reader's frame lies in
        self._last: tuple[int, int, int] | None = None  # of the last frame: number, sensor time, index of its arrival
        self._lost = 0
        self._metadata: dict[str, Any] = {}
        self._camera = self._open(number)
        try:
            self._configure()
            self._start()
        except RuntimeError as exc:
            self.close()
            raise CameraError(f"{self._where}: it does not deliver {settings.width} x {settings.height} px as asked "
                              f"for ({exc}). Try another size or preset in the node's settings.") from exc
        except CameraError:
            self.close()
            raise

    @property
    def size(self) -> tuple[int, int]:
        """(width, height), px."""
        return self._size

    def read(self, timeout_s: float) -> Frame | None:
        """The newest frame; its image lies in the camera's buffer until the next read. Raises CameraError when the
        camera fell silent."""
        self._give_back()
        arrival = self._newest.take(timeout_s)
        if arrival is None:
            if time.monotonic() - self._heard_s > SILENCE_S:
                raise CameraError(f"{self._where}: no frame for {SILENCE_S:.0f} s. Is its cable seated at both ends? "
                                  "Then run `rhot-node doctor`.")
            return None
        self._heard_s = time.monotonic()
        self._held = contextlib.ExitStack()
        self._held.callback(arrival.request.release)
        self._metadata = metadata = read_metadata(arrival.request)
        mapped = self._held.enter_context(self._stack.picamera2.MappedArray(arrival.request, STREAM, write=False))
        timestamp_ns, exposure_ns = int(metadata["SensorTimestamp"]), 1000 * int(metadata["ExposureTime"])
        t_host_ns = mid_exposure_ns(timestamp_ns, exposure_ns, self._readout, self._settings.timestamp_marks,
                                    round(1000 * self._settings.timestamp_offset_us))
        return Frame(
            image=from_i420(mapped.array, *self._size, self._stride),
            number=self._count(timestamp_ns, arrival.index),
            t_node_ns=self._clock.from_host_ns(t_host_ns),
            t_available_node_ns=arrival.t_node_ns,
            exposure_ns=exposure_ns,
            row_time_ns=self._readout.row_time_ns,
        )

    def report(self) -> dict[str, Any]:
        """What the sensor really does, for the control channel."""
        angle = self._readout.view_angle_deg
        return {"sensor": self._sensor, "preset": self._preset.name if self._preset else None,
                "sensor_mode": list(self._mode), "fps": round(1e9 / self._controls.frame_ns, 2),
                "fps_max": round(1e6 / self._frame_min_us, 2),
                "view_angle_deg": None if angle is None else round(angle, 1),
                "row_time_us": self._readout.row_time_ns / 1000, "exposure_us": self._metadata.get("ExposureTime"),
                "lost_by_camera": self._lost, "refused": list(self._controls.refused), **self._sync()}

    def close(self) -> None:
        """Give all buffers back and release the camera. May be called twice."""
        self._give_back()
        self._newest.close()
        waiting = self._newest.take(0.0)
        if waiting is not None:
            waiting.request.release()
        camera, self._camera = self._camera, None
        if camera is not None:
            camera.close()

    def _open(self, number: int) -> Any:
        """The camera itself; its sensor and preset are looked up first."""
        picamera2 = self._stack.picamera2.Picamera2
        found = picamera2.global_camera_info()
        if number >= len(found):
            names = ", ".join(f"{k}: {info['Model']}" for k, info in enumerate(found)) or "none"
            raise CameraError(f"{self._where}: no such camera (present: {names}). Is its ribbon cable seated, contacts "
                              "the right way round? `rpicam-hello --list-cameras` must show it.")
        self._sensor = str(found[number]["Model"])
        self._preset = choose_preset(self._sensor, self._settings.preset)
        try:
            return picamera2(number)
        except RuntimeError as exc:
            raise CameraError(f"{self._where}: it cannot be opened ({exc}). Does another program use it, and may you "
                              "read it (group video)?") from exc

    def _configure(self) -> None:
        settings, camera = self._settings, self._camera
        sensor = {} if self._preset is None else {"output_size": self._preset.size, "bit_depth": BIT_DEPTH}
        # Full-range BT.601, which the detector's colours are of; the library's choice for video has a limited range.
        camera.configure(camera.create_video_configuration(
            main={"format": "YUV420", "size": (settings.width, settings.height)}, raw=None, buffer_count=BUFFERS,
            queue=False, sensor=sensor, colour_space=self._stack.libcamera.ColorSpace.Sycc(), display=None,
            encode=None))
        config = camera.camera_configuration()
        stream = config[STREAM]
        self._size: tuple[int, int] = stream["size"]
        self._stride: int = stream["stride"]
        self._mode: tuple[int, int] = tuple((config.get("sensor") or {}).get("output_size") or (0, 0))
        if stream["format"] != "YUV420" or (self._preset is not None and self._mode != self._preset.size):
            raise CameraError(f"{self._where}: it is set to {stream['format']} by sensor mode {self._mode[0]} x "
                              f"{self._mode[1]} instead of YUV420 by {self._preset and self._preset.title}; update the "
                              "system's camera software (sudo apt full-upgrade).")
        if self._size != (settings.width, settings.height):
            log.warning("%s: delivers %d x %d px instead of %d x %d", self._where, *self._size, settings.width,
                        settings.height)
        if self._stride != self._size[0]:
            log.warning("%s: its rows are padded to %d bytes; the detector is compiled once more for that. A width "
                        "that is a multiple of 128 has no padding", self._where, self._stride)

    def _start(self) -> None:
        camera = self._camera
        offered = camera.camera_controls
        self._frame_min_us = float(offered["FrameDurationLimits"][0])
        self._controls = make_controls(self._settings, offered, self._stack.libcamera)
        for phrase in self._controls.refused:
            log.warning("%s: the camera does not take the setting %s", self._where, phrase)
        camera.set_controls(self._controls.values)
        camera.post_callback = self._arrive
        camera.start()
        first = self._newest.take(FIRST_FRAME_S)
        if first is None:
            raise CameraError(f"{self._where}: opened, but no frame came within {FIRST_FRAME_S:.0f} s. Seat its cable "
                              "anew, then run `rhot-node doctor`.")
        self._metadata = read_metadata(first.request)
        first.request.release()
        limits = _box(offered["ScalerCrop"][1])
        crop = _box(self._metadata["ScalerCrop"]) if "ScalerCrop" in self._metadata else limits
        self._readout = read_out(self._preset, self._frame_min_us, limits, crop, self._size,
                                 self._settings.row_time_ns)
        self._heard_s = time.monotonic()

    def _arrive(self, request: Any) -> None:
        """picamera2's callback, in its thread: keep the request, and give the one before it back."""
        t_node_ns = self._clock.now_ns()
        request.acquire()
        unused = self._newest.put(Arrival(request, self._arrivals, t_node_ns))
        self._arrivals += 1
        if unused is not None:
            unused.request.release()

    def _give_back(self) -> None:
        held, self._held = self._held, None
        if held is not None:
            held.close()

    def _count(self, timestamp_ns: int, index: int) -> int:
        """The frame's number by the sensor's time, so that frames which the camera lost leave a gap as well."""
        if self._last is None:
            number = 0
        else:
            last_number, last_ns, last_index = self._last
            frames = max(1, round((timestamp_ns - last_ns) / self._controls.frame_ns))
            number = last_number + frames
            self._lost += max(0, frames - (index - last_index))
        self._last = number, timestamp_ns, index
        return number

    def _sync(self) -> dict[str, Any]:
        """Software sync as the camera stack tells it."""
        if self._settings.sync == "off":
            return {"sync": "off"}
        if "SyncMode" not in self._controls.values:
            return {"sync": "unavailable"}
        ready = bool(self._metadata.get("SyncReady", False))
        return {"sync": "synchronised" if ready else "waiting", "sync_role": self._settings.sync}


def _box(rectangle: Any) -> Box:
    """A libcamera.Rectangle, or the tuple that picamera2 makes of it."""
    if isinstance(rectangle, tuple):
        return Box(*rectangle)
    return Box(rectangle.x, rectangle.y, rectangle.width, rectangle.height)


# -- the completed requests of a Pi camera -----------------------------------------------------------------------------

WANTED = frozenset({"SensorTimestamp", "ExposureTime", "ScalerCrop", "SyncReady"})


@dataclass(frozen=True, slots=True)
class Arrival:
    """A completed request, how many came before it, and when it was complete. Whoever takes it releases it."""

    request: Any
    index: int
    t_node_ns: int


def read_metadata(request: Any) -> dict[str, Any]:
    """The few values that are needed, as libcamera gives them: `get_metadata` turns every one into Python's, which
    takes longer than a frame of 200 Hz has to spare."""
    return {key.name: value for key, value in request.request.metadata.items() if key.name in WANTED}
