"""The visible outline of layers in one camera: points of their occluding contours, and which layer lies behind.

An outline point is taken as fixed to its link: what it slides along the surface, it slides along the line of sight
(Rehg 1995, eq. 3.12; the envelope theorem). A capsule's contour is that of a hand's (`barehand.contours`); what hides
it is decided by the visibility order, because boxes and tapered links have no common depth that a step could show.
"""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from rhot_app.articulated.bodies import CAPSULE, Bodies, Placed, layer_distances
from rhot_app.articulated.visibility import NONE, front_layers
from rhot_app.barehand.contours import JUMP_M, OUTSIDE_M, STEP_M, capsule_contour, image_normals
from rhot_app.geometry.camera import CameraRecord, project_with_slope

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

POINT = np.dtype([("layer", np.int64), ("behind", np.int64), ("point", np.float64, 3), ("pixel", np.float64, 2),
                  ("across", np.float64, 2)])
"""A point of an outline: `layer`; `behind`: the layer seen beside it, NONE: the background; `point` (3,) m in the frame
of the layer's row; `pixel` (2,) px; `across` (2,): unit, outwards."""

_MOST = 3000  # points of one capsule

Points = tuple[Array, Array]
"""Points (N, 3) m, world, of a body's contour and their outward normals (N, 3)."""


def outline_of(bodies: Bodies, placed: Placed, order: Indices, camera: CameraRecord,
               step_m: float = STEP_M) -> np.recarray:
    """The visible outline (K,) POINT before a camera; a point every `step_m`. Without an `order`, each layer is taken
    as if it were alone."""
    contours = [_capsule(placed.ends[k], bodies.radii[k], camera.centre, step_m) if bodies.kind[k] == CAPSULE else
                _box(placed.box[k], bodies.half[k], camera.centre, step_m) for k in range(len(bodies.row))]
    layers = np.repeat(bodies.layer, [len(points) for points, _ in contours])
    points, normals = (np.concatenate(parts) for parts in zip(*contours, strict=True))
    seen, _ = _met(bodies, placed, order, layers, camera.centre, points - OUTSIDE_M * normals)
    layers, points, normals = (one[seen == layers] for one in (layers, points, normals))
    behind, deeper = _met(bodies, placed, order, layers, camera.centre, points + OUTSIDE_M * normals)
    pixels, slopes = project_with_slope(points, camera.pose, camera.intrinsics)
    inside = np.all((pixels > 0.0) & (pixels < camera.size - 1.0), axis=1)
    across = image_normals(slopes, normals, points - camera.centre)
    good = np.flatnonzero((behind != layers) & (deeper >= JUMP_M) & inside & np.isfinite(across[:, 0]))
    frames = np.concatenate([placed.frames, placed.root[None, :3]])[bodies.layer_row[layers[good]]]
    own = (points[good] - frames[:, :, 3])[:, None] @ frames[:, :, :3]
    return np.rec.fromarrays([layers[good], behind[good], own[:, 0], pixels[good], across[good]], POINT)


def _met(bodies: Bodies, placed: Placed, order: Indices, layers: Indices, centre: Array,
         points: Array) -> tuple[Indices, Array]:
    """(N,) the layer that a ray from `centre` through each of `points` (N, 3) meets first, and how far behind the
    point, m. Without an order, each of `layers` (N,) is alone."""
    rays = points - centre
    far = np.linalg.norm(rays, axis=1)
    rays /= far[:, None]
    layers = front_layers(bodies, placed, order, centre, rays) if len(order) else layers.copy()
    deeper = np.full(len(layers), np.inf)
    for layer in np.setdiff1d(layers, [NONE]):
        own = np.flatnonzero(layers == layer)
        away = layer_distances(bodies, placed, layer, centre, rays[own], 0.0)
        layers[own[away < 0.0]] = NONE
        deeper[own] = np.where(away > 0.0, away - far[own], np.inf)
    return layers, deeper


def _capsule(ends: Array, radii: Array, centre: Array, step_m: float) -> Points:
    points, normals = np.empty((2, _MOST, 3))
    line, ray = ends[1] - ends[0], 0.5 * (ends[0] + ends[1]) - centre
    seen = np.linalg.norm(np.cross(line, ray)) / (np.linalg.norm(line) * np.linalg.norm(ray) + 1e-12)
    count = capsule_contour(ends, radii, np.ones(2, np.bool_), centre, step_m, seen * step_m, np.empty(_MOST, np.int64),
                            np.empty(_MOST), points, normals)
    return points[:count], normals[:count]


def _box(pose: Array, half: Array, centre: Array, step_m: float) -> Points:
    """Points of the edges between a face that is seen and one that is not; their normals are square to the edge and to
    the line of sight."""
    turn, points, normals = pose[:, :3], [np.empty((0, 3))], [np.empty((0, 3))]
    at = turn.T @ (centre - pose[:, 3])
    for i in range(3):
        a, b, number = (i + 1) % 3, (i + 2) % 3, max(int(2.0 * half[i] / step_m + 0.5), 1)
        places = (2.0 * (np.arange(number) + 0.5) / number - 1.0) * half[i]
        for to_a, to_b in product((-1.0, 1.0), (-1.0, 1.0)):
            if (to_a * at[a] > half[a]) != (to_b * at[b] > half[b]):
                edge = pose[:, 3] + to_a * half[a] * turn[:, a] + to_b * half[b] * turn[:, b]
                points.append(edge + places[:, None] * turn[:, i])
                normal = np.cross(points[-1] - centre, turn[:, i])
                outwards = np.sign(normal @ (to_a * turn[:, a] + to_b * turn[:, b]))
                normals.append((outwards / np.linalg.norm(normal, axis=1))[:, None] * normal)
    return np.concatenate(points), np.concatenate(normals)
