"""The scene with its own toolbar: what is drawn of uncertainty and names."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QToolBar, QToolButton, QVBoxLayout, QWidget

from rhot_app.ui.common.menu import Menu
from rhot_app.ui.language import tr
from rhot_app.ui.scene.view import SceneView


class SceneBar(QToolBar):
    """`switches` stand alone; `uncertainty` is a switch too, whose menu chooses `kinds`; `sizes` exclude each other."""

    def __init__(self, uncertainty: QAction, kinds: list[QAction], sizes: list[QAction], switches: list[QAction],
                 parent: QWidget | None = None) -> None:
        super().__init__(tr("Scene"), parent)
        self.setObjectName("scene toolbar")
        self.setContextMenuPolicy(Qt.ContextMenuPolicy.PreventContextMenu)
        self.uncertainty_button = QToolButton()
        self.uncertainty_button.setDefaultAction(uncertainty)
        self.uncertainty_button.setPopupMode(QToolButton.ToolButtonPopupMode.MenuButtonPopup)
        menu = Menu("", self.uncertainty_button)
        menu.addActions(kinds)
        self.uncertainty_button.setMenu(menu)
        self.addWidget(self.uncertainty_button)
        self.addActions(sizes)
        self.addSeparator()
        self.addActions(switches)


class ScenePage(QWidget):
    """Toolbar above, scene below."""

    def __init__(self, scene: SceneView, bar: SceneBar, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.bar = bar
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addWidget(bar)
        layout.addWidget(scene, 1)
