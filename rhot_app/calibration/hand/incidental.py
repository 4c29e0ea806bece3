"""What the noise of every instant's own pose does to the shape of the hand, and how to take it out again.

Each instant brings 27 unknowns of its own, so there is never more than a handful of markers to average a pose's noise.
Points go round joints on curves: a pose that is off by its noise puts them beside their curve on average, on the outer
side, and thousands of instants agree on that. Joints move towards the markers until it fits: a last phalanx came out
3 to 8 mm too short at 0.2 mm of noise (incidental parameters, Neyman and Scott 1948). To second order the mean of what
is left of a marker is half the trace of its second derivative by the pose times the pose's covariance: `bend`. Sights
moved by it show the shape with little bias.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.hand.bundle_model import POSE, Poses, expected
from rhot_app.calibration.hand.shape import HandUnknowns

Array = NDArray[np.float64]

_FARTHEST = 0.3
"""Radians, m: what is so uncertain is not known to second order; it is taken to be this uncertain only."""

DRAWS = 4
"""Of random poses; every instant draws its own, so few are enough."""

_SEED = 1


def bend(unknowns: HandUnknowns, vector: Array, poses: Poses, covariances: Array) -> Array:
    """(F, M, 3) m, by how much markers are off on average when poses scatter with `covariances` (F, 27, 27)."""
    middle = expected(unknowns, vector, poses)
    roots = _roots(covariances)
    total = np.zeros_like(middle)
    for k in range(POSE):
        for sign in (1.0, -1.0):
            total += expected(unknowns, vector, poses.moved(sign * roots[..., k])) - middle
    return np.asarray(0.5 * total)


def scatter_of(covariances: Array) -> Iterator[Array]:
    """Some draws (F, 27) of poses that scatter with `covariances` (F, 27, 27); by sign only, which has no tails."""
    rng = np.random.default_rng(_SEED)
    roots = _roots(covariances)
    for _ in range(DRAWS):
        yield np.asarray((roots @ rng.choice([-1.0, 1.0], size=(len(roots), POSE, 1)))[..., 0])


def _roots(covariances: Array) -> Array:
    """(F, 27, 27) whose columns are steps of one standard deviation, no longer than what second order holds for."""
    values, axes = np.linalg.eigh(covariances)
    return np.asarray(axes * np.minimum(np.sqrt(np.maximum(values, 0.0)), _FARTHEST)[:, None, :])
