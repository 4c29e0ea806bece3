"""The scene of the 3-D mouse: a ground, the cursor on its pole, balls and targets, and what they throw shadows on."""

from __future__ import annotations

from typing import Final

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from pyqtgraph.opengl import GLLinePlotItem, GLViewWidget
from PySide6.QtCore import Qt
from PySide6.QtGui import QKeyEvent, QVector3D
from PySide6.QtWidgets import QWidget

from rhot_app.mouse.pick_scene import PickScene
from rhot_app.mouse.pointer import GROUND_M, MouseState
from rhot_app.mouse.target_test import WIDTH_M, TargetTest
from rhot_app.ui.language import tr
from rhot_app.ui.models.palette import Scheme, rgb_of
from rhot_app.ui.scene.mesh_item import MeshItem
from rhot_app.ui.scene.meshes import capsule_template, pose_capsules, repeat_faces

Array = NDArray[np.float64]
Bytes = NDArray[np.uint8]

LIGHT: Final = np.array([0.45, 0.3])
"""Shift of a shadow on the ground, right and forward, per metre of height: the light comes from the left and the
front."""

_CELL_M: Final = 0.06
_POLE_M, _LINE_M, _TIP_M = 0.002, 0.0012, 0.006  # radii
_DISTANCE_M, _ELEVATION_DEG, _FIELD_OF_VIEW_DEG = 0.86, 30.0, 40.0
_TEMPLATE: Final = capsule_template(20, 6)
_PARTS: Final = 3  # pole, cursor and selection line stand before the balls


class MouseView(GLViewWidget):
    """`show_mouse` poses everything. Left drag turns, the wheel zooms."""

    def __init__(self, scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("mouse scene")
        self.setMinimumSize(320, 240)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setAccessibleName(tr("Three-dimensional scene of the mouse: ground, cursor and balls"))
        self.setCameraParams(fov=_FIELD_OF_VIEW_DEG, center=QVector3D(0.0, 0.0, 0.07), distance=_DISTANCE_M,
                             azimuth=-90.0, elevation=_ELEVATION_DEG)
        self._scheme = scheme
        self._count = 0
        self._rebuild(len(PickScene().balls))

    def set_scheme(self, scheme: Scheme) -> None:
        """Change colours."""
        self._scheme = scheme
        self._rebuild(self._count)

    def show_mouse(self, mouse: MouseState | None, scene: PickScene, test: TargetTest | None) -> None:
        """Pose the cursor, the balls or, during a test, the targets."""
        balls = scene.balls if test is None else []
        if len(balls) != self._count:
            self._rebuild(len(balls))
        vertices, normals, colours, hatched = self._solids(mouse, scene, test is None)
        self._solid_item.set_vertices(vertices, normals, colours, hatched)
        shade = np.tile(np.array([*rgb_of(self._scheme.shadow), 255], np.uint8), (len(vertices), 1))
        self._shadow_item.set_vertices(shadow_of(vertices), normals, shade, np.zeros(len(vertices), bool))
        self._target_item.setVisible(test is not None)
        if test is not None:
            self._show_targets(test)
        self.update()

    def keyPressEvent(self, ev: QKeyEvent) -> None:  # noqa: N802
        """The arrow keys turn the view; every other key goes to the window's shortcuts."""
        if ev.key() in self.noRepeatKeys:
            super().keyPressEvent(ev)
        else:
            ev.ignore()

    def _rebuild(self, balls: int) -> None:
        """New items for another scheme, or another number of balls."""
        self.clear()
        self._count = balls
        self.setBackgroundColor(pg.mkColor(self._scheme.scene))
        corners = 0.5 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * [*GROUND_M, 0.0]
        ground = MeshItem(np.array([[0, 1, 2], [0, 2, 3]], np.uint32), lit=False, behind=True)
        up = np.tile([0.0, 0.0, 1.0], (4, 1))
        ground.set_vertices(corners, up, np.tile(np.array([*rgb_of(self._scheme.raised), 255], np.uint8), (4, 1)),
                            np.zeros(4, bool))
        grid = GLLinePlotItem(pos=grid_lines(), color=pg.mkColor(self._scheme.grid_strong), mode="lines",
                              antialias=True, glOptions="translucent")
        vertices, faces = len(_TEMPLATE.directions), _TEMPLATE.faces
        self._target_item = MeshItem(repeat_faces(_DISC_FACES, _DISC + 1, len(TargetTest().targets)), lit=False,
                                     behind=True)
        self._shadow_item = MeshItem(repeat_faces(faces, vertices, _PARTS + balls), lit=False, behind=True)
        self._solid_item = MeshItem(repeat_faces(faces, vertices, _PARTS + balls))
        for depth, item in enumerate((ground, grid, self._target_item, self._shadow_item, self._solid_item), -20):
            item.setDepthValue(depth)
            self.addItem(item)

    def _solids(self, mouse: MouseState | None, scene: PickScene,
                with_balls: bool) -> tuple[Array, Array, Bytes, NDArray[np.bool_]]:
        """Vertices, normals, colours and hatching of pole, cursor, selection line and balls. What is not there
        collapses to a point the ground's middle."""
        cursor = None if mouse is None else mouse.cursor
        tip = np.zeros(3) if cursor is None else cursor
        chosen = scene.held if scene.held is not None else scene.selected
        to = tip if chosen is None or not with_balls else np.array(scene.balls[chosen].centre)
        starts = [tip * [1.0, 1.0, 0.0], tip, tip]
        stops = [tip, tip, to]
        shown = float(cursor is not None)
        radii = [_POLE_M * shown, _TIP_M * shown, _LINE_M * shown * float(to is not tip)]
        pressed = mouse is not None and bool(mouse.pressed)
        colours = [rgb_of(self._scheme.text), rgb_of(self._scheme.accent if pressed else self._scheme.text),
                   rgb_of(self._scheme.accent)]
        if with_balls:
            starts += [np.array(ball.centre) for ball in scene.balls]
            stops += [np.array(ball.centre) for ball in scene.balls]
            radii += [ball.radius_m for ball in scene.balls]
            colours += [ball.rgb for ball in scene.balls]
        vertices, normals = pose_capsules(_TEMPLATE, np.array(starts), np.array(stops), np.tile(radii, (2, 1)).T)
        each = len(_TEMPLATE.directions)
        painted = np.repeat([[*colour, 255] for colour in colours], each, axis=0).astype(np.uint8)
        hatched = np.zeros(len(vertices), bool)
        hatched[:2 * each] = mouse is None or not mouse.observed
        return vertices, normals, painted, hatched

    def _show_targets(self, test: TargetTest) -> None:
        rim = 2.0 * np.pi * np.arange(_DISC) / _DISC
        disc = 0.5 * WIDTH_M * np.vstack([[0.0, 0.0], np.stack([np.cos(rim), np.sin(rim)], axis=1)])
        places = (test.targets[:, None] + disc).reshape(-1, 2)
        colours = np.array([[*rgb_of(self._scheme.accent if number == test.wanted else self._scheme.grid_strong), 255]
                            for number in range(len(test.targets))], np.uint8)
        flat = np.column_stack([places, np.zeros(len(places))])
        self._target_item.set_vertices(flat, np.tile([0.0, 0.0, 1.0], (len(flat), 1)),
                                       np.repeat(colours, _DISC + 1, axis=0), np.zeros(len(flat), bool))


_DISC: Final = 32  # corners of a target
_DISC_FACES: Final = np.array([(0, 1 + k, 1 + (k + 1) % _DISC) for k in range(_DISC)], np.uint32)


def shadow_of(vertices: Array) -> Array:
    """Where points (N, 3) m throw their shadows on the ground; at its edge they end."""
    half = 0.5 * np.array(GROUND_M)
    places = np.clip(vertices[:, :2] + vertices[:, 2:] * LIGHT, -half, half)
    return np.column_stack([places, np.zeros(len(places))])


def grid_lines() -> Array:
    """Segments (2 L, 3) m on the ground, every 60 mm."""
    half_x, half_y = 0.5 * GROUND_M[0], 0.5 * GROUND_M[1]
    across = [((-half_x, y, 0.0), (half_x, y, 0.0)) for y in np.arange(-half_y, half_y + 1e-9, _CELL_M)]
    along = [((x, -half_y, 0.0), (x, half_y, 0.0)) for x in np.arange(-half_x, half_x + 1e-9, _CELL_M)]
    return np.array(across + along).reshape(-1, 3)
