"""Which tracker makes a hand of the markers: chosen while it runs, seen at once, taken back with one key."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence
from pathlib import Path

import msgspec
from PySide6.QtCore import Qt, QTimer, Signal
from PySide6.QtGui import QKeySequence, QShortcut, QShowEvent
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QDialog,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QRadioButton,
    QScrollArea,
    QStackedWidget,
    QVBoxLayout,
    QWidget,
)

from rhot_app.calibration.rig_figures import tracker_text
from rhot_app.hand.anthropometry import scaled_hand
from rhot_app.mouse.model import LOCKED_DEG, table_plane, with_mouse_model
from rhot_app.project import TRACKER_KINDS, Rig, TrackerKind, TrackerSettings, estimator_obstacle, observation_obstacle
from rhot_app.state import HandState
from rhot_app.ui.backend.contract import CommandClient, Connect
from rhot_app.ui.common.job import Job
from rhot_app.ui.common.sentence import Sentence
from rhot_app.ui.language import tr
from rhot_app.ui.models.proposal import RigChange, progress_text
from rhot_app.ui.models.words import (
    FLAT_MEANING,
    IK_METHODS,
    KINDS,
    LANDMARKS_ONLY,
    LIMITS,
    OBSERVED,
    SIZE_MEANING,
    VARIANTS,
    size_settled,
    size_text,
)

LOOK_MS = 150
_WIDTH_PX, _FRAME_PX = 460, 48  # the window's title


class TrackerDialog(QDialog):
    """Every choice takes effect at once, in the engine and in the rig's file, and `rig_used` gives the new rig.

    `hand` gives the newest state, None while nothing streams. The rig's file keeps what each choice replaced.
    """

    rig_used = Signal(object)

    def __init__(self, rig: Rig, path: Path | None, connect: Connect, hand: Callable[[], HandState | None],
                 parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle(tr("Tracker"))
        self.setProperty("guide", "tracker")
        self.setFixedWidth(_WIDTH_PX)
        self._rig, self._path = rig, path
        self._connect, self._hand = connect, hand
        self._made: list[RigChange] = []
        self._job: Job | None = None
        self.kinds = {kind: QRadioButton(tr(title)) for kind, (title, _) in KINDS.items()}
        self.ik_box, self.ik_words = _choices(IK_METHODS), Sentence(2, muted=True)
        self.observe_box, self.observe_words = _choices(OBSERVED), Sentence(2, muted=True)
        self.variant_box, self.variant_words = _choices(VARIANTS), Sentence(2, muted=True)
        self.limits_box, self.limits_words = _choices(LIMITS), Sentence(2, muted=True)
        self.size_check = QCheckBox(tr("Estimate the hand's size"))
        self.size_check.setToolTip(tr(SIZE_MEANING))
        self.flat_check = QCheckBox(tr("Flat, for the 3-D mouse"))
        self.flat_check.setToolTip(tr(FLAT_MEANING))
        self.size_label = Sentence(2, muted=True)
        self.size_button = QPushButton(tr("Use this size for the rig's hand"))
        self.size_button.setToolTip(tr("Makes every length of the rig's hand so much larger or smaller. What was there "
                                       "is kept."))
        policy = self.size_button.sizePolicy()
        policy.setRetainSizeWhenHidden(True)
        self.size_button.setSizePolicy(policy)
        self.obstacle_label, self.sentence = QLabel(), Sentence(3)
        self.obstacle_label.setWordWrap(True)
        self.undo_button, self.close_button = QPushButton(tr("Undo")), QPushButton(tr("Close"))
        self.undo_button.setToolTip(tr("Take the last change back (Ctrl+Z)."))
        self._lay_out()
        self._connect_parts()
        self._show_rig()
        self._timer = QTimer(self)
        self._timer.timeout.connect(self.look)
        self._timer.start(LOOK_MS)

    # -- putting it together ---------------------------------------------------------------------------------------

    def _lay_out(self) -> None:
        choices, area = QWidget(), QScrollArea()
        column = QVBoxLayout(choices)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(8)
        for kind, (_, meaning) in KINDS.items():
            words = QLabel(tr(meaning))
            words.setWordWrap(True)
            words.setProperty("muted", True)
            words.setContentsMargins(24, 0, 0, 0)
            column.addWidget(self.kinds[kind])
            column.addWidget(words)
        self.obstacle_label.setContentsMargins(24, 0, 0, 0)
        column.addWidget(self.obstacle_label)
        self.solver = _form(((tr("Fingers bent by"), self.ik_box), ("", self.ik_words)))
        self.details = _form((
            (tr("Tracked by"), self.observe_box), ("", self.observe_words),
            (tr("Fingers"), self.variant_box), ("", self.variant_words), (tr("Limits"), self.limits_box),
            ("", self.limits_words), (tr("Hand"), self.flat_check),
            (tr("Size"), self.size_check), ("", self.size_label), ("", self.size_button)))
        self._forms = QStackedWidget()
        for form in (self.solver, self.details):
            self._forms.addWidget(form)
        column.addWidget(self._forms)
        column.addStretch(1)
        area.setProperty("clear", True)
        area.setWidget(choices)
        area.setWidgetResizable(True)
        area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._choices, self._area = choices, area
        layout = QVBoxLayout(self)
        layout.setContentsMargins(16, 16, 16, 16)
        layout.setSpacing(8)
        layout.addWidget(area, 1)
        layout.addWidget(self.sentence)
        buttons = QHBoxLayout()
        buttons.addWidget(self.undo_button)
        buttons.addStretch(1)
        buttons.addWidget(self.close_button)
        layout.addLayout(buttons)

    def _connect_parts(self) -> None:
        for kind in self.kinds.values():
            kind.clicked.connect(self._choose)
        for box in (self.ik_box, self.observe_box, self.variant_box, self.limits_box):
            box.activated.connect(self._choose)
        self.size_check.clicked.connect(self._choose)
        self.flat_check.clicked.connect(self._choose)
        self.size_button.clicked.connect(self.use_size)
        self.undo_button.clicked.connect(self.undo)
        self.close_button.clicked.connect(self.reject)
        for button in (self.size_button, self.undo_button, self.close_button):
            button.setAutoDefault(False)  # Enter in the form is no order
        QShortcut(QKeySequence(QKeySequence.StandardKey.Undo), self).activated.connect(self.undo)

    # -- what is done ----------------------------------------------------------------------------------------------

    def _kind(self) -> TrackerKind:
        return next((kind for kind in TRACKER_KINDS if self.kinds[kind].isChecked()), "classic")

    @property
    def chosen(self) -> TrackerSettings:
        """What the form says."""
        kind = self._kind()
        settings = msgspec.structs.replace(
            self._rig.tracker, kind=kind, ik=self.ik_box.currentData(), variant=self.variant_box.currentData(),
            limits=self.limits_box.currentData(), float_scale=self.size_check.isChecked(),
            observe="markers" if kind == "classic" else self.observe_box.currentData())
        flat, table = settings.locked_deg == LOCKED_DEG, table_plane(self._rig)
        if self.flat_check.isChecked() == flat:
            return settings
        if flat:  # a plane that was written by hand stays
            plane = None if settings.palm_plane == table else settings.palm_plane
            return msgspec.structs.replace(settings, locked_deg={}, palm_plane=plane)
        rig = msgspec.structs.replace(self._rig, tracker=settings)
        return with_mouse_model(rig, settings.palm_plane or table).tracker

    def _choose(self) -> None:
        try:
            settings = self.chosen
            rig = self._tracked_by(settings)
            settings = rig.tracker
        except ValueError as exc:  # the rig cannot be tracked so, as two hands of which one has no markers
            self._failed(f"{str(exc)[:1].upper()}{str(exc)[1:]}.")
            return
        if settings != self._rig.tracker:
            obstacle = observation_obstacle(rig)
            if obstacle is not None:
                self._failed(f"{obstacle.why} {obstacle.remedy}")
                return
            self._change(rig, f"choosing the tracker {tracker_text(settings)}")

    def _tracked_by(self, settings: TrackerSettings) -> Rig:
        """The rig tracked so. Of the classic tracker, which leads on from markers only, a rig without markers on its
        hands goes on to their contours. Raises ValueError for a rig that cannot be tracked so."""
        try:
            return msgspec.structs.replace(self._rig, tracker=settings)
        except ValueError:
            if self._rig.tracker.kind != "classic":
                raise
            contours = msgspec.structs.replace(settings, observe="contours")
            return msgspec.structs.replace(self._rig, tracker=contours)

    def use_size(self) -> None:
        """Put the estimated size into the rig's hand."""
        state = self._hand()
        if state is not None and size_settled(state):
            hand = scaled_hand(self._rig.hand, state.hand_scale)
            self._change(msgspec.structs.replace(self._rig, hand=hand), f"hand {state.hand_scale:.3f} times as large")

    def undo(self) -> None:
        """Take the last change back."""
        if self._job is None and self._made:
            change = self._made[-1]
            self._start(change.before, lambda client: change.restore(client.command), lambda: self._undone(change))

    def _change(self, rig: Rig, reason: str) -> None:
        if self._job is None:
            change = RigChange(self._rig, rig, self._path, reason)
            self._start(rig, lambda client: change.use(client.command), lambda: self._done(change))

    def _start(self, rig: Rig, work: Callable[[CommandClient], None], done: Callable[[], None]) -> None:
        def with_engine() -> None:
            with contextlib.closing(self._connect()) as client:
                work(client)

        self.sentence.setText(progress_text(rig))
        self._job = Job(lambda progress: with_engine(), lambda _: done(), self._failed, None, self).start()
        self._enable()

    def _done(self, change: RigChange) -> None:
        self._made.append(change)
        self._take(change.after, tr("In force.") if self._path is not None
                   else tr("In force until the engine ends: this rig came from no file. Rig, Save rig keeps it."))

    def _undone(self, change: RigChange) -> None:
        self._made.remove(change)
        self._take(change.before, tr("Taken back."))

    def _take(self, rig: Rig, sentence: str) -> None:
        self._job, self._rig = None, rig
        self.sentence.setText(sentence)
        self._show_rig()
        self.rig_used.emit(rig)

    def _failed(self, sentence: str) -> None:
        self._job = None
        self.sentence.setText(sentence)
        self._show_rig()

    # -- showing ---------------------------------------------------------------------------------------------------

    def follow(self, rig: Rig, path: Path | None) -> None:
        """Somebody else has changed the rig: what was changed here cannot be taken back singly any more."""
        if self._job is None and (rig != self._rig or path != self._path):
            self._rig, self._path = rig, path
            self._made.clear()
            self.sentence.setText("")
            self._show_rig()

    def _show_rig(self) -> None:
        """The form as the rig is."""
        settings = self._rig.tracker
        self.kinds[settings.kind].setChecked(True)
        self.ik_box.setCurrentIndex(self.ik_box.findData(settings.ik))
        self.ik_words.setText(tr(IK_METHODS[settings.ik][1]))
        self.variant_box.setCurrentIndex(self.variant_box.findData(settings.variant))
        self.limits_box.setCurrentIndex(self.limits_box.findData(settings.limits))
        self.size_check.setChecked(settings.float_scale)
        self.flat_check.setChecked(settings.locked_deg == LOCKED_DEG)
        self.observe_box.setCurrentIndex(self.observe_box.findData(settings.observe))
        unsaid = not settings.landmarks and all(marker.shape == "landmark" for marker in self._rig.markers.markers)
        self.observe_words.setText(tr(LANDMARKS_ONLY if unsaid and settings.observe != "contours"
                                      else OBSERVED[settings.observe][1]))
        self.variant_words.setText(tr(VARIANTS[settings.variant][1]))
        self.limits_words.setText(tr(LIMITS[settings.limits][1]))
        obstacle = estimator_obstacle(self._rig)
        self.obstacle_label.setText("" if obstacle is None else f"{obstacle.why} {obstacle.remedy}")
        self.obstacle_label.setVisible(bool(self.obstacle_label.text()))
        self._forms.setCurrentWidget(self.solver if settings.kind == "classic" else self.details)
        self._enable()
        self.look()

    def showEvent(self, event: QShowEvent) -> None:  # noqa: N802
        """As high as its largest form needs, for good; on a small screen the choices scroll, the buttons do not."""
        super().showEvent(event)
        others_px = self.sizeHint().height() - self._area.sizeHint().height()
        needed_px = self._choices.heightForWidth(_WIDTH_PX - 32) + others_px
        self.setFixedHeight(min(needed_px, self.screen().availableGeometry().height() - _FRAME_PX))

    def _enable(self) -> None:
        resting = self._job is None
        possible = not self.obstacle_label.text()
        self.kinds["classic"].setEnabled(resting)
        self.kinds["estimator"].setEnabled(resting and possible)
        self.details.setEnabled(resting and possible)
        self.solver.setEnabled(resting)
        self.undo_button.setEnabled(resting and bool(self._made))
        self.close_button.setEnabled(resting)

    def reject(self) -> None:
        """Close, but not while the engine changes over: what comes of that is written to the rig file, or told."""
        if self._job is None:
            super().reject()

    def look(self) -> None:
        """The hand's size as it is estimated now."""
        state = self._hand()
        text = size_text(state, self._rig)
        self.size_button.setEnabled(size_settled(state))
        self.size_label.setText(text)
        self.size_button.setVisible(bool(text))


def _form(rows: Sequence[tuple[str, QWidget]]) -> QWidget:
    widget = QWidget()
    form = QGridLayout(widget)
    form.setContentsMargins(24, 8, 0, 0)
    form.setVerticalSpacing(6)
    form.setColumnStretch(1, 1)
    for row, (name, part) in enumerate(rows):
        form.addWidget(QLabel(name), row, 0)
        form.addWidget(part, row, 1)
    return widget


def _choices(words: dict[str, tuple[str, str]]) -> QComboBox:
    box = QComboBox()
    box.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)  # widens no dialog
    for name, (title, meaning) in words.items():
        box.addItem(tr(title), name)
        box.setItemData(box.count() - 1, tr(meaning), Qt.ItemDataRole.ToolTipRole)
    return box
