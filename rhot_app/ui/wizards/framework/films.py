"""Films in place of live cameras, for the steps that show a board: which film of which camera, and what they show."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Literal

import cv2
import numpy as np
from PySide6.QtWidgets import QComboBox, QFileDialog, QPushButton, QWidget

from rhot_app.calibration.board.boards import Board
from rhot_app.calibration.board.shared_views import BoardShot
from rhot_app.calibration.lens.views import size_of
from rhot_app.calibration.stereo.reading import film_frames
from rhot_app.calibration.verdict import Finding
from rhot_app.progress import Progress, within
from rhot_app.sources.film_offset import FilmOffset, offset_sentence, offsets_of
from rhot_app.ui.backend.feed import Picture
from rhot_app.ui.common.parts import plain_button
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.wizards.framework.board import OTHER_BOARD, BoardSearch
from rhot_app.ui.wizards.framework.drawing import board_marks
from rhot_app.ui.wizards.framework.page import Page
from rhot_app.ui.wizards.framework.step import AnnotatedPicture, Step, StepView, Task
from rhot_node.pictures import VIDEO_SUFFIXES

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
        return Task(tr("Looking for the board in the films"), read_films,
                    ({name: self.paths[name] for name in self.cameras}, board, self.began))

    def view(self, shown: StepView) -> StepView:
        """What a step that shows a board says while films are chosen; `shown` is what it says of the views it has."""
        if not self.complete:
            missing = next(name for name in self.cameras if name not in self.paths)
            return StepView(tr("Choose the film of {missing}, too.", missing=missing),
                            hint=tr("Or go back to the live cameras."))
        if self.read is None:
            sentence = tr("Choose another film, or the live cameras.") if self.problem else tr("One moment: films are "
                                                                                               "read.")
            return StepView(sentence, hint=self.problem)
        if self.read.size is not None:
            return StepView(tr(OTHER_BOARD), hint=f"{self.read.size.figure} {self.read.size.cause}",
                            annotated=self.read.stillest)
        said = tr("{shots} frames were chosen.", shots=len(self.read.shots))
        if self.read.offsets:
            said += f" {offset_sentence(self.read.offsets, self.began)}"
        if shown.done:
            sentence = tr("Enough: press Next.")
        elif shown.may_go_on:
            sentence = tr("Press Next. Better: a film in which the board comes to all parts of the picture.")
        else:
            sentence = tr("Too few: film the board in more places, still in each.")
        return replace(shown, sentence=sentence, hint=said, annotated=self.read.stillest)


class FilmedStep(Step):
    """Base of the steps that show a board to live cameras, or take `films` of it in their place."""

    films: Films
    _started = False

    def __init__(self) -> None:
        self.search = BoardSearch()

    @property
    def board(self) -> Board:
        """The board that is shown."""
        raise NotImplementedError

    def begin(self) -> None:
        """Forget what was taken."""
        self._started = True
        self.search.forget()
        self.films.forget_read()

    def shown(self) -> StepView:
        """What to do with the board, and what was taken so far."""
        raise NotImplementedError

    @property
    def other_board(self) -> Finding | None:
        """What live pictures say against the board's size."""
        return self.search.size_finding(self.board) if self._started else None

    def view(self) -> StepView:
        """The same of films; a board of another size is said first."""
        if self.films.paths:
            return self.films.view(self.shown())
        wrong = self.other_board
        return self.shown() if wrong is None else replace(
            self.shown(), sentence=tr(OTHER_BOARD), hint=f"{wrong.figure} {wrong.cause}", done=False, passable=False)

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


# -- the controls ------------------------------------------------------------------------------------------------------

_BEGAN = (("together", tr_noop("Films began together")), ("sound", tr_noop("Align by sound")),
          ("flash", tr_noop("Align by a flash")))
_ENDINGS = " ".join(f"*{suffix}" for suffix in sorted(VIDEO_SUFFIXES))


class FilmsPage(Page):
    """A button for the film of each camera, how they are aligned, and the way back."""

    def __init__(self, step: FilmedStep, parent: QWidget | None = None) -> None:
        super().__init__(step, parent)
        self._shows = step
        self.buttons: dict[str, QPushButton] = {}
        self.began = QComboBox()
        for value, text in _BEGAN:
            self.began.addItem(tr(text), value)
        self.began.setToolTip(tr("How it is known by how much one film began later than the other: by what all cameras "
                                 "heard, or by a light that went on once."))
        self.began.currentIndexChanged.connect(self._align)
        self.live = plain_button(tr("Live cameras"), tr("Films are left out; views are taken of the live cameras "
                                                        "again."))
        self.live.clicked.connect(self._use_live)
        self.column.addWidget(self.began)
        self.column.addWidget(self.live)
        self.column.addStretch(1)

    def entered(self) -> None:
        """A button for each of the step's cameras."""
        cameras = self._shows.films.cameras
        if tuple(self.buttons) != cameras:
            for button in self.buttons.values():
                self.column.removeWidget(button)
                button.deleteLater()
            self.buttons = {}
            for place, camera in enumerate(cameras):
                button = plain_button("", tr("A recorded film of the board in place of the live camera: move the "
                                             "board, rest it for half a second, and move it on. Frames are chosen by "
                                             "themselves."))
                button.clicked.connect(partial(self._choose, camera))
                self.column.insertWidget(place, button)
                button.show()
                self.buttons[camera] = button
        self.began.setCurrentIndex(self.began.findData(self._shows.films.began))
        self.show_view(StepView(""))

    def show_view(self, view: StepView) -> None:
        """The names of the films."""
        films = self._shows.films
        for camera, button in self.buttons.items():
            path = films.paths.get(camera)
            button.setText(tr("Use a film of {camera} …", camera=camera) if path is None else f"{camera}: {path.name}")
        self.began.setVisible(len(films.cameras) > 1 and bool(films.paths))
        self.live.setVisible(bool(films.paths))

    def _choose(self, camera: str) -> None:
        chosen = self._shows.films.paths
        folder = next((path.parent for path in chosen.values()), Path.home())
        name, _ = QFileDialog.getOpenFileName(self, tr("Film of {camera}", camera=camera), str(folder),
                                              tr("Films ({names});;All files (*)", names=_ENDINGS))
        if name:
            self._shows.films.choose(camera, Path(name))
            self.changed.emit()

    def _align(self) -> None:
        self._shows.films.set_began(self.began.currentData())
        self.changed.emit()

    def _use_live(self) -> None:
        self._shows.use_live()
        self.changed.emit()
