"""The simulated rig's cameras are covered and uncovered from the Rig menu."""

from __future__ import annotations

from pathlib import Path


def caps_of(bench):
    return bench.window.actions_.caps


def ticked(bench):
    return [cap.text() for cap in caps_of(bench).actions() if cap.isChecked()]


def test_a_tick_covers_a_camera_and_another_click_uncovers_it(tracking):
    menu = caps_of(tracking)
    assert menu.menuAction().isVisible() and [cap.text() for cap in menu.actions()] == ["left", "right"]
    left, right = menu.actions()
    left.trigger()
    tracking.until(lambda: tracking.backend.covered == ("left",))
    right.trigger()
    tracking.until(lambda: tracking.backend.covered == ("left", "right"))
    left.trigger()
    tracking.until(lambda: tracking.backend.covered == ("right",))
    right.trigger()
    tracking.until(lambda: tracking.backend.covered == ())
    assert ticked(tracking) == []


def test_a_covered_camera_is_said_to_be_black_and_nobody_is_sent_to_the_colours(tracking):
    left = caps_of(tracking).actions()[0]
    left.trigger()
    tracking.until(lambda: tracking.said("left", "black", "covered"))
    assert not tracking.said("colour")
    left.trigger()
    tracking.until(lambda: tracking.calm)


def test_the_menu_shows_what_another_window_has_covered(tracking):
    tracking.backend.covered = ("right",)
    caps_of(tracking).aboutToShow.emit()
    tracking.until(lambda: ticked(tracking) == ["right"])
    tracking.backend.covered = ()
    caps_of(tracking).aboutToShow.emit()
    tracking.until(lambda: ticked(tracking) == [])


def test_a_rig_that_does_not_answer_is_a_sentence_and_nothing_is_ticked(tracking):
    tracking.backend.refuse = "the simulated rig gave no answer in 8 s."
    caps_of(tracking).actions()[0].trigger()
    tracking.until(lambda: tracking.said("no answer in 8 s"))
    assert ticked(tracking) == []


def test_a_real_rig_has_no_caps(tracking, tmp_path: Path):
    bench = tracking
    bench.close_rig()
    assert not caps_of(bench).menuAction().isVisible()
    bench.window.open_rig(tmp_path / "two_pis.json")
    bench.until(lambda: bench.controller.rig is not None)
    assert not caps_of(bench).menuAction().isVisible()
    bench.close_rig()
