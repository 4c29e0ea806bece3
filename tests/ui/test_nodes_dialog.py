"""Connecting nodes by address: honest words for silence, pairing by code, a rig file when both are paired."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
import zmq
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication

from rhot_app.errors import PairingError, SourceError
from rhot_app.keys import load_master_keys
from rhot_app.project import load_rig
from rhot_app.sources.pairing import Introduction, NodeAddress
from rhot_app.ui.backend.ping import NodeAnswer, ask_nodes, first_rig
from rhot_app.ui.models.palette import DARK
from rhot_app.ui.nodes_dialog import NodesDialog
from rhot_app.ui.pair_dialog import PairDialog
from rhot_node.config import NodeSettings
from rhot_node.control import ControlServer
from rhot_node.files import resource_path
from rhot_node.markers import load_markers
from rhot_node.pairing import show_code
from rhot_node.pairing_offer import OfferFile
from rhot_node.reception import Reception
from rhot_node.requests import Responder
from rhot_node.trust import NodeTrust


class Node:
    """The reception of a real node."""

    def __init__(self, folder: Path, node_id: int, name: str) -> None:
        settings = NodeSettings(node_id, name, load_markers(resource_path("markers", "rhot6.json")), "127.0.0.1", 0, 0, 0,
                                None, pairing_port=0)
        self.offers = OfferFile(folder / f"{name}.pairing.json")
        self.trust = NodeTrust(folder / f"{name}.keys.json")
        self.server = ControlServer(settings, self.trust)
        self.about = {"node_id": node_id, "name": name, "state": "ready", "udp_port": 40000 + node_id,
                      "control_port": self.server.control_port, "preview_port": self.server.preview_port,
                      "pairing_port": self.server.pairing_port}
        self.server.start(Responder.__new__(Responder), Reception(self.trust, self.offers, lambda: self.about))


@pytest.fixture
def nodes(tmp_path: Path) -> Iterator[list[Node]]:
    nodes = [Node(tmp_path, 7, "left"), Node(tmp_path, 8, "right")]
    yield nodes
    for node in nodes:
        node.server.close()


def fill(dialog: NodesDialog, nodes: list[Node], qtbot) -> None:
    for k, node in enumerate(nodes):
        qtbot.keyClicks(dialog.hosts[k], "127.0.0.1")
        shown = dialog.ports[k].lineEdit()
        assert shown.text() == "47803" and shown.width() > shown.fontMetrics().horizontalAdvance("47803")
        dialog.ports[k].setValue(node.server.pairing_port)


def type_code(code: str, qtbot) -> PairDialog:
    """Types into the pairing dialog that is open and presses its button."""
    dialog = QApplication.activeModalWidget()
    assert isinstance(dialog, PairDialog)
    dialog.code.clear()
    assert not dialog.pair_button.isEnabled()
    qtbot.keyClicks(dialog.code, code)
    qtbot.mouseClick(dialog.pair_button, Qt.MouseButton.LeftButton)
    return dialog


def test_both_nodes_are_asked_paired_and_written_into_a_rig(nodes, qtbot, themed, tmp_path, monkeypatch):
    dialog = NodesDialog(DARK)
    qtbot.addWidget(dialog)
    dialog.show()
    assert not dialog.ask_button.isEnabled(), "there is nobody to ask yet"
    fill(dialog, nodes, qtbot)
    qtbot.mouseClick(dialog.ask_button, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(dialog.pair_buttons[0].isEnabled, timeout=5000)
    assert "left (id 7) answers; it is ready. Not paired" in dialog.replies[0].text()
    assert not dialog.save_button.isEnabled()

    tried: list[str] = []

    def enter(pairing: PairDialog) -> int:
        """In place of `exec`: a wrong code first, then the right one."""
        node = nodes[len(tried) // 2]
        pairing.open()
        right = show_code(node.offers.renew().code)
        for code in ("0" * 15, right):
            tried.append(code)
            type_code(code, qtbot)
            qtbot.waitUntil(lambda: not pairing.isVisible() or "wrong" in pairing.verdict.text(), timeout=5000)
        return int(not pairing.isVisible())

    monkeypatch.setattr(PairDialog, "exec", enter)
    for k in range(2):
        qtbot.waitUntil(dialog.pair_buttons[k].isEnabled, timeout=5000)
        qtbot.mouseClick(dialog.pair_buttons[k], Qt.MouseButton.LeftButton)
    qtbot.waitUntil(dialog.save_button.isEnabled, timeout=5000)
    assert "Paired with this computer" in dialog.replies[1].text()
    assert len(tried) == 4 and all(node.trust.admits(load_master_keys().own.public_key) for node in nodes)
    dialog.write(tmp_path / "rig.json")
    rig = load_rig(tmp_path / "rig.json")
    assert [(node.node_id, node.address, node.control_port, node.udp_port, node.public_key) for node in rig.nodes] == [
        (node.about["node_id"], "127.0.0.1", node.server.control_port, 40000 + node.about["node_id"],
         node.trust.own.public_key) for node in nodes]
    assert dialog.rig_path == tmp_path / "rig.json"


def test_a_node_without_a_code_says_how_to_get_one(nodes, qtbot, themed):
    def refuse(address: NodeAddress, code: str) -> str:
        raise PairingError(f"node left offers no code now; run `rhot-node pair` on it ({code}).")

    dialog = PairDialog("left", NodeAddress("127.0.0.1", nodes[0].server.pairing_port), refuse)
    qtbot.addWidget(dialog)
    dialog.show()
    qtbot.keyClicks(dialog.code, "0123456789ABCDE")
    dialog.pair()
    qtbot.waitUntil(lambda: "rhot-node pair" in dialog.verdict.text(), timeout=5000)
    assert dialog.pair_button.isEnabled() and dialog.isVisible()


def test_silence_and_nonsense_are_sentences():
    with_nobody = zmq.Context()
    socket = with_nobody.socket(zmq.REP)
    port = socket.bind_to_random_port("tcp://127.0.0.1")
    socket.close(0)
    with_nobody.destroy(0)
    answers = ask_nodes([NodeAddress("127.0.0.1", port), NodeAddress("no such address", 1)], timeout_s=0.3)
    assert "Is rhot-node running there" in answers[0].error
    assert not answers[1].found


def test_nodes_that_cannot_make_a_rig_are_refused():
    who = Introduction(3, "left", "ready", "open", 1, 2, 3, 4)
    answer = NodeAnswer(NodeAddress("10.0.0.1", 1), who)
    assert "anybody on the network" in answer.text
    with pytest.raises(SourceError, match="have the id 3"):
        first_rig([answer, answer])
    with pytest.raises(SourceError, match="two nodes"):
        first_rig([answer, NodeAnswer(NodeAddress("10.0.0.2", 1), Introduction(4, "b", "ready", "paired", 1, 2, 3, 4))])
