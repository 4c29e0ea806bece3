"""The certificate's wizard by clicks: every step recorded of the simulated rig, the lines shown, the folder written."""

from __future__ import annotations

import itertools
import shutil
from pathlib import Path

import pytest
from fake_engine import FakeEngine
from simulated_protocol import recorded
from wizard_hand import HeldMarker, RecordingClient

from rhot_app.calibration.kinds import certificate as kinds_certificate
from rhot_app.certificate.certify import certify
from rhot_app.certificate.document import read_certificate
from rhot_app.certificate.recordings import ProtocolFile, read_protocol
from rhot_app.certificate.simulated import record_flash
from rhot_app.simulator.film.node_log import T0_MASTER_NS
from rhot_app.simulator.scene.scene import make_scene, twin_defaults
from rhot_app.ui.wizards import certificate as certificate_wizard

FLASH_S, EDGES, SCREEN_S = 6.0, 16, 0.015
STEP_NS = 40_000_000


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """What the cameras of the simulated rig send in every step."""
    return recorded(tmp_path_factory.mktemp("protocol") / "made", 5)


@pytest.fixture
def hands(open_wizard, made, tmp_path, monkeypatch):
    """The wizard before an engine whose recordings are those; of the patch, as it really flashed by a quick clock."""
    monkeypatch.setattr(kinds_certificate, "user_documents_path", lambda: tmp_path / "documents")
    protocol = made.protocol

    def write(log):
        name = Path(log).name
        if name.startswith("flash"):
            record_flash(make_scene(twin_defaults(), 5), Path(log), flash.edges, SCREEN_S, sketched=True)
            return
        source = (protocol.static if name.startswith("still") else protocol.rod if name.startswith("rod") else
                  protocol.plumb if name.startswith("plumb") else
                  min(protocol.ruler, key=lambda row: abs(row.distance_mm - hands.window.page.distance.value())))
        shutil.copyfile(made.folder / source.log, log)

    hands = open_wizard("certificate", RecordingClient(made.rig, write=write),
                        listen=HeldMarker(FakeEngine()).connect)
    flash = next(page for page in hands.window.definition.pages if isinstance(page, certificate_wizard.FlashPage))
    flash.clock = itertools.count(T0_MASTER_NS, STEP_NS).__next__
    return hands


def record(hands, seconds=0.01):
    step = hands.window.step
    step.seconds = seconds
    hands.click(hands.window.page.button)
    hands.until(lambda: step.phase == "recorded")


def test_from_a_still_hand_to_a_certificate(hands, made):
    record(hands)
    hands.next()
    page = hands.window.page
    for row in made.protocol.ruler[::2]:
        page.distance.setValue(row.distance_mm)
        record(hands)
    assert [row.distance_mm for row in page.distances.rows] == [row.distance_mm for row in made.protocol.ruler[::2]]
    hands.keep("certificate-ruler")
    hands.next()
    hands.window.page.length.setValue(made.protocol.rod.length_mm)
    record(hands)
    hands.next()
    page = hands.window.page
    assert page.centre.isVisible()
    page.movement.seconds = FLASH_S
    hands.click(page.button)
    hands.until(lambda: len(page.edges) >= EDGES)
    hands.keep("certificate-flash", 8)
    hands.click(page.button)
    hands.until(lambda: page.movement.phase == "recorded")
    hands.next()
    record(hands)
    hands.next()
    certificate = hands.solved()[1]
    said = {line.code: line for line in certificate.lines}
    assert all(line.verdict == "agrees" for code, line in said.items() if code != "timing"), said
    assert said["latency"].figure("screen to the picture's timestamp").interval.widened(1.0).holds(1e3 * SCREEN_S)
    hands.keep("certificate-result")
    hands.next()
    hands.until(lambda: hands.frame.next_button.text() == "Write the certificate")
    hands.keep("certificate-keep", 8)
    hands.use()
    folder = hands.window.step.proposal.changes[0].folder
    assert read_certificate(folder).lines == certificate.lines
    kept = read_protocol(folder / "recordings")
    assert all((folder / "recordings" / step.log).exists() for step in (kept.static, *kept.ruler, kept.rod, kept.flash))
    again = certify(folder / "recordings", ProtocolFile(plumb=kept.plumb), made.rig)
    assert [line.verdict for line in again.lines if line.code == "upright"] == ["agrees"]
    hands.restore()
    assert not folder.exists()


def test_steps_that_are_left_out_are_not_measured(hands):
    for _ in range(4):
        hands.next()
    record(hands)  # the plumb line alone
    hands.next()
    verdicts = {line.code: line.verdict for line in hands.solved()[1].lines}
    assert verdicts.pop("upright") == "agrees"
    verdicts.pop("timing")  # of this computer
    assert set(verdicts.values()) == {"not measured"}


def test_a_row_is_taken_back_and_closing_ends_the_recording(hands):
    hands.next()
    record(hands)
    step = hands.window.step
    assert len(step.rows) == 1
    hands.undo()
    assert not step.rows
    step.seconds = 60.0
    hands.click(hands.window.page.button)
    hands.until(lambda: step.phase == "recording")
    hands.window.end().wait(5.0)
    assert hands.client.commands[-1] == "record_stop"
