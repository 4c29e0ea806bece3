"""A hand that moves through the volume before two cameras, one of which is knocked: frames without pictures."""

from __future__ import annotations

import dataclasses
import tempfile
from pathlib import Path

import msgspec
import numpy as np

from rhot_app.estimation.se3 import exp_so3, quaternion_from_rotation, rotation_from_quaternion
from rhot_app.geometry.transforms import rigid
from rhot_app.project import CameraPose, Rig
from rhot_app.simulator.film.ideal_observations import ORDINARY, ObservationNoise, ideal_observations
from rhot_app.simulator.film.shot import make_shot
from rhot_app.simulator.scene.motion import Sway
from rhot_app.simulator.scene.motion_file import Key, MotionFile
from rhot_app.simulator.scene.scene import Scene, build_rig, make_scene, twin_defaults
from rhot_app.sources.local_nodes import NodePorts
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.wire.messages import MarkerFlag

EPOCH_NS = 5 * 10**14
LOST = int(MarkerFlag.LOST)
STILL = np.zeros(6)
REACH_MM = np.array([130.0, 80.0, 160.0])
"""Half of the volume that the hand's middle moves through: its markers then come near the pictures' borders."""

PRESS_S = 1.5


def volume_motion(seed: int, reach_mm: np.ndarray = REACH_MM) -> MotionFile:
    """A hand that goes to another place every 1.5 s, half a metre a second at most, and turns and bends a little."""
    rng = np.random.default_rng([seed, 0x70])
    keys = []
    for k in range(40):
        bend = {f"{finger}_{joint}_flexion": float(rng.uniform(5.0, 45.0))
                for finger in ("index", "middle", "ring", "little") for joint in ("mcp", "pip")}
        keys.append(Key(PRESS_S * k, tuple(float(v) for v in rng.uniform(-reach_mm, reach_mm)),
                        tuple(float(v) for v in rng.uniform(-12.0, 12.0, 3)), bend))
    return MotionFile("volume", "Through the whole volume, for the simulated study.", 40 * PRESS_S, tuple(keys),
                      sway=Sway(position_mm=2.0, rotation_deg=1.2, angle_deg=1.0, tremor_mm=0.05))


def moved(pose: CameraPose, correction: np.ndarray) -> CameraPose:
    """`pose` turned by the first three numbers (rad) and shifted by the others (m) along its own axes."""
    there = rigid(rotation_from_quaternion(pose.rotation_wxyz), pose.translation_m) @ rigid(
        exp_so3(correction[:3]), correction[3:])
    return CameraPose(tuple(float(v) for v in quaternion_from_rotation(there[:3, :3])),
                      tuple(float(v) for v in there[:3, 3]))


def scene_of(seed: int) -> Scene:
    return make_scene(twin_defaults(), seed)


def rig_of(scene: Scene) -> Rig:
    """As a perfect calibration of the scene would have found it."""
    return build_rig(scene, tuple(NodePorts(47810 + 10 * k, 47811 + 10 * k, 47812 + 10 * k, 47813 + 10 * k)
                                  for k in range(len(scene.names))))


def filmed(scene: Scene, motion: str | MotionFile, seconds: float, correction: np.ndarray = STILL,
           knocked_at_s: float = 0.0, noise: ObservationNoise = ORDINARY,
           bias_px: np.ndarray | None = None) -> list[CameraObservations]:
    """All frames in the order of their arrival. The second camera is moved by `correction` from `knocked_at_s` on;
    `bias_px` (C, M, 2) is added to every centroid."""
    frames = _frames(scene, motion, seconds, noise, bias_px)
    if np.any(correction):
        poses = (scene.poses[0], moved(scene.poses[1], correction))
        after = _frames(dataclasses.replace(scene, poses=poses), motion, seconds, noise, bias_px)
        since = EPOCH_NS + round(1e9 * knocked_at_s)
        frames = [f for f in frames if f.t_row0_master_ns < since] + [f for f in after if f.t_row0_master_ns >= since]
    return sorted(frames, key=lambda frame: frame.t_receive_ns)


def _frames(scene: Scene, motion: str | MotionFile, seconds: float, noise: ObservationNoise,
            bias_px: np.ndarray | None) -> list[CameraObservations]:
    with tempfile.TemporaryDirectory() as folder:
        if isinstance(motion, MotionFile):
            path = Path(folder) / "volume.json"
            path.write_bytes(msgspec.json.encode(motion))
            motion = str(path)
        shot = make_shot(scene, motion, seconds)
    found = []
    for index in range(len(scene.names)):
        observed, _ = ideal_observations(shot, index, noise)
        for t_ns, markers in zip(scene.frame_times_ns(index, seconds), observed, strict=True):
            found.append(_frame(scene, index, t_ns, markers, None if bias_px is None else bias_px[index]))
    return found


def _frame(scene: Scene, index: int, t_ns: int, markers: list, bias_px: np.ndarray | None) -> CameraObservations:
    flags = np.array([int(one.flags) for one in markers], np.uint16)
    pixels = np.array([(one.x, one.y) for one in markers])
    pixels[(flags & LOST) != 0] = np.nan
    if bias_px is not None:
        pixels = pixels + bias_px
    covariances = np.array([[[one.cov_xx, one.cov_xy], [one.cov_xy, one.cov_yy]] for one in markers])
    return CameraObservations(
        camera=index, t_row0_master_ns=EPOCH_NS + t_ns, row_time_ns=scene.row_time_ns, clock_bound_s=1e-4,
        t_receive_ns=EPOCH_NS + t_ns + 480 * scene.row_time_ns + 5_000_000, detect_s=2e-3, network_s=1e-3,
        pixels=pixels, covariances=covariances, diameters=np.array([one.diameter for one in markers]),
        qualities=np.array([one.quality for one in markers]), flags=flags)
