"""From the picture files of several cameras to shared views: what cannot be used is named and left out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from rhot_app.calibration.board import Board
from rhot_app.calibration.corners import BoardView
from rhot_app.calibration.stereo_files import match_files
from rhot_app.calibration.stereo_views import Dropped, SharedViews, Shot
from rhot_app.calibration.verdict import Finding
from rhot_app.calibration.views import Read, drop_other_sizes, explain, no_board, read_picture, size_of
from rhot_app.errors import CalibrationError
from rhot_app.progress import Progress, silent


@dataclass(frozen=True, slots=True)
class ReadPictures:
    """What the files of all cameras hold: shared `views`, the pictures that were `dropped`, and what the pictures say
    about the board's size."""

    views: SharedViews
    dropped: tuple[Dropped, ...]
    size: Finding | None


def read_shared(files: Mapping[str, Sequence[Path]], board: Board, *, progress: Progress = silent) -> ReadPictures:
    """Find the board in the pictures of all cameras, `files` per camera's name.

    Raises CalibrationError when nothing can be put together, or one camera shows the board in no picture.
    """
    matched = match_files(files)
    rows: list[list[Read]] = []
    for number, shot in enumerate(matched.shots):
        progress(f"looking for the board in {shot.name}", number / len(matched.shots))
        rows.append([Read(None) if path is None else read_picture(path, board) for path in shot.files])
    dropped = list(matched.alone)
    for camera, name in enumerate(files):
        reads = [row[camera] for row in rows]
        drop_other_sizes(reads)
        explain(reads, board)
        if not any(each.view is not None for each in reads):
            raise CalibrationError(no_board(name, reads, board))
        dropped += [Dropped(_name(each.path, name), each.trouble, each.code)
                    for each in reads if each.path and each.trouble]
    shots = tuple(Shot(shot.name, tuple(each.view for each in row))
                  for shot, row in zip(matched.shots, rows, strict=True))
    size = size_of([each for row in rows for each in row], board)
    return ReadPictures(SharedViews(tuple(files), board, shots), tuple(dropped), size)


def read_view(path: Path, board: Board) -> BoardView:
    """The board in one picture; raises CalibrationError when the file cannot be read or the board is not there."""
    read = read_picture(path, board)
    explain([read], board)
    if read.view is None:
        raise CalibrationError(f"{path}: {read.trouble}.")
    return read.view


def _name(path: Path, camera: str) -> str:
    """What to call a picture: with its camera, unless its own name says it (left/007.png, left07.png)."""
    return path.name if camera in path.name else f"{camera}/{path.name}"
