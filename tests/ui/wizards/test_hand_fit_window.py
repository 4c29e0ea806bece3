"""The window that fits a hand to pictures, worked as a person works it: drags, sliders, keys, files."""

from __future__ import annotations

import signal
from pathlib import Path

import cv2
import msgspec
import numpy as np
import pytest
from fake_engine import FakeClient, FakeEngine
from fit_scenes import another_hand, begun, drawn, seen
from patience import PATIENCE_S
from person import NONE, Person
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QFileDialog, QInputDialog, QMessageBox
from screen_pictures import check
from wizard_rig import FakeRigClient

from rhot_app.errors import RigError
from rhot_app.hand.anatomy import load_hand
from rhot_app.hand.skeleton import FINGERS, JOINTS
from rhot_app.handfit.hand_shape import ROOTS
from rhot_app.handfit.session import HandFit
from rhot_app.project import load_rig, save_rig
from rhot_app.rig_history import versions
from rhot_app.ui import app
from rhot_app.ui.common.settings import Settings
from rhot_app.ui.handfit.frame import Kept
from rhot_app.ui.handfit.instants import TITLE
from rhot_app.ui.handfit.live import fit_live
from rhot_app.ui.handfit.window import HandFitWindow
from rhot_app.ui.language import use_language
from rhot_app.ui.models.palette import DARK, LIGHT

INDEX_TIP, WRIST = JOINTS.index("index_tip"), JOINTS.index("wrist")
CONTROL, SHIFT = Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.ShiftModifier


class Fitter(Person):
    """A person with the mouse on the joints of one fit."""

    def __init__(self, fit: HandFit, settings: Settings, kept: Kept, scheme=DARK, size=(1280, 800)):
        self.fit = fit
        window = HandFitWindow(fit, scheme, settings, kept)
        self.frame = window.frame
        window.resize(*size)
        super().__init__(window)

    def told(self):
        return self.sentence

    @property
    def sentence(self):
        return self.frame.sentence.text()

    def at(self, camera, joint):
        view = self.frame.views[camera]
        return view.to_widget(*view.joints[joint]).toPoint()

    def drag_joint(self, camera, joint, dx, dy):
        """Over the screen by so many px; returns where in the picture it ended."""
        view, start = self.frame.views[camera], self.at(camera, joint)
        end = start + QPoint(dx, dy)
        self.drag(view, start, start + QPoint(4, 4), end)  # farther than a click
        place = view.place()
        return ((end.x() - place.target.x()) / place.scale - 0.5, (end.y() - place.target.y()) / place.scale - 0.5)

    def put(self, camera, places):
        """Joints by number to px of a picture, each at once."""
        for joint, place in places.items():
            self.fit.grab(camera, joint)
            self.fit.drag((float(place[0]), float(place[1])), last=True)
            self.fit.release()
        self.window.refresh()

    def key(self, key, modifier=NONE, widget=None):
        self.press(key, widget, modifier)

    def row(self, group, name):
        self.frame.form.show_group(group)
        number = next(one for one in self.fit.numbers if (one.group, one.name) == (group, name))
        return self.frame.form.rows[number.key], number


@pytest.fixture
def person(themed, tmp_path):
    people = []

    def make(fit=None, kept=None, **options):
        fit = begun(true_pose=True) if fit is None else fit
        fit.begin()
        people.append(Fitter(fit, Settings(tmp_path / "app.ini"), kept or Kept(), **options))
        return people[-1]

    yield make
    for one in people:
        assert one.window.end().wait(PATIENCE_S)
        one.window.deleteLater()


def test_a_joint_is_dragged_to_the_pointer_and_brought_back(person):
    one = person()
    before = one.fit.state
    end = one.drag_joint(0, INDEX_TIP, 12, 20)
    assert one.frame.views[0].joints[INDEX_TIP] == pytest.approx(end, abs=0.5)
    assert "1 anchor" in one.frame.errors.text() and one.frame.undo_button.isEnabled()
    one.key(Qt.Key.Key_Z, CONTROL)
    assert one.fit.state is before and all(word in one.sentence for word in ("index tip", "camera 1"))
    assert one.frame.errors.text() == "no anchors" and not one.frame.undo_button.isEnabled()
    one.key(Qt.Key.Key_Z, CONTROL)
    assert one.fit.state is before, "nothing to undo is no error"
    one.key(Qt.Key.Key_Z, CONTROL | SHIFT)
    assert one.frame.views[0].joints[INDEX_TIP] == pytest.approx(end, abs=0.5)
    assert not one.frame.redo_button.isEnabled()


def test_a_right_click_and_a_button_free_joints(person):
    one = person()
    one.drag_joint(0, INDEX_TIP, 12, 20)
    one.drag_joint(1, WRIST, -5, 5)
    QTest.mouseClick(one.frame.views[0], Qt.MouseButton.RightButton, Qt.KeyboardModifier.NoModifier,
                     one.at(0, INDEX_TIP))
    assert "1 anchor," in one.frame.errors.text()
    one.click(one.frame.free_button)
    assert one.frame.errors.text() == "no anchors" and not one.frame.free_button.isEnabled()


def test_a_joint_dragged_out_of_the_picture_is_refused(person):
    one = person()
    view = one.frame.views[0]
    start = one.at(0, INDEX_TIP)
    inside = view.place().target
    one.drag_joint(0, INDEX_TIP, 0, round(inside.y()) - start.y() - 30)
    assert all(word in one.sentence for word in ("outside", "camera 1"))
    last = one.fit.instant.anchors[0].pixel if one.fit.instant.anchors else (0.0, 0.0)
    assert last[1] >= -0.5
    one.drag_joint(0, WRIST, 4, 4)
    assert "outside" not in one.sentence


def test_joints_are_moved_by_keys_alone(person):
    one = person()
    view = one.frame.views[1]
    view.setFocus()
    for _ in range(2):
        one.key(Qt.Key.Key_Period, widget=view)
    joint = view.joint
    x, y = view.joints[joint]
    one.key(Qt.Key.Key_Right, SHIFT, widget=view)
    one.key(Qt.Key.Key_Up, widget=view)
    assert view.joints[joint] == pytest.approx((x + 5.0, y - 0.5), abs=0.5)
    one.key(Qt.Key.Key_Delete, widget=view)
    assert not one.fit.instant.anchors


def test_a_slider_moves_a_number_in_one_step(person):
    one = person()
    before = one.fit.state
    row, number = one.row("Index", "PIP flexion")
    slider, before_value = row.slider, one.fit.value(number)
    handle = QPoint(round(slider.width() * slider.value() / slider.maximum()), slider.height() // 2)
    QTest.mousePress(slider, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, handle)
    for part in range(1, 6):
        QTest.mouseMove(slider, handle + QPoint(12 * part, 0))
    QTest.mouseRelease(slider, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, handle + QPoint(60, 0))
    moved = one.fit.value(number)
    assert moved > before_value + 5.0 and row.box.value() == pytest.approx(moved, abs=0.06)
    assert "±" in row.spread.text()
    one.window.setFocus()
    one.key(Qt.Key.Key_Z, CONTROL)
    assert one.fit.state is before and row.box.value() == pytest.approx(one.fit.value(number), abs=0.06)


def test_a_number_is_typed(person):
    one = person()
    row, number = one.row("Lengths", "middle medial")
    row.box.setFocus()
    row.box.selectAll()
    QTest.keyClicks(row.box, "29.5")
    QTest.keyClick(row.box, Qt.Key.Key_Return)
    assert one.fit.value(number) == pytest.approx(29.5, abs=1e-4)
    assert one.fit.undoable == "lengths, middle medial"


def test_a_click_on_a_joint_shows_the_numbers_of_its_finger(person):
    one = person()
    QTest.mouseClick(one.frame.views[0], Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier,
                     one.at(0, JOINTS.index("ring_tip")))
    assert one.frame.form.group == "Ring"
    assert one.frame.errors.text() == "no anchors", "a click drags nothing"
    one.frame.form.show_group("Lengths")
    one.drag_joint(0, JOINTS.index("thumb_tip"), 1, 1)
    assert one.frame.form.group == "Lengths", "a group of the shape stays"


def test_a_click_on_the_wrist_shows_the_palm_in_every_language(person):
    use_language("de")
    one = person()
    one.frame.form.show_group("Thumb")
    QTest.mouseClick(one.frame.views[0], Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, one.at(0, WRIST))
    assert one.frame.form.group == "Palm" and one.frame.form.group_box.currentText() == "Handfläche"
    assert one.frame.form.group_box.itemText(len(FINGERS)) == "Kleiner Finger"
    use_language("en")


def test_the_wheel_zooms_about_the_pointer_and_a_double_click_shows_all(person):
    one = person()
    view = one.frame.views[0]
    at = QPointF(view.to_widget(*view.joints[INDEX_TIP]))
    for _ in range(4):
        QApplication.sendEvent(view, QWheelEvent(at, view.mapToGlobal(at), QPoint(0, 0), QPoint(0, 120),
                                                 Qt.MouseButton.NoButton, Qt.KeyboardModifier.NoModifier,
                                                 Qt.ScrollPhase.NoScrollPhase, False))
    place = view.place()
    assert place.scale > 1.5 and view.to_widget(*view.joints[INDEX_TIP]).x() == pytest.approx(at.x(), abs=1.5)
    end = one.drag_joint(0, INDEX_TIP, 15, 10)
    assert view.joints[INDEX_TIP] == pytest.approx(end, abs=0.5)
    one.key(Qt.Key.Key_F)
    assert view.place().scale > 1.0
    corner = view.rect().bottomRight() - QPoint(4, 4)
    QTest.mouseDClick(view, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, corner)
    assert view.place().target.width() == pytest.approx(view.width())


def test_lengths_from_anchors_are_saved_as_a_hand_file(person, tmp_path, monkeypatch):
    """Drag every joint to where another hand has it, fit, save: the file has that hand's bones."""
    one = person()
    rig, pose, _ = drawn()
    hand = another_hand(rig.hand, 3, only=slice(0, 18))
    one.frame.freedom_box.setCurrentIndex(1)
    for camera, places in enumerate(seen(hand, pose, one.fit.cameras)):
        one.put(camera, dict(enumerate(places)))
    one.key(Qt.Key.Key_Return, CONTROL)
    one.until(lambda: "Fitted" in one.sentence)
    assert "42 anchors" in one.frame.errors.text()
    lengths = [number for number in one.fit.numbers if number.kind == "length"]
    truth = [bone for finger in hand.fingers.values() for bone in finger.bones_mm]
    off = [abs(one.fit.value(number) - bone) / one.fit.sd(number) for number, bone in zip(lengths, truth, strict=True)]
    assert max(off) < 3.0
    out = tmp_path / "mine.json"
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *args: (str(out), ""))
    one.key(Qt.Key.Key_S, CONTROL)
    assert f"Saved: {out}" in one.sentence
    saved = load_hand(out)
    assert saved == one.window.named_hand and "fitted to pictures" in saved.name
    assert [bone for finger in saved.fingers.values() for bone in finger.bones_mm] == pytest.approx(
        [one.fit.value(number) for number in lengths], abs=1e-5)


def test_a_hand_that_cannot_be_saved_is_said_and_kept(person, tmp_path):
    one = person(kept=Kept(out=tmp_path / "nowhere" / "hand.json"))
    one.drag_joint(0, INDEX_TIP, 5, 5)
    one.click(one.frame.save_button)
    assert "cannot be written" in one.sentence and one.fit.errors_px()


def test_the_rig_gets_the_hand_or_a_sentence_says_why_not(person):
    taken = []

    def use(hand):
        if not taken:
            taken.append("refused")
            raise RigError("desk.json: cannot be written (Read-only file system); nothing was changed.")
        taken.append(hand)

    one = person(kept=Kept(use))
    one.row("Lengths", "index proximal")[0].box.setValue(42.0)
    one.click(one.frame.use_button)
    one.until(lambda: "Read-only" in one.sentence)
    assert one.fit.unsaved
    used = []
    one.window.used.connect(lambda: used.append(True))
    one.click(one.frame.use_button)
    one.until(lambda: bool(used))
    assert taken[1].fingers["index"].bones_mm[0] == pytest.approx(42.0, abs=1e-4) and not one.fit.unsaved
    assert "Bring back" in one.sentence


def test_a_pose_is_no_other_hand(person, tmp_path):
    taken = []
    one = person(kept=Kept(taken.append, out=tmp_path / "hand.json"))
    base = one.fit.shapes.base
    one.drag_joint(0, INDEX_TIP, 5, 5)
    one.click(one.frame.use_button)
    assert taken == [] and "only the pose" in one.sentence
    one.click(one.frame.save_button)
    assert load_hand(tmp_path / "hand.json") == base


def test_closing_asks_only_when_the_hand_was_changed(person, monkeypatch):
    asked = []
    monkeypatch.setattr(QMessageBox, "question", lambda *args: asked.append(1) or QMessageBox.StandardButton.Cancel)
    one = person()
    one.drag_joint(0, INDEX_TIP, 5, 5)
    one.row("Lengths", "index proximal")[0].box.setValue(42.0)
    one.window.reject()
    assert asked and one.window.isVisible()
    one.fit.note_saved()
    one.window.reject()
    assert len(asked) == 1 and not one.window.isVisible()


def test_pictures_are_opened_from_files_and_mistakes_are_sentences(person, tmp_path, monkeypatch):
    rig, _, images = drawn()
    names = [str(tmp_path / f"{k}.png") for k in range(2)]
    for name, image in zip(names, images, strict=True):
        cv2.imwrite(name, image[:, :, ::-1])
    (tmp_path / "text.png").write_text("no picture")
    one = person(HandFit(rig))
    assert "Open a picture" in one.sentence
    assert not one.frame.contours_button.isEnabled() and not one.frame.save_button.isEnabled()
    monkeypatch.setattr(QFileDialog, "getOpenFileNames", lambda *args: ([str(tmp_path / "text.png")], ""))
    one.click(one.frame.open_button)
    assert "is not a picture" in one.sentence and one.fit.instant is None
    monkeypatch.setattr(QFileDialog, "getOpenFileNames", lambda *args: (names[::-1], ""))
    for _ in range(2):
        one.click(one.frame.open_button)
    assert [one.frame.instant_box.itemText(k) for k in range(2)] == ["Instant 1", "Instant 2"]
    assert one.frame.instant_box.currentText() == "Instant 2"
    assert np.array_equal(one.fit.instant.images[0], images[0])
    one.click(one.frame.remove_button)
    assert one.frame.instant_box.count() == 1
    one.click(one.frame.undo_button)
    assert one.frame.instant_box.count() == 2


def test_pictures_come_from_videos_at_a_second(person, tmp_path, monkeypatch):
    rig, _, images = drawn()
    names = {"camera 2": images[1], "camera 1": images[0]}
    for name, image in names.items():
        writer = cv2.VideoWriter(str(tmp_path / f"{name}.avi"), cv2.VideoWriter_fourcc(*"MJPG"), 10.0, (640, 480))
        for k in range(20):
            writer.write(image[:, :, ::-1] if k >= 10 else np.zeros_like(image))
        writer.release()
    one, chosen = person(HandFit(rig)), [str(tmp_path / f"{name}.avi") for name in names]
    monkeypatch.setattr(QFileDialog, "getOpenFileNames", lambda *args: (chosen, ""))
    monkeypatch.setattr(QInputDialog, "getDouble", lambda *args: (1.5, True))
    one.click(one.frame.open_button)
    for camera, image in enumerate(images):
        assert np.mean(np.abs(one.fit.instant.images[camera].astype(float) - image)) < 5.0
    monkeypatch.setattr(QInputDialog, "getDouble", lambda *args: (9.0, True))
    one.click(one.frame.open_button)
    assert "second 9" in one.sentence and len(one.fit.state.instants) == 1
    monkeypatch.setattr(QInputDialog, "getDouble", lambda *args: (0.0, False))
    one.click(one.frame.open_button)
    assert len(one.fit.state.instants) == 1, "thought better of it"


def test_the_contours_finish_what_was_begun_by_hand(person):
    one = person()
    row, number = one.row("Index", "MCP flexion")
    right = one.fit.value(number)
    row.box.setValue(right + 8.0)
    one.click(one.frame.contours_button)
    assert not one.frame.undo_button.isEnabled() and one.frame.cancel_button.isVisible()
    one.until(lambda: "contour was found" in one.sentence)
    assert one.fit.value(number) == pytest.approx(right, abs=3.0)
    assert one.fit.undoable == "fitting to contours" and not one.frame.cancel_button.isVisible()


def test_what_is_looked_for_can_be_cancelled(person):
    one = person()
    before = one.fit.state
    one.click(one.frame.find_button)
    one.click(one.frame.cancel_button)
    assert "Cancelled" in one.sentence and one.fit.state is before
    one.run(0.2)
    assert one.fit.state is before and one.frame.find_button.isEnabled()


def test_choices_are_remembered(person, tmp_path):
    one = person()
    one.frame.freedom_box.setCurrentIndex(2)
    one.frame.sd_box.setValue(1.5)
    one.window.close()
    other = person()
    assert other.fit.freedom == "roots" and other.fit.anchor_sd_px == 1.5


@pytest.mark.parametrize(("size", "scheme"), [((1280, 800), DARK), ((1024, 700), LIGHT)])
def test_everything_is_in_sight(person, size, scheme):
    one = person(size=size, scheme=scheme, kept=Kept(lambda hand: None))
    assert (one.window.width(), one.window.height()) == size
    for part in (one.frame.save_button, one.frame.use_button, one.frame.close_button, one.frame.undo_button,
                 one.frame.redo_button, one.frame.reset_button, one.frame.contours_button, *one.frame.views):
        corner = part.mapTo(one.window, part.rect().bottomRight())
        assert one.window.rect().contains(corner), part.objectName() or part.accessibleName()
    for view in one.frame.views:
        assert view.width() >= 280
    for row in one.frame.form.rows.values():
        one.frame.form.show_group(row.number.group)
        one.run(0.0)
        viewport = row.parentWidget().parentWidget()
        right = row.spread.mapTo(viewport, row.spread.rect().topRight()).x()
        assert row.spread.text() and right < viewport.width(), f"{row.number.name} is cut off"


def test_picture(person, tmp_path):
    rig, pose, images = drawn()
    fit = HandFit(rig, another_hand(rig.hand, 5, only=slice(0, ROOTS)))
    fit.add_pictures(dict(enumerate(images)), pose)
    fit.anchor_sd_px = 2.0
    one = person(fit, Kept(lambda hand: None))
    one.frame.freedom_box.setCurrentIndex(1)
    places = seen(rig.hand, pose, fit.cameras)
    names = ("wrist", "index_mcp", "little_mcp", *(f"{finger}_tip" for finger in FINGERS))
    joints = [JOINTS.index(name) for name in names]
    for camera in range(2):
        one.put(camera, {joint: places[camera][joint] for joint in joints})
    one.click(one.frame.anchors_button)
    one.until(lambda: "Fitted" in one.sentence)
    one.frame.form.show_group("Lengths")
    one.key(Qt.Key.Key_F)
    one.frame.views[0].choose(JOINTS.index("index_tip"))
    one.frame.views[1].choose(-1)
    check("hand-fit", one.window.grab().toImage(), 60)


def test_command_refusals_are_sentences_before_a_window_opens(tmp_path, capsys, monkeypatch):
    from rhot_app.__main__ import main

    rig, _, images = drawn()
    save_rig(tmp_path / "rig.json", rig)
    save_rig(tmp_path / "bare.json", msgspec.structs.replace(rig, calibration=None))
    picture = str(tmp_path / "left.png")
    cv2.imwrite(picture, images[0][:, :, ::-1])
    good = ["fit-hand", "--rig", str(tmp_path / "rig.json"), "--pictures", picture]
    for arguments, sentence in (
            (["fit-hand", "--rig", str(tmp_path / "bare.json"), "--pictures", picture], "No camera of this rig"),
            (["fit-hand", "--rig", str(tmp_path / "rig.json"), "--pictures", str(tmp_path / "rig.json")],
             "is not a picture"),
            ([*good, "--save", str(tmp_path / "none" / "hand.json")], "does not exist"),
            ([*good, "--save", str(tmp_path / "rig.json")], "is no hand file"),
            (["fit-hand", "--rig", str(tmp_path / "rig.json"), "--pictures", "up=left.avi"], "no camera 'up'"),
            ([*good, "--hand", str(tmp_path / "rig.json")], "rig.json")):
        assert main(arguments) == 2
        assert sentence in capsys.readouterr().err
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM"):
        monkeypatch.delenv(name, raising=False)
    assert main(good) == 2 and "no screen here" in capsys.readouterr().err
    assert sorted(path.name for path in Path(tmp_path).glob("*.json")) == ["bare.json", "rig.json"]


def test_the_command_ends_the_work_under_way_as_the_app_does(themed, tmp_path, monkeypatch):
    from rhot_app.__main__ import main

    rig, _, images = drawn()
    save_rig(tmp_path / "rig.json", rig)
    cv2.imwrite(str(tmp_path / "left.png"), images[0][:, :, ::-1])
    ended = []
    monkeypatch.setenv("QT_QPA_PLATFORM", "offscreen")
    monkeypatch.setattr(signal, "signal", lambda *_: None)
    monkeypatch.setattr(QApplication, "exec", lambda *_: 0)
    monkeypatch.setattr(app, "leave", lambda code: ended.append(code) or code)
    assert main(["fit-hand", "--rig", str(tmp_path / "rig.json"), "--pictures", str(tmp_path / "left.png"),
                 "--settings", str(tmp_path / "app.ini")]) == 0
    assert ended == [0]


# -- on a rig whose cameras run ----------------------------------------------------------------------------------------

class FittedRigClient(FakeRigClient):
    """Gives the drawn pictures of the hand, as the nodes would."""

    def __init__(self, rig):
        images = {node.node_id: image for node, image in zip(rig.nodes, drawn()[2], strict=True)}
        super().__init__(rig, lambda node_id, t_s: images[node_id][:, :, ::-1])


@pytest.fixture
def live(themed, tmp_path):
    """Opens the window on a rig whose cameras run and whose hand is tracked, if the engine is `running`."""
    opened = []

    def make(*, running, refuse=""):
        rig, _, _ = drawn()
        path = tmp_path / "desk.json"
        save_rig(path, rig)
        client, engine = FittedRigClient(rig), FakeEngine(running=running)
        client.refuse = refuse
        opened.append(fit_live(HandFit(rig), path, client.connect, lambda: FakeClient(engine), DARK,
                               Settings(tmp_path / "app.ini"), None))
        return Person(opened[-1]), path, client

    yield make
    for window in opened:
        assert window.end().wait(PATIENCE_S)
        window.deleteLater()


def test_pictures_are_taken_of_live_cameras_and_the_hand_goes_to_the_rig(live):
    one, path, client = live(running=True)
    window = one.window
    one.until(lambda: window.cameras.pose() is not None
              and len(window.cameras.feed.together(window.fit.names)) == 2)
    one.until(lambda: all(view.shown is not None for view in window.frame.views))
    assert window.frame.instant_box.currentText() == "Live pictures"
    one.press(Qt.Key.Key_Space)
    assert window.fit.instant is not None and "where it is tracked" in window.message
    assert not window.live and set(window.fit.instant.images) == {0, 1}
    window.frame.form.show_group("Lengths")
    number = next(one for one in window.fit.numbers if one.kind == "length")
    window.frame.form.rows[number.key].box.setValue(50.0)
    one.click(window.frame.use_button)
    one.until(lambda: "has this hand" in window.message)
    assert client.rig.hand.fingers["thumb"].bones_mm[0] == pytest.approx(50.0, abs=1e-4)
    assert load_rig(path).hand == client.rig.hand and versions(path)[0].replaced_by == "hand fitted to pictures"
    window.frame.instant_box.setCurrentIndex(0)
    window.frame.instant_box.activated.emit(0)
    assert window.live and not window.frame.contours_button.isEnabled()


def test_cameras_without_pictures_are_said(live):
    one, _, client = live(running=False, refuse="Nothing heard from 127.0.0.1 for 2 s.")
    frame = one.window.frame
    one.until(lambda: all(view.problem == client.refuse for view in frame.views))
    one.click(frame.take_button)
    assert "No camera" in frame.sentence.text() and one.window.fit.instant is None


def test_the_calibrate_menu_opens_it_and_refuses_without_a_calibration(make_bench):
    bench = make_bench()
    bench.track()
    bench.window.actions_.fit.trigger()
    bench.until(lambda: bench.window.wizards.fit is not None)
    assert bench.window.wizards.fit.windowTitle() == TITLE
    bench.window.wizards.fit.reject()
    bench.until(lambda: bench.window.wizards.fit is None)
    bench.backend.engine.rig = msgspec.structs.replace(bench.backend.engine.rig, calibration=None)
    bench.window.actions_.fit.trigger()
    bench.until(lambda: bench.said("No camera", "calibrated"))
