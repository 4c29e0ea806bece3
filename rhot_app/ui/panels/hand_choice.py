"""Which of two hands a panel tells of, and how each is tracked."""

from __future__ import annotations

from PySide6.QtCore import QSize
from PySide6.QtWidgets import QBoxLayout, QButtonGroup, QHBoxLayout, QPushButton, QWidget

from rhot_app.tracking.state import Condition, HandState
from rhot_app.ui.models.hands import each_hand
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.models.words import Look, condition_look
from rhot_app.ui.shapes import shape_icon


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
            button.setText(f"{name} hand")
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
                button.setIcon(shape_icon(look.shape, self._scheme.tone(look.tone), self.devicePixelRatioF()))
                button.setToolTip(f"Show the {button.text()}'s angles. It is {look.word}.")

    def chosen(self, state: HandState | None) -> HandState | None:
        """The chosen hand's part of `state`, None where that has none."""
        if self.buttons[0].isChecked() or state is None:
            return state
        return state.other
