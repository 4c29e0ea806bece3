"""Which located markers to believe, and what to say of those that are not located: one small memory per marker."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.estimation.track import LOST_NS

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

SPEED_LIMIT = 10.0
"""No hand moves faster, m/s (a boxer's fist peaks near 10): beyond it a marker jumped to another thing."""

ACCELERATION_LIMIT = 120.0
"""Nor does it change its speed faster, m/s^2: waving 30 cm wide four times a second takes 95."""

JUMP_FLOOR_M = 0.02
CONFIRMATIONS = 3
"""A jump is accepted when the marker stays at the new place for this many states."""

FORGET_S = 1e-9 * LOST_NS
"""After this long any place is as likely as any other."""

PREDICT_S = 0.25
"""How long a marker out of sight is carried on at constant velocity."""

ACCELERATION_SD = 10.0
VELOCITY_SD = 0.05
MOVED_M = 5e-3
"""Less motion than this, m, may be the calibration's and a shadow's: a track has to move farther to be a hand's."""

_REACH_SIGMAS = 5.0  # standard deviations of a distance beyond the hand's reach, as in `_reachable`
MEASURED_SD_MAX_M = 0.042
"""m: half a palm's breadth (ANSUR: 84 mm). A marker with a greater standard deviation could be any finger's."""

_CONFIRMING_MARKERS = 2  # other tracks of the hand that have moved and confirm one that has
_STILL_MARKERS = 4  # other markers of the hand that confirm a track without motion: chance does not bring so many
VELOCITY_TIME_S = 0.03  # low-pass of the velocity that predictions use

# Columns of the memory, one row per marker: time, position, smoothed velocity, last step and its duration, then the
# jump that waits for confirmation, and where the track began.
_T, _X, _V, _STEP, _STEP_S, _JUMP_T, _JUMP_X, _JUMPS, _START = 0, 1, 4, 7, 10, 11, 12, 15, 16
COLUMNS = 19


def empty_memory(markers: int) -> Array:
    """(M, 19) memory of markers never seen."""
    return np.full((markers, COLUMNS), np.nan)


@njit(cache=True)
def _reachable(position: Array, covariance: Array, since: Array, step: Array, step_s: float, dt: float) -> bool:
    """Whether a hand that came to `since` by `step` in `step_s` (NaN: unknown) can be at `position` after `dt` s."""
    squared = 0.0
    for k in range(3):
        squared += (position[k] - since[k] - step[k] * dt / step_s) ** 2
    margin = 5.0 * math.sqrt(max(covariance[0, 0] + covariance[1, 1] + covariance[2, 2], 0.0)) + JUMP_FLOOR_M
    if _distance(position, since) > SPEED_LIMIT * dt + margin:
        return False
    return not math.sqrt(squared) > 0.5 * ACCELERATION_LIMIT * dt * (dt + step_s) + margin


@njit(cache=True)
def _distance(a: Array, b: Array) -> float:
    return math.sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2)


@njit(cache=True)
def judge(t_s: float, positions: Array, covariances: Array, memory: Array, accepted: Mask, restarted: Mask) -> None:
    """Decide for each located marker whether it can have got there, and remember it if so.

    `positions` (M, 3) m with `covariances` (M, 3, 3), NaN where not located. Fills `accepted` (M,), and `restarted`
    (M,): accepted although it did not get there continuously, so filters must start anew.
    """
    unknown = np.full(3, np.nan)
    for m in range(positions.shape[0]):
        accepted[m] = restarted[m] = False
        position = positions[m]
        if not math.isfinite(position[0] + position[1] + position[2]):
            continue
        row = memory[m]
        dt = t_s - row[_T]
        fresh = not dt <= FORGET_S
        steady = t_s - row[_JUMP_T] <= FORGET_S and _reachable(
            position, covariances[m], row[_JUMP_X:_JUMP_X + 3], unknown, math.nan, t_s - row[_JUMP_T])
        # Waiting makes every place reachable: a marker that stays where it jumped to has still jumped.
        stayed = steady and _distance(position, row[_JUMP_X:_JUMP_X + 3]) < _distance(position, row[_X:_X + 3])
        if not fresh and (stayed or not _reachable(position, covariances[m], row[_X:_X + 3], row[_STEP:_STEP + 3],
                                                   row[_STEP_S], dt)):
            row[_JUMPS] = row[_JUMPS] + 1.0 if steady else 1.0
            row[_JUMP_T] = t_s
            row[_JUMP_X:_JUMP_X + 3] = position
            if row[_JUMPS] < CONFIRMATIONS:
                continue
            fresh = True
        if fresh:
            row[_V:_STEP_S + 1] = math.nan
            row[_START:_START + 3] = position
        elif dt > 0.0:
            weight = dt / (dt + VELOCITY_TIME_S)
            row[_STEP_S] = dt
            for k in range(3):
                row[_STEP + k] = position[k] - row[_X + k]
                speed = (position[k] - row[_X + k]) / dt
                row[_V + k] = speed if math.isnan(row[_V + k]) else row[_V + k] + weight * (speed - row[_V + k])
        row[_T] = t_s
        row[_X:_X + 3] = position
        row[_JUMP_T] = math.nan
        row[_JUMPS] = 0.0
        accepted[m] = True
        restarted[m] = fresh


@njit(cache=True)
def keep_within_reach(positions: Array, covariances: Array, reach: Array, memory: Array, accepted: Mask,
                      restarted: Mask, confirmed: Mask) -> None:
    """Reject `accepted` markers (M,) that are farther from other ones than the hand's reach allows.

    `positions` (M, 3) m with `covariances` (M, 3, 3) m^2; `reach` (M, M) m, the greatest distances. The marker with
    the most contradictions is rejected first. In a tie those are rejected whose track is not `confirmed` (M,) or has
    just `restarted` (M,); without any such, all of the tie. A rejected marker's `memory` is cleared.
    """
    count = positions.shape[0]
    contradictions = np.empty(count, np.int64)
    while True:
        most, any_new = 0, False
        for m in range(count):
            contradictions[m] = 0
            for n in range(count):
                if accepted[m] and accepted[n]:
                    contradictions[m] += _beyond_reach(positions, covariances, reach, m, n)
            if contradictions[m] > most:
                most, any_new = contradictions[m], False
            any_new |= contradictions[m] == most and (restarted[m] or not confirmed[m])
        if most == 0:
            return
        for m in range(count):
            if contradictions[m] == most and not (any_new and confirmed[m] and not restarted[m]):
                accepted[m] = restarted[m] = confirmed[m] = False
                memory[m] = math.nan


@njit(cache=True)
def _beyond_reach(positions: Array, covariances: Array, reach: Array, m: int, n: int) -> bool:
    """Whether markers m and n are certainly farther apart than `reach`."""
    if m == n or not math.isfinite(reach[m, n]):
        return False
    variance = 0.0
    for k in range(3):
        variance += covariances[m, k, k] + covariances[n, k, k]
    return _distance(positions[m], positions[n]) > reach[m, n] + _REACH_SIGMAS * math.sqrt(max(variance, 0.0))


@njit(cache=True)
def confirm(positions: Array, covariances: Array, memory: Array, accepted: Mask, doubtful: Mask, restarted: Mask,
            reach: Array, confirmed: Mask) -> None:
    """Update which tracks are `confirmed` (M,) as markers of the hand; `reach` (M, M) m, infinite off the hand.

    A marker has only its colour to distinguish it from another object, which does not move. A track is confirmed once
    it has moved and two other tracks of the hand have, or once five markers of the hand, or all of a smaller set, are
    accepted together.
    `positions` (M, 3) m with `covariances` (M, 3, 3) m^2; a `doubtful` (M,) one neither confirms others nor is
    confirmed itself. One becomes doubtful whose position is not known to MEASURED_SD_MAX_M. A restarted track starts
    unconfirmed.
    """
    count = positions.shape[0]
    moved = np.empty(count, np.bool_)
    for m in range(count):
        variance = covariances[m, 0, 0] + covariances[m, 1, 1] + covariances[m, 2, 2]
        doubtful[m] |= not variance < MEASURED_SD_MAX_M**2
        moved[m] = accepted[m] and not doubtful[m] and (
            _distance(positions[m], memory[m, _START:_START + 3]) > MOVED_M + _REACH_SIGMAS * math.sqrt(variance))
    for m in range(count):
        on_hand = together = together_moved = 0
        for n in range(count):
            if m != n and math.isfinite(reach[m, n]):
                on_hand += 1
                together += accepted[n] and not doubtful[n]
                together_moved += moved[n]
        if restarted[m]:
            confirmed[m] = False
        joined = together >= min(_STILL_MARKERS, on_hand) or (moved[m] and together_moved >= _CONFIRMING_MARKERS)
        if joined and accepted[m] and not doubtful[m]:
            confirmed[m] = True


@njit(cache=True)
def predict(t_s: float, memory: Array, located: Mask, origin: Array, positions: Array, covariances: Array) -> None:
    """Carry on the markers that are not `located` (M,) from `origin` (M, 3), their last published position.

    Fills their `positions` (M, 3) m and `covariances` (M, 3, 3) m^2, growing as the square of time; NaN when they
    were last seen more than PREDICT_S ago.
    """
    for m in range(positions.shape[0]):
        if located[m]:
            continue
        dt = t_s - memory[m, _T]
        positions[m] = math.nan
        covariances[m] = math.nan
        if not 0.0 <= dt <= PREDICT_S:
            continue
        variance = (0.5 * ACCELERATION_SD * dt * dt) ** 2 + (VELOCITY_SD * dt) ** 2 + 1e-6
        for k in range(3):
            speed = memory[m, _V + k]
            positions[m, k] = origin[m, k] + (0.0 if math.isnan(speed) else speed * dt)
            for j in range(3):
                covariances[m, k, j] = variance if j == k else 0.0
