"""The dialogs and other windows that the main window opens."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QFileDialog, QWidget

from rhot_app.project import Rig
from rhot_app.ui.controller import Controller
from rhot_app.ui.export_dialog import ExportDialog
from rhot_app.ui.guide import GuideViewer
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.nodes_dialog import NodesDialog
from rhot_app.ui.outputs_dialog import OutputsDialog
from rhot_app.ui.recordings import recordings_folder
from rhot_app.ui.rig_dialog import RigDialog
from rhot_app.ui.tracker_dialog import TrackerDialog


class Dialogs:
    """Each asks one thing, or shows one thing, on top of `parent`."""

    def __init__(self, parent: QWidget) -> None:
        self._parent = parent
        self.guide: GuideViewer | None = None
        self.tracker: TrackerDialog | None = None
        self.outputs: OutputsDialog | None = None

    def choose_rig(self, last_rig: str) -> Path | None:
        """A rig file, looked for beside the one opened last; None when the person thought better of it."""
        last = Path(last_rig)
        start = str(last.parent) if last_rig and last.parent.is_dir() else str(Path.home())
        name, _ = QFileDialog.getOpenFileName(self._parent, "Open a rig file", start,
                                              "Rig files (*.json);;All files (*)")
        return Path(name) if name else None

    def connect_nodes(self, scheme: Scheme) -> Path | None:
        """The rig file written for two nodes that answered; None when there is none."""
        dialog = NodesDialog(scheme, self._parent)
        return dialog.rig_path if dialog.exec() else None

    def export_recording(self, log: Path | None = None) -> None:
        """What to write of a recording, beside the window; `log` None is asked for."""
        self.export = ExportDialog(log, recordings_folder(), self._parent)
        self.export.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.export.open()

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
            self.tracker = TrackerDialog(opened.rig, path, controller.backend.asker,
                                         lambda: controller.live.state if controller.running else None, self._parent)
            self.tracker.rig_used.connect(lambda rig: rig_used())
            self.tracker.finished.connect(self._forget_tracker)
        self.tracker.show()
        self.tracker.raise_()
        self.tracker.activateWindow()

    def show_outputs(self, controller: Controller, scheme: Callable[[], Scheme], actions: Sequence[QAction],
                     rig_used: Callable[[], None]) -> None:
        """The live streams to other programs, beside the window; the keys of `actions` work there too."""
        opened = controller.opened
        if opened is None:
            return
        if self.outputs is None:
            self.outputs = OutputsDialog(opened, controller.backend.asker, lambda: controller.live.status, scheme,
                                         self._parent)
            self.outputs.addActions(actions)
            self.outputs.rig_used.connect(lambda rig: rig_used())
            self.outputs.finished.connect(self._forget_outputs)
        self.outputs.show()
        self.outputs.raise_()
        self.outputs.activateWindow()

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

    def _forget_tracker(self) -> None:
        if self.tracker is not None:
            self.tracker.deleteLater()
            self.tracker = None

    def _forget_outputs(self) -> None:
        if self.outputs is not None:
            self.outputs.deleteLater()
            self.outputs = None

    def open_guide(self, page: str) -> None:
        """A page of the guide beside the window."""
        if self.guide is None:
            self.guide = GuideViewer(self._parent)
        self.guide.open_page(page)

    @property
    def guide_page(self) -> str:
        """The page of the guide that is open, "" for none."""
        return self.guide.page if self.guide is not None and self.guide.isVisible() else ""

    def close(self) -> None:
        """Close what stands beside the window."""
        for window in (self.guide, self.tracker, self.outputs):
            if window is not None:
                window.close()
