"""The panel of the next steps: two questions about what is there, and the steps that follow, with ticks."""

from __future__ import annotations

from collections.abc import Callable, Collection
from pathlib import Path

from PySide6.QtCore import Qt, QTimer, Signal
from PySide6.QtWidgets import (
    QButtonGroup,
    QCheckBox,
    QGridLayout,
    QHBoxLayout,
    QPushButton,
    QRadioButton,
    QVBoxLayout,
    QWidget,
)

from rhot_app.errors import RhotError
from rhot_app.project import Rig
from rhot_app.ui.common.job import Job
from rhot_app.ui.common.parts import ask_where_to_save
from rhot_app.ui.common.sentence import Sentence
from rhot_app.ui.common.settings import Settings
from rhot_app.ui.common.shapes import ShapeMark
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.models.next_steps import BOARD, Answers, Step, Wear, answers_of, next_steps
from rhot_app.ui.models.palette import Scheme
from rhot_node.landmarks.install import installed_folder

LOOK_MS = 700
NEXT_STEPS = "next steps"
"""The setting: whether the steps are shown by themselves."""

_COLUMNS = 3
_MOST_STEPS = 8
_PRINTED = "board printed"
_WEARS: tuple[tuple[Wear, str], ...] = (
    ("paint", tr_noop("Paint or tape in six colours")), ("bare", tr_noop("A bare hand")),
    ("landmarks", tr_noop("Landmarks or nodes of my own")))


class NextSteps(QWidget):
    """A panel below the scene, so that hand and cameras stay in sight. `asked` gives the action of a step whose button
    was pressed; what it opens is the window's business. `closed` when the person has seen enough of it."""

    asked = Signal(str)
    closed = Signal()

    def __init__(self, scheme: Scheme, rig: Callable[[], Rig | None], reasons: Callable[[], Collection[str]],
                 settings: Settings, parent: QWidget | None = None, *,
                 networks: Callable[[], bool] = lambda: installed_folder() is not None) -> None:
        super().__init__(parent)
        self.setObjectName("steps")
        self.setProperty("guide", "start")
        self.setProperty("panel", True)
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self._scheme, self._rig, self._reasons, self._settings, self._networks = (scheme, rig, reasons, settings,
                                                                                  networks)
        self._shown: list[Step] = []
        self._job: Job | None = None
        self.wears = {wear: QRadioButton(tr(text)) for wear, text in _WEARS}
        self.counts = {1: QRadioButton(tr("one camera")), 2: QRadioButton(tr("two cameras"))}
        self._groups = [self._group(list(self.wears.values())), self._group(list(self.counts.values()))]
        self.marks = [ShapeMark(16) for _ in range(_MOST_STEPS)]
        self.buttons = [QPushButton() for _ in range(_MOST_STEPS)]
        self.verdict = Sentence(2)
        self.never = QCheckBox(tr("Do not open by itself"))
        self.never.setToolTip(tr("Do not show these steps by themselves. Calibrate, What to do next shows them."))
        self.never.setChecked(not settings.flag(NEXT_STEPS))
        self.never.toggled.connect(lambda never: settings.set_flag(NEXT_STEPS, not never))
        settings.flag_changed.connect(self._follow_settings)
        self.close_button = QPushButton(tr("Close"))
        self.close_button.clicked.connect(self.closed)
        self._lay_out()
        self._timer = QTimer(self, interval=LOOK_MS)
        self._timer.timeout.connect(lambda: self.look() if self.isVisible() else None)
        self._timer.start()

    def begin(self) -> None:
        """Answer the questions by the rig that is open, and show its steps."""
        rig = self._rig()
        if rig is not None:
            answers = answers_of(rig)
            self.wears[answers.wear].setChecked(True)
            self.counts[answers.cameras].setChecked(True)
            self.look()

    def _follow_settings(self, flag: str) -> None:
        if flag == NEXT_STEPS:
            self.never.setChecked(not self._settings.flag(NEXT_STEPS))

    def set_scheme(self, scheme: Scheme) -> None:
        """Change colours."""
        self._scheme = scheme
        self._show()

    def _group(self, buttons: list[QRadioButton]) -> QButtonGroup:
        group = QButtonGroup(self)
        for button in buttons:
            group.addButton(button)
            button.clicked.connect(self.look)
        return group

    def _lay_out(self) -> None:
        """The steps in columns; below them what stays where it is when their number changes."""
        layout, grid, answers, bottom = QVBoxLayout(self), QGridLayout(), QHBoxLayout(), QHBoxLayout()
        layout.setContentsMargins(16, 4, 16, 4)
        layout.setSpacing(4)
        grid.setSpacing(4)
        for number, (mark, button) in enumerate(zip(self.marks, self.buttons, strict=True)):
            button.clicked.connect(lambda checked=False, number=number: self._press(number))
            row, column = divmod(number, _COLUMNS)
            grid.addWidget(mark, row, 2 * column)
            grid.addWidget(button, row, 2 * column + 1)
            grid.setColumnStretch(2 * column + 1, 1)
        layout.addStretch(1)
        layout.addLayout(grid)
        for group in self._groups:
            for answer in group.buttons():
                answers.addWidget(answer)
            answers.addSpacing(16)
        answers.addStretch(1)
        layout.addLayout(answers)
        bottom.addWidget(self.verdict, 1)
        bottom.addWidget(self.never)
        bottom.addWidget(self.close_button)
        layout.addLayout(bottom)

    @property
    def answers(self) -> Answers:
        """What is chosen."""
        wear = next(wear for wear, button in self.wears.items() if button.isChecked())
        return Answers(wear, 1 if self.counts[1].isChecked() else 2)

    @property
    def steps(self) -> list[Step]:
        """The steps shown."""
        return self._shown

    def look(self) -> None:
        """Look at the rig and show how far it is."""
        rig = self._rig()
        if rig is None:
            return
        printed = bool(self._settings.remembered(_PRINTED))
        found = next_steps(self.answers, rig, networks=self._networks(), printed=printed, reasons=self._reasons())
        if found != self._shown:
            self._shown = found
            self._show()

    def _show(self) -> None:
        first = next((number for number, step in enumerate(self._shown) if not step.done), None)
        for row in range(_MOST_STEPS):
            step = self._shown[row] if row < len(self._shown) else None
            self.marks[row].setVisible(step is not None)
            self.buttons[row].setVisible(step is not None)
            if step is None:
                continue
            self.marks[row].set_shape("tick" if step.done else "ring",
                                      self._scheme.good if step.done else self._scheme.neutral)
            self.marks[row].setAccessibleName(tr("done") if step.done else tr("not done yet"))
            self.buttons[row].setText(f"{step.title} …")
            self.buttons[row].setAccessibleName(step.title)
            self.buttons[row].setToolTip(step.meaning)
            self.buttons[row].setProperty("primary", row == first)
            style = self.buttons[row].style()
            style.unpolish(self.buttons[row])
            style.polish(self.buttons[row])
        if self._shown:
            self.verdict.setText(tr("All is done: hold the hand before the cameras.") if first is None
                                 else f"{self._shown[first].title}: {self._shown[first].meaning}")

    def _press(self, row: int) -> None:
        action = self._shown[row].action
        if action == BOARD:
            self._choose_board()
        else:
            self.asked.emit(action)

    def _choose_board(self) -> None:
        path = ask_where_to_save(self, tr("Write the board"), Path.home() / "board.pdf", tr("PDF (*.pdf)"))
        if path is not None and self._job is None:
            self._job = Job(lambda progress: _write_board(path), self._printed, self._refused, None, self).start()

    def _printed(self, path: Path) -> None:
        self._job = None
        self._settings.remember(_PRINTED, str(path))
        self.look()
        self.verdict.setText(tr("Written: {path}. Print it at 100 % and measure the ruler on it.", path=path))

    def _refused(self, sentence: str) -> None:
        self._job = None
        self.verdict.setText(sentence)


def _write_board(path: Path) -> Path:
    """Write the standard chessboard on A4. Raises RhotError."""
    from rhot_app.calibration.board.boards import STANDARD_BOARD
    from rhot_app.calibration.board.target import write_target

    try:
        write_target(path, STANDARD_BOARD, "A4")
    except OSError as exc:
        raise RhotError(tr("{path}: cannot be written ({strerror}).", path=path, strerror=exc.strerror)) from exc
    return path
