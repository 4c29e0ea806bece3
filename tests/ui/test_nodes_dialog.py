"""Finding nodes by address: honest words for silence, a rig file when both answer."""

from __future__ import annotations

import threading

import pytest
import zmq
from PySide6.QtCore import Qt

from rhot_app.errors import SourceError
from rhot_app.project import load_rig
from rhot_app.ui.backend.ping import NodeAddress, NodeAnswer, ask_nodes, first_rig
from rhot_app.ui.models.palette import DARK
from rhot_app.ui.nodes_dialog import NodesDialog


@pytest.fixture
def nodes():
    """Two sockets that answer one question each as nodes do."""
    context = zmq.Context()
    ports, threads = [], []

    def serve(socket, number):
        if socket.poll(5000):
            assert socket.recv() == b'{"request": "state"}'
            name = ("left", "right")[number]
            socket.send(f'{{"ok": true, "node_id": {number + 7}, "name": "{name}", "state": "ready"}}'.encode())
        socket.close(500)

    for number in range(2):
        socket = context.socket(zmq.REP)
        ports.append(socket.bind_to_random_port("tcp://127.0.0.1"))
        threads.append(threading.Thread(target=serve, args=(socket, number), daemon=True))
        threads[-1].start()
    yield ports
    for thread in threads:
        thread.join(6.0)
    context.destroy(0)


def test_both_nodes_answer_and_a_rig_is_written(nodes, qtbot, themed, tmp_path):
    dialog = NodesDialog(DARK)
    qtbot.addWidget(dialog)
    dialog.show()
    assert not dialog.ask_button.isEnabled(), "there is nobody to ask yet"
    for k, port in enumerate(nodes):
        qtbot.keyClicks(dialog.hosts[k], "127.0.0.1")
        shown = dialog.ports[k].lineEdit()
        assert shown.text() == "47801" and shown.width() > shown.fontMetrics().horizontalAdvance("47801")
        dialog.ports[k].setValue(port)
    assert not dialog.save_button.isEnabled()
    qtbot.mouseClick(dialog.ask_button, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(dialog.save_button.isEnabled, timeout=5000)
    assert "left (id 7) answers; it is ready." in dialog.replies[0].text()
    dialog.write(tmp_path / "rig.json")
    rig = load_rig(tmp_path / "rig.json")
    assert [(node.node_id, node.address, node.control_port) for node in rig.nodes] == \
        [(7, "127.0.0.1", nodes[0]), (8, "127.0.0.1", nodes[1])]
    assert dialog.rig_path == tmp_path / "rig.json"


def test_silence_says_what_to_do(qtbot, themed):
    with_nobody = zmq.Context()
    socket = with_nobody.socket(zmq.REP)
    port = socket.bind_to_random_port("tcp://127.0.0.1")
    socket.close(0)
    with_nobody.destroy(0)
    answers = ask_nodes([NodeAddress("127.0.0.1", port), NodeAddress("no such address", 1)], timeout_s=0.3)
    assert "Is rhot-node running there" in answers[0].error
    assert not answers[1].found


def test_two_nodes_with_one_id_are_refused():
    answer = NodeAnswer(NodeAddress("10.0.0.1", 1), 3, "left", "ready")
    with pytest.raises(SourceError, match="have the id 3"):
        first_rig([answer, answer])
    with pytest.raises(SourceError, match="two nodes"):
        first_rig([answer])
