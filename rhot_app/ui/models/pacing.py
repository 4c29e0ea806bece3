"""When to draw: at most so many times a second, and never more of the time than a fixed share of it."""

from __future__ import annotations


class FramePacer:
    """Times are s on any monotonic clock. `share` is the part of the time that drawing may take.

    With software OpenGL one frame may cost 30 ms; drawing every tick would then leave nothing for anything else.
    """

    def __init__(self, most_hz: float = 60.0, share: float = 0.5) -> None:
        self._least_s = 1.0 / most_hz
        self._share = share
        self._began: float | None = None
        self._next = 0.0
        self.cost_s = 0.0

    def due(self, now_s: float) -> bool:
        """Whether a frame should be drawn now: the last one is on the screen and has been paid for."""
        return self._began is None and now_s >= self._next

    def begin(self, now_s: float) -> None:
        """A frame is being drawn."""
        self._began = now_s

    def end(self, now_s: float) -> None:
        """The frame is on the screen; one that was not begun here (an orbit by hand) does not count."""
        if self._began is None:
            return
        cost = now_s - self._began
        self.cost_s = cost if self.cost_s == 0.0 else 0.8 * self.cost_s + 0.2 * cost
        self._next = max(self._began + self._least_s, now_s + min(cost, 0.25) * (1.0 / self._share - 1.0))
        self._began = None

    def give_up(self, now_s: float, patience_s: float = 0.5) -> None:
        """Forget a frame that never came to the screen, e.g. because the window is hidden."""
        if self._began is not None and now_s - self._began > patience_s:
            self._began = None
