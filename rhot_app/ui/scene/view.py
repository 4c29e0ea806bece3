"""The scene's widget: hands, markers, cameras and floor; orbit, pan, zoom; F frames the hands, Home resets the view."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from pyqtgraph.opengl import GLLinePlotItem, GLViewWidget
from PySide6.QtCore import QEvent, QPoint, Qt
from PySide6.QtGui import QHelpEvent, QKeyEvent, QMatrix4x4, QPainter, QResizeEvent, QVector3D
from PySide6.QtWidgets import QPushButton, QToolTip, QWidget

from rhot_app.calibration.check.camera_calibration import KNOWN_EXACTLY, calibration_error
from rhot_app.project import Rig
from rhot_app.state import HandState
from rhot_app.ui.language import tr
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.models.rows import marker_name
from rhot_app.ui.models.words import KINDS, each_hand, hand_names
from rhot_app.ui.scene.ellipsoid_mesh import EllipsoidChoice
from rhot_app.ui.scene.frames import (
    Up,
    axis_labels,
    axis_lines,
    camera_like,
    camera_like_state,
    floor_lines,
    frustum_lines,
    height_lines,
    tick_labels,
    to_display,
)
from rhot_app.ui.scene.hand_actors import HandActors
from rhot_app.ui.scene.hands import hands_of, nearest, spots
from rhot_app.ui.scene.labels import LabelPainter, Legend, TextStyle, ellipsoid_text, pixels_of
from rhot_app.ui.scene.object_actors import ObjectActors

Array = NDArray[np.float64]

_FIELD_OF_VIEW_DEG = 50.0
_FRUSTUM_M = 0.09
_HOME_DISTANCE_M = 1.05
_HOME_CENTRE_M = (0.06, 0.38, -0.04)
_HOME_AZIMUTH_DEG = -62.0
_HOME_ELEVATION_DEG = 20.0
_FRAMED_DISTANCE_M = 0.42
_FIRST_DISTANCE_M = 0.56  # with room around the hand for what it will do next
_HAND_RADIUS_M = 0.12
"""About the middle of a hand's joints; what reaches farther is looked at from so much farther away."""


class SceneView(GLViewWidget):
    """`show_rig` sets what does not move, `show_state` poses the rest.

    Left drag turns, middle drag or Ctrl + left drag moves, the wheel zooms, the arrow keys turn. The mouse held still
    over a marker or joint tells how well it is known. `actors` move; `second` are those of the second rig; None for
    none. `legend` is the key of colours and ellipsoids.
    """

    def __init__(self, scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("scene")
        self.setMinimumSize(320, 200)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setAccessibleName(tr("Three-dimensional scene of the hand and the cameras"))
        self._scheme = scheme
        self._rig: Rig | None = None
        self._by_calibration = KNOWN_EXACTLY
        self._state: HandState | None = None
        self._in_rig: HandState | None = None
        self.actors: Actors | None = None
        self._second_rig: Rig | None = None
        self._second_state: HandState | None = None
        self.second: Actors | None = None
        self._labels = LabelPainter()
        self.legend = Legend()
        self._show_labels = True
        self._ellipsoids: EllipsoidChoice | None = EllipsoidChoice()
        self._cameras: list[tuple[str, Array]] = []
        self.start_button = QPushButton(tr("Start tracking"), self)
        self.start_button.setProperty("primary", True)
        self.start_button.setToolTip(tr("Tell the nodes to stream (Space)."))
        self.start_button.hide()
        self._rebuild()
        self.reset_view()

    def set_scheme(self, scheme: Scheme) -> None:
        """Change colours."""
        self._scheme = scheme
        self._rebuild()

    def show_rig(self, rig: Rig | None) -> None:
        """Another rig: other cameras, markers and hands. None shows the empty floor."""
        self._rig, self._by_calibration = rig, calibration_error(rig)
        self._state = self._in_rig = None
        self._rebuild()

    def show_second_rig(self, rig: Rig | None) -> None:
        """Whose hands are drawn beside the first ones, translucent and in another colour; None for nobody's."""
        self._second_rig = rig
        self._second_state = None
        self._rebuild()

    def show_state(self, state: HandState | None, second: HandState | None = None) -> None:
        """Pose hands and markers; None hides them, and so does a state that came before its rig or after it.

        `second`: a state of the second rig.
        """
        state = _of_rig(state, self._rig)
        second = _of_rig(second, self._second_rig)
        self._in_rig = state
        self._state = None if state is None else camera_like_state(state, self._up)
        self._second_state = None if second is None else camera_like_state(second, self._up)
        self._pose()
        self.update()

    @property
    def state(self) -> HandState | None:
        """The state shown, in the rig's frame; None for none."""
        return self._in_rig

    @property
    def scheme(self) -> Scheme:
        """The colours."""
        return self._scheme

    @property
    def ellipsoids(self) -> EllipsoidChoice | None:
        """Which ellipsoids of uncertainty are drawn, None for none."""
        return self._ellipsoids

    def show_names(self, visible: bool) -> None:
        """Marker names beside the markers, or not."""
        self._show_labels = visible
        self.update()

    def show_ellipsoids(self, choice: EllipsoidChoice | None) -> None:
        """Which ellipsoids of uncertainty are drawn, None for none."""
        self._ellipsoids = choice
        if self.actors is not None:
            self.actors.ellipsoids = choice
        self._pose()
        self.update()

    def offer_start(self, offered: bool) -> None:
        """A button in the middle while nothing streams: the next step where the hand will be."""
        if offered != self.start_button.isVisibleTo(self):
            self.start_button.setVisible(offered)
            self._place_button()

    def _place_button(self) -> None:
        self.start_button.adjustSize()
        self.start_button.move((self.width() - self.start_button.width()) // 2, round(0.4 * self.height()))

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802
        """Keep the button in the middle."""
        super().resizeEvent(event)
        self._place_button()

    def reset_view(self) -> None:
        """Back to the view from beside and above, which shows the cameras too."""
        self.setCameraParams(fov=_FIELD_OF_VIEW_DEG, center=QVector3D(*_HOME_CENTRE_M), distance=_HOME_DISTANCE_M,
                             azimuth=_HOME_AZIMUTH_DEG, elevation=_HOME_ELEVATION_DEG)
        self._untouched_view = self.cameraParams()
        self.update()

    def frame_first(self) -> None:
        """Go near the hands, unless somebody has moved the view since it was reset."""
        if self.cameraParams() == self._untouched_view and self._show_hands_from(_FIRST_DISTANCE_M):
            self._untouched_view = self.cameraParams()

    def frame_hand(self) -> None:
        """Bring the hands into the middle, near enough to see every finger; without a hand, reset the view."""
        if not self._show_hands_from(_FRAMED_DISTANCE_M):
            self.reset_view()

    def _show_hands_from(self, distance_m: float) -> bool:
        """Bring the hands that are there into the middle, one hand from so far away; False when there is none."""
        joints = np.concatenate([hand.joint_positions for hand in each_hand(self._state)] or [np.empty((0, 3))])
        joints = joints[np.isfinite(joints).all(axis=1)]
        if not len(joints):
            return False
        middle = 0.5 * (joints.min(axis=0) + joints.max(axis=0))
        reach_m = float(np.linalg.norm(joints - middle, axis=1).max())
        self.setCameraParams(center=QVector3D(*(float(v) for v in to_display(middle))),
                             distance=distance_m * max(reach_m / _HAND_RADIUS_M, 1.0))
        self.update()
        return True

    def keyPressEvent(self, ev: QKeyEvent) -> None:  # noqa: N802
        """The arrow keys turn the view; every other key goes to the window's shortcuts."""
        if ev.key() in self.noRepeatKeys:
            super().keyPressEvent(ev)
        else:
            ev.ignore()

    def event(self, event: QEvent) -> bool:
        """The mouse has been held still: what lies there, or nothing."""
        if event.type() == QEvent.Type.ToolTip and isinstance(event, QHelpEvent):
            QToolTip.showText(event.globalPos(), self.tool_tip_at(event.pos()), self)
            return True
        return bool(super().event(event))

    def tool_tip_at(self, at: QPoint) -> str:
        """What is known of the marker or joint nearest to a place in the widget, "" when none is near."""
        found = spots(self._in_rig, hand_names(self._rig)) if self._in_rig is not None else []
        if not found:
            return ""
        number = nearest(self.to_widget(np.array([spot.place for spot in found])), (at.x(), at.y()))
        return "" if number is None else found[number].text(self._by_calibration)

    def to_widget(self, places: Array) -> Array:
        """(N, 2) px of the widget, NaN behind the viewer, of places (N, 3) m in the rig's frame."""
        return pixels_of(to_display(camera_like(places, self._up)), self._projection(), (self.width(), self.height()))

    def marker_labels(self) -> tuple[Array, list[str]]:
        """Where the markers' names stand, (N, 3) m in the scene's frame, and these names; none without a state. Of
        landmarks only wrist and fingertips have one: twenty-one would cover the hand."""
        if self._state is None or self._rig is None or not self._show_labels:
            return np.empty((0, 3)), []
        inner = {marker.id for marker in self._rig.markers.markers if marker.shape == "landmark"
                 and not (marker.role or "").endswith(("_tip", "_wrist"))}
        named = [k for k, name in enumerate(self._state.marker_ids) if name not in inner]
        return (to_display(self._state.marker_positions[named]),
                [marker_name(self._state.marker_ids[k]) for k in named])

    def _projection(self) -> QMatrix4x4:
        return self.projectionMatrix(self.getViewport(), self.getViewport()) * self.viewMatrix()

    def paintGL(self) -> None:  # noqa: N802
        """The scene, then the labels over it in one painter."""
        super().paintGL()
        painter = QPainter(self)
        painter.setFont(self.font())
        self._paint_labels(painter)
        painter.end()

    def _rebuild(self) -> None:
        """New items for another rig or scheme; never while a hand moves."""
        self.clear()
        self._labels.clear()
        self.setBackgroundColor(pg.mkColor(self._scheme.scene))
        self._cameras = []
        self._add_stage()
        self.actors = None
        if self._rig is not None:
            self._add_cameras(self._rig)
            self.actors = Actors(self._rig, self._scheme)
            self.actors.ellipsoids = self._ellipsoids
            for item in self.actors.items:
                self.addItem(item)
        self.second = second_actors(self._second_rig, self._scheme) if self._second_rig is not None else None
        for item in self.second.items if self.second is not None else ():
            self.addItem(item)
        self._pose()
        self.update()

    @property
    def tracker_word(self) -> str:
        """What makes a hand of the markers; "" without a rig."""
        return "" if self._rig is None else tr(KINDS[self._rig.tracker.kind][0]).lower()

    @property
    def _up(self) -> Up:
        return "-y" if self._rig is None else self._rig.up

    def _pose(self) -> None:
        for actors, state in ((self.actors, self._state), (self.second, self._second_state)):
            if actors is not None and state is not None:
                actors.pose(state)
            elif actors is not None:
                actors.hide()

    def _add_lines(self, segments: Array, colour: Array | str, width: float = 1.0, depth: int = -10) -> None:
        item = GLLinePlotItem(pos=segments, color=colour if isinstance(colour, np.ndarray) else pg.mkColor(colour),
                              width=width, mode="lines", antialias=True, glOptions="translucent")
        item.setDepthValue(depth)
        self.addItem(item)

    def _add_stage(self) -> None:
        segments, strong = floor_lines()
        self._add_lines(segments[~strong], self._scheme.grid)
        self._add_lines(np.concatenate([segments[strong], height_lines()]), self._scheme.grid_strong)
        on_table = self._up == "z"
        both = (tick_labels(on_table=on_table), axis_labels(on_table=on_table))
        self._stage_labels = [(np.array([label.place for label in labels]), [label.text for label in labels])
                              for labels in both]
        axes, colours = axis_lines(on_table=on_table)
        self._add_lines(axes, colours, width=2.0, depth=-5)

    def _add_cameras(self, rig: Rig) -> None:
        nodes = [node for node in rig.nodes if node.pose_known]
        frusta = [frustum_lines(node.intrinsics, node.pose, _FRUSTUM_M, self._up) for node in nodes]
        self._add_lines(np.concatenate(frusta), self._scheme.frustum, width=1.5, depth=-5)
        self._cameras = [(node.name, lines[-2]) for node, lines in zip(nodes, frusta, strict=True)]

    def _paint_labels(self, painter: QPainter) -> None:
        matrix = self._projection()
        size = (self.width(), self.height())
        muted, plain = TextStyle(self._scheme.muted), TextStyle(self._scheme.text)
        for (places, texts), style in zip(self._stage_labels, (muted, plain), strict=True):
            self._labels.paint(painter, matrix, size, places, texts, style)
        self._labels.paint(painter, matrix, size, np.array([place for _, place in self._cameras]),
                           [name for name, _ in self._cameras], muted, lift=10.0)
        places, names = self.marker_labels()
        if names:
            style = TextStyle(self._scheme.text, small=False, plate=self._scheme.scene)
            self._labels.paint_apart(painter, matrix, size, places, names, style)
        if self.actors is not None:
            text = ellipsoid_text(self._ellipsoids, cut=self._state is not None and self.actors.cut,
                                  pictures_alone=not self._by_calibration.known)
            self.legend.paint(painter, size, self._scheme, text, self.tracker_word)


def _of_rig(state: HandState | None, rig: Rig | None) -> HandState | None:
    """`state`, unless it has another rig's markers."""
    return state if state is None or rig is None or state.marker_ids == rig.markers.ids else None


# -- what moves in the scene -------------------------------------------------------------------------------------------

class Actors:
    """The moving items of one rig in one colour scheme, by its `hands`. `items` are to be added to the view.

    `ellipsoids` chooses what is drawn of the uncertainty, None for nothing. `opacity` 0..1 is of everything.
    """

    def __init__(self, rig: Rig, scheme: Scheme, opacity: float = 1.0) -> None:
        self.hands = tuple(HandActors(hand, scheme, opacity) for hand in hands_of(rig))
        self._objects = ObjectActors(rig, scheme, opacity)
        self.ellipsoids: EllipsoidChoice | None = EllipsoidChoice()
        self.items = (*(item for hand in self.hands for item in hand.items), *self._objects.items)

    @property
    def visible(self) -> bool:
        """Whether anything is shown."""
        return any(item.visible() for item in self.items)

    @property
    def cut(self) -> bool:
        """Whether an ellipsoid is drawn smaller than it is."""
        return self.ellipsoids is not None and any(hand.cut for hand in self.hands)

    def hide(self) -> None:
        """Show nothing until the next pose."""
        for hand in self.hands:
            hand.hide()
        self._objects.hide()

    def pose(self, state: HandState) -> None:
        """Show everything at a state of this rig."""
        for hand in self.hands:
            hand.pose(state, self.ellipsoids)
        self._objects.pose(state.objects)


_SECOND_OPACITY = 0.45


def second_actors(rig: Rig, scheme: Scheme) -> Actors:
    """The hands of a second run of the same recording: translucent, in the accent colour, without ellipsoids."""
    actors = Actors(rig, replace(scheme, hand=scheme.accent, text=scheme.accent), _SECOND_OPACITY)
    actors.ellipsoids = None
    return actors
