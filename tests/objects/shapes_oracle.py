"""Distances by other means: a box face by face, triangles by projection and by their edges, the sign by winding."""

from __future__ import annotations

import numpy as np


def box_distance(point, sides):
    """Unsigned distance to the surface of a box, by clamping to each of its six faces."""
    half, best = 0.5 * np.asarray(sides), np.inf
    for axis in range(3):
        for side in (-1.0, 1.0):
            near = np.clip(point, -half, half)
            near[axis] = side * half[axis]
            best = min(best, float(np.linalg.norm(point - near)))
    return best


def surface_distance(point, triangles):
    """Distance to triangles (F, 3, 3): to a plane where the foot lies inside of its triangle, else to three edges."""
    ends = np.roll(triangles, -1, axis=1)
    edges = ends - triangles
    along = np.clip(np.sum((point - triangles) * edges, axis=2) / np.sum(edges**2, axis=2), 0.0, 1.0)
    to_edges = np.linalg.norm(point - triangles - along[..., None] * edges, axis=2).min()
    normals = np.cross(edges[:, 0], edges[:, 1])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    heights = np.sum((point - triangles[:, 0]) * normals, axis=1)
    feet = point - heights[:, None] * normals
    sides = np.sum(np.cross(edges, feet[:, None] - triangles) * normals[:, None], axis=2)
    return min(to_edges, np.abs(heights)[(sides >= 0.0).all(axis=1)].min(initial=np.inf))


def winding_number(point, triangles):
    """1 inside of a closed surface, 0 outside (Van Oosterom and Strackee 1983)."""
    a, b, c = (triangles[:, k] - point for k in range(3))
    la, lb, lc = (np.linalg.norm(one, axis=1) for one in (a, b, c))
    top = np.einsum("fi,fi->f", a, np.cross(b, c))
    bottom = (la * lb * lc + np.einsum("fi,fi->f", a, b) * lc + np.einsum("fi,fi->f", b, c) * la
              + np.einsum("fi,fi->f", c, a) * lb)
    return float(np.sum(2.0 * np.arctan2(top, bottom)) / (4.0 * np.pi))


def star(rng, rings=12, around=16):
    """A closed, dented surface about the origin, 6 to 12 cm wide: vertices (V, 3), faces (F, 3)."""
    angles = np.linspace(0.0, np.pi, rings + 1)[1:-1]
    turn = np.linspace(0.0, 2.0 * np.pi, around, endpoint=False)
    ring = np.stack([np.outer(np.sin(angles), np.cos(turn)), np.outer(np.sin(angles), np.sin(turn)),
                     np.outer(np.cos(angles), np.ones(around))], axis=2).reshape(-1, 3)
    vertices = np.vstack([ring, [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]])
    vertices *= rng.uniform(0.03, 0.06, (len(vertices), 1))
    faces = []
    for k in range(around):
        after = (k + 1) % around
        for row in range(rings - 2):
            a, b, c, d = (around * (row + i) + j for i in (0, 1) for j in (k, after))
            faces += [(a, c, b), (b, c, d)]
        last = around * (rings - 2)
        faces += [(len(ring), k, after), (last + k, len(ring) + 1, last + after)]
    return vertices, np.array(faces)


def box_mesh(sides):
    """12 triangles."""
    corners = 0.5 * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * np.asarray(sides)
    faces = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6),
             (0, 6, 4), (1, 5, 7), (1, 7, 3)]
    return corners, np.array(faces)
