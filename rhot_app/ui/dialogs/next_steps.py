"""The page "What do you have?": three answers, one camera or two, and the steps that follow, with ticks."""

from __future__ import annotations

from collections.abc import Callable, Collection
from pathlib import Path

from PySide6.QtCore import Qt, QTimer, Signal
from PySide6.QtWidgets import (
    QButtonGroup,
    QCheckBox,
    QDialog,
    QFileDialog,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QRadioButton,
    QVBoxLayout,
    QWidget,
)

from rhot_app.errors import RhotError
from rhot_app.project import Rig
from rhot_app.ui.common.job import Job
from rhot_app.ui.common.sentence import Sentence
from rhot_app.ui.common.shapes import ShapeMark
from rhot_app.ui.common.theme import app_font
from rhot_app.ui.models.next_steps import BOARD, Answers, Step, Wear, answers_of, next_steps
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.wizards.framework.plan import Memory
from rhot_node.landmarks.install import installed_folder

LOOK_MS = 700
_WIDTH_PX = 620
_MOST_STEPS = 8
_PRINTED = "board printed"
_WEARS: tuple[tuple[Wear, str], ...] = (
    ("paint", "Paint or tape in six colours"), ("bare", "A bare hand"),
    ("landmarks", "Landmarks or nodes of my own"))


class NextSteps(QDialog):
    """`asked` gives the action of a step whose button was pressed; what it opens is the window's business."""

    asked = Signal(str)

    def __init__(self, scheme: Scheme, rig: Callable[[], Rig | None], reasons: Callable[[], Collection[str]],
                 memory: Memory, parent: QWidget | None = None, *,
                 networks: Callable[[], bool] = lambda: installed_folder() is not None) -> None:
        super().__init__(parent)
        self.setWindowTitle("What do you have?")
        self.setProperty("guide", "start")
        self._scheme, self._rig, self._reasons, self._memory, self._networks = scheme, rig, reasons, memory, networks
        self._shown: list[Step] = []
        self._job: Job | None = None
        now = rig()
        answers = Answers("bare", 2) if now is None else answers_of(now)
        self.wears = {wear: QRadioButton(text) for wear, text in _WEARS}
        self.counts = {1: QRadioButton("one camera"), 2: QRadioButton("two cameras")}
        self._groups = [self._group(list(self.wears.values())), self._group(list(self.counts.values()))]
        self.wears[answers.wear].setChecked(True)
        self.counts[answers.cameras].setChecked(True)
        self.marks = [ShapeMark(16) for _ in range(_MOST_STEPS)]
        self.titles = [QLabel() for _ in range(_MOST_STEPS)]
        self.meanings = [QLabel() for _ in range(_MOST_STEPS)]
        self.buttons = [QPushButton() for _ in range(_MOST_STEPS)]
        self.verdict = Sentence(2)
        self.never = QCheckBox("Do not show this by itself any more")
        self.never.setToolTip("Calibrate, What to do next opens it.")
        self.close_button = QPushButton("Close")
        self.close_button.setAutoDefault(False)
        self.close_button.clicked.connect(self.reject)
        self._lay_out()
        self.setMinimumWidth(_WIDTH_PX)
        self._timer = QTimer(self, interval=LOOK_MS)
        self._timer.timeout.connect(lambda: self.look() if self.isVisible() else None)
        self._timer.start()
        self.look()

    def _group(self, buttons: list[QRadioButton]) -> QButtonGroup:
        group = QButtonGroup(self)
        for button in buttons:
            group.addButton(button)
            button.clicked.connect(self.look)
        return group

    def _lay_out(self) -> None:
        layout, grid, bottom = QVBoxLayout(self), QGridLayout(), QHBoxLayout()
        layout.setContentsMargins(16, 16, 16, 16)
        layout.setSpacing(8)
        for group in self._groups:
            answers = QHBoxLayout()
            for answer in group.buttons():
                answers.addWidget(answer)
            answers.addStretch(1)
            layout.addLayout(answers)
        grid.setHorizontalSpacing(16)
        grid.setVerticalSpacing(8)
        grid.setColumnStretch(1, 1)
        for row, (mark, title, meaning, button) in enumerate(zip(self.marks, self.titles, self.meanings, self.buttons,
                                                                 strict=True)):
            title.setFont(app_font(bold=True))
            meaning.setProperty("muted", True)
            meaning.setWordWrap(True)
            button.setAutoDefault(False)
            button.clicked.connect(lambda checked=False, row=row: self._press(row))
            words = QVBoxLayout()
            words.setSpacing(0)
            words.addWidget(title)
            words.addWidget(meaning)
            grid.addWidget(mark, row, 0, Qt.AlignmentFlag.AlignTop)
            grid.addLayout(words, row, 1)
            grid.addWidget(button, row, 2, Qt.AlignmentFlag.AlignVCenter)
        layout.addSpacing(8)
        layout.addLayout(grid)
        layout.addStretch(1)
        layout.addWidget(self.verdict)
        bottom.addWidget(self.never)
        bottom.addStretch(1)
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
        if rig is None or not any(button.isChecked() for button in self.counts.values()):
            return
        printed = bool(self._memory.remembered(_PRINTED))
        found = next_steps(self.answers, rig, networks=self._networks(), printed=printed, reasons=self._reasons())
        if found != self._shown:
            self._shown = found
            self._show()

    def _show(self) -> None:
        first = next((number for number, step in enumerate(self._shown) if not step.done), None)
        for row in range(_MOST_STEPS):
            step = self._shown[row] if row < len(self._shown) else None
            for widget in (self.marks[row], self.titles[row], self.meanings[row], self.buttons[row]):
                widget.setVisible(step is not None)
            if step is None:
                continue
            self.marks[row].set_shape("tick" if step.done else "ring",
                                      self._scheme.good if step.done else self._scheme.neutral)
            self.marks[row].setAccessibleName("done" if step.done else "not done yet")
            self.titles[row].setText(step.title)
            self.meanings[row].setText(step.meaning)
            self.buttons[row].setText("Again …" if step.done else "Do it …")
            self.buttons[row].setAccessibleName(step.title)
            self.buttons[row].setProperty("primary", row == first)
            style = self.buttons[row].style()
            style.unpolish(self.buttons[row])
            style.polish(self.buttons[row])
        self.verdict.setText("All is done: press Start, and hold the hand before the cameras." if first is None else "")

    def _press(self, row: int) -> None:
        action = self._shown[row].action
        if action == BOARD:
            self._choose_board()
        else:
            self.asked.emit(action)

    def _choose_board(self) -> None:
        name, _ = QFileDialog.getSaveFileName(self, "Write the board", str(Path.home() / "board.pdf"), "PDF (*.pdf)")
        if name and self._job is None:
            self._job = Job(lambda progress: _write_board(Path(name)), self._printed, self._refused, None, self).start()

    def _printed(self, path: Path) -> None:
        self._job = None
        self._memory.remember(_PRINTED, str(path))
        self.look()
        self.verdict.setText(f"Written: {path}. Print it at 100 % and measure the ruler on it.")

    def _refused(self, sentence: str) -> None:
        self._job = None
        self.verdict.setText(sentence)


def _write_board(path: Path) -> Path:
    """The usual chessboard on A4. Raises CalibrationError."""
    from rhot_app.calibration.board.boards import Chessboard, parse_size
    from rhot_app.calibration.board.standard_board import BOARD as SIZE
    from rhot_app.calibration.board.standard_board import SQUARE_MM
    from rhot_app.calibration.board.target import write_target

    try:
        write_target(path, Chessboard(*parse_size(SIZE), 1e-3 * SQUARE_MM), "A4")
    except OSError as exc:
        raise RhotError(f"{path}: cannot be written ({exc.strerror}).") from exc
    return path
