"""The row of buttons under the timeline: first, back, play, on, last, speed, the range that is repeated, bookmark."""

from __future__ import annotations

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QIcon
from PySide6.QtWidgets import QComboBox, QHBoxLayout, QLabel, QPushButton, QWidget

from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.replay.player import SPEEDS
from rhot_app.ui.replay.session import Replay
from rhot_app.ui.shapes import shape_pixmap

_ICON_PX = 16


class Transport(QWidget):
    """Says what is wanted; the window does it. `speed_chosen` gives times real time."""

    play_asked = Signal()
    step_asked = Signal(int)
    first_asked = Signal()
    last_asked = Signal()
    speed_chosen = Signal(float)
    loop_begin_asked = Signal()
    loop_end_asked = Signal()
    loop_clear_asked = Signal()
    bookmark_asked = Signal()

    def __init__(self, scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._signs: list[tuple[QPushButton, str]] = []
        self._playing: bool | None = None
        self.first_button = self._sign("first", "The beginning (Home).")
        self.back_button = self._sign("previous", "One state back (left arrow).")
        self.play_button = self._sign("play", "Play or pause (Space).")
        self.on_button = self._sign("next", "One state on (right arrow).")
        self.last_button = self._sign("last", "The end (End).")
        self.speed_box = QComboBox()
        self.speed_box.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.speed_box.setToolTip("How fast it plays, times real time.")
        for speed in SPEEDS:
            self.speed_box.addItem(f"{speed:g} ×", speed)
        self.speed_box.setCurrentIndex(SPEEDS.index(1.0))
        self.loop_begin_button = self._word("Loop from here", "The range that is repeated begins here ([).")
        self.loop_end_button = self._word("to here", "The range that is repeated ends here (]).")
        self.loop_clear_button = self._word("No loop", "Repeat nothing.")
        self.bookmark_button = self._word("Bookmark", "Write a few words about this moment into the recording (B).")
        self.place = QLabel("")
        widest = "00:00.00 of 00:00.00, state 00000 of 00000"
        self.place.setMinimumWidth(self.place.fontMetrics().horizontalAdvance(widest))
        self._lay_out()
        self._connect()
        self.set_scheme(scheme)

    def _sign(self, shape: str, meaning: str) -> QPushButton:
        button = self._word("", meaning)
        button.setIconSize(QSize(_ICON_PX, _ICON_PX))
        button.setAccessibleName(meaning)
        self._signs.append((button, shape))
        return button

    def _word(self, text: str, meaning: str) -> QPushButton:
        button = QPushButton(text)
        button.setToolTip(meaning)
        button.setFocusPolicy(Qt.FocusPolicy.TabFocus)  # a click leaves the space bar to the player
        return button

    def _lay_out(self) -> None:
        row = QHBoxLayout(self)
        row.setContentsMargins(10, 0, 10, 8)
        row.setSpacing(6)
        for button, _ in self._signs:
            row.addWidget(button)
        row.addWidget(self.speed_box)
        row.addSpacing(8)
        row.addWidget(self.place)
        row.addStretch(1)
        for word in (self.loop_begin_button, self.loop_end_button, self.loop_clear_button, self.bookmark_button):
            row.addWidget(word)

    def _connect(self) -> None:
        for button, signal in ((self.first_button, self.first_asked), (self.play_button, self.play_asked),
                               (self.last_button, self.last_asked), (self.loop_begin_button, self.loop_begin_asked),
                               (self.loop_end_button, self.loop_end_asked),
                               (self.loop_clear_button, self.loop_clear_asked),
                               (self.bookmark_button, self.bookmark_asked)):
            button.clicked.connect(lambda checked=False, signal=signal: signal.emit())
        self.back_button.clicked.connect(lambda: self.step_asked.emit(-1))
        self.on_button.clicked.connect(lambda: self.step_asked.emit(1))
        self.speed_box.activated.connect(lambda: self.speed_chosen.emit(float(self.speed_box.currentData())))

    def set_scheme(self, scheme: Scheme) -> None:
        """Change colours."""
        self._scheme = scheme
        ratio = self.devicePixelRatioF()
        for button, shape in self._signs:
            button.setIcon(QIcon(shape_pixmap(shape, scheme.text, _ICON_PX, ratio)))
        self._playing = None

    @property
    def is_playing(self) -> bool | None:
        """What the play button shows; None before it shows anything."""
        return self._playing

    def show_replay(self, replay: Replay) -> None:
        """Where it stands."""
        player = replay.player
        self.place.setText(replay.position_text)
        self.loop_clear_button.setEnabled(player.loop is not None)
        if player.playing != self._playing:
            self._playing = player.playing
            self.play_button.setIcon(QIcon(shape_pixmap("pause" if player.playing else "play", self._scheme.text,
                                                        _ICON_PX, self.devicePixelRatioF())))
