"""What the rig file says must be readable without widening columns by hand."""

from __future__ import annotations

import msgspec
import pytest
from fake_engine import synthetic_rig
from patience import PATIENCE_MS
from PySide6.QtGui import QFontMetrics

from rhot_app.ui.common.record_table import RecordTable
from rhot_app.ui.dialogs.rig_dialog import RigDialog


@pytest.mark.parametrize("page", ["cameras", "markers", "hand"])
def test_no_head_and_no_value_is_cut_off(qtbot, themed, page):
    rig = synthetic_rig()
    nodes = tuple(msgspec.structs.replace(node, address="192.168.100.211") for node in rig.nodes)
    dialog = RigDialog(msgspec.structs.replace(rig, nodes=nodes), page)
    qtbot.addWidget(dialog)
    dialog.show()
    qtbot.waitExposed(dialog)
    table = dialog.tabs.currentWidget().findChild(RecordTable)
    metrics = QFontMetrics(table.font())
    for column, head in enumerate(table.heads()):
        texts = [table.text(row, column) for row in range(len(table.records))]
        texts.append(head)
        assert table.columnWidth(column) >= max(metrics.horizontalAdvance(text) for text in texts) + 8
    bars = (table.horizontalScrollBar(), table.verticalScrollBar())
    qtbot.waitUntil(lambda: not any(bar.isVisible() for bar in bars), timeout=PATIENCE_MS)
    assert dialog.width() <= 1280
