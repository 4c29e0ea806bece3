"""picamera2 and libcamera without a camera: the names, signatures, errors and buffers of picamera2 0.3.36.

Written from its sources (picamera2.py, request.py, controls.py, allocators/dmaallocator.py). Frames are completed by
the test, in its own thread; buffers are real memory maps, which refuse to be closed while an array looks at them.
"""

from __future__ import annotations

import mmap
from collections.abc import Callable
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Rectangle:
    x: int
    y: int
    width: int
    height: int


@dataclass(eq=False)
class ControlId:
    name: str


class _ColorSpace:
    def __init__(self, name: str) -> None:
        self.name = name

    @staticmethod
    def Sycc() -> _ColorSpace:  # noqa: N802 - libcamera's name
        return _ColorSpace("sYCC")


IDS = {name: ControlId(name) for name in (
    "SensorTimestamp", "ExposureTime", "ScalerCrop", "FrameDuration", "AnalogueGain", "Lux", "ColourTemperature",
    "SyncReady", "SyncTimer")}

libcamera = SimpleNamespace(
    ColorSpace=_ColorSpace, Rectangle=Rectangle,
    controls=SimpleNamespace(
        draft=SimpleNamespace(NoiseReductionModeEnum=SimpleNamespace(Off="noise off", Fast="fast", Minimal="minimal")),
        rpi=SimpleNamespace(SyncModeEnum=SimpleNamespace(Off="sync off", Server="sync server", Client="sync client"))))


@dataclass(frozen=True)
class Mode:
    """A sensor's mode: what it shows of the full resolution, and its shortest frame, us."""

    crop: tuple[int, int, int, int]
    frame_min_us: int


@dataclass
class Sensor:
    """What is plugged in, and what goes wrong with it."""

    model: str = "imx219"
    modes: dict[tuple[int, int], Mode] = field(default_factory=lambda: {
        (3280, 2464): Mode((0, 0, 3280, 2464), 47_183), (1640, 1232): Mode((0, 0, 3280, 2464), 23_895),
        (640, 480): Mode((1000, 752, 1280, 960), 4_839)})
    busy: bool = False
    silent: bool = False  # starts, but completes nothing
    broken_mode: bool = False  # configure fails
    sync: bool = True
    stride_align: int = 64  # of chroma rows, as on a Pi 5


GLOBAL_SHUTTER = {(1456, 1088): Mode((0, 0, 1456, 1088), 16_562)}


class _FrameBuffer:
    def __init__(self, size: int) -> None:
        self.memory = mmap.mmap(-1, size)
        self.free = True


class _Request:
    """libcamera.Request: `metadata` is made anew at every look."""

    def __init__(self, buffers: dict[str, _FrameBuffer], values: dict[str, Any]) -> None:
        self.buffers = buffers
        self._values = values

    @property
    def metadata(self) -> dict[ControlId, Any]:
        return {IDS[name]: value for name, value in self._values.items()}


class CompletedRequest:
    def __init__(self, request: _Request, picam2: Picamera2) -> None:
        self.request: _Request | None = request
        self.ref_count = 1
        self.picam2 = picam2
        self.config = picam2.camera_config.copy()

    def acquire(self) -> None:
        if self.ref_count == 0:
            raise RuntimeError("CompletedRequest: acquiring lock with ref_count 0")
        self.ref_count += 1

    def release(self) -> None:
        self.ref_count -= 1
        if self.ref_count < 0:
            raise RuntimeError("CompletedRequest: lock now has negative ref_count")
        if self.ref_count == 0:
            assert self.request is not None
            for buffer in self.request.buffers.values():
                buffer.free = True
            self.request = None
            self.config = {}

    def get_metadata(self) -> dict[str, Any]:
        assert self.request is not None
        self.picam2.full_metadata_reads += 1
        return {key.name: value for key, value in self.request.metadata.items()}


class MappedArray:
    def __init__(self, request: CompletedRequest, stream: str, reshape: bool = True, write: bool = True) -> None:
        assert request.request is not None
        self._buffer = request.request.buffers[stream]
        self._config = request.config[stream]
        self._reshape = reshape
        self._array: np.ndarray | None = None

    def __enter__(self) -> MappedArray:
        array = np.frombuffer(self._buffer.memory, np.uint8)
        if self._reshape:
            assert self._config["format"] == "YUV420"
            array = array.reshape(self._config["size"][1] * 3 // 2, self._config["stride"])
        self._array = array
        return self

    def __exit__(self, *_exc: object) -> None:
        del self._array

    @property
    def array(self) -> np.ndarray | None:
        return self._array


class Picamera2:
    """One class per test, made by `plug_in`: `sensors` and `opened` belong to it."""

    sensors: list[Sensor]
    opened: list[Picamera2]

    @classmethod
    def global_camera_info(cls) -> list[dict[str, Any]]:
        return [{"Model": sensor.model, "Location": 2, "Rotation": 180, "Id": f"/base/soc/i2c/{sensor.model}@10",
                 "Num": number} for number, sensor in enumerate(cls.sensors)]

    def __init__(self, camera_num: int = 0) -> None:
        number = self.global_camera_info()[camera_num]["Num"]
        self.sensor = self.sensors[number]
        if self.sensor.busy:
            raise RuntimeError("Camera __init__ sequence did not complete.")
        self.opened.append(self)
        self.is_open, self.started = True, False
        self.camera_config: dict[str, Any] = {}
        self.controls: dict[str, Any] = {}
        self.post_callback: Callable[[CompletedRequest], None] | None = None
        self.buffers: list[_FrameBuffer] = []
        self.full_metadata_reads = 0
        self.now_ns = 10**12
        self.image: np.ndarray | None = None  # what the sensor sees, packed I420
        self.metadata: dict[str, Any] = {}

    @property
    def camera_properties(self) -> dict[str, Any]:
        return {"Model": self.sensor.model, "ColorFilterArrangement": 0}

    @property
    def mode(self) -> Mode:
        sensor = self.camera_config.get("sensor") or {}
        return self.sensor.modes[sensor.get("output_size") or max(self.sensor.modes)]

    @property
    def camera_controls(self) -> dict[str, tuple[Any, Any, Any]]:
        offered: dict[str, tuple[Any, Any, Any]] = {
            "AeEnable": (False, True, None), "AwbEnable": (False, True, None), "NoiseReductionMode": (0, 4, 0),
            "FrameDurationLimits": (self.mode.frame_min_us, 11_767_556, 33_333),
            "ExposureTime": (75, 11_766_829, 20_000), "AnalogueGain": (1.0, 10.666667, 1.0),
            "ColourGains": (0.0, 32.0, None), "Saturation": (0.0, 32.0, 1.0),
            "Brightness": (-1.0, 1.0, 0.0), "Contrast": (0.0, 32.0, 1.0),
            "ScalerCrop": ((0, 0, 64, 64), self.mode.crop, self._crop())}
        if self.sensor.sync:
            offered |= {"SyncMode": (0, 2, 0), "SyncFrames": (100, 100000, 1000)}
        return offered

    def create_video_configuration(self, main: Any = {}, lores: Any = None, raw: Any = {}, transform: Any = None,  # noqa: B006
                                   colour_space: Any = None, buffer_count: int = 6, controls: Any = {},  # noqa: B006
                                   display: str | None = "main", encode: str | None = "main", queue: bool = True,
                                   sensor: Any = {}, use_case: str = "video") -> dict[str, Any]:  # noqa: B006
        for key in main:
            if key not in ("format", "size", "stride", "preserve_ar"):
                raise ValueError(f"Bad key {key!r}: valid stream configuration keys are ...")
        stream = {"format": "XBGR8888", "size": (1280, 720), "preserve_ar": True} | main
        stream["size"] = (stream["size"][0] & ~1, stream["size"][1] & ~1)
        return {"use_case": use_case, "transform": transform, "colour_space": colour_space or _ColorSpace("SMPTE170M"),
                "buffer_count": buffer_count, "queue": queue, "main": stream, "lores": lores, "raw": raw,
                "controls": {"NoiseReductionMode": "fast", "FrameDurationLimits": (33333, 33333)} | controls,
                "sensor": sensor, "display": display, "encode": encode}

    def configure(self, camera_config: dict[str, Any]) -> None:
        if self.started:
            raise RuntimeError("Camera must be stopped before configuring")
        if set(camera_config["sensor"] or {}) - {"bit_depth", "output_size"}:
            raise RuntimeError("Unexpected keys in sensor configuration")
        if self.sensor.broken_mode:
            raise RuntimeError(f"Invalid camera configuration: {camera_config['main']}")
        config = camera_config | {"main": dict(camera_config["main"]), "sensor": dict(camera_config["sensor"])}
        width, height = config["main"]["size"]
        stride = -(-width // (2 * self.sensor.stride_align)) * 2 * self.sensor.stride_align
        config["main"] |= {"stride": stride, "framesize": stride * height * 3 // 2}
        config["sensor"].setdefault("output_size", max(self.sensor.modes))
        self.camera_config = config
        self.buffers = [_FrameBuffer(config["main"]["framesize"]) for _ in range(config["buffer_count"])]
        self.controls = {}
        self.set_controls(config["controls"])

    def camera_configuration(self) -> dict[str, Any]:
        return self.camera_config

    def set_controls(self, controls: dict[str, Any]) -> None:
        for name in controls:
            if name not in self.camera_controls:
                raise RuntimeError(f"Control {name} is not advertised by libcamera")
        self.controls |= controls

    def start(self, config: Any = None, show_preview: bool = False) -> None:
        if not self.camera_config:
            raise RuntimeError("Camera has not been configured")
        self.started = True
        if not self.sensor.silent:
            self.complete()

    def stop(self) -> None:
        self.started = False

    def close(self) -> None:
        if not self.is_open:
            return
        self.stop()
        for buffer in self.buffers:
            assert buffer.free, "a request was not released"
            buffer.memory.close()
        self.is_open = False

    def complete(self, frames: int = 1) -> None:
        """The sensor takes `frames` frames' time and delivers the last of them, unless all buffers are in use."""
        self.now_ns += 1000 * frames * self.controls["FrameDurationLimits"][0]
        buffer = next((buffer for buffer in self.buffers if buffer.free), None)
        if buffer is None:
            return
        buffer.free = False
        self._expose(buffer)
        values = {"SensorTimestamp": self.now_ns, "ExposureTime": self.controls.get("ExposureTime", 20_000),
                  "FrameDuration": self.controls["FrameDurationLimits"][0], "Lux": 400.0, "ColourTemperature": 4000,
                  "ScalerCrop": Rectangle(*self._crop()), **self.metadata}
        request = CompletedRequest(_Request({"main": buffer}, values), self)
        if self.post_callback is not None:
            self.post_callback(request)
        request.release()

    def _crop(self) -> tuple[int, int, int, int]:
        """The largest middle part of the mode that has the image's aspect ratio."""
        x, y, width, height = self.mode.crop
        if "main" not in self.camera_config:
            return self.mode.crop
        out_width, out_height = self.camera_config["main"]["size"]
        scale = min(width / out_width, height / out_height)
        crop_width, crop_height = round(out_width * scale) & ~1, round(out_height * scale) & ~1
        return x + (width - crop_width) // 2, y + (height - crop_height) // 2, crop_width, crop_height

    def _expose(self, buffer: _FrameBuffer) -> None:
        """Write the picture, row by row; padding is left as rubbish."""
        memory = np.frombuffer(buffer.memory, np.uint8)
        memory[:] = 0xAA
        if self.image is None:
            return
        (width, height), stride = self.camera_config["main"]["size"], self.camera_config["main"]["stride"]
        planes = ((self.image[:width * height], height, width, stride),
                  (self.image[width * height:], height, width // 2, stride // 2))  # U, then V
        offset = 0
        for plane, rows, columns, row_bytes in planes:
            target = memory[offset:offset + rows * row_bytes].reshape(rows, row_bytes)
            target[:, :columns] = plane.reshape(rows, columns)
            offset += rows * row_bytes


def plug_in(*sensors: Sensor) -> SimpleNamespace:
    """The module picamera2 of a Pi with these sensors."""
    camera_class = type("Picamera2", (Picamera2,), {"sensors": list(sensors), "opened": []})
    return SimpleNamespace(Picamera2=camera_class, MappedArray=MappedArray)
