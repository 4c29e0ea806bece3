"""The messages of the wire as frozen values. No bytes and no sockets here."""

from __future__ import annotations

import enum
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import msgspec

U32_MAX = 2**32 - 1
"""Of a field of 32 bits: sequence and frame numbers begin anew behind it."""

U64_MAX = 2**64 - 1
PORT_MAX = 65535

BROADCAST_PORT, UDP_PORT, CONTROL_PORT, PREVIEW_PORT, PAIRING_PORT = 47799, 47800, 47801, 47802, 47803
"""A node's ports unless its settings say otherwise (docs/node.md)."""


class NodeState(enum.IntEnum):
    """Life of a node: it starts, is ready, streams between start and stop, and says so when something broke."""

    STARTING = 0
    READY = 1
    STREAMING = 2
    FAULT = 3


class TrustState(enum.IntEnum):
    """Whom a node answers: everybody, nobody yet, or the masters that it is paired with."""

    OPEN = 0
    UNPAIRED = 1
    PAIRED = 2


class MarkerFlag(enum.IntFlag):
    """What a node noticed about one marker."""

    LOST = 1  # not found in this frame; x and y are NaN
    PARTIAL = 2  # smaller or otherwise shaped than the last frames say: half hidden; covariance widened
    EDGE = 4  # touches the image border
    AMBIGUOUS = 8  # another blob of the same colour is as plausible
    ACQUIRED = 16  # found by full search, not by prediction: the first frame of a track
    REFERENCE = 32  # measured by the thesis's pipeline


NO_FLAGS = MarkerFlag(0)
FLAGS = tuple(MarkerFlag(bits) for bits in range(2 * int(max(MarkerFlag))))
"""Every MarkerFlag at the index of its bits: building one takes a microsecond."""
CANDIDATES_MAX = 4  # candidates of one marker in one frame


class MarkerObservation(msgspec.Struct, frozen=True, gc=False):
    """One marker in one frame. A msgspec structure, because a master makes a thousand and more of them a second, and
    each frozen dataclass costs it ten times as much.

    Pixels: (0, 0) is the centre of the top-left pixel, raw (distorted) image. `diameter` is the equivalent diameter
    sqrt(4 area / pi), px. `cov_xx, cov_xy, cov_yy` is the covariance of (x, y), px^2. `quality` 0..1.
    """

    index: int
    x: float
    y: float
    diameter: float
    cov_xx: float
    cov_xy: float
    cov_yy: float
    quality: float
    flags: MarkerFlag = NO_FLAGS

    @property
    def found(self) -> bool:
        """True unless the marker is stated as lost."""
        return not self.flags & MarkerFlag.LOST


@dataclass(frozen=True, slots=True)
class FrameMessage:
    """What all messages about a frame say. `width`, `height`: of the image, px.

    `t_frame_node_ns`: mid-exposure of row 0, node clock; what lies at row y is later by y * `row_time_ns`.
    `t_send_node_ns`: when the datagram was handed to the socket. `processing_ns`: from frame available to then.
    """

    node_id: int
    session: int
    sequence: int
    t_frame_node_ns: int
    t_send_node_ns: int
    processing_ns: int
    exposure_ns: int
    row_time_ns: int
    width: int
    height: int
    frame_number: int


FrameHead = tuple[int, int, int, int, int, int, int, int, int, int, int]
"""The fields of `FrameMessage`."""


@dataclass(frozen=True, slots=True)
class Observations(FrameMessage):
    """All markers of one frame.

    `markers`: the best candidate of every marker, in the order of the set, lost ones included. Further candidates
    follow, at most CANDIDATES_MAX of a marker in all. `truncated`: some did not fit the datagram.
    """

    marker_checksum: int
    markers: Sequence[MarkerObservation]
    truncated: bool = False

    @property
    def marker_count(self) -> int:
        """Number of markers of the set: as many rows of `markers` are best candidates."""
        known: int | None = getattr(self.markers, "marker_count", None)  # of a decoded table
        return 1 + max((mark.index for mark in self.markers), default=-1) if known is None else known


@dataclass(frozen=True, slots=True)
class ClockRequest:
    """Master to node: first half of a four-timestamp exchange.

    `session` is the one the master runs, 0 when none: a streaming node that hears no request of its session for
    some seconds takes its master for gone.
    """

    node_id: int
    session: int
    sequence: int
    t1_master_ns: int


@dataclass(frozen=True, slots=True)
class ClockReply:
    """Node to master: the request's t1 again, the node's receive and send times, and what the node is doing.

    `sequence` and `t1_master_ns` are the request's. `session` is the one the node is in, 0 when none: it differs from
    the master's when a start message was lost or another master took over. `boot_id` changes whenever the daemon
    starts, so that the master forgets the old clock at once.
    """

    node_id: int
    session: int
    sequence: int
    t1_master_ns: int
    t2_node_ns: int
    t3_node_ns: int
    boot_id: int
    state: NodeState


@dataclass(frozen=True, slots=True)
class StartEntry:
    """One node's part of a start message: where to stream to and when to begin on its own clock (0: at once)."""

    node_id: int
    data_port: int
    t_start_node_ns: int


@dataclass(frozen=True, slots=True)
class Start:
    """Master to all nodes: stream in `session`. A node without an entry ignores it. node_id in the header is 0.

    Every start after a stop needs a new session: a node does not take up one that was stopped or replaced, because
    the network may deliver a start late or twice.
    """

    node_id: ClassVar[int] = 0
    session: int
    sequence: int
    entries: tuple[StartEntry, ...]


@dataclass(frozen=True, slots=True)
class Stop:
    """Master to all nodes: stop streaming `session` (0: whatever session)."""

    node_id: ClassVar[int] = 0
    session: int
    sequence: int


@dataclass(frozen=True, slots=True)
class Find:
    """Anybody to all nodes, or to `node_id` (0: all): who and where are you? Never tagged. `nonce` comes back."""

    session: ClassVar[int] = 0
    node_id: int
    sequence: int
    nonce: int


@dataclass(frozen=True, slots=True)
class Here:
    """A node to whoever asked: who it is. Never tagged, so only good for showing and for trying an address.

    `sequence` and `nonce` are the question's. `boot_id` is that of the clock replies.
    """

    session: ClassVar[int] = 0
    node_id: int
    sequence: int
    nonce: int
    boot_id: int
    udp_port: int
    control_port: int
    preview_port: int
    pairing_port: int
    state: NodeState
    trust: TrustState
    name: str


FAMILIES = (
    "DICT_4X4_50", "DICT_4X4_100", "DICT_4X4_250", "DICT_4X4_1000", "DICT_5X5_50", "DICT_5X5_100", "DICT_5X5_250",
    "DICT_5X5_1000", "DICT_6X6_50", "DICT_6X6_100", "DICT_6X6_250", "DICT_6X6_1000", "DICT_7X7_50", "DICT_7X7_100",
    "DICT_7X7_250", "DICT_7X7_1000", "DICT_ARUCO_ORIGINAL", "DICT_APRILTAG_16h5", "DICT_APRILTAG_25h9",
    "DICT_APRILTAG_36h10", "DICT_APRILTAG_36h11", "DICT_ARUCO_MIP_36h12")
"""cv2.aruco's dictionaries; a family is an index into them, which is also cv2's own number."""


@dataclass(frozen=True, slots=True)
class Fiducial:
    """One fiducial tag in one frame.

    `family`: index into FAMILIES. `corners`: x and y of the four corners, px, raw image, in the order top left, top
    right, bottom right, bottom left of the upright tag. `covariances`: xx, xy, yy of each corner, px^2.
    """

    family: int
    number: int
    corners: tuple[float, ...]
    covariances: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Fiducials(FrameMessage):
    """All fiducial tags of one frame. `truncated`: some did not fit the datagram."""

    fiducials: Sequence[Fiducial]
    truncated: bool = False


LANDMARKS = 21
"""Of a hand, in the order of docs/landmarks.md."""


@dataclass(frozen=True, slots=True)
class LandmarkedHand:
    """The landmarks of one hand in one frame. `presence`: probability that it is a hand; `right`: that it is a right
    one. `points`: x, y, xx, xy, yy of each landmark: px, raw image, and their covariance, px^2; all 0 where there is
    none."""

    presence: float
    right: float
    points: tuple[tuple[float, ...], ...]


@dataclass(frozen=True, slots=True)
class HandLandmarks(FrameMessage):
    """The hands of one frame, as the hand networks find them."""

    hands: Sequence[LandmarkedHand]


@dataclass(frozen=True, slots=True)
class Slices:
    """Master to node: short line segments across which edges are to be found in every image, and whether a foreground
    map is wanted. In force until the next request, or for a second.

    Part `part` of `parts`; `slice_count` slices in all. `width`, `height`: of the image that they are meant for, px.
    `map_step`: every so many px of the image a foreground probability is wanted; 0: none. `records`: the slices of
    this part as `wire.search` packs them.
    """

    node_id: int
    session: int
    sequence: int
    request: int
    width: int
    height: int
    slice_count: int
    part: int
    parts: int
    map_step: int
    records: bytes


class SliceEdge(msgspec.Struct, frozen=True, gc=False):
    """One edge on a slice, a short line segment in the image that the master asked for.

    `offset` px along the slice's normal from its centre, with standard deviation `sd` px. `strength`: grey levels per
    px, positive where it gets brighter along the normal. `inside`, `outside`: foreground probability on both sides.
    """

    slice_index: int
    offset: float
    sd: float
    strength: float
    inside: float
    outside: float


@dataclass(frozen=True, slots=True)
class SliceEdges(FrameMessage):
    """The edges of one frame on the `slice_count` slices of the master's `request`; part `part` of `parts`."""

    request: int
    slice_count: int
    part: int
    parts: int
    edges: Sequence[SliceEdge]


@dataclass(frozen=True, slots=True)
class ForegroundPart(FrameMessage):
    """A part of the foreground map of one frame: `data`, a piece of the compressed map (`wire.search`). `request` is
    that of the `Slices` that asked for it."""

    request: int
    step: int
    part: int
    parts: int
    data: bytes


Message = FrameMessage | ClockRequest | ClockReply | Start | Stop | Find | Here | Slices
