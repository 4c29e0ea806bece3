"""The tracker's steps on one instant's markers, several at a time in compiled code.

Between two frames of a live camera the interpreter's own code and data leave the processor's caches, so that a line
of Python costs some microseconds. Each function here is one stage of a state, without a line in between.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.filters import one_euro
from rhot_app.tracking import locate, trust
from rhot_app.tracking.estimate import locate_by_disparity
from rhot_app.tracking.state import Knowledge

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Codes = NDArray[np.uint8]

_MEASURED, _INFERRED, _UNKNOWN = int(Knowledge.MEASURED), int(Knowledge.INFERRED), int(Knowledge.UNKNOWN)


class Sheet:
    """Work sheet of one state: C cameras, M markers."""

    def __init__(self, cameras: int, markers: int) -> None:
        self.used = np.empty((cameras, markers), np.bool_)
        self.doubtful, self.believed, self.restarted = np.empty((3, markers), np.bool_)
        self.raw = np.empty((markers, 3))
        self.positions = np.empty((markers, 3))
        self.covariances = np.empty((markers, 3, 3))
        self.errors = np.empty(markers)
        self.knowledge = np.empty(markers, np.uint8)


@njit(cache=True)
def turn_band(world_from_palm: Array, half_axes: Array, shape: Array) -> None:
    """Fill `shape` (3, 3) m^2 as `silhouette.ellipsoid` does for a band that turns with the palm (4, 4)."""
    for i in range(3):
        for j in range(3):
            shape[i, j] = 0.0
            for k in range(3):
                shape[i, j] += world_from_palm[i, k] * half_axes[k] ** 2 * world_from_palm[j, k]


@njit(cache=True)
def locate_raw(t_s: float, flags: NDArray[np.int64], live: Mask, pixels: Array, covariances: Array, intrinsics: Array,
               cameras: Array, focal: Array, shapes: Array, law: Array, reach: Array, memory: Array, confirmed: Mask,
               used: Mask, doubtful: Mask, believed: Mask, restarted: Mask, raw: Array, raw_covariances: Array,
               errors: Array) -> None:
    """Unfiltered positions decide what to believe. Arrays as in `locate`, `estimate` and `trust`."""
    locate.choose_views(flags, live, used, doubtful)
    _locate(pixels, covariances, used, intrinsics, cameras, focal, shapes, law, raw, raw_covariances, errors)
    trust.judge(t_s, raw, raw_covariances, memory, believed, restarted)
    trust.keep_within_reach(raw, raw_covariances, reach, memory, believed, restarted, confirmed)
    trust.confirm(raw, raw_covariances, memory, believed, doubtful, restarted, reach, confirmed)
    for m in range(raw.shape[0]):
        doubtful[m] |= errors[m] > locate.DOUBT_PX or not confirmed[m]
        if not believed[m]:
            raw[m] = math.nan
            used[:, m] = False


@njit(cache=True)
def _locate(pixels: Array, covariances: Array, used: Mask, intrinsics: Array, cameras: Array, focal: Array,
            shapes: Array, law: Array, positions: Array, position_covariances: Array, errors: Array) -> None:
    """By triangulation, or by disparity where the rig has a law for it."""
    if law.shape[0] > 0:
        locate_by_disparity(pixels, covariances, used, law, positions, position_covariances, errors)
    else:
        locate.locate_all(pixels, covariances, used, intrinsics, cameras, focal, shapes, positions,
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
def locate_filtered(pixels: Array, covariances: Array, used: Mask, intrinsics: Array, cameras: Array, focal: Array,
                    shapes: Array, law: Array, positions: Array) -> None:
    """Fill `positions` (M, 3) m from filtered pixels; covariances and errors stay those of the unfiltered ones."""
    markers = positions.shape[0]
    _locate(pixels, covariances, used.copy(), intrinsics, cameras, focal, shapes, law, positions,
            np.empty((markers, 3, 3)), np.empty(markers))


@njit(cache=True)
def filter_positions(t_s: float, positions: Array, parameters: Array, state: Array, gap_s: float,
                     believed: Mask) -> None:
    """Filter `positions` (M, 3) in place; what has none is not `believed` (M,)."""
    flat = positions.reshape(-1)
    one_euro.step(t_s, flat, parameters, state, gap_s, flat)
    for m in range(positions.shape[0]):
        believed[m] = believed[m] and not math.isnan(positions[m, 0] + positions[m, 1] + positions[m, 2])


@njit(cache=True)
def conclude(t_s: float, memory: Array, believed: Mask, doubtful: Mask, anchors: Array, positions: Array,
             covariances: Array, knowledge: Codes, wrist_marker: int, tip_markers: NDArray[np.int64], wrist: Array,
             tips: Array, tip_knowledge: Codes) -> tuple[int, int]:
    """Say where the markers out of sight should be, how each is known (M,), and what that says of the hand.

    `anchors` (M, 3): last published positions, brought up to date. `wrist_marker` and `tip_markers` (5,) are indices,
    -1 for none; `wrist` (3,), `tips` (5, 3) and `tip_knowledge` (5,) are filled. Returns how many are measured, and
    the wrist's knowledge.
    """
    for m in range(positions.shape[0]):
        if believed[m]:
            anchors[m] = positions[m]
    trust.predict(t_s, memory, believed, anchors, positions, covariances)
    measured = 0
    for m in range(positions.shape[0]):
        if believed[m] and not doubtful[m]:
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
