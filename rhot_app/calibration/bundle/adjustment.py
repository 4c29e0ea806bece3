"""One robust bundle adjustment over all cameras, boards and, where free, lenses.

Levenberg-Marquardt on the sparse normal equations, with Huber's loss on each corner's distance by reweighting
(Triggs et al. 2000, "Bundle adjustment - a modern synthesis"). The sparse factorisation converges to the last digit in
some ten steps, where scipy's least_squares with its iterative inner solver is still 10 px off after a hundred.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from rhot_app.calibration.bundle.model import (
    POINT,
    Array,
    BoardFreedom,
    BundleState,
    Layout,
    LensFreedom,
    Observations,
    linearise,
    residuals,
)
from rhot_app.errors import CalibrationError
from rhot_app.estimation.least_squares import minimise
from rhot_app.progress import Progress, silent, within

HUBER = 3.0
"""Corners farther off than this many standard deviations (per axis) count less: one in ninety of Gaussian noise."""
LEAST_NOISE_PX = 1e-3
"""No corner is trusted to better than this: keeps exact synthetic corners from dividing by zero."""

_MOST_STEPS, _USUAL_STEPS = 100, 20
_LEAST_GAIN = 1e-5  # of the cost: nothing moves by half a hundredth of its standard deviation any more
_RAYLEIGH_MEDIAN = 1.1774100225154747  # median distance of a 2-D Gaussian, in standard deviations per axis


@dataclass(frozen=True, slots=True)
class Bundle:
    """The adjusted `state` and what is left.

    `residuals` (M, 2) px, seen minus expected, and Huber's `weights` (M,); `noise_px` the standard deviation of a
    corner per axis, and `determined` how many unknowns were taken from the corners to get it (fewer than all where
    something is known beforehand);
    `layout` of the unknowns and their `covariance` (size, size), already times noise squared.
    """

    state: BundleState
    residuals: Array
    weights: Array
    noise_px: float
    determined: float
    layout: Layout
    covariance: Array


def adjust(start: BundleState, seen: Observations, lenses: Sequence[LensFreedom], *,
           board_errors: BoardFreedom | None = None, progress: Progress = silent) -> Bundle:
    """Adjust everything that is free to the corners seen; `board_errors` frees the board's own shape, too.

    The noise of the corners is estimated, not given: first a fit at a generous guess, then one at its robust estimate.
    Raises CalibrationError when the corners do not determine the unknowns.
    """
    layout = Layout(lenses, len(start.world_from_board), seen, board_errors)
    if board_errors is not None and start.board_errors is None:
        start = replace(start, board_errors=np.zeros((board_errors.count, POINT)))
    if 2 * len(seen) <= layout.errors_at:
        raise CalibrationError(f"{len(seen)} corners do not determine {layout.size} unknowns; add pictures.")
    state = start
    noise = _noise(residuals(state, seen))
    for stage in range(3):
        stage_progress = within(progress, 0.3 * stage, 0.3 * stage + 0.3)
        found, _ = minimise(_Iterate(state, seen, layout, noise), _MOST_STEPS, _LEAST_GAIN,
                            watch=partial(_report, stage_progress))
        state = found.state
        before, noise = noise, _noise(residuals(state, seen))
        if stage and abs(noise - before) < 0.02 * before:
            break
    progress("working out how certain it is", 0.95)
    off = residuals(state, seen)
    weights = _weights(off, noise)
    covariance = _covariance(state, seen, layout, weights, noise)
    known, _ = layout.prior(state)
    determined = layout.size - float(np.sum((known @ covariance) * known.toarray()))  # the rest is known beforehand
    spread = _spread(off, weights, determined)
    return Bundle(state, off, weights, spread, determined, layout,
                  _covariance(state, seen, layout, weights, spread))


def misfit(bundle: Bundle, seen: Observations, noise_px: float) -> float:
    """Twice the negative logarithm of a result's likelihood and prior, less a constant, where corners scatter by
    `noise_px`: what a likelihood-ratio test compares."""
    return 2.0 * _Iterate(bundle.state, seen, bundle.layout, noise_px).cost


def _report(progress: Progress, taken: int) -> None:
    progress("adjusting cameras and boards", min(1.0, taken / _USUAL_STEPS))


class _Iterate:
    """Implements `Iterate`: cameras and boards at a given noise of the corners, with Huber's cost."""

    def __init__(self, state: BundleState, seen: Observations, layout: Layout, noise: float) -> None:
        self.state, self._seen, self._layout, self._noise = state, seen, layout, noise
        ratio = np.linalg.norm(residuals(state, seen), axis=1) / noise
        loss = np.where(ratio <= HUBER, 0.5 * ratio**2, HUBER * (ratio - 0.5 * HUBER))
        total = float(np.sum(loss) + 0.5 * np.sum(np.square(layout.prior(state)[1])))
        self.cost = total if np.isfinite(total) else np.inf  # behind a camera

    def moved(self, damping: float) -> _Iterate:
        normal, side = self._normal_equations
        diagonal = normal.diagonal()
        if not np.all(diagonal > 0.0):
            raise CalibrationError("the corners do not determine every unknown: a camera or a board is seen in no "
                                   "picture.")
        step = np.asarray(splu(normal + sparse.diags(damping * diagonal, format="csc")).solve(side))
        return _Iterate(self._layout.moved(self.state, step), self._seen, self._layout, self._noise)

    @cached_property
    def _normal_equations(self) -> tuple[Any, Array]:
        line = linearise(self.state, self._seen)
        jacobian = self._layout.jacobian(line)
        weights = np.repeat(_weights(line.residuals, self._noise), 2) / self._noise**2
        known, off = self._layout.prior(self.state)
        normal = jacobian.T @ jacobian.multiply(weights[:, None]).tocsr() + known.T @ known
        return normal.tocsc(), jacobian.T @ (weights * line.residuals.ravel()) + known.T @ off


def _weights(off: Array, noise: float) -> Array:
    """Huber's weights (M,)."""
    return np.minimum(1.0, HUBER * noise / np.maximum(np.linalg.norm(off, axis=1), 1e-300))


def _noise(off: Array) -> float:
    """Robust standard deviation of a corner per axis, from the median distance."""
    return max(float(np.median(np.linalg.norm(off, axis=1))) / _RAYLEIGH_MEDIAN, LEAST_NOISE_PX)


def _spread(off: Array, weights: Array, unknowns: float) -> float:
    """Standard deviation of a corner per axis from the weighted residuals and the degrees of freedom left."""
    total = float(np.sum(weights * np.sum(np.square(off), axis=1)))
    return float(np.sqrt(total / (2 * len(off) - unknowns)))


def _covariance(state: BundleState, seen: Observations, layout: Layout, weights: Array, spread: float) -> Array:
    """Inverse of the normal equations at the corners' own spread; exact for Gaussian noise up to first order.

    Raises CalibrationError when they are singular.
    """
    jacobian = layout.jacobian(linearise(state, seen))
    known, _ = layout.prior(state)
    scaled = np.repeat(weights, 2) / max(spread, 1e-12) ** 2
    normal = (jacobian.T @ jacobian.multiply(scaled[:, None]).tocsr() + known.T @ known).toarray()
    scale = 1.0 / np.sqrt(np.diag(normal))
    try:
        inverse = np.linalg.inv(normal * scale[:, None] * scale)
    except np.linalg.LinAlgError as exc:
        raise CalibrationError("the corners do not determine every unknown; add pictures in which the board is "
                               "tilted and elsewhere.") from exc
    return np.asarray(inverse * scale[:, None] * scale)
