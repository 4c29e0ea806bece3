"""Validates the datagrams of one node, live or from a log: each is dropped and counted, or becomes observations.

No sockets and no threads. Nothing in a datagram raises past `DatagramValidator.admit`.
"""

from __future__ import annotations

import functools
import logging
import re
from collections import Counter
from collections.abc import Callable

import numpy as np

from rhot_app.project import Rig, RigNode
from rhot_app.sources.clock import ClockEstimate, NodeClockModel
from rhot_app.tracking.kinds.edges import EdgeKind
from rhot_app.tracking.kinds.kind import Collected, FrameTimes, Kind
from rhot_app.tracking.kinds.landmarks import LandmarkKind
from rhot_app.tracking.kinds.markers import MarkerKind
from rhot_app.tracking.kinds.registry import KINDS
from rhot_app.tracking.tracker import CameraFrame, CameraObservations
from rhot_node.errors import WireError
from rhot_node.wire.codec import Seal, SequenceVerdict, SequenceWindow, decode, decode_sealed, is_tagged
from rhot_node.wire.fields import IMAGE_SIZE_MAX
from rhot_node.wire.messages import FrameMessage, MarkerFlag, Message, Observations

log = logging.getLogger(__name__)

# -- authentication ----------------------------------------------------------------------------------------------------

Open = Callable[[bytes], Message]
"""Gives the message of a datagram that comes from whom we listen to; raises WireError of any other."""


def tagged_by(seal: Seal) -> Open:
    """Opens only what `seal` tagged."""
    return functools.partial(decode_sealed, seal=seal)


def refuse_without_key(data: bytes) -> Message:
    """`Open` of a paired node whose key is not known yet."""
    if is_tagged(data):
        raise WireError("no_key", "the node has not given the key yet")
    raise WireError("untagged", "no tag where one is required")


# -- datagram validator ------------------------------------------------------------------------------------------------

OLDEST_FRAME_NS = 1_000_000_000
"""A frame taken longer ago than this is not worth a state, or its time is wrong."""

FAILED = "failed"
"""Reason to drop a datagram over which a kind of observations failed."""

Verified = Collected | CameraObservations
"""What is verified and waits for `DatagramValidator.convert`; text needs no second half."""

SLACK_NS = 1_000_000
"""Scheduling between the stamps at both ends."""


class DatagramValidator:
    """Verifies and counts one node's datagrams. Written by one thread; the counters may be read from others."""

    def __init__(self, rig: Rig, camera: int, clock: NodeClockModel) -> None:
        """`camera` is the node's index in the rig."""
        self.clock = clock
        self.open: Open = decode
        self._kinds = [kind() for kind in reversed(KINDS)]
        self._takers: dict[type, list[Kind]] = {
            message: [kind for kind in self._kinds if message in kind.messages]
            for kind in self._kinds for message in kind.messages}
        self._sequences = {message: SequenceWindow() for message in self._takers}
        self.sequence = self._sequences[Observations]
        self.searches = next(kind for kind in self._kinds if isinstance(kind, EdgeKind))
        self.received = 0  # datagrams of any kind
        self.taken = 0  # of the stream, and come for the first time: they are recorded
        self.frames: Counter[str] = Counter()  # accepted ones, by the names of their kinds
        self.dropped: dict[str, int] = {}
        self.refused: dict[str, int] = {}  # those of them that were not taken: anybody can send them again
        self.image_size: tuple[int, int] | None = None  # of the last refused frame of another size
        self.last_t_receive_ns = 0  # of the last accepted one
        self._travel = TravelTimes()
        self._session = 0
        self.configure(rig, camera)

    def configure(self, rig: Rig, camera: int) -> None:
        """Expect what the rig says about this node: marker set, image size, text or binary."""
        node: RigNode = rig.nodes[camera]
        self._node_id = node.node_id
        self._size = (node.intrinsics.width, node.intrinsics.height)
        for kind in self._kinds:
            kind.configure(rig, camera)
        self._time_offset_ns = round(1e9 * node.time_offset_s)
        self._text = (TextReader(camera, len(rig.markers.markers), self._size, self._time_offset_ns)
                      if node.text_datagrams else None)

    @property
    def accepted(self) -> int:
        """Accepted frames of markers and landmarks."""
        return self.frames[MarkerKind.name] + self.frames[LandmarkKind.name]

    @property
    def clock_in_doubt(self) -> bool:
        """Whether datagrams are dropped until another clock exchange has been made."""
        return self._travel.in_doubt

    def expect_session(self, session: int) -> None:
        """Admit only datagrams of `session` from now on (0: none), counted from a new first number."""
        self._session = session
        self.restart_sequences()

    def restart_sequences(self) -> None:
        """The node counts from a new first number."""
        for sequence in self._sequences.values():
            sequence.restart()
        for kind in self._kinds:
            kind.restart()

    def admit(self, data: bytes, t_receive_ns: int) -> CameraFrame | None:
        """The datagram as observations or fiducials, or None when it was dropped and counted."""
        verified = self.verify(data, t_receive_ns)
        return None if verified is None else self.convert(verified)

    def drop(self, reason: str, count: int = 1) -> None:
        """Count `count` datagrams as dropped for `reason`."""
        self.dropped[reason] = self.dropped.get(reason, 0) + count

    def verify(self, data: bytes, t_receive_ns: int) -> Verified | None:
        """First half of `admit`, cheap enough for a flood: everything is counted, nothing is built yet."""
        self.received += 1
        taken = self.taken
        try:
            verified = self._verify_text(data, t_receive_ns) if self._text else self._verify(data, t_receive_ns)
        except WireError as exc:
            verified = exc.reason
        except Exception:  # in a kind of another package: it costs this datagram only
            verified = self._failed()
        if isinstance(verified, str):
            self.drop(verified)
            if self.taken == taken:
                self.refused[verified] = self.refused.get(verified, 0) + 1
            return None
        if verified is None:  # a part of something
            return None
        self.frames[MarkerKind.name if isinstance(verified, CameraObservations) else verified[0].name] += 1
        self.last_t_receive_ns = t_receive_ns
        return verified

    def convert(self, verified: Verified) -> CameraFrame | None:
        """Second half of `admit`: arrays in the rig's marker order, times in master time. None when it failed."""
        if isinstance(verified, CameraObservations):
            return verified
        kind, collected, times = verified
        try:
            return kind.observe(collected, times)
        except Exception:  # as in `verify`, which has counted the frame
            self.frames[kind.name] -= 1
            self.drop(self._failed())
            return None

    def _failed(self) -> str:
        """The reason to drop what a kind fails over, which is logged once."""
        if FAILED not in self.dropped:
            log.exception("a kind of observations failed over a datagram; further failures are counted")
        return FAILED

    def _verify_text(self, data: bytes, t_receive_ns: int) -> Verified | str:
        if not self._session:
            return "not_started"
        assert self._text is not None
        observations = self._text.read(data, t_receive_ns)
        self.taken += 1
        return observations

    def _verify(self, data: bytes, t_receive_ns: int) -> Verified | str | None:
        """A message, what a last part completes, None of another part, or why it is dropped."""
        message = self.open(data)
        if not isinstance(message, FrameMessage):
            return "kind"
        kind = self._kind_of(message)
        if kind is None:
            return "kind"
        sequence = self._sequences[type(message)]
        reason = self._not_of_the_stream(message, sequence)
        if reason is not None:
            return reason
        sequence.take(message.sequence)  # also what is refused now has come: it is not lost
        self.taken += 1
        reason = kind.refusal(message)
        if reason is not None:
            return reason
        if (message.width, message.height) != self._size:
            self.image_size = (message.width, message.height)
            return "image_size"
        estimate = self.clock.estimate_at(t_receive_ns)
        if estimate is None:
            return "no_clock"
        t_row0_ns = estimate.to_master_ns(message.t_frame_node_ns) + self._time_offset_ns
        t_send_ns = estimate.to_master_ns(message.t_send_node_ns)
        bound_s = estimate.bound_s(t_receive_ns)
        if not self._plausible(t_row0_ns, t_send_ns, t_receive_ns, bound_s):
            return "time"
        if not self._travel.plausible(t_receive_ns - t_send_ns, t_receive_ns, estimate):
            return "clock_in_doubt"
        times = FrameTimes(t_row0_ns, t_send_ns, t_receive_ns, bound_s)
        collected = kind.collect(message, times)
        return None if collected is None else (kind, collected, times)

    def _kind_of(self, message: FrameMessage) -> Kind | None:
        for kind in self._takers.get(type(message), ()):
            if kind.accepts(message):
                return kind
        return None

    def _not_of_the_stream(self, message: FrameMessage, sequence: SequenceWindow) -> str | None:
        """Why this message is not a new one of the stream that we asked for; None when it is."""
        if message.node_id != self._node_id:
            return "foreign_node"
        if message.session != self._session:
            return "session" if self._session else "not_started"
        verdict = sequence.judge(message.sequence)
        if verdict is not SequenceVerdict.FRESH and verdict is not SequenceVerdict.LATE:
            return verdict.name.lower()
        return None

    def _plausible(self, t_row0_ns: int, t_send_ns: int, t_receive_ns: int, bound_s: float) -> bool:
        """Whether a frame can have been taken and sent at these times: not in the future, not long ago."""
        latest_ns = t_receive_ns + SLACK_NS + round(1e9 * bound_s)
        return (t_receive_ns - OLDEST_FRAME_NS <= t_row0_ns <= latest_ns + abs(self._time_offset_ns)
                and t_send_ns <= latest_ns)


# -- how long a node's datagrams take to arrive ------------------------------------------------------------------------

FORGETTING = 1e-4
"""Per datagram: the range narrows to what the network does now, in a minute or two; a busy machine is not doubted anew
at every hiccup."""


class TravelTimes:
    """The range of one node's travel times that exchanges have confirmed. One thread."""

    def __init__(self) -> None:
        self._shortest_ns = self._longest_ns = 0.0
        self._known = False
        self._doubt_since_ns: int | None = None

    @property
    def in_doubt(self) -> bool:
        """Whether the last datagram was dropped for its times."""
        return self._doubt_since_ns is not None

    def plausible(self, travel_ns: int, t_receive_ns: int, estimate: ClockEstimate) -> bool:
        """Whether a datagram's times are plausible that took `travel_ns` by the clock `estimate`."""
        if self._known:
            slack_ns = SLACK_NS + 1e9 * estimate.bound_s(t_receive_ns)
            if not self._shortest_ns - slack_ns <= travel_ns <= self._longest_ns + slack_ns:
                if self._doubt_since_ns is None:
                    self._doubt_since_ns = t_receive_ns
                if estimate.t_master_ns <= self._doubt_since_ns:
                    return False
            self._shortest_ns += FORGETTING * (travel_ns - self._shortest_ns)
            self._longest_ns += FORGETTING * (travel_ns - self._longest_ns)
        else:
            self._shortest_ns = self._longest_ns = travel_ns
            self._known = True
        self._doubt_since_ns = None
        self._shortest_ns = min(self._shortest_ns, travel_ns)
        self._longest_ns = max(self._longest_ns, travel_ns)
        return True


# -- the thesis's text datagrams (RHOT 6.4) ----------------------------------------------------------------------------
# ``x,y;x,y;...`` in the rig's marker order, one port per node. They carry no session, time or key, so they are as
# trustworthy as the network they come from.

LENGTH_MAX = 4096  # bytes; 64 markers with room to spare

VARIANCE_PX2 = 1.0
"""Assumed variance of a text centroid per axis: the thesis measured 2-5 px peak deviation (RHOT figure 7.7)."""

DIAMETER_PX = 16.0  # a painted fingertip at 0.6 m; the text does not say
QUALITY = 0.5
TIME_BOUND_S = 0.005
"""The delay from exposure to here is not known; half of a 100 Hz frame is what pairing has to expect."""

Point = tuple[float, float]

_NUMBER = re.compile(rb"[+-]?(?:\d{1,9}(?:\.\d{0,12})?|\.\d{1,12})\Z")


def parse_text(data: bytes | bytearray | memoryview, count: int) -> list[Point | None]:
    """The `count` marker positions of a text datagram, px; None for a lost marker (``-1,-1``, ``,`` or nothing).

    A trailing newline, carriage return, NUL or one semicolon too many is tolerated, as `nc` and printf produce them.
    Raises WireError with reason length, count or text.
    """
    if len(data) > LENGTH_MAX:
        raise WireError("length", f"{len(data)} bytes of text")
    pairs = bytes(data).rstrip(b"\r\n\0 \t").split(b";")
    if len(pairs) == count + 1 and not pairs[-1].strip():
        pairs.pop()
    if len(pairs) != count:
        raise WireError("count", f"{len(pairs)} pairs for {count} markers")
    return [_parse_pair(pair) for pair in pairs]


def _parse_pair(pair: bytes) -> Point | None:
    parts = [part.strip() for part in pair.split(b",")]
    if not any(parts) and len(parts) <= 2:
        return None
    if len(parts) != 2 or not all(_NUMBER.match(part) for part in parts):
        raise WireError("text", f"{pair!r} is not a pair of numbers")
    x, y = float(parts[0]), float(parts[1])
    if x == -1.0 and y == -1.0:
        return None
    if not (0.0 <= x <= IMAGE_SIZE_MAX and 0.0 <= y <= IMAGE_SIZE_MAX):
        raise WireError("text", f"{pair!r} lies outside any image")
    return x, y


class TextReader:
    """Reads text datagrams of one camera."""

    def __init__(self, camera: int, count: int, size: tuple[int, int], time_offset_ns: int = 0) -> None:
        """`count` markers in the rig's order, image `size` (width, height) px; the calibrated `time_offset_ns` is added
        to the receive time, so a delay that a moving marker showed is taken off here."""
        self._camera = camera
        self._count = count
        self._size = size
        self._time_offset_ns = time_offset_ns

    def read(self, data: bytes, t_receive_ns: int) -> CameraObservations:
        """The observations of one datagram. Raises WireError (length, count, text, or marker: outside the image)."""
        pixels = np.full((self._count, 2), np.nan)
        for row, point in enumerate(parse_text(data, self._count)):
            if point is not None:
                if point[0] > self._size[0] or point[1] > self._size[1]:
                    raise WireError("marker", f"{point} lies outside the image of {self._size} px")
                pixels[row] = point
        lost = np.isnan(pixels[:, 0])
        return CameraObservations(
            camera=self._camera, t_row0_master_ns=t_receive_ns + self._time_offset_ns, row_time_ns=0,
            clock_bound_s=TIME_BOUND_S, t_receive_ns=t_receive_ns, detect_s=float("nan"), network_s=float("nan"),
            pixels=pixels, covariances=np.where(lost, 0.0, VARIANCE_PX2)[:, None, None] * np.eye(2),
            diameters=np.where(lost, 0.0, DIAMETER_PX), qualities=np.where(lost, 0.0, QUALITY),
            flags=np.where(lost, MarkerFlag.LOST, 0).astype(np.uint16))
