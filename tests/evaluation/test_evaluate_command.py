"""`rhot evaluate --compare` on takes without pictures, and what it refuses."""

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
QUICK = ("evaluate", "--compare", "--sketched", "--trackers", "classic", "--motions", "rest, pinch", "--seeds", "2",
         "--seconds", "1.6")


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
                                   ("--frames", "somewhere"), ("--detector", "reference"), ("--motions", "flight"),
                                   ("--motions", "rest,"), ("--motion", "rest"), ("--recording", "nowhere.tsv"),
                                   ("--lamp", "0.1"), ("--background", "clutter"),
                                   ("--distance", "0.1"), ("--logs", __file__), ("--logs", f"{__file__}/logs")])
def test_what_cannot_be_compared_is_said(wrong: tuple[str, str], tmp_path: Path,
                                         capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*QUICK, "--logs", str(tmp_path), *wrong]) == 2
    assert capsys.readouterr().err.startswith("rhot: ") and list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("option", "value", "said"), [("--distance", "0.1", "expected a number >= 0.15"),
                                                       ("--kelvin", "9", "expected a number >= 1700")])
def test_a_scene_that_cannot_be_is_said_of_the_option(option: str, value: str, said: str,
                                                      capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["evaluate", option, value]) == 2
    assert capsys.readouterr().err.startswith(f"rhot: {option} {float(value)}: {said}")


@pytest.mark.parametrize("stray", [("--sketched",), ("--seeds", "3"), ("--motions", "rest"),
                                   ("--trackers", "estimator")])
def test_what_belongs_to_a_comparison_is_not_passed_over_without_one(stray: tuple[str, ...],
                                                                    capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["evaluate", *stray]) == 2
    assert capsys.readouterr().err.startswith(f"rhot: {stray[0]} is of --compare")
