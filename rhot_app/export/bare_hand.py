"""A bare hand tracked through recorded videos into a table, with a summary and pictures that show what was found."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.registry import calibration
from rhot_app.errors import ExportError, RecordingError, note_loss
from rhot_app.export.export import check_place, format_of, whole_file
from rhot_app.export.formats import all_formats
from rhot_app.export.overlay import overlay
from rhot_app.export.pictures import check_pictures, side_by_side, whole_pictures
from rhot_app.export.plan import Plan
from rhot_app.export.states import BLOCK, states_of
from rhot_app.handfit.adaptation import Adapted, adapt
from rhot_app.progress import Progress, silent
from rhot_app.project import Rig
from rhot_app.rig_history import accept_hand, require_hand_place
from rhot_app.sources.frame_sets import CameraVideo, frame_sets, frames_left_out, overlap
from rhot_app.state import HandState
from rhot_app.tracking.contours.follower import HandFollower
from rhot_node.detect.foreground import Foreground, learn_background, skin_foreground

Image = NDArray[np.uint8]

BACKGROUND_PICTURES: Final = 16
"""Pictures of each camera from which its background is learnt: a pixel's noise is then known to 1/sqrt(2 n), 18 %."""

TABLES: Final = (".csv", ".parquet", ".npz")


@dataclass(frozen=True, slots=True)
class BareHandSummary:
    """What came of a run. `frame_sets`: states, one after every set of frames; `tracked` of them show the hand;
    `starts`: how often it was found; `lost`: intervals without a hand, s from the first state. `step_s` (K,): times
    that the tracked steps took; `seconds`: the whole run, with reading, searching and drawing. `left_out`: frames
    outside the time that all videos show. `adapted`: the hand that was written, None without."""

    frame_sets: int
    tracked: int
    starts: int
    lost: tuple[tuple[float, float], ...]
    step_s: NDArray[np.float64]
    seconds: float
    left_out: int
    adapted: Adapted | None = None

    def document(self) -> dict[str, Any]:
        """The same for JSON."""
        steps = [None if not len(self.step_s) else float(np.quantile(self.step_s, q)) for q in (0.5, 0.99)]
        return {"frame_sets": self.frame_sets, "tracked": self.tracked / max(self.frame_sets, 1), "starts": self.starts,
                "computed_per_s": self.frame_sets / self.seconds,
                "step_p50_ms": None if steps[0] is None else 1e3 * steps[0],
                "step_p99_ms": None if steps[1] is None else 1e3 * steps[1],
                "lost_s": [list(one) for one in self.lost], "frames_left_out": self.left_out,
                "adapted": None if self.adapted is None else self.adapted.document()}


def learn_backgrounds(videos: Sequence[CameraVideo], seconds: float | None = None) -> list[Foreground]:
    """What each camera's background looks like, from a video without a hand, or from its first `seconds` within the
    time that all videos show. Raises RecordingError with fewer than two pictures."""
    learnt = []
    first, _ = overlap(videos) if seconds is not None else (0, 0)
    for video in videos:
        wanted = np.ones(len(video.times_ns), np.bool_)
        if seconds is not None:
            wanted = (video.times_ns >= first) & (video.times_ns < first + round(1e9 * seconds))
        pictures = video.some(wanted, BACKGROUND_PICTURES)
        if len(pictures) < 2:
            raise RecordingError(f"{video.path}: a background needs two pictures without a hand at least. Record some, "
                                 "or give more --background-seconds.")
        learnt.append(learn_background(skin_foreground(), pictures))
    return learnt


def track_videos(rig: Rig, videos: Sequence[CameraVideo], foreground: Sequence[Foreground] | None, *,
                 known_size: bool = True, empty_s: float = 0.0, start_frame: int | None = None,
                 out: Path | None = None, pictures: Path | None = None, again: bool = False,
                 hand_file: Path | None = None, progress: Progress = silent) -> BareHandSummary:
    """Track the bare hand of `rig`, whose nodes are the videos' cameras in their order.

    `foreground`: as learnt of each camera's background, or None. `empty_s`: so long no hand is expected.
    `start_frame`: the frame set, from 0, in which the hand is in its start pose, which no check confirms; None: it is
    followed from where it is seen to have taken that. `out`: a table of the states (docs/export.md). `pictures`: an
    .avi or .mp4 file, or a folder of PNG files, with what was found. `hand_file`: where the rig's hand, adapted to the
    one that was found last, is written; what was there is kept beside it; a loss is noted where too little was seen of
    it (`errors.note_loss`). Files appear when they are whole. Raises RecordingError, ExportError, RigError.
    """
    check_outputs(videos, out, pictures, again, hand_file)
    first, last = overlap(videos)
    run = HandFollower(rig, foreground, known_size=known_size,
                       empty_until_ns=first + round(1e9 * empty_s) if start_frame is None else last + 1,
                       period_ns=min(video.period_ns for video in videos))
    tracker, spent = run.hand, list[tuple[int, bool]]()
    begun = time.perf_counter()
    with contextlib.ExitStack() as stack:
        table = stack.enter_context(open_table(rig, videos[0].path.name, out)) if out is not None else None
        fps = 1e9 / min(video.period_ns for video in videos)
        drawn = stack.enter_context(whole_pictures(pictures, fps)) if pictures is not None else None
        for number, frames in enumerate(frame_sets(videos)):
            if number == start_frame:
                run.follow(tracker.start_pose, frames.first_ns)
            progress("tracking", min(max((frames.first_ns - first) / max(last - first, 1), 0.0), 1.0))
            state = run.step(frames.images, frames.t_ns)
            spent.append((state.t_master_ns, state.tracked))
            if table is not None:
                table.add(state)
            if drawn is not None:
                def draw(c: int, picture: Image, state: HandState = state) -> Image:
                    frame = tracker.frames[c]
                    return picture if frame is None or not run.confirmed else overlay(
                        picture, frame, tracker.filter.newest.state, tracker.cameras[c].project(state.joint_positions))
                drawn.add(side_by_side(tracker.cameras, frames.images, state.condition.value, draw))
        if start_frame is not None and start_frame >= len(spent):
            raise RecordingError(f"--start {start_frame}: the videos show {len(spent)} frames together, 0 to "
                                 f"{len(spent) - 1}. Give the number of one of them.")
        if table is not None:
            table.finish()
    seconds = time.perf_counter() - begun
    adapted = None
    if hand_file is not None and run.key_frames.sufficient:
        adapted = adapt(rig.hand, run.key_frames.kept)
        if adapted.verdict.acceptable:
            accept_hand(hand_file, adapted.hand, calibration("adapted").reason)
        else:
            note_loss(str(hand_file), f"{hand_file}: not written. {adapted.verdict.findings[0].sentence}")
            adapted = None
    elif hand_file is not None:
        note_loss(str(hand_file), f"{hand_file}: not written, the hand was not adapted. Since it was found last, the "
                                  "videos tell too little of its lengths. Show it from all sides, and bend and spread "
                                  "every finger; a hand that is hardly tracked tells nothing.")
    return BareHandSummary(len(spent), sum(tracked for _, tracked in spent), run.starts, lost_intervals(spent),
                           np.array(run.step_s), seconds, frames_left_out(videos), adapted)


def lost_intervals(spent: Sequence[tuple[int, bool]]) -> tuple[tuple[float, float], ...]:
    """(from, to) s after the first state of every stretch of (time ns, tracked) without a hand; `to`: when it is there
    again, or the last state."""
    found: list[tuple[float, float]] = []
    begin: int | None = None
    for t, tracked in spent:
        if tracked and begin is not None:
            found.append((1e-9 * (begin - spent[0][0]), 1e-9 * (t - spent[0][0])))
            begin = None
        elif not tracked and begin is None:
            begin = t
    if begin is not None:
        found.append((1e-9 * (begin - spent[0][0]), 1e-9 * (spent[-1][0] - spent[0][0])))
    return tuple(found)


def check_outputs(videos: Sequence[CameraVideo], out: Path | None, pictures: Path | None, again: bool,
                  hand_file: Path | None, kept: Path | None = None) -> None:
    """Refuse what cannot be written, before anything is tracked. Raises ExportError, RigError."""
    named = [(option, path.resolve()) for option, path in (
        ("--out", out), ("--overlay", pictures), ("--adapt", hand_file), ("--log", kept)) if path is not None]
    for k, (option, path) in enumerate(named):
        other = next((earlier for earlier, place in named[:k] if place == path), None)
        if other is not None:
            raise ExportError(f"{path}: {other} and {option} would both write it; give each a file of its own.")
    if out is not None and out.suffix.lower() not in TABLES:
        raise ExportError(f"{out}: a bare hand is written as .csv, .parquet or .npz; rhot export has the other formats "
                          "for raw logs.")
    for video in videos:
        if out is not None:
            check_place(video.path, out, again)
        if pictures is not None:
            check_pictures(video.path, pictures, again)
        if kept is not None:
            check_place(video.path, kept, again, "--log")
    if hand_file is not None:
        require_hand_place(hand_file)


class StateTable:
    """States on their way to a file, a block at a time."""

    def __init__(self, rig: Rig, name: str, kind: str, path: Path, zero_ns: int | None) -> None:
        self._rig, self._name, self._kind, self._path, self._zero_ns = rig, name, kind, path, zero_ns
        self._waiting: list[HandState] = []
        self._writer: Any = None

    def add(self, state: HandState) -> None:
        """Take one state."""
        self._waiting.append(state)
        if len(self._waiting) == BLOCK:
            self._write()

    def finish(self) -> None:
        """Write what is left."""
        self._write()
        self._writer.finish()

    def close(self) -> None:
        """Let go of the file."""
        if self._writer is not None:
            with contextlib.suppress(OSError):
                self._writer.close()

    def _write(self) -> None:
        if self._writer is None:
            self._writer = all_formats()[self._kind].writer(Plan(
                self._path, self._rig, "rig", "m" if self._kind == "npz" else "mm", "hand", None, self._name,
                datetime.now(UTC).isoformat(timespec="seconds"),
                self._waiting[0].t_master_ns if self._zero_ns is None else self._zero_ns))
        if self._waiting:
            self._writer.add(states_of(self._waiting))
        self._waiting = []


@contextlib.contextmanager
def open_table(rig: Rig, name: str, out: Path, zero_ns: int | None = None) -> Iterator[StateTable]:
    """A table of the states of `name`, whole when the context ends. `zero_ns`: master time at which its seconds begin,
    None for the first state's."""
    with (whole_file(out, lambda: None) as path,
          contextlib.closing(StateTable(rig, name, format_of(None, out), path, zero_ns)) as table):
        yield table


def closing_sentences(document: dict[str, Any]) -> list[str]:
    """What the summaries of landmarks and contours have in common: rate, losses, files."""
    out = [f"Computed: {document['computed_per_s']:.1f} frame sets a second overall, with reading and drawing."]
    if document["lost_s"] and document["tracked"]:
        out.append("No hand at " + ", ".join(f"{a:.2f} to {b:.2f}" for a, b in document["lost_s"]) + " s.")
    return [*out, *(f"Written: {document[key]}" for key in ("out", "overlay", "log", "hand_file") if document.get(key))]
