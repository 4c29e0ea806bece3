"""One camera's picture with the hand drawn over it: joints to drag as handles, the skeleton, and the contour."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import (
    QColor,
    QImage,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPen,
    QPolygonF,
    QResizeEvent,
    QWheelEvent,
)
from PySide6.QtWidgets import QSizePolicy, QWidget

from rhot_app.export.overlay import INNER_RGB, SILHOUETTE_RGB
from rhot_app.hand.skeleton import JOINTS
from rhot_app.handfit.session import Outline
from rhot_app.ui.common.shapes import paint_tag
from rhot_app.ui.language import tr
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.wizards.framework.picture_painter import FramePlacement, fit

Array = NDArray[np.float64]
Image = NDArray[np.uint8]

REACH_PX: Final = 12.0
"""Of the screen: a press so near to a joint takes it, a fingertip's half width on a touch screen."""

CLICK_PX: Final = 3.0
"""Of the screen: a press that moves less is a click, and drags nothing (chosen)."""

HANDLE_PX: Final = 4.5
MOST_ZOOM: Final = 16.0
NUDGE_PX, LARGE_NUDGE_PX = 0.5, 5.0
"""px of the picture per press of an arrow key, and with Shift."""

_CASING = QColor(0, 0, 0, 170)
_TAG_PX = 12.0  # between a joint and its name
_MARGIN = 1.4  # of a hand that is framed: forearm and thickness about its joints
_FAR_PX = 0.5  # an anchor whose joint is farther away is joined to it by a line


class FitPicture(QWidget):
    """A press on a joint, moves and release give `grabbed` (joint), `dragged` (x, y px, whether the pointer has
    stopped) and `released`; `removed` (joint) asks for an anchor to be taken away, `chosen` (joint) says which joint is
    meant now."""

    grabbed = Signal(int)
    dragged = Signal(float, float, bool)
    released = Signal()
    removed = Signal(int)
    chosen = Signal(int)

    def __init__(self, name: str, size: tuple[int, int], scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.name, self._size, self._scheme = name, size, scheme
        self._image = QImage()
        self._kept: Image | None = None
        self._problem = ""
        self.joints = np.full((len(JOINTS), 2), np.nan)
        self.anchors: Mapping[int, tuple[float, float]] = {}
        self._errors: Mapping[int, float] = {}
        self._outline: Sequence[Outline] = ()
        self.joint = -1  # the one meant
        self.usable = False
        self._dragging, self._moved, self._pressed = False, False, QPointF()
        self._zoom, self._middle = 1.0, np.array([0.5, 0.5])  # the part of the picture at the widget's middle
        self._pan: QPointF | None = None
        self.setMinimumSize(240, 180)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setMouseTracking(True)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setAccessibleName(tr("Picture of camera {name}", name=name))
        self.setToolTip(tr("Drag a joint to its place; the right button frees it. The wheel zooms, the middle button "
                           "moves the picture, a double click shows all of it, F frames the hand. Without a mouse: "
                           "comma and point choose a joint, arrows move it, Delete frees it."))

    def sizeHint(self) -> QSize:  # noqa: N802
        """Four by three."""
        return QSize(640, 480)

    # -- what is shown ---------------------------------------------------------------------------------------------

    @property
    def shown(self) -> Image | None:
        """The picture; None while there is none."""
        return self._kept

    @property
    def problem(self) -> str:
        """Why there is no new picture; "" while all is well."""
        return self._problem

    def show_image(self, image: Image | None, problem: str = "", *, bgr: bool = False) -> None:
        """A picture (H, W, 3); None: `problem` in its place."""
        if image is self._kept and problem == self._problem:
            return
        self._kept, self._problem = image, problem
        if image is None:
            self._image = QImage()
        else:
            height, width = image.shape[:2]
            kind = QImage.Format.Format_BGR888 if bgr else QImage.Format.Format_RGB888
            self._image = QImage(image.data, width, height, image.strides[0], kind)
        self.update()

    def show_hand(self, joints: Array, outline: Sequence[Outline], anchors: Mapping[int, tuple[float, float]],
                  errors: Mapping[int, float]) -> None:
        """`joints` (21, 2) px, NaN for none; anchors and their errors px by joint."""
        self.joints, self._outline, self.anchors, self._errors = joints, outline, anchors, errors
        self.update()

    def set_scheme(self, scheme: Scheme) -> None:
        """Other colours."""
        self._scheme = scheme
        self.update()

    def choose(self, joint: int) -> None:
        """Another joint is meant."""
        if joint != self.joint:
            self.joint = joint
            self.update()

    def frame_hand(self) -> None:
        """Zoom so that the hand fills the picture; all of the picture without a hand."""
        known = self.joints[np.isfinite(self.joints).all(axis=1)]
        inside = known[np.all((known >= 0.0) & (known < self._size), axis=1)]
        self._zoom, self._middle = 1.0, np.array([0.5, 0.5])
        if len(inside) > len(JOINTS) // 2:
            low, high = inside.min(axis=0), inside.max(axis=0)
            scale = self.place().scale * _MARGIN
            self._zoom = float(np.clip(min(self.width() / max((high[0] - low[0]) * scale, 1.0),
                                           self.height() / max((high[1] - low[1]) * scale, 1.0)), 1.0, MOST_ZOOM))
            self._look_at(0.5 * (low + high) / np.array(self._size))
        self.update()

    # -- places ----------------------------------------------------------------------------------------------------

    def place(self) -> FramePlacement:
        """Where the picture lies, larger than the widget when it is zoomed."""
        whole = fit(*self._size, QRectF(self.rect()))
        width, height = whole.target.width() * self._zoom, whole.target.height() * self._zoom
        centre = QRectF(self.rect()).center()
        return FramePlacement(QRectF(centre.x() - self._middle[0] * width, centre.y() - self._middle[1] * height, width,
                                     height), *self._size)

    def to_widget(self, x: float, y: float) -> QPointF:
        """A pixel of the picture on the widget."""
        return self.place().to_widget(np.array([[x, y]]))[0]

    def _to_picture(self, at: QPointF) -> tuple[float, float]:
        """A point of the widget as px of the picture, also outside of it."""
        place = self.place()
        return ((at.x() - place.target.x()) / place.scale - 0.5, (at.y() - place.target.y()) / place.scale - 0.5)

    def _joint_at(self, at: QPointF) -> int:
        """The nearest joint within reach, anchors first; -1 for none."""
        place, best = self.place(), (REACH_PX, -1)
        for joint, own in enumerate(self.joints):
            shown = place.to_widget(np.array([own, self.anchors.get(joint, (np.nan, np.nan))]))
            for point in shown:
                distance = float(np.hypot(point.x() - at.x(), point.y() - at.y()))
                best = min(best, (distance - (1.0 if joint in self.anchors else 0.0), joint))
        return best[1]

    # -- mouse and keys --------------------------------------------------------------------------------------------

    def mousePressEvent(self, event: QMouseEvent) -> None:  # noqa: N802
        """Take a joint, free it with the right button, or move the picture."""
        if event.button() == Qt.MouseButton.MiddleButton:
            self._pan = event.position()
            return
        joint = self._joint_at(event.position()) if self.usable else -1
        if joint < 0:
            return
        self.choose(joint)
        self.chosen.emit(joint)
        if event.button() == Qt.MouseButton.LeftButton:
            self._dragging, self._moved, self._pressed = True, False, event.position()
            self.grabbed.emit(joint)
        elif event.button() == Qt.MouseButton.RightButton:
            self.removed.emit(joint)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:  # noqa: N802
        """Drag, move the picture, or say which joint is here."""
        if self._pan is not None:
            place, moved = self.place(), event.position() - self._pan
            self._pan = event.position()
            self._look_at(self._middle - np.array([moved.x() / place.target.width(),
                                                   moved.y() / place.target.height()]))
        elif self._dragging:
            self._moved = self._moved or (event.position() - self._pressed).manhattanLength() >= CLICK_PX
            if self._moved:
                self.dragged.emit(*self._to_picture(event.position()), False)
        elif self.usable:
            joint = self._joint_at(event.position())
            self.setCursor(Qt.CursorShape.OpenHandCursor if joint >= 0 else Qt.CursorShape.ArrowCursor)
            if joint >= 0:
                self.choose(joint)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:  # noqa: N802
        """The end of a drag."""
        self._pan = None
        if self._dragging and event.button() == Qt.MouseButton.LeftButton:
            self._dragging = False
            if self._moved:
                self.dragged.emit(*self._to_picture(event.position()), True)
            self.released.emit()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:  # noqa: N802
        """The whole picture again; on a joint it is a press."""
        if self.usable and self._joint_at(event.position()) >= 0:
            self.mousePressEvent(event)
        else:
            self._zoom, self._middle = 1.0, np.array([0.5, 0.5])
            self.update()

    def wheelEvent(self, event: QWheelEvent) -> None:  # noqa: N802
        """Larger or smaller about the pointer."""
        before = np.array(self._to_picture(event.position()))
        self._zoom = float(np.clip(self._zoom * 2.0 ** (event.angleDelta().y() / 360.0), 1.0, MOST_ZOOM))
        after = np.array(self._to_picture(event.position()))
        self._look_at(self._middle + (before - after) / np.array(self._size))
        event.accept()

    def _look_at(self, middle: Array) -> None:
        """Move the picture, as far as it still fills the widget; in the middle where it is smaller."""
        target = self.place().target
        margin = np.minimum(0.5 * np.array([self.width(), self.height()])
                            / np.array([target.width(), target.height()]), 0.5)
        self._middle = np.clip(middle, margin, 1.0 - margin)
        self.update()

    def keyPressEvent(self, event: QKeyEvent) -> None:  # noqa: N802
        """Choose, move and free joints without a mouse."""
        key, steps = event.key(), {Qt.Key.Key_Left: (-1, 0), Qt.Key.Key_Right: (1, 0), Qt.Key.Key_Up: (0, -1),
                                   Qt.Key.Key_Down: (0, 1)}
        if self.usable and key in (Qt.Key.Key_Comma, Qt.Key.Key_Period):
            self.choose((max(self.joint, 0) + (1 if key == Qt.Key.Key_Period else -1 if self.joint >= 0 else 0))
                        % len(JOINTS))
            self.chosen.emit(self.joint)
        elif self.usable and key in steps and self.joint >= 0 and np.isfinite(self.joints[self.joint]).all():
            far = LARGE_NUDGE_PX if event.modifiers() & Qt.KeyboardModifier.ShiftModifier else NUDGE_PX
            x, y = self.anchors.get(self.joint, tuple(self.joints[self.joint]))
            self.grabbed.emit(self.joint)
            self.dragged.emit(x + far * steps[Qt.Key(key)][0], y + far * steps[Qt.Key(key)][1], True)
            self.released.emit()
        elif self.usable and key in (Qt.Key.Key_Delete, Qt.Key.Key_Backspace) and self.joint >= 0:
            self.removed.emit(self.joint)
        else:
            super().keyPressEvent(event)

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802
        """As before, in another size."""
        super().resizeEvent(event)
        self.update()

    # -- painting --------------------------------------------------------------------------------------------------

    def paintEvent(self, event: object) -> None:  # noqa: N802
        """Picture, outline, skeleton, handles, words."""
        painter = QPainter(self)
        painter.setRenderHints(QPainter.RenderHint.Antialiasing | QPainter.RenderHint.SmoothPixmapTransform)
        place = self.place()
        shown = place.target.intersected(QRectF(self.rect()))
        painter.fillRect(shown, QColor(self._scheme.scene))
        painter.setClipRect(shown)
        if not self._image.isNull():
            painter.drawImage(place.target, self._image)
        else:
            painter.setPen(QColor(self._scheme.text))
            painter.drawText(shown.adjusted(24, 24, -24, -24), Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap,
                             self._problem or tr("no picture of this camera"))
        if self.usable:
            self._paint_outline(painter, place)
            self._paint_skeleton(painter, place)
            self._paint_handles(painter, place)
        paint_tag(painter, shown.topLeft() + QPointF(6, 6), self.name, bold=True)
        if self.usable and self.joint >= 0 and np.isfinite(self.joints[self.joint]).all():
            error = self._errors.get(self.joint)
            words = JOINTS[self.joint].replace("_", " ") + ("" if error is None
                                                            else tr(", {error:.1f} px away", error=error))
            at = place.to_widget(self.joints[self.joint][None])[0]
            wide = painter.fontMetrics().horizontalAdvance(words) + _TAG_PX
            left = min(max(at.x() + _TAG_PX, shown.left()), shown.right() - wide)
            top = min(max(at.y() - 2 * _TAG_PX, shown.top()), shown.bottom() - 2 * _TAG_PX)
            paint_tag(painter, QPointF(left, top), words)
        if self.hasFocus():
            painter.setPen(QPen(QColor(self._scheme.accent), 1.5))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawRect(shown.adjusted(1, 1, -1, -1))
        painter.end()

    def _paint_outline(self, painter: QPainter, place: FramePlacement) -> None:
        for piece in self._outline:
            line = QPolygonF(place.to_widget(piece.points))
            painter.setPen(QPen(QColor(*(INNER_RGB if piece.inner else SILHOUETTE_RGB)), 1.6,
                                Qt.PenStyle.DashLine if piece.inner else Qt.PenStyle.SolidLine))
            painter.drawPolyline(line)

    def _paint_skeleton(self, painter: QPainter, place: FramePlacement) -> None:
        for pen in (QPen(_CASING, 3.0), QPen(QColor("#ffffff"), 1.2)):
            painter.setPen(pen)
            for finger in range(5):
                for a, b in itertools.pairwise([0, *range(1 + 4 * finger, 5 + 4 * finger)]):
                    if np.isfinite(self.joints[[a, b]]).all():
                        painter.drawLine(*place.to_widget(self.joints[[a, b]]))

    def _paint_handles(self, painter: QPainter, place: FramePlacement) -> None:
        accent = QColor(self._scheme.accent)
        for joint, own in enumerate(self.joints):
            if not np.isfinite(own).all():
                continue
            at = place.to_widget(own[None])[0]
            large = HANDLE_PX * (1.5 if joint == self.joint else 1.0)
            painter.setBrush(Qt.BrushStyle.NoBrush)
            if joint in self.anchors:
                pinned = place.to_widget(np.array([self.anchors[joint]]))[0]
                if self._errors.get(joint, 0.0) > _FAR_PX:
                    painter.setPen(QPen(accent, 1.5, Qt.PenStyle.DotLine))
                    painter.drawLine(pinned, at)
                painter.setPen(QPen(_CASING, 2.0))
                painter.setBrush(accent)
                painter.drawRect(QRectF(pinned.x() - large, pinned.y() - large, 2 * large, 2 * large))
                continue
            for pen in (QPen(_CASING, 3.5), QPen(accent if joint == self.joint else QColor("#ffffff"), 1.6)):
                painter.setPen(pen)
                painter.drawEllipse(at, large, large)
