"""The numbers of a fit as rows of a slider, a box to type into, and a standard deviation; one page for each group."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QWheelEvent
from PySide6.QtWidgets import (
    QComboBox,
    QDoubleSpinBox,
    QGridLayout,
    QLabel,
    QScrollArea,
    QSlider,
    QStackedWidget,
    QVBoxLayout,
    QWidget,
)

from rhot_app.handfit.quantities import GROUPS, Number
from rhot_app.ui.language import tr

STEPS: Final = 2000
"""Of a slider: finer than a pixel of the screen."""

_UNKNOWN = 999.0  # mm, degrees or per cent: as good as nothing is known
_DECIMALS = {"mm": 1, "°": 1, "%": 1}
_MOST_MM = {"place": 9999.0, "length": 400.0, "radius": 400.0, "root": 400.0}  # what may be typed; 400 is a hand file's


class NumberRow(QWidget):
    """`changed` with the value and whether a slider goes on with the same movement."""

    changed = Signal(float, bool)

    def __init__(self, number: Number, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.number = number
        self._filling = self._moving = False
        group, title = tr(number.group), tr(number.name)
        name = QLabel(title)
        self.box = _Box()
        most = _MOST_MM.get(number.kind)
        self.box.setRange(*((number.low, number.high) if most is None else (-most, most)))
        self.box.setDecimals(_DECIMALS[number.unit])
        self.box.setSingleStep(0.5)
        self.box.setSuffix(f" {number.unit}" if number.unit != "°" else number.unit)
        self.box.setKeyboardTracking(False)
        self.slider = _Slider(Qt.Orientation.Horizontal)
        self.slider.setRange(0, STEPS)
        self.spread = QLabel()
        self.spread.setProperty("muted", True)
        self.spread.setToolTip(tr("Standard deviation in the unit beside, by the anchors and what is known of people's "
                                  "hands; after Fit to contours by the contours, too."))
        for part in (name, self.box, self.slider):
            part.setToolTip(tr(number.meaning))
        self.box.setAccessibleName(f"{group}, {title}")
        self.slider.setAccessibleName(tr("{group}, {name}, slider", group=group, name=title))
        grid = QGridLayout(self)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setVerticalSpacing(0)
        grid.setColumnStretch(0, 1)
        self.spread.setFixedWidth(self.fontMetrics().horizontalAdvance("± 888.8 "))
        grid.addWidget(name, 0, 0)
        grid.addWidget(self.box, 0, 1)
        grid.addWidget(self.spread, 0, 2)
        grid.addWidget(self.slider, 1, 0, 1, 3)
        self.box.valueChanged.connect(self._type)
        self.slider.valueChanged.connect(self._slide)
        self.slider.sliderReleased.connect(self._release)

    def fill(self, value: float, sd: float) -> None:
        """Show a value and its standard deviation without telling anybody."""
        self._filling = True
        if not self.box.hasFocus() or abs(self.box.value() - value) > 0.05:
            self.box.setValue(value)
        if not self.slider.isSliderDown():
            low, high = self.number.low, self.number.high
            self.slider.setValue(round(STEPS * (min(max(value, low), high) - low) / (high - low)))
        self.spread.setText(f"± {sd:.1f}" if sd < _UNKNOWN else "± ?")
        self._filling = False

    def _type(self, value: float) -> None:
        if not self._filling:
            self.changed.emit(value, False)

    def _slide(self, step: int) -> None:
        if not self._filling:
            goes_on, self._moving = self._moving, self.slider.isSliderDown()
            low, high = self.number.low, self.number.high
            self.changed.emit(low + step / STEPS * (high - low), goes_on)

    def _release(self) -> None:
        self._moving = False


class NumberForm(QWidget):
    """All groups; `changed` with the number, its value, and whether a slider goes on."""

    changed = Signal(object, float, bool)

    def __init__(self, numbers: Sequence[Number], parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.rows: dict[tuple[str, int], NumberRow] = {}
        self.group_box = QComboBox()
        self.group_box.setToolTip(tr("Which numbers the sliders below move."))
        self.group_box.setAccessibleName(tr("Numbers"))
        for group in GROUPS:
            self.group_box.addItem(tr(group), group)
        self.pages = QStackedWidget()
        for group in GROUPS:
            self.pages.addWidget(self._page([number for number in numbers if number.group == group]))
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(8)
        layout.addWidget(self.group_box)
        layout.addWidget(self.pages, 1)
        self.group_box.currentIndexChanged.connect(self.pages.setCurrentIndex)

    @property
    def group(self) -> str:
        """The group shown."""
        return str(self.group_box.currentData())

    def show_group(self, group: str) -> None:
        """Show another group."""
        self.group_box.setCurrentIndex(self.group_box.findData(group))

    def fill(self, value: Callable[[Number], float], sd: Callable[[Number], float]) -> None:
        """Show the newest values of the group that is shown."""
        for row in self.rows.values():
            if row.number.group == self.group:
                row.fill(value(row.number), sd(row.number))

    def _page(self, numbers: Sequence[Number]) -> QScrollArea:
        inside = QWidget()
        inside.setProperty("panel", True)
        column = QVBoxLayout(inside)
        column.setContentsMargins(8, 8, 8, 8)
        column.setSpacing(4)
        for number in numbers:
            row = NumberRow(number)
            row.changed.connect(lambda value, goes_on, number=number: self.changed.emit(number, value, goes_on))
            self.rows[number.key] = row
            column.addWidget(row)
        wide = max(self.rows[number.key].box.sizeHint().width() for number in numbers)
        for number in numbers:
            self.rows[number.key].box.setFixedWidth(wide)
        column.addStretch(1)
        scroll = QScrollArea()
        scroll.setWidgetResizable(True)
        scroll.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        scroll.setWidget(inside)
        return scroll


class _Box(QDoubleSpinBox):
    """The wheel scrolls the page that it stands on, and moves no number by accident."""

    def wheelEvent(self, event: QWheelEvent) -> None:  # noqa: N802
        event.ignore()


class _Slider(QSlider):
    """As `_Box`."""

    def wheelEvent(self, event: QWheelEvent) -> None:  # noqa: N802
        event.ignore()
