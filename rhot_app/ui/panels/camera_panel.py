"""What the cameras see: the last preview of each with the markers found in it drawn over it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QLineF, QPointF, QRectF, QSize, QSizeF, Qt
from PySide6.QtGui import QColor, QEnterEvent, QFontMetricsF, QImage, QPainter, QPen, QResizeEvent
from PySide6.QtWidgets import QBoxLayout, QSizePolicy, QWidget

from rhot_app.charts import hex_of
from rhot_app.engine.status import Preview
from rhot_app.project import Rig
from rhot_app.state import Knowledge, SeenContour
from rhot_app.ui.backend.live import Live
from rhot_app.ui.common.shapes import paint_tag
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.models.label_layout import place_at_sides
from rhot_app.ui.models.palette import Scheme, visible_on
from rhot_app.ui.models.rows import marker_name
from rhot_app.ui.panels.empty_state import EmptyState
from rhot_app.ui.scene.hand_mesh import BONES
from rhot_node.markers import MarkerSet
from rhot_node.wire.messages import MarkerFlag

Array = NDArray[np.float64]

OUTLINE_COLOUR, INNER_COLOUR, SLICE_COLOUR = "#28e650", "#3c8cff", "#60808080"
HAND_COLOUR, OTHER_COLOUR, SHOWN_COLOUR, BONE_COLOUR = "#ff2828", "#ffdc00", "#ffffff", "#ffffff"
"""As in `export.overlay`: the contour before the background and within the hand, slices; edges, the hand's and
others; and a pose that the hand is to take."""

TAKE_POSE, TAKE_POSE_SHORT = tr_noop("Take this pose with {hands}, and hold it"), tr_noop("Take this pose")

_RING_PX = (4.0, 7.0)  # radius in small and in large pictures
_ROOM_FOR_NAMES_PX = 320.0


@dataclass(frozen=True, slots=True)
class Mark:
    """One marker in the picture: place in px of the full frame, and whether it is seen whole and beyond doubt."""

    place: QPointF
    name: str
    colour: str
    whole: bool


@dataclass(frozen=True, slots=True, eq=False)
class Skeleton:
    """A tracked hand in the picture: `joints` (21, 2) px of the full frame and their `knowledge` (21,)."""

    joints: Array
    knowledge: NDArray[np.uint8]


class CameraView(QWidget):
    """One camera's preview, as large as fits, with name, marks and labels."""

    def __init__(self, name: str, scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.name = name
        self._scheme = scheme
        self._image = QImage()
        self._frame = (4, 3)
        self.marks: list[Mark] = []
        self.contours: list[SeenContour] = []
        self.skeletons: list[Skeleton] = []
        self.hands = tr("the hand", "Take this pose with the hand")
        self._pointed_at = False
        self.setMinimumSize(120, 90)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setAccessibleName(tr("Picture of camera {name}", name=name))
        self.setToolTip(tr("Camera {name}: what it saw a moment ago, and the markers found in that picture.\nA full "
                           "ring is a marker seen whole, a broken ring one that is half hidden or doubtful.\nNames "
                           "stand in large pictures, and in small ones while the mouse is over them.\nOf a bare hand: "
                           "green its outline, blue contours within it, red the edges that are its, yellow others; "
                           "white a pose that the hand is to take before it is followed.", name=name))

    def sizeHint(self) -> QSize:  # noqa: N802
        """Four by three."""
        return QSize(272, 204)

    def show_preview(self, preview: Preview, markers: MarkerSet) -> None:
        """Another picture, with the markers that were found in it."""
        image = QImage.fromData(preview.jpeg)
        if image.isNull():
            return
        self._image, self._frame, self.marks, self.contours = image, (preview.width, preview.height), [], []
        if len(preview.pixels) == len(markers.ids):
            doubtful = int(MarkerFlag.PARTIAL | MarkerFlag.AMBIGUOUS)
            self.marks = [Mark(QPointF(float(x), float(y)), marker_name(marker.id),
                               visible_on(hex_of(marker.display_rgb), "#000000", 3.0), not int(flag) & doubtful)
                          for (x, y), flag, marker in zip(preview.pixels, preview.flags, markers.markers, strict=True)
                          if np.isfinite(x) and np.isfinite(y)]
        self.update()

    def show_picture(self, image: QImage) -> None:
        """Another picture without marks; a null one for none."""
        self._image, self.marks, self.contours, self.skeletons = image, [], [], []
        if not image.isNull():
            self._frame = image.width(), image.height()
        self.update()

    def show_skeletons(self, skeletons: list[Skeleton]) -> None:
        """The hands that were tracked when this picture was taken."""
        self.skeletons = skeletons
        self.update()

    def show_contours(self, seen: list[SeenContour]) -> None:
        """What was seen of bare hands in this picture."""
        if len(seen) != len(self.contours):
            self.contours = seen
            self.update()

    @property
    def marked(self) -> list[str]:
        """Names of the markers drawn."""
        return [mark.name for mark in self.marks]

    @property
    def named(self) -> bool:
        """Whether the markers' names are shown: where there is room for them, or somebody points at the picture."""
        return self._pointed_at or self._target().width() >= _ROOM_FOR_NAMES_PX

    def enterEvent(self, event: QEnterEvent) -> None:  # noqa: N802
        """Somebody wants to know more."""
        self._pointed_at = True
        self.update()

    def leaveEvent(self, event: QEvent) -> None:  # noqa: N802
        """Nobody does any more."""
        self._pointed_at = False
        self.update()

    def _target(self) -> QRectF:
        """Where the picture stands in the widget."""
        width, height = self._frame
        scale = min(self.width() / width, self.height() / height)
        target = QRectF(0, 0, width * scale, height * scale)
        target.moveCenter(QPointF(self.width() / 2, self.height() / 2))
        return target

    def paintEvent(self, event: object) -> None:  # noqa: N802
        """Picture, marks, name."""
        painter = QPainter(self)
        painter.setRenderHints(QPainter.RenderHint.Antialiasing | QPainter.RenderHint.SmoothPixmapTransform)
        target = self._target()
        painter.fillRect(target, QColor(self._scheme.scene))
        if not self._image.isNull():
            painter.drawImage(target, self._image)
        painter.setClipRect(target)
        painter.translate(target.topLeft())
        scale = target.width() / self._frame[0]
        places = [(mark.place + QPointF(0.5, 0.5)) * scale for mark in self.marks]
        for contour in self.contours:
            paint_contour(painter, contour, scale)
        for skeleton in self.skeletons:
            paint_skeleton(painter, skeleton, scale)
        if any(contour.shown for contour in self.contours):
            self._paint_request(painter, target.size())
        self._paint_rings(painter, places, target.width())
        if self.named:
            self._paint_names(painter, places, target.size())
        else:
            paint_tag(painter, QPointF(6, 6), self.name, bold=True)
        painter.translate(-target.topLeft())
        if self._image.isNull():
            painter.setPen(QColor(self._scheme.muted))
            painter.drawText(target, Qt.AlignmentFlag.AlignCenter, tr("no picture yet"))
        painter.end()

    def _paint_request(self, painter: QPainter, picture: QSizeF) -> None:
        """At the lower edge: to take the pose that is shown; in a small picture in fewer words."""
        text = TAKE_POSE.format(hands=self.hands)
        if QFontMetricsF(painter.font()).horizontalAdvance(text) > picture.width() - 20.0:
            text = TAKE_POSE_SHORT
        paint_tag(painter, QPointF(6, picture.height() - 26), text)

    def _paint_rings(self, painter: QPainter, places: list[QPointF], width: float) -> None:
        radius = _RING_PX[0] + (_RING_PX[1] - _RING_PX[0]) * min(1.0, width / _ROOM_FOR_NAMES_PX)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        for at, mark in zip(places, self.marks, strict=True):
            style = Qt.PenStyle.SolidLine if mark.whole else Qt.PenStyle.DotLine
            for colour, line_width in (("#000000", 4.0), (mark.colour, 2.0)):
                painter.setPen(QPen(QColor(colour), line_width, style))
                painter.drawEllipse(at, radius, radius)

    def _paint_names(self, painter: QPainter, places: list[QPointF], picture: QSizeF) -> None:
        """Names at the sides, each with a line to its marker."""
        metrics = QFontMetricsF(painter.font())
        sizes = [(metrics.horizontalAdvance(mark.name) + 8, metrics.height() + 2) for mark in self.marks]
        anchors = [(at.x(), at.y()) for at in places]
        boxes = place_at_sides(anchors, sizes, (picture.width(), picture.height()), 4.0)
        for colour, width in (("#000000", 3.0), ("#ffffff", 1.0)):
            painter.setPen(QPen(QColor(colour), width))
            for anchor, box in zip(anchors, boxes, strict=True):
                painter.drawLine(QPointF(*anchor), QPointF(*box.nearest(anchor)))
        for mark, box in zip(self.marks, boxes, strict=True):
            paint_tag(painter, QPointF(box.x, box.y), mark.name)


def paint_contour(painter: QPainter, seen: SeenContour, scale: float) -> None:
    """A bare hand's contour, the slices across it and the edges on them, `scale` px of the screen for one of the
    frame."""
    def dots(places: Array, colour: str, width: float) -> None:
        painter.setPen(QPen(QColor(colour), width, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap))
        painter.drawPoints([QPointF(float(x), float(y)) for x, y in (places + 0.5) * scale])

    painter.setPen(QPen(QColor(SLICE_COLOUR), 1.0))
    painter.drawLines([QLineF(*(float(value) for value in row)) for row in (seen.slices + 0.5) * scale])
    dots(seen.contour[seen.outline], SHOWN_COLOUR if seen.shown else OUTLINE_COLOUR, 2.5 if seen.shown else 5.0)
    dots(seen.contour[~seen.outline], SHOWN_COLOUR if seen.shown else INNER_COLOUR, 1.5 if seen.shown else 5.0)
    dots(seen.edges[~seen.of_hand], OTHER_COLOUR, 2.0)
    dots(seen.edges[seen.of_hand], HAND_COLOUR, 2.0)


def paint_skeleton(painter: QPainter, skeleton: Skeleton, scale: float) -> None:
    """The bones of a hand, `scale` px of the screen for one of the frame: solid where both ends are known well, dotted
    where one is guessed."""
    places = (skeleton.joints + 0.5) * scale
    for near, far in (*((0, 1 + 4 * finger) for finger in range(5)), *BONES):
        known = int(max(skeleton.knowledge[near], skeleton.knowledge[far]))
        if known >= Knowledge.UNKNOWN or not np.isfinite(places[[near, far]]).all():
            continue
        style = Qt.PenStyle.DotLine if known == Knowledge.GUESSED else Qt.PenStyle.SolidLine
        line = QLineF(*(float(value) for value in places[[near, far]].ravel()))
        for colour, width in (("#000000", 4.0), (BONE_COLOUR, 2.0)):
            painter.setPen(QPen(QColor(colour), width, style, Qt.PenCapStyle.RoundCap))
            painter.drawLine(line)


def hands_to_take(rig: Rig) -> str:
    """The words for the hands of a rig in `TAKE_POSE`."""
    if rig.other_hand is not None:
        return tr("each hand", "Take this pose with each hand")
    return (tr("the left hand", "Take this pose with the left hand") if rig.hand.side == "left" else
            tr("the right hand", "Take this pose with the right hand"))


class CameraPanel(QWidget):
    """The cameras of the rig, one above the other."""

    def __init__(self, scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setProperty("panel", True)
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self.setProperty("guide", "cameras")
        self._scheme = scheme
        self._rig: Rig | None = None
        self._shown: dict[str, Preview] = {}
        self.views: dict[str, CameraView] = {}
        self.empty = EmptyState(tr("Pictures appear here once a rig is open and its nodes answer."))
        self._layout = QBoxLayout(QBoxLayout.Direction.TopToBottom, self)
        self._layout.setContentsMargins(8, 4, 8, 8)
        self._layout.setSpacing(8)
        self._layout.addWidget(self.empty)

    def set_scheme(self, scheme: Scheme) -> None:
        """Change colours."""
        self._scheme = scheme
        self.show_rig(self._rig)

    def show_rig(self, rig: Rig | None) -> None:
        """Views for another rig's cameras."""
        self._rig = rig
        for view in self.views.values():
            self._layout.removeWidget(view)
            view.deleteLater()
        self.views = {node.name: CameraView(node.name, self._scheme) for node in (rig.nodes if rig else ())}
        self._shown = {}
        for view in self.views.values():
            if rig is not None:
                view.hands = hands_to_take(rig)
            self._layout.addWidget(view, 1)
        self.empty.setVisible(rig is None)

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802
        """Side by side where that makes the pictures larger."""
        count = max(len(self.views), 1)
        stacked = min(self.width(), 4 / 3 * self.height() / count)
        beside = min(self.width() / count, 4 / 3 * self.height())
        self._layout.setDirection(QBoxLayout.Direction.LeftToRight if beside > stacked
                                  else QBoxLayout.Direction.TopToBottom)
        super().resizeEvent(event)

    def refresh(self, live: Live) -> None:
        """Show new previews, and what was seen in their images as soon as it has come."""
        if self._rig is None:
            return
        for name, view in self.views.items():
            preview = live.previews.get(name)
            if preview is None:
                continue
            if self._shown.get(name) is not preview:
                self._shown[name] = preview
                view.show_preview(preview, self._rig.markers)
            view.show_contours(live.contours_in(preview))
