"""The alignment wizard without its widgets: another tracker, a movement of both, the fit, the file beside the rig."""

from __future__ import annotations

import shlex
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.registry import ALIGNMENT
from rhot_app.charts import Chart, Curve
from rhot_app.errors import CalibrationError
from rhot_app.objects.alignment.alignment_file import (
    Alignment,
    alignment_path,
    load_alignment,
    save_alignment,
    to_alignment,
)
from rhot_app.objects.alignment.drift import Drift, DriftMonitor
from rhot_app.objects.alignment.fit import LASTING_M, SEARCH_S, OffsetSearch, align
from rhot_app.objects.alignment.motion_stream import SAMPLES, MotionStream
from rhot_app.objects.alignment.report import (
    FAIR_M,
    FAST_M_S,
    REACH_M,
    AlignmentReport,
    Coverage,
    coverage_of_motion,
    judge_alignment,
)
from rhot_app.progress import Progress
from rhot_app.state import HandState
from rhot_app.ui.backend.pose_feed import PoseFeed
from rhot_app.ui.models.proposal import Command, Proposal, Row
from rhot_app.ui.wizards.models.step import Bar, Step, StepView, Task

Array = NDArray[np.float64]

SECONDS = 20.0

ENOUGH_RAD = LASTING_M / FAIR_M
ENOUGH_M = LASTING_M * REACH_M / FAIR_M
ENOUGH_M_S = LASTING_M * FAST_M_S / FAIR_M
"""rad, m and m/s: of the verdict's "good" (`objects.alignment.report`)."""

LEAST_HZ = 20.0
"""Hz: hands move at up to 5 Hz, and a cubic needs four samples a period."""

_RECENT_NS = 1_000_000_000


@dataclass(frozen=True, slots=True)
class SourceKind:
    """A kind of source: the `name` of `open_source` with the detail in place of {}, and what is said of it."""

    label: str
    name: str
    meaning: str
    detail: str = ""


KINDS: tuple[SourceKind, ...] = (
    SourceKind("SteamVR", "openvr", "A Vive tracker, by SteamVR on this machine."),
    SourceKind("libsurvive", "libsurvive", "A Vive tracker, by survive-cli on this machine."),
    SourceKind("Program", "run:{}", "A program that prints a line for each pose.", "program and arguments"),
    SourceKind("UDP", "udp:{}", "Lines that a program sends to this port.", "port"),
    SourceKind("TCP", "tcp:{}", "A program that serves lines.", "host:port"))


def simulated_kind(rig_path: Path | None) -> SourceKind | None:
    """The simulated rig's own tracker; None on another rig."""
    if rig_path is None:
        return None
    from rhot_app.simulator.nodes.remote import SERVER_NAME  # with OpenCV

    if not (rig_path.parent / SERVER_NAME).exists():
        return None
    command = shlex.join([sys.executable, "-m", "rhot_app.simulator.nodes.tracker", str(rig_path.parent)])
    return SourceKind("Simulated", f"run:{command}", "A tracker on the simulated index fingertip.")


class SourceStep(Step):
    """A source is chosen and listened to. `kind`, `detail` and `tracker` are as entered."""

    title = "The tracker"

    def __init__(self, kinds: Sequence[SourceKind], feed: PoseFeed) -> None:
        self.kinds, self.feed = tuple(kinds), feed
        self.kind, self.detail, self.tracker = self.kinds[0], "", ""

    def connect(self) -> None:
        """Listen to what was entered."""
        self.feed.open(self.kind.name.replace("{}", self.detail.strip()), self.tracker.strip())

    def view(self) -> StepView:
        """Whether poses come."""
        if not self.feed.opened:
            return StepView("Choose the other tracker, switch it on, then connect.")
        rate_hz = self.feed.rate_hz
        bars = (Bar("poses", min(rate_hz / LEAST_HZ, 1.0), f"{LEAST_HZ:.0f} or more a second"),)
        if rate_hz >= LEAST_HZ:
            return StepView(f"{rate_hz:.0f} poses a second. Go on.", done=True, bars=bars, hint=self.feed.notice)
        return StepView("Waiting for poses.", bars=bars, hint=self.feed.notice)


@dataclass(frozen=True, eq=False)
class StreamRecording:
    """A movement of both: the other tracker's `foreign` poses (N, 4, 4) m at `foreign_s` (N,) s, and `places` (M, 3) m
    of the marker in the rig at `rig_s` (M,) s, both by the master's clock. Equal only to itself."""

    foreign_s: Array
    foreign: Array
    rig_s: Array
    places: Array

    @property
    def coverage(self) -> Coverage | None:
        """The motion so far; None of too few samples."""
        if len(self.foreign_s) < SAMPLES or len(self.rig_s) < SAMPLES:
            return None
        velocity = np.gradient(self.places, self.rig_s, axis=0)
        calm = np.linalg.norm(velocity, axis=1)
        calm_enough = calm <= np.quantile(calm, 0.98)  # a jump of a marker is no speed
        return coverage_of_motion(self.foreign[:, :3, :3], self.places, velocity[calm_enough])


Phase = Literal["waiting", "recording", "recorded"]


class TogetherStep(Step):
    """Tracker and fingertip are moved together; Space begins and ends. `marker` is the number of the fingertip's."""

    title = "Move both"
    captures = True

    def __init__(self, markers: Sequence[str], feed: PoseFeed, recent: Callable[[float], Sequence[HandState]],
                 now_ns: Callable[[], int] = time.monotonic_ns) -> None:
        """`recent` gives the hand's states of the last seconds."""
        self.markers, self.feed = tuple(markers), feed
        self.marker = self.markers.index("index") if "index" in self.markers else 0
        self.seconds = SECONDS
        self.phase: Phase = "waiting"
        self.recording: StreamRecording | None = None
        self.problem = ""
        self._recent, self._now_ns = recent, now_ns
        self._began_ns = self._ended_ns = 0
        self._places: list[tuple[int, Array]] = []
        self._coverage: Coverage | None = None

    @property
    def keeps(self) -> bool:
        """A movement costs a person a minute."""
        return self.recording is not None

    def capture(self) -> bool:
        """Begin, or end."""
        now_ns = self._now_ns()
        if self.phase == "recording":
            self._gather(now_ns)
            self.phase, self._ended_ns, self.recording = "recorded", now_ns, self._recorded(now_ns)
            return True
        self.problem = self._missing()
        if self.problem:
            return False
        self.phase, self._began_ns, self.recording = "recording", now_ns, None
        self._places, self._coverage = [], None
        return True

    def seen(self) -> bool:
        """Whether the marker was measured within the last second."""
        return any(np.isfinite(state.marker_raw_positions[self.marker]).all() for state in self._recent(1.0))

    def _missing(self) -> str:
        if not self.feed.between(self._now_ns() - _RECENT_NS, self._now_ns()):
            return self.feed.notice or "The tracker gives no poses. Go back and connect it."
        if not self.seen():
            return (f"The marker {self.markers[self.marker]} is not seen by two cameras. Hold it before them, or "
                    "choose another one.")
        return ""

    def _gather(self, now_ns: int) -> None:
        """The marker's places, unfiltered: a filter's lag would be taken for the tracker's delay."""
        last_ns = self._places[-1][0] if self._places else self._began_ns
        for state in self._recent(4.0):
            place = state.marker_raw_positions[self.marker]
            if last_ns < state.t_master_ns <= now_ns and np.isfinite(place).all():
                self._places.append((state.t_master_ns, np.array(place)))
                last_ns = state.t_master_ns

    def _recorded(self, now_ns: int) -> StreamRecording:
        # the other clock may be off by as much as is searched
        poses = self.feed.between(self._began_ns - round(1e9 * SEARCH_S), now_ns)
        return StreamRecording(np.array([1e-9 * (pose.t_master_ns - self._began_ns) for pose in poses]),
                               np.array([pose.world_from_body for pose in poses]).reshape(-1, 4, 4),
                               np.array([1e-9 * (t_ns - self._began_ns) for t_ns, _ in self._places]),
                               np.array([place for _, place in self._places]).reshape(-1, 3))

    def view(self) -> StepView:
        """Coverage and what is missing."""
        now_ns = self._now_ns()
        if self.phase == "recording":
            self._gather(now_ns)
            self._coverage = self._recorded(now_ns).coverage
            if now_ns - self._began_ns >= 1e9 * self.seconds:
                self.capture()
        elapsed_s = 1e-9 * ((now_ns if self.phase == "recording" else self._ended_ns) - self._began_ns)
        recorded = self.phase == "recorded"
        missing = advice(self._coverage)
        return StepView(self._say(elapsed_s, missing), done=recorded and not missing, passable=recorded,
                        hint=self.problem or ("" if self.phase != "recording" or self.seen() else self._missing()),
                        bars=(Bar("time", min(elapsed_s / self.seconds, 1.0) if self._began_ns else 0.0,
                                  f"of {self.seconds:.0f} s recorded"), *bars_of(self._coverage)),
                        kept=int(recorded))

    def _say(self, elapsed_s: float, missing: str) -> str:
        if self.phase == "recording":
            return f"{missing or 'Good, go on.'} {max(0.0, self.seconds - elapsed_s):.0f} s left."
        if self.phase == "recorded":
            return f"{missing} Record again." if missing else "Recorded. Go on, or record again."
        return "Tie the tracker to the finger. Press Record, then move and turn both, irregularly."


def bars_of(coverage: Coverage | None) -> tuple[Bar, ...]:
    """How much of what an alignment needs the motion shows."""
    turn, reach, speed = (0.0, 0.0, 0.0) if coverage is None else (
        float(coverage.turn[0]) / ENOUGH_RAD, float(np.linalg.norm(coverage.spread_m[1:])) / ENOUGH_M,
        coverage.speed_m_s / ENOUGH_M_S)
    return (Bar("turn", min(turn, 1.0), f"of the tracker about two axes, {np.degrees(ENOUGH_RAD):.0f} degrees rms"),
            Bar("reach", min(reach, 1.0), f"of the finger across its longest way, {1e3 * ENOUGH_M:.0f} mm rms"),
            Bar("speed", min(speed, 1.0), f"of the finger, {1e3 * ENOUGH_M_S:.0f} mm/s rms"))


def advice(coverage: Coverage | None) -> str:
    """Which motion is missing most; "" when none is."""
    if coverage is None:
        return "Keep the marker in view."
    if coverage.turn[2] < ENOUGH_RAD:
        return "Turn the tracker while you move it."
    if coverage.turn[0] < ENOUGH_RAD:
        return "Turn it about a second axis, too."
    if np.linalg.norm(coverage.spread_m[1:]) < ENOUGH_M:
        return "Move farther: up and down, left and right, near and far."
    return "" if coverage.speed_m_s >= ENOUGH_M_S else "Move faster."


@dataclass(frozen=True, eq=False)
class AlignmentResult:
    """A solved alignment, its search, and the test of the one that was in use; None when there was none."""

    report: AlignmentReport
    search: OffsetSearch
    drift: Drift | None


def solve_recording(recording: StreamRecording, before: Alignment | None, *, progress: Progress) -> AlignmentResult:
    """What ``rhot calibrate alignment`` does with two files. Raises CalibrationError as `align` does."""
    foreign = MotionStream.of_poses(recording.foreign_s, recording.foreign)
    rig = MotionStream(recording.rig_s, recording.places)
    fit, search = align(foreign, rig, SEARCH_S, progress)
    drift = None if before is None else DriftMonitor.test_streams(before, foreign, rig)
    return AlignmentResult(judge_alignment(fit, search), search, drift)


def charts_of(result: AlignmentResult) -> tuple[Chart, ...]:
    """The residuals over the speed, and the time offsets tried."""
    fit, search = result.report.fit, result.search
    speed, error = np.linalg.norm(fit.velocity, axis=1), np.linalg.norm(fit.errors, axis=1)
    tried = np.isfinite(search.median_m)
    return (Chart("What is left between both; a delay is a slope", "speed, mm/s", "distance, mm",
                  (Curve("agree", 1e3 * speed[fit.inlier], 1e3 * error[fit.inlier], "faint dots"),
                   Curve("do not", 1e3 * speed[~fit.inlier], 1e3 * error[~fit.inlier], "faint dots"))),
            Chart("Time offsets tried", "offset, ms", "median distance, mm",
                  (Curve("median", 1e3 * search.offsets_s[tried], 1e3 * search.median_m[tried]),)))


@dataclass(frozen=True, slots=True)
class AlignmentChange:
    """Another alignment in the file beside the rig."""

    before: Alignment | None
    after: Alignment
    path: Path | None

    def use(self, command: Command) -> None:
        """Write it; raises CalibrationError."""
        if self.path is None:
            raise CalibrationError("This rig came from no file, so there is no place beside it. Save the rig first.")
        save_alignment(self.path, self.after)

    def restore(self, command: Command) -> None:
        """What was there before, or no file; raises CalibrationError."""
        assert self.path is not None
        if self.before is not None:
            save_alignment(self.path, self.before)
            return
        try:
            self.path.unlink(missing_ok=True)
        except OSError as exc:
            raise CalibrationError(f"{self.path}: cannot be removed ({exc.strerror}).") from exc

    @property
    def way_back(self) -> str:
        """The file is replaced."""
        return "The alignment in use can be brought back here, until this window closes."


class AlignmentSolver:
    """Makes the work of a recording, and one proposal of each result."""

    def __init__(self, together: TogetherStep, rig_path: Path | None) -> None:
        """An alignment that cannot be read counts as none: the new one replaces it."""
        self._together = together
        self.path = None if rig_path is None else alignment_path(rig_path)
        self.before: Alignment | None = None
        if self.path is not None and self.path.exists():
            try:
                self.before = load_alignment(self.path)
            except CalibrationError:
                self.before = None
        self._proposed: tuple[AlignmentResult, Proposal] | None = None

    def task(self) -> Task | None:
        """The work; None before a recording."""
        recording = self._together.recording
        return None if recording is None else Task("Aligning both trackers …", solve_recording,
                                                   (recording, self.before))

    def propose(self, result: AlignmentResult | None) -> Proposal | None:
        """The new alignment beside the old one."""
        if result is None:
            return None
        if self._proposed is None or self._proposed[0] is not result:
            after = to_alignment(result.report)
            rows = (Row("alignment in use", self._state(result.drift), "just solved"),
                    *(Row(what, old, new) for what, old, new in zip(
                        _WHATS, _figures(self.before), _figures(after), strict=True)))
            self._proposed = result, Proposal(
                ALIGNMENT.reason, result.report.verdict, rows, (AlignmentChange(self.before, after, self.path),),
                "" if self.path is None else f"It is in {self.path.name}, beside the rig.")
        return self._proposed[1]

    def _state(self, drift: Drift | None) -> str:
        if self.before is None:
            return "none"
        if drift is None:
            return "not tested"
        return f"stale: {1e3 * drift.distance_m:.1f} mm off" if drift.stale else "holds"


_WHATS = ("its origin in the rig", "fingertip on the tracker", "time offset", "what is left")


def _figures(alignment: Alignment | None) -> tuple[str, str, str, str]:
    if alignment is None:
        return ("–",) * 4
    origin, point = (", ".join(f"{1e3 * value:.1f}" for value in transform.translation_m)
                     for transform in (alignment.rig_from_foreign, alignment.tracker_from_body))
    rms = "–" if alignment.rms_m is None else f"{1e3 * alignment.rms_m:.2f} mm rms"
    return f"{origin} mm", f"{point} mm", f"{1e3 * alignment.time_offset_s:+.1f} ms", rms
