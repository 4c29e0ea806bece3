"""Simple pictures of a bare hand: ray cast, shaded, before a cluttered wall."""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.barehand.surface import FOREARM, Surface, posed, ray_to_capsule
from rhot_app.geometry.camera import CameraModel, intrinsics_row
from rhot_app.geometry.transforms import inverse, rigid
from rhot_app.hand.motion.hand_state import SHAPE
from rhot_app.hand.skeleton import HandPose

Array = NDArray[np.float64]
LIGHT = np.array([-0.4, -0.7, -0.59])
SKIN = np.array([205.0, 150.0, 125.0])
SHIRT, HAIR, EYE, LIPS = ((60.0, 75.0, 110.0), (50.0, 35.0, 25.0), (40.0, 30.0, 30.0), (170.0, 80.0, 80.0))
HEAD = (  # ends of a capsule m, x right, y down, z away from the camera; radii m; colour
    ((0.0, -0.02, 0.0), (0.0, 0.05, 0.0), 0.075, 0.065, SKIN),
    ((0.0, 0.05, 0.02), (0.0, 0.15, 0.03), 0.05, 0.055, SKIN),
    ((0.0, -0.06, 0.02), (0.0, -0.05, 0.03), 0.085, 0.085, HAIR),
    ((0.0, 0.0, -0.068), (0.0, 0.025, -0.072), 0.008, 0.012, SKIN),
    ((-0.03, -0.01, -0.066), (-0.025, -0.01, -0.066), 0.01, 0.01, EYE),
    ((0.03, -0.01, -0.066), (0.025, -0.01, -0.066), 0.01, 0.01, EYE),
    ((-0.02, 0.055, -0.055), (0.02, 0.055, -0.055), 0.007, 0.007, LIPS),
    ((-0.17, 0.22, 0.03), (0.17, 0.22, 0.03), 0.06, 0.06, SHIRT),
    ((-0.12, 0.3, 0.03), (0.12, 0.3, 0.03), 0.1, 0.1, SHIRT),
    ((-0.12, 0.5, 0.03), (0.12, 0.5, 0.03), 0.12, 0.12, SHIRT))


def look_at(place: Array, target: Array, focal: float = 600.0, width: int = 640, height: int = 480) -> CameraModel:
    """A camera without distortion that looks from `place` to `target`, image down along world y."""
    z = (target - place) / np.linalg.norm(target - place)
    x = np.cross([0.0, 1.0, 0.0], z)
    x /= np.linalg.norm(x)
    world = rigid(np.column_stack([x, np.cross(z, x), z]), place)
    return CameraModel(width, height, intrinsics_row([focal, focal, 0.5 * width - 0.5, 0.5 * height - 0.5]),
                       world, inverse(world))


def two_cameras(baseline: float = 0.25, distance: float = 0.55) -> list[CameraModel]:
    """Two cameras 640x480 that look at a place `distance` m before the world's origin."""
    target = np.array([0.0, 0.0, distance])
    return [look_at(np.array([x, 0.0, 0.0]), target) for x in (-0.5 * baseline, 0.5 * baseline)]


def wall(camera: CameraModel, seed: int, clutter: bool) -> Array:
    """(H, W, 3) a background: soft shades, and with `clutter` boxes and lines of any colour."""
    rng = np.random.default_rng(seed)
    soft = cv2.resize(rng.uniform(60.0, 140.0, (8, 10, 3)), (camera.width, camera.height),
                      interpolation=cv2.INTER_CUBIC)
    if clutter:
        for _ in range(25):
            corner = rng.integers(0, [camera.width, camera.height])
            size = rng.integers(10, 120, 2)
            colour = tuple(float(v) for v in rng.uniform(20.0, 230.0, 3))
            end = tuple(int(v) for v in corner + size)
            if rng.random() < 0.5:
                cv2.rectangle(soft, tuple(int(v) for v in corner), end, colour, -1)
            else:
                cv2.line(soft, tuple(int(v) for v in corner), end, colour, int(rng.integers(1, 5)))
    return np.asarray(soft)


def picture(surface: Surface, world: Array, angles: Array, camera: CameraModel, background: Array, seed: int,
            forearm_m: float = 0.4, blur_px: float = 0.8, noise: float = 2.0,
            paint: dict[int, tuple[float, float, float]] | None = None, exposure: float = 1.0) -> NDArray[np.uint8]:
    """(H, W, 3) RGB of a hand; `paint`: colours of fingertips by finger; `exposure`: as of `taken`."""
    centres, radii = _with_forearm(surface, world, angles, forearm_m)
    out, colours = background.copy(), np.tile(SKIN, (len(radii), 1))
    for finger, colour in (paint or {}).items():
        colours[np.flatnonzero(surface.group == finger)[-1]] = colour
    _cast(centres, radii, colours, camera, out)
    return taken(out, seed, blur_px, noise, exposure)


def picture_of(hands: Sequence[tuple[Surface, HandPose]], camera: CameraModel, background: Array, seed: int,
               forearm_m: float = 0.4) -> NDArray[np.uint8]:
    """(H, W, 3) RGB of some hands, of which the nearer ones hide the others."""
    out, shapes = background.copy(), [_with_forearm(surface, pose.world_from_palm, pose.angles, forearm_m)
                                      for surface, pose in hands]
    if shapes:
        centres, radii = (np.concatenate(columns) for columns in zip(*shapes, strict=True))
        _cast(centres, radii, np.tile(SKIN, (len(radii), 1)), camera, out)
    return taken(out, seed)


def capsules_of(surface: Surface, world: Array, angles: Array, shape: Array | None = None) -> tuple[Array, Array]:
    """`centres` (N, 2, 3) m and `radii` (N, 2) m of a posed hand: `world` (4, 4), `angles` (21,) rad."""
    hand = posed(surface, world, angles, np.zeros(SHAPE) if shape is None else shape)
    return hand.centres, hand.radii


def _with_forearm(surface: Surface, world: Array, angles: Array, forearm_m: float) -> tuple[Array, Array]:
    centres, radii = capsules_of(surface, world, angles)
    for k in np.flatnonzero(surface.group == FOREARM):
        line = centres[k, 1] - centres[k, 0]
        centres[k, 1] = centres[k, 0] + line * forearm_m / np.linalg.norm(line)
    return centres, radii


def person(camera: CameraModel, background: Array, place: Array) -> Array:
    """(H, W, 3) a head with a face, a neck and shoulders before a background; `place` (3,) m of the head's middle."""
    ends = np.array([[first, second] for first, second, *_ in HEAD]) + place
    out = background.copy()
    _cast(ends, np.array([[a, b] for _, _, a, b, _ in HEAD]), np.array([colour for *_, colour in HEAD]), camera, out)
    return out


def taken(scene: Array, seed: int, blur_px: float = 0.8, noise: float = 2.0,
          exposure: float = 1.0) -> NDArray[np.uint8]:
    """(H, W, 3) RGB: a scene (H, W, 3) through a lens, `exposure` times as bright, with noise."""
    out = exposure * (cv2.GaussianBlur(scene, (0, 0), blur_px) if blur_px else scene)
    out += np.random.default_rng([seed, 7]).normal(0.0, noise, out.shape)
    return np.clip(out + 0.5, 0.0, 255.0).astype(np.uint8)


def _cast(centres: Array, radii: Array, colours: Array, camera: CameraModel, out: Array) -> None:
    _draw(centres, radii, camera.centre.copy(), camera.camera_from_world[:3, :3].copy(), camera.intrinsics,
          LIGHT / np.linalg.norm(LIGHT), colours, out)


@njit(cache=True)
def _draw(centres, radii, o, rotation, intrinsics, light, colours, out):
    boxes = np.empty((len(centres), 4))
    for k in range(len(centres)):
        boxes[k] = np.array([1e9, 1e9, -1e9, -1e9])
        for e in range(2):
            local = rotation @ (centres[k, e] - o)
            z = max(local[2], 0.05)
            u, v = intrinsics[0] * local[0] / z + intrinsics[2], intrinsics[1] * local[1] / z + intrinsics[3]
            r = 1.1 * intrinsics[0] * radii[k, e] / max(z - radii[k, e], 0.02) + 2.0
            boxes[k, 0], boxes[k, 1] = min(boxes[k, 0], u - r), min(boxes[k, 1], v - r)
            boxes[k, 2], boxes[k, 3] = max(boxes[k, 2], u + r), max(boxes[k, 3], v + r)
    near, colour, d, n = np.empty(len(centres), np.int64), np.empty(3), np.empty(3), np.empty(3)
    for y in range(out.shape[0]):
        for x in range(out.shape[1]):
            count = 0
            for k in range(len(centres)):
                if boxes[k, 0] <= x + 0.25 and x - 0.25 <= boxes[k, 2] and (
                        boxes[k, 1] <= y + 0.25 and y - 0.25 <= boxes[k, 3]):
                    near[count] = k
                    count += 1
            if not count:
                continue
            colour[:] = 0.0
            hits = 0
            for sub in range(4):
                a = (x - 0.25 + 0.5 * (sub % 2) - intrinsics[2]) / intrinsics[0]
                b = (y - 0.25 + 0.5 * (sub // 2) - intrinsics[3]) / intrinsics[1]
                length = math.sqrt(a * a + b * b + 1.0)
                for i in range(3):
                    d[i] = (rotation[0, i] * a + rotation[1, i] * b + rotation[2, i]) / length
                best, which = 1e9, -1
                for k in near[:count]:
                    t = ray_to_capsule(o, d, centres, radii, k)
                    if 0.0 < t < best:
                        best, which = t, k
                if which < 0:
                    continue
                along = squared = 0.0
                for i in range(3):
                    axis = centres[which, 1, i] - centres[which, 0, i]
                    n[i] = o[i] + best * d[i] - centres[which, 0, i]
                    along += n[i] * axis
                    squared += axis * axis
                h = min(max(along / squared, 0.0), 1.0)
                size = lit = facing = 0.0
                for i in range(3):
                    n[i] -= h * (centres[which, 1, i] - centres[which, 0, i])
                    size += n[i] * n[i]
                    lit -= n[i] * light[i]
                    facing += n[i] * d[i]
                size = math.sqrt(size)
                shade = 0.55 + 0.45 * max(lit / size, 0.0) - 0.15 * (1.0 + facing / size)
                for i in range(3):
                    colour[i] += colours[which, i] * shade
                hits += 1
            for i in range(3):
                out[y, x, i] = colour[i] / 4.0 + out[y, x, i] * (4 - hits) / 4.0
