"""One node's data socket and the thread that drains it through the node's door."""

from __future__ import annotations

import contextlib
import os
import socket
import struct
import sys
import threading
from collections.abc import Callable

from rhot_app.errors import SourceError
from rhot_app.sources.validation import DatagramValidator, Verified
from rhot_app.tracking.tracker import CameraFrame
from rhot_node.clock import ANCILLARY_SIZE, KernelTime, ask_for_times

# -- thread priority ---------------------------------------------------------------------------------------------------

_PRIORITY = 1  # the lowest of the real-time ones: above every ordinary program, below all of the system's own


PATIENCE_S = 2e-5
"""How long a thread that wakes up leaves the interpreter to another one (Python's default is 5 ms)."""

_WORK_S = 5e-3  # no state takes longer


def claim_interpreter() -> None:
    """Keep the interpreter until this thread waits for something: a state is not interrupted for a status report."""
    sys.setswitchinterval(_WORK_S)


def share_interpreter() -> None:
    """From now on the next thread that wakes up gets the interpreter within `PATIENCE_S`."""
    sys.setswitchinterval(PATIENCE_S)


def hurry_this_thread() -> None:
    """Let the calling thread run as soon as it wakes up, whatever else the machine does. Linux, where permitted.

    Permission is root's or what ``ulimit -r`` grants; without it nothing changes. The kernel leaves a twentieth of
    the time to others whatever such a thread does, and programs started from it run as usual.
    """
    with contextlib.suppress(OSError, AttributeError):
        os.sched_setscheduler(0, os.SCHED_RR | os.SCHED_RESET_ON_FORK, os.sched_param(_PRIORITY))


# -- receiving thread --------------------------------------------------------------------------------------------------

RECEIVE_BUFFER = 4 << 20
"""Bytes asked of the kernel: half a second of a 10,000 datagrams/s flood (each costs the kernel ~800 bytes)."""

BURST = 256
"""Datagrams taken at once before the newest are handed on."""

FRESH_NS = 400_000
"""A datagram that came less than this ago is handed on at once: asking the socket for another one would cost it a
twentieth of a millisecond. When datagrams pile up they are older, and all are taken before any is handed on."""

NEWEST = 8
"""Of one burst at most so many are handed on: when flooded, count everything, track the newest."""

DATAGRAM_MAX = 4096  # bytes; 64 markers need 2.1 kB, and a longer datagram is refused for its length

SO_RCVBUFFORCE = 33
_WAIT = struct.pack("@ll", 0, 200_000)  # a blocked read returns after 0.2 s to see whether it shall end

DatagramTap = Callable[[int, bytes], None]
"""``tap(t_receive_ns, data)``: sees every genuine datagram before it is judged."""

Deliver = Callable[[list[CameraFrame]], None]
"""Takes verified frames of one camera, oldest first, in the thread that received them. May take as long as a state."""


def to_nobody(frames: list[CameraFrame]) -> None:
    """The `Deliver` of a source that nobody listens to yet."""


def open_data_socket(port: int, node_name: str) -> socket.socket:
    """A bound UDP socket (0: any free port) with a large buffer and kernel times. Raises SourceError."""
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        sock.bind(("", port))
    except OSError as exc:
        sock.close()
        raise SourceError(f"node {node_name}: UDP port {port} cannot be opened ({exc.strerror}). Stop the program that "
                          "uses it, or give the node another data_port in the rig (0 takes any free one).") from exc
    try:
        sock.setsockopt(socket.SOL_SOCKET, SO_RCVBUFFORCE, RECEIVE_BUFFER)
    except OSError:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, _WAIT)
    ask_for_times(sock)
    return sock


def granted_buffer(sock: socket.socket) -> int:
    """Bytes of receive buffer the kernel granted, counted as they are asked for (it reports twice that)."""
    return sock.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF) // 2


class NodeReceiver:
    """Drains one data socket in bursts. `step` is one burst; `start` runs it in a thread until `close`.

    The thread that received a frame carries it on through the tracker: handing it to another one costs as much as the
    tracker's own work.
    """

    def __init__(self, sock: socket.socket, door: DatagramValidator, name: str) -> None:
        self.door = door
        self.tap: DatagramTap | None = None
        self.deliver: Deliver = to_nobody
        self.port: int = sock.getsockname()[1]
        self.buffer_bytes = granted_buffer(sock)
        self.skipped = 0  # verified and counted, but not tracked because newer ones had come already
        self._socket = sock
        self._kernel_time = KernelTime()
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"receive {name}", daemon=True)

    @property
    def overflowed(self) -> int:
        """Datagrams that the kernel dropped because the receive buffer was full."""
        return self._kernel_time.overflowed

    def step(self) -> int:
        """Wait for a datagram (at most 0.2 s), take all that wait, hand on the newest; returns how many came."""
        verified: list[Verified] = []
        count, flags = 0, 0
        with contextlib.suppress(BlockingIOError):
            while count < BURST:
                data, ancillary, _, _ = self._socket.recvmsg(DATAGRAM_MAX, ANCILLARY_SIZE, flags)
                claim_interpreter()
                t_receive_ns, now_ns = self._kernel_time.receive_time_ns(ancillary)
                count, flags = count + 1, socket.MSG_DONTWAIT
                if self.tap is not None and self.door.admission.genuine(data):  # a stranger fills no disk
                    self.tap(t_receive_ns, data)
                frame = self.door.verify(data, t_receive_ns)
                if frame is not None:
                    verified.append(frame)
                if now_ns - t_receive_ns < FRESH_NS:
                    break
        if verified:
            self.skipped += max(0, len(verified) - NEWEST)
            self.deliver([self.door.convert(frame) for frame in verified[-NEWEST:]])
        return count

    def start(self) -> None:
        """Receive in a thread of its own."""
        self._thread.start()

    def close(self) -> None:
        """End the thread and close the port. May be called twice."""
        self._ending.set()
        with contextlib.suppress(OSError):  # "not connected", which it never is; Linux ends a blocked read all the same
            self._socket.shutdown(socket.SHUT_RD)
        if self._thread.is_alive():
            self._thread.join()
        self._socket.close()

    def _run(self) -> None:
        hurry_this_thread()
        while not self._ending.is_set():
            self.step()
            share_interpreter()
