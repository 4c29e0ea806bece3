"""The layers of the tracked hand, live: masks over a camera's picture, and the visibility order beside it."""

from __future__ import annotations

from typing import Final

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QColor, QIcon, QImage, QPainter, QPixmap
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QHBoxLayout,
    QListWidget,
    QListWidgetItem,
    QPushButton,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from rhot_app.engine.status import Preview
from rhot_app.project import Rig
from rhot_app.state import HandState
from rhot_app.ui.common.controller import Controller
from rhot_app.ui.common.job import Job
from rhot_app.ui.common.sentence import Sentence
from rhot_app.ui.common.tool_window import ToolWindow
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.models.layers import LayerPicture, LayerPictures
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.wizards.framework.picture_painter import fit

TICK_MS: Final = 60
NEAR_NS: Final = 50_000_000
"""No state is nearer to a picture's time: the hand was not tracked in it."""

_SIZE, _LIST_PX, _SWATCH_PX = QSize(1000, 640), 220, 14
NO_HAND = tr_noop("No hand is tracked, so there are no layers. Press Start, and show the hand to the cameras.")
FIRST = tr_noop("The first picture takes a moment, the very first one of all half a minute.")
_LEGEND = tr_noop("1 is the link that nothing hides. A line is white beside the background, and black before another "
                  "link. A number in brackets: the links hide each other in a circle, which is cut there.")


class LayersDialog(ToolWindow):
    """`shown` is the drawing, `shown_of` its camera and state; None for none."""

    def __init__(self, controller: Controller, scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(tr("Layers of the hand"), "scene", parent, _SIZE)
        self._controller = controller
        self._drawer: LayerPictures | None = None
        self._job: Job | None = None
        self._drawn: tuple[object, ...] = ()
        self.shown: LayerPicture | None = None
        self.shown_of: tuple[str, HandState] | None = None
        self.camera_box = QComboBox()
        self.camera_box.setToolTip(tr("Whose picture is shown. Each camera has an order of its own."))
        self.camera_box.setAccessibleName(tr("Camera"))
        self.over_check = QCheckBox(tr("Over the picture"))
        self.over_check.setChecked(True)
        self.over_check.setToolTip(tr("Off: the layers on plain grey, as fast as states come."))
        self.pause_button = QPushButton(tr("Pause"))
        self.pause_button.setCheckable(True)
        self.pause_button.setAutoDefault(False)
        self.pause_button.setToolTip(tr("Hold what is shown (Space)."))
        self.picture = _Picture(scheme)
        self.list = QListWidget()
        self.list.setFixedWidth(_LIST_PX)
        self.list.setIconSize(QSize(_SWATCH_PX, _SWATCH_PX))
        self.list.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.list.setSelectionMode(QListWidget.SelectionMode.NoSelection)
        self.list.setAccessibleName(tr("Visibility order"))
        self.sentence = Sentence(2)
        self._lay_out()
        self.start(TICK_MS, {}, self.pause_button.toggle)
        self.tick()

    def _lay_out(self) -> None:
        top, middle = QHBoxLayout(), QHBoxLayout()
        for part in (self.camera_box, self.over_check, self.pause_button):
            top.addWidget(part)
        top.addStretch(1)
        middle.setSpacing(16)
        middle.addWidget(self.picture, 1)
        middle.addWidget(self.list)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(16, 16, 16, 16)
        layout.setSpacing(8)
        layout.addLayout(top)
        layout.addLayout(middle, 1)
        layout.addWidget(self.sentence)

    def set_scheme(self, scheme: Scheme) -> None:
        """Other colours."""
        self.picture.set_scheme(scheme)

    def tick(self) -> None:
        """Take in the newest state and picture, and have them drawn, one at a time."""
        self._follow(self._controller.rig)
        live = self._controller.live
        if self._job is not None or self._drawer is None or self.pause_button.isChecked():
            return
        camera, wanted = self.camera_box.currentText(), self._wanted(live.previews.get(self.camera_box.currentText()))
        if wanted is None:
            self._show(None)
        elif (camera, *wanted) != self._drawn:
            self._drawn = (camera, *wanted)
            drawer, (state, preview) = self._drawer, wanted
            if self.shown is None:
                self.sentence.setText(tr(FIRST))
            self._job = Job(lambda progress: drawer.draw(camera, state, preview),
                            lambda drawn: self._show(drawn, (camera, state)), self._failed, None, self).start()

    @property
    def drawing(self) -> bool:
        """Whether a drawing is under way."""
        return self._job is not None

    def _wanted(self, preview: Preview | None) -> tuple[HandState, Preview | None] | None:
        """The newest picture with the state of its time; None without a hand."""
        states = self._controller.live.states
        if not states or not self._controller.running or not states[-1].tracked:
            return None
        if preview is None or not self.over_check.isChecked():
            return states[-1], None
        nearest = min(states, key=lambda state: abs(state.t_master_ns - preview.t_master_ns))
        if abs(nearest.t_master_ns - preview.t_master_ns) > NEAR_NS:
            return states[-1], None
        return nearest, preview

    def _follow(self, rig: Rig | None) -> None:
        if rig is (self._drawer.rig if self._drawer is not None else None):
            return
        self._drawn = ()
        self._drawer = None if rig is None else LayerPictures(rig)
        before = self.camera_box.currentText()
        self.camera_box.clear()
        if rig is not None:
            self.camera_box.addItems([node.name for node in rig.nodes])
            self.camera_box.setCurrentIndex(max(self.camera_box.findText(before), 0))

    def _show(self, drawn: LayerPicture | None, of: tuple[str, HandState] | None = None) -> None:
        self._job = None
        self.shown, self.shown_of = drawn, of
        self.picture.show_image(drawn)
        self.sentence.setText(tr(NO_HAND if drawn is None else _LEGEND))
        lines = () if drawn is None else drawn.lines
        while self.list.count() > len(lines):
            self.list.takeItem(self.list.count() - 1)
        for row, line in enumerate(lines):
            if row == self.list.count():
                self.list.addItem(QListWidgetItem())
            item = self.list.item(row)
            if item.text() != line.text:
                swatch = QPixmap(_SWATCH_PX, _SWATCH_PX)
                swatch.fill(QColor(*line.rgb))
                item.setText(line.text)
                item.setIcon(QIcon(swatch))

    def _failed(self, sentence: str) -> None:
        self._job = None
        self.sentence.setText(sentence)


class _Picture(QWidget):
    """The picture, as large as fits."""

    def __init__(self, scheme: Scheme) -> None:
        super().__init__()
        self._scheme, self._image = scheme, QImage()
        self._drawn: LayerPicture | None = None  # keeps the image's memory
        self.setMinimumSize(320, 240)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setAccessibleName(tr("Layers over the camera's picture"))

    def set_scheme(self, scheme: Scheme) -> None:
        self._scheme = scheme
        self.update()

    def show_image(self, drawn: LayerPicture | None) -> None:
        """Another picture; None for none."""
        self._drawn = drawn
        if drawn is None:
            self._image = QImage()
        else:
            height, width = drawn.image.shape[:2]
            self._image = QImage(drawn.image.data, width, height, drawn.image.strides[0], QImage.Format.Format_RGB888)
        self.update()

    def paintEvent(self, event: object) -> None:  # noqa: N802
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        if self._image.isNull():
            painter.fillRect(QRectF(self.rect()), QColor(self._scheme.scene))
        else:
            painter.drawImage(fit(self._image.width(), self._image.height(), QRectF(self.rect())).target, self._image)
        painter.end()
