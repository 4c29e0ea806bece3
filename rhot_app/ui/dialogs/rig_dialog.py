"""What the rig file says, to read: its cameras, markers and hand."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QShowEvent
from PySide6.QtWidgets import QDialog, QLabel, QPushButton, QTabWidget, QVBoxLayout, QWidget

from rhot_app.charts import hex_of
from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.anatomy import FingerAnatomy
from rhot_app.hand.skeleton import FINGERS
from rhot_app.project import Rig, RigNode
from rhot_app.ui.common.record_table import Column, RecordTable
from rhot_app.ui.language import tr
from rhot_app.ui.models.words import HANDS
from rhot_node.markers import Marker

_MARGIN_PX = 40
_HEAD_PX = 190  # tabs, sentence, column heads and button


def _field_of_view(node: RigNode) -> str:
    return f"{np.degrees(CameraModel.from_rig(node.intrinsics, node.pose).field_of_view[0]):.1f}°"


def _camera_columns() -> tuple[Column[RigNode], ...]:
    return (
        Column(tr("camera"), lambda node: node.name),
        Column(tr("picture [px]"), lambda node: f"{node.intrinsics.width} × {node.intrinsics.height}"),
        Column(tr("field of view"), _field_of_view),
        Column(tr("focal length [px]"), lambda node: f"{node.intrinsics.fx:.1f}, {node.intrinsics.fy:.1f}"),
        Column(tr("centre [px]"), lambda node: f"{node.intrinsics.cx:.1f}, {node.intrinsics.cy:.1f}"),
        Column("k1, k2", lambda node: "{:.3f}, {:.3f}".format(*node.intrinsics.distortion[:2])),
        Column(tr("address : port"), lambda node: f"{node.address}:{node.control_port}"))


def _colours(marker: Marker) -> dict[int, QColor]:
    """The marker's colour, and what can be read on it."""
    red, green, blue = marker.display_rgb
    light = 0.3 * red + 0.6 * green + 0.1 * blue > 128
    return {Qt.ItemDataRole.BackgroundRole: QColor(red, green, blue),
            Qt.ItemDataRole.ForegroundRole: QColor("#000000" if light else "#ffffff")}


def _marker_columns() -> tuple[Column[Marker], ...]:
    return (
        Column(tr("marker"), lambda marker: marker.id),
        Column(tr("colour"), lambda marker: hex_of(marker.display_rgb), roles=_colours),
        Column(tr("place"), lambda marker: tr((marker.role or "free").replace("_", " "))),
        Column(tr("shape"), lambda marker: tr(marker.shape)),
        Column(tr("radius [mm]"), lambda marker: f"{marker.radius_mm:.1f}" if marker.radius_mm else "–"))


def _bone(number: int) -> Callable[[tuple[str, FingerAnatomy]], str]:
    return lambda named: f"{named[1].bones_mm[number]:.1f}"


def _hand_columns() -> tuple[Column[tuple[str, FingerAnatomy]], ...]:
    return (
        Column(tr("finger"), lambda named: tr(named[0])), Column(tr("first bone [mm]"), _bone(0)),
        Column(tr("second [mm]"), _bone(1)),
        Column(tr("last [mm]"), _bone(2)),
        Column(tr("marker to last joint [mm]"), lambda named: f"{named[1].marker_mm:.1f}"))


def baseline_text(rig: Rig) -> str:
    """Distance of the first two cameras in words."""
    if len(rig.nodes) < 2:
        return tr("The rig has one camera; depth needs two.")
    if not all(rig.tracked_with[:2]):
        return tr("Where {first} and {second} stand to each other is not known.", first=rig.nodes[0].name,
                  second=rig.nodes[1].name)
    first, second = (np.array(node.pose.translation_m) for node in rig.nodes[:2])
    return tr("{first} and {second} stand {distance:.1f} mm apart.", first=rig.nodes[0].name, second=rig.nodes[1].name,
              distance=1e3 * np.linalg.norm(second - first))


class RigDialog(QDialog):
    """Three tabs; `page` is the one shown first: "cameras", "markers" or "hand"."""

    def __init__(self, rig: Rig, page: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle(tr("Rig {name}", name=rig.name))
        self.setProperty("guide", "calibration")
        self.tabs = QTabWidget()
        self.tabs.addTab(_page(_table(_camera_columns(), rig.nodes), baseline_text(rig)), tr("Cameras"))
        self.tabs.addTab(_page(_table(_marker_columns(), rig.markers.markers),
                               tr("Marker set {name}. Nodes and master must use the same one.",
                                  name=rig.markers.name or tr("without a name"))), tr("Markers"))
        self.tabs.addTab(_page(_table(_hand_columns(), [(name, rig.hand.fingers[name]) for name in FINGERS]),
                               tr("{name}, {hand}; wrist {breadth:.0f} × {thickness:.0f} mm.",
                                  name=rig.hand.name or tr("Hand"), hand=tr(HANDS[rig.hand.side]),
                                  breadth=rig.hand.wrist_breadth_mm, thickness=rig.hand.wrist_thickness_mm)),
                         tr("Hand"))
        self.tabs.setCurrentIndex(("cameras", "markers", "hand").index(page))
        close = QPushButton(tr("Close"))
        close.clicked.connect(self.reject)
        layout = QVBoxLayout(self)
        layout.addWidget(self.tabs)
        layout.addWidget(close, alignment=Qt.AlignmentFlag.AlignRight)

    def showEvent(self, event: QShowEvent) -> None:  # noqa: N802
        """Only now are fonts and paddings known."""
        self._fit()
        super().showEvent(event)

    def _fit(self) -> None:
        """Wide and tall enough for every table, as far as the screen allows; beyond that they scroll."""
        tables = self.findChildren(RecordTable)
        width = max(_width_of(table) for table in tables) + 2 * _MARGIN_PX
        height = max(table.verticalHeader().length() for table in tables) + _HEAD_PX
        room = self.screen().availableSize()
        self.resize(min(max(width, 480), room.width() - _MARGIN_PX), min(height, room.height() - _MARGIN_PX))


def _table(columns: Sequence[Column[Any]], records: Sequence[Any]) -> RecordTable[Any]:
    table: RecordTable[Any] = RecordTable(columns, selectable=False)
    table.setWordWrap(False)
    table.show_records(records)
    table.fit_columns()
    return table


def _width_of(table: RecordTable[Any]) -> int:
    header = table.horizontalHeader()
    return sum(max(table.sizeHintForColumn(k), header.sectionSizeHint(k)) for k in range(header.count()))


def _page(table: RecordTable[Any], sentence: str) -> QWidget:
    page = QWidget()
    label = QLabel(sentence)
    label.setWordWrap(True)
    layout = QVBoxLayout(page)
    layout.addWidget(label)
    layout.addWidget(table, 1)
    return page
