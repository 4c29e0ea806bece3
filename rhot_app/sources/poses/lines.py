"""The line protocol of poses (docs/objects.md), and the clock of whoever prints them. No sockets, no processes.

One pose is one line: ``t_s name x y z qw qx qy qz``, seconds, metres and a unit quaternion. The recording of libsurvive
is of this form, with the word POSE behind the name.
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rhot_app.estimation.se3 import rotation_from_quaternion
from rhot_app.geometry.transforms import rigid
from rhot_app.objects.pose import Validity
from rhot_app.objects.stream import FARTHEST_M
from rhot_app.sources.poses.source import ForeignPose, StreamNoise
from rhot_node.errors import NAME_LIMIT, printable
from rhot_node.files import KIB
from rhot_node.wire.fields import TIME_MAX_NS

Array = NDArray[np.float64]

LINE_MAX = KIB
"""Bytes of a line; what is longer is no pose."""

WINDOW_S = 10.0
"""s: the least delay is looked for within this. Two crystals of 50 ppm drift apart by 1 ms meanwhile."""

SILENCE_NS = 1_000_000_000
"""ns without a pose after which `notice` reports silence."""


@dataclass(frozen=True, slots=True)
class PoseLine:
    """One line: `t_s` by the program's clock, the tracker's `device` name, `world_from_body` (4, 4) m."""

    t_s: float
    device: str
    world_from_body: Array


def parse_line(line: bytes) -> PoseLine | None:
    """Read a line without its end. None for an empty one, and for another record, ``t name WORD ...`` or a log message
    of libsurvive (``Info: ...``). Raises ValueError with what is wrong with it."""
    words = line.decode("ascii", "replace").split()
    if not words or words[0] in ("Info:", "Warning:", "OPTION"):
        return None
    if len(words) > 2 and words[2].isupper() and words[2][0].isalpha():
        if words[2] != "POSE":
            return None
        del words[2]
    if len(words) != 9:
        raise ValueError(f"{len(words)} words where 9 belong")
    try:
        t_s, *numbers = (float(word) for word in (words[0], *words[2:]))
    except ValueError as exc:
        raise ValueError("a word that is no number") from exc
    if not all(map(math.isfinite, (t_s, *numbers))) or abs(t_s) > 1e-9 * TIME_MAX_NS:
        raise ValueError("a number that is not finite")
    if max(map(abs, numbers[:3])) > FARTHEST_M:
        raise ValueError("a place beyond 1 km; metres are needed")
    if abs(math.hypot(*numbers[3:]) - 1.0) > 0.1:
        raise ValueError("a quaternion that is not of length 1")
    return PoseLine(t_s, words[1], rigid(rotation_from_quaternion(numbers[3:]), numbers[:3]))


class ArrivalClock:
    """Master times of another clock's, from arrivals: the least delay of the last WINDOW_S is taken for all.

    A constant part of the delay remains in the times; an alignment finds it. The rest is exact but for the drift within
    the window (one-way synchronisation by a minimum filter, Paxson 1998).
    """

    def __init__(self) -> None:
        self._least: deque[tuple[float, int]] = deque()  # (their time, delay, ns), delays ascending
        self._last_s = -math.inf

    def observe(self, t_s: float, arrival_ns: int) -> None:
        """What was stamped `t_s` came at `arrival_ns`. A clock that goes back was set: its delay begins anew."""
        if t_s < self._last_s:
            self._least.clear()
        self._last_s = t_s
        delay_ns = arrival_ns - round(1e9 * t_s)
        while self._least and self._least[-1][1] >= delay_ns:
            self._least.pop()
        self._least.append((t_s, delay_ns))
        while t_s - self._least[0][0] > WINDOW_S:
            self._least.popleft()

    def master_ns(self, t_s: float) -> int:
        """The master's time of `t_s`, after an arrival was observed."""
        return round(1e9 * t_s) + self._least[0][1]


class LineInput(Protocol):
    """Where lines come from."""

    @property
    def name(self) -> str:
        """What it is, for people."""
        ...

    @property
    def end(self) -> str:
        """Why no more will come, as a sentence; "" while more may."""
        ...

    def read(self) -> bytes:
        """What has come since the last call; returns at once and raises nothing."""
        ...

    def close(self) -> None:
        """End it. May be called twice."""
        ...


class LinePoses:
    """A `PoseSource` of lines: the tracker named `device`, or the one that is named first. `unreadable` counts lines
    that are none of the protocol, `others` poses of other trackers, `late` those that were not later than the last."""

    def __init__(self, lines: LineInput, device: str = "", now_ns: Callable[[], int] = time.monotonic_ns) -> None:
        """`now_ns` is the master's monotonic clock."""
        self._lines, self.device, self._clock_ns = lines, device, now_ns
        self._buffer, self._overlong = b"", False
        self._clock, self._noise = ArrivalClock(), StreamNoise()
        self._last_ns, self._heard_ns = -1, now_ns()
        self.unreadable = self.others = self.late = 0
        self._example, self._other = "", ""

    @property
    def name(self) -> str:
        """The input's and the tracker's."""
        return f"{self._lines.name} {self.device}".rstrip()

    @property
    def ended(self) -> bool:
        """Whether the input has ended."""
        return bool(self._lines.end)

    @property
    def notice(self) -> str:
        """The end, silence, and lines that cannot be read."""
        said, silent_ns = [self._lines.end] if self._lines.end else [], self._clock_ns() - self._heard_ns
        if not said and silent_ns > SILENCE_NS:
            whose = f" of {self.device}" if self.device else ""
            other = f" There are poses of {self._other}." if self._other else ""
            said.append(f"{self._lines.name}: no pose{whose} for {1e-9 * silent_ns:.0f} s. Is the tracker switched on "
                        f"and in view of its base stations?{other}")
        if self.unreadable:
            said.append(f"{self._lines.name}: {self.unreadable} lines are no poses, the last one {self._example}.")
        return " ".join(said)

    def poll(self) -> list[ForeignPose]:
        """See `PoseSource`."""
        return self.take(self._lines.read(), self._clock_ns())

    def take(self, data: bytes, arrival_ns: int) -> list[ForeignPose]:
        """The poses in bytes that came at monotonic time `arrival_ns`."""
        read = [each for line in self._split(data) if (each := self._read(line)) is not None]
        for each in read:  # of lines that came together the newest had the least delay
            self._clock.observe(each.t_s, arrival_ns)
        return [pose for each in read if (pose := self._pose(each, arrival_ns)) is not None]

    def close(self) -> None:
        """See `PoseSource`."""
        self._lines.close()

    def _split(self, data: bytes) -> list[bytes]:
        *lines, self._buffer = (self._buffer + data).split(b"\n")
        if lines and self._overlong:
            lines, self._overlong = lines[1:], False
        if len(self._buffer) > LINE_MAX:
            if not self._overlong:
                self._refuse(self._buffer, "it has no end")
            self._buffer, self._overlong = b"", True
        return lines

    def _read(self, line: bytes) -> PoseLine | None:
        """The pose of the tracker that is wanted."""
        try:
            read = parse_line(line)
        except ValueError as exc:
            self._refuse(line, str(exc))
            return None
        if read is None:
            return None
        self.device = self.device or read.device
        if read.device == self.device:
            return read
        self.others += 1
        self._other = printable(read.device, NAME_LIMIT)
        return None

    def _refuse(self, line: bytes, reason: str) -> None:
        self.unreadable += 1
        self._example = f"{printable(line[:40].decode('ascii', 'replace'))!r} ({reason})"

    def _pose(self, read: PoseLine, arrival_ns: int) -> ForeignPose | None:
        t_ns = self._clock.master_ns(read.t_s)
        if t_ns <= self._last_ns:
            self.late += 1
            return None
        self._last_ns, self._heard_ns = t_ns, arrival_ns
        covariance = self._noise.add(t_ns, read.world_from_body)
        return ForeignPose(t_ns, read.world_from_body, covariance, Validity.TRACKED)
