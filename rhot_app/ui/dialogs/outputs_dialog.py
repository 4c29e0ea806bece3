"""The live streams to other programs: which run, and how they go; switched, added, changed, removed while tracking."""

from __future__ import annotations

import contextlib
from collections.abc import Callable

import msgspec
from PySide6.QtCore import QSize, Qt, QTimer, Signal
from PySide6.QtGui import QKeyEvent, QKeySequence, QShortcut
from PySide6.QtWidgets import (
    QComboBox,
    QDialog,
    QDoubleSpinBox,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QPushButton,
    QScrollArea,
    QVBoxLayout,
    QWidget,
)

from rhot_app.engine.status import EngineStatus
from rhot_app.errors import OutputError
from rhot_app.outputs.outputs import output_plugins
from rhot_app.outputs.spec import OPENXR_ONLY
from rhot_app.project import OutputSettings, Rig
from rhot_app.ui.backend.contract import Connect, Opened
from rhot_app.ui.common.job import Job
from rhot_app.ui.common.sentence import Sentence
from rhot_app.ui.dialogs.output_card import OutputCard
from rhot_app.ui.language import tr
from rhot_app.ui.models.outputs import (
    EMPTY,
    JOINT_SETS,
    KINDS,
    Edit,
    OutputRow,
    SendRates,
    change_outputs,
    draft,
    keeping,
    kind_of,
    replacing,
    restoring,
    rows,
    title_of,
)
from rhot_app.ui.models.palette import Scheme

LOOK_MS = 150
_SIZE = QSize(720, 700)


class OutputsDialog(QDialog):
    """Every change takes effect at once in the engine, and `rig_used` gives the new rig; Save rig keeps it.

    `status` gives the engine's newest status, None before there is one.
    """

    rig_used = Signal(object)

    def __init__(self, opened: Opened, connect: Connect, status: Callable[[], EngineStatus | None],
                 scheme: Callable[[], Scheme], parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle(tr("Outputs"))
        self.setProperty("guide", "outputs")
        self.resize(_SIZE)
        self._opened, self._outputs = opened, opened.rig.outputs
        self._connect, self._status, self._scheme = connect, status, scheme
        self._rates = SendRates()
        self._made: list[tuple[tuple[OutputSettings, ...], tuple[OutputSettings, ...]]] = []
        self._job: Job | None = None
        self._changing: OutputSettings | None = None  # the one that the form changes
        self.cards: list[OutputCard] = []
        self.empty_label = QLabel(tr(EMPTY))
        self.empty_label.setWordWrap(True)
        self.empty_label.setProperty("muted", True)
        self.form_title = QLabel()
        self.form_title.setProperty("title", True)
        self.kind_box, self.joints_box = QComboBox(), QComboBox()
        self.kind_label, self.target_edit, self.rate_box = Sentence(3, muted=True), QLineEdit(), QDoubleSpinBox()
        self.add_button, self.cancel_button = QPushButton(tr("Add")), QPushButton(tr("Cancel"))
        self.sentence = Sentence(3)
        self.undo_button, self.close_button = QPushButton(tr("Undo")), QPushButton(tr("Close"))
        self._fill_form()
        self._lay_out()
        self._connect_parts()
        self._end_changing()
        self._show_outputs()
        self._timer = QTimer(self)
        self._timer.timeout.connect(self.look)
        self._timer.start(LOOK_MS)
        self.finished.connect(self._timer.stop)

    # -- putting it together ---------------------------------------------------------------------------------------

    def _fill_form(self) -> None:
        for name in (*KINDS, *output_plugins()):
            self.kind_box.addItem(tr(kind_of(name).title), name)
            self.kind_box.setItemData(self.kind_box.count() - 1, tr(kind_of(name).meaning), Qt.ItemDataRole.ToolTipRole)
        for name, (title, meaning) in JOINT_SETS.items():
            self.joints_box.addItem(tr(title), name)
            self.joints_box.setItemData(self.joints_box.count() - 1, tr(meaning), Qt.ItemDataRole.ToolTipRole)
        self.kind_box.setToolTip(tr("Which protocol the other program understands."))
        self.joints_box.setToolTip(tr("The joint set: which joints, in whose order and axes."))
        self.rate_box.setRange(0.0, 1000.0)
        self.rate_box.setDecimals(1)
        self.rate_box.setSuffix(tr(" states/s"))
        self.rate_box.setSpecialValueText(tr("every state"))
        self.rate_box.setMinimumHeight(30)
        self.rate_box.setToolTip(tr("At most so many states per second; at the lowest value every state is sent."))
        self.undo_button.setToolTip(tr("Take the last change back (Ctrl+Z)."))

    def _lay_out(self) -> None:
        layout = QVBoxLayout(self)
        layout.setContentsMargins(16, 16, 16, 16)
        layout.setSpacing(8)
        layout.addWidget(self.empty_label)
        area, inner = QScrollArea(), QWidget()
        self._list = QVBoxLayout(inner)
        self._list.setContentsMargins(0, 0, 0, 0)
        self._list.setSpacing(8)
        self._list.addStretch(1)
        inner.setProperty("panel", True)
        area.setWidget(inner)
        area.setWidgetResizable(True)
        area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        layout.addWidget(area, 1)
        layout.addWidget(self.form_title)
        form = QGridLayout()
        form.setColumnStretch(1, 1)
        for row, column, name, part in ((0, 0, "&Kind", self.kind_box), (0, 2, "&Joints", self.joints_box),
                                        (1, 0, "&Target", self.target_edit), (1, 2, "&Rate", self.rate_box)):
            label = QLabel(name)
            label.setBuddy(part)
            form.addWidget(label, row, column)
            form.addWidget(part, row, column + 1)
        layout.addLayout(form)
        adding, buttons = QHBoxLayout(), QHBoxLayout()
        adding.addWidget(self.kind_label, 1)
        for button in (self.cancel_button, self.add_button):
            adding.addWidget(button)
        layout.addLayout(adding)
        layout.addWidget(self.sentence)
        buttons.addWidget(self.undo_button)
        buttons.addStretch(1)
        buttons.addWidget(self.close_button)
        layout.addLayout(buttons)

    def _connect_parts(self) -> None:
        self.kind_box.currentIndexChanged.connect(self._show_kind)
        self.target_edit.returnPressed.connect(self.submit)
        self.add_button.clicked.connect(self.submit)
        self.cancel_button.clicked.connect(self._end_changing)
        self.undo_button.clicked.connect(self.undo)
        self.close_button.clicked.connect(self.close)
        for button in (self.add_button, self.cancel_button, self.undo_button, self.close_button):
            button.setAutoDefault(False)  # Enter in a list or at a switch is no order
        QShortcut(QKeySequence(QKeySequence.StandardKey.Undo), self).activated.connect(self.undo)

    # -- what is done ----------------------------------------------------------------------------------------------

    def submit(self) -> None:
        """Add what the form says, or put it in the place of the output that is being changed."""
        old = self._changing
        others = tuple(one for one in self._outputs if one != old)
        try:
            new = draft(self.kind_box.currentData(), self.target_edit.text(), self.joints_box.currentData(),
                        self.rate_box.value(), others)
        except OutputError as exc:
            self.sentence.setText(_capital(str(exc)))
            self.target_edit.setFocus()
            return
        if old is None:
            self._change(replacing(None, new), tr("Added {output}.", output=title_of(new)))
        else:
            self._change(replacing(old, msgspec.structs.replace(new, enabled=old.enabled)),
                         tr("Changed to {output}.", output=title_of(new)))

    def switch(self, settings: OutputSettings, on: bool) -> None:
        """Open or close one; it stays in the list."""
        self._change(replacing(settings, msgspec.structs.replace(settings, enabled=on)),
                     tr("{output} is on.", output=title_of(settings)) if on
                     else tr("{output} is off.", output=title_of(settings)))

    def remove(self, settings: OutputSettings) -> None:
        """Close one and take it out of the list."""
        self._change(replacing(settings, None), tr("Removed {output}.", output=title_of(settings)))

    def undo(self) -> None:
        """Take the last change back."""
        if self._job is None and self._made:
            before, after = self._made[-1]
            self._change(restoring(before, after), tr("Taken back."), undoing=True)

    def _change(self, edit: Edit, said: str, *, undoing: bool = False) -> None:
        if self._job is not None:
            return

        def work() -> tuple[tuple[OutputSettings, ...], Rig]:
            with contextlib.closing(self._connect()) as client:
                return change_outputs(client.command, edit)

        def done(result: tuple[tuple[OutputSettings, ...], Rig]) -> None:
            before, rig = result
            if undoing:
                self._made.pop()
            else:
                self._made.append((before, rig.outputs))
            self._job, self._outputs = None, rig.outputs
            self.sentence.setText(f"{said} {keeping(self._opened.rig_path, simulated=self._opened.simulated)}")
            self._end_changing()
            self._show_outputs()
            self.rig_used.emit(rig)

        self.sentence.setText(tr("The engine changes over …"))
        self._job = Job(lambda progress: work(), done, self._failed, None, self).start()
        self.undo_button.setEnabled(False)

    def _failed(self, sentence: str) -> None:
        self._job = None
        self.sentence.setText(_capital(sentence))
        self._show_outputs()

    # -- the form --------------------------------------------------------------------------------------------------

    def begin_changing(self, settings: OutputSettings) -> None:
        """Put an output into the form."""
        self._changing = settings
        self.form_title.setText(tr("Change {output}", output=title_of(settings)))
        if self.kind_box.findData(settings.kind) < 0:  # a plug-in that is not installed here
            self.kind_box.addItem(tr(kind_of(settings.kind).title), settings.kind)
        self.kind_box.setCurrentIndex(self.kind_box.findData(settings.kind))
        self.target_edit.setText(settings.target)
        self.joints_box.setCurrentIndex(self.joints_box.findData(settings.joints))
        self.rate_box.setValue(settings.rate_hz or 0.0)
        self.add_button.setText(tr("Change"))
        self.cancel_button.show()
        self.target_edit.setFocus()
        self.target_edit.selectAll()

    def _end_changing(self) -> None:
        self._changing = None
        self.form_title.setText(tr("Add a stream"))
        self.add_button.setText(tr("Add"))
        self.add_button.setToolTip(tr("It opens at once; tracking goes on."))
        self.cancel_button.hide()
        self._show_kind()

    def _show_kind(self) -> None:
        """What the kind means; a target that nobody typed becomes the new kind's."""
        kind = kind_of(self.kind_box.currentData())
        if self.target_edit.text() in ("", *(one.suggestion for one in KINDS.values())):
            self.target_edit.setText(kind.suggestion)
        self.target_edit.setPlaceholderText(tr(kind.target))
        self.target_edit.setToolTip(tr(kind.target))
        self.kind_label.setText(tr("{meaning} Target: {target}", meaning=tr(kind.meaning), target=tr(kind.target)))
        fixed = self.kind_box.currentData() in OPENXR_ONLY
        if fixed:
            self.joints_box.setCurrentIndex(self.joints_box.findData("openxr"))
        self.joints_box.setEnabled(not fixed)

    # -- showing ---------------------------------------------------------------------------------------------------

    def follow(self, opened: Opened) -> None:
        """Somebody else has changed the rig, or opened another one: what was changed here is not taken back then."""
        self._opened = opened
        if self._job is None and opened.rig.outputs != self._outputs:
            self._outputs = opened.rig.outputs
            self._made.clear()
            self.sentence.setText("")
            if self._changing not in self._outputs:
                self._end_changing()
            self._show_outputs()

    def look(self) -> None:
        """How each goes now."""
        status = self._status()
        if status is not None:
            self._rates.take(status)
        found = rows(self._outputs, status, self._rates)
        if len(found) != len(self.cards) or [row.title for row in found] != [c.title_label.text() for c in self.cards]:
            self._show_outputs()
            return
        for card, row in zip(self.cards, found, strict=True):
            card.show_row(row, self._scheme())

    def _show_outputs(self) -> None:
        """The list as it is; a card whose output only was switched stays, and the focus with it."""
        found = rows(self._outputs, self._status(), self._rates)
        kept = {_heard(card.settings): card for card in self.cards if card.settings is not None}
        settings = (*self._outputs, *(None for _ in found[len(self._outputs):]))
        gone, self.cards = self.cards, []
        for place, (one, row) in enumerate(zip(settings, found, strict=True)):
            card = kept.get(_heard(one)) if one is not None else None
            self.cards.append(self._card(one, row) if card is None else card)
            self.cards[-1].settings = one
            self.cards[-1].show_switch()
            self.cards[-1].show_row(row, self._scheme())
            self._list.insertWidget(place, self.cards[-1])
        self.empty_label.setVisible(not self.cards)
        self.undo_button.setEnabled(self._job is None and bool(self._made))
        for card in gone:
            if card not in self.cards:
                if card.isAncestorOf(self.focusWidget() or self):
                    self.undo_button.setFocus()
                self._list.removeWidget(card)
                card.hide()
                card.deleteLater()

    def _card(self, settings: OutputSettings | None, row: OutputRow) -> OutputCard:
        card = OutputCard(settings, row)

        def about(act: Callable[[OutputSettings], None]) -> None:
            if card.settings is not None:
                act(card.settings)

        card.switch.clicked.connect(lambda on: about(lambda one: self.switch(one, on)))
        card.change_button.clicked.connect(lambda: about(self.begin_changing))
        card.remove_button.clicked.connect(lambda: about(self.remove))
        for button in (card.change_button, card.remove_button, card.copy_button):
            button.setAutoDefault(False)
        remove = QShortcut(QKeySequence(Qt.Key.Key_Delete), card, context=Qt.ShortcutContext.WidgetWithChildrenShortcut)
        remove.activated.connect(lambda: about(self.remove))
        return card

    def keyPressEvent(self, event: QKeyEvent) -> None:  # noqa: N802
        """Enter presses the button in focus; Escape leaves a change first, then the dialog."""
        focus = self.focusWidget()
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter) and isinstance(focus, QPushButton):
            focus.click()
        elif event.key() == Qt.Key.Key_Escape and self._changing is not None:
            self._end_changing()
        else:
            super().keyPressEvent(event)


def _heard(settings: OutputSettings | None) -> OutputSettings | None:
    """An output whether it is on or off."""
    return None if settings is None else msgspec.structs.replace(settings, enabled=True)


def _capital(sentence: str) -> str:
    return sentence[:1].upper() + sentence[1:]

