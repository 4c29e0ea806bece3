"""What moves with one hand: skin, skeleton, its markers, ellipsoids and its shadow on the floor, as OpenGL items."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rhot_app.tracking.state import HandState, Knowledge
from rhot_app.ui.models.palette import Scheme, rgb_of
from rhot_app.ui.scene.ellipsoid_mesh import EllipsoidChoice, EllipsoidMesh
from rhot_app.ui.scene.hand_mesh import HandMesh, PosedMesh, SkeletonMesh
from rhot_app.ui.scene.hands import OneHand
from rhot_app.ui.scene.known import tinted, with_knowledge
from rhot_app.ui.scene.marker_mesh import MarkerMesh
from rhot_app.ui.scene.mesh_item import MeshItem
from rhot_app.ui.scene.stage import FLOOR_M

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
