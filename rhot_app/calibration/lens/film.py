"""Films of a moving board: the frames to calibrate from, chosen where the board is still, sharp and somewhere new.

Of all frames some hundred are searched, evenly spread. The corners that are found in one are followed to the frames
before and after it by optical flow (Lucas and Kanade 1981): how far they move says how still the board is. Frames are
then taken in the order of their quality, each only where it shows the board in another pose than those before.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board.boards import Board
from rhot_app.calibration.board.corners import BoardView, Gray, detect, to_gray
from rhot_app.calibration.board.size_check import Beyond, look_beyond
from rhot_app.calibration.lens.coverage import BLURRED_PX, NEW, STILL_PX, place
from rhot_app.errors import CalibrationError
from rhot_app.progress import Progress, silent, within
from rhot_node.errors import PictureError
from rhot_node.pictures import VIDEO_SUFFIXES, open_video

Array = NDArray[np.float64]

SEARCHED: Final = 300
"""Frames of a film at most: half a minute of work, ten a second of a film of as long."""

MOST: Final = 40
"""Frames that are taken at most: a lens is known no better from more, which takes longer."""

UNEXPLAINED: Final = 4
"""Frames that are kept of a film without a board, to find out why."""

FEWEST: Final = 8
"""Frames with which a calibration is not short of views; further ones are hardly worse than these."""

_WORSE: Final = 2.0  # times the badness of the last of them
_FPS: Final = (1.0, 1000.0)


@dataclass(frozen=True, slots=True, eq=False)
class FilmView:
    """The board in a frame, `badness`: 1 where the board moves, or is blurred, as much as in a still that wizards take;
    and whether the board goes on where it should end."""

    view: BoardView
    badness: float
    beyond: Beyond | None


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """What the films show at one time: `t_s` of the first film, and the board in each film that shows it."""

    t_s: float
    views: tuple[FilmView | None, ...]


@dataclass(frozen=True, slots=True, eq=False)
class FilmFrames:
    """The `moments` that were chosen of films, in the order of time.

    `searched`: how many frames of each film. For each film, `found`: in how many of them the board is; `stillest`: the
    frame in which it moves least, with its view; `unexplained`: some pictures where it has no board, to find out why.
    """

    moments: tuple[Moment, ...]
    searched: int
    found: tuple[int, ...]
    stillest: tuple[tuple[Gray, BoardView] | None, ...]
    unexplained: tuple[tuple[Gray, ...], ...]


def is_film(path: Path) -> bool:
    """Whether a file is a film, by its name."""
    return path.suffix.lower() in VIDEO_SUFFIXES


def choose_frames(films: Sequence[Path], board: Board, offsets_s: Sequence[float] = (), *,
                  progress: Progress = silent) -> FilmFrames:
    """The frames of one film to calibrate from, or of several that were taken at the same time.

    `offsets_s`: added to each film's times, where they did not begin together. Of several films a moment counts where
    two show the board. Raises CalibrationError: no film, no frame rate, or no common time.
    """
    clips = [_Clip.open(path, offset) for path, offset in
             zip(films, offsets_s or [0.0] * len(films), strict=True)]
    begin, end = max(clip.begin_s for clip in clips), min(clip.end_s for clip in clips)
    if end <= begin and len(clips) > 1:
        raise CalibrationError(f"{' and '.join(clip.path.name for clip in clips)} have no common time. Are they of one "
                               "recording?")
    first = clips[0]
    frames = np.arange(first.nearest(begin), first.nearest(end) + 1)
    times = first.begin_s + frames[::-(-len(frames) // SEARCHED)] / first.fps
    searches = [_search(clip, times, board, within(progress, k / len(clips), (k + 1) / len(clips)))
                for k, clip in enumerate(clips)]
    rows = [search.views for search in searches]
    moments = [Moment(float(t), views) for t, views in zip(times, zip(*rows, strict=True), strict=True)
               if sum(view is not None for view in views) >= min(2, len(clips))]
    chosen = sorted(_choose(moments, board), key=lambda moment: moment.t_s)
    return FilmFrames(tuple(chosen), len(times), tuple(sum(view is not None for view in row) for row in rows),
                      tuple(search.stillest for search in searches),
                      tuple(() if any(search.views) else search.without for search in searches))


def frame_at(path: Path) -> NDArray[np.uint8]:
    """(H, W, 3) BGR, the frame of a film at a time: the path ends in ``@SECONDS``. Raises CalibrationError."""
    name, _, seconds = path.name.rpartition("@")
    try:
        at_s = float(seconds)
    except ValueError:
        at_s = np.nan
    film = path.with_name(name) if name else path
    if not name or not 0.0 <= at_s < 1e6:
        raise CalibrationError(f"{path}: a film has many pictures; say which by its second, as in {path.name}@2.5.")
    clip = _Clip.open(film, 0.0)
    if at_s > clip.end_s:
        raise CalibrationError(f"{film}: the film ends at {clip.end_s:.2f} s, before {at_s:g} s.")
    for _, picture in clip.frames(np.array([clip.nearest(at_s)])):
        return picture
    raise CalibrationError(f"{film}: its frame at {at_s:g} s cannot be decoded. Is the film complete?")


def names_frame(path: Path) -> bool:
    """Whether a path is a film's, or one of its frames by ``@SECONDS``."""
    return is_film(path) or (not path.exists() and is_film(path.with_name(path.name.rpartition("@")[0] or path.name)))


# -- one film ----------------------------------------------------------------------------------------------------------

@dataclass(frozen=True, slots=True)
class _Clip:
    """A film: frames, frames/s, and when it begins by the clock of all films."""

    path: Path
    count: int
    fps: float
    begin_s: float

    @property
    def end_s(self) -> float:
        """When its last frame was taken."""
        return self.begin_s + (self.count - 1) / self.fps

    @classmethod
    def open(cls, path: Path, begin_s: float) -> _Clip:
        with _opened(path) as capture:
            if not capture.grab():
                raise CalibrationError(f"{path}: no frame of it can be decoded. Is it a film, and complete?")
            count, fps = int(capture.get(cv2.CAP_PROP_FRAME_COUNT)), float(capture.get(cv2.CAP_PROP_FPS))
        if count < 1 or not _FPS[0] <= fps <= _FPS[1]:
            raise CalibrationError(f"{path}: it does not say its frame rate and length. Write it anew with a video "
                                   "program.")
        return cls(path, count, fps, begin_s)

    def nearest(self, t_s: float) -> int:
        """The number of the frame nearest to a time."""
        return int(np.clip(round((t_s - self.begin_s) * self.fps), 0, self.count - 1))

    def frames(self, numbers: NDArray[np.int_]) -> Iterator[tuple[int, NDArray[np.uint8]]]:
        """(number, picture (H, W, 3) BGR) of the frames of these numbers, rising; a film that ends early ends it."""
        wanted = set(numbers.tolist())
        with _opened(self.path) as capture:
            for k in range(int(numbers[-1]) + 1):
                if not capture.grab():
                    return
                if k in wanted:
                    read, picture = capture.retrieve()
                    if read:
                        yield k, np.asarray(picture, np.uint8)


@contextlib.contextmanager
def _opened(path: Path) -> Iterator[cv2.VideoCapture]:
    try:
        capture = open_video(path)
    except PictureError as exc:
        raise CalibrationError(str(exc)) from exc
    try:
        yield capture
    finally:
        capture.release()


@dataclass(frozen=True, slots=True, eq=False)
class _Search:
    """The board at each time, the frame in which it is stillest, and frames in which it is not."""

    views: list[FilmView | None]
    stillest: tuple[Gray, BoardView] | None
    without: tuple[Gray, ...]


def _search(clip: _Clip, times: Array, board: Board, progress: Progress) -> _Search:
    """Look for the board at each of `times` (T,) s."""
    numbers = np.array([clip.nearest(t) for t in times])
    beside = np.unique(np.clip(np.concatenate([numbers - 1, numbers, numbers + 1]), 0, clip.count - 1))
    found: dict[int, FilmView | None] = {}
    without: list[Gray] = []
    before: tuple[int, Gray, BoardView | None] | None = None
    best, stillest = np.inf, None
    for number, picture in clip.frames(beside):
        gray, view = to_gray(picture), None
        if before is not None and number == before[0] + 1 and before[2] is not None:
            seen = found[before[0]] = _worse(found[before[0]], _motion(before[1], gray, before[2]))
            if seen is not None and seen.badness < best:
                best, stillest = seen.badness, (before[1], seen.view)
        if number in numbers:
            progress(f"looking for the board in {clip.path.name}", number / clip.count)
            view = detect(gray, board, thorough=False, source=f"{clip.path.name} at {number / clip.fps:.2f} s")
            found[number] = None
            if view is not None:
                moved = (_motion(gray, before[1], view) if before is not None and number == before[0] + 1 else 0.0)
                beyond = look_beyond(gray, view, board)
                blur = view.blur_px / BLURRED_PX if np.isfinite(view.blur_px) else 1.0
                found[number] = FilmView(view, max(blur, moved), beyond)
            elif len(without) < UNEXPLAINED and number >= len(without) * clip.count / UNEXPLAINED:
                without.append(gray)
        before = number, gray, view
    return _Search([found.get(int(number)) for number in numbers], stillest, tuple(without))


def _motion(here: Gray, there: Gray, view: BoardView) -> float:
    """How far the board's corners are in a frame beside it, in units of a still board's noise; inf where they are lost.
    """
    if here.shape != there.shape:
        return np.inf
    corners = np.ascontiguousarray(view.pixels[:, None], np.float32)
    moved, tracked, _ = cv2.calcOpticalFlowPyrLK(here, there, corners, None)  # type: ignore[call-overload]
    kept = tracked.ravel() == 1
    if kept.mean() < 0.5:
        return np.inf
    return float(np.median(np.linalg.norm(moved[kept, 0] - corners[kept, 0], axis=1))) / STILL_PX


def _worse(seen: FilmView | None, badness: float) -> FilmView | None:
    return None if seen is None else replace(seen, badness=max(seen.badness, badness))


# -- the choice --------------------------------------------------------------------------------------------------------

def _choose(moments: Sequence[Moment], board: Board) -> list[Moment]:
    """The best moments, each in another pose than those before. Beyond as many as a calibration needs only such as are
    hardly worse."""
    graded = sorted(moments, key=_badness)
    chosen: list[Moment] = []
    places: list[list[Array | None]] = []
    for moment in graded:
        if len(chosen) == MOST or (len(chosen) >= FEWEST
                                   and _badness(moment) > max(1.0, _WORSE * _badness(chosen[FEWEST - 1]))):
            break
        where = [None if seen is None else place(seen.view, board) for seen in moment.views]
        if all(_apart(where, other) > NEW for other in places):
            chosen.append(moment)
            places.append(where)
    return chosen


def _badness(moment: Moment) -> float:
    return max(seen.badness for seen in moment.views if seen is not None)


def _apart(one: Sequence[Array | None], other: Sequence[Array | None]) -> float:
    """How different two poses look to the camera to which they look most different; inf where none sees both."""
    return max((float(np.abs(a - b).sum()) for a, b in zip(one, other, strict=True) if a is not None and b is not None),
               default=np.inf)
