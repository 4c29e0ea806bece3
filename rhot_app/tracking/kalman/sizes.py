"""How large what a camera sees is, in metres: what a node states in pixels, at the distance at which the hand is.

A picture is taken row by row. What moves down the picture goes with the rows and is drawn out, what moves up is seen
for fewer of them: a fingertip that falls before a camera of 1 m/s shows several hundredths more of itself.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rhot_app.lean import lean, room
from rhot_app.tracking.kalman.combine import dot
from rhot_app.tracking.kalman.estimate import Estimate
from rhot_app.tracking.kalman.markers import Cameras, Frame, Places, Worn, project_marker

Array = NDArray[np.float64]

LEAST = 0.5
"""A picture is not drawn out to more than twice its height, nor to less than two thirds: nothing that is followed is
as fast as that."""


@lean
def measure_sizes(worn: Worn, cameras: Cameras, frame: Frame, estimate: Estimate, places: Places) -> None:
    """Fill `frame.sizes` as if nothing moved.

    To be called when `frame.label` is known. `places` as `place_markers` has them.
    """
    camera = frame.camera[0]
    place, pixel, slope = room((3,)), room((2,)), room((2, 3))
    for sight in range(worn.part.shape[0]):
        frame.sizes[sight] = 0.0
        if not frame.seen[sight] or not frame.widths[sight] > 0.0:
            continue
        m = frame.label[sight]
        for i in range(3):
            place[i] = places.points[m, i] + estimate.bias[m, i]
        if project_marker(place, estimate.world, worn.half_axes[m], cameras.pose[camera], cameras.intrinsics[camera],
                          pixel, slope):
            down = frame.row_s[0] * _px_per_s(slope[1], places.jacobian[m], estimate.velocity)
            still = 1.0 - min(max(down, -LEAST), LEAST)
            frame.sizes[sight] = frame.widths[sight] * metres_per_px(slope) * math.sqrt(still)


@lean
def metres_per_px(slope: Array) -> float:
    """How large a pixel is, as a ball covers them, where a picture's `slope` is (2, 3) px/m: wherever it is in it."""
    u, v = slope[0], slope[1]
    x, y, z = u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]
    return 1.0 / math.sqrt(math.sqrt(x * x + y * y + z * z))


@lean
def _px_per_s(slope: Array, jacobian: Array, velocity: Array) -> float:
    """How fast what has `jacobian` (3, 27) moves along one of a picture's axes, of which `slope` is (3,) px/m."""
    return float(slope[0] * dot(jacobian[0], velocity) + slope[1] * dot(jacobian[1], velocity)
                 + slope[2] * dot(jacobian[2], velocity))
