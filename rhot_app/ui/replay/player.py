"""Which state of a run is shown: position, speed, steps and the range that is repeated. No Qt, no clock of its own."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0)
"""Times real time."""

STALE_S = 1.0
"""A state is shown until the next one, but no longer than this: a still picture would pass for a still hand."""

_LEAST_LOOP_S = 0.05


class Player:
    """Plays N states at `times_s` (N,), s since the first one, growing. The caller passes the time to `advance`.

    `loop` is the range that is repeated, s, None for none.
    """

    def __init__(self, times_s: Array) -> None:
        self._times_s = times_s
        self.duration_s = float(times_s[-1])
        self.position_s = 0.0
        self.playing = False
        self.speed = 1.0
        self.loop: tuple[float, float] | None = None
        self._now_s = 0.0

    @property
    def number(self) -> int:
        """The newest state at the position."""
        return max(0, int(np.searchsorted(self._times_s, self.position_s, side="right")) - 1)

    @property
    def shown(self) -> int | None:
        """The state to show; None where the recording has none."""
        number = self.number
        return number if self.position_s - self._times_s[number] <= STALE_S else None

    @property
    def at_end(self) -> bool:
        """Whether there is nothing left to play."""
        return self.position_s >= self.duration_s

    def play(self, now_s: float) -> None:
        """Go on from here; from the beginning when the end is reached."""
        if self.at_end:
            self.position_s = self.loop[0] if self.loop is not None else 0.0
        self._now_s = now_s
        self.playing = True

    def pause(self) -> None:
        """Stand still."""
        self.playing = False

    def toggle(self, now_s: float) -> None:
        """Play or pause."""
        if self.playing:
            self.pause()
        else:
            self.play(now_s)

    def advance(self, now_s: float) -> None:
        """Move on to where the recording is at `now_s`, on any clock that does not fall."""
        passed_s, self._now_s = now_s - self._now_s, now_s
        if not self.playing:
            return
        before, self.position_s = self.position_s, self.position_s + self.speed * passed_s
        if self.loop is not None and before <= self.loop[1] < self.position_s:
            begin, end = self.loop
            self.position_s = begin + (self.position_s - end) % (end - begin)
        if self.at_end:
            self.position_s = self.duration_s
            self.playing = False

    def seek(self, position_s: float) -> None:
        """Go to a time; playing goes on from there."""
        self.position_s = min(max(position_s, 0.0), self.duration_s)

    def step(self, count: int) -> None:
        """Pause at the state so many on, or back when negative."""
        self.playing = False
        number = min(max(self.number + count, 0), len(self._times_s) - 1)
        self.position_s = float(self._times_s[number])

    def set_speed(self, speed: float, now_s: float) -> None:
        """Play so many times as fast as it was."""
        self.advance(now_s)
        self.speed = min(max(speed, SPEEDS[0]), SPEEDS[-1])

    def begin_loop(self) -> None:
        """The range that is repeated begins here; it ends where it ended, or at the end of the recording."""
        end = self.loop[1] if self.loop is not None else self.duration_s
        self._set_loop(self.position_s, end if end > self.position_s else self.duration_s)

    def end_loop(self) -> None:
        """The range that is repeated ends here."""
        begin = self.loop[0] if self.loop is not None else 0.0
        self._set_loop(begin if begin < self.position_s else 0.0, self.position_s)

    def _set_loop(self, begin_s: float, end_s: float) -> None:
        """A range that is too short to be seen is none."""
        self.loop = (begin_s, end_s) if end_s - begin_s >= _LEAST_LOOP_S else None

    def clear_loop(self) -> None:
        """Repeat nothing."""
        self.loop = None


def time_text(seconds: float) -> str:
    """A position for people, e.g. "1:02.34"."""
    hundredths = round(100.0 * max(seconds, 0.0))
    minutes, rest = divmod(hundredths, 6000)
    return f"{minutes}:{rest // 100:02d}.{rest % 100:02d}"
