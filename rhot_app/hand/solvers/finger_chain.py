"""One finger in its own base frame: forward kinematics with Jacobian, and FABRIK passes that keep joint limits.

The base frame is the model's `base_rotation` frame: x along the first bone at zero angles, y the flexion axis. A
finger has four angles and moves in one plane through z; a thumb has five: a saddle joint, a second one, a hinge.
Arrays: `angles` (4,) or (5,) rad, `lengths` (3,) m with the last bone ending at the point to be placed,
`limits` like the angles with (low, high) rows, `joints` (4, 3) m from the root to that point.
"""

from __future__ import annotations

import math
from enum import IntEnum

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.hand.limits import clamp_angle, wrap

Array = NDArray[np.float64]

GAIN = 0.02
"""An iteration of FABRIK that brings the end nearer by less than this part of its distance makes no progress."""

PATIENCE = 10
"""Iterations in a row without progress, after which FABRIK is stopped."""

PLANE_MARGIN = 0.02
"""A target nearer to the abduction axis than this part of the finger's length does not show the finger's plane."""


@njit(cache=True)
def to_finger(world_from_palm: Array, mirror: float, base: Array, base_rotation: Array, point: Array,
              local: Array) -> None:
    """Fill `local` (3,): a world point in one finger's base frame, mirrored into a right hand."""
    palm = np.zeros(3)
    for i in range(3):
        for j in range(3):
            palm[i] += world_from_palm[j, i] * (point[j] - world_from_palm[j, 3])
    palm[1] *= mirror
    for i in range(3):
        local[i] = 0.0
        for j in range(3):
            local[i] += base_rotation[j, i] * (palm[j] - base[j])


@njit(cache=True)
def chain_points(angles: Array, lengths: Array, joints: Array, jacobian: Array) -> None:
    """Fill `joints` (4, 3) and `jacobian` (3, n): change of the last of them per angle."""
    ca, sa, cf, sf = math.cos(angles[0]), math.sin(angles[0]), math.cos(angles[1]), math.sin(angles[1])
    xx, xy, xz = ca * cf, sa * cf, -sf  # the axes of the first bone's frame; y is (-sa, ca, 0)
    zx, zy, zz = ca * sf, sa * sf, cf
    hx, hy, hz = -sa, ca, 0.0  # the hinge axis of the other joints
    thumb = angles.shape[0] == 5
    joints[0, 0], joints[0, 1], joints[0, 2] = 0.0, 0.0, 0.0
    joints[1, 0], joints[1, 1], joints[1, 2] = lengths[0] * xx, lengths[0] * xy, lengths[0] * xz
    if thumb:
        cb, sb = math.cos(angles[2]), math.sin(angles[2])
        hx, hy, hz = -cb * sa - sb * xx, cb * ca - sb * xy, -sb * xz
        xx, xy, xz = cb * xx - sb * sa, cb * xy + sb * ca, cb * xz
    first = 3 if thumb else 2
    bent = 0.0
    for bone in range(1, 3):
        bent += angles[first + bone - 1]
        along, across = lengths[bone] * math.cos(bent), lengths[bone] * math.sin(bent)
        joints[bone + 1, 0] = joints[bone, 0] + along * xx - across * zx
        joints[bone + 1, 1] = joints[bone, 1] + along * xy - across * zy
        joints[bone + 1, 2] = joints[bone, 2] + along * xz - across * zz
    _turn(0.0, 0.0, 1.0, joints[0], joints[3], jacobian, 0)
    _turn(-sa, ca, 0.0, joints[0], joints[3], jacobian, 1)
    if thumb:
        _turn(zx, zy, zz, joints[1], joints[3], jacobian, 2)
    _turn(hx, hy, hz, joints[1], joints[3], jacobian, first)
    _turn(hx, hy, hz, joints[2], joints[3], jacobian, first + 1)


@njit(cache=True)
def _turn(ax: float, ay: float, az: float, origin: Array, point: Array, out: Array, column: int) -> None:
    """Column of the Jacobian: velocity of `point` turning about the axis (ax, ay, az) through `origin`."""
    rx, ry, rz = point[0] - origin[0], point[1] - origin[1], point[2] - origin[2]
    out[0, column] = ay * rz - az * ry
    out[1, column] = az * rx - ax * rz
    out[2, column] = ax * ry - ay * rx


@njit(cache=True)
def distance(a: Array, b: Array) -> float:
    """Distance of two points (3,)."""
    return math.sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2)


@njit(cache=True)
def norm(vector: Array) -> float:
    """Length of a vector (3,)."""
    return math.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)


@njit(cache=True)
def assign(values: Array, out: Array) -> None:
    """Copy `values` (n,) into `out`. A slice assignment does the same, and takes ten times as long to compile."""
    for k in range(values.shape[0]):
        out[k] = values[k]


@njit(cache=True)
def clamp(angles: Array, limits: Array) -> None:
    """Bring `angles` (n,) within `limits` (n, 2), in place."""
    for k in range(angles.shape[0]):
        angles[k] = min(max(angles[k], limits[k, 0]), limits[k, 1])


@njit(cache=True)
def linearise(angles: Array, lengths: Array, target: Array, joints: Array, jacobian: Array, error: Array) -> float:
    """Fill `joints` (4, 3), `jacobian` (3, n) and `error` (3,), target less end; returns the error's length."""
    chain_points(angles, lengths, joints, jacobian)
    for i in range(3):
        error[i] = target[i] - joints[3, i]
    return distance(joints[3], target)


@njit(cache=True)
def miss(angles: Array, lengths: Array, target: Array) -> float:
    """Distance of the finger's end from `target` (3,)."""
    joints = np.empty((4, 3))
    chain_points(angles, lengths, joints, np.empty((3, angles.shape[0])))
    return distance(joints[3], target)


@njit(cache=True)
def fold_abduction(x: float, y: float, margin: float, fallback: float) -> float:
    """Abduction, within -90..90 degrees, of a plane through z and (x, y); `fallback` when that lies within `margin`."""
    if math.hypot(x, y) < margin:
        return fallback
    return math.atan2(y, x) if x > 0.0 else math.atan2(-y, -x)


@njit(cache=True)
def fabrik_finger(angles: Array, lengths: Array, limits: Array, target: Array, tolerance: float,
                  max_iterations: int) -> tuple[int, bool]:
    """FABRIK in the finger's plane, in place on `angles`; returns the iterations done and whether it was stopped.

    The abduction axis lies in the plane, so the target alone chooses it. In the plane (u outward, w palmar) a bone
    is its direction F from u; a hinge limits the difference of neighbours' directions in both passes. Stopped means
    that limits, or a target on the line of a straight finger, let PATIENCE iterations in a row gain nothing.
    """
    reach = lengths[0] + lengths[1] + lengths[2]
    angles[0] = clamp_angle(fold_abduction(target[0], target[1], PLANE_MARGIN * reach, angles[0]),
                            limits[0, 0], limits[0, 1])
    goal_u = math.cos(angles[0]) * target[0] + math.sin(angles[0]) * target[1]
    goal_w = -target[2]
    if math.sqrt(target[0] ** 2 + target[1] ** 2 + target[2] ** 2) >= reach:
        angles[1] = clamp_angle(math.atan2(goal_w, goal_u), limits[1, 0], limits[1, 1])
        for k in range(2, 4):
            angles[k] = clamp_angle(0.0, limits[k, 0], limits[k, 1])
        return 0, False
    u, w = np.zeros(4), np.zeros(4)
    _lay_out(angles, lengths, u, w)
    missed, idle = math.hypot(u[3] - goal_u, w[3] - goal_w), 0
    if missed <= tolerance:
        return 0, False
    for iteration in range(1, max_iterations + 1):
        u[3], w[3] = goal_u, goal_w
        heading = math.atan2(w[3] - w[2], u[3] - u[2])
        for k in range(2, 0, -1):
            u[k] = u[k + 1] - lengths[k] * math.cos(heading)
            w[k] = w[k + 1] - lengths[k] * math.sin(heading)
            bend = wrap(heading - math.atan2(w[k] - w[k - 1], u[k] - u[k - 1]))
            heading -= clamp_angle(bend, limits[k + 1, 0], limits[k + 1, 1])
        # The first bone keeps its far end: that is what the forward pass reads from it.
        heading = 0.0
        for k in range(3):
            turn = math.atan2(w[k + 1] - w[k], u[k + 1] - u[k]) - heading
            angles[k + 1] = clamp_angle(turn, limits[k + 1, 0], limits[k + 1, 1])
            heading += angles[k + 1]
            u[k + 1] = u[k] + lengths[k] * math.cos(heading)
            w[k + 1] = w[k] + lengths[k] * math.sin(heading)
        before, missed = missed, math.hypot(u[3] - goal_u, w[3] - goal_w)
        idle = idle + 1 if missed > (1.0 - GAIN) * before else 0
        if missed <= tolerance or idle == PATIENCE:
            return iteration, idle == PATIENCE
    return max_iterations, False


@njit(cache=True)
def _lay_out(angles: Array, lengths: Array, u: Array, w: Array) -> None:
    """The finger's joints in its plane."""
    heading = 0.0
    for k in range(3):
        heading += angles[k + 1]
        u[k + 1] = u[k] + lengths[k] * math.cos(heading)
        w[k + 1] = w[k] + lengths[k] * math.sin(heading)


@njit(cache=True)
def fabrik_within(angles: Array, lengths: Array, limits: Array, target: Array, tolerance: float,
                  max_iterations: int) -> tuple[int, bool]:
    """`fabrik_finger` or `fabrik_thumb`, by the number of angles."""
    if angles.shape[0] == 5:
        return fabrik_thumb(angles, lengths, limits, target, tolerance, max_iterations)
    return fabrik_finger(angles, lengths, limits, target, tolerance, max_iterations)


@njit(cache=True)
def fabrik_thumb(angles: Array, lengths: Array, limits: Array, target: Array, tolerance: float,
                 max_iterations: int) -> tuple[int, bool]:
    """FABRIK of the thumb, in place on `angles`; returns the iterations done and whether it was stopped.

    The backward pass is free; the forward pass reads each bone's angles in its parent's frame and clamps them. The
    two bones behind the MCP joint share a plane, which the target chooses as it does for a finger.
    """
    joints, jacobian = np.empty((4, 3)), np.empty((3, 5))
    chain_points(angles, lengths, joints, jacobian)
    if distance(joints[0], target) >= lengths[0] + lengths[1] + lengths[2]:
        for k in range(1, 4):
            assign(target, joints[k])
        _read_thumb(angles, joints, lengths, limits)
        return 0, False
    missed, idle = distance(joints[3], target), 0
    for iteration in range(1, max_iterations + 1):
        assign(target, joints[3])
        for k in range(2, 0, -1):
            length = distance(joints[k + 1], joints[k])
            if length > 0.0:
                for i in range(3):
                    joints[k, i] = joints[k + 1, i] + lengths[k] / length * (joints[k, i] - joints[k + 1, i])
        _read_thumb(angles, joints, lengths, limits)
        chain_points(angles, lengths, joints, jacobian)
        before, missed = missed, distance(joints[3], target)
        idle = idle + 1 if missed > (1.0 - GAIN) * before else 0
        if missed <= tolerance or idle == PATIENCE:
            return iteration, idle == PATIENCE
    return max_iterations, False


@njit(cache=True)
def _read_thumb(angles: Array, joints: Array, lengths: Array, limits: Array) -> None:
    """Clamped angles that point the thumb's bones, one after the other from the root, at `joints`."""
    abduction = fold_abduction(joints[1, 0], joints[1, 1], 1e-9, angles[0])
    angles[0] = clamp_angle(abduction, limits[0, 0], limits[0, 1])
    ca, sa = math.cos(angles[0]), math.sin(angles[0])
    flexion = math.atan2(-joints[1, 2], ca * joints[1, 0] + sa * joints[1, 1])
    angles[1] = clamp_angle(flexion, limits[1, 0], limits[1, 1])
    cf, sf = math.cos(angles[1]), math.sin(angles[1])
    local = np.empty((2, 3))  # the two joints behind the MCP joint, seen from it in the metacarpal's frame
    for k in range(2):
        along = ca * joints[k + 2, 0] + sa * joints[k + 2, 1]
        local[k, 0] = cf * along - sf * joints[k + 2, 2] - lengths[0]
        local[k, 1] = ca * joints[k + 2, 1] - sa * joints[k + 2, 0]
        local[k, 2] = sf * along + cf * joints[k + 2, 2]
    margin = PLANE_MARGIN * (lengths[1] + lengths[2])
    angles[2] = clamp_angle(fold_abduction(local[1, 0], local[1, 1], margin, angles[2]), limits[2, 0], limits[2, 1])
    c, s = math.cos(angles[2]), math.sin(angles[2])
    angles[3] = clamp_angle(math.atan2(-local[0, 2], c * local[0, 0] + s * local[0, 1]), limits[3, 0], limits[3, 1])
    u = c * local[1, 0] + s * local[1, 1] - lengths[1] * math.cos(angles[3])
    w = -local[1, 2] - lengths[1] * math.sin(angles[3])
    angles[4] = clamp_angle(math.atan2(w, u) - angles[3], limits[4, 0], limits[4, 1])


# -- How an inverse kinematics solver ended ----------------------------------------------------------------------------

class Status(IntEnum):
    """How the solution of one finger ended. Only REACHED promises a residual within the tolerance."""

    REACHED = 0
    UNREACHABLE = 1
    """The target is farther than the chain is long, or nearer than its longest bone lets it fold."""
    LIMITED = 2
    """No more progress, with a joint at its limit."""
    STALLED = 3
    """No more progress, with no joint at its limit: a singular pose or a local minimum."""
    EXHAUSTED = 4
    """Still under way when the iterations were used up."""
    MISSING = 5
    """There was no target: the start stands."""


REACHED, UNREACHABLE, LIMITED, STALLED, EXHAUSTED, MISSING = (int(status) for status in Status)

AT_LIMIT = 1e-6
"""A joint this near to its limit stands at it, rad."""


@njit(cache=True)
def within_reach(lengths: Array, away: float, tolerance: float) -> bool:
    """Whether a free chain of bones `lengths` (n,) could bring its end within `tolerance` of a point this far `away`
    from its root."""
    total, longest = 0.0, 0.0
    for k in range(lengths.shape[0]):
        total += lengths[k]
        longest = max(longest, lengths[k])
    return 2.0 * longest - total - tolerance <= away <= total + tolerance


@njit(cache=True)
def status_of(angles: Array, lengths: Array, limits: Array, away: float, residual: float, tolerance: float,
              moving: bool) -> int:
    """The status of a finger that ended with `residual`, its target this far `away` from its root; `moving`: it was
    still making progress."""
    if residual <= tolerance:
        return REACHED
    if not within_reach(lengths, away, tolerance):
        return UNREACHABLE
    if moving:
        return EXHAUSTED
    for k in range(angles.shape[0]):
        if angles[k] - limits[k, 0] < AT_LIMIT or limits[k, 1] - angles[k] < AT_LIMIT:
            return LIMITED
    return STALLED
