"""Which groups of the hand move as they were not expected to, and which observations are not to be believed.

A hand at rest is worth long averaging, a hand that starts to move none at all. How it moves says what acceleration to
expect (`motion.liveliness`); that it starts, only an innovation can say. A group whose observations are far from
plausible is given the acceleration that makes them so, the palm first, then what is left to each finger. A slow start
hides in the noise of each frame, but it corrects the same velocity in the same direction again and again, which a hand
that moves as expected does not. All thresholds are high: whoever answers every large innovation with a larger gain
weighs the worst observations most.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rhot_app.lean import lean, room
from rhot_app.tracking.kalman.estimate import (
    FIRST_FINGER,
    GROUP_OF,
    GROUPS,
    LINEAR,
    PALM_HELD,
    PLACED,
    POSE,
    TURN,
    TURN_HELD,
    VELOCITY,
    Estimate,
)
from rhot_app.tracking.kalman.gain import Gain, expected_noise
from rhot_app.tracking.kalman.median import median
from rhot_app.tracking.kalman.motion import AWAKE, MOST, STILL, jerk_gains, shake
from rhot_app.tracking.kalman.rows import PALM_PART, ROWS_MAX, Rows

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

PLAUSIBLE = 20.0
"""Squared normalised innovation (2 degrees of freedom) that 5 in 100,000 exceed by chance."""

ROBUST = 8.0
"""Beyond this an observation's weight falls: its noise is widened until it is no farther off."""

UNLIKELY = PLAUSIBLE / ROBUST
"""A sight whose noise was widened by more to fit is not beyond doubt: 5 in 100,000 are so by chance."""

GATE = 100.0
"""Beyond this, with all acceleration that a hand is capable of, it is something else."""

LEAK = 0.1
"""Weight of the newest correction in the trend."""

TREND = 14.0
"""Squared normalised trend of one velocity that 2 in 10,000 exceed by chance."""

ONSET_S = 0.04
"""What surprises began this long ago: it takes until it shows in an image. Agitation is raised as of then."""

ASLEEP = 0.25
"""A group with less agitation than this part of what it has awake is woken by a surprise."""

_STEP = 3.0


@lean
def appraise(rows: Rows, estimate: Estimate, together: Array, back: Mask, believed: Mask, widening: Array) -> None:
    """Raise the agitation (and the covariance by what it did since its onset); fill `believed` and `widening` (L,).

    `together` as in `Habits`. Fingers that are `back` (5,) from out of sight do not surprise, wherever they are: where
    they are expected, and how sharply, is linearised about a pose that is far from theirs.
    """
    count, how = rows.used[1], estimate.held[0]
    if count == 0:
        return
    noise, per_unit = room((ROWS_MAX, 3)), room((ROWS_MAX, 3, 3))
    expected_noise(rows, estimate.covariance, noise)
    if _as_expected(rows, estimate, noise, back, believed, widening):
        return
    grown, added = room((3, 3)), room((GROUPS,))
    jerk_gains(ONSET_S, grown)
    per_unit[:count] = 0.0
    added[:] = 0.0
    for observation in range(count):
        for kind in range(3):
            group = kind if kind < FIRST_FINGER else FIRST_FINGER + rows.part[observation]
            _effect(rows, observation, group, grown, together, per_unit[observation, kind])
    if how not in (PLACED, PALM_HELD):
        _raise_palm(rows, noise, per_unit, LINEAR, added)
        if how != TURN_HELD:
            _raise_palm(rows, noise, per_unit, TURN, added)
    for finger in range(GROUPS - FIRST_FINGER):
        if not back[finger]:
            _raise_finger(rows, noise, per_unit, finger, added)
    _follow_trends(estimate, added)
    if how in (PLACED, PALM_HELD):
        added[LINEAR] = 0.0
    if how in (TURN_HELD, PLACED, PALM_HELD):
        added[TURN] = 0.0
    _wake(estimate, added, _of_one_camera(rows))
    shake(estimate.covariance, added, together, ONSET_S)
    for observation in range(count):
        value = 0.0 if _is_of(back, rows, observation) else _squared(rows, observation, noise, per_unit, added)
        believed[observation] = value < GATE
        widening[observation] = max(1.0, value / ROBUST)
        if value > PLAUSIBLE:
            estimate.untroubled[0] = 0.0


@lean
def _as_expected(rows: Rows, estimate: Estimate, noise: Array, back: Mask, believed: Mask, widening: Array) -> bool:
    """Whether nothing surprises, as with most frames: then all is believed, and what acceleration would do need not be
    known."""
    for i in range(POSE):
        if _trend(estimate, i) > TREND:
            return False
    for observation in range(rows.used[1]):
        value = 0.0 if _is_of(back, rows, observation) else _normalised(rows, observation, noise[observation, 0],
                                                                        noise[observation, 1], noise[observation, 2])
        if not value <= PLAUSIBLE:
            return False
        believed[observation], widening[observation] = True, max(1.0, value / ROBUST)
    return True


@lean
def _is_of(fingers: Mask, rows: Rows, observation: int) -> bool:
    """Whether an observation is attached to one of these `fingers` (5,)."""
    part = rows.part[observation]
    return bool(part != PALM_PART and fingers[part])


@lean
def _trend(estimate: Estimate, i: int) -> float:
    """The squared normalised trend of a velocity."""
    return float(estimate.trend[i] ** 2 * (2.0 - LEAK) / LEAK)


@lean
def _follow_trends(estimate: Estimate, added: Array) -> None:
    """Wake the groups whose velocities were corrected the same way for long; a new trend begins."""
    total = room((GROUPS,))  # the largest trend of each group's velocities
    total[:] = 0.0
    for i in range(POSE):
        total[GROUP_OF[i]] = max(total[GROUP_OF[i]], _trend(estimate, i))
    for group in range(GROUPS):
        if total[group] > TREND:
            added[group] = max(added[group], AWAKE[group] ** 2)
    for i in range(POSE):
        if total[GROUP_OF[i]] > TREND:
            estimate.trend[i] = 0.0


@lean
def _of_one_camera(rows: Rows) -> bool:
    """Whether all observations are of the same camera."""
    others = 0
    for observation in range(rows.used[1]):
        others += rows.source[observation, 0] != rows.source[0, 0]
    return others == 0


@lean
def _wake(estimate: Estimate, added: Array, alone: bool) -> None:
    """Wake what surprised, to be as lively as makes it plausible; leave in `added` (7,) what the covariance must learn
    of it.

    Of one camera `alone` an onset is told to the covariance once. Told with every frame, it would let each camera in
    turn shift the hand sideways where the hand's distance is wrong. Cameras that are weighed together do not.
    """
    for group in range(GROUPS):
        if added[group] > 0.0:
            awake = AWAKE[group] ** 2
            asleep = estimate.agitation[group] < ASLEEP * awake
            estimate.agitation[group] = min(max(2.0 * estimate.agitation[group], awake, added[group]), MOST[group])
            added[group] = max(added[group], awake) if asleep or not alone else 0.0


@lean
def _effect(rows: Rows, observation: int, group: int, gains: Array, together: Array, out: Array) -> None:
    """Fill `out` (3,): innovation variance uu, uv, vv per unit of a group's agitation."""
    out[:] = 0.0
    row, last = rows.first[observation], rows.first[observation + 1] - 1
    u, v = rows.jacobian[row], rows.jacobian[last]
    grown_u, grown_v = room((3,)), room((3,))
    for j in range(POSE):
        if GROUP_OF[j] != group:
            continue
        for m in range(3):  # what acceleration of unit variance does to the row's j-th number and its derivatives
            grown_u[m], grown_v[m] = 0.0, 0.0
            for n in range(3):
                grown_u[m] += gains[m, n] * u[VELOCITY * n + j]
                grown_v[m] += gains[m, n] * v[VELOCITY * n + j]
        for i in range(POSE):
            if GROUP_OF[i] == group and together[i, j] != 0.0:
                for m in range(3):
                    out[0] += together[i, j] * u[VELOCITY * m + i] * grown_u[m]
                    out[1] += together[i, j] * u[VELOCITY * m + i] * grown_v[m]
                    out[2] += together[i, j] * v[VELOCITY * m + i] * grown_v[m]
    if last == row:
        out[1], out[2] = 0.0, 0.0


@lean
def _total(rows: Rows, observation: int, noise: Array, per_unit: Array, added: Array) -> tuple[float, float, float]:
    uu, uv, vv = noise[observation, 0], noise[observation, 1], noise[observation, 2]
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


@lean
def _squared(rows: Rows, observation: int, noise: Array, per_unit: Array, added: Array) -> float:
    """Squared normalised innovation of one observation, with the acceleration `added` so far."""
    uu, uv, vv = _total(rows, observation, noise, per_unit, added)
    return _normalised(rows, observation, uu, uv, vv)


@lean
def _normalised(rows: Rows, observation: int, uu: float, uv: float, vv: float) -> float:
    """Squared innovation of one observation, normalised by its covariance."""
    row = rows.first[observation]
    u = rows.residual[row]
    v = rows.residual[row + 1] if rows.first[observation + 1] - row > 1 else 0.0
    return float((vv * u * u - 2.0 * uv * u * v + uu * v * v) / (uu * vv - uv * uv))


@lean
def _raise_palm(rows: Rows, noise: Array, per_unit: Array, group: int, added: Array) -> None:
    """Raise one of the palm's groups until the median of the observations that show it is plausible.

    Markers on the palm show its translation; the others, and all of them together, its rotation.
    """
    on_palm, surprise = 0, room((ROWS_MAX,))
    for observation in range(rows.used[1]):
        on_palm += rows.part[observation] == PALM_PART
    while True:
        chosen = 0
        for observation in range(rows.used[1]):
            if group == TURN or on_palm == 0 or rows.part[observation] == PALM_PART:
                surprise[chosen] = _squared(rows, observation, noise, per_unit, added)
                chosen += 1
        if median(surprise[:chosen]) <= PLAUSIBLE or not _raise(added, group):
            return


@lean
def _raise_finger(rows: Rows, noise: Array, per_unit: Array, finger: int, added: Array) -> None:
    while True:
        worst = 0.0
        for observation in range(rows.used[1]):
            if rows.part[observation] == finger:
                worst = max(worst, _squared(rows, observation, noise, per_unit, added))
        if worst <= PLAUSIBLE or not _raise(added, FIRST_FINGER + finger):
            return


@lean
def _raise(added: Array, group: int) -> bool:
    """Raise a group by one step; False when no hand can do more."""
    if added[group] >= MOST[group]:
        return False
    added[group] = _STEP * added[group] if added[group] > 0.0 else STILL[group] ** 2
    return True


@lean
def note_trend(estimate: Estimate, step: Array, gain: Gain) -> None:
    """Remember how an update corrects the velocities: `step` (N,), and the `gain` by which."""
    held, total = gain.used[0], gain.used[1]
    if total == held:
        return
    variance = room((POSE,))
    variance[:] = 0.0
    for k in range(held, total):
        learnt = gain.rows[k, VELOCITY:VELOCITY + POSE]
        for i in range(POSE):
            variance[i] += learnt[i] ** 2
    for i in range(POSE):
        if variance[i] > 0.0:
            estimate.trend[i] += LEAK * (step[VELOCITY + i] / math.sqrt(variance[i]) - estimate.trend[i])
