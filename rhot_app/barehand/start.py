"""Finds a hand anywhere and in any pose, in the foreground of one image of each camera.

Candidates are positions where the foreground is as thick as a palm. At each, many rotations of a relaxed hand are
scored by the foreground (`silhouette`), and the best of them with other postures of the fingers. A short search about
each of the best selects those for a long one, by their log odds.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rhot_app.barehand.silhouette import CORRELATED, LogOddsMaps, log_odds_maps, score, score_steps, search
from rhot_app.barehand.surface import SHAPE, Surface
from rhot_app.geometry.camera import CameraModel, pixels_per_metre_facing, project_with_slope
from rhot_app.geometry.transforms import rigid
from rhot_app.hand.model import HandModel
from rhot_app.hand.motion.palm_on_plane import PalmOnPlane
from rhot_app.hand.skeleton import ANGLE_SLICES, FLEXIONS, HandPose

Array = NDArray[np.float64]
_Candidate = tuple[float, Array, Array]  # a score, world_from_palm and angles

STEP = 8
"""px: spacing of the pixels of the foreground map."""

ROTATIONS = 400
"""Rotations of a relaxed hand that are scored at a candidate: 25 degrees apart."""

TURNS = 60
"""Rotations of a palm on a plane about its normal: 6 degrees apart. Chosen, not tuned."""

RESCORED = 80
"""Best rotations, of all candidates, that are scored with the other postures. Chosen, not tuned."""

KEPT, FIRST_ROUNDS = 20, 15
"""Best poses about which a short search is made, and its rounds (`silhouette.search`). Chosen: enough to rank them."""

REFINED, LAST_ROUNDS = 4, 120
"""Best poses of the short searches about which a long one is made, and its rounds. Chosen, not tuned."""

PALMS, PEAKS = 6, 24
"""Most candidate positions of a palm, of all cameras together, and most thick parts of each camera's foreground that
they are triangulated from. Chosen: a scene has fewer."""

_CURLS_DEG = ((5.0, 10.0, 5.0), (20.0, 30.0, 20.0), (65.0, 80.0, 45.0))  # MCP, PIP, DIP: open, relaxed, closed
_THUMB_STEP = 0.5  # rad to either side of a relaxed thumb: a third of its range
_SPREAD = 0.03, 0.35, 0.35  # m, rad, rad: prior standard deviations about a scored pose, which are as far apart
_PALM_RADIUS = 0.36, 1.7  # bounds, relative to half the palm's breadth; from the side, it is half as thick


def find_hand(foreground: Sequence[NDArray[np.float32] | None], cameras: Sequence[CameraModel], model: HandModel,
              surface: Surface, rng: np.random.Generator, plane: PalmOnPlane | None = None) -> HandPose | None:
    """The most probable pose, of the file's shape, in foreground probabilities (h, w) of every STEP-th pixel of each
    camera, None of a camera without an image. `plane`: on which the palm lies.

    Returns None without foreground as thick as a palm, or if every candidate fails this test: the hand and its ring,
    without the forearm, must be more probable than if each pixel were foreground with probability 0.5. Otherwise a
    large foreground, such as a face, is accepted for the few pixels that a fist covers.
    """
    size = np.zeros(SHAPE)
    used = [c for c, one in enumerate(foreground) if one is not None]
    maps = [one for one in foreground if one is not None]
    lenses = [cameras[c].camera_from_world[:3] for c in used], [cameras[c].intrinsics for c in used]
    odds, even = log_odds_maps(maps, STEP, *lenses), log_odds_maps(maps, STEP, *lenses, rate=0.5)
    breadth = 0.5 * float(model.base[1, 1] - model.base[4, 1] + model.radii[1, 0] + model.radii[4, 0])
    centres = _palm_centres(maps, [cameras[c] for c in used], breadth)
    found: list[_Candidate] = []
    postures = _postures(model)
    if plane is None:
        turns = Rotation.random(ROTATIONS, random_state=int(rng.integers(2**31))).as_matrix()
    else:
        met = [plane.met_by(cameras[used[0]].centre, centre) for centre in centres]
        centres, turns = [centre for centre in met if centre is not None], plane.turns(TURNS)
    tried: list[_Candidate] = []
    middle = np.array([0.6 * model.base[2, 0], 0.0, 0.0])

    def try_pose(world: Array, angles: Array) -> None:
        value = float(score_steps(surface, world, angles, np.zeros((1, 27)), model.limits, size, odds)[0])
        tried.append((value, world, angles))

    for centre, turn in product(centres, turns):
        try_pose(rigid(turn, centre - turn @ middle), postures[0])
    tried.sort(key=lambda one: -one[0])
    for (_, world, _), angles in product(tried[:RESCORED], postures[1:]):
        try_pose(world, angles)
    tried.sort(key=lambda one: -one[0])
    covariance = np.diag(np.repeat(np.square(_SPREAD), (3, 3, 21)))
    covariance[6:, 6:] = np.linalg.inv(model.pose_prior.information + np.eye(21) / _SPREAD[2] ** 2)
    if plane is not None:
        covariance = plane.narrowed(covariance)
    for _, world, angles in _distinct(tried, KEPT):
        moved, bent = search(surface, world, angles, covariance, model.limits, size, odds, rng, FIRST_ROUNDS)
        bent = choose_postures(surface, moved, bent, model, size, odds)
        found.append((log_odds(surface, moved, bent, model, size, odds), moved, bent))
    found.sort(key=lambda one: -one[0])
    refined = []
    for _, world, angles in found[:REFINED]:
        moved, bent = search(surface, world, angles, covariance, model.limits, size, odds, rng, LAST_ROUNDS)
        moved, bent = settle(surface, moved, bent, covariance, model, size, odds, rng)
        if score(surface, moved, bent, size, even)[1][:, [0, 2]].sum() > 0.0:
            refined.append((log_odds(surface, moved, bent, model, size, odds), moved, bent))
    if not refined:
        return None
    _, world, angles = max(refined, key=lambda one: one[0])
    return HandPose(world, angles)


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
    moved, bent = search(surface, world, angles, covariance, model.limits, size, odds, rng, FIRST_ROUNDS)
    bent = choose_postures(surface, moved, bent, model, size, odds)
    return search(surface, moved, bent, 0.25 * covariance, model.limits, size, odds, rng, FIRST_ROUNDS)


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


def _distinct(tried: list[_Candidate], most: int) -> list[_Candidate]:
    """The best poses of which no two are nearer than half a radian and `_SPREAD[0]`, m."""
    kept: list[_Candidate] = []
    for one in tried:
        if all(np.trace(one[1][:3, :3].T @ other[1][:3, :3]) < 1.0 + 2.0 * np.cos(0.5)
               or np.linalg.norm(one[1][:3, 3] - other[1][:3, 3]) > _SPREAD[0] for other in kept):
            kept.append(one)
            if len(kept) == most:
                break
    return kept


def _postures(model: HandModel) -> list[Array]:
    """Angles (21,) of a relaxed, an open, a closed and a pointing hand; locked angles are those of the prior."""
    out = []
    for curl in _CURLS_DEG:
        angles = model.pose_prior.mean.copy()
        for flexions in FLEXIONS[1:]:
            angles[list(flexions)] = np.radians(curl)
        out.append(angles)
    pointing = out[2].copy()
    pointing[list(FLEXIONS[1])] = np.radians(_CURLS_DEG[0])
    held = list(model.locked)
    for angles in (*out, pointing):
        angles[held] = model.pose_prior.mean[held]
    return [out[1], out[0], out[2], pointing]


def _palm_centres(maps: Sequence[NDArray[np.float32]], cameras: Sequence[CameraModel], breadth: float) -> list[Array]:
    """Candidate positions (3,) m of palms: thick foreground triangulated from two cameras, or placed by its size before
    one."""
    peaks = [_largest_discs(one) for one in maps]
    found: list[tuple[float, Array]] = []
    for a in range(len(maps)):
        for b in range(a):
            for p, q in product(peaks[a], peaks[b]):
                rays = [cameras[k].undistort(peak[None, :2])[0] for k, peak in ((a, p), (b, q))]
                matrices = [cameras[k].camera_from_world[:3] for k in (a, b)]
                point = cv2.triangulatePoints(matrices[0], matrices[1], rays[0].reshape(2, 1), rays[1].reshape(2, 1))
                place = (point[:3] / point[3]).ravel()
                error = 0.0
                for k, peak in ((a, p), (b, q)):
                    pixel = cameras[k].project(place)[0]
                    error += float(np.linalg.norm(pixel - peak[:2]) / peak[2]) if np.isfinite(pixel).all() else np.inf
                    error += _size_error(cameras[k], place, peak[2], breadth)
                if np.isfinite(error):
                    found.append((error, place))
    if len(maps) == 1:
        camera = cameras[0]
        for peak in peaks[0]:
            ray = camera.world_from_camera[:3, :3] @ np.append(camera.undistort(peak[None, :2])[0], 1.0)
            place = camera.centre + _scale(camera, camera.centre + ray) * breadth / peak[2] * ray
            if np.isfinite(place).all():
                found.append((0.0, place))
    found.sort(key=lambda one: one[0])
    return [place for _, place in found[:PALMS]]


def _scale(camera: CameraModel, place: Array) -> float:
    """px per m of what faces the camera at a position; NaN where it sees nothing."""
    _, slopes = project_with_slope(place[None], camera.camera_from_world, camera.intrinsics)
    return pixels_per_metre_facing(slopes[0], camera.camera_from_world)


def _size_error(camera: CameraModel, place: Array, radius: float, breadth: float) -> float:
    """Absolute log ratio of a radius px to that of a palm at a position; inf beyond _PALM_RADIUS."""
    ratio = radius / (_scale(camera, place) * breadth)
    return abs(float(np.log(ratio))) if _PALM_RADIUS[0] < ratio < _PALM_RADIUS[1] else np.inf


def _largest_discs(probability: NDArray[np.float32]) -> list[Array]:
    """(3,) px centre x, y and radius of the largest discs inside the foreground, largest first, with distinct
    centres."""
    solid = (probability > 0.5).astype(np.uint8)
    distance = cv2.distanceTransform(cv2.copyMakeBorder(solid, 1, 1, 1, 1, cv2.BORDER_REPLICATE), cv2.DIST_L2, 5)
    distance = distance[1:-1, 1:-1].copy()
    ridge = (distance >= cv2.dilate(distance, np.ones((3, 3)))) & (distance > 1.0)
    rows, columns = np.nonzero(ridge)
    order = np.argsort(-distance[rows, columns])
    out: list[Array] = []
    for k in order:
        radius = float(distance[rows[k], columns[k]])
        place = np.array([(columns[k] + 0.5) * STEP - 0.5, (rows[k] + 0.5) * STEP - 0.5, radius * STEP])
        if all(np.linalg.norm(place[:2] - other[:2]) > 0.7 * other[2] for other in out):
            out.append(place)
            if len(out) == PEAKS:
                break
    return out
