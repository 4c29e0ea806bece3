"""A Rauch-Tung-Striebel smoother on a manifold, for recordings (Rauch, Tung and Striebel 1965).

It runs back over the knots of a filter, so that every estimate uses the observations after it as well. Knots are
smoothed in chunks that overlap, which bounds the memory.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from rhot_app.estimation.residual import Process

Array = NDArray[np.float64]

CHUNK_S, AHEAD_S = 3.0, 1.0
"""s: estimates that are smoothed at once, and those after them that only help: some correlation times of a hand. At
80 per second, filtered and smoothed covariances of 100 numbers take 45 MB."""

JITTER = 1e-9
"""Of the variances, added before a factorisation: the rounding errors of a filtered covariance are smaller."""


@dataclass(slots=True)
class Estimate:
    """One instant, s: a state with its covariance (n, n).

    `process`: leads on from here. `label`: the caller's own. A covariance may be inflated after its update: the
    estimates before it were as wrong, and are corrected as much.
    """

    t_s: float
    state: Array
    covariance: Array
    process: Process
    label: Any = None


def smooth(filtered: Sequence[Estimate], count: int | None = None) -> list[Estimate]:
    """The first `count` (None: all) of the filtered estimates, in ascending time, by all the observations."""
    count = len(filtered) if count is None else count
    found: list[Estimate] = []
    state, covariance = np.empty(0), np.empty((0, 0))
    for number in range(len(filtered) - 1, -1, -1):
        here = filtered[number]
        if number == len(filtered) - 1:
            state, covariance = here.state, here.covariance
        else:
            state, covariance = _step_back(here, filtered[number + 1], state, covariance)
        if number < count:
            found.append(replace(here, state=state, covariance=covariance))
    return found[::-1]


def _step_back(here: Estimate, after: Estimate, state: Array, covariance: Array) -> tuple[Array, Array]:
    """Smoothed state and covariance at `here`; `state` and `covariance` are those at `after`.

    A later estimate says nothing of what a prediction does not carry on; a linearised gain would correct it all the
    same. The covariance is in Joseph's form, for a gain that is not the best one.
    """
    process, dt_s = here.process, after.t_s - here.t_s
    if dt_s <= 0.0:  # two frames of one instant: the same state
        return state, covariance
    predicted, predicted_covariance = process.predict(here.state, here.covariance, dt_s)
    move = process.transition(here.state, dt_s)
    noise = predicted_covariance - move @ here.covariance @ move.T
    step = process.difference(state, predicted)
    gain = process.remembered(here.state) @ _divide(here.covariance @ move.T, predicted_covariance)
    left = np.eye(process.size) - gain @ move
    smoothed = left @ here.covariance @ left.T + gain @ (noise + covariance) @ gain.T
    return process.retract(here.state, gain @ step), 0.5 * (smoothed + smoothed.T)


def _divide(cross: Array, covariance: Array) -> Array:
    """`cross` (n, m) times the inverse of `covariance` (m, m), whose numbers are first scaled to variances of 1."""
    variances = np.diag(covariance)
    scale = np.sqrt(np.where(variances > 0.0, variances, np.inf))  # a number without a variance tells nothing
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

    def __init__(self, chunk_s: float = CHUNK_S, ahead_s: float = AHEAD_S) -> None:
        self._chunk_s, self._ahead_s = chunk_s, ahead_s
        self._waiting: list[Estimate] = []

    def add(self, estimate: Estimate) -> list[Estimate]:
        """Take the next estimate; returns those that are smoothed with it, mostly none."""
        self._waiting.append(estimate)
        begin_s = self._waiting[0].t_s
        if estimate.t_s - begin_s <= self._chunk_s + self._ahead_s:
            return []
        count = sum(one.t_s - begin_s < self._chunk_s for one in self._waiting)
        found = smooth(self._waiting, count)
        del self._waiting[:count]
        return found

    def finish(self) -> list[Estimate]:
        """The rest. The next estimate begins anew."""
        found, self._waiting = smooth(self._waiting), []
        return found
