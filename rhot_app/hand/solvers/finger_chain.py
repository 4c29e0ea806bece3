"""One finger in its own base frame: forward kinematics with Jacobian, and how the solution of its angles ended.

The base frame is the model's `base_rotation` frame: x along the first bone at zero angles, y the flexion axis. A
finger has four angles and moves in one plane through z; a thumb has five: a saddle joint, a second one, a hinge.
Arrays: `angles` (4,) or (5,) rad, `lengths` (3,) m with the last bone ending at the point to be placed,
`limits` like the angles with (low, high) rows, `joints` (4, 3) m from the root to that point.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]


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


@dataclass(frozen=True, slots=True)
class Solution:
    """All five fingers: `angles` (21,) rad, `residuals` (5,) m (NaN without a target), `iterations` (5,), `statuses`
    (5,) of Status."""

    angles: Array
    residuals: Array
    iterations: NDArray[np.int64]
    statuses: NDArray[np.uint8]

    @property
    def reached(self) -> NDArray[np.bool_]:
        """(5,) which targets are met."""
        return np.asarray(self.statuses == REACHED)


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
