"""The markers as one posed mesh in their own colours."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rhot_app.hand.anatomy import HandAnatomy
from rhot_app.hand.skeleton import JOINTS, TIP_ROLES
from rhot_app.tracking.state import HandState
from rhot_app.ui.scene.frames import to_display
from rhot_app.ui.scene.hand_mesh import PosedMesh
from rhot_app.ui.scene.meshes import Faces, capsule_template, elliptic_band, pose_capsules, repeat_faces
from rhot_node.markers import FLAT_PATCHES, Marker, MarkerSet

Array = NDArray[np.float64]
Colours = NDArray[np.uint8]

_DEFAULT_RADIUS_M, _FLAT_RADIUS_M = 0.008, 0.003
_PROUD_M = 0.001  # markers stand this far out of the skin, so that the two surfaces do not flicker


def colour_rows(markers: Sequence[Marker], counts: list[int], alpha: int) -> Colours:
    """(sum of counts, 4) bytes: each marker's own colour for its `counts` vertices."""
    return np.repeat(np.array([(*marker.display_rgb, alpha) for marker in markers], dtype=np.uint8), counts, axis=0)


def _radius(marker: Marker) -> float:
    """Of a marker's body, m: a flat patch is half as wide as long, so that it stands little out of the skin."""
    if marker.patch in FLAT_PATCHES:
        return 0.25e-3 * marker.length_mm if marker.length_mm else _FLAT_RADIUS_M
    return 1e-3 * marker.radius_mm if marker.radius_mm else _DEFAULT_RADIUS_M


class MarkerMesh:
    """Painted fingertips are capsules along the last bone, nails and dots short flat ones where the paint is, bands lie
    about the wrist, everything else is a ball: also a ring about a finger, of which the ball stands out all round."""

    def __init__(self, markers: MarkerSet, anatomy: HandAnatomy) -> None:
        self._bands = [k for k, marker in enumerate(markers.markers)
                       if marker.shape == "band" and marker.role not in TIP_ROLES]
        self._bodies = [k for k in range(len(markers.markers)) if k not in self._bands]
        self._template = capsule_template(14, 4)
        bodies = [markers.markers[k] for k in self._bodies]
        self._radii = np.array([_radius(marker) for marker in bodies])
        long = [(m.shape == "capsule" and m.patch == "segment") or m.patch in FLAT_PATCHES for m in bodies]
        lengths = np.where(long, [m.length_mm or 0.0 for m in bodies], 0.0)
        self._halves = np.maximum(0.5e-3 * lengths - self._radii, 0.0)
        self._tips = np.array([JOINTS.index(m.role) if m.role in TIP_ROLES else -1 for m in bodies], dtype=np.intp)
        width = next((m.length_mm for m in markers.markers if m.shape == "band" and m.length_mm), 14.0)
        self._band = elliptic_band(0.5e-3 * anatomy.wrist_breadth_mm + 0.002,
                                   0.5e-3 * anatomy.wrist_thickness_mm + 0.002, 1e-3 * width)
        self._body_size, self._band_size = len(self._template.directions), len(self._band.vertices)
        first_band = len(self._bodies) * self._body_size
        self.faces: Faces = np.concatenate([
            repeat_faces(self._template.faces, self._body_size, len(self._bodies)),
            repeat_faces(self._band.faces, self._band_size, len(self._bands)) + np.uint32(first_band)])
        order = [markers.markers[k] for k in (*self._bodies, *self._bands)]
        self._sizes = [self._body_size] * len(self._bodies) + [self._band_size] * len(self._bands)
        self.colours = colour_rows(order, self._sizes, 255)

    def pose(self, state: HandState) -> PosedMesh:
        """The markers at `state`; one without a position is not drawn."""
        places = state.marker_positions
        known = np.asarray(np.isfinite(places).all(axis=1))
        places = np.where(known[:, None], places, 0.0)
        axis = self._halves[:, None] * self._last_bones(state)
        centres = places[self._bodies]
        vertices, normals = pose_capsules(
            self._template, to_display(centres - axis), to_display(centres + axis),
            ((self._radii + _PROUD_M) * known[self._bodies])[:, None] * np.ones(2))
        parts, part_normals = [vertices], [normals]
        rotation = state.world_from_palm[:3, :3]
        rotation = rotation if np.isfinite(rotation).all() else np.eye(3)
        for k in self._bands:
            parts.append(to_display(known[k] * (self._band.vertices @ rotation.T) + places[k]))
            part_normals.append(to_display(self._band.normals @ rotation.T))
        knowledge = np.repeat(state.marker_knowledge[self._bodies + self._bands].astype(np.uint8), self._sizes)
        return PosedMesh(np.concatenate(parts), np.concatenate(part_normals), knowledge)

    def _last_bones(self, state: HandState) -> Array:
        """Unit directions (bodies, 3) of the bones that the markers are painted on; zero where there is none."""
        joints = state.joint_positions
        bones = np.where((self._tips >= 0)[:, None], joints[self._tips] - joints[self._tips - 1], 0.0)
        length = np.linalg.norm(bones, axis=1, keepdims=True)
        return np.where(length > 1e-6, bones / np.maximum(length, 1e-6), 0.0)
