"""Where the silhouette of a marker with a body lies in the image: not where its centre projects.

A sphere of radius r whose centre stands at the angle phi from the optical axis, at distance D, is seen between
tan(phi - alpha) and tan(phi + alpha) with sin(alpha) = r / D. The middle of the two is

    sin(phi) cos(phi) / (cos(phi)^2 - sin(alpha)^2) = tan(phi) / (1 - r^2 / Z^2),    Z = D cos(phi),

exactly as if the centre stood at Z - r^2 / Z: every camera sees it too near, and so does triangulation. A cylinder,
and a capsule or band, does the same across its axis. 26 mm of wrist at 0.6 m make 1.1 mm of depth.

An ellipsoid with centre c and shape matrix A (x^T A^-1 x = 1 on its surface) is seen as the conic with the dual matrix
A - c c^T (Hartley and Zisserman 2004, 8.3), whose centre is

    x = (X Z - A_xz) / (Z^2 - A_zz),    y alike,

which for a sphere, A = r^2 I, is the formula above.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]


@njit(cache=True)
def point_rays(rays: Array, cameras: Array, shape: Array, position: Array, out: Array) -> None:
    """Normalised coordinates of a marker's centre from those of its silhouette's centroid.

    `rays` (C, 2) as seen; `cameras` (C, 3, 4) camera_from_world; `shape` (3, 3) m^2, the marker's ellipsoid in the
    world's axes (r^2 I for a sphere); `position` (3,) m where the rays as they are meet, at Z' = Z - A_zz / Z.
    Writes `out` (C, 2); unchanged rays for a point inside the body or unknown.
    """
    for c in range(rays.shape[0]):
        out[c] = rays[c]
        near = cameras[c, 2, 3]
        for k in range(3):
            near += cameras[c, 2, k] * position[k]
        xz, yz, zz = 0.0, 0.0, 0.0
        for i in range(3):
            for j in range(3):
                half = shape[i, j] * cameras[c, 2, j]
                xz += cameras[c, 0, i] * half
                yz += cameras[c, 1, i] * half
                zz += cameras[c, 2, i] * half
        if not (math.isfinite(near) and near > 2.0 * math.sqrt(max(zz, 0.0))):
            continue
        z = 0.5 * (near + math.sqrt(near * near + 4.0 * zz))
        out[c, 0] = rays[c, 0] * (1.0 - zz / (z * z)) + xz / (z * z)
        out[c, 1] = rays[c, 1] * (1.0 - zz / (z * z)) + yz / (z * z)


def ball(radius: float) -> Array:
    """Shape matrix (3, 3) m^2 of a sphere; of a point for radius 0."""
    return radius**2 * np.eye(3)


def ellipsoid(rotation: Array, half_axes: Array) -> Array:
    """Shape matrix (3, 3) m^2 of an ellipsoid whose `half_axes` (3,) m lie along the columns of `rotation` (3, 3)."""
    return np.asarray((rotation * np.square(half_axes)) @ rotation.T)
