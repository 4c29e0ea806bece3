"""The window in which a hand is fitted to pictures: pictures beside each other, numbers beside them, undo, save."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from PySide6.QtCore import Qt, QTimer, Signal
from PySide6.QtGui import QCloseEvent, QKeySequence, QResizeEvent, QShortcut
from PySide6.QtWidgets import (
    QAbstractButton,
    QApplication,
    QComboBox,
    QDialog,
    QFileDialog,
    QInputDialog,
    QLineEdit,
    QMessageBox,
    QWidget,
)

from rhot_app.barehand.tracker import LEAST_SUPPORT
from rhot_app.errors import CalibrationError, RhotError
from rhot_app.hand.anatomy import HandAnatomy, save_hand
from rhot_app.hand.skeleton import JOINTS, HandPose
from rhot_app.handfit.quantities import Number
from rhot_app.handfit.session import HandFit
from rhot_app.handfit.state import FitState, Image
from rhot_app.ui.backend.feed import LiveFeed
from rhot_app.ui.common.guide import GuideViewer
from rhot_app.ui.common.job import Job, Progress
from rhot_app.ui.handfit.files import VIDEOS, in_order, is_video, read_instant
from rhot_app.ui.handfit.frame import FitFrame, Kept
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.wizards.framework.plan import Memory

TITLE: Final = "Fit the hand to pictures"
REASON: Final = "hand fitted to pictures"
"""In the history of a rig file."""

TICK_MS: Final = 50
_SIZE: Final = (1280, 800)
_FREEDOM_KEY, _FOLDER_KEY, _SD_KEY = "fit/freedom", "fit/folder", "fit/anchor sd px"
_PICTURES = (f"Pictures and videos (*.png *.jpg *.jpeg *.bmp *.tif *.tiff {' '.join(f'*{end}' for end in VIDEOS)});;"
             "All files (*)")
_LONGEST_S = 1e5  # of a video: a day
_KEEP = "The hand was changed and not saved. Close without it?"


@dataclass(frozen=True, slots=True)
class LiveCameras:
    """Where pictures come from while cameras run: their newest pictures, and the pose that is tracked now, None for
    none. `numbers`: the camera's number in the rig by its name in the feed. `stop` ends both, and may wait."""

    feed: LiveFeed
    pose: Callable[[], HandPose | None]
    numbers: dict[str, int]
    stop: Callable[[], None]


class HandFitWindow(QDialog):
    """Shows one `HandFit`. `used` when the rig has the hand."""

    used = Signal()

    def __init__(self, fit: HandFit, scheme: Scheme, memory: Memory, kept: Kept, live: LiveCameras | None = None,
                 parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.fit, self._live, self._kept, self._memory = fit, live, kept, memory
        self.setWindowTitle(TITLE)
        self.setProperty("guide", "fitting")
        self.setWindowFlag(Qt.WindowType.WindowMaximizeButtonHint)
        self.resize(*_SIZE)
        self._job: Job | None = None
        self._storing = False  # the job writes the rig, which nothing takes back half way
        self._guide: GuideViewer | None = None
        self.message = fit.warning
        self._bad, self._at_s = False, 0.0
        self.frame = FitFrame(fit, scheme, kept, self, live=live is not None)
        self._connect_parts()
        self._remember_back()
        self._show_instants()
        self.refresh()
        if live is not None:
            live.feed.start()
        self._timer = QTimer(self)
        self._timer.timeout.connect(self.tick)
        self._timer.start(TICK_MS)

    # -- putting it together ---------------------------------------------------------------------------------------

    def _connect_parts(self) -> None:
        frame = self.frame
        for button, action in (
                (frame.take_button, self.take_pictures), (frame.open_button, self.choose_pictures),
                (frame.find_button, self.find_hand), (frame.remove_button, self.remove_instant),
                (frame.undo_button, self.undo), (frame.redo_button, self.redo),
                (frame.anchors_button, self.fit_to_anchors), (frame.contours_button, self.fit_to_contours),
                (frame.free_button, self.free_joints), (frame.reset_button, self.reset),
                (frame.save_button, self.save), (frame.use_button, self.use), (frame.close_button, self.reject),
                (frame.cancel_button, self.cancel)):
            button.clicked.connect(lambda checked=False, action=action: action())
        for key, action in (("Space", self._press_space), ("Ctrl+O", self.choose_pictures), ("Ctrl+S", self.save),
                            ("Ctrl+Z", self._undo_key), ("Ctrl+Shift+Z", self.redo), ("Ctrl+Y", self.redo),
                            ("Ctrl+Return", self.fit_to_anchors), ("Ctrl+Shift+Return", self.fit_to_contours),
                            ("F", self.frame_hand), ("F1", self.open_guide)):
            QShortcut(QKeySequence(key), self).activated.connect(action)
        for camera, view in enumerate(frame.views):
            view.grabbed.connect(lambda joint, camera=camera: self._edit(lambda: self.fit.grab(camera, joint)))
            view.dragged.connect(lambda x, y, last: self._edit(lambda: self.fit.drag((x, y), last=last)))
            view.released.connect(self.fit.release)
            view.released.connect(self.refresh)
            view.removed.connect(lambda joint, camera=camera: self._edit(
                lambda: self.fit.remove_anchor(camera, joint)))
            view.chosen.connect(self._choose_joint)
        frame.form.changed.connect(self._move_number)
        frame.form.group_box.currentIndexChanged.connect(lambda _: self.refresh())
        frame.instant_box.activated.connect(self._choose_instant)
        frame.freedom_box.currentIndexChanged.connect(self._choose_freedom)
        frame.sd_box.valueChanged.connect(self._choose_sd)

    def _remember_back(self) -> None:
        place = self.frame.freedom_box.findData(self._memory.remembered(_FREEDOM_KEY))
        self.frame.freedom_box.setCurrentIndex(max(place, 0))
        try:
            self.frame.sd_box.setValue(float(self._memory.remembered(_SD_KEY)))
        except ValueError:
            self.frame.sd_box.setValue(self.fit.anchor_sd_px)

    # -- pictures --------------------------------------------------------------------------------------------------

    @property
    def live(self) -> bool:
        """Whether the pictures are the cameras' newest, and no hand is fitted to them."""
        return self._live is not None and self.frame.instant_box.currentData() is None

    def take_pictures(self) -> None:
        """The newest pictures of all cameras become an instant."""
        if self._live is None or self._job is not None:
            return
        feed, numbers = self._live.feed, self._live.numbers
        together = feed.together(feed.cameras)
        pose = self._live.pose()
        self._add({numbers[name]: picture.bgr[:, :, ::-1].copy() for name, picture in together.items()}, pose)

    def choose_pictures(self) -> None:
        """Ask for the picture files of one instant."""
        if self._job is not None:
            return
        names, _ = QFileDialog.getOpenFileNames(self, "Pictures of one instant, one for each camera",
                                                self._memory.remembered(_FOLDER_KEY) or str(Path.home()), _PICTURES)
        if names:
            self._memory.remember(_FOLDER_KEY, str(Path(names[0]).parent))
            self.open_pictures(in_order(self.fit.rig, names))

    def open_pictures(self, given: list[str]) -> None:
        """Files of pictures or videos, as `files.read_instant` takes them, become an instant."""
        at_s, wanted = 0.0, True
        if any(is_video(Path(name)) for name in given):
            at_s, wanted = QInputDialog.getDouble(self, TITLE, "Which second of the videos?", self._at_s, 0.0,
                                                  _LONGEST_S, 2)
        if wanted:
            self._at_s = at_s
            try:
                self._add(read_instant(self.fit.rig, given, at_s), None)
            except RhotError as exc:
                self.tell(str(exc), bad=True)

    def _add(self, images: dict[int, Image], pose: HandPose | None) -> None:
        if self._edit(lambda: self.fit.add_pictures(images, pose)):
            self._show_instants()
            if pose is not None:
                self.frame_hand()
            self.tell("Drag the wrist, the knuckles and the fingertips to their places, or press Find the hand."
                      if pose is None else "The hand begins where it is tracked. Drag joints, or fit to the contours.")

    def frame_hand(self) -> None:
        """Zoom every picture to the hand."""
        for view in self.frame.views:
            view.frame_hand()

    def remove_instant(self) -> None:
        """Without the instant shown."""
        if self._edit(self.fit.remove_instant):
            self._show_instants()

    def _choose_instant(self) -> None:
        number = self.frame.instant_box.currentData()
        if number is not None:
            self.fit.current = number
        self.refresh()

    def _show_instants(self) -> None:
        """The list of instants; the one in work is chosen."""
        self.frame.instant_box.clear()
        if self._live is not None:
            self.frame.instant_box.addItem("Live pictures", None)
        for number, one in enumerate(self.fit.state.instants):
            self.frame.instant_box.addItem(one.name, number)
        if self.fit.instant is not None:
            self.frame.instant_box.setCurrentIndex(self.frame.instant_box.findData(self.fit.current))
        self.refresh()

    # -- changes ---------------------------------------------------------------------------------------------------

    def _edit(self, change: Callable[[], None]) -> bool:
        """Make one change of the fit, or say why not; whether it was made."""
        if self._job is not None:
            return False
        try:
            change()
        except CalibrationError as exc:
            self.tell(str(exc), bad=True)
            return False
        if self._bad:
            self.tell("")
        self.refresh()
        return True

    def _move_number(self, number: Number, value: float, goes_on: bool) -> None:
        self._edit(lambda: self.fit.set_number(number, value, goes_on=goes_on))

    def _choose_joint(self, joint: int) -> None:
        """The numbers of the joint's finger, unless a group of the shape is shown."""
        for view in self.frame.views:
            view.choose(joint)
        if self.frame.form.group_box.currentIndex() <= len(JOINTS) // 4:
            self.frame.form.show_group(JOINTS[joint].split("_")[0].capitalize() if joint else "Palm")

    def _choose_freedom(self) -> None:
        self.fit.freedom = self.frame.freedom_box.currentData()
        self._memory.remember(_FREEDOM_KEY, self.fit.freedom)

    def _choose_sd(self, value: float) -> None:
        self.fit.anchor_sd_px = value
        self._memory.remember(_SD_KEY, f"{value:g}")
        self.refresh()

    def fit_to_anchors(self) -> None:
        """The most probable hand by all anchors, in a worker."""
        self._work("Fitting to the anchors", lambda progress: self.fit.fitted_to_anchors(), "fitting to anchors",
                   lambda: "Fitted to the anchors of this instant." if self.fit.freedom == "pose" else
                   "Fitted to the anchors of all instants.")

    def fit_to_contours(self) -> None:
        """The hand by the edges in the pictures, in a worker."""
        def say() -> str:
            one = self.fit.instant
            found = one.contour.found if one is not None and one.contour is not None else 0.0
            return (f"{found:.0%} of the hand's contour was found in the pictures."
                    + ("" if found > LEAST_SUPPORT else " Drag what is wrong to its place, then fit again."))

        self._work("Fitting to the contours", lambda progress: self.fit.fitted_to_contours(), "fitting to contours",
                   say)

    def find_hand(self) -> None:
        """Look for the hand, in a worker."""
        self._work("Looking for the hand", lambda progress: self.fit.with_found_hand(progress.report),
                   "finding the hand", lambda: "Look whether it is the hand; if not, undo and drag the joints instead.")

    def free_joints(self) -> None:
        """No anchors."""
        self._edit(self.fit.remove_anchors)

    def reset(self) -> None:
        """As in the beginning."""
        if self._edit(self.fit.reset):
            self.tell("As in the beginning. Undo brings the fit back.")

    def undo(self) -> None:
        """One step back."""
        self._go(self.fit.undo, self.fit.undoable, "Undone")

    def redo(self) -> None:
        """One step forward."""
        self._go(self.fit.redo, self.fit.redoable, "Done again")

    def _go(self, go: Callable[[], None], what: str, word: str) -> None:
        if what and self._job is None:
            go()
            self._show_instants()
            self.tell(f"{word}: {what}.")

    # -- long work -------------------------------------------------------------------------------------------------

    def _work(self, text: str, op: Callable[[Progress], FitState], done: str, say: Callable[[], str]) -> None:
        """Compute another state in a worker, and take it."""
        if self._job is not None or self.fit.instant is None:
            return

        def take(state: FitState) -> None:
            self._job = None
            self.fit.take(state, done)
            self.refresh()
            self.tell(say())

        self._job = Job(op, take, self._failed, lambda what, part: self.tell(f"{text}: {part:.0%}"), self)
        self.tell(f"{text} …")
        self._job.start()
        self.refresh()

    def cancel(self) -> None:
        """Give up what is computed."""
        if self._job is not None and not self._storing:
            self._job.cancel()
            self._job = None
            self.tell("Cancelled; nothing was changed.")
            self.refresh()

    def _failed(self, sentence: str) -> None:
        self._job, self._storing = None, False
        self.tell(sentence, bad=True)
        self.refresh()

    # -- keeping the hand ------------------------------------------------------------------------------------------

    @property
    def named_hand(self) -> HandAnatomy:
        """The hand as it is kept: its name says how it was made."""
        name = self.fit.shapes.base.name
        return self.fit.renamed(name if "fitted to pictures" in name else f"{name}, fitted to pictures".lstrip(", "))

    def save(self) -> None:
        """Write a hand file."""
        if self._job is not None:
            return
        out = self._kept.out
        if out is None:
            start = str(Path(self._memory.remembered(_FOLDER_KEY) or str(Path.home())) / "hand.json")
            name, _ = QFileDialog.getSaveFileName(self, "Save the hand", start, "Hand files (*.json)")
            if not name:
                return
            out = Path(name)
        try:
            save_hand(out, self.named_hand)
        except OSError as exc:
            self.tell(f"{out}: cannot be written ({exc.strerror}); nothing was saved.", bad=True)
            return
        self.fit.note_saved()
        self.tell(f"Saved: {out}")
        self.refresh()

    def use(self) -> None:
        """Put the hand into the rig, in a worker."""
        use, hand = self._kept.use, self.named_hand
        if self._job is not None or use is None:
            return

        def done(_: None) -> None:
            self._job, self._storing = None, False
            self.fit.note_saved()
            self.tell("The rig has this hand now. Calibrate, Bring back an earlier calibration restores the old one.")
            self.refresh()
            self.used.emit()

        self._storing = True
        self._job = Job(lambda progress: use(hand), done, self._failed, None, self).start()
        self.refresh()

    # -- showing ---------------------------------------------------------------------------------------------------

    def tell(self, sentence: str, *, bad: bool = False) -> None:
        """What was done, or why it could not be done."""
        self.message, self._bad = sentence, bad
        self._show_sentence()

    def tick(self) -> None:
        """Newest pictures while they are live."""
        if self.live and self._live is not None:
            for camera, view in enumerate(self.frame.views):
                name = self.fit.names[camera]
                if name in self._live.feed.cameras:
                    picture = self._live.feed.newest(name)
                    view.show_image(None if picture is None else picture.bgr,
                                    self._live.feed.problem(name) or "waiting for the first picture", bgr=True)

    def refresh(self) -> None:
        """Show the fit as it is now."""
        fit, one = self.fit, self.fit.instant
        fitted = one is not None and not self.live
        errors = fit.errors_px() if fitted else {}
        for camera, view in enumerate(self.frame.views):
            view.usable = fitted and one is not None and camera in one.images
            if fitted and one is not None:
                view.show_image(one.images.get(camera))
                view.show_hand(fit.joints(camera), fit.outline(camera),
                               {a.joint: a.pixel for a in errors if a.camera == camera},
                               {a.joint: error for a, error in errors.items() if a.camera == camera})
            view.update()
        if one is not None:
            self.frame.form.fill(fit.value, fit.sd)
        self.frame.errors.setText(_error_words(list(errors.values())))
        self.frame.show_buttons(fit, fitted=fitted, anchored=bool(errors), idle=self._job is None)
        self.frame.cancel_button.setVisible(self._job is not None and not self._storing)
        self._show_sentence()

    def _show_sentence(self) -> None:
        sentence = self.message
        if not sentence and self.live:
            sentence = "Hold the hand still in all pictures, fingers spread, and press Take pictures."
        elif not sentence and self.fit.instant is None:
            sentence = "Open a picture of each camera, taken at the same moment."
        elif not sentence:
            sentence = "Drag joints in the pictures or move the numbers until the outline lies on the hand."
        self.frame.sentence.setText(sentence)

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802
        """Pictures beside or above each other."""
        super().resizeEvent(event)
        self.frame.arrange(self.width(), self.height())

    # -- keys and the end ------------------------------------------------------------------------------------------

    def _press_space(self) -> None:
        """Take pictures, unless the key means something where the focus is."""
        focus = QApplication.focusWidget()
        if isinstance(focus, QAbstractButton):
            focus.click()
        elif isinstance(focus, QComboBox):
            focus.showPopup()
        else:
            self.take_pictures()

    def _undo_key(self) -> None:
        focus = QApplication.focusWidget()
        if isinstance(focus, QLineEdit) and focus.isUndoAvailable():
            focus.undo()
        else:
            self.undo()

    def open_guide(self) -> None:
        """The page of the guide."""
        if self._guide is None:
            self._guide = GuideViewer(self)
        self._guide.open_page("fitting")

    def reject(self) -> None:
        """Escape and Close: ask only when something would be lost."""
        if self.fit.unsaved and not self._may_lose():
            return
        self.end()
        super().reject()

    def closeEvent(self, event: QCloseEvent) -> None:  # noqa: N802
        """The window's own close button is Escape."""
        event.ignore()
        self.reject()

    def _may_lose(self) -> bool:
        answer = QMessageBox.question(self, TITLE, _KEEP,
                                      QMessageBox.StandardButton.Discard | QMessageBox.StandardButton.Cancel,
                                      QMessageBox.StandardButton.Cancel)
        return answer == QMessageBox.StandardButton.Discard

    def end(self) -> Job:
        """Stop what runs, in a worker, because a question to a node may be under way."""
        self._timer.stop()
        if self._job is not None:
            self._job.cancel()
            self._job = None
        live = self._live

        def stop() -> None:
            if live is not None:
                live.stop()

        return Job(lambda progress: stop(), lambda _: None, lambda sentence: None).start()


def _error_words(errors: list[float]) -> str:
    """The anchors' reprojection errors."""
    if not errors:
        return "no anchors"
    rms = (sum(error**2 for error in errors) / len(errors)) ** 0.5
    return f"{len(errors)} anchor{'' if len(errors) == 1 else 's'}, {rms:.1f} px rms, {max(errors):.1f} px most"
