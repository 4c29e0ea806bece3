"""What moves with one hand: skin, skeleton, its markers, ellipsoids and its shadow on the floor, as OpenGL items."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rhot_app.hand.anatomy import HandAnatomy
from rhot_app.hand.skeleton import JOINTS, TIP_ROLES
from rhot_app.state import HandState, Knowledge
from rhot_app.ui.models.palette import Scheme, rgb_of
from rhot_app.ui.scene.ellipsoid_mesh import EllipsoidChoice, EllipsoidMesh
from rhot_app.ui.scene.frames import FLOOR_M, to_display
from rhot_app.ui.scene.hand_mesh import HandMesh, PosedMesh, SkeletonMesh, tinted, with_knowledge
from rhot_app.ui.scene.hands import OneHand
from rhot_app.ui.scene.mesh_item import MeshItem
from rhot_app.ui.scene.meshes import Faces, capsule_template, elliptic_band, pose_capsules, repeat_faces
from rhot_node.markers import FLAT_PATCHES, Marker, MarkerSet

Colours = NDArray[np.uint8]


class HandActors:
    """The moving items of one hand in one colour scheme. `items` are to be added to the view, in drawing order.

    `opacity` 0..1 makes all of them translucent.
    """

    def __init__(self, hand: OneHand, scheme: Scheme, opacity: float = 1.0) -> None:
        self._scheme = scheme
        self._opacity = opacity
        self._hand = hand
        self._skin = HandMesh(hand.anatomy)
        self._skeleton = SkeletonMesh()
        self._markers = MarkerMesh(hand.markers, hand.anatomy)
        self._ellipsoids = EllipsoidMesh(hand.markers, scheme)
        self._shade = np.tile(np.array([*rgb_of(scheme.shadow), 255], np.uint8), (1 + int(self._skin.faces.max()), 1))
        self._shadow_item = MeshItem(self._skin.faces, lit=False, behind=True)
        self._skeleton_item = MeshItem(self._skeleton.faces)
        self._marker_item = MeshItem(self._markers.faces)
        self._skin_item = MeshItem(self._skin.faces)
        self._ellipsoid_item = MeshItem(self._ellipsoids.faces, through=True)
        self.items = (self._shadow_item, self._skeleton_item, self._marker_item, self._skin_item,
                      self._ellipsoid_item)
        for depth, item in zip((-20, 1, 2, 3, 4), self.items, strict=True):
            item.setDepthValue(depth)
        self.hide()

    @property
    def cut(self) -> bool:
        """Whether an ellipsoid is drawn smaller than it is."""
        return self._ellipsoids.cut

    def hide(self) -> None:
        """Show nothing until the next pose."""
        for item in self.items:
            item.setVisible(False)

    def pose(self, state: HandState, choice: EllipsoidChoice | None) -> None:
        """Show the hand at a state of the whole rig; of the uncertainty what is chosen, None for nothing."""
        state = self._hand.state_of(state)
        for item in self.items:
            item.setVisible(item is not self._ellipsoid_item or (choice is not None and choice.any))
        skin = self._skin.pose(state)
        self._draw(self._skin_item, skin, tinted(self._scheme.hand, skin.knowledge, self._scheme))
        self._pose_shadow(skin)
        bones = self._skeleton.pose(state)
        self._draw(self._skeleton_item, bones, tinted(self._scheme.text, bones.knowledge, self._scheme))
        markers = self._markers.pose(state)
        self._draw(self._marker_item, markers, with_knowledge(self._markers.colours, markers.knowledge))
        if choice is not None and choice.any:
            clouds = self._ellipsoids.pose(state, choice)
            self._draw(self._ellipsoid_item, clouds, self._ellipsoids.colours(clouds))

    def _draw(self, item: MeshItem, mesh: PosedMesh, colours: Colours) -> None:
        """What is guessed is hatched, whatever it is."""
        if self._opacity < 1.0:
            colours = colours.copy()
            colours[:, 3] = self._opacity * colours[:, 3]
        item.set_vertices(mesh.vertices, mesh.normals, colours, mesh.knowledge == Knowledge.GUESSED)

    def _pose_shadow(self, skin: PosedMesh) -> None:
        flat = skin.vertices.copy()
        flat[:, 2] = FLOOR_M
        self._shadow_item.set_vertices(flat, skin.normals, self._shade, np.zeros(len(flat), bool))


# -- the markers as one posed mesh in their own colours ----------------------------------------------------------------

Array = NDArray[np.float64]

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
