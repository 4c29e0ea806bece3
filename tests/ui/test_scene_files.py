"""The scene of the simulated rig is saved and opened from the Rig menu."""

from __future__ import annotations

import pytest
from PySide6.QtWidgets import QFileDialog

from rhot_app.errors import SimulatorError
from rhot_app.simulator.nodes import remote
from rhot_app.simulator.nodes.remote import SCENE_NAME, TwinState
from rhot_app.simulator.render.camera_controls import Lamp
from rhot_app.simulator.scene.scene_description import BoardShow, HandShow
from rhot_app.simulator.scene.scene_file import SceneFields, SceneFile, read_scene, write_scene
from rhot_app.ui.backend.contract import TwinChoice
from rhot_app.ui.backend.session import Session
from rhot_node.files import write_document


@pytest.fixture
def answer(monkeypatch):
    """Answers the file dialogs."""
    def choose(path):
        for name in ("getSaveFileName", "getOpenFileName"):
            monkeypatch.setattr(QFileDialog, name, lambda *args: (str(path), "") if path else ("", ""))

    return choose


def test_a_scene_is_saved_and_opened_again(tracking, answer, tmp_path):
    path, actions = tmp_path / "lamp.json", tracking.window.actions_
    answer(path)
    actions.save_scene.trigger()
    tracking.until(lambda: tracking.said("was saved to", "lamp.json"))
    assert read_scene(path).show["motion"] == "wave"
    actions.open_scene.trigger()
    tracking.until(lambda: "twin lamp.json" in tracking.backend.calls)
    tracking.until(lambda: tracking.window.toolbar.badge.word == "TRACKING")
    tracking.controller.press("twin")
    tracking.until(lambda: tracking.backend.calls.count("twin lamp.json") == 2)
    tracking.until(lambda: tracking.window.toolbar.badge.word == "TRACKING")


def test_who_thinks_better_of_it_changes_nothing(tracking, answer, tmp_path):
    answer(None)
    tracking.window.actions_.save_scene.trigger()
    tracking.window.actions_.open_scene.trigger()
    tracking.run(0.1)
    assert not tracking.backend.calls and not list(tmp_path.glob("*.json"))


def test_what_cannot_be_saved_is_told(tracking, answer, tmp_path):
    answer(tmp_path / "nowhere" / "lamp.json")
    tracking.window.actions_.save_scene.trigger()
    tracking.until(lambda: tracking.said("nowhere"))
    tracking.window.passing.clear()
    tracking.backend.refuse = "the simulated rig gave no answer in 3 s."
    tracking.window.actions_.save_scene.trigger()
    tracking.until(lambda: tracking.said("no answer in 3 s"))


def test_without_the_simulated_rig_there_is_nothing_to_save(bench):
    actions = bench.window.actions_
    assert actions.open_scene.isEnabled() and not actions.save_scene.isEnabled()


@pytest.fixture
def session(tmp_path, monkeypatch):
    """A session whose twin shows a board, by another lamp than it began with."""
    directory = tmp_path / "engine"
    directory.mkdir(mode=0o700)
    write_scene(directory / SCENE_NAME, SceneFields({"preset": "fast", "lamp": {"flicker": 0.1}}, {"show": "hand"}, 7))
    now = TwinState("a board", BoardShow(on_table=True), Lamp(kelvin=3000.0, flicker=0.1))
    monkeypatch.setattr(remote.TwinRemote, "state", lambda self: now)
    return Session(directory)


def test_what_is_saved_is_what_the_twin_shows_now(session, tmp_path):
    session.save_scene(tmp_path / "now.json")
    fields = read_scene(tmp_path / "now.json")
    assert fields.shown() == BoardShow(on_table=True) and fields.seed == 7
    settings = fields.scene().settings
    assert settings.lamp == Lamp(kelvin=3000.0, flicker=0.1) and settings.preset == "fast"


@pytest.mark.parametrize(("show", "words"), [
    ({"motion": "gone.json"}, "no motion 'gone.json'"), ({"show": "board", "square_mm": "wide"}, "square_mm"),
    ({"show": "cat"}, "show")])
def test_a_scene_that_cannot_be_is_refused_while_the_other_rig_still_runs(session, tmp_path, monkeypatch, show, words):
    path = tmp_path / "scene.json"
    write_document(path, SceneFile({}, show))
    monkeypatch.setattr(session, "_clear", lambda report: pytest.fail("the other rig was ended"))
    with pytest.raises(SimulatorError, match=words):
        session.open_twin(TwinChoice(None, None, None, "classic", path), lambda text, fraction: None)


def test_a_twin_without_a_scene_file_refuses_to_save(session, tmp_path):
    (tmp_path / "engine" / SCENE_NAME).unlink()
    with pytest.raises(SimulatorError, match="no such file"):
        session.save_scene(tmp_path / "now.json")
    assert not (tmp_path / "now.json").exists()


def test_a_saved_motion_plays_again(tmp_path):
    path = tmp_path / "scene.json"
    write_scene(path, SceneFields({}, {"show": "hand", "motion": "wave", "cube": True}))
    assert read_scene(path).shown() == HandShow("wave", True)
