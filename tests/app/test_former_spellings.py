"""Command lines as they were spelt before are read for one release, and the note says how they are spelt now."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from rhot_app import former_spellings
from rhot_app.__main__ import main, parse
from rhot_app.former_spellings import present_spelling
from rhot_app.simulator.scene.scene_arguments import scene_of, show_of

DOCUMENT = (Path(__file__).parents[2] / "docs" / "commands.md").read_text()


@pytest.mark.parametrize(("former", "now"), [
    ("simulate --bare --tone 7 --sleeve --out a",
     "simulate --show bare-hand --set show.tone=7 --set show.sleeve=true --out a"),
    ("simulate --kelvin=3000 --back --out a", "simulate --set lamp.kelvin=3000 --set facing=back --out a"),
    ("simulate --show board --charuco --board 8x5 --out a",
     "simulate --show board --set show.pattern=charuco --set show.size=8x5 --out a"),
    ("evaluate --lamp 0.5", "evaluate live --set lamp.brightness=0.5"),
    ("evaluate --compare --recording walk.tsv --sketched",
     "evaluate compare --motions rest,wave,grasp,pinch,fast --motions walk.tsv --sketched"),
    ("evaluate --compare --motions rest --recording walk.tsv", "evaluate compare --motions rest --motions walk.tsv"),
    ("evaluate --seeds 2 --bare-hand", "evaluate bare-hand --seeds 2"),
    ("mouse", "mouse run"), ("mouse --measure --places 3", "mouse measure --places 3"),
    ("mouse --gain 2 --on-table", "mouse run --set gain=2 --set on_table=true"),
    ("calibrate stereo --left a --right b --kind charuco --board 8x5 --marker-mm 20 --legacy-pattern",
     "calibrate stereo --left a --right b --board charuco,8x5,marker_mm=20,legacy"),
    ("calibrate lens --images a --dictionary=DICT_5X5_50 --marker-mm 9",
     "calibrate lens --images a --board marker_mm=9,dictionary=DICT_5X5_50"),
    ("calibrate stereo --left a --left-intrinsics l.json", "calibrate stereo --left a --intrinsics left=l.json"),
    ("target aprilgrid --board 6x4 --tag-spacing 0.2 --out b.svg", "target aprilgrid,6x4,tag_spacing=0.2 --out b.svg"),
    ("bare-hand --fps 30 --video left=a --video=right=b", "track left=a right=b --fps 30"),
    ("certify --step static=s --step=ruler:30=r --step rod=o --step plumb=p --facing back --marker m --rod-mm 5 "
     "--rod-markers a,b", "certify --step static:back=s --step=ruler:30:m=r --step rod:5:a,b=o --step plumb:a,b=p"),
    ("--directory here mouse --pointer", "mouse run --directory here --pointer"),
    ("mouse --simulated --directory here --gain 2", "mouse run --simulated --directory here --set gain=2"),
    ("simulate --bare --show hand --out a", "simulate --show bare-hand --out a"),
    ("simulate --scene NONE --moving --out a", "simulate --scene NONE --set show.moving=true --out a"),
])
def test_a_former_line_is_read_as_the_present_one(former: str, now: str, capsys: pytest.CaptureFixture[str]) -> None:
    _, parsed = parse(shlex.split(former))
    note = capsys.readouterr().err
    assert note == f"rhot: this is the former spelling, read for one release. Now: rhot {now}\n"
    assert vars(parse(shlex.split(now))[1]) == vars(parsed) and not capsys.readouterr().err


@pytest.mark.parametrize(("former", "left", "now"), [
    ("--charuco --square-mm 25", "--charuco, --square-mm", ""), ("--moving --on-table", "--moving, --on-table", ""),
    ("--marker index --distance 0.5", "--marker", "--distance 0.5"), ("--ruler-mm 100", "--ruler-mm", ""),
    ("--show ruler --square-mm 25", "--square-mm", "--show ruler"),
    ("--bare --charuco", "--charuco", "--show bare-hand"),
    ("--show board --marker thumb --board=8x5", "--marker", "--show board --set show.size=8x5")])
def test_a_former_option_of_what_is_not_shown_is_left_out(former: str, left: str, now: str,
                                                          capsys: pytest.CaptureFixture[str]) -> None:
    parsed = parse(["simulate", *former.split(), "--out", "a"])[1]
    assert f"says nothing of what is shown: {left}. Now: rhot simulate" in capsys.readouterr().err
    assert vars(parse(["simulate", *now.split(), "--out", "a"])[1]) == vars(parsed)
    show_of(parsed)


def test_a_bare_hand_beside_another_show_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", "--show", "empty", "--bare", "--out", str(tmp_path / "a")]) == 2
    assert "leave out --show empty" in capsys.readouterr().err and not list(tmp_path.iterdir())


def test_a_command_of_two_words_may_follow_the_apps_options(capsys: pytest.CaptureFixture[str]) -> None:
    parsed = parse(shlex.split("--directory here mouse run --pointer"))[1]
    assert vars(parse(shlex.split("mouse run --directory here --pointer"))[1]) == vars(parsed)
    assert not capsys.readouterr().err


@pytest.mark.parametrize("present", ["replay a.rhotlog --json", "evaluate --help", "mouse run --json", "export --back",
                                     "evaluate compare --sketched", "simulate --set facing=back --out a",
                                     "calibrate stereo --board 9x6", "target charuco,8x5 --out a.svg", "track a b"])
def test_a_present_line_stays(present: str) -> None:
    assert present_spelling(present.split()) == present.split()


def test_an_option_without_its_value_is_left_to_the_parser(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        parse(["simulate", "--out", "a", "--kelvin"])
    assert "--kelvin" in capsys.readouterr().err


def test_former_scenes_are_the_same_scenes() -> None:
    parsed = parse(shlex.split("simulate --kelvin 3000 --mains 50 --worn 0.2 --glove 1,2,3 --back --seed 4 "
                               "--background clutter --show marker --marker ring --distance 0.4 --moving --out a"))[1]
    scene, show = scene_of(parsed), show_of(parsed)
    settings = scene.settings
    assert (settings.lamp.kelvin, settings.lamp.mains_hz, settings.worn_paint) == (3000, 50, 0.2)
    assert (settings.glove_rgb, settings.facing, settings.background, scene.seed) == ((1, 2, 3), "back", "clutter", 4)
    assert (show.marker, show.distance_m, show.moving) == ("ring", 0.4, True)  # type: ignore[union-attr]


def test_every_former_option_is_in_the_document() -> None:
    told = set(re.findall(r"--[a-z-]+", DOCUMENT.partition("## Former spellings")[2]))
    gone = {option for options in former_spellings._OPTIONS.values() for option in options} - {"--legacy"}
    assert gone <= told, gone - told
