"""Everything that shows live data, refreshed together: each part as often as it is worth and no oftener."""

from __future__ import annotations

import time
from collections.abc import Callable

from PySide6.QtCore import QByteArray, Qt, QTimer
from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import QDockWidget, QMainWindow, QSplitter, QVBoxLayout, QWidget

from rhot_app.project import Rig
from rhot_app.state import Condition, HandState
from rhot_app.ui.backend.live import SILENCE_S, Live
from rhot_app.ui.common.parts import scrolled
from rhot_app.ui.language import tr
from rhot_app.ui.models.pacing import FramePacer
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.models.words import each_hand
from rhot_app.ui.panels.camera_panel import CameraPanel
from rhot_app.ui.panels.hand_panel import HandPanel
from rhot_app.ui.panels.markers_panel import MarkersPanel
from rhot_app.ui.panels.nodes_panel import NodesPanel
from rhot_app.ui.panels.objects_panel import ObjectsPanel
from rhot_app.ui.plots.live_plots import JitterPlot, LatencyPlot, RatePlot
from rhot_app.ui.plots.plot_panel import PlotPanel
from rhot_app.ui.scene.view import SceneView

PANEL_S = 0.1
PLOT_S = 0.25
STALE_S = 1.0
"""A hand that has not moved on for this long is no longer shown: a still picture would pass for a still hand."""


class Screen:
    """Scene, panels and plots. `refresh` is called every tick and draws what is due.

    `shown`: what the scene is to draw of the newest state, so long from now, s, as drawing takes.
    """

    def __init__(self, scheme: Scheme) -> None:
        self.scene = SceneView(scheme)
        self.scene.setProperty("guide", "scene")
        self.nodes = NodesPanel(scheme)
        self.markers = MarkersPanel(scheme)
        self.cameras = CameraPanel(scheme)
        self.hand = HandPanel(scheme)
        self.objects = ObjectsPanel(scheme)
        self.hand_and_objects = QWidget()
        beneath = QVBoxLayout(self.hand_and_objects)
        beneath.setContentsMargins(0, 0, 0, 0)
        beneath.setSpacing(0)
        beneath.addWidget(self.hand, 1)
        beneath.addWidget(self.objects)
        self.jitter = JitterPlot(scheme)
        self.latency = LatencyPlot(scheme)
        self.rate = RatePlot(scheme)
        self.plots = QSplitter(Qt.Orientation.Horizontal)
        self.plots.setProperty("guide", "plots")
        self.all_plots: tuple[PlotPanel, ...] = (self.jitter, self.latency, self.rate)
        for plot in self.all_plots:
            self.plots.addWidget(plot)
        self.plots.setSizes([100, 122, 94])
        self.plots.setChildrenCollapsible(False)
        self.pacer = FramePacer()
        self.scene.frameSwapped.connect(lambda: self.pacer.end(time.monotonic()))
        self.shown: Callable[[HandState | None, float], HandState | None] = lambda newest, ahead_s: newest
        self._drawn_state = self._drawn_preview = -1
        self._next_panels = self._next_plots = 0.0
        self._state_seen_at = 0.0
        self._counted = 0
        self._framed_session = -1

    def set_scheme(self, scheme: Scheme) -> None:
        """Change colours everywhere."""
        for part in (self.scene, self.nodes, self.markers, self.cameras, self.hand, self.objects):
            part.set_scheme(scheme)
        for plot in self.all_plots:
            plot.set_scheme(scheme)
        self._drawn_preview = -1

    def show_rig(self, rig: Rig | None) -> None:
        """Another rig, or none."""
        self.scene.show_rig(rig)
        self.markers.show_rig(rig)
        self.cameras.show_rig(rig)
        self.jitter.show_rig(rig)
        for plot in self.all_plots:
            plot.begin_anew()
        self.nodes.show_status(None)
        self.hand.show_rig(rig)
        self.objects.show_rig(rig)
        self._drawn_state = self._drawn_preview = self._framed_session = -1
        self._state_seen_at = 0.0

    def refresh(self, live: Live, now_s: float) -> None:
        """Draw what is due: the scene as often as it can, pictures when they come, panels and plots a few times a
        second."""
        self._refresh_scene(live, now_s)
        if self.cameras.isVisible() and (live.preview_count != self._drawn_preview or now_s >= self._next_panels):
            self._drawn_preview = live.preview_count
            self.cameras.refresh(live)
        if now_s >= self._next_panels:
            self._next_panels = now_s + PANEL_S
            self._refresh_panels(live)
        if now_s >= self._next_plots and self.plots.isVisible():
            self._next_plots = now_s + PLOT_S
            now_ns = round(1e9 * now_s)
            self.jitter.refresh(live.jitter, now_ns)
            self.latency.refresh(live.latency, now_ns)
            self.rate.refresh(live.rates, now_ns)

    def _refresh_scene(self, live: Live, now_s: float) -> None:
        drawing_s = time.monotonic()
        self.pacer.give_up(drawing_s)
        if live.state is not None and live.state_count != self._counted:
            self._counted = live.state_count
            self._state_seen_at = now_s
        if self._state_seen_at > 0.0 and live.state_count != self._drawn_state:
            if self.scene.isVisible() and self.pacer.due(drawing_s):
                self.pacer.begin(drawing_s)
                self._drawn_state = live.state_count
                self.scene.show_state(self.shown(live.state, self.pacer.cost_s))
                self._frame_once(live)
        elif self._state_seen_at > 0.0 and now_s - self._state_seen_at > STALE_S:
            self.scene.show_state(None)
            self._state_seen_at = 0.0

    def _frame_once(self, live: Live) -> None:
        """Go near the hands the first time that all of them are tracked after a start."""
        session = live.status.session if live.status is not None else 0
        hands = each_hand(live.state)
        if session != self._framed_session and hands and all(hand.condition is Condition.TRACKING for hand in hands):
            self._framed_session = session
            self.scene.frame_first()

    def _refresh_panels(self, live: Live) -> None:
        fresh = live.state if self._state_seen_at > 0.0 else None
        if self.nodes.isVisible():
            self.nodes.show_status(live.status if live.silent_for_s() < SILENCE_S else None)
        if self.markers.isVisible():
            running = live.status is not None and live.status.running and live.silent_for_s() < SILENCE_S
            self.markers.show_state(fresh, running=running)
        if self.hand.isVisible():
            self.hand.show_state(fresh)
        if self.objects.isVisible():
            self.objects.show_state(fresh)

    @property
    def frame_cost_s(self) -> float:
        """What one drawing of the scene costs, s."""
        return self.pacer.cost_s


# -- The panels around the scene as docks ------------------------------------------------------------------------------

_AREAS = {"left": Qt.DockWidgetArea.LeftDockWidgetArea, "right": Qt.DockWidgetArea.RightDockWidgetArea,
          "bottom": Qt.DockWidgetArea.BottomDockWidgetArea}
LEFT_PX, RIGHT_PX, BOTTOM_PX = 264, 440, 220
_SHARES = {"left": (216, 260), "right": (240, 230), "bottom": (1,)}


class Docks:
    """Keys 1, 2, 3 … show and hide the panels in the order in which they were added.

    `put_away` hides all of them for a reason ("no rig", "scene alone"); they return when the last reason is gone.
    """

    def __init__(self, window: QMainWindow) -> None:
        self._window = window
        self.docks: list[QDockWidget] = []
        self._areas: list[str] = []
        self._reasons: set[str] = set()
        self._kept: QByteArray | None = None
        self._arranged = False

    def add(self, name: str, widget: QWidget, area: str, *, scroll: bool = False, title: bool = True) -> QDockWidget:
        """Put `widget` into a dock; without a title it can only be moved from the View menu."""
        dock = QDockWidget(tr(name), self._window)
        dock.setObjectName(f"dock {name}")
        dock.setWidget(scrolled(widget) if scroll else widget)
        if not title:
            dock.setTitleBarWidget(QWidget())
        self.docks.append(dock)
        self._areas.append(area)
        key = str(len(self.docks))
        action = dock.toggleViewAction()
        action.setShortcut(QKeySequence(key))
        action.setObjectName(f"panel {name}")
        action.setToolTip(tr("Show or hide the panel."))
        self._window.addDockWidget(_AREAS[area], dock)
        return dock

    @property
    def actions(self) -> list[QAction]:
        """The switches of the panels, in order."""
        return [dock.toggleViewAction() for dock in self.docks]

    def arrange(self) -> None:
        """The standard layout; its sizes are taken once the window is laid out, by `set_sizes`."""
        for dock, area in zip(self.docks, self._areas, strict=True):
            dock.setFloating(False)
            self._window.removeDockWidget(dock)
            self._window.addDockWidget(_AREAS[area], dock)
            dock.setVisible(not self._reasons)
        self._kept = None
        self._arranged = not self._reasons
        if self._arranged:
            self.set_sizes()

    def restore(self, state: QByteArray) -> bool:
        """A layout that `state` gave before; False when it is not one of this window."""
        if not self._window.restoreState(state):
            return False
        self._arranged = True
        self._kept = state
        return True

    def state(self) -> QByteArray:
        """The layout, to be remembered: as it is, or as it will be when the panels come back."""
        return self._kept if self._reasons and self._kept is not None else self._window.saveState()

    def set_sizes(self) -> None:
        """The standard sizes; only docks that are shown take them."""
        by_area = {area: [d for d, a in zip(self.docks, self._areas, strict=True) if a == area] for area in _AREAS}
        self._window.resizeDocks([by_area["left"][0], by_area["right"][0]], [LEFT_PX, RIGHT_PX],
                                 Qt.Orientation.Horizontal)
        self._window.resizeDocks(by_area["bottom"], [BOTTOM_PX], Qt.Orientation.Vertical)
        for area in ("left", "right"):
            self._window.resizeDocks(by_area[area], list(_SHARES[area]), Qt.Orientation.Vertical)

    def put_away(self, reason: str, away: bool) -> None:
        """Hide all panels while there is any reason to, then bring back those that were shown, where they stood."""
        before = bool(self._reasons)
        (self._reasons.add if away else self._reasons.discard)(reason)
        if self._reasons and not before:
            if self._arranged and self._kept is None:
                self._kept = self._window.saveState()
            for dock in self.docks:
                dock.hide()
        elif before and not self._reasons:
            self._bring_back()
        for action in self.actions:
            action.setEnabled(not self._reasons)

    def _bring_back(self) -> None:
        if self._kept is not None:
            self._window.restoreState(self._kept)
            self._kept = None
            return
        for dock in self.docks:
            dock.show()
        self._arranged = True
        QTimer.singleShot(0, self.set_sizes)
