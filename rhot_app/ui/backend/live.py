"""Everything the widgets show, pulled from the engine's client by `step()`. No Qt: a timer calls it."""

from __future__ import annotations

import time
from collections import deque
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from rhot_app.engine.status import EngineStatus, Preview
from rhot_app.tracking.state import HandState
from rhot_app.ui.models.jitter import JitterWindow
from rhot_app.ui.models.latency import LatencyWindow
from rhot_app.ui.models.rates import LossMeter, rate_names, rate_row
from rhot_app.ui.models.series import Series

Array = NDArray[np.float64]

SILENCE_S = 1.5
"""The engine reports several times a second; silence longer than this means that it is gone or stuck."""


class Client(Protocol):
    """What the app needs of `rhot_app.engine.client.EngineClient`."""

    def poll(self) -> list[HandState | EngineStatus | Preview]:
        """Everything that arrived since the last call; never waits."""
        ...

    def command(self, name: str, **args: Any) -> dict[str, Any]:
        """Ask the engine; raises EngineError."""
        ...


class Live:
    """The newest of everything, and the sliding windows behind the plots.

    `state`, `status` and `previews` are the newest messages; `state_count` grows with each state, so that a widget
    knows whether there is anything new to draw.
    """

    def __init__(self) -> None:
        self.jitter = JitterWindow()
        self.latency = LatencyWindow()
        self._losses = LossMeter()
        self.clear()

    def clear(self) -> None:
        """Forget everything: another rig, another engine."""
        self.state: HandState | None = None
        self.status: EngineStatus | None = None
        self.previews: dict[str, Preview] = {}
        self.state_count = 0
        self.preview_count = 0
        self.heard_at_s = time.monotonic()
        self.sights: deque[tuple[int, Array, NDArray[np.uint16]]] = deque(maxlen=256)
        self.rates = Series(("states",))
        self.losses = Series(("lost",))
        self.jitter.clear()
        self.latency.clear()
        self._losses.clear()

    def step(self, client: Client) -> None:
        """Take in what arrived. Every state counts for the windows; only the newest is kept for drawing."""
        for message in client.poll():
            if isinstance(message, HandState):
                self._take_state(message)
            elif isinstance(message, EngineStatus):
                self._take_status(message)
            elif isinstance(message, Preview):
                self.previews[message.camera] = message
                self.preview_count += 1

    def silent_for_s(self) -> float:
        """Seconds since the engine last said anything about itself."""
        return time.monotonic() - self.heard_at_s

    def _take_state(self, state: HandState) -> None:
        self.state = state
        self.state_count += 1
        self.jitter.add(state)
        self.latency.add(state)
        self.sights.append((state.t_master_ns, state.camera_pixels, state.camera_flags))

    def _take_status(self, status: EngineStatus) -> None:
        self.status = status
        self.heard_at_s = time.monotonic()
        if rate_names(status) != self.rates.names:
            self.rates = Series(rate_names(status))
        self.rates.append(status.t_master_ns, rate_row(status))
        self.losses.append(status.t_master_ns, np.array([self._losses.per_second(status)]))

    def sight_at(self, t_master_ns: int) -> tuple[Array, NDArray[np.uint16]] | None:
        """Pixels (C, M, 2) and flags (C, M) of the state nearest to a preview's time; None without a state within 0.25 s.

        A preview is older than the newest state; drawn with the newest pixels, marks would run ahead of the picture.
        """
        if not self.sights:
            return None
        nearest = min(self.sights, key=lambda sight: abs(sight[0] - t_master_ns))
        return nearest[1:] if abs(nearest[0] - t_master_ns) < 250_000_000 else None
