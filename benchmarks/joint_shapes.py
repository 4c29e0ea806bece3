"""How far a joint of two angles may turn: a hinge, a box, an elliptic cone, or a parabola (Aristidou and Lasenby 2011).

A bone's frame has x along it, and turns out of its parent's by an abduction about z, then a flexion about y. A cone
bounds the direction of the bone, whatever its angles: the quarters of an ellipse over the swing, its flexing part and
its sideways part, so that equal bounds make a circular cone. (The paper draws the ellipse on a plane across the bone,
where 90 degrees are infinitely far.) A parabola bounds the two angles themselves and narrows the abduction to nothing
as the joint bends to its end: what a knuckle does, and what RHOT 7.4 misses in its framework.
"""

from __future__ import annotations

import math
from dataclasses import replace
from enum import IntEnum

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.hand.limits import clamp_angle
from rhot_app.hand.skeleton import ANGLE_SLICES, FINGERS
from rhot_app.hand.solvers.finger_chain import fold_abduction
from rhot_app.hand.solvers.methods import Problem

Array = NDArray[np.float64]


class Shape(IntEnum):
    """Which pairs of abduction and flexion a joint allows within their bounds."""

    HINGE = 0
    BOX = 1
    CONE = 2
    PARABOLA = 3


HINGE, BOX, CONE, PARABOLA = (int(shape) for shape in Shape)

THIN = 1e-9
"""A bound nearer to the axis than this, rad, is on it."""


@njit(cache=True)
def swing(abduction: float, flexion: float) -> tuple[float, float]:
    """The turn that takes the parent's axis straight to the bone, rad: its part sideways and its part in flexion."""
    sideways, down = math.sin(abduction) * math.cos(flexion), math.sin(flexion)
    across = math.hypot(sideways, down)
    if across < 1e-300:
        return 0.0, 0.0
    angle = math.atan2(across, math.cos(abduction) * math.cos(flexion))
    return angle * sideways / across, angle * down / across


@njit(cache=True)
def unswing(sideways: float, down: float, abduction: float) -> tuple[float, float]:
    """Abduction and flexion of a bone from its swing; `abduction` is kept where the bone shows none."""
    angle = math.hypot(sideways, down)
    share = math.sin(angle) / angle if angle > 1e-12 else 1.0
    return direction_angles(math.cos(angle), share * sideways, -share * down, abduction)


@njit(cache=True)
def direction_angles(x: float, y: float, z: float, abduction: float) -> tuple[float, float]:
    """Abduction, within -90..90 degrees, and flexion of a bone along (x, y, z) in its parent's frame."""
    if math.hypot(x, y) > 1e-12 * (abs(x) + abs(y) + abs(z)):
        abduction = math.atan2(y, x) if x > 0.0 else math.atan2(-y, -x)
    return abduction, math.atan2(-z, math.cos(abduction) * x + math.sin(abduction) * y)


@njit(cache=True)
def excess(shape: int, bounds: Array, abduction: float, flexion: float) -> float:
    """How far two angles are outside a CONE or PARABOLA: up to 1 is within; `bounds` (2, 2) of both, low and high."""
    if shape == CONE:
        abduction, flexion = swing(abduction, flexion)
    across = _share(abduction, bounds[0])
    along = _share(flexion, bounds[1])
    return across ** 2 + (along ** 2 if shape == CONE else along)


@njit(cache=True)
def _share(angle: float, bound: Array) -> float:
    """The part of its range, from 0 to the bound on its side, that an angle takes."""
    if abs(angle) < THIN:
        return 0.0
    return abs(angle) / max(bound[1] if angle > 0.0 else -bound[0], THIN)


@njit(cache=True)
def clamp_joint(shape: int, bounds: Array, abduction: float, flexion: float) -> tuple[float, float]:
    """The allowed angles nearest to two others; `bounds` (2, 2) of abduction and flexion, low and high.

    For a CONE that is the nearest swing. Cones and parabolas have the parent's axis within their bounds.
    """
    if shape == HINGE:
        return 0.0, clamp_angle(flexion, bounds[1, 0], bounds[1, 1])
    if shape == BOX:
        return clamp_angle(abduction, bounds[0, 0], bounds[0, 1]), clamp_angle(flexion, bounds[1, 0], bounds[1, 1])
    if excess(shape, bounds, abduction, flexion) <= 1.0:
        return abduction, flexion
    if shape == PARABOLA:
        return _nearest(shape, bounds, abduction, flexion)
    across, along = swing(abduction, flexion)
    across, along = _nearest(shape, bounds, across, along)
    return unswing(across, along, abduction)


@njit(cache=True)
def _nearest(shape: int, bounds: Array, across: float, along: float) -> tuple[float, float]:
    """The point of the border nearest to (across, along) outside it.

    On the ellipse (a / A)^2 + (f / F)^2 = 1 it is (a0 A^2 / (A^2 + t), f0 F^2 / (F^2 + t)), on the parabola
    (a / A)^2 + f / F = 1 it is (a0 A^2 / (A^2 + t), f0 - t / (2 F)), where t > 0 makes it lie there: the left side
    falls and is convex in t, so that Newton's steps from the left never overshoot.
    """
    width = bounds[0, 1] if across > 0.0 else -bounds[0, 0]
    height = bounds[1, 1] if along > 0.0 else -bounds[1, 0]
    a, f = abs(across), abs(along)
    if height < THIN:  # no room on this side of the axis
        return math.copysign(min(a, width), across), 0.0
    if width < THIN:
        return 0.0, math.copysign(min(f, height), along)
    t = max(width * (a - width), 0.0)
    if shape == CONE:
        t = max(t, height * (f - height))
    elif a <= 0.0:
        return 0.0, math.copysign(height, along)
    for _ in range(60):
        wide, high = width * a / (width ** 2 + t), height * f / (height ** 2 + t)
        if shape == CONE:
            value = wide ** 2 + high ** 2 - 1.0
            slope = -2.0 * (wide ** 2 / (width ** 2 + t) + high ** 2 / (height ** 2 + t))
        else:
            value = wide ** 2 + (f - 0.5 * t / height) / height - 1.0
            slope = -2.0 * wide ** 2 / (width ** 2 + t) - 0.5 / height ** 2
        t -= value / slope
        if value < 1e-12:
            break
    wide = min(a * width ** 2 / (width ** 2 + t), width)
    # The last rounding is taken inwards, along the axis that the border is solved for.
    rest = 1.0 - (wide / width) ** 2
    high = height * (math.sqrt(max(rest, 0.0)) if shape == CONE else max(rest, 0.0))
    return math.copysign(wide, across), math.copysign(high, along)


@njit(cache=True)
def slice_flexion(shape: int, bounds: Array, abduction: float) -> tuple[float, float]:
    """The flexions, low and high, that a joint allows at one `abduction` within its bounds."""
    if shape in (HINGE, BOX):
        return bounds[1, 0], bounds[1, 1]
    if shape == PARABOLA:
        rest = max(1.0 - _share(abduction, bounds[0]) ** 2, 0.0)
        return rest * bounds[1, 0], rest * bounds[1, 1]
    return _edge(bounds, abduction, bounds[1, 0]), _edge(bounds, abduction, bounds[1, 1])


@njit(cache=True)
def _edge(bounds: Array, abduction: float, far: float) -> float:
    """The flexion between 0 and `far` at which a bone of this abduction leaves its cone."""
    if excess(CONE, bounds, abduction, far) <= 1.0:
        return far
    inside, outside = 0.0, far
    for _ in range(40):
        middle = 0.5 * (inside + outside)
        if excess(CONE, bounds, abduction, middle) <= 1.0:
            inside = middle
        else:
            outside = middle
    return inside


# -- cones and parabolas for solvers of box limits ---------------------------------------------------------------------
# A finger bends in one plane through its abduction axis, so its target alone says how far it is abducted. What a cone
# or parabola then leaves of the flexion is a range again.

ON_AXIS = 1e-9
"""A target nearer to the abduction axis than this, m, does not show the finger's plane: the start's stands."""


def shape_knuckles(problem: Problem, shape: Shape) -> Problem:
    """The same problem with the limits of the four fingers' MCP joints as a CONE or PARABOLA instead of a box.

    The abduction is held where the target shows it, or at the end of its range. The thumb keeps its boxes.
    Raises ValueError when a range leaves out the joint's own axis, where neither shape has a middle.
    """
    limits = problem.limits.copy()
    for finger in range(1, len(FINGERS)):
        rows, target = ANGLE_SLICES[finger], problem.targets[finger]
        bounds = problem.limits[rows][:2]
        if (bounds[:, 0] > 0.0).any() or (bounds[:, 1] < 0.0).any():
            raise ValueError(f"the {FINGERS[finger]} finger's MCP limits leave out its straight pose")
        if not np.isfinite(target).all():
            continue
        shown = fold_abduction(target[0], target[1], ON_AXIS, problem.start[rows][0])
        abduction = min(max(shown, bounds[0, 0]), bounds[0, 1])
        limits[rows.start] = abduction
        limits[rows.start + 1] = slice_flexion(int(shape), bounds, abduction)
    return replace(problem, limits=limits)
