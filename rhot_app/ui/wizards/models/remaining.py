"""How long a piece of work will still take, in words."""

from __future__ import annotations

_LEAST_DONE = 0.03
_LEAST_S = 0.5


class Remaining:
    """Fed with the fraction done and the time; tells the remaining time once there is enough to judge by."""

    def __init__(self, began_s: float) -> None:
        self._began_s = began_s
        self.fraction = 0.0
        self._at_s = began_s

    def report(self, fraction: float, now_s: float) -> None:
        """`fraction` 0..1 is done at `now_s`; work that goes back a little stays where it was."""
        self.fraction = max(self.fraction, min(fraction, 1.0))
        self._at_s = now_s

    def text(self, now_s: float) -> str:
        """Remaining time in words, "" while it cannot be told."""
        elapsed = self._at_s - self._began_s
        if self.fraction < _LEAST_DONE or elapsed < _LEAST_S:
            return ""
        left = elapsed * (1.0 - self.fraction) / self.fraction - (now_s - self._at_s)
        if left < 1.0:
            return "a moment left"
        if left < 90.0:
            return f"about {left:.0f} s left"
        return f"about {left / 60.0:.0f} min left"
