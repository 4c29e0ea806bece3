"""From picture files and films to views of a board: what cannot be used is named and left out, the rest goes on."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rhot_app.calibration.board.boards import Board
from rhot_app.calibration.board.corners import BoardView, Gray, detect
from rhot_app.calibration.board.shared_views import Dropped
from rhot_app.calibration.board.size_check import Beyond, look_beyond, size_finding, why_missing
from rhot_app.calibration.lens.film import FilmFrames, choose_frames, is_film
from rhot_app.calibration.verdict import Finding
from rhot_app.errors import CalibrationError
from rhot_app.progress import Progress, silent, within
from rhot_node import pictures
from rhot_node.errors import PictureError

MOST_EXPLAINED = 8
"""Pictures of one camera that are searched for the reason why they show no board: that takes a second each."""


@dataclass(slots=True)
class Read:
    """One picture on its way: its view, or the trouble with it in words and its code ("file", "no_board").

    `beyond` says whether the board goes on where it should end; `path` is None where a camera has no picture.
    """

    path: Path | None
    view: BoardView | None = None
    trouble: str = ""
    code: str = ""
    beyond: Beyond | None = None


@dataclass(frozen=True, slots=True)
class ViewSet:
    """One camera's views in the order of its files, the pictures that were `dropped`, and what the pictures say about
    the board's size, None when it is as said."""

    views: tuple[BoardView, ...]
    dropped: tuple[Dropped, ...]
    size: Finding | None


def read_views(files: Sequence[Path], board: Board, *, progress: Progress = silent) -> ViewSet:
    """Find the board in the pictures and films of one camera; of a film, in frames that are chosen
    (`lens.film`). Raises CalibrationError when none shows it, and says why."""
    if not files:
        raise CalibrationError("There are no pictures. Give a pattern in quotes, such as 'left*.jpg'.")
    reads = []
    for number, path in enumerate(files):
        progress(f"looking for the board in {path.name}", number / len(files))
        if is_film(path):
            part = within(progress, number / len(files), (number + 1) / len(files))
            reads += of_film([path], choose_frames([path], board, progress=part), board)[0]
        else:
            reads.append(read_picture(path, board))
    drop_other_sizes(reads)
    progress("looking for what is wrong with the other pictures", 0.95)
    explain(reads, board)
    views = tuple(each.view for each in reads if each.view is not None)
    if not views:
        raise CalibrationError(no_board(f"{files[0].parent}", reads, board))
    dropped = tuple(Dropped(each.path.name, each.trouble, each.code) for each in reads if each.path and each.trouble)
    return ViewSet(views, dropped, size_of(reads, board))


def of_film(films: Sequence[Path], frames: FilmFrames, board: Board) -> list[list[Read]]:
    """The frames that were chosen of films as pictures, film by film; of one without a board, why that is."""
    reads = [[Read(path, None if seen is None else seen.view, beyond=None if seen is None else seen.beyond)
              for seen in (moment.views[k] for moment in frames.moments)] for k, path in enumerate(films)]
    for those, path, without in zip(reads, films, frames.unexplained, strict=True):
        those += [Read(path, None, why_missing(gray, board), "no_board") for gray in without]
    return reads


def read_picture(path: Path, board: Board) -> Read:
    """Look for the board in one file."""
    gray, trouble = open_picture(path)
    if gray is None:
        return Read(path, None, trouble, "file")
    view = detect(gray, board, source=path.name)
    if view is None:
        return Read(path, None, f"the board ({board.text}) was not found", "no_board")
    return Read(path, view, beyond=look_beyond(gray, view, board))


def open_picture(path: Path) -> tuple[Gray | None, str]:
    """The picture in grey levels, or None and the reason."""
    if is_film(path):
        return None, "is a film"
    try:
        return pictures.read_picture(path, grey=True), ""
    except PictureError as exc:
        return None, exc.reason


def drop_other_sizes(reads: Sequence[Read]) -> None:
    """Take out the views of a camera whose pictures have another size than most: another camera, zoom or crop."""
    sizes = Counter(each.view.size for each in reads if each.view is not None)
    if len(sizes) < 2:
        return
    (width, height), _ = sizes.most_common(1)[0]
    for each in reads:
        if each.view is not None and each.view.size != (width, height):
            each.trouble = f"is {each.view.width}x{each.view.height} px, the others are {width}x{height}"
            each.code, each.view, each.beyond = "file", None, None


def explain(reads: Sequence[Read], board: Board) -> None:
    """Find out why pictures show no board; of many only the first `MOST_EXPLAINED`."""
    lost = [each for each in reads if each.code == "no_board" and each.path is not None and not is_film(each.path)]
    for each in lost[:MOST_EXPLAINED]:
        assert each.path is not None
        gray, _ = open_picture(each.path)
        if gray is not None:
            each.trouble = why_missing(gray, board)


def no_board(name: str, reads: Sequence[Read], board: Board) -> str:
    """The message for a camera none of whose pictures can be used; `reads` after `explain`."""
    files = [each for each in reads if each.path is not None]
    lost = [each.trouble for each in files if each.code == "no_board"][:MOST_EXPLAINED]
    if not lost:
        first = files[0]
        return f"{name}: none of {len(files)} files can be used; {first.path and first.path.name} {first.trouble}."
    reason, count = Counter(lost).most_common(1)[0]
    return (f"{name}: no picture shows the board ({board.text}). Most often ({count} of {len(lost)} "
            f"looked into): {reason}.")


def size_of(reads: Sequence[Read], board: Board) -> Finding | None:
    """What the pictures say about the board's size."""
    return size_finding([each.beyond for each in reads if each.beyond is not None], board)


def in_natural_order(files: Sequence[Path]) -> list[Path]:
    """Sorted as people number them: left2 before left10."""
    return sorted(files, key=lambda path: [(int(part), "") if part.isdigit() else (-1, part)
                                           for part in re.split(r"(\d+)", path.name)])


def matching_files(pattern: str) -> list[Path]:
    """The files that a pattern names, in natural order; the folder is what stands before the first wildcard.

    Raises CalibrationError when it names a folder.
    """
    if Path(pattern).is_dir():
        raise CalibrationError(f"{pattern} is a folder; say which files in it, for example "
                               f"'{pattern.rstrip('/')}/*.jpg'.")
    parts = Path(pattern).parts
    wild = next((i for i, part in enumerate(parts) if set(part) & set("*?[")), len(parts) - 1)
    if not parts:
        return []
    return in_natural_order([path for path in Path(*parts[:wild]).glob("/".join(parts[wild:])) if path.is_file()])
