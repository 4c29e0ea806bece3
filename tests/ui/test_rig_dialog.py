"""What the rig file says must be readable without widening columns by hand."""

from __future__ import annotations

import msgspec
import pytest
from fake_engine import synthetic_rig
from patience import PATIENCE_MS
from PySide6.QtGui import QFontMetrics
from PySide6.QtWidgets import QTableWidget

from rhot_app.ui.dialogs.dialogs import RigDialog


@pytest.mark.parametrize("page", ["cameras", "markers", "hand"])
def test_no_head_and_no_value_is_cut_off(qtbot, themed, page):
    rig = synthetic_rig()
    nodes = tuple(msgspec.structs.replace(node, address="192.168.100.211") for node in rig.nodes)
    dialog = RigDialog(msgspec.structs.replace(rig, nodes=nodes), page)
    qtbot.addWidget(dialog)
    dialog.show()
    qtbot.waitExposed(dialog)
    table = dialog.tabs.currentWidget().findChild(QTableWidget)
    metrics = QFontMetrics(table.font())
    for column in range(table.columnCount()):
        texts = [table.item(row, column).text() for row in range(table.rowCount())]
        texts.append(table.horizontalHeaderItem(column).text())
        assert table.columnWidth(column) >= max(metrics.horizontalAdvance(text) for text in texts) + 8
    bars = (table.horizontalScrollBar(), table.verticalScrollBar())
    qtbot.waitUntil(lambda: not any(bar.isVisible() for bar in bars), timeout=PATIENCE_MS)
    assert dialog.width() <= 1280
