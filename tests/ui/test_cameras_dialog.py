"""Choosing cameras of this computer by clicks: webcams below a fake driver, films, refusals, names and modes."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from fake_backend import FakeBackend
from patience import PATIENCE_MS
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QFileDialog, QInputDialog
from screen_pictures import check, colours_in

from rhot_app.project import load_rig
from rhot_app.sources.cameras import camera_set
from rhot_app.sources.cameras.camera_set import camera_set_of
from rhot_app.ui.dialogs.cameras_dialog import CamerasDialog
from rhot_app.ui.models.palette import DARK
from rhot_node.capture.v4l2 import Device, Mode

WEBCAM = Device("/dev/video0", "HD Webcam", modes=(Mode(640, 480, 30.0), Mode(1280, 720, 30.0)))
HELD = Device("/dev/video2", "Other camera", problem="Another program uses this camera. Close it.")


def a_hand(width: int, height: int) -> np.ndarray:
    """(H, W, 3) BGR: something like a hand before a wall."""
    picture = np.full((height, width, 3), (96, 90, 84), np.uint8)
    picture[:] = np.clip(picture + np.linspace(-30, 30, width)[None, :, None], 0, 255)
    palm, colour = (width // 2, int(0.68 * height)), (120, 150, 205)
    cv2.ellipse(picture, palm, (height // 7, height // 5), 0, 0, 360, colour, -1)
    for finger in range(5):
        angle = np.radians(-150 + 30 * finger)
        tip = palm[0] + int(0.45 * height * np.cos(angle)), palm[1] + int(0.45 * height * np.sin(angle))
        cv2.line(picture, palm, tip, colour, height // 16)
    return cv2.GaussianBlur(picture, (5, 5), 0)


class StillPreview:
    """A camera that shows one picture at its rate."""

    def __init__(self, source) -> None:
        self.source, self.ended = source, False
        self.picture = a_hand(source.width, source.height)
        self.problem, self.remark, self.rate_hz = "", "", 29.6

    def stop(self) -> None:
        self.ended = True

    def wait(self) -> bool:
        return self.ended


class Chosen:
    """The dialog and what it has looked at."""

    def __init__(self, qtbot, *devices: Device) -> None:
        self.previews: list[StillPreview] = []
        self.devices = devices
        self.dialog = CamerasDialog(DARK, devices=lambda: self.devices, preview=self._preview)
        qtbot.addWidget(self.dialog)
        self.qtbot = qtbot
        self.dialog.show()
        self.settle()

    def _preview(self, source, after) -> StillPreview:
        assert after is None or after.ended
        self.previews.append(StillPreview(source))
        return self.previews[-1]

    def settle(self) -> None:
        """Until the worker is done."""
        self.qtbot.waitUntil(self.dialog.again_button.isEnabled, timeout=PATIENCE_MS)

    def click(self, button) -> None:
        assert button.isEnabled()
        self.qtbot.mouseClick(button, Qt.MouseButton.LeftButton)

    def tick(self, row: int) -> None:
        """Click the box of an entry."""
        rect = self.dialog.list.visualItemRect(self.dialog.list.item(row))
        self.qtbot.mouseClick(self.dialog.list.viewport(), Qt.MouseButton.LeftButton, pos=rect.center())
        QTest.keyClick(self.dialog.list, Qt.Key.Key_Space)

    def lines(self) -> list[str]:
        return [self.dialog.list.item(row).text() for row in range(self.dialog.list.count())]


@pytest.fixture(autouse=True)
def own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    monkeypatch.setattr(camera_set, "installed_folder", lambda: tmp_path)


def film(path: Path) -> str:
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 30.0, (64, 48))
    for _ in range(6):
        writer.write(np.random.default_rng(3).integers(0, 255, (48, 64, 3), np.uint8))
    writer.release()
    return str(path)


def test_a_webcam_is_seen_named_and_opened_in_another_mode(qtbot, themed):
    chosen = Chosen(qtbot, WEBCAM, HELD)
    dialog = chosen.dialog
    assert "HD Webcam (video0)" in chosen.lines()[0] and "640 × 480" in chosen.lines()[0]
    assert "cannot be used" in chosen.lines()[1]
    assert not dialog.open_button.isEnabled(), "nothing is ticked yet"
    qtbot.waitUntil(lambda: "30 frames/s" in dialog.rate.text(), timeout=PATIENCE_MS)
    assert dialog.picture.shown is not None
    dialog.mode_box.setCurrentIndex(1)
    dialog.mode_box.activated.emit(1)
    assert "1280 × 720" in chosen.lines()[0] and chosen.previews[0].ended
    chosen.click(dialog.turned_box)
    assert chosen.previews[-1].source.turned and chosen.previews[-2].ended
    def colours_of_box() -> int:
        box = dialog.list.visualItemRect(dialog.list.item(0))
        box.setWidth(box.height() // 2)
        return colours_in(dialog.list.viewport().grab(box).toImage())
    unticked = colours_of_box()
    chosen.tick(0)
    assert colours_of_box() > unticked, "a tick is drawn in the box"
    dialog.name_field.setFocus()
    qtbot.keyClicks(dialog.name_field, "desk/left")
    assert dialog.name_field.text() == "deskleft", "a name is part of file names"
    assert "deskleft" in chosen.lines()[0] and dialog.open_button.text() == "Open 1 camera"
    dialog.hand_box.setCurrentIndex(1)
    with qtbot.waitSignal(dialog.accepted, timeout=PATIENCE_MS):
        chosen.click(dialog.open_button)
    assert all(preview.ended for preview in chosen.previews), "a node cannot open what is open here"
    rig, cameras = load_rig(dialog.prepared.rig_path), camera_set_of(dialog.prepared.rig_path)
    assert rig.nodes[0].name == "deskleft" and rig.hand.side == "left"
    assert (cameras.cameras[0].spec, cameras.cameras[0].width) == ("/dev/video0", 1280)
    assert cameras.cameras[0].turned and not cameras.cameras[0].mirrored


def test_two_films_are_added_ticked_and_opened(qtbot, themed, tmp_path, monkeypatch):
    paths = [film(tmp_path / "left.avi"), film(tmp_path / "right.avi")]
    monkeypatch.setattr(QFileDialog, "getOpenFileNames", lambda *args: (paths, ""))
    chosen = Chosen(qtbot)
    dialog = chosen.dialog
    assert "no camera" in dialog.verdict.text()
    chosen.click(dialog.film_button)
    qtbot.waitUntil(lambda: dialog.open_button.text() == "Open 2 cameras", timeout=PATIENCE_MS)
    chosen.settle()
    chosen.click(dialog.film_button)
    qtbot.waitUntil(lambda: "in the list already" in dialog.verdict.text(), timeout=PATIENCE_MS)
    chosen.settle()
    with qtbot.waitSignal(dialog.accepted, timeout=PATIENCE_MS):
        chosen.click(dialog.open_button)
    rig = load_rig(dialog.prepared.rig_path)
    assert [node.name for node in rig.nodes] == ["left", "right"] and rig.tracked_with == (True, False)


def test_what_cannot_be_opened_is_told_and_not_added(qtbot, themed, tmp_path, monkeypatch):
    (tmp_path / "text.mp4").write_text("no film\n" * 99)
    chosen = Chosen(qtbot, HELD)
    dialog = chosen.dialog
    qtbot.waitUntil(lambda: "Another program" in dialog.picture.problem, timeout=PATIENCE_MS)
    for text, words in ((str(tmp_path / "text.mp4"), "no film"), ("ftp://10.0.0.1/x", "no address")):
        monkeypatch.setattr(QInputDialog, "getText", lambda *args, text=text: (text, True))
        chosen.click(dialog.address_button)
        qtbot.waitUntil(lambda words=words: words in dialog.verdict.text(), timeout=PATIENCE_MS)
        chosen.settle()
    assert len(chosen.lines()) == 1 and not dialog.open_button.isEnabled()
    dialog.reject()
    assert dialog.prepared is None and not (tmp_path / "data").exists()


def test_cameras_of_one_name_are_refused(qtbot, themed):
    chosen = Chosen(qtbot, WEBCAM, Device("/dev/video4", "HD Webcam", modes=WEBCAM.modes))
    dialog = chosen.dialog
    for row in range(2):
        chosen.tick(row)
        dialog.name_field.setFocus()
        qtbot.keyClicks(dialog.name_field, "left")
    chosen.click(dialog.open_button)
    assert "called left" in dialog.verdict.text() and dialog.isVisible()


def test_a_webcam_that_is_plugged_in_later_is_found_and_one_that_went_is_gone(qtbot, themed):
    chosen = Chosen(qtbot, WEBCAM)
    chosen.devices = (Device("/dev/video4", "New one", modes=WEBCAM.modes),)
    chosen.click(chosen.dialog.again_button)
    qtbot.waitUntil(lambda: any("New one" in line for line in chosen.lines()), timeout=PATIENCE_MS)
    assert len(chosen.lines()) == 1 and chosen.previews[0].ended


def test_everything_fits_a_small_screen(qtbot, themed):
    chosen = Chosen(qtbot, WEBCAM)
    dialog = chosen.dialog
    assert dialog.width() <= 1024 and dialog.height() <= 700
    assert dialog.minimumSizeHint().width() <= 1024 and dialog.minimumSizeHint().height() <= 700
    assert dialog.picture.width() > 500 and dialog.picture.height() > 300, "a picture is there to be seen"


def test_the_first_page_leads_to_the_cameras_and_opens_them(bench, tmp_path, monkeypatch):
    window = bench.window
    prepared = camera_set.prepare([camera_set.CameraSource(film(tmp_path / "hand.avi"), "hand.avi", 64, 48, 30.0, 0.2)])
    monkeypatch.setattr(window.dialogs, "choose_cameras", lambda scheme: prepared)
    bench.click(window.welcome.cameras_button)
    bench.until(lambda: f"open {prepared.rig_path.name}" in bench.backend.calls)
    assert isinstance(bench.backend, FakeBackend)
    assert window.actions_.own_cameras in window.menus.rig.actions()


def test_its_picture_for_the_guide(qtbot, themed, tmp_path):
    chosen = Chosen(qtbot, WEBCAM, HELD)
    dialog = chosen.dialog
    dialog.add([film(tmp_path / "right.avi")])
    qtbot.waitUntil(lambda: dialog.list.count() == 3, timeout=PATIENCE_MS)
    chosen.settle()
    dialog.list.setCurrentRow(0)
    qtbot.waitUntil(lambda: dialog.picture.shown is not None, timeout=PATIENCE_MS)
    check("cameras", dialog.grab().toImage(), 20)
