"""Markers of two uncalibrated cameras: distance from disparity, the rest from the view angle (RHOT 6.5.2, 7.2.3).

For users without a board. The cameras are taken as equal and parallel; what they are not makes the distances wrong by
some percent everywhere, which the covariances say. Lenses, poses and the markers' bodies are not looked at, and rows
that disagree are no outlier: nobody aligned the cameras.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.project import Rig

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

ERROR_BY_THEORY, ERROR_BY_LAW = 0.05, 0.02
"""Standard deviation of a distance as a part of it: in the thesis's table, by eq. 6.12 and by the power law."""

LEAST_PX = 1.0
"""Less disparity says nothing: a pixel of it is tens of metres away."""


def disparity_law(rig: Rig) -> Array:
    """The rig's `depth` for `locate_by_disparity`: baseline m, focal length px, image centre (2) px, k, z, relative
    error (7,); empty (0,) when the rig finds distances by stereo."""
    depth = rig.depth
    if depth.mode != "disparity":
        return np.empty(0)
    lens = rig.nodes[0].intrinsics
    focal = 0.5 * lens.width / math.tan(0.5 * math.radians(depth.view_angle_deg))
    k, z, error = depth.baseline_m * focal, -1.0, ERROR_BY_THEORY
    if depth.k is not None and depth.z is not None:
        k, z, error = depth.k, depth.z, ERROR_BY_LAW
    return np.array([depth.baseline_m, focal, 0.5 * (lens.width - 1), 0.5 * (lens.height - 1), k, z, error])


@njit(cache=True)
def locate_by_disparity(pixels: Array, covariances: Array, used: Mask, law: Array, positions: Array,
                        position_covariances: Array, errors: Array) -> None:
    """Locate M markers from two cameras, the left one first (or the right one: the magnitude counts).

    Arguments as of `locate.locate_all`, `law` as of `disparity_law`. World frame: the left camera, x right, y down,
    z away. A marker that is not `used` (2, M) by both, or has too little disparity, is NaN; `errors` are always NaN:
    without a calibration nothing says how near rays should meet.
    """
    focal, z = law[1], law[5]
    jacobian = np.empty((3, 4))  # of the position by both cameras' x and y
    ray = np.empty(3)
    for m in range(pixels.shape[1]):
        errors[m] = math.nan
        positions[m] = math.nan
        position_covariances[m] = math.nan
        disparity = pixels[0, m, 0] - pixels[1, m, 0]
        if not (used[0, m] and used[1, m] and abs(disparity) > LEAST_PX):
            used[:, m] = False
            continue
        depth = law[4] * abs(disparity) ** z
        ray[0] = (0.5 * (pixels[0, m, 0] + pixels[1, m, 0]) - law[2]) / focal
        ray[1] = (0.5 * (pixels[0, m, 1] + pixels[1, m, 1]) - law[3]) / focal
        ray[2] = 1.0
        steepness = z * depth / disparity
        for i in range(3):
            positions[m, i] = depth * ray[i]
            jacobian[i, 0], jacobian[i, 2] = steepness * ray[i], -steepness * ray[i]
            jacobian[i, 1], jacobian[i, 3] = 0.0, 0.0
        positions[m, 0] += 0.5 * law[0]
        for camera in range(2):
            jacobian[0, 2 * camera] += 0.5 * depth / focal
            jacobian[1, 2 * camera + 1] += 0.5 * depth / focal
        for i in range(3):
            for j in range(3):
                total = (law[6] * depth) ** 2 * ray[i] * ray[j]
                for camera in range(2):
                    for a in range(2):
                        for b in range(2):
                            total += (jacobian[i, 2 * camera + a] * covariances[camera, m, a, b]
                                      * jacobian[j, 2 * camera + b])
                position_covariances[m, i, j] = total
