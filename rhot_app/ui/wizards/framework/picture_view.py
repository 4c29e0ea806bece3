"""The live picture of one camera, as large as fits, with what the step draws over it; and several side by side."""

from __future__ import annotations

import time

import numpy as np
from PySide6.QtCore import QPoint, QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QImage, QMouseEvent, QPainter, QPen, QResizeEvent
from PySide6.QtWidgets import QBoxLayout, QSizePolicy, QVBoxLayout, QWidget

from rhot_app.ui.backend.feed import LiveFeed, Picture
from rhot_app.ui.common.shapes import paint_tag
from rhot_app.ui.language import tr
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.wizards.framework.drawing import Callout, Overlay
from rhot_app.ui.wizards.framework.picture_painter import FramePlacement, fit, paint_overlay
from rhot_app.ui.wizards.framework.step import StepView

ANNOTATED_NS = 1_000_000_000
"""A picture that was looked at is shown while it is no more behind the newest one."""

FLASH_S = 0.25
"""How long the frame lights up when a picture was kept: long enough to be seen from two metres."""

_FLASH_PX = 10
_SMALL_PX = (160, 120)
_ANY_PX = 16777215  # Qt's QWIDGETSIZE_MAX


class PictureView(QWidget):
    """`picked` gives the picture shown and a rectangle (x, y, width, height) in its px when a person has clicked or
    dragged over it; a click is a rectangle without size. Only while `pickable`. A click on a `small` one only gives
    `chosen`."""

    picked = Signal(Picture, float, float, float, float)
    chosen = Signal(str)

    def __init__(self, name: str, scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.name = name
        self.pickable = self.small = False
        self._scheme = scheme
        self._picture: Picture | None = None
        self._image = QImage()
        self._overlay: Overlay = ()
        self._problem = ""
        self._flash_until = 0.0
        self._drag: tuple[QPointF, QPointF] | None = None
        self.setMinimumSize(160, 120)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setAccessibleName(tr("Live picture of camera {name}", name=name))

    def sizeHint(self) -> QSize:  # noqa: N802
        """Four by three."""
        return QSize(640, 480)

    @property
    def shown(self) -> Picture | None:
        """The picture shown."""
        return self._picture

    @property
    def overlay(self) -> Overlay:
        """What is drawn over it."""
        return self._overlay

    def show_picture(self, picture: Picture | None, problem: str = "") -> None:
        """Another picture; `problem` is shown instead of one, or over the last one."""
        if picture is self._picture and problem == self._problem:
            return
        self._picture, self._problem = picture, problem
        if picture is None:
            self._image = QImage()
        else:
            height, width = picture.bgr.shape[:2]
            self._image = QImage(picture.bgr.data, width, height, picture.bgr.strides[0], QImage.Format.Format_BGR888)
        self.update()

    def show_overlay(self, overlay: Overlay) -> None:
        """Draw this over the picture from now on."""
        if overlay != self._overlay:
            self._overlay = overlay
            self.update()

    def flash(self) -> None:
        """Light the frame up: a picture was kept."""
        self._flash_until = time.monotonic() + FLASH_S
        self.update()

    def tick(self) -> None:
        """End the flash in time."""
        if self._flash_until and time.monotonic() >= self._flash_until:
            self._flash_until = 0.0
            self.update()

    @property
    def problem(self) -> str:
        """Why there is no new picture; "" while all is well."""
        return self._problem

    def to_widget(self, x: float, y: float) -> QPoint:
        """Where px (x, y) of the frame is drawn."""
        return self._place().to_widget(np.array([[x, y]]))[0].toPoint()

    def _place(self) -> FramePlacement:
        width, height = (self._image.width(), self._image.height()) if not self._image.isNull() else (640, 480)
        return fit(width, height, QRectF(self.rect()))

    def paintEvent(self, event: object) -> None:  # noqa: N802
        """Picture, overlay, name, flash, drag."""
        painter = QPainter(self)
        painter.setRenderHints(QPainter.RenderHint.Antialiasing | QPainter.RenderHint.SmoothPixmapTransform)
        place = self._place()
        painter.fillRect(place.target, QColor(self._scheme.scene))
        if not self._image.isNull():
            painter.drawImage(place.target, self._image)
            paint_overlay(painter, self._without_words() if self.small else self._overlay, place, self._scheme)
        if self.name:
            paint_tag(painter, place.target.topLeft() + QPointF(6, 6), self.name, bold=True)
        if self._image.isNull() or self._problem:
            painter.setPen(QColor(self._scheme.text))
            painter.drawText(place.target.adjusted(24, 24, -24, -24),
                             Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap,
                             self._problem or tr("waiting for the first picture"))
        self._paint_frames(painter, place)
        painter.end()

    def _without_words(self) -> Overlay:
        return tuple(mark for mark in self._overlay if not isinstance(mark, Callout))

    def set_small(self, small: bool) -> None:
        """Small beside a large one, or as large as there is room."""
        self.small = small
        self.setMaximumSize(*(_SMALL_PX if small else (_ANY_PX, _ANY_PX)))
        self.setToolTip(tr("A click shows this picture large.") if small else "")

    def _paint_frames(self, painter: QPainter, place: FramePlacement) -> None:
        painter.setBrush(Qt.BrushStyle.NoBrush)
        if self._flash_until:
            painter.setPen(QPen(QColor(self._scheme.good), _FLASH_PX))
            half = _FLASH_PX / 2
            painter.drawRect(place.target.adjusted(half, half, -half, -half))
        if self._drag is not None:
            painter.setPen(QPen(QColor(self._scheme.accent), 2, Qt.PenStyle.DashLine))
            painter.drawRect(QRectF(*self._drag).normalized())

    def mousePressEvent(self, event: QMouseEvent) -> None:  # noqa: N802
        """The first corner, or the wish to see it large."""
        if self.small:
            self.chosen.emit(self.name)
            return
        if self.pickable and self._picture is not None and event.button() == Qt.MouseButton.LeftButton:
            self._drag = (event.position(), event.position())
            self.update()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:  # noqa: N802
        """The other corner, so far."""
        if self._drag is not None:
            self._drag = (self._drag[0], event.position())
            self.update()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:  # noqa: N802
        """The other corner."""
        if self._drag is None or self._picture is None:
            return
        place = self._place()
        (x0, y0), (x1, y1) = place.to_frame(self._drag[0]), place.to_frame(event.position())
        self._drag = None
        self.update()
        self.picked.emit(self._picture, min(x0, x1), min(y0, y1), abs(x1 - x0), abs(y1 - y0))


class PictureGrid(QWidget):
    """The pictures of some cameras, beside or above each other, whichever makes them larger."""

    picked = Signal(Picture, float, float, float, float)

    def __init__(self, cameras: tuple[str, ...], scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.views = {name: PictureView(name, scheme) for name in cameras}
        self._shown = cameras
        self._view = StepView("")
        self.large = ""  # the camera whose picture is large beside small ones; "" while all are alike
        self._side = QWidget()
        self._column = QVBoxLayout(self._side)
        self._column.setContentsMargins(0, 0, 0, 0)
        self._column.setSpacing(8)
        self._column.addStretch(1)
        self._side.hide()
        self._layout = QBoxLayout(QBoxLayout.Direction.LeftToRight, self)
        self._layout.setContentsMargins(0, 0, 0, 0)
        self._layout.setSpacing(8)
        for view in self.views.values():
            self._layout.addWidget(view, 1)
            view.picked.connect(self.picked)
            view.chosen.connect(self._enlarge)
        self._layout.addWidget(self._side)

    def show_cameras(self, cameras: tuple[str, ...] | None) -> None:
        """Show only these; None shows all."""
        wanted = tuple(self.views) if cameras is None else cameras
        if wanted != self._shown:
            self._shown = wanted
            for name, view in self.views.items():
                view.setVisible(name in wanted)
            self._arrange()

    def show_one_large(self, on: bool) -> None:
        """One picture as large as fits and the others small, or all alike."""
        if on != bool(self.large) and len(self.views) > 1:
            self._enlarge(next(iter(self.views)) if on else "")

    def _enlarge(self, name: str) -> None:
        self.large = name
        for number, (camera, view) in enumerate(self.views.items()):
            view.set_small(bool(name) and camera != name)
            if view.small:
                self._column.insertWidget(self._column.count() - 1, view)
            else:
                self._layout.insertWidget(0 if name else number, view, 1)
        self._side.setVisible(bool(name))
        self._arrange()

    def refresh(self, feed: LiveFeed) -> None:
        """The step's own pictures; else those that were looked at, with what was found in them; else the newest."""
        for name, view in self.views.items():
            if not view.isVisible():
                continue
            newest, annotated, frozen = feed.newest(name), self._view.annotated.get(name), self._view.pictures.get(name)
            picture = frozen or newest
            if frozen is None and annotated is not None and (
                    newest is None or newest.received_ns - annotated.picture.received_ns <= ANNOTATED_NS):
                picture = annotated.picture
            own = annotated.overlay if annotated is not None and annotated.picture is picture else ()
            view.show_picture(picture, "" if frozen is not None else feed.problem(name))
            view.show_overlay((*self._view.overlays.get(name, ()), *own))
            view.tick()

    def show_view(self, view: StepView) -> None:
        """What the step draws from the next `refresh` on."""
        self._view = view

    def flash(self) -> None:
        """A picture was kept."""
        for view in self.views.values():
            view.flash()

    def set_pickable(self, on: bool) -> None:
        """Whether a person may click and drag in the pictures."""
        for view in self.views.values():
            view.pickable = on
            view.setCursor(Qt.CursorShape.CrossCursor if on else Qt.CursorShape.ArrowCursor)

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802
        """Another arrangement may be larger now."""
        super().resizeEvent(event)
        self._arrange()

    def _arrange(self) -> None:
        if self.large:
            self._layout.setDirection(QBoxLayout.Direction.LeftToRight)
            return
        count = max(sum(not view.isHidden() for view in self.views.values()), 1)
        stacked = min(self.width(), 4 / 3 * self.height() / count)
        beside = min(self.width() / count, 4 / 3 * self.height())
        self._layout.setDirection(QBoxLayout.Direction.LeftToRight if beside >= stacked
                                  else QBoxLayout.Direction.TopToBottom)
