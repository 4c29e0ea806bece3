"""Films in place of live cameras, for the steps that show a board: which film of which camera, and what they show."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import cv2
import numpy as np

from rhot_app.calibration.board.boards import Board
from rhot_app.calibration.board.shared_views import BoardShot
from rhot_app.calibration.lens.views import size_of
from rhot_app.calibration.stereo.reading import film_frames
from rhot_app.calibration.verdict import Finding
from rhot_app.progress import Progress, within
from rhot_app.sources.film_offset import FilmOffset, offset_sentence, offsets_of
from rhot_app.ui.backend.feed import Picture
from rhot_app.ui.wizards.models.board_form import OTHER_BOARD
from rhot_app.ui.wizards.models.drawing import board_marks
from rhot_app.ui.wizards.models.step import AnnotatedPicture, Step, StepView, Task

Began = Literal["together", "sound", "flash"]
"""How it is known when films of several cameras began."""


@dataclass(frozen=True, slots=True, eq=False)
class FilmShots:
    """What films show: the `shots` that were chosen, each with a view of each camera or None.

    `size`: what they say against the board's size. `stillest`: the frame in which each camera's board moves least.
    `offsets`: of films that were aligned.
    """

    shots: tuple[BoardShot, ...]
    size: Finding | None
    stillest: Mapping[str, AnnotatedPicture]
    offsets: Mapping[str, FilmOffset]


def read_films(films: Mapping[str, Path], board: Board, began: Began, *, progress: Progress) -> FilmShots:
    """Choose frames of one film of each camera. Raises CalibrationError and RecordingError."""
    aligned = 0.0 if began == "together" else 0.3
    offsets = offsets_of(films, began, within(progress, 0.0, aligned)) if aligned else {}
    frames, columns = film_frames(films, board, {name: one.seconds for name, one in offsets.items()},
                                  within(progress, aligned, 1.0))
    shots = tuple(BoardShot(f"{moment.t_s:.2f} s", tuple(None if seen is None else seen.view for seen in moment.views))
                  for moment in frames.moments)
    stillest = {}
    for name, one in zip(films, frames.stillest, strict=True):
        if one is not None:
            gray, view = one
            picture = Picture(name, np.asarray(cv2.cvtColor(gray, cv2.COLOR_GRAY2BGR), np.uint8), 0, 0, 0)
            stillest[name] = AnnotatedPicture(picture, board_marks(view, board))
    return FilmShots(shots, size_of([each for reads in columns for each in reads], board), stillest, offsets)


class Films:
    """The films that a person chose for `cameras`, and what came of them."""

    def __init__(self, cameras: tuple[str, ...]) -> None:
        self.cameras = cameras
        self.paths: dict[str, Path] = {}
        self.began: Began = "together"
        self.read: FilmShots | None = None
        self.problem = ""

    def choose(self, camera: str, path: Path) -> None:
        """The film of a camera."""
        self.paths[camera] = path
        self.forget_read()

    def set_began(self, began: Began) -> None:
        """How films of several cameras are aligned."""
        if began != self.began:
            self.began = began
            self.forget_read()

    def forget(self) -> None:
        """Back to the live cameras."""
        self.paths.clear()
        self.forget_read()

    def forget_read(self) -> None:
        """The films are to be read anew: others, or for another board."""
        self.read, self.problem = None, ""

    @property
    def complete(self) -> bool:
        """Whether there is a film of each camera."""
        return len(self.paths) == len(self.cameras)

    def task(self, board: Board) -> Task | None:
        """The search for the board, as long as it was not done."""
        if not self.complete or self.read is not None:
            return None
        return Task("Looking for the board in the films", read_films,
                    ({name: self.paths[name] for name in self.cameras}, board, self.began))

    def view(self, shown: StepView) -> StepView:
        """What a step that shows a board says while films are chosen; `shown` is what it says of the views it has."""
        if not self.complete:
            missing = next(name for name in self.cameras if name not in self.paths)
            return StepView(f"Choose the film of {missing}, too.", hint="Or go back to the live cameras.")
        if self.read is None:
            sentence = "Choose another film, or the live cameras." if self.problem else "One moment: films are read."
            return StepView(sentence, hint=self.problem)
        if self.read.size is not None:
            return StepView(OTHER_BOARD, hint=f"{self.read.size.figure} {self.read.size.cause}",
                            annotated=self.read.stillest)
        said = f"{len(self.read.shots)} frames were chosen."
        if self.read.offsets:
            said += f" {offset_sentence(self.read.offsets, self.began)}"
        if shown.done:
            sentence = "Enough: press Next."
        elif shown.may_go_on:
            sentence = "Press Next. Better: a film in which the board comes to all parts of the picture."
        else:
            sentence = "Too few: film the board in more places, still in each."
        return replace(shown, sentence=sentence, hint=said, annotated=self.read.stillest)


class FilmedStep(Step):
    """Base of the steps that show a board to live cameras, or take `films` of it in their place."""

    films: Films

    @property
    def board(self) -> Board:
        """The board that is shown."""
        raise NotImplementedError

    def begin(self) -> None:
        """Forget what was taken."""
        raise NotImplementedError

    def keep(self, shot: BoardShot) -> None:
        """Take what films show at one moment."""
        raise NotImplementedError

    def use_live(self) -> None:
        """Leave the films out, and what was taken of them."""
        self.films.forget()
        self.begin()

    def task(self) -> Task | None:
        """The films are read, where there is one of each camera."""
        return self.films.task(self.board) if self.films.paths else None

    def take_result(self, result: FilmShots) -> None:
        """What films show takes the place of all else."""
        self.begin()
        self.films.read = result
        for shot in result.shots if result.size is None else ():
            self.keep(shot)

    def take_failure(self, sentence: str) -> None:
        """Why the films cannot be used."""
        self.films.problem = sentence
