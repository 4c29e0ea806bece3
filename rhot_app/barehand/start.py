"""The start of a bare hand that contours show: a pose is shown to the person, and the hand takes it (Rehg 1995).

Whether the hand has taken it is decided by the foreground of one image of each camera (`silhouette`): most joints lie
on it, and the best pose near the shown one is more probable there than no hand.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.silhouette import CORRELATED, LogOddsMaps, log_odds_maps, score, score_steps, search
from rhot_app.barehand.surface import Surface
from rhot_app.estimation.se3 import quaternion_from_rotation, rotation_from_quaternion
from rhot_app.geometry.camera import CameraModel
from rhot_app.geometry.transforms import rigid
from rhot_app.hand.kinematics import forward
from rhot_app.hand.model import HandModel
from rhot_app.hand.motion.hand_state import SHAPE
from rhot_app.hand.motion.palm_on_plane import PalmOnPlane
from rhot_app.hand.skeleton import ANGLE_SLICES, ANGLES, FLEXIONS, JOINTS, HandPose
from rhot_app.project import Rig, StartPose

Array = NDArray[np.float64]
ForegroundMaps = Sequence[NDArray[np.float32] | None]
"""Foreground probabilities (h, w) of every STEP-th pixel of each camera, None of a camera without an image."""

STEP = 8
"""px: spacing of the pixels of the foreground map."""

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

ROUNDS = 15
"""Rounds of a search about a pose (`silhouette.search`). Chosen: enough to rank postures."""

UPRIGHT = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""camera_from_palm of a hand that shows its palm to a camera, fingers up."""

HEIGHT_PART, NEAR_M, FAR_M = 0.5, 0.25, 1.5
"""Part of an image's height that a shown hand fills, and the bounds of its distance, m. Chosen: it stays in the image
when it moves by its own length."""

LATERAL_M = 0.1
"""m: of a shown hand from the middle, where there are two. Chosen: two hands' breadths are then between the palms."""

_CURLS_DEG = ((5.0, 10.0, 5.0), (20.0, 30.0, 20.0), (65.0, 80.0, 45.0))  # MCP, PIP, DIP: open, relaxed, closed
_PARALLEL = 1e-3  # 3 degrees between the axes of two cameras
_MIDDLE_TIP = JOINTS.index("middle_tip")
_THUMB_STEP = 0.5  # rad to either side of a relaxed thumb: a third of its range


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


def taken_pose(shown: HandPose, maps: ForegroundMaps, cameras: Sequence[CameraModel], model: HandModel,
               surface: Surface, rng: np.random.Generator, plane: PalmOnPlane | None = None) -> HandPose | None:
    """The pose about the `shown` one that a hand of the file's shape has taken in foreground maps; None without.

    In every map some of the joints must lie on foreground where they are shown, and most where they are found.
    `mean_log_odds` must be positive there. All this only saves work: `BareHandTracker.verified` decides.
    """
    used = [camera for camera, one in zip(cameras, maps, strict=True) if one is not None]
    known = [one for one in maps if one is not None]
    if not known or not _on_foreground(shown, known, used, model, CANDIDATE_SHARE):
        return None
    lenses = [camera.camera_from_world[:3] for camera in used], [camera.intrinsics for camera in used]
    covariance = np.diag(np.repeat(np.square(START_SD), (3, 3, 21)))
    covariance[6:, 6:] = np.linalg.inv(model.pose_prior.information + np.eye(21) / START_SD[2] ** 2)
    size = np.zeros(SHAPE)
    world, angles = settle(surface, shown.world_from_palm, shown.angles, covariance, model, size,
                           log_odds_maps(known, STEP, *lenses), rng, plane)
    found = HandPose(world, angles)
    good = (mean_log_odds(found, size, maps, cameras, surface) > 0.0
            and _on_foreground(found, known, used, model, MAJORITY))
    return found if good else None


def mean_log_odds(pose: HandPose, size: Array, maps: ForegroundMaps, cameras: Sequence[CameraModel],
              surface: Surface) -> float:
    """Log odds per pixel of a hand of the shape `size` (SHAPE,) in foreground maps, and of the ring about it, if each
    pixel of the rest were foreground with probability 0.5: a large foreground, such as a face, has less."""
    used = [(camera, one) for camera, one in zip(cameras, maps, strict=True) if one is not None]
    even = log_odds_maps([one for _, one in used], STEP, [camera.camera_from_world[:3] for camera, _ in used],
                         [camera.intrinsics for camera, _ in used], rate=0.5)
    _, parts = score(surface, pose.world_from_palm, pose.angles, size, even)
    return float((parts[:, 0] + parts[:, 2]).sum() / max(parts[:, 1].sum(), 1.0))


def _on_foreground(pose: HandPose, maps: Sequence[NDArray[np.float32]], cameras: Sequence[CameraModel],
                   model: HandModel, share: float) -> bool:
    joints = forward(model, pose).joints
    return all(min(joints_on_foreground(camera, joints, one)) > share
               for camera, one in zip(cameras, maps, strict=True))


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


def log_odds(surface: Surface, world: Array, angles: Array, model: HandModel, size: Array, odds: LogOddsMaps) -> float:
    """Log odds of a pose by the foreground (`silhouette.score`) and the pose prior, up to a constant."""
    prior, shown = model.pose_prior, score(surface, world, angles, size, odds)[0]
    bent = angles - prior.mean
    return shown / CORRELATED - 0.5 * float(bent @ prior.information @ bent)


def settle(surface: Surface, world: Array, angles: Array, covariance: Array, model: HandModel, size: Array,
           odds: LogOddsMaps, rng: np.random.Generator, plane: PalmOnPlane | None = None) -> tuple[Array, Array]:
    """The most probable pose by the foreground about `world`, `angles` with prior covariance (27, 27)
    (`silhouette.search`). Each finger is tried in each posture before the search and in between (`choose_postures`)."""
    if plane is not None:
        covariance = plane.narrowed(covariance)
    angles = choose_postures(surface, world, angles, model, size, odds)
    moved, bent = search(surface, world, angles, covariance, model.limits, size, odds, rng, ROUNDS)
    bent = choose_postures(surface, moved, bent, model, size, odds)
    return search(surface, moved, bent, 0.25 * covariance, model.limits, size, odds, rng, ROUNDS)


def choose_postures(surface: Surface, world: Array, angles: Array, model: HandModel, size: Array,
                    odds: LogOddsMaps) -> Array:
    """The angles (21,) with the posture of each digit that the foreground makes most probable: a finger unchanged,
    open, relaxed or closed; the thumb unchanged, relaxed or to either side. Then each pair of neighbouring fingers,
    with the prior's abduction, in all nine combinations: one may lie in the other's place. Coordinate descent, twice
    over all digits. Locked angles (`HandModel.locked`) stay."""
    angles, held = angles.copy(), set(model.locked)
    turns = [k for k in (0, 1) if k not in held]  # the thumb's angles at its root
    thumbs = [model.pose_prior.mean[ANGLE_SLICES[0]] + aside * np.eye(5)[which]
              for which, aside in ((0, 0.0), *product(turns, (-_THUMB_STEP, _THUMB_STEP)))]
    choices: list[tuple[slice | list[int] | NDArray[np.int64], list[Array] | Array]] = []
    if turns:
        choices.append((ANGLE_SLICES[0], thumbs))
    choices += [(list(flexions), np.radians(_CURLS_DEG)) for flexions in FLEXIONS[1:] if not held & set(flexions)]
    curls = np.radians(_CURLS_DEG)
    for finger in (1, 2, 3):
        both = np.r_[ANGLE_SLICES[finger], ANGLE_SLICES[finger + 1]]
        if not held & set(both):
            spread = model.pose_prior.mean[both[[0, 4]]]
            choices.append((both, [np.concatenate([spread[:1], one, spread[1:], other])
                                   for one, other in product(curls, curls)]))
    for where, options in [*choices, *choices]:
        steps = np.zeros((1 + len(options), 27))
        for k, option in enumerate(options):
            steps[1 + k, 6:][where] = option - angles[where]
        best = int(np.argmax(score_steps(surface, world, angles, steps, model.limits, size, odds)))
        angles += steps[best, 6:]
    return angles
