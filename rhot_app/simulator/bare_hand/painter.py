"""A bare hand before one camera: its surface moved by the pose, lit by one lamp and the room, over the background."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.kinematics import frames_and_points
from rhot_app.hand.skeleton import JOINTS
from rhot_app.simulator.bare_hand.rasterise import SAMPLES, accumulate, unshadowed, vertex_normals
from rhot_app.simulator.bare_hand.surface import BONES, FOREARM, Surface
from rhot_app.simulator.render.camera_controls import level_gain
from rhot_app.simulator.render.exposure_samples import NODES, FrameTime, power_series
from rhot_app.simulator.render.painter import Box, LitImage, PoseSource
from rhot_app.simulator.render.rays import LIGHT

Array = NDArray[np.float64]

_WRIST_PART: Final = 0.45
"""Part of the hand's turn that the wrist makes; the forearm makes the rest."""

_WRAP: Final = 0.25  # light that goes round the edge of a surface through skin, part of a right angle
_TEXEL_M, _BIAS_M = 3.0e-3, 5.0e-3
"""Side of a shadow map's texel: more than the mesh's edges; and the depth a vertex must be behind another."""

_SHEEN, _SHEEN_POWER = 0.10, 14.0
"""Light that skin's oil reflects like a mirror, of the lamp's, and how sharp the highlight is (Blinn 1977)."""


@dataclass(frozen=True, eq=False)
class BareHand:
    """A hand without paint: its `surface`, the `colours` (V, 3) of its vertices, levels 0..255 in full light, the
    direction `arm` (3,) in the world, from the elbow to the wrist, of a forearm at rest, unit vectors towards the
    lamp `light` (3,), and the part `ambient` of the light that comes from the room. `marker_count`: of the rig's set,
    none of which it wears."""

    surface: Surface
    colours: Array
    arm: Array
    light: Array
    ambient: float
    marker_count: int = 0

    def joints_and_markers(self, world_from_palm: Array, angles: Array) -> tuple[Array, Array]:
        """(T, 21, 3) m joints, and (T, M, 3) NaN: it wears no marker."""
        points = frames_and_points(self.surface.model.dh, world_from_palm, angles)[1]
        return points[:, :len(JOINTS)], self.marker_positions(world_from_palm, angles)

    def marker_positions(self, world_from_palm: Array, angles: Array) -> Array:
        """(T, M, 3) NaN."""
        return np.full((len(angles), self.marker_count, 3), np.nan)

    def vertices(self, world_from_palm: Array, angles: Array) -> Array:
        """(T, V, 3) m, the surface in the world for poses (T, 4, 4) and (T, 21)."""
        surface = self.surface
        world_from_rest = self._bones(world_from_palm, angles)  # (T, B, 3, 4)
        out = np.empty((len(angles), len(surface.vertices), 3))
        for k, bones in enumerate(world_from_rest):
            blended = surface.weights @ bones.reshape(BONES, 12)
            for axis in range(3):
                x, y, z, shift = blended[:, 4 * axis:4 * axis + 4].T
                out[k, :, axis] = (x * surface.vertices[:, 0] + y * surface.vertices[:, 1]
                                   + z * surface.vertices[:, 2] + shift)
        return out

    def _bones(self, world_from_palm: Array, angles: Array) -> Array:
        """(T, B, 3, 4): where each bone takes the surface from its rest pose."""
        frames = frames_and_points(self.surface.model.dh, world_from_palm, angles)[0]
        out = np.empty((len(angles), BONES, 3, 4))
        rest = self.surface.bone_from_palm
        for k, palm in enumerate(world_from_palm):
            out[k] = palm[:3]
            for bone in np.flatnonzero(self.surface.rows >= 0):
                frame = frames[k, self.surface.rows[bone]]
                out[k, bone, :, :3] = frame[:, :3] @ rest[bone, :, :3]
                out[k, bone, :, 3] = frame[:, :3] @ rest[bone, :, 3] + frame[:, 3]
            along = _WRIST_PART * palm[:3, 0] + (1.0 - _WRIST_PART) * self.arm
            along /= np.linalg.norm(along)
            back = palm[:3, 2] - (palm[:3, 2] @ along) * along
            back /= np.linalg.norm(back)
            out[k, FOREARM, :, :3] = np.stack([along, np.cross(back, along), back], axis=1)
        return out


class BareHandPainter:
    """A `Painter` of a bare hand. No marker is ever visible."""

    def __init__(self, hand: BareHand, camera: CameraModel, samples: int = SAMPLES) -> None:
        """`samples`: pictures whose mean is a frame, a power of two up to 16."""
        self._hand, self._camera, self._samples = hand, camera, samples
        height, width = camera.height, camera.width
        count = len(hand.colours)
        self._work = (np.zeros(count), np.zeros((count, 3)), np.zeros((count, 3)), np.zeros(count, np.uint8),
                      np.zeros_like(hand.surface.triangles))
        self._normals = np.zeros((count, 3))
        self._depth, self._cover = np.zeros((height, width), np.float32), np.zeros((height, width), np.float32)
        self._shown, self._total = (np.zeros((height, width, 3), np.float32) for _ in range(2))

    def paint(self, lit: LitImage, source: PoseSource, time: FrameTime, number: int) -> tuple[Box, Array]:
        """Paint the hand as `source` moves it during the frame."""
        world_from_palm, angles = source.sample(time.nodes_s)
        hand, camera = self._hand, self._camera
        world = hand.vertices(world_from_palm, angles)
        colours = self._shaded(world[NODES // 2], hand.colours * lit.level).astype(np.float32)
        local = world @ camera.camera_from_world[:3, :3].T + camera.camera_from_world[:3, 3]
        box = np.zeros(4, np.int64)
        accumulate(power_series(local), time.timing, camera.intrinsics, hand.surface.triangles, colours, self._samples,
                   self._work, box, self._depth, self._shown, self._total, self._cover)
        x0, y0, x1, y1 = (int(edge) for edge in box)
        if x0 < x1:
            total = self._total[y0:y1, x0:x1].transpose(2, 0, 1)
            free = self._samples - self._cover[y0:y1, x0:x1]
            lit.image[:, y0:y1, x0:x1] = (total + free * lit.background[:, y0:y1, x0:x1]) / self._samples
        return (x0, y0, x1, y1), np.zeros(hand.marker_count)

    def _shaded(self, vertices: Array, colours: Array) -> Array:
        """(V, 3) levels of the vertices (V, 3) m, world, of these `colours` (V, 3) in full light, as they are lit."""
        hand = self._hand
        vertex_normals(vertices, hand.surface.triangles, self._normals)
        cosine = self._normals @ hand.light
        direct = np.maximum((cosine + _WRAP) / (1.0 + _WRAP), 0.0) * unshadowed(
            vertices, cosine, hand.light, _TEXEL_M, _BIAS_M)
        upwards = 0.75 - 0.25 * self._normals[:, 1]  # the room's light comes more from above: y is down
        light = hand.ambient * upwards + (1.0 - hand.ambient) * direct
        eye = self._camera.centre - vertices
        half = eye / np.linalg.norm(eye, axis=1, keepdims=True) + hand.light
        half /= np.linalg.norm(half, axis=1, keepdims=True)
        sheen = _SHEEN * np.maximum(np.einsum("vi,vi->v", self._normals, half), 0.0) ** _SHEEN_POWER * direct
        linear = (colours / 255.0) ** 2.2 * light[:, None] + 0.35 * sheen[:, None]
        return np.asarray(255.0 * level_gain(linear))


def light_of(turn_rad: tuple[float, float]) -> Array:
    """(3,) unit vector towards a lamp that stands `turn_rad` beside the twin's own: about the vertical, about x."""
    (cy, sy), (cx, sx) = ((np.cos(turn), np.sin(turn)) for turn in turn_rad)
    light = np.array([[cy, 0.0, sy], [0.0, 1.0, 0.0], [-sy, 0.0, cy]]) @ np.array(
        [[1.0, 0.0, 0.0], [0.0, cx, -sx], [0.0, sx, cx]]) @ LIGHT
    return np.asarray(light / np.linalg.norm(light))
