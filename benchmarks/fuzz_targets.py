"""What `fuzz.py` throws datagrams at: a master's door, a master's command port, a node's link. Time stands still."""

from __future__ import annotations

import socket
import sys
from pathlib import Path
from typing import Protocol

import msgspec
import numpy as np

from rhot_app.barehand.observations import EdgeFrame, ForegroundFrame, SliceRequest
from rhot_app.project import Rig
from rhot_app.sources.node_link import NodeLink
from rhot_app.sources.validation import OLDEST_FRAME_NS
from rhot_app.tracking.kinds.edges import REMEMBERED
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.clock import NodeClock
from rhot_node.config import NodeSettings
from rhot_node.detect.edges import EDGES_MAX, find_edges
from rhot_node.detect.foreground import no_foreground
from rhot_node.errors import WireError
from rhot_node.files import resource_path
from rhot_node.foreground_store import ForegroundStore
from rhot_node.markers import load_markers
from rhot_node.network.link import UdpLink
from rhot_node.network.presence import Presence
from rhot_node.network.session import Link, LinkKeys, Sessions
from rhot_node.slice_search import SliceSearch
from rhot_node.wire.codec import Seal, encode
from rhot_node.wire.messages import (
    ClockReply,
    ClockRequest,
    Find,
    ForegroundPart,
    HandLandmarks,
    LandmarkedHand,
    MarkerFlag,
    MarkerObservation,
    Message,
    NodeState,
    Observations,
    SliceEdges,
    Slices,
    Start,
    StartEntry,
    Stop,
    TrustState,
)
from rhot_node.wire.search import SLICES_MAX, pack_edges, pack_map, pack_slices

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from synthetic_node import synthetic_rig

NOW_NS = 5 * 10**12
SLACK_NS = 5_000_000
SESSION = 1 << 40
KEY = bytes(range(32))
RIG = synthetic_rig()
LANDMARK_RIG = msgspec.structs.replace(RIG, markers=load_markers(resource_path("markers", "landmarks21.json")))
MAP_STEP = 8
SLICES = np.array([[x, 240.0, 0.0, 1.0, 9.0] for x in np.linspace(20.0, 600.0, 40)])
SEARCHED = 64
"""So many requests are taken for one that is searched, which takes as long as all of these."""


class WronglyTakenError(Exception):
    """Something was taken that must not be."""


class Target(Protocol):
    """One receiver of datagrams."""

    name: str
    seal: Seal

    def renew(self) -> None:
        """Begin anew with numbers, as a new session or link does."""
        ...

    def genuine(self) -> list[bytes]:
        """The next datagrams that must be taken, tagged."""
        ...

    def public(self) -> list[bytes]:
        """What anybody may say, and which changes nothing."""
        ...

    def feed(self, data: bytes) -> bool:
        """Whether a datagram was taken for one of ours; raises WronglyTakenError when it is not plausible."""
        ...

    def refused(self) -> dict[str, int]:
        """Datagrams that were not taken, by reason."""
        ...


def paired_link(rig: Rig = RIG) -> NodeLink:
    """A master's link to a paired node whose clock it knows."""
    node = msgspec.structs.replace(rig.nodes[0], public_key="0" * 64)
    link = NodeLink(msgspec.structs.replace(rig, nodes=(node, rig.nodes[1])), 0)
    link.use_key("fuzz", KEY)
    for k in range(5):
        t = NOW_NS - (5 - k) * 10**8
        link.clock.add(t, t + 50_000, t + 50_000, t + 100_000, 1)
    return link


class Door:
    """A master's data port."""

    name = "door"
    seal = Seal(KEY)

    def __init__(self, rig: Rig = RIG) -> None:
        self._link, self._markers = paired_link(rig), len(rig.markers.markers)
        self._session = SESSION
        self.renew()

    def renew(self) -> None:
        """Another session."""
        self._session, self._sequence = self._session + 1, 0
        self._link.want(self._session, NOW_NS)

    def genuine(self) -> list[bytes]:
        """The node's next frame."""
        markers = tuple(MarkerObservation(k, 100.0 + k, 200.0, 16.0, 0.01, 0.001, 0.02, 0.9) for k in range(6))
        self._sequence += 1
        frame = Observations(1, self._session, self._sequence, NOW_NS - 9_000_000, NOW_NS - 200_000, 10**6, 10**6,
                             10**4, 640, 480, self._sequence, RIG.markers.checksum, markers)
        return [encode(frame, self.seal)]

    def public(self) -> list[bytes]:
        """Nothing."""
        return []

    def feed(self, data: bytes) -> bool:
        """Through the door and into arrays, as in the receiver."""
        frame = self._link.door.admit(data, NOW_NS)
        if isinstance(frame, CameraObservations):
            check_frame(frame, self._markers)
        elif frame is not None:
            check_search(frame)
        return frame is not None

    def refused(self) -> dict[str, int]:
        """The door's own count."""
        return self._link.door.dropped


def check_frame(frame: CameraObservations, markers: int) -> None:
    """The oracle: a camera of 640 x 480 px could have seen this a moment ago."""
    lost = (frame.flags & MarkerFlag.LOST) != 0
    seen, xx, yy, xy = (frame.pixels[~lost], frame.covariances[:, 0, 0], frame.covariances[:, 1, 1],
                        frame.covariances[:, 0, 1])
    sound = (frame.pixels.shape == (markers, 2) and np.isnan(frame.pixels[lost]).all()
             and ((seen >= -64.0) & (seen <= (703.0, 543.0))).all()
             and ((xx >= 0.0) & (yy >= 0.0) & (xx <= 1e8) & (yy <= 1e8)).all()
             and (xy * xy <= xx * yy * 1.00001 + 1e-29).all()
             and ((frame.diameters[~lost] > 0.0) & (frame.diameters[~lost] <= 1280.0)).all()
             and ((frame.qualities >= 0.0) & (frame.qualities <= 1.0)).all() and (frame.flags < 64).all()
             and NOW_NS - OLDEST_FRAME_NS <= frame.t_row0_master_ns <= NOW_NS + SLACK_NS)
    if not sound:
        raise WronglyTakenError(f"an implausible frame was taken: {frame}")


class Landmarks(Door):
    """A master's data port, for the landmarks that a node's hand networks find."""

    name = "landmarks"

    def __init__(self) -> None:
        super().__init__(LANDMARK_RIG)

    def genuine(self) -> list[bytes]:
        """The hands of the node's next frame."""
        self._sequence += 1
        hands = tuple(LandmarkedHand(0.9, right, tuple((x + 8.0 * k, 200.0, 2.0, 0.5, 1.5) for k in range(21)))
                      for x, right in ((20.0, 0.9), (300.0, 0.1)))
        return [encode(HandLandmarks(1, self._session, self._sequence, NOW_NS - 9_000_000, NOW_NS - 200_000, 10**6,
                                     10**6, 10**4, 640, 480, self._sequence, hands), self.seal)]


class Searches(Door):
    """A master's data port, for the edges and foreground maps that a node was asked for."""

    name = "searches"

    def renew(self) -> None:
        """Another session, and a request in it."""
        super().renew()
        request, = self._link.door.searches.ask(SliceRequest(0, SLICES, MAP_STEP), 1, self._session, (640, 480))
        self._request, self._frame = request.request, 0

    def genuine(self) -> list[bytes]:
        """The edges and the map of the node's next frame."""
        self._sequence += 1
        self._frame += 1
        head = (1, self._session, self._sequence, NOW_NS - 9_000_000, NOW_NS - 200_000, 10**6, 10**6, 10**4, 640, 480,
                self._frame, self._request)
        edges = pack_edges(np.arange(len(SLICES)), np.tile([1.5, 0.2, -9.0, 0.9, 0.1], (len(SLICES), 1)))
        shown = pack_map(np.linspace(0.0, 1.0, 4800, dtype=np.float32).reshape(60, 80))
        return [encode(SliceEdges(*head, len(SLICES), 0, 1, edges), self.seal),
                encode(ForegroundPart(*head, MAP_STEP, 0, 1, shown), self.seal)]


def check_search(frame: EdgeFrame | ForegroundFrame) -> None:
    """The oracle: a camera of 640 x 480 px could have answered so."""
    sound = NOW_NS - OLDEST_FRAME_NS <= frame.t_row0_master_ns <= NOW_NS + SLACK_NS
    if isinstance(frame, ForegroundFrame):
        shown = frame.probability
        sound &= (shown.shape == (480 // frame.step, 640 // frame.step) and bool(np.isfinite(shown).all())
                  and bool(((shown >= 0.0) & (shown <= 1.0)).all()))
    else:
        edges, valid = frame.edges, np.arange(EDGES_MAX) < frame.edges.number[:, None]
        sound &= (len(edges.number) == len(SLICES) and bool((edges.number <= EDGES_MAX).all())
                  and all(bool(np.isfinite(one).all()) for one in edges[1:]) and bool((edges.sd[valid] > 0.0).all())
                  and all(bool(((one >= 0.0) & (one <= 1.0)).all()) for one in (edges.inside, edges.outside)))
    if not sound:
        raise WronglyTakenError(f"an implausible answer was taken: {frame}")


class Replies:
    """A master's command port: answers to its clock requests."""

    name = "replies"
    seal = Seal(KEY)

    def __init__(self) -> None:
        self._link = paired_link()
        self._refused: dict[str, int] = {}

    def renew(self) -> None:
        """A node that lied about its clock is restarted."""
        self._link = paired_link()

    def genuine(self) -> list[bytes]:
        """The answer to the next question."""
        request = self._link.request(NOW_NS - 300_000)
        return [encode(ClockReply(1, 0, request.sequence, request.t1_master_ns, NOW_NS - 200_000, NOW_NS - 100_000, 1,
                                  NodeState.READY), self.seal)]

    def public(self) -> list[bytes]:
        """Nothing."""
        return []

    def feed(self, data: bytes) -> bool:
        """As the command socket's thread does it, which has asked the next question meanwhile."""
        self._link.request(NOW_NS - 300_000)
        try:
            reply = self._link.door.open(data)
        except WireError as exc:
            self._refused[exc.reason] = self._refused.get(exc.reason, 0) + 1
            return False
        taken = isinstance(reply, ClockReply) and self._link.take_reply(reply, NOW_NS)
        if taken and len(self._link._pending) > REMEMBERED:
            raise WronglyTakenError("questions pile up")
        if not taken:
            self._refused["unasked"] = self._refused.get("unasked", 0) + 1
        return taken

    def refused(self) -> dict[str, int]:
        """By reason; `unasked` answers no question."""
        return self._refused


class CountedKeys(LinkKeys):
    """Counts what was taken for a master's."""

    taken = 0

    def open(self, data: bytes) -> tuple[Message, Link]:
        """As the keys do."""
        opened = super().open(data)
        self.taken += 1
        return opened


class NodeSide:
    """A node's link. Its answers go to a socket that nobody reads."""

    name = "node"

    def __init__(self) -> None:
        settings = NodeSettings(1, "left", RIG.markers, "127.0.0.1", 0, 0, 0, None)
        self._drain = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._drain.bind(("127.0.0.1", 0))
        self._sender = self._drain.getsockname()
        self._keys, self._sessions = CountedKeys(), Sessions()
        self._udp = UdpLink(settings, NodeClock(), self._sessions, 7, lambda: NodeState.READY, self._keys)
        self._udp.introduce = lambda: Presence(1, 7, "left", 1, 2, 3, 4, TrustState.PAIRED)
        self._search = SliceSearch(1, NodeClock(), ForegroundStore(None))
        self._udp.take_slices = self._search.take
        self._image, self._searched = np.zeros((480, 640, 3), np.uint8), 0
        self._session = SESSION
        self.renew()

    def renew(self) -> None:
        """Another link, as after a restart of the master; eight stay known."""
        self.seal = self._keys.grant("fuzz").seal
        self._sequence = 0

    def genuine(self) -> list[bytes]:
        """What a master says next."""
        self._sequence += 1
        self._session += 1
        messages: list[Message] = [
            ClockRequest(1, self._session, self._sequence, NOW_NS),
            Start(self._session, self._sequence, (StartEntry(1, 50_001, 0), StartEntry(2, 50_002, 0))),
            Slices(1, self._session, self._sequence, self._sequence, 640, 480, len(SLICES), 0, 1, MAP_STEP,
                   pack_slices(SLICES)),
            Stop(self._session, self._sequence)]
        return [encode(message, self.seal) for message in messages]

    def public(self) -> list[bytes]:
        """A question who is there."""
        return [encode(Find(1, self._sequence, 77))]

    def feed(self, data: bytes) -> bool:
        """As the link's thread does it."""
        before = self._keys.taken
        self._udp.take(data, self._sender, NOW_NS)
        stream = self._sessions.current
        if stream is not None and (stream.address[0] != self._sender[0] or not 1 <= stream.address[1] <= 65535):
            raise WronglyTakenError(f"the node streams to {stream}")
        if self._search.found >= self._searched + SEARCHED:
            self._search_image()
        return self._keys.taken > before

    def _search_image(self) -> None:
        """As the search's thread does it with the request that was taken last."""
        self._searched, order = self._search.found, self._search._order
        assert order is not None
        edges = find_edges(self._image, order.slices, no_foreground(), 1.0)
        if len(order.slices) > SLICES_MAX or edges.number.any():
            raise WronglyTakenError(f"edges in a black picture, or too many slices: {len(order.slices)}")

    def refused(self) -> dict[str, int]:
        """The link's own count."""
        return self._udp.dropped
