"""A landmark detector without images: what it would report of a moving hand, with errors of the measured sizes.

The errors are drawn otherwise than the estimator models them: the mean places are fixed in the hand's segments, the
lasting errors are each camera's own in the image, and a landmark's own error has the tails of Student's t with 4
degrees of freedom.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_app.estimation.se3 import quaternion_from_rotation
from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.anatomy import load_hand
from rhot_app.hand.kinematics import frames_and_points
from rhot_app.hand.landmarks import LASTING_S
from rhot_app.hand.model import HandModel, build_model
from rhot_app.hand.places import LANDMARK_ROLES
from rhot_app.project import CameraPose, Intrinsics, Rig, RigNode, TrackerSettings
from rhot_app.simulator.scene.motion_file import load_motion
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.files import resource_path
from rhot_node.markers import MarkerSet, load_markers

Array = NDArray[np.float64]

EPOCH_NS = 10**12
DISTANCE_M, ANGLE_RAD = 0.6, math.radians(40.0)
"""Of the hand from each camera, and between the two cameras."""

_DEGREES = 4.0  # of freedom of a landmark's own error


@dataclass(frozen=True, slots=True)
class LandmarkErrors:
    """Standard deviations per axis, m at the hand, of a recorded hand (`python benchmarks/landmarks.py`). `anatomy`: of
    a landmark's mean place about its joint; `lasting`: of the error of one camera that lasts; `common`: of the error
    that all landmarks of a frame share; `noise`: of a landmark's own error. `painted_px`: of painted markers, px."""

    anatomy: float = 3e-3
    lasting: float = 2e-3
    common: float = 1e-3
    noise: float = 1.3e-3
    painted_px: float = 0.1


@dataclass(frozen=True, slots=True)
class Hand:
    """A hand that moves: `model` is the true one, whose bones may differ from the rig's."""

    model: HandModel
    worlds: Array  # (T, 4, 4)
    angles: Array  # (T, 21) rad
    times_s: Array  # (T,)

    def joints(self) -> Array:
        """(T, 21, 3) m, world."""
        return frames_and_points(self.model.dh, self.worlds, self.angles)[1][:, :len(LANDMARK_ROLES)]


def landmark_rig(cameras: int = 2, markers: MarkerSet | None = None, *, float_scale: bool = False) -> Rig:
    """Cameras that look at one place from `ANGLE_RAD` apart, with the landmark set or other `markers`."""
    lens, nodes = Intrinsics(640, 480, 530.0, 530.0, 319.5, 239.5), []
    for k in range(cameras):
        turn = ANGLE_RAD * (k - 0.5 * (cameras - 1))
        c, s = math.cos(turn), math.sin(turn)
        pose = np.eye(4)
        pose[:3, :3] = [[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]
        pose[:3, 3] = [-DISTANCE_M * s, 0.0, DISTANCE_M * (1.0 - c)]
        w, x, y, z = (float(value) for value in quaternion_from_rotation(pose[:3, :3]))
        a, b, d = (float(value) for value in pose[:3, 3])
        nodes.append(RigNode(k + 1, f"camera {k + 1}", lens, CameraPose((w, x, y, z), (a, b, d))))
    return Rig("landmarks", tuple(nodes), markers or load_markers(resource_path("markers", "landmarks21.json")),
               load_hand(resource_path("hands", "right.json")),
               tracker=TrackerSettings(kind="estimator", float_scale=float_scale))


def moving_hand(rig: Rig, motion: str, seconds: float, fps: float, seed: int, bone_sd: float = 0.0) -> Hand:
    """The rig's hand in a shipped motion; each of its bones is longer by a factor with standard deviation `bone_sd`."""
    rng, fingers = np.random.default_rng(seed), {}
    for name, finger in rig.hand.fingers.items():
        a, b, c = (float(bone * math.exp(bone_sd * rng.standard_normal())) for bone in finger.bones_mm)
        fingers[name] = msgspec.structs.replace(finger, bones_mm=(a, b, c), marker_mm=min(finger.marker_mm, c))
    model = build_model(msgspec.structs.replace(rig.hand, fingers=fingers))
    times = np.arange(round(seconds * fps)) / fps
    moving = load_motion(motion, model, np.array([0.0, 0.0, DISTANCE_M]), seed)
    return Hand(model, *moving.sample(times), times)


def detected_landmarks(rig: Rig, hand: Hand, seed: int,
                       errors: LandmarkErrors | None = None) -> list[CameraObservations]:
    """What all cameras report, in the order of time. Painted fingertips are seen at the pads' centres."""
    rng, errors = np.random.default_rng([seed, 1]), errors or LandmarkErrors()
    roles = [marker.role or "" for marker in rig.markers.markers]
    landmark = np.array([role in LANDMARK_ROLES for role in roles])
    joints = [LANDMARK_ROLES.index(role) if role in LANDMARK_ROLES
              else len(LANDMARK_ROLES) + [f"{name}_tip" for name in hand.model.anatomy.fingers].index(role)
              for role in roles]
    frames, points = frames_and_points(hand.model.dh, hand.worlds, hand.angles)
    rows, count = hand.model.dh.point_row[joints], len(joints)
    offsets = np.where(landmark[:, None], errors.anatomy * rng.standard_normal((count, 3)), 0.0)
    places = points[:, joints] + np.einsum("tmij,mj->tmi", frames[:, rows, :, :3], offsets)
    out = []
    for camera, node in enumerate(rig.nodes):
        model = CameraModel.from_rig(node.intrinsics, node.pose)
        depth = model.camera_from_world[2]
        lasting = errors.lasting * rng.standard_normal((count, 2))
        for t, t_s in enumerate(hand.times_s):
            kept = math.exp(-(hand.times_s[1] - hand.times_s[0]) / LASTING_S)
            lasting = kept * lasting + math.sqrt(1.0 - kept * kept) * errors.lasting * rng.standard_normal((count, 2))
            own = rng.standard_t(_DEGREES, (count, 2)) * math.sqrt((_DEGREES - 2.0) / _DEGREES)
            off_m = lasting + errors.noise * own + errors.common * rng.standard_normal(2)
            px_per_m = node.intrinsics.fx / (places[t] @ depth[:3] + depth[3])
            off = np.where(landmark[:, None], off_m * px_per_m[:, None],
                           errors.painted_px * rng.standard_normal((count, 2)))
            pixels = model.project(places[t]) + off
            sd = np.where(landmark, 0.3, errors.painted_px)
            t_ns = EPOCH_NS + round(1e9 * t_s)
            out.append(CameraObservations(
                camera, t_ns, 0, 1e-5, t_ns + 10**6, 1e-3, 1e-3, pixels, (sd**2)[:, None, None] * np.eye(2),
                np.ones(count), np.ones(count), np.zeros(count, np.uint16)))
    return sorted(out, key=lambda one: (one.t_row0_master_ns, one.camera))

