"""How large the hand is: learnt slowly, from many of its shapes, beside the filter.

One frame hardly shows a hand's size, and a filter that takes every frame for new evidence soon becomes overconfident.
So shapes of the hand are kept that differ from each other, each as all its markers were located at one instant. For
each of them the evidence for a grid of sizes is worked out once, one size per datagram. All shapes together are the
evidence for the one size that they share. They are of one person, whose mean pose is not the prior's and who often
repeats a movement, so they count for less than as many independent ones.

A larger hand holds its markers in the same places when it bends its fingers more. How plausible that is, its pose says:
by the natural pose, by the joints' limits, and by how much room there is for such poses. Fingers that are nearly
stretched hold their tips near the farthest place that they reach, where many poses differ little; that all of them
should end there by chance on a hand that is larger is not likely, and a smaller hand does not reach so far. So the
evidence integrates over the pose (Laplace's method, MacKay 2003, chapter 27), about the most plausible one.
"""

from __future__ import annotations

import math
from itertools import chain, combinations
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.estimation.least_squares import Stop, descend
from rhot_app.estimation.linear import factorise
from rhot_app.estimation.track import comes_late
from rhot_app.hand.dh import DhArrays
from rhot_app.hand.limits import PERSON_LIMIT_SD_RAD, PosePrior
from rhot_app.hand.solvers.pose_descent import SIZE, WORLD, PoseProblem, linearise_pose, pose_state
from rhot_app.tracking.locate import Located
from rhot_app.tracking.markers.marker_model import LEAST_SIZE_SD, USUAL_SIZE_SD

Array = NDArray[np.float64]

GRID = 0.0125 * np.arange(-24, 25)
"""(49,) logarithms of the scales that are weighed."""

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


class HandSize:
    """The logarithm of a hand's scale, from what its markers show when it moves."""

    def __init__(self, dh: DhArrays, limits: Array, pose_prior: PosePrior, paint_variance: Array) -> None:
        """`dh`: the hand's table with M markers as points; `limits` (21, 2) rad; `paint_variance` (M,) m^2."""
        self._posture = Posture(dh, limits, pose_prior.mean, pose_prior.information)
        self._doubt = (paint_variance + _PLACE_SD_M**2)[:, None, None] * np.eye(3)
        self._pairs = np.array(list(combinations(range(len(paint_variance)), 2))).reshape(-1, 2).T
        self.reset()

    def reset(self) -> None:
        """Forget the hand."""
        self._shapes: list[Array] = []  # each (P,) m, distances of all pairs of markers
        self._curves: list[Array] = []  # each (49,), how implausible the grid's sizes are; zero where unfit
        self._in_work: _Curve | None = None
        self._aim, self._aim_variance = 0.0, USUAL_SIZE_SD**2
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
        if not comes_late(t_ns, self._t_ns):
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
        total = weight * np.mean(counted, axis=0) + 0.5 * np.square(GRID / USUAL_SIZE_SD)
        likely = np.exp(total.min() - total)
        likely /= likely.sum()
        self._aim = float(likely @ GRID)
        self._aim_variance = float(likely @ np.square(GRID - self._aim)) + LEAST_SIZE_SD**2


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


# -- the evidence of one instant's markers -----------------------------------------------------------------------------

STOP = Stop(20, 1e-5, 1e-6, 0.0)
"""Of the descent; a pose found for a neighbouring size needs three or four steps."""


class Posture(NamedTuple):
    """What holds of a hand in any pose. `dh`: its table with one point per marker; `limits` (21, 2) rad; `mean` (21,)
    rad and `information` (21, 21) 1/rad^2 of its angles without evidence."""

    dh: DhArrays
    limits: Array
    mean: Array
    information: Array


@njit(cache=True)
def implausibility(posture: Posture, places: Array, information: Array, log_scale: float, world: Array,
                   angles: Array) -> tuple[float, float]:
    """How implausible a hand exp(log_scale) times as large is: the negative logarithm of the evidence, but for a
    constant, and the part of it that is misfit and strain of the most plausible pose.

    `places` (M, 3) m, world, NaN for a marker that was not located; `information` (M, 3, 3) 1/m^2, the inverse of their
    covariances. The descent (Levenberg-Marquardt) starts from `world` (4, 4) and `angles` (21,) rad, which become the
    most plausible pose.
    """
    problem = pose_problem(posture, places, information, math.exp(log_scale))
    state = pose_state(world, angles)
    descend(problem, state, int(SIZE), STOP)
    world[:3], angles[:] = state[:WORLD].reshape(3, 4), state[WORLD:]
    matrix, room = np.empty((SIZE, SIZE)), 0.0
    cost = linearise_pose(problem, state, matrix, np.empty(SIZE), np.empty(SIZE), np.empty(SIZE))
    factorise(matrix)
    for i in range(SIZE):
        room += math.log(matrix[i, i])
    return cost + room, cost


@njit(cache=True)
def pose_problem(posture: Posture, places: Array, information: Array, scale: float) -> PoseProblem:
    """That of a hand `scale` times as large, its limits a person's. Arguments as in `implausibility`."""
    return PoseProblem(posture.dh, posture.limits, posture.mean, posture.information, places, information, scale,
                       PERSON_LIMIT_SD_RAD, np.zeros(WORLD + posture.mean.shape[0]), np.zeros(SIZE))
