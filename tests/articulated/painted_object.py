"""Pictures of articulated objects whose links have other shapes than a tracker's: meshes with bulges and texture.

Each link is a tube about its axis, or a box, whose vertices have the colours of a random texture; one lamp and the
room light them. `rasterise.draw` of the simulator paints the triangles.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.articulated import Box, Capsule
from rhot_app.hand.articulated_model import ArticulatedModel
from rhot_app.hand.kinematics import empty_frames, forward_arrays
from rhot_app.simulator.bare_hand.rasterise import draw

Array = NDArray[np.float64]
LAMP = np.array([-0.35, -0.7, -0.62])
AMBIENT = 0.45
EDGE_M = 1.0e-3


@dataclass
class LinkMesh:
    """Vertices (V, 3) and normals (V, 3) in the frame of a row, triangles (T, 3), colours (V, 3)."""

    row: int
    vertices: Array
    normals: Array
    triangles: NDArray[np.int64]
    colours: Array


def meshes_of(model: ArticulatedModel, seed: int, texture: float, bulge: float = 0.06,
              rgb: tuple[float, float, float] = (205.0, 150.0, 125.0)) -> list[LinkMesh]:
    """A mesh for every body. `texture`: standard deviation of the colour, part of 1; `bulge`: of the radius along a
    capsule, part of 1."""
    rng = np.random.default_rng(seed)
    out = []
    for body in model.bodies:
        if isinstance(body.shape, Capsule):
            start = 1e-3 * body.shape.radius_mm
            end = 1e-3 * (body.shape.end_radius_mm or body.shape.radius_mm)
            vertices, normals, triangles = _tube(body.link, start, end, bulge)
        elif isinstance(body.shape, Box):
            vertices, normals, triangles = _box(1e-3 * np.array(body.shape.size_mm))
            c, s = np.cos(body.twist), np.sin(body.twist)
            turn = np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]])
            centre = np.array([-0.5 * body.link, 0.0, 0.0]) + turn @ (1e-3 * np.array(body.shape.centre_mm))
            vertices, normals = vertices @ turn.T + centre, normals @ turn.T
        else:
            continue
        field = np.exp(texture * waves(vertices, rng))
        tint = np.clip(rng.normal(1.0, 0.05, 3), 0.85, 1.15)
        out.append(LinkMesh(body.row, vertices, normals, triangles, field[:, None] * np.array(rgb) * tint))
    return out


def waves(points: Array, rng: np.random.Generator, lengths: tuple[float, ...] = (0.024, 0.016, 0.011, 0.008)) -> Array:
    """(V,) a smooth random field of unit variance, with these wavelengths, m."""
    total = np.zeros(len(points))
    for length in np.repeat(lengths, 4):
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        total += np.sin(2.0 * np.pi / length * (points @ direction) + rng.uniform(0.0, 2.0 * np.pi))
    return total / np.sqrt(2.0 * len(lengths))


def _tube(length: float, start: float, end: float, bulge: float) -> tuple[Array, Array, NDArray[np.int64]]:
    """A link along x from -length to 0, thick at the joints, thinner between, with round ends."""
    steps = max(int((length + 2.0 * start) / EDGE_M), 8)
    s = np.linspace(0.0, 1.0, steps)
    x = -length - start + s * (length + start + end)
    t = np.clip((x + length) / max(length, 1e-9), 0.0, 1.0)
    radius = start + t * (end - start)
    radius = radius * (1.0 + bulge * np.cos(2.0 * np.pi * t))
    before, after = np.clip(-length - x, 0.0, start), np.clip(x, 0.0, end)
    radius = radius * np.sqrt(np.maximum(1.0 - (before / start) ** 2, 0.0)) * np.sqrt(
        np.maximum(1.0 - (after / end) ** 2, 0.0))
    around = max(int(2.0 * np.pi * start / EDGE_M), 12)
    angle = 2.0 * np.pi * np.arange(around) / around
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    vertices = np.concatenate([np.broadcast_to(x[:, None, None], (steps, around, 1)),
                               radius[:, None, None] * ring[None]], axis=2)
    slope = np.gradient(radius, x)
    normals = np.concatenate([np.broadcast_to(-slope[:, None, None], (steps, around, 1)),
                              np.broadcast_to(ring[None], (steps, around, 2))], axis=2).reshape(-1, 3)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    i, j = np.meshgrid(np.arange(steps - 1), np.arange(around), indexing="ij")
    a, b = i * around + j, i * around + (j + 1) % around
    c, d = a + around, b + around
    triangles = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([b, d, c], -1).reshape(-1, 3)])
    return vertices.reshape(-1, 3), normals, triangles


def _box(size: Array) -> tuple[Array, Array, NDArray[np.int64]]:
    vertices, normals, triangles, count = [], [], [], 0
    for axis in range(3):
        a, b = (axis + 1) % 3, (axis + 2) % 3
        for side in (-1.0, 1.0):
            na, nb = (max(int(size[i] / EDGE_M), 2) for i in (a, b))
            u, v = np.meshgrid(np.linspace(-0.5, 0.5, na), np.linspace(-0.5, 0.5, nb), indexing="ij")
            face = np.zeros((na * nb, 3))
            face[:, axis], face[:, a], face[:, b] = side * 0.5 * size[axis], u.ravel() * size[a], v.ravel() * size[b]
            normal = np.zeros(3)
            normal[axis] = side
            i, j = np.meshgrid(np.arange(na - 1), np.arange(nb - 1), indexing="ij")
            p = (count + i * nb + j).reshape(-1)
            quads = np.concatenate([np.stack([p, p + nb, p + 1], 1), np.stack([p + nb, p + nb + 1, p + 1], 1)])
            vertices.append(face)
            normals.append(np.tile(normal, (len(face), 1)))
            triangles.append(quads if side > 0 else quads[:, ::-1])
            count += len(face)
    return np.concatenate(vertices), np.concatenate(normals), np.concatenate(triangles)


def picture(model: ArticulatedModel, meshes: list[LinkMesh], root: Array, angles: Array, camera: CameraModel,
            background: Array, seed: int, samples: int = 4, blur_px: float = 0.7,
            noise: float = 2.0) -> NDArray[np.uint8]:
    """(H, W, 3) RGB of the object at `root` (4, 4) with `angles` (A,), before a `background` (H, W, 3)."""
    dh = model.dh
    frames, points = empty_frames(dh), np.empty((len(dh.point_row), 3))
    forward_arrays(dh, np.ascontiguousarray(root), np.ascontiguousarray(angles), frames, points)
    height, width = camera.height, camera.width
    total = np.zeros((height, width, 3))
    lamp = LAMP / np.linalg.norm(LAMP)
    posed = []
    for mesh in meshes:
        pose = root[:3] if mesh.row < 0 else frames[mesh.row]
        world, normals = mesh.vertices @ pose[:, :3].T + pose[:, 3], mesh.normals @ pose[:, :3].T
        light = AMBIENT + (1.0 - AMBIENT) * np.maximum(normals @ lamp, 0.0)
        local = world @ camera.camera_from_world[:3, :3].T + camera.camera_from_world[:3, 3]
        seen = np.column_stack([camera.project(world), 1.0 / np.maximum(local[:, 2], 0.05)])
        posed.append((seen, mesh.triangles, (mesh.colours * light[:, None]).astype(np.float32)))
    box = np.array([0, 0, width, height])
    for k in range(samples):
        ox, oy = (k + 0.5) / samples - 0.5, ((3 * k) % samples + 0.5) / samples - 0.5
        depth, shown = np.zeros((height, width), np.float32), np.zeros((height, width, 3), np.float32)
        for seen, triangles, colours in posed:
            mine = np.zeros_like(depth)
            image = np.zeros_like(shown)
            draw(seen, triangles, colours, ox, oy, box, mine, image)
            nearer = mine > depth
            depth[nearer], shown[nearer] = mine[nearer], image[nearer]
        total += np.where(depth[:, :, None] > 0.0, shown, background)
    out = cv2.GaussianBlur(total / samples, (0, 0), blur_px) if blur_px else total / samples
    out += np.random.default_rng([seed, 7]).normal(0.0, noise, out.shape)
    return np.clip(out + 0.5, 0.0, 255.0).astype(np.uint8)
