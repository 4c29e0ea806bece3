"""Whether the live twin keeps up: it says so when its cameras run slower than their preset, or no longer do."""

from __future__ import annotations

from typing import Any

WINDOW_S = 2.0
"""Rates are means over this long: a single late frame is none of the user's business."""

SHORT = 0.95  # of the preset's rate: below it the rig is slow
CHANGE = 0.15  # of the rate said last: what is worth saying again


class Pace:
    """Counts frames; `note` returns what to say, seldom."""

    def __init__(self, preset_hz: float) -> None:
        self._preset_hz = preset_hz
        self._began_s: float | None = None
        self._frames = 0
        self._said_hz = preset_hz
        self.rate_hz = 0.0
        """Frames per second, of late; 0 until that is known."""

    def note(self, now_s: float) -> dict[str, Any] | None:
        """A frame is out at monotonic time `now_s`. Returns an event for programs to read, or None:
        ``{"event": "slow", "achieved_hz": 21.4, "preset_hz": 40.0, "text": sentence}``, and once the rate is back
        ``{"event": "in_time", ...}`` with the same fields."""
        if self._began_s is None:
            self._began_s = now_s
            return None
        self._frames += 1
        if now_s - self._began_s < WINDOW_S:
            return None
        achieved_hz = self._frames / (now_s - self._began_s)
        self._began_s, self._frames, self.rate_hz = now_s, 0, achieved_hz
        slow, was_slow = (rate < SHORT * self._preset_hz for rate in (achieved_hz, self._said_hz))
        if slow == was_slow and (not slow or abs(achieved_hz - self._said_hz) < CHANGE * self._said_hz):
            return None
        self._said_hz = achieved_hz
        return {"event": "slow" if slow else "in_time", "achieved_hz": round(achieved_hz, 1),
                "preset_hz": self._preset_hz, "text": self._sentence(achieved_hz, slow)}

    def _sentence(self, achieved_hz: float, slow: bool) -> str:
        if not slow:
            return f"The simulated cameras run at their {self._preset_hz:g} frames per second again."
        return (f"The simulated cameras run at {achieved_hz:.0f} instead of {self._preset_hz:g} frames per second: "
                "rendering takes only what this machine can spare. Rates and latency are not those of a real rig.")
