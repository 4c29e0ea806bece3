"""Where a hand is when nothing is known of it: from one instant's triangulated markers."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rhot_app.estimation.filter import update
from rhot_app.estimation.layout import pose_matrix
from rhot_app.estimation.residual import Residual, stack
from rhot_app.geometry.camera import pixels_per_metre, project_with_slope, undistort_points
from rhot_app.geometry.transforms import fit_rigid, rigid
from rhot_app.hand.kinematics import empty_frames, forward_arrays
from rhot_app.hand.landmarks import NOISE_M
from rhot_app.hand.model import neutral_pose
from rhot_app.hand.motion.hand_process import HandProcess
from rhot_app.hand.motion.hand_state import STATE, TANGENT
from rhot_app.hand.motion.palm_on_plane import PalmOnPlane
from rhot_app.hand.skeleton import TIP_ROLES, WRIST_ROLE, HandPose
from rhot_app.hand.solvers.finger_ik import solve_fingers
from rhot_app.hand.solvers.palm_fit import TIPS_WITHOUT_WRIST, fit_palm, palms_before_camera
from rhot_app.tracking.locate import Located, locate_paired, rig_table
from rhot_app.tracking.markers.hand_size import Posture, implausibility
from rhot_app.tracking.markers.marker_model import MarkerModel
from rhot_app.tracking.markers.marker_residual import MarkerFrame
from rhot_app.tracking.pairing import Pairing
from rhot_app.tracking.rig_arrays import RigArrays
from rhot_app.tracking.tracker import CameraObservations

Array = NDArray[np.float64]

LEAST_MARKERS = 4
"""Markers that show where a hand is."""

EXTENT_M = 0.1
"""m: least extent of a hand's landmarks across a line of sight, so that no noise is taken for too small: 98 to 159 mm
on a recorded hand. Its figures are the same with 0.03 to 0.3; without the noise its first state is a quarter worse."""

FLATTEST_M2 = 1e-5
"""Least area spanned by three palm markers that show how the palm is turned."""

UNFIT_M = 0.06
"""Markers so far from where the hand has them are something else. A first fit of a moving hand may be 3 cm off."""

TURNS = 24
"""Of a palm on a plane, all around: 15 degrees apart, half of START_SD's."""

START_SD = 0.03, 0.5
"""m and rad: standard deviation of the palm's pose as it is first found."""

_TARGET_SD_M = 1e-3


class Starter:
    """Collects frames until one instant shows enough of the hand."""

    def __init__(self, rig: RigArrays, markers: MarkerModel) -> None:
        self._rig, self._markers, self._table = rig, markers, rig_table(rig)
        self._pairing = Pairing(len(rig.cameras), len(rig.marker_ids))
        self._tips = [markers.marker_of(role) for role in TIP_ROLES]
        self._wrist = markers.marker_of(WRIST_ROLE)
        self._on_palm = np.flatnonzero(markers.finger < 0)

    def reset(self) -> None:
        """Forget the frames."""
        self._pairing.reset()

    def ingest(self, observations: CameraObservations) -> None:
        """Take one frame in."""
        self._pairing.ingest(self._with_landmark_noise(observations))

    def _with_landmark_noise(self, observations: CameraObservations) -> CameraObservations:
        """The frame with the noise of landmarks, of a hand as far as its image is large: what a detector states is less
        than by how much two cameras' landmarks miss each other."""
        own = self._markers.landmark & np.isfinite(observations.pixels[:, 0])
        if np.count_nonzero(own) < LEAST_MARKERS:
            return observations
        extent_px = float(np.ptp(observations.pixels[own], axis=0).max())
        covariances = observations.covariances.copy()
        covariances[own] += (NOISE_M / EXTENT_M * extent_px) ** 2 * np.eye(2)
        return replace(observations, covariances=covariances)

    def locate(self) -> Located | None:
        """Where the markers were at the newest instant; None: none is due."""
        paired = self._pairing.due()
        if paired is None:
            return None
        places, doubtful = locate_paired(paired, self._table)
        return Located(paired.t_ns, places.positions, places.covariances,
                       ~doubtful & np.isfinite(places.positions[:, 0]))

    def pose_of(self, markers: Array, scale: float = 1.0) -> HandPose | None:
        """The hand, `scale` times as large as its file says, whose `markers` (M, 3) m, NaN where not located, are
        enough to find it.

        None when they are not, or are where no hand has them: two that change names in one camera seem far away.
        """
        if scale != 1.0 and np.isfinite(markers).any():
            centre = np.nanmean(markers, axis=0)
            pose = self.pose_of(centre + (markers - centre) / scale)
            if pose is not None:
                pose.world_from_palm[:3, 3] = centre + (pose.world_from_palm[:3, 3] - centre) * scale
            return pose
        pose = self._fitted(markers)
        return pose if pose is not None and not np.any(
            np.linalg.norm(markers - self._worn_at(pose), axis=1) > UNFIT_M) else None

    def _tips_and_wrist(self, markers: Array) -> tuple[Array, Array]:
        """(5, 3) m of the fingertips and (3,) m of the wrist, NaN where not located."""
        nowhere = np.full(3, np.nan)
        return (np.array([markers[m] if m >= 0 else nowhere for m in self._tips]),
                markers[self._wrist] if self._wrist >= 0 else nowhere)

    def _worn_at(self, pose: HandPose) -> Array:
        """(M, 3) m where a hand in `pose` has its markers."""
        dh, out = self._markers.dh, np.empty((len(self._rig.marker_ids), 3))
        forward_arrays(dh, pose.world_from_palm, pose.angles, empty_frames(dh), out)
        return out

    def _fitted(self, markers: Array) -> HandPose | None:
        """The hand that comes nearest to them; None when they are too few."""
        located = np.isfinite(markers[:, 0])
        if np.count_nonzero(located) < min(LEAST_MARKERS, len(markers)):
            return None
        tips, wrist = self._tips_and_wrist(markers)
        on_palm = self._on_palm[located[self._on_palm]]
        if len(on_palm) >= 3:
            own = np.array([self._markers.places[m].point for m in on_palm])
            if np.linalg.norm(np.cross(own[1] - own[0], own[2] - own[0])) > 2.0 * FLATTEST_M2:
                pose = neutral_pose(fit_rigid(own, markers[on_palm]))
                if self._markers.landmark.any():
                    return self._fit_all(markers, pose)
                solution = solve_fingers(self._markers.model, pose, tips, target_sd=_TARGET_SD_M)
                return HandPose(pose.world_from_palm, solution.angles)
        if not np.isfinite(wrist[0]) and np.count_nonzero(np.isfinite(tips[:, 0])) < TIPS_WITHOUT_WRIST:
            return None
        fit = fit_palm(self._markers.model, wrist, tips, None, 0.0)
        return None if fit is None else fit.pose

    def _fit_all(self, markers: Array, pose: HandPose) -> HandPose:
        """The pose that all markers (M, 3) m make the most plausible, by a descent from `pose`."""
        m, world, angles = self._markers, pose.world_from_palm.copy(), pose.angles.copy()
        variance = m.paint_variance + np.where(m.landmark, NOISE_M**2, _TARGET_SD_M**2)
        posture = Posture(m.dh, m.limits, m.pose_prior.mean, m.pose_prior.information)
        implausibility(posture, markers, np.eye(3) / variance[:, None, None], 0.0, world, angles)
        return HandPose(world, angles)


def pose_on_plane(plane: PalmOnPlane, frame: MarkerFrame, process: HandProcess) -> HandPose | None:
    """The hand on a plane whose markers one camera's frame shows; None when they are too few, or are where no hand has
    them. Hands turned all around are tried, each in the posture of the process's prior."""
    m, seen = frame.markers, frame.seen
    if np.count_nonzero(seen) < min(LEAST_MARKERS, len(seen)):
        return None
    rotation, shift = m.poses[frame.camera][:, :3], m.poses[frame.camera][:, 3]
    centre = -rotation.T @ shift
    rays = undistort_points(frame.pixels[seen], m.intrinsics[frame.camera])
    place = plane.met_by(centre, centre + rotation.T @ np.append(rays.mean(axis=0), 1.0))
    if place is None:
        return None
    angles, worn = np.clip(process.mean, m.limits[:, 0], m.limits[:, 1]), np.empty((len(seen), 3))
    forward_arrays(m.dh, np.eye(4), angles, empty_frames(m.dh), worn)
    middle = worn[seen].mean(axis=0)
    places = [rigid(turn, place - turn @ middle) for turn in plane.turns(TURNS)]
    return _best_of(places, frame, process, plane)


def pose_before_camera(frame: MarkerFrame, process: HandProcess) -> HandPose | None:
    """The hand whose landmarks one camera's frame shows, as large as its file says; None when they are too few, or are
    where no hand has them. The palm's landmarks show how it is turned, but for a mirroring along the line of sight:
    both are tried."""
    m = frame.markers
    palm = np.flatnonzero(frame.seen & m.landmark & (m.finger < 0))
    if len(palm) < LEAST_MARKERS:
        return None
    own = np.array([m.places[k].point for k in palm])
    rays = undistort_points(frame.pixels[palm], m.intrinsics[frame.camera])
    return _best_of(palms_before_camera(own, rays, m.poses[frame.camera]), frame, process)


def _best_of(places: Sequence[Array], frame: MarkerFrame, process: HandProcess,
             plane: PalmOnPlane | None = None) -> HandPose | None:
    """The most probable of the hands that are found from `places` (4, 4) of the palm, each in the posture of the
    process's prior; None when one of its markers is UNFIT_M off or more."""
    m = frame.markers
    best: tuple[float, Array] | None = None
    angles = np.clip(process.mean, m.limits[:, 0], m.limits[:, 1])
    frame = copy.copy(frame)
    residuals: list[Residual] = [frame] if plane is None else [frame, plane]
    for number, place in enumerate(places):
        prior = process.start(place, angles, START_SD)
        if number == 0:
            frame.add_landmark_noise(prior[0])
        try:
            state = update(process, 0.0, prior, residuals).state
        except np.linalg.LinAlgError:  # turned so, the hand cannot be where the markers are
            continue
        away = process.difference(state, prior[0])[TANGENT.pose]
        cost = stack([one.linearise(state) for one in residuals], process.size, weigh=True)[3]
        cost += float(away @ np.linalg.solve(prior[1][TANGENT.pose, TANGENT.pose], away))
        if best is None or cost < best[0]:
            best = cost, state
    if best is None:
        return None
    state, world = best[1], pose_matrix(best[1])
    _, slopes = project_with_slope(world[None, :3, 3], m.poses[frame.camera], m.intrinsics[frame.camera])
    off_px = np.linalg.norm(frame.pixels - frame.expected(state), axis=1)[frame.seen]
    return (HandPose(world, state[STATE.angles].copy())
            if np.all(off_px < UNFIT_M * pixels_per_metre(slopes[0])) else None)
