"""Bare hands filmed for trackers without markers: pictures with their times, and apart from them the truth.

A tracker is given `BareHandSequence.tracker_rig` and the pictures; the hand, its skin, the light and the true cameras
are drawn from the seed. Time 0 is the sequence's start; pictures are timed at the mid-exposure of their middle row.
What was rendered once can be kept in a folder and found again: the hand as it is lit, without the sensor's noise.
"""

from __future__ import annotations

import functools
import hashlib
import json
import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Final, Literal

import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rhot_app.estimation.se3 import exp_so3, quaternion_from_rotation, rotation_from_quaternion
from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.anatomy import HandAnatomy
from rhot_app.hand.kinematics import forward
from rhot_app.hand.model import HandModel, build_model
from rhot_app.hand.skeleton import FINGERS, HandPose
from rhot_app.project import CameraCalibration, CameraPose, Rig, RigNode
from rhot_app.simulator.bare_hand.painter import BareHand, BareHandPainter, light_of
from rhot_app.simulator.bare_hand.skin import skin_colours
from rhot_app.simulator.bare_hand.surface import build_surface
from rhot_app.simulator.render.camera_controls import Controls, Lamp
from rhot_app.simulator.render.exposure_samples import Shutter
from rhot_app.simulator.render.painter import KeptPainter, PoseSource
from rhot_app.simulator.render.render import Exposure, FrameRenderer, Optics
from rhot_app.simulator.scene.background import background_image
from rhot_app.simulator.scene.motion import BACK_FACING, FACING
from rhot_app.simulator.scene.motion_file import load_motion
from rhot_app.simulator.scene.scene import Background, make_scene, twin_defaults
from rhot_node.detect.image import from_i420, to_bgr

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]

ENTRY_S: Final = 0.6
"""How long a hand takes to come into the picture from below."""

SPEED_UP_S: Final = 0.4
"""How long a hand that was held still takes to its motion's speed."""

_EXPOSURE_STEP_S: Final = 0.7  # from one step of an automatic exposure to the next
_EXPOSURE_STEP: Final = 0.3  # largest step, part of the light
_COMMON: Final = 0.6
"""Part of a hand's deviation from the mean hand that all its bones share; the rest, in squares, is each bone's own."""


@dataclass(frozen=True)
class BareHandOptions:
    """How a sequence differs from a nominal hand before a cloth in exactly calibrated, synchronised cameras.

    `length_sd`, `radius_sd`: standard deviations of bone lengths and of radii, parts of 1. `tone`: of the skin, 1..10
    on the Monk scale, None: drawn from 2 to 9. `sleeve`: the forearm wears one. `facing`: the side of the hand towards
    the cameras. `turn_deg`: largest turn of the whole motion, about any axis. `enters_after_s`: the background alone
    is seen so long, then the hand comes in from below; None: it is there. `holds_s`: so long it then holds the motion's
    first pose. `exposure_steps`: an automatic exposure
    changes by up to 30 %. `row_time_us`: of the rolling shutter. `camera_delay`: part of a frame by which the second
    camera lags. `calibration_deg`, `calibration_mm`: how wrong the tracker's rig is. `lost`: (camera, from s, to s) in
    which a camera delivers no picture. `mesh_m`: length of the surface's edges.
    """

    length_sd: float = 0.0
    radius_sd: float = 0.0
    tone: float | None = None
    forearm: bool = True
    sleeve: bool = False
    background: Background = "cloth"
    distance_m: float = 0.6
    facing: Literal["palm", "back"] = "palm"
    turn_deg: float = 0.0
    enters_after_s: float | None = None
    holds_s: float = 0.0
    exposure_ms: float = 4.0
    exposure_steps: bool = False
    row_time_us: float = 0.0
    camera_delay: float = 0.0
    calibration_deg: float = 0.0
    calibration_mm: float = 0.0
    lost: tuple[tuple[int, float, float], ...] = ()
    mesh_m: float = 2e-3


@dataclass(frozen=True)
class BareHandTruth:
    """The hand at one instant, rig frame: `joints` (21, 3) m, `angles` (21,) rad, `world_from_palm` (4, 4) m;
    `in_view`: whether every joint lies inside every camera's picture, delivered or not."""

    t_ns: int
    joints: Array
    angles: Array
    world_from_palm: Array
    in_view: bool

    @property
    def pose(self) -> HandPose:
        """The same as a pose."""
        return HandPose(self.world_from_palm, self.angles)


@dataclass(frozen=True)
class BareHandFrame:
    """One picture of every camera: `images` (H, W, 3) uint8 RGB, None where a camera delivers none, `t_ns` the
    mid-exposure of their middle rows, and the truth at the mean of those times."""

    images: tuple[Picture | None, ...]
    t_ns: tuple[int, ...]
    truth: BareHandTruth


@dataclass(frozen=True, eq=False)
class BareHandSequence:
    """A filmed bare hand; `frames` renders it. `rig`: the true cameras and the mean hand. `tracker_rig`: what a
    calibration with its errors, and no measured hand, would give a tracker. `model`: the hand that is filmed, moved by
    `source`. `kept_in`: a folder for what is rendered, or None."""

    rig: Rig
    tracker_rig: Rig
    model: HandModel
    motion: str
    source: MovedSource
    options: BareHandOptions
    seconds: float
    rate_hz: float
    seed: int
    kept_in: Path | None = None

    @functools.cached_property
    def hand(self) -> BareHand:
        """What is filmed, made when it is first asked for."""
        return drawn_hand(self.model, self.source, self.options, self.seed, len(self.rig.markers.ids))

    @property
    def times_ns(self) -> list[tuple[int, ...]]:
        """By frame: the cameras' times."""
        delays = [self.options.camera_delay / self.rate_hz * k for k in range(len(self.rig.nodes))]
        half_s = 0.5e-6 * self.options.row_time_us * self.rig.nodes[0].intrinsics.height
        return [tuple(round(1e9 * (half_s + n / self.rate_hz + delay)) for delay in delays)
                for n in range(max(1, round(self.seconds * self.rate_hz)))]

    def frames(self) -> Iterator[BareHandFrame]:
        """Render frame by frame."""
        cameras = [CameraModel.from_rig(node.intrinsics, node.pose) for node in self.rig.nodes]
        renderers = [self._renderer(index, camera) for index, camera in enumerate(cameras)]
        for number, times_ns in enumerate(self.times_ns):
            images = tuple(self._picture(renderers[k], k, 1e-9 * t_ns, number) for k, t_ns in enumerate(times_ns))
            yield BareHandFrame(images, times_ns, self.truth_at(sum(times_ns) // len(times_ns)))

    def truth_at(self, t_ns: int) -> BareHandTruth:
        """The hand at any instant, ns."""
        world_from_palm, angles = self.source.sample(np.array([1e-9 * t_ns]))
        joints = forward(self.model, HandPose(world_from_palm[0], angles[0])).joints
        in_view = True
        for node in self.rig.nodes:
            seen = CameraModel.from_rig(node.intrinsics, node.pose).project(joints)
            size = (node.intrinsics.width - 1, node.intrinsics.height - 1)
            in_view = in_view and bool(((seen >= 0.0) & (seen <= size)).all())
        return BareHandTruth(t_ns, joints, angles[0], world_from_palm[0], in_view)

    def _renderer(self, index: int, camera: CameraModel) -> FrameRenderer:
        options, settings = self.options, twin_defaults()
        background = background_image(options.background, camera, options.distance_m, self.seed)
        shutter = Shutter(1e-3 * options.exposure_ms, 1e-6 * options.row_time_us)
        optics = Optics(settings.psf_sigma_px, settings.noise_mid_grey, settings.noise_read)
        exposure = Exposure(shutter, shutter.exposure_s, Lamp(), Controls())
        count = len(self.times_ns)
        painter = KeptPainter(lambda: BareHandPainter(self.hand, camera), background,
                              None if self.kept_in is None else self.kept_in / self._file(index), count)
        return FrameRenderer(painter, background, optics, exposure, 1000 * self.seed + index)

    def _file(self, index: int) -> str:
        """A name that differs with all that the rendered hand depends on, its programs included."""
        about = replace(self.options, lost=(), calibration_deg=0.0, calibration_mm=0.0, exposure_steps=False)
        facts = [msgspec.to_builtins(self.rig), asdict(about), self.seconds, self.rate_hz, index, _sources()]
        digest = hashlib.sha256(json.dumps(facts, sort_keys=True).encode()).hexdigest()
        return f"bare-{Path(self.motion).stem}-{self.seed}-{digest[:16]}.zip"

    def _picture(self, renderer: FrameRenderer, index: int, t_s: float, number: int) -> Picture | None:
        controls = Controls()
        if self.options.exposure_steps:
            rng = np.random.default_rng([self.seed, 0xE59, math.floor(t_s / _EXPOSURE_STEP_S)])
            controls = Controls(gain=math.exp(rng.uniform(-1.0, 1.0) * math.log1p(_EXPOSURE_STEP)))
        exposure = replace(renderer.exposure, controls=controls)
        if exposure != renderer.exposure:
            renderer.expose(exposure)
        intrinsics = self.rig.nodes[index].intrinsics
        t_row0_s = t_s - 0.5e-6 * self.options.row_time_us * intrinsics.height
        packed, _ = renderer.render(self.source, t_row0_s, number)
        if any(camera == index and start <= t_s < end for camera, start, end in self.options.lost):
            return None
        return np.ascontiguousarray(to_bgr(from_i420(packed, intrinsics.width, intrinsics.height))[:, :, ::-1])


def bare_hand_sequence(rig: Rig, motion: str, seconds: float, rate_hz: float, seed: int,
                       options: BareHandOptions = BareHandOptions(), kept_in: Path | None = None) -> BareHandSequence:
    """A bare hand like the rig's, before the rig's cameras. `motion`: a name or a file, as of `load_motion`.

    Raises SimulatorError when there is no such motion.
    """
    model = build_model(varied_hand(rig.hand, options.length_sd, options.radius_sd, seed))
    tracker_rig = miscalibrated(rig, math.radians(options.calibration_deg), 1e-3 * options.calibration_mm, seed)
    return BareHandSequence(rig, tracker_rig, model, motion, _pose_source(rig, motion, seed, options), options, seconds,
                            rate_hz, seed, kept_in)


def drawn_hand(model: HandModel, source: PoseSource, options: BareHandOptions, seed: int, markers: int) -> BareHand:
    """Surface, skin, sleeve and lamp of a hand, drawn from the seed; `markers`: of the rig's set, all unpainted."""
    rng = np.random.default_rng([seed, 0xBA2E])
    sleeve_from_m = float(rng.uniform(0.05, 0.12))
    surface = build_surface(model.anatomy, spacing_m=options.mesh_m, forearm=options.forearm,
                            sleeve_from_m=sleeve_from_m if options.sleeve else None)
    tone = float(rng.uniform(2.0, 9.0)) if options.tone is None else options.tone
    red, green, blue = (float(level) for level in rng.uniform(25.0, 215.0, 3))
    colours = skin_colours(surface, tone, (red, green, blue) if options.sleeve else None, seed)
    lamp = light_of((float(rng.uniform(-0.6, 0.6)), float(rng.uniform(-0.4, 0.4))))
    arm = Rotation.from_rotvec(rng.normal(0.0, 0.12, 3)).apply(source.sample(np.zeros(1))[0][0, :3, 0])
    return BareHand(surface, colours, arm, lamp, float(rng.uniform(0.30, 0.55)), markers)


def bare_hand_rig(side: Literal["right", "left"] = "right", *, width: int | None = None) -> Rig:
    """The twin's exactly calibrated rig, with the mean hand of one side. `width`: of smaller pictures with the same
    field of view, px."""
    scene = make_scene(msgspec.structs.replace(twin_defaults(), hand=side), 0)
    lens = scene.intrinsics
    if width is not None:
        part = width / lens.width
        lens = msgspec.structs.replace(lens, width=width, height=round(part * lens.height), fx=part * lens.fx,
                                       fy=part * lens.fy, cx=part * (lens.cx + 0.5) - 0.5,
                                       cy=part * (lens.cy + 0.5) - 0.5)
    nodes = tuple(RigNode(node_id=k + 1, name=scene.names[k], intrinsics=lens, pose=scene.poses[k])
                  for k in range(len(scene.names)))
    return Rig(name="simulated", nodes=nodes, markers=scene.markers, hand=scene.hand,
               calibration=CameraCalibration("exact", error_m=0.0))


def varied_hand(anatomy: HandAnatomy, length_sd: float, radius_sd: float, seed: int) -> HandAnatomy:
    """A hand drawn about `anatomy`: standard deviations of its bones' lengths and of its radii, parts of 1."""
    rng = np.random.default_rng([seed, 0x4A2D])
    own = math.sqrt(1.0 - _COMMON ** 2)
    length, radius = rng.normal(size=2)

    def factor(sd: float, common: float) -> float:
        return 1.0 + sd * float(np.clip(_COMMON * common + own * rng.normal(), -2.0, 2.0))

    palm, fingers = factor(length_sd, length), {}
    for name in FINGERS:
        finger, thick = anatomy.fingers[name], factor(radius_sd, radius)
        x, y, z = finger.base_mm
        first, second, last = (factor(length_sd, length) * bone for bone in finger.bones_mm)
        radii = [thick * value for value in finger.radii_mm]
        fingers[name] = msgspec.structs.replace(
            finger, base_mm=(palm * x, palm * y, palm * z), bones_mm=(first, second, last),
            radii_mm=(radii[0], radii[1], radii[2]), marker_mm=finger.marker_mm * last / finger.bones_mm[2])
    thick = factor(radius_sd, radius)
    return msgspec.structs.replace(
        anatomy, fingers=fingers, palm_thickness_mm=thick * anatomy.palm_thickness_mm,
        wrist_breadth_mm=thick * anatomy.wrist_breadth_mm, wrist_thickness_mm=thick * anatomy.wrist_thickness_mm)


def miscalibrated(rig: Rig, turn_rad: float, shift_m: float, seed: int) -> Rig:
    """The rig with every camera but the first turned by `turn_rad` and shifted by `shift_m`, in random directions. It
    does not say how well it is calibrated."""
    rng = np.random.default_rng([seed, 0xCA1])
    nodes = [rig.nodes[0]]
    for node in rig.nodes[1:]:
        axis, way = (vector / np.linalg.norm(vector) for vector in rng.normal(size=(2, 3)))
        rotation = rotation_from_quaternion(node.pose.rotation_wxyz) @ exp_so3(turn_rad * axis)
        w, x, y, z = (float(value) for value in quaternion_from_rotation(rotation))
        tx, ty, tz = (float(value) for value in np.array(node.pose.translation_m) + shift_m * way)
        nodes.append(msgspec.structs.replace(node, pose=CameraPose((w, x, y, z), (tx, ty, tz))))
    return msgspec.structs.replace(rig, nodes=tuple(nodes), calibration=None)


@dataclass(frozen=True)
class MovedSource:
    """A `PoseSource` that begins another one at `start_s`, turned by `turn` (3, 3) about `centre` (3,) m and shifted by
    `shift` (3,) m; until `enters_s` the hand stands `below_m` lower, out of the picture, and then rises. `holds_s`:
    until so long after it has risen, it holds its first pose."""

    base: PoseSource
    start_s: float = 0.0
    turn: Array = field(default_factory=lambda: np.eye(3))
    centre: Array = field(default_factory=lambda: np.zeros(3))
    shift: Array = field(default_factory=lambda: np.zeros(3))
    enters_s: float | None = None
    below_m: float = 0.5
    holds_s: float = 0.0

    @property
    def moves_s(self) -> float:
        """When a hand that is held begins to move."""
        return (0.0 if self.enters_s is None else self.enters_s + ENTRY_S) + self.holds_s

    def sample(self, times_s: Array) -> tuple[Array, Array]:
        """(T, 4, 4) world_from_palm and (T, 21) rad at times (T,) s."""
        moved_s = times_s
        if self.holds_s:
            late = np.maximum(times_s - self.moves_s, 0.0)
            moved_s = np.where(late < SPEED_UP_S, 0.5 * late**2 / SPEED_UP_S, late - 0.5 * SPEED_UP_S)
        transforms, angles = self.base.sample(moved_s + self.start_s)
        out = transforms.copy()
        out[:, :3, :3] = self.turn @ transforms[:, :3, :3]
        out[:, :3, 3] = (transforms[:, :3, 3] - self.centre) @ self.turn.T + self.centre + self.shift
        if self.enters_s is not None:
            t = np.clip((times_s - self.enters_s) / ENTRY_S, 0.0, 1.0)
            out[:, 1, 3] += self.below_m * (1.0 - t ** 3 * (10.0 - 15.0 * t + 6.0 * t * t))
        return out, angles


def _pose_source(rig: Rig, motion: str, seed: int, options: BareHandOptions) -> MovedSource:
    rng = np.random.default_rng([seed, 0x90E5])
    centres = np.array([node.pose.translation_m for node in rig.nodes])
    centre = centres.mean(axis=0) + np.array([0.0, 0.0, options.distance_m])
    base = load_motion(motion, build_model(rig.hand), centre, seed)
    base = replace(base, facing=BACK_FACING if options.facing == "back" else FACING)
    axis = rng.normal(size=3)
    turn = exp_so3(math.radians(options.turn_deg) * rng.uniform() * axis / np.linalg.norm(axis))
    shift = (options.turn_deg > 0.0) * rng.uniform(-0.04, 0.04, 3)
    start_s = float(rng.uniform(0.0, base.period_s))
    return MovedSource(base, start_s, turn, centre, shift, options.enters_after_s, 0.8 * options.distance_m,
                       options.holds_s)


@functools.cache
def _sources() -> str:
    """A digest of the programs that a rendered bare hand depends on."""
    own = Path(__file__).parent
    files = [*sorted(own.glob("*.py")), *(own.parent / "scene" / f"{name}.py" for name in ("motion", "background"))]
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()
