"""The instants of a fit in its window: pictures of running cameras or of files become one, and one of them is shown."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QFileDialog, QInputDialog, QWidget

from rhot_app.errors import RhotError
from rhot_app.hand.skeleton import HandPose
from rhot_app.handfit.state import Image
from rhot_app.ui.backend.feed import LiveFeed
from rhot_app.ui.handfit.changes import FOLDER_KEY, Changes
from rhot_app.ui.handfit.files import in_order, is_video, read_instant
from rhot_app.ui.handfit.frame import FitFrame
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.wizards.framework.definition import SettingsStore
from rhot_node.pictures import VIDEO_SUFFIXES

TITLE: Final = tr_noop("Fit the hand to pictures")
_ENDINGS = " ".join(["*.png *.jpg *.jpeg *.tif *.tiff *.webp", *(f"*{end}" for end in sorted(VIDEO_SUFFIXES))])
_LONGEST_S = 1e5  # of a video: a day


@dataclass(frozen=True, slots=True)
class LiveCameras:
    """Where pictures come from while cameras run: their newest pictures, and the pose that is tracked now, None for
    none. `numbers`: the camera's number in the rig by its name in the feed. `stop` ends both, and may wait."""

    feed: LiveFeed
    pose: Callable[[], HandPose | None]
    numbers: dict[str, int]
    stop: Callable[[], None]


class Instants(QObject):
    """The list of instants; `cameras`: None without running ones."""

    def __init__(self, changes: Changes, frame: FitFrame, memory: SettingsStore, cameras: LiveCameras | None,
                 window: QWidget) -> None:
        super().__init__(window)
        self._changes, self._fit, self._frame, self._memory = changes, changes.fit, frame, memory
        self._cameras, self._window = cameras, window
        self._at_s = 0.0

    @property
    def live(self) -> bool:
        """Whether the pictures are the cameras' newest, and no hand is fitted to them."""
        return self._cameras is not None and self._frame.instant_box.currentData() is None

    def take_pictures(self) -> None:
        """The newest pictures of all cameras become an instant."""
        if self._cameras is None or not self._changes.idle:
            return
        feed, numbers = self._cameras.feed, self._cameras.numbers
        together = feed.together(feed.cameras)
        pose = self._cameras.pose()
        self._add({numbers[name]: picture.bgr[:, :, ::-1].copy() for name, picture in together.items()}, pose)

    def choose_pictures(self) -> None:
        """Ask for the picture files of one instant."""
        if not self._changes.idle:
            return
        names, _ = QFileDialog.getOpenFileNames(self._window, tr("Pictures of one instant, one for each camera"),
                                                self._memory.remembered(FOLDER_KEY) or str(Path.home()),
                                                tr("Pictures and videos ({endings});;All files (*)", endings=_ENDINGS))
        if names:
            self._memory.remember(FOLDER_KEY, str(Path(names[0]).parent))
            self.open_pictures(in_order(self._fit.rig, names))

    def open_pictures(self, given: list[str]) -> None:
        """Files of pictures or videos, as `files.read_instant` takes them, become an instant."""
        at_s, wanted = 0.0, True
        if any(is_video(Path(name)) for name in given):
            at_s, wanted = QInputDialog.getDouble(self._window, tr(TITLE), tr("Which second of the videos?"),
                                                  self._at_s, 0.0, _LONGEST_S, 2)
        if wanted:
            self._at_s = at_s
            try:
                self._add(read_instant(self._fit.rig, given, at_s), None)
            except RhotError as exc:
                self._changes.tell(str(exc), bad=True)

    def remove(self) -> None:
        """Without the instant shown."""
        if self._changes.edit(self._fit.remove_instant):
            self.show_list()

    def choose(self) -> None:
        """The one that was chosen in the list is in work."""
        number = self._frame.instant_box.currentData()
        if number is not None:
            self._fit.current = number
        self._changes.changed.emit()

    def show_list(self) -> None:
        """The list of instants; the one in work is chosen."""
        box = self._frame.instant_box
        box.clear()
        if self._cameras is not None:
            box.addItem(tr("Live pictures"), None)
        for number, one in enumerate(self._fit.state.instants):
            box.addItem(one.name, number)
        if self._fit.instant is not None:
            box.setCurrentIndex(box.findData(self._fit.current))
        self._changes.changed.emit()

    def show_newest(self) -> None:
        """The cameras' newest pictures while they are live."""
        if self.live and self._cameras is not None:
            for camera, view in enumerate(self._frame.views):
                name = self._fit.names[camera]
                if name in self._cameras.feed.cameras:
                    picture = self._cameras.feed.newest(name)
                    view.show_image(None if picture is None else picture.bgr,
                                    self._cameras.feed.problem(name) or tr("waiting for the first picture"), bgr=True)

    def frame_hand(self) -> None:
        """Zoom every picture to the hand."""
        for view in self._frame.views:
            view.frame_hand()

    def _add(self, images: dict[int, Image], pose: HandPose | None) -> None:
        if self._changes.edit(lambda: self._fit.add_pictures(images, pose)):
            self.show_list()
            if pose is not None:
                self.frame_hand()
            self._changes.tell(
                tr("Drag the wrist, the knuckles and the fingertips to their places, or press Find the hand.")
                    if pose is None
                    else tr("The hand begins where it is tracked. Drag joints, or fit to the contours."))
