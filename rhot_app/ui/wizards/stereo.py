"""The wizard that puts two or more cameras together: board, shared captures, a known length, solve, table."""

from __future__ import annotations

from PySide6.QtWidgets import QDoubleSpinBox, QFormLayout, QPushButton

from rhot_app.calibration.registry import STEREO
from rhot_app.simulator.scene.scene_description import RulerShow
from rhot_app.ui.backend.feed import Picture
from rhot_app.ui.models.proposal import Proposal
from rhot_app.ui.wizards.framework.board_page import MEMORY, BoardPage
from rhot_app.ui.wizards.framework.definition import Definition, WizardContext
from rhot_app.ui.wizards.framework.films_page import FilmsPage
from rhot_app.ui.wizards.framework.page import AcceptPage, Page
from rhot_app.ui.wizards.models.board_form import BoardStep, fields_from
from rhot_app.ui.wizards.models.step import AcceptStep, StepView
from rhot_app.ui.wizards.steps.lengths_step import LengthsStep
from rhot_app.ui.wizards.steps.stereo_steps import (
    ShowStep,
    StereoSolveStep,
    TableStep,
    chosen_nodes,
    known_lenses,
    stereo_proposal,
)


def make_wizard(context: WizardContext) -> Definition:
    """The wizard's pages for the rig at hand."""
    nodes = chosen_nodes(context.rig)
    cameras = tuple(node.name for node in nodes)
    board = BoardStep(fields_from(context.memory.remembered(MEMORY)), cameras)
    show = ShowStep(board, cameras)
    known = LengthsStep(cameras)
    solve = StereoSolveStep(show, known_lenses(nodes), lambda: known.known)
    table = TableStep(board, solve, cameras)

    def propose() -> Proposal | None:
        report = solve.report
        return None if report is None else stereo_proposal(context.rig, context.rig_path, report, table.world)

    accept = AcceptPage(AcceptStep(propose), context.scheme)
    pages = (BoardPage(board, context.memory), FilmsPage(show), LengthsPage(known), Page(solve), Page(table), accept)
    return Definition(STEREO.title, pages, solver="rhot_app.ui.wizards.steps.stereo_steps")


# -- the fields of the second known length, and clicks on the ruler's ends ---------------------------------------------

SKIP = "Skip: lengths stay unproven"


class LengthsPage(Page):
    """Two lengths in mm; 0 says that it was not measured. With neither, a person must say so."""

    def __init__(self, step: LengthsStep) -> None:
        super().__init__(step)
        self._known = step
        self.pickable = True
        self.twin_facts = f"Shows a ruler: its crosses are {RulerShow().length_mm:g} mm apart."
        self.baseline = _length("The distance between the middles of the two lenses, measured by hand. 75 mm on the "
                                "frame that the thesis describes.")
        self.ruler = _length("The distance between two marks on a ruler, 200 mm for instance, that both cameras see.")
        form = QFormLayout()
        form.setSpacing(8)
        form.addRow("Lens to lens", self.baseline)
        form.addRow("Ruler", self.ruler)
        self.hold = QPushButton("Hold the pictures")
        self.hold.setToolTip("Space. Then click both ends of the ruler in each picture.")
        self.hold.setAutoDefault(False)
        self.hold.clicked.connect(self._hold)
        self.column.addLayout(form)
        self.skip = QPushButton(SKIP)
        self.skip.setToolTip("If the size of the squares was typed wrong, every length is wrong by the same factor "
                             "and nothing will tell.")
        self.skip.setAutoDefault(False)
        self.skip.clicked.connect(self._skip)
        self.column.addWidget(self.hold)
        self.column.addWidget(self.skip)
        self.column.addStretch(1)
        for box in (self.baseline, self.ruler):
            box.valueChanged.connect(self._take)

    def _take(self) -> None:
        self._known.set_lengths(self.baseline.value(), self.ruler.value())
        self.changed.emit()

    def _skip(self) -> None:
        self._known.skip(not self._known.skipped)
        self.changed.emit()

    def _hold(self) -> None:
        self._known.capture()
        self.changed.emit()

    def pick(self, picture: Picture, x: float, y: float, width: float, height: float) -> None:
        """An end of the ruler; a drag is a click that slipped."""
        self._known.pick(picture.camera, x, y)

    def show_view(self, view: StepView) -> None:
        """The button says what it would do; there is nothing to skip once a length is known."""
        self.skip.setEnabled(not view.done)
        self.skip.setText("Do not skip" if self._known.skipped and not view.done else SKIP)
        self.hold.setEnabled(self.ruler.value() > 0.0)
        self.hold.setText("Let the pictures go on" if view.pictures else "Hold the pictures")


def _length(meaning: str) -> QDoubleSpinBox:
    box = QDoubleSpinBox()
    box.setRange(0.0, 5000.0)
    box.setDecimals(1)
    box.setSuffix(" mm")
    box.setSpecialValueText("not measured")
    box.setToolTip(meaning)
    return box
