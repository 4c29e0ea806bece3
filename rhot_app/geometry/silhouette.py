"""Where the silhouette of a marker with a body lies in the image: not where its centre projects.

A sphere of radius r whose centre stands at the angle phi from the optical axis, at distance D, is seen between
tan(phi - alpha) and tan(phi + alpha) with sin(alpha) = r / D. The middle of the two is

    sin(phi) cos(phi) / (cos(phi)^2 - sin(alpha)^2) = tan(phi) / (1 - r^2 / Z^2),    Z = D cos(phi),

exactly as if the centre stood at Z - r^2 / Z: every camera sees it too near, and so does triangulation. A cylinder, and a
capsule or band, does the same across its axis. 26 mm of wrist at 0.6 m make 1.1 mm of depth.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]


@njit(cache=True)
def point_rays(rays: Array, cameras: Array, radius: float, position: Array, out: Array) -> None:
    """Normalised coordinates of a round marker's centre from those of its silhouette's centroid.

    `rays` (C, 2) as seen; `cameras` (C, 3, 4) camera_from_world; `radius` m; `position` (3,) m where the rays as they
    are meet, at Z' = Z - r^2 / Z. Writes `out` (C, 2): rays * (1 - r^2 / Z^2), unchanged for a point inside the body.
    """
    for c in range(rays.shape[0]):
        near = cameras[c, 2, 3]
        for k in range(3):
            near += cameras[c, 2, k] * position[k]
        factor = 1.0
        if math.isfinite(near) and near > 2.0 * radius:
            z = 0.5 * (near + math.sqrt(near * near + 4.0 * radius * radius))
            factor = 1.0 - (radius / z) ** 2
        out[c, 0] = rays[c, 0] * factor
        out[c, 1] = rays[c, 1] * factor
