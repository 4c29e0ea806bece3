"""First guesses for the adjustment: which instants to use, and how the hand lay in each."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.hand_bundle_model import Poses, expected
from rhot_app.calibration.hand_shape import HandUnknowns
from rhot_app.geometry.transforms import apply, fit_rigid
from rhot_app.hand.model import neutral_pose

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

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
