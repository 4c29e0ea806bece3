"""What the model tracker publishes of its estimate: places with covariances, and how each is known."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.hand.dh import DhArrays
from rhot_app.hand.skeleton import ANGLE_SLICES, JOINT_SLICES, TIP_ROLES, WRIST_ROLE
from rhot_app.lean import lean, room, slots
from rhot_app.tracking.bends import tell_of_bends
from rhot_app.tracking.kalman.combine import fill
from rhot_app.tracking.kalman.estimate import ANGLES, MOST_MARKERS, POSE, ROTATION, Estimate
from rhot_app.tracking.kalman.hiding import slightly_moved, speed_of
from rhot_app.tracking.kalman.markers import Cameras, Places, empty_places, place_markers
from rhot_app.tracking.kalman.share import Share
from rhot_app.tracking.kalman.sighted import eyes_on
from rhot_app.tracking.kalman.wearing import Wearing
from rhot_app.tracking.known import TOLD, Sheet, empty_sheet, fill_known, tell_of_open
from rhot_app.tracking.raw_places import RawPlaces, locate_raw
from rhot_app.tracking.sights import Seen, all_in_sight, seen_clearly
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

FIRST_TIP, FIRST_MARKER, MOST_POINTS = 21, 26, 26 + MOST_MARKERS
"""Of the points that a state tells of: joints, fingertips, markers."""

_FINGER_OF_JOINT = np.array([-1] + [finger for finger, rows in enumerate(JOINT_SLICES)
                                    for _ in range(rows.stop - rows.start)])
_FINGER_OF_ANGLE = np.array([finger for finger, columns in enumerate(ANGLE_SLICES)
                             for _ in range(columns.stop - columns.start)])


class Subject(NamedTuple):
    """What states tell of, unchanging: `dh`, the hand's table with P = 26 + M points: joints, fingertips, M markers;
    `part` (M,) and `half_axes` (M, 3) m of the markers as in `Worn`; `paint` and `made` (M,) m^2 as in `fill_known`,
    `lasting` (M,) as in `Wearing`, `usual` (27,) as in `tell_of_open`. `tips` (5,) and `wrist`: the markers on the
    fingertips and on the wrist, -1 where there is none."""

    dh: DhArrays
    part: Indices
    half_axes: Array
    cameras: Cameras
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


def subject_of(wearing: Wearing) -> Subject:
    """The hand with its markers before its cameras."""
    one, other = wearing.model.dh, wearing.worn.dh
    dh = one._replace(point_row=np.concatenate([one.point_row, other.point_row]),
                      point_offset=np.concatenate([one.point_offset, other.point_offset]))
    return Subject(dh, wearing.worn.part, wearing.worn.half_axes, wearing.cameras,
                   wearing.paint_variance, wearing.bias_variance, wearing.lasting, np.diag(wearing.habits.usual).copy(),
                   np.array([wearing.marker_of(role) for role in TIP_ROLES]), wearing.marker_of(WRIST_ROLE))


def empty_report(markers: int) -> Report:
    """Room for one state."""
    points = FIRST_MARKER + markers
    return Report(np.empty((points, 3)), np.empty((points, 3, 3)), np.empty((markers, 3)), np.empty(markers),
                  np.empty(21), np.empty(markers, np.uint8), np.empty(21, np.uint8), np.empty(21, np.uint8),
                  np.empty(1, np.uint8), np.empty((ANGLES, ANGLES)))


class Account(NamedTuple):
    """What a state tells of - a hand as it is estimated, and what was seen of it -, and room to work in: the `places`
    of the subject's points, `known` (28, 28) as `fill_known` has it, and `located` (M, 3, 3) m^2, how well sights alone
    have the markers."""

    estimate: Estimate
    subject: Subject
    seen: Seen
    places: Places
    known: Array
    located: Array
    sheet: Sheet


def open_account(estimate: Estimate, subject: Subject, seen: Seen) -> Account:
    """An account of a hand, with the room that it takes."""
    markers = len(subject.part)
    return Account(estimate, subject, seen, empty_places(subject.dh), np.empty((TOLD, TOLD)),
                   np.empty((markers, 3, 3)), empty_sheet(markers))


@njit(cache=True)
def describe(account: Share, t_ns: int, report: Report) -> tuple[bool, bool]:
    """Fill `report` from a shared `Account` of `t_ns`; returns whether all markers are measured, and whether all are in
    sight (`sights.all_in_sight`). One call for all that is told of a state: each costs some microseconds."""
    return fill_report(account.of, t_ns, report), all_in_sight(account.of.seen, t_ns)


@lean
def fill_report(told: Account, t_ns: int, report: Report) -> bool:
    """Returns whether all markers are measured."""
    estimate, subject, seen, places, known = told.estimate, told.subject, told.seen, told.places, told.known
    tips, cameras = subject.tips, subject.cameras
    fill_known(estimate, cameras, subject.paint, subject.made, told.sheet, known)
    place_markers(subject.dh, estimate, places)
    for p in range(places.points.shape[0]):
        fill(report.points[p], places.points[p])
    placed = slots((MOST_POINTS,))
    note_placed(estimate.unseen, tips, placed)
    _cover_all(estimate.world, known, places, placed, 1, report.covariances)
    tell_of_open(estimate, subject.usual, known)
    for i in range(ANGLES):
        fill(report.palm_covariance[i], known[i, :ANGLES])
    tell_of_bends(estimate, cameras.pose, tips, places.points[FIRST_MARKER:], places.jacobian[FIRST_MARKER:], known)
    _cover_all(estimate.world, known, places, placed, 0, report.covariances)
    locate_raw(subject.half_axes, cameras, estimate, places, FIRST_MARKER, t_ns, seen,
               RawPlaces(report.raw, told.located, report.errors))
    tell_of_hiding(estimate, subject, report)
    tell_of_lasting(estimate.velocity, subject, places.jacobian[FIRST_MARKER:], told.located, report)
    all_measured = True
    for m in range(subject.part.shape[0]):
        report.marker_knowledge[m] = _know(_worst(report.covariances[FIRST_MARKER + m]),
                                           seen_clearly(seen, t_ns, m), MEASURED_M, INFERRED_M)
        all_measured &= report.marker_knowledge[m] == _MEASURED
    _conclude(known, subject, report)
    return all_measured


@lean
def tell_of_hiding(estimate: Estimate, subject: Subject, report: Report) -> None:
    """Add to what is told of fingertips and their markers how far what hides a little of them may move them."""
    for finger in range(subject.tips.shape[0]):
        m = subject.tips[finger]
        if m >= 0:
            moved = slightly_moved(estimate, m)
            for i in range(3):
                report.covariances[FIRST_MARKER + m, i, i] += moved
                report.covariances[FIRST_TIP + finger, i, i] += moved


@lean
def tell_of_lasting(velocity: Array, subject: Subject, jacobian: Array, located: Array, report: Report) -> None:
    """Add to what is told of markers, the fingertips and the wrist that wear them what no waiting takes away: errors of
    one camera that last, part of the covariances (M, 3, 3) m^2 of the places that its sights have."""
    for m in range(located.shape[0]):
        if not np.isfinite(located[m, 0, 0]):
            continue
        share = subject.lasting[m] ** 2 / (1.0 + (speed_of(jacobian[m], velocity) / CHANGES_M_S) ** 2)
        for i in range(3):
            for j in range(3):
                lasting = share * located[m, i, j]
                report.covariances[FIRST_MARKER + m, i, j] += lasting
                if m == subject.wrist:
                    report.covariances[0, i, j] += lasting
                    report.palm_covariance[i, j] += lasting
                for finger in range(subject.tips.shape[0]):
                    if m == subject.tips[finger]:
                        report.covariances[FIRST_TIP + finger, i, j] += lasting


@lean
def _conclude(covariance: Array, subject: Subject, report: Report) -> None:
    """What is measured, the images alone determine; what they determine through habit is inferred, however well.

    A fingertip needs its marker, an inner joint two markers on its finger, a palm's rotation three on the palm, an
    angle two on its finger beside those.
    """
    shown = slots((6,))  # markers measured on the palm, then on each finger
    shown[:] = 0
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


@lean
def _know(sd: float, shown: bool, measured: float, inferred: float) -> int:
    if sd <= measured and shown:
        return _MEASURED
    return _INFERRED if sd <= inferred else _GUESSED


@lean
def _worst(covariance: Array) -> float:
    """Standard deviation along the worst axis of a (3, 3) covariance, from its trace: at most sqrt(3) too large."""
    return math.sqrt(max(covariance[0, 0] + covariance[1, 1] + covariance[2, 2], 0.0))


@lean
def note_placed(unseen: Array, tips: Indices, out: Indices) -> None:
    """Fill `out` (P,), 1 for points that two cameras see: markers, and fingertips that wear them. No open direction
    moves these. `unseen` (C, M) as in `Estimate`."""
    out[:] = 0
    for m in range(unseen.shape[1]):
        out[FIRST_MARKER + m] = eyes_on(unseen, m)[0] > 1
    for finger in range(tips.shape[0]):
        if tips[finger] >= 0:
            out[FIRST_TIP + finger] = out[FIRST_MARKER + tips[finger]]


@lean
def _cover_all(world: Array, covariance: Array, places: Places, placed: Indices, chosen: int, out: Array) -> None:
    """Fill `out` (P, 3, 3) m^2 with the covariances of those of the points of which `placed` (P,) is as `chosen`;
    `covariance` (28, 28) as `fill_known` has it."""
    columns, slopes, points, jacobian = slots((TOLD,)), room((TOLD, 3)), places.points, places.jacobian
    scaled = covariance[POSE, POSE] > 0.0
    for p in range(points.shape[0]):
        if placed[p] != chosen:
            continue
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


@lean
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
