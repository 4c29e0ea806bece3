"""What the master knows of one node from its answers: its clock, what it does, and whether it needs a start.

No sockets. Live links and replayed logs feed the same object.
"""

from __future__ import annotations

from rhot_app.barehand.observations import SliceRequest
from rhot_app.project import Rig
from rhot_app.sources.clock import NodeClockModel
from rhot_app.sources.validation import DatagramValidator, refuse_without_key, tagged_by
from rhot_app.tracking.kinds.edges import REMEMBERED
from rhot_node.wire.codec import Seal, encode
from rhot_node.wire.messages import U32_MAX, ClockReply, ClockRequest, Message, NodeState

SILENT_NS = 700_000_000
"""A node that neither answers nor sends for so long is called silent."""

RESTART_NS = 250_000_000
"""A start is repeated no sooner than this: the node needs a moment to say that it streams."""

UNANSWERED_NS = 300_000_000
"""A paired node that has answered no clock request for so long may have forgotten our key: it is asked for it."""

CLOCK_REPLY = "clock_reply"
"""What `NodeLink.refused_replies` are called where datagrams are counted by reason."""



class NodeLink:
    """One node: requests out, replies in. One thread writes; status may be read from any."""

    def __init__(self, rig: Rig, camera: int) -> None:
        """`camera` is the node's index in the rig."""
        self.node = rig.nodes[camera]
        self.clock = NodeClockModel()
        self.door = DatagramValidator(rig, camera, self.clock)
        self.state: NodeState | None = None
        self.session = 0  # the node's own word
        self.wanted = 0  # the session we told it to stream; 0: none
        self.clock_changes = 0  # boots and steps: what the tracker knows of this node's times is void
        self.refused_replies = 0  # on the command port: forged, repeated or to no question of ours
        self.address_problem = ""  # why nobody can tell where the node is
        self.turned_away = False  # the node lets no encrypted connection of ours in: it does not know us
        self.key_name = ""  # of the link whose key we have
        self.last_reply_ns: int | None = None
        self._seal: Seal | None = None
        self._key_is_new = False  # what the node streams is tagged with another
        self._boot_id: int | None = None
        self._sequence = 0
        self._pending: dict[int, int] = {}
        self._last_start_ns: int | None = None
        self._ready_since_ns: int | None = None
        self._was_ours = False
        if self.paired:
            self.door.open = refuse_without_key

    @property
    def paired(self) -> bool:
        """Whether only tagged datagrams go to and come from the node."""
        return bool(self.node.public_key)

    @property
    def reachable(self) -> bool:
        """Whether what we say to the node can have the tag that it needs."""
        return not self.paired or self._seal is not None

    def encode(self, message: Message) -> bytes:
        """The datagram that says `message` to the node, with a tag when it needs one."""
        return encode(message, self._seal)

    def wants_key(self, now_ns: int) -> bool:
        """Whether the node should be asked for the key of our datagrams, or whether it still knows it."""
        return self._seal is None or now_ns - (self.last_reply_ns or 0) > UNANSWERED_NS

    def use_key(self, name: str, key: bytes) -> None:
        """Tag what we say with `key` and believe only what is tagged with it, from now on."""
        if name != self.key_name:
            self.key_name, self._seal, self._key_is_new = name, Seal(key), True
            self.door.open = tagged_by(self._seal)

    def request(self, t1_master_ns: int) -> ClockRequest:
        """The next clock request, to be sent now; it tells the node which session its master runs."""
        self._sequence = (self._sequence + 1) & U32_MAX
        request = ClockRequest(self.node.node_id, self.wanted, self._sequence, t1_master_ns)
        self.sent(request)
        return request

    def sent(self, request: ClockRequest) -> None:
        """Remember a request, so that only its own answer is believed."""
        self._pending[request.sequence] = request.t1_master_ns
        while len(self._pending) > REMEMBERED:
            del self._pending[next(iter(self._pending))]

    def slices(self, request: SliceRequest) -> list[bytes]:
        """The datagrams that ask the node to search slices; none while it does not stream for us or has no tag."""
        if not self.wanted or self.node.text_datagrams or not self.reachable:
            return []
        size = self.node.intrinsics.width, self.node.intrinsics.height
        return [self.encode(message) for message in self.door.searches.ask(request, self.node.node_id, self.wanted,
                                                                           size)]

    def take_reply(self, reply: ClockReply, t4_master_ns: int) -> bool:
        """Take a reply in that the kernel received at `t4_master_ns`. False when it answers no question of ours."""
        t1_master_ns = self._pending.pop(reply.sequence, None)
        if t1_master_ns is None or t1_master_ns != reply.t1_master_ns:
            self.refused_replies += 1
            return False
        if self.clock.add(t1_master_ns, reply.t2_node_ns, reply.t3_node_ns, t4_master_ns, reply.boot_id):
            self.clock_changes += 1
        if reply.boot_id != self._boot_id:
            self._boot_id = reply.boot_id
            self.door.restart_sequences()  # a daemon that starts anew counts from 0 again
        self.state = reply.state
        self.session = reply.session
        self._was_ours |= self.wanted != 0 and reply.session == self.wanted
        if reply.state is not NodeState.READY or not self.wanted:
            self._ready_since_ns = None
        elif self._ready_since_ns is None:
            self._ready_since_ns = t4_master_ns
        self.last_reply_ns = t4_master_ns
        return True

    def want(self, session: int, now_ns: int) -> None:
        """We are telling the node to stream `session` now (0: nothing), and admit only that."""
        self.wanted = session
        self._was_ours = self._key_is_new = False
        self._last_start_ns = now_ns
        self.door.expect_session(session)

    def wants_start(self, now_ns: int) -> bool:
        """Whether the node answers but does not stream for us, and was not told so just now.

        A node that left our session for another master's is not fought for: the last start wins.
        """
        if not self.wanted or self.node.text_datagrams or self.silent(now_ns):
            return False
        if self._last_start_ns is not None and now_ns - self._last_start_ns < RESTART_NS:
            return False
        return self.state is NodeState.READY or self._key_is_new or (self.streams_elsewhere and not self._was_ours)

    @property
    def streams_elsewhere(self) -> bool:
        """Whether the node streams, but not the session that we want."""
        return self.wanted != 0 and self.state is NodeState.STREAMING and self.session != self.wanted

    def not_started_s(self, now_ns: int) -> float:
        """How long the node has been ready although it was told to stream, s."""
        return 0.0 if self._ready_since_ns is None else 1e-9 * (now_ns - self._ready_since_ns)

    def silent(self, now_ns: int) -> bool:
        """Whether neither an answer nor an accepted datagram came lately."""
        heard_ns = max(self.last_reply_ns or 0, self.door.last_t_receive_ns)
        return heard_ns == 0 or now_ns - heard_ns > SILENT_NS


class RigLinks:
    """What is known of all nodes of a rig, in its order. `starts`: sessions that began."""

    def __init__(self, rig: Rig) -> None:
        self.links = tuple(NodeLink(rig, camera) for camera in range(len(rig.nodes)))
        self.starts = 0

    @property
    def changes(self) -> int:
        """Starts so far, and clocks that were set or came anew: the tracker must then forget."""
        return self.starts + sum(link.clock_changes for link in self.links)

    def configure(self, rig: Rig) -> None:
        """Expect what `rig` says about markers and images; the network is as it was."""
        for camera, link in enumerate(self.links):
            link.node = rig.nodes[camera]
            link.door.configure(rig, camera)
