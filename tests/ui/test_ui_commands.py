"""The two commands that open the window: what they accept, what they refuse."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from rhot_app.__main__ import main
from rhot_app.simulator.scene.scene_file import SceneFields, write_scene
from rhot_app.ui import app, demo_command
from rhot_app.ui.backend.contract import TwinChoice
from rhot_node.files import resource_path


@pytest.fixture
def opened(monkeypatch):
    calls = []

    def open_window(args, *, rig, twin):
        calls.append((rig, twin))
        return 0

    monkeypatch.setattr(app, "open_window", open_window)
    monkeypatch.setattr(demo_command, "open_window", open_window)
    return calls


def test_the_demo_takes_a_motion_and_a_seed(opened):
    assert main(["demo", "--motion", "pinch", "--seed", "7"]) == 0
    assert opened == [(None, TwinChoice(motion="pinch", seed=7))]


def test_the_demo_takes_a_tracker(opened):
    assert main(["demo", "--tracker", "estimator"]) == 0
    assert opened == [(None, TwinChoice(tracker="estimator"))]


def test_the_demo_takes_a_motion_file(opened, tmp_path):
    path = tmp_path / "mine.json"
    path.write_text("{}")
    assert main(["demo", "--motion", str(path)]) == 0
    assert opened[0][1].motion == str(path)


def test_the_demo_takes_a_scene_and_what_is_given_beside_it(opened, tmp_path):
    path = tmp_path / "lamp.json"
    write_scene(path, SceneFields({"lamp": {"kelvin": 3000.0}}, {"show": "hand", "motion": "wave"}, 7))
    assert main(["demo", "--scene", str(path)]) == 0
    assert main(["demo", "--scene", str(path), "--motion", "pinch", "--seed", "2"]) == 0
    assert opened == [(None, TwinChoice(None, None, None, "classic", path)),
                      (None, TwinChoice("pinch", 2, None, "classic", path))]


@pytest.mark.parametrize(("text", "said"), [
    (None, "no such file"), ("{", "lamp.json"), ('{"format": "rhot-rig", "version": 1}', "rhot-rig"),
    ('{"format": "rhot-scene", "version": 1, "settings": {"lamp": {"kelvin": "warm"}}}', "lamp.kelvin"),
    ('{"format": "rhot-scene", "version": 1, "show": {"show": "board", "square_mm": -1}}', "square_mm")])
def test_a_scene_that_cannot_be_opens_no_window(opened, tmp_path, capsys, text, said):
    path = tmp_path / "lamp.json"
    if text is not None:
        path.write_text(text)
    assert main(["demo", "--scene", str(path)]) == 2
    assert said in capsys.readouterr().err and opened == []


def test_a_motion_beside_a_scene_without_a_hand_is_refused(opened, tmp_path, capsys):
    path = tmp_path / "board.json"
    write_scene(path, SceneFields({}, {"show": "board"}))
    assert main(["demo", "--scene", str(path), "--motion", "wave"]) == 2
    assert "--motion wave" in capsys.readouterr().err and opened == []


def test_a_motion_that_is_not_there_is_named(opened, capsys):
    assert main(["demo", "--motion", "juggle"]) == 2
    assert "no motion 'juggle'" in capsys.readouterr().err and opened == []


def test_the_app_opens_a_rig_or_the_first_page(opened, tmp_path):
    rig = resource_path("rigs", "two_pis.json")
    assert main(["--rig", str(rig)]) == 0
    assert main([]) == 0
    assert opened == [(rig, None), (None, None)]


def test_a_rig_that_is_not_there_opens_no_window(opened, tmp_path, capsys):
    assert main(["--rig", str(tmp_path / "desk.json")]) == 2
    assert "desk.json: no such file" in capsys.readouterr().err and opened == []


def test_a_directory_that_others_can_read_is_refused(tmp_path, capsys):
    shared = tmp_path / "shared"
    shared.mkdir(mode=0o755)
    assert main(["--directory", str(shared)]) == 2
    assert "open to other users" in capsys.readouterr().err


def test_options_may_stand_before_the_subcommand(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[tuple[Path | None, object]] = []
    monkeypatch.setattr("rhot_app.ui.demo_command.open_window",
                        lambda args, rig, twin: opened.append((args.directory, twin)) or 0)
    assert main(["--directory", str(tmp_path), "demo", "--seed", "3"]) == 0
    assert main(["--reset", "--directory", "demo", "demo"]) == 0
    (place, twin), (second, _) = opened
    assert place == tmp_path
    assert isinstance(twin, TwinChoice)
    assert twin.seed == 3
    assert second == Path("demo"), "the value of an option is no subcommand"


def test_an_option_that_the_subcommand_does_not_have_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["--rig", "rig.json", "demo"])
    assert ended.value.code == 2
    assert "'--rig'" in capsys.readouterr().err


def test_settings_are_kept_in_a_file_and_nothing_else(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    os.mkfifo(tmp_path / "pipe.ini")
    assert main(["--settings", str(tmp_path / "pipe.ini"), "--directory", str(tmp_path / "engine")]) == 2
    assert "pipe.ini: cannot be written (it is a pipe" in capsys.readouterr().err
