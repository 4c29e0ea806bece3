"""The depth wizard: distance from disparity without a board (RHOT 7.2.3)."""

from __future__ import annotations

import time
from collections.abc import Callable

from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QAbstractItemView,
    QComboBox,
    QDoubleSpinBox,
    QFormLayout,
    QHeaderView,
    QLabel,
    QPushButton,
    QTableWidget,
    QTableWidgetItem,
)

from rhot_app.calibration.depth.table import DepthRow
from rhot_app.calibration.registry import DEPTH
from rhot_app.errors import EngineError
from rhot_app.ui.backend.feed import StateFeed
from rhot_app.ui.wizards.framework.definition import Definition, WizardContext
from rhot_app.ui.wizards.framework.page import AcceptPage, ChartPage, Page, shrinkable
from rhot_app.ui.wizards.models.step import AcceptStep, StepView
from rhot_app.ui.wizards.steps.depth_steps import DistanceStep, LawStep, propose


def make_wizard(context: WizardContext, clock: Callable[[], float] = time.monotonic) -> Definition:
    """Measure, look at the law, use it."""
    if context.listen is None:
        raise EngineError("this window cannot hear the markers; open the wizard from the main window.")
    states = StateFeed(context.listen, clock)
    distances = DistanceStep(context.rig, states.recent)
    law = LawStep(distances)
    accept = AcceptStep(lambda: propose(distances.report, context.rig, context.rig_path),
                        "Measure some distances first.")
    pages = (DistancePage(distances, states), ChartPage(law, context.scheme), AcceptPage(accept, context.scheme))
    return Definition(DEPTH.title, pages, put_back=states.stop)


# -- the page of the distances -----------------------------------------------------------------------------------------

_HEADS = ("cm", "px", "± px")


class DistancePage(Page):
    """Space or the button takes a row; Delete takes the chosen one out, Ctrl+Z the last one."""

    def __init__(self, step: DistanceStep, states: StateFeed) -> None:
        super().__init__(step)
        self.distances = step
        self._states = states
        self._shown: list[DepthRow] = []
        self.marker = QComboBox()
        self.marker.addItems(list(step.rig.markers.ids))
        self.marker.setToolTip("The marker that is held at the distance.")
        self.marker.currentIndexChanged.connect(self._choose)
        self.distance = QDoubleSpinBox()
        self.distance.setRange(5.0, 500.0)
        self.distance.setDecimals(1)
        self.distance.setSuffix(" cm")
        self.distance.setValue(100 * step.distance_m)
        self.distance.setToolTip("From the middle between both lenses straight to the marker, by a tape measure.")
        self.distance.valueChanged.connect(self._enter)
        self.seen = QLabel()
        self.take_button = QPushButton("Take this distance")
        self.take_button.setAutoDefault(False)
        self.take_button.setToolTip("Space. Takes the disparity that both cameras have seen in the last second.")
        self.take_button.clicked.connect(self._take)
        form = QFormLayout()
        form.addRow("Marker", self.marker)
        form.addRow("Distance", self.distance)
        form.addRow("Disparity", self.seen)
        self.table = QTableWidget(0, len(_HEADS))
        self.table.setHorizontalHeaderLabels(list(_HEADS))
        self.table.setToolTip("Distance, mean disparity and its spread within the second.")
        self.table.horizontalHeader().setSectionResizeMode(QHeaderView.ResizeMode.Stretch)
        self.table.verticalHeader().setVisible(False)
        self.table.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.table.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.remove_button = QPushButton("Remove the chosen row")
        self.remove_button.setAutoDefault(False)
        self.remove_button.clicked.connect(self._remove)
        self.table.itemSelectionChanged.connect(self._show_removable)
        self.column.addLayout(form)
        self.column.addWidget(self.take_button)
        self.column.addWidget(self.table, 1)
        shrinkable(self.table)
        self.column.addWidget(self.remove_button)
        self.first_field = self.distance
        self.twin_facts = "Shows one marker at: choose the distance that you enter here."
        self._show_removable()

    def entered(self) -> None:
        """Hear the markers from now on."""
        self._states.start()

    def show_view(self, view: StepView) -> None:
        """The disparity seen now, and the rows."""
        seen = self.distances.disparities()
        self.seen.setText(f"{seen.mean():.2f} ± {seen.std():.2f} px" if len(seen) else "not seen by both cameras")
        if self.distances.rows != self._shown:
            self._shown = list(self.distances.rows)
            self._fill()

    def _fill(self) -> None:
        self.table.setRowCount(len(self._shown))
        for r, row in enumerate(self._shown):
            for c, text in enumerate((f"{100 * row.distance_m:.1f}", f"{row.disparity_px:.2f}", f"{row.sd_px:.2f}")):
                item = QTableWidgetItem(text)
                item.setTextAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
                self.table.setItem(r, c, item)
        self.table.clearSelection()
        self._show_removable()

    def _choose(self, index: int) -> None:
        self.distances.marker = index
        self.changed.emit()

    def _enter(self, value: float) -> None:
        self.distances.distance_m = 0.01 * value

    def _take(self) -> None:
        self.distances.capture()
        self.changed.emit()

    def _remove(self) -> None:
        self.distances.remove(self.table.currentRow())
        self.changed.emit()

    def _show_removable(self) -> None:
        self.remove_button.setEnabled(bool(self.table.selectedItems()))
