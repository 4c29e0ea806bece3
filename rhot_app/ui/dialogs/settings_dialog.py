"""What the app remembers, to be changed: look, language, folders, start, recording, keys. Every change holds at once,
but the language from the next start on."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QDialog,
    QFileDialog,
    QFormLayout,
    QHBoxLayout,
    QHeaderView,
    QKeySequenceEdit,
    QLabel,
    QTabWidget,
    QVBoxLayout,
    QWidget,
)

from rhot_app.ui.common.keys import ActionKeys, title_of
from rhot_app.ui.common.parts import plain_button
from rhot_app.ui.common.record_table import Column, RecordTable
from rhot_app.ui.common.sentence import Sentence
from rhot_app.ui.common.settings import STARTS, Settings
from rhot_app.ui.dialogs.next_steps import NEXT_STEPS
from rhot_app.ui.language import LANGUAGES, language, language_of, tr, tr_noop

_SIZE: Final = (720, 520)
_KEY_PX: Final = 170
_ROW_PX: Final = 30
_BESIDE: Final = tr_noop("beside the recording")


class SettingsDialog(QDialog):
    """`actions` are those of the main window: its switches change with the page."""

    def __init__(self, settings: Settings, actions: ActionKeys, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle(tr("Settings"))
        self.setProperty("guide", "settings")
        self.resize(*_SIZE)
        self._settings = settings
        self.tabs = QTabWidget()
        self.general = GeneralPage(settings, actions)
        self.keys = KeysPage(actions)
        self.tabs.addTab(self.general, tr("General"))
        self.tabs.addTab(self.keys, tr("Keys"))
        self.reset_button = plain_button(tr("Reset all"), tr("Forget layout, last rig, switches, folders and keys."))
        self.reset_button.clicked.connect(actions.named("reset").trigger)
        self.reset_button.clicked.connect(self.refresh)
        self.close_button = plain_button(tr("Close"), tr("Every change holds already."))
        self.close_button.clicked.connect(self.close)
        self.file_label = where = QLabel(str(settings.path))
        where.setToolTip(tr("The file in which the app remembers all this."))
        where.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        where.setWordWrap(True)
        where.setProperty("muted", True)
        buttons = QHBoxLayout()
        buttons.addWidget(self.reset_button)
        buttons.addWidget(where, 1)
        buttons.addWidget(self.close_button)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(16, 16, 16, 16)
        layout.setSpacing(16)
        layout.addWidget(self.tabs, 1)
        layout.addLayout(buttons)
        self.addAction(actions.named("guide"))

    def refresh(self) -> None:
        """Show what the settings say now."""
        self.general.refresh()
        self.keys.refresh()

    def done(self, result: int) -> None:
        """Written to disk when the page is closed, too, should the app not end well."""
        self._settings.sync()
        super().done(result)


class GeneralPage(QWidget):
    """Look, start, folders, recording."""

    def __init__(self, settings: Settings, actions: ActionKeys, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._settings = settings
        self.look_box, self.language_box, self.start_box = QComboBox(), QComboBox(), QComboBox()
        self.look_box.setToolTip(tr("Light text on dark ground, or the other way round. The View menu has it, too."))
        self._looks = (actions.named("dark"), actions.named("light"))
        for look in self._looks:
            self.look_box.addItem(title_of(look))
            look.toggled.connect(self._show_look)
        self.look_box.currentIndexChanged.connect(self._choose_look)
        self.language_box.setToolTip(tr("The language of the windows, from the next start on."))
        for code, name in (("system", tr("As the desktop")), *LANGUAGES.items()):
            self.language_box.addItem(name, code)
        self.language_box.currentIndexChanged.connect(self._choose_language)
        self.language_note = QLabel(tr("From the next start on."))
        self.language_note.hide()
        speaks = QHBoxLayout()
        speaks.addWidget(self.language_box, 1)
        speaks.addWidget(self.language_note)
        self.start_box.setToolTip(tr("What the app opens when it starts without a rig. An engine that runs already "
                                     "comes first."))
        for name, words in STARTS:
            self.start_box.addItem(tr(words), name)
        self.start_box.currentIndexChanged.connect(self._choose_start)
        self.steps_check = QCheckBox(tr("Show what to do next when cameras of this computer are opened"))
        self.steps_check.toggled.connect(lambda on: settings.set_flag(NEXT_STEPS, on))
        settings.flag_changed.connect(self._show_steps)
        self.video_check = _switch(actions.named("video"))
        self.recordings = FolderRow(tr("Where recordings are made and listed."))
        self.exports = FolderRow(tr("Where exported files are offered to be written."))
        self.recordings.chosen.connect(lambda path: self._choose_folder("recordings", path))
        self.exports.chosen.connect(lambda path: self._choose_folder("exports", path))
        form = QFormLayout(self)
        form.setContentsMargins(16, 16, 16, 16)
        form.setSpacing(12)
        form.addRow(tr("Look"), self.look_box)
        form.addRow(tr("Language"), speaks)
        form.addRow(tr("At the start, open"), self.start_box)
        form.addRow("", self.steps_check)
        form.addRow(tr("Recordings"), self.recordings)
        form.addRow("", self.video_check)
        form.addRow(tr("Exported files"), self.exports)
        self.refresh()

    def refresh(self) -> None:
        """Show what the settings say now."""
        self._show_look()
        self._show_steps()
        self.language_box.setCurrentIndex(max(self.language_box.findData(self._settings.language), 0))
        self.start_box.setCurrentIndex(self.start_box.findData(self._settings.start))
        exports = self._settings.exports_folder
        self.recordings.show_folder(str(self._settings.recordings_folder))
        self.exports.show_folder(tr(_BESIDE) if exports is None else str(exports))

    def _show_look(self, on: bool = True) -> None:
        if on:
            self.look_box.setCurrentIndex(next((k for k, look in enumerate(self._looks) if look.isChecked()), 0))

    def _choose_look(self, number: int) -> None:
        if not self._looks[number].isChecked():
            self._looks[number].trigger()

    def _choose_language(self) -> None:
        self._settings.language = self.language_box.currentData()
        self.language_note.setVisible(language_of(self._settings.language) != language())

    def _choose_start(self) -> None:
        self._settings.start = self.start_box.currentData()

    def _show_steps(self, flag: str = NEXT_STEPS) -> None:
        if flag == NEXT_STEPS:
            self.steps_check.setChecked(self._settings.flag(NEXT_STEPS))

    def _choose_folder(self, name: str, path: Path | None) -> None:
        self._settings.choose_folder(name, path)
        self.refresh()


class FolderRow(QWidget):
    """A folder, with buttons for another one and for the first one; `chosen` gives its path, None for the first."""

    chosen = Signal(object)

    def __init__(self, meaning: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._meaning = meaning
        self.label = QLabel()
        self.label.setWordWrap(True)
        self.choose_button = plain_button(tr("Choose …"), tr("Another folder."))
        self.own_button = plain_button(tr("As at first"), tr("The folder that it was on the first start."))
        self.choose_button.clicked.connect(self._choose)
        self.own_button.clicked.connect(lambda: self.chosen.emit(None))
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self.label, 1)
        layout.addWidget(self.choose_button)
        layout.addWidget(self.own_button)

    def show_folder(self, text: str) -> None:
        """The folder, or words for it."""
        self.label.setText(text)
        self.label.setToolTip(f"{self._meaning} {text}")

    def _choose(self) -> None:
        start = self.label.text() if Path(self.label.text()).is_dir() else str(Path.home())
        name = QFileDialog.getExistingDirectory(self, self._meaning.removesuffix("."), start)
        if name:
            self.chosen.emit(Path(name))


class KeysPage(QWidget):
    """All actions with their keys; below, another key for the one that is selected."""

    def __init__(self, keys: ActionKeys, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._keys = keys
        self.table: RecordTable[QAction] = RecordTable((
            Column(tr("Action"), title_of, roles=lambda action: {Qt.ItemDataRole.ToolTipRole: action.toolTip()}),
            Column(tr("Key"), lambda action: action.shortcut().toString(QKeySequence.SequenceFormat.NativeText))))
        self.table.setShowGrid(False)
        self.table.setAccessibleName(tr("Keys of all actions"))
        self.table.verticalHeader().setDefaultSectionSize(_ROW_PX)
        self.table.horizontalHeader().setSectionResizeMode(0, QHeaderView.ResizeMode.Stretch)
        self.table.setColumnWidth(1, _KEY_PX)
        self.edit = QKeySequenceEdit()
        self.edit.setMaximumSequenceLength(1)
        self.edit.setClearButtonEnabled(True)
        self.edit.setToolTip(tr("Press the new key here; the cross takes the key away."))
        self.edit.setAccessibleName(tr("Key"))
        self.own_button = plain_button(tr("As at first"), tr("The key that the action had on the first start."))
        self.sentence = Sentence(2)
        self.table.chosen_changed.connect(self._show_chosen)
        self.edit.editingFinished.connect(self._choose)
        self.own_button.clicked.connect(self._choose_own)
        below = QHBoxLayout()
        below.addWidget(QLabel(tr("Key of the selected action")))
        below.addWidget(self.edit, 1)
        below.addWidget(self.own_button)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(16, 16, 16, 16)
        layout.setSpacing(12)
        layout.addWidget(self.table, 1)
        layout.addLayout(below)
        layout.addWidget(self.sentence)
        self.table.show_records(keys.actions)
        self.table.selectRow(0)

    def refresh(self) -> None:
        """Show the keys as they are now."""
        self.table.records_model.refresh()
        self._show_chosen()

    def _show_chosen(self) -> None:
        action = self.table.chosen
        self.edit.setEnabled(action is not None)
        self.own_button.setEnabled(action is not None and not self._keys.is_own(action))
        if action is not None:
            self.edit.setKeySequence(action.shortcut())
            self.sentence.setText(tr("Space starts and stops always. Windows beside the main one have keys of their "
                                     "own; the guide lists them."))

    def _choose(self) -> None:
        action = self.table.chosen
        if action is not None and self.edit.keySequence() != action.shortcut():
            self._show(self._keys.choose(action, self.edit.keySequence()))

    def _choose_own(self) -> None:
        action = self.table.chosen
        if action is not None:
            self._show(self._keys.choose_own(action))

    def _show(self, problem: str) -> None:
        self.refresh()
        if problem:
            self.sentence.setText(problem)


def _switch(action: QAction) -> QCheckBox:
    """A box that is a menu's switch."""
    box = QCheckBox(title_of(action))
    box.setToolTip(action.toolTip())
    box.setChecked(action.isChecked())
    box.toggled.connect(action.setChecked)
    action.toggled.connect(box.setChecked)
    return box
