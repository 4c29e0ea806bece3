"""What a rig still needs: steps by what somebody has, ticks by what the rig says, and the page in the window."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import msgspec
import pytest
from fake_engine import synthetic_rig
from PySide6.QtWidgets import QFileDialog
from screen_pictures import cut_texts

from rhot_app.hand.anthropometry import scaled_hand
from rhot_app.project import CameraCalibration, CameraPose, Intrinsics, Rig, load_rig
from rhot_app.sources.cameras import camera_set
from rhot_app.sources.cameras.camera_set import CameraSource, LocalCamera, change_observed, first_rig, prepare
from rhot_app.ui.models.next_steps import Answers, answers_of, next_steps

TWO = tuple(LocalCamera(name, f"{name}.mp4", 640, 480, 30.0, True) for name in ("left", "right"))
LENS = Intrinsics(640, 480, 500.0, 500.0, 321.0, 240.0)


def ticks(rig: Rig, answers: Answers | None = None, **known) -> dict[str, bool]:
    facts = {"networks": False, "printed": False, "reasons": ()} | known
    return {step.action: step.done for step in next_steps(answers or answers_of(rig), rig, **facts)}


def with_lenses(rig: Rig, count: int = 2) -> Rig:
    nodes = tuple(msgspec.structs.replace(node, intrinsics=LENS) if number < count else node
                  for number, node in enumerate(rig.nodes))
    return msgspec.structs.replace(rig, nodes=nodes)


def placed(rig: Rig) -> Rig:
    node = msgspec.structs.replace(rig.nodes[1], pose=CameraPose(translation_m=(0.2, 0.0, 0.0)), pose_known=True)
    return msgspec.structs.replace(rig, nodes=(rig.nodes[0], node), calibration=CameraCalibration("board"))


def test_a_bare_hand_before_two_cameras_needs_everything_in_order():
    rig = first_rig(TWO, bare=True)
    assert list(ticks(rig)) == ["networks", "tracker", "board", "lens", "stereo", "time", "measured"]
    assert ticks(rig) == {"networks": False, "tracker": True, "board": False, "lens": False, "stereo": False,
                          "time": False, "measured": False}


def test_each_tick_comes_from_what_the_rig_says():
    rig = first_rig(TWO, bare=True)
    assert ticks(rig, networks=True)["networks"] and ticks(rig, printed=True)["board"]
    half = with_lenses(rig, 1)
    assert ticks(half)["board"] and not ticks(half)["lens"], "one lens of two is not all"
    assert ticks(with_lenses(rig))["lens"] and not ticks(with_lenses(rig))["stereo"]
    assert not ticks(placed(rig))["stereo"], "cameras with assumed lenses are not put together"
    done = placed(with_lenses(rig))
    assert ticks(done)["stereo"]
    outdated = msgspec.structs.replace(done, calibration=CameraCalibration("outdated"))
    assert not ticks(outdated)["stereo"]
    assert ticks(msgspec.structs.replace(done, hand=scaled_hand(done.hand, 1.05)))["measured"]


def test_the_cameras_times_are_unknown_until_they_are_measured():
    def step(rig: Rig):
        return next(one for one in next_steps(Answers("bare", 2), rig, networks=True, printed=True, reasons=())
                    if one.action == "time")

    for unplaced in (first_rig(TWO, bare=True), first_rig(TWO[:1], bare=True)):
        assert "half a frame" in step(unplaced).meaning and " ms" not in step(unplaced).meaning
    rig = placed(with_lenses(first_rig(TWO, bare=True)))
    assert not step(rig).done and "half a frame" in step(rig).meaning
    left, right = rig.nodes
    measured = (left, msgspec.structs.replace(right, time_offset_s=0.0032, time_offset_sd_s=2e-4))
    timed = msgspec.structs.replace(rig, nodes=measured)
    assert step(timed).done and "3.20 ± 0.20 ms" in step(timed).meaning
    of_the_reference = (msgspec.structs.replace(left, time_offset_sd_s=0.0), right)
    assert not step(msgspec.structs.replace(rig, nodes=of_the_reference)).done


def test_paint_needs_colours_and_one_camera_needs_no_other():
    rig = first_rig(TWO, bare=False)
    steps = ticks(rig, reasons=["colour calibration of left and right"])
    assert steps["colours"] and "networks" not in steps and not steps["bones"] and steps["tracker"]
    assert not ticks(rig)["colours"]
    one = ticks(first_rig(TWO[:1], bare=True))
    assert "stereo" not in one and "measured" not in one
    more = ticks(first_rig(TWO[:1], bare=True), Answers("bare", 2))
    assert more["cameras"] is False and next(iter(more)) == "cameras"


def test_another_answer_than_the_rigs_is_a_step_of_its_own():
    bare = first_rig(TWO, bare=True)
    assert not ticks(bare, Answers("paint", 2))["tracker"]
    assert not ticks(first_rig(TWO, bare=False), Answers("bare", 2))["tracker"]
    assert "networks" not in ticks(bare, Answers("landmarks", 2)), "they come from somewhere else"


def test_the_cameras_go_over_to_paint_and_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    monkeypatch.setattr(camera_set, "installed_folder", lambda: tmp_path)
    path = prepare([CameraSource("/a.mp4", "a.mp4", 640, 480, 30.0, 1.0)]).rig_path
    change_observed(path, bare=False)
    assert load_rig(path).painted and load_rig(path).tracker.kind == "estimator"
    change_observed(path, bare=True)
    assert load_rig(path).tracker.landmarks


@pytest.fixture
def cameras(bench, monkeypatch):
    """The window on two cameras of this computer that nobody has calibrated."""
    bench.backend.engine.rig = msgspec.structs.replace(synthetic_rig(calibration=None),
                                                       nodes=first_rig(TWO, bare=False).nodes)
    opened = bench.backend.open_rig
    monkeypatch.setattr(bench.backend, "open_rig", lambda path, report: replace(opened(path, report), begin=True))
    return bench


def test_the_steps_are_there_by_themselves_leave_the_scene_in_sight_and_can_be_closed_for_ever(cameras, tmp_path,
                                                                                                monkeypatch):
    bench, page = cameras, cameras.window.next_steps
    bench.window.open_rig(tmp_path / "cameras.json")
    bench.until(page.isVisible)
    parts = bench.window.screen_parts
    bench.until(parts.scene.isVisible)
    assert not parts.plots.isVisible() and parts.cameras.isVisible(), "hand and cameras stay in sight"
    bench.window.resize(1280, 800)
    bench.keep("next-steps", 12, lambda: page.grab().toImage())
    assert [step.action for step in page.steps] == ["tracker", "board", "lens", "stereo", "time", "colours",
                                                       "bones"]
    bench.click(page.counts[1])
    assert "stereo" not in [step.action for step in page.steps]
    bench.click(page.counts[2])
    lens = next(row for row, step in enumerate(page.steps) if step.action == "lens")
    bench.click(page.buttons[lens])
    bench.until(lambda: bench.window.wizards.wizard is not None and bench.window.wizards.wizard.isVisible())
    bench.window.wizards.wizard.reject()
    bench.until(lambda: bench.window.wizards.wizard is None)
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *args: (str(tmp_path / "board.pdf"), ""))
    board = next(row for row, step in enumerate(page.steps) if step.action == "board")
    bench.click(page.buttons[board])
    bench.until(lambda: page.steps[board].done)
    assert (tmp_path / "board.pdf").read_bytes().startswith(b"%PDF")
    bench.click(page.never)
    bench.click(page.close_button)
    bench.until(lambda: parts.plots.isVisible() and not page.isVisible())
    bench.close_rig()
    bench.window.open_rig(tmp_path / "cameras.json")
    bench.until(lambda: bench.controller.opened is not None)
    assert not page.isVisible()
    bench.window.actions_.next_steps.trigger()
    bench.until(page.isVisible)
    bench.close_rig()
    assert not page.isVisible() and not parts.plots.isVisible(), "the first page has no panels"


def test_the_steps_come_into_the_panel_of_the_plots_where_that_was_hidden(cameras, tmp_path):
    bench, page, plots = cameras, cameras.window.next_steps, cameras.window.screen_parts.plots
    bench.window.open_rig(tmp_path / "cameras.json")
    bench.until(page.isVisible)
    bench.click(page.close_button)
    bench.until(plots.isVisible)
    hide_plots = bench.window.docks.actions[4]
    hide_plots.trigger()
    bench.until(lambda: not plots.isVisible())
    bench.window.actions_.next_steps.trigger()
    bench.until(page.isVisible)
    bench.click(page.close_button)
    bench.until(lambda: not page.isVisible())
    assert not plots.isVisible()


@pytest.mark.parametrize("count", [1, 2])
@pytest.mark.parametrize("size", [(1280, 800), (1024, 700)])
def test_every_step_fits_its_place_and_leaves_room_for_the_scene(cameras, tmp_path, size, count):
    bench, page = cameras, cameras.window.next_steps
    rig = bench.backend.engine.rig
    bench.backend.engine.rig = msgspec.structs.replace(rig, nodes=rig.nodes[:count])
    bench.window.resize(*size)
    bench.window.open_rig(tmp_path / "cameras.json")
    bench.until(page.isVisible)
    scene = bench.window.screen_parts.scene
    for answer in (*page.wears.values(), *page.counts.values()):
        bench.click(answer)
        bench.run(0.02)
        assert cut_texts(page) == []
        assert bench.window.size().toTuple() == size and scene.height() > 0.3 * size[1]


def test_a_rig_of_other_nodes_is_left_in_peace(bench, tmp_path):
    bench.window.open_rig(tmp_path / "desk.json")
    bench.until(lambda: bench.controller.opened is not None)
    assert not bench.window.next_steps.isVisible()
