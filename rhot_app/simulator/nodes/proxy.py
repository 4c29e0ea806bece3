"""A bad network between one node and the master: a UDP proxy that loses, delays, reorders and doubles datagrams.

The rig names the proxy's `command_port` as the node's port. Start messages pass with the node's data port replaced by
the proxy's own, so that the node's observations come through here too; the node sees the proxy as its master.
"""

from __future__ import annotations

import contextlib
import dataclasses
import heapq
import itertools
import selectors
import socket
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from rhot_app.errors import SimulatorError
from rhot_node.errors import WireError
from rhot_node.threads import Worker
from rhot_node.wire.codec import decode, encode
from rhot_node.wire.messages import Start, StartEntry


@dataclass(frozen=True, slots=True)
class Impairment:
    """A network's faults. Probabilities 0..1 per datagram; delays in seconds.

    A datagram is lost with `loss`; otherwise it waits `delay_s` plus an exponential time of mean `jitter_s`, is held
    back `reorder_delay_s` longer with `reorder` (so that later ones overtake it), and comes twice with `duplicate`.
    """

    loss: float = 0.0
    delay_s: float = 0.0
    jitter_s: float = 0.0
    reorder: float = 0.0
    reorder_delay_s: float = 0.03
    duplicate: float = 0.0

    def __post_init__(self) -> None:
        for name in ("loss", "reorder", "duplicate"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ValueError(f"{name} is a probability, 0..1, not {getattr(self, name)}")
        if min(self.delay_s, self.jitter_s, self.reorder_delay_s) < 0.0:
            raise ValueError("a delay cannot be negative")

    def arrivals(self, rng: np.random.Generator) -> list[float]:
        """Seconds after which copies of one datagram arrive: none when it is lost, two when it is doubled."""
        lost, held, doubled = rng.random(3) < (self.loss, self.reorder, self.duplicate)
        if lost:
            return []
        waits = self.delay_s + self.jitter_s * rng.standard_exponential(2) + self.reorder_delay_s * held
        return [float(wait) for wait in waits[: 2 if doubled else 1]]


@dataclass
class DelayQueue:
    """Datagrams on their way, by arrival time; equal times keep their order."""

    _heap: list[tuple[float, int, bytes]] = field(default_factory=list)
    _count: itertools.count[int] = field(default_factory=itertools.count)

    def put(self, t_arrival_s: float, datagram: bytes) -> None:
        """Add a datagram that arrives at `t_arrival_s`."""
        heapq.heappush(self._heap, (t_arrival_s, next(self._count), datagram))

    def pop_due(self, now_s: float) -> list[bytes]:
        """All datagrams that have arrived by `now_s`, in order of arrival."""
        due = []
        while self._heap and self._heap[0][0] <= now_s:
            due.append(heapq.heappop(self._heap)[2])
        return due

    @property
    def next_s(self) -> float | None:
        """When the next datagram arrives; None when none is on its way."""
        return self._heap[0][0] if self._heap else None


Address = tuple[str, int]

_DATAGRAM_MAX = 65536
_HOST = "127.0.0.1"


class _Way:
    """One direction: datagrams come in on one socket and leave, late or never, through another."""

    def __init__(self, source: socket.socket, sink: socket.socket, impairment: Impairment, seed: list[int]) -> None:
        self.source = source
        self.target: Address | None = None
        self._sink = sink
        self._impairment = impairment
        self._rng = np.random.default_rng(seed)
        self._queue = DelayQueue()

    def take(self, change: Callable[[bytes, Address], bytes]) -> None:
        """Receive one datagram, let `change` note its sender and rewrite it, and put it on its way."""
        try:
            datagram, sender = self.source.recvfrom(_DATAGRAM_MAX)
        except OSError:  # a port that nobody listens on any more answers so
            return
        datagram = change(datagram, sender)
        now = time.monotonic()
        for wait in self._impairment.arrivals(self._rng):
            self._queue.put(now + wait, datagram)

    def deliver(self) -> None:
        """Send what has arrived; without a target it is lost, as on a network without the receiver."""
        for datagram in self._queue.pop_due(time.monotonic()):
            if self.target is not None:
                with contextlib.suppress(OSError):
                    self._sink.sendto(datagram, self.target)

    @property
    def next_s(self) -> float | None:
        return self._queue.next_s


class UdpProxy:
    """Stands between the master and the node `node_id` that listens on `node_port` of this machine.

    `impairment` applies to observations; clock, start and stop messages pass as they are. `start` runs it in a
    thread of its own. Raises SimulatorError when no port can be had.
    """

    def __init__(self, node_id: int, node_port: int, impairment: Impairment, *, seed: int = 0) -> None:
        self._node_id = node_id
        self._data_port: int | None = None
        try:
            self._sockets = [self._bound() for _ in range(3)]
        except OSError as exc:
            raise SimulatorError(f"the network proxy of node {node_id} gets no UDP port: {exc.strerror}.") from exc
        command, toward_node, data = self._sockets
        self._to_node = _Way(command, toward_node, Impairment(), [seed, node_id, 0])
        self._to_master = _Way(toward_node, command, Impairment(), [seed, node_id, 1])
        self._observations = _Way(data, command, impairment, [seed, node_id, 2])
        self._to_node.target = (_HOST, node_port)
        self._selector = selectors.DefaultSelector()
        for way, change in ((self._to_node, self._from_master), (self._to_master, self._unchanged),
                            (self._observations, self._unchanged)):
            self._selector.register(way.source, selectors.EVENT_READ, (way, change))
        self._worker = Worker(f"delays node {self._node_id}", self.step)

    @staticmethod
    def _bound() -> socket.socket:
        bound = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        bound.bind((_HOST, 0))
        return bound

    @property
    def command_port(self) -> int:
        """The port that the master takes for the node's."""
        return int(self._sockets[0].getsockname()[1])

    def _from_master(self, datagram: bytes, sender: Address) -> bytes:
        self._to_master.target = sender
        if self._data_port is not None:
            self._observations.target = (sender[0], self._data_port)
        with contextlib.suppress(WireError):
            message = decode(datagram)
            if isinstance(message, Start):
                return encode(dataclasses.replace(message, entries=tuple(
                    self._redirected(entry, sender) if entry.node_id == self._node_id else entry
                    for entry in message.entries)))
        return datagram

    def _redirected(self, entry: StartEntry, sender: Address) -> StartEntry:
        self._data_port = entry.data_port
        self._observations.target = (sender[0], entry.data_port)
        return dataclasses.replace(entry, data_port=int(self._sockets[2].getsockname()[1]))

    @staticmethod
    def _unchanged(datagram: bytes, _sender: Address) -> bytes:
        return datagram

    def step(self, timeout_s: float = 0.1) -> None:
        """Wait for the next datagram or arrival, at most `timeout_s`, and pass on what is due."""
        ways = (self._to_node, self._to_master, self._observations)
        arrivals = [way.next_s for way in ways if way.next_s is not None]
        if arrivals:
            timeout_s = min(timeout_s, max(0.0, min(arrivals) - time.monotonic()))
        for key, _ in self._selector.select(timeout_s):
            way, change = key.data
            way.take(change)
        for way in ways:
            way.deliver()

    def start(self) -> None:
        """Run in a thread until `close`."""
        self._worker.start()

    def close(self) -> None:
        """End the thread and free the ports. May be called twice."""
        self._worker.close()
        self._selector.close()
        for bound in self._sockets:
            bound.close()
