"""What stands behind the hand: a dark cloth, or a cluttered desk, perhaps with things of skin's colour on it.

All is drawn on a plane, so that both cameras see one room.

A background is a function of the plane's coordinates, m; edges are as soft as one pixel, so that nothing aliases.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rhot_app.errors import SimulatorError
from rhot_app.geometry.camera import CameraModel
from rhot_app.simulator.render.rays import ray_table

Array = NDArray[np.float64]

BACKGROUNDS = ("cloth", "clutter", "skin")
BEHIND_HAND_M = 0.55
_OBJECTS, _SKIN_OBJECTS = 26, 14


def background_image(name: str, camera: CameraModel, hand_distance_m: float, seed: int) -> NDArray[np.float32]:
    """(3, H, W) grey levels 0..255 of the plane BEHIND_HAND_M behind the hand; alike for all cameras of one seed.

    Raises SimulatorError for a background that there is not.
    """
    if name not in BACKGROUNDS:
        raise SimulatorError(f"there is no background {name!r}; there are {', '.join(BACKGROUNDS)}.")
    plane_m = hand_distance_m + BEHIND_HAND_M
    rays = ray_table(camera)[1:-1, 1:-1]
    directions = np.concatenate([rays, np.ones((*rays.shape[:2], 1))], axis=2) @ camera.world_from_camera[:3, :3].T
    reach = (plane_m - camera.centre[2]) / np.maximum(directions[:, :, 2], 0.05)
    x = camera.centre[0] + reach * directions[:, :, 0]
    y = camera.centre[1] + reach * directions[:, :, 1]
    pixel_m = plane_m / camera.intrinsics[0]
    rng = np.random.default_rng([seed, 0xBAC])
    image = _cloth(x, y, rng) if name == "cloth" else _clutter(x, y, pixel_m, rng)
    if name == "skin":
        _lay_skin(image, x, y, pixel_m, rng)
    return np.clip(image, 4.0, 240.0).astype(np.float32)


def _waves(x: Array, y: Array, rng: np.random.Generator, lengths_m: Array, spread_rad: float = np.pi) -> Array:
    """Sum of plane waves of random direction and phase, about -1..1."""
    total = np.zeros_like(x)
    for length in lengths_m:
        direction, phase = rng.uniform(-spread_rad, spread_rad), rng.uniform(0.0, 2.0 * np.pi)
        total += np.sin(2.0 * np.pi / length * (x * np.cos(direction) + y * np.sin(direction)) + phase)
    return np.asarray(total / np.sqrt(len(lengths_m)))


def _cloth(x: Array, y: Array, rng: np.random.Generator) -> Array:
    """Charcoal cloth: broad folds and a fine weave."""
    folds = _waves(x, y, rng, np.array([0.9, 0.61, 0.43, 0.37]), 0.5)
    weave = np.sin(2.0 * np.pi * x / 0.0061) * np.sin(2.0 * np.pi * y / 0.0067) + 0.5 * _waves(
        x, y, rng, np.array([0.013, 0.017, 0.023]))
    level = 1.0 + 0.22 * folds + 0.04 * weave
    return np.stack([33.0 * level, 35.0 * level, 41.0 * level])


def _clutter(x: Array, y: Array, pixel_m: float, rng: np.random.Generator) -> Array:
    """A wooden desk seen from above with papers, books, mugs and boxes on it."""
    image = _wood(x, y, rng)
    for _ in range(_OBJECTS):
        centre = rng.uniform((-0.75, -0.6), (0.8, 0.6))
        size, turn = rng.uniform(0.02, 0.13, 2), rng.uniform(0.0, np.pi)
        u = (x - centre[0]) * np.cos(turn) + (y - centre[1]) * np.sin(turn)
        v = (y - centre[1]) * np.cos(turn) - (x - centre[0]) * np.sin(turn)
        round_one = rng.random() < 0.4
        distance = np.hypot(u, v) - size[0] if round_one else np.maximum(abs(u) - size[0], abs(v) - size[1])
        colour = _object_colour(rng)
        shine = 1.0 + 0.18 * np.clip(u / size[0], -1.0, 1.0)
        _lay(image, distance - 0.004, 0.008, 0.75 * image)  # the shadow round it
        _lay(image, distance, pixel_m, colour[:, None, None] * shine)
        if round_one:
            _lay(image, distance + 0.25 * size[0], pixel_m, 0.6 * colour[:, None, None] * shine)
        elif rng.random() < 0.6:
            lines = np.maximum(abs(np.mod(v, 0.014) - 0.007) - 0.0018, distance + 0.012)
            _lay(image, lines, pixel_m, 0.55 * colour[:, None, None] * shine)
    return image


def _lay_skin(image: Array, x: Array, y: Array, pixel_m: float, rng: np.random.Generator) -> None:
    """Rods and discs of skin's colours on the desk, as thick as fingers, arms and faces."""
    for _ in range(_SKIN_OBJECTS):
        start, turn, length = rng.uniform((-0.6, -0.45), (0.65, 0.45)), rng.uniform(0.0, np.pi), rng.uniform(0.0, 0.35)
        radius = rng.choice([0.009, 0.012, 0.035, 0.08])
        u = (x - start[0]) * np.cos(turn) + (y - start[1]) * np.sin(turn)
        v = (y - start[1]) * np.cos(turn) - (x - start[0]) * np.sin(turn)
        distance = np.hypot(u - np.clip(u, 0.0, length), v) - radius
        red = rng.uniform(90.0, 225.0)
        colour = red * np.array([1.0, rng.uniform(0.66, 0.84), rng.uniform(0.48, 0.70)])
        shade = 0.72 + 0.28 * np.sqrt(np.clip(-distance / radius, 0.0, 1.0))
        _lay(image, distance - 0.004, 0.008, 0.75 * image)
        _lay(image, distance, pixel_m, colour[:, None, None] * shade)


def _wood(x: Array, y: Array, rng: np.random.Generator) -> Array:
    bend = 0.03 * _waves(x, y, rng, np.array([0.8, 0.5]), 0.4)
    grain = _waves(x * 0.06, y + bend, rng, np.array([0.05, 0.031, 0.019, 0.012, 0.0083]), 0.02)
    fine = _waves(0.1 * x, y + bend, rng, np.array([0.041, 0.027, 0.017, 0.011]))
    level = 1.0 + 0.06 * grain + 0.07 * fine
    return np.stack([142.0 * level, 104.0 * level, 70.0 * level])


def _object_colour(rng: np.random.Generator) -> Array:
    """Mostly dull, some saturated: a room has both."""
    hue, value = rng.uniform(0.0, 6.0), rng.uniform(60.0, 200.0)
    saturation = rng.uniform(0.05, 0.35) if rng.random() < 0.7 else rng.uniform(0.35, 0.7)
    ramp = np.clip(np.abs(np.mod(hue + np.array([0.0, 4.0, 2.0]), 6.0) - 3.0) - 1.0, 0.0, 1.0)
    return np.asarray(value * (1.0 - saturation + saturation * ramp))


def _lay(image: Array, distance_m: Array, soft_m: float, colour: Array) -> None:
    """Blend `colour` over the image where the signed distance is negative, over an edge of width `soft_m`."""
    cover = np.clip(0.5 - distance_m / soft_m, 0.0, 1.0)
    image += cover * (colour - image)
