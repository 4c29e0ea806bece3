"""The nodes: one card each with state, rate, losses and clock."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFrame, QGridLayout, QLabel, QSizePolicy, QVBoxLayout, QWidget

from rhot_app.engine.status import EngineStatus, NodeStatus
from rhot_app.ui.common.shapes import ShapeMark
from rhot_app.ui.language import tr
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.models.rows import NodeRow, node_row
from rhot_app.ui.models.words import tip
from rhot_app.ui.panels.empty_state import EmptyState


class NodeCard(QFrame):
    """One node."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setProperty("card", True)
        self._mark = ShapeMark(14)
        self._name, self._word, self._rate = QLabel(), QLabel(), QLabel()
        self._losses, self._clock, self._message = QLabel(), QLabel(), QLabel()
        self._name.setProperty("title", True)
        for label, term in ((self._rate, "node rate"), (self._losses, "lost"), (self._clock, "clock")):
            label.setProperty("muted", True)
            label.setToolTip(tip(term))
        self._rate.setAlignment(Qt.AlignmentFlag.AlignRight)
        self._word.setAlignment(Qt.AlignmentFlag.AlignRight)
        for label in (self._losses, self._message):
            label.setWordWrap(True)  # a card is no wider than its dock, whatever has to be said
        self._message.setVisible(False)
        grid = QGridLayout(self)
        grid.setContentsMargins(8, 6, 8, 6)
        grid.setHorizontalSpacing(8)
        grid.setVerticalSpacing(1)
        grid.addWidget(self._mark, 0, 0)
        grid.addWidget(self._name, 0, 1)
        grid.addWidget(self._word, 0, 2)
        grid.addWidget(self._losses, 1, 1)
        grid.addWidget(self._rate, 1, 2)
        grid.addWidget(self._clock, 2, 1, 1, 2)
        grid.addWidget(self._message, 3, 1, 1, 2)
        grid.setColumnStretch(1, 1)
        self.row: NodeRow | None = None

    def show_node(self, row: NodeRow, scheme: Scheme) -> None:
        """Show other values."""
        if row == self.row:
            return
        self.row = row
        self._mark.set_shape(row.look.shape, scheme.tone(row.look.tone))
        for label, text in ((self._name, row.name), (self._word, tr(row.look.word)), (self._rate, row.rate),
                            (self._losses, row.losses), (self._clock, row.clock), (self._message, row.message)):
            label.setText(text)
        self._message.setVisible(bool(row.message))
        self._word.setToolTip(tr(row.look.meaning))
        self.setToolTip(row.tooltip)
        self.setAccessibleName(tr("Node {name}: {word}, {rate}, {losses}, {clock}", name=row.name,
                                  word=tr(row.look.word), rate=row.rate, losses=row.losses, clock=row.clock))


class NodesPanel(QWidget):
    """All nodes, or the next step when there are none."""

    def __init__(self, scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setProperty("panel", True)
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self.setProperty("guide", "nodes")
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Maximum)
        self._scheme = scheme
        self._cards: list[NodeCard] = []
        self.empty = EmptyState(tr("No word from the engine about its nodes."))
        self._layout = QVBoxLayout(self)
        self._layout.setContentsMargins(8, 4, 8, 8)
        self._layout.setSpacing(6)
        self._layout.addWidget(self.empty)

    def set_scheme(self, scheme: Scheme) -> None:
        """Change colours."""
        self._scheme = scheme
        for card in self._cards:
            card.row = None

    def show_status(self, status: EngineStatus | None) -> None:
        """Show the nodes of `status`; None is the empty state."""
        nodes: tuple[NodeStatus, ...] = status.nodes if status is not None else ()
        self.empty.setVisible(not nodes)
        while len(self._cards) < len(nodes):
            self._cards.append(NodeCard(self))
            self._layout.addWidget(self._cards[-1])
        for k, card in enumerate(self._cards):
            card.setVisible(k < len(nodes))
            if k < len(nodes):
                card.show_node(node_row(nodes[k]), self._scheme)

    @property
    def cards(self) -> list[NodeCard]:
        """The cards that are shown."""
        return [card for card in self._cards if not card.isHidden()]
