"""The node's clock: monotonic nanoseconds, never the wall clock, so that no time service can make it jump."""

from __future__ import annotations

import enum
import socket
import struct
import time
from dataclasses import dataclass


@dataclass(frozen=True)
class NodeClock:
    """A clock that runs `drift_ppm` fast and stands `offset_ns` ahead of this machine's monotonic clock.

    A real node uses the defaults. Simulated nodes on one machine get clocks that disagree, as real ones do.
    """

    offset_ns: int = 0
    drift_ppm: float = 0.0
    origin_ns: int = 0  # host monotonic time at which the drift began

    def now_ns(self) -> int:
        """Node time now, ns."""
        return self.from_host_ns(time.monotonic_ns())

    def from_host_ns(self, t_host_ns: int) -> int:
        """Node time at which this machine's monotonic clock shows `t_host_ns`."""
        return t_host_ns + self.offset_ns + round((t_host_ns - self.origin_ns) * self.drift_ppm * 1e-6)


# -- kernel receive time -----------------------------------------------------------------------------------------------
# The kernel stamps with the wall clock (SO_TIMESTAMPNS). It is brought to the monotonic clock by their difference
# measured right after the read; when the wall clock was set in between, the stamp is not used.

class LinuxOption(enum.IntEnum):
    """Options of sockets that the module `socket` does not name (Linux, asm-generic/socket.h)."""

    RCVBUFFORCE = 33
    TIMESTAMPNS = 35
    RXQ_OVFL = 40


_TIMESTAMPNS, _RXQ_OVFL = int(LinuxOption.TIMESTAMPNS), int(LinuxOption.RXQ_OVFL)
_TIMESPEC = struct.Struct("@ll")
_COUNT = struct.Struct("@I")
ANCILLARY_SIZE = socket.CMSG_SPACE(_TIMESPEC.size) + socket.CMSG_SPACE(_COUNT.size)

_STEP_NS = 300_000  # more than reading two clocks can differ by
_PAUSE_NS = 20_000  # between two looks at clocks: somebody else had the processor
_ATTEMPTS = 4
_SLEW = 1e-3  # time services turn the wall clock's rate by 500 ppm at most
_OLDEST_NS = 10_000_000_000  # no datagram waits longer in a socket that is being read

Ancillary = list[tuple[int, int, bytes]]


def ask_for_times(sock: socket.socket) -> None:
    """Have the kernel stamp every datagram and tell how many it had to drop."""
    sock.setsockopt(socket.SOL_SOCKET, LinuxOption.TIMESTAMPNS, 1)
    sock.setsockopt(socket.SOL_SOCKET, LinuxOption.RXQ_OVFL, 1)


class KernelTime:
    """Turns one socket's ancillary data into monotonic receive times. One thread only."""

    def __init__(self) -> None:
        self.overflowed = 0  # datagrams the kernel dropped because the buffer was full
        self._difference_ns, self._measured_ns = _measure()

    def receive_time_ns(self, ancillary: Ancillary) -> tuple[int, int]:
        """Monotonic time at which the kernel received the datagram that was just read, and now, ns."""
        stamp_ns = None
        for _, kind, data in ancillary:
            if kind == _TIMESTAMPNS and len(data) >= _TIMESPEC.size:
                seconds, nanoseconds = _TIMESPEC.unpack_from(data)
                stamp_ns = seconds * 1_000_000_000 + nanoseconds
            elif kind == _RXQ_OVFL and len(data) >= _COUNT.size:
                self.overflowed = _COUNT.unpack_from(data)[0]
        difference_ns, now_ns = _measure()
        change_ns = abs(difference_ns - self._difference_ns)
        steady = change_ns < _STEP_NS + _SLEW * (now_ns - self._measured_ns)
        self._difference_ns, self._measured_ns = difference_ns, now_ns
        if stamp_ns is None or not steady:
            return now_ns, now_ns
        t_ns = stamp_ns - difference_ns
        # The difference is read with some noise: a datagram cannot have come after now.
        return (min(t_ns, now_ns) if now_ns - _OLDEST_NS < t_ns < now_ns + _STEP_NS else now_ns), now_ns


def _measure() -> tuple[int, int]:
    """(wall clock - monotonic clock, monotonic now), ns. Asked again when this program had to wait in between."""
    looks = []
    for _ in range(_ATTEMPTS):
        before_ns = time.monotonic_ns()
        wall_ns = time.time_ns()
        now_ns = time.monotonic_ns()
        looks.append((now_ns - before_ns, wall_ns - (before_ns + now_ns) // 2))
        if looks[-1][0] < _PAUSE_NS:
            break
    return min(looks)[1], now_ns
