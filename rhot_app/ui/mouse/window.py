"""The window of the 3-D mouse: pick balls up and move them with the hand, undo that, and run the target test."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Final

from PySide6.QtCore import QSize
from PySide6.QtWidgets import QComboBox, QHBoxLayout, QLabel, QVBoxLayout, QWidget

from rhot_app.engine.status import EngineStatus
from rhot_app.errors import RhotError
from rhot_app.mouse.model import up_of
from rhot_app.mouse.pick_scene import PickScene
from rhot_app.mouse.pointer import BUTTONS, Mouse, MouseSettings, MouseState
from rhot_app.mouse.target_test import TargetTest
from rhot_app.project import Rig
from rhot_app.state import HandState
from rhot_app.ui.backend.contract import Listener
from rhot_app.ui.backend.live import SILENCE_S
from rhot_app.ui.common.parts import keep_width, plain_button
from rhot_app.ui.common.sentence import Sentence
from rhot_app.ui.common.shapes import shape_pixmap
from rhot_app.ui.common.theme import app_font
from rhot_app.ui.common.tool_window import ToolWindow
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.models.pacing import FramePacer
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.models.words import NO_RIG, condition_look
from rhot_app.ui.mouse.scene import MouseView
from rhot_app.ui.panels.state_badge import StateBadge

TICK_MS: Final = 16
TOLD_S: Final = 6.0
"""What was done stands so long, as in the main window."""

_SIZE: Final = QSize(960, 720)
_SHAPE_PX: Final = 18
_READOUT_PT: Final = 14.0
_NAMES: Final = {"thumb": tr_noop("Thumb"), "little": tr_noop("Little finger")}

NO_ENGINE: Final = tr_noop("No engine is heard, so no hand moves the mouse. Open a rig, or the simulated rig, in the "
                           "main window and press Start.")


class MouseWindow(ToolWindow):
    """`listener` is this window's own; `rig` gives the rig that is open."""

    def __init__(self, listener: Listener, rig: Callable[[], Rig | None], scheme: Scheme, parent: QWidget | None = None,
                 clock: Callable[[], float] = time.monotonic) -> None:
        """`clock` gives seconds."""
        super().__init__(tr("3-D mouse"), "mouse", parent, _SIZE)
        self._clock = clock
        self._listener, self._rig, self._scheme = listener, rig, scheme
        self._followed: Rig | None = None
        self._heard_s = clock()
        self._told, self._told_s = "", -TOLD_S
        self.mouse = Mouse()
        self.state: MouseState | None = None
        self.pick = PickScene()
        self.test: TargetTest | None = None
        self.pacer = FramePacer()
        self.view = MouseView(scheme)
        self.view.frameSwapped.connect(lambda: self.pacer.end(time.monotonic()))
        self._make_parts(scheme)
        self._lay_out()
        self.start(TICK_MS, {"H": self.take_rest, "T": self.begin_or_end_test})
        self.tick()

    def _make_parts(self, scheme: Scheme) -> None:
        self.rest_button = plain_button(tr("Rest here"), tr("The hand as it lies for the next half second becomes the "
                                                            "cursor's origin (H)."), self.take_rest)
        self.undo_button = plain_button(tr("Undo"), tr("Take the last move of a ball back (Ctrl+Z)."), self.undo)
        self.test_button = plain_button(tr("Target test"), tr("Click nine targets with the thumb: how many bits per "
                                                              "second the hand conveys (T)."), self.begin_or_end_test)
        self.height_box = QComboBox()
        self.height_box.setToolTip(tr("What sets the pole's length: the index fingertip above the palm, or the palm."))
        self.height_box.setAccessibleName(tr("Height from"))
        for title, source in ((tr("Height from the index finger"), "index"), (tr("Height from the palm"), "palm")):
            self.height_box.addItem(title, source)
        self.height_box.currentIndexChanged.connect(self._choose_height)
        self.badge = StateBadge(scheme)
        self.place = QLabel()
        self.place.setFont(app_font(_READOUT_PT))
        keep_width(self.place, tr("right {right:+4.0f} mm   forward {forward:+4.0f} mm   height {height:3.0f} mm",
                                  right=-888, forward=-888, height=888))
        self.place.setToolTip(tr("Cursor: right and forward of the ground's middle, and above it."))
        self.shapes = {button: QLabel() for button in BUTTONS}
        self.words = {button: QLabel() for button in BUTTONS}
        for button, label in self.words.items():
            label.setFont(app_font(_READOUT_PT))
            keep_width(label, *(f"{tr(_NAMES[button])} {word}" for word in (tr("DOWN"), tr("up"))))
            label.setToolTip(tr("Pressed while the {finger} is spread away from the hand.", finger=tr(button)))
        self.sentence = Sentence(2)

    def _lay_out(self) -> None:
        top, below = QHBoxLayout(), QHBoxLayout()
        for part in (self.rest_button, self.undo_button, self.test_button, self.height_box):
            top.addWidget(part)
        top.addStretch(1)
        top.addWidget(self.badge)
        below.addWidget(self.place)
        below.addStretch(1)
        for button in BUTTONS:
            below.addWidget(self.shapes[button])
            below.addWidget(self.words[button])
            below.addSpacing(16)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(16, 16, 16, 16)
        layout.setSpacing(8)
        layout.addLayout(top)
        layout.addWidget(self.view, 1)
        layout.addLayout(below)
        layout.addWidget(self.sentence)

    # -- what the person does --------------------------------------------------------------------------------------

    def take_rest(self) -> None:
        """The next half second is the hand's rest."""
        self.mouse.rest()
        self._tell(tr("Hold the hand still."))

    def undo(self) -> None:
        """Take the last move of a ball back, or say that there is none."""
        self._tell(self.pick.undo() if self.test is None
                   else tr("The target test moves no ball. End it to undo moves."))

    def begin_or_end_test(self) -> None:
        """Nine targets in place of the balls, or the balls again, which lie where they were."""
        self.test = TargetTest() if self.test is None else None
        self.pick.interrupt()
        self.test_button.setText(tr("Target test") if self.test is None else tr("End the test"))
        self._told = ""

    def _choose_height(self) -> None:
        self.mouse = self._new_mouse()
        self._tell(tr("Hold the hand still for half a second: that becomes the cursor's origin."))

    def _new_mouse(self) -> Mouse:
        up = None if self._followed is None else up_of(self._followed)
        return Mouse(MouseSettings(height_from=self.height_box.currentData()), up)

    # -- every tick ------------------------------------------------------------------------------------------------

    def tick(self) -> None:
        """Take in what arrived, and show it."""
        if self._rig() is not self._followed:
            self._followed = self._rig()
            self.mouse = self._new_mouse()
        now, drawing_s = self._clock(), time.monotonic()
        try:
            messages = self._listener.poll()
        except RhotError as exc:
            messages = []
            self._tell(str(exc))
        for message in messages:
            if isinstance(message, HandState):
                self._feed(message)
            if isinstance(message, HandState | EngineStatus):
                self._heard_s = now
        if self._rig() is None or now - self._heard_s > SILENCE_S:
            self.state = None
        self._show_words(now)
        self.pacer.give_up(drawing_s)
        if self.pacer.due(drawing_s) and self.view.isVisible():
            self.pacer.begin(drawing_s)
            self.view.show_mouse(self.state, self.pick, self.test)

    def _feed(self, hand: HandState) -> None:
        self.state = self.mouse.feed(hand)
        if self.test is None:
            self.pick.feed(self.state)
            return
        if self.test.wanted is not None:
            self.test.feed(self.state)

    def _tell(self, sentence: str) -> None:
        self._told, self._told_s = sentence, self._clock()

    def _show_words(self, now: float) -> None:
        state = self.state
        self.badge.show_look(NO_RIG if state is None else condition_look(state.condition.value), None)
        cursor = None if state is None else state.cursor
        if cursor is None:
            self.place.setText(tr("right – mm   forward – mm   height – mm"))
        else:
            right, forward, height = 1e3 * cursor
            self.place.setText(tr("right {right:+4.0f} mm   forward {forward:+4.0f} mm   height {height:3.0f} mm",
                                  right=right, forward=forward, height=height))
        for button in BUTTONS:
            down = state is not None and state.is_pressed(button)
            word = tr("DOWN") if down else tr("up")
            self.words[button].setText(f"{tr(_NAMES[button])} {word}")
            self.shapes[button].setPixmap(shape_pixmap(
                "disc" if down else "ring", self._scheme.accent if down else self._scheme.neutral, _SHAPE_PX,
                self.devicePixelRatioF()))
        self.sentence.setText(self._sentence(now))

    def _sentence(self, now: float) -> str:
        """The most urgent thing: what was done just now, what is missing, what to do."""
        if now - self._told_s < TOLD_S and self._told:
            return self._told
        if self.state is None:
            return tr(NO_ENGINE)
        if self.state.needs:
            return tr(self.state.needs[0])
        if self.test is not None:
            found = self.test.result()
            done = tr("Move the cursor's foot into the blue target and spread the thumb.")
            return done if found is None else tr("Done: {sentence}", sentence=found.sentence)
        if self.pick.held is not None:
            return tr("The {name} moves with the cursor until the thumb returns.",
                      name=self.pick.balls[self.pick.held].name)
        if self.pick.selected is not None:
            return (tr("Spread the thumb to pick the {name}, the little finger to put it on the ground.",
                       name=self.pick.balls[self.pick.selected].name))
        return tr("Bring the cursor to a ball.")

    def set_scheme(self, scheme: Scheme) -> None:
        """Change colours."""
        self._scheme = scheme
        self.badge.set_scheme(scheme)
        self.view.set_scheme(scheme)

    def stop(self) -> None:
        """Listening."""
        self._listener.close()
