"""What a recording looks like at one moment: scene, panels, plots and timeline, each drawn as often as it is worth."""

from __future__ import annotations

import time

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtWidgets import QComboBox, QHBoxLayout, QLabel, QPushButton, QSplitter, QVBoxLayout, QWidget

from rhot_app.hand.skeleton import FINGERS
from rhot_app.state import Condition, HandState
from rhot_app.ui.common.parts import scrolled
from rhot_app.ui.common.settings import Settings
from rhot_app.ui.common.shapes import shape_icon
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.models.pacing import FramePacer
from rhot_app.ui.models.palette import STAGE_COLOURS, Scheme, visible_on
from rhot_app.ui.panels.hand_panel import HandPanel
from rhot_app.ui.panels.markers_panel import MarkersPanel
from rhot_app.ui.plots.live_plots import JitterPlot
from rhot_app.ui.plots.plot_panel import DASHES, LegendEntry, Line, PlotPanel, newest, number
from rhot_app.ui.replay.film_panel import FilmPanel
from rhot_app.ui.replay.session import SPEEDS, Comparison, Replay
from rhot_app.ui.replay.timeline import Timeline
from rhot_app.ui.scene.view import SceneView

PANEL_S = 0.1
PLOT_S = 0.25
_FILMS_PX, _SIDE_PX, _HAND_PX, _PLOTS_PX = 300, 440, 220, 180
_SIZE = (1280, 800)


class ReplayScreen(QWidget):
    """`show_run` whenever runs change, `refresh` at every tick."""

    def __init__(self, settings: Settings, scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.scene = SceneView(scheme)
        self.scene.show_names(settings.flag("names"))
        if not settings.flag("clouds"):
            self.scene.show_ellipsoids(None)
        self.films = FilmPanel(scheme)
        self.wants_films = settings.flag("films")
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
        for splitter, parts in ((side, (self.hand, scrolled(self.markers))), (middle, (self.films, self.scene, side)),
                                (plots, self.plots), (whole, (middle, plots))):
            for part in parts:
                splitter.addWidget(part)
            splitter.setChildrenCollapsible(False)
        side.setSizes([_HAND_PX, _SIZE[1] - _PLOTS_PX - _HAND_PX])
        middle.setSizes([_FILMS_PX, _SIZE[0] - _FILMS_PX - _SIDE_PX, _SIDE_PX])
        whole.setSizes([_SIZE[1] - _PLOTS_PX, _PLOTS_PX])
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(4)
        layout.addWidget(whole, 1)
        layout.addWidget(self.timeline)
        layout.addWidget(self.transport)

    def set_scheme(self, scheme: Scheme) -> None:
        """Change colours."""
        for part in (self.films, self.scene, self.markers, self.hand, self.timeline, self.transport):
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
        self.films.show_run(replay)
        self.show_films(self.wants_films)
        self.scene.show_second_rig(replay.second.rig if replay is not None and replay.second is not None else None)
        comparison = replay.comparison if replay is not None else None
        if comparison is not None:
            self.difference.show_comparison(comparison)
        self.difference.setVisible(comparison is not None)
        self.timeline.show_replay(replay)
        self.transport.setEnabled(replay is not None)
        self.look_again()

    def show_films(self, wanted: bool) -> None:
        """Pictures beside the scene, where there are any; before somebody asks for them, no word of their lack."""
        self.wants_films = wanted
        self.films.setVisible(wanted and bool(self.films.films))
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
        self._refresh_scene(replay)
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

    def _refresh_scene(self, replay: Replay) -> None:
        now_s = time.monotonic()
        self.pacer.give_up(now_s)
        if not self._stale_scene or not self.pacer.due(now_s):
            return
        self._stale_scene = False
        self.pacer.begin(now_s)
        state, second = replay.shown()
        self.scene.show_state(state, second)
        if self.films.isVisible():
            self.films.show_moment(replay.position_ns, state)
        if not self._framed and state is not None and state.condition is Condition.TRACKING:
            self._framed = True
            self.scene.frame_first()


# -- difference plot -------------------------------------------------------------------------------------------------

Array = NDArray[np.float64]


class DifferencePlot(PlotPanel):
    """One line per finger."""

    term = "fingertip difference"
    title = tr_noop("Fingertip difference")
    unit = "mm"
    least_span = 1.0

    def __init__(self, scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(scheme, ("now", "p50", "p95"), "000.0", parent)
        self._whole: list[tuple[str, str]] = [("–", "–")] * len(FINGERS)
        self._curves: list[pg.PlotDataItem] = []
        self._colour()

    def show_comparison(self, comparison: Comparison) -> None:
        """Another pair of runs."""
        median, p95 = comparison.percentiles_mm(50.0, 95.0)
        self._whole = [(number(low, 1), number(high, 1)) for low, high in zip(median, p95, strict=True)]

    def _colour(self) -> None:
        for curve in self._curves:
            self.plot.removeItem(curve)
        self._curves, entries = [], []
        for k, finger in enumerate(FINGERS):
            colour = visible_on(STAGE_COLOURS[k], self._scheme.panel)
            dash = DASHES[k % len(DASHES)]
            self._curves.append(self.plot.plot(pen=pg.mkPen(colour, width=2, style=dash), connect="finite"))
            entries.append(LegendEntry(finger, colour, dash))
        self.legend.set_entries(entries)

    def draw(self, seconds: Array, rows: Array, names: tuple[str, ...]) -> None:
        if rows.shape[1] != len(self._curves):
            rows = np.full((len(seconds), len(self._curves)), np.nan)
        for k, curve in enumerate(self._curves):
            curve.setData(seconds, rows[:, k])
        self.legend.set_values([(number(newest(seconds, rows, k), 1), *whole) for k, whole in enumerate(self._whole)])
        self._fit(seconds, [Line(entry.name, entry.colour, rows[:, k]) for k, entry in enumerate(self.legend.entries)])


# -- the row of buttons under the timeline -----------------------------------------------------------------------------

_ICON_PX = 16


class Transport(QWidget):
    """Says what is wanted; the window does it. `speed_chosen` gives times real time."""

    play_asked = Signal()
    step_asked = Signal(int)
    first_asked = Signal()
    last_asked = Signal()
    speed_chosen = Signal(float)
    loop_begin_asked = Signal()
    loop_end_asked = Signal()
    loop_clear_asked = Signal()
    bookmark_asked = Signal()

    def __init__(self, scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._signs: list[tuple[QPushButton, str]] = []
        self._playing: bool | None = None
        self.first_button = self._sign("first", tr("The beginning (Home)."))
        self.back_button = self._sign("previous", tr("One state back (left arrow)."))
        self.play_button = self._sign("play", tr("Play or pause (Space)."))
        self.on_button = self._sign("next", tr("One state on (right arrow)."))
        self.last_button = self._sign("last", tr("The end (End)."))
        self.speed_box = QComboBox()
        self.speed_box.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.speed_box.setToolTip(tr("How fast it plays, times real time."))
        for speed in SPEEDS:
            self.speed_box.addItem(f"{speed:g} ×", speed)
        self.speed_box.setCurrentIndex(SPEEDS.index(1.0))
        self.loop_begin_button = self._word(tr("Loop from here"), tr("The range that is repeated begins here ([)."))
        self.loop_end_button = self._word(tr("to here"), tr("The range that is repeated ends here (])."))
        self.loop_clear_button = self._word(tr("No loop"), tr("Repeat nothing."))
        self.bookmark_button = self._word(tr("Bookmark"),
                                          tr("Write a few words about this moment into the recording (B)."))
        self.place = QLabel("")
        widest = "00:00.00 of 00:00.00"  # the number of the state is cut off in a narrow window
        self.place.setMinimumWidth(self.place.fontMetrics().horizontalAdvance(widest))
        self._lay_out()
        self._connect()
        self.set_scheme(scheme)

    def _sign(self, shape: str, meaning: str) -> QPushButton:
        button = self._word("", meaning)
        button.setIconSize(QSize(_ICON_PX, _ICON_PX))
        button.setAccessibleName(meaning)
        self._signs.append((button, shape))
        return button

    def _word(self, text: str, meaning: str) -> QPushButton:
        button = QPushButton(text)
        button.setToolTip(meaning)
        button.setFocusPolicy(Qt.FocusPolicy.TabFocus)  # a click leaves the space bar to the player
        return button

    def _lay_out(self) -> None:
        row = QHBoxLayout(self)
        row.setContentsMargins(10, 0, 10, 8)
        row.setSpacing(4)
        for button, _ in self._signs:
            row.addWidget(button)
        row.addWidget(self.speed_box)
        row.addSpacing(8)
        row.addWidget(self.place)
        row.addStretch(1)
        for word in (self.loop_begin_button, self.loop_end_button, self.loop_clear_button, self.bookmark_button):
            row.addWidget(word)

    def _connect(self) -> None:
        for button, signal in ((self.first_button, self.first_asked), (self.play_button, self.play_asked),
                               (self.last_button, self.last_asked), (self.loop_begin_button, self.loop_begin_asked),
                               (self.loop_end_button, self.loop_end_asked),
                               (self.loop_clear_button, self.loop_clear_asked),
                               (self.bookmark_button, self.bookmark_asked)):
            button.clicked.connect(lambda checked=False, signal=signal: signal.emit())
        self.back_button.clicked.connect(lambda: self.step_asked.emit(-1))
        self.on_button.clicked.connect(lambda: self.step_asked.emit(1))
        self.speed_box.activated.connect(lambda: self.speed_chosen.emit(float(self.speed_box.currentData())))

    def set_scheme(self, scheme: Scheme) -> None:
        """Change colours."""
        self._scheme = scheme
        for button, shape in self._signs:
            button.setIcon(shape_icon(shape, scheme.text, _ICON_PX))
        self._playing = None

    @property
    def is_playing(self) -> bool | None:
        """What the play button shows; None before it shows anything."""
        return self._playing

    def show_replay(self, replay: Replay) -> None:
        """Where it stands."""
        player = replay.player
        self.place.setText(replay.position_text)
        self.loop_clear_button.setEnabled(player.loop is not None)
        if player.playing != self._playing:
            self._playing = player.playing
            self.play_button.setIcon(shape_icon("pause" if player.playing else "play", self._scheme.text, _ICON_PX))
