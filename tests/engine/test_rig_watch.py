"""The engine notices a turned camera by itself, offers the refined rig, and changes nothing."""

from __future__ import annotations

import json
from collections import deque
from pathlib import Path

import msgspec
import numpy as np
import pytest
from knocked_rig import moved
from log_writing import write_log
from synthetic_rig import WIDE, Viewing, hand_trajectory, make_rig, observe

from rhot_app.__main__ import main
from rhot_app.engine.rig_watch import JUDGE_NS, RigWatch
from rhot_app.engine.status import Advice
from rhot_app.project import Rig, load_rig, parse_rig, save_rig
from rhot_app.rig_history import versions
from rhot_app.tracking.tracker import CameraObservations

RIG = make_rig()
SECONDS = 30.0


def turned(rig: Rig, degrees: float) -> Rig:
    """The second camera's file says that it is turned by `degrees` about its line of sight."""
    pose = moved(rig.nodes[1].pose, np.array([0.0, 0.0, np.radians(degrees), 0.0, 0.0, 0.0]))
    return msgspec.structs.replace(rig, nodes=(rig.nodes[0], msgspec.structs.replace(rig.nodes[1], pose=pose)))


@pytest.fixture(scope="module")
def frames() -> list[CameraObservations]:
    return observe(RIG, WIDE, hand_trajectory(RIG, "sweep", SECONDS), SECONDS, Viewing(noise_px=0.03))


def told(watch: RigWatch, frames: list[CameraObservations]) -> list[Advice]:
    """What is said once everything was seen."""
    queue: deque[CameraObservations] = deque()
    for frame in frames:
        queue.append(frame)
        if len(queue) == 8:
            watch.take(queue)
            assert not queue
    watch.advice(2 * JUDGE_NS)
    watch.wait()
    return watch.advice(2 * JUDGE_NS + 1)


def test_a_sound_rig_is_left_in_peace(frames: list[CameraObservations]) -> None:
    watch = RigWatch(RIG)
    assert watch.refined(RIG) == {"known": False}
    assert told(watch, frames) == []
    answer = watch.refined(RIG)
    assert answer["known"] and not answer["stale"] and not answer["usable"]


def test_a_turned_camera_is_told_and_forgotten_with_a_new_run(frames: list[CameraObservations]) -> None:
    wrong = turned(RIG, -0.3)
    watch = RigWatch(wrong)
    (advice,) = told(watch, frames)
    assert "camera 2 camera is turned by 0." in advice.text and advice.level == "warning"
    answer = watch.refined(wrong)
    msgspec.json.encode(answer)
    assert answer["stale"] and answer["usable"] == (advice.mender == "refined")
    mended = parse_rig(msgspec.json.encode(answer["document"]), "the refined rig")
    assert np.array(mended.nodes[1].pose.rotation_wxyz) == pytest.approx([1.0, 0.0, 0.0, 0.0], abs=4e-3)
    assert mended.nodes[1].pose.rotation_wxyz[3] == pytest.approx(0.0, abs=5e-4), "the file said 2.6e-3"
    watch.restart()
    assert watch.advice(2 * JUDGE_NS + 2) == [] and watch.refined(wrong) == {"known": False}


def test_the_command_reports_and_writes_only_when_asked(frames: list[CameraObservations], tmp_path: Path,
                                                        capsys: pytest.CaptureFixture[str]) -> None:
    log, path = tmp_path / "take.rhotlog", tmp_path / "rig.json"
    wrong = turned(RIG, -0.3)
    write_log(log, RIG, frames)
    save_rig(path, wrong)
    arguments = ["refine", str(log), "--rig", str(path), "--no-scale", "--json"]
    main(arguments)
    report = json.loads(capsys.readouterr().out)
    assert not report["holds"] and report["written"] is None and load_rig(path) == wrong
    assert report["cameras"][0]["turn_deg"][2] == pytest.approx(0.3, abs=0.06)
    assert report["before_px"] > 3.0 * report["after_px"]
    if not report["cameras"][0]["undetermined"]:
        assert main([*arguments, "--use"]) == 0
        assert load_rig(path) != wrong and [one.replaced_by for one in versions(path)] == ["refined calibration"]
    assert main(["refine", str(log), "--no-scale"]) == 0, "the rig of the log holds"
    assert "still holds" in capsys.readouterr().out


def test_mistakes_of_the_command_are_sentences(tmp_path: Path, capsys: pytest.CaptureFixture[str],
                                               frames: list[CameraObservations]) -> None:
    log = write_log(tmp_path / "short.rhotlog", RIG, frames[:40])
    assert main(["refine", str(log)]) == 2
    assert "two minutes" in capsys.readouterr().err
    assert main(["refine", str(log), "--use"]) == 2
    assert "--rig" in capsys.readouterr().err
