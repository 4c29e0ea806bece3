"""From a hand state to what other programs expect: the joint set, its order and its axes (docs/outputs.md)."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from typing import Any, Final, Literal

import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_app.estimation.se3 import quaternion_from_rotation
from rhot_app.hand.anatomy import HandAnatomy
from rhot_app.hand.model import build_model, neutral_pose
from rhot_app.hand.skeleton import JOINTS, HandPose
from rhot_app.objects.state import ObjectState
from rhot_app.outputs.openxr import OPENXR_JOINTS, OUR_JOINTS, openxr_hand, openxr_map
from rhot_app.project import Rig
from rhot_app.state import Codes, HandState

Array = NDArray[np.float64]
JointSet = Literal["own", "openxr", "mediapipe"]

MEDIAPIPE_JOINTS: Final = (
    "WRIST", "THUMB_CMC", "THUMB_MCP", "THUMB_IP", "THUMB_TIP",
    *(f"{finger}_{joint}" for finger in ("INDEX_FINGER", "MIDDLE_FINGER", "RING_FINGER", "PINKY")
      for joint in ("MCP", "PIP", "DIP", "TIP")))
"""MediaPipe's HandLandmark, 0 to 20: the order of `skeleton.JOINTS`."""

JOINT_NAMES: dict[JointSet, tuple[str, ...]] = {"own": JOINTS, "openxr": OPENXR_JOINTS, "mediapipe": MEDIAPIPE_JOINTS}

LIVE_S: Final = 10.0
"""A state older than this comes from a replayed log, whose clock was another one: it has no age."""

_HALF: Final = math.sqrt(0.5)
_UPRIGHT: Final = {"-y": (0.0, 1.0, 0.0, 0.0), "z": (_HALF, -_HALF, 0.0, 0.0)}
"""wxyz, OpenXR's axes (x right, y up, -z forward) from the rig frame, by the rig's `up`: half a turn about x where the
frame is the left camera's, a quarter turn where z is up."""

_KNOWN_BY: Final = np.array([-1 if name is None else JOINTS.index(name) for name in OUR_JOINTS])


@dataclass(frozen=True, slots=True)
class HandSample:
    """One hand as an output sends it; unknown values are NaN.

    `name`: left, right, or other_left, other_right for a second hand of the same side. In the rig frame, or with
    "openxr" in OpenXR's axes: `positions` (N, 3) m; `orientations` (N, 4) xyzw and `radii` (N,) m with "openxr" only;
    `palm_position` (3,) m and `palm_orientation` (4,) xyzw of the palm frame. `knowledge` (N,) Knowledge.
    """

    name: str
    side: Literal["left", "right"]
    condition: str
    positions: Array
    knowledge: Codes
    palm_position: Array
    palm_orientation: Array
    orientations: Array | None = None
    radii: Array | None = None


@dataclass(frozen=True, slots=True)
class ObjectSample:
    """One tracked object as an output sends it, in the axes of the hands: `position` (3,) m and `orientation` (4,)
    xyzw, NaN when unknown. `distances` (5,) m and `contacts` (5,) are of the first hand's fingertips."""

    name: str
    validity: str
    position: Array
    orientation: Array
    distances: Array
    contacts: NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Sample:
    """One instant as an output sends it. `age_s`: since the instant that it describes; NaN for a replayed log.
    `t_unix_ns`: that instant by this computer's wall clock, since 1970; None for a replayed log.
    `joints`: the names of each hand's rows. `state`: where it comes from, for what is not in here."""

    joint_set: JointSet
    joints: tuple[str, ...]
    age_s: float
    hands: tuple[HandSample, ...]
    state: HandState
    objects: tuple[ObjectSample, ...] = ()
    t_unix_ns: int | None = None


class JointConverter:
    """Turns states of one rig into samples. Any thread may call it; it keeps nothing between calls."""

    def __init__(self, rig: Rig) -> None:
        self._upright = np.array(_UPRIGHT[rig.up])
        self._hands = [_Hand(rig.hand, rig.hand.side, rig.up)]
        if rig.other_hand is not None:
            side = rig.other_hand.side
            name = f"other_{side}" if side == rig.hand.side else side
            self._hands.append(_Hand(rig.other_hand, name, rig.up))

    def sample(self, state: HandState, joint_set: JointSet) -> Sample:
        """The state's hands with these joints."""
        age_ns = time.monotonic_ns() - state.t_master_ns
        live = 0 <= age_ns < 1e9 * LIVE_S
        states = [state] if state.other is None else [state, state.other]
        hands = tuple(hand.sample(one, joint_set) for hand, one in zip(self._hands, states, strict=False))
        objects = tuple(self._object(one, joint_set) for one in state.objects)
        return Sample(joint_set, JOINT_NAMES[joint_set], 1e-9 * age_ns if live else math.nan, hands, state, objects,
                      time.time_ns() - age_ns if live else None)

    def _object(self, one: ObjectState, joint_set: JointSet) -> ObjectSample:
        position = one.world_from_object[:3, 3]
        turn = quaternion_from_rotation(one.world_from_object[:3, :3]) if one.tracked else np.full(4, np.nan)
        if joint_set == "openxr":
            position, turn = _turned(self._upright, position), _product(self._upright, turn)
        return ObjectSample(one.name, one.validity.value, position, _xyzw(turn), one.distances, one.contacts)

    def warm_up(self) -> None:
        """Compile what the conversion needs, before the first state."""
        for hand in self._hands:
            hand.openxr(neutral_pose(), 1.0)


class _Hand:
    """One hand of the rig, with its model."""

    def __init__(self, anatomy: HandAnatomy, name: str, up: Literal["-y", "z"]) -> None:
        self._model = build_model(anatomy)
        self._map = openxr_map(self._model)
        self._name = name
        self._upright = np.array(_UPRIGHT[up])

    def sample(self, state: HandState, joint_set: JointSet) -> HandSample:
        palm = state.world_from_palm
        known = bool(np.isfinite(palm).all())
        turn = quaternion_from_rotation(palm[:3, :3]) if known else np.full(4, np.nan)
        sample = HandSample(self._name, self._model.anatomy.side, state.condition.value, state.joint_positions,
                            state.joint_knowledge, palm[:3, 3], _xyzw(turn))
        if joint_set != "openxr":
            return sample
        knowledge = np.where(_KNOWN_BY < 0, np.uint8(state.palm_knowledge), state.joint_knowledge[_KNOWN_BY])
        positions, orientations, radii = self.openxr(HandPose(palm, state.angles), state.hand_scale)
        return replace(sample, positions=positions, orientations=orientations, radii=radii, knowledge=knowledge,
                       palm_position=_turned(self._upright, palm[:3, 3]),
                       palm_orientation=_xyzw(_product(self._upright, turn)))

    def openxr(self, pose: HandPose, scale: float) -> tuple[Array, Array, Array]:
        """Positions (26, 3) m, orientations (26, 4) xyzw and radii (26,) m in OpenXR's axes."""
        hand = openxr_hand(self._model, self._map, pose)
        wrist = pose.world_from_palm[:3, 3]
        positions = _turned(self._upright, wrist + scale * (hand.positions - wrist))
        return positions, _xyzw(_product(self._upright, hand.orientations)), scale * hand.radii


def _xyzw(wxyz: Array) -> Array:
    return np.roll(wxyz, -1, axis=-1)


def _turned(wxyz: Array, points: Array) -> Array:
    """Points (..., 3) turned about x by the quaternion, whose y and z are zero."""
    cosine, sine = wxyz[0] ** 2 - wxyz[1] ** 2, 2.0 * wxyz[0] * wxyz[1]
    x, y, z = points[..., 0], points[..., 1], points[..., 2]
    return np.stack([x, cosine * y - sine * z, sine * y + cosine * z], axis=-1)


def _product(a: Array, b: Array) -> Array:
    """Quaternions wxyz: (4,) times (..., 4)."""
    w, x, y, z = b[..., 0], b[..., 1], b[..., 2], b[..., 3]
    return np.stack([a[0] * w - a[1] * x - a[2] * y - a[3] * z, a[0] * x + a[1] * w + a[2] * z - a[3] * y,
                     a[0] * y - a[1] * z + a[2] * w + a[3] * x, a[0] * z + a[1] * y - a[2] * x + a[3] * w], axis=-1)


_DIGITS = 6  # micrometres, and as fine for quaternions


def json_message(sample: Sample) -> bytes:
    """The whole sample. An unknown joint is null, as is the age of a replayed state."""
    age_s = None if math.isnan(sample.age_s) else round(sample.age_s, _DIGITS)
    return msgspec.json.encode({
        "sequence": sample.state.sequence, "t_master_ns": sample.state.t_master_ns,
        "t_unix_ns": sample.t_unix_ns, "age_s": age_s,
        "joint_set": sample.joint_set, "joints": sample.joints, "hands": [_hand(hand) for hand in sample.hands],
        **({"objects": [_object(one) for one in sample.objects]} if sample.objects else {})})


def _object(one: ObjectSample) -> dict[str, Any]:
    return {"name": one.name, "validity": one.validity, "position": _rows(one.position[None])[0],
            "orientation": _rows(one.orientation[None])[0], "distances": np.round(one.distances, _DIGITS).tolist(),
            "contacts": one.contacts.tolist()}


def _hand(hand: HandSample) -> dict[str, Any]:
    document = {
        "name": hand.name, "side": hand.side, "condition": hand.condition, "positions": _rows(hand.positions),
        "knowledge": hand.knowledge.tolist(), "palm_position": _rows(hand.palm_position[None])[0],
        "palm_orientation": _rows(hand.palm_orientation[None])[0]}
    if hand.orientations is not None and hand.radii is not None:
        document |= {"orientations": _rows(hand.orientations), "radii": np.round(hand.radii, _DIGITS).tolist()}
    return document


def _rows(values: NDArray[np.float64]) -> list[list[float] | None]:
    rows: list[list[float]] = np.round(values, _DIGITS).tolist()
    return [row if all(map(math.isfinite, row)) else None for row in rows]
