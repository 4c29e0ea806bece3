"""The start of a bare hand that contours show: a pose is shown to the person, and the hand takes it (Rehg 1995).

Whether the hand has taken it is decided by the foreground of one image of each camera (`silhouette`): most joints lie
on it, and the best pose near the shown one is more probable there than no hand.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.pose_search import PoseSearch
from rhot_app.barehand.silhouette import STEP, ForegroundMaps
from rhot_app.estimation.se3 import quaternion_from_rotation, rotation_from_quaternion
from rhot_app.geometry.camera import CameraModel
from rhot_app.geometry.transforms import rigid
from rhot_app.hand.kinematics import forward
from rhot_app.hand.model import HandModel
from rhot_app.hand.motion.hand_state import SHAPE, pose_of, state_at
from rhot_app.hand.motion.palm_on_plane import PalmOnPlane
from rhot_app.hand.skeleton import ANGLES, JOINTS, HandPose
from rhot_app.project import Rig, StartPose

Array = NDArray[np.float64]

START_SD = 0.015, 0.2, 0.2
"""m, rad and rad: standard deviations of position, rotation and angles of a given start, such as a pose that a person
takes: about a thumb's breadth."""

MAJORITY = 0.5
"""Part of the expected contour that must be found, and of the joints that must lie on foreground: more than half. Where
more slices may be confused, fingers are guessed."""

MIN_DWELL_NS = 300_000_000
"""ns: so long a hand holds the start pose before it is followed. Chosen: a hand that passes by is gone by then."""

CONTOUR_THRESHOLD = 0.9
"""Part of the expected contour that is found of a hand that is followed from its start pose, chosen of 0.85 to 0.9 by
all frames of a recorded hand (`python benchmarks/start_pose.py`): each takes the same good poses, and 0.9 none of two
wrong ones. Of drawn hands with errors below 3 mm 0.88 to 1.0 was found. Neither threshold alone refuses faces: of 48
drawn ones two reached 0.94 and 0.95 here, with log odds of 0.26 and 0.10, and another 0.85 with 0.48."""

LOG_ODDS_THRESHOLD = 0.4
"""Log odds per pixel of such a hand and its ring, if every other pixel were foreground. Of drawn hands 0.46 to 0.99; of
wrong poses 0.48 at most. Of the recorded hand 0.42 to 0.7; of fits that are 20 to 35 mm off 0.3 to 0.55, so half of
these pass."""

CANDIDATE_SHARE = 0.25
"""Part of the joints of the shown pose that must lie on foreground before a hand is looked for there. Chosen: fingers
that are a finger's breadth off miss the hand."""

UPRIGHT = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""camera_from_palm of a hand that shows its palm to a camera, fingers up."""

HEIGHT_PART, NEAR_M, FAR_M = 0.5, 0.25, 1.5
"""Part of an image's height that a shown hand fills, and the bounds of its distance, m. Chosen: it stays in the image
when it moves by its own length."""

LATERAL_M = 0.1
"""m: of a shown hand from the middle, where there are two. Chosen: two hands' breadths are then between the palms."""

_PARALLEL = 1e-3  # 3 degrees between the axes of two cameras
_MIDDLE_TIP = JOINTS.index("middle_tip")


def shown_pose(rig: Rig, cameras: Sequence[CameraModel], model: HandModel, plane: PalmOnPlane | None = None,
               lateral_m: float = 0.0) -> HandPose:
    """The pose that a hand is to take: the rig's; else a relaxed hand in the middle of the cameras' views that shows
    the first camera its palm, or that lies on the `plane`. `lateral_m`: to the first camera's right."""
    angles = model.pose_prior.mean.copy()
    for given in rig.tracker.start_poses[:1]:
        for name, degrees in given.angles_deg.items():
            angles[ANGLES.index(name)] = np.radians(degrees)
        return HandPose(rigid(rotation_from_quaternion(given.rotation_wxyz), np.array(given.translation_m)), angles)
    first = cameras[0]
    middle, turn = _middle(rig, cameras, model), first.world_from_camera[:3, :3] @ UPRIGHT
    if plane is not None:
        met = plane.met_by(first.centre, middle)
        middle = middle if met is None else met
        turn = plane.facing(-first.world_from_camera[:3, 1])
    middle = middle + lateral_m * first.world_from_camera[:3, 0]
    centre = np.array([0.5 * _length(model), 0.0, 0.0])
    return HandPose(rigid(turn, middle - turn @ centre), angles)


def start_pose_file(pose: HandPose) -> StartPose:
    """A pose as a rig file has it."""
    w, x, y, z = (float(value) for value in quaternion_from_rotation(pose.world_from_palm[:3, :3]))
    px, py, pz = (float(value) for value in pose.world_from_palm[:3, 3])
    return StartPose((w, x, y, z), (px, py, pz), dict(zip(ANGLES, np.degrees(pose.angles).tolist(), strict=True)))


def _length(model: HandModel) -> float:
    """m: of an open hand, from the wrist to the middle finger's tip."""
    return float(forward(model, HandPose(np.eye(4), np.zeros(21))).joints[_MIDDLE_TIP, 0])


def _middle(rig: Rig, cameras: Sequence[CameraModel], model: HandModel) -> Array:
    """(3,) m: where the cameras' axes come nearest to each other, if that is before all of them; else before their
    middle, where the rig was calibrated for, or where a hand is as large as HEIGHT_PART."""
    axes = np.array([camera.world_from_camera[:3, 2] for camera in cameras])
    centres = np.array([camera.centre for camera in cameras])
    across = np.eye(3) - axes[:, :, None] * axes[:, None, :]
    if np.linalg.eigvalsh(across.sum(axis=0))[0] > _PARALLEL:
        met = np.linalg.solve(across.sum(axis=0), np.einsum("cij,cj->i", across, centres))
        depths = np.sum((met - centres) * axes, axis=1)
        if (depths > NEAR_M).all() and (depths < FAR_M).all():
            return np.asarray(met)
    elif (axes @ axes[0]).min() < 0.0:  # they face each other
        return np.asarray(centres.mean(axis=0))
    distance = cameras[0].intrinsics[1] * _length(model) / (HEIGHT_PART * cameras[0].height)
    if rig.calibration is not None:
        distance = rig.calibration.distance_m
    distance = np.clip(distance, NEAR_M, FAR_M)
    return np.asarray(centres.mean(axis=0) + distance * axes[0])


def taken_pose(shown: HandPose, maps: ForegroundMaps, search: PoseSearch) -> HandPose | None:
    """The pose about the `shown` one that a hand of the file's shape has taken in foreground maps; None without.

    In every map some of the joints must lie on foreground where they are shown, and most where they are found. The log
    odds of `even_log_odds` must be positive there. All this only saves work: `BareHandTracker.verified` decides.
    """
    if all(one is None for one in maps) or not _on_foreground(shown, maps, search, CANDIDATE_SHARE):
        return None
    covariance = np.diag(np.repeat(np.square(START_SD), (3, 3, 21)))
    covariance[6:, 6:] = np.linalg.inv(search.model.pose_prior.information + np.eye(21) / START_SD[2] ** 2)
    state = search.settle(search.odds_of(maps), state_at(shown.world_from_palm, shown.angles, SHAPE), covariance)
    found = pose_of(state)
    good = even_log_odds(search, maps, state) > 0.0 and _on_foreground(found, maps, search, MAJORITY)
    return found if good else None


def even_log_odds(search: PoseSearch, maps: ForegroundMaps, state: Array) -> float:
    """Log odds per pixel of a hand in foreground maps, and of the ring about it, if each pixel of the rest were
    foreground with probability 0.5: a large foreground, such as a face, has less."""
    return search.log_odds_per_pixel(search.odds_of(maps, rate=0.5), state)


def _on_foreground(pose: HandPose, maps: ForegroundMaps, search: PoseSearch, share: float) -> bool:
    joints = forward(search.model, pose).joints
    return all(min(joints_on_foreground(camera, joints, one)) > share
               for camera, one in zip(search.cameras, maps, strict=True) if one is not None)


def joints_on_foreground(camera: CameraModel, joints: Array, probability: NDArray[np.float32]) -> tuple[float, float]:
    """Part of `joints` (J, 3) m, world, that project into a camera's image where the foreground (h, w) of every
    STEP-th pixel is known, and the part of these that lie on foreground."""
    places = camera.project(joints)
    with np.errstate(invalid="ignore"):
        inside = np.all((places > -0.5) & (places < [camera.width - 0.5, camera.height - 0.5]), axis=1)
    rows, columns = probability.shape
    x, y = (places[inside] // STEP).astype(int).T
    shown = probability[np.clip(y, 0, rows - 1), np.clip(x, 0, columns - 1)]
    shown = shown[~np.isnan(shown)]
    return len(shown) / len(places), float(np.mean(shown > 0.5)) if len(shown) else 0.0
