"""How much the hand must be accelerating, and which observations are not to be believed: both read from innovations.

A hand at rest is worth long averaging, a hand that starts to move none at all. The innovation itself says which: each
group of the hand is given just as much white acceleration as makes its observations plausible, the palm first, then
what is left to each finger, at once when it moves, fading when nothing surprises any more. A slow motion hides in the
noise of each frame but not in the mean of several, so that mean is watched too.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.tracking.kalman.estimate import FIRST_FINGER, GROUP_OF, GROUPS, LINEAR, POSE, TURN, VELOCITY, Estimate
from rhot_app.tracking.kalman.gain import expected_noise, spread
from rhot_app.tracking.kalman.motion import MOST, jerk_gains, shake
from rhot_app.tracking.kalman.rows import PALM_PART, Rows

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

PLAUSIBLE = 7.4
"""Squared normalised innovation (2 degrees of freedom) that 2.5 % of all exceed by chance."""

ROBUST = 9.0
"""Beyond this an observation's weight falls: its noise is widened until it is no farther off."""

GATE = 25.0
"""Beyond this, with all acceleration that a hand is capable of, it is something else."""

LEAK = 0.15
"""Weight of the newest innovation in the leaky mean."""

ONSET_S = 0.04
"""What surprises began this long ago: it takes until it shows in an image. Agitation is raised as of then."""

_STEP = 3.0


@njit(cache=True)
def appraise(rows: Rows, estimate: Estimate, together: Array, believed: Mask, widening: Array) -> None:
    """Raise the agitation (and the covariance by what it did since its onset), then fill `believed` and `widening` (L,).

    `together` as in `Habits`.
    """
    count, size = rows.count[1], estimate.covariance.shape[0]
    if count == 0:
        return
    gains, grown = np.empty((rows.count[0], size)), jerk_gains(ONSET_S)
    spread(rows, estimate.covariance, gains)
    noise, per_unit, surprise = np.empty((count, 3)), np.empty((count, 3, 3)), np.empty(count)
    for observation in range(count):
        noise[observation] = expected_noise(rows, gains, observation)
        for kind in range(3):
            group = kind if kind < FIRST_FINGER else FIRST_FINGER + rows.part[observation]
            _effect(rows, observation, group, grown, together, per_unit[observation, kind])
    added = np.zeros(GROUPS)
    _raise_palm(rows, estimate, noise, per_unit, LINEAR, added, surprise)
    _raise_palm(rows, estimate, noise, per_unit, TURN, added, surprise)
    for finger in range(GROUPS - FIRST_FINGER):
        _raise_finger(rows, estimate, noise, per_unit, finger, added, surprise)
    for group in range(GROUPS):
        estimate.agitation[group] += added[group]
    shake(estimate.covariance, added, together, ONSET_S)
    for observation in range(count):
        value = _squared(rows, observation, noise, per_unit, added)
        believed[observation] = value < GATE
        widening[observation] = max(1.0, value / ROBUST)
        _note_drift(rows, observation, noise, per_unit, added, estimate.drift, believed[observation])


@njit(cache=True)
def _effect(rows: Rows, observation: int, group: int, gains: Array, together: Array, out: Array) -> None:
    """Fill `out` (3,): innovation variance uu, uv, vv per unit of a group's agitation."""
    out[:] = 0.0
    row, last = rows.first[observation], rows.first[observation + 1] - 1
    for i in range(POSE):
        if GROUP_OF[i] != group:
            continue
        for j in range(POSE):
            if GROUP_OF[j] == group and together[i, j] != 0.0:
                out[0] += together[i, j] * _grown(rows.jacobian[row], rows.jacobian[row], i, j, gains)
                if last > row:
                    out[1] += together[i, j] * _grown(rows.jacobian[row], rows.jacobian[last], i, j, gains)
                    out[2] += together[i, j] * _grown(rows.jacobian[last], rows.jacobian[last], i, j, gains)


@njit(cache=True)
def _grown(a: Array, b: Array, i: int, j: int, gains: Array) -> float:
    """What acceleration of unit variance does, by `gains`, to the product of two rows, by their numbers i and j."""
    total = 0.0
    for m in range(3):
        for n in range(3):
            total += a[VELOCITY * m + i] * b[VELOCITY * n + j] * gains[m, n]
    return total


@njit(cache=True)
def _total(rows: Rows, observation: int, noise: Array, per_unit: Array, added: Array) -> tuple[float, float, float]:
    uu, uv, vv = noise[observation]
    for kind in range(3):
        group = kind
        if kind == FIRST_FINGER:
            if rows.part[observation] == PALM_PART:
                break
            group = FIRST_FINGER + rows.part[observation]
        uu += added[group] * per_unit[observation, kind, 0]
        uv += added[group] * per_unit[observation, kind, 1]
        vv += added[group] * per_unit[observation, kind, 2]
    return uu, uv, vv


@njit(cache=True)
def _squared(rows: Rows, observation: int, noise: Array, per_unit: Array, added: Array) -> float:
    """Squared normalised innovation of one observation, with the acceleration `added` so far."""
    uu, uv, vv = _total(rows, observation, noise, per_unit, added)
    row = rows.first[observation]
    u = rows.residual[row]
    v = rows.residual[row + 1] if rows.first[observation + 1] - row > 1 else 0.0
    return (vv * u * u - 2.0 * uv * u * v + uu * v * v) / (uu * vv - uv * uv)


@njit(cache=True)
def _surprise(rows: Rows, observation: int, estimate: Estimate, noise: Array, per_unit: Array, added: Array) -> float:
    """The larger of this innovation's square and that of the leaky mean with this one, in the same scale."""
    squared = _squared(rows, observation, noise, per_unit, added)
    if rows.source[observation, 0] < 0:
        return squared
    u, v = _drifted(rows, observation, estimate.drift, noise, per_unit, added)
    return max(squared, (u * u + v * v) * (2.0 - LEAK) / LEAK)


@njit(cache=True)
def _drifted(rows: Rows, observation: int, drift: Array, noise: Array, per_unit: Array,
             added: Array) -> tuple[float, float]:
    """The leaky mean of normalised innovations with this one. Past ones count as if the acceleration that is `added`
    now had been known then: else no acceleration could explain them, and the more would be added."""
    camera, marker = rows.source[observation]
    uu, _, vv = _total(rows, observation, noise, per_unit, added)
    row = rows.first[observation]
    u = (1.0 - LEAK) * drift[camera, marker, 0] * np.sqrt(noise[observation, 0] / uu)
    v = (1.0 - LEAK) * drift[camera, marker, 1] * np.sqrt(noise[observation, 2] / vv)
    return u + LEAK * rows.residual[row] / np.sqrt(uu), v + LEAK * rows.residual[row + 1] / np.sqrt(vv)


@njit(cache=True)
def _raise_palm(rows: Rows, estimate: Estimate, noise: Array, per_unit: Array, group: int, added: Array,
                surprise: Array) -> None:
    """Raise one of the palm's groups until the median of the observations that show it is plausible.

    Markers on the palm show its translation; the others, and all of them together, its rotation.
    """
    on_palm = 0
    for observation in range(rows.count[1]):
        on_palm += rows.part[observation] == PALM_PART
    while True:
        chosen = 0
        for observation in range(rows.count[1]):
            if group == TURN or on_palm == 0 or rows.part[observation] == PALM_PART:
                surprise[chosen] = _surprise(rows, observation, estimate, noise, per_unit, added)
                chosen += 1
        if np.median(surprise[:chosen]) <= PLAUSIBLE or not _raise(estimate, added, group):
            return


@njit(cache=True)
def _raise_finger(rows: Rows, estimate: Estimate, noise: Array, per_unit: Array, finger: int, added: Array,
                  surprise: Array) -> None:
    while True:
        worst = 0.0
        for observation in range(rows.count[1]):
            if rows.part[observation] == finger:
                worst = max(worst, _surprise(rows, observation, estimate, noise, per_unit, added))
        if worst <= PLAUSIBLE or not _raise(estimate, added, FIRST_FINGER + finger):
            return


@njit(cache=True)
def _raise(estimate: Estimate, added: Array, group: int) -> bool:
    """Raise a group by one step; False when it is as agitated as any hand."""
    if estimate.agitation[group] + added[group] >= MOST[group]:
        return False
    added[group] = _STEP * added[group] if added[group] > 0.0 else estimate.agitation[group]
    return True


@njit(cache=True)
def _note_drift(rows: Rows, observation: int, noise: Array, per_unit: Array, added: Array, drift: Array,
                believed: bool) -> None:
    camera, marker = rows.source[observation]
    if camera < 0:
        return
    if believed:
        drift[camera, marker, 0], drift[camera, marker, 1] = _drifted(rows, observation, drift, noise, per_unit, added)
    else:
        drift[camera, marker] = 0.0
