"""Everything the widgets show, pulled from the engine's client by `step()`. No Qt: a timer calls it."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from rhot_app.engine.status import EngineStatus, Preview, Published
from rhot_app.latency import STACKED
from rhot_app.state import HandState, SeenContour
from rhot_app.ui.backend.contract import Listener
from rhot_app.ui.models.meters import JitterWindow, LatencyWindow, LossMeter, RateRows, rate_names
from rhot_app.ui.models.series import Series

Array = NDArray[np.float64]

SILENCE_S = 1.5
"""The engine reports ten times a second; silence longer than this means that it is gone or stuck."""

STATES = 128
"""States that wait for the picture of their time: a second at 120 Hz."""

_PAUSE_NS = 400_000_000
"""No state for so long is a gap in the plots; at 10 states per second three may be late."""

LATENCY_COLUMNS: tuple[str, ...] = (*(f"{stage} p50" for stage in STACKED), "all p50",
                                    *(f"{stage} p99" for stage in STACKED), "all p99")
LOST = "lost"


class Live:
    """The newest of everything, and the sliding windows behind the plots.

    `state`, `status` and `previews` are the newest messages, `states` the last ones; `state_count` grows with each
    state, so that a widget knows whether there is anything new to draw. The series behind the plots run on this
    machine's monotonic clock (a replayed log's states carry the times of their recording): `jitter` mm, `latency` ms,
    `rates` per second.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """`clock` gives seconds."""
        self._clock = clock
        self._jitter_window = JitterWindow()
        self._latency_window = LatencyWindow()
        self._losses = LossMeter()
        self._rates = RateRows()
        self.clear()

    def clear(self) -> None:
        """Forget everything: another rig, another engine."""
        self.state: HandState | None = None
        self.status: EngineStatus | None = None
        self.previews: dict[str, Preview] = {}
        self.state_count = 0
        self.preview_count = 0
        self.heard_at_s = self._clock()
        self.states: deque[HandState] = deque(maxlen=STATES)
        self.contours: deque[SeenContour] = deque(maxlen=128)
        self.jitter = Series(())
        self.latency = Series(LATENCY_COLUMNS)
        self.rates = Series(("states", LOST))
        self._state_at_ns = 0
        self._jitter_window.clear()
        self._latency_window.clear()
        self._losses.clear()
        self._rates.clear()

    def step(self, client: Listener) -> None:
        """Take in what arrived. Every state counts for the windows; only the newest is kept for drawing."""
        for message in client.poll():
            self.take(message)

    def take(self, message: Published) -> None:
        """Take in one message."""
        if isinstance(message, HandState):
            self._take_state(message)
        elif isinstance(message, EngineStatus):
            self._take_status(message)
        elif isinstance(message, Preview):
            self.previews[message.camera] = message
            self.preview_count += 1
        elif isinstance(message, SeenContour):
            self.contours.append(message)

    def silent_for_s(self) -> float:
        """Seconds since the engine last said anything about itself."""
        return self._clock() - self.heard_at_s

    def _take_state(self, state: HandState) -> None:
        self.state = state
        self.states.append(state)
        self.state_count += 1
        self._state_at_ns = round(1e9 * self._clock())
        self._jitter_window.add(state)
        self._latency_window.add(state)

    def _take_status(self, status: EngineStatus) -> None:
        self.status = status
        self.heard_at_s = self._clock()
        names = (*rate_names(status), LOST)
        if names != self.rates.names:
            self.rates = Series(names)
        row = np.append(self._rates.row(status), self._losses.per_second(status))
        self.rates.append(round(1e9 * self.heard_at_s), row)

    def sample(self, now_ns: int) -> None:
        """Add the windows' figures of this moment to the series of jitter and latency; a gap when nothing came."""
        fresh = self.state is not None and now_ns - self._state_at_ns < _PAUSE_NS
        if self.state is not None and self.state.marker_ids != self.jitter.names:
            self.jitter = Series(self.state.marker_ids)
        if fresh and self.state is not None:
            t_ns = self.state.t_master_ns
            self.jitter.append(now_ns, 1e3 * self._jitter_window.rms(t_ns))
            self.latency.append(now_ns, 1e3 * np.concatenate(self._latency_window.summary(t_ns)))
        else:
            self.jitter.append(now_ns, np.full(len(self.jitter.names), np.nan))
            self.latency.append(now_ns, np.full(len(LATENCY_COLUMNS), np.nan))

    def contours_in(self, preview: Preview) -> list[SeenContour]:
        """What was seen of bare hands in the very image of a preview, or the pose that a hand is to take now."""
        newest = {one.hand: one for one in self.contours if one.camera == preview.camera}
        return [*(one for one in newest.values() if one.shown),
                *(one for one in self.contours if one.camera == preview.camera and not one.shown
                  and one.t_node_ns == preview.t_node_ns != 0)]
