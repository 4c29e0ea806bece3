"""The colour of a bare hand's skin at every vertex: tone, mottling, creases, nails, and a sleeve.

Tones are those of the Monk Skin Tone Scale (Monk 2019), as sRGB levels; blood makes skin redder than the scale's
swatches, and the palm of a dark hand is lighter than its back.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Final

import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_app.hand.model import HandModel, build_model
from rhot_app.simulator.bare_hand.surface import FOREARM, PALM, SLEEVE_GROUP, Surface, rest_frames, smooth_step

Array = NDArray[np.float64]

TONES: Final = ((246, 237, 228), (243, 231, 219), (247, 234, 208), (234, 218, 186), (215, 189, 150), (160, 126, 86),
                (130, 92, 67), (96, 65, 52), (58, 49, 42), (41, 36, 32))
"""The ten tones, sRGB; tone 1 is the lightest."""

_PALMAR_LIGHTEST: Final = 5.0  # tone towards which a darker hand's palm is lighter
_BLOOD: Final = np.array([1.04, 0.86, 0.83])  # what blood does to the swatches' levels
_MOTTLE_M: Final = (0.045, 0.030, 0.021, 0.014)  # wavelengths of uneven blood and pigment
_MOTTLE, _MOTTLE_RED = 0.025, 0.02
_CREASE_M: Final = 1.3e-3  # half width of a crease at which it is 1/e as dark


def skin_colours(surface: Surface, tone: float, sleeve_rgb: tuple[float, float, float] | None, seed: int) -> Array:
    """(V, 3) levels 0..255 in full light. `tone`: 1..10 on the scale, in between as well."""
    rng = np.random.default_rng([seed, 0x5C1])
    model = build_model(msgspec.structs.replace(surface.model.anatomy, side="right"))
    vertices = surface.right
    bone = np.argmax(surface.weights, axis=1)
    palmar, creases, nails, blush = _details(model, surface, bone)
    light = _tone(min(tone, 0.45 * tone + 0.55 * _PALMAR_LIGHTEST))
    levels = _tone(tone) + palmar[:, None] * (light - _tone(tone))
    mottle = 1.0 + _MOTTLE * _waves(vertices, rng)
    red = _MOTTLE_RED * _waves(vertices, rng) + blush
    levels = levels * (mottle * creases)[:, None] * (1.0 + red[:, None] * np.array([0.5, -0.8, -0.7]))
    nail_rgb = 0.55 * levels + 0.45 * np.array([228.0, 178.0, 165.0])
    levels += np.clip(nails, 0.0, 1.0)[:, None] * (nail_rgb - levels)
    levels *= 1.0 - 0.16 * np.clip(-nails, 0.0, 1.0)[:, None]  # the fold round a nail
    if sleeve_rgb is not None:
        folds = 1.0 + 0.08 * _waves(vertices * np.array([2.0, 0.7, 0.7]), rng)
        cloth = surface.group == SLEEVE_GROUP
        levels[cloth] = folds[cloth, None] * np.array(sleeve_rgb)
    return np.clip(levels, 6.0, 250.0)


def _tone(tone: float) -> Array:
    """(3,) levels of a tone between the scale's."""
    levels = np.array(TONES, dtype=np.float64)
    at = np.clip(tone, 1.0, len(TONES)) - 1.0
    return np.array([np.interp(at, np.arange(len(TONES)), levels[:, c]) for c in range(3)]) * _BLOOD


def _waves(points: Array, rng: np.random.Generator) -> Array:
    """(V,) a smooth random field of about unit variance in points (V, 3) m."""
    total = np.zeros(len(points))
    for length in np.repeat(_MOTTLE_M, 3):
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        total += np.sin(2.0 * np.pi / length * (points @ direction) + rng.uniform(0.0, 2.0 * np.pi))
    return total / np.sqrt(1.5 * len(_MOTTLE_M))


def _details(model: HandModel, surface: Surface, bone: NDArray[np.int64]) -> tuple[Array, Array, Array, Array]:
    """By vertex: palmar side 0..1; factor of creases; nails 1, their folds down to -1; redness."""
    vertices, count = surface.right, len(surface.right)
    frames, points = rest_frames(model)
    palmar, creases, nails, blush = np.zeros(count), np.ones(count), np.zeros(count), np.zeros(count)
    of_palm = (bone == PALM) | (bone == FOREARM)
    palmar[of_palm] = smooth_step((-0.004 - vertices[of_palm, 2]) / 0.010)
    for finger in range(5):
        joints = points[1 + 4 * finger:5 + 4 * finger]
        for k in range(3):
            mine = np.flatnonzero(bone == 1 + 3 * finger + k)
            rotation = frames[model.dh.point_row[2 + 4 * finger + k], :, :3]
            along_axis = rotation[:, 0]
            hinge = rotation[:, 2]
            bend = np.cross(hinge, along_axis)  # positive flexion turns the bone's axis this way
            local = vertices[mine] - joints[k]
            along, down, across = local @ along_axis, local @ bend, local @ hinge
            radius, length = float(model.radii[finger, k]), float(model.bones[finger, k])
            facing = down / np.maximum(np.hypot(down, across), 1e-6)
            palmar[mine] = smooth_step(0.5 + 0.5 * facing / 0.6)
            below, above = smooth_step(facing / 0.5), smooth_step(-facing / 0.5)
            if k > 0:
                creases[mine] *= 1.0 - 0.30 * below * _line(along) - 0.14 * above * (
                    _line(along) + _line(along - 3e-3) + _line(along + 3e-3))
                blush[mine] += 0.08 * above * np.exp(-(along / 7e-3) ** 2)
            if k < 2:
                creases[mine] *= 1.0 - 0.30 * below * _line(along - length) - 0.14 * above * (
                    _line(along - length) + _line(along - length + 3e-3))
            if k == 0 and finger > 0:
                creases[mine] *= 1.0 - 0.28 * below * _line(along - 0.46 * length)
            if k == 2:
                blush[mine] += 0.10 * below * smooth_step(along / length)
                reach = (np.abs((along - 0.60 * length) / (0.30 * length)) ** 3.0
                         + np.abs(across / (0.74 * radius)) ** 3.0)
                nails[mine] = above * np.where(reach < 1.0, 1.0, -np.exp(-((reach - 1.0) / 0.35) ** 2))
                tip = above * (reach < 1.0) * smooth_step((along - 0.80 * length) / (0.06 * length))
                blush[mine] -= 0.10 * tip
    lines = np.full(count, np.inf)
    for polyline in _palm_lines(points):
        lines = np.minimum(lines, _distance(vertices[:, :2], polyline))
    creases *= 1.0 - 0.20 * palmar * of_palm * _line(lines)
    wrist = np.minimum(np.abs(vertices[:, 0] + 1e-3), np.abs(vertices[:, 0] + 8e-3))
    creases *= 1.0 - 0.12 * palmar * of_palm * _line(wrist)
    return palmar, creases, nails, blush


def _palm_lines(points: Array) -> list[Array]:
    """The three great creases of a palm, (N, 2) m in its plane."""
    index, middle, little, thumb = points[5, :2], points[9, :2], points[17, :2], points[1, :2]
    heart = ((little, -8, -8), (little, -14, 10), (middle, -17, -4), (middle, -10, 8), (middle, 2, 11))
    head = ((index, -22, 9), (middle, -30, 6), (0.55 * middle + 0.45 * little, -35, 0), (little, -38, -2))
    life = ((index, -20, 9), (0.72 * index, 0, -6), (0.5 * middle, 4, 4), (0.6 * thumb, 12, -8), (0.25 * thumb, 4, -2))
    return [np.array([at + np.array([1e-3 * x, 1e-3 * y]) for at, x, y in line]) for line in (heart, head, life)]


def _distance(points: Array, polyline: Array) -> Array:
    """(V,) m from points (V, 2) to the nearest piece of a polyline (N, 2)."""
    nearest = np.full(len(points), np.inf)
    for start, end in pairwise(polyline):
        piece = end - start
        along = np.clip((points - start) @ piece / (piece @ piece), 0.0, 1.0)
        nearest = np.minimum(nearest, np.linalg.norm(points - start - along[:, None] * piece, axis=1))
    return nearest


def _line(distance: Array) -> Array:
    return np.asarray(np.exp(-(distance / _CREASE_M) ** 2))

