"""The rig's nodes, live: a port and a thread for the data of each, and one more for clocks, start and stop."""

from __future__ import annotations

import contextlib
import functools
import ipaddress
import logging
import secrets
import socket
import threading
import time
from collections import deque
from collections.abc import Callable

from rhot_app.barehand.observations import SliceRequest
from rhot_app.project import Rig
from rhot_app.recording.raw_log import RecordKind, RecordSink
from rhot_app.sources.key_exchange import KeyExchange
from rhot_app.sources.lost_nodes import LostNodes
from rhot_app.sources.node_link import NodeLink, RigLinks
from rhot_app.sources.poses.followed import FollowedObjects
from rhot_app.sources.poses.open_source import why
from rhot_app.sources.receiver import DatagramSink, Deliver, NodeReceiver, open_data_socket
from rhot_node.clock import ANCILLARY_SIZE, KernelTime, ask_for_times
from rhot_node.errors import WireError, printable
from rhot_node.keys import KeyPair
from rhot_node.threads import Worker
from rhot_node.wire.codec import encode, node_of
from rhot_node.wire.fields import RECEIVE_MAX
from rhot_node.wire.messages import ClockReply, Message, Start, StartEntry, Stop

REQUEST_NS = 100_000_000
"""Each node is asked for its time ten times a second."""

EAGER_NS = 25_000_000
"""... and four times as often while its clock is not known or in doubt, so that nothing has to wait for it."""

RECENT = 40
"""Requests and replies per node that are kept for a recording that begins later: two seconds."""

_RESOLVE_S = 2.0  # between tries to find the address of a node that is named, not numbered

log = logging.getLogger(__name__)


def new_session() -> int:
    """A session number that no node has seen."""
    return secrets.randbits(62) | 1


class UdpNodes(RigLinks):
    """`ObservationSource` of the rig's nodes. Receives as soon as it is made; admits frames once started. `step` waits
    for answers to commands and sends what is due, in a thread of its own."""

    live = True
    log_path = ""

    def __init__(self, rig: Rig, own: KeyPair | None = None) -> None:
        """Open all ports; `own`: the master's keys, which paired nodes ask for. Raises SourceError when a port is taken
        or keys are missing; nothing stays open then."""
        super().__init__(rig)
        with contextlib.ExitStack() as stack:
            sockets = []
            for node in rig.nodes:
                sockets.append(open_data_socket(node.data_port, node.name))
                stack.callback(sockets[-1].close)
            self.receivers = tuple(NodeReceiver(sock, link.door, link.node.name)
                                   for sock, link in zip(sockets, self.links, strict=True))
            self._keys = KeyExchange(self.links, own)
            stack.callback(self._keys.close)
            self._tap: RecordSink | None = None
            self._recent: deque[tuple[RecordKind, int, int, bytes]] = deque(maxlen=RECENT * len(self.links))
            # text nodes are not spoken to
            spoken_to = [(link, receiver) for link, receiver in zip(self.links, self.receivers, strict=True)
                         if not link.node.text_datagrams]
            self._links = {link.node.node_id: link for link, _ in spoken_to}
            self._entries = {link.node.node_id: StartEntry(link.node.node_id, receiver.port, 0)
                             for link, receiver in spoken_to}
            self._broadcast = (rig.broadcast.address, rig.broadcast.port)
            self._addresses: dict[int, str | None] = {}
            for node_id, link in self._links.items():
                with contextlib.suppress(ValueError):
                    self._addresses[node_id] = str(ipaddress.ip_address(link.node.address))
            self._named = [link for node_id, link in self._links.items() if node_id not in self._addresses]
            self._lost = LostNodes(list(self._links.values()), rig.broadcast.port, time.monotonic_ns())
            stack.callback(self._lost.close)
            self._due_ns = dict.fromkeys(self._links, 0)
            self._sequence = 0
            self._lock = threading.Lock()
            self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            stack.callback(self._socket.close)
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
            self._socket.bind(("", 0))
            ask_for_times(self._socket)
            self._followed = FollowedObjects(rig)
            stack.pop_all()
        self._kernel_time = KernelTime()
        self._worker = Worker("commands the nodes", lambda: self.step(0.02))
        self._resolver = Worker("looks up the nodes' addresses", self._resolve, hang_s=None)
        for receiver in self.receivers:
            receiver.start()
        self._followed.start()
        self._worker.start()
        if self._named:
            self._resolver.start()

    def deliver_to(self, deliver: Deliver) -> None:
        """Hand frames to `deliver` from now on, each camera's in its own thread."""
        for receiver in self.receivers:
            receiver.deliver = deliver
        self._followed.deliver = deliver

    def notices(self) -> list[str]:
        """What is wrong with the trackers that follow objects. Links and receivers speak for themselves."""
        return self._followed.notices()

    def start(self, session: int) -> None:
        """Admit `session` and tell every node to stream it."""
        with self._lock:
            now_ns = time.monotonic_ns()
            for link in self.links:
                link.want(session, now_ns)
            self.starts += 1
            self._tell(RecordKind.START, functools.partial(self._start, session), now_ns)

    def stop(self) -> None:
        """Tell every node to stop what it streams for us, twice, because nobody asks again; admit nothing more."""
        with self._lock:
            now_ns = time.monotonic_ns()
            for session in {link.wanted for link in self._links.values() if link.wanted}:
                self._tell(RecordKind.STOP, functools.partial(self._stop, session), now_ns, times=2)
            for link in self.links:
                link.want(0, now_ns)

    def search(self, request: SliceRequest) -> None:
        """Ask a node to search its next frames. May be called by any thread."""
        link = self.links[request.camera]
        with self._lock:
            for datagram in link.slices(request):
                self._send(link, datagram)
                self._note(RecordKind.SLICES, link.node.node_id, time.monotonic_ns(), datagram)

    def record_to(self, tap: RecordSink | None) -> None:
        """Hand everything to `tap` from now on, None: to nobody. First the running session and the last exchanges,
        without which a recording that begins now could not tell the nodes' times: datagrams mean nothing before."""
        with self._lock:
            if tap is not None:
                for node_id, link in self._links.items():
                    if link.wanted:
                        datagram = encode(self._start(link.wanted, [self._entries[node_id]]))
                        tap.put(RecordKind.START, node_id, time.monotonic_ns(), datagram)
                for record in list(self._recent):
                    tap.put(*record)
            self._tap = tap
        for link, receiver in zip(self.links, self.receivers, strict=True):
            before, receiver.sink = receiver.sink, None if tap is None else DatagramSink(tap, link)
            if before is not None:
                before.close()
        self._followed.tap = tap

    def step(self, timeout_s: float) -> None:
        """Wait up to `timeout_s` for one answer, take in all that wait, then send what is due."""
        self._socket.settimeout(timeout_s)
        try:
            self._receive(0)
            while True:
                self._receive(socket.MSG_DONTWAIT)
        except (TimeoutError, BlockingIOError):
            pass
        except OSError as exc:  # an unreachable host answers with an ICMP error on some systems
            log.debug("command socket: %s", exc)
        now_ns = time.monotonic_ns()
        with self._lock:
            self._lost.step(now_ns)
        for link in self._links.values():
            self._keys.reach(link, self._lost.places(link))
        self._keys.step(now_ns)
        with self._lock:
            for node_id, link in self._links.items():
                if link.wants_start(now_ns):
                    self._start_again(link, now_ns)
                wait_ns = EAGER_NS - REQUEST_NS if link.door.clock_in_doubt else 0
                if now_ns >= self._due_ns[node_id] + wait_ns and link.reachable:
                    self._ask(link, now_ns)

    def close(self) -> None:
        """End the threads and close all ports. May be called twice."""
        self._followed.close()
        self._resolver.close(0.0)  # the system may take its time over a name
        self._worker.close()
        self._lost.close()
        self._keys.close()
        self._socket.close()
        for receiver in self.receivers:
            receiver.close()

    def _receive(self, flags: int) -> None:
        data, ancillary, _, sender = self._socket.recvmsg(RECEIVE_MAX, ANCILLARY_SIZE, flags)
        t_receive_ns, _ = self._kernel_time.receive_time_ns(ancillary)
        try:
            link = self._links.get(node_of(data))
        except WireError:
            return
        if link is None:
            return
        try:
            reply = link.door.open(data)
        except WireError:
            link.refused_replies += 1
            return
        if isinstance(reply, ClockReply) and link.take_reply(reply, t_receive_ns):
            self._note(RecordKind.CLOCK_REPLY, reply.node_id, t_receive_ns, data)
            self._look_where(link, sender)

    def _look_where(self, link: NodeLink, sender: tuple[str, int]) -> None:
        """What the node alone can answer came from one of the places where it may be: it is there from now on."""
        place = self._lost.at(link, sender)
        if place is not None:
            log.warning("node %s has moved from %s to %s", link.node.name, link.node.address, place.address)
            link.node = place
            self._addresses[place.node_id] = place.address

    def _ask(self, link: NodeLink, now_ns: int) -> None:
        known = link.clock.estimate_at(now_ns) is not None or link.silent(now_ns)
        self._due_ns[link.node.node_id] = now_ns + (REQUEST_NS if known else EAGER_NS)
        t1_ns = time.monotonic_ns()
        datagram = link.encode(link.request(t1_ns))
        self._send(link, datagram)
        self._note(RecordKind.CLOCK_REQUEST, link.node.node_id, t1_ns, datagram)

    def _start_again(self, link: NodeLink, now_ns: int) -> None:
        """A node that starts anew or was without us for long takes no old session up: it gets one of its own."""
        session = new_session()
        log.info("node %s is started again, session %d", link.node.name, session)
        datagram = link.encode(self._start(session, [self._entries[link.node.node_id]]))
        self._note(RecordKind.START, link.node.node_id, now_ns, datagram)
        link.want(session, now_ns)
        self._send(link, datagram)

    def _tell(self, kind: RecordKind, message: Callable[[list[StartEntry]], Message], now_ns: int,
              times: int = 1) -> None:
        """Tell open nodes by broadcast (RHOT 7.1) and each at its own address; tell each paired node with its own key,
        which no broadcast could have. A paired node without a key is told when it has one and says that it is ready."""
        open_links = [link for link in self._links.values() if not link.paired]
        if open_links:
            datagram = encode(message([self._entries[link.node.node_id] for link in open_links]))
            self._note(kind, 0, now_ns, datagram)
            for _ in range(times):
                self._send_broadcast(datagram)
                for link in open_links:
                    self._send(link, datagram)
        for node_id, link in self._links.items():
            if link.paired and link.reachable:
                datagram = link.encode(message([self._entries[node_id]]))
                self._note(kind, node_id, now_ns, datagram)
                for _ in range(times):
                    self._send(link, datagram)

    def _start(self, session: int, entries: list[StartEntry]) -> Start:
        self._sequence += 1
        return Start(session, self._sequence, tuple(entries))

    def _stop(self, session: int, _entries: list[StartEntry]) -> Stop:
        self._sequence += 1
        return Stop(session, self._sequence)

    def _send(self, link: NodeLink, datagram: bytes) -> None:
        """To where the node is, and to every place where it may be."""
        address = self._addresses.get(link.node.node_id)
        known = [] if address is None else [(address, link.node.udp_port)]
        for target in [*known, *((place.address, place.udp_port) for place in self._lost.places(link))]:
            try:
                self._socket.sendto(datagram, target)
            except OSError as exc:  # unreachable now; the node is shown as silent until it answers
                log.debug("node %s: %s", link.node.name, exc)

    def _send_broadcast(self, datagram: bytes) -> None:
        try:
            self._socket.sendto(datagram, self._broadcast)
        except OSError as exc:  # every node is told at its own address too
            log.info("broadcast to %s: %s", self._broadcast[0], exc.strerror)

    def _note(self, kind: RecordKind, node_id: int, t_master_ns: int, data: bytes) -> None:
        if kind in (RecordKind.CLOCK_REQUEST, RecordKind.CLOCK_REPLY):
            self._recent.append((kind, node_id, t_master_ns, data))
        if self._tap is not None:
            self._tap.put(kind, node_id, t_master_ns, data)

    def _resolve(self) -> None:
        """Look up named nodes, again and again: a node that appears later or moves is found."""
        for link in self._named:
            try:
                self._addresses[link.node.node_id] = socket.gethostbyname(link.node.address)
                link.address_problem = ""
            except (OSError, ValueError) as exc:  # ValueError: a name that none can have
                link.address_problem = (f"Its address {printable(link.node.address, 100)} is not found ({why(exc)}). "
                                        "Correct it in the rig, or switch the node on.")
        found = all(self._addresses.get(link.node.node_id) for link in self._named)
        self._resolver.ending.wait(_RESOLVE_S if not found else 10 * _RESOLVE_S)
