"""The whole way from marker tracks to a hand's shape: instants, first guess, adjustment, and how far to believe it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.hand_bundle import HandAdjustment, HandBundle, Weights
from rhot_app.calibration.hand_bundle_model import POSE
from rhot_app.calibration.hand_shape import HandUnknowns
from rhot_app.calibration.hand_start import choose_instants, lay_on, lay_palm_on
from rhot_app.calibration.marker_places import MarkerTracks
from rhot_app.calibration.track_noise import SmoothTracks, smooth
from rhot_app.errors import CalibrationError
from rhot_app.hand.anatomy import HandAnatomy
from rhot_app.progress import Progress, silent

Array = NDArray[np.float64]

INSTANTS = 800
LEAST_INSTANTS = 30

INDEPENDENT_ERRORS = 3.0
"""What is left of the markers beyond their noise (skin on bones, joints that are no hinges) repeats itself with every
movement: a minute tells as little of it as this many independent looks. Then two halves of a recording of a real hand
agree; with a look per instant they contradict each other."""

_START_NOISE_M = 3e-3
_SIDE_INSTANTS = 60
_ROUNDS = 4
_NOISE_DOUBT = 1.2  # the variance of the noise is known to a fifth; only more than that is an error of another kind
_DISTANCE_MEDIAN = 1.5382  # median distance of a 3-D Gaussian, in standard deviations per axis


@dataclass(frozen=True, slots=True)
class HandFit:
    """`unknowns` and their adjusted `bundle` over the `instants` (F,) of the tracks.

    `raw_noise_m`: noise of the tracks per axis; `model_error_m`: what is left beyond noise, standard deviation per
    axis of a marker; `side` the hand was fitted as, `other_side_cost` how much worse the other hand fits (above 1) or
    better (below), as a ratio of costs.
    """

    unknowns: HandUnknowns
    bundle: HandBundle
    instants: NDArray[np.int64]
    raw_noise_m: float
    model_error_m: float
    other_side_cost: float


def fit_hand(tracks: MarkerTracks, base: HandAnatomy, *, progress: Progress = silent) -> HandFit:
    """Fit the hand `base` to a recording of many markers. Raises CalibrationError when it cannot hold a hand."""
    smoothed = smooth(tracks.times_s, tracks.positions)
    instants = choose_instants(smoothed.positions, INSTANTS)
    if len(instants) < LEAST_INSTANTS:
        raise CalibrationError(f"only {len(instants)} instants show enough markers at once; at least {LEAST_INSTANTS} "
                               "are needed. Record a minute with all markers in sight.")
    unknowns = HandUnknowns(base, tracks.places)
    seen = as_right(smoothed.positions[instants], base.side)
    progress("looking at the side of the hand", 0.0)
    some = seen[np.linspace(0, len(seen) - 1, min(_SIDE_INSTANTS, len(seen))).astype(int)]
    costs = [_begin(unknowns, sights, 15).cost for sights in (some, as_right(some, "left"))]
    bundle = _begin(unknowns, seen, 30)
    bundle, model_error_m = _believe(unknowns, seen, bundle, smoothed, progress)
    return HandFit(unknowns, bundle, instants, smoothed.raw_noise_m, model_error_m, costs[1] / costs[0])


def as_right(positions: Array, side: str) -> Array:
    """Points (..., 3) of a left hand in a mirror, where it is a right one; a right hand's as they are."""
    return positions if side == "right" else positions * [1.0, -1.0, 1.0]


def _begin(unknowns: HandUnknowns, seen: Array, steps: int) -> HandBundle:
    """Poses and a first shape from nothing: the hand is laid on the markers, the best instants show where the palm's
    markers sit, and these then hold the palm at all instants."""
    poses, off = lay_on(unknowns, unknowns.prior.mean, seen)
    best = np.argsort(off)[:max(20, len(seen) // 20)]
    few = HandAdjustment(unknowns, seen[best], Weights(_START_NOISE_M, len(best), len(best)))
    begun = few.run(unknowns.prior.mean, poses.of(best), steps)
    poses = lay_palm_on(unknowns, begun.vector, seen, poses)
    every = HandAdjustment(unknowns, seen, Weights(_START_NOISE_M, len(seen), len(seen)))
    return every.run(begun.vector, every.settle(begun.vector, poses, steps), 0)


def _believe(unknowns: HandUnknowns, seen: Array, start: HandBundle, smoothed: SmoothTracks,
             progress: Progress) -> tuple[HandBundle, float]:
    """Adjust, see how large the errors are, weigh accordingly, and again. Returns the error beyond noise, m."""
    bundle, weights, beyond = start, Weights(_START_NOISE_M, 30.0), 0.0
    for turn in range(_ROUNDS):
        def share(text: str, fraction: float, turn: int = turn) -> None:
            progress(text, 0.1 + 0.9 * (turn + fraction) / _ROUNDS)

        bundle = HandAdjustment(unknowns, seen, weights).run(bundle.vector, bundle.poses, 100, progress=share)
        error = max(_error(bundle.residuals, unknowns.size), 1e-5)
        noise = min(smoothed.noise_m, error)
        beyond = float(np.sqrt(max(error ** 2 - _NOISE_DOUBT * noise ** 2, 0.0)))
        # Noise averages out over the instants; what is beyond it does not.
        looks = min(float(len(seen)), smoothed.looks)
        weights = Weights(error, error ** 2 / (noise ** 2 / looks + beyond ** 2 / INDEPENDENT_ERRORS + 1e-18))
    return bundle, beyond


def _error(residuals: Array, shape_size: int) -> float:
    """Standard deviation of a marker per axis, m, robust, from residuals (F, M, 3) of which the fit took its share."""
    distance = np.linalg.norm(residuals, axis=2)
    distance = distance[np.isfinite(distance)]
    count, taken = 3 * len(distance), POSE * len(residuals) + shape_size
    return float(np.median(distance) / _DISTANCE_MEDIAN * np.sqrt(count / max(count - taken, 0.1 * count)))
