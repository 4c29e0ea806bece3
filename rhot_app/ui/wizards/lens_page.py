"""The pages of the lens wizard: which camera beside the board's form, and the views' errors beside the result."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QAbstractItemView, QCheckBox, QComboBox, QHeaderView, QTableWidget, QTableWidgetItem

from rhot_app.ui.wizards.board_page import BoardPage
from rhot_app.ui.wizards.memory import Memory
from rhot_app.ui.wizards.models.lens_result import LensSolveStep
from rhot_app.ui.wizards.models.lens_steps import LensBoardStep
from rhot_app.ui.wizards.models.step import StepView
from rhot_app.ui.wizards.page import Page


class LensBoardPage(BoardPage):
    """The camera is chosen above the board's fields."""

    def __init__(self, step: LensBoardStep, memory: Memory) -> None:
        super().__init__(step, memory)
        self.which = QComboBox()
        self.which.addItems(step.choices)
        self.which.setCurrentText(step.camera)
        self.which.setToolTip("Whose lens is to be found. One camera at a time.")
        self.add_field("Camera", self.which)
        self.which.currentTextChanged.connect(self._choose)
        self.first_field = self.which
        self._lens_step = step

    def _choose(self, camera: str) -> None:
        self._lens_step.choose(camera)
        self.changed.emit()


class LensResultPage(Page):
    """Errors by view; the picture with residuals or straightened; pixels forced to be square."""

    def __init__(self, step: LensSolveStep) -> None:
        super().__init__(step)
        self._lens = step
        self.straighten = QCheckBox("Straighten the picture")
        self.straighten.setToolTip("Shows the live picture without the lens's distortion: hold a ruler before the "
                                   "camera, it must be straight everywhere.")
        self.straighten.toggled.connect(self._straighten)
        self.square = QCheckBox("Pixels are square")
        self.square.setToolTip("Forces one focal length for both directions, as nearly every sensor has it. Fewer "
                               "numbers to find need fewer views.")
        self.square.toggled.connect(self._square)
        self.table = QTableWidget(0, 3)
        self.table.setHorizontalHeaderLabels(["view", "rms [px]", "corners"])
        self.table.verticalHeader().setVisible(False)
        self.table.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.table.setSelectionMode(QAbstractItemView.SelectionMode.NoSelection)
        self.table.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.table.horizontalHeader().setSectionResizeMode(QHeaderView.ResizeMode.Stretch)
        self.table.setToolTip("How well each view fits. Arrows in the picture are the mean residual of each part: "
                              "a pattern in them is something that the lens model does not explain.")
        self.column.addWidget(self.straighten)
        self.column.addWidget(self.square)
        self.column.addWidget(self.table, 1)
        self._shown: object = None

    def _straighten(self, on: bool) -> None:
        self._lens.straighten = on
        self.changed.emit()

    def _square(self, on: bool) -> None:
        self._lens.set_square_pixels(on)
        self.changed.emit()

    def show_view(self, view: StepView) -> None:
        """The errors of the newest solve."""
        report = self._lens.report
        if report is self._shown:
            return
        self._shown = report
        views = report.views if report is not None else ()
        self.table.setRowCount(len(views))
        for row, one in enumerate(views):
            for column, text in enumerate((one.source.removeprefix("view "), f"{one.rms_px:.2f}", str(one.corners))):
                item = QTableWidgetItem(text)
                item.setTextAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
                self.table.setItem(row, column, item)
