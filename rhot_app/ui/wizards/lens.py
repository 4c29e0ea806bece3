"""The wizard of a camera's intrinsics: camera and board, views, solve, before and after."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QAbstractItemView, QCheckBox, QComboBox, QHeaderView, QTableWidget, QTableWidgetItem

from rhot_app.calibration.registry import LENS
from rhot_app.ui.models.proposal import Proposal
from rhot_app.ui.wizards.framework.board_page import MEMORY, BoardPage
from rhot_app.ui.wizards.framework.definition import Definition, SettingsStore, WizardContext
from rhot_app.ui.wizards.framework.films_page import FilmsPage
from rhot_app.ui.wizards.framework.page import AcceptPage, Page, shrinkable
from rhot_app.ui.wizards.models.board_form import fields_from
from rhot_app.ui.wizards.models.step import AcceptStep, StepView
from rhot_app.ui.wizards.steps.lens_steps import LensBoardStep, LensShowStep, LensSolveStep, lens_proposal
from rhot_app.ui.wizards.steps.stereo_steps import chosen_nodes

LAST = "lens camera"


def make_wizard(context: WizardContext) -> Definition:
    """The wizard's pages for the rig at hand; it begins with the camera after the one that was done last."""
    cameras = tuple(node.name for node in chosen_nodes(context.rig))
    board = LensBoardStep(fields_from(context.memory.remembered(MEMORY)), cameras,
                          _next(cameras, context.memory.remembered(LAST)))
    show = LensShowStep(board)
    solve = LensSolveStep(show)

    def propose() -> Proposal | None:
        if solve.report is None:
            return None
        context.memory.remember(LAST, board.camera)
        return lens_proposal(context.rig, context.rig_path, board.camera, solve.report)

    pages = (LensBoardPage(board, context.memory), FilmsPage(show), LensResultPage(solve),
             AcceptPage(AcceptStep(propose), context.scheme))
    return Definition(LENS.title, pages, solver="rhot_app.calibration.lens.intrinsics")


def _next(cameras: tuple[str, ...], done: str) -> str:
    return cameras[(cameras.index(done) + 1) % len(cameras)] if done in cameras else cameras[0]


# -- the pages of the lens wizard --------------------------------------------------------------------------------------

class LensBoardPage(BoardPage):
    """The camera is chosen above the board's fields."""

    def __init__(self, step: LensBoardStep, memory: SettingsStore) -> None:
        super().__init__(step, memory)
        self.which = QComboBox()
        self.which.addItems(step.choices)
        self.which.setCurrentText(step.camera)
        self.which.setToolTip("Whose intrinsics are calibrated. One camera at a time.")
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
        shrinkable(self.table)
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
