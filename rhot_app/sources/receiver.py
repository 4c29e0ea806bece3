"""Where frames come from: live nodes or a log, the same to the engine; and one node's data socket with the thread that
drains it through the node's door."""

from __future__ import annotations

import contextlib
import os
import socket
import struct
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Protocol

import msgspec

from rhot_app.barehand.observations import SliceRequest
from rhot_app.errors import SourceError
from rhot_app.project import Rig
from rhot_app.recording.raw_log import RecordKind, RecordSink
from rhot_app.sources.node_link import CLOCK_REPLY, NodeLink
from rhot_app.sources.validation import DatagramValidator, Verified
from rhot_app.tracking.tracker import CameraFrame
from rhot_node.clock import ANCILLARY_SIZE, KernelTime, LinuxOption, ask_for_times
from rhot_node.files import MIB
from rhot_node.threads import Worker
from rhot_node.wire.fields import BURST, RECEIVE_MAX

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

RECEIVE_BUFFER = 4 * MIB
"""Bytes asked of the kernel: half a second of a 10,000 datagrams/s flood (each costs the kernel ~800 bytes)."""

FRESH_NS = 400_000
"""A datagram that came less than this ago is handed on at once: asking the socket for another one would cost it a
twentieth of a millisecond. When datagrams pile up they are older, and all are taken before any is handed on."""

NEWEST = 8
"""Of one burst at most so many are handed on: when flooded, count everything, track the newest."""

_WAIT = struct.pack("@ll", 0, 200_000)  # a blocked read returns after 0.2 s to see whether it shall end

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
        sock.setsockopt(socket.SOL_SOCKET, LinuxOption.RCVBUFFORCE, RECEIVE_BUFFER)
    except OSError:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, _WAIT)
    ask_for_times(sock)
    return sock


def granted_buffer(sock: socket.socket) -> int:
    """Bytes of receive buffer the kernel granted, counted as they are asked for (it reports twice that)."""
    return sock.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF) // 2


REFUSED_NS = 1_000_000_000
"""How often the log is told how many datagrams were refused."""


class DatagramSink:
    """Records one node's datagrams, and how many others came: nothing that can be sent again and again."""

    def __init__(self, sink: RecordSink, link: NodeLink) -> None:
        self._sink, self._link = sink, link
        self._told = self._refused()
        self._due_ns = 0
        self._lock = threading.Lock()  # the last count is another thread's

    def put(self, t_receive_ns: int, data: bytes) -> None:
        """Record a datagram."""
        self._sink.put(RecordKind.DATAGRAM, self._link.node.node_id, t_receive_ns, data)

    def count_refused(self, now_ns: int) -> None:
        """Record how many were refused since the last time, when that is a while ago."""
        if now_ns >= self._due_ns:
            self._due_ns = now_ns + REFUSED_NS
            self._tell(now_ns)

    def close(self) -> None:
        """Record what is left to say."""
        self._tell(time.monotonic_ns())

    def _tell(self, now_ns: int) -> None:
        with self._lock:
            before, self._told = self._told, self._refused()
            since = self._told - before
            if since:
                self._sink.put(RecordKind.REFUSED, self._link.node.node_id, now_ns, msgspec.json.encode(since))

    def _refused(self) -> Counter[str]:
        return Counter(self._link.door.refused.copy()) + Counter({CLOCK_REPLY: self._link.refused_replies})


class NodeReceiver:
    """Drains one data socket in bursts. `step` is one burst; `start` runs it in a thread until `close`.

    The thread that received a frame carries it on through the tracker: handing it to another one costs as much as the
    tracker's own work.
    """

    def __init__(self, sock: socket.socket, door: DatagramValidator, name: str) -> None:
        self.door = door
        self.sink: DatagramSink | None = None
        """Given every datagram of the stream that comes for the first time."""
        self.deliver: Deliver = to_nobody
        self.port: int = sock.getsockname()[1]
        self.buffer_bytes = granted_buffer(sock)
        self.skipped = 0  # verified and counted, but not tracked because newer ones had come already
        self._socket = sock
        self._kernel_time = KernelTime()
        self._worker = Worker(f"receives from {name}", self._turn, begin=hurry_this_thread)

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
                data, ancillary, _, _ = self._socket.recvmsg(RECEIVE_MAX, ANCILLARY_SIZE, flags)
                claim_interpreter()
                t_receive_ns, now_ns = self._kernel_time.receive_time_ns(ancillary)
                count, flags = count + 1, socket.MSG_DONTWAIT
                taken = self.door.taken
                frame = self.door.verify(data, t_receive_ns)
                sink = self.sink
                if sink is not None and self.door.taken > taken:
                    sink.put(t_receive_ns, data)
                if frame is not None:
                    verified.append(frame)
                if now_ns - t_receive_ns < FRESH_NS:
                    break
        if verified:
            self.skipped += max(0, len(verified) - NEWEST)
            frames = [self.door.convert(frame) for frame in verified[-NEWEST:]]
            self.deliver([frame for frame in frames if frame is not None])
        sink = self.sink
        if sink is not None:
            sink.count_refused(time.monotonic_ns())
        return count

    def start(self) -> None:
        """Receive in a thread of its own."""
        self._worker.start()

    def close(self) -> None:
        """End the thread and close the port. May be called twice."""
        self._worker.ending.set()
        with contextlib.suppress(OSError):  # "not connected", which it never is; Linux ends a blocked read all the same
            self._socket.shutdown(socket.SHUT_RD)
        self._worker.close()
        self._socket.close()

    def _turn(self) -> None:
        self.step()
        share_interpreter()


# -- sources: live nodes or a log --------------------------------------------------------------------------------------

class ObservationSource(Protocol):
    """Delivers verified frames of all cameras of a rig from threads of its own."""

    def deliver_to(self, deliver: Deliver) -> None:
        """Hand frames to `deliver` from now on, possibly from several threads at once; before, they go nowhere."""
        ...

    @property
    def links(self) -> Sequence[NodeLink]:
        """What is known of each node, in the order of the rig's nodes."""
        ...

    @property
    def receivers(self) -> Sequence[NodeReceiver]:
        """Likewise; none in a replay."""
        ...

    @property
    def live(self) -> bool:
        """Whether receive times are of this moment, so that latency means something."""
        ...

    @property
    def log_path(self) -> str:
        """The log that is replayed, "" of live nodes."""
        ...

    @property
    def changes(self) -> int:
        """Grows whenever a node's clock was set or a session began: the tracker must then forget."""
        ...

    def notices(self) -> list[str]:
        """Sentences about the source itself, such as the end of a log."""
        ...

    def configure(self, rig: Rig) -> None:
        """Go on with another rig whose nodes are reached the same way (`same_network`)."""
        ...

    def start(self, session: int) -> None:
        """Have the nodes stream in `session` (not 0)."""
        ...

    def stop(self) -> None:
        """Have the nodes stop."""
        ...

    def search(self, request: SliceRequest) -> None:
        """Ask a node to search its next frames; a log answers what it was asked when it was recorded."""
        ...

    def record_to(self, tap: RecordSink | None) -> None:
        """Hand every datagram and clock exchange to `tap` from now on, beginning with what a replay needs to know."""
        ...

    def close(self) -> None:
        """End all threads and close all ports. May be called twice."""
        ...


def same_network(one: Rig, other: Rig) -> bool:
    """Whether both rigs reach the same nodes and other trackers in the same way, so that nothing is opened anew."""
    def network(rig: Rig) -> list[tuple[object, ...]]:
        return [(rig.broadcast.address, rig.broadcast.port),
                *((one.model.name, one.poses) for one in rig.objects if one.model is not None and one.poses),
                *((node.node_id, node.address, node.udp_port, node.data_port, node.text_datagrams, node.public_key,
                   node.control_port if node.public_key else 0) for node in rig.nodes)]
    return network(one) == network(other)
