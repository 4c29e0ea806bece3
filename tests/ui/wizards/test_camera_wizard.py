"""The camera wizard, clicked through on cameras that obey: knobs, advice, undo, saved to the nodes and nowhere else."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from fake_engine import synthetic_rig
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QMessageBox
from wizard_rig import FakeRigClient, FakeSettingsStore

from rhot_app.calibration.registry import InForce, calibration
from rhot_app.ui.backend.feed import Picture
from rhot_app.ui.models.palette import DARK
from rhot_app.ui.wizards.camera import CONTROLS, CameraChoices, CameraEye, SettingsStep, make_wizard
from rhot_app.ui.wizards.framework.definition import WizardContext
from rhot_app.ui.wizards.framework.drawing import Layer
from rhot_node.config import CameraSettings

EXPOSURE, RED = CONTROLS[0], CONTROLS[5]
LIT = 150.0  # level of the room at 4 ms


class Room:
    """A grey room before obedient cameras: more exposure, brighter picture; gains colour it."""

    def __init__(self, client):
        self.client = client
        ramp = np.linspace(0.6, 1.2, 640)[None, :, None] * np.ones((480, 1, 3))
        self.scene = ramp.astype(np.float32)
        self.noise = np.random.default_rng(2).normal(0, 2, (480, 640, 3)).astype(np.float32)

    def draw(self, node_id, t_s):
        camera = self.client.settings[node_id].camera
        gains = np.array([camera.blue_gain or 1.0, 1.0, camera.red_gain or 1.0]) * [1.0, 1.0, 1.25]
        light = self.scene * gains * camera.exposure_us / 4000.0 * (camera.gain or 1.0)
        picture = LIT * light ** (1 / 2.2) + self.noise
        cv2.circle(picture, (320, 240), 20, (30.0, 30.0, 200.0), -1)
        return np.clip(picture, 0, 255).astype(np.uint8)


@pytest.fixture(scope="module", autouse=True)
def compiled():
    """What looks at pictures is compiled at its first use, also what follows once a marker is found: no test should
    wait for it."""
    client = FakeRigClient(synthetic_rig())
    eye = CameraEye(client.rig.markers)
    for number, picture in enumerate((painted(client.rig), Room(client).draw(client.rig.nodes[0].node_id, 0.0))):
        eye.look(Picture("left", picture, number, number * 30_000_000, 0), CameraSettings(), None)


@pytest.fixture
def client():
    client = FakeRigClient(synthetic_rig())
    client.draw = Room(client).draw
    return client


@pytest.fixture
def hands(open_wizard, client):
    return open_wizard("camera", client, in_file=False)


def row(hands, field):
    return hands.window.page.rows[field]


def exposures(client):
    return [client.settings[node_id].camera.exposure_us for node_id in (1, 2)]


def drag_grey(hands):
    view = hands.frame.grid.views["left"]
    hands.until(lambda: view.shown is not None)
    QTest.mouseClick(view, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier,
                     view.rect().center() + QPoint(0, 80))


def test_from_a_dark_picture_to_saved_settings(hands, client):
    row(hands, "exposure_us").box.setValue(0.3)
    hands.until(lambda: exposures(client) == [300.0, 300.0])
    assert client.saved == [], "what is tried out is not saved"
    row(hands, "exposure_us").box.setValue(5.0)
    hands.until(lambda: exposures(client) == [5000.0, 5000.0])
    hands.until(lambda: hands.verdict is not None)
    hands.next()
    assert hands.window.page.table.text(0, 2) == "5.00 ms"
    assert "any time" not in hands.window.page.note.text(), "nodes keep no earlier settings"
    hands.use()
    assert client.saved == [1, 2] and exposures(client) == [5000.0, 5000.0]
    hands.restore()
    assert exposures(client) == [4000.0, 4000.0] and client.saved == [1, 2, 2, 1]


def painted(rig):
    """A room in which every marker of the rig is seen."""
    picture = np.repeat(np.linspace(60, 150, 640, dtype=np.uint8)[None, :, None], 480, axis=0).repeat(3, axis=2)
    for number, marker in enumerate(rig.markers.markers):
        cv2.circle(picture, (60 + 90 * number, 200), 16, tuple(map(int, marker.display_rgb[::-1])), -1, cv2.LINE_AA)
    return picture


def test_a_good_check_is_a_result_and_ticks_the_menu(hands, client):
    picture = painted(client.rig)
    client.draw = lambda node_id, t_s: picture
    hands.until(lambda: "good" in hands.sentence)
    hands.until(lambda: hands.frame.steps.states[0] == "current" and hands.window.step.view().done)
    told = []
    hands.window.used.connect(lambda proposal, on: told.append((proposal.reason, proposal.rig, on)))
    hands.next()
    assert hands.window.page.table.records_model.rowCount() > 0
    hands.use()
    assert told == [("camera settings", None, True)] and client.saved == []


@pytest.mark.parametrize(("shown", "code"), [("grey", "colourless"), ("covered", "flat")])
def test_no_other_pictures_are_good(hands, client, shown, code):
    grey = cv2.cvtColor(cv2.cvtColor(painted(client.rig), cv2.COLOR_BGR2GRAY), cv2.COLOR_GRAY2BGR)
    picture = grey if shown == "grey" else np.full_like(grey, 130)
    client.draw = lambda node_id, t_s: picture
    hands.until(lambda: hands.verdict is not None and code in hands.verdict.codes)
    hands.until(lambda: "flicker_waiting" not in hands.verdict.codes)
    assert code in hands.verdict.codes and not hands.verdict.acceptable and not hands.window.step.view().done


def test_a_camera_that_gives_no_picture_is_not_good(client):
    step = SettingsStep(CameraChoices(client.rig.nodes, client.told), client.rig.markers)
    for number in range(12):
        shown = {"left": Picture("left", painted(client.rig), number, number * 30_000_000, 1 + number * 400_000_000)}
        step.accept_observation(step.observe(shown))
        if number == 5:
            assert step.view().verdict.acceptable and not step.view().may_go_on, "the other one may be slow"
    assert step.view().verdict.codes >= {"no_picture"} and not step.view().done


def test_settings_that_are_worse_are_not_used(hands, client):
    picture = painted(client.rig)

    def draw(node_id, t_s):
        grey = np.full_like(picture, 130)
        return grey if client.settings[node_id].camera.contrast == 0.0 else picture

    client.draw = draw
    hands.until(lambda: hands.verdict is not None and hands.verdict.acceptable)
    row(hands, "contrast").check_box.setChecked(True)
    row(hands, "contrast").box.setValue(0.0)
    hands.until(lambda: "flat" in hands.verdict.codes)
    hands.next()
    assert not hands.verdict.acceptable and not hands.window.step.usable


def test_closing_puts_back_what_was_tried_out(hands, client, monkeypatch):
    monkeypatch.setattr(QMessageBox, "question", lambda *args: QMessageBox.StandardButton.Discard)
    row(hands, "exposure_us").box.setValue(20.0)
    hands.until(lambda: exposures(client) == [20000.0, 20000.0])
    hands.key(Qt.Key.Key_Escape)
    hands.until(lambda: exposures(client) == [4000.0, 4000.0])
    assert client.saved == []


def test_too_bright_pictures_are_striped_and_told(hands, client):
    row(hands, "exposure_us").box.setValue(30.0)
    hands.until(lambda: hands.verdict is not None
                and "over" in hands.verdict.codes)

    def striped(camera):  # the other camera's pictures may be the first to be too bright
        layer = next((mark for mark in hands.frame.grid.views[camera].overlay if isinstance(mark, Layer)), None)
        return layer is not None and layer.rgba[..., 3].mean() > 20.0

    hands.until(lambda: striped("left") and striped("right"))
    finding = next(f for f in hands.verdict.findings if f.code == "over")
    assert finding.figure.startswith(("left: ", "right: ")) and "Shorten exposure to " in finding.remedy


def test_one_camera_alone_undo_and_a_slider(hands, client):
    page = hands.window.page
    page.which.setCurrentIndex(2)
    slider = row(hands, "exposure_us").slider
    slider.setSliderDown(True)
    for step in (250, 260, 270):
        slider.setValue(step)
    slider.setSliderDown(False)
    hands.until(lambda: exposures(client)[1] > 4000.0)
    assert exposures(client)[0] == 4000.0
    hands.click(page.undo_button)
    hands.until(lambda: exposures(client) == [4000.0, 4000.0])
    assert not page.undo_button.isEnabled(), "a whole movement of the slider is one step"


def test_a_setting_is_left_to_the_camera_or_told(hands, client):
    told = row(hands, "gain").check_box
    assert not told.isChecked() and not row(hands, "gain").box.isEnabled()
    told.setChecked(True)
    hands.until(lambda: client.settings[1].camera.gain == 1.0)
    told.setChecked(False)
    hands.until(lambda: client.settings[1].camera.gain is None)
    assert not row(hands, "exposure_us").check_box.isEnabled(), "a camera must be told how long to expose"


def test_grey_paper_balances_the_colours(hands, client):
    page = hands.window.page
    page.which.setCurrentIndex(1)
    drag_grey(hands)
    hands.until(page.balance_button.isEnabled)

    def balanced():
        if page.balance_button.isEnabled():
            hands.click(page.balance_button)
        camera = client.settings[1].camera
        return camera.red_gain == pytest.approx(0.8, abs=0.06) and camera.blue_gain == pytest.approx(1.0, abs=0.06)

    hands.until(balanced)


def test_choices_say_only_what_differs(client):
    choices = CameraChoices(client.rig.nodes, client.told)
    assert choices.changed == () and choices.rows(choices.changed) == ()
    choices.change((2,), RED, 1.5)
    assert [node.name for node in choices.changed] == ["right"]
    assert choices.differences(2) == ({"camera": {"red_gain": None}}, {"camera": {"red_gain": 1.5}})
    assert next(r for r in choices.rows(choices.changed) if r.changed).before == "left to the camera"
    with pytest.raises(ValueError, match="0"):
        choices.change((2,), EXPOSURE, -1.0)


def test_a_silent_node_has_no_knobs(themed, client, qtbot):
    context = WizardContext(calibration("camera"), InForce(client.rig), client.connect, DARK, FakeSettingsStore())
    plan = make_wizard(context)
    view = plan.pages[0].step.view()
    assert "No camera" in view.sentence and not view.may_go_on
    for page in plan.pages:
        qtbot.addWidget(page)
