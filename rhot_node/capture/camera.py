"""The camera interface: where real cameras, recordings and the digital twin enter a node."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

from rhot_node.detect.image import YuvImage


@dataclass(frozen=True, slots=True)
class Frame:
    """One image with its time.

    `t_node_ns`: mid-exposure of row 0, node clock. `t_available_node_ns`: when the whole frame could be read.
    `number` counts the camera's frames; a gap means dropped frames. The image may be a view of a buffer that is
    reused: it is valid until the next `read`.
    """

    image: YuvImage
    number: int
    t_node_ns: int
    t_available_node_ns: int
    exposure_ns: int
    row_time_ns: int


class Camera(Protocol):
    """An open camera. Constructors open it and raise CameraError with a remedy."""

    @property
    def size(self) -> tuple[int, int]:
        """(width, height), px; constant while open."""
        ...

    def read(self, timeout_s: float) -> Frame | None:
        """The next frame; None when none came within `timeout_s`. Raises CameraError when the camera is gone
        or changed its size, and EndOfRecording when a finite recording is over."""
        ...

    def close(self) -> None:
        """Release the device. May be called twice."""
        ...


@runtime_checkable
class Rewindable(Protocol):
    """A finite source that can be played again."""

    def rewind(self) -> None:
        """Go before the first frame; frame numbers and times go on, as if the recording were longer."""
        ...


@runtime_checkable
class Reporting(Protocol):
    """A camera that can tell more of itself than its frames do."""

    def report(self) -> dict[str, Any]:
        """What it really does, as JSON values for the control channel. Any thread may ask."""
        ...


class EndOfRecording(Exception):  # noqa: N818 - an end, not an error
    """A finite source (file, folder) has no more frames."""


# -- pacing of recordings ----------------------------------------------------------------------------------------------

NS_PER_S = 1_000_000_000
WAKE_UP_NS = 50_000  # the kernel wakes a sleeper 50 to 100 us late (its timer slack); this much is left out


def available_delay_ns(exposure_ns: int, row_time_ns: int, height: int) -> int:
    """From the mid-exposure of row 0 until the last row of a frame is exposed and read out, ns."""
    return exposure_ns // 2 + (height - 1) * row_time_ns


def sleep_until(t_host_ns: int) -> None:
    """Sleep until the host's monotonic clock shows `t_host_ns`; returns at once when that is past.

    Wakes some 50 us late on an idle machine; never spins, so that a playing twin leaves the processor to others.
    """
    remaining_ns = t_host_ns - time.monotonic_ns() - WAKE_UP_NS
    if remaining_ns > 0:
        time.sleep(remaining_ns / NS_PER_S)
