"""The hand networks in the window: whether they are there, installed with progress, cancelled, refused."""

from __future__ import annotations

import threading

import pytest
from patience import PATIENCE_MS, PATIENCE_S
from PySide6.QtCore import Qt

from rhot_app.ui.dialogs.networks_dialog import NetworksDialog
from rhot_node.errors import KeypointError
from rhot_node.landmarks import install
from rhot_node.landmarks.install import FILES, WheelFile, user_folder

EMPTY_SHA256 = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"


@pytest.fixture
def opened(qtbot, themed, tmp_path, monkeypatch):
    """A function that opens the dialog on a computer without networks, which are empty files here."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    for name in FILES:
        monkeypatch.setitem(install.FILES, name, WheelFile(name, EMPTY_SHA256))

    def open_with(work):
        dialog = NetworksDialog(install=work)
        qtbot.addWidget(dialog)
        dialog.show()
        qtbot.waitUntil(lambda: "not installed" in dialog.sentence.text(), timeout=PATIENCE_MS)
        return dialog
    return open_with


def place(folder, wheel, progress):
    """An installation."""
    progress("Downloading", 0.5)
    folder.mkdir(parents=True)
    for name in FILES:
        (folder / name).touch()


def click(qtbot, button):
    qtbot.mouseClick(button, Qt.MouseButton.LeftButton)


def test_networks_are_installed_and_said_to_be_whole(opened, qtbot):
    dialog = opened(place)
    assert not dialog.cancel_button.isEnabled()
    click(qtbot, dialog.install_button)
    qtbot.waitUntil(lambda: str(user_folder()) in dialog.sentence.text(), timeout=PATIENCE_MS)
    assert dialog.install_button.isEnabled()


def test_a_damaged_network_is_not_said_to_be_whole(opened, qtbot):
    def damage(folder, wheel, progress):
        place(folder, wheel, progress)
        (folder / "hand_landmark_full.tflite").write_bytes(b"x")

    dialog = opened(damage)
    click(qtbot, dialog.install_button)
    qtbot.waitUntil(lambda: "hand_landmark_full" in dialog.sentence.text(), timeout=PATIENCE_MS)
    assert "whole" not in dialog.sentence.text()


def test_what_is_refused_is_said(opened, qtbot):
    def refuse(folder, wheel, progress):
        raise KeypointError("pip could not download it. Give the file.")

    dialog = opened(refuse)
    click(qtbot, dialog.install_button)
    qtbot.waitUntil(lambda: "could not download" in dialog.sentence.text(), timeout=PATIENCE_MS)
    assert dialog.install_button.isEnabled() and not dialog.cancel_button.isEnabled()


@pytest.mark.parametrize("how", ["cancel_button", "close_button"])
def test_an_installation_is_cancelled(opened, qtbot, how):
    ended, going = threading.Event(), threading.Event()

    def endless(folder, wheel, progress):
        try:
            while True:
                progress("Downloading", 0.25)
                going.wait(0.01)
        finally:
            ended.set()

    dialog = opened(endless)
    places = [button.geometry() for button in (dialog.install_button, dialog.cancel_button)]
    click(qtbot, dialog.install_button)
    qtbot.waitUntil(lambda: dialog.bar.value() == 25, timeout=PATIENCE_MS)
    assert places == [button.geometry() for button in (dialog.install_button, dialog.cancel_button)]
    click(qtbot, getattr(dialog, how))
    assert ended.wait(PATIENCE_S)
    if how == "cancel_button":
        assert "Cancelled" in dialog.sentence.text() and dialog.install_button.isEnabled()
    else:
        assert not dialog.isVisible()
