"""All markers of one instant from pixels to points: undistort, triangulate, set back to the marker's centre."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.geometry.camera import point_rays
from rhot_app.geometry.triangulate import Outcome, Rays, cast, empty_rays, triangulate
from rhot_app.tracking.pairing import DOUBTFUL, Paired
from rhot_app.tracking.rig_arrays import RigArrays, locate_by_disparity

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

GATE_FLOOR_PX = 2.5
"""A reprojection error below this (rms over cameras; half the epipolar distance of a pair) is never an outlier:
calibrations drift that far before anybody notices."""

GATE_SIGMAS = 6.0

_OK = int(Outcome.OK)


class RigTable(NamedTuple):
    """What locates markers: `intrinsics` (C, 13), `cameras` (C, 3, 4), `shapes` (M, 3, 3), `law` and `reach` (M, M) of
    `RigArrays`."""

    intrinsics: Array
    cameras: Array
    shapes: Array
    law: Array
    reach: Array


class Views(NamedTuple):
    """M markers in C cameras: `pixels` (C, M, 2) raw px with `covariances` (C, M, 2, 2) px^2; `used` (C, M), which of
    them count."""

    pixels: Array
    covariances: Array
    used: Mask


class Places(NamedTuple):
    """Where M markers are: `positions` (M, 3) m with `covariances` (M, 3, 3) m^2, NaN where not located; `errors` (M,)
    px, rms over cameras: how far the rays miss each other."""

    positions: Array
    covariances: Array
    errors: Array


class Located(NamedTuple):
    """Where M markers were at `t_ns`, master ns: `positions` (M, 3) m, world, with `covariances` (M, 3, 3) m^2, NaN
    where not located; `clear` (M,) bool: by two cameras that saw it beyond doubt."""

    t_ns: int
    positions: Array
    covariances: Array
    clear: NDArray[np.bool_]


def rig_table(rig: RigArrays, shapes: Array | None = None) -> RigTable:
    """The rig's; `shapes` replaces its own where a pose turns them."""
    return RigTable(rig.intrinsics, rig.cameras, rig.shapes if shapes is None else shapes, rig.law,
                    rig.reach)


def empty_places(markers: int) -> Places:
    """Room for the places of so many markers."""
    return Places(np.empty((markers, 3)), np.empty((markers, 3, 3)), np.empty(markers))


def locate_paired(paired: Paired, rig: RigTable) -> tuple[Places, Mask]:
    """The places of all markers of one instant, and (M,) whether a doubtful observation counted."""
    places, doubtful = empty_places(len(rig.shapes)), np.empty(len(rig.shapes), np.bool_)
    views = Views(paired.pixels, paired.covariances, np.empty(paired.flags.shape, np.bool_))
    choose_views(paired.flags, paired.live, views.used, doubtful)
    locate_all(views, rig, places)
    return places, doubtful


@njit(cache=True)
def choose_views(flags: NDArray[np.int64], live: Mask, used: Mask, doubtful: Mask) -> None:
    """Which cameras count for each marker: those that see it beyond doubt if these are two, else all that see it.

    `flags` (C, M) of the bracketing samples, -1 for none; `live` (C,). Fills `used` (C, M), and `doubtful` (M,):
    whether a doubtful observation counts.
    """
    for m in range(flags.shape[1]):
        observed = live & (flags[:, m] >= 0)
        clear = observed & ((flags[:, m] & DOUBTFUL) == 0)
        doubtful[m] = np.sum(clear) < 2
        used[:, m] = observed if doubtful[m] else clear


@njit(cache=True)
def _locate(rays: Rays, cameras: Array, used: Mask, shape: Array, position: Array, covariance: Array
            ) -> tuple[float, int]:
    error, outcome = triangulate(rays, cameras, used, position, covariance)
    if outcome == _OK and shape[0, 0] + shape[1, 1] + shape[2, 2] > 0.0:
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
def locate_all(views: Views, rig: RigTable, places: Places) -> None:
    """Fill `places` by triangulation, or by disparity where the rig has a law for it.

    A marker that cannot be located, or whose rays miss each other by more than the gate, has NaN positions; in the
    second case its error is still filled. With three cameras or more the one view whose removal leaves the smallest
    error is given up first, and cleared in `views.used`.
    """
    pixels, covariances, used = views
    if rig.law.shape[0] > 0:
        locate_by_disparity(pixels, covariances, used, rig.law, places.positions, places.covariances, places.errors)
        return
    count = pixels.shape[0]
    rays = empty_rays(count)
    chosen, trial = np.empty(count, np.bool_), np.empty(count, np.bool_)
    for m in range(pixels.shape[1]):
        position, spread, shape = places.positions[m], places.covariances[m], rig.shapes[m]
        chosen[:] = used[:, m]
        cast(pixels[:, m], covariances[:, m], rig.intrinsics, chosen, rays)
        error, outcome = _locate(rays, rig.cameras, chosen, shape, position, spread)
        if outcome == _OK and error > _gate(covariances[:, m], chosen) and np.sum(chosen) > 2:
            best, worst = error, -1
            for c in range(count):
                if chosen[c]:
                    trial[:] = chosen
                    trial[c] = False
                    error, outcome = _locate(rays, rig.cameras, trial, shape, position, spread)
                    if outcome == _OK and error < best:
                        best, worst = error, c
            if worst >= 0:
                chosen[worst] = False
            error, outcome = _locate(rays, rig.cameras, chosen, shape, position, spread)
        places.errors[m] = error
        if outcome != _OK or error > _gate(covariances[:, m], chosen):
            position[:] = math.nan
            spread[:] = math.nan
        used[:, m] = chosen


@njit(cache=True)
def turn_band(world_from_palm: Array, half_axes: Array, shape: Array) -> None:
    """S = R diag(a^2) R^T, filled into `shape` (3, 3) m^2: the body of a band with `half_axes` a (3,) m that turns with
    the palm (4, 4)."""
    for i in range(3):
        for j in range(3):
            shape[i, j] = 0.0
            for k in range(3):
                shape[i, j] += world_from_palm[i, k] * half_axes[k] ** 2 * world_from_palm[j, k]
