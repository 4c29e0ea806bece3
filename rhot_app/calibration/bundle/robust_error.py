"""How much more the shots disagree than the scatter of their corners explains, and which views are outliers.

A sheet that bends from picture to picture, a board that moves while cameras expose one after the other, a rolling
shutter: such errors move all corners of a shot together. Whatever the pose of the board can take up leaves no trace in
the residuals, and the rest pulls at lenses and cameras without making the residuals much larger; the inverse of the
normal equations, which counts every corner as a witness of its own, is then far too sure. On real pictures of hand-held
boards by a factor of 2 to 5: so far apart are the results of halves of the shots.

Here every shot is one witness (Liang and Zeger 1986): the pulls of single shots at the result are compared with those
that independent corners would make. For independent errors the ratio is one on the average.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.bundle.adjustment import LEAST_NOISE_PX, Bundle
from rhot_app.calibration.bundle.model import Observations, linearise

Array = NDArray[np.float64]

_NOTABLE = 1.5  # times; less comes by chance with a dozen shots


def error_inflation(bundle: Bundle, seen: Observations, common: Array | None = None) -> float:
    """What standard deviations of lenses and cameras have to be multiplied by, 1 or more.

    `common` (2M, K) px: how far errors that are stated elsewhere, of lenses that were kept, move the corners, one
    column per standard deviation. What they do to single shots is expected.
    """
    layout = bundle.layout
    reported = layout.board_at  # lenses and cameras stand first
    if not reported or bundle.noise_px < LEAST_NOISE_PX:
        return 1.0
    shared = np.r_[:reported, layout.errors]
    certainty = bundle.covariance[np.ix_(shared, shared)]
    moved_by = certainty[:, :reported]  # how the result moves with a pull
    metric = moved_by @ np.linalg.solve(certainty[:reported, :reported], moved_by.T)
    jacobian = layout.jacobian(linearise(bundle.state, seen))
    scaled = np.repeat(np.sqrt(bundle.weights), 2) / bundle.noise_px
    off = np.column_stack([bundle.residuals.ravel(), *(() if common is None else common.T)])
    witnesses = []
    for shot in range(len(bundle.state.world_from_board)):
        rows = np.flatnonzero(np.repeat(seen.shot == shot, 2))
        witnesses.append(_witness(jacobian[rows], off[rows], scaled[rows], shared, layout.board(shot)))
    answer = certainty @ np.sum([pulls[:, 1:] for pulls, _ in witnesses], axis=0)  # of the unknowns to common errors
    found, expected = 0.0, 0.0
    for pulls, information in witnesses:
        found += float(pulls[:, 0] @ metric @ pulls[:, 0])
        expected += float(np.sum(metric * (information - information @ certainty @ information)))
        left = pulls[:, 1:] - information @ answer
        expected += float(np.sum(left * (metric @ left)))
    return float(np.sqrt(max(1.0, found / expected))) if expected > 0.0 else 1.0


def in_words(times: float) -> str:
    """The likely cause of a disagreement, empty where there is none to speak of."""
    if times < _NOTABLE:
        return ""
    return (f"The pictures disagree {times:.1f} times as much as the scatter of their corners explains: the board "
            "bends from picture to picture, or moves while it is taken.")


def what_is_reported(times: float) -> str:
    """What is printed behind ±, in words."""
    more = f", {times:.1f} times what the scatter of the corners explains: so far are the pictures apart"
    return "± is one standard deviation" + (more if times >= _NOTABLE else "")


def _witness(jacobian: Any, off: Array, scaled: Array, shared: NDArray[np.intp], board: slice) -> tuple[Array, Array]:
    """The pulls of a shot's `off` (2M, L) px at the K shared unknowns (K, L), and its information on them (K, K), the
    board's pose eliminated."""
    by_shared = jacobian[:, shared].toarray() * scaled[:, None]
    free, _ = np.linalg.qr(jacobian[:, board].toarray() * scaled[:, None])
    by_shared -= free @ (free.T @ by_shared)
    return by_shared.T @ (off * scaled[:, None]), by_shared.T @ by_shared


# -- outlier views and the disagreement of views -----------------------------------------------------------------------

MOST_DROPPED = 0.34
"""Of the views; who needs more thrown away has another trouble."""

_OFF_TIMES = 4.0  # a view whose rms is this many times the median view's, and
_OFF_PX = 0.3  # this much more than it, does not fit


def misfit_limit(rms: Array) -> tuple[float, float]:
    """The rms in px above which a view does not fit, and the usual one, from the rms of all views; NaN is no view."""
    usual = float(np.nanmedian(rms))
    return max(_OFF_TIMES * usual, usual + _OFF_PX), usual


def tilt_spread(world_from_board: Array) -> float:
    """Largest angle, rad, between the normals of any two boards (S, 4, 4): without it planes show no focal length."""
    normals = world_from_board[:, :3, 2]
    return float(np.arccos(np.clip(np.min(normals @ normals.T), -1.0, 1.0)))
