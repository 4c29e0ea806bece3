"""Films in place of live cameras, by clicks: a lens, cameras together, films that began apart, and wrong files."""

from __future__ import annotations

import threading
from pathlib import Path

import cv2
import numpy as np
import pytest
from board_scene import BoardScene, compile_search
from fake_backend import InProcessSolver
from fake_engine import synthetic_rig
from msgspec.structs import replace
from PySide6.QtWidgets import QFileDialog
from test_lens_wizard import PLACES as LENS_PLACES
from test_stereo_wizard import PLACES as STEREO_PLACES
from test_stereo_wizard import TRUE_BASELINE_M
from wizard_rig import FakeRigClient

from rhot_app.calibration.board.boards import STANDARD_BOARD
from rhot_app.project import CameraPose, load_rig
from rhot_app.ui.wizards import lens, stereo

FPS = 25.0
PLACES = STEREO_PLACES[:12]
DARK, LATER = 5, 3  # frames before the light goes on; frames by which the right film began later


@pytest.fixture(scope="module", autouse=True)
def compiled():
    compile_search()


def film(path: Path, pictures: list[np.ndarray]) -> Path:
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"MJPG"), FPS, pictures[0].shape[1::-1])
    writer.set(cv2.VIDEOWRITER_PROP_QUALITY, 98)
    for picture in pictures:
        writer.write(picture)
    writer.release()
    return path


def shown(scene: BoardScene, node: int, places, held: int) -> list[np.ndarray]:
    """The board resting for `held` frames at each place, in the dark before the first."""
    pictures = []
    for place in places:
        scene.place(*place)
        pictures += held * [scene.draw(node)]
    return [np.uint8(0.6 * pictures[0])] * DARK + pictures


@pytest.fixture(scope="module")
def films(tmp_path_factory) -> dict[str, Path]:
    """`lens` of one camera; `left`, and `late`, of right, that began later."""
    folder, scene = tmp_path_factory.mktemp("films"), BoardScene(synthetic_rig(), STANDARD_BOARD)
    left, right = (shown(scene, node, PLACES, 2) for node in (1, 2))
    (folder / "text.mp4").write_text("no film")
    return {"lens": film(folder / "lens.avi", shown(scene, 1, LENS_PLACES, 3)), "text": folder / "text.mp4",
            "left": film(folder / "left.avi", left), "late": film(folder / "late.avi", right[LATER:]),
            "empty": film(folder / "empty.avi", 30 * [np.full((480, 640, 3), 110, np.uint8)])}


@pytest.fixture
def choose(monkeypatch):
    """Answers the next question for a file, and clicks the button that asks it."""
    def choose(hands, camera: str, path: Path | None) -> None:
        monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *args: (str(path or ""), ""))
        hands.click(hands.window.page.buttons[camera])

    return choose


def at_show_step(open_wizard, module, rig, **options):
    """The wizard where the board is shown; the live cameras see none."""
    hands = open_wizard(module.__name__.rpartition(".")[2], FakeRigClient(rig, BoardScene(rig, STANDARD_BOARD).draw),
                        **options)
    hands.type(hands.window.page.square, "25")
    hands.next()
    return hands


def test_a_lens_is_calibrated_from_a_film(open_wizard, films, choose):
    truth = synthetic_rig()
    wrong = replace(truth.nodes[0].intrinsics, fx=572.0, fy=572.0)
    hands = at_show_step(open_wizard, lens, replace(truth, nodes=(replace(truth.nodes[0], intrinsics=wrong),
                                                                  *truth.nodes[1:])))
    choose(hands, "left", None)
    assert not hands.window.step.films.paths, "a question that is not answered chooses nothing"
    choose(hands, "left", films["lens"])
    hands.until(lambda: hands.window.step.view().done)
    assert "12 frames" in hands.hint and "lens.avi" in hands.window.page.buttons["left"].text()
    assert hands.window.step.view().annotated["left"].overlay, "the board is marked in a frame of the film"
    hands.next()
    hands.solved()
    hands.next()
    hands.use()
    assert load_rig(hands.path).nodes[0].intrinsics.fx == pytest.approx(530.0, rel=0.005)


def test_wrong_films_are_a_sentence_and_the_live_camera_comes_back(open_wizard, films, choose):
    hands = at_show_step(open_wizard, lens, synthetic_rig())
    for name, words in (("text", "decoded"), ("empty", "no picture shows the board")):
        choose(hands, "left", films[name])
        hands.until(lambda words=words: words in hands.window.step.view().hint)
        assert not hands.frame.next_button.isEnabled() and hands.frame.work_view.again_button.isVisible()
    hands.click(hands.window.page.live)
    assert not hands.window.page.live.isVisible() and "Show the whole board" in hands.sentence
    choose(hands, "left", films["lens"])
    hands.until(lambda: hands.window.step.view().done)


def test_a_board_that_is_larger_than_the_form_says_is_named(open_wizard, films, choose):
    scene = BoardScene(synthetic_rig(), STANDARD_BOARD)
    hands = open_wizard("lens", FakeRigClient(synthetic_rig(), scene.draw))
    hands.window.page.cols.setValue(8)
    hands.type(hands.window.page.square, "25")
    hands.next()
    choose(hands, "left", films["lens"])
    hands.until(lambda: "larger than 8x6" in hands.hint)
    assert not hands.frame.next_button.isEnabled() and not hands.window.step.views


def test_reading_is_cancelled_and_begun_again(open_wizard, films, choose):
    reached, go_on = threading.Event(), threading.Event()

    class Waiting(InProcessSolver):
        def run(self, function, arguments, progress, options=None):
            def report(text, fraction):
                reached.set()
                go_on.wait()
                progress(text, fraction)

            return super().run(function, arguments, report, options)

    hands = at_show_step(open_wizard, lens, synthetic_rig(), make_solver=Waiting)
    choose(hands, "left", films["lens"])
    hands.until(reached.is_set)
    hands.click(hands.frame.work_view.cancel_button)
    go_on.set()
    hands.until(hands.frame.work_view.again_button.isVisible)
    assert not hands.window.step.views and not hands.frame.next_button.isEnabled()
    hands.click(hands.frame.work_view.again_button)
    hands.until(lambda: hands.window.step.view().done)


def test_cameras_are_put_together_from_films_that_began_apart(open_wizard, films, choose):
    truth = synthetic_rig()
    wrong = replace(truth.nodes[1], pose=CameraPose(translation_m=(0.06, 0.0, 0.0)))
    hands = at_show_step(open_wizard, stereo, replace(truth, nodes=(truth.nodes[0], wrong)))
    choose(hands, "left", films["left"])
    assert "right" in hands.sentence and not hands.frame.next_button.isEnabled()
    page = hands.window.page
    page.began.setCurrentIndex(page.began.findData("flash"))
    choose(hands, "right", films["late"])
    hands.until(lambda: hands.window.step.view().may_go_on)
    assert "right +0.12" in hands.hint and len(hands.window.step.views.shots) >= 10
    hands.next()
    hands.click(hands.window.page.skip)
    hands.next()
    hands.solved()
    hands.next()
    hands.next()
    hands.use()
    _, other = load_rig(hands.path).nodes
    assert np.linalg.norm(other.pose.translation_m) == pytest.approx(TRUE_BASELINE_M, abs=3e-4)


def test_films_that_began_apart_are_not_put_together_as_they_are(open_wizard, films, choose):
    hands = at_show_step(open_wizard, stereo, synthetic_rig())
    choose(hands, "left", films["left"])
    choose(hands, "right", films["late"])
    hands.until(lambda: hands.window.step.view().may_go_on or hands.window.step.films.problem)
    if hands.window.step.view().may_go_on:
        hands.next()
        hands.click(hands.window.page.skip)
        hands.next()
        hands.until(lambda: hands.window.step.result is not None or hands.window.step.view().hint)
        assert not hands.frame.next_button.isEnabled()
