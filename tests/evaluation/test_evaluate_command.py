"""`rhot evaluate compare` on takes without pictures, and what it refuses."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from rhot_app.__main__ import main
from rhot_app.evaluation.compare import TRACKERS, compare, consistency_table, table
from rhot_app.evaluation.data_sets import Order
from rhot_app.simulator.scene.scene import make_scene, twin_defaults

RAMP = Path(__file__).resolve().parents[2] / "benchmarks" / "motions" / "ramp.json"
SHORT = ("evaluate", "compare", "--sketched", "--trackers", "classic", "--seeds", "2", "--seconds", "1.6")
QUICK = (*SHORT, "--motions", "rest, pinch")


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> str:
    return str(tmp_path_factory.mktemp("logs") / "logs")


def test_a_comparison_prints_tables_and_json(logs: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*QUICK, "--logs", logs]) == 0
    printed = capsys.readouterr()
    table, legend, honesty = printed.out.split("\n\n")
    assert [line.split()[0] for line in table.splitlines()[2:]] == ["rest"] * 3 + ["pinch"] * 3
    assert legend.startswith("Root mean squares") and honesty.startswith("NEES")
    assert "comparing: done in" in printed.err
    assert main([*QUICK, "--logs", logs, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["outdated"] == 0 and len(found["runs"]) == 4
    assert 0.0 < found["motions"]["rest"]["classic"]["tip_visible_mm"] < 2.0
    assert found["honesty"]["rest"]["classic"]["tips"]["average"] is None


def test_ratios_to_a_baseline_are_printed(logs: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*QUICK, "--logs", logs, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    kept = {motion: trackers[list(trackers)[-1]] for motion, trackers in found["motions"].items()}
    baseline = tmp_path / "baseline.json"
    baseline.write_text(json.dumps({"tracker": "the same", "motions": kept}))
    assert main([*QUICK, "--logs", logs, "--baseline", str(baseline)]) == 0
    rest = next(line for line in capsys.readouterr().out.split("over the baseline")[1].splitlines()
                if line.startswith("rest"))
    assert rest.split()[1] == "1.00"
    baseline.write_text("[]")
    assert main([*QUICK, "--logs", logs, "--baseline", str(baseline)]) == 2
    assert "not a baseline" in capsys.readouterr().err


def test_a_recording_of_a_motions_name_is_another_motion(tmp_path: Path) -> None:
    recording = shutil.copy(RAMP, tmp_path / "pinch.json")
    wanted = [Order(make_scene(twin_defaults(), 1), motion, 1.6, sketched=True) for motion in ("pinch", str(recording))]
    found = compare(wanted, tmp_path / "logs", {"classic": TRACKERS["classic"]})
    assert found.motions() == ["pinch", "pinch.json"]
    assert [len(found.of(motion)) for motion in found.motions()] == [1, 1]
    for printed in (table(found), consistency_table(found)):
        assert [line.split()[0] for line in printed.splitlines()[-2:]] == ["pinch", "pinch.json"]


@pytest.mark.parametrize("wrong", [("--trackers", "magic"), ("--trackers", ""), ("--seconds", "0.5"),
                                   ("--loss", "1"), ("--seconds", "1.01"),
                                   ("--motions", "flight"), ("--motions", "rest,"), ("--motions", "nowhere.tsv"),
                                   ("--set", "lamp.brightness=0.1"), ("--set", "background=clutter"),
                                   ("--set", "show.cube=true"), ("--set", "show.show=board"),
                                   ("--recording", "nowhere.tsv"), ("--lamp", "0.1"), ("--background", "clutter"),
                                   ("--distance", "0.1"), ("--logs", __file__), ("--logs", f"{__file__}/logs")])
def test_what_cannot_be_compared_is_said(wrong: tuple[str, str], tmp_path: Path,
                                         capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*SHORT, "--logs", str(tmp_path), *wrong]) == 2
    assert capsys.readouterr().err.startswith("rhot: ") and list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("option", "value", "said"), [
    ("--distance", "0.1", "--distance 0.1: expected a number >= 0.15"),
    ("--set", "lamp.kelvin=9", "--set lamp.kelvin=9: expected a number >= 1700"),
    ("--kelvin", "9", "--set lamp.kelvin=9: expected a number >= 1700")])
def test_a_scene_that_cannot_be_is_said_of_the_option(option: str, value: str, said: str,
                                                      capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["evaluate", "live", option, value]) == 2
    assert said in capsys.readouterr().err


@pytest.mark.parametrize(("command", "stray"), [
    ("live", "--sketched"), ("live", "--seeds"), ("live", "--motions"), ("live", "--trackers"), ("live", "--cases"),
    ("compare", "--frames"), ("compare", "--detector"), ("compare", "--cases"), ("bare-hand", "--sketched"),
    ("bare-hand", "--loss"), ("bare-hand", "--scene")])
def test_each_evaluation_has_its_own_options(command: str, stray: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(["evaluate", command, stray, "3"])
    assert end.value.code == 2 and f"there is no option '{stray}' here" in capsys.readouterr().err


def test_evaluate_and_mouse_alone_are_their_former_selves(capsys: pytest.CaptureFixture[str]) -> None:
    for former, now in ((["evaluate", "--seconds", "0.5"], "rhot evaluate live --seconds 0.5"),
                        (["evaluate", "--compare", "--seconds=0.5"], "rhot evaluate compare --seconds=0.5"),
                        (["evaluate", "--bare-hand", "--seconds", "0.5"], "rhot evaluate bare-hand --seconds 0.5"),
                        (["mouse", "--rig", "a.json"], "rhot mouse run --rig a.json")):
        assert main(former) == 2
        note, refusal = capsys.readouterr().err.splitlines()
        assert note == f"rhot: this is the former spelling, read for one release. Now: {now}"
        assert "--seconds" in refusal or "--rig" in refusal


def test_a_scene_file_says_on_what_is_compared(logs: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = tmp_path / "scene.json"
    assert main(["simulate", "--motion", "pinch", "--seed", "1", "--out", str(scene)]) == 0
    capsys.readouterr()
    assert main([*SHORT, "--scene", str(scene), "--logs", logs, "--json"]) == 0
    assert list(json.loads(capsys.readouterr().out)["motions"]) == ["pinch"]
