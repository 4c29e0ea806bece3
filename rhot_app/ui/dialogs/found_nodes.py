"""The nodes that are found on the network, in a list that one can take the left and the right camera from."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from PySide6.QtCore import Signal
from PySide6.QtWidgets import (
    QHBoxLayout,
    QProgressBar,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from rhot_app.progress import Progress
from rhot_app.sources.discovery import FoundNode, Search
from rhot_app.ui.common.job import Job
from rhot_app.ui.common.parts import plain_button
from rhot_app.ui.common.record_table import Column, RecordTable
from rhot_app.ui.common.sentence import Sentence
from rhot_app.ui.language import tr, tr_noop
from rhot_node.wire.messages import TrustState

Find = Callable[[Progress], Search]
"""Searches and reports its progress; called in a worker."""

NOBODY = tr_noop("No node was found. Is rhot-node running there, and on the same network? Some networks let no search "
                 "through: then type the address in below.")
_TRUST = {TrustState.OPEN: tr_noop("open to everybody"), TrustState.UNPAIRED: tr_noop("not paired yet"),
          TrustState.PAIRED: tr_noop("paired")}
def _columns() -> tuple[Column[FoundNode], ...]:
    return (
        Column(tr("name"), lambda node: node.presence.name),
        Column(tr("id"), lambda node: str(node.presence.node_id)),
        Column(tr("address"), lambda node: ", ".join(node.addresses)),
        Column(tr("trust"), lambda node: tr(_TRUST[node.presence.trust])),
        Column(tr("state"), lambda node: tr("announces itself") if node.state is None else tr(node.state.name.lower())))


class FoundNodes(QWidget):
    """A list that fills itself. `chosen(side, node)`: the node is to be camera number `side`; `searched()`: the list is
    complete."""

    chosen = Signal(int, object)
    searched = Signal()

    def __init__(self, find: Find, sides: Sequence[str], parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._find = find
        self._job: Job | None = None
        self.table: RecordTable[FoundNode] = RecordTable(_columns())
        self.table.fit_columns()
        self.table.setTabKeyNavigation(False)
        self.table.setShowGrid(False)
        self.table.setAccessibleName(tr("Nodes on the network"))
        self.table.setMinimumHeight(140)
        self.table.chosen_changed.connect(self._show_whether_chosen)
        self.side_buttons = [self._side_button(number, side) for number, side in enumerate(sides)]
        self.again = plain_button(tr("Search again"), clicked=self.search)
        self.progress_bar = QProgressBar()
        self.progress_bar.setRange(0, 100)
        self.progress_bar.setTextVisible(False)
        policy = self.progress_bar.sizePolicy()
        policy.setRetainSizeWhenHidden(True)
        self.progress_bar.setSizePolicy(policy)
        self.message = Sentence(2)
        buttons = QHBoxLayout()
        for button in self.side_buttons:
            buttons.addWidget(button)
        buttons.addWidget(self.progress_bar, 1)
        buttons.addWidget(self.again)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(8)
        layout.addWidget(self.table)
        layout.addLayout(buttons)
        layout.addWidget(self.message)

    def search(self) -> None:
        """Search anew in a worker; what was found before stays in sight until then."""
        if self._job is None:
            self.again.setEnabled(False)
            self.progress_bar.show()
            self.message.setText(tr("Looking for nodes …"))
            self._job = Job(lambda progress: self._find(progress.report), self._show, self._show_error,
                            self._show_progress, self).start()

    def stop(self) -> None:
        """End a search that nobody waits for any more."""
        if self._job is not None:
            self._job.cancel()
            self._job = None

    def _side_button(self, number: int, side: str) -> QPushButton:
        button = plain_button(tr("Use as {side} camera", side=tr(side)))
        button.setEnabled(False)
        button.setToolTip(tr("Possible once a node is selected in the list."))
        button.clicked.connect(lambda: self.chosen.emit(number, self.table.chosen))
        return button

    def _show(self, found: Search) -> None:
        self._rest()
        self.table.clearSelection()
        self.table.show_records(found.nodes)
        sentences = [*([] if found.nodes else [tr(NOBODY)]), *found.conflicts, *found.notes]
        self.message.setText("\n".join(sentences))
        self._show_whether_chosen()
        self.searched.emit()

    def _show_error(self, sentence: str) -> None:
        self._rest()
        self.message.setText(sentence)

    def _show_progress(self, text: str, fraction: float) -> None:
        self.progress_bar.setValue(round(100 * fraction))

    def _rest(self) -> None:
        self._job = None
        self.again.setEnabled(True)
        self.progress_bar.reset()
        self.progress_bar.hide()

    def _show_whether_chosen(self) -> None:
        for button in self.side_buttons:
            button.setEnabled(self.table.chosen is not None)
