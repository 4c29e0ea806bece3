"""How large the hand is: learnt slowly, from many of its shapes, beside the filter.

One frame hardly shows a hand's size, and a filter that takes every frame for new evidence soon believes to know it. So
shapes of the hand are kept that differ from each other, each as all its markers were located at one instant; for each
of them the evidence for a grid of sizes is worked out once, one size per datagram; and all shapes together are the
evidence for the one size that they share. They are of one person, whose habits are not the natural pose's and who often
repeats a movement, so they count for less than as many independent ones.
"""

from __future__ import annotations

import math
from itertools import chain, combinations
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.hand.dh import DhArrays
from rhot_app.hand.kinematics import TWIST, forward_arrays, jacobian_arrays, move
from rhot_app.hand.limits import NaturalPose
from rhot_app.hand.linear import factorise, substitute
from rhot_app.hand.skeleton import ANGLES
from rhot_app.tracking.acquisition import Located

# -- What one instant's markers say of a hand's size: the evidence for a size, whatever the pose -----------------------
# A larger hand holds its markers in the same places when it bends its fingers more. How plausible that is, its pose
# says: by the natural pose, by the joints' limits, and by how much room there is for such poses. Fingers that are
# nearly stretched hold their tips near the farthest place that they reach, where many poses differ little; that all
# of them should end there by chance on a hand that is larger is not likely, and a smaller hand does not reach so far.
# So the evidence integrates over the pose (Laplace's method, MacKay 2003, chapter 27), about the most plausible one.

Array = NDArray[np.float64]

LIMIT_SD_RAD = math.radians(5.0)
"""Joints go beyond their published limits by as much: those are means over people."""

STEPS = 20
"""Of the descent at most; a pose found for a neighbouring size needs three or four."""

_STEP_RAD = 0.5
_SMALL_GAIN = 1e-4
_RETRIES = 6
_SIZE = TWIST + len(ANGLES)


class Posture(NamedTuple):
    """What holds of a hand in any pose. `dh`: its table with one point per marker; `limits` (21, 2) rad; `mean` (21,)
    rad and `information` (21, 21) 1/rad^2 of its angles without evidence."""

    dh: DhArrays
    limits: Array
    mean: Array
    information: Array


class Fitting(NamedTuple):
    """Normal equations of one pose: `matrix` (27, 27) and `right` (27,), the negative gradient."""

    matrix: Array
    right: Array


@njit(cache=True)
def implausibility(posture: Posture, places: Array, information: Array, log_scale: float, world: Array,
                   angles: Array) -> tuple[float, float]:
    """How implausible a hand exp(log_scale) times as large is: the negative logarithm of the evidence, but for a
    constant, and the part of it that is misfit and strain of the most plausible pose.

    `places` (M, 3) m, world, NaN for a marker that was not located; `information` (M, 3, 3) 1/m^2, the inverse of their
    covariances. The descent (Levenberg-Marquardt) starts from `world` (4, 4) and `angles` (21,) rad, which become the
    most plausible pose.
    """
    now = Fitting(np.empty((_SIZE, _SIZE)), np.empty(_SIZE))
    then = Fitting(np.empty((_SIZE, _SIZE)), np.empty(_SIZE))
    scale, factor, step = math.exp(log_scale), np.empty((_SIZE, _SIZE)), np.empty(_SIZE)
    trial_world, trial_angles = world.copy(), angles.copy()
    cost = linearise(posture, places, information, scale, world, angles, now)
    damping = 1e-4
    for _ in range(STEPS):
        before = cost
        for _ in range(_RETRIES):
            _factorise_damped(now.matrix, damping, factor)
            substitute(factor, now.right, step)
            step *= min(1.0, _STEP_RAD / max(np.abs(step[3:]).max(), 1e-9))
            move(world, angles, step, trial_world, trial_angles)
            trial = linearise(posture, places, information, scale, trial_world, trial_angles, then)
            if trial <= cost:
                cost, damping = trial, max(0.1 * damping, 1e-9)
                world[:], angles[:] = trial_world, trial_angles
                now.matrix[:], now.right[:] = then.matrix, then.right
                break
            damping = max(10.0 * damping, 1e-3)
        if before - cost < _SMALL_GAIN:
            break
    _factorise_damped(now.matrix, 0.0, factor)
    room = 0.0
    for i in range(_SIZE):
        room += math.log(factor[i, i])
    return cost + room, cost


@njit(cache=True)
def _factorise_damped(matrix: Array, damping: float, factor: Array) -> None:
    factor[:] = matrix
    for i in range(_SIZE):
        factor[i, i] *= 1.0 + damping
    factorise(factor)


@njit(cache=True)
def linearise(posture: Posture, places: Array, information: Array, scale: float, world: Array, angles: Array,
              fitting: Fitting) -> float:
    """Fill the normal equations of misfit and strain at one pose; returns half the sum of their squares. Arguments as
    in `implausibility`."""
    dh, matrix, right = posture.dh, fitting.matrix, fitting.right
    frames, points = np.empty((dh.parent.shape[0], 3, 4)), np.empty((dh.point_row.shape[0], 3))
    jacobian, weighed = np.empty((points.shape[0], 3, _SIZE)), np.empty(3)
    forward_arrays(dh, world, angles, frames, points)
    jacobian_arrays(dh, world, frames, points, jacobian)
    matrix[:], right[:] = 0.0, 0.0
    cost = _strain(posture, angles, matrix, right)
    off, used = np.empty(3), np.empty(_SIZE, np.int64)
    for m in range(points.shape[0]):
        if math.isnan(places[m, 0]):
            continue
        for i in range(3):
            off[i] = places[m, i] - world[i, 3] - scale * (points[m, i] - world[i, 3])
            for j in range(3, _SIZE):
                jacobian[m, i, j] *= scale
        count = _columns(jacobian[m], used)
        for a in range(count):
            column = used[a]
            for i in range(3):
                weighed[i] = 0.0
                for k in range(3):
                    weighed[i] += jacobian[m, k, column] * information[m, k, i]
            for i in range(3):
                right[column] += weighed[i] * off[i]
            for b in range(count):
                for i in range(3):
                    matrix[column, used[b]] += weighed[i] * jacobian[m, i, used[b]]
        for i in range(3):
            for k in range(3):
                cost += 0.5 * off[i] * information[m, i, k] * off[k]
    return cost


@njit(cache=True)
def _columns(jacobian: Array, used: NDArray[np.int64]) -> int:
    """Note the columns of a point's `jacobian` (3, 27) that are not zero; returns how many: ten of 27 for a tip."""
    count = 0
    for j in range(_SIZE):
        if jacobian[0, j] != 0.0 or jacobian[1, j] != 0.0 or jacobian[2, j] != 0.0:
            used[count] = j
            count += 1
    return count


@njit(cache=True)
def _strain(posture: Posture, angles: Array, matrix: Array, right: Array) -> float:
    """Add how far `angles` (21,) are from the natural pose and beyond their limits.

    A limit sets in softly, over its standard deviation: the evidence shall not jump where a joint meets its limit.
    """
    cost = 0.0
    for i in range(angles.shape[0]):
        pull = 0.0
        for j in range(angles.shape[0]):
            pull += posture.information[i, j] * (posture.mean[j] - angles[j])
            matrix[TWIST + i, TWIST + j] = posture.information[i, j]
        cost += 0.5 * pull * (posture.mean[i] - angles[i])
        right[TWIST + i] = pull
    for i in range(angles.shape[0]):
        for side in range(2):
            sign = 2.0 * side - 1.0
            beyond = sign * (angles[i] - posture.limits[i, side]) / LIMIT_SD_RAD
            root = math.sqrt(beyond * beyond + 1.0)
            soft, slope = 0.5 * (beyond + root), 0.5 * (1.0 + beyond / root) / LIMIT_SD_RAD
            cost += 0.5 * soft * soft
            right[TWIST + i] -= sign * slope * soft
            matrix[TWIST + i, TWIST + i] += slope * slope
    return cost


# -- How large the hand is: learnt slowly, from many of its shapes, beside the filter ----------------------------------

GRID = 0.0125 * np.arange(-24, 25)
"""(49,) logarithms of the scales that are weighed."""

USUAL_SD = 0.1
"""How far hands are from the size in their file, before anything is seen: standard deviation of the logarithm."""

LEAST_SD = 0.015
"""No size is known better: bones of hands of one length scatter by 3 to 8 %, so hands differ in proportion, and the one
size is a mean over fifteen bones."""

DISTINCT_M = 0.01
"""A shape is another when the distance of two markers differs by as much from every shape that is kept."""

SHARE, MOST = 0.25, 2.0
"""How much each shape counts, in independent ones, and all of them at most: habits are a person's own, and movements
return (`benchmarks/hand_size.py`)."""

UNFIT = 20.0
"""Least misfit and strain beyond which a shape is none of a hand of any size. Those of the twin have 0 to 10."""

KEPT = 48
LEAST_MARKERS = 5
FOLLOW_S = 2.0
"""The hand takes on another size with this time constant."""

_PLACE_SD_M = 5e-4
"""What is wrong with a located marker beside its noise, at the least."""

_LONGEST_S = 0.1
_ANEW_NS = 1_000_000_000
"""So far back in time begins another timeline."""


class HandSize:
    """The logarithm of a hand's scale, from what its markers show when it moves."""

    def __init__(self, dh: DhArrays, limits: Array, natural: NaturalPose, paint_variance: Array) -> None:
        """`dh`: the hand's table with M markers as points; `limits` (21, 2) rad; `paint_variance` (M,) m^2."""
        self._posture = Posture(dh, limits, natural.mean, natural.information)
        self._doubt = (paint_variance + _PLACE_SD_M**2)[:, None, None] * np.eye(3)
        self._pairs = np.array(list(combinations(range(len(paint_variance)), 2))).reshape(-1, 2).T
        self.reset()

    def reset(self) -> None:
        """Forget the hand."""
        self._shapes: list[Array] = []  # each (P,) m, distances of all pairs of markers
        self._curves: list[Array] = []  # each (49,), how implausible the grid's sizes are; zero where unfit
        self._in_work: _Curve | None = None
        self._aim, self._aim_variance = 0.0, USUAL_SD**2
        self._log_scale, self._t_ns = 0.0, 0

    @property
    def known(self) -> tuple[float, float]:
        """The logarithm of the scale and its variance; until it has followed, what it lags behind is doubt as well."""
        return self._log_scale, self._aim_variance + (self._aim - self._log_scale) ** 2

    @property
    def scale(self) -> float:
        """The factor on every length that is best known, followed or not."""
        return math.exp(self._aim)

    def settle(self) -> None:
        """A hand that begins anew need not follow."""
        self._log_scale = self._aim

    def follow(self, t_ns: int) -> tuple[float, float]:
        """`known` at `t_ns`, master ns, a while later; cameras that take turns are not always in the order of time."""
        if not 0 <= self._t_ns - t_ns < _ANEW_NS:
            dt = min(max(1e-9 * (t_ns - self._t_ns), 0.0), _LONGEST_S)
            self._log_scale += (self._aim - self._log_scale) * -math.expm1(-dt / FOLLOW_S)
            self._t_ns = t_ns
        return self.known

    def look(self, located: Located, world: Array, angles: Array) -> None:
        """Keep the hand's shape if it is a new one; it may be as `world` (4, 4) m and `angles` (21,) rad say."""
        if self._in_work is not None or np.count_nonzero(located.clear) < LEAST_MARKERS:
            return
        places = np.where(located.clear[:, None], located.positions, np.nan)
        shape = np.linalg.norm(places[self._pairs[0]] - places[self._pairs[1]], axis=1)
        if all(np.nanmax(np.abs(shape - other), initial=0.0) > DISTINCT_M for other in self._shapes):
            self._shapes = [*self._shapes[1 - KEPT:], shape]
            information = np.asarray(np.linalg.inv(located.covariances + self._doubt), dtype=np.float64)
            self._in_work = _Curve(self._posture, places, information, world, angles, self._log_scale)

    def work(self) -> None:
        """Weigh one size of the shape in work; conclude when all are weighed."""
        curve = self._in_work
        if curve is not None and curve.step():
            self._curves = [*self._curves[1 - KEPT:], curve.values if curve.least <= UNFIT else np.zeros(len(GRID))]
            self._in_work = None
            self._conclude()

    def _conclude(self) -> None:
        """Mean and standard deviation of the size by all shapes."""
        counted = [curve for curve in self._curves if curve.any()]
        if not counted:
            return
        weight = min(SHARE * len(counted), MOST)
        total = weight * np.mean(counted, axis=0) + 0.5 * np.square(GRID / USUAL_SD)
        likely = np.exp(total.min() - total)
        likely /= likely.sum()
        self._aim = float(likely @ GRID)
        self._aim_variance = float(likely @ np.square(GRID - self._aim)) + LEAST_SD**2


class _Curve:
    """How implausible the sizes of the grid are for one shape: from the nearest size upwards, then downwards, each from
    its neighbour's pose."""

    def __init__(self, posture: Posture, places: Array, information: Array, world: Array, angles: Array,
                 log_scale: float) -> None:
        self.values, self.least = np.zeros(len(GRID)), math.inf
        self._shape = posture, places, information
        self._start = self._pose = world.copy(), angles.copy()
        self._first = int(np.argmin(np.abs(GRID - log_scale)))
        self._order = chain(range(self._first, len(GRID)), range(self._first - 1, -1, -1))
        self._left = len(GRID)

    def step(self) -> bool:
        """Weigh the next size; returns whether it was the last one."""
        k = next(self._order)
        if k == self._first - 1:
            self._pose = self._start
        self.values[k], misfit = implausibility(*self._shape, GRID[k], *self._pose)
        if k == self._first:
            self._start = self._pose[0].copy(), self._pose[1].copy()
        self.least = min(self.least, misfit)
        self._left -= 1
        return self._left == 0
