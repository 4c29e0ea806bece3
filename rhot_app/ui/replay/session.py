"""One recording that is open: its run, a second run beside it, the player, the bookmarks. No Qt."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_app.hand.anatomy import load_hand
from rhot_app.hand.skeleton import FINGERS
from rhot_app.project import Rig, load_rig, with_tracker
from rhot_app.recording.bookmarks import Bookmark
from rhot_app.recording.raw_log import LogReader
from rhot_app.state import HandState
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.models.series import RecordedSeries
from rhot_app.ui.replay.run import Codes, Run, Tracked, condition_bins

# -- Two runs of one recording side by side (no Qt) --------------------------------------------------------------------

Array = NDArray[np.float64]

FARTHEST_NS = 50_000_000
"""States farther apart in time are not compared: at 1 m/s a hand moves 5 cm meanwhile."""


class Comparison:
    """`second` beside `first`. `differences_mm` (N, 5): between the fingertips at each of the first one's states."""

    def __init__(self, first: Tracked, second: Tracked) -> None:
        self.partners = nearest(first.times_ns, second.times_ns)
        apart_ns = np.abs(second.times_ns[self.partners] - first.times_ns)
        self.partners[apart_ns > FARTHEST_NS] = -1
        gaps_m = np.linalg.norm(second.fingertips[self.partners] - first.fingertips, axis=2)
        gaps_m[self.partners < 0] = np.nan
        self.differences_mm: Array = 1e3 * gaps_m
        self.times_ns = first.times_ns
        self.of = (first, second)

    def partner(self, number: int) -> int | None:
        """The second run's state at the instant of the first one's; None when there is none."""
        found = int(self.partners[number])
        return found if found >= 0 else None

    def highest_mm(self, least_spacing_ns: int) -> tuple[NDArray[np.int64], Array]:
        """For a plot: times (K,), at least so far apart, and the highest differences (K, 5) from each to the next."""
        spacing_ns = max(1, int(np.median(np.diff(self.times_ns)))) if len(self.times_ns) > 1 else least_spacing_ns
        begins = np.arange(0, len(self.times_ns), max(1, round(least_spacing_ns / spacing_ns)))
        return self.times_ns[begins], np.fmax.reduceat(self.differences_mm, begins, axis=0)

    def percentiles_mm(self, *percents: float) -> Array:
        """(len(percents), 5) of each fingertip's differences over the whole recording; NaN where there are none."""
        found = np.full((len(percents), self.differences_mm.shape[1]), np.nan)
        for finger, column in enumerate(self.differences_mm.T):
            known = column[np.isfinite(column)]
            if len(known):
                found[:, finger] = np.percentile(known, percents)
        return found


def nearest(wanted_ns: NDArray[np.int64], given_ns: NDArray[np.int64]) -> NDArray[np.intp]:
    """(N,) for each of `wanted_ns` (N,) the number of the nearest of `given_ns` (K,), which grows."""
    after = np.clip(np.searchsorted(given_ns, wanted_ns), 0, len(given_ns) - 1)
    before = np.maximum(after - 1, 0)
    nearer_before = np.abs(given_ns[before] - wanted_ns) <= np.abs(given_ns[after] - wanted_ns)
    return np.where(nearer_before, before, after)


# -- Player: position, speed, steps and range (no Qt) ------------------------------------------------------------------

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


# -- One open recording (no Qt) ----------------------------------------------------------------------------------------

_PLOT_SPACING_NS = 50_000_000  # thirty seconds of a plot are 600 rows then


@dataclass(frozen=True, slots=True)
class TrackerChoice:
    """How a recording is to be tracked: as it was recorded, or with another tracker, rig file or hand file."""

    tracker: Literal["", "classic", "estimator"] = ""
    rig: Path | None = None
    hand: Path | None = None
    beside: bool = False  # compared with the run that is shown, instead of in its place
    smooth: bool = False  # every state uses what came after it as well

    def rig_for(self, log: Path) -> Rig:
        """The rig that the log is tracked with. Raises RigError or RecordingError naming the file."""
        if self.rig is not None:
            rig = load_rig(self.rig)
        else:
            reader = LogReader(log)
            reader.close()
            rig = reader.rig
        if self.tracker:
            rig = with_tracker(rig, self.tracker)
        return rig if self.hand is None else msgspec.structs.replace(rig, hand=load_hand(self.hand))

    @property
    def text(self) -> str:
        """In words, e.g. "estimator, desk.json"."""
        parts = [tr({"classic": tr_noop("classic tracker")}.get(self.tracker, self.tracker))] if self.tracker else []
        parts += [path.name for path in (self.rig, self.hand) if path is not None]
        parts += [tr("smoothed")] if self.smooth else []
        return ", ".join(parts) or tr("as recorded")


class Replay:
    """What is shown of a recording. Positions are s since the first state of the run; `second` is compared with it."""

    def __init__(self, path: Path, run: Run, choice: TrackerChoice) -> None:
        self.path = path
        self.run = run
        self.choice = choice
        self.player = Player(run.times_s)
        self.bookmarks: list[Bookmark] = list(run.tracked.bookmarks)
        self.second: Run | None = None
        self.second_choice = TrackerChoice()
        self.comparison: Comparison | None = None
        self.differences: RecordedSeries | None = None  # between both runs, mm
        self.jitter = _jitter(run)

    # -- runs ------------------------------------------------------------------------------------------------------

    def use(self, run: Run, choice: TrackerChoice, comparison: Comparison | None = None) -> None:
        """Another run in the first one's place; the moment that is shown stays. `comparison`: with the second run."""
        at_ns = self.position_ns
        self.run.close()
        self.run, self.choice = run, choice
        self.jitter = _jitter(run)
        before = self.player
        self.player = Player(run.times_s)
        self.player.speed = before.speed
        self.player.seek(self.seconds_of(at_ns))
        self._compare(comparison)

    def compare(self, run: Run | None, choice: TrackerChoice | None = None,
                comparison: Comparison | None = None) -> None:
        """Another run beside the first one, with its `comparison`; None for none."""
        if self.second is not None:
            self.second.close()
        self.second, self.second_choice = run, choice or TrackerChoice()
        self._compare(comparison)

    def _compare(self, comparison: Comparison | None) -> None:
        """Take a comparison of both runs; one that was made of others is made anew."""
        self.comparison = self.differences = None
        if self.second is not None:
            fits = comparison is not None and comparison.of == (self.run.tracked, self.second.tracked)
            self.comparison = comparison if fits else Comparison(self.run.tracked, self.second.tracked)
            assert self.comparison is not None
            self.differences = RecordedSeries(FINGERS, *self.comparison.highest_mm(_PLOT_SPACING_NS), STALE_S)

    def close(self) -> None:
        """Free the states."""
        self.run.close()
        self.compare(None)

    # -- what is shown ---------------------------------------------------------------------------------------------

    @property
    def position_ns(self) -> int:
        """The moment that is shown, by the recording's master clock."""
        return int(self.run.tracked.times_ns[0]) + round(1e9 * self.player.position_s)

    def seconds_of(self, t_master_ns: int) -> float:
        """A moment as a position; it may lie outside."""
        return 1e-9 * (t_master_ns - int(self.run.tracked.times_ns[0]))

    def shown(self) -> tuple[HandState | None, HandState | None]:
        """The states of both runs at the position."""
        number = self.player.shown
        if number is None:
            return None, None
        partner = self.comparison.partner(number) if self.comparison is not None else None
        second = self.second.state(partner) if self.second is not None and partner is not None else None
        return self.run.state(number), second

    def bar(self, count: int) -> Codes:
        """(count,) the condition in each part of the recording, see `condition_bins`."""
        return condition_bins(self.run.times_s, self.run.tracked.conditions, self.player.duration_s, count)

    @property
    def position_text(self) -> str:
        """Where the recording stands, e.g. "0:01.20 of 0:04.00, state 121 of 400"."""
        player = self.player
        return tr("{time} of {length}, state {number} of {count}", time=time_text(player.position_s),
                  length=time_text(player.duration_s), number=player.number + 1, count=len(self.run))

    @property
    def rate_hz(self) -> float:
        """States per second of the recording."""
        return (len(self.run) - 1) / self.player.duration_s if self.player.duration_s else 0.0

    # -- bookmarks -------------------------------------------------------------------------------------------------

    def add_bookmark(self, bookmark: Bookmark) -> None:
        """Show one more, which the log has already."""
        kept = [one for one in self.bookmarks if one.t_master_ns != bookmark.t_master_ns]
        self.bookmarks = sorted([*kept, *([bookmark] if bookmark.text else [])], key=lambda one: one.t_master_ns)

    def bookmark_text(self, bookmark: Bookmark) -> str:
        """A bookmark in a list, e.g. "0:01.20  the thumb is lost"."""
        return f"{time_text(self.seconds_of(bookmark.t_master_ns))}  {bookmark.text}"

    def bookmark_near(self, position_s: float, within_s: float) -> Bookmark | None:
        """The bookmark nearest to a position."""
        near = [(abs(self.seconds_of(one.t_master_ns) - position_s), one) for one in self.bookmarks]
        found = min(near, key=lambda pair: pair[0], default=None)
        return found[1] if found is not None and found[0] <= within_s else None


def _jitter(run: Run) -> RecordedSeries:
    tracked = run.tracked
    return RecordedSeries(tracked.rig.markers.ids, tracked.jitter_times_ns, tracked.jitter, STALE_S)
