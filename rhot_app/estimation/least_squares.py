"""Least squares: Levenberg-Marquardt (Marquardt 1963) on any normal equations, and robust linear fits.

`minimise` knows damping and the stop rule only. An `Iterate` holds a state, its cost and its damped step; `Dense` is
that of a few unknowns and robust residuals. Sparse and reduced systems bring their own.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any, Generic, NamedTuple, Protocol, Self, TypeVar

import numpy as np
from numba import njit
from numba.extending import overload
from numpy.typing import NDArray

from rhot_app.estimation.linear import solve_in_box
from rhot_app.estimation.quantiles import chi_squared
from rhot_app.estimation.residual import Kernel, Rows, stack
from rhot_app.estimation.se3 import retract

Array = NDArray[np.float64]

DAMPING = 1e-4
"""Of the first step, as a part of the normal equations' diagonal."""

LEAST_DAMPING, GREATEST_DAMPING = 1e-12, 1e12
"""Above the first a singular system can be solved in double precision; at the second a step is nothing."""

TENFOLD = 10.0
"""Damping falls and rises by this factor (Marquardt 1963)."""

State = TypeVar("State")


class Iterate(Protocol):
    """A state with its cost, from which a damped step leads to the next one."""

    @property
    def cost(self) -> float:
        """What is minimised; infinite where the state is impossible."""
        ...

    def moved(self, damping: float) -> Self:
        """The iterate after one step, the normal equations' diagonal raised by `damping` times itself."""
        ...


AnyIterate = TypeVar("AnyIterate", bound=Iterate)


def minimise(start: AnyIterate, steps: int, least_gain: float, damping: float = DAMPING,
             watch: Callable[[int], None] = lambda taken: None) -> tuple[AnyIterate, int]:
    """The nearest minimum, and the number of steps taken.

    It ends after `steps`, or with the step that lowers the cost by less than `least_gain`, or when no damping lowers
    it. `watch` is called with the steps taken before each.
    """
    here = start
    for taken in range(steps):
        watch(taken)
        while not (there := here.moved(damping)).cost <= here.cost:
            damping = max(TENFOLD * damping, TENFOLD * LEAST_DAMPING)
            if damping > GREATEST_DAMPING:
                return here, taken
        gain, here = here.cost - there.cost, there
        damping = max(damping / TENFOLD, LEAST_DAMPING)
        if gain < least_gain:
            return here, taken + 1
    return here, steps


class Dense(Generic[State]):
    """Implements `Iterate` for residuals whose Jacobian by a tangent space of `size` numbers is dense.

    `rows(state)`: the linearised residuals; None where the state is impossible. `retract(state, step)`: the state moved
    by `step` (n,). `cost` is -2 log likelihood, up to a constant.
    """

    def __init__(self, state: State, rows: Callable[[State], Sequence[Rows] | None],
                 retract: Callable[[State, Array], State], size: int) -> None:
        self.state, self._rows, self._retract, self._size = state, rows, retract, size
        self.rows = rows(state)
        self.normal, self._side, self.cost = np.eye(size), np.zeros(size), np.inf
        if self.rows is not None:
            error, jacobian, variances, self.cost, _ = stack(self.rows, size, weigh=True)
            weighted = jacobian / variances[:, None]
            self.normal, self._side = weighted.T @ jacobian, weighted.T @ error

    def moved(self, damping: float) -> Dense[State]:
        """The iterate after a damped step."""
        scale, values, axes = self._spectrum
        step = axes @ (axes.T @ (self._side / scale) / (values + damping)) / scale
        return Dense(self._retract(self.state, step), self._rows, self._retract, self._size)

    @cached_property
    def _spectrum(self) -> tuple[Array, Array, Array]:
        """Scale (n,) of the unknowns that makes the normal matrix' diagonal 1, its eigenvalues then, and their axes."""
        diagonal = np.diag(self.normal)
        scale = np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
        values, axes = np.linalg.eigh(self.normal / np.outer(scale, scale))
        return scale, np.maximum(values, 0.0), axes

    def covariance(self) -> Array | None:
        """(n, n) of the state; None where the residuals do not determine it."""
        try:
            covariance = np.linalg.inv(self.normal)
            np.linalg.cholesky(covariance)
        except np.linalg.LinAlgError:
            return None
        return np.asarray(0.5 * (covariance + covariance.T))


def fit_linear(columns: Array, target: Array, kernel: Kernel, rounds: int, rcond: float,
               least_sd: float = 0.0) -> tuple[Array, Array]:
    """Iteratively reweighted least squares (Beaton and Tukey 1974): `columns` (N, d, n) times the solution is `target`
    (N, d).

    `kernel` weighs each of the N by its distance in standard deviations, which the median distance shows; `least_sd`
    is the smallest. Singular values below `rcond` of the largest count as 0. Returns the solution (n,) and the weights.
    """
    dimension = np.full(len(target), float(target.shape[1]))
    weights, solution = np.ones(len(target)), np.zeros(columns.shape[2])
    for _ in range(rounds):
        root = np.sqrt(weights)[:, None]
        solution = np.asarray(np.linalg.lstsq((columns * root[:, :, None]).reshape(-1, len(solution)),
                                              (target * root).ravel(), rcond=rcond)[0], np.float64)
        squared = np.sum((target - columns @ solution) ** 2, axis=1)
        variance = max(least_sd**2, float(np.median(squared)) / float(chi_squared(0.5, target.shape[1])), 1e-18)
        weights = kernel.weights(squared / variance, dimension)
    return solution, weights


# -- compiled, within a box --------------------------------------------------------------------------------------------

class Stop(NamedTuple):
    """When a compiled descent ends: after `steps`; at a cost of `enough`; or with a step that is shorter than `still`
    in every number, or that lowers the cost, or by the quadratic model would lower it (the Newton decrement; Boyd and
    Vandenberghe 2004, 9.5.1), by less than `gain` times one plus the cost."""

    steps: int
    gain: float
    still: float
    enough: float


def linearised(problem: Any, state: Array, matrix: Array, right: Array, low: Array, high: Array) -> float:
    """The cost of a compiled problem at `state`. Fills the Gauss-Newton `matrix` H (n, n), the negative gradient
    `right` (n,) and the bounds `low` and `high` (n,) of a step. Each record of a problem has its own (`implements`)."""
    raise NotImplementedError


def implements(record: type, compiled: Any) -> None:
    """Let `linearised` of a `record`, a NamedTuple, be a compiled function of the same arguments. (A function cannot be
    an argument of a compiled one that is kept on disk.)"""
    @overload(linearised, strict=False, inline="always")
    def _of_record(problem: Any, state: Any, matrix: Any, right: Any, low: Any, high: Any) -> Any:
        if getattr(problem, "instance_class", None) is not record:
            return None
        return lambda problem, state, matrix, right, low, high: compiled(problem, state, matrix, right, low, high)


@njit  # kept on disk with its callers: an index of its own would name records that may move
def descend(problem: Any, state: Array, size: int, stop: Stop) -> tuple[float, int, bool]:
    """(H + damping diag H) step = -gradient, low <= step <= high: `minimise`, compiled, in place on `state`.

    `problem`: a record that implements `linearised`; `state`: a vector of `size` numbers, or a pose and more
    (`estimation.se3`) with as many in its tangent space. Returns the cost, the steps taken, and whether it ended before
    they were used up.
    """
    matrix, vectors = np.empty((3, size, size)), np.empty((7, size))
    damped, step, here, damping = matrix[2], vectors[6], 0, DAMPING
    cost = linearised(problem, state, matrix[0], vectors[0], vectors[2], vectors[3])
    for taken in range(stop.steps):
        if cost <= stop.enough:
            return cost, taken, True
        right, low, high, there = vectors[here], vectors[2 + 2 * here], vectors[3 + 2 * here], 1 - here
        while True:
            _damp(matrix[here], damping, damped)
            solve_in_box(damped, right, low, high, step)
            trial = retract(state, step) if len(state) > size else state + step
            gain, longest = _promise(matrix[here], right, step)
            if 0.0 <= gain < stop.gain * (1.0 + cost) or (math.isfinite(gain) and longest < stop.still):
                state[:] = trial
                return cost - gain, taken + 1, True
            trial_cost = linearised(problem, trial, matrix[there], vectors[there], vectors[2 + 2 * there],
                                    vectors[3 + 2 * there])
            if trial_cost <= cost:
                break
            damping = max(TENFOLD * damping, DAMPING)
            if damping > GREATEST_DAMPING:
                return cost, taken, True
        state[:], gain, cost, here = trial, cost - trial_cost, trial_cost, there
        damping = max(damping / TENFOLD, LEAST_DAMPING)
        if gain < stop.gain * (1.0 + cost):
            return cost, taken + 1, True
    return cost, stop.steps, False


@njit(cache=True)
def _damp(matrix: Array, damping: float, damped: Array) -> None:
    """Fill `damped` (n, n); a number that shows in no residual is damped by the mean."""
    size, mean = matrix.shape[0], 0.0
    for i in range(size):
        mean += matrix[i, i] / size
        for j in range(size):
            damped[i, j] = matrix[i, j]
    for i in range(size):
        damped[i, i] += damping * max(matrix[i, i], DAMPING * mean)


@njit(cache=True)
def _promise(matrix: Array, right: Array, step: Array) -> tuple[float, float]:
    """By how much the quadratic model falls over a step, and the step's largest number."""
    gain, longest = 0.0, 0.0
    for i in range(step.shape[0]):
        slope = right[i]
        for j in range(step.shape[0]):
            slope -= 0.5 * matrix[i, j] * step[j]
        gain += step[i] * slope
        longest = max(longest, abs(step[i]))
    return gain, longest
