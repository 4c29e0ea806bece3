"""Residuals of a hand: marker centroids and apparent sizes in one camera's frame.

After the motion, a state has the errors that last: a displacement of each of M markers, m along the world's axes, and a
turn of each of C cameras but the reference, the first one that is tracked with, rad about its own axes.
"""

from __future__ import annotations

import copy
import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.estimation.layout import pose_matrix
from rhot_app.estimation.residual import UNIT, Rows, student
from rhot_app.geometry.camera import is_wide, pixels_per_metre, project_with_slope
from rhot_app.geometry.turns import fill_by_turn, turn_covariances, turn_of, turned_pose
from rhot_app.hand.kinematics import forward_arrays, jacobian_arrays, point_jacobian
from rhot_app.hand.landmarks import NOISE_M
from rhot_app.hand.motion.hand_state import MOTION, POSE, STATE
from rhot_app.tracking.association import GATE, assign, list_candidates, squared_distances
from rhot_app.tracking.markers.marker_model import LASTING_PX, MarkerModel, project_marker
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.wire.messages import MarkerFlag

Array = NDArray[np.float64]

FLOOR_PX = 0.02
"""px: no centroid is better, whatever a node states."""

CENTROID_KERNEL = student(4.0)
"""Centroids have heavy tails: blobs are partly hidden. 4 degrees of freedom (Lange, Little and Taylor 1989)."""

CONFUSION = 0.01
"""Probability that a node reports a marker under another one's colour."""

SIZE_SD = 0.02
"""Standard deviation of the logarithm of a fingertip's apparent width (`python benchmarks/marker_errors.py`)."""

SIZE_S = 0.2
"""s: correlation time of that error. Within it, all frames together count as one observation."""

_END_ON = 0.03  # sine of the least angle between a fingertip and the line of sight
_STRETCH_MAX = 0.5  # of a marker's height by its motion along the rows

_COLUMNS = "pixels", "covariances", "diameters", "flags"


class Observed(NamedTuple):
    """What compiled functions take of a `MarkerFrame`: (M, ...) each, and the time between two rows."""

    seen: NDArray[np.bool_]
    pixels: Array
    covariances: Array
    diameters: Array
    flags: NDArray[np.uint16]
    late_s: Array
    log_width: Array
    size_sd: Array
    row_s: float


class MarkerFrame:
    """What one camera sees in one frame; implements `estimation.residual.Residual`.

    `t_ns`: master time, the mean of the markers' rows. `seen` (M,). `log_width` (M,): ln of the width in metres that a
    marker shows from its side; NaN where its apparent size is no observation; `size_sd`: of its logarithm.
    """

    def __init__(self, markers: MarkerModel, observations: CameraObservations) -> None:
        self.markers, self.observations, self.camera = markers, observations, observations.camera
        self.pixels, self.covariances = observations.pixels, observations.covariances
        self.diameters, self.flags = observations.diameters, observations.flags
        rows = observations.pixels[:, 1]
        self.seen = ((observations.flags & int(MarkerFlag.LOST)) == 0) & np.isfinite(rows)
        mean_row = rows[self.seen].mean() if self.seen.any() else markers.intrinsics[self.camera, 3]
        self.row_s = 1e-9 * observations.row_time_ns
        self.set_time(observations.t_row0_master_ns + int(mean_row * observations.row_time_ns))
        self.log_width, self.size_sd = np.full(len(rows), np.nan), np.full(len(rows), SIZE_SD)

    def set_time(self, t_ns: int) -> None:
        """Count the markers' times, `late_s` (M,) s, from the master time `t_ns`, that of the states."""
        row0_s = 1e-9 * (self.observations.t_row0_master_ns - t_ns)
        self.t_ns, self.late_s = t_ns, np.where(self.seen, row0_s + self.pixels[:, 1] * self.row_s, 0.0)

    def linearise(self, state: Array) -> Rows:
        """Two rows, px, for each marker that is seen, then one for each apparent size, by standard deviations. Rows of
        a marker behind the camera are zero."""
        error, jacobian, first = _linearise(state, self.markers.arrays, self.camera, self.observed)
        return Rows(error, jacobian, UNIT, CENTROID_KERNEL, first)

    @property
    def observed(self) -> Observed:
        """What compiled functions take of it."""
        return Observed(self.seen, self.pixels, self.covariances, self.diameters, self.flags, self.late_s,
                        self.log_width, self.size_sd, self.row_s)

    def expected(self, state: Array) -> Array:
        """(M, 2) px where each marker of a hand in `state` is seen at its own time; NaN behind the camera."""
        return np.asarray(project_markers(state, self.markers.arrays, self.camera, self.late_s)[0])

    def predict_pixels(self, state: Array, covariance: Array) -> tuple[Array, Array]:
        """Pixels (M, 2) where the markers are expected, NaN behind the camera, and their covariances (M, 2, 2)."""
        pixels, jacobian, _ = project_markers(state, self.markers.arrays, self.camera, self.late_s)
        jacobian[:, :, POSE:MOTION] = 0.0  # of the way until the row: little, but for a start, whose gate it would open
        return pixels, _spread(jacobian, covariance)

    def add_landmark_noise(self, state: Array) -> None:
        """Widen the landmarks' covariances by the noise of their detector at the distance that `state` has."""
        landmark = self.markers.landmark
        if landmark.any():
            pixels, _, scale = project_markers(state, self.markers.arrays, self.camera, self.late_s)
            noise_px = np.where(landmark & np.isfinite(pixels[:, 0]), NOISE_M * scale, 0.0)
            self.covariances = self.covariances + noise_px[:, None, None] ** 2 * np.eye(2)

    def widths(self, state: Array) -> Array:
        """(M,) ln of the width in metres that each plain fingertip would show from its side at its estimated distance;
        NaN where unknown."""
        plain = self.seen & (self.flags == 0) & (self.markers.slender >= 0.0) & (self.diameters > 0.0)
        return np.asarray(_measure_widths(state, self.markers.arrays, self.camera, plain, self.observed)[0])

    def distances(self, pixels: Array, covariances: Array) -> Array:
        """(M,) squared Mahalanobis distances from where the markers are predicted, NaN where not seen."""
        distances, _ = squared_distances(self.pixels - pixels, covariances + self.covariances)
        return np.where(self.seen, distances, np.nan)

    def associated(self, pixels: Array, covariances: Array, distances: Array) -> MarkerFrame:
        """The frame with the blob of each marker, predicted at `pixels` (M, 2) with `covariances` (M, 2, 2) px^2, from
        which its own one is at `distances` (M,). A landmark is always its own: a detector that errs does not mean
        another joint, and its kernel weighs it."""
        landmark = self.markers.landmark
        if self.observations.further is None and not np.any(distances[~landmark] > GATE):
            return self
        listed = list_candidates(replace(self.observations, covariances=self.covariances))
        own = np.arange(len(landmark))[:, None] == listed.markers
        confused = np.where(landmark[:, None] | landmark[listed.markers], np.inf, -2.0 * np.log(CONFUSION))
        blobs, _ = assign(pixels, covariances, listed.pixels, listed.covariances, np.where(own, 0.0, confused))
        chosen = np.where(landmark, np.where(own.any(axis=1), own.argmax(axis=1), -1), blobs)
        out, found = copy.copy(self), chosen >= 0
        for name in _COLUMNS:
            column = getattr(self, name).copy()
            column[found] = getattr(listed, name)[chosen[found]]
            setattr(out, name, column)
        out.seen = found
        out.set_time(self.t_ns)
        return out


@njit(cache=True)
def place_points(state, dh):
    """The hand's pose world (4, 4), frames (R, 3, 4) of a table `dh`, its points (P, 3) m, and their Jacobian (P, 3,
    27) by the pose and the angles."""
    count = dh.point_row.shape[0]
    frames, points, jacobian = np.empty((dh.parent.shape[0], 3, 4)), np.empty((count, 3)), np.empty((count, 3, POSE))
    world = pose_matrix(state)
    forward_arrays(dh, world, state[STATE.angles], frames, points)
    jacobian_arrays(dh, world, frames, points, jacobian)
    return world, frames, points, jacobian


@njit(cache=True)
def turned_camera(state, markers, camera):
    """camera_from_world (3, 4) of a camera with its turn in `state` about its own axes, rad, and the turn's left
    Jacobian (3, 3)."""
    turn = np.zeros(3)
    if camera != markers.reference:
        first = 3 * (markers.half_axes.shape[0] + turn_of(camera, markers.reference))
        turn[:] = state[STATE.lasting][first:first + 3]
    return turned_pose(markers.poses[camera], turn)


@njit(cache=True)
def fill_centre(state, m, late, point, jacobian, centre):
    """x + b + J (v t + a t^2 / 2): fill `centre` (3,) m, where marker m's is seen `late` s t after the state's instant.
    `point` (3,) x and `jacobian` (3, 27) J: of its place."""
    velocity, acceleration, biases = state[STATE.velocity], state[STATE.acceleration], state[STATE.lasting]
    for i in range(3):
        centre[i] = point[i] + biases[3 * m + i]
    for j in range(POSE):
        way = late * (velocity[j] + 0.5 * late * acceleration[j])
        for i in range(3):
            centre[i] += jacobian[i, j] * way


@njit(cache=True)
def project_markers(state, markers, camera, late_s):
    """Pixels (M, 2), NaN behind the camera, where the markers are seen `late_s` (M,) s after the state's instant, their
    Jacobian (M, 2, n), and the scale (M,) px/m of the image at their places."""
    count, cameras = late_s.shape[0], markers.poses.shape[0]
    pixels, scale = np.empty((count, 2)), np.empty(count)
    jacobian = np.zeros((count, 2, MOTION + 3 * (count + cameras - 1)))
    world, _, points, by_pose = place_points(state, markers.dh)
    (pose, left), intrinsics, centre = turned_camera(state, markers, camera), markers.intrinsics[camera], np.empty(3)
    own = MOTION + 3 * (count + turn_of(camera, markers.reference))
    slope, at_joint, joint_pixel = np.empty((2, 3)), np.empty((2, 3)), np.empty(2)
    for m in range(late_s.shape[0]):
        late = late_s[m]
        fill_centre(state, m, late, points[m], by_pose[m], centre)
        if not (project_marker(centre, world, markers.half_axes[m], pose, intrinsics, pixels[m], slope)
                and project_marker(points[m], world, markers.half_axes[m], pose, intrinsics, joint_pixel, at_joint)):
            pixels[m] = scale[m] = math.nan
            continue
        scale[m] = pixels_per_metre(at_joint)
        if not markers.landmark[m]:  # with the lever of its large bias, a landmark would draw the hand nearer
            at_joint[:] = slope
        for r in range(2):
            for j in range(POSE):
                along = (at_joint[r, 0] * by_pose[m, 0, j] + at_joint[r, 1] * by_pose[m, 1, j]
                         + at_joint[r, 2] * by_pose[m, 2, j])
                jacobian[m, r, j] = along
                jacobian[m, r, POSE + j] = late * along
                jacobian[m, r, 2 * POSE + j] = 0.5 * late * late * along
            for k in range(3):
                jacobian[m, r, MOTION + 3 * m + k] = slope[r, k]
            if camera == markers.reference or markers.landmark[m]:  # landmarks' errors last, and would turn the cameras
                continue
            fill_by_turn(centre, pose, left, slope[r], jacobian[m, r, own:own + 3])
    return pixels, jacobian, scale


@njit(cache=True)
def _linearise(state, markers, camera, observed):
    """Whitened errors (K,), their Jacobian (K, n), and the first row of each observation."""
    pixels, jacobian, _ = project_markers(state, markers, camera, observed.late_s)
    sized = observed.seen & np.isfinite(observed.log_width)
    count, size = np.count_nonzero(observed.seen), jacobian.shape[2]
    most, used = 2 * count + np.count_nonzero(sized), 0
    error, rows, first = np.zeros(most), np.zeros((most, size)), np.empty(most - count, np.int64)
    for k, m in enumerate(np.flatnonzero(observed.seen)):
        # by the Cholesky factor of the 2x2 covariance
        covariance = observed.covariances[m]
        a = math.sqrt(covariance[0, 0] + FLOOR_PX**2)
        b = covariance[0, 1] / a
        c = math.sqrt(max(covariance[1, 1] + FLOOR_PX**2 - b * b, FLOOR_PX**2))
        if not math.isnan(pixels[m, 0]):
            error[used] = (observed.pixels[m, 0] - pixels[m, 0]) / a
            error[used + 1] = (observed.pixels[m, 1] - pixels[m, 1] - b * error[used]) / c
        for j in range(size):
            rows[used, j] = jacobian[m, 0, j] / a
            rows[used + 1, j] = (jacobian[m, 1, j] - b * rows[used, j]) / c
        first[k], used = used, used + 2
    if sized.any():
        widths, by_pose = _measure_widths(state, markers, camera, sized, observed)
        for k, m in enumerate(np.flatnonzero(sized)):
            if not math.isnan(widths[m]):
                error[used] = (widths[m] - observed.log_width[m]) / observed.size_sd[m]
                rows[used, :POSE] = -by_pose[m] / observed.size_sd[m]
            first[count + k], used = used, used + 1
    return error, rows, first


@njit(cache=True)
def _spread(jacobian, covariance):
    """J P J^T: (M, 2, 2) px^2 of pixels whose `jacobian` J (M, 2, n) is mostly zero, by the `covariance` P (n, n)."""
    size = covariance.shape[0]
    out, product = np.empty((jacobian.shape[0], 2, 2)), np.empty(size)
    for m in range(jacobian.shape[0]):
        for r in range(2):
            product[:] = 0.0
            for j in range(size):
                if jacobian[m, r, j] != 0.0:
                    for i in range(size):
                        product[i] += jacobian[m, r, j] * covariance[j, i]
            for q in range(2):
                out[m, r, q] = np.dot(product, jacobian[m, q])
    return out


@njit(cache=True)
def _measure_widths(state, markers, camera, chosen, observed):
    """(M,) ln of the width in metres that each of the `chosen` (M,) fingertips would show from its side at its place,
    NaN of the others; and its Jacobian (M, 27) by the pose and the angles."""
    count = chosen.shape[0]
    widths, jacobian = np.full(count, np.nan), np.empty((count, POSE))
    if not chosen.any():
        return widths, jacobian
    world, frames, points, by_pose = place_points(state, markers.dh)
    dh, pose, intrinsics = markers.dh, markers.poses[camera], markers.intrinsics[camera]
    velocity, pixel, slope, turning = state[STATE.velocity], np.empty(2), np.empty((2, 3)), np.empty((3, POSE))
    bone, line, change = np.empty(3), np.empty(3), np.empty(3)
    for m in np.flatnonzero(chosen):
        if not project_marker(points[m], world, markers.half_axes[m], pose, intrinsics, pixel, slope):
            continue
        distance = along = down = 0.0
        for i in range(3):
            line[i] = points[m, i]
            for k in range(3):
                line[i] += pose[k, i] * pose[k, 3]
            distance += line[i] ** 2
        distance = math.sqrt(distance)
        for i in range(3):
            line[i] /= distance
            bone[i] = frames[dh.point_row[m], i, 0]
            along += bone[i] * line[i]
            for j in range(POSE):
                down += slope[1, i] * by_pose[m, i, j] * velocity[j]
        side = max(math.sqrt(max(1.0 - along * along, 0.0)), _END_ON)
        shown = 1.0 + markers.slender[m] * side  # over that from the end: an area
        still = 1.0 - min(max(down * observed.row_s, -_STRETCH_MAX), _STRETCH_MAX)  # over the stretched area
        widths[m] = (math.log(observed.diameters[m] / pixels_per_metre(slope))
                     + 0.5 * math.log(still * (1.0 + markers.slender[m]) / shown))
        turning[:] = -by_pose[m]
        point_jacobian(dh, world, frames, dh.point_row[m], points[m, 0] + bone[0], points[m, 1] + bone[1],
                       points[m, 2] + bone[2], turning)
        _size_change(points[m], pose, intrinsics, line, distance, change)
        for j in range(POSE):
            farther, turned, larger = 0.0, 0.0, 0.0
            for i in range(3):
                farther += line[i] * by_pose[m, i, j]
                larger += change[i] * by_pose[m, i, j]
            for i in range(3):
                turned += line[i] * turning[i, j] + bone[i] * (by_pose[m, i, j] - farther * line[i]) / distance
            jacobian[m, j] = larger + 0.5 * markers.slender[m] / shown * along / side * turned
    return widths, jacobian


@njit(cache=True)
def _size_change(point, pose, intrinsics, line, distance, change):
    """Fill `change` (3,) per m: of ln of the size of a pixel at `point` (3,) with its place. `line` (3,): direction
    from the camera, `distance` m."""
    if not is_wide(intrinsics):
        depth = pose[2, 3] + pose[2, 0] * point[0] + pose[2, 1] * point[1] + pose[2, 2] * point[2]
        for i in range(3):  # it grows with depth^1.5 / distance^0.5, but for a plain lens's distortion
            change[i] = 1.5 * pose[2, i] / depth - 0.5 * line[i] / distance
        return
    step, near = 1e-3 * distance, np.empty((6, 3))
    for i in range(6):
        near[i] = point
        near[i, i // 2] += step if i % 2 else -step
    _, slopes = project_with_slope(near, pose, intrinsics)
    for i in range(3):
        change[i] = math.log(pixels_per_metre(slopes[2 * i]) / pixels_per_metre(slopes[2 * i + 1])) / (2.0 * step)


@njit(cache=True)
def lasting_covariances(state, markers):
    """(M + C - 1, 3, 3) of the errors that last: of a marker's triangulated centre, m^2, by the cameras' LASTING_PX and
    by its paint; then of the turns of all cameras but the reference, rad^2."""
    dh, world, count, cameras = markers.dh, pose_matrix(state), markers.half_axes.shape[0], markers.poses.shape[0]
    points, pixel, slope = np.empty((count, 3)), np.empty(2), np.empty((2, 3))
    out = np.zeros((count + cameras - 1, 3, 3))
    forward_arrays(dh, world, state[STATE.angles], np.empty((dh.parent.shape[0], 3, 4)), points)
    for m in range(count):
        information = 1e4 * np.eye(3)  # of 10 mm, where the cameras do not tell the distance
        for camera in range(cameras):
            if project_marker(points[m], world, markers.half_axes[m], markers.poses[camera], markers.intrinsics[camera],
                              pixel, slope):
                for i in range(3):
                    for j in range(3):
                        information[i, j] += (slope[0, i] * slope[0, j] + slope[1, i] * slope[1, j]) / LASTING_PX**2
        out[m] = np.linalg.inv(information)
        for i in range(3):
            out[m, i, i] += markers.paint_variance[m]
    out[count:] = turn_covariances(world[:3, 3], markers.poses, markers.reference, markers.turn_sd)
    return out


@njit(cache=True)
def expected_turn(state, covariance, markers):
    """(C,) rad, rms about an axis: how far each camera is turned by an estimate, what is not known of it included. The
    axis that is held says nothing: a turn about it is as likely as about the other two."""
    count, cameras = markers.half_axes.shape[0], markers.poses.shape[0]
    world, out = pose_matrix(state), np.zeros(cameras)
    free = turn_covariances(world[:3, 3], markers.poses, markers.reference, np.ones(cameras))
    for camera in range(cameras):
        if camera == markers.reference:
            continue
        k, total = turn_of(camera, markers.reference), 0.0
        first = 3 * (count + k)
        turn, own = state[STATE.lasting][first:first + 3], covariance[MOTION + first:, MOTION + first:]
        for i in range(3):
            for j in range(3):
                total += free[k, i, j] * (turn[i] * turn[j] + own[i, j])
        out[camera] = math.sqrt(max(0.5 * total, 0.0))
    return out
