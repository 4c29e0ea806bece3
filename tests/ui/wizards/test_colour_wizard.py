"""The colour wizard, clicked through on painted fingertips; its steps and drawings on their own."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
from colour_scenes import PAINTS
from fake_engine import synthetic_rig
from paint_scene import PaintScene, compile_detector, other_colours
from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QFont, QFontMetricsF
from PySide6.QtTest import QTest
from wizard_rig import FakeRigClient

from rhot_app.calibration.colour.separability import SKIN
from rhot_app.calibration.kinds.colours import hue_chart, propose
from rhot_app.calibration.registry import InForce, calibration
from rhot_app.project import load_rig
from rhot_app.ui.common.theme import apply_theme
from rhot_app.ui.models.palette import DARK, SCHEMES, contrast
from rhot_app.ui.wizards.colours.bounds import BoundsStep
from rhot_app.ui.wizards.colours.masks import MaskChoice
from rhot_app.ui.wizards.colours.pick import PickStep
from rhot_app.ui.wizards.colours.separation import SeparationStep
from rhot_app.ui.wizards.framework.drawing import Callout, Layer
from rhot_app.ui.wizards.framework.picture_painter import callout_boxes, fit
from rhot_node.detect.fast import FastDetector
from rhot_node.detect.image import from_bgr

COLOURS = calibration("colours"), InForce(synthetic_rig())

NAMES = list(PAINTS)


@pytest.fixture(scope="module")
def scene():
    compile_detector()
    return PaintScene()


@pytest.fixture(scope="module")
def rig():
    """A rig whose colours are all wrong."""
    rig = synthetic_rig()
    return msgspec.structs.replace(rig, markers=other_colours(rig.markers))


@pytest.fixture(scope="module")
def shared(open_shared, scene, rig):
    return open_shared("colours", FakeRigClient(rig, scene.draw))


@pytest.fixture
def hands(shared, scene):
    """The wizard before painted fingertips that rest, nothing picked."""
    scene.moving = False
    while shared.window.current:
        shared.window.back()
    step = shared.window.step
    while step.undo():
        pass
    if step.held:
        step.capture()
    step.chosen = NAMES[0]
    shared.until(lambda: set(step.masked) == set(step.cameras) and all(
        np.abs(shown.image.y.astype(float) - from_bgr(scene.at_rest[name].bgr).y).mean() < 2.0
        for name, shown in step.masked.items()))
    return shared


@pytest.fixture
def picks(scene, rig):
    """The first step without its window, the hand in sight of both cameras, nothing picked."""
    picks = PickStep(rig.markers, ("left", "right"))
    look(picks, scene)
    return picks


def look(step, scene):
    step.accept_observation(step.observe(scene.at_rest))


def click_at(hands, camera, x, y, to=None):
    """Click, or drag to another place, px of the frame."""
    view = hands.frame.grid.views[camera]
    if view.small:
        hands.click(view)
        hands.until(lambda: not view.small and view.width() > 400)
    hands.drag(view, *(view.to_widget(px, py) for px, py in ((x, y), to or (x, y))))


def pick(picks, name, place=None, camera="left"):
    """Choose a marker and click the paint of `place`, by default its own; the next line is chosen after it."""
    picks.chosen = name
    assert picks.pick(picks.masked[camera].picture, *(place or PaintScene.where(name)), 0.0, 0.0), picks.problem


def pick_all(picks):
    for name in PAINTS:
        assert picks.chosen == name
        pick(picks, name)


def on_skin(name):
    """Below a marker, on its finger."""
    x, y = PaintScene.where(name)
    return x, y + 45.0


def said(verdict):
    """A verdict as running text."""
    return "" if verdict is None else " ".join([verdict.sentence, *(one.sentence for one in verdict.findings)])


def learnt(step):
    """The step with its task done, if it has one."""
    step.enter()
    task = step.task()
    if task is not None:
        step.take_result(task.function(*task.arguments, progress=lambda text, fraction: None))
    return step


def test_from_clicks_to_a_rig_and_nodes_with_the_new_colours(hands, scene):
    before = hands.client.settings[1].markers
    for name in PAINTS:
        assert hands.window.step.chosen == name
        click_at(hands, "left", *PaintScene.where(name))
        assert name in hands.window.step.gathering.names, hands.window.step.problem
    assert hands.window.step.chosen == SKIN
    x, y = PaintScene.where("thumb")
    click_at(hands, "right", x - 14.0 - 4, y + 40, to=(x - 14.0 + 4, y + 60))
    assert len(hands.window.step.gathering.skin) >= 40
    scene.moving = True
    hands.until(lambda: hands.window.step.view().done)
    page = hands.window.page
    assert [page.list.text(row, 1) for row in range(7)] == [*PAINTS, SKIN]
    hands.until(lambda: int(page.list.text(0, 2)) >= 10)
    scene.moving = False
    hands.next()
    hands.solved()
    move_a_bound(hands)
    hands.next()
    hands.solved()
    assert hands.verdict.acceptable
    page = hands.window.page
    assert page.table.records_model.rowCount() == 6 and page.table.heads()[7] == SKIN
    assert int(page.table.text(0, 1)) >= 90 and page.charts.plots
    hands.next()
    model = hands.window.page.table.records_model
    assert not any(model.index(0, column).data(Qt.ItemDataRole.DecorationRole).isNull() for column in (1, 2))
    hands.use()
    saved = load_rig(hands.path).markers
    assert all(settings.markers == saved for settings in hands.client.settings.values())
    assert saved.markers[0].chroma.hue_tolerance_deg == pytest.approx(7.0)
    seen = FastDetector(saved).detect(from_bgr(scene.draw(1)))
    for name, mark in zip(PAINTS, seen, strict=False):
        x, y = PaintScene.where(name)
        assert mark.found and abs(mark.x - x) < 3.0 and abs(mark.y - y) < 3.0, name
    hands.restore()
    assert all(settings.markers == before for settings in hands.client.settings.values())


def move_a_bound(hands):
    """Type another tolerance, undo it, type it again."""
    page, step = hands.window.page, hands.window.step
    learnt = step.model("thumb").hue_tolerance_deg
    box = page.rows["hue_tolerance_deg"].box

    def enter(value):
        box.setFocus()
        box.selectAll()
        QTest.keyClicks(box, str(value))
        QTest.keyClick(box, Qt.Key.Key_Tab)

    enter(7.0)
    assert step.model("thumb").hue_tolerance_deg == 7.0 and "by hand" in page.list.text(0, 2)
    hands.undo()
    assert step.model("thumb").hue_tolerance_deg == learnt and box.value() == pytest.approx(learnt, abs=0.05)
    enter(7.0)
    hands.until(lambda: step.masked)


def test_one_picture_is_large_and_a_click_enlarges_the_other(hands):
    views = hands.frame.grid.views
    if views["left"].small:
        hands.click(views["left"])
    hands.until(lambda: views["left"].width() >= 540)
    assert views["right"].width() <= 160 and views["right"].isVisible()
    hands.click(views["right"])
    hands.until(lambda: views["right"].width() >= 540 and views["left"].width() <= 160)
    assert hands.window.step.gathering.names == (), "the click chose a picture, no paint"


def test_a_click_beside_the_paint_is_refused_and_undo_takes_the_last_one_back(hands):
    step = hands.window.step
    click_at(hands, "left", *PaintScene.where("thumb"))
    click_at(hands, "left", 310.0, 10.0)
    assert "index" in hands.hint and step.gathering.names == ("thumb",)
    click_at(hands, "left", *PaintScene.where("index"))
    assert step.chosen == "middle"
    hands.undo()
    assert step.gathering.names == ("thumb",) and step.chosen == "index"
    hands.click(hands.window.page.undo_button)
    assert step.gathering.names == () and not hands.frame.next_button.isEnabled()
    table = hands.window.page.list
    row = [one.name for one in table.records].index("ring")
    hands.click(table.viewport(), table.visualRect(table.records_model.index(row, 1)).center())
    assert step.chosen == "ring", "a click on a line chooses it"


def test_space_holds_the_pictures_for_a_click(hands, scene):
    scene.moving = True
    hands.frame.middle.setFocus()
    hands.key(Qt.Key.Key_Space)
    held = hands.window.step.held["left"]
    assert "held" in hands.sentence
    newest = hands.window.feed.newest("left").number
    hands.until(lambda: hands.window.feed.newest("left").number > newest + 2)
    assert hands.frame.grid.views["left"].shown is held
    hands.window.page.mask_choice.setCurrentIndex(2)
    assert hands.frame.grid.views["left"].overlay == ()
    hands.window.page.mask_choice.setCurrentIndex(0)
    hands.key(Qt.Key.Key_Space)
    assert not hands.window.step.held


@pytest.mark.parametrize("scheme", [DARK, SCHEMES["light"]], ids=["dark", "light"])
def test_the_chosen_line_of_a_drop_down_can_be_read(qapp, qtbot, scheme):
    box = MaskChoice()
    qtbot.addWidget(box)
    before = qapp.styleSheet(), qapp.palette()
    apply_theme(qapp, scheme)
    try:
        box.show()
        qtbot.waitExposed(box)
        box.showPopup()
        qtbot.waitUntil(box.view().isVisible)
        row = box.view().visualRect(box.model().index(box.currentIndex(), 0))
        image = box.view().viewport().grab(row).toImage()
        found = {image.pixelColor(x, y).name() for x in range(image.width()) for y in range(image.height())}
        ground = image.pixelColor(image.width() - 3, image.height() // 2).name()
        assert max(contrast(ground, colour) for colour in found) > 4.0
        box.hidePopup()
    finally:
        qapp.setStyleSheet(before[0])
        qapp.setPalette(before[1])


# -- the steps without a window ----------------------------------------------------------------------------------------

def test_names_stand_at_the_side_and_leave_the_paint_in_sight(qapp, picks, scene):
    pick_all(picks)
    look(picks, scene)
    place = fit(320, 240, QRectF(0, 0, 800, 600))
    callouts = [mark for mark in picks.view().annotated["left"].overlay if isinstance(mark, Callout)]
    boxes = callout_boxes(callouts, place, QFontMetricsF(QFont()))
    assert len(boxes) >= len(PAINTS)
    for box in boxes:
        assert not any(box.covers(((mark.x + 0.5) * place.scale, (mark.y + 0.5) * place.scale), 10.0)
                       for mark in callouts)


def test_the_mask_is_what_the_detector_takes(picks, scene):
    pick_all(picks)
    look(picks, scene)
    assert all(mark.found for mark in picks.masked["left"].seen)
    layer, *marks = picks.view().annotated["left"].overlay
    assert isinstance(layer, Layer) and {mark.text for mark in marks if isinstance(mark, Callout)} >= set(PAINTS)
    labels = picks.masked["left"].labels
    assert layer.rgba.shape == (120, 160, 4)
    assert np.array_equal(layer.rgba[..., 3] == 255, labels > 0)
    row, column = (round(at / 2) for at in reversed(PaintScene.where("ring")))
    assert labels[row, column] == 1 + NAMES.index("ring")


def test_after_a_marker_is_picked_again_the_next_line_is_chosen(picks):
    pick_all(picks)
    picks.chosen = "thumb"
    pick_all(picks)
    assert picks.chosen == SKIN and picks.view().verdict is None
    assert [one.name for one in picks.gathering.samples] == NAMES


def test_clicks_one_finger_too_far_are_refused_with_the_skin_and_the_exchanged_colours_named(picks, rig):
    pick_all(picks)
    pick(picks, "thumb")
    assert picks.chosen == "index" and picks.view().verdict is None
    pick(picks, "index", on_skin("index"))
    assert picks.chosen == "middle" and "index has the colour of skin" in said(picks.view().verdict)
    pick(picks, "middle", PaintScene.where("index"))
    assert "middle now has the colour that index had" in said(picks.view().verdict)
    assert picks.doubt("index") == "as skin" and picks.doubt("middle") == "was index's"
    for name, other in zip(NAMES[3:], NAMES[2:], strict=False):
        pick(picks, name, PaintScene.where(other))
    apart = learnt(SeparationStep(*COLOURS, learnt(BoundsStep(*COLOURS, picks))))
    verdict = apart.view().verdict
    assert not verdict.acceptable and "index has the colour of skin" in said(verdict)
    for name, other in zip(NAMES[2:], NAMES[1:], strict=False):
        assert f"{name} now has the colour that {other} had" in said(verdict)
    assert not propose(apart.result, InForce(rig)).verdict.acceptable


def test_two_markers_of_one_colour_are_refused_and_undo_mends_it(picks):
    pick(picks, "thumb")
    pick(picks, "index")
    pick(picks, "middle", PaintScene.where("index"))
    verdict = picks.view().verdict
    assert not verdict.acceptable and "index and middle have one colour" in said(verdict) and "0°" in said(verdict)
    assert (picks.doubt("index"), picks.doubt("middle")) == ("as middle", "as index")
    assert picks.undo()
    assert picks.view().verdict is None and picks.chosen == "middle" and picks.gathering.names == ("thumb", "index")
    pick(picks, "index", PaintScene.where("ring"))
    red, green, blue = picks.markers.markers[1].display_rgb
    assert red < 90 < green < blue  # the ring's paint, at once
    assert picks.undo()
    red, green, blue = picks.markers.markers[1].display_rgb
    assert blue < 90 < green < red and picks.chosen == "index"


def test_pictures_can_be_held_before_the_first_ones_were_looked_at(rig, scene):
    picks = PickStep(rig.markers, ("left", "right"))
    assert not picks.capture()
    look(picks, scene)
    assert picks.held == scene.at_rest and "held" in picks.view().sentence
    assert not picks.capture() and not picks.held
    look(picks, scene)
    assert not picks.held, "let go for good"


def test_a_click_is_read_in_the_picture_that_was_clicked(picks, scene):
    rotated = dict(zip(NAMES, [PAINTS[name] for name in (*NAMES[1:], NAMES[0])], strict=True))
    late = picks.observe(PaintScene(rotated).at_rest)
    assert picks.capture()
    picks.accept_observation(late)  # looked at while the pictures were held
    assert picks.pick(picks.held["left"], *PaintScene.where("ring"), 0.0, 0.0), picks.problem
    shown = picks.markers.markers[picks.base.ids.index(NAMES[0])].display_rgb
    assert np.abs(np.subtract(shown, PAINTS["ring"])).max() < 40


def test_a_camera_that_does_not_find_a_marker_is_named_with_the_test_that_refuses_it(picks, scene):
    other = PaintScene({name: rgb for name, rgb in PAINTS.items() if name != "ring"}, background=(60, 62, 66))
    seen = {"left": scene.at_rest["left"], "right": other.at_rest["right"]}
    picks.accept_observation(picks.observe(seen))
    pick(picks, "ring")
    picks.chosen = SKIN
    x, y = on_skin("thumb")
    assert picks.pick(picks.masked["left"].picture, x - 4.0, y, 8.0, 20.0), picks.problem
    picks.accept_observation(picks.observe(seen))
    hint = picks.view().hint
    assert all(word in hint for word in ("right", "ring", "not found")) and "left" not in hint


def test_alike_paints_are_said_to_be_alike(rig):
    alike = PaintScene({**PAINTS, "little": (26, 163, 204)})
    picks = PickStep(rig.markers, ("left", "right"))
    look(picks, alike)
    pick_all(picks)
    apart = learnt(SeparationStep(*COLOURS, learnt(BoundsStep(*COLOURS, picks))))
    assert not apart.view().verdict.acceptable
    bands = [curve for curve in hue_chart(apart.result).curves if curve.style == "band"]
    assert {curve.name for curve in bands if curve.name} == set(PAINTS)
    assert all(-180.0 <= curve.x[0] < curve.x[1] <= 180.0 for curve in bands)
