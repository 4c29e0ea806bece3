"""The frozen state that the tracker publishes: one instant of the hand, with what is known and how well."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhot_app.objects.state import ObjectState
from rhot_node.wire.messages import MarkerFlag

Array = NDArray[np.float64]
Codes = NDArray[np.uint8]


class Knowledge(enum.IntEnum):
    """How a value came to be known; shown alike everywhere (solid, translucent, hatched)."""

    MEASURED = 0  # seen by enough cameras at this instant
    INFERRED = 1  # follows from measured values through the model, or from a half-occluded observation
    GUESSED = 2  # the images do not determine it; prior or last value
    UNKNOWN = 3  # nothing to say; the value is NaN


MEASURED_M, INFERRED_M = 3e-3, 12e-3
"""m: standard deviation (root of the trace) up to which a place counts as measured, and as inferred."""

MEASURED_RAD, INFERRED_RAD = math.radians(4.0), math.radians(12.0)
"""rad: the same of angles and of the palm's rotation."""


class Condition(enum.Enum):
    """The one word the operator reads from two metres away."""

    IDLE = "IDLE"
    SEARCHING = "SEARCHING"
    TRACKING = "TRACKING"
    PARTIAL = "PARTIAL"
    LOST = "LOST"
    FAULT = "FAULT"


UNESTIMATED: dict[str, Any] = {
    "joint_covariances": np.full((21, 3, 3), np.nan), "fingertip_covariances": np.full((5, 3, 3), np.nan),
    "angle_sd": np.full(21, np.nan), "palm_covariance": np.full((6, 6), np.nan), "velocity": np.full(27, np.nan),
    "acceleration": np.full(27, np.nan), "velocity_sd": np.full(27, np.nan), "acceleration_sd": np.full(27, np.nan),
    "joint_velocity_sd": np.full(21, np.nan), "joint_acceleration_sd": np.full(21, np.nan),
    "hand_scale": 1.0, "hand_scale_sd": math.nan}
"""What a tracker without covariances says in their place. Read-only."""

LATENCY_STAGES: tuple[str, ...] = ("detect", "network", "pair", "triangulate", "filter", "solve", "publish",
                                   "receive_to_state")
"""Stages of a state's way, in order. `publish` and `receive_to_state` of a state are those of the one before it,
because they are only known once a state has left."""


@dataclass(frozen=True, slots=True)
class HandState:
    """One instant. M markers, C cameras; joints and angles as in `rhot_app.hand.skeleton`.

    World frame is the rig frame, metres. Unknown values are NaN. Times are master monotonic ns.
    """

    sequence: int
    t_master_ns: int  # the instant the state describes
    t_receive_ns: int  # kernel receive time of the datagram that completed it
    condition: Condition
    marker_ids: tuple[str, ...]
    marker_positions: Array  # (M, 3) m, filtered
    marker_raw_positions: Array  # (M, 3) m, triangulated, unfiltered
    marker_covariances: Array  # (M, 3, 3) m^2, of the position (classic tracker: of the unfiltered one). All
    # covariances of places have the calibration's error in a state that is published (docs/states.md)
    marker_knowledge: Codes  # (M,) Knowledge
    camera_names: tuple[str, ...]
    camera_pixels: Array  # (C, M, 2) px, last observation; NaN when lost
    camera_flags: NDArray[np.uint16]  # (C, M) MarkerFlag
    joint_positions: Array  # (21, 3) m
    joint_knowledge: Codes  # (21,)
    fingertip_positions: Array  # (5, 3) m, solved end effectors: the marker's place on the distal phalanx
    angles: Array  # (21,) rad
    angle_knowledge: Codes  # (21,)
    world_from_palm: Array  # (4, 4)
    palm_knowledge: Knowledge
    epipolar_error_px: Array  # (M,) rms distance of the rays' points from the reprojected marker, px
    joint_covariances: Array  # (21, 3, 3) m^2; NaN from a tracker that does not estimate it, as are the next ten
    fingertip_covariances: Array  # (5, 3, 3) m^2
    angle_sd: Array  # (21,) rad
    palm_covariance: Array  # (6, 6) m^2 and rad^2: palm translation, then rotation about its origin, world axes
    velocity: Array  # (27,) m/s and rad/s: of the palm's translation and rotation, along world axes, and of the angles
    acceleration: Array  # (27,) m/s^2 and rad/s^2
    velocity_sd: Array  # (27,) m/s and rad/s
    acceleration_sd: Array  # (27,) m/s^2 and rad/s^2
    joint_velocity_sd: Array  # (21,) m/s, root of the trace
    joint_acceleration_sd: Array  # (21,) m/s^2
    hand_scale: float  # factor on every length of the rig's hand
    hand_scale_sd: float
    latency_s: dict[str, float]  # by LATENCY_STAGES
    other: HandState | None = None  # of the rig's other hand at the same instant, with its own markers only
    objects: tuple[ObjectState, ...] = ()  # the rig's tracked objects at the same instant

    @property
    def tracked(self) -> bool:
        """Whether there is a hand."""
        return self.condition in (Condition.TRACKING, Condition.PARTIAL)


@dataclass(frozen=True, slots=True)
class SeenContour:
    """What was seen of a bare hand in one image of a camera, for people to look at; places px, raw. `t_node_ns`: of the
    image by its node's clock, 0 when that is not known. `hand`: 0 the rig's hand, 1 its other one. `shown`: no hand was
    seen; this is the pose that it is to take.

    `contour` (N, 2): where the estimated hand's contour crosses the slices; `outline` (N,): before the background, not
    within the hand. `slices` (N, 4): their ends, x and y twice. `edges` (M, 2), `of_hand` (M,): which are the hand's.
    """

    camera: str
    t_master_ns: int
    contour: Array
    outline: NDArray[np.bool_]
    slices: Array
    edges: Array
    of_hand: NDArray[np.bool_]
    t_node_ns: int = 0
    hand: int = 0
    shown: bool = False


def no_hand(t_ns: int, condition: Condition, cameras: tuple[str, ...] = (), filter_s: float = 0.0,
            markers: tuple[str, ...] = ()) -> HandState:
    """The state of master time `t_ns` without a hand and with nothing known of `markers`. `filter_s`: what it took."""
    unknown, count, nothing = int(Knowledge.UNKNOWN), len(markers), np.full((len(markers), 3), np.nan)
    return HandState(
        sequence=0, t_master_ns=t_ns, t_receive_ns=t_ns, condition=condition, marker_ids=markers,
        marker_positions=nothing, marker_raw_positions=nothing.copy(),
        marker_covariances=np.full((count, 3, 3), np.nan), marker_knowledge=np.full(count, unknown, np.uint8),
        camera_names=cameras, camera_pixels=np.full((len(cameras), count, 2), np.nan),
        camera_flags=np.full((len(cameras), count), int(MarkerFlag.LOST), np.uint16),
        joint_positions=np.full((21, 3), np.nan), joint_knowledge=np.full(21, unknown, np.uint8),
        fingertip_positions=np.full((5, 3), np.nan), angles=np.full(21, np.nan),
        angle_knowledge=np.full(21, unknown, np.uint8), world_from_palm=np.full((4, 4), np.nan),
        palm_knowledge=Knowledge.UNKNOWN, epipolar_error_px=np.full(count, np.nan),
        **UNESTIMATED | {"hand_scale": np.nan}, latency_s={"filter": filter_s})
