"""What the model tracker publishes of its estimate: places with covariances, and how each is known."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.hand.dh import DhArrays
from rhot_app.hand.kinematics import forward_arrays, jacobian_arrays
from rhot_app.hand.skeleton import ANGLE_SLICES, JOINT_SLICES
from rhot_app.tracking.kalman.estimate import ANGLES, POSE, ROTATION, SCALE, Estimate
from rhot_app.tracking.kalman.markers import Cameras, Worn, place_markers, project_marker
from rhot_app.tracking.state import Knowledge

Array = NDArray[np.float64]
Codes = NDArray[np.uint8]
Times = NDArray[np.int64]

_MEASURED, _INFERRED, _GUESSED = int(Knowledge.MEASURED), int(Knowledge.INFERRED), int(Knowledge.GUESSED)

MEASURED_M, INFERRED_M = 3e-3, 12e-3
"""Standard deviation along the worst axis up to which a place counts as measured (when it was seen) and as inferred."""

MEASURED_RAD, INFERRED_RAD = math.radians(4.0), math.radians(12.0)

_FINGER_OF_JOINT = np.array([-1] + [finger for finger, rows in enumerate(JOINT_SLICES)
                                    for _ in range(rows.stop - rows.start)])
_FINGER_OF_ANGLE = np.array([finger for finger, columns in enumerate(ANGLE_SLICES)
                             for _ in range(columns.stop - columns.start)])


class Report(NamedTuple):
    """Arrays of one state, filled by `describe`; fields as in `HandState`. `points` (26, 3): joints, then tips."""

    points: Array
    covariances: Array  # (26, 3, 3)
    markers: Array
    marker_covariances: Array
    angle_sd: Array
    joint_knowledge: Codes
    angle_knowledge: Codes
    palm: Codes  # (1,)


def empty_report(markers: int) -> Report:
    """Room for one state."""
    return Report(np.empty((26, 3)), np.empty((26, 3, 3)), np.empty((markers, 3)), np.empty((markers, 3, 3)),
                  np.empty(21), np.empty(21, np.uint8), np.empty(21, np.uint8), np.empty(1, np.uint8))


@njit(cache=True)
def describe(estimate: Estimate, dh: DhArrays, worn: Worn, seen: NDArray[np.bool_], knowledge: Codes,
             report: Report) -> None:
    """Fill `report` and `knowledge` (M,). `seen` (M,): seen beyond doubt by two cameras or more, just now."""
    count = worn.part.shape[0]
    jacobian = np.empty((26, 3, POSE))
    scale = math.exp(estimate.log_scale[0])
    frames = np.empty((dh.parent.shape[0], 3, 4))
    forward_arrays(dh, estimate.world, estimate.angles, frames, report.points)
    jacobian_arrays(dh, estimate.world, frames, report.points, jacobian)
    if scale != 1.0:
        for p in range(26):
            for i in range(3):
                report.points[p, i] = estimate.world[i, 3] + scale * (report.points[p, i] - estimate.world[i, 3])
                for j in range(ROTATION, POSE):
                    jacobian[p, i, j] *= scale
    for p in range(26):
        _cover(estimate, jacobian[p], report.points[p], report.covariances[p])
    marker_jacobian = np.empty((count, 3, POSE))
    place_markers(worn, estimate, report.markers, marker_jacobian)
    for m in range(count):
        _cover(estimate, marker_jacobian[m], report.markers[m], report.marker_covariances[m])
        knowledge[m] = _know(_worst(report.marker_covariances[m]), seen[m], MEASURED_M, INFERRED_M)
    _conclude(estimate, worn, knowledge, report)


@njit(cache=True)
def _conclude(estimate: Estimate, worn: Worn, knowledge: Codes, report: Report) -> None:
    """What is measured, the images alone determine; what they determine through habit is inferred, however well.

    A fingertip needs its marker, an inner joint two markers on its finger, a palm's rotation three on the palm, an
    angle two on its finger beside those.
    """
    shown = np.zeros(6, np.int64)  # markers measured on the palm, then on each finger
    for m in range(worn.part.shape[0]):
        shown[worn.part[m] + 1] += knowledge[m] == _MEASURED
    turn = shown[0] >= 3
    for joint in range(21):
        finger = _FINGER_OF_JOINT[joint]
        needed = 2 if finger >= 0 and (joint - 1) % 4 < 3 else 1
        sd = _worst(report.covariances[joint])
        report.joint_knowledge[joint] = _know(sd, shown[finger + 1] >= needed, MEASURED_M, INFERRED_M)
    for angle in range(21):
        sd = math.sqrt(max(estimate.covariance[ANGLES + angle, ANGLES + angle], 0.0))
        report.angle_sd[angle] = sd
        report.angle_knowledge[angle] = _know(sd, turn and shown[_FINGER_OF_ANGLE[angle] + 1] >= 2, MEASURED_RAD,
                                              INFERRED_RAD)
    sd = _worst(estimate.covariance[ROTATION:ANGLES, ROTATION:ANGLES])
    report.palm[0] = _know(sd, turn, MEASURED_RAD, INFERRED_RAD)


@njit(cache=True)
def _know(sd: float, shown: bool, measured: float, inferred: float) -> int:
    if sd <= measured and shown:
        return _MEASURED
    return _INFERRED if sd <= inferred else _GUESSED


@njit(cache=True)
def _worst(covariance: Array) -> float:
    """Standard deviation along the worst axis of a (3, 3) covariance, from its trace: at most sqrt(3) too large."""
    return math.sqrt(max(covariance[0, 0] + covariance[1, 1] + covariance[2, 2], 0.0))


@njit(cache=True)
def _cover(estimate: Estimate, jacobian: Array, point: Array, out: Array) -> None:
    """Fill `out` (3, 3) m^2 with the covariance of a point with `jacobian` (3, 27); zeros cost nothing."""
    chosen, count = np.empty(POSE + 1, np.int64), 0
    slopes = np.empty((POSE + 1, 3))
    for j in range(POSE):
        if jacobian[0, j] != 0.0 or jacobian[1, j] != 0.0 or jacobian[2, j] != 0.0:
            chosen[count] = j
            slopes[count] = jacobian[:, j]
            count += 1
    if estimate.covariance[SCALE, SCALE] > 0.0:
        chosen[count] = SCALE
        for i in range(3):
            slopes[count, i] = point[i] - estimate.world[i, 3]
        count += 1
    out[:] = 0.0
    for a in range(count):
        x, y, z = 0.0, 0.0, 0.0
        row = estimate.covariance[chosen[a]]
        for b in range(count):
            p = row[chosen[b]]
            x += p * slopes[b, 0]
            y += p * slopes[b, 1]
            z += p * slopes[b, 2]
        for i in range(3):
            out[i, 0] += slopes[a, i] * x
            out[i, 1] += slopes[a, i] * y
            out[i, 2] += slopes[a, i] * z


@njit(cache=True)
def bring_together(worn: Worn, cameras: Cameras, estimate: Estimate, t_ns: int, times: Times, fresh_ns: int,
                   pixels: Array, out: Array, used: NDArray[np.bool_]) -> None:
    """Fill `out` (C, M, 2) px: each camera's last sight of each marker, carried to `t_ns` as the hand moved since.

    `times` (C, M) ns of the sights `pixels` (C, M, 2); those older than `fresh_ns` are NaN and not `used` (C, M).
    """
    count = worn.part.shape[0]
    points, jacobian = np.empty((count, 3)), np.empty((count, 3, POSE))
    place_markers(worn, estimate, points, jacobian)
    pixel, slope = np.empty(2), np.empty((2, 3))
    for c in range(times.shape[0]):
        for m in range(count):
            used[c, m] = times[c, m] >= 0 and abs(t_ns - times[c, m]) <= fresh_ns and project_marker(
                points[m], estimate.world, worn.half_axes[m], cameras.pose[c], cameras.intrinsics[c], pixel, slope)
            out[c, m] = np.nan
            if not used[c, m]:
                continue
            out[c, m] = pixels[c, m]
            for i in range(3):
                speed = 0.0
                for j in range(POSE):
                    speed += jacobian[m, i, j] * estimate.velocity[j]
                for k in range(2):
                    out[c, m, k] += slope[k, i] * speed * 1e-9 * (t_ns - times[c, m])
