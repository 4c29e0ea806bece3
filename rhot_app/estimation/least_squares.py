"""Least squares: Levenberg-Marquardt (Marquardt 1963) on any normal equations, and robust linear fits.

`minimise` knows damping and the stop rule only. An `Iterate` holds a state, its cost and its damped step; `Dense` is
that of a few unknowns and robust residuals. Sparse and reduced systems bring their own.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Generic, Protocol, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from rhot_app.estimation.quantiles import chi_squared
from rhot_app.estimation.residual import Kernel, Rows, stack

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
