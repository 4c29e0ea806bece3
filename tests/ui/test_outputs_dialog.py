"""The outputs' page: added, switched, changed, removed and taken back as a person does it; a real engine sends."""

from __future__ import annotations

import contextlib
import socket
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import cv2
import msgspec
import numpy as np
import pytest
from fake_engine import FakeClient, FakeEngine, synthetic_rig
from patience import PATIENCE_MS, eventually
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QGuiApplication, QImage
from PySide6.QtTest import QTest
from screen_pictures import check
from synthetic_node import SyntheticNode
from synthetic_node import synthetic_rig as streaming_rig

from rhot_app.engine.client import EngineClient
from rhot_app.outputs.spec import OutputStatus
from rhot_app.project import OutputSettings, load_rig, save_rig
from rhot_app.ui.backend.contract import Opened
from rhot_app.ui.common.guide import page_of
from rhot_app.ui.dialogs.output_card import qr_code
from rhot_app.ui.dialogs.outputs_dialog import OutputsDialog
from rhot_app.ui.models.outputs import SendRates, web_hint
from rhot_app.ui.models.palette import DARK

OSC = OutputSettings("osc", "127.0.0.1:9000")
WS = OutputSettings("ws", "127.0.0.1:9001", "openxr", 60.0)
WEB = OutputSettings("web", "0.0.0.0:47810")
WEB_RUN = "web:0.0.0.0:47810?joints=openxr&hz=60"
ADDRESS = "https://192.168.1.20:47810/q8Jw0cXr3mVt5nZb7LkPaYdE/"


class Page:
    """The dialog on an engine, and a person's hands."""

    def __init__(self, qtbot, rig, connect, status, path=""):
        self.dialog = OutputsDialog(Opened(rig, path, True, True, False), connect, status, lambda: DARK)
        self.qtbot = qtbot
        qtbot.addWidget(self.dialog)
        self.dialog.show()
        self.dialog.activateWindow()
        assert QTest.qWaitForWindowActive(self.dialog, PATIENCE_MS)

    def until(self, condition):
        self.qtbot.waitUntil(condition, timeout=PATIENCE_MS)

    def says(self, *words):
        self.until(lambda: all(word in self.dialog.sentence.text() for word in words))

    def press(self, button):
        self.until(lambda: button.isEnabled() and button.isVisible())
        QTest.mouseClick(button, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier,
                         QPoint(12, button.height() // 2))

    def type_target(self, text):
        self.dialog.target_edit.selectAll()
        QTest.keyClicks(self.dialog.target_edit, text)

    def choose(self, kind):
        self.dialog.kind_box.setCurrentIndex(self.dialog.kind_box.findData(kind))

    @property
    def titles(self):
        return [card.title_label.text() for card in self.dialog.cards]


@pytest.fixture
def page(qtbot, themed):
    """A function that opens the page on a rig with these outputs."""
    def open_on(*outputs, path="", **attributes):
        engine = FakeEngine(msgspec.structs.replace(synthetic_rig(), outputs=outputs))
        for name, value in attributes.items():
            setattr(engine, name, value)
        client = FakeClient(engine)  # states are made when they are asked for

        def status():
            client.poll()
            return engine.status(engine.clock())

        found = Page(qtbot, engine.rig, lambda: FakeClient(engine), status, path)
        found.engine = engine
        return found
    return open_on


def test_the_first_one_is_added_by_two_keys_and_removed_and_taken_back(page):
    desk = page(path="/rigs/desk.json")
    assert "No program listens yet" in desk.dialog.empty_label.text() and desk.dialog.empty_label.isVisible()
    assert desk.dialog.target_edit.text() == "127.0.0.1:9000" and not desk.dialog.undo_button.isEnabled()
    desk.dialog.target_edit.setFocus()
    QTest.keyClick(desk.dialog.target_edit, Qt.Key.Key_Return)
    desk.says("Added OSC to 127.0.0.1:9000", "desk.json")
    assert desk.engine.rig.outputs == (OSC,) and not desk.dialog.empty_label.isVisible()
    desk.press(desk.dialog.cards[0].remove_button)
    desk.says("Removed OSC to 127.0.0.1:9000")
    assert desk.engine.rig.outputs == () and desk.dialog.empty_label.isVisible()
    QTest.keyClick(desk.dialog, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    desk.says("Taken back")
    assert desk.engine.rig.outputs == (OSC,) and desk.titles == ["OSC to 127.0.0.1:9000"]


@pytest.mark.parametrize(("kind", "target", "sentence"), [
    ("osc", "127.0.0.1:99999", "no port 99999"), ("osc", "9000", "is not HOST:PORT"),
    ("ws", "here", "is not [HOST:]PORT"), ("web", "127.0.0.1:0", "not [HOST:]PORT"),
    ("zenoh", "router", "is not HOST:PORT"), ("ws", "127.0.0.1:9001", "is in the list already")])
def test_what_cannot_be_is_refused_with_a_sentence(page, kind, target, sentence):
    desk = page(msgspec.structs.replace(WS, joints="own", rate_hz=None))
    desk.choose(kind)
    desk.type_target(target)
    desk.press(desk.dialog.add_button)
    desk.says(sentence)
    assert len(desk.engine.rig.outputs) == 1 and "set_rig" not in [name for name, _ in desk.engine.commands]
    assert desk.dialog.target_edit.text() == target


def test_what_the_engine_refuses_changes_nothing(page):
    desk = page(OSC, refuse_rig="output 'osc': no.")
    desk.press(desk.dialog.cards[0].switch)
    desk.says("Output 'osc': no.")
    assert desk.dialog.cards[0].switch.isChecked() and desk.engine.rig.outputs == (OSC,)
    assert not desk.dialog.undo_button.isEnabled()


def test_one_is_switched_off_and_keeps_focus_and_place(page):
    desk = page(OSC, WS)
    card = desk.dialog.cards[0]
    card.switch.setFocus()
    QTest.keyClick(card.switch, Qt.Key.Key_Space)
    desk.says("OSC to 127.0.0.1:9000", "off")
    assert desk.engine.rig.outputs == (msgspec.structs.replace(OSC, enabled=False), WS)
    assert desk.dialog.cards[0] is card and card.switch.hasFocus() and card.status_label.text() == "off"
    QTest.keyClick(card.switch, Qt.Key.Key_Space)
    desk.says("is on.")
    assert desk.engine.rig.outputs == (OSC, WS)
    desk.until(lambda: card.status_label.text().startswith("sending "))


def test_one_is_changed_in_the_form(page):
    desk = page(OSC, WS)
    desk.press(desk.dialog.cards[1].change_button)
    assert desk.dialog.target_edit.text() == "127.0.0.1:9001" and desk.dialog.rate_box.value() == 60.0
    assert desk.dialog.joints_box.currentData() == "openxr" and desk.dialog.add_button.text() == "Change"
    QTest.keyClick(desk.dialog, Qt.Key.Key_Escape)
    assert desk.dialog.isVisible() and desk.dialog.add_button.text() == "Add"
    desk.press(desk.dialog.cards[1].change_button)
    desk.type_target("9002")
    desk.dialog.rate_box.setValue(0.0)
    desk.press(desk.dialog.add_button)
    desk.says("Changed", "WebSocket", "9002")
    assert desk.engine.rig.outputs == (OSC, OutputSettings("ws", "9002", "openxr"))
    desk.press(desk.dialog.undo_button)
    desk.says("Taken back")
    assert desk.engine.rig.outputs == (OSC, WS)


def test_delete_on_a_card_removes_it_and_the_focus_goes_to_undo(page):
    desk = page(OSC, WS)
    desk.dialog.cards[0].change_button.setFocus()
    QTest.keyClick(desk.dialog.cards[0].change_button, Qt.Key.Key_Delete)
    desk.until(lambda: desk.engine.rig.outputs == (WS,) and desk.dialog.undo_button.hasFocus())
    QTest.keyClick(desk.dialog.undo_button, Qt.Key.Key_Return)
    desk.until(lambda: desk.engine.rig.outputs == (OSC, WS) and len(desk.dialog.cards) == 2)


def test_how_each_goes_is_said(page):
    desk = page(OSC, WS, running=False)
    words = [card.status_label for card in desk.dialog.cards]
    desk.until(lambda: [label.text() for label in words] == ["waits for Start"] * 2)
    base = OutputStatus(WS.spec, "ws", "running", sent=7)
    for status, text, message in (
            (replace(base, clients=0, url="ws://127.0.0.1:9001/"), "waits for a client", ""),
            (replace(base, state="failed", message="port 9001 is in use."), "failed", "port 9001 is in use."),
            (replace(base, message="it has not taken a state for 3 s."), "slow", "it has not taken a state for 3 s."),
            (replace(base, state="starting"), "opens", "")):
        desk.engine.outputs = {WS.spec: status}
        desk.until(lambda text=text: words[1].text() == text)
        assert desk.dialog.cards[1].message_label.text() == message
        assert desk.dialog.cards[1].url_edit.isVisible() == bool(status.url)
    fixed = replace(base, spec="lsl:LAB", kind="lsl", fixed=True)
    desk.engine.outputs = {WS.spec: fixed}  # in place of the other: one of the command line
    desk.until(lambda: desk.titles[-1].endswith("as LAB"))
    assert not desk.dialog.cards[-1].remove_button.isEnabled()


def test_rates_are_counted_over_seconds_and_end_with_the_stream():
    rates, engine = SendRates(), FakeEngine(msgspec.structs.replace(synthetic_rig(), outputs=(OSC,)))
    for tenth in range(60):
        engine.sequence = 24 * (tenth // 2)  # 120 states/s, told in steps of 0.2 s
        rates.take(engine.status(0.1 * tenth))
    assert rates.of(OSC.spec) == pytest.approx(120.0, rel=0.01) and rates.of("other") == 0.0
    rates.take(engine.status(7.5))
    assert rates.of(OSC.spec) == 0.0
    engine.sequence = 3  # started again
    rates.take(engine.status(7.6))
    assert rates.of(OSC.spec) == 0.0


def test_the_web_views_address_is_copied_and_coded(page):
    desk = page(WEB, outputs={WEB_RUN: OutputStatus(WEB_RUN, "web", "running", clients=0, url=ADDRESS)})
    card = desk.dialog.cards[0]
    desk.until(lambda: card.status_label.text() == "waits for a browser")
    assert "the browser warns once" in card.message_label.text()
    desk.press(card.copy_button)
    assert QGuiApplication.clipboard().text() == ADDRESS
    image = qr_code(ADDRESS, 132).toImage().convertToFormat(QImage.Format.Format_Grayscale8)
    pixels = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), image.bytesPerLine())
    assert card.code_label.isVisible()
    assert cv2.QRCodeDetector().detectAndDecode(pixels[:, :image.width()].copy())[0] == ADDRESS
    assert "0.0.0.0:47810" in web_hint("http://127.0.0.1:47810/secret/")


def test_it_opens_from_the_menu_follows_and_is_saved(bench, tmp_path):
    path = tmp_path / "desk.json"
    save_rig(path, synthetic_rig())
    bench.window.open_rig(path)
    bench.until(lambda: bench.controller.rig is not None)
    bench.window.actions_.outputs.trigger()
    dialog = bench.window.dialogs.outputs
    assert page_of(dialog.target_edit) == "outputs"
    bench.click(dialog.add_button)
    bench.until(lambda: bench.window.actions_.save_rig.isEnabled() and dialog.undo_button.isEnabled())
    assert load_rig(path).outputs == ()
    QTest.keyClick(dialog, Qt.Key.Key_S, Qt.KeyboardModifier.ControlModifier)
    bench.until(lambda: load_rig(path).outputs == (OSC,))
    bench.backend.engine.rig = msgspec.structs.replace(synthetic_rig(), outputs=(WS,))
    bench.window.rig_watch.look_soon()
    bench.until(lambda: dialog.cards[0].settings == WS)
    assert not dialog.undo_button.isEnabled()
    bench.window.actions_.close_rig.trigger()
    bench.until(lambda: bench.window.dialogs.outputs is None)


def test_a_real_engine_sends_what_is_added_while_it_tracks(qtbot, themed, tmp_path: Path) -> None:
    rig = streaming_rig()
    save_rig(tmp_path / "rig.json", rig)
    nodes = [SyntheticNode(rig, camera) for camera in (0, 1)]
    for node in nodes:
        node.start()
    with contextlib.ExitStack() as stack:
        for node in nodes:
            stack.callback(node.close)
        sock = stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
        sock.bind(("127.0.0.1", 0))
        sock.setblocking(False)
        process = subprocess.Popen(
            [sys.executable, "-m", "rhot_app", "engine", "--rig", "rig.json", "--directory", "engine", "--start",
             "--unchecked", "--json"], cwd=tmp_path, stdout=subprocess.PIPE)
        stack.callback(process.wait, 60)
        stack.callback(process.terminate)
        assert process.stdout is not None and process.stdout.readline()
        client = stack.enter_context(EngineClient(tmp_path / "engine"))
        eventually(lambda: client.poll(0.1) and client.status is not None and client.status.state_rate_hz > 0)

        def status():
            client.poll()
            return client.status

        desk = Page(qtbot, rig, lambda: EngineClient(tmp_path / "engine", states=False, events=False), status)
        stack.callback(desk.dialog.close)
        session = client.status.session
        desk.type_target(f"127.0.0.1:{sock.getsockname()[1]}")
        desk.press(desk.dialog.add_button)
        desk.until(lambda: arrives(sock))
        desk.until(lambda: desk.dialog.cards[0].status_label.text().startswith("sending "))
        desk.press(desk.dialog.cards[0].remove_button)
        desk.says("Removed OSC")
        desk.until(lambda: not arrives(sock, all_of_it=True) and not desk.qtbot.wait(300) and not arrives(sock))
        assert status().session == session and status().state_rate_hz > 0


def arrives(sock: socket.socket, *, all_of_it: bool = False) -> bool:
    """Whether a datagram lies there; `all_of_it` takes every one away and says False."""
    with contextlib.suppress(BlockingIOError):
        while sock.recv(2048):
            if not all_of_it:
                return True
    return False


def test_picture_of_the_page(page):
    off = OutputSettings("vmc", "127.0.0.1:39539", enabled=False)
    desk = page(OSC, WS, off, WEB, path="/rigs/desk.json", outputs={
        WS.spec: OutputStatus(WS.spec, "ws", "failed", "port 9001 is in use by another program; choose another one."),
        WEB_RUN: OutputStatus(WEB_RUN, "web", "running", clients=0, url=ADDRESS)})
    desk.until(lambda: desk.dialog.cards[0].status_label.text().startswith("sending"))
    desk.dialog.resize(720, 740)
    check("outputs", desk.dialog.grab().toImage(), 12)
