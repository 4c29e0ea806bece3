"""A bare hand tracked through recorded videos into a table, with a summary and pictures that show what was found."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.overlay import overlay
from rhot_app.barehand.tracker import BareHandTracker
from rhot_app.errors import ExportError, RecordingError
from rhot_app.export.export import check_place, format_of, make_writer, whole_file
from rhot_app.export.pictures import check_pictures, whole_pictures
from rhot_app.export.plan import Plan
from rhot_app.export.states import BLOCK, states_of
from rhot_app.progress import Progress, silent
from rhot_app.project import Rig
from rhot_app.sources.frame_sets import CameraVideo, FrameSet, frame_sets, frames_left_out, overlap
from rhot_app.state import UNESTIMATED, Condition, HandState, Knowledge
from rhot_node.detect.foreground import Foreground, foreground_map, learn_background, learn_skin, skin_foreground

Image = NDArray[np.uint8]
Points = NDArray[np.float64]

BACKGROUND_PICTURES: Final = 16
"""Pictures of each camera from which its background is learnt: a pixel's noise is then known to 1/sqrt(2 n), 18 %."""

MOST: Final = 0.5
"""Part above which more speaks for a hand than against it: of the contour that is found, of joints on foreground."""

CONFUSED_M: Final = 0.02
"""Mean distance of two hands' joints, m, from which fingers are taken for each other: neighbouring knuckles are so far
apart in the hand files."""

FASTEST_M_S: Final = 4.0
"""m/s: twice the speed of the fastest motion in `resources/motions`. Chosen, not measured."""

TABLES: Final = ("csv", "parquet", "npz")
_TEXT_RGB: Final = (255, 255, 255)


@dataclass(frozen=True, slots=True)
class BareHandSummary:
    """What came of a run. `frame_sets`: states, one after every set of frames; `tracked` of them show the hand;
    `starts`: how often it was found; `lost`: intervals without a hand, s from the first state. `step_s` (K,): times
    that the tracked steps took. `left_out`: frames outside the time that all videos show."""

    frame_sets: int
    tracked: int
    starts: int
    lost: tuple[tuple[float, float], ...]
    step_s: NDArray[np.float64]
    left_out: int

    def document(self) -> dict[str, Any]:
        """The same for JSON."""
        steps = [None if not len(self.step_s) else float(np.quantile(self.step_s, q)) for q in (0.5, 0.99)]
        return {"frame_sets": self.frame_sets, "tracked": self.tracked / max(self.frame_sets, 1), "starts": self.starts,
                "rate_hz": None if not steps[0] else 1.0 / steps[0],
                "step_p50_ms": None if steps[0] is None else 1e3 * steps[0],
                "step_p99_ms": None if steps[1] is None else 1e3 * steps[1],
                "lost_s": [list(one) for one in self.lost], "frames_left_out": self.left_out}


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


class BareHandRun:
    """Tracks through frame sets; looks for the hand while there is none, and says so in the states."""

    def __init__(self, rig: Rig, foreground: Sequence[Foreground] | None, *, known_size: bool,
                 empty_until_ns: int) -> None:
        """`foreground`: of each camera; None: the colours of skin are learnt while the hand is looked for.
        `empty_until_ns`: no hand is looked for before."""
        self.tracker = BareHandTracker(rig, known_size=known_size, foreground=foreground)
        self.starts = 0
        self.step_s: list[float] = []
        self._skin, self._empty_until_ns = foreground is None, empty_until_ns
        self._names = tuple(node.name for node in rig.nodes)
        self._following = False
        self._proposed: tuple[int, Points] | None = None
        self._count = 0

    def step(self, frames: FrameSet) -> HandState:
        """The state after one frame set. LOST or SEARCHING, without numbers, where no hand is found."""
        begun = time.perf_counter()
        following = self._following
        if not following and not self._found(frames):
            self._proposed = None
            return self._none(frames, begun)
        state = self.tracker.step(frames.images, frames.t_ns)
        good = state.tracked and self._supported(frames) and self._on_foreground(frames, state, whole=not following)
        self._following = good and (following or self._confirmed(state))
        if not self._following:
            return self._none(frames, begun)
        if following:
            self.step_s.append(time.perf_counter() - begun)
        else:
            self.starts += 1
            self._proposed = None
        self._count += 1
        return replace(state, sequence=self._count - 1)

    @property
    def following(self) -> bool:
        """Whether the newest state has a hand."""
        return self._following

    def _found(self, frames: FrameSet) -> bool:
        whole = all(image is not None for image in frames.images)
        if not whole or frames.first_ns < self._empty_until_ns:
            return False
        if self._skin:
            self.tracker.foreground = [learn_skin(image) for image in frames.images if image is not None]
        return self.tracker.find(frames.images, frames.first_ns)

    def _supported(self, frames: FrameSet) -> bool:
        """Whether the cameras of this set find the contour that the hand should have."""
        seen = np.sum([self.tracker.fit.seen[c].sum(axis=0) for c, image in enumerate(frames.images)
                       if image is not None], axis=0)
        return bool(seen[0] > MOST * seen[1])

    def _on_foreground(self, frames: FrameSet, state: HandState, *, whole: bool) -> bool:
        """Whether most joints lie on foreground in every camera that shows most of them, of which there must be one;
        `whole`: every camera must show most of them."""
        shown = []
        for camera, image, known in zip(self.tracker.cameras, frames.images, self.tracker.foreground, strict=True):
            if image is None:
                continue
            places = camera.project(state.joint_positions)
            inside = np.all((places > -0.5) & (places < [camera.width - 0.5, camera.height - 0.5]), axis=1)
            columns, rows = np.round(places[inside]).astype(int).T
            shown.append(bool(np.mean(inside) > MOST))
            if shown[-1] and np.mean(foreground_map(image, known, 1)[rows, columns] > 0.5) <= MOST:
                return False
        return all(shown) if whole else any(shown)

    def _confirmed(self, state: HandState) -> bool:
        """Whether the hand that was found in the frame set before is the same one. Finding is a random search: two of
        them agree by chance on a wrong hand less probably than one is wrong."""
        before, self._proposed = self._proposed, (state.t_master_ns, state.joint_positions)
        if before is None:
            return False
        centre, earlier = state.joint_positions.mean(axis=0), before[1].mean(axis=0)
        pace = float(np.linalg.norm(centre - earlier)) / max(1e-9 * (state.t_master_ns - before[0]), 1e-3)
        shape = np.linalg.norm((state.joint_positions - centre) - (before[1] - earlier), axis=1)
        return pace < FASTEST_M_S and float(np.mean(shape)) < CONFUSED_M

    def _none(self, frames: FrameSet, begun: float) -> HandState:
        self._count += 1
        return no_hand(self._count - 1, frames.first_ns, Condition.LOST if self.starts else Condition.SEARCHING,
                       self._names, time.perf_counter() - begun)


def no_hand(sequence: int, t_ns: int, condition: Condition, cameras: tuple[str, ...], filter_s: float) -> HandState:
    """A state without markers that says nothing of a hand."""
    unknown, nothing = int(Knowledge.UNKNOWN), np.empty((0, 3))
    return HandState(
        sequence=sequence, t_master_ns=t_ns, t_receive_ns=t_ns, condition=condition, marker_ids=(),
        marker_positions=nothing, marker_raw_positions=nothing, marker_covariances=np.empty((0, 3, 3)),
        marker_knowledge=np.empty(0, np.uint8), camera_names=cameras, camera_pixels=np.empty((len(cameras), 0, 2)),
        camera_flags=np.empty((len(cameras), 0), np.uint16), joint_positions=np.full((21, 3), np.nan),
        joint_knowledge=np.full(21, unknown, np.uint8), fingertip_positions=np.full((5, 3), np.nan),
        angles=np.full(21, np.nan), angle_knowledge=np.full(21, unknown, np.uint8),
        world_from_palm=np.full((4, 4), np.nan), palm_knowledge=Knowledge.UNKNOWN, epipolar_error_px=np.empty(0),
        **UNESTIMATED | {"hand_scale": np.nan}, latency_s={"filter": filter_s})


# -- The whole run ----------------------------------------------------------------------------------------------------

def track_videos(rig: Rig, videos: Sequence[CameraVideo], foreground: Sequence[Foreground] | None, *,
                 known_size: bool = True, empty_s: float = 0.0, out: Path | None = None, pictures: Path | None = None,
                 again: bool = False, progress: Progress = silent) -> BareHandSummary:
    """Track the bare hand of `rig`, whose nodes are the videos' cameras in their order.

    `foreground`: as learnt of each camera's background, or None. `empty_s`: so long no hand is looked for. `out`: a
    table of the states (docs/export.md). `pictures`: an .avi or .mp4 file, or a folder of PNG files, with what was
    found. Files appear when they are whole. Raises RecordingError, ExportError, TrackingError.
    """
    for video in videos:
        if out is not None:
            check_table(video.path, out, again)
        if pictures is not None:
            check_pictures(video.path, pictures, again)
    first, last = overlap(videos)
    run = BareHandRun(rig, foreground, known_size=known_size,
                      empty_until_ns=first + round(1e9 * empty_s) if empty_s else first)
    spent: list[tuple[int, bool]] = []
    with contextlib.ExitStack() as stack:
        table = stack.enter_context(_table(rig, videos[0].path.name, out)) if out is not None else None
        fps = 1e9 / min(video.period_ns for video in videos)
        drawn = stack.enter_context(whole_pictures(pictures, fps)) if pictures is not None else None
        for frames in frame_sets(videos):
            progress("tracking", min(max((frames.first_ns - first) / max(last - first, 1), 0.0), 1.0))
            state = run.step(frames)
            spent.append((state.t_master_ns, state.tracked))
            if table is not None:
                table.add(state)
            if drawn is not None:
                drawn.add(side_by_side(run, frames, state))
        if table is not None:
            table.finish()
    return BareHandSummary(len(spent), sum(tracked for _, tracked in spent), run.starts, lost_intervals(spent),
                           np.array(run.step_s), frames_left_out(videos))


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


# -- What is written --------------------------------------------------------------------------------------------------

def check_table(video: Path, target: Path, again: bool) -> None:
    """Refuse a table that cannot be written, before anything is tracked. Raises ExportError."""
    if format_of(None, target) not in TABLES:
        raise ExportError(f"{target}: a bare hand is written as .csv, .parquet or .npz; rhot export has the other "
                          "formats for raw logs.")
    check_place(video, target, again)


class _Table:
    """States on their way to a file, a block at a time."""

    def __init__(self, rig: Rig, name: str, kind: str, path: Path) -> None:
        self._rig, self._name, self._kind, self._path = rig, name, kind, path
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
            self._writer = make_writer(self._kind, Plan(
                self._path, self._rig, "rig", "m" if self._kind == "npz" else "mm", "hand", None, self._name,
                datetime.now(UTC).isoformat(timespec="seconds"), self._waiting[0].t_master_ns))
        if self._waiting:
            self._writer.add(states_of(self._waiting))
        self._waiting = []


@contextlib.contextmanager
def _table(rig: Rig, name: str, out: Path) -> Iterator[_Table]:
    with (whole_file(out, lambda: None) as path,
          contextlib.closing(_Table(rig, name, format_of(None, out), path)) as table):
        yield table


def side_by_side(run: BareHandRun, frames: FrameSet, state: HandState) -> Image:
    """All cameras' pictures (H, W, 3) RGB of a frame set beside each other, with the hand's contour, slices and
    skeleton, and the state's condition. A camera without picture is black."""
    tracker, shown = run.tracker, []
    for camera, image, frame in zip(tracker.cameras, frames.images, tracker.frames, strict=True):
        picture = np.zeros((camera.height, camera.width, 3), np.uint8) if image is None else image.copy()
        if run.following and image is not None and frame is not None:
            picture = overlay(picture, frame, tracker.filter.newest.state, camera.project(state.joint_positions))
        cv2.putText(picture, state.condition.value, (8, 24), cv2.FONT_HERSHEY_SIMPLEX, 0.7, _TEXT_RGB, 2, cv2.LINE_AA)
        shown.append(picture)
    height = max(picture.shape[0] for picture in shown)
    return np.hstack([np.pad(picture, ((0, height - picture.shape[0]), (0, 0), (0, 0))) for picture in shown])
