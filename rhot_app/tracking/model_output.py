"""What the model tracker publishes of its estimate: places with covariances, and how each is known."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.hand.dh import DhArrays
from rhot_app.hand.kinematics import forward_arrays, jacobian_arrays
from rhot_app.hand.skeleton import ANGLE_SLICES, JOINT_SLICES, TIP_ROLES, WRIST_ROLE
from rhot_app.tracking.bends import tell_of_bends
from rhot_app.tracking.kalman.estimate import ANGLES, POSE, ROTATION, Estimate, scale_of
from rhot_app.tracking.kalman.markers import Cameras
from rhot_app.tracking.kalman.share import Share
from rhot_app.tracking.kalman.sighted import eyes_on
from rhot_app.tracking.kalman.wearing import Wearing
from rhot_app.tracking.known import known_of, tell_of_open
from rhot_app.tracking.locate import locate_all
from rhot_app.tracking.rig_arrays import RigArrays
from rhot_app.tracking.sights import Seen, bring_together, seen_clearly
from rhot_app.tracking.state import Knowledge

Array = NDArray[np.float64]
Codes = NDArray[np.uint8]
Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]

_MEASURED, _INFERRED, _GUESSED = int(Knowledge.MEASURED), int(Knowledge.INFERRED), int(Knowledge.GUESSED)

MEASURED_M, INFERRED_M = 3e-3, 12e-3
"""Standard deviation, the root of the summed variances of its axes, up to which a place counts as measured (when it was
seen) and as inferred."""

CHANGES_M_S = 0.5
"""A marker that moves so fast looks otherwise with every frame, and what lasts of its errors has half the
variance."""

MEASURED_RAD, INFERRED_RAD = math.radians(4.0), math.radians(12.0)

FIRST_TIP, FIRST_MARKER = 21, 26
"""Of the points that a state tells of: joints, fingertips, markers."""

_FINGER_OF_JOINT = np.array([-1] + [finger for finger, rows in enumerate(JOINT_SLICES)
                                    for _ in range(rows.stop - rows.start)])
_FINGER_OF_ANGLE = np.array([finger for finger, columns in enumerate(ANGLE_SLICES)
                             for _ in range(columns.stop - columns.start)])


class Subject(NamedTuple):
    """What states tell of, unchanging: `dh`, the hand's table with P = 26 + M points: joints, fingertips, M markers;
    `part` (M,) and `half_axes` (M, 3) m of the markers as in `Worn`; `focal` (C, 2) px and `shapes` (M, 3, 3) m^2 as in
    `RigArrays`; `paint` and `made` (M,) m^2 as in `known_of`, `lasting` (M,) as in `Wearing`, `usual` (27,) as in
    `tell_of_open`. `tips` (5,) and `wrist`: the markers on the fingertips and on the wrist, -1 where there is none."""

    dh: DhArrays
    part: Indices
    half_axes: Array
    cameras: Cameras
    focal: Array
    shapes: Array
    paint: Array
    made: Array
    lasting: Array
    usual: Array
    tips: Indices
    wrist: int


class Report(NamedTuple):
    """Arrays of one state, filled by `describe`; fields as in `HandState`, P points as in `Subject`."""

    points: Array  # (P, 3) m
    covariances: Array  # (P, 3, 3) m^2
    raw: Array
    errors: Array
    angle_sd: Array
    marker_knowledge: Codes
    joint_knowledge: Codes
    angle_knowledge: Codes
    palm: Codes  # (1,)
    palm_covariance: Array  # (6, 6), palm translation m and rotation rad


def subject_of(wearing: Wearing, rig: RigArrays) -> Subject:
    """The hand with its markers before its cameras."""
    one, other = wearing.model.dh, wearing.worn.dh
    dh = one._replace(point_row=np.concatenate([one.point_row, other.point_row]),
                      point_offset=np.concatenate([one.point_offset, other.point_offset]))
    return Subject(dh, wearing.worn.part, wearing.worn.half_axes, wearing.cameras, rig.focal, rig.shapes,
                   wearing.paint_variance, wearing.bias_variance, wearing.lasting, np.diag(wearing.habits.usual).copy(),
                   np.array([wearing.marker_of(role) for role in TIP_ROLES]), wearing.marker_of(WRIST_ROLE))


def empty_report(markers: int) -> Report:
    """Room for one state."""
    points = FIRST_MARKER + markers
    return Report(np.empty((points, 3)), np.empty((points, 3, 3)), np.empty((markers, 3)), np.empty(markers),
                  np.empty(21), np.empty(markers, np.uint8), np.empty(21, np.uint8), np.empty(21, np.uint8),
                  np.empty(1, np.uint8), np.empty((ANGLES, ANGLES)))


class Account(NamedTuple):
    """What a state tells of: a hand as it is estimated, and what was seen of it."""

    estimate: Estimate
    subject: Subject
    seen: Seen


@njit(cache=True)
def describe(account: Share, t_ns: int, report: Report) -> bool:
    """Fill `report` from a shared `Account` of `t_ns`; returns whether all markers are measured. One call for all
    that is told of a state: each costs some microseconds."""
    told: Account = account.of
    estimate, subject, seen = told.estimate, told.subject, told.seen
    world, count = estimate.world, report.points.shape[0]
    covariance = known_of(estimate, subject.cameras, subject.paint, subject.made)
    placed = placed_points(estimate.unseen, subject.tips)
    jacobian = np.empty((count, 3, POSE))
    _place(world, estimate.angles, scale_of(estimate), subject.dh, report.points, jacobian)
    _cover_all(world, covariance, jacobian, report.points, placed, report.covariances)
    tell_of_open(estimate, subject.usual, covariance)
    report.palm_covariance[:] = covariance[:ANGLES, :ANGLES]
    tell_of_bends(estimate, subject.cameras.pose, subject.tips, report.points[FIRST_MARKER:], jacobian[FIRST_MARKER:],
                  covariance)
    _cover_all(world, covariance, jacobian, report.points, ~placed, report.covariances)
    located = np.empty((count - FIRST_MARKER, 3, 3))
    _locate(world, estimate.velocity, subject, report.points[FIRST_MARKER:], jacobian[FIRST_MARKER:], seen, t_ns,
            report, located)
    tell_of_lasting(estimate.velocity, subject, jacobian[FIRST_MARKER:], located, report)
    all_measured = True
    for m in range(count - FIRST_MARKER):
        report.marker_knowledge[m] = _know(_worst(report.covariances[FIRST_MARKER + m]),
                                           seen_clearly(seen, t_ns, m), MEASURED_M, INFERRED_M)
        all_measured &= report.marker_knowledge[m] == _MEASURED
    _conclude(covariance, subject, report)
    return all_measured


@njit(cache=True)
def _place(world: Array, angles: Array, scale: float, dh: DhArrays, points: Array, jacobian: Array) -> None:
    """Fill `points` (P, 3) m and `jacobian` (P, 3, 27) of a hand of any size."""
    frames = np.empty((dh.parent.shape[0], 3, 4))
    forward_arrays(dh, world, angles, frames, points)
    jacobian_arrays(dh, world, frames, points, jacobian)
    if scale != 1.0:
        for p in range(points.shape[0]):
            for i in range(3):
                points[p, i] = world[i, 3] + scale * (points[p, i] - world[i, 3])
                for j in range(ROTATION, POSE):
                    jacobian[p, i, j] *= scale


@njit(cache=True)
def _locate(world: Array, velocity: Array, subject: Subject, markers: Array, jacobian: Array, seen: Seen, t_ns: int,
            report: Report, covariances: Array) -> None:
    """Where the sights alone have the markers, with `covariances` (M, 3, 3) m^2: they are of several instants, and the
    hand says how it moved since."""
    shape, cameras = seen.times.shape, subject.cameras
    pixels, used = np.empty((shape[0], shape[1], 2)), np.empty(shape, np.bool_)
    bring_together(subject.half_axes, cameras, world, velocity, markers, jacobian, t_ns, seen, pixels, used)
    locate_all(pixels, seen.covariances, used, cameras.intrinsics, cameras.pose, subject.focal, subject.shapes,
               report.raw, covariances, report.errors)


@njit(cache=True)
def tell_of_lasting(velocity: Array, subject: Subject, jacobian: Array, located: Array, report: Report) -> None:
    """Add to what is told of markers, the fingertips and the wrist that wear them what no waiting takes away: errors of
    one camera that last, part of the covariances (M, 3, 3) m^2 of the places that its sights have."""
    for m in range(located.shape[0]):
        if not np.isfinite(located[m, 0, 0]):
            continue
        square = 0.0
        for i in range(3):
            speed = 0.0
            for j in range(POSE):
                speed += jacobian[m, i, j] * velocity[j]
            square += speed * speed
        lasting = subject.lasting[m] ** 2 / (1.0 + square / CHANGES_M_S**2) * located[m]
        report.covariances[FIRST_MARKER + m] += lasting
        if m == subject.wrist:
            report.covariances[0] += lasting
            report.palm_covariance[:3, :3] += lasting
        for finger in range(subject.tips.shape[0]):
            if m == subject.tips[finger]:
                report.covariances[FIRST_TIP + finger] += lasting


@njit(cache=True)
def _conclude(covariance: Array, subject: Subject, report: Report) -> None:
    """What is measured, the images alone determine; what they determine through habit is inferred, however well.

    A fingertip needs its marker, an inner joint two markers on its finger, a palm's rotation three on the palm, an
    angle two on its finger beside those.
    """
    shown = np.zeros(6, np.int64)  # markers measured on the palm, then on each finger
    for m in range(subject.part.shape[0]):
        shown[subject.part[m] + 1] += report.marker_knowledge[m] == _MEASURED
    turn = shown[0] >= 3
    for joint in range(21):
        finger = _FINGER_OF_JOINT[joint]
        needed = 2 if finger >= 0 and (joint - 1) % 4 < 3 else 1
        sd = _worst(report.covariances[joint])
        report.joint_knowledge[joint] = _know(sd, shown[finger + 1] >= needed, MEASURED_M, INFERRED_M)
    for angle in range(21):
        variance = covariance[ANGLES + angle, ANGLES + angle]
        sd = math.sqrt(max(min(variance, subject.usual[ANGLES + angle]), 0.0))  # no angle is known less than by habit
        report.angle_sd[angle] = sd
        report.angle_knowledge[angle] = _know(sd, turn and shown[_FINGER_OF_ANGLE[angle] + 1] >= 2, MEASURED_RAD,
                                              INFERRED_RAD)
    sd = _worst(covariance[ROTATION:ANGLES, ROTATION:ANGLES])
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
def placed_points(unseen: Array, tips: Indices) -> Mask:
    """(P,) which points two cameras see: markers, and fingertips that wear them. No open direction moves these.
    `unseen` (C, M) as in `Estimate`."""
    placed = np.zeros(FIRST_MARKER + unseen.shape[1], np.bool_)
    for m in range(unseen.shape[1]):
        placed[FIRST_MARKER + m] = eyes_on(unseen, m)[0] > 1
    for finger in range(tips.shape[0]):
        placed[FIRST_TIP + finger] = tips[finger] >= 0 and placed[FIRST_MARKER + tips[finger]]
    return placed


@njit(cache=True)
def _cover_all(world: Array, covariance: Array, jacobian: Array, points: Array, chosen: Mask, out: Array) -> None:
    """Fill `out` (P, 3, 3) m^2 with the covariances of those of the `points` (P, 3) m, with `jacobian` (P, 3, 27), that
    are `chosen` (P,); `covariance` (28, 28) as in `known_of`."""
    columns, slopes = np.empty(POSE + 1, np.int64), np.empty((POSE + 1, 3))
    scaled = covariance[POSE, POSE] > 0.0
    for p in np.flatnonzero(chosen):
        count = 0
        for j in range(POSE):  # zeros cost nothing
            x, y, z = jacobian[p, 0, j], jacobian[p, 1, j], jacobian[p, 2, j]
            if x != 0.0 or y != 0.0 or z != 0.0:
                columns[count] = j
                slopes[count, 0], slopes[count, 1], slopes[count, 2] = x, y, z
                count += 1
        if scaled:
            columns[count] = POSE
            for i in range(3):
                slopes[count, i] = points[p, i] - world[i, 3]
            count += 1
        _cover(covariance, columns[:count], slopes, out[p])


@njit(cache=True)
def _cover(covariance: Array, columns: Indices, slopes: Array, out: Array) -> None:
    """Fill `out` (3, 3) with the covariance of what changes by `slopes` (K, 3) per number of the state in `columns`."""
    xx = xy = xz = yy = yz = zz = 0.0
    for a in range(columns.shape[0]):
        x = y = z = 0.0
        for b in range(columns.shape[0]):
            p = covariance[columns[a], columns[b]]
            x += p * slopes[b, 0]
            y += p * slopes[b, 1]
            z += p * slopes[b, 2]
        xx += slopes[a, 0] * x
        xy += slopes[a, 0] * y
        xz += slopes[a, 0] * z
        yy += slopes[a, 1] * y
        yz += slopes[a, 1] * z
        zz += slopes[a, 2] * z
    out[0, 0], out[1, 1], out[2, 2] = xx, yy, zz
    out[0, 1] = out[1, 0] = xy
    out[0, 2] = out[2, 0] = xz
    out[1, 2] = out[2, 1] = yz
