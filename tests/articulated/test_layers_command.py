"""``rhot layers``: pictures and films of visibility orders, and its refusals."""

import json

import cv2
import numpy as np
import pytest

from rhot_app.__main__ import main
from rhot_app.export import layers_command
from rhot_node.files import resource_path

FINGERS = str(resource_path("articulated", "two_fingers.json"))


def test_a_hand_is_drawn_and_its_order_is_printed(tmp_path, capsys):
    picture = tmp_path / "layers.png"
    bent = ["--angle", "index_mcp_flexion=70", "--angle", "index_pip_flexion=60"]
    assert main(["layers", *bent, "--from=70,-50", "--out", str(picture), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["order"].index("index_distal") < said["order"].index("palm")
    assert said["cut"] == []
    image = cv2.imread(str(picture))
    assert image.shape == (480, 640, 3)
    assert len(np.unique(image.reshape(-1, 3), axis=0)) > 50


def test_from_the_back_the_palm_hides_the_bent_finger(tmp_path, capsys):
    bent = ["--angle", "index_mcp_flexion=85", "--angle", "index_pip_flexion=90"]
    assert main(["layers", *bent, "--from=70,70", "--out", str(tmp_path / "back.png"), "--json"]) == 0
    order = json.loads(capsys.readouterr().out)["order"]
    assert order.index("palm") < order.index("index_distal")


def test_a_film_turns_about_the_object(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(layers_command, "FILM_FRAMES", 12)
    film = tmp_path / "turn.avi"
    assert main(["layers", FINGERS, "--out", str(film)]) == 0
    assert "1  " in capsys.readouterr().out
    video = cv2.VideoCapture(str(film))
    assert video.get(cv2.CAP_PROP_FRAME_COUNT) == 12
    assert [path.name for path in tmp_path.iterdir()] == ["turn.avi"]


@pytest.mark.parametrize(("arguments", "sentence"), [
    (["--angle", "wink=3"], "has no angle 'wink'; it has first_mcp"),
    (["--angle", "first_mcp"], "as in --angle first_mcp"), (["--angle", "first_mcp="], "'' is no number of degrees"),
    (["--angle", "first_mcp=200"], "the limits of first_mcp are -10 and 95"),
    (["--from", "30"], "give two numbers"),
    (["--from", "30,89"], "between -85 and 85")])
def test_what_cannot_be_has_a_sentence(tmp_path, capsys, arguments, sentence):
    picture = tmp_path / "layers.png"
    assert main(["layers", FINGERS, *arguments, "--out", str(picture)]) == 2
    assert sentence in capsys.readouterr().err
    assert not picture.exists()


def test_other_endings_and_missing_folders_are_refused(tmp_path, capsys):
    assert main(["layers", "--out", str(tmp_path / "layers.pdf")]) == 2
    assert ".png or .jpg" in capsys.readouterr().err
    assert main(["layers", "--out", str(tmp_path / "none" / "layers.png")]) == 2
    assert "no folder" in capsys.readouterr().err
    mine = tmp_path / "mine.png"
    mine.write_text("mine")
    assert main(["layers", FINGERS, "--out", str(mine)]) == 2
    assert "--force" in capsys.readouterr().err and mine.read_text() == "mine"
    assert main(["layers", FINGERS, "--out", str(mine), "--force"]) == 0 and cv2.imread(str(mine)) is not None
    nothing = tmp_path / "nothing.json"
    nothing.write_text(json.dumps({"format": "rhot-articulated", "version": 1, "name": "x", "root": {"name": "a"},
                                   "frames": []}))
    assert main(["layers", str(nothing), "--out", str(tmp_path / "layers.png")]) == 2
    assert "no frame has a shape" in capsys.readouterr().err
