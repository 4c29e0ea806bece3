"""The camera interface: where real cameras, recordings and the digital twin enter a node."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Generic, Protocol, TypeVar, runtime_checkable

from rhot_node.clock import NodeClock
from rhot_node.detect.image import YuvImage
from rhot_node.errors import CameraError
from rhot_node.files import MIB, read_input

T = TypeVar("T")

FIRST_FRAME_S: Final = 5.0
"""s that a camera may take from being opened to its first frame. Chosen."""

READ_S: Final = 0.05
"""s that a loop waits for a frame before it looks at everything else."""

SILENCE_S: Final = 3.0
"""s without a frame after which a camera is gone. Chosen, longer than the longest exposure of `CameraSettings`."""


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


def report_of(camera: Camera) -> dict[str, Any]:
    """What a camera says of itself, if it does."""
    return camera.report() if isinstance(camera, Reporting) else {}


def i420_bytes(width: int, height: int) -> int:
    """Of a packed frame: a byte of luma a pixel, and two of chroma for four pixels."""
    return width * height + width * height // 2


class EndOfRecording(Exception):  # noqa: N818 - an end, not an error
    """A finite source (file, folder) has no more frames."""


class Newest(Generic[T]):
    """Holds the newest item that a driver's thread puts in until the reader takes it: a slow reader misses the others.
    """

    def __init__(self) -> None:
        self.closed = False
        self._changed = threading.Condition()
        self._item: T | None = None

    def put(self, item: T) -> T | None:
        """Keep `item`; returns what nobody will take any more: the one before, or once closed `item` itself."""
        with self._changed:
            if self.closed:
                return item
            before, self._item = self._item, item
            self._changed.notify_all()
        return before

    def take(self, timeout_s: float) -> T | None:
        """The newest item not taken yet; None when none comes in time, or none will come."""
        with self._changed:
            self._changed.wait_for(lambda: self._item is not None or self.closed, timeout_s)
            item, self._item = self._item, None
            return item

    def close(self) -> None:
        """No more items come."""
        with self._changed:
            self.closed = True
            self._changed.notify_all()


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


def wait_until(due_ns: int, deadline_ns: int) -> bool:
    """Sleep until `due_ns`, at most until `deadline_ns`, host monotonic time; True when it is due."""
    sleep_until(min(due_ns, deadline_ns))
    return due_ns <= deadline_ns


class DelayedStart:
    """Repeats a recording's first frame, a scene that stands still, until the instant in a file.

    The file holds one integer: the host's monotonic time, ns, of the recording's time 0. The first frame is repeated at
    the recording's rate while the file does not exist, and until that instant.
    """

    def __init__(self, file: Path, period_ns: int, delay_ns: int, first_ns: int = 0) -> None:
        """`delay_ns`: from a frame's mid-exposure until it is available; `first_ns`: the first frame's time."""
        self._file = file
        self._period_ns = period_ns
        self._delay_ns = delay_ns
        self._first_ns = first_ns
        self._opened_ns = time.monotonic_ns()
        self.t0_ns: int | None = None
        self.repeated = 0  # numbers that the repetitions have used

    def repetition(self) -> tuple[int, int] | None:
        """Number and mid-exposure (host monotonic ns) of the next repetition; None when the recording is to play.

        Raises CameraError for a bad file.
        """
        if self.t0_ns is None:
            self.t0_ns = read_start_file(self._file)
        newest = (time.monotonic_ns() - self._delay_ns - self._opened_ns) // self._period_ns
        number = max(self.repeated, newest)
        t_mid_ns = self._opened_ns + number * self._period_ns
        if self.t0_ns is not None and t_mid_ns >= self.t0_ns + self._first_ns - self._period_ns // 2:
            return None
        return number, t_mid_ns

    def wait(self, number: int, t_mid_ns: int, deadline_ns: int) -> bool:
        """Sleep until this repetition is available, at most until `deadline_ns`; True when it is."""
        if not wait_until(t_mid_ns + self._delay_ns, deadline_ns):
            return False
        self.repeated = number + 1
        return True


class PlayedCamera:
    """A recording as a camera, by the host's monotonic time from T0 on, which `start_file` may say (`DelayedStart`). A
    kind of recordings gives `_first`, the first image, and `_play`, what follows."""

    def __init__(self, clock: NodeClock, size: tuple[int, int], exposure_ns: int, row_time_ns: int, period_ns: int,
                 start_file: Path | None, first_ns: int = 0) -> None:
        """`first_ns`: the first frame's time after T0."""
        self._clock, self._size = clock, size
        self._exposure_ns, self._row_time_ns, self._period_ns = exposure_ns, row_time_ns, period_ns
        self._delay_ns = available_delay_ns(exposure_ns, row_time_ns, size[1])
        self._start = DelayedStart(start_file, period_ns, self._delay_ns, first_ns) if start_file else None
        self._t0_ns: int | None = None
        self._base = 0  # number of frame 0

    @property
    def size(self) -> tuple[int, int]:
        """(width, height), px."""
        return self._size

    def read(self, timeout_s: float) -> Frame | None:
        """The next frame at its time. Raises EndOfRecording; CameraError for a bad start file or a broken recording."""
        now_ns = time.monotonic_ns()
        deadline_ns = now_ns + round(timeout_s * NS_PER_S)
        if self._start is not None:
            if still := self._start.repetition():
                return self._frame(self._first(), *still) if self._start.wait(*still, deadline_ns) else None
            self._t0_ns, self._base, self._start = self._start.t0_ns, self._start.repeated, None
        return self._play(now_ns, deadline_ns)

    def _first(self) -> YuvImage:
        raise NotImplementedError

    def _play(self, now_ns: int, deadline_ns: int) -> Frame | None:
        raise NotImplementedError

    def _frame(self, image: YuvImage, number: int, t_mid_ns: int) -> Frame:
        return Frame(image, number, self._clock.from_host_ns(t_mid_ns),
                     self._clock.from_host_ns(t_mid_ns + self._delay_ns), self._exposure_ns, self._row_time_ns)


def read_start_file(path: Path) -> int | None:
    """Host monotonic ns in a start file, None while it does not exist; write it elsewhere and rename it to `path`."""
    try:
        text = read_input(path, MIB).decode("ascii", "replace").strip()
    except FileNotFoundError:
        return None
    except OSError as exc:
        raise CameraError(f"{path}: the start file cannot be read ({exc.strerror}).") from exc
    if not text:
        return None
    try:
        return int(text)
    except ValueError as exc:
        raise CameraError(f"{path}: a start file holds one integer, host monotonic ns, not {text[:40]!r}.") from exc
