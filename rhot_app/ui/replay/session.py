"""One recording that is open: its run, a second run beside it, the player, the bookmarks. No Qt."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import msgspec

from rhot_app.hand.anatomy import load_hand
from rhot_app.hand.skeleton import FINGERS
from rhot_app.project import Rig, load_rig, with_tracker
from rhot_app.recording.bookmarks import Bookmark
from rhot_app.recording.raw_log import LogReader
from rhot_app.tracking.state import HandState
from rhot_app.ui.models.series import RecordedSeries
from rhot_app.ui.replay.comparison import Comparison
from rhot_app.ui.replay.player import STALE_S, Player, time_text
from rhot_app.ui.replay.run import Codes, Run, condition_bins

_PLOT_SPACING_NS = 50_000_000  # thirty seconds of a plot are 600 rows then


@dataclass(frozen=True, slots=True)
class Choice:
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
        parts = [{"classic": "classic tracker"}.get(self.tracker, self.tracker)] if self.tracker else []
        parts += [path.name for path in (self.rig, self.hand) if path is not None]
        parts += ["smoothed"] if self.smooth else []
        return ", ".join(parts) or "as recorded"


class Replay:
    """What is shown of a recording. Positions are s since the first state of the run; `second` is compared with it."""

    def __init__(self, path: Path, run: Run, choice: Choice) -> None:
        self.path = path
        self.run = run
        self.choice = choice
        self.player = Player(run.times_s)
        self.bookmarks: list[Bookmark] = list(run.tracked.bookmarks)
        self.second: Run | None = None
        self.second_choice = Choice()
        self.comparison: Comparison | None = None
        self.differences: RecordedSeries | None = None  # between both runs, mm
        self.jitter = _jitter(run)

    # -- runs ------------------------------------------------------------------------------------------------------

    def use(self, run: Run, choice: Choice, comparison: Comparison | None = None) -> None:
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

    def compare(self, run: Run | None, choice: Choice | None = None, comparison: Comparison | None = None) -> None:
        """Another run beside the first one, with its `comparison`; None for none."""
        if self.second is not None:
            self.second.close()
        self.second, self.second_choice = run, choice or Choice()
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
        return (f"{time_text(player.position_s)} of {time_text(player.duration_s)}, state {player.number + 1} of "
                f"{len(self.run)}")

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
