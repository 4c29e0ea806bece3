"""Which located markers are inliers, and what to say of those that are not located: the classic tracker's tracks.

Between two frames of a live camera the interpreter's own code and data leave the processor's caches, so that a line of
Python costs some microseconds. `locate_inliers` and `conclude` are one stage of a state each, without a line between.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.estimation.track import LOST_NS
from rhot_app.filters.one_euro import RESET_GAP_S
from rhot_app.state import Knowledge
from rhot_app.tracking.association import GATE
from rhot_app.tracking.locate import Places, RigTable, Views, choose_views, locate_all

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Codes = NDArray[np.uint8]
Indices = NDArray[np.int64]
Tracks = NDArray[np.void]

SPEED_LIMIT = 10.0
"""No hand moves faster, m/s (a boxer's fist peaks near 10): beyond it a marker jumped to another thing."""

ACCELERATION_LIMIT = 120.0
"""Nor does it change its speed faster, m/s^2: waving 30 cm wide four times a second takes 95."""

ACCELERATION_SD = ACCELERATION_LIMIT / math.sqrt(GATE)
"""m/s^2: process noise with which a hand at the acceleration limit lies on the gate."""

POSITION_SD_M = 2e-3
"""m: standard deviation of a tracked marker's last position, for the noise and latency of the tracker."""

SIGMAS = 5.0
"""Standard deviations of a distance beyond which it is no measurement error."""

JUMP_FLOOR_M = 0.02
"""m: by what the cameras' calibration may change between two places, beside the stated errors."""

CONFIRMATIONS = 3
"""A jump is accepted when the marker stays at the new place for this many states."""

FORGET_S = 1e-9 * LOST_NS
"""After this long any place is as likely as any other."""

MOVED_M = 5e-3
"""Less motion than this, m, may be the calibration's and a shadow's: a track has to move farther to be a hand's."""

MEASURED_SD_MAX_M = 0.042
"""m: half a palm's breadth (ANSUR: 84 mm). A marker with a greater standard deviation could be any finger's."""

MOVING, STILL = 2, 4
"""Other tracks of the hand that confirm one: such as have moved, where it has moved; any, as chance does not bring so
many."""

DOUBT_PX = 1.0
"""Rays that miss each other by more (rms over cameras) are no outlier yet, but something is hidden in one view or the
calibration has drifted: such a place is inferred, not measured."""

VELOCITY_TIME_S = 0.03
"""s: low-pass of the velocity that predictions use."""

_MEASURED, _INFERRED, _UNKNOWN = int(Knowledge.MEASURED), int(Knowledge.INFERRED), int(Knowledge.UNKNOWN)


TRACK = np.dtype([
    ("t_s", "f8"), ("place", "f8", 3), ("speed", "f8", 3), ("step_s", "f8"), ("velocity", "f8", 3), ("start", "f8", 3),
    ("jump_s", "f8"), ("jump_place", "f8", 3), ("jumps", "i8"), ("confirmed", "?"), ("published", "f8", 3)])
"""One marker. `t_s`: when it was an inlier last, NaN without a track, at `place` m; before that it moved at `speed` m/s
for `step_s`, NaN in a new track; `velocity` m/s is smoothed. `start` m: where it began. `jump_s`, `jump_place`,
`jumps`: when and where it was last beyond its reach, and how often in a row. `confirmed`: it is a marker of the hand.
`published` m: its last filtered place."""


class Verdicts(NamedTuple):
    """(M,) each: which markers are `accepted`; which of these have `restarted`, not having got there continuously, so
    that filters start anew; where the place is `doubtful`."""

    accepted: Mask
    restarted: Mask
    doubtful: Mask


class Targets(NamedTuple):
    """The wrist and the five fingertips: `positions` (6, 3) m, NaN where unknown, and `knowledge` (6,)."""

    positions: Array
    knowledge: Codes


def no_tracks(markers: int) -> Tracks:
    """(M,) `TRACK` of markers that nobody has observed."""
    tracks = np.zeros(markers, TRACK)
    tracks["t_s"] = tracks["jump_s"] = np.nan
    return tracks


def no_verdicts(markers: int) -> Verdicts:
    """Room for those of so many markers."""
    return Verdicts(*np.zeros((3, markers), np.bool_))


@njit(cache=True)
def locate_inliers(t_s: float, flags: Indices, live: Mask, views: Views, rig: RigTable, tracks: Tracks,
                   verdicts: Verdicts, places: Places) -> None:
    """Fill the places of all markers at `t_s`, NaN for outliers, the verdicts, and which of the views count. `flags`
    (C, M) and `live` (C,) as in `Paired`."""
    choose_views(flags, live, views.used, verdicts.doubtful)
    locate_all(views, rig, places)
    judge(t_s, places, tracks, verdicts)
    keep_within_reach(places, rig.reach, tracks, verdicts)
    confirm(places, rig.reach, tracks, verdicts)
    for m in range(tracks.shape[0]):
        verdicts.doubtful[m] |= places.errors[m] > DOUBT_PX or not tracks[m].confirmed
        if not verdicts.accepted[m]:
            places.positions[m] = math.nan
            views.used[:, m] = False


@njit(cache=True)
def _sd(covariance: Array) -> float:
    return math.sqrt(max(covariance[0, 0] + covariance[1, 1] + covariance[2, 2], 0.0))


@njit(cache=True)
def _distance(a: Array, b: Array) -> float:
    return math.sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2)


@njit(cache=True)
def _reachable(position: Array, sd_m: float, since: Array, speed: Array, step_s: float, dt: float) -> bool:
    """|x - x0| <= v_max dt and |x - x0 - v dt| <= a_max dt (dt + step) / 2: whether a hand that came to `since` x0 at
    `speed` v for `step_s` (NaN: unknown) can be at `position` x after `dt` s."""
    margin, squared = SIGMAS * sd_m + JUMP_FLOOR_M, 0.0
    for k in range(3):
        squared += (position[k] - since[k] - speed[k] * dt) ** 2
    return bool(_distance(position, since) <= SPEED_LIMIT * dt + margin and not (
        math.sqrt(squared) > 0.5 * ACCELERATION_LIMIT * dt * (dt + step_s) + margin))


@njit(cache=True)
def judge(t_s: float, places: Places, tracks: Tracks, verdicts: Verdicts) -> None:
    """Decide for each located marker whether it can have got there, and continue its track if so."""
    for m in range(tracks.shape[0]):
        position, track = places.positions[m], tracks[m]
        verdicts.accepted[m] = verdicts.restarted[m] = False
        if not math.isfinite(position[0]):
            continue
        sd_m, dt, jump_dt = _sd(places.covariances[m]), t_s - track.t_s, t_s - track.jump_s
        new = not dt <= FORGET_S
        steady = jump_dt <= FORGET_S and _reachable(position, sd_m, track.jump_place, track.speed, math.nan, jump_dt)
        # Waiting makes every place reachable: a marker that stays where it jumped to has still jumped.
        stayed = steady and _distance(position, track.jump_place) < _distance(position, track.place)
        if not new and (stayed or not _reachable(position, sd_m, track.place, track.speed, track.step_s, dt)):
            track.jumps = track.jumps + 1 if steady else 1
            track.jump_s = t_s
            track.jump_place[:] = position
            if track.jumps < CONFIRMATIONS:
                continue
            new = True
        if new:
            track.step_s = math.nan
            track.start[:] = position
            track.velocity[:] = 0.0
        elif dt > 0.0:
            share = dt / (dt + VELOCITY_TIME_S) if track.step_s > 0.0 else 1.0
            track.step_s = dt
            for k in range(3):
                track.speed[k] = (position[k] - track.place[k]) / dt
                track.velocity[k] += share * (track.speed[k] - track.velocity[k])
        track.t_s, track.jump_s = t_s, math.nan
        track.place[:] = position
        verdicts.accepted[m], verdicts.restarted[m] = True, new


@njit(cache=True)
def keep_within_reach(places: Places, reach: Array, tracks: Tracks, verdicts: Verdicts) -> None:
    """Reject accepted markers that are farther from other ones than the hand's `reach` (M, M) m allows.

    The marker with the most contradictions is rejected first. In a tie those are rejected whose track is not confirmed
    or has just restarted; without any such, all of the tie. The track of a rejected marker ends.
    """
    accepted, restarted, _ = verdicts
    count = len(accepted)
    contradicted = np.zeros((count, count))
    for m in range(count):
        for n in range(m):
            sd_m = math.hypot(_sd(places.covariances[m]), _sd(places.covariances[n]))
            if _distance(places.positions[m], places.positions[n]) > reach[m, n] + SIGMAS * sd_m:
                contradicted[m, n] = contradicted[n, m] = 1.0
    while contradicted.any():
        contradictions = accepted * (contradicted @ accepted.astype(np.float64))
        if contradictions.max() == 0.0:
            return
        worst = contradictions == contradictions.max()
        unsure = worst & (restarted | ~tracks["confirmed"])
        for rejected in np.flatnonzero(unsure if unsure.any() else worst):
            accepted[rejected] = restarted[rejected] = tracks[rejected].confirmed = False
            tracks[rejected].t_s = tracks[rejected].jump_s = math.nan


@njit(cache=True)
def confirm(places: Places, reach: Array, tracks: Tracks, verdicts: Verdicts) -> None:
    """Update which tracks are confirmed as markers of the hand; `reach` (M, M) m, infinite off the hand.

    A marker has only its colour to distinguish it from another object, which does not move. A track is confirmed once
    it has moved and two other tracks of the hand have, or once five markers of the hand, or all of a smaller set, are
    accepted together. A doubtful marker neither confirms others nor is confirmed itself. One becomes doubtful whose
    position is not known to MEASURED_SD_MAX_M. A restarted track starts unconfirmed.
    """
    count = len(reach)
    sure, moved = np.empty(count, np.bool_), np.empty(count, np.bool_)
    for m in range(count):
        sd_m = _sd(places.covariances[m])
        verdicts.doubtful[m] |= not sd_m < MEASURED_SD_MAX_M
        sure[m] = verdicts.accepted[m] and not verdicts.doubtful[m]
        moved[m] = sure[m] and _distance(places.positions[m], tracks[m].start) > MOVED_M + SIGMAS * sd_m
    for m in range(count):
        others = np.isfinite(reach[m])
        others[m] = False
        joined = (np.sum(others & sure) >= min(STILL, np.sum(others))
                  or (moved[m] and np.sum(others & moved) >= MOVING))
        tracks[m].confirmed = (tracks[m].confirmed and not verdicts.restarted[m]) or (joined and sure[m])


def predict(tracks: Tracks, t_s: float) -> tuple[Array, Array]:
    """x + v t: (M, 3) m where confirmed markers are at `t_s`, NaN of those without a track, and their variances (M,)
    m^2 on every axis."""
    dt = t_s - tracks["t_s"]
    known = tracks["confirmed"] & (np.abs(dt) < FORGET_S)
    return (np.where(known[:, None], tracks["place"] + dt[:, None] * tracks["velocity"], np.nan),
            POSITION_SD_M**2 + (0.5 * ACCELERATION_SD * dt * dt) ** 2)


@njit(cache=True)
def conclude(t_s: float, tracks: Tracks, verdicts: Verdicts, roles: Indices, places: Places, targets: Targets
             ) -> Codes:
    """How each marker is known (M,), with those that are not located predicted, and the `targets` filled.

    x0 + v t with the standard deviations a t^2 / 2 and POSITION_SD_M on each axis, for RESET_GAP_S; NaN after that.
    `roles` (6,): the markers of wrist and fingertips, -1 for none.
    """
    positions, knowledge = places.positions, np.empty(tracks.shape[0], np.uint8)
    for m in range(tracks.shape[0]):
        track, position = tracks[m], positions[m]
        dt = t_s - track.t_s
        if verdicts.accepted[m]:
            track.published[:] = position
            knowledge[m] = _INFERRED if verdicts.doubtful[m] else _MEASURED
        elif 0.0 <= dt <= RESET_GAP_S:
            for k in range(3):
                position[k] = track.published[k] + dt * track.velocity[k]
            places.covariances[m] = (POSITION_SD_M**2 + (0.5 * ACCELERATION_SD * dt * dt) ** 2) * np.eye(3)
            knowledge[m] = _INFERRED
        else:
            position[:], places.covariances[m], knowledge[m] = math.nan, math.nan, _UNKNOWN
    for k in range(roles.shape[0]):
        targets.positions[k], targets.knowledge[k] = math.nan, _UNKNOWN
        if roles[k] >= 0:
            targets.positions[k], targets.knowledge[k] = positions[roles[k]], knowledge[roles[k]]
    return knowledge
