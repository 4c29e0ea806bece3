"""A paired node whose frames are sent by hand, the rig that knows it, and a master that listens to it."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import msgspec
from findable_nodes import free_udp_port, presence
from patience import eventually
from synthetic_node import synthetic_rig
from trusted_node import TrustedNode

from rhot_app.project import Broadcast, Rig
from rhot_app.recording.raw_log import RecordKind
from rhot_app.sources.links import UdpNodes, new_session
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.clock import NodeClock
from rhot_node.config import NodeSettings
from rhot_node.keys import KeyPair
from rhot_node.network.link import UdpLink
from rhot_node.network.session import LinkKeys
from rhot_node.wire.messages import MarkerObservation, NodeState, Observations

CLOCK = NodeClock(7 * 3600 * 10**9, 20.0, 0)


class StreamingNode(TrustedNode):
    """The control side and the UDP link of a closed node; frames are sent by hand."""

    def __init__(self, folder: Path, udp_port: int = 0, boot_id: int = 1, address: str = "127.0.0.1",
                 broadcast_port: int | None = None) -> None:
        super().__init__(folder, address)
        self.sequence = 0
        self.boot_id = boot_id
        self.broadcast_port = broadcast_port
        self.open_link(udp_port, boot_id)

    def open_link(self, udp_port: int, boot_id: int) -> None:
        settings = NodeSettings(1, "left", synthetic_rig().markers, self.address, udp_port, 0, 0, self.broadcast_port)
        self.link = UdpLink(settings, CLOCK, self.sessions, boot_id,
                            lambda: NodeState.STREAMING if self.sessions.current else NodeState.READY, self.keys)
        self.link.introduce = lambda: dataclasses.replace(
            presence(1, boot_id=boot_id, udp_port=self.link.port), control_port=self.server.control_port)
        self.link.start()

    def restart(self) -> None:
        """Another run of the daemon: links and session are forgotten, keys and ports stay."""
        port = self.link.port
        self.link.close()
        self.sessions.stop(0)
        self.keys = LinkKeys()
        self.responder.keys = self.keys
        self.boot_id += 1
        self.open_link(port, self.boot_id)

    def frame(self, rig: Rig) -> Observations:
        stream = self.sessions.current
        assert stream is not None
        now_ns = CLOCK.now_ns()
        markers = tuple(MarkerObservation(k, 100.0 + k, 50.0, 16.0, 0.01, 0.0, 0.01, 0.5) for k in range(6))
        self.sequence += 1
        return Observations(1, stream.session, self.sequence, now_ns - 8_000_000, now_ns, 5_000_000, 4_000_000, 10_000,
                            640, 480, self.sequence, rig.markers.checksum, markers)

    def send_frame(self, rig: Rig) -> None:
        stream = self.sessions.current
        assert stream is not None
        assert self.link.send(self.frame(rig), stream)

    def close(self) -> None:
        self.link.close()
        super().close()


class Records(list[tuple[RecordKind, int, int, bytes]]):
    """A tap that keeps what it sees."""

    def put(self, kind: RecordKind, node_id: int, t_master_ns: int, data: bytes) -> None:
        self.append((kind, node_id, t_master_ns, data))

    def of(self, kind: RecordKind) -> list[bytes]:
        return [data for one, _, _, data in self if one is kind]


class Setup:
    """One node, the rig that knows it, and a master."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.broadcast_port = free_udp_port()
        self.node = StreamingNode(folder, broadcast_port=self.broadcast_port)
        self.own = self.node.admit()
        rig = synthetic_rig()
        left = msgspec.structs.replace(
            rig.nodes[0], udp_port=self.node.link.port, control_port=self.node.server.control_port,
            public_key=self.node.trust.own.public_key)
        self.rig = msgspec.structs.replace(rig, nodes=(left,),
                                           broadcast=Broadcast("127.255.255.255", self.broadcast_port))
        self.frames: list[CameraObservations] = []
        self.records = Records()
        self.source = self.connect(self.own)

    def move(self, address: str) -> None:
        """The node's machine is started again and gets another address; the node has other ports there too."""
        self.node.close()
        self.node = StreamingNode(self.folder, boot_id=2, address=address, broadcast_port=self.broadcast_port)

    def connect(self, own: KeyPair | None) -> UdpNodes:
        self.sent = 0
        source = UdpNodes(self.rig, own)
        source.deliver_to(self.frames.extend)
        source.record_to(self.records)
        return source

    def run(self) -> None:
        """Start, and wait until a frame of the node has come through."""
        eventually(lambda: self.source.links[0].clock.offset_s is not None)
        self.source.start(new_session())
        self.stream()

    def stream(self) -> None:
        """Send frames until one came through, and all that were sent have come."""
        before = len(self.frames)

        def arrived() -> bool:
            stream = self.node.sessions.current
            if stream is not None and stream.session == self.source.links[0].wanted:
                self.node.send_frame(self.rig)
                self.sent += 1
            return len(self.frames) > before
        received = self.source.links[0].door.received - self.sent  # others' datagrams
        eventually(arrived)
        eventually(lambda: self.source.links[0].door.received >= received + self.sent)

    def close(self) -> None:
        self.source.close()
        self.node.close()
