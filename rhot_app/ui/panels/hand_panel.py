"""A hand's joint angles as a table, each with how and how well it is known, and the palm."""

from __future__ import annotations

import math

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QBrush, QColor, QFont, QFontMetrics, QPainter
from PySide6.QtWidgets import (
    QBoxLayout,
    QButtonGroup,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from rhot_app.calibration.check.camera_calibration import KNOWN_EXACTLY, calibration_error
from rhot_app.hand.skeleton import ANGLE_SLICES, FINGERS
from rhot_app.project import Rig
from rhot_app.state import Condition, HandState, Knowledge
from rhot_app.ui.common.shapes import ShapeMark, shape_icon
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.models.rows import DASH, angle_text, palm_text
from rhot_app.ui.models.words import (
    HANDS,
    KNOWLEDGE,
    Look,
    condition_look,
    each_hand,
    hand_names,
    scale_text,
    size_known,
    tip,
)

FINGER_HEADS = ((tr_noop("spread"), "abduction"), ("MCP", "MCP"), ("PIP", "PIP"), ("DIP", "DIP"))
THUMB_HEADS = ((tr_noop("spread"), "abduction"), ("CMC", "CMC"), (tr_noop("turn"), "abduction"), ("MCP", "MCP"),
               ("IP", "IP"))

_WIDEST, _WIDE = "-88 ±88°", "-88 ±8°"


class AngleCell(QLabel):
    """One angle: plain when measured, muted when inferred, hatched ground when guessed."""

    def __init__(self, name: str, scheme: Scheme) -> None:
        super().__init__(DASH)
        self._scheme = scheme
        self._knowledge = Knowledge.UNKNOWN
        self._title = name.replace("_", " ")
        self.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        self.setContentsMargins(2, 1, 2, 1)

    def sizeHint(self) -> QSize:  # noqa: N802
        """Room for every angle: a column that grew with what it says would move the whole dock."""
        return self._room_for(_WIDEST)

    def minimumSizeHint(self) -> QSize:  # noqa: N802
        """Room for an angle that is known to less than ten degrees."""
        return self._room_for(_WIDE)

    def _room_for(self, text: str) -> QSize:
        bold = QFont(self.font())
        bold.setWeight(QFont.Weight.DemiBold)
        margins = self.contentsMargins()
        return QSize(QFontMetrics(bold).horizontalAdvance(text) + margins.left() + margins.right(),
                     super().sizeHint().height())

    def show_angle(self, angle_rad: float, sd_rad: float, knowledge: Knowledge) -> None:
        """Another value with its standard deviation, NaN when that is not known."""
        text = angle_text(angle_rad, sd_rad)
        if text == self.text() and knowledge == self._knowledge:
            return
        self.setText(text)
        if knowledge != self._knowledge:
            self._knowledge = knowledge
            colour = self._scheme.text if knowledge == Knowledge.MEASURED else self._scheme.muted
            self.setStyleSheet(f"color: {colour}; font-weight: {600 if knowledge == Knowledge.MEASURED else 400};")
            look = KNOWLEDGE[knowledge]
            self.setToolTip(f"{self._title}: {tr(look.word)}.\n{tr(look.meaning)}")

    def paintEvent(self, event: object) -> None:  # noqa: N802
        """Hatch under a guessed value, then the text."""
        if self._knowledge == Knowledge.GUESSED:
            painter = QPainter(self)
            painter.fillRect(QRectF(self.rect()).adjusted(1, 1, -1, -1),
                             QBrush(QColor(self._scheme.border), Qt.BrushStyle.BDiagPattern))
            painter.end()
        super().paintEvent(event)  # type: ignore[arg-type]


class HandPanel(QWidget):
    """Four fingers in one table, the thumb in another, and the key to how values are known; of two hands the chosen."""

    def __init__(self, scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setProperty("panel", True)
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self.setProperty("guide", "hand")
        self._scheme = scheme
        self.choice = HandChoice(scheme)
        self._by_calibration = KNOWN_EXACTLY
        self.cells: list[AngleCell] = []
        self._grid = QGridLayout()
        self._grid.setHorizontalSpacing(2)
        self._grid.setVerticalSpacing(1)
        self._whole = QHBoxLayout()
        self._key = QHBoxLayout()
        layout = QVBoxLayout(self)
        layout.setContentsMargins(8, 4, 8, 8)
        layout.setSpacing(6)
        layout.addWidget(self.choice)
        layout.addLayout(self._grid)
        layout.addLayout(self._whole)
        layout.addLayout(self._key)
        layout.addStretch(1)
        self._fill()

    def set_scheme(self, scheme: Scheme) -> None:
        """Change colours."""
        self._scheme = scheme
        self.choice.set_scheme(scheme)
        for box in (self._grid, self._whole, self._key):
            while (item := box.takeAt(0)) is not None:
                if (widget := item.widget()) is not None:
                    widget.deleteLater()
        self._fill()

    def _fill(self) -> None:
        self.cells = []
        self._add_heads(0, FINGER_HEADS)
        cells: dict[str, list[AngleCell]] = {}
        for name, part in zip(FINGERS, ANGLE_SLICES, strict=True):
            heads = THUMB_HEADS if name == "thumb" else FINGER_HEADS
            cells[name] = [AngleCell(f"{tr(name)} {tr(head)}", self._scheme) for head, _ in heads]
            assert len(cells[name]) == part.stop - part.start
            self.cells += cells[name]
        for row, name in enumerate(FINGERS[1:], start=1):
            self._add_row(row, name, cells[name])
        self._add_heads(6, THUMB_HEADS)
        self._add_row(7, "thumb", cells["thumb"])
        self._grid.setRowMinimumHeight(5, 6)
        self._fill_whole()
        for knowledge in (Knowledge.MEASURED, Knowledge.INFERRED, Knowledge.GUESSED):
            look = KNOWLEDGE[knowledge]
            mark, word = ShapeMark(12), QLabel(tr(look.word))
            mark.set_shape(look.shape, self._scheme.tone(look.tone))
            word.setProperty("muted", True)
            word.setToolTip(tr(look.meaning))
            self._key.addWidget(mark)
            self._key.addWidget(word)
            self._key.addStretch(1)

    def _fill_whole(self) -> None:
        self._palm_mark, self.palm = ShapeMark(12), QLabel(DASH)
        self.palm.setToolTip(f"{tip('palm')}\n{tip('hand size')}")
        self.palm.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)  # it must not widen the dock
        self._whole.addWidget(QLabel(tr("palm")))
        self._whole.addSpacing(8)
        self._whole.addWidget(self._palm_mark)
        self._whole.addWidget(self.palm, 1)

    def _add_heads(self, row: int, heads: tuple[tuple[str, str], ...]) -> None:
        for column, (head, term) in enumerate(heads, start=1):
            label = QLabel(tr(head))
            label.setProperty("muted", True)
            label.setAlignment(Qt.AlignmentFlag.AlignRight)
            label.setContentsMargins(2, 0, 2, 0)
            label.setToolTip(tip(term) + ("" if term == "abduction" else "\n" + tip("flexion")))
            self._grid.addWidget(label, row, column)

    def _add_row(self, row: int, name: str, cells: list[AngleCell]) -> None:
        self._grid.addWidget(QLabel(tr(name)), row, 0)
        for column, cell in enumerate(cells, start=1):
            self._grid.addWidget(cell, row, column)
            self._grid.setColumnStretch(column, 1)

    def show_rig(self, rig: Rig | None) -> None:
        """Hands of another rig, of which nothing is known yet."""
        self.choice.show_hands(hand_names(rig))
        self._by_calibration = calibration_error(rig)
        self.palm.setToolTip("\n".join(filter(None, (tip("palm"), tip("hand size"), self._by_calibration.reason))))
        self.show_state(None)

    def show_state(self, state: HandState | None) -> None:
        """The angles of `state`, of its other hand when that is chosen; None shows dashes."""
        self.choice.show_state(state)
        state = self.choice.chosen(state)
        known = self._by_calibration.known
        for k, cell in enumerate(self.cells):
            if state is None:
                cell.show_angle(math.nan, math.nan, Knowledge.UNKNOWN)
            else:
                cell.show_angle(float(state.angles[k]), float(state.angle_sd[k]) if known else math.nan,
                                Knowledge(int(state.angle_knowledge[k])))
        self._show_palm(state)

    def _show_palm(self, state: HandState | None) -> None:
        """The line about the whole hand: how the palm is known, and its size where that is estimated."""
        knowledge = Knowledge.UNKNOWN if state is None else state.palm_knowledge
        if state is None:
            text = DASH
        else:
            text = ", ".join(part for part in (tr(KNOWLEDGE[knowledge].word), palm_text(state, self._by_calibration))
                             if part)
            if size_known(state):
                text += tr("; size {size}", size=scale_text(state, known=self._by_calibration.known))
        if text != self.palm.text():
            self.palm.setText(text)
            look = KNOWLEDGE[knowledge]
            self._palm_mark.set_shape(look.shape, self._scheme.tone(look.tone))


# -- which of two hands a panel tells of, and how each is tracked ------------------------------------------------------

class HandChoice(QWidget):
    """A button for each hand, with the shape of how it is tracked. Not shown while there is only one."""

    def __init__(self, scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._scheme = scheme
        self.buttons = [QPushButton(), QPushButton()]
        self._looks: list[Look | None] = [None, None]
        self._group = QButtonGroup(self)
        self._row = QHBoxLayout(self)
        self._row.setContentsMargins(0, 0, 0, 0)
        self._row.setSpacing(4)
        for button in self.buttons:
            button.setProperty("flat", True)
            button.setCheckable(True)
            button.setIconSize(QSize(24, 18))
            self._group.addButton(button)
            self._row.addWidget(button, 1)
        self.show_hands(("",))

    def set_scheme(self, scheme: Scheme) -> None:
        """Change colours; the shapes follow with the next state."""
        self._scheme = scheme
        self._looks = [None, None]

    def show_hands(self, names: tuple[str, ...]) -> None:
        """Hands of these names, the rig's first one first and chosen; left stands at the left."""
        direction = QBoxLayout.Direction
        self._row.setDirection(direction.LeftToRight if names == tuple(sorted(names)) else direction.RightToLeft)
        for button, name in zip(self.buttons, names, strict=False):
            button.setText(tr(HANDS.get(name, "")))
        self._looks = [None, None]
        self.buttons[0].setChecked(True)
        self.setVisible(len(names) > 1)
        self.show_state(None)

    def show_state(self, state: HandState | None) -> None:
        """How each hand is tracked; a hand that the state does not tell of is idle."""
        hands = each_hand(state)
        for k, button in enumerate(self.buttons):
            look = condition_look((hands[k].condition if k < len(hands) else Condition.IDLE).value)
            if look != self._looks[k]:
                self._looks[k] = look
                button.setIcon(shape_icon(look.shape, self._scheme.tone(look.tone)))
                button.setToolTip(tr("Show the {hand}'s angles. It is {word}.", hand=button.text(), word=tr(look.word)))

    def chosen(self, state: HandState | None) -> HandState | None:
        """The chosen hand's part of `state`, None where that has none."""
        if self.buttons[0].isChecked() or state is None:
            return state
        return state.other
