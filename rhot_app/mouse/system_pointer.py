"""The 3-D mouse as the system's pointer, by Linux's uinput: an absolute pointing device with two buttons.

The cursor's position on the ground moves the pointer: forward is up. The thumb is the left button, the little finger
the right one. Structures and codes are those of <linux/uinput.h> and <linux/input-event-codes.h>.
"""

from __future__ import annotations

import contextlib
import os
import struct
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from rhot_app.errors import OutputError
from rhot_app.mouse.pointer import GROUND_M, MouseState

DEVICE: Final = Path("/dev/uinput")
RANGE: Final = 32767
"""Largest value of each axis, that of other absolute pointers."""

_EV_SYN, _EV_KEY, _EV_ABS = 0, 1, 3
_ABS_X, _ABS_Y = 0, 1
_PROP_POINTER, _BUS_VIRTUAL = 0, 6
_KEY_OF: Final = {"thumb": 0x110, "little": 0x111}  # BTN_LEFT, BTN_RIGHT
_SET_EVBIT, _SET_KEYBIT, _SET_ABSBIT, _SET_PROPBIT = 0x40045564, 0x40045565, 0x40045567, 0x4004556E
_DEV_SETUP, _ABS_SETUP, _DEV_CREATE, _DEV_DESTROY = 0x405C5503, 0x401C5504, 0x5501, 0x5502

Ioctl = Callable[[int, int, Any], Any]


class SystemPointer:
    """A virtual pointing device. Closing removes it, which releases its buttons."""

    def __init__(self, path: Path = DEVICE, ioctl: Ioctl | None = None) -> None:
        """Create the device. `ioctl`: replaces that of ``fcntl`` in tests. Raises OutputError with the missing
        permission."""
        self._ioctl = ioctl or _system_ioctl()  # first: its error names the systems without one
        self._file = _open(path)
        self._sent: dict[tuple[int, int], int] = {}
        try:
            self._create()
        except OSError as exc:
            os.close(self._file)
            raise OutputError(f"{path}: no pointer can be made with it ({exc.strerror}). It must be the kernel's "
                              "uinput device.") from exc

    def write(self, mouse: MouseState) -> None:
        """Send the changes of position and buttons. Raises OutputError."""
        wanted: dict[tuple[int, int], int] = {}
        if mouse.cursor is not None:
            right, forward = (float(mouse.cursor[k]) / GROUND_M[k] for k in range(2))
            wanted = {(_EV_ABS, _ABS_X): round(RANGE * (0.5 + right)),
                      (_EV_ABS, _ABS_Y): round(RANGE * (0.5 - forward))}
        wanted |= {(_EV_KEY, key): int(mouse.is_pressed(button)) for button, key in _KEY_OF.items()}
        changed = {code: value for code, value in wanted.items() if self._sent.get(code, 0) != value}
        if not changed:
            return
        self._sent |= changed
        events = [*((kind, code, value) for (kind, code), value in changed.items()), (_EV_SYN, 0, 0)]
        try:
            os.write(self._file, b"".join(struct.pack("@llHHi", 0, 0, *event) for event in events))
        except OSError as exc:
            raise OutputError(f"the system's pointer cannot be moved ({exc.strerror}). Start it again.") from exc

    def close(self) -> None:
        """Remove the device."""
        with contextlib.suppress(OSError):
            self._ioctl(self._file, _DEV_DESTROY, 0)
        os.close(self._file)

    def _create(self) -> None:
        for request, codes in ((_SET_EVBIT, (_EV_KEY, _EV_ABS)), (_SET_KEYBIT, _KEY_OF.values()),
                               (_SET_ABSBIT, (_ABS_X, _ABS_Y)), (_SET_PROPBIT, (_PROP_POINTER,))):
            for code in codes:
                self._ioctl(self._file, request, code)
        for axis in (_ABS_X, _ABS_Y):
            self._ioctl(self._file, _ABS_SETUP, struct.pack("@HHiiiiii", axis, 0, 0, 0, RANGE, 0, 0, 0))
        self._ioctl(self._file, _DEV_SETUP, struct.pack("@HHHH80sI", _BUS_VIRTUAL, 0, 0, 1, b"RHOT 3-D mouse", 0))
        self._ioctl(self._file, _DEV_CREATE, 0)


def _open(path: Path) -> int:
    try:
        return os.open(path, os.O_WRONLY | os.O_NONBLOCK)
    except PermissionError as exc:
        raise OutputError(f"{path} may not be written by this user. The system's pointer needs write permission on it: "
                          f"`sudo setfacl -m u:$USER:rw {path}`, or a udev rule for the group input.") from exc
    except OSError as exc:
        raise OutputError(f"{path} cannot be opened ({exc.strerror}). The system's pointer needs Linux's uinput: "
                          "`sudo modprobe uinput`.") from exc


def _system_ioctl() -> Ioctl:
    if not sys.platform.startswith("linux"):
        raise OutputError("the system's pointer needs Linux's uinput; this system has none.")
    import fcntl

    return fcntl.ioctl
