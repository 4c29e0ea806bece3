"""A Video4Linux driver below OpenCV: files in a folder stand for devices, and `Driver` answers their ioctls."""

from __future__ import annotations

import errno
import struct
from dataclasses import dataclass, field
from pathlib import Path

from rhot_node.capture import v4l2

CAPTURE, METADATA, STREAMING, DEVICE_CAPS = 0x1, 0x0080_0000, 0x0400_0000, 0x8000_0000


@dataclass
class FakeCamera:
    """`formats`: by pixel format, the sizes and their rates. `steps`: sizes are a range up to the largest."""

    card: str = "HD Webcam"
    capabilities: int = CAPTURE | STREAMING
    formats: list[list[tuple[int, int, list[float]]]] = field(default_factory=lambda: [
        [(640, 480, [30.0, 15.0]), (1280, 720, [10.0])], [(640, 480, [30.0]), (1280, 720, [30.0])]])
    controls: dict[int, int] = field(default_factory=dict)
    held: bool = False
    steps: bool = False


class Driver:
    """`ioctl` as fcntl has it, for the fake cameras of a folder."""

    def __init__(self, folder: Path, cameras: dict[str, FakeCamera]) -> None:
        self.folder, self.cameras = folder, cameras
        for name in cameras:
            (folder / name).touch()

    def ioctl(self, handle: int, request: int, data: bytearray) -> None:
        camera = self.cameras[Path(f"/proc/self/fd/{handle}").readlink().name]
        if request == v4l2.Request.QUERYCAP:
            struct.pack_into("<16s32s32sIII", data, 0, b"uvcvideo", camera.card.encode(), b"usb-0000:00:14.0-1", 0,
                             CAPTURE | METADATA | DEVICE_CAPS, camera.capabilities)
        elif request == v4l2.Request.REQBUFS:
            if camera.held:
                raise OSError(errno.EBUSY, "busy")
        elif request == v4l2.Request.G_CTRL:
            control = struct.unpack_from("<I", data)[0]
            self._has(control in camera.controls)
            struct.pack_into("<i", data, 4, camera.controls[control])
        elif request == v4l2.Request.ENUM_FMT:
            index = struct.unpack_from("<I", data)[0]
            self._has(index < len(camera.formats))
            struct.pack_into("<I", data, 44, 1000 + index)
        elif request == v4l2.Request.ENUM_FRAMESIZES:
            index, pixel_format = struct.unpack_from("<II", data)
            sizes = camera.formats[pixel_format - 1000]
            self._has(index < (1 if camera.steps else len(sizes)))
            width, height, _ = sizes[index]
            if camera.steps:
                struct.pack_into("<IIIIIII", data, 8, 3, 16, width, 2, 16, height, 2)
            else:
                struct.pack_into("<III", data, 8, 1, width, height)
        else:
            index, pixel_format, width, height = struct.unpack_from("<IIII", data)
            rates = next((one[2] for one in camera.formats[pixel_format - 1000] if one[:2] == (width, height)), [])
            self._has(index < len(rates))
            struct.pack_into("<III", data, 16, 1, 10, round(10 * rates[index]))

    @staticmethod
    def _has(answer: bool) -> None:
        if not answer:
            raise OSError(errno.EINVAL, "no more")
