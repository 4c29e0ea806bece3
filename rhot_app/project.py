"""The rig: everything the master knows about cameras, markers, hand and filters, in one JSON file (``rhot-rig``).

docs/rig.md describes the format. Nothing else on the master is configured anywhere else.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Annotated, ClassVar, Final, Literal, NamedTuple

import msgspec
from msgspec import Meta

from rhot_app.errors import ObjectError, RigError
from rhot_app.hand.anatomy import HandAnatomy, load_hand
from rhot_app.hand.skeleton import ANGLES
from rhot_app.objects.object_file import Name, ObjectModel, load_object, require_distinct
from rhot_node.files import decode_document, read_document, read_json, resource_path, write_document
from rhot_node.markers import MarkerSet, load_markers
from rhot_node.wire.messages import (
    BROADCAST_PORT,
    CONTROL_PORT,
    PAIRING_PORT,
    PREVIEW_PORT,
    U32_MAX,
    UDP_PORT,
)

FORMAT: Final = "rhot-rig"
VERSION: Final = 1

OTHER_HAND: Final = "other_"
"""Begins the role of a marker that sits on the rig's `other_hand`: ``other_index_tip``."""

Hertz = Annotated[float, Meta(gt=0, le=1e6)]
Beta = Annotated[float, Meta(ge=0, le=1e9)]
Port = Annotated[int, Meta(ge=0, le=65535)]
Pixels = Annotated[int, Meta(ge=16, le=16384)]
Focal = Annotated[float, Meta(gt=0, le=1e6)]
Pixel = Annotated[float, Meta(ge=-1e6, le=1e6)]
Coefficient = Annotated[float, Meta(ge=-1e6, le=1e6)]
Distortion = Annotated[tuple[Coefficient, ...], Meta(min_length=5, max_length=8)]
Sd = Annotated[float, Meta(gt=0)]
Metres = Annotated[float, Meta(ge=-1000, le=1000)]
Address = Annotated[str, Meta(pattern=r"\A[A-Za-z0-9._:%-]{1,253}\Z")]
"""Of a machine: its name, IPv4 or IPv6 address."""
PublicKey = Annotated[str, Meta(pattern=r"\A([0-9a-f]{64})?\Z")]


def require_distortion(distortion: tuple[float, ...]) -> None:
    """Raise ValueError unless there are as many coefficients as one of the two lens models has."""
    if len(distortion) not in (5, 8):
        raise ValueError(f"distortion has {len(distortion)} coefficients; it is k1, k2, p1, p2, k3, and of a wide lens "
                         "also k4, k5, k6")


class Intrinsics(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Pinhole with OpenCV's distortion: k1, k2, p1, p2, k3, and of a wide lens also k4, k5, k6; pixels, (0, 0) at the
    centre of the top-left pixel."""

    width: Pixels
    height: Pixels
    fx: Focal
    fy: Focal
    cx: Pixel
    cy: Pixel
    distortion: Distortion = (0.0, 0.0, 0.0, 0.0, 0.0)
    ASSUMED_DEG: ClassVar[float] = 60.0
    """Horizontal field of view of a camera of which nothing is known: webcams have 55 to 70 degrees."""

    def __post_init__(self) -> None:
        require_distortion(self.distortion)

    @classmethod
    def assumed(cls, width: int, height: int) -> Intrinsics:
        """The lens of a camera of which nothing but the size of its pictures is known, px."""
        focal = 0.5 * width / math.tan(0.5 * math.radians(cls.ASSUMED_DEG))
        return cls(width, height, focal, focal, 0.5 * (width - 1), 0.5 * (height - 1))

    @property
    def nominal(self) -> bool:
        """Whether nobody has calibrated this lens: exactly centred, without distortion."""
        return (self.cx, self.cy) == ((self.width - 1) / 2, (self.height - 1) / 2) and not any(self.distortion)


class CameraPose(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """world_from_camera: unit quaternion wxyz and translation in metres (the camera's centre in the rig frame)."""

    rotation_wxyz: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    translation_m: tuple[Metres, Metres, Metres] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        norm = sum(q * q for q in self.rotation_wxyz)
        if not 0.998 < norm < 1.002:
            raise ValueError(f"rotation_wxyz is not a unit quaternion (its squared norm is {norm:.4f})")


class RigNode(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One camera node: how to reach it and how its camera looks at the world."""

    node_id: Annotated[int, Meta(ge=1, le=U32_MAX)]
    name: Name
    intrinsics: Intrinsics
    pose: CameraPose = CameraPose()
    address: Address = "127.0.0.1"
    udp_port: Port = UDP_PORT  # the node's: start, stop, clock
    control_port: Port = CONTROL_PORT  # the node's: settings, state, stills
    preview_port: Port = PREVIEW_PORT  # the node's: preview stream
    data_port: Port = 0  # the master's: observations; 0 takes any free port and tells the node
    text_datagrams: bool = False  # accept the thesis's text datagrams on data_port (untrusted)
    time_offset_s: Annotated[float, Meta(ge=-10, le=10)] = 0.0  # calibrated correction added to this camera's times
    time_offset_sd_s: Annotated[float, Meta(ge=0, le=10)] | None = None  # of that; None: nobody has measured it
    pairing_port: Port = PAIRING_PORT  # the node's: who it is, pairing
    public_key: PublicKey = ""  # the node's; empty: the node is not paired, and what it says is untrusted
    pose_known: bool = True  # whether `pose` was measured or set; without, the camera is shown and not tracked with

    def __post_init__(self) -> None:
        if self.text_datagrams and self.public_key:
            raise ValueError(f"node {self.name} has a public_key and text_datagrams; text cannot be trusted, so take "
                             "one of them away")


class Broadcast(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Where start and stop are broadcast, besides being sent to every node's own address."""

    address: Address = "255.255.255.255"
    port: Port = BROADCAST_PORT


class OneEuroSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """1-euro filter (Casiez 2012): min cutoff Hz, beta in Hz per (unit/s), derivative cutoff Hz."""

    min_cutoff_hz: Hertz
    beta: Beta
    derivative_cutoff_hz: Hertz = 1.0


class FilterSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Filters before depth (pixels) and after (metres); `markers` overrides both for single marker ids."""

    enabled: bool = True
    pixel: OneEuroSettings = OneEuroSettings(min_cutoff_hz=1.0, beta=8.0, derivative_cutoff_hz=15.0)
    position: OneEuroSettings = OneEuroSettings(min_cutoff_hz=1.0, beta=4000.0, derivative_cutoff_hz=15.0)
    pixel_markers: dict[str, OneEuroSettings] = {}
    position_markers: dict[str, OneEuroSettings] = {}


class DepthSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How distance is found: `stereo` from calibrated cameras; `disparity` from the disparity of two uncalibrated ones,
    parallel and equal, by RHOT eq. 6.12 or, with `k` (metres) and `z`, by the power law D = k |x|^z of eq. 7.4."""

    mode: Literal["stereo", "disparity"] = "stereo"
    baseline_m: Annotated[float, Meta(gt=0, le=1000)] = 0.075
    view_angle_deg: Annotated[float, Meta(gt=1, lt=170)] = 62.2  # horizontal
    k: Annotated[float, Meta(gt=0, le=1e9)] | None = None
    z: Annotated[float, Meta(ge=-2, lt=0)] | None = None

    def __post_init__(self) -> None:
        if (self.k is None) != (self.z is None):
            raise ValueError("k and z belong together; give both or neither")


TrackerKind = Literal["classic", "estimator", "model"]
"""`model` is an earlier tracker in old files; the estimator takes its place."""

TRACKER_KINDS: tuple[TrackerKind, ...] = ("classic", "estimator")


IkMethod = Literal["fabrik", "transpose", "pseudo_inverse", "svd", "dls", "newton", "lm", "closed_form"]
"""What bends the classic tracker's fingers (RHOT chapter 2.2). `fabrik` is the tracker's own: FABRIK, then a descent
towards the pose prior that allows for the noise of the target. The others meet the target exactly."""


Observe = Literal["markers", "landmarks", "contours", "both", "landmarks_and_contours"]
"""What the estimator observes of the hand: painted markers, landmarks, the bare hand's contours, or two of these;
`both` is paint and contours. Files from before there was a word for landmarks have `markers` and `both` for them, too.
"""


def _require_angles(names: Iterable[str], purpose: str) -> None:
    unknown = sorted(set(names) - set(ANGLES))
    if unknown:
        raise ValueError(f"there is no joint angle {unknown[0]!r} {purpose}; they are {', '.join(ANGLES)}")


class PalmPlane(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A plane on which the palm slides. `normal`: along the back of the hand, rig frame, of any length. `distance_m`:
    of the palm's origin, the wrist, from the rig frame's origin along it."""

    normal: tuple[float, float, float]
    distance_m: Metres

    def __post_init__(self) -> None:
        if not sum(value * value for value in self.normal) > 0.0:
            raise ValueError("the normal of a plane is not 0, 0, 0")


class StartPose(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A pose that a bare hand takes to be tracked by its contours: the palm's frame in the rig frame, as a camera's
    pose, and joint angles of `hand.skeleton.ANGLES` that differ from a relaxed hand's."""

    rotation_wxyz: tuple[float, float, float, float]
    translation_m: tuple[Metres, Metres, Metres]
    angles_deg: dict[str, Annotated[float, Meta(ge=-180, le=180)]] = {}

    def __post_init__(self) -> None:
        CameraPose(self.rotation_wxyz, self.translation_m)
        _require_angles(self.angles_deg, "to start with")


class _PoseFile(StartPose, frozen=True, forbid_unknown_fields=True):
    """A start pose as a file of its own."""

    format: Literal["rhot-pose"] = "rhot-pose"
    version: Literal[1] = 1


def load_start_pose(path: Path) -> StartPose:
    """Read and validate a start pose; raises RigError naming file and field."""
    read = read_document(path, _PoseFile, format_name="rhot-pose", version=1, error=RigError)
    return StartPose(read.rotation_wxyz, read.translation_m, read.angles_deg)


class TrackerSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Which tracker makes a hand of the markers, and what it may assume.

    `kind`: `classic` is the thesis's (pair, triangulate, 1-euro, palm fit, inverse kinematics by `ik`); `estimator`
    estimates one hand from every image position. The other fields are the estimator's.
    `variant`: `full` (27 degrees of freedom) or `coupled` (DIP = 2/3 PIP and no abduction of the middle finger, RHOT
    2.2 to 2.4). `float_scale`: estimate the hand's size as it moves. `observe`: paint, landmarks, the contours of the
    bare hand, or two at once. `locked_deg`: angles of `hand.skeleton.ANGLES` that the hand holds there, or
    about there with a standard deviation. `palm_plane`:
    the palm slides on it; one camera then suffices. `start_poses`: of the hand and the other hand, in which contours
    begin to be followed; without them one that the cameras see well (`barehand.start`).
    """

    kind: TrackerKind = "classic"
    ik: IkMethod = "fabrik"
    variant: Literal["full", "coupled"] = "full"
    limits: Literal["anatomical", "thesis"] = "anatomical"
    float_scale: bool = False
    observe: Observe = "markers"
    locked_deg: dict[str, float | tuple[float, Sd]] = {}
    palm_plane: PalmPlane | None = None
    start_poses: Annotated[tuple[StartPose, ...], Meta(max_length=2)] = ()

    @property
    def by_markers(self) -> bool:
        """Whether every hand is tracked by its markers or landmarks, and by nothing else."""
        return self.kind == "estimator" and not self.contours

    @property
    def smooths(self) -> bool:
        """Whether what is tracked can be smoothed afterwards."""
        return self.by_markers

    @property
    def contours(self) -> bool:
        """Whether the nodes search their pictures for the hand's contours."""
        return self.observe in ("contours", "both", "landmarks_and_contours")

    @property
    def landmarks(self) -> bool:
        """Whether the rig's marker set is to have landmarks."""
        return self.observe in ("landmarks", "landmarks_and_contours")

    def __post_init__(self) -> None:
        if self.kind == "model":
            msgspec.structs.force_setattr(self, "kind", "estimator")
        if self.kind == "classic" and self.observe != "markers":
            raise ValueError(f"the classic tracker knows markers only, and observe is \"{self.observe}\"; choose the "
                             "kind \"estimator\", or take observe away")
        _require_angles(self.locked_deg, "to lock")


class CameraCalibration(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How the lenses and poses of a rig were found, and how far they may be trusted.

    `method`: `board`, by the stereo calibration; `outdated`, likewise, but intrinsics were calibrated anew since;
    `exact`, known without error, as in a simulation; `refined`, one of these, and refined from a moving hand since.
    `lengths`: which second known length confirmed the size of the board's squares; without one every length may be
    wrong by one factor.
    `error_m`: standard deviation of a place `distance_m` from the cameras by the calibration alone; none when unknown.
    """

    method: Literal["board", "outdated", "exact", "refined"]
    lengths: Literal["skipped", "baseline", "ruler"] = "skipped"
    error_m: Annotated[float, Meta(ge=0, le=100)] | None = None
    distance_m: Annotated[float, Meta(gt=0, le=100)] = 0.6


class OutputSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One live stream to other programs (docs/outputs.md). `rate_hz`: at most so many states/s; None: every one.
    `enabled`: one that is switched off is kept, and not opened."""

    kind: Annotated[str, Meta(pattern=r"\A[A-Za-z0-9][A-Za-z0-9_.-]{0,63}\Z")]  # osc, vmc, ws, ..., or a plug-in's name
    target: Annotated[str, Meta(max_length=256)] = ""  # HOST:PORT, or what the kind understands
    joints: Literal["own", "openxr", "mediapipe"] = "own"
    rate_hz: Annotated[float, Meta(gt=0, le=1000)] | None = None
    enabled: bool = True

    @property
    def spec(self) -> str:
        """As it is typed behind ``--output``."""
        options = [f"joints={self.joints}"] if self.joints != "own" else []
        options += [] if self.rate_hz is None else [f"hz={self.rate_hz:g}"]
        return f"{self.kind}{':' if self.target else ''}{self.target}{'?' if options else ''}{'&'.join(options)}"


class ObjectPoses(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """Where the poses of an object come from that another tracker follows (docs/objects.md, "Another tracker").

    `source`: `openvr`, `libsurvive`, `tcp:HOST:PORT` or `udp:PORT`; no program is started because a file says so.
    `alignment`: the file of ``rhot calibrate alignment``, in the rig file relative to that. `tracker`: which one, by
    serial number, name or role. `rotation_wxyz` and `translation_m`: the object in the tracker's frame.
    """

    source: Annotated[str, Meta(pattern=r"^(openvr|libsurvive|(tcp|udp):[\w.:\-\[\]]+)$", max_length=256)]
    alignment: Annotated[str, Meta(min_length=1, max_length=4096)]
    tracker: Annotated[str, Meta(max_length=64)] = ""
    rotation_wxyz: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    translation_m: tuple[Metres, Metres, Metres] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        CameraPose(self.rotation_wxyz, self.translation_m)


class RigObject(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """A tracked object of the rig.

    `file`: its object file (docs/objects.md), in the rig file relative to that; absolute in a rig that was read.
    `name`: how states name it; None: as the object file does. `model`: what the file says. A rig file has it only where
    there is no such file, as of a rig that came from a log. `poses`: another tracker that follows it.
    """

    file: Annotated[str, Meta(min_length=1, max_length=4096)]
    name: Name | None = None
    model: ObjectModel | None = None
    poses: ObjectPoses | None = None

    @property
    def folder(self) -> Path | None:
        """Where a mesh lies beside the object file; None when that is not known."""
        return Path(self.file).parent if Path(self.file).is_absolute() else None


def landmark_markers(both: bool = False) -> MarkerSet:
    """The landmarks of a hand as markers, or those of `both` hands of a rig."""
    one = load_markers(resource_path("markers", "landmarks21.json"))
    return _of_both_hands(one) if both else one


def _of_both_hands(one: MarkerSet) -> MarkerSet:
    """The markers of a hand, and the same ones of the other hand."""
    others = tuple(msgspec.structs.replace(marker, id=f"{OTHER_HAND}{marker.id}", role=f"{OTHER_HAND}{marker.role}")
                   for marker in one.markers)
    return msgspec.structs.replace(one, markers=one.markers + others)


def usual_hand() -> HandAnatomy:
    """A right hand of usual size."""
    return load_hand(resource_path("hands", "right.json"))


class Rig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The whole rig. Without `markers` its hands are bare, and tracked by landmarks."""

    name: Name
    nodes: Annotated[tuple[RigNode, ...], Meta(min_length=1, max_length=16)]
    markers: MarkerSet = msgspec.field(default_factory=landmark_markers)
    hand: HandAnatomy = msgspec.field(default_factory=usual_hand)
    filters: FilterSettings = FilterSettings()
    depth: DepthSettings = DepthSettings()
    tracker: TrackerSettings = TrackerSettings()
    up: Literal["-y", "z"] = "-y"  # which axis of the rig frame points up: the left camera's, or a table's frame
    broadcast: Broadcast = Broadcast()
    other_hand: HandAnatomy | None = None  # a second one at the same time
    calibration: CameraCalibration | None = None  # of lenses and poses together; none: nothing is recorded
    outputs: tuple[OutputSettings, ...] = ()  # live streams of a live engine
    objects: Annotated[tuple[RigObject, ...], Meta(max_length=16)] = ()  # tracked beside the hand
    format: Literal["rhot-rig"] = FORMAT
    version: Literal[1] = VERSION

    def __post_init__(self) -> None:
        if self.tracker.kind == "classic" and not self.painted:
            msgspec.structs.force_setattr(self, "tracker", msgspec.structs.replace(
                self.tracker, kind="estimator", observe="landmarks"))
        if self.other_hand is not None and self.tracker.landmarks and not self.painted and not any(
                (marker.role or "").startswith(OTHER_HAND) for marker in self.markers.markers):
            msgspec.structs.force_setattr(self, "markers", _of_both_hands(self.markers))
        fields: tuple[tuple[str, list[int | str]], ...] = (
            ("node_id", [node.node_id for node in self.nodes]), ("name", [node.name for node in self.nodes]),
            ("data_port", [node.data_port for node in self.nodes if node.data_port]),
            ("public_key", [node.public_key for node in self.nodes if node.public_key]))
        for what, values in fields:
            doubled = [value for value in values if values.count(value) > 1]
            if doubled:
                raise ValueError(f"two nodes have the same {what} {doubled[0]!r}; each node needs its own")
        if self.depth.mode == "disparity" and len(self.nodes) != 2:
            raise ValueError(f"depth.mode is \"disparity\", which needs two cameras; the rig has {len(self.nodes)}")
        if not any(self.tracked_with):
            raise ValueError("no node has a known pose; the first camera's pose is the rig frame: set its pose_known")
        self._check_hands()
        self._check_objects()
        known = set(self.markers.ids)
        for field in ("pixel_markers", "position_markers"):
            unknown = sorted(set(getattr(self.filters, field)) - known)
            if unknown:
                raise ValueError(f"filters.{field} names a marker {unknown[0]!r} that the marker set does not have")

    @property
    def painted(self) -> bool:
        """Whether a marker that is no landmark is on a hand, or none is a landmark. A hand of which there are landmarks
        only is tracked by them: the classic tracker knows painted markers."""
        landmarks = [marker.shape == "landmark" for marker in self.markers.markers]
        return not any(landmarks) or any(marker.role is not None and not landmark
                                         for marker, landmark in zip(self.markers.markers, landmarks, strict=True))

    @property
    def tracked_with(self) -> tuple[bool, ...]:
        """Of each node, whether its camera is tracked with: its pose is known, or distance follows from disparity."""
        return tuple(node.pose_known or self.depth.mode == "disparity" for node in self.nodes)

    @property
    def models(self) -> tuple[ObjectModel, ...]:
        """The objects, those that were read."""
        return tuple(one.model for one in self.objects if one.model is not None)

    def _check_objects(self) -> None:
        """Objects can be told apart, and their markers are in the marker set and on no hand."""
        read = [one for one in self.objects if one.model is not None]
        try:
            require_distinct(self.models, [one.file for one in read])
        except ObjectError as exc:
            raise ValueError(str(exc).removesuffix(".")) from exc
        roles = {marker.id: marker.role for marker in self.markers.markers}
        for one, model in zip(read, self.models, strict=True):
            if not (model.fiducials or model.markers or one.poses):
                raise ValueError(f"{one.file}: {model.name!r} has neither fiducials nor markers, and the rig names no "
                                 "poses of another tracker for it; give one of the three")
            for marker in model.markers:
                if marker.marker not in roles:
                    raise ValueError(f"{one.file}: the marker {marker.marker!r} of {model.name!r} is not in the rig's "
                                     "marker set; add it there, or name another")
                if roles[marker.marker] is not None:
                    raise ValueError(f"{one.file}: the marker {marker.marker!r} of {model.name!r} has the role "
                                     f"{roles[marker.marker]!r} on the hand; take it away, or name another marker")

    def _check_hands(self) -> None:
        """Each marker has a hand of the rig, and each hand that is tracked by its markers has some."""
        other = [(marker.role or "").startswith(OTHER_HAND) for marker in self.markers.markers]
        if self.other_hand is None and any(other):
            marker = self.markers.markers[other.index(True)]
            raise ValueError(f"marker {marker.id!r} has the role {marker.role!r}, which is on another hand; give the "
                             "rig that hand as other_hand, or the marker another role")
        if self.other_hand is not None and self.tracker.by_markers and not 0 < sum(other) < len(other):
            raise ValueError("the rig has a hand and an other_hand, but not both wear markers; those of other_hand "
                             f"have roles that begin with \"{OTHER_HAND}\", or let bare hands be tracked "
                             "(tracker.observe \"contours\")")


class Obstacle(NamedTuple):
    """What stands in the way, and what to do about it: a sentence each."""

    why: str
    remedy: str


def estimator_obstacle(rig: Rig) -> Obstacle | None:
    """Why the estimator cannot work with a rig, None when nothing is known to stand in its way.

    A marker that sits nowhere on the hand is refused by the tracker itself.
    """
    if rig.depth.mode == "disparity":
        return Obstacle("The estimator needs calibrated cameras; this rig takes distance from disparity alone "
                        "(depth.mode).",
                        "Use Calibrate, Stereo calibration, or the classic tracker (tracker.kind).")
    text = next((node.name for node in rig.nodes if node.text_datagrams), None)
    if text is not None:
        return Obstacle(f"The estimator needs the time of every picture; node {text} sends text datagrams, which "
                        "carry none.", "Run rhot-node there and take text_datagrams out of the rig file, or use the "
                        "classic tracker (tracker.kind).")
    return None


def observation_obstacle(rig: Rig) -> Obstacle | None:
    """Why the rig's marker set does not fit what its tracker is to observe, None when it does. Where paint is to be
    observed, landmarks of the set are, too, as in old files."""
    if rig.tracker.landmarks and not any(marker.shape == "landmark" for marker in rig.markers.markers):
        return Obstacle(f"Landmarks are to be tracked, and the rig's marker set ({rig.markers.name or 'no name'}) has "
                        "none.", "Give the rig a set with landmarks, such as resources/markers/landmarks21.json, or "
                        "track something else (tracker.observe).")
    return None


def with_tracker(rig: Rig, kind: TrackerKind) -> Rig:
    """The rig with another kind of tracker, which may assume what the one before might."""
    observe: Observe = "markers" if kind == "classic" else rig.tracker.observe
    return msgspec.structs.replace(rig, tracker=msgspec.structs.replace(rig.tracker, kind=kind, observe=observe))


def load_rig(path: Path, folder: Path | None = None) -> Rig:
    """Read and validate a rig file and its objects; raises RigError naming file and field.

    `folder`: where the paths of objects begin, by default the file's own folder.
    """
    rig = read_document(path, Rig, format_name=FORMAT, version=VERSION, error=RigError)
    return _with_models(rig, path.parent if folder is None else folder, str(path))


def is_rig_file(path: Path) -> bool:
    """Whether the file says that it is a rig, sound or not."""
    try:
        document = read_json(path, RigError)
    except RigError:
        return False
    return isinstance(document, dict) and document.get("format") == FORMAT


def parse_rig(data: bytes, where: str) -> Rig:
    """Decode a rig document, whose objects have models or absolute paths; `where` begins every error message. Raises
    RigError."""
    return _with_models(decode_document(data, Rig, format_name=FORMAT, version=VERSION, where=where, error=RigError),
                        None, where)


def save_rig(path: Path, rig: Rig) -> None:
    """Write a rig file atomically; raises OSError, the old file then stays as it was."""
    folder = path.resolve().parent

    def written(one: RigObject) -> RigObject:
        if not Path(one.file).is_absolute():
            return one
        return RigObject(os.path.relpath(one.file, folder), one.name, None if Path(one.file).exists() else one.model,
                         _aligned_by(one, lambda file: os.path.relpath(file, folder)))
    write_document(path, _with_objects(rig, written))


def with_object(rig: Rig, path: Path, name: str | None = None) -> Rig:
    """The rig with another object, read from its file. Raises ObjectError (the file) or RigError (it does not go with
    the rig)."""
    model = load_object(path)
    added = RigObject(str(path.resolve()), name, model if name is None else msgspec.structs.replace(model, name=name))
    try:
        return msgspec.structs.replace(rig, objects=(*rig.objects, added))
    except ValueError as exc:
        raise RigError(f"{exc}.") from exc


def _aligned_by(one: RigObject, place: Callable[[str], str]) -> ObjectPoses | None:
    """The object's poses with the path of their alignment as `place` gives it."""
    poses = one.poses
    return None if poses is None else msgspec.structs.replace(poses, alignment=place(poses.alignment))


def _with_objects(rig: Rig, change: Callable[[RigObject], RigObject]) -> Rig:
    return msgspec.structs.replace(rig, objects=tuple(map(change, rig.objects))) if rig.objects else rig


def _with_models(rig: Rig, folder: Path | None, where: str) -> Rig:
    """The rig with its object files read: those below `folder`, and with None only objects that have no model."""
    def read(one: RigObject) -> RigObject:
        if folder is None:
            if one.model is not None:
                return one
            if not Path(one.file).is_absolute():
                raise RigError(f"{where}: the object file {one.file!r} is relative, and to what is not known. Give an "
                               "absolute path.")
        path = ((folder or Path()) / one.file).resolve()
        try:
            model = one.model if one.model is not None and not path.exists() else load_object(path)
        except ObjectError as exc:
            raise RigError(f"{where}: an object of the rig cannot be read. {exc}") from exc
        name = one.name
        return RigObject(str(path), name, model if name is None else msgspec.structs.replace(model, name=name),
                         _aligned_by(one, lambda file: str(((folder or Path()) / file).resolve())))
    try:
        return _with_objects(rig, read)
    except ValueError as exc:
        raise RigError(f"{where}: {exc}.") from exc
