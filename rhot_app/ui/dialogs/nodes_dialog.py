"""Connect two nodes: find them or enter their addresses, pair with them, and write a first rig file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtGui import QShowEvent
from PySide6.QtWidgets import (
    QDialog,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QPushButton,
    QSpinBox,
    QVBoxLayout,
    QWidget,
)

from rhot_app.errors import RhotError
from rhot_app.project import save_rig
from rhot_app.sources.discovery import FoundNode
from rhot_app.sources.pairing import NodeAddress
from rhot_app.ui.backend.ping import NodeAnswer, ask_nodes, first_rig, look_for_nodes, pair_node
from rhot_app.ui.common.job import Job
from rhot_app.ui.common.parts import ask_where_to_save
from rhot_app.ui.common.sentence import Sentence
from rhot_app.ui.common.shapes import ShapeMark
from rhot_app.ui.dialogs.found_nodes import Find, FoundNodes
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.models.palette import Scheme
from rhot_node.network.pairing import CODE_LENGTH
from rhot_node.wire.messages import PAIRING_PORT

SIDES = ("left", "right")

Ask = Callable[[list[NodeAddress]], list[NodeAnswer]]
"""Asks every address who is there; called in a worker."""


class NodesDialog(QDialog):
    """`rig_path` is the file written when the dialog was accepted."""

    def __init__(self, scheme: Scheme, parent: QWidget | None = None, find: Find = look_for_nodes,
                 ask: Ask = ask_nodes) -> None:
        super().__init__(parent)
        self.setWindowTitle(tr("Connect nodes"))
        self.setProperty("guide", "nodes")
        self._scheme = scheme
        self._answers: list[NodeAnswer] = []
        self._ask = ask
        self._job: Job | None = None
        self._ask_again = False
        self.rig_path: Path | None = None
        intro = QLabel(tr("Select a node in the list and say which camera it is. Left and right are as seen from "
                          "behind the cameras. The address of a node that is not found can be typed in: it stands on "
                          "the node's console, and <b>hostname&nbsp;-I</b> prints it there."))
        intro.setWordWrap(True)
        intro.setTextFormat(Qt.TextFormat.RichText)
        self.found = FoundNodes(find, SIDES)
        self.found.chosen.connect(self.choose)
        self.found.searched.connect(self._choose_by_name)
        self.finished.connect(self.found.stop)
        self.hosts: list[QLineEdit] = []
        self.ports: list[QSpinBox] = []
        self._marks: list[ShapeMark] = []
        self.replies: list[Sentence] = []
        self.pair_buttons: list[QPushButton] = []
        grid = QGridLayout()
        grid.setHorizontalSpacing(8)
        grid.setVerticalSpacing(8)
        for column, head in enumerate((tr("camera"), tr("address or host name"), tr("port"), "", tr("answer"), "")):
            label = QLabel(head)
            label.setProperty("muted", True)
            grid.addWidget(label, 0, column)
        for row, side in enumerate(SIDES, start=1):
            self._add_row(grid, row, side)
        grid.setColumnStretch(4, 1)
        default = QLabel(tr("The port is {port} unless the node's settings file says otherwise (pairing_port).",
                            port=PAIRING_PORT))
        default.setWordWrap(True)
        default.setProperty("muted", True)
        self.ask_button = QPushButton(tr("Ask the nodes"))
        self.ask_button.setDefault(True)
        self.ask_button.setEnabled(False)
        self.ask_button.setToolTip(tr("Possible once both addresses are entered. Nothing is changed on the nodes."))
        self.ask_button.clicked.connect(self.ask)
        self.save_button = QPushButton(tr("Write a rig file and open it …"))
        self.save_button.setEnabled(False)
        self.save_button.setToolTip(tr("Possible once both nodes have answered and are paired with this computer."))
        self.save_button.clicked.connect(self._choose_file)
        cancel = QPushButton(tr("Cancel"))
        cancel.clicked.connect(self.reject)
        buttons = QHBoxLayout()
        buttons.addWidget(self.ask_button)
        buttons.addStretch(1)
        buttons.addWidget(cancel)
        buttons.addWidget(self.save_button)
        self.verdict = Sentence(2)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(16, 16, 16, 16)
        layout.setSpacing(16)
        layout.addWidget(intro)
        layout.addWidget(self.found)
        layout.addLayout(grid)
        layout.addWidget(default)
        layout.addWidget(self.verdict)
        layout.addLayout(buttons)
        self.resize(820, 640)

    def showEvent(self, event: QShowEvent) -> None:  # noqa: N802
        """Look for nodes as soon as somebody sees the dialog."""
        super().showEvent(event)
        if not event.spontaneous():
            self.found.search()

    def choose(self, side: int, node: FoundNode) -> None:
        """Take the camera of a side from the list; when both are there they are asked."""
        self.hosts[side].setText(node.address)
        self.ports[side].setValue(node.presence.pairing_port)
        if all(host.text().strip() for host in self.hosts):
            self.ask()

    def _choose_by_name(self) -> None:
        """Nodes that are called as the sides are taken for these, unless something was typed or chosen before."""
        for side, name in enumerate(SIDES):
            named = [node for node in self.found.table.records if node.presence.name == name]
            if len(named) == 1 and not self.hosts[side].text().strip():
                self.choose(side, named[0])

    def _add_row(self, grid: QGridLayout, row: int, side: str) -> None:
        host, port, mark, reply = QLineEdit(), QSpinBox(), ShapeMark(14), Sentence(2, muted=True)
        reply.setText(tr("not asked yet"))
        host.setPlaceholderText(tr("e.g. {address}", address=f"192.168.1.{10 + row}"))
        host.setAccessibleName(tr("Address of the {side} node", side=tr(side)))
        host.setMinimumWidth(180)
        host.textChanged.connect(self._forget_answers)
        port.setRange(1, 65535)
        port.setMinimumHeight(30)
        port.setButtonSymbols(QSpinBox.ButtonSymbols.NoButtons)
        port.setValue(PAIRING_PORT)
        port.setToolTip(tr("Where the node says who it is. The default is right unless its settings file says "
                           "otherwise."))
        port.setAccessibleName(tr("Pairing port of the {side} node", side=tr(side)))
        port.valueChanged.connect(self._forget_answers)
        mark.set_shape("square", self._scheme.neutral)
        pair = QPushButton(tr("Pair …"))
        pair.setEnabled(False)
        pair.setToolTip(tr("Possible once the node has answered and is not paired with this computer."))
        pair.clicked.connect(lambda: self.pair(row - 1))
        self.pair_buttons.append(pair)
        for column, widget in enumerate((QLabel(side), host, port, mark, reply, pair)):
            grid.addWidget(widget, row, column)
        self.hosts.append(host)
        self.ports.append(port)
        self._marks.append(mark)
        self.replies.append(reply)

    def _show_not_asked(self) -> None:
        for mark, reply in zip(self._marks, self.replies, strict=True):
            mark.set_shape("square", self._scheme.neutral)
            reply.setText(tr("not asked yet"))
        self._forget_answers()

    def _forget_answers(self) -> None:
        self._answers = []
        self.save_button.setEnabled(False)
        for button in self.pair_buttons:
            button.setEnabled(False)
        self.ask_button.setEnabled(self._job is None and all(host.text().strip() for host in self.hosts))

    def addresses(self) -> list[NodeAddress]:
        """What was entered."""
        return [NodeAddress(host.text().strip(), port.value())
                for host, port in zip(self.hosts, self.ports, strict=True)]

    def ask(self) -> None:
        """Ask both addresses in a worker."""
        self._ask_again = self._job is not None
        if self._job is not None:
            return
        addresses = self.addresses()
        self.ask_button.setEnabled(False)
        for mark, reply in zip(self._marks, self.replies, strict=True):
            mark.set_shape("ring", self._scheme.accent)
            reply.setText(tr("asking …"))
        self._job = Job(lambda progress: self._ask(addresses), self._show_answers, self._show_error, None, self).start()

    def _show_answers(self, answers: list[NodeAnswer]) -> None:
        self._job = None
        self.ask_button.setEnabled(True)
        if [answer.address for answer in answers] != self.addresses():  # something else was entered since
            self._show_not_asked()
            if self._ask_again:
                self.ask()
            return
        self._answers = answers
        for answer, mark, reply, button in zip(answers, self._marks, self.replies, self.pair_buttons, strict=True):
            shape, colour = ("disc", self._scheme.good) if answer.usable else (
                ("ring", self._scheme.accent) if answer.found else ("cross", self._scheme.bad))
            mark.set_shape(shape, colour)
            reply.setText(answer.text)
            button.setEnabled(answer.found and not answer.usable)
        both = all(answer.usable for answer in answers)
        self.save_button.setEnabled(both)
        self.verdict.setText(tr("Both nodes answer. The new rig starts with textbook lenses and a 75 mm baseline: "
                                "calibrate before you trust millimetres.") if both else "")

    def pair(self, row: int) -> None:
        """Pair with the node of a row, then ask both again."""
        answer = self._answers[row]
        if answer.who is not None and PairDialog(answer.who.name, answer.address, pair_node, self).exec():
            self.ask()
            self.found.search()

    def _show_error(self, sentence: str) -> None:
        self._job = None
        self.ask_button.setEnabled(True)
        self.verdict.setText(sentence)

    def _choose_file(self) -> None:
        path = ask_where_to_save(self, tr("Write the rig file"), Path.home() / "rig.json", tr("Rig files (*.json)"))
        if path is not None:
            self.write(path)

    def write(self, path: Path) -> None:
        """Write the rig and accept; a failure is shown and nothing is half-written."""
        try:
            save_rig(path, first_rig(self._answers))
        except RhotError as exc:
            self.verdict.setText(str(exc))
            return
        except OSError as exc:
            self.verdict.setText(tr("{out}: cannot be written ({strerror}); nothing was saved.", out=path,
                                    strerror=exc.strerror))
            return
        self.rig_path = path
        self.accept()


# -- pair with one node ------------------------------------------------------------------------------------------------

INTRO = tr_noop(
    "Pairing makes sure that this computer and the node know each other, so that nobody else on the network "
    "can see its pictures, steer it, or pretend to be it.\n\n1. On the node {name}, at its console or over "
    "SSH, run:  rhot-node pair\n2. It shows a code of three groups, such as 7K2QD-9M4XT-BNWH3. Type it here "
    "within five minutes.")

Pair = Callable[[NodeAddress, str], str]
"""Pairs by a code and returns the node's name; raises a sentence."""


class PairDialog(QDialog):
    """Accepted once the node is paired."""

    def __init__(self, name: str, address: NodeAddress, pair: Pair, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle(tr("Pair with {name}", name=name))
        self._address = address
        self._pair = pair
        self._job: Job | None = None
        intro = QLabel(tr(INTRO, name=name))
        intro.setTextFormat(Qt.TextFormat.PlainText)  # the name is the node's own word
        intro.setWordWrap(True)
        self.code = QLineEdit()
        self.code.setPlaceholderText(tr("code shown by the node"))
        self.code.setAccessibleName(tr("Pairing code"))
        self.code.setMaxLength(40)
        self.code.textChanged.connect(self._show_whether_complete)
        self.verdict = Sentence(3)
        self.pair_button = QPushButton(tr("Pair"))
        self.pair_button.setDefault(True)
        self.pair_button.setEnabled(False)
        self.pair_button.setToolTip(tr("Possible once {code_length} letters and digits are entered; dashes are free.",
                                       code_length=CODE_LENGTH))
        self.pair_button.clicked.connect(self.pair)
        cancel = QPushButton(tr("Cancel"))
        cancel.clicked.connect(self.reject)
        buttons = QHBoxLayout()
        buttons.addStretch(1)
        buttons.addWidget(cancel)
        buttons.addWidget(self.pair_button)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(16, 16, 16, 16)
        layout.setSpacing(16)
        for widget in (intro, self.code, self.verdict):
            layout.addWidget(widget)
        layout.addLayout(buttons)
        self.resize(600, max(340, layout.totalHeightForWidth(600)))
        self.code.setFocus()

    def _show_whether_complete(self) -> None:
        letters = sum(character.isalnum() for character in self.code.text())
        self.pair_button.setEnabled(self._job is None and letters == CODE_LENGTH)

    def pair(self) -> None:
        """Pair in a worker."""
        if self._job is not None:
            return
        code = self.code.text()
        self.pair_button.setEnabled(False)
        self.verdict.setText(tr("pairing …"))
        self._job = Job(lambda progress: self._pair(self._address, code), self._accept, self._show_error, None,
                        self).start()

    def _accept(self, _name: str) -> None:
        self._job = None
        self.accept()

    def _show_error(self, sentence: str) -> None:
        self._job = None
        self._show_whether_complete()
        self.verdict.setText(sentence)
