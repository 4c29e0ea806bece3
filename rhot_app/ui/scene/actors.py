"""What moves in the scene: hand, skeleton, markers, their clouds and the shadow on the floor, as OpenGL items."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rhot_app.project import Rig
from rhot_app.tracking.state import HandState, Knowledge
from rhot_app.ui.models.palette import Scheme, rgb_of
from rhot_app.ui.scene.hand_mesh import HandMesh, PosedMesh, SkeletonMesh
from rhot_app.ui.scene.marker_mesh import CloudMesh, MarkerMesh
from rhot_app.ui.scene.mesh_item import MeshItem
from rhot_app.ui.scene.stage import FLOOR_M

Colours = NDArray[np.uint8]

ALPHA: dict[Knowledge, int] = {Knowledge.MEASURED: 255, Knowledge.INFERRED: 130, Knowledge.GUESSED: 120,
                               Knowledge.UNKNOWN: 0}
"""Measured is solid, inferred translucent, guessed translucent and hatched, unknown not drawn."""


class Actors:
    """The moving items of one rig in one colour scheme. `items` are to be added to the view, in drawing order."""

    def __init__(self, rig: Rig, scheme: Scheme) -> None:
        self._scheme = scheme
        self._hand = HandMesh(rig.hand)
        self._skeleton = SkeletonMesh()
        self._markers = MarkerMesh(rig.markers, rig.hand)
        self._clouds = CloudMesh(rig.markers)
        self.show_clouds = True
        self._shadow_item = MeshItem(self._hand.faces, lit=False, behind=True)
        self._skeleton_item = MeshItem(self._skeleton.faces)
        self._marker_item = MeshItem(self._markers.faces)
        self._hand_item = MeshItem(self._hand.faces)
        self._cloud_item = MeshItem(self._clouds.faces)
        self.items = (self._shadow_item, self._skeleton_item, self._marker_item, self._hand_item, self._cloud_item)
        for depth, item in zip((-20, 1, 2, 3, 4), self.items, strict=True):
            item.setDepthValue(depth)
        self.hide()

    def hide(self) -> None:
        """Show nothing until the next pose."""
        for item in self.items:
            item.setVisible(False)

    def pose(self, state: HandState) -> None:
        """Show everything at `state`."""
        for item in self.items:
            item.setVisible(item is not self._cloud_item or self.show_clouds)
        skin = self._hand.pose(state)
        self._hand_item.set_vertices(skin.vertices, skin.normals, self._skin_colours(skin),
                                     skin.knowledge == Knowledge.GUESSED)
        self._pose_shadow(skin)
        bones = self._skeleton.pose(state)
        self._skeleton_item.set_vertices(bones.vertices, bones.normals, self._plain(self._scheme.text, bones),
                                         np.zeros(len(bones.vertices), bool))
        markers = self._markers.pose(state)
        colours = self._markers.colours.copy()
        colours[:, 3] = _alphas()[markers.knowledge]
        self._marker_item.set_vertices(markers.vertices, markers.normals, colours,
                                       markers.knowledge == Knowledge.GUESSED)
        if self.show_clouds:
            clouds = self._clouds.pose(state)
            self._cloud_item.set_vertices(clouds.vertices, clouds.normals, self._clouds.colours,
                                          np.zeros(len(clouds.vertices), bool))

    def _pose_shadow(self, skin: PosedMesh) -> None:
        flat = skin.vertices.copy()
        flat[:, 2] = FLOOR_M
        self._shadow_item.set_vertices(flat, skin.normals, self._plain(self._scheme.shadow, skin),
                                       np.zeros(len(flat), bool))

    def _plain(self, colour: str, mesh: PosedMesh) -> Colours:
        return np.tile(np.array([*rgb_of(colour), 255], np.uint8), (len(mesh.vertices), 1))

    def _skin_colours(self, skin: PosedMesh) -> Colours:
        table = np.zeros((len(Knowledge), 4), np.uint8)
        for knowledge in Knowledge:
            colour = self._scheme.guessed if knowledge == Knowledge.GUESSED else self._scheme.hand
            table[knowledge] = (*rgb_of(colour), ALPHA[knowledge])
        return np.asarray(table[skin.knowledge])


def _alphas() -> NDArray[np.uint8]:
    return np.array([ALPHA[knowledge] for knowledge in Knowledge], np.uint8)
