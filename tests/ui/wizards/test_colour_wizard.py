"""The colour wizard, clicked through on painted fingertips; its models on their own."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
from colour_scenes import PAINTS, picture
from fake_engine import synthetic_rig
from paint_scene import PaintScene, compile_detector, other_colours
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QFontMetricsF
from PySide6.QtTest import QTest
from wizard_hands import Hands
from wizard_rig import FakeMemory, FakeRigAsker

from rhot_app.calibration.colour.separability import SKIN
from rhot_app.project import load_rig, save_rig
from rhot_app.ui.common.theme import apply_theme
from rhot_app.ui.models.palette import DARK, SCHEMES, contrast
from rhot_app.ui.wizards.colours import MaskChoice, make_plan
from rhot_app.ui.wizards.framework.picture_painter import callout_boxes
from rhot_app.ui.wizards.framework.plan import Kit
from rhot_app.ui.wizards.framework.window import WizardWindow
from rhot_app.ui.wizards.models.drawing import Callout, Layer
from rhot_app.ui.wizards.steps.colour_result import hue_chart
from rhot_node.detect.fast import FastDetector
from rhot_node.detect.image import from_bgr


@pytest.fixture(scope="module")
def scene():
    return PaintScene()


@pytest.fixture(scope="module", autouse=True)
def compiled():
    compile_detector()


@pytest.fixture
def hands(themed, scene, tmp_path):
    """The wizard on a rig whose colours are all wrong, before painted fingertips that rest."""
    scene.moving = False
    rig, path = synthetic_rig(), tmp_path / "desk.json"
    rig = msgspec.structs.replace(rig, markers=other_colours(rig.markers))
    save_rig(path, rig)
    asker = FakeRigAsker(rig, scene.draw)
    settings = {node_id: msgspec.to_builtins(one) for node_id, one in asker.settings.items()}
    kit = Kit(rig, path, asker.connect, DARK, FakeMemory(), settings)
    hands = Hands(WizardWindow(make_plan(kit), kit))
    hands.path, hands.asker = path, asker
    hands.until(lambda: set(hands.window.step._masked) == {"left", "right"}
                and all(view.shown is not None for view in hands.window.frame.wall.views.values()))
    yield hands
    hands.window.end().wait(5.0)
    hands.window.deleteLater()


def click_at(hands, camera, x, y, to=None):
    """Click, or drag to another place, px of the frame."""
    view = hands.window.frame.wall.views[camera]
    if view.small:
        hands.click(view)
        hands.until(lambda: not view.small and view.width() > 400)
    place = view._place()
    at = [QPoint(round(place.target.x() + (px + 0.5) * place.scale), round(place.target.y() + (py + 0.5) * place.scale))
          for px, py in ((x, y), to or (x, y))]
    QTest.mousePress(view, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, at[0])
    if to is not None:
        QTest.mouseMove(view, at[1])
    QTest.mouseRelease(view, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, at[1])


def pick_all(hands):
    for name in PAINTS:
        assert hands.window.step.chosen == name
        click_at(hands, "left", *PaintScene.where(name))
        assert name in hands.window.step.gathering.names, hands.window.step.problem


def test_from_clicks_to_a_rig_and_nodes_with_the_new_colours(hands, scene):
    before = hands.asker.settings[1].markers
    pick_all(hands)
    assert hands.window.step.chosen == SKIN
    x, y = PaintScene.where("thumb")
    click_at(hands, "right", x - 14.0 - 4, y + 40, to=(x - 14.0 + 4, y + 60))
    assert len(hands.window.step.gathering.skin) >= 40
    scene.moving = True
    hands.until(lambda: hands.window.step.view().done, timeout_s=40.0)
    page = hands.window.page
    assert [page.list.item(row, 1).text() for row in range(7)] == [*PAINTS, SKIN]
    assert int(page.list.item(0, 2).text()) >= 10
    scene.moving = False
    hands.next()
    hands.until(lambda: hands.window.step.report is not None, timeout_s=60.0)
    move_a_bound(hands)
    hands.next()
    hands.until(lambda: hands.window.step.report is not None, timeout_s=60.0)
    assert hands.window.frame.verdict.verdict.acceptable
    page = hands.window.page
    assert page.table.rowCount() == 6 and page.table.horizontalHeaderItem(6).text() == SKIN
    assert int(page.table.item(0, 0).text()) >= 90 and page.charts.plots
    hands.next()
    hands.click(hands.window.frame.next_button)
    hands.until(lambda: hands.window.step.state == "used")
    saved = load_rig(hands.path).markers
    assert all(settings.markers == saved for settings in hands.asker.settings.values())
    assert saved.markers[0].chroma.hue_tolerance_deg == pytest.approx(7.0)
    seen = FastDetector(saved).detect(from_bgr(scene.draw(1, 0.0)))
    for name, mark in zip(PAINTS, seen, strict=False):
        x, y = PaintScene.where(name)
        assert mark.found and abs(mark.x - x) < 3.0 and abs(mark.y - y) < 3.0, name
    hands.click(hands.window.page.restore_button)
    hands.until(lambda: hands.window.step.state == "restored")
    assert all(settings.markers == before for settings in hands.asker.settings.values())


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
    assert step.model("thumb").hue_tolerance_deg == 7.0 and "by hand" in page.list.item(0, 2).text()
    page.list.setFocus()
    hands.key(Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert step.model("thumb").hue_tolerance_deg == learnt and box.value() == pytest.approx(learnt, abs=0.05)
    enter(7.0)
    hands.until(lambda: step._masked)


def test_one_picture_is_large_and_a_click_enlarges_the_other(hands):
    hands.window.resize(1280, 800)
    views = hands.window.frame.wall.views
    hands.until(lambda: views["left"].width() >= 540)
    assert views["right"].width() <= 160 and views["right"].isVisible()
    hands.click(views["right"])
    hands.until(lambda: views["right"].width() >= 540 and views["left"].width() <= 160)
    assert hands.window.step.gathering.names == (), "the click chose a picture, no paint"
    hands.click(views["left"])
    hands.until(lambda: views["left"].width() >= 540)


def test_names_stand_at_the_side_and_leave_the_paint_in_sight(hands, scene):
    pick_all(hands)
    step, view = hands.window.step, hands.window.frame.wall.views["left"]
    hands.until(lambda: all(mark.found for mark in step._masked["left"].seen))
    place = view._place()
    callouts = [mark for mark in step.view().overlays["left"] if isinstance(mark, Callout)]
    boxes = callout_boxes(callouts, place, QFontMetricsF(view.font()))
    assert len(boxes) >= len(PAINTS)
    for box in boxes:
        assert not any(box.covers(((mark.x + 0.5) * place.scale, (mark.y + 0.5) * place.scale), 10.0)
                       for mark in callouts)


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


def test_the_mask_is_what_the_detector_takes(hands, scene):
    pick_all(hands)
    step = hands.window.step
    hands.until(lambda: all(mark.found for mark in step._masked["left"].seen))
    layer, *marks = step.view().overlays["left"]
    assert isinstance(layer, Layer) and {mark.text for mark in marks if isinstance(mark, Callout)} >= set(PAINTS)
    labels = step._masked["left"].labels
    assert layer.rgba.shape == (120, 160, 4)
    assert np.array_equal(layer.rgba[..., 3] == 255, labels > 0)
    row, column = (round(at / 2) for at in reversed(PaintScene.where("ring")))
    assert labels[row, column] == 1 + list(PAINTS).index("ring")
    hands.window.page.mask_choice.setCurrentIndex(2)
    assert step.view().overlays == {}


def test_a_click_beside_the_paint_is_refused_and_undo_takes_the_last_one_back(hands):
    step = hands.window.step
    click_at(hands, "left", *PaintScene.where("thumb"))
    click_at(hands, "left", 310.0, 10.0)
    assert "index" in hands.window.frame.hint.text() and step.gathering.names == ("thumb",)
    click_at(hands, "left", *PaintScene.where("index"))
    assert step.chosen == "middle"
    hands.key(Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert step.gathering.names == ("thumb",) and step.chosen == "index"
    hands.click(hands.window.page.undo_button)
    assert step.gathering.names == () and not hands.window.frame.next_button.isEnabled()


def choose(hands, name):
    """Click a marker's line in the list."""
    table = hands.window.page.list
    row = [table.item(row, 1).text() for row in range(table.rowCount())].index(name)
    QTest.mouseClick(table.viewport(), Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier,
                     table.visualItemRect(table.item(row, 1)).center())
    assert hands.window.step.chosen == name


def on_skin(name):
    """Below a marker, on its finger."""
    x, y = PaintScene.where(name)
    return x, y + 45.0


def test_after_a_marker_is_picked_again_the_next_line_is_chosen(hands):
    pick_all(hands)
    choose(hands, "thumb")
    for name in PAINTS:
        assert hands.window.step.chosen == name
        click_at(hands, "left", *PaintScene.where(name))
    assert hands.window.step.chosen == SKIN and hands.window.step.view().verdict is None
    table = hands.window.page.list
    assert table.item(table.currentRow(), 1).text() == SKIN
    assert [one.name for one in hands.window.step.gathering.samples] == list(PAINTS)


def test_clicks_one_finger_too_far_are_refused_with_the_skin_and_the_exchanged_colours_named(hands):
    pick_all(hands)
    step, names = hands.window.step, list(PAINTS)
    choose(hands, "thumb")
    click_at(hands, "left", *PaintScene.where("thumb"))
    assert step.chosen == "index" and hands.window.frame.verdict.verdict is None
    click_at(hands, "left", *on_skin("index"))
    assert step.chosen == "middle" and "index has the colour of skin" in said(hands)
    click_at(hands, "left", *PaintScene.where("index"))
    assert "middle now has the colour that index had" in said(hands)
    assert hands.window.page.list.item(names.index("index"), 2).text() == "as skin"
    assert hands.window.page.list.item(names.index("middle"), 2).text() == "was index's"
    for name, place in zip(names[3:], names[2:], strict=False):
        assert step.chosen == name
        click_at(hands, "left", *PaintScene.where(place))
    hands.next()
    hands.until(lambda: hands.window.step.report is not None, timeout_s=60.0)
    hands.next()
    hands.until(lambda: hands.window.step.report is not None, timeout_s=60.0)
    assert not hands.window.frame.verdict.verdict.acceptable
    assert said(hands).startswith("Not usable") and "index has the colour of skin" in said(hands)
    for name, other in zip(names[2:], names[1:], strict=False):
        assert f"{name} now has the colour that {other} had" in said(hands)
    assert hands.sentence == "Read what is wrong, then go back."
    hands.next()
    assert hands.window.frame.next_button.text() == "Use this calibration"
    assert not hands.window.frame.next_button.isEnabled()
    icons = [hands.window.page.table.item(0, column).icon().isNull() for column in (1, 2)]
    assert icons == [False, False]


def test_two_markers_of_one_colour_are_refused_and_undo_mends_it(hands):
    step = hands.window.step
    for name in ("thumb", "index"):
        click_at(hands, "left", *PaintScene.where(name))
    click_at(hands, "left", *PaintScene.where("index"))
    assert not step.view().verdict.acceptable
    assert "index and middle have one colour: their hues are 0° apart" in said(hands)
    assert [hands.window.page.list.item(row, 2).text() for row in (1, 2)] == ["as middle", "as index"]
    hands.key(Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert step.view().verdict is None and step.chosen == "middle" and step.gathering.names == ("thumb", "index")
    choose(hands, "index")
    click_at(hands, "left", *PaintScene.where("ring"))
    index = list(PAINTS).index("index")
    red, green, blue = step.markers.markers[index].display_rgb
    assert red < 90 < green < blue  # the ring's paint, at once
    hands.key(Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    red, green, blue = step.markers.markers[index].display_rgb
    assert blue < 90 < green < red and step.chosen == "index"


def said(hands):
    """The verdict shown, as running text."""
    verdict = hands.window.frame.verdict.verdict
    return "" if verdict is None else " ".join([verdict.sentence, *(one.sentence for one in verdict.findings)])


def test_the_page_says_which_test_a_camera_that_does_not_find_a_marker_refuses_it_by(hands, scene):
    other = PaintScene({name: rgb for name, rgb in PAINTS.items() if name != "ring"}, background=(60, 62, 66))
    hands.asker.draw = lambda node_id, t_s: (scene if node_id == 1 else other).draw(node_id, t_s)
    hands.until(lambda: hands.window.step._masked["right"].image.y[10, 10] < 90)  # grey, no longer wood
    choose(hands, "ring")
    click_at(hands, "left", *PaintScene.where("ring"))
    choose(hands, SKIN)
    x, y = on_skin("thumb")
    click_at(hands, "left", x - 4.0, y, to=(x + 4.0, y + 20.0))
    hands.until(lambda: "right has not seen ring: not found. " in hands.window.frame.hint.text())


def test_space_holds_the_pictures_for_a_click(hands, scene):
    scene.moving = True
    hands.window.frame.middle.setFocus()
    hands.key(Qt.Key.Key_Space)
    assert hands.window.step.held and "held" in hands.sentence
    hands.run(0.5)
    held = hands.window.step.held["left"]
    assert hands.window.frame.wall.views["left"].shown is held
    hands.key(Qt.Key.Key_Space)
    assert not hands.window.step.held


def test_alike_paints_are_said_to_be_alike(hands, scene):
    from rhot_app.calibration.colour.colours import solve_colours
    from rhot_app.calibration.colour.gathering import ColourGathering

    alike = {**PAINTS, "little": (26, 163, 204)}
    gathering = ColourGathering(("left",))
    for name in PAINTS:
        gathering.pick(name, "left", picture(alike), PaintScene.where(name))
    report = solve_colours(gathering.samples, gathering.views, base=hands.asker.rig.markers)
    assert not report.verdict.acceptable
    bands = [curve for curve in hue_chart(report).curves if curve.style == "band"]
    assert {curve.name for curve in bands if curve.name} == set(PAINTS)
    assert all(-180.0 <= curve.x[0] < curve.x[1] <= 180.0 for curve in bands)
