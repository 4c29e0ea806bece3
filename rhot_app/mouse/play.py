"""Plays a script on the twin and feeds the tracker's states to the mouse: markers or a bare hand, two cameras or one.

The mouse gets the tracker's states only. A second mouse gets the true hand, for comparison.
"""

from __future__ import annotations

import hashlib
import math
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, Literal

import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.start import start_pose_file
from rhot_app.estimation.se3 import exp_so3
from rhot_app.evaluation.contour_tracker import SearchedNodes
from rhot_app.evaluation.data_sets import Order, Watch, data_set, data_sets_folder
from rhot_app.evaluation.track import Timed, states_of
from rhot_app.geometry.transforms import rigid
from rhot_app.hand.model import build_model
from rhot_app.hand.skeleton import ANGLES, FINGERS, JOINTS, TIP_ROLES, HandPose
from rhot_app.mouse.model import FLAT_DEG, up_of, with_mouse_model
from rhot_app.mouse.pointer import Mouse, MouseSettings, MouseState
from rhot_app.mouse.script import FACINGS, Script, Side, home_pose, motion_file
from rhot_app.project import PalmPlane, Rig, TrackerSettings
from rhot_app.recording.raw_log import RecordKind
from rhot_app.simulator.bare_hand.sequence import ENTRY_S, BareHandOptions, BareHandSequence, MovedSource
from rhot_app.simulator.film.node_log import T0_MASTER_NS
from rhot_app.simulator.scene.motion import WRIST_BELOW_CENTRE_M, Sway
from rhot_app.simulator.scene.motion_file import load_motion
from rhot_app.simulator.scene.scene import Scene, build_rig, make_scene, twin_defaults
from rhot_app.state import Condition, HandState, Knowledge
from rhot_app.tracking.scene import make_tracker
from rhot_node.detect.foreground import learn_background, skin_foreground
from rhot_node.files import write_document

Array = NDArray[np.float64]

RATE_HZ: Final = 30.0
"""Frame rate of the cameras before a bare hand."""

EMPTY_S: Final = 0.4
"""s: time of the empty background before a bare hand enters."""

EMPTY_IMAGES: Final = 8
"""Number of images of each camera from which the background is learnt."""

POSTURE_SD_DEG: Final = 3.0
"""Standard deviation of the scripted hand's locked joints from those of the mouse's model. Chosen: a goniometer repeats
to 5 degrees."""

PLANE_SD: Final = 0.002, math.radians(0.5)
"""m and rad: standard deviations of the plane that a tracker is given. Chosen: the accuracy of a board on a table."""

_HANDS: Final = {"markers": "markers", "contours": "bare hand"}
_TIPS: Final = [JOINTS.index(f"{finger}_tip") for finger in FINGERS]
_KEY_S: Final = 0.01  # interval of motion keys, for movements of a tenth of a second


@dataclass(frozen=True, slots=True)
class SetUp:
    """How a script is played. `observe`: what the tracker observes. `cameras`: their number. `pictures`: markers are
    rendered and detected; a bare hand always is. `facing`: the side of the hand towards the cameras."""

    observe: Literal["markers", "contours"] = "markers"
    cameras: int = 2
    pictures: bool = False
    facing: Side = "palm"

    @property
    def modelled(self) -> bool:
        """Whether the tracker has the palm's plane and the mouse's hand model (`rhot_app.mouse.model`): with one
        camera, or a bare hand."""
        return self.cameras == 1 or self.observe == "contours"

    @property
    def name(self) -> str:
        """For display."""
        side = f", {self.facing} seen" if self.facing != "palm" else ""
        return f"{_HANDS[self.observe]}, {'one camera' if self.cameras == 1 else 'two cameras'}{side}"


MARKERS: Final = SetUp()


@dataclass(frozen=True, slots=True)
class MouseRun:
    """One script through the pipeline: N states of the tracker, and the mouse states of them and of the true hand.
    `times_s` (N,): scene times. `age_s` (N,): latency until a state was ready."""

    script: Script
    times_s: Array
    states: list[HandState]
    mouse: list[MouseState]
    true_mouse: list[MouseState]
    true_palm: Array  # (N, 3) m
    age_s: Array

    @property
    def cursor(self) -> Array:
        """(N, 3) m, NaN before the resting pose is known."""
        return _cursors(self.mouse)

    @property
    def true_cursor(self) -> Array:
        """(N, 3) m, of the true hand."""
        return _cursors(self.true_mouse)

    def during(self, begin_s: float, end_s: float) -> NDArray[np.bool_]:
        """Mask (N,) of the states between two scene times at which both cursors are known."""
        known = np.isfinite(self.cursor).all(axis=1) & np.isfinite(self.true_cursor).all(axis=1)
        return np.asarray((self.times_s >= begin_s) & (self.times_s <= end_s) & known)


def play(script: Script, seed: int, set_up: SetUp = MARKERS, *, settings: MouseSettings | None = None,
         sway: Sway | None = None, blocked_s: float = math.inf, watch: Watch = lambda title: None) -> MouseRun:
    """Play a script on the twin and feed its states to the mouse. The second camera sends nothing from `blocked_s`, s,
    on. Raises RhotError."""
    settings, scene = settings or MouseSettings(), twin_scene(set_up, seed)
    posture = drawn_posture(seed) if set_up.modelled else FLAT_DEG
    document = motion_file(script, scene.hand, settings, sway or Sway(), key_s=_KEY_S, posture=posture,
                           facing=set_up.facing)
    with tempfile.TemporaryDirectory(prefix="rhot-mouse-") as name:
        path = Path(name) / f"mouse-{hashlib.sha256(msgspec.json.encode(document)).hexdigest()[:16]}.json"
        write_document(path, document)
        tracked = _bare_hand if set_up.observe == "contours" else _markers
        played = tracked(set_up, scene, path, script.end_s, blocked_s, watch)
    times = 1e-9 * np.array([state.t_master_ns - T0_MASTER_NS for state in played.states])
    ready = 1e-9 * np.array([state.t_receive_ns - T0_MASTER_NS for state in played.states]) + played.compute_s
    mouse, true_mouse = Mouse(settings, up_of(played.rig)), Mouse(settings)
    palms = np.array([state.world_from_palm[:3, 3] for state in played.true]).reshape(-1, 3)
    return MouseRun(script, times, played.states, [mouse.feed(state) for state in played.states],
                    [true_mouse.feed(state) for state in played.true], palms, ready - times)


@dataclass(frozen=True, slots=True)
class _Played:
    """A tracker's states, the true ones of the same instants, the tracker's rig, and how long a state took to compute,
    s; NaN: not timed."""

    states: list[HandState]
    true: list[HandState]
    rig: Rig
    compute_s: float


def _markers(set_up: SetUp, scene: Scene, motion: Path, seconds: float, blocked_s: float, watch: Watch) -> _Played:
    order = Order(scene, str(motion), seconds, sketched=not set_up.pictures)
    data = data_set(order, data_sets_folder() if set_up.pictures else motion.parent / "sets", watch, anew=True)
    truth, rig = data.truth, tracked_rig(data.rig, set_up, scene)
    second = data.rig.nodes[1].node_id
    records = [one for one in data.records() if one.node_id != second or one.kind is not RecordKind.DATAGRAM
               or 1e-9 * (one.t_master_ns - T0_MASTER_NS) < blocked_s]
    timed = Timed(records)
    states = list(states_of(timed, rig))
    times_s = 1e-9 * np.array([state.t_master_ns - T0_MASTER_NS for state in states])
    roles = [marker.role for marker in rig.markers.markers]
    tips = truth.markers_at(times_s)[:, [roles.index(role) for role in TIP_ROLES]]
    true = [_true_state(*each) for each in zip(states, truth.palm_at(times_s), truth.joints_at(times_s), tips,
                                               strict=True)]
    return _Played(states, true, rig, float(np.median(timed.compute_s)))


def _bare_hand(set_up: SetUp, scene: Scene, motion: Path, seconds: float, blocked_s: float, watch: Watch) -> _Played:
    """Rendered images, searched as the tracker requests. The hand enters before the script begins."""
    lead_s = EMPTY_S + ENTRY_S
    whole = build_rig(scene)
    model = build_model(scene.hand)
    moved = replace(load_motion(str(motion), model, scene.centre, scene.seed), facing=FACINGS[set_up.facing])
    source = MovedSource(moved, -lead_s, enters_s=EMPTY_S,
                         below_m=0.8 * scene.settings.distance_m)
    sequence = BareHandSequence(whole, whole, model, str(motion), source, BareHandOptions(), lead_s + seconds, RATE_HZ,
                                scene.seed, data_sets_folder())
    rig = tracked_rig(whole, set_up, scene)
    progress, count = watch(f"{motion.name}, bare hand, seed {scene.seed}"), len(sequence.times_ns)
    empty: list[tuple[NDArray[np.uint8], ...]] = []
    nodes: SearchedNodes | None = None
    for number, frame in enumerate(sequence.frames()):
        images = list(frame.images[:set_up.cameras])
        if 1e-9 * frame.t_ns[0] - lead_s >= blocked_s:
            images[1:] = [None] * (len(images) - 1)
        if len(empty) < EMPTY_IMAGES:
            empty.append(tuple(image for image in images if image is not None))
            continue
        if nodes is None:
            foreground = [learn_background(skin_foreground(), list(each)) for each in zip(*empty, strict=True)]
            nodes = SearchedNodes(make_tracker(rig), foreground, len(rig.markers.ids))
        nodes.step(number, images, times_ns=[T0_MASTER_NS + t_ns - round(1e9 * lead_s) for t_ns in frame.t_ns])
        if progress is not None:
            progress(number, count)
    states = [] if nodes is None else nodes.states
    true = []
    for state in states:
        truth = sequence.truth_at(state.t_master_ns - T0_MASTER_NS + round(1e9 * lead_s))
        true_state = _true_state(state, truth.world_from_palm, truth.joints, truth.joints[_TIPS])
        entering = state.t_master_ns < T0_MASTER_NS
        true.append(replace(true_state, condition=Condition.SEARCHING) if entering else true_state)
    return _Played(states, true, rig, math.nan)


def _true_state(state: HandState, palm: Array, joints: Array, tips: Array) -> HandState:
    """A state of the same instant with the true hand, all measured."""
    return replace(state, condition=Condition.TRACKING, world_from_palm=palm, palm_knowledge=Knowledge.MEASURED,
                   palm_covariance=np.zeros((6, 6)), joint_positions=joints,
                   joint_knowledge=np.full(21, Knowledge.MEASURED, np.uint8), fingertip_positions=tips,
                   fingertip_covariances=np.zeros((5, 3, 3)))


def twin_scene(set_up: SetUp, seed: int) -> Scene:
    """The twin's default scene, with the side of the hand of `set_up`."""
    return make_scene(msgspec.structs.replace(twin_defaults(), facing=set_up.facing), seed)


def tracked_rig(rig: Rig, set_up: SetUp, scene: Scene) -> Rig:
    """The rig of the tracker, with the prior knowledge of table and hand, and the pose in which a script begins."""
    rest = HandPose(rigid(home_pose(scene.settings.facing), rest_place(scene)),
                    np.radians([FLAT_DEG.get(name, 0.0) for name in ANGLES]))
    poses = (start_pose_file(rest),) if set_up.observe == "contours" else ()
    tracker = TrackerSettings("estimator", observe=set_up.observe, start_poses=poses)
    rig = msgspec.structs.replace(rig, nodes=rig.nodes[:set_up.cameras], tracker=tracker)
    return with_mouse_model(rig, drawn_plane(scene)) if set_up.modelled else rig


def drawn_plane(scene: Scene) -> PalmPlane:
    """The plane of the scripted palm, with the error of a calibration."""
    rng = np.random.default_rng([scene.seed, 0x91A])
    turn = exp_so3(PLANE_SD[1] * rng.normal(size=3)) @ home_pose(scene.settings.facing)
    normal = turn[:, 2]
    return PalmPlane((float(normal[0]), float(normal[1]), float(normal[2])),
                     float(normal @ rest_place(scene) + PLANE_SD[0] * rng.normal()))


def rest_place(scene: Scene) -> Array:
    """(3,) m: of the wrist of a hand at rest."""
    return np.asarray(scene.centre + np.array([0.0, WRIST_BELOW_CENTRE_M, 0.0]))


def drawn_posture(seed: int) -> dict[str, float]:
    """degrees: a flat hand, each joint with a random error of POSTURE_SD_DEG."""
    rng = np.random.default_rng([seed, 0xF1A7])
    return {name: round(FLAT_DEG.get(name, 0.0) + POSTURE_SD_DEG * float(rng.normal()), 3) for name in ANGLES}


def _cursors(mouse: list[MouseState]) -> Array:
    return np.array([np.full(3, np.nan) if one.cursor is None else one.cursor for one in mouse]).reshape(-1, 3)
