"""Tracks a hand without markers in the images of any number of cameras, each image at its own time.

Contours are one kind of residual of the estimator (`rhot_app.estimation`). Every image is searched along slices across
the predicted contours, and the state is estimated. The image is then searched again about that estimate. Marker and
landmark residuals of the same state may be added at any time.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.contour_residual import (
    GROUPS,
    SAME_TIME_S,
    ContourFrame,
    Contours,
    JointLimits,
    slices_of,
    velocity_of,
)
from rhot_app.barehand.contours import STEP_M, contour_points
from rhot_app.barehand.joints import covariances_of, knowledge_of, points_in
from rhot_app.barehand.pose_search import ODDS_DROP, PoseSearch
from rhot_app.barehand.silhouette import STEP, ForegroundMaps
from rhot_app.barehand.start import (
    CONTOUR_THRESHOLD,
    LOG_ODDS_THRESHOLD,
    MAJORITY,
    START_SD,
    even_log_odds,
    shown_pose,
    taken_pose,
)
from rhot_app.barehand.surface import FOREARM_RADIUS, HAND_SIZE, PALM, THICKNESS, surface_of
from rhot_app.errors import TrackingError
from rhot_app.estimation.filter import Estimate, Knot, Partial, refined
from rhot_app.estimation.residual import Residual
from rhot_app.estimation.track import TrackFilter
from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.anatomy import HandAnatomy
from rhot_app.hand.model import build_model, with_locked
from rhot_app.hand.motion.hand_process import FASTEST, PALM_SPREAD, SLOWEST, HandProcess
from rhot_app.hand.motion.hand_state import MOTION, POSE, STATE, TANGENT, pose_of
from rhot_app.hand.motion.palm_on_plane import PalmOnPlane
from rhot_app.hand.skeleton import FINGER_OF_ANGLE, FINGER_OF_JOINT, FINGERS, HandPose
from rhot_app.project import Rig
from rhot_app.state import (
    INFERRED_M,
    INFERRED_RAD,
    MEASURED_M,
    MEASURED_RAD,
    Condition,
    HandState,
    Knowledge,
    no_hand,
)
from rhot_node.detect.edges import find_edges, noise_of
from rhot_node.detect.foreground import Foreground, foreground_map, no_foreground

Array = NDArray[np.float64]
Image = NDArray[np.uint8]

PASSES, START_PASSES = 2, 6
"""Searches of an image, and of the first one after a start. Each search halves the standard
deviation of the expected contour: six leave less than a pixel of LONGEST_PX."""

SIZE_SD = 0.1, 0.05, 0.08
"""Standard deviations, in adults, of the logarithms of a hand's size, of its fingers' length relative to that, and of
its thickness relative to that (`tracking.markers.hand_size`; Buryanov and Kotiuk 2010)."""

LENGTH_SD, RADIUS_SD = 0.05, 0.08
"""The same of the length and the radius of one phalanx."""

MEASURED_SD = 0.02
"""The same of a phalanx's length where the bones were measured (`python benchmarks/bones.py`, with noise). No
calibration measures radii."""

FOREARM_SD = 0.2, 0.5, 0.25
"""Standard deviations of the logarithm of the forearm's radius, with or without a sleeve, and, rad, of the wrist's
flexion and deviation: a third of their ranges (Ryu et al. 1991: 138 and 59 degrees)."""

SHAPE_S, TURN_S = 1e3, 0.3
"""s: correlation times of the hand's shape, which does not change, and of the forearm's rotation, which moves as the
hand does (`hand_process.SLOWEST`)."""

PHALANGES = MOTION + np.arange(THICKNESS, FOREARM_RADIUS)
"""The phalanges' lengths and radii in the tangent space."""

SAME_POSE_S = 1.0
"""s: images within this time show nearly the same pose, since a grasp takes a second, and count as one for the
phalanges. Errors of edges and surface are correlated as long; taken as independent, they would move the lengths."""


class BareHandTracker:
    """One bare hand before the cameras of a rig."""

    def __init__(self, rig: Rig, *, known_size: bool = True, foreground: Sequence[Foreground] | None = None,
                 row_s: Sequence[float] | None = None, lateral_m: float = 0.0) -> None:
        """`known_size`: the prior of lengths and radii is the rig's hand file with the standard deviations there;
        otherwise the variation of adults about it. `foreground`: each camera's model of hand and background;
        uninformative by default. `row_s`: each camera's time between two rows, s; 0 by default. `lateral_m`: see
        `shown_pose`."""
        self.model = with_locked(build_model(rig.hand), rig.tracker.locked_deg)
        plane = rig.tracker.palm_plane
        self.plane = None if plane is None else PalmOnPlane(plane)
        self.surface = surface_of(self.model)
        self.cameras = [CameraModel.from_rig(node.intrinsics, node.pose) for node in rig.nodes]
        self.names = tuple(node.name for node in rig.nodes)
        self.records = [camera.record for camera in self.cameras]
        self.row_s = [0.0] * len(self.cameras) if row_s is None else list(row_s)
        self.foreground = list(foreground) if foreground else [no_foreground() for _ in self.cameras]
        prior = self.model.pose_prior
        file_sd = _relative_sd(rig.hand) if known_size else None
        size = SIZE_SD if not known_size else (0.0, 0.0, SIZE_SD[2] if file_sd is None else 0.0)
        phalanges = np.repeat((MEASURED_SD if known_size else LENGTH_SD, RADIUS_SD), 15) if file_sd is None else file_sd
        spread = np.concatenate([size, phalanges, FOREARM_SD]).reshape(-1, 3)
        self.shape_covariance = np.square(spread)[:, :, None] * np.eye(3)
        self.shape_s = np.append(np.full(len(spread) - 1, SHAPE_S), TURN_S)
        self.slowest = np.append(SLOWEST[:2], FASTEST)  # resting fingers may move fast at the next image
        self.process = HandProcess(self.surface.dh, self.model.limits, prior.mean,
                                   np.asarray(np.linalg.inv(prior.information)), PALM_SPREAD, self.slowest, FASTEST,
                                   self.shape_covariance, self.shape_s)
        self.filter = TrackFilter(self.process)
        self.constraints: list[Residual] = [JointLimits(self.model.limits)]
        if self.plane is not None:
            self.constraints.append(self.plane)
        self.frames: list[ContourFrame | None] = [None] * len(self.cameras)
        self.noise = [0.0] * len(self.cameras)
        self._sequence, self.starting = 0, False
        self.search = PoseSearch(self.model, self.surface, self.cameras, self.plane)
        self.start_pose = shown_pose(rig, self.cameras, self.model, self.plane, lateral_m)
        self._repeated, self._taken_s = [1.0] * len(self.cameras), [-np.inf] * len(self.cameras)

    def start(self, pose: HandPose, t_ns: int, place_sd: tuple[float, float, float] = START_SD) -> None:
        """Start a track at a pose whose position, rotation and angles have standard deviations `place_sd`, m, rad and
        rad. Contours also fit what is no hand, so something
        else must have shown the pose: a person who has taken `start_pose`, or markers."""
        state, covariance = self.process.start(pose.world_from_palm, pose.angles, place_sd[:2])
        known = np.linalg.inv(covariance[TANGENT.angles, TANGENT.angles]) + np.eye(POSE - 6) / place_sd[2] ** 2
        covariance[TANGENT.angles, TANGENT.angles] = np.linalg.inv(known)
        self.filter.begin(t_ns, state, covariance)
        self.starting = True
        self._taken_s = [-np.inf] * len(self.cameras)
        self.search.restart()
        self.frames = [None] * len(self.cameras)

    def begin(self, images: Sequence[Image | None], t_ns: int) -> bool:
        """Start a track if a hand has taken `start_pose` in these images. Returns whether it has."""
        pose = self.taken(self.maps_of(images))
        if pose is not None:
            self.start(pose, t_ns)
        return pose is not None

    def maps_of(self, images: Sequence[Image | None]) -> list[NDArray[np.float32] | None]:
        """Foreground probabilities of every STEP-th pixel of each image; None without an image."""
        return [None if image is None else foreground_map(image, learnt, STEP)
                for image, learnt in zip(images, self.foreground, strict=True)]

    def taken(self, maps: ForegroundMaps) -> HandPose | None:
        """The pose about `start_pose` that a hand has taken (`start.taken_pose`)."""
        return taken_pose(self.start_pose, maps, self.search)

    def verified(self, maps: ForegroundMaps, state: Array | None = None) -> bool:
        """Whether the last images and these maps show a hand in the newest state, or in `state` (n,) at the maps' time:
        CONTOUR_THRESHOLD of its contour and LOG_ODDS_THRESHOLD of its foreground."""
        found, expected = self.slice_counts.sum(axis=(0, 1))
        state = self.filter.newest.state if state is None else state
        known = any(one is not None for one in maps)
        return bool(found > CONTOUR_THRESHOLD * expected > 0.0 and known
                    and even_log_odds(self.search, maps, state) > LOG_ODDS_THRESHOLD)

    def step(self, images: Sequence[Image | None], t_ns: Sequence[int]) -> HandState:
        """The hand after one image (H, W, 3) RGB of each camera, None without one, at master times `t_ns`. Raises
        TrackingError before a start."""
        begun = time.perf_counter()
        if not self.filter.knots:
            raise TrackingError("the bare hand has no start; give one by start(pose, t_ns), or by begin(images, t_ns) "
                                "once it has taken its start pose")
        given = {c: image for c, image in enumerate(images) if image is not None}
        if given:
            newest = max(t_ns[c] for c in given)
            self.update(given, newest, late_s={c: 1e-9 * (t_ns[c] - newest) for c in given})
        return self.state(begun)

    def update(self, images: dict[int, Image], t_ns: int, extra: Sequence[Residual] = (),
               late_s: Mapping[int, float] | None = None) -> Knot:
        """Update the state at master time `t_ns` by the images of some cameras and by `extra` residuals of the same
        state. `late_s`: each image's time less that instant, s; 0 by default."""
        t_s, late = self.filter.seconds(t_ns), late_s or {}
        prediction, since_s = self.filter.predict(t_s), t_s - self.filter.newest.t_s
        self.prepare_update(images, t_s)
        self.frames = [frame if c in images else None for c, frame in enumerate(self.frames)]
        maps, search, start = self._maps(images), self.search, None
        odds = None if maps is None else search.odds_of(maps)
        if maps and odds and search.begins_search(search.log_odds_per_pixel(odds, prediction[0]), t_s):
            start = search.relocalise(maps, prediction, self.process.stationary, since_s)
        passes = START_PASSES if self.starting or start is not None else PASSES
        knot = self._fit(images, late, t_s, prediction, prediction[0] if start is None else start, extra, passes)
        if odds is not None:
            per_pixel = search.log_odds_per_pixel(odds, knot.state)
            if start is not None and per_pixel < search.log_odds_per_pixel(odds, start) - ODDS_DROP:
                # Edges have drawn the pose away from the foreground: restart there, without the prediction.
                knot = self._fit(images, late, t_s, self._restart(t_s, start), start, extra, START_PASSES)
                per_pixel = search.log_odds_per_pixel(odds, knot.state)
            search.average(per_pixel)
        self.starting = False
        return knot

    def _restart(self, t_s: float, start: Array) -> tuple[Array, Array]:
        """Restart the filter at rest in the pose and shape of the state `start`, with the newest covariance of the
        shape. Returns state (n,) and covariance (n, n)."""
        pose = pose_of(start)
        state, covariance = self.process.start(pose.world_from_palm, pose.angles, START_SD[:2])
        state[STATE.lasting], own = start[STATE.lasting], TANGENT.shape
        covariance[own, own] = self.filter.newest.covariance[own, own]
        self.filter.start(t_s, state, covariance)
        return state, covariance

    def _fit(self, images: dict[int, Image], late_s: Mapping[int, float], t_s: float,
             prediction: tuple[Array, Array], initial: Array, extra: Sequence[Residual], passes: int) -> Knot:
        """Search the images and estimate the state, `passes` times; the first search is about the state `initial`."""
        ambiguous: list[float] = []  # of the first searches

        def search(number: int, state: Array) -> list[ContourFrame]:
            frames = [self._search(camera, image, state, prediction[1] * 0.25**number, number == passes - 1,
                                   late_s.get(camera, 0.0)) for camera, image in images.items()]
            if number == 0:
                ambiguous.extend(frame.ambiguous for frame in frames)
            elif passes == PASSES:  # more of them search around a given start
                for frame, share in zip(frames, ambiguous, strict=True):
                    frame.ambiguous = share
            return frames

        return self.solve(t_s, prediction, initial, search, passes, extra)

    def solve(self, t_s: float, prediction: tuple[Array, Array], state: Array,
              contours: Callable[[int, Array], list[ContourFrame]], passes: int = PASSES,
              extra: Sequence[Residual] = ()) -> Knot:
        """Update the state at `t_s`, s since the start, by `extra` residuals and the `contours` of each pass, by its
        number and the `state` (n,) so far. Raises LinAlgError when the observations contradict the estimate."""
        def observe(number: int, about: Array, estimate: Estimate) -> list[Residual]:
            return [Contours(contours(number, about), velocity_of(estimate)), *self.constraints, *extra]

        state, estimate = refined(self.process, t_s, prediction, passes - 1, observe, state, self.filter.partial)
        return self.filter.add(t_s, observe(passes - 1, state, estimate), prediction, state)

    def prepare_update(self, cameras: Iterable[int], t_s: float) -> None:
        """Prepare for an update at `t_s`, s since the start, by images of `cameras`: how many correlated images count
        as one, and the share of the partial update of the phalanges (Brink 2017). Without cameras the phalanges are
        consider states: their uncertainty counts, their values stay."""
        cameras = list(cameras)
        last_s = max(self._taken_s) if np.isfinite(self._taken_s).any() else self.filter.newest.t_s
        rate = float(self.process.rates(self.filter.newest.state)[1])
        for camera in cameras:
            self._repeated[camera] = max(1.0 / (rate * max(t_s - self._taken_s[camera], SAME_TIME_S)), 1.0)
            self._taken_s[camera] = t_s
        share = min(max(t_s - last_s, 0.0) / SAME_POSE_S, 1.0) if cameras else 0.0
        self.filter.partial = Partial(PHALANGES, share)

    def _maps(self, images: dict[int, Image]) -> list[NDArray[np.float32] | None] | None:
        """The maps of cameras with an informative foreground model; None without any."""
        known = [images.get(c) if model.informative else None for c, model in enumerate(self.foreground)]
        return None if all(image is None for image in known) else self.maps_of(known)

    def _search(self, camera: int, image: Image, state: Array, covariance: Array, last: bool,
                late_s: float = 0.0) -> ContourFrame:
        """Search one image along the contours of a hand in `state`."""
        if not self.noise[camera]:
            self.noise[camera] = noise_of(image)
        frame = self.expected_contour(camera, state, covariance, STEP_M if last else 2.0 * STEP_M, late_s)
        frame.observe(find_edges(image, frame.slices, self.foreground[camera], self.noise[camera]))
        if last:
            self.frames[camera] = frame
        return frame

    def expected_contour(self, camera: int, state: Array, covariance: Array, step_m: float = STEP_M,
                         late_s: float = 0.0) -> ContourFrame:
        """The slices across the contours, `step_m` apart, of a hand in `state` with `covariance` in one camera's image,
        taken `late_s` s later. They have no edges yet."""
        record, then = self.records[camera], state
        if abs(late_s) > SAME_TIME_S:
            step = np.zeros(self.process.size)
            step[TANGENT.pose] = late_s * state[STATE.velocity]
            then = self.process.retract(state, step)
        points = contour_points(self.surface, then, record, step_m)
        return slices_of(self.surface, state, covariance, record, points, self.row_s[camera], self._repeated[camera],
                         late_s)

    @property
    def slice_counts(self) -> Array:
        """(C, GROUPS, 2): of the last image of each camera, and of each finger, the palm and the forearm, the slices on
        which the expected contour was found, and all."""
        return np.array([np.zeros((GROUPS, 2)) if frame is None else frame.slice_counts for frame in self.frames])

    def state(self, begun: float | None = None, markers: tuple[str, ...] = ()) -> HandState:
        """The hand at the newest instant, with nothing known of `markers`."""
        begun = time.perf_counter() if begun is None else begun
        knot = self.filter.newest
        state, covariance = knot.state, knot.covariance
        points, jacobian = points_in(self.model.dh, self.surface.bone, state)
        covariances, motion = covariances_of(jacobian, covariance)
        deviation = np.sqrt(np.maximum(np.diag(covariance), 0.0))
        frames = [frame for frame in self.frames if frame is not None]
        # predicted so uncertainly, fingers are taken for each other
        guessed = bool(frames) and min(frame.ambiguous for frame in frames) > MAJORITY
        frames = [frame for frame in frames if frame.ambiguous <= MAJORITY]
        # cameras that found three slices or more of each finger, the palm and the forearm
        observing = np.zeros(GROUPS)
        if frames:
            observing = np.sum([frame.slice_counts[:, 0] >= 3.0 for frame in frames], axis=0)
        observed = observing >= 2
        joint_sd = np.sqrt(np.trace(covariances[:21], axis1=1, axis2=2))
        group = np.where(FINGER_OF_JOINT < 0, PALM, FINGER_OF_JOINT)
        joints = knowledge_of(joint_sd, observed[group], MEASURED_M, INFERRED_M)
        angles = knowledge_of(deviation[TANGENT.angles], observed[FINGER_OF_ANGLE], MEASURED_RAD, INFERRED_RAD)
        if guessed:
            joints[1:], angles[:] = int(Knowledge.GUESSED), int(Knowledge.GUESSED)
        turn_sd, pose = float(np.sqrt(np.trace(covariance[3:6, 3:6]))), pose_of(state)
        self._sequence += 1
        nowhere = no_hand(self.filter.newest_ns,
                          Condition.TRACKING if np.all(observing[[*range(6)]] >= 1) else Condition.PARTIAL, self.names,
                          time.perf_counter() - begun, markers)
        return replace(
            nowhere, sequence=self._sequence - 1, joint_positions=points[:21], joint_knowledge=joints,
            fingertip_positions=points[21:], angles=pose.angles, angle_knowledge=angles,
            world_from_palm=pose.world_from_palm,
            palm_knowledge=Knowledge(int(knowledge_of(turn_sd, observed[PALM], MEASURED_RAD, INFERRED_RAD))),
            joint_covariances=covariances[:21], fingertip_covariances=covariances[21:],
            angle_sd=deviation[TANGENT.angles].copy(), palm_covariance=covariance[TANGENT.palm, TANGENT.palm].copy(),
            velocity=state[STATE.velocity].copy(), acceleration=state[STATE.acceleration].copy(),
            velocity_sd=deviation[TANGENT.velocity], acceleration_sd=deviation[TANGENT.acceleration],
            joint_velocity_sd=motion[0, :21], joint_acceleration_sd=motion[1, :21],
            hand_scale=float(np.exp(state[STATE.shape][HAND_SIZE])),
            hand_scale_sd=float(deviation[TANGENT.shape][HAND_SIZE]))


def _relative_sd(hand: HandAnatomy) -> Array | None:
    """(30,) relative standard deviations of lengths and radii from a hand file; None where it has none."""
    found = []
    for field in ("bones", "radii"):
        for name in FINGERS:
            sd = getattr(hand.fingers[name], f"{field}_sd_mm")
            if sd is None:
                return None
            found += [one / value for one, value in zip(sd, getattr(hand.fingers[name], f"{field}_mm"), strict=True)]
    return np.array(found)
