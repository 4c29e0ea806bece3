"""From picture files to shared views: what cannot be read is named and left out, the rest goes on."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from rhot_app.calibration.board import Board, CharucoBoard, Chessboard
from rhot_app.calibration.board_size_check import Beyond, look_beyond, size_finding
from rhot_app.calibration.corners import BoardView, Gray, detect
from rhot_app.calibration.stereo_files import match_files
from rhot_app.calibration.stereo_views import Dropped, SharedViews, Shot
from rhot_app.calibration.verdict import Finding
from rhot_app.errors import CalibrationError
from rhot_app.progress import Progress, silent

_JPEG_START, _JPEG_END = b"\xff\xd8", b"\xff\xd9"
_TRIED_MIRRORED = 5


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
    rows: list[list[_Read]] = []
    for number, shot in enumerate(matched.shots):
        progress(f"looking for the board in {shot.name}", number / len(matched.shots))
        rows.append([_read(path, board) for path in shot.files])
    dropped = list(matched.alone)
    for camera in range(len(files)):
        _drop_other_sizes([row[camera] for row in rows])
    for row in rows:
        dropped += [Dropped(_name(each.path, camera), each.trouble, each.code)
                    for each, camera in zip(row, files, strict=True) if each.path and each.trouble]
    shots = tuple(Shot(shot.name, tuple(each.view for each in row))
                  for shot, row in zip(matched.shots, rows, strict=True))
    views = SharedViews(tuple(files), board, shots)
    for camera, name in enumerate(files):
        if not views.of_camera(camera):
            raise CalibrationError(_no_board(name, [row[camera] for row in rows], board))
    beyond = [each.beyond for row in rows for each in row if each.beyond is not None]
    size = size_finding(beyond, board) if isinstance(board, Chessboard) else None
    return ReadPictures(views, tuple(dropped), size)


def read_view(path: Path, board: Board) -> BoardView:
    """The board in one picture; raises CalibrationError when the file cannot be read or the board is not there."""
    read = _read(path, board)
    if read.view is None:
        raise CalibrationError(f"{path}: {read.trouble}.")
    return read.view


@dataclass(slots=True)
class _Read:
    """One picture on its way: its view, or the trouble with it."""

    path: Path | None
    view: BoardView | None = None
    trouble: str = ""
    code: str = ""
    beyond: Beyond | None = None


def _read(path: Path | None, board: Board) -> _Read:
    if path is None:
        return _Read(path)
    gray = _picture(path)
    if gray is None:
        return _Read(path, None, "cannot be read as a picture", "file")
    view = detect(gray, board, source=path.name)
    if view is None:
        return _Read(path, None, f"the board ({board.text}) was not found", "no_board")
    beyond = look_beyond(gray, view, board) if isinstance(board, Chessboard) else None
    return _Read(path, view, beyond=beyond)


def _name(path: Path, camera: str) -> str:
    """What to call a picture: with its camera, unless its own name says it (left/007.png, left07.png)."""
    return path.name if camera in path.name else f"{camera}/{path.name}"


def _picture(path: Path) -> Gray | None:
    """The picture in grey levels; None for a file that is missing, no picture, or cut off."""
    try:
        data = path.read_bytes()
    except OSError:
        return None
    if data.startswith(_JPEG_START) and data.rfind(_JPEG_END) < len(data) // 2:
        return None  # the decoder would fill up what is missing with grey
    image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_GRAYSCALE) if data else None
    return None if image is None else np.asarray(image, np.uint8)


def _drop_other_sizes(reads: Sequence[_Read]) -> None:
    """Take out the views of a camera whose pictures have another size than most."""
    sizes = Counter(each.view.size for each in reads if each.view is not None)
    if len(sizes) < 2:
        return
    (width, height), _ = sizes.most_common(1)[0]
    for each in reads:
        if each.view is not None and each.view.size != (width, height):
            each.trouble = f"is {each.view.width}x{each.view.height} px, the others are {width}x{height}"
            each.code, each.view, each.beyond = "file", None, None


def _no_board(name: str, reads: Sequence[_Read], board: Board) -> str:
    """Why no picture of a camera shows the board."""
    files = [each.path for each in reads if each.path is not None]
    if all(each.code == "file" for each in reads if each.path is not None):
        return f"{name}: none of {len(files)} files can be read as a picture ({files[0]} is the first)."
    if isinstance(board, CharucoBoard):
        for path in files[:_TRIED_MIRRORED]:
            gray = _picture(path)
            if gray is not None and detect(np.ascontiguousarray(gray[:, ::-1]), board) is not None:
                return (f"{name}: the pictures are mirrored; flipped left to right they show the board. Switch the "
                        "mirroring (hflip, selfie view) off and take them again.")
    return (f"{name}: no picture shows the board ({board.text}). Count the inner corners, where four squares meet, and "
            "see that the whole board with a white margin is in the picture, sharp and evenly lit.")
