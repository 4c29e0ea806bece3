"""FABRIK for any chain whose joints have limits: Aristidou and Lasenby 2011, section 5, on frames instead of points.

Both passes keep the limits. The forward pass turns each bone out of its parent's frame as near to the free chain as
its joint allows; the backward pass asks the same of each parent, seen from the bone that is already in place. Limits
can lock such a chain. It then says so and goes on with the exact solver of `chain_newton`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from rhot_app.hand.solvers.chain_newton import finish_arrays, lay_out
from rhot_app.hand.solvers.finger_chain import (
    EXHAUSTED,
    GAIN,
    LIMITED,
    PATIENCE,
    REACHED,
    STALLED,
    UNREACHABLE,
    Status,
    distance,
    within_reach,
)
from rhot_app.hand.solvers.joint_shapes import BOX, CONE, HINGE, Shape, clamp_joint, direction_angles, excess
from rhot_app.hand.solvers.problem import assign

Array = NDArray[np.float64]
Range = tuple[float, float]


@dataclass(frozen=True, slots=True)
class JointLimit:
    """What the joint at the root of a bone allows: a shape, and the ranges (low, high) of its angles, rad."""

    shape: Shape
    flexion: Range
    abduction: Range = (0.0, 0.0)


@dataclass(frozen=True, slots=True)
class LimitedSolution:
    """`joints` (n+1, 3) in the unit of the input; `angles` (n, 2) rad, abduction and flexion of every bone out of its
    parent's frame; `stopped`: how FABRIK ended; `status`: how all ended, after handing over where FABRIK had to."""

    joints: Array
    angles: Array
    iterations: int
    residual: float
    stopped: Status
    status: Status


def solve_limited_chain(joints: ArrayLike, target: ArrayLike, limits: Sequence[JointLimit], *,
                        base: ArrayLike | None = None, tolerance: float = 1e-4, max_iterations: int = 50,
                        hand_over: bool = True) -> LimitedSolution:
    """Move the last joint of a chain to `target` within the limits of its joints.

    `joints` (n+1, 3), root first, is the start pose, brought within the limits first; `limits` has one entry per
    bone; `base` (3, 3) is the frame in which the first bone's angles count, columns x, y, z (the world's by default).
    Units of length are the caller's. Without `hand_over` the chain stays where FABRIK ends. A target out of reach
    stretches the chain towards it as far as the limits allow.

    Raises ValueError for wrong shapes, numbers that are not finite, bones without length, a range upside down, or a
    cone or parabola that leaves out its own axis.
    """
    start, goal = np.array(joints, dtype=np.float64), np.array(target, dtype=np.float64)
    frame = np.eye(3) if base is None else np.array(base, dtype=np.float64)
    shapes, bounds = _checked(start, goal, frame, limits)
    lengths = np.linalg.norm(np.diff(start, axis=0), axis=1)
    if not lengths.all():
        raise ValueError("every bone must have a length")
    angles, frames = np.zeros((len(lengths), 2)), np.empty((len(lengths), 3, 3))
    read_angles(start, frame, lengths, shapes, bounds, angles, frames)
    iterations, stopped = solve_limited_arrays(start, frame, goal, lengths, shapes, bounds, angles, frames, tolerance,
                                               max_iterations)
    status = stopped
    if hand_over and stopped != REACHED:
        iterations += finish_arrays(start, frame, goal, lengths, shapes, bounds, angles, frames, 1e-3 * tolerance)
        residual = distance(start[-1], goal)
        status = _status(residual, distance(start[0], goal), lengths, shapes, bounds, angles, tolerance, False)
    return LimitedSolution(start, angles, iterations, distance(start[-1], goal), Status(stopped), Status(status))


def _checked(joints: Array, target: Array, base: Array,
             limits: Sequence[JointLimit]) -> tuple[NDArray[np.int64], Array]:
    """The limits as arrays: shapes (n,) and bounds (n, 2, 2), abduction and flexion, low and high."""
    if joints.ndim != 2 or joints.shape[1] != 3 or len(joints) < 2:
        raise ValueError(f"joints must have shape (n+1, 3) with at least one bone, not {joints.shape}")
    if target.shape != (3,) or base.shape != (3, 3):
        raise ValueError(f"target must have shape (3,) and base (3, 3), not {target.shape} and {base.shape}")
    if not (np.isfinite(joints).all() and np.isfinite(target).all() and np.isfinite(base).all()):
        raise ValueError("joints, target and base must be finite numbers")
    if len(limits) != len(joints) - 1:
        raise ValueError(f"{len(joints) - 1} bones need as many limits, not {len(limits)}")
    for bone, limit in enumerate(limits):
        for low, high in (limit.flexion, limit.abduction):
            if not low <= high:
                raise ValueError(f"the range {low}..{high} of bone {bone} is upside down")
            if limit.shape >= CONE and not low <= 0.0 <= high:
                raise ValueError(f"the {limit.shape.name.lower()} of bone {bone} leaves out its own axis")
    return (np.array([int(limit.shape) for limit in limits]),
            np.array([(limit.abduction, limit.flexion) for limit in limits], dtype=np.float64))


@njit(cache=True)
def solve_limited_arrays(joints: Array, base: Array, target: Array, lengths: Array, shapes: NDArray[np.int64],
                         bounds: Array, angles: Array, frames: Array, tolerance: float,
                         max_iterations: int) -> tuple[int, int]:
    """FABRIK in place on `joints` (n+1, 3), `angles` (n, 2) and `frames` (n, 3, 3); returns iterations and status."""
    bones, reach, aim = lengths.shape[0], tolerance, np.empty(3)
    for k in range(bones):
        reach += lengths[k]
    away, missed, idle, iteration = distance(joints[0], target), distance(joints[bones], target), 0, 0
    if away > reach:
        for k in range(1, bones + 1):
            assign(target, joints[k])
        read_angles(joints, base, lengths, shapes, bounds, angles, frames)
        return 0, UNREACHABLE
    while missed > tolerance and idle < PATIENCE and iteration < max_iterations:
        iteration += 1
        _aim_plane(joints, base, target, lengths, shapes, bounds, angles, frames, aim)
        _reach_back(joints, aim, lengths, shapes, bounds, angles, frames)
        read_angles(joints, base, lengths, shapes, bounds, angles, frames)
        before, missed = missed, distance(joints[bones], target)
        idle = idle + 1 if missed > (1.0 - GAIN) * before else 0
    return iteration, _status(missed, away, lengths, shapes, bounds, angles, tolerance, idle < PATIENCE)


@njit(cache=True)
def read_angles(joints: Array, base: Array, lengths: Array, shapes: NDArray[np.int64], bounds: Array, angles: Array,
                frames: Array) -> None:
    """The forward pass: point each bone at its far joint as its limits allow, in place on everything but the root."""
    for k in range(lengths.shape[0]):
        parent = base if k == 0 else frames[k - 1]
        along = np.zeros(3)
        for i in range(3):
            for j in range(3):
                along[i] += parent[j, i] * (joints[k + 1, j] - joints[k, j])
        abduction, flexion = angles[k, 0], angles[k, 1]
        if along[0] != 0.0 or along[1] != 0.0 or along[2] != 0.0:
            if shapes[k] == HINGE:
                abduction, flexion = 0.0, math.atan2(-along[2], along[0])
            else:
                abduction, flexion = direction_angles(along[0], along[1], along[2], angles[k, 0])
        angles[k, 0], angles[k, 1] = clamp_joint(shapes[k], bounds[k], abduction, flexion)
        lay_out(k, joints, base, lengths, angles, frames)


@njit(cache=True)
def _aim_plane(joints: Array, base: Array, target: Array, lengths: Array, shapes: NDArray[np.int64], bounds: Array,
               angles: Array, frames: Array, aim: Array) -> None:
    """Turn the plane of the hinges that end a chain towards `target`, and fill `aim` (3,), its foot in that plane.

    The passes themselves would tilt the plane a little at a time. What turns it is the last joint of two angles.
    """
    turning, last = lengths.shape[0] - 1, lengths.shape[0] - 1
    while turning >= 0 and shapes[turning] == HINGE:
        turning -= 1
    assign(target, aim)
    if turning == last:
        return
    if turning >= 0:
        parent, along = base if turning == 0 else frames[turning - 1], np.zeros(3)
        for i in range(3):
            for j in range(3):
                along[i] += parent[j, i] * (target[j] - joints[turning, j])
        abduction, _ = direction_angles(along[0], along[1], along[2], angles[turning, 0])
        angles[turning, 0] = min(max(abduction, bounds[turning, 0, 0]), bounds[turning, 0, 1])
        for k in range(turning, last + 1):
            lay_out(k, joints, base, lengths, angles, frames)
    off = 0.0
    for i in range(3):
        off += frames[last, i, 1] * (target[i] - joints[last, i])
    for i in range(3):
        aim[i] -= off * frames[last, i, 1]


@njit(cache=True)
def _reach_back(joints: Array, target: Array, lengths: Array, shapes: NDArray[np.int64], bounds: Array,
                angles: Array, frames: Array) -> None:
    """The backward pass, in place on `joints` but the root, whose bone keeps its far end, and on `frames`."""
    last = lengths.shape[0] - 1
    _swing_frame(frames[last], target, joints[last])
    for i in range(3):
        joints[last + 1, i] = target[i]
        joints[last, i] = target[i] - lengths[last] * frames[last, i, 0]
    for k in range(last - 1, 0, -1):
        # The parent k, seen from bone k + 1: x = (cos F cos a, -sin a, sin F cos a).
        along = np.zeros(3)
        for i in range(3):
            for j in range(3):
                along[i] += frames[k + 1, j, i] * (joints[k + 1, j] - joints[k, j])
        size = max(math.sqrt(along[0] ** 2 + along[1] ** 2 + along[2] ** 2), 1e-300)
        abduction = -math.asin(min(max(along[1] / size, -1.0), 1.0))
        flexion = math.atan2(along[2], along[0])
        abduction, flexion = clamp_joint(shapes[k + 1], bounds[k + 1], abduction, flexion)
        ca, sa, cf, sf = math.cos(abduction), math.sin(abduction), math.cos(flexion), math.sin(flexion)
        for i in range(3):
            x, y, z = frames[k + 1, i, 0], frames[k + 1, i, 1], frames[k + 1, i, 2]
            straight, frames[k, i, 2] = cf * x + sf * z, cf * z - sf * x
            frames[k, i, 0], frames[k, i, 1] = ca * straight - sa * y, sa * straight + ca * y
            joints[k, i] = joints[k + 1, i] - lengths[k] * frames[k, i, 0]


@njit(cache=True)
def _swing_frame(frame: Array, tip: Array, root: Array) -> None:
    """Turn `frame` (3, 3) the shortest way until its x points from `root` to `tip`; not at all when they coincide."""
    size = distance(tip, root)
    if size < 1e-300:
        return
    x, y, z = (tip[0] - root[0]) / size, (tip[1] - root[1]) / size, (tip[2] - root[2]) / size
    a, b, c = frame[0, 0], frame[1, 0], frame[2, 0]
    cosine = a * x + b * y + c * z
    u, v, w = b * z - c * y, c * x - a * z, a * y - b * x  # axis times sine
    if cosine < -0.999999:  # straight back: about y
        for i in range(3):
            frame[i, 0], frame[i, 2] = -frame[i, 0], -frame[i, 2]
        return
    for j in range(3):
        p, q, r = frame[0, j], frame[1, j], frame[2, j]
        dot = (u * p + v * q + w * r) / (1.0 + cosine)
        frame[0, j] = cosine * p + (v * r - w * q) + dot * u
        frame[1, j] = cosine * q + (w * p - u * r) + dot * v
        frame[2, j] = cosine * r + (u * q - v * p) + dot * w


@njit(cache=True)
def _status(residual: float, away: float, lengths: Array, shapes: NDArray[np.int64], bounds: Array, angles: Array,
            tolerance: float, moving: bool) -> int:
    if residual <= tolerance:
        return REACHED
    if not within_reach(lengths, away, tolerance):
        return UNREACHABLE
    if moving:
        return EXHAUSTED
    for k in range(lengths.shape[0]):
        if shapes[k] > BOX:
            if excess(shapes[k], bounds[k], angles[k, 0], angles[k, 1]) > 1.0 - 1e-6:
                return LIMITED
            continue
        for i in range(shapes[k] == HINGE, 2):
            if angles[k, i] < bounds[k, i, 0] + 1e-6 or angles[k, i] > bounds[k, i, 1] - 1e-6:
                return LIMITED
    return STALLED
