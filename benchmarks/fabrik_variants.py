"""FABRIK as published (Aristidou and Lasenby 2011; RHOT 2.2.7), for the comparison in `solvers.py`.

Three variants: a chain without limits; a finger within its limits (`rhot_app.hand.solvers.fabrik`); and the same,
handed over to Levenberg-Marquardt where limits stop it. `solve` takes them and the methods of the tracker.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.hand.skeleton import FINGER_ANGLES
from rhot_app.hand.solvers import methods
from rhot_app.hand.solvers.fabrik import fabrik_within
from rhot_app.hand.solvers.finger_chain import (
    EXHAUSTED,
    MISSING,
    REACHED,
    STALLED,
    UNREACHABLE,
    Solution,
    assign,
    chain_points,
    clamp,
    distance,
    miss,
    norm,
    status_of,
    within_reach,
)
from rhot_app.hand.solvers.methods import Effort, Method, Problem
from rhot_app.hand.solvers.newton import LEVENBERG, solve_exactly

Array = NDArray[np.float64]

STILL = 1e-12
"""An iteration that moves every joint by less than this part of the chain's length moves nothing."""

HANDED_OVER_ITERATIONS = 40
"""Of Levenberg-Marquardt, after FABRIK."""

COARSE = 5e-5
"""m: tolerance of FABRIK, which needs ever more iterations."""


class Fabrik(IntEnum):
    """Variants, numbered behind the tracker's methods."""

    FABRIK_FREE = 7
    """Without limits, as published (2.2.7)."""
    FABRIK = 8
    """Within limits; handed over to Levenberg-Marquardt where they stop it."""
    FABRIK_ALONE = 9
    """Within limits; it says what stopped it."""


EFFORT: dict[int, Effort] = {**methods.EFFORT, Fabrik.FABRIK: Effort(COARSE, 10),
                             Fabrik.FABRIK_FREE: Effort(COARSE, 100), Fabrik.FABRIK_ALONE: Effort(COARSE, 100)}

_LEVENBERG, _FREE, _HANDED_OVER = int(LEVENBERG), int(Fabrik.FABRIK_FREE), int(Fabrik.FABRIK)


@dataclass(frozen=True, slots=True)
class FabrikSolution(Solution):
    """`joints` (5, 4, 3) m in the base frames, root to the placed point: where the angles put them, but of the free
    chain its own, which the angles only approximate. `handed_over` (5,): limits stopped FABRIK."""

    joints: Array
    handed_over: NDArray[np.bool_]


def solve(method: Method | Fabrik, problem: Problem, effort: Effort | None = None) -> FabrikSolution:
    """As `methods.solve`; the free chain keeps no limits."""
    effort = effort or EFFORT[method]
    angles, joints, handed_over = problem.start.copy(), np.empty((5, 4, 3)), np.zeros(5, dtype=np.bool_)
    if method in tuple(Method):
        found = methods.solve(Method(method), problem, effort)
        for finger, (low, high) in enumerate(FINGER_ANGLES):
            chain_points(found.angles[low:high], problem.lengths[finger], joints[finger], np.empty((3, high - low)))
        return FabrikSolution(found.angles, found.residuals, found.iterations, found.statuses, joints, handed_over)
    residuals, iterations, statuses = np.empty(5), np.empty(5, dtype=np.int64), np.empty(5, dtype=np.uint8)
    solve_arrays(int(method), angles, problem.lengths, problem.limits, problem.targets, effort, residuals, iterations,
                 statuses, joints, handed_over)
    return FabrikSolution(angles, residuals, iterations, statuses, joints, handed_over)


@njit(cache=True)
def solve_arrays(variant, angles, lengths, limits, targets, effort, residuals, iterations, statuses, joints,
                 handed_over):
    """`solve` of a variant on arrays: `angles` (21,) in place, and every field of `FabrikSolution` filled."""
    tolerance, most = effort
    for finger in range(5):
        low, high = FINGER_ANGLES[finger]
        own, bones, box, target = angles[low:high], lengths[finger], limits[low:high], targets[finger]
        found, handed_over[finger] = (math.nan, 0, MISSING), False
        if not math.isnan(target[0] + target[1] + target[2]):
            if variant == _FREE:
                found = solve_free(own, bones, target, tolerance, most, joints[finger])
            else:
                found = solve_limited(own, bones, box, target, tolerance, most)
            if variant == _HANDED_OVER and found[2] != REACHED:
                handed_over[finger], taken = True, found[1]
                residual, more, status = solve_exactly(_LEVENBERG, own, bones, box, target, tolerance,
                                                       HANDED_OVER_ITERATIONS)
                found = residual, taken + more, status
        residuals[finger], iterations[finger], statuses[finger] = found
        if variant != _FREE or found[2] == MISSING:
            chain_points(own, bones, joints[finger], np.empty((3, high - low)))


@njit(cache=True)
def solve_free(angles: Array, lengths: Array, target: Array, tolerance: float, max_iterations: int,
               joints: Array) -> tuple[float, int, int]:
    """A free chain: fills `joints` (4, 3) and, with the nearest that a finger's joints can do, `angles`.

    Returns residual of the chain, m, iterations and status. The chain knows neither hinges nor limits: its angles
    may lie anywhere and put the end elsewhere.
    """
    chain_points(angles, lengths, joints, np.empty((3, angles.shape[0])))
    iterations, moving = solve_chain(joints, target, tolerance, max_iterations)
    bones = np.empty((3, 3))
    for k in range(3):
        for i in range(3):
            bones[k, i] = (joints[k + 1, i] - joints[k, i]) / max(lengths[k], 1e-300)
    assign(thumb_angles(bones) if angles.shape[0] == 5 else plane_angles(bones), angles)
    residual = distance(joints[3], target)
    if residual <= tolerance:
        return residual, iterations, REACHED
    if not within_reach(lengths, norm(target), tolerance):
        return residual, iterations, UNREACHABLE
    return residual, iterations, EXHAUSTED if moving else STALLED


@njit(cache=True)
def solve_limited(angles: Array, lengths: Array, limits: Array, target: Array, tolerance: float,
                  max_iterations: int) -> tuple[float, int, int]:
    """FABRIK within limits, in place on `angles`; returns residual, m, iterations, and what stopped it: LIMITED where
    limits did, STALLED where the target lies on the line of a straight finger."""
    clamp(angles, limits)
    iterations, stopped = 0, False
    if miss(angles, lengths, target) > tolerance:
        iterations, stopped = fabrik_within(angles, lengths, limits, target, tolerance, max_iterations)
    residual = miss(angles, lengths, target)
    return residual, iterations, status_of(angles, lengths, limits, norm(target), residual, tolerance, not stopped)


@njit(cache=True)
def solve_chain(joints: Array, target: Array, tolerance: float, max_iterations: int) -> tuple[int, bool]:
    """Move the last of `joints` (n + 1, 3), root first, to `target` (3,), in place; the bones keep their lengths.

    Returns the iterations done and whether the last one moved anything. A target farther than the chain is long
    stretches the chain towards it, without iterating. Otherwise each iteration is a backward pass, from the last joint
    set on the target, and a forward pass, from the root; then the `tolerance` is checked. A straight chain whose target
    lies on its own line cannot bend.
    """
    bones = joints.shape[0] - 1
    if distance(joints[bones], target) <= tolerance:
        return 0, False
    lengths = np.empty(bones)
    directions = np.empty((bones, 3))  # the last one known of each bone, for when its two joints coincide
    total = 0.0
    for k in range(bones):
        lengths[k] = distance(joints[k], joints[k + 1])
        total += lengths[k]
        for i in range(3):
            directions[k, i] = (joints[k + 1, i] - joints[k, i]) / lengths[k] if lengths[k] > 0.0 else i == 0
    if distance(joints[0], target) > total:
        for k in range(bones):
            _place(joints[k], target, lengths[k], directions[k], 1.0, joints[k + 1])
        return 0, False
    root, before, moving = joints[0].copy(), joints.copy(), True
    for iteration in range(1, max_iterations + 1):
        assign(target, joints[bones])
        for k in range(bones - 1, -1, -1):
            _place(joints[k + 1], joints[k], lengths[k], directions[k], -1.0, joints[k])
        assign(root, joints[0])
        for k in range(bones):
            _place(joints[k], joints[k + 1], lengths[k], directions[k], 1.0, joints[k + 1])
        moving = False
        for k in range(1, bones + 1):
            moving |= distance(joints[k], before[k]) > STILL * total
            assign(joints[k], before[k])
        if distance(joints[bones], target) <= tolerance:
            return iteration, moving
    return max_iterations, moving


@njit(cache=True)
def _place(fixed: Array, towards: Array, length: float, direction: Array, sign: float, out: Array) -> None:
    """Put `out` at `length` from `fixed` on the line to `towards` (eq. 2.28); keep `direction`, times `sign`."""
    apart = distance(fixed, towards)
    if apart > 1e-15 * length:
        for i in range(3):
            direction[i] = sign * (towards[i] - fixed[i]) / apart
    for i in range(3):
        out[i] = fixed[i] + sign * length * direction[i]


@njit(cache=True)
def plane_angles(bones: Array) -> Array:
    """Abduction, then one flexion per bone, of a planar chain of unit bones (n, 3) in its base frame.

    In that frame a bone bent by F in all lies along (cos a cos F, sin a cos F, -sin F): seen along z all bones lie
    on one line through the abduction a, which is their principal axis.
    """
    count = bones.shape[0]
    angles = np.empty(count + 1)
    xx, yy, xy = 0.0, 0.0, 0.0
    for k in range(count):
        xx += bones[k, 0] ** 2
        yy += bones[k, 1] ** 2
        xy += bones[k, 0] * bones[k, 1]
    abduction = 0.5 * math.atan2(2.0 * xy, xx - yy) if xx + yy > 1e-18 else 0.0
    c, s = math.cos(abduction), math.sin(abduction)
    angles[0] = abduction
    bent = 0.0
    for k in range(count):
        total = math.atan2(-bones[k, 2], c * bones[k, 0] + s * bones[k, 1])
        turn = total - bent
        angles[k + 1] = turn - 2.0 * math.pi * round(turn / (2.0 * math.pi))
        bent = total
    return angles


@njit(cache=True)
def thumb_angles(bones: Array) -> Array:
    """The thumb's five angles from its unit bones (3, 3) in its base frame: CMC abduction and flexion, then MCP, IP."""
    angles = np.empty(5)
    angles[:2] = plane_angles(bones[:1])
    ca, sa, cf, sf = math.cos(angles[0]), math.sin(angles[0]), math.cos(angles[1]), math.sin(angles[1])
    turned = np.empty((2, 3))  # the last two bones in the metacarpal's frame
    for k in range(2):
        along = ca * bones[k + 1, 0] + sa * bones[k + 1, 1]
        turned[k, 0] = cf * along - sf * bones[k + 1, 2]
        turned[k, 1] = ca * bones[k + 1, 1] - sa * bones[k + 1, 0]
        turned[k, 2] = sf * along + cf * bones[k + 1, 2]
    angles[2:] = plane_angles(turned)
    return angles
