"""A state that wanders slowly and may have jumped once: which jump is the most probable, and the state since.

What was observed comes in parts, each as information: a matrix J^T W J and a vector J^T W z. An information filter goes
through the parts for every hypothesis; the one with the largest evidence wins (after Adams and MacKay 2007, "Bayesian
online changepoint detection", with one jump).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class ChangePoint:
    """`part`: the one before which the jump was, -1 for none; `before` (n,) the state just before it, `state` (n,) and
    `covariance` (n, n) at the end."""

    part: int
    before: Array
    state: Array
    covariance: Array


def find_change(prior: Array, jump: Array, walk: Array, t_s: Array, matrices: Array, vectors: Array,
                log_odds: Array) -> ChangePoint:
    """The most probable of S + 1 hypotheses: no jump, or one before each of S parts.

    `prior` and `jump` (n,) variances of the state about zero and of a jump, `walk` (n,) the variance that a second
    adds; `t_s` (S,) times of the parts, `matrices` (S, n, n) and `vectors` (S, n) their information; `log_odds`
    (S + 1,) prior logarithms. All hypotheses go through the parts at once.
    """
    count, size = len(log_odds), len(prior)
    state, before, evidence = np.zeros((count, size)), np.zeros((count, size)), log_odds.copy()
    covariance = np.tile(np.diag(prior), (count, 1, 1))
    for k in range(len(t_s)):
        if k:
            covariance += np.diag(walk * (t_s[k] - t_s[k - 1]))
        before[k + 1] = state[k + 1]
        covariance[k + 1] += np.diag(jump)
        information = np.linalg.inv(covariance)
        total = information + matrices[k]
        held = np.einsum("hij,hj->hi", information, state)
        pull = held + vectors[k]
        covariance = np.linalg.inv(total)
        moved = np.einsum("hij,hj->hi", covariance, pull)
        evidence += 0.5 * (np.linalg.slogdet(information)[1] - np.linalg.slogdet(total)[1]
                           + np.sum(pull * moved, axis=1) - np.sum(state * held, axis=1))
        state = moved
    best = int(np.argmax(evidence))
    return ChangePoint(best - 1, before[best], state[best], covariance[best])
