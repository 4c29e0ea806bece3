"""The door of one node: every datagram, live or from a log, is verified here and counted, or becomes observations.

No sockets and no threads. Nothing in a datagram raises past `NodeDoor.admit`.
"""

from __future__ import annotations

from rhot_app.project import Rig, RigNode
from rhot_app.sources.admission import ANYBODY
from rhot_app.sources.clock import NodeClockModel
from rhot_app.sources.text_frames import TextReader
from rhot_app.sources.travel_times import TravelTimes
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.errors import WireError
from rhot_node.wire.marker_table import MarkerTable
from rhot_node.wire.messages import Observations
from rhot_node.wire.sequence import SequenceWindow, Verdict

OLDEST_FRAME_NS = 1_000_000_000
"""A frame taken longer ago than this is not worth a state, or its time is wrong."""

Verified = tuple[Observations, int, int, int, float] | CameraObservations
"""A message with its row-0, send and receive times, master ns, and clock bound, s; text needs no second half."""

_CLOCK_SLACK_NS = 1_000_000  # scheduling between the stamps at both ends


class NodeDoor:
    """Verifies and counts one node's datagrams. Written by one thread; the counters may be read from others."""

    def __init__(self, rig: Rig, camera: int, clock: NodeClockModel) -> None:
        """`camera` is the node's index in the rig."""
        self.clock = clock
        self.admission = ANYBODY
        self.sequence = SequenceWindow()
        self.received = 0  # datagrams of any kind
        self.accepted = 0
        self.dropped: dict[str, int] = {}
        self.image_size: tuple[int, int] | None = None  # of the last refused frame of another size
        self.last_t_receive_ns = 0  # of the last accepted one
        self._travel = TravelTimes()
        self._session = 0
        self.configure(rig, camera)

    def configure(self, rig: Rig, camera: int) -> None:
        """Expect what the rig says about this node: marker set, image size, text or binary."""
        node: RigNode = rig.nodes[camera]
        self._camera = camera
        self._node_id = node.node_id
        self._count = len(rig.markers.markers)
        self._checksum = rig.markers.checksum
        self._size = (node.intrinsics.width, node.intrinsics.height)
        self._time_offset_ns = round(1e9 * node.time_offset_s)
        self._text = TextReader(camera, self._count, self._size, self._time_offset_ns) if node.text_datagrams else None

    @property
    def clock_in_doubt(self) -> bool:
        """Whether datagrams are dropped until another clock exchange has been made."""
        return self._travel.in_doubt

    def expect_session(self, session: int) -> None:
        """Admit only datagrams of `session` from now on (0: none), counted from a new first number."""
        self._session = session
        self.sequence.restart()

    def admit(self, data: bytes, t_receive_ns: int) -> CameraObservations | None:
        """The datagram as observations, or None when it was dropped and counted."""
        verified = self.verify(data, t_receive_ns)
        return None if verified is None else self.convert(verified)

    def drop(self, reason: str, count: int = 1) -> None:
        """Count `count` datagrams as dropped for `reason`."""
        self.dropped[reason] = self.dropped.get(reason, 0) + count

    def verify(self, data: bytes, t_receive_ns: int) -> Verified | None:
        """First half of `admit`, cheap enough for a flood: everything is counted, nothing is built yet."""
        self.received += 1
        try:
            verified = self._verify_text(data, t_receive_ns) if self._text else self._verify(data, t_receive_ns)
        except WireError as exc:
            self.drop(exc.reason)
            return None
        if isinstance(verified, str):
            self.drop(verified)
            return None
        self.accepted += 1
        self.last_t_receive_ns = t_receive_ns
        return verified

    def convert(self, verified: Verified) -> CameraObservations:
        """Second half of `admit`: arrays in the rig's marker order, times in master time."""
        return verified if isinstance(verified, CameraObservations) else self._build(*verified)

    def _verify_text(self, data: bytes, t_receive_ns: int) -> Verified | str:
        if not self._session:
            return "not_started"
        assert self._text is not None
        return self._text.read(data, t_receive_ns)

    def _verify(self, data: bytes, t_receive_ns: int) -> Verified | str:
        message = self.admission.open(data)
        if not isinstance(message, Observations):
            return "kind"
        reason = self._objection(message)
        if reason is not None:
            return reason
        estimate = self.clock.estimate_at(t_receive_ns)
        if estimate is None:
            self.sequence.take(message.sequence)  # it came, so it is not lost
            return "no_clock"
        t_row0_ns = estimate.to_master_ns(message.t_frame_node_ns) + self._time_offset_ns
        t_send_ns = estimate.to_master_ns(message.t_send_node_ns)
        bound_s = estimate.bound_s(t_receive_ns)
        if not self._plausible(t_row0_ns, t_send_ns, t_receive_ns, bound_s):
            return "time"
        self.sequence.take(message.sequence)  # also what is refused for its clock has come
        if not self._travel.believed(t_receive_ns - t_send_ns, t_receive_ns, estimate):
            return "clock_in_doubt"
        return message, t_row0_ns, t_send_ns, t_receive_ns, bound_s

    def _objection(self, message: Observations) -> str | None:
        """Why this message is not one of the stream we asked for; None when it is."""
        if message.node_id != self._node_id:
            return "foreign_node"
        if message.session != self._session:
            return "session" if self._session else "not_started"
        verdict = self.sequence.judge(message.sequence)
        if verdict is not Verdict.FRESH and verdict is not Verdict.LATE:
            return verdict.name.lower()
        if message.marker_checksum != self._checksum or message.marker_count != self._count:
            return "marker_set"
        if (message.width, message.height) != self._size:
            self.image_size = (message.width, message.height)
            return "image_size"
        return None

    def _plausible(self, t_row0_ns: int, t_send_ns: int, t_receive_ns: int, bound_s: float) -> bool:
        """Whether a frame can have been taken and sent at these times: not in the future, not long ago."""
        latest_ns = t_receive_ns + _CLOCK_SLACK_NS + round(1e9 * bound_s)
        return (t_receive_ns - OLDEST_FRAME_NS <= t_row0_ns <= latest_ns + abs(self._time_offset_ns)
                and t_send_ns <= latest_ns)

    def _build(self, message: Observations, t_row0_ns: int, t_send_ns: int, t_receive_ns: int,
               bound_s: float) -> CameraObservations:
        assert isinstance(message.markers, MarkerTable)  # as everything that was decoded
        pixels, covariances, diameters, qualities, flags = (
            column[:self._count] for column in message.markers.columns())
        return CameraObservations(
            camera=self._camera, t_row0_master_ns=t_row0_ns, row_time_ns=message.row_time_ns,
            clock_bound_s=bound_s, t_receive_ns=t_receive_ns,
            detect_s=1e-9 * message.processing_ns, network_s=1e-9 * (t_receive_ns - t_send_ns),
            pixels=pixels, covariances=covariances, diameters=diameters, qualities=qualities, flags=flags)
