"""An iterated extended Kalman filter on a manifold, with a buffer for out-of-sequence observations.

At every observation time the state is the minimum of the prior and all residuals, found by Gauss-Newton steps (Bell and
Cathey 1993). Observations that arrive late are put in their place, and the knots after them are solved again.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from rhot_app.estimation.linear import substitute
from rhot_app.estimation.residual import Process, Residual, stack

Array = NDArray[np.float64]
Estimate = tuple[Array, Array]
"""A state and its covariance."""

Indices = NDArray[np.int64]

ITERATIONS = 3
"""Gauss-Newton steps of an update, at most."""

CONVERGED = 1e-2
"""Standard deviations of the prior: a shorter last step changes nothing that matters."""

KNOTS = 12
"""Knots kept for observations that arrive late."""


@dataclass(frozen=True, slots=True)
class Partial:
    """Numbers `columns` (P,) of the tangent space that an update moves by `share` of their step only.

    Their errors are taken as new in every update, but last longer than one. With a share of 0 they are considered, not
    estimated (Schmidt 1966); between, see Brink 2017, "Partial-update Schmidt-Kalman filter", eq. 15 to 19.
    """

    columns: Indices
    share: float = 0.0


ALL = Partial(np.empty(0, np.int64))


@dataclass(slots=True)
class Knot:
    """One instant, s: the estimate after its `residuals`, and the `weights` (G,) that the kernels gave to their
    observations in the last step. `label`: the caller's own."""

    t_s: float
    state: Array
    covariance: Array
    residuals: list[Residual] = field(default_factory=list)
    weights: Array = field(default_factory=lambda: np.empty(0))
    label: Any = None


def refined(process: Process, t_s: float, prediction: Estimate, passes: int,
            observe: Callable[[int, Array, Estimate], list[Residual]], initial: Array | None = None,
            partial: Partial = ALL) -> tuple[Array, Estimate]:
    """The state after updates of one `prediction` in `passes`, and its estimate; before any, `initial` and the
    prediction.

    Each pass has the residuals that `observe` finds, by its number, about the state so far, and with its estimate.
    """
    state, estimate = prediction[0] if initial is None else initial, prediction
    for number in range(passes):
        knot = update(process, t_s, prediction, observe(number, state, estimate), state, partial)
        state, estimate = knot.state, (knot.state, knot.covariance)
    return state, estimate


class IteratedFilter:
    """The newest knots of an estimate, `most` at most."""

    most = KNOTS

    def __init__(self, process: Process) -> None:
        self.process, self.partial = process, ALL
        self.knots: list[Knot] = []

    @property
    def newest(self) -> Knot:
        """The newest knot; IndexError before `start`."""
        return self.knots[-1]

    def start(self, t_s: float, state: Array, covariance: Array) -> None:
        """Begin anew with a prior."""
        self.knots = [Knot(t_s, state.copy(), covariance.copy())]

    def predict(self, t_s: float) -> tuple[Array, Array]:
        """State and covariance at `t_s` by everything before it; of the oldest knot for an earlier time."""
        place = max(bisect_right(self.knots, t_s, key=lambda knot: knot.t_s) - 1, 0)
        knot = self.knots[place]
        return self.process.predict(knot.state, knot.covariance, max(t_s - knot.t_s, 0.0))

    def add(self, t_s: float, residuals: Sequence[Residual],
            prediction: tuple[Array, Array] | None = None, initial: Array | None = None) -> Knot:
        """Take in `residuals` of the instant `t_s` and return its knot.

        `prediction`: what `predict(t_s)` returned, to save doing it again. `initial`: see `update`. An
        observation from before the oldest knot enters that one, which keeps its label and its residuals.
        """
        place = bisect_right(self.knots, t_s, key=lambda knot: knot.t_s)
        if place:
            prior = self.predict(t_s) if prediction is None else prediction
            self.knots.insert(place, update(self.process, t_s, prior, residuals, initial, self.partial))
        else:
            oldest = self.knots[0]
            knot = update(self.process, oldest.t_s, (oldest.state, oldest.covariance), residuals, None, self.partial)
            self.knots[0] = replace(knot, residuals=[*knot.residuals, *oldest.residuals], label=oldest.label,
                                    weights=np.concatenate([knot.weights, oldest.weights]))
        added = self.knots[place]
        for later in range(place + 1, len(self.knots)):
            before, knot = self.knots[later - 1], self.knots[later]
            prior = self.process.predict(before.state, before.covariance, knot.t_s - before.t_s)
            self.knots[later] = update(self.process, knot.t_s, prior, knot.residuals, None, self.partial)
            self.knots[later].label = knot.label
        while len(self.knots) > self.most:
            self.release(self.knots.pop(0))
        return added

    def release(self, knot: Knot, inflated: Array | None = None) -> None:
        """Let go of a knot that no late observation changes any more. `inflated` (n, n): the covariance with which it
        leads on, if that is another one."""


def update(process: Process, t_s: float, prior: tuple[Array, Array], residuals: Sequence[Residual],
           initial: Array | None = None, partial: Partial = ALL) -> Knot:
    """The posterior of a `prior` (state, covariance) and residuals. The first step begins at the state `initial`, or at
    the prior's.

    `away` is the present state less the prior's, in the tangent space of the present state.
    """
    state, covariance = prior
    away, weights, distance, before = np.zeros(process.size), np.empty(0), 0.0, np.inf
    if initial is not None:
        state, away = initial, process.difference(initial, prior[0])
    cross, root, last = np.empty((process.size, 0)), np.empty((0, 0)), (state, away)
    for iteration in range(ITERATIONS):
        error, jacobian, variances, cost, weighed = stack(
            [residual.linearise(state) for residual in residuals], process.size, weigh=iteration > 0)
        if not len(error):
            break
        if iteration > 1 and cost + distance > before:  # the last step was too long: half of it, by its own weights
            state = process.retract(last[0], 0.5 * last[1])
            break
        before, weights = cost + distance, weighed
        cross, root, reached, distance, moved = gauss_newton_step(covariance, jacobian, error, variances, away)
        reached[partial.columns] *= partial.share
        last = (state, reached - away)
        state, away = process.retract(state, reached - away), reached
        if iteration and moved < CONVERGED**2:
            break
    posterior = _reduce(covariance, cross, root)
    kept, block = (1.0 - partial.share) ** 2, np.ix_(partial.columns, partial.columns)
    posterior[block] = kept * covariance[block] + (1.0 - kept) * posterior[block]
    return Knot(t_s, state, posterior, list(residuals), weights)


@njit(cache=True)
def gauss_newton_step(covariance: Array, jacobian: Array, error: Array, variances: Array, step: Array) \
        -> tuple[Array, Array, Array, float, float]:
    """One Gauss-Newton step from `step` (n,), the present state relative to the prior.

    Returns covariance times jacobian transposed (n, K), the Cholesky factor of the innovation covariance (K, K), the
    new step, its squared Mahalanobis distance under the prior, and that of the change in observation space."""
    count = error.shape[0]
    cross = np.dot(covariance, jacobian.T)
    reduced = np.dot(jacobian, cross)
    innovation = error + np.dot(jacobian, step)
    total = reduced.copy()
    for k in range(count):
        total[k, k] += variances[k]
    root = np.linalg.cholesky(total)
    solution = np.empty(count)
    substitute(root, innovation, solution)
    new = np.dot(cross, solution)
    distance = np.dot(solution, np.dot(reduced, solution))
    change = np.dot(jacobian, new - step)
    moved = 0.0
    for k in range(count):
        moved += change[k] * change[k] / total[k, k]
    return cross, root, new, distance, moved


@njit(cache=True)
def _reduce(covariance: Array, cross: Array, root: Array) -> Array:
    """Covariance after the update, symmetric."""
    if cross.shape[1] == 0:
        return covariance.copy()
    count = root.shape[0]
    whitened = cross.T.copy()
    for i in range(count):
        for j in range(i):
            whitened[i] -= root[i, j] * whitened[j]
        whitened[i] /= root[i, i]
    out = covariance - np.dot(whitened.T, whitened)
    size = out.shape[0]
    for i in range(size):
        for j in range(i):
            mean = 0.5 * (out[i, j] + out[j, i])
            out[i, j] = mean
            out[j, i] = mean
    return out


# -- Rauch-Tung-Striebel smoother (Rauch, Tung and Striebel 1965) ------------------------------------------------------
# It runs back over the knots of a filter, so that every estimate uses the observations after it as well. Knots are
# smoothed in chunks that overlap, which bounds the memory.

CHUNK_S, AHEAD_S = 3.0, 1.0
"""s: estimates that are smoothed at once, and those after them that only help: some correlation times of a hand. At
80 per second, filtered and smoothed covariances of 100 numbers take 45 MB."""

CONTRADICTION = 3.0
"""Standard deviations of a filtered estimate, rms over its numbers, by which smoothing may change it. If models and
covariances hold, the mean square is below 1; the greatest of recorded hands are 1.0, of drawn ones 1.6."""

JITTER = 1e-9
"""Of the variances, added before a factorisation: the rounding errors of a filtered covariance are smaller."""


@runtime_checkable
class Following(Process, Protocol):
    """A process whose noise follows the motion of its state."""

    def moving_as(self, *states: Array) -> Process:
        """The process with the noise of the greatest motion in these states, whatever state is predicted."""
        ...


@dataclass(slots=True)
class FilteredState:
    """One instant, s: a state with its covariance (n, n).

    `process`: leads on from here. `label`: the caller's own. `inflated` (n, n): the covariance with which it led on, if
    that was larger than the update's. What is added is noise of this instant: a later estimate corrects what follows
    it, and what came before by no more than its own covariance allows. `contradicted`: smoothing has led farther from
    it than is possible, so it is as it was filtered, and the pass has begun anew from it. `residuals`: of this instant.
    """

    t_s: float
    state: Array
    covariance: Array
    process: Process
    label: Any = None
    inflated: Array | None = None
    contradicted: bool = False
    residuals: Sequence[Residual] = ()

    @property
    def begun(self) -> Array:
        """The covariance with which it leads on."""
        return self.covariance if self.inflated is None else self.inflated


def smooth(filtered: Sequence[FilteredState], count: int | None = None) -> list[FilteredState]:
    """The first `count` (None: all) of the filtered estimates, in ascending time, by all the observations.

    Where a process follows the motion, a filter knows a sudden motion only afterwards, and the pass back believes its
    noise. So what has been smoothed is filtered and smoothed again, with the noise of the smoothed motion.
    """
    found = _back(filtered)
    if len(filtered) > 1 and all(isinstance(one.process, Following) and one.residuals for one in filtered):
        found = _back(_again(filtered, found))
    return found[:count]


def _again(filtered: Sequence[FilteredState], smoothed: Sequence[FilteredState]) -> Sequence[FilteredState]:
    """The estimates filtered again from the first of them, each step with the noise of the smoothed motion at both
    its ends; as they were if the filter contradicts itself."""
    found = [filtered[0]]
    for number in range(1, len(filtered)):
        before, here = found[-1], filtered[number]
        assert isinstance(before.process, Following)
        process = before.process.moving_as(smoothed[number - 1].state, smoothed[number].state)
        found[-1] = before = replace(before, process=process)
        prior = process.predict(before.state, before.begun, here.t_s - before.t_s)
        try:
            knot = update(process, here.t_s, prior, here.residuals)
        except np.linalg.LinAlgError:
            return filtered
        inflated = None if here.inflated is None else knot.covariance + here.inflated - here.covariance
        found.append(replace(here, state=knot.state, covariance=knot.covariance, inflated=inflated))
    return found


def _back(filtered: Sequence[FilteredState]) -> list[FilteredState]:
    """One pass back."""
    found: list[FilteredState] = []
    state, covariance = np.empty(0), np.empty((0, 0))
    for number in range(len(filtered) - 1, -1, -1):
        here = filtered[number]
        if number == len(filtered) - 1:
            state, covariance = here.state, here.begun
        else:
            state, covariance = _step_back(here, filtered[number + 1], state, covariance)
        contradicted = _deviations(here, state) > CONTRADICTION
        if contradicted:
            state, covariance = here.state, here.begun
        found.append(replace(here, state=state, covariance=covariance, contradicted=contradicted))
        if here.inflated is not None:
            state, covariance = _before_inflation(here, here.inflated, state, covariance)
    return found[::-1]


def _before_inflation(here: FilteredState, inflated: Array, state: Array, covariance: Array) -> tuple[Array, Array]:
    """Smoothed state and covariance at `here` before its covariance was `inflated`, from those after."""
    values, axes = np.linalg.eigh(inflated - here.covariance)
    noise = (axes * np.maximum(values, 0.0)) @ axes.T  # numbers that are inflated by factors lose correlation too
    gain = _divide(here.covariance, here.covariance + noise)
    left = np.eye(len(gain)) - gain
    smoothed = left @ here.covariance @ left.T + gain @ (noise + covariance) @ gain.T
    return here.process.retract(here.state, gain @ here.process.difference(state, here.state)), smoothed


def _deviations(here: FilteredState, state: Array) -> float:
    """Root mean square of what smoothing has changed, in standard deviations of the filtered estimate; infinite where
    it is not finite."""
    step = here.process.difference(state, here.state)
    if not np.isfinite(step).all():
        return np.inf
    return float(np.sqrt(max(_divide(step[None], here.begun)[0] @ step, 0.0) / len(step)))


def _step_back(here: FilteredState, after: FilteredState, state: Array, covariance: Array) -> tuple[Array, Array]:
    """Smoothed state and covariance at `here`; `state` and `covariance` are those at `after`.

    The covariance is in Joseph's form. No part of the gain may be left out: only the whole one shortens a step, by the
    covariances, so that going back over many steps is stable.
    """
    process, dt_s = here.process, after.t_s - here.t_s
    begun = here.begun
    if dt_s <= 0.0:  # two frames of one instant: the same state
        return state, covariance
    predicted, predicted_covariance = process.predict(here.state, begun, dt_s)
    move = process.transition(here.state, dt_s)
    noise = predicted_covariance - move @ begun @ move.T
    step = process.difference(state, predicted)
    gain = _divide(begun @ move.T, predicted_covariance)
    left = np.eye(process.size) - gain @ move
    smoothed = left @ begun @ left.T + gain @ (noise + covariance) @ gain.T
    return process.retract(here.state, gain @ step), 0.5 * (smoothed + smoothed.T)


def _divide(cross: Array, covariance: Array) -> Array:
    """`cross` (n, m) times the inverse of `covariance` (m, m), whose numbers are first scaled to variances of 1."""
    variances = np.diag(covariance)
    scale = np.sqrt(np.where(variances > 0.0, variances, np.inf))  # a number without variance has no correlation
    correlation = covariance / scale[:, None] / scale
    correlation[np.diag_indices_from(correlation)] += JITTER
    try:
        factor = cho_factor(correlation, lower=True, check_finite=False)
        return np.asarray(cho_solve(factor, (cross / scale).T, overwrite_b=True, check_finite=False).T / scale)
    except np.linalg.LinAlgError:  # rounding has left negative eigenvalues
        values, vectors = np.linalg.eigh(correlation)
        return np.asarray((cross / scale) @ (vectors / np.maximum(values, JITTER)) @ vectors.T / scale)


class ChunkedSmoother:
    """Takes filtered estimates in ascending time and gives them smoothed, `chunk_s` at a time.

    Each chunk is smoothed from `ahead_s` after its end; what lies there is smoothed again with the next chunk.
    """

    chunk_s, ahead_s = CHUNK_S, AHEAD_S

    def __init__(self) -> None:
        self._waiting: list[FilteredState] = []

    def add(self, estimate: FilteredState) -> list[FilteredState]:
        """Take the next estimate; returns those that are smoothed with it, mostly none."""
        self._waiting.append(estimate)
        begin_s = self._waiting[0].t_s
        if estimate.t_s - begin_s <= self.chunk_s + self.ahead_s:
            return []
        count = sum(one.t_s - begin_s < self.chunk_s for one in self._waiting)
        found = smooth(self._waiting, count)
        del self._waiting[:count]
        return found

    def finish(self) -> list[FilteredState]:
        """The rest. The next estimate begins anew."""
        found, self._waiting = smooth(self._waiting), []
        return found
