"""The controls of a step that shows a board to live cameras, or takes films of it in their place."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from PySide6.QtWidgets import QComboBox, QFileDialog, QPushButton, QWidget

from rhot_app.ui.wizards.framework.page import Page
from rhot_app.ui.wizards.models.films import FilmedStep
from rhot_app.ui.wizards.models.step import StepView
from rhot_node.pictures import VIDEO_SUFFIXES

_BEGAN = (("together", "Films began together"), ("sound", "Align by sound"), ("flash", "Align by a flash"))
_FILTER = f"Films ({' '.join(f'*{suffix}' for suffix in sorted(VIDEO_SUFFIXES))});;All files (*)"


class FilmsPage(Page):
    """A button for the film of each camera, how they are aligned, and the way back."""

    def __init__(self, step: FilmedStep, parent: QWidget | None = None) -> None:
        super().__init__(step, parent)
        self._shows = step
        self.buttons: dict[str, QPushButton] = {}
        self.began = QComboBox()
        for value, text in _BEGAN:
            self.began.addItem(text, value)
        self.began.setToolTip("How it is known by how much one film began later than the other: by what all cameras "
                              "heard, or by a light that went on once.")
        self.began.currentIndexChanged.connect(self._align)
        self.live = _button("Live cameras", "Films are left out; views are taken of the live cameras again.")
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
                button = _button("", "A recorded film of the board in place of the live camera: move the board, rest "
                                 "it for half a second, and move it on. Frames are chosen by themselves.")
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
            button.setText(f"Use a film of {camera} …" if path is None else f"{camera}: {path.name}")
        self.began.setVisible(len(films.cameras) > 1 and bool(films.paths))
        self.live.setVisible(bool(films.paths))

    def _choose(self, camera: str) -> None:
        chosen = self._shows.films.paths
        folder = next((path.parent for path in chosen.values()), Path.home())
        name, _ = QFileDialog.getOpenFileName(self, f"Film of {camera}", str(folder), _FILTER)
        if name:
            self._shows.films.choose(camera, Path(name))
            self.changed.emit()

    def _align(self) -> None:
        self._shows.films.set_began(self.began.currentData())
        self.changed.emit()

    def _use_live(self) -> None:
        self._shows.use_live()
        self.changed.emit()


def _button(text: str, meaning: str) -> QPushButton:
    button = QPushButton(text)
    button.setAutoDefault(False)
    button.setToolTip(meaning)
    return button
