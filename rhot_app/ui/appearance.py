"""Dark or light, names and clouds in the scene: the switches of the View menu, as they were left."""

from __future__ import annotations

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QApplication

from rhot_app.ui.actions import Actions
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.panels.advice_bar import AdviceBar
from rhot_app.ui.screen import Screen
from rhot_app.ui.settings import Settings
from rhot_app.ui.theme import apply_theme, scheme_named


class Appearance(QObject):
    """Keeps actions, parts and settings alike; `scheme_changed` after the parts have their new colours."""

    scheme_changed = Signal()

    def __init__(self, settings: Settings, actions: Actions, parts: Screen, advice: AdviceBar,
                 parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._settings = settings
        self._actions, self._parts, self._advice = actions, parts, advice
        self.scheme: Scheme = scheme_named(settings.scheme)
        actions.names.toggled.connect(self._show_names)
        actions.clouds.toggled.connect(self._show_clouds)
        actions.dark.triggered.connect(lambda: self.set_scheme("dark"))
        actions.light.triggered.connect(lambda: self.set_scheme("light"))

    def restore(self) -> None:
        """The switches as they were left."""
        a, s = self._actions, self._settings
        (a.light if s.scheme == "light" else a.dark).setChecked(True)
        a.names.setChecked(s.flag("names"))
        a.clouds.setChecked(s.flag("clouds"))
        self._parts.scene.show_names(s.flag("names"))
        self._parts.scene.show_clouds(s.flag("clouds"))

    def set_scheme(self, name: str) -> None:
        """Dark or light."""
        self._settings.scheme = name
        self.scheme = scheme_named(name)
        app = QApplication.instance()
        if isinstance(app, QApplication):
            apply_theme(app, self.scheme)
        self._parts.set_scheme(self.scheme)
        self._advice.set_scheme(self.scheme)
        self.scheme_changed.emit()

    def _show_names(self, on: bool) -> None:
        self._settings.set_flag("names", on)
        self._parts.scene.show_names(on)

    def _show_clouds(self, on: bool) -> None:
        self._settings.set_flag("clouds", on)
        self._parts.scene.show_clouds(on)
