"""Connecting nodes, found or by address: honest words for silence, pairing by code, a rig file when both are paired."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
import zmq
from patience import PATIENCE_MS, PATIENCE_S
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication

from rhot_app.errors import PairingError, SourceError
from rhot_app.keys import load_master_keys
from rhot_app.project import load_rig
from rhot_app.sources.discovery import Search, Sighting, conflicts, together
from rhot_app.sources.pairing import Introduction, NodeAddress
from rhot_app.ui.backend.ping import NodeAnswer, ask_nodes, first_rig
from rhot_app.ui.common.job import CancelledError
from rhot_app.ui.dialogs.nodes_dialog import NodesDialog, PairDialog
from rhot_app.ui.models.palette import DARK
from rhot_node.config import NodeSettings
from rhot_node.files import resource_path
from rhot_node.keys import NodeTrust
from rhot_node.markers import load_markers
from rhot_node.network.control import ControlServer
from rhot_node.network.pairing import OfferFile, Reception, show_code
from rhot_node.network.presence import Presence
from rhot_node.network.requests import Responder
from rhot_node.wire.messages import NodeState, TrustState


class Node:
    """The reception of a real node."""

    def __init__(self, folder: Path, node_id: int, name: str) -> None:
        settings = NodeSettings(node_id, name, load_markers(resource_path("markers", "rhot6.json")), "127.0.0.1", 0, 0,
                                0, None, pairing_port=0)
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
    dialog = NodesDialog(DARK, find=lambda progress: Search((), (), ()))
    qtbot.addWidget(dialog)
    dialog.show()
    assert not dialog.ask_button.isEnabled(), "there is nobody to ask yet"
    fill(dialog, nodes, qtbot)
    qtbot.mouseClick(dialog.ask_button, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(dialog.pair_buttons[0].isEnabled, timeout=PATIENCE_MS)
    assert all(words in dialog.replies[0].text() for words in ("left (id 7)", "ready", "Not paired"))
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
            qtbot.waitUntil(lambda: not pairing.isVisible() or "wrong" in pairing.verdict.text(), timeout=PATIENCE_MS)
        return int(not pairing.isVisible())

    monkeypatch.setattr(PairDialog, "exec", enter)
    for k in range(2):
        qtbot.waitUntil(dialog.pair_buttons[k].isEnabled, timeout=PATIENCE_MS)
        qtbot.mouseClick(dialog.pair_buttons[k], Qt.MouseButton.LeftButton)
    qtbot.waitUntil(dialog.save_button.isEnabled, timeout=PATIENCE_MS)
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
    qtbot.waitUntil(lambda: "rhot-node pair" in dialog.verdict.text(), timeout=PATIENCE_MS)
    assert dialog.pair_button.isEnabled() and dialog.isVisible()


def test_silence_and_nonsense_are_sentences():
    with_nobody = zmq.Context()
    socket = with_nobody.socket(zmq.REP)
    port = socket.bind_to_random_port("tcp://127.0.0.1")
    socket.close(0)
    with_nobody.destroy(0)
    answers = ask_nodes([NodeAddress("127.0.0.1", port), NodeAddress("no such address", 1)], timeout_s=0.3)
    assert "rhot-node" in answers[0].error
    assert not answers[1].found


def test_nodes_that_cannot_make_a_rig_are_refused():
    who = Introduction(3, "left", "ready", "open", 1, 2, 3, 4)
    answer = NodeAnswer(NodeAddress("10.0.0.1", 1), who)
    assert "anybody on the network" in answer.text
    with pytest.raises(SourceError, match="have the id 3"):
        first_rig([answer, answer])
    with pytest.raises(SourceError, match="two nodes"):
        first_rig([answer, NodeAnswer(NodeAddress("10.0.0.2", 1), Introduction(4, "b", "ready", "paired", 1, 2, 3, 4))])


def found(*who: tuple[str, int]) -> Search:
    """Unpaired nodes of these names, whose ids and addresses end in these numbers."""
    nodes = together(Sighting(Presence(last, last, name, 47800, 47801, 47802, 40000 + last, TrustState.UNPAIRED),
                              f"10.0.0.{last}", NodeState.READY) for name, last in who)
    return Search(nodes, conflicts(nodes), ())


class Network:
    """What the dialog finds, and who answers it; nothing is waited for."""

    def __init__(self, *who: tuple[str, int]) -> None:
        self.who = who
        self.searches = 0
        self.asked: list[list[str]] = []

    def find(self, progress) -> Search:
        self.searches += 1
        progress("looking for nodes", 0.5)
        return found(*self.who)

    def ask(self, addresses: list[NodeAddress]) -> list[NodeAnswer]:
        self.asked.append([str(address) for address in addresses])
        who = [Introduction(address.pairing_port - 40000, "x", "ready", "paired", 1, 2, 3, 4) for address in addresses]
        return [NodeAnswer(address, one, True) for address, one in zip(addresses, who, strict=True)]


def open_dialog(network: Network, qtbot) -> NodesDialog:
    dialog = NodesDialog(DARK, find=network.find, ask=network.ask)
    qtbot.addWidget(dialog)
    dialog.show()
    return dialog


def row_of(dialog: NodesDialog, row: int) -> list[str]:
    table = dialog.found.table
    return [table.text(row, column) for column in range(len(table.heads()))]


def test_nodes_called_left_and_right_are_found_and_asked_by_themselves(qtbot, themed):
    network = Network(("left", 11), ("right", 12), ("spare", 13))
    dialog = open_dialog(network, qtbot)
    qtbot.waitUntil(dialog.save_button.isEnabled, timeout=PATIENCE_MS)
    assert row_of(dialog, 0) == ["left", "11", "10.0.0.11", "not paired yet", "ready"]
    assert network.asked == [["10.0.0.11:40011", "10.0.0.12:40012"]]
    assert all(words in dialog.replies[1].text() for words in ("ready", "Paired"))


def test_what_was_typed_stays_and_a_node_is_chosen_from_the_list(qtbot, themed):
    network = Network(("left", 11), ("spare", 13))
    dialog = open_dialog(network, qtbot)
    dialog.hosts[0].setText("my-pi.local")
    qtbot.waitUntil(lambda: len(dialog.found.table.records) == 2, timeout=PATIENCE_MS)
    assert dialog.hosts[0].text() == "my-pi.local" and dialog.hosts[1].text() == "" and network.asked == []
    assert not dialog.found.side_buttons[1].isEnabled()
    dialog.found.table.selectRow(1)
    qtbot.mouseClick(dialog.found.side_buttons[1], Qt.MouseButton.LeftButton)
    qtbot.waitUntil(dialog.save_button.isEnabled, timeout=PATIENCE_MS)
    assert network.asked == [["my-pi.local:47803", "10.0.0.13:40013"]]
    qtbot.mouseClick(dialog.found.again, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: network.searches == 2 and dialog.found.again.isEnabled(), timeout=PATIENCE_MS)
    assert dialog.hosts[0].text() == "my-pi.local" and dialog.save_button.isEnabled()


def test_an_answer_to_what_is_not_entered_any_more_does_not_count(qtbot, themed):
    begun, go_on = threading.Event(), threading.Event()

    class Slow(Network):
        def ask(self, addresses: list[NodeAddress]) -> list[NodeAnswer]:
            begun.set()
            go_on.wait(PATIENCE_S)
            return super().ask(addresses)

    network = Slow(("left", 11), ("right", 12), ("spare", 13))
    dialog = open_dialog(network, qtbot)
    qtbot.waitUntil(begun.is_set, timeout=PATIENCE_MS)
    dialog.choose(1, dialog.found.table.records[2])
    go_on.set()
    qtbot.waitUntil(dialog.save_button.isEnabled, timeout=PATIENCE_MS)
    assert network.asked == [["10.0.0.11:40011", "10.0.0.12:40012"], ["10.0.0.11:40011", "10.0.0.13:40013"]]
    assert all("ready" in reply.text() for reply in dialog.replies), "only the last answer is shown"


def test_conflicts_and_an_empty_network_are_told(qtbot, themed):
    network = Network(("left", 11), ("left", 12))
    dialog = open_dialog(network, qtbot)
    qtbot.waitUntil(lambda: len(dialog.found.table.records) == 2, timeout=PATIENCE_MS)
    assert "called left" in dialog.found.message.text()
    assert dialog.hosts[0].text() == "", "nobody can know which is meant"
    network.who = ()
    dialog.found.search()
    qtbot.waitUntil(lambda: "No node was found" in dialog.found.message.text(), timeout=PATIENCE_MS)
    assert len(dialog.found.table.records) == 0


def test_a_search_ends_with_the_dialog(qtbot, themed):
    begun, stopped, go_on = threading.Event(), threading.Event(), threading.Event()

    def find(progress) -> Search:
        begun.set()
        go_on.wait(PATIENCE_S)
        try:
            progress("looking for nodes", 0.5)
        except CancelledError:
            stopped.set()
            raise
        return found()
    dialog = NodesDialog(DARK, find=find)
    qtbot.addWidget(dialog)
    dialog.show()
    assert begun.wait(PATIENCE_S)
    dialog.reject()
    go_on.set()
    assert stopped.wait(PATIENCE_S)
