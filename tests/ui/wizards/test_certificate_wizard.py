"""The certificate's wizard by clicks: every step recorded of the simulated rig, the lines shown, the folder written."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from fake_engine import FakeEngine
from PySide6.QtCore import Qt
from simulated_protocol import recorded
from wizard_hand import HeldMarker, RecordingAsker
from wizard_hands import Hands
from wizard_rig import FakeMemory

from rhot_app.certificate.certify import certify
from rhot_app.certificate.document import read_certificate
from rhot_app.certificate.recordings import read_protocol
from rhot_app.certificate.simulated import record_flash
from rhot_app.project import save_rig
from rhot_app.simulator.film.node_log import T0_MASTER_NS
from rhot_app.simulator.scene.scene import make_scene, twin_defaults
from rhot_app.ui.models.palette import DARK
from rhot_app.ui.wizards import certificate as certificate_wizard
from rhot_app.ui.wizards.framework.plan import Kit
from rhot_app.ui.wizards.framework.window import WizardWindow

FLASH_S, SCREEN_S = 6.0, 0.015


class Bench:
    """The wizard in front of an engine whose recordings are those of the simulated rig."""

    def __init__(self, tmp_path):
        self.made = recorded(tmp_path / "made", 5)
        self.asker = RecordingAsker(self.made.rig, write=self.write)
        rig_path = tmp_path / "desk.json"
        save_rig(rig_path, self.made.rig)
        kit = Kit(self.made.rig, rig_path, self.asker.connect, DARK, FakeMemory(), {},
                  HeldMarker(FakeEngine()).connect)
        self.hands = Hands(WizardWindow(certificate_wizard.make_plan(kit), kit))
        self.flash = next(page for page in self.hands.window.plan.pages
                          if isinstance(page, certificate_wizard.FlashPage))
        began_ns = self.flash.clock()
        self.flash.clock = lambda clock=self.flash.clock: T0_MASTER_NS + clock() - began_ns

    def write(self, log):
        """What the cameras of the simulated rig send in this step; of the patch, as it really flashed."""
        name, protocol = Path(log).name, self.made.protocol
        if name.startswith("flash"):
            edges = self.flash._said.edges
            record_flash(make_scene(twin_defaults(), 5), Path(log), edges, SCREEN_S, sketched=True)
            return
        source = (protocol.static if name.startswith("still") else protocol.rod if name.startswith("rod") else
                  protocol.plumb if name.startswith("plumb") else
                  min(protocol.ruler, key=lambda row: abs(row.distance_mm - self.hands.window.page.distance.value())))
        shutil.copyfile(self.made.folder / source.log, log)


@pytest.fixture
def bench(themed, tmp_path, monkeypatch):
    monkeypatch.setattr(certificate_wizard, "user_documents_path", lambda: tmp_path / "documents")
    bench = Bench(tmp_path)
    yield bench
    bench.hands.window.end().wait(5.0)
    bench.hands.window.deleteLater()


def record(hands, seconds=0.3):
    step = hands.window.step
    step.seconds = seconds
    hands.click(hands.window.page.button)
    hands.until(lambda: step.phase == "recording")
    hands.until(lambda: step.phase == "recorded", timeout_s=60.0)


def test_from_a_still_hand_to_a_certificate(bench):
    hands = bench.hands
    record(hands)
    hands.next()
    page = hands.window.page
    for row in bench.made.protocol.ruler[::2]:
        page.distance.setValue(row.distance_mm)
        record(hands)
    assert [row.distance_mm for row in page.distances.rows] == [
        row.distance_mm for row in bench.made.protocol.ruler[::2]]
    hands.keep("certificate-ruler")
    hands.next()
    page = hands.window.page
    page.length.setValue(bench.made.protocol.rod.length_mm)
    record(hands)
    hands.next()
    assert hands.window.page is bench.flash and bench.flash.centre.isVisible()
    record(hands, FLASH_S)
    assert len(bench.flash._said.edges) > 10
    hands.keep("certificate-flash", 8)
    hands.next()
    record(hands)
    hands.next()
    step = hands.window.step
    hands.until(lambda: step.report is not None or step.view().hint, timeout_s=120.0)
    assert step.report is not None, step.view().hint
    said = {line.code: line for line in step.report[1].lines}
    assert all(line.verdict == "agrees" for code, line in said.items() if code != "timing"), said
    assert said["latency"].figure("screen to the picture's timestamp").interval.widened(1.0).holds(1e3 * SCREEN_S)
    hands.keep("certificate-result")
    hands.next()
    hands.until(lambda: hands.window.frame.next_button.text() == "Write the certificate")
    hands.keep("certificate-keep", 8)
    hands.next()
    hands.until(lambda: hands.window.step.state == "used")
    folder = hands.window.step.proposal.changes[0].folder
    assert read_certificate(folder).lines == step.report[1].lines
    again = certify(folder / "recordings", read_protocol(folder / "recordings"), bench.made.rig)
    assert [line.verdict for line in again.lines if line.code != "timing"] == ["agrees"] * 6
    hands.click(hands.window.page.restore_button)
    hands.until(lambda: hands.window.step.state == "restored")
    assert not folder.exists()


def test_steps_that_are_left_out_are_not_measured(bench):
    hands = bench.hands
    for _ in range(4):
        hands.next()
    record(hands)  # the plumb line alone
    hands.next()
    step = hands.window.step
    hands.until(lambda: step.report is not None or step.view().hint, timeout_s=120.0)
    verdicts = {line.code: line.verdict for line in step.report[1].lines}
    assert verdicts.pop("upright") == "agrees"
    verdicts.pop("timing")  # of this computer
    assert set(verdicts.values()) == {"not measured"}


def test_a_row_is_taken_back_and_closing_ends_the_recording(bench):
    hands = bench.hands
    hands.next()
    record(hands)
    assert len(hands.window.step.rows) == 1
    hands.window.frame.middle.setFocus()
    hands.key(Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert not hands.window.step.rows
    hands.click(hands.window.page.button)
    hands.until(lambda: hands.window.step.phase == "recording")
    hands.window.end().wait(5.0)
    assert bench.asker.commands[-1] == "record_stop"
