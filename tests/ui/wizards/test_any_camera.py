"""A new user's first five minutes by clicks, in a small window and on real processes: from two films to a tracked hand.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from board_scene import compile_search
from person import Person, wait
from PySide6.QtCore import QSize, Qt, QTimer
from PySide6.QtWidgets import QApplication, QFileDialog, QPushButton
from screen_pictures import cut_texts
from twin_films import filmed_scene, write_films
from wizard_hands import Hands, opened

from rhot_app.calibration.board.standard_board import SQUARE_MM
from rhot_app.sources.cameras import camera_set
from rhot_app.ui.backend.session import Session
from rhot_app.ui.common.controller import Controller
from rhot_app.ui.common.settings import Settings
from rhot_app.ui.dialogs.cameras_dialog import CamerasDialog
from rhot_app.ui.main_window import MainWindow
from rhot_node.detect.fast import FastDetector
from rhot_node.detect.image import from_bgr
from rhot_node.files import resource_path
from rhot_node.markers import load_markers

SMALL = QSize(1024, 700)
LOOP_S = 50.0
"""s: longer than the films, after which they have shown all again."""


@pytest.fixture(scope="session")
def films(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    return write_films(tmp_path_factory.mktemp("films"))


class Newcomer(Person):
    """Somebody before the main window, which is small."""

    def __init__(self, window: MainWindow) -> None:
        super().__init__(window)
        window.resize(SMALL)

    def told(self) -> object:
        return self.window.toolbar.badge.word, self.window.advice.texts

    def choose(self, button: QPushButton, act) -> None:
        """Click a button that opens a dialog, and `act` in that before the click returns."""
        failed: list[BaseException] = []

        def begin() -> None:
            dialog = QApplication.activeModalWidget()
            try:
                act(dialog)
            except BaseException as exc:
                failed.append(exc)
                dialog.reject()
        QTimer.singleShot(0, begin)
        self.click(button)
        if failed:
            raise failed[0]

    def ticks(self) -> dict[str, bool]:
        """Titles and ticks of the steps, once they are there."""
        steps = self.window.next_steps
        self.until(steps.isVisible, 60.0)
        return {step.title: step.done for step in steps.steps}

    def press_step(self, title: str) -> None:
        """The button of a step."""
        assert title in self.ticks()
        self.click(next(button for button in self.window.next_steps.buttons if button.text().startswith(title)))

    def wizard(self, title: str) -> Hands:
        """The wizard that the button of a step opens."""
        self.press_step(title)
        wizard = opened(self.window.wizards, "wizard")
        assert wizard.size() == SMALL
        return Hands(wizard, SMALL)


@pytest.fixture
def newcomer(themed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    monkeypatch.setattr(camera_set, "installed_folder", lambda: None)
    controller = Controller(Session(tmp_path / "e"))
    window = MainWindow(controller, Settings(tmp_path / "app.ini"))
    person = Newcomer(window)
    yield person
    window.close()
    controller.shut_down()
    window.deleteLater()


def next_page(hands: Hands) -> None:
    """Read the page, of which all must be readable, and go on."""
    hands.until(hands.frame.next_button.isEnabled, 2 * LOOP_S)
    assert cut_texts(hands.window) == [], hands.title
    hands.next()


def show_board(hands: Hands) -> None:
    """The first pages of a wizard that needs the board: which one, and views of it until they suffice."""
    hands.type(hands.window.page.square, f"{SQUARE_MM:g}")
    hands.until(lambda: "this is the board" in hands.sentence, LOOP_S)
    next_page(hands)
    hands.until(lambda: "Enough" in hands.sentence, 3 * LOOP_S)
    next_page(hands)


def accept(hands: Hands) -> None:
    """A result that may be used is used, and the window closed."""
    while not hands.frame.next_button.text().startswith("Use"):
        next_page(hands)
    hands.until(lambda: hands.verdict is not None)
    assert hands.verdict.acceptable and cut_texts(hands.window) == [], hands.verdict
    hands.use()
    hands.click(hands.frame.next_button)


def click_colours(hands: Hands) -> None:
    """Hold pictures that show the whole hand, and click each marker's paint and the skin beside the wrist."""
    paints, view = load_markers(resource_path("markers", "rhot6.json")), hands.frame.grid.views["left"]

    def find() -> dict[str, tuple[float, float]]:
        found = FastDetector(paints).detect(from_bgr(view.shown.bgr)) if view.shown is not None else ()
        return {paints.ids[mark.index]: (mark.x, mark.y) for mark in found if mark.found}
    seen: dict[str, tuple[float, float]] = {}
    while set(seen) != set(paints.ids):
        hands.until(lambda: set(find()) == set(paints.ids), LOOP_S)
        hands.key(Qt.Key.Key_Space)
        hands.until(lambda: "held" in hands.sentence)
        hands.run(0.2)
        seen = find()
        if set(seen) != set(paints.ids):  # an older picture was held
            hands.key(Qt.Key.Key_Space)
    x, y = seen["wrist"]
    for place in (*(seen[name] for name in paints.ids), (x, y - 25.0)):
        hands.run(0.1)
        hands.click(view, view.to_widget(*place))
    hands.key(Qt.Key.Key_Space)


@pytest.mark.timeout(900)
@pytest.mark.study("rhot_app/ui", "rhot_app/sources/cameras")
def test_two_films_lead_to_a_calibrated_and_tracked_hand(newcomer, films, tmp_path, monkeypatch):
    compile_search()

    def choose_films(dialog: CamerasDialog) -> None:
        monkeypatch.setattr(QFileDialog, "getOpenFileNames", lambda *args: (films, ""))
        wait(dialog.film_button.isEnabled)
        newcomer.click(dialog.film_button)
        wait(dialog.open_button.isEnabled)
        assert cut_texts(dialog) == []
        newcomer.click(dialog.open_button)
    newcomer.choose(newcomer.window.welcome.cameras_button, choose_films)
    assert newcomer.ticks() == {"Track painted markers": True, "Print the board": False, "Calibrate each lens": False,
                                "Put the cameras together": False, "Compare the cameras' times": False,
                                "Teach the colours": False, "Measure your hand": False}
    assert newcomer.window.size() == SMALL and newcomer.window.screen_parts.scene.isVisible()
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *args: (str(tmp_path / "board.pdf"), ""))
    newcomer.press_step("Print the board")
    newcomer.until(lambda: newcomer.ticks()["Print the board"])
    for camera in ("left", "right"):
        hands = newcomer.wizard("Calibrate each lens")
        assert hands.window.page.which.currentText() == camera
        show_board(hands)
        accept(hands)
    newcomer.until(lambda: newcomer.ticks()["Calibrate each lens"])
    hands = newcomer.wizard("Put the cameras together")
    show_board(hands)
    hands.type(hands.window.page.baseline.lineEdit(), "75")
    next_page(hands)
    accept(hands)
    newcomer.until(lambda: newcomer.ticks()["Put the cameras together"])
    hands = newcomer.wizard("Teach the colours")
    click_colours(hands)
    hands.until(lambda: "Enough" in hands.sentence, 3 * LOOP_S)
    next_page(hands)
    accept(hands)
    newcomer.until(lambda: newcomer.ticks()["Teach the colours"])
    newcomer.until(lambda: newcomer.window.toolbar.badge.word == "TRACKING", 2 * LOOP_S)
    state = newcomer.window.controller.live.state
    distance_m = float(np.linalg.norm(state.joint_positions[0]))
    assert distance_m == pytest.approx(filmed_scene().settings.distance_m, abs=0.15)
