"""A finger whose last two joints bend together, solved without iterating on its pose.

With DIP = 2/3 PIP (RHOT eq. 2.4) one angle q shapes the finger, and the two angles of its root turn it. The distance
of the end from the root depends on q alone,

    |p(q)|^2 = l1^2 + l2^2 + l3^2 + 2 l2 l3 cos(c q) + 2 l1 cos(b) (l2 cos(q) + l3 cos((1 + c) q)),

which for c = 2/3 is a quintic in cos(q / 3): it has no root in radicals, but falls monotonously between its turning
points, where a guarded Newton step finds it to rounding. The root's two angles then follow in closed form. A thumb's
IP joint bends as its MCP joint does (c = 1), and its MCP abduction b stays as it is.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.hand.anatomy import DIP_PER_PIP
from rhot_app.hand.limits import clamp_angle, wrap
from rhot_app.hand.solvers.finger_chain import assign, clamp, miss, norm, status_of

Array = NDArray[np.float64]

IP_PER_MCP = 1.0
"""Flexion of the thumb's IP joint per flexion of its MCP joint (`limits.pose_prior`)."""

SLACK = 1e-9
"""A root this far beyond a limit, rad, is rounding."""

SAMPLES = 9
SECTIONS = 26
"""Evaluations of the search for the nearest end, when no root keeps the limits: a coarse one, then golden sections."""


@njit(cache=True)
def solve_coupled(angles: Array, lengths: Array, limits: Array, target: Array, tolerance: float
                  ) -> tuple[float, int, int]:
    """One finger, in place on `angles` (4,) or (5,); returns residual, m, Newton steps for q, and status.

    Of up to four shapes and two turns of the root the one nearest to the start within the limits is taken. When
    none keeps them, the nearest end within the limits is searched along q.
    """
    clamp(angles, limits)
    shape, start, best = angles.shape[0] - 2, np.empty(angles.shape[0]), np.empty(angles.shape[0])
    assign(angles, start)
    ratio = _ratio(angles)
    low = max(limits[shape, 0], limits[shape + 1, 0] / ratio)
    high = max(min(limits[shape, 1], limits[shape + 1, 1] / ratio), low)
    least, steps = np.inf, 0
    edges = np.empty(5)
    for piece in range(_monotone_pieces(lengths, start, low, high, edges)):
        q, taken = _shape_of(lengths, start, edges[piece], edges[piece + 1], target)
        steps = max(steps, taken)
        if taken < 0:
            continue
        for side in range(2):
            if _turn_root(angles, start, lengths, limits, target, q, side == 1):
                change = 0.0
                for k in range(angles.shape[0]):
                    change += (angles[k] - start[k]) ** 2
                if change < least:
                    least = change
                    assign(angles, best)
    assign(best, angles)
    if math.isinf(least):
        _nearest(angles, start, lengths, limits, target, low, high)
    clamp(angles, limits)
    residual = miss(angles, lengths, target)
    return residual, steps, status_of(angles, lengths, limits, norm(target), residual, tolerance, False)


@njit(cache=True)
def _ratio(angles: Array) -> float:
    return IP_PER_MCP if angles.shape[0] == 5 else DIP_PER_PIP


@njit(cache=True)
def _twist(angles: Array) -> float:
    """The abduction between the first bone and the others."""
    return angles[2] if angles.shape[0] == 5 else 0.0


@njit(cache=True)
def _slope(lengths: Array, start: Array, q: float) -> float:
    """Derivative of |p(q)|^2."""
    c, b = _ratio(start), math.cos(_twist(start))
    return (-2.0 * c * lengths[1] * lengths[2] * math.sin(c * q) - 2.0 * lengths[0] * b
            * (lengths[1] * math.sin(q) + (1.0 + c) * lengths[2] * math.sin((1.0 + c) * q)))


@njit(cache=True)
def _monotone_pieces(lengths: Array, start: Array, low: float, high: float, edges: Array) -> int:
    """Fill the `edges` (5,) of the parts of low..high in which |p(q)| rises or falls, and return how many parts: it
    turns at 0 and, folded up, once on each side of it."""
    fold = max(abs(low), abs(high))
    if _slope(lengths, start, fold) > 0.0:
        inner, outer = 0.5 * fold, fold
        for _ in range(50):
            middle = 0.5 * (inner + outer)
            if _slope(lengths, start, middle) > 0.0:
                outer = middle
            else:
                inner = middle
        fold = outer
    count = 1
    edges[0] = low
    for edge in (-fold, 0.0, fold):
        if edges[count - 1] < edge < high:
            edges[count] = edge
            count += 1
    edges[count] = high
    return count


@njit(cache=True)
def _end(lengths: Array, start: Array, q: float) -> tuple[float, float, float]:
    """p(q): the end in the first bone's frame."""
    c, b = _ratio(start), _twist(start)
    along = lengths[1] * math.cos(q) + lengths[2] * math.cos((1.0 + c) * q)
    across = lengths[1] * math.sin(q) + lengths[2] * math.sin((1.0 + c) * q)
    return lengths[0] + math.cos(b) * along, math.sin(b) * along, -across


@njit(cache=True)
def _shape_of(lengths: Array, start: Array, low: float, high: float, target: Array) -> tuple[float, int]:
    """The q of low..high, where |p(q)| is monotone, that puts the end as far from the root as the target; and the
    Newton steps it took, -1 when there is none."""
    square = target[0] ** 2 + target[1] ** 2 + target[2] ** 2
    at_low, at_high = _excess(lengths, start, low, square), _excess(lengths, start, high, square)
    slack = 1e-15 * (lengths[0] + lengths[1] + lengths[2]) ** 2
    if abs(at_low) <= slack:
        return low, 0
    if abs(at_high) <= slack:
        return high, 0
    if (at_low > 0.0) == (at_high > 0.0):
        return low, -1
    # |p|^2 is nearly a parabola of q: begin where the parabola would cross.
    share = at_low / (at_low - at_high)
    q = low + (high - low) * (math.sqrt(share) if abs(low) < abs(high) else 1.0 - math.sqrt(1.0 - share))
    for step in range(1, 60):
        value = _excess(lengths, start, q, square)
        if abs(value) <= slack:
            return q, step
        if (value > 0.0) == (at_low > 0.0):
            low = q
        else:
            high = q
        slope = _slope(lengths, start, q)
        following = q - value / slope if slope != 0.0 else low
        q = following if low < following < high else 0.5 * (low + high)
        if high - low < 1e-15:
            break
    return q, step


@njit(cache=True)
def _excess(lengths: Array, start: Array, q: float, square: float) -> float:
    x, y, z = _end(lengths, start, q)
    return x * x + y * y + z * z - square


@njit(cache=True)
def _turn_root(angles: Array, start: Array, lengths: Array, limits: Array, target: Array, q: float,
               behind: bool) -> bool:
    """Fill `angles` so that p(q), turned about y and then z, points at `target`; whether they keep the limits.

    The turn about y alone brings it to the target's height z, before the root's axis or `behind` it.
    """
    x, y, z = _end(lengths, start, q)
    size = math.hypot(x, z)
    raised = math.asin(min(max(target[2] / max(size, 1e-300), -1.0), 1.0))
    if behind:
        raised = math.pi - raised
    shape = angles.shape[0] - 2
    if math.hypot(target[0], target[1]) > 1e-12 * size:
        angles[0] = wrap(math.atan2(target[1], target[0]) - math.atan2(y, size * math.cos(raised)))
    else:
        angles[0] = start[0]
    angles[1] = wrap(math.atan2(z, x) - raised)
    angles[shape], angles[shape + 1] = q, _ratio(start) * q
    for k in range(angles.shape[0]):
        if angles[k] < limits[k, 0] - SLACK or angles[k] > limits[k, 1] + SLACK:
            return False
    return True


@njit(cache=True)
def _nearest(angles: Array, start: Array, lengths: Array, limits: Array, target: Array, low: float,
             high: float) -> None:
    """Fill `angles` with those within the limits whose end is nearest to `target`, searched along q in low..high."""
    best, least, width = low, np.inf, (high - low) / (SAMPLES - 1)
    for sample in range(SAMPLES):
        missed = _aim(angles, start, lengths, limits, target, low + sample * width)
        if missed < least:
            best, least = low + sample * width, missed
    golden = 0.5 * (math.sqrt(5.0) - 1.0)
    left, right = max(low, best - width), min(high, best + width)
    a, b = right - golden * (right - left), left + golden * (right - left)
    at_a = _aim(angles, start, lengths, limits, target, a)
    at_b = _aim(angles, start, lengths, limits, target, b)
    for _ in range(SECTIONS):
        if at_a < at_b:
            right, b, at_b = b, a, at_a
            a = right - golden * (right - left)
            at_a = _aim(angles, start, lengths, limits, target, a)
        else:
            left, a, at_a = a, b, at_b
            b = left + golden * (right - left)
            at_b = _aim(angles, start, lengths, limits, target, b)
    q = a if at_a < at_b else b
    if least <= min(at_a, at_b):  # at an end of the range, where golden sections never arrive
        q = best
    _aim(angles, start, lengths, limits, target, q)


@njit(cache=True)
def _aim(angles: Array, start: Array, lengths: Array, limits: Array, target: Array, q: float) -> float:
    """Fill `angles` with the shape q, its root turned as near to `target` as the limits let it; returns the miss."""
    x, y, z = _end(lengths, start, q)
    shape = angles.shape[0] - 2
    assign(start, angles)
    angles[shape], angles[shape + 1] = q, min(max(_ratio(start) * q, limits[shape + 1, 0]), limits[shape + 1, 1])
    flat = math.hypot(target[0], target[1])
    azimuth = math.atan2(target[1], target[0]) if flat > 1e-12 else start[0]
    ahead = math.sqrt(max(flat * flat - y * y, 0.0))  # the target's place before the root's axis, or behind it
    best, least = start[0], np.inf
    for side in range(2):
        angles[0] = clamp_angle(azimuth - math.atan2(y, -ahead if side else ahead), limits[0, 0], limits[0, 1])
        missed = _flex_root(angles, lengths, limits, target, x, z)
        if missed < least:
            best, least = angles[0], missed
    angles[0] = best
    return _flex_root(angles, lengths, limits, target, x, z)


@njit(cache=True)
def _flex_root(angles: Array, lengths: Array, limits: Array, target: Array, x: float, z: float) -> float:
    """Turn the root about y until (x, ., z) points as near to `target` as the limits let it; returns the miss."""
    in_plane = math.cos(angles[0]) * target[0] + math.sin(angles[0]) * target[1]
    angles[1] = clamp_angle(math.atan2(z, x) - math.atan2(target[2], in_plane), limits[1, 0], limits[1, 1])
    return miss(angles, lengths, target)
