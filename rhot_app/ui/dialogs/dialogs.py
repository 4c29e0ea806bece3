"""The dialogs and other windows that the main window opens."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtGui import QAction
from PySide6.QtWidgets import (
    QDialog,
    QFileDialog,
    QWidget,
)

from rhot_app.project import Rig
from rhot_app.sources.cameras.camera_set import Prepared
from rhot_app.ui.common.controller import Controller
from rhot_app.ui.common.disposal import dispose, release_style
from rhot_app.ui.common.guide import GuideViewer
from rhot_app.ui.common.keys import ActionKeys
from rhot_app.ui.common.settings import Settings
from rhot_app.ui.dialogs.about_dialog import AboutDialog
from rhot_app.ui.dialogs.cameras_dialog import CamerasDialog
from rhot_app.ui.dialogs.export_dialog import ExportDialog
from rhot_app.ui.dialogs.networks_dialog import NetworksDialog
from rhot_app.ui.dialogs.nodes_dialog import NodesDialog
from rhot_app.ui.dialogs.outputs_dialog import OutputsDialog
from rhot_app.ui.dialogs.rig_dialog import RigDialog
from rhot_app.ui.dialogs.settings_dialog import SettingsDialog
from rhot_app.ui.dialogs.tracker_dialog import TrackerDialog
from rhot_app.ui.language import tr
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.mouse.window import MouseWindow

if TYPE_CHECKING:  # they bring numerical code, which waits until it is wanted
    from rhot_app.ui.dialogs.layers_dialog import LayersDialog


class Dialogs:
    """Each asks one thing, or shows one thing, on top of `parent`."""

    def __init__(self, parent: QWidget) -> None:
        self._parent = parent
        self.guide: GuideViewer | None = None
        self.tracker: TrackerDialog | None = None
        self.networks: NetworksDialog | None = None
        self.outputs: OutputsDialog | None = None
        self.mouse: MouseWindow | None = None
        self.layers: LayersDialog | None = None
        self.export: ExportDialog | None = None
        self.settings: SettingsDialog | None = None
        self.about: AboutDialog | None = None

    def _hold(self, name: str, dialog: QDialog) -> None:
        """Hold a dialog until it is closed, then let go of it."""
        def forget() -> None:
            setattr(self, name, None)
            dispose(dialog)

        setattr(self, name, dialog)
        dialog.finished.connect(forget)

    def choose_rig(self, last_rig: str) -> Path | None:
        """A rig file, looked for beside the one opened last; None when the person thought better of it."""
        last = Path(last_rig)
        start = str(last.parent) if last_rig and last.parent.is_dir() else str(Path.home())
        name, _ = QFileDialog.getOpenFileName(self._parent, tr("Open a rig file"), start,
                                              tr("Rig files (*.json);;All files (*)"))
        return Path(name) if name else None

    def connect_nodes(self, scheme: Scheme) -> Path | None:
        """The rig file written for two nodes that answered; None when there is none."""
        dialog = NodesDialog(scheme, self._parent)
        dialog.finished.connect(lambda: release_style(dialog))
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        return dialog.rig_path if dialog.exec() else None

    def choose_cameras(self, scheme: Scheme) -> Prepared | None:
        """The rig written for cameras of this computer; None when the person thought better of it."""
        dialog = CamerasDialog(scheme, self._parent)
        dialog.finished.connect(lambda: release_style(dialog))
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        return dialog.prepared if dialog.exec() else None

    def export_recording(self, settings: Settings, log: Path | None = None) -> None:
        """What to write of a recording, beside the window; `log` None is asked for."""
        dialog = ExportDialog(log, settings.recordings_folder, self._parent, out_folder=settings.exports_folder)
        self._hold("export", dialog)
        dialog.open()

    def show_rig(self, rig: Rig, page: str) -> None:
        """What the rig says, to read; `page` is "cameras", "markers" or "hand"."""
        dialog = RigDialog(rig, page, self._parent)
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.open()

    def choose_tracker(self, controller: Controller, rig_used: Callable[[], None]) -> None:
        """The choice of the tracker, beside the window so that the hand is seen; `rig_used` after each change."""
        opened = controller.opened
        if opened is None:
            return
        if self.tracker is None:
            path = Path(opened.rig_path) if opened.rig_path else None
            dialog = TrackerDialog(opened.rig, path, controller.backend.command_client,
                                   lambda: controller.live.state if controller.running else None, self._parent)
            dialog.rig_used.connect(lambda rig: rig_used())
            self._hold("tracker", dialog)
        _bring_forward(self.tracker)

    def show_networks(self) -> None:
        """The hand networks of this computer, beside the window; with or without a rig."""
        if self.networks is None:
            self._hold("networks", NetworksDialog(self._parent))
        _bring_forward(self.networks)

    def show_outputs(self, controller: Controller, scheme: Callable[[], Scheme], actions: Sequence[QAction],
                     rig_used: Callable[[], None]) -> None:
        """The live streams to other programs, beside the window; the keys of `actions` work there too."""
        opened = controller.opened
        if opened is None:
            return
        if self.outputs is None:
            dialog = OutputsDialog(opened, controller.backend.command_client, lambda: controller.live.status, scheme,
                                   self._parent)
            dialog.addActions(actions)
            dialog.rig_used.connect(lambda rig: rig_used())
            self._hold("outputs", dialog)
        _bring_forward(self.outputs)

    def show_settings(self, settings: Settings, actions: ActionKeys) -> None:
        """What the app remembers, to be changed."""
        if self.settings is None:
            self._hold("settings", SettingsDialog(settings, actions, self._parent))
        _bring_forward(self.settings)

    def show_about(self) -> None:
        """Versions and licences."""
        if self.about is None:
            self._hold("about", AboutDialog(self._parent))
        _bring_forward(self.about)

    def follow_rig(self, controller: Controller) -> None:
        """Another rig is open, or none."""
        if self.tracker is not None:
            if controller.opened is None:
                self.tracker.close()
            else:
                path = controller.opened.rig_path
                self.tracker.follow(controller.opened.rig, Path(path) if path else None)
        if self.outputs is not None:
            if controller.opened is None:
                self.outputs.close()
            else:
                self.outputs.follow(controller.opened)

    def show_mouse(self, controller: Controller, scheme: Scheme) -> None:
        """The 3-D mouse beside the window; with or without a rig."""
        if self.mouse is None:
            self._hold("mouse", MouseWindow(controller.backend.client(), lambda: controller.rig, scheme, self._parent,
                                            controller.clock))
        _bring_forward(self.mouse)

    def show_layers(self, controller: Controller, scheme: Scheme) -> None:
        """Which link of the tracked hand hides which, beside the window."""
        if self.layers is None:
            from rhot_app.ui.dialogs.layers_dialog import LayersDialog

            self._hold("layers", LayersDialog(controller, scheme, self._parent))
        _bring_forward(self.layers)

    def set_scheme(self, scheme: Scheme) -> None:
        """Change the colours of what paints by itself."""
        if self.layers is not None:
            self.layers.set_scheme(scheme)
        if self.mouse is not None:
            self.mouse.set_scheme(scheme)

    def open_guide(self, page: str) -> None:
        """A page of the guide beside the window."""
        guide = self.guide
        if guide is None:
            guide = GuideViewer(self._parent)
            self._hold("guide", guide)
        guide.open_page(page)

    @property
    def guide_page(self) -> str:
        """The page of the guide that is open, "" for none."""
        return self.guide.page if self.guide is not None and self.guide.isVisible() else ""

    def close(self) -> None:
        """Close what stands beside the window."""
        for window in (self.guide, self.tracker, self.networks, self.outputs, self.mouse, self.layers, self.export,
                       self.settings, self.about):
            if window is not None:
                window.close()


def _bring_forward(window: QWidget | None) -> None:
    if window is not None:
        window.show()
        window.raise_()
        window.activateWindow()
