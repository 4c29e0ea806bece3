"""One setting on the screen: told or left to the camera, a number to type and a slider to move."""

from __future__ import annotations

import math
from dataclasses import dataclass

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QPalette
from PySide6.QtWidgets import QCheckBox, QDoubleSpinBox, QGridLayout, QSlider, QWidget

from rhot_app.ui.language import tr

Value = float | None


@dataclass(frozen=True, slots=True)
class Control:
    """One setting: its field in `CameraSettings`, its name, what it does. `low`..`high` is what the slider covers, in
    units of the field divided by `scale`; typed numbers may go to `most`. `optional`: it may be left to the camera."""

    field: str
    name: str
    meaning: str
    low: float
    high: float
    most: float
    neutral: float
    unit: str = ""
    scale: float = 1.0
    decimals: int = 2
    optional: bool = True
    logarithmic: bool = False
    least: float = 0.0


_STEPS = 400


class ControlRow(QWidget):
    """`changed` with the value (None: left to the camera) and whether a slider is still under way."""

    changed = Signal(object, bool)

    def __init__(self, control: Control, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.control = control
        self._filling = False
        self._moving = False
        self.check_box = QCheckBox(tr(control.name))
        self.check_box.setToolTip(tr("{meaning}\nUntick it to leave it to the camera.", meaning=tr(control.meaning))
                                  if control.optional else tr(control.meaning))
        if not control.optional:  # a name, not a choice
            self.check_box.setStyleSheet("QCheckBox { spacing: 0 } QCheckBox::indicator { width: 0; height: 0 }")
            palette = self.check_box.palette()
            palette.setColor(QPalette.ColorGroup.Disabled, QPalette.ColorRole.WindowText, palette.windowText().color())
            self.check_box.setPalette(palette)
        self.box = QDoubleSpinBox()
        self.box.setRange(control.least, control.most)
        self.box.setDecimals(control.decimals)
        self.box.setSingleStep(0.1)
        self.box.setSuffix(control.unit)
        self.box.setKeyboardTracking(False)
        self.box.setToolTip(tr(control.meaning))
        self.box.setAccessibleName(tr(control.name))
        self.slider = QSlider(Qt.Orientation.Horizontal)
        self.slider.setRange(0, _STEPS)
        self.slider.setAccessibleName(tr("{name}, slider", name=tr(control.name)))
        grid = QGridLayout(self)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setVerticalSpacing(0)
        grid.addWidget(self.check_box, 0, 0)
        grid.addWidget(self.box, 0, 1, alignment=Qt.AlignmentFlag.AlignRight)
        grid.addWidget(self.slider, 1, 0, 1, 2)
        self.check_box.toggled.connect(self._toggle)
        self.box.valueChanged.connect(self._type)
        self.slider.valueChanged.connect(self._slide)
        self.slider.sliderReleased.connect(self._release)

    def fill(self, value: Value) -> None:
        """Show a value without telling anybody."""
        self._filling = True
        shown = self.control.neutral if value is None else value
        self.check_box.setChecked(value is not None)
        self.check_box.setEnabled(self.control.optional)
        self.box.setValue(shown)
        if not self.slider.isSliderDown():
            self.slider.setValue(self._to_step(shown))
        self.box.setEnabled(value is not None)
        self.slider.setEnabled(value is not None)
        self._filling = False

    def _toggle(self, on: bool) -> None:
        if not self._filling:
            self.changed.emit(self.box.value() if on else None, False)

    def _type(self, value: float) -> None:
        if not self._filling:
            self.changed.emit(value, False)

    def _slide(self, step: int) -> None:
        if not self._filling:
            goes_on, self._moving = self._moving, self.slider.isSliderDown()
            self.changed.emit(round(self._from_step(step), self.control.decimals), goes_on)

    def _release(self) -> None:
        self._moving = False

    def _to_step(self, value: float) -> int:
        low, high = self.control.low, self.control.high
        inside = min(max(value, low), high)
        share = (math.log(inside / low) / math.log(high / low) if self.control.logarithmic
                 else (inside - low) / (high - low))
        return round(_STEPS * share)

    def _from_step(self, step: int) -> float:
        low, high = self.control.low, self.control.high
        share = step / _STEPS
        return low * (high / low) ** share if self.control.logarithmic else low + share * (high - low)
