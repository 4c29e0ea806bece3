"""Residuals of a hand: marker centroids and apparent sizes in one camera's frame."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.estimation.layout import pose_matrix
from rhot_app.estimation.residual import UNIT, Rows, student
from rhot_app.geometry.camera import is_wide, pixels_per_metre, project_with_slope
from rhot_app.hand.kinematics import forward_arrays, jacobian_arrays, point_jacobian
from rhot_app.hand.landmarks import NOISE_M
from rhot_app.hand.motion.hand_state import MOTION, POSE, STATE, tangent_size
from rhot_app.tracking.markers.marker_model import MarkerModel, project_marker
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.wire.messages import MarkerFlag

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

FLOOR_PX = 0.02
"""px: no centroid is better, whatever a node states."""

CENTROID_KERNEL = student(4.0)
"""Centroids have heavy tails: blobs are partly hidden. 4 degrees of freedom (Lange, Little and Taylor 1989)."""

SIZE_SD = 0.02
"""Standard deviation of the logarithm of a fingertip's apparent width (`python benchmarks/marker_errors.py`)."""

SIZE_S = 0.2
"""s: correlation time of that error. Within it, all frames together count as one observation."""

_END_ON = 0.03  # sine of the least angle between a fingertip and the line of sight
_STRETCH_MAX = 0.5  # of a marker's height by its motion along the rows

_COLUMNS = "pixels", "covariances", "diameters", "flags"


class MarkerFrame:
    """What one camera sees in one frame; implements `estimation.residual.Residual`.

    `t_ns`: master time, the mean of the markers' rows. `seen` (M,). `log_width` (M,): ln of the width in metres that a
    marker shows from its side; NaN where its apparent size is no observation; `size_sd`: of its logarithm.
    """

    def __init__(self, markers: MarkerModel, observations: CameraObservations) -> None:
        self.markers, self.observations, self.camera = markers, observations, observations.camera
        rows = observations.pixels[:, 1]
        self.seen = ((observations.flags & int(MarkerFlag.LOST)) == 0) & np.isfinite(rows)
        mean_row = rows[self.seen].mean() if self.seen.any() else markers.intrinsics[self.camera, 3]
        self.t_ns = observations.t_row0_master_ns + int(mean_row * observations.row_time_ns)
        self.row_s = 1e-9 * observations.row_time_ns
        self.late_s = np.where(self.seen, (rows - mean_row) * self.row_s, 0.0)
        self.pixels, self.covariances = observations.pixels, observations.covariances
        self.diameters, self.flags = observations.diameters, observations.flags
        self.log_width, self.size_sd = np.full(len(rows), np.nan), np.full(len(rows), SIZE_SD)

    def linearise(self, state: Array) -> Rows:
        """Two rows, px, for each marker that is seen, then one for each apparent size, by standard deviations."""
        count = len(self.seen)
        error, jacobian = np.empty(3 * count), np.zeros((3 * count, tangent_size(state)))
        first = np.empty(2 * count, np.int64)
        m = self.markers
        rows, observations = _linearise(
            state, m.dh, m.half_axes, m.poses[self.camera], m.intrinsics[self.camera], self.seen, self.pixels,
            self.covariances, self.late_s, m.slender, self.log_width, self.size_sd, self.diameters, self.row_s,
            m.landmark, error, jacobian, first)
        return Rows(error[:rows], jacobian[:rows], UNIT, CENTROID_KERNEL, first[:observations])

    def predict_pixels(self, state: Array, covariance: Array) -> tuple[Array, Array]:
        """Pixels (M, 2) where the markers are expected, NaN behind the camera, and their covariances (M, 2, 2)."""
        m, count = self.markers, len(self.seen)
        pixels, covariances = np.empty((count, 2)), np.empty((count, 2, 2))
        _predict_pixels(state, covariance, m.dh, m.half_axes, m.poses[self.camera], m.intrinsics[self.camera],
                        self.late_s, pixels, covariances)
        return pixels, covariances

    def add_landmark_noise(self, state: Array) -> None:
        """Widen the landmarks' covariances by the noise of their detector at the distance that `state` has."""
        m = self.markers
        if m.landmark.any():
            self.covariances = self.covariances.copy()
            _add_noise(state, m.dh, m.half_axes, m.poses[self.camera], m.intrinsics[self.camera],
                       np.where(m.landmark, NOISE_M, 0.0), self.covariances)

    def widths(self, state: Array) -> Array:
        """(M,) ln of the width in metres that each plain fingertip would show from its side at its estimated distance;
        NaN where unknown."""
        m, out = self.markers, np.full(len(self.seen), np.nan)
        plain = self.seen & (self.flags == 0) & (m.slender >= 0.0) & (self.diameters > 0.0)
        if plain.any():
            _widths(state, m.dh, m.half_axes, m.poses[self.camera], m.intrinsics[self.camera], plain, m.slender,
                    self.diameters, self.row_s, out)
        return out

    def expected(self, state: Array) -> Array:
        """(M, 2) px where each marker of a hand in `state` is seen at its own time; NaN behind the camera."""
        m, out = self.markers, np.empty((len(self.seen), 2))
        _expected(state, m.dh, m.half_axes, m.poses[self.camera], m.intrinsics[self.camera], self.late_s, out)
        return out

    def associated(self, assign: Callable[[Array, Array, NDArray[np.bool_]], Indices]) -> MarkerFrame:
        """The frame with the blobs that `assign` chooses. It takes pixels (N, 2), covariances (N, 2, 2) and whether
        each was reported as each marker (M, N), and returns the blob (M,) of each marker, -1 for none."""
        further, own = self.observations.further, np.flatnonzero(self.seen)
        columns = {name: getattr(self, name)[own] for name in _COLUMNS}
        if further is not None:
            columns = {name: np.concatenate([columns[name], getattr(further, name)]) for name in _COLUMNS}
        reported = own if further is None else np.concatenate([own, further.markers])
        chosen = assign(columns["pixels"], columns["covariances"], np.arange(len(self.seen))[:, None] == reported)
        out, found = copy.copy(self), chosen >= 0
        out.seen = found
        for name, column in columns.items():
            kept = getattr(self, name).copy()
            kept[found] = column[chosen[found]]
            setattr(out, name, kept)
        row0_s = 1e-9 * (self.observations.t_row0_master_ns - self.t_ns)
        out.late_s = np.where(found, row0_s + out.pixels[:, 1] * self.row_s, 0.0)
        return out


@njit(cache=True)
def _add_noise(state, dh, half_axes, pose, intrinsics, noise_m, covariances):
    count = noise_m.shape[0]
    frames, points, jacobian = np.empty((dh.parent.shape[0], 3, 4)), np.empty((count, 3)), np.empty((count, 3, POSE))
    world = _place(state, dh, frames, points, jacobian)
    pixel, slope = np.empty(2), np.empty((2, 3))
    for m in range(count):
        if noise_m[m] > 0.0 and project_marker(points[m], world, half_axes[m], pose, intrinsics, pixel, slope):
            for r in range(2):
                covariances[m, r, r] += (noise_m[m] * pixels_per_metre(slope)) ** 2


@njit(cache=True)
def _place(state, dh, frames, points, jacobian):
    """Fill frames (R, 3, 4), points (M, 3) and jacobian (M, 3, 27) of a state; returns world (4, 4)."""
    world = pose_matrix(state)
    forward_arrays(dh, world, state[STATE.angles], frames, points)
    jacobian_arrays(dh, world, frames, points, jacobian)
    return world


@njit(cache=True)
def _moved(state, m, late, points, jacobian, place):
    """Fill `place` (3,): marker m's seen centre `late` s after the state's instant."""
    velocity, acceleration, biases = state[STATE.velocity], state[STATE.acceleration], state[STATE.lasting]
    for i in range(3):
        place[i] = points[m, i] + biases[3 * m + i]
    for j in range(POSE):
        way = late * (velocity[j] + 0.5 * late * acceleration[j])
        for i in range(3):
            place[i] += jacobian[m, i, j] * way


@njit(cache=True)
def _linearise(state, dh, half_axes, pose, intrinsics, seen, pixels, covariances, late_s, slender, log_width,
               size_sd, diameters, row_s, landmark, error, out, first):
    count = seen.shape[0]
    joint_pixel, at_joint = np.empty(2), np.empty((2, 3))
    frames, points, jacobian = np.empty((dh.parent.shape[0], 3, 4)), np.empty((count, 3)), np.empty((count, 3, POSE))
    world = _place(state, dh, frames, points, jacobian)
    pixel, slope, place, row = np.empty(2), np.empty((2, 3)), np.empty(3), np.empty((2, POSE))
    used = observations = 0
    for m in range(count):
        if not seen[m]:
            continue
        late = late_s[m]
        _moved(state, m, late, points, jacobian, place)
        if not project_marker(place, world, half_axes[m], pose, intrinsics, pixel, slope):
            continue
        # whitened by the Cholesky factor of the 2x2 covariance
        a = math.sqrt(covariances[m, 0, 0] + FLOOR_PX**2)
        b = covariances[m, 0, 1] / a
        c = math.sqrt(max(covariances[m, 1, 1] + FLOOR_PX**2 - b * b, FLOOR_PX**2))
        at_joint[:] = slope
        if landmark[m]:  # a large bias goes with the residual: through its lever it would draw the hand nearer
            project_marker(points[m], world, half_axes[m], pose, intrinsics, joint_pixel, at_joint)
        for j in range(POSE):
            for r in range(2):
                row[r, j] = (at_joint[r, 0] * jacobian[m, 0, j] + at_joint[r, 1] * jacobian[m, 1, j]
                             + at_joint[r, 2] * jacobian[m, 2, j])
            row[0, j] /= a
            row[1, j] = (row[1, j] - b * row[0, j]) / c
        error[used] = (pixels[m, 0] - pixel[0]) / a
        error[used + 1] = (pixels[m, 1] - pixel[1] - b * error[used]) / c
        for k in range(3):
            out[used, MOTION + 3 * m + k] = slope[0, k] / a
            out[used + 1, MOTION + 3 * m + k] = (slope[1, k] - b * slope[0, k] / a) / c
        for r in range(2):
            for j in range(POSE):
                out[used + r, j] = row[r, j]
                out[used + r, POSE + j] = late * row[r, j]
                out[used + r, 2 * POSE + j] = 0.5 * late * late * row[r, j]
        first[observations] = used
        used, observations = used + 2, observations + 1
    bone, line, change, turning = np.empty(3), np.empty(3), np.empty(3), np.empty((3, POSE))
    for m in range(count):
        if math.isnan(log_width[m]) or not seen[m]:
            continue
        side, along, distance = _view(dh, frames, points, pose, m, bone, line)
        if not project_marker(points[m], world, half_axes[m], pose, intrinsics, pixel, slope):
            continue
        turning[:] = -jacobian[m]
        point_jacobian(dh, world, frames, dh.point_row[m], points[m, 0] + bone[0], points[m, 1] + bone[1],
                       points[m, 2] + bone[2], turning)
        shown = -0.5 * slender[m] / (1.0 + slender[m] * side) * along / side
        expected = log_width[m] + _log_shown(slender[m], side)
        size = (math.log(diameters[m] / pixels_per_metre(slope))
                + 0.5 * math.log(_still(state, slope, jacobian, m, row_s)))
        error[used] = (size - expected) / size_sd[m]
        _size_change(points[m], pose, intrinsics, line, distance, change)
        for j in range(POSE):
            farther, turned, larger = 0.0, 0.0, 0.0
            for i in range(3):
                farther += line[i] * jacobian[m, i, j]
                larger += change[i] * jacobian[m, i, j]
            for i in range(3):
                turned += line[i] * turning[i, j] + bone[i] * (jacobian[m, i, j] - farther * line[i]) / distance
            out[used, j] = (shown * turned - larger) / size_sd[m]
        first[observations] = used
        used, observations = used + 1, observations + 1
    return used, observations


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
def _view(dh, frames, points, pose, m, bone, line):
    """Fill the directions of marker m's bone and of the line of sight; returns the sine and cosine between, and the
    distance."""
    distance = along = 0.0
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
    return max(math.sqrt(max(1.0 - along * along, 0.0)), _END_ON), along, distance


@njit(cache=True)
def _log_shown(slender, side):
    """ln of the width shown over the width shown from the side."""
    return 0.5 * math.log((1.0 + slender * side) / (1.0 + slender))


@njit(cache=True)
def _still(state, slope, jacobian, m, row_s):
    """Area of a marker at rest over that of the moving one, which the rolling shutter stretches."""
    down, velocity = 0.0, state[STATE.velocity]
    for j in range(POSE):
        for i in range(3):
            down += slope[1, i] * jacobian[m, i, j] * velocity[j]
    return 1.0 - min(max(down * row_s, -_STRETCH_MAX), _STRETCH_MAX)


@njit(cache=True)
def _widths(state, dh, half_axes, pose, intrinsics, plain, slender, diameters, row_s, out):
    count = plain.shape[0]
    frames, points, jacobian = np.empty((dh.parent.shape[0], 3, 4)), np.empty((count, 3)), np.empty((count, 3, POSE))
    world = _place(state, dh, frames, points, jacobian)
    pixel, slope, bone, line = np.empty(2), np.empty((2, 3)), np.empty(3), np.empty(3)
    for m in range(count):
        if plain[m] and project_marker(points[m], world, half_axes[m], pose, intrinsics, pixel, slope):
            side, _, _ = _view(dh, frames, points, pose, m, bone, line)
            out[m] = (math.log(diameters[m] / pixels_per_metre(slope)) - _log_shown(slender[m], side)
                      + 0.5 * math.log(_still(state, slope, jacobian, m, row_s)))


@njit(cache=True)
def _expected(state, dh, half_axes, pose, intrinsics, late_s, pixels):
    count = late_s.shape[0]
    frames, points, jacobian = np.empty((dh.parent.shape[0], 3, 4)), np.empty((count, 3)), np.empty((count, 3, POSE))
    world = _place(state, dh, frames, points, jacobian)
    slope, place = np.empty((2, 3)), np.empty(3)
    for m in range(count):
        _moved(state, m, late_s[m], points, jacobian, place)
        if not project_marker(place, world, half_axes[m], pose, intrinsics, pixels[m], slope):
            pixels[m] = math.nan


@njit(cache=True)
def _predict_pixels(state, covariance, dh, half_axes, pose, intrinsics, late_s, pixels, covariances):
    count = late_s.shape[0]
    frames, points, jacobian = np.empty((dh.parent.shape[0], 3, 4)), np.empty((count, 3)), np.empty((count, 3, POSE))
    world = _place(state, dh, frames, points, jacobian)
    slope, place, size = np.empty((2, 3)), np.empty(3), covariance.shape[0]
    row, product = np.zeros((2, size)), np.empty(size)
    for m in range(count):
        _moved(state, m, late_s[m], points, jacobian, place)
        if not project_marker(place, world, half_axes[m], pose, intrinsics, pixels[m], slope):
            pixels[m] = math.nan
            covariances[m] = math.nan
            continue
        row[:] = 0.0
        for r in range(2):
            for j in range(POSE):
                row[r, j] = (slope[r, 0] * jacobian[m, 0, j] + slope[r, 1] * jacobian[m, 1, j]
                             + slope[r, 2] * jacobian[m, 2, j])
            for k in range(3):
                row[r, MOTION + 3 * m + k] = slope[r, k]
        for r in range(2):
            for i in range(size):
                product[i] = 0.0
            for j in range(size):
                if row[r, j] != 0.0:
                    for i in range(size):
                        product[i] += row[r, j] * covariance[j, i]
            for s in range(2):
                covariances[m, r, s] = np.dot(product, row[s])


@njit(cache=True)
def triangulation_covariance(state, dh, half_axes, poses, intrinsics, pixel_sd, paint_variance, out):
    """Fill `out` (M, 3, 3) m^2: of a marker's triangulated centre by the cameras' `pixel_sd` px and by the paint."""
    count = out.shape[0]
    frames, points = np.empty((dh.parent.shape[0], 3, 4)), np.empty((count, 3))
    world = pose_matrix(state)
    forward_arrays(dh, world, state[STATE.angles], frames, points)
    pixel, slope, information = np.empty(2), np.empty((2, 3)), np.empty((3, 3))
    for m in range(count):
        information[:] = 0.0
        for i in range(3):
            information[i, i] = 1e4  # of 10 mm, where the cameras do not tell the distance
        for camera in range(poses.shape[0]):
            if project_marker(points[m], world, half_axes[m], poses[camera], intrinsics[camera], pixel, slope):
                for i in range(3):
                    for j in range(3):
                        for r in range(2):
                            information[i, j] += slope[r, i] * slope[r, j] / pixel_sd**2
        out[m] = np.linalg.inv(information)
        for i in range(3):
            out[m, i, i] += paint_variance[m]
