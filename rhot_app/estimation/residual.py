"""What an estimator asks of a residual and of a process, and the robust kernels.

A residual is one observation kind at one instant: a marker in an image, an edge, a landmark, a contact. It linearises
itself at any state. The solver sees only rows. (The contract follows the tasks of mink, Zakka 2024.)
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


_GAUSSIAN, _STUDENT = range(2)


@dataclass(frozen=True, slots=True)
class Kernel:
    """Robust weight of an observation of `d` rows with squared Mahalanobis distance `m`; see `student`.

    `kind`: 0 weighs every observation by 1, 1 is Student's.
    """

    kind: int = _GAUSSIAN
    parameter: float = 0.0

    def weights(self, squared: Array, rows: Array) -> Array:
        """(G,) in (0, 1] for G observations of `rows` (G,) rows and Mahalanobis distances `squared` (G,)."""
        return np.array([_weight(self.kind, self.parameter, m, d) for m, d in zip(squared, rows, strict=True)])

    def cost(self, squared: Array, rows: Array) -> float:
        """Sum of -2 log likelihoods of G observations, up to a constant."""
        return float(sum(_cost(self.kind, self.parameter, m, d) for m, d in zip(squared, rows, strict=True)))


GAUSSIAN = Kernel()


def student(nu: float = 4.0) -> Kernel:
    """Weight (nu + d) / (nu + m), of Student's t with `nu` degrees of freedom (Lange, Little and Taylor 1989)."""
    return Kernel(_STUDENT, nu)


UNIT = np.ones(())


@dataclass(frozen=True, slots=True)
class Rows:
    """A residual linearised at a state: K rows, n numbers of the tangent space.

    `error` (K,): observed minus predicted. `jacobian` (K, n): of the predicted value by the state's tangent. `noise`:
    (K,) variances or a (K, K) covariance; UNIT where the rows are whitened. `first` (G,): the first row of each of G
    observations, which the kernel weighs one by one; None: every row is an observation of its own.
    """

    error: Array
    jacobian: Array
    noise: Array
    kernel: Kernel = GAUSSIAN
    first: Indices | None = None


class Residual(Protocol):
    """One observation kind at one instant."""

    def linearise(self, state: Array) -> Rows:
        """The rows at `state`. Any number, also none."""
        ...


class Process(Protocol):
    """How a state moves. A state is a flat array; its tangent space has `size` numbers."""

    size: int

    def retract(self, state: Array, step: Array) -> Array:
        """The state moved by `step` (n,) of its tangent space."""
        ...

    def difference(self, state: Array, origin: Array) -> Array:
        """(n,) the step from `origin` to `state`."""
        ...

    def predict(self, state: Array, covariance: Array, dt_s: float) -> tuple[Array, Array]:
        """State and covariance (n, n) after `dt_s` >= 0, as new arrays."""
        ...

    def transition(self, state: Array, dt_s: float) -> Array:
        """(n, n) Jacobian of `predict`'s state by `state`."""
        ...


@njit(cache=True)
def compressed(information, pull, cost, ridge):
    """Whitened errors (P + 1,) and their Jacobian (P + 1, P) that have an `information` (P, P), of which the lower
    triangle is read, a gradient `pull` (P,) and a cost in all; the last row has the rest of the cost. `ridge`: the
    information of what no observation shows. Raises LinAlgError: the information is not positive definite or finite."""
    count = len(pull)
    root = np.linalg.cholesky(information + ridge * np.eye(count))
    error, jacobian = np.zeros(count + 1), np.zeros((count + 1, count))
    for row in range(count):
        left = pull[row]
        for column in range(row):
            left -= root[row, column] * error[column]
        error[row] = left / root[row, row]
        cost -= error[row] ** 2
        jacobian[:row + 1, row] = root[row, :row + 1]
    if not np.isfinite(cost):
        raise np.linalg.LinAlgError("the information is not finite")
    error[count] = math.sqrt(max(cost, 0.0))
    return error, jacobian


def stack(rows: Sequence[Rows], size: int, weigh: bool) -> tuple[Array, Array, Array, float, Array]:
    """All rows whitened: error (K,), jacobian (K, n), variances (K,), the robust cost, and the weights (G,).

    The noise of every row is 1 before its robust weight; `weigh` False leaves all weights at 1.
    """
    errors, jacobians, variances, weights, cost = [], [], [], [], 0.0
    for one in rows:
        if not len(one.error):
            continue
        if one.noise.ndim == 0:
            error, jacobian = one.error, one.jacobian
        elif one.noise.ndim == 1:
            scale = 1.0 / np.sqrt(one.noise)
            error, jacobian = one.error * scale, one.jacobian * scale[:, None]
        else:
            lower = np.linalg.cholesky(one.noise)
            error, jacobian = np.linalg.solve(lower, one.error), np.linalg.solve(lower, one.jacobian)
        first = np.arange(len(error)) if one.first is None else one.first
        variance, weight = np.empty(len(error)), np.empty(len(first))
        cost += _weigh(one.kernel.kind, one.kernel.parameter, weigh, error, first, variance, weight)
        errors.append(error)
        jacobians.append(jacobian)
        variances.append(variance)
        weights.append(weight)
    if not errors:
        return np.empty(0), np.empty((0, size)), np.empty(0), 0.0, np.empty(0)
    if len(errors) == 1:
        return errors[0], jacobians[0], variances[0], cost, weights[0]
    return (np.concatenate(errors), np.concatenate(jacobians), np.concatenate(variances), cost,
            np.concatenate(weights))


@njit(cache=True)
def _weight(kind: int, parameter: float, squared: float, rows: float) -> float:
    if kind == _STUDENT:
        return min(1.0, (parameter + rows) / (parameter + squared))
    return 1.0


@njit(cache=True)
def _cost(kind: int, parameter: float, squared: float, rows: float) -> float:
    if kind == _STUDENT:
        return (parameter + rows) * math.log(1.0 + squared / parameter)
    return squared


@njit(cache=True)
def _weigh(kind: int, parameter: float, weigh: bool, error: Array, first: Indices, variances: Array, weights: Array
           ) -> float:
    """Fill the variances (K,) and weights (G,) of whitened rows, 1 without `weigh`; returns their cost."""
    cost, count = 0.0, first.shape[0]
    for g in range(count):
        end = first[g + 1] if g + 1 < count else error.shape[0]
        squared, rows = 0.0, float(end - first[g])
        for k in range(first[g], end):
            squared += error[k] * error[k]
        cost += _cost(kind, parameter, squared, rows)
        weights[g] = _weight(kind, parameter, squared, rows) if weigh else 1.0
        for k in range(first[g], end):
            variances[k] = 1.0 / weights[g]
    return cost
