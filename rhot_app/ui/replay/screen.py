"""What a recording looks like at one moment: scene, panels, plots and timeline, each drawn as often as it is worth."""

from __future__ import annotations

import time

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QSplitter, QVBoxLayout, QWidget

from rhot_app.tracking.state import Condition, HandState
from rhot_app.ui.models.pacing import FramePacer
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.panels.hand_panel import HandPanel
from rhot_app.ui.panels.markers_panel import MarkersPanel
from rhot_app.ui.plots.jitter_plot import JitterPlot
from rhot_app.ui.plots.plot_panel import PlotPanel
from rhot_app.ui.replay.difference_plot import DifferencePlot
from rhot_app.ui.replay.session import Replay
from rhot_app.ui.replay.timeline import Timeline
from rhot_app.ui.replay.transport import Transport
from rhot_app.ui.scene.view import SceneView
from rhot_app.ui.settings import Settings

PANEL_S = 0.1
PLOT_S = 0.25
_SIDE_PX, _PLOTS_PX = 440, 180
_SIZE = (1280, 800)


class ReplayScreen(QWidget):
    """`show_run` whenever runs change, `refresh` at every tick."""

    def __init__(self, settings: Settings, scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.scene = SceneView(scheme)
        self.scene.show_names(settings.flag("names"))
        if not settings.flag("clouds"):
            self.scene.show_ellipsoids(None)
        self.markers, self.hand = MarkersPanel(scheme), HandPanel(scheme)
        self.jitter, self.difference = JitterPlot(scheme), DifferencePlot(scheme)
        self.plots: tuple[PlotPanel, ...] = (self.jitter, self.difference)
        for plot in self.plots:
            plot.head.leave_out(plot.reset_button)  # a recording's past is not forgotten
        self.timeline, self.transport = Timeline(scheme), Transport(scheme)
        self.pacer = FramePacer()
        self._shown: tuple[int | None, float] | None = None
        self._framed = False
        self._stale_scene = self._stale_panels = self._stale_plots = False
        self._next_panels = self._next_plots = 0.0
        self.state: HandState | None = None
        self._lay_out()
        self.scene.frameSwapped.connect(lambda: self.pacer.end(time.monotonic()))

    def _lay_out(self) -> None:
        side, middle = QSplitter(Qt.Orientation.Vertical), QSplitter(Qt.Orientation.Horizontal)
        plots, whole = QSplitter(Qt.Orientation.Horizontal), QSplitter(Qt.Orientation.Vertical)
        for splitter, parts in ((side, (self.hand, self.markers)), (middle, (self.scene, side)), (plots, self.plots),
                                (whole, (middle, plots))):
            for part in parts:
                splitter.addWidget(part)
            splitter.setChildrenCollapsible(False)
        middle.setSizes([_SIZE[0] - _SIDE_PX, _SIDE_PX])
        whole.setSizes([_SIZE[1] - _PLOTS_PX, _PLOTS_PX])
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(4)
        layout.addWidget(whole, 1)
        layout.addWidget(self.timeline)
        layout.addWidget(self.transport)

    def set_scheme(self, scheme: Scheme) -> None:
        """Change colours."""
        for part in (self.scene, self.markers, self.hand, self.timeline, self.transport):
            part.set_scheme(scheme)
        for plot in self.plots:
            plot.set_scheme(scheme)
        self.look_again()

    def show_recording(self) -> None:
        """Another recording will be shown: the view is as at first, and goes near the hand once it is tracked."""
        self.transport.speed_box.setCurrentIndex(self.transport.speed_box.findData(1.0))
        self.scene.reset_view()
        self._framed = False

    def show_run(self, replay: Replay | None) -> None:
        """Other runs; None for no recording."""
        rig = replay.run.rig if replay is not None else None
        for part in (self.scene, self.markers, self.hand, self.jitter):
            part.show_rig(rig)
        self.scene.show_second_rig(replay.second.rig if replay is not None and replay.second is not None else None)
        comparison = replay.comparison if replay is not None else None
        if comparison is not None:
            self.difference.show_comparison(comparison)
        self.difference.setVisible(comparison is not None)
        self.timeline.show_replay(replay)
        self.transport.setEnabled(replay is not None)
        self.look_again()

    def look_again(self) -> None:
        """Draw everything at the next tick, even if nothing has moved."""
        self._shown = None

    def refresh(self, replay: Replay, now_s: float) -> bool:
        """Draw what is due; whether another moment is shown than before."""
        player = replay.player
        shown = (player.shown, player.position_s)
        moved = shown != self._shown or self.transport.is_playing != player.playing
        if moved:
            self._shown = shown
            self._stale_scene = self._stale_panels = self._stale_plots = True
            self.timeline.update()
            self.transport.show_replay(replay)
        self._refresh_scene(replay, now_s)
        if self._stale_panels and now_s >= self._next_panels:
            self._stale_panels, self._next_panels = False, now_s + PANEL_S
            self.state, _ = replay.shown()
            self.markers.show_state(self.state, running=True)
            self.hand.show_state(self.state)
        if self._stale_plots and now_s >= self._next_plots:
            self._stale_plots, self._next_plots = False, now_s + PLOT_S
            self.jitter.refresh(replay.jitter, replay.position_ns)
            if replay.differences is not None:
                self.difference.refresh(replay.differences, replay.position_ns)
        return moved

    def _refresh_scene(self, replay: Replay, now_s: float) -> None:
        self.pacer.give_up(now_s)
        if not self._stale_scene or not self.pacer.due(now_s):
            return
        self._stale_scene = False
        self.pacer.begin(now_s)
        state, second = replay.shown()
        self.scene.show_state(state, second)
        if not self._framed and state is not None and state.condition is Condition.TRACKING:
            self._framed = True
            self.scene.frame_first()
