"""Scene files: written by a command, read by all that simulate, and refused with a sentence."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from rhot_app.__main__ import main, parse
from rhot_app.simulator.film.shot import make_shot, save_shot
from rhot_app.simulator.scene.scene import make_scene, twin_defaults
from rhot_app.simulator.scene.scene_arguments import scene_of, show_of
from rhot_app.simulator.scene.scene_description import BoardShow, HandShow, MarkerShow


def written(path: Path, **fields: Any) -> str:
    """A scene file of some fields."""
    path.write_text(json.dumps({"format": "rhot-scene", "version": 1, **fields}))
    return str(path)


def of(*words: str) -> Any:
    """What `rhot simulate` makes of some words."""
    return parse(["simulate", *words, "--out", "a"])[1]


def test_a_written_scene_is_the_scene_again(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ("--preset", "fast", "--set", "lamp.kelvin=3000", "--set", "glove_rgb=9,8,7", "--seed", "5", "--show",
             "board", "--set", "show.pattern=charuco", "--set", "show.on_table=true")
    path = tmp_path / "scene.json"
    assert main(["simulate", *words, "--out", str(path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"out": str(path)}
    asked, again = of(*words), of("--scene", str(path))
    assert scene_of(again) == scene_of(asked) and show_of(again) == show_of(asked)
    assert show_of(asked).on_table and scene_of(asked).seed == 5  # type: ignore[union-attr]
    assert main(["simulate", *words, "--out", str(path)]) == 2
    assert "exists already" in capsys.readouterr().err


def test_options_win_over_set_and_set_over_the_file(tmp_path: Path) -> None:
    path = written(tmp_path / "a.json", seed=7, settings={"distance_m": 0.5, "lamp": {"kelvin": 3000, "mains_hz": 50}},
                   show={"show": "hand", "motion": "pinch"})
    scene = scene_of(of("--scene", path, "--set", "lamp.kelvin=5000", "--set", "distance_m=0.4", "--distance", "0.3"))
    assert (scene.settings.distance_m, scene.settings.lamp.kelvin, scene.settings.lamp.mains_hz) == (0.3, 5000, 50)
    assert scene.seed == 7 and scene_of(of("--scene", path, "--seed", "2")).seed == 2
    assert show_of(of("--scene", path)) == HandShow("pinch")
    assert show_of(of("--scene", path, "--motion", "wave")) == HandShow("wave")
    assert show_of(of("--scene", path, "--show", "board")) == BoardShow(), "another thing begins anew"


def test_a_recordings_shot_is_a_scene(tmp_path: Path) -> None:
    shot = make_shot(make_scene(twin_defaults(), 9), HandShow("tap"), 1.0)
    save_shot(shot, tmp_path)
    asked = of("--scene", str(tmp_path / "shot.json"))
    assert scene_of(asked) == shot.scene and show_of(asked) == HandShow("tap")
    (tmp_path / "shot.json").write_text('{"format": "rhot-shot", "seed": 1}')
    assert main(["simulate", "--scene", str(tmp_path / "shot.json"), "--out", str(tmp_path / "new")]) == 2


@pytest.mark.parametrize(("words", "show"), [
    (("--show", "board", "--set", "show.size=9,6"), BoardShow(size="9,6")),
    (("--show", "marker", "--set", "show.marker=1"), MarkerShow("1")),
    (("--show", "marker", "--set", "show.marker=1", "--set", "show.marker=null"), MarkerShow()),
    (("--set", "show.motion=7"), HandShow("7")), (("--set", "show.motion=7", "--motion", "tap"), HandShow("tap"))])
def test_a_field_of_text_takes_what_looks_like_a_number(words: tuple[str, ...], show: object) -> None:
    assert show_of(of(*words)) == show


@pytest.mark.parametrize("option", ["--pictures=3", "--hide=thumb", "--points", "--depth-table=20,40", "--seconds=10"])
def test_a_scene_alone_takes_no_option_of_pictures(option: str, tmp_path: Path,
                                                   capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", option, "--out", str(tmp_path / "a.json")]) == 2
    assert f"leave out {option.split('=')[0]}," in capsys.readouterr().err and not list(tmp_path.iterdir())


@pytest.mark.parametrize(("fields", "said"), [
    ({"settings": {"lamp": {"kelvin": 1}}}, "scene.json: lamp.kelvin: expected a number >= 1700"),
    ({"settings": {"lampe": 1}}, 'scene.json: lampe: there is no field "lampe"; did you mean "lamp"?'),
    ({"settings": []}, "settings: expected an object"), ({"setting": {}}, 'did you mean "settings"?'),
    ({"seed": -1}, "seed: a seed is a whole number from 0 on"), ({"seed": 1.5}, "seed: expected a whole number"),
    ({"show": {"show": "zebra"}}, "show.show: 'zebra' is not one of"), ({"version": 2}, "version 2"),
    ({"show": {"show": "board", "size": 7}}, "show.size: expected text, not a whole number"),
    ({"show": {"show": "board", "tone": 7}}, 'show.tone: there is no field "tone"'),
    ({"settings": {"presets": {"wide": {"fps": "x"}}}}, "presets.wide.fps: expected a number, not text"),
    ({"settings": {"preset": "slow"}}, "preset 'slow' is none of fast, wide"), ({"format": "rhot-rig"}, "rhot-scene"),
    ({"settings": {"markers": "none.json"}}, "none.json"), ({"settings": {"markers": 6}}, "markers: expected text")])
def test_a_scene_file_that_cannot_be_is_refused(fields: dict[str, Any], said: str, tmp_path: Path,
                                                capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path / "scene.json", **fields)
    assert main(["simulate", "--scene", path, "--out", str(tmp_path / "out")]) == 2
    assert said in capsys.readouterr().err
    assert main(["simulate", "--scene", path, "--out", str(tmp_path / "new.json")]) == 2
    assert [entry.name for entry in tmp_path.iterdir()] == ["scene.json"], "nothing is half-written"


@pytest.mark.parametrize(("text", "said"), [
    ("lamp.kelvin", "write NAME=VALUE"), ("=3", "write NAME=VALUE"), ("lamp.=3", "write NAME=VALUE"),
    ("lamp=3", "expected an object {...}, not a whole number"), ("lamp.kelvin.x=3", "expected a number, not an object"),
    ("kelvin=3", 'no field "kelvin"'), ("seed=x", "a seed is a whole number"), ("show.cube=", "expected true or false"),
    ("distance_m=near", "expected a number, not text"), ("glove_rgb=1,2", "glove_rgb=1,2: expected a list"),
    ("lamp.kelvin=nan", "lamp.kelvin=nan"), ("markers=6", "there is no '6'")])
def test_a_field_that_cannot_be_set_is_refused(text: str, said: str, tmp_path: Path,
                                               capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", "--set", text, "--out", str(tmp_path / "out")]) == 2
    assert said in capsys.readouterr().err and not list(tmp_path.iterdir())
