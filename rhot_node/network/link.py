"""The node's UDP side: start, stop, clock requests and questions who is there come in, clock replies, answers and
observations go out.
"""

from __future__ import annotations

import ipaddress
import logging
import select
import socket
import time
from collections import Counter, deque
from collections.abc import Callable

from rhot_node.clock import ANCILLARY_SIZE, KernelTime, NodeClock, ask_for_times
from rhot_node.config import NodeSettings
from rhot_node.errors import LinkError, WireError
from rhot_node.network.presence import Presence
from rhot_node.network.session import LinkKeys, Sessions, Stream
from rhot_node.threads import Worker
from rhot_node.wire.codec import Seal, asks_who_is_there, decode, encode
from rhot_node.wire.fields import RECEIVE_MAX
from rhot_node.wire.messages import (
    ClockReply,
    ClockRequest,
    Find,
    FrameMessage,
    Message,
    NodeState,
    Slices,
    Start,
    Stop,
)

log = logging.getLogger(__name__)

BURST = 64  # datagrams of one socket before the other one is looked at: a flood of one must not delay clocks

ANSWERS_PER_S = 20  # to strangers who ask who is there


class UdpLink:
    """One socket on `udp_port`, one on `broadcast_port`. `step` handles what has come; `start` runs it in a thread."""

    def __init__(self, settings: NodeSettings, clock: NodeClock, sessions: Sessions, boot_id: int,
                 state: Callable[[], NodeState], keys: LinkKeys | None) -> None:
        """Open the ports; raises LinkError. `state` tells what a clock reply says of the node; any thread calls it.
        Only datagrams that a link of `keys` has tagged are taken; with None the node is open, and all are. Who asks
        whether somebody is there is answered once `introduce` is set; any thread may call it. `take_slices` gets
        slices and the running session, 0 for none, and returns why it drops them, or nothing."""
        self.dropped: Counter[str] = Counter()  # datagrams not acted upon, by reason
        self.clock_requests = 0
        self.introduce: Callable[[], Presence] | None = None
        self.take_slices: Callable[[Slices, int], str] | None = None
        self._answered_s = deque([-1.0] * ANSWERS_PER_S, ANSWERS_PER_S)  # when strangers were answered
        self._node_id = settings.node_id
        self._clock = clock
        self._sessions = sessions
        self._boot_id = boot_id
        self._state = state
        self._keys = keys
        self._worker = Worker("answers masters' datagrams", lambda: self.step(0.1))
        self._socket = _open(settings.bind_address, settings.udp_port, "udp_port", shared=False)
        self._sockets = {self._socket.fileno(): (self._socket, KernelTime())}
        if settings.broadcast_port is not None:
            try:
                shared = _open(_broadcast_bind_address(settings.bind_address), settings.broadcast_port,
                               "broadcast_port", shared=True)
            except LinkError:
                self._socket.close()
                raise
            self._sockets[shared.fileno()] = (shared, KernelTime())
        self.port: int = self._socket.getsockname()[1]
        self._poll = select.poll()
        for number in self._sockets:
            self._poll.register(number, select.POLLIN)

    def send(self, observations: FrameMessage, stream: Stream) -> bool:
        """Send one frame's observations; False when the network refused them, which costs that frame only. Any thread
        may call it."""
        try:
            self._socket.sendto(encode(observations, stream.seal), stream.address)
        except (OSError, WireError) as exc:
            log.debug("observations to %s port %d: %s", *stream.address, exc)
            return False
        return True

    def count(self) -> dict[str, object]:
        """Counters, for the control channel."""
        return {"clock_requests": self.clock_requests, "dropped": dict(self.dropped)}

    def step(self, timeout_s: float) -> None:
        """Wait up to `timeout_s` for datagrams and act upon those that have come."""
        for number, _ in self._poll.poll(timeout_s * 1000.0):
            sock, kernel_time = self._sockets[number]
            for _ in range(BURST):
                try:
                    data, ancillary, _, sender = sock.recvmsg(RECEIVE_MAX, ANCILLARY_SIZE, socket.MSG_DONTWAIT)
                except BlockingIOError:
                    break
                except OSError as exc:
                    log.debug("link: %s", exc)
                    break
                self.take(data, sender, kernel_time.receive_time_ns(ancillary)[0])

    def start(self) -> None:
        """Answer in a thread of its own until `close`."""
        self._worker.start()

    def close(self) -> None:
        """End the thread and close the ports. May be called twice."""
        self._worker.close()
        for sock, _ in self._sockets.values():
            sock.close()

    def take(self, data: bytes, sender: tuple[str, int], t_receive_host_ns: int) -> None:
        """Act upon one datagram that the kernel received from `sender` at `t_receive_host_ns`; whatever it is, nothing
        raises."""
        try:
            message, seal = self._open(data)
        except WireError as exc:
            self.dropped[exc.reason] += 1
            return
        match message:
            case ClockRequest():
                self._answer(message, sender, t_receive_host_ns, seal)
            case Start():
                self._take_start(message, sender[0], seal)
            case Stop():
                if not self._sessions.stop(message.session):
                    self.dropped["stop_of_nothing"] += 1
            case Slices() if self.take_slices is not None:
                stream = self._sessions.current
                reason = self.take_slices(message, stream.session if stream else 0)
                if reason:
                    self.dropped[f"slices_{reason}"] += 1
            case Find() if seal is None:
                self._say_who(message, sender)
            case _:
                self.dropped["kind"] += 1

    def _open(self, data: bytes) -> tuple[Message, Seal | None]:
        if self._keys is None or asks_who_is_there(data):
            return decode(data), None
        message, link = self._keys.open(data)
        return message, link.seal

    def _answer(self, request: ClockRequest, sender: tuple[str, int], t_receive_host_ns: int,
                seal: Seal | None) -> None:
        if request.node_id != self._node_id:
            self.dropped["foreign_node"] += 1
            return
        self.clock_requests += 1
        self._sessions.hear(request.session, time.monotonic())
        stream = self._sessions.current
        t2 = self._clock.from_host_ns(t_receive_host_ns)
        reply = ClockReply(self._node_id, stream.session if stream else 0, request.sequence, request.t1_master_ns,
                           t2, max(t2, self._clock.now_ns()), self._boot_id, self._state())
        try:
            self._socket.sendto(encode(reply, seal), sender)
        except OSError as exc:
            log.debug("clock reply to %s port %d: %s", *sender, exc)

    def _say_who(self, question: Find, sender: tuple[str, int]) -> None:
        """Answer a stranger, who may have put another's address into his question: never more than was asked with."""
        now_s = time.monotonic()
        if question.node_id not in (0, self._node_id) or self.introduce is None:
            self.dropped["foreign_node"] += 1
        elif now_s - self._answered_s[0] < 1.0:
            self.dropped["find_often"] += 1
        else:
            self._answered_s.append(now_s)
            try:
                self._socket.sendto(encode(self.introduce().answer(question, self._state())), sender)
            except (OSError, WireError) as exc:
                log.debug("answer to %s port %d: %s", *sender, exc)

    def _take_start(self, message: Start, sender: str, seal: Seal | None) -> None:
        entry = next((entry for entry in message.entries if entry.node_id == self._node_id), None)
        if entry is None:
            self.dropped["foreign_node"] += 1
            return
        verdict = self._sessions.start(message.session, (sender, entry.data_port), entry.t_start_node_ns,
                                       now_node_ns=self._clock.now_ns(), now_s=time.monotonic(), seal=seal)
        if verdict != "started":
            self.dropped[f"start_{verdict}"] += 1


def _open(address: str, port: int, setting: str, *, shared: bool) -> socket.socket:
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        if shared:  # every node of this machine hears a broadcast
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
        sock.bind((address, port))
        ask_for_times(sock)
    except OSError as exc:
        sock.close()
        raise LinkError(f"{setting}: UDP port {port} on {address} cannot be opened ({exc.strerror}). Stop the program "
                        f"that uses it, or choose another {setting} in the settings.") from exc
    return sock


def _broadcast_bind_address(bind_address: str) -> str:
    """Where broadcasts are heard: everywhere, but only on this machine when the node is bound to this machine."""
    try:
        loopback = ipaddress.ip_address(bind_address).is_loopback
    except ValueError:
        loopback = False
    return "127.255.255.255" if loopback else ""
