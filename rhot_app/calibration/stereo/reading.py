"""From the picture files or films of several cameras to shared views: what cannot be used is named and left out."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from rhot_app.calibration.board.boards import Board
from rhot_app.calibration.board.corners import BoardView
from rhot_app.calibration.board.shared_views import BoardShot, Dropped, SharedViews
from rhot_app.calibration.lens.film import FilmFrames, choose_frames, is_film
from rhot_app.calibration.lens.views import (
    Read,
    drop_other_sizes,
    explain,
    in_natural_order,
    no_board,
    of_film,
    read_picture,
    size_of,
)
from rhot_app.calibration.verdict import Finding
from rhot_app.errors import CalibrationError
from rhot_app.progress import Progress, silent


@dataclass(frozen=True, slots=True)
class ReadPictures:
    """What the files of all cameras hold: shared `views`, the pictures that were `dropped`, and what the pictures say
    about the board's size."""

    views: SharedViews
    dropped: tuple[Dropped, ...]
    size: Finding | None


def read_shared(files: Mapping[str, Sequence[Path]], board: Board, *, offsets_s: Mapping[str, float] | None = None,
                progress: Progress = silent) -> ReadPictures:
    """Find the board in the pictures of all cameras, `files` per camera's name; or in one film of each camera, in
    moments that are chosen (`lens.film`), with `offsets_s` added to the times of a camera's film.

    Raises CalibrationError when nothing can be put together, or one camera shows the board in no picture.
    """
    if any(is_film(path) for those in files.values() for path in those):
        names, columns, dropped = _read_films(files, board, offsets_s or {}, progress)
    else:
        matched = match_files(files)
        names, dropped, columns = [shot.name for shot in matched.shots], list(matched.alone), [[] for _ in files]
        for number, shot in enumerate(matched.shots):
            progress(f"looking for the board in {shot.name}", number / len(matched.shots))
            for reads, path in zip(columns, shot.files, strict=True):
                reads.append(Read(None) if path is None else read_picture(path, board))
    for name, reads in zip(files, columns, strict=True):
        drop_other_sizes(reads)
        explain(reads, board)
        if not any(each.view is not None for each in reads):
            raise CalibrationError(no_board(name, reads, board))
        dropped += [Dropped(_name(each.path, name), each.trouble, each.code)
                    for each in reads if each.path and each.trouble]
    shots = tuple(BoardShot(name, tuple(each.view for each in row))
                  for name, row in zip(names, zip(*columns, strict=True), strict=True))
    size = size_of([each for reads in columns for each in reads], board)
    return ReadPictures(SharedViews(tuple(files), board, shots), tuple(dropped), size)


def _read_films(files: Mapping[str, Sequence[Path]], board: Board, offsets_s: Mapping[str, float],
                progress: Progress) -> tuple[list[str], list[list[Read]], list[Dropped]]:
    """Names of the moments that were chosen, and what each camera's film shows then."""
    for name, those in files.items():
        if len(those) != 1 or not is_film(those[0]):
            raise CalibrationError(f"{name}: give one film of each camera, or pictures of each.")
    frames, columns = film_frames({name: those[0] for name, those in files.items()}, board, offsets_s, progress)
    return [f"{moment.t_s:.2f} s" for moment in frames.moments], columns, []


def film_frames(films: Mapping[str, Path], board: Board, offsets_s: Mapping[str, float] | None = None,
                progress: Progress = silent) -> tuple[FilmFrames, list[list[Read]]]:
    """The frames that are chosen of one film of each camera, and what each film shows then. Raises CalibrationError."""
    offsets_s = offsets_s or {}
    paths = list(films.values())
    frames = choose_frames(paths, board, [offsets_s.get(name, 0.0) for name in films], progress=progress)
    columns = of_film(paths, frames, board)
    for name, found, reads in zip(films, frames.found, columns, strict=True):
        if not found:
            raise CalibrationError(no_board(name, reads, board))
    if not frames.moments:
        raise CalibrationError(f"In {frames.searched} frames that were searched no two cameras see the board at once. "
                               "Did the films begin together? Else align them (--offset-s).")
    return frames, columns


def read_view(path: Path, board: Board) -> BoardView:
    """The board in one picture, or in a film's frame in which it is stillest; raises CalibrationError when the file
    cannot be read or the board is not there."""
    if is_film(path):
        frames = choose_frames([path], board)
        seen = [each for moment in frames.moments for each in moment.views if each is not None]
        if not seen:
            raise CalibrationError(no_board(path.name, of_film([path], frames, board)[0], board))
        return min(seen, key=lambda each: each.badness).view
    read = read_picture(path, board)
    explain([read], board)
    if read.view is None:
        raise CalibrationError(f"{path}: {read.trouble}.")
    return read.view


def _name(path: Path, camera: str) -> str:
    """What to call a picture: with its camera, unless its own name says it (left/007.png, left07.png)."""
    return path.name if camera in path.name else f"{camera}/{path.name}"


# -- matching pictures by the numbers in their names -------------------------------------------------------------------

Key = tuple[int, ...]


@dataclass(frozen=True, slots=True)
class FileShot:
    """The pictures of one moment, one per camera, None where a camera has none; `name` is what they share."""

    name: str
    files: tuple[Path | None, ...]


@dataclass(frozen=True, slots=True)
class FileShots:
    """All moments in order, the pictures without partner, and whether the numbers in the names said what belongs
    together (`by_number`) or only the order of the names did."""

    shots: tuple[FileShot, ...]
    alone: tuple[Dropped, ...]
    by_number: bool


def match_files(files: Mapping[str, Sequence[Path]]) -> FileShots:
    """Put the pictures of all cameras together.

    `files` per camera's name. Pictures belong together when the numbers in their names are the same, leaving out
    numbers that never change; without such numbers lists of the same length are taken in order. Raises CalibrationError
    when neither works.
    """
    for name, those in files.items():
        if not those:
            raise CalibrationError(f"{name}: there are no pictures. Give a pattern in quotes, such as 'left*.jpg'.")
    keys = {name: _keys(those) for name, those in files.items()}
    shared = _common(list(keys.values()))
    if len(shared) >= max(1, min(len(those) for those in files.values()) // 2):
        return _by_number(files, keys, shared)
    lengths = {name: len(those) for name, those in files.items()}
    if len(set(lengths.values())) != 1:
        counts = ", ".join(f"{name} {count}" for name, count in lengths.items())
        raise CalibrationError(f"The lists have different lengths ({counts}) and the file names have no common "
                               "numbers: it cannot be told which pictures belong together. Number them alike, such as "
                               "left07.jpg and right07.jpg.")
    ordered = [in_natural_order(those) for those in files.values()]
    return FileShots(tuple(FileShot("/".join(path.stem for path in row), tuple(row))
                           for row in zip(*ordered, strict=True)), (), False)


def _keys(files: Sequence[Path]) -> dict[Key, Path] | None:
    """Each file under the numbers in its name that change within the list; None when they do not tell files apart."""
    numbers = [tuple(int(number) for number in re.findall(r"\d+", path.stem)) for path in files]
    if len({len(each) for each in numbers}) != 1:
        return None
    columns = list(zip(*numbers, strict=True))
    telling = [column for column in columns if len(set(column)) > 1] or columns[-1:]
    keys = list(zip(*telling, strict=True))
    if len(set(keys)) != len(files) or not keys:
        return None
    return dict(zip(keys, files, strict=True))


def _common(keys: Sequence[dict[Key, Path] | None]) -> set[Key]:
    """The numbers that at least two cameras have."""
    every = [set(each) for each in keys if each is not None]
    if len(every) != len(keys):
        return set()
    return {key for those in every for key in those if sum(key in other for other in every) >= 2}


def _by_number(files: Mapping[str, Sequence[Path]], keys: Mapping[str, dict[Key, Path] | None],
               shared: set[Key]) -> FileShots:
    tables = [keys[name] or {} for name in files]
    shots = tuple(FileShot("-".join(str(number) for number in key), tuple(table.get(key) for table in tables))
                  for key in sorted(shared))
    alone = [Dropped(path.name, "no other camera has a picture of this number", "no_partner")
             for table in tables for key, path in table.items() if key not in shared]
    return FileShots(shots, tuple(alone), True)
