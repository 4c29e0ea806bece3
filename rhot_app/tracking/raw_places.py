"""Where the cameras' sights alone have the markers, by Gauss-Newton from where the hand has them.

Sights are of several instants: they are carried to one as the hand moved since. The steps go on until they are shorter
than a hair, so the result has forgotten where it began.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rhot_app.geometry.triangulate import solve_symmetric3
from rhot_app.lean import lean, room, slots
from rhot_app.tracking.kalman.combine import dot
from rhot_app.tracking.kalman.estimate import MOST_CAMERAS, Estimate
from rhot_app.tracking.kalman.markers import Cameras, Places, project_marker
from rhot_app.tracking.locate import EXACT_PX2, GATE_FLOOR_PX, GATE_SIGMAS
from rhot_app.tracking.sights import Seen, is_fresh

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

_STEPS = 10
_SHORT_M = 1e-5
"""Nothing is gained after so short a step; one that is never reached leads nowhere."""

_FARTHEST_M = 0.3
"""A place with a greater standard deviation, all axes together, is none: the rays are as good as parallel."""


class RawPlaces(NamedTuple):
    """M markers: `positions` (M, 3) m, world, with `covariances` (M, 3, 3) m^2, and `errors` (M,) px, by how much rays
    miss each other, rms over the cameras."""

    positions: Array
    covariances: Array
    errors: Array


class _Views(NamedTuple):
    """One marker in C cameras: `pixels` (C, 2) px, carried to one instant; `used` (C,) 1 where it counts, else 0."""

    pixels: Array
    used: Indices


@lean
def locate_raw(half_axes: Array, cameras: Cameras, estimate: Estimate, places: Places, first: int, t_ns: int,
               seen: Seen, out: RawPlaces) -> None:
    """Locate the markers at `t_ns`, to which the estimate has been carried.

    `half_axes` (M, 3) as in `Worn`; markers are the points `first` and later of `places`. A marker that fewer than two
    cameras have just seen is NaN. So is one whose rays miss each other by more than the gate of `locate.py`, but for
    its error; with three cameras or more the one view is given up first whose removal leaves the smallest error.
    """
    views, point = _Views(room((MOST_CAMERAS, 2)), slots((MOST_CAMERAS,))), room((3,))
    for m in range(half_axes.shape[0]):
        out.positions[m], out.covariances[m], out.errors[m] = math.nan, math.nan, math.nan
        begin, covariance = places.points[first + m], out.covariances[m]
        count = _carry(half_axes[m], cameras, estimate, begin, places.jacobian[first + m], m, t_ns, seen, views)
        if count < 2:
            continue
        error = _fit(half_axes[m], cameras, estimate.world, begin, m, seen, views, point, covariance)
        if count > 2 and not error <= _gate_px(seen, views, m):
            _give_up_worst(half_axes[m], cameras, estimate.world, begin, m, seen, views, error, point, covariance)
            error = _fit(half_axes[m], cameras, estimate.world, begin, m, seen, views, point, covariance)
        out.errors[m] = error
        if error <= _gate_px(seen, views, m):
            for i in range(3):
                out.positions[m, i] = point[i]
        else:
            covariance[:] = math.nan


@lean
def _carry(half_axes: Array, cameras: Cameras, estimate: Estimate, point: Array, jacobian: Array, m: int, t_ns: int,
           seen: Seen, out: _Views) -> int:
    """Fill `out` with the cameras' last sights of marker `m`, at `point` (3,) m with `jacobian` (3, 27) per pose
    number, carried to `t_ns`; returns how many are fresh."""
    pixel, slope, speed, count = room((2,)), room((2, 3)), room((3,)), 0
    for i in range(3):
        speed[i] = dot(jacobian[i], estimate.velocity)
    for c in range(seen.times.shape[0]):
        out.used[c] = 0
        if is_fresh(seen, t_ns, c, m) and project_marker(point, estimate.world, half_axes, cameras.pose[c],
                                                         cameras.intrinsics[c], pixel, slope):
            elapsed_s = 1e-9 * (t_ns - seen.times[c, m])
            for k in range(2):
                out.pixels[c, k] = seen.pixels[c, m, k] + elapsed_s * dot(slope[k], speed)
            if _determinant(seen.covariances[c, m]) > 0.0 and math.isfinite(out.pixels[c, 0] + out.pixels[c, 1]):
                out.used[c] = 1
                count += 1
    return count


@lean
def _fit(half_axes: Array, cameras: Cameras, world: Array, begin: Array, m: int, seen: Seen, views: _Views,
         point: Array, covariance: Array) -> float:
    """Fill `point` (3,) m and `covariance` (3, 3) m^2 of marker `m` from `begin` (3,); returns the error, NaN where the
    views do not determine a place."""
    pixel, slope, normal, side, step = room((2,)), room((2, 3)), room((3, 3)), room((3,)), room((3,))
    for i in range(3):
        point[i] = begin[i]
    for _ in range(_STEPS):
        normal[:], side[:] = 0.0, 0.0
        square, count = 0.0, 0
        for c in range(seen.times.shape[0]):
            if views.used[c] == 0:
                continue
            if not project_marker(point, world, half_axes, cameras.pose[c], cameras.intrinsics[c], pixel, slope):
                return math.nan
            u, v = views.pixels[c, 0] - pixel[0], views.pixels[c, 1] - pixel[1]
            square += u * u + v * v
            count += 1
            _add(normal, side, slope, u, v, seen.covariances[c, m])
        if not solve_symmetric3(normal, side, step, covariance):
            return math.nan
        for i in range(3):
            point[i] += step[i]
        if dot(step, step) < _SHORT_M**2:
            known = covariance[0, 0] + covariance[1, 1] + covariance[2, 2] < _FARTHEST_M**2
            return math.sqrt(square / count) if known else math.nan
    return math.nan


@lean
def _determinant(noise: Array) -> float:
    """Of a sight's covariance (2, 2) px^2 as it is weighed."""
    return float(max(noise[0, 0], EXACT_PX2) * max(noise[1, 1], EXACT_PX2) - noise[0, 1] ** 2)


@lean
def _add(normal: Array, side: Array, slope: Array, u: float, v: float, noise: Array) -> None:
    """Add to the normal equations what a sight tells: residuals `u` and `v` px, `slope` (2, 3) px/m, `noise` (2, 2)."""
    uu, vv = max(noise[0, 0], EXACT_PX2), max(noise[1, 1], EXACT_PX2)
    uv, determinant = noise[0, 1], _determinant(noise)
    for i in range(3):
        a = (vv * slope[0, i] - uv * slope[1, i]) / determinant
        b = (uu * slope[1, i] - uv * slope[0, i]) / determinant
        side[i] += a * u + b * v
        for j in range(3):
            normal[i, j] += a * slope[0, j] + b * slope[1, j]


@lean
def _give_up_worst(half_axes: Array, cameras: Cameras, world: Array, begin: Array, m: int, seen: Seen, views: _Views,
                   error: float, point: Array, covariance: Array) -> None:
    """Leave out the one view without which the rest agree best, and better than all."""
    best, worst = error, -1
    for c in range(seen.times.shape[0]):
        if views.used[c] > 0:
            views.used[c] = 0
            found = _fit(half_axes, cameras, world, begin, m, seen, views, point, covariance)
            if found < best or (math.isfinite(found) and not math.isfinite(best)):
                best, worst = found, c
            views.used[c] = 1
    if worst >= 0:
        views.used[worst] = 0


@lean
def _gate_px(seen: Seen, views: _Views, m: int) -> float:
    total, count = 0.0, 0
    for c in range(seen.times.shape[0]):
        if views.used[c] > 0:
            total += 0.5 * (seen.covariances[c, m, 0, 0] + seen.covariances[c, m, 1, 1])
            count += 1
    return max(GATE_FLOOR_PX, GATE_SIGMAS * math.sqrt(total / max(count, 1)))
