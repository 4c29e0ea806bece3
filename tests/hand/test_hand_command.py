"""``rhot hand``: what it makes, writes and draws, and that mistakes end in a sentence with nothing written."""

import json
import shutil

import cv2
import msgspec
import pytest
from shipped_rig import RIGHT_HAND

from rhot_app.__main__ import main
from rhot_app.hand.anatomy import load_hand
from rhot_app.hand.anthropometry import hand_length
from rhot_app.hand.articulated import load_articulated
from rhot_app.project import load_rig
from rhot_app.rig_history import versions
from rhot_node.files import resource_path

DIGITEYES = str(resource_path("hands", "digiteyes.json"))
RIG = resource_path("rigs", "two_pis.json")


def test_a_left_hand_of_190_mm(tmp_path, capsys):
    out = tmp_path / "mine.json"
    assert main(["hand", "--length", "190", "--side", "left", "--out", str(out)]) == 0
    hand = load_hand(out)
    assert hand.side == "left"
    assert hand.name == "left hand, 190 mm"
    assert hand_length(hand) == pytest.approx(0.190, abs=1e-6)
    assert hand.fingers["middle"].bones_mm[1] == pytest.approx(0.170 * 190)
    assert str(out) in capsys.readouterr().out


def test_proportions_of_the_file_stay(tmp_path):
    out = tmp_path / "mine.json"
    assert main(["hand", "--length", "200", "--proportions", "file", "--name", "me", "--out", str(out)]) == 0
    hand = load_hand(out)
    factor = 0.2 / hand_length(RIGHT_HAND)
    assert hand.name == "me"
    assert hand.fingers["ring"].bones_mm[0] == pytest.approx(factor * RIGHT_HAND.fingers["ring"].bones_mm[0], abs=1e-5)


def test_rows_and_picture(tmp_path):
    rows, picture = tmp_path / "rows.json", tmp_path / "hand.png"
    assert main(["hand", "--rows", "--out", str(rows), "--draw", str(picture)]) == 0
    assert len(load_articulated(rows).frames) == 31
    assert cv2.imread(str(picture)).shape == (480, 960, 3)


def test_json_of_an_articulated_file(capsys):
    assert main(["hand", DIGITEYES, "--length", "200", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (len(told["bodies"]), told["state_numbers"], told["degrees_of_freedom"]) == (16, 28, 27)
    assert told["length_mm"] == pytest.approx(200)
    assert told["written"] == []


def test_a_hand_goes_to_a_rig_which_keeps_the_former(tmp_path):
    path = tmp_path / "rig.json"
    shutil.copy(RIG, path)
    before = load_rig(path)
    assert main(["hand", "--length", "200", "--proportions", "file", "--rig", str(path)]) == 0
    rig = load_rig(path)
    assert hand_length(rig.hand) == pytest.approx(0.2, abs=1e-6)
    assert rig.hand.side == before.hand.side
    assert msgspec.structs.replace(rig, hand=before.hand) == before
    assert load_rig(versions(path)[0].path) == before


@pytest.mark.parametrize(("arguments", "complaint"), [
    (["--length", "19"], "100 to 260 mm"),
    (["--length", "1900", "--proportions", "file"], "100 to 260 mm"),
    ([DIGITEYES, "--length", "200", "--proportions", "table"], "--proportions file"),
    (["--proportions", "file"], "--length"),
    ([DIGITEYES, "--rig", str(RIG)], "a rig tracks a rhot-hand"),
    (["nowhere.json"], "no such file"),
    ([str(RIG)], 'not a "rhot-hand" file'),
])
def test_mistakes_are_sentences_and_write_nothing(arguments, complaint, tmp_path, capsys):
    out = tmp_path / "mine.json"
    assert main(["hand", *arguments, "--out", str(out)]) == 2
    assert complaint in capsys.readouterr().err
    assert not out.exists()


def test_a_drawing_of_another_kind_is_refused(tmp_path, capsys):
    assert main(["hand", "--draw", str(tmp_path / "h.xyz")]) == 2
    assert "ends in .png" in capsys.readouterr().err and not list(tmp_path.iterdir())


def test_a_missing_folder_is_noticed_before_anything_is_written(tmp_path, capsys):
    out = tmp_path / "mine.json"
    assert main(["hand", "--out", str(out), "--draw", str(tmp_path / "nowhere" / "hand.png")]) == 2
    assert "there is no folder" in capsys.readouterr().err
    assert not out.exists()
