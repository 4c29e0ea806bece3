"""Live nodes: a port and a thread for each, one more for clocks, start and stop."""

from __future__ import annotations

import contextlib
import time

from rhot_app.project import Rig
from rhot_app.recording.raw_log import RecordKind
from rhot_app.sources.links import NodeLinks
from rhot_app.sources.node_link import NodeLink
from rhot_app.sources.receiver import DatagramTap, Deliver, NodeReceiver, open_data_socket
from rhot_app.sources.record_sink import RecordSink
from rhot_node.keys import KeyPair


class UdpNodes:
    """`ObservationSource` of the rig's nodes. Receives as soon as it is made; admits frames once started."""

    live = True
    log_path = ""

    def __init__(self, rig: Rig, own: KeyPair | None = None) -> None:
        """Open all ports; `own`: the master's keys, which paired nodes ask for. Raises SourceError when a port is taken
        or keys are missing; nothing stays open then."""
        self.links = tuple(NodeLink(rig, camera) for camera in range(len(rig.nodes)))
        self._starts = 0
        with contextlib.ExitStack() as stack:
            sockets = []
            for node in rig.nodes:
                sockets.append(open_data_socket(node.data_port, node.name))
                stack.callback(sockets[-1].close)
            self.receivers = tuple(NodeReceiver(sock, link.door, link.node.name)
                                   for sock, link in zip(sockets, self.links, strict=True))
            self._commands = NodeLinks(rig, list(self.links), [receiver.port for receiver in self.receivers],
                                       own)
            stack.pop_all()
        for receiver in self.receivers:
            receiver.start()
        self._commands.start_thread()

    @property
    def changes(self) -> int:
        """Starts so far, and clocks that were set or came anew."""
        return self._starts + sum(link.clock_changes for link in self.links)

    def deliver_to(self, deliver: Deliver) -> None:
        """Hand frames to `deliver` from now on, each camera's in its own thread."""
        for receiver in self.receivers:
            receiver.deliver = deliver

    def notices(self) -> list[str]:
        """A live source has nothing to say about itself: its links and receivers do."""
        return []

    def configure(self, rig: Rig) -> None:
        """Expect what `rig` says about markers and images; the network is as it was."""
        for camera, link in enumerate(self.links):
            link.node = rig.nodes[camera]
            link.door.configure(rig, camera)

    def start(self, session: int) -> None:
        """Admit `session` and tell every node to stream it."""
        for link in self.links:
            link.want(session, time.monotonic_ns())
        self._starts += 1
        self._commands.start(session)

    def stop(self) -> None:
        """Tell every node to stop, and admit nothing more."""
        self._commands.stop()
        for link in self.links:
            link.want(0, time.monotonic_ns())

    def record_to(self, tap: RecordSink | None) -> None:
        """Tap all sockets; None ends it."""
        self._commands.record_to(tap)  # first what is known of sessions and clocks: datagrams mean nothing before
        for link, receiver in zip(self.links, self.receivers, strict=True):
            receiver.tap = None if tap is None else _datagram_tap(tap, link.node.node_id)

    def close(self) -> None:
        """Close all ports."""
        self._commands.close()
        for receiver in self.receivers:
            receiver.close()


def _datagram_tap(tap: RecordSink, node_id: int) -> DatagramTap:
    def put(t_receive_ns: int, data: bytes) -> None:
        tap.put(RecordKind.DATAGRAM, node_id, t_receive_ns, data)
    return put
