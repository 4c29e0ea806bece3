"""Dark or light, names, uncertainty and prediction in the scene: the switches of the View menu, as they were left."""

from __future__ import annotations

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QApplication

from rhot_app.project import Rig
from rhot_app.state import HandState
from rhot_app.tracking.extrapolation import Extrapolator
from rhot_app.ui.actions import CLOUD_KINDS, Actions
from rhot_app.ui.common.controller import Controller
from rhot_app.ui.common.settings import Settings
from rhot_app.ui.common.theme import apply_theme, scheme_named
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.panels.advice_bar import AdviceBar
from rhot_app.ui.scene.ellipsoid_mesh import LARGER, EllipsoidChoice
from rhot_app.ui.screen import Screen

# -- The hand at display time ------------------------------------------------------------------------------------------

_FRESH_NS = 500_000_000
"""A state that is older is of a recording, or of a hand that is gone: nothing is predicted of it."""


class DisplayPrediction:
    """Predicts the newest state while `wanted`, where the rig's tracker estimates velocities."""

    def __init__(self, controller: Controller) -> None:
        self.wanted = True
        self._controller = controller
        self._rig: Rig | None = None
        self._extrapolator: Extrapolator | None = None

    def shown(self, newest: HandState | None, ahead_s: float) -> HandState | None:
        """What to draw of the `newest` state when it will be seen `ahead_s` from now: the hand predicted to then, else
        that state."""
        now_ns, rig = round(1e9 * self._controller.clock()), self._controller.rig
        if (not self.wanted or newest is None or rig is None or rig.tracker.kind == "classic"
                or abs(now_ns - newest.t_master_ns) > _FRESH_NS):
            return newest
        if self._extrapolator is None or rig is not self._rig:
            self._rig, self._extrapolator = rig, Extrapolator(rig)
        return self._extrapolator.at(newest, now_ns + round(1e9 * ahead_s)) or newest


# -- Switches of the View menu -----------------------------------------------------------------------------------------

_LARGER = "clouds larger"
_CLOUD_FLAGS = {"clouds": True, **{f"clouds of {kind}": True for kind, _, _ in CLOUD_KINDS}, _LARGER: False}
"""The switches of the ellipsoids by their names in the settings, with what they are at first."""


class Appearance(QObject):
    """Keeps actions, parts and settings alike; `scheme_changed` after the parts have their new colours."""

    scheme_changed = Signal()

    def __init__(self, settings: Settings, actions: Actions, parts: Screen, advice: AdviceBar,
                 prediction: DisplayPrediction, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._prediction = prediction
        self._settings = settings
        self._actions, self._parts, self._advice = actions, parts, advice
        self.scheme: Scheme = scheme_named(settings.scheme)
        actions.names.toggled.connect(self._show_names)
        actions.video.toggled.connect(self._choose_video)
        actions.now.toggled.connect(self._show_now)
        for action in (actions.clouds, *actions.cloud_kinds, actions.cloud_sizes[-1]):
            action.toggled.connect(self._choose_ellipsoids)
        actions.dark.triggered.connect(lambda: self.set_scheme("dark"))
        actions.light.triggered.connect(lambda: self.set_scheme("light"))

    def restore(self) -> None:
        """The switches as they were left."""
        a, s = self._actions, self._settings
        (a.light if s.scheme == "light" else a.dark).setChecked(True)
        a.names.setChecked(s.flag("names"))
        self._parts.scene.show_names(s.flag("names"))
        a.video.setChecked(s.video)
        a.now.setChecked(s.flag("now"))
        self._prediction.wanted = s.flag("now")
        wanted = {name: s.flag(name, default) for name, default in _CLOUD_FLAGS.items()}
        for action, name in zip((a.clouds, *a.cloud_kinds), _CLOUD_FLAGS, strict=False):
            action.setChecked(wanted[name])
        a.cloud_sizes[wanted[_LARGER]].setChecked(True)
        self._choose_ellipsoids()

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

    def _show_now(self, on: bool) -> None:
        self._settings.set_flag("now", on)
        self._prediction.wanted = on

    def _choose_video(self, on: bool) -> None:
        self._settings.video = on

    def _choose_ellipsoids(self) -> None:
        a = self._actions
        shown = [action.isChecked() for action in (a.clouds, *a.cloud_kinds, a.cloud_sizes[-1])]
        for name, on in zip(_CLOUD_FLAGS, shown, strict=True):
            self._settings.set_flag(name, on)
        on, joints, fingertips, markers, larger = shown
        for action in (*a.cloud_kinds, *a.cloud_sizes):
            action.setEnabled(on)
        choice = EllipsoidChoice(joints, fingertips, markers, LARGER if larger else 1)
        self._parts.scene.show_ellipsoids(choice if on else None)
