"""A calibration's verdict: the grade as shape, colour and word, the sentence, each finding with cause and remedy."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QGridLayout, QLabel, QScrollArea, QVBoxLayout, QWidget

from rhot_app.calibration.verdict import Finding, Verdict
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.shapes import ShapeMark
from rhot_app.ui.theme import app_font
from rhot_app.ui.wizards.models.grades import GRADES

_SENTENCE_PT = 14.0


class VerdictView(QScrollArea):
    """Empty until a verdict is there."""

    def __init__(self, scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._scheme = scheme
        self.verdict: Verdict | None = None
        self.setWidgetResizable(True)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)

    def show_verdict(self, verdict: Verdict | None) -> None:
        """Another verdict, or none."""
        if verdict == self.verdict:
            return
        self.verdict = verdict
        body = QWidget()
        body.setProperty("panel", True)
        column = QVBoxLayout(body)
        column.setContentsMargins(0, 0, 8, 0)
        if verdict is not None:
            column.addLayout(self._rows(verdict))
        column.addStretch(1)
        self.setWidget(body)

    def _rows(self, verdict: Verdict) -> QGridLayout:
        grid = QGridLayout()
        grid.setHorizontalSpacing(10)
        grid.setVerticalSpacing(6)
        grid.setColumnStretch(1, 1)
        look = GRADES[verdict.grade]
        self._add_row(grid, look.shape, look.tone, _label(_escaped(verdict.sentence), size=_SENTENCE_PT, bold=True), 24)
        for finding in verdict.findings:
            look = GRADES[finding.grade]
            self._add_row(grid, look.shape, look.tone, _label(_finding_text(finding)), 16)
        self.setAccessibleName(f"Verdict: {GRADES[verdict.grade].word}. {verdict.sentence}")
        return grid

    def _add_row(self, grid: QGridLayout, shape: str, tone: str, label: QLabel, size: int) -> None:
        mark = ShapeMark(size)
        mark.set_shape(shape, self._scheme.tone(tone))
        row = grid.rowCount()
        grid.addWidget(mark, row, 0, Qt.AlignmentFlag.AlignTop | Qt.AlignmentFlag.AlignHCenter)
        grid.addWidget(label, row, 1)


def _finding_text(finding: Finding) -> str:
    remedy = f"<b>{_escaped(finding.remedy)}</b>" if finding.remedy else ""
    return " ".join(part for part in (_escaped(finding.figure), _escaped(finding.cause), remedy) if part)


def _escaped(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;")


def _label(text: str, *, size: float | None = None, bold: bool = False) -> QLabel:
    label = QLabel(text)
    label.setWordWrap(True)
    label.setTextFormat(Qt.TextFormat.RichText)
    label.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
    if size is not None:
        label.setFont(app_font(size, bold=bold))
    return label
