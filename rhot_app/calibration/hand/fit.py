"""The whole way from marker tracks to a hand's shape: instants, first guess, adjustment, and its uncertainty."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.hand.bundle import HandAdjustment, HandBundle, Weights, bend
from rhot_app.calibration.hand.bundle_model import POSE, Poses, expected
from rhot_app.calibration.hand.marker_places import MarkerTracks
from rhot_app.calibration.hand.shape import HandUnknowns
from rhot_app.calibration.time.tracks import SmoothTracks, smooth
from rhot_app.errors import CalibrationError
from rhot_app.geometry.transforms import apply, fit_rigid
from rhot_app.hand.anatomy import HandAnatomy
from rhot_app.hand.model import neutral_pose
from rhot_app.progress import Progress, silent, within

Indices = NDArray[np.int64]
Array = NDArray[np.float64]

INSTANTS = 800
LEAST_INSTANTS = 30

INDEPENDENT_ERRORS = 3.0
"""What is left of the markers beyond their noise (skin on bones, joints that are no hinges) repeats itself with every
movement: a minute tells as little of it as this many independent looks. Then two halves of a recording of a real hand
agree; with a look per instant they contradict each other."""

HIDDEN_ERROR = 0.15
"""As a part of the noise: an error of this kind that adds two hundredths to its variance is not to be seen, and repeats
itself none the less. Where skin moved unseen a last phalanx came out 4 mm short and was stated to be known to 1 mm."""

_START_NOISE_M = 3e-3
_SIDE_INSTANTS = 60
_ROUNDS, _STEPS = 3, 20  # to see how large the errors are, which the last steps hardly change
_NOISE_DOUBT = 1.2  # the variance of the noise is known to a fifth; only more than that is an error of another kind
_FAST = 90.0, 2.5003  # a percentile of distances, and its value in a 3-D unit Gaussian


@dataclass(frozen=True, slots=True)
class HandFit:
    """`unknowns` and their adjusted `bundle` over the `instants` (F,) of the tracks; `covariance` (G, G) of its vector.

    `raw_noise_m`: noise of the tracks per axis; `model_error_m`: what is left beyond noise, standard deviation per
    axis of a marker; `side` the hand was fitted as, `other_side_cost` how much worse the other hand fits (above 1) or
    better (below), as a ratio of costs.
    """

    unknowns: HandUnknowns
    bundle: HandBundle
    covariance: Array
    instants: NDArray[np.int64]
    raw_noise_m: float
    model_error_m: float
    other_side_cost: float


def fit_hand(tracks: MarkerTracks, base: HandAnatomy, *, progress: Progress = silent) -> HandFit:
    """Fit the hand `base` to a recording of many markers. Raises CalibrationError when it cannot hold a hand."""
    smoothed = smooth(tracks.times_s, tracks.positions)
    instants = choose_instants(smoothed.positions, INSTANTS, smoothed.apart)
    if len(instants) < LEAST_INSTANTS:
        raise CalibrationError(f"only {len(instants)} instants show enough markers at once; at least {LEAST_INSTANTS} "
                               "are needed. Record a minute with all markers in sight.")
    unknowns = HandUnknowns(base, tracks.places)
    seen = as_right(smoothed.positions[instants], base.side)
    progress("looking at the side of the hand", 0.0)
    some = seen[np.linspace(0, len(seen) - 1, min(_SIDE_INSTANTS, len(seen))).astype(int)]
    costs = [_begin(unknowns, positions, 15).cost for positions in (some, as_right(some, "left"))]
    bundle = _begin(unknowns, seen, 30)
    bundle, covariance, model_error_m = _adjust_by_error(unknowns, seen, bundle, smoothed, progress)
    return HandFit(unknowns, bundle, covariance, instants, smoothed.raw_noise_m, model_error_m, costs[1] / costs[0])


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


def _adjust_by_error(unknowns: HandUnknowns, seen: Array, start: HandBundle, smoothed: SmoothTracks,
                     progress: Progress) -> tuple[HandBundle, Array, float]:
    """Adjust until the hand fits as well as it can, estimate the errors that remain, and adjust once more with markers
    weighted accordingly. Returns the covariance of the shape too, and the error beyond noise, m.

    The errors are estimated with full weight on the markers. With the prior's weight the hand would fit worse, the
    markers would count less for it, and the prior even more.
    """
    bundle, weights, shift = start, Weights(_START_NOISE_M, 30.0, fresh=0.0), np.zeros_like(seen)
    everything = float(len(seen))
    error = noise = 0.0

    for turn in range(_ROUNDS):
        share = within(progress, 0.1 + 0.7 * turn / _ROUNDS, 0.1 + 0.7 * (turn + 1) / _ROUNDS)
        adjustment = HandAdjustment(unknowns, seen + shift, weights)
        bundle = adjustment.run(bundle.vector, bundle.poses, _STEPS, progress=share)
        error = max(_error(bundle.residuals, unknowns.size), 1e-5)
        noise = min(smoothed.noise_m, error)
        weights = Weights(error, everything, fresh=(noise / error) ** 2)
        scatter = HandAdjustment(unknowns, seen, weights).pose_covariances(bundle.vector, bundle.poses)
        shift = bend(unknowns, bundle.vector, bundle.poses, scatter)
    beyond = float(np.sqrt(max(error ** 2 - _NOISE_DOUBT * noise ** 2, 0.0)))
    repeated = max(beyond, HIDDEN_ERROR * noise)
    # Noise averages out over the instants; what is beyond it does not.
    spread = noise ** 2 / min(everything, smoothed.looks) + repeated ** 2 / INDEPENDENT_ERRORS
    last = HandAdjustment(unknowns, seen + shift, Weights(error, error ** 2 / spread, fresh=(noise / error) ** 2))
    bundle = last.run(bundle.vector, bundle.poses, 100, progress=within(progress, 0.8, 1.0))
    return bundle, last.covariance(bundle.vector, bundle.poses), beyond


def _error(residuals: Array, shape_size: int) -> float:
    """Standard deviation of a marker per axis, m, from residuals (F, M, 3) of which the fit took its share.

    The worst tenth may be anything, but what is just below decides: a hand errs where it moves, and the median of a
    recording that rests for a while would be far too small.
    """
    distance = np.linalg.norm(residuals, axis=2)
    distance = distance[np.isfinite(distance)]
    count, taken = 3 * len(distance), POSE * len(residuals) + shape_size
    return float(np.percentile(distance, _FAST[0]) / _FAST[1] * np.sqrt(count / max(count - taken, 0.1 * count)))


# -- first guesses for the adjustment ----------------------------------------------------------------------------------

_CANDIDATES = 3000
_SMALL_M = 5e-3
_CLOSINGS = (0.0, 1.0, 2.0, 3.0)


def choose_instants(positions: Array, count: int, apart: int = 1) -> Indices:
    """At most `count` instants of `positions` (T, M, 3) m, as different from each other as possible, in their order.

    Different in the distances between markers, whatever the hand's place: farthest-point sampling. `apart`: samples
    from one instant whose noise is its own to the next, as after smoothing; those between are left out if enough
    remain, since rare poses would else be taken whole and their noise be believed as often. Instants at which markers
    are missing are left out too.
    """
    seen = np.isfinite(positions[..., 0]).sum(axis=1)
    usable = np.flatnonzero(seen >= max(3, int(0.7 * seen.max(initial=0))))
    spaced = usable[np.diff(usable // apart, prepend=-1) > 0]
    usable = spaced if len(spaced) >= count else usable
    if len(usable) <= count:
        return usable
    usable = usable[np.linspace(0, len(usable) - 1, min(_CANDIDATES, len(usable))).astype(np.int64)]
    first, second = np.triu_indices(positions.shape[1], 1)
    features = np.linalg.norm(positions[usable][:, first] - positions[usable][:, second], axis=2)
    features = features[:, np.isfinite(features).any(axis=0)]  # a marker may never have been seen
    middle = np.nanmedian(features, axis=0)
    low, high = np.nanpercentile(features, [1.0, 99.0], axis=0)  # what lies beyond are mistakes rather than poses
    features = np.where(np.isfinite(features), np.clip(features, low, high), middle) - middle
    features /= np.maximum(high - low, _SMALL_M)  # the last joint's small circles count as much as a whole finger's
    chosen = [int(np.argmin(np.linalg.norm(features, axis=1)))]
    distance = np.full(len(usable), np.inf)
    while len(chosen) < count:
        distance = np.minimum(distance, np.linalg.norm(features - features[chosen[-1]], axis=1))
        chosen.append(int(np.argmax(distance)))
    return np.sort(usable[np.unique(chosen)])


def lay_on(unknowns: HandUnknowns, vector: Array, positions: Array) -> tuple[Poses, Array]:
    """Poses of the hand laid on markers (F, M, 3) m by least squares, and how far off each is, m rms.

    Of several hands, from open to closed, each instant takes the one that fits best. Dots on the palm, which may be
    anywhere on it, take no part.
    """
    takes_part = np.array([not place.on_palm or place.painted for place in unknowns.places])
    best = Poses(np.tile(np.eye(4), (len(positions), 1, 1)), np.zeros((len(positions), len(neutral_pose().angles))))
    off = np.full(len(positions), np.inf)
    for closing in _CLOSINGS:
        angles = neutral_pose().angles.copy()
        angles[4:] *= closing
        hand = expected(unknowns, vector, Poses(np.eye(4)[None], angles[None]))[0]
        for k, markers in enumerate(positions):
            used = takes_part & np.isfinite(markers[:, 0])
            if used.sum() < 3:
                continue
            world = fit_rigid(hand[used], markers[used])
            rms = float(np.sqrt(np.mean((apply(world, hand[used]) - markers[used]) ** 2)))
            if rms < off[k]:
                best.world[k], best.angles[k], off[k] = world, angles, rms
    return best, off


def lay_palm_on(unknowns: HandUnknowns, vector: Array, positions: Array, poses: Poses) -> Poses:
    """The poses with their palms laid on the palm's own markers wherever three of them are seen."""
    on_palm = np.array([place.on_palm for place in unknowns.places])
    hand = unknowns.shape(vector).markers
    world = poses.world.copy()
    for k, markers in enumerate(positions):
        used = on_palm & np.isfinite(markers[:, 0])
        if used.sum() >= 3:
            world[k] = fit_rigid(hand[used], markers[used])
    return Poses(world, poses.angles)
