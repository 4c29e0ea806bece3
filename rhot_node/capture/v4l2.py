"""The cameras of this computer as Video4Linux knows them: names, modes, and whether another program holds one.

Structures and numbers are those of the kernel's ``videodev2.h`` on 64-bit machines and on ARM.
"""

from __future__ import annotations

import contextlib
import enum
import errno
import fcntl
import os
import re
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from rhot_node.config import CameraSettings

Ioctl = Callable[[int, int, bytearray], object]
"""``ioctl(descriptor, request, structure)``; raises OSError."""


class Request(enum.IntEnum):
    """VIDIOC_... of the kernel."""

    QUERYCAP = 0x80685600
    ENUM_FMT = 0xC0405602
    REQBUFS = 0xC0145608
    G_CTRL = 0xC008561B
    ENUM_FRAMESIZES = 0xC02C564A
    ENUM_FRAMEINTERVALS = 0xC034564B


class Control(enum.IntEnum):
    """V4L2_CID_... of the kernel."""

    AUTO_WHITE_BALANCE = 0x0098090C
    EXPOSURE_AUTO = 0x009A0901
    EXPOSURE_ABSOLUTE = 0x009A0902


class ExposureMode(enum.IntEnum):
    """V4L2_EXPOSURE_...: values of `Control.EXPOSURE_AUTO`."""

    AUTO = 0
    MANUAL = 1
    SHUTTER_PRIORITY = 2
    APERTURE_PRIORITY = 3


class Capability(enum.IntFlag):
    """V4L2_CAP_... of the kernel."""

    VIDEO_CAPTURE = 0x00000001
    DEVICE_CAPS = 0x80000000


_CONTROL: Final = struct.Struct("<Ii")
_CAPABILITY: Final = struct.Struct("<16s32s32sIII12x")
_FORMAT: Final = struct.Struct("<III32sI16x")
_BUFFERS: Final = struct.Struct("<III8x")
_SIZE: Final = struct.Struct("<IIIIIIIII8x")
_INTERVAL: Final = struct.Struct("<IIIIIII24x")
_CAPTURE_TYPE, _MMAP, _DISCRETE = 1, 1, 1
_MOST: Final = 256  # of an enumeration; a driver that never ends one is broken

EXPOSURE_UNIT_US: Final = 100.0  # of V4L2_CID_EXPOSURE_ABSOLUTE

SMOOTH_HZ: Final = 25.0
"""The rate of television (ITU-R BT.470): slower modes are chosen only where there is no other."""


@dataclass(frozen=True, slots=True)
class Mode:
    """A picture size, px, and its highest rate, frames/s."""

    width: int
    height: int
    fps: float

    def __str__(self) -> str:
        return f"{self.width} x {self.height} at {self.fps:g}/s"


_ASKED = CameraSettings()
USUAL: Final = Mode(_ASKED.width, _ASKED.height, _ASKED.fps)
"""What a node asks for by itself, and most webcams have."""


@dataclass(frozen=True, slots=True)
class Device:
    """A camera. `modes`: smallest picture first. `problem`: a sentence when it cannot be used now, else ""."""

    path: str
    name: str
    bus: str = ""
    modes: tuple[Mode, ...] = ()
    problem: str = ""

    @property
    def mode(self) -> Mode:
        """The mode nearest to the usual one that is not slow."""
        pixels = USUAL.width * USUAL.height
        return min(self.modes, key=lambda mode: (mode.fps < SMOOTH_HZ, abs(mode.width * mode.height - pixels)),
                   default=USUAL)


def list_devices(folder: Path = Path("/dev"), ioctl: Ioctl = fcntl.ioctl) -> tuple[Device, ...]:
    """All cameras, in the order of their numbers. Devices that give no pictures, such as a webcam's metadata, are left
    out."""
    numbered = sorted((int(match[1]), path) for path in folder.glob("video*")
                      if (match := re.fullmatch(r"video(\d+)", path.name)))
    found = (look_at_device(path, ioctl) for _, path in numbered)
    return tuple(device for device in found if device is not None)


@dataclass(frozen=True, slots=True)
class Automatics:
    """What a driver says of its automatic modes now; None where it does not. `exposure`: the camera chooses its
    exposure time, which may be longer than a frame in the dark (V4L2's ``exposure_dynamic_framerate``)."""

    exposure: bool | None = None
    white_balance: bool | None = None
    exposure_us: float | None = None


def read_automatics(path: str, ioctl: Ioctl = fcntl.ioctl) -> Automatics:
    """What a webcam's driver says of its automatic modes; the camera may be in use."""
    try:
        handle = os.open(path, os.O_RDWR | os.O_NONBLOCK | os.O_CLOEXEC)
    except OSError:
        return Automatics()
    try:
        mode, balance, time = (_control(handle, ioctl, one)
                               for one in (Control.EXPOSURE_AUTO, Control.AUTO_WHITE_BALANCE,
                                           Control.EXPOSURE_ABSOLUTE))
    finally:
        os.close(handle)
    return Automatics(None if mode is None else mode in (ExposureMode.AUTO, ExposureMode.APERTURE_PRIORITY),
                      None if balance is None else balance != 0, None if time is None else EXPOSURE_UNIT_US * time)


def _control(handle: int, ioctl: Ioctl, control: int) -> int | None:
    data = bytearray(_CONTROL.pack(control, 0))
    try:
        ioctl(handle, Request.G_CTRL, data)
    except OSError:
        return None
    return int(_CONTROL.unpack(data)[1])


def look_at_device(path: Path, ioctl: Ioctl = fcntl.ioctl) -> Device | None:
    """What a device says; None when it is no camera. One that cannot be opened is a Device with a problem."""
    try:
        handle = os.open(path, os.O_RDWR | os.O_NONBLOCK | os.O_CLOEXEC)
    except (FileNotFoundError, IsADirectoryError):
        return None
    except PermissionError:
        return Device(str(path), path.name, problem="You may not read this camera. Join its group, then log in again: "
                                                    "`sudo usermod -aG video $USER`.")
    except OSError as exc:
        return Device(str(path), path.name, problem=_held(path) if exc.errno == errno.EBUSY else
                      f"The camera cannot be opened ({exc.strerror}). Plug it in again.")
    try:
        data = bytearray(_CAPABILITY.size)
        ioctl(handle, Request.QUERYCAP, data)
        _, card, bus, _, capabilities, own = _CAPABILITY.unpack(data)
        if not (own if capabilities & Capability.DEVICE_CAPS else capabilities) & Capability.VIDEO_CAPTURE:
            return None
        modes = tuple(sorted(_modes(handle, ioctl), key=lambda mode: (mode.width * mode.height, mode.width)))
        return Device(str(path), _text(card) or path.name, _text(bus), modes,
                      _held(path) if _is_held(handle, ioctl) else "")
    except OSError:
        return None  # it answers no question that every camera answers
    finally:
        os.close(handle)


def _held(path: Path) -> str:
    return f"Another program uses this camera. Close it: `fuser {path}` names it."


def _is_held(handle: int, ioctl: Ioctl) -> bool:
    """Whether the driver refuses buffers because another program has some."""
    try:
        ioctl(handle, Request.REQBUFS, bytearray(_BUFFERS.pack(1, _CAPTURE_TYPE, _MMAP)))
    except OSError as exc:
        return exc.errno == errno.EBUSY
    with contextlib.suppress(OSError):
        ioctl(handle, Request.REQBUFS, bytearray(_BUFFERS.pack(0, _CAPTURE_TYPE, _MMAP)))
    return False


def _modes(handle: int, ioctl: Ioctl) -> list[Mode]:
    """Each size once, at the highest rate of any pixel format."""
    best: dict[tuple[int, int], float] = {}
    for fields in _enumerate(handle, ioctl, Request.ENUM_FMT, _FORMAT, _CAPTURE_TYPE):
        pixel_format = fields[4]
        for size in _enumerate(handle, ioctl, Request.ENUM_FRAMESIZES, _SIZE, pixel_format):
            width, height = size[3:5] if size[2] == _DISCRETE else (min(size[4], USUAL.width),
                                                                        min(size[7], USUAL.height))
            fps = _rate(handle, ioctl, pixel_format, width, height)
            best[width, height] = max(fps, best.get((width, height), 0.0))
            if size[2] != _DISCRETE:
                break  # one entry is a whole range
    return [Mode(width, height, fps) for (width, height), fps in best.items()]


def _rate(handle: int, ioctl: Ioctl, pixel_format: int, width: int, height: int) -> float:
    """Frames/s: the highest rate; the usual one where the driver names none."""
    rates = [fields[6] / fields[5] for fields in _enumerate(
        handle, ioctl, Request.ENUM_FRAMEINTERVALS, _INTERVAL, pixel_format, width, height)
        if fields[5] and fields[6]]
    return round(max(rates, default=USUAL.fps), 2)


def _enumerate(handle: int, ioctl: Ioctl, request: int, layout: struct.Struct,
               *asked: int) -> Iterator[tuple[int, ...]]:
    """The answers to a question that begins with an index and what is `asked`, until the driver has no more."""
    for index in range(_MOST):
        data = bytearray(layout.size)
        struct.pack_into(f"<{1 + len(asked)}I", data, 0, index, *asked)
        try:
            ioctl(handle, request, data)
        except OSError:
            return
        yield layout.unpack(data)


def _text(raw: bytes) -> str:
    return raw.split(b"\0")[0].decode("utf-8", "replace").strip()
