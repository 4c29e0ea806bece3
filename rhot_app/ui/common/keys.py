"""Keys of windows: the space bar for what people do while they look elsewhere, and keys that a person can change."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Final

from PySide6.QtCore import Qt
from PySide6.QtGui import QAction, QKeySequence, QShortcut
from PySide6.QtWidgets import QAbstractButton, QApplication, QComboBox, QPushButton, QToolButton, QWidget

from rhot_app.ui.common.menu import without_letter
from rhot_app.ui.common.settings import Settings
from rhot_app.ui.language import tr, tr_noop

_FIXED: Final = {"Space": tr_noop("Start and Stop"), "Alt+Down": tr_noop("opening menus"),
                 "Alt+M": tr_noop("the list of sentences")}
"""Keys that no action can have, and what they serve."""

_ALWAYS: Final = {"start": "Space"}
"""By an action's object name: a key that it has beside the one that can be changed."""


class ActionKeys:
    """The keys of a window's actions, which are known by their object names: those that they were made with, or those
    that the person chose. An action's tooltip ends with its key."""

    def __init__(self, actions: Iterable[QAction], settings: Settings, menus: Iterable[QAction] = ()) -> None:
        """`menus` of the menu bar, whose letters no action can have as its key."""
        self._settings = settings
        self._letters = {letter: tr("the menu {menu}", menu=title_of(menu)) for menu in menus
                         if (letter := QKeySequence.mnemonic(menu.text()).toString())}
        self.actions = list(actions)
        self._own = {action.objectName(): action.shortcut() for action in self.actions}
        self._meanings = {action.objectName(): action.toolTip() for action in self.actions}
        self.restore()

    def named(self, name: str) -> QAction:
        """The action of that object name."""
        return next(action for action in self.actions if action.objectName() == name)

    def restore(self) -> None:
        """The keys as the settings have them, but those that are a menu's letter in this language."""
        for action in self.actions:
            chosen = self._settings.key(action.objectName())
            key = self._own[action.objectName()] if chosen is None else QKeySequence(chosen)
            self._set(action, self._own[action.objectName()] if chosen and self._reserved(key) else key)

    def is_own(self, action: QAction) -> bool:
        """Whether the action has the key that it was made with."""
        return action.shortcut() == self._own[action.objectName()]

    def choose(self, action: QAction, key: QKeySequence) -> str:
        """Give an action another key, or none. The sentence that says why it cannot have it, else ""."""
        text = key.toString()
        holder = self._reserved(key) or next(
            (title_of(one) for one in self.actions if one is not action and text and one.shortcut() == key), "")
        if holder:
            return tr("{text} is the key of {holder}. Choose another, or take it from there first.",
                      text=_shown(key), holder=holder)
        own = key == self._own[action.objectName()]
        self._settings.set_key(action.objectName(), None if own else text)
        self._set(action, key)
        return ""

    def _reserved(self, key: QKeySequence) -> str:
        """What a key serves that no action can have, else ""."""
        text = key.toString()
        return tr(_FIXED.get(text, "")) or self._letters.get(text, "")

    def choose_own(self, action: QAction) -> str:
        """Give an action the key that it was made with; what `choose` says."""
        return self.choose(action, self._own[action.objectName()])

    def forget(self) -> None:
        """All keys as they were made."""
        for action in self.actions:
            self._settings.set_key(action.objectName(), None)
        self.restore()

    def _set(self, action: QAction, key: QKeySequence) -> None:
        action.setShortcut(key)
        meaning, always = self._meanings[action.objectName()], QKeySequence(_ALWAYS.get(action.objectName(), ""))
        keys = ", ".join(filter(None, (_shown(always), _shown(key))))
        action.setToolTip(f"{meaning.removesuffix('.')} ({keys})." if keys else meaning)


def _shown(key: QKeySequence) -> str:
    """A key as the keyboards of the language have it."""
    return key.toString(QKeySequence.SequenceFormat.NativeText)


def title_of(action: QAction) -> str:
    """What an action is called, without its letter, the sign of its dialog and what a menu says behind a tab."""
    return without_letter(action.text()).partition("\t")[0].removesuffix(" …")


def bind_space(window: QWidget, action: Callable[[], object]) -> None:
    """Space calls `action`, or presses the button that the Tab key has reached; it never opens a menu or a list.

    Alt+Down does that. A mouse that presses a button or chooses from a list leaves the focus, so that Space does not
    press it again.
    """
    for part in (*window.findChildren(QAbstractButton), *window.findChildren(QComboBox)):
        if part.focusPolicy() & Qt.FocusPolicy.ClickFocus:
            part.setFocusPolicy(Qt.FocusPolicy.TabFocus)
    QShortcut(QKeySequence(Qt.Key.Key_Space), window).activated.connect(lambda: _press_or(action))
    QShortcut(QKeySequence("Alt+Down"), window).activated.connect(_open_list)


def _press_or(action: Callable[[], object]) -> None:
    focus = QApplication.focusWidget()
    if isinstance(focus, QAbstractButton) and not _has_menu(focus):
        focus.click()
    else:
        action()


def _open_list() -> None:
    focus = QApplication.focusWidget()
    if isinstance(focus, QComboBox):
        focus.showPopup()
    elif isinstance(focus, QPushButton | QToolButton) and _has_menu(focus):
        focus.showMenu()


def _has_menu(button: QAbstractButton) -> bool:
    if isinstance(button, QToolButton) and button.defaultAction() is not None:
        return button.menu() is not None or button.defaultAction().menu() is not None
    return isinstance(button, QPushButton | QToolButton) and button.menu() is not None
