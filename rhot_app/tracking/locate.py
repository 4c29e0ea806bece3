"""All markers of one instant from pixels to points: undistort, triangulate, set back to the marker's centre."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.filters import one_euro
from rhot_app.geometry.camera import point_rays
from rhot_app.geometry.triangulate import Rays, cast, empty_rays, triangulate
from rhot_app.state import Knowledge
from rhot_app.tracking import trust
from rhot_app.tracking.pairing import DOUBTFUL
from rhot_app.tracking.rig_arrays import locate_by_disparity

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

GATE_FLOOR_PX = 2.5
"""A reprojection error below this (rms over cameras; half the epipolar distance of a pair) is never an outlier:
calibrations drift that far before anybody notices."""

DOUBT_PX = 1.0
"""Rays that miss each other by more (rms over cameras) are no outlier yet, but something is hidden in one view or the
calibration has drifted: such a place is inferred, not measured."""

GATE_SIGMAS = 6.0


@njit(cache=True)
def choose_views(flags: NDArray[np.int64], live: Mask, used: Mask, doubtful: Mask) -> None:
    """Which cameras count for each marker: those that see it beyond doubt if these are two, else all that see it.

    `flags` (C, M) of the bracketing samples, -1 for none; `live` (C,). Fills `used` (C, M), and `doubtful` (M,):
    whether a doubtful observation counts.
    """
    for m in range(flags.shape[1]):
        clear = 0
        for c in range(flags.shape[0]):
            if live[c] and flags[c, m] >= 0 and not flags[c, m] & DOUBTFUL:
                clear += 1
        doubtful[m] = clear < 2
        for c in range(flags.shape[0]):
            seen = live[c] and flags[c, m] >= 0
            used[c, m] = seen and (clear < 2 or not flags[c, m] & DOUBTFUL)


@njit(cache=True)
def _locate(rays: Rays, cameras: Array, used: Mask, shape: Array, position: Array, covariance: Array
            ) -> tuple[float, int]:
    error, outcome = triangulate(rays, cameras, used, position, covariance)
    if outcome == 0 and shape[0, 0] + shape[1, 1] + shape[2, 2] > 0.0:
        centred = Rays(np.empty_like(rays.at), rays.covariances, rays.by_pixel)
        point_rays(rays.at, cameras, shape, position, centred.at)
        error, outcome = triangulate(centred, cameras, used, position, covariance)
    return error, outcome


@njit(cache=True)
def _gate(pixel_covariances: Array, used: Mask) -> float:
    total, count = 0.0, 0
    for c in range(used.shape[0]):
        if used[c]:
            total += 0.5 * (pixel_covariances[c, 0, 0] + pixel_covariances[c, 1, 1])
            count += 1
    return max(GATE_FLOOR_PX, GATE_SIGMAS * math.sqrt(total / max(count, 1)))


@njit(cache=True)
def locate_all(pixels: Array, covariances: Array, used: Mask, intrinsics: Array, cameras: Array, shapes: Array,
               positions: Array, position_covariances: Array, errors: Array) -> None:
    """Locate M markers from C cameras.

    `pixels` (C, M, 2) raw px with `covariances` (C, M, 2, 2); `used` (C, M) which count; `intrinsics` (C, 13),
    `cameras` (C, 3, 4), `shapes` (M, 3, 3) as in `RigArrays`. Fills `positions` (M, 3) m,
    `position_covariances` (M, 3, 3) m^2 and `errors` (M,) px rms. A marker that cannot be located, or whose rays miss
    each other by more than the gate, has NaN positions; in the second case its error is still filled. With three
    cameras or more the one view whose removal leaves the smallest error is given up first, and cleared in `used`.
    """
    count = pixels.shape[0]
    rays = empty_rays(count)
    views, trial = np.empty(count, np.bool_), np.empty(count, np.bool_)
    for m in range(pixels.shape[1]):
        views[:] = used[:, m]
        cast(pixels[:, m], covariances[:, m], intrinsics, views, rays)
        error, outcome = _locate(rays, cameras, views, shapes[m], positions[m], position_covariances[m])
        if outcome == 0 and error > _gate(covariances[:, m], views) and np.sum(views) > 2:
            best, worst = error, -1
            for c in range(count):
                if views[c]:
                    trial[:] = views
                    trial[c] = False
                    error, outcome = _locate(rays, cameras, trial, shapes[m], positions[m], position_covariances[m])
                    if outcome == 0 and error < best:
                        best, worst = error, c
            if worst >= 0:
                views[worst] = False
            error, outcome = _locate(rays, cameras, views, shapes[m], positions[m], position_covariances[m])
        errors[m] = error
        if outcome != 0 or error > _gate(covariances[:, m], views):
            positions[m] = math.nan
            position_covariances[m] = math.nan
        used[:, m] = views


# -- compiled stages of the classic tracker ----------------------------------------------------------------------------
# Between two frames of a live camera the interpreter's own code and data leave the processor's caches, so that a line
# of Python costs some microseconds. Each function here is one stage of a state, without a line in between.

Codes = NDArray[np.uint8]

_MEASURED, _INFERRED, _UNKNOWN = int(Knowledge.MEASURED), int(Knowledge.INFERRED), int(Knowledge.UNKNOWN)


class LocateArrays:
    """Arrays of one state: C cameras, M markers."""

    def __init__(self, cameras: int, markers: int) -> None:
        self.used = np.empty((cameras, markers), np.bool_)
        self.doubtful, self.accepted, self.restarted = np.empty((3, markers), np.bool_)
        self.raw = np.empty((markers, 3))
        self.positions = np.empty((markers, 3))
        self.covariances = np.empty((markers, 3, 3))
        self.errors = np.empty(markers)
        self.knowledge = np.empty(markers, np.uint8)


@njit(cache=True)
def turn_band(world_from_palm: Array, half_axes: Array, shape: Array) -> None:
    """Fill `shape` (3, 3) m^2 of a band that turns with the palm (4, 4)."""
    for i in range(3):
        for j in range(3):
            shape[i, j] = 0.0
            for k in range(3):
                shape[i, j] += world_from_palm[i, k] * half_axes[k] ** 2 * world_from_palm[j, k]


@njit(cache=True)
def locate_raw(t_s: float, flags: NDArray[np.int64], live: Mask, pixels: Array, covariances: Array, intrinsics: Array,
               cameras: Array, shapes: Array, law: Array, reach: Array, memory: Array, confirmed: Mask,
               used: Mask, doubtful: Mask, accepted: Mask, restarted: Mask, raw: Array, raw_covariances: Array,
               errors: Array) -> None:
    """Unfiltered positions decide what to believe. Arrays as in `locate`, `estimate` and `trust`."""
    choose_views(flags, live, used, doubtful)
    _locate_markers(pixels, covariances, used, intrinsics, cameras, shapes, law, raw, raw_covariances, errors)
    trust.judge(t_s, raw, raw_covariances, memory, accepted, restarted)
    trust.keep_within_reach(raw, raw_covariances, reach, memory, accepted, restarted, confirmed)
    trust.confirm(raw, raw_covariances, memory, accepted, doubtful, restarted, reach, confirmed)
    for m in range(raw.shape[0]):
        doubtful[m] |= errors[m] > DOUBT_PX or not confirmed[m]
        if not accepted[m]:
            raw[m] = math.nan
            used[:, m] = False


@njit(cache=True)
def _locate_markers(pixels: Array, covariances: Array, used: Mask, intrinsics: Array, cameras: Array,
                    shapes: Array, law: Array, positions: Array, position_covariances: Array, errors: Array) -> None:
    """By triangulation, or by disparity where the rig has a law for it."""
    if law.shape[0] > 0:
        locate_by_disparity(pixels, covariances, used, law, positions, position_covariances, errors)
    else:
        locate_all(pixels, covariances, used, intrinsics, cameras, shapes, positions,
                          position_covariances, errors)


@njit(cache=True)
def filter_pixels(t_s: float, used: Mask, restarted: Mask, pixels: Array, parameters: Array, pixel_state: Array,
                  position_state: Array, gap_s: float, filtered: Array) -> None:
    """Fill `filtered` (C, M, 2) from the `used` of `pixels`, NaN elsewhere; markers that `restarted` begin anew.

    `parameters` and `pixel_state` (C M 2, 3), `position_state` (M 3, 3) as in `one_euro.step`.
    """
    markers = restarted.shape[0]
    for c in range(pixels.shape[0]):
        for m in range(markers):
            row = 2 * (c * markers + m)
            if restarted[m]:
                pixel_state[row:row + 2] = math.nan
                position_state[3 * m:3 * m + 3] = math.nan
            for k in range(2):
                filtered[c, m, k] = pixels[c, m, k] if used[c, m] else math.nan
    flat = filtered.reshape(-1)
    one_euro.step(t_s, flat, parameters, pixel_state, gap_s, flat)


@njit(cache=True)
def locate_filtered(pixels: Array, covariances: Array, used: Mask, intrinsics: Array, cameras: Array,
                    shapes: Array, law: Array, positions: Array) -> None:
    """Fill `positions` (M, 3) m from filtered pixels; covariances and errors stay those of the unfiltered ones."""
    markers = positions.shape[0]
    _locate_markers(pixels, covariances, used.copy(), intrinsics, cameras, shapes, law, positions,
            np.empty((markers, 3, 3)), np.empty(markers))


@njit(cache=True)
def filter_positions(t_s: float, positions: Array, parameters: Array, state: Array, gap_s: float,
                     accepted: Mask) -> None:
    """Filter `positions` (M, 3) in place; what has none is not `accepted` (M,)."""
    flat = positions.reshape(-1)
    one_euro.step(t_s, flat, parameters, state, gap_s, flat)
    for m in range(positions.shape[0]):
        accepted[m] = accepted[m] and not math.isnan(positions[m, 0] + positions[m, 1] + positions[m, 2])


@njit(cache=True)
def conclude(t_s: float, memory: Array, accepted: Mask, doubtful: Mask, anchors: Array, positions: Array,
             covariances: Array, knowledge: Codes, wrist_marker: int, tip_markers: NDArray[np.int64], wrist: Array,
             tips: Array, tip_knowledge: Codes) -> tuple[int, int]:
    """Say where the markers out of sight should be, how each is known (M,), and what that says of the hand.

    `anchors` (M, 3): last published positions, brought up to date. `wrist_marker` and `tip_markers` (5,) are indices,
    -1 for none; `wrist` (3,), `tips` (5, 3) and `tip_knowledge` (5,) are filled. Returns how many are measured, and
    the wrist's knowledge.
    """
    for m in range(positions.shape[0]):
        if accepted[m]:
            anchors[m] = positions[m]
    trust.predict(t_s, memory, accepted, anchors, positions, covariances)
    measured = 0
    for m in range(positions.shape[0]):
        if accepted[m] and not doubtful[m]:
            knowledge[m] = _MEASURED
            measured += 1
        elif math.isfinite(positions[m, 0] + positions[m, 1] + positions[m, 2]):
            knowledge[m] = _INFERRED
        else:
            knowledge[m] = _UNKNOWN
    wrist[:] = math.nan
    if wrist_marker >= 0:
        wrist[:] = positions[wrist_marker]
    for finger in range(tips.shape[0]):
        marker = tip_markers[finger]
        tips[finger] = math.nan
        tip_knowledge[finger] = _UNKNOWN
        if marker >= 0:
            tips[finger] = positions[marker]
            tip_knowledge[finger] = knowledge[marker]
    return measured, knowledge[wrist_marker] if wrist_marker >= 0 else _UNKNOWN
