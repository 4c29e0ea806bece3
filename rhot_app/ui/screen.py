"""Everything that shows live data, refreshed together: each part as often as it is worth and no oftener."""

from __future__ import annotations

import time
from collections.abc import Callable

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QSplitter

from rhot_app.project import Rig
from rhot_app.tracking.state import Condition, HandState
from rhot_app.ui.backend.live import SILENCE_S, Live
from rhot_app.ui.models.hands import each_hand
from rhot_app.ui.models.pacing import FramePacer
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.panels.camera_panel import CameraPanel
from rhot_app.ui.panels.hand_panel import HandPanel
from rhot_app.ui.panels.markers_panel import MarkersPanel
from rhot_app.ui.panels.nodes_panel import NodesPanel
from rhot_app.ui.plots.jitter_plot import JitterPlot
from rhot_app.ui.plots.latency_plot import LatencyPlot
from rhot_app.ui.plots.plot_panel import PlotPanel
from rhot_app.ui.plots.rate_plot import RatePlot
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
        for part in (self.scene, self.nodes, self.markers, self.cameras, self.hand):
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
            now_ns = time.monotonic_ns()
            self.jitter.refresh(live.jitter, now_ns)
            self.latency.refresh(live.latency, now_ns)
            self.rate.refresh(live.rates, now_ns)

    def _refresh_scene(self, live: Live, now_s: float) -> None:
        self.pacer.give_up(now_s)
        if live.state is not None and live.state_count != self._counted:
            self._counted = live.state_count
            self._state_seen_at = now_s
        if self._state_seen_at > 0.0 and live.state_count != self._drawn_state:
            if self.scene.isVisible() and self.pacer.due(now_s):
                self.pacer.begin(now_s)
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

    @property
    def frame_cost_s(self) -> float:
        """What one drawing of the scene costs, s."""
        return self.pacer.cost_s
