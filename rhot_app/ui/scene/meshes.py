"""Triangle meshes as arrays: spheres, capsules, hulls and rings, made once and posed every frame in one numpy step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

Array = NDArray[np.float64]
Faces = NDArray[np.uint32]


@dataclass(frozen=True, slots=True)
class Mesh:
    """Vertices (V, 3) m with outward unit normals (V, 3), and triangles (F, 3) of vertex numbers."""

    vertices: Array
    normals: Array
    faces: Faces


@dataclass(frozen=True, slots=True)
class CapsuleTemplate:
    """A capsule without a length: vertex k lies at end `ends[k]` (0 or 1) in unit direction `directions[k]` (V, 3).

    The bone runs along local +z.
    """

    directions: Array
    ends: NDArray[np.intp]
    faces: Faces


def capsule_template(sectors: int = 14, rings: int = 4) -> CapsuleTemplate:
    """Capsule of `sectors` sides whose round ends have `rings` rings each."""
    around = np.linspace(0.0, 2 * np.pi, sectors, endpoint=False)
    polar = np.concatenate([np.linspace(np.pi, np.pi / 2, rings + 1)[1:], np.linspace(np.pi / 2, 0.0, rings + 1)[:-1]])
    rows = np.stack([np.sin(polar)[:, None] * np.cos(around), np.sin(polar)[:, None] * np.sin(around),
                     np.broadcast_to(np.cos(polar)[:, None], (2 * rings, sectors))], axis=2)
    directions = np.concatenate([[[0.0, 0.0, -1.0]], rows.reshape(-1, 3), [[0.0, 0.0, 1.0]]])
    ends = np.concatenate([[0], np.repeat([0, 1], rings * sectors), [1]]).astype(np.intp)
    faces: list[tuple[int, int, int]] = []
    last = len(directions) - 1
    for k in range(sectors):
        j = (k + 1) % sectors
        faces.append((0, 1 + j, 1 + k))
        for row in range(2 * rings - 1):
            a, b = 1 + row * sectors, 1 + (row + 1) * sectors
            faces += [(a + k, a + j, b + k), (a + j, b + j, b + k)]
        top = 1 + (2 * rings - 1) * sectors
        faces.append((top + k, top + j, last))
    return CapsuleTemplate(directions, ends, np.array(faces, dtype=np.uint32))


def bone_frames(starts: Array, stops: Array) -> Array:
    """Rotations (B, 3, 3) whose third column runs from `starts` (B, 3) to `stops` (B, 3); any turn about it will do."""
    axis = stops - starts
    length = np.linalg.norm(axis, axis=1, keepdims=True)
    z = np.where(length > 1e-9, axis / np.maximum(length, 1e-9), [0.0, 0.0, 1.0])
    helper = np.where(np.abs(z[:, 2:3]) < 0.9, [0.0, 0.0, 1.0], [1.0, 0.0, 0.0])
    x = np.cross(helper, z)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return np.stack([x, np.cross(z, x), z], axis=2)


def pose_capsules(template: CapsuleTemplate, starts: Array, stops: Array, radii: Array) -> tuple[Array, Array]:
    """Vertices and normals, each (B * V, 3), of B capsules from `starts` to `stops` (B, 3) with `radii` (B, 2) m.

    The normals of a tapering capsule are those of a straight one; the difference cannot be seen.
    """
    frames = bone_frames(starts, stops)
    normals = template.directions[None] @ frames.transpose(0, 2, 1)
    ends = np.stack([starts, stops], axis=1)[:, template.ends]
    vertices = ends + radii[:, template.ends, None] * normals
    return vertices.reshape(-1, 3), normals.reshape(-1, 3)


def repeat_faces(faces: Faces, vertices: int, copies: int) -> Faces:
    """Triangles of `copies` meshes of `vertices` vertices each that stand one after the other in one array."""
    offsets = np.arange(copies, dtype=np.uint32)[:, None, None] * np.uint32(vertices)
    return np.asarray((faces[None] + offsets).reshape(-1, 3), dtype=np.uint32)


def sphere(sectors: int = 18, rings: int = 6) -> Mesh:
    """Unit sphere."""
    template = capsule_template(sectors, rings)
    keep = template.directions
    return Mesh(keep, keep, template.faces)


def hull_of_spheres(centres: Array, radii: Array, sectors: int = 20, rings: int = 6) -> Mesh:
    """Convex hull of spheres at `centres` (S, 3) with `radii` (S,), m, with the spheres' normals: it looks round."""
    directions = sphere(sectors, rings).vertices
    points = (centres[:, None] + radii[:, None, None] * directions[None]).reshape(-1, 3)
    normals = np.tile(directions, (len(centres), 1))
    hull = ConvexHull(points)
    used, faces = np.unique(hull.simplices, return_inverse=True)
    triangles = faces.reshape(-1, 3).astype(np.uint32)
    corners = points[used][triangles]
    facing = np.einsum("fi,fi->f", np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]),
                       hull.equations[:, :3])
    triangles[facing < 0] = triangles[facing < 0][:, ::-1]
    return Mesh(points[used], normals[used], triangles)


def elliptic_band(semi_y: float, semi_z: float, width: float, sectors: int = 40) -> Mesh:
    """A bracelet about the x axis: ellipse of `semi_y` and `semi_z`, `width` along x, m. Open at both ends."""
    around = np.linspace(0.0, 2 * np.pi, sectors, endpoint=False)
    ring = np.stack([np.zeros(sectors), semi_y * np.cos(around), semi_z * np.sin(around)], axis=1)
    normal = np.stack([np.zeros(sectors), np.cos(around) / semi_y, np.sin(around) / semi_z], axis=1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    profile = np.array([(-0.5, 0.0), (-0.42, 0.05), (0.42, 0.05), (0.5, 0.0)])
    vertices = [ring + [x * width, 0.0, 0.0] + out * width * normal for x, out in profile]
    faces = []
    for row in range(len(profile) - 1):
        a, b = row * sectors, (row + 1) * sectors
        for k in range(sectors):
            j = (k + 1) % sectors
            faces += [(a + k, a + j, b + k), (a + j, b + j, b + k)]
    return Mesh(np.concatenate(vertices), np.tile(normal, (len(profile), 1)), np.array(faces, dtype=np.uint32))
