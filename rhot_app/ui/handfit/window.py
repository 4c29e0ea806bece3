"""The window in which a hand is fitted to pictures: pictures beside each other, numbers beside them, undo, save."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from PySide6.QtCore import Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QWidget

from rhot_app.hand.anatomy import HandAnatomy
from rhot_app.hand.skeleton import JOINTS
from rhot_app.handfit.quantities import PALM, Number
from rhot_app.handfit.session import HandFit
from rhot_app.ui.common.tool_window import ToolWindow
from rhot_app.ui.handfit.changes import Changes
from rhot_app.ui.handfit.frame import FitFrame, Kept
from rhot_app.ui.handfit.instants import TITLE, Instants, LiveCameras
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.wizards.framework.definition import SettingsStore

REASON: Final = "hand fitted to pictures"
"""In the history of a rig file."""

TICK_MS: Final = 50
_FREEDOM_KEY, _SD_KEY = "fit/freedom", "fit/anchor sd px"


class HandFitWindow(ToolWindow):
    """Shows one `HandFit`. `used` when the rig has the hand. `cameras`: None while none run."""

    losing = tr_noop("The hand was changed and not saved. Close without it?")
    used = Signal()

    def __init__(self, fit: HandFit, scheme: Scheme, memory: SettingsStore, kept: Kept, live: LiveCameras | None = None,
                 parent: QWidget | None = None) -> None:
        super().__init__(tr(TITLE), "fitting", parent)
        self.fit, self.cameras, self._memory = fit, live, memory
        self.frame = FitFrame(fit, scheme, kept, self, live=live is not None)
        self._changes = Changes(fit, kept, memory, self)
        self._instants = Instants(self._changes, self.frame, memory, live, self)
        self._connect_parts()
        self._remember_back()
        self._instants.show_list()
        if live is not None:
            live.feed.start()
        changes, instants = self._changes, self._instants
        self.start(TICK_MS, {
            "Ctrl+O": instants.choose_pictures, "Ctrl+S": changes.save, "Ctrl+Shift+Z": changes.redo,
            "Ctrl+Y": changes.redo, "Ctrl+Return": changes.fit_to_anchors,
            "Ctrl+Shift+Return": changes.fit_to_contours, "F": instants.frame_hand}, instants.take_pictures)

    # -- putting it together ---------------------------------------------------------------------------------------

    def _connect_parts(self) -> None:
        frame, changes, instants = self.frame, self._changes, self._instants
        changes.changed.connect(self.refresh)
        changes.stepped.connect(instants.show_list)
        changes.said.connect(self._show_sentence)
        changes.used.connect(self.used)
        for button, action in (
                (frame.take_button, instants.take_pictures), (frame.open_button, instants.choose_pictures),
                (frame.find_button, changes.find_hand), (frame.remove_button, instants.remove),
                (frame.undo_button, changes.undo), (frame.redo_button, changes.redo),
                (frame.anchors_button, changes.fit_to_anchors), (frame.contours_button, changes.fit_to_contours),
                (frame.free_button, changes.free_joints), (frame.reset_button, changes.reset),
                (frame.save_button, changes.save), (frame.use_button, changes.use), (frame.close_button, self.reject),
                (frame.cancel_button, changes.cancel)):
            button.clicked.connect(lambda checked=False, action=action: action())
        for camera, view in enumerate(frame.views):
            view.grabbed.connect(lambda joint, camera=camera: changes.edit(lambda: self.fit.grab(camera, joint)))
            view.dragged.connect(lambda x, y, last: changes.edit(lambda: self.fit.drag((x, y), last=last)))
            view.released.connect(self.fit.release)
            view.released.connect(self.refresh)
            view.removed.connect(lambda joint, camera=camera: changes.edit(
                lambda: self.fit.remove_anchor(camera, joint)))
            view.chosen.connect(self._choose_joint)
        frame.form.changed.connect(self._move_number)
        frame.form.group_box.currentIndexChanged.connect(lambda _: self.refresh())
        frame.instant_box.activated.connect(lambda _: instants.choose())
        frame.freedom_box.currentIndexChanged.connect(self._choose_freedom)
        frame.sd_box.valueChanged.connect(self._choose_sd)

    def _remember_back(self) -> None:
        place = self.frame.freedom_box.findData(self._memory.remembered(_FREEDOM_KEY))
        self.frame.freedom_box.setCurrentIndex(max(place, 0))
        try:
            self.frame.sd_box.setValue(float(self._memory.remembered(_SD_KEY)))
        except ValueError:
            self.frame.sd_box.setValue(self.fit.anchor_sd_px)

    # -- what others read ------------------------------------------------------------------------------------------

    @property
    def live(self) -> bool:
        """Whether the pictures are the cameras' newest, and no hand is fitted to them."""
        return self._instants.live

    @property
    def message(self) -> str:
        """What was said last; nothing while a sentence says what to do next."""
        return self._changes.message

    @property
    def named_hand(self) -> HandAnatomy:
        """The hand as it is kept."""
        return self._changes.named_hand

    def frame_hand(self) -> None:
        """Zoom every picture to the hand."""
        self._instants.frame_hand()

    # -- numbers and choices ---------------------------------------------------------------------------------------

    def _move_number(self, number: Number, value: float, goes_on: bool) -> None:
        self._changes.edit(lambda: self.fit.set_number(number, value, goes_on=goes_on))

    def _choose_joint(self, joint: int) -> None:
        """The numbers of the joint's finger, unless a group of the shape is shown."""
        for view in self.frame.views:
            view.choose(joint)
        if self.frame.form.group_box.currentIndex() <= len(JOINTS) // 4:
            self.frame.form.show_group(JOINTS[joint].split("_")[0].capitalize() if joint else PALM)

    def _choose_freedom(self) -> None:
        self.fit.freedom = self.frame.freedom_box.currentData()
        self._memory.remember(_FREEDOM_KEY, self.fit.freedom)

    def _choose_sd(self, value: float) -> None:
        self.fit.anchor_sd_px = value
        self._memory.remember(_SD_KEY, f"{value:g}")
        self.refresh()

    # -- showing ---------------------------------------------------------------------------------------------------

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
        self.frame.show_buttons(fit, fitted=fitted, anchored=bool(errors), idle=self._changes.idle)
        self.frame.cancel_button.setVisible(not self._changes.idle and not self._changes.storing)
        self._show_sentence()

    def _show_sentence(self) -> None:
        sentence = self._changes.message
        if not sentence and self.live:
            sentence = tr("Hold the hand still in all pictures, fingers spread, and press Take pictures.")
        elif not sentence and self.fit.instant is None:
            sentence = tr("Open a picture of each camera, taken at the same moment.")
        elif not sentence:
            sentence = tr("Drag joints in the pictures or move the numbers until the outline lies on the hand.")
        self.frame.sentence.setText(sentence)

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802
        """Pictures beside or above each other."""
        super().resizeEvent(event)
        self.frame.arrange(self.width(), self.height())

    # -- keys and the end ------------------------------------------------------------------------------------------

    def tick(self) -> None:
        """The newest pictures while the cameras are shown."""
        self._instants.show_newest()

    def undo(self) -> None:
        """Take the last change back."""
        self._changes.undo()

    @property
    def would_lose(self) -> bool:
        """Whether the hand was changed and not saved."""
        return self.fit.unsaved

    def stop(self) -> Callable[[], None] | None:
        """Fits under way, and the cameras' pictures."""
        self._changes.end()
        return None if self.cameras is None else self.cameras.stop


def _error_words(errors: list[float]) -> str:
    """The anchors' reprojection errors."""
    if not errors:
        return tr("no anchors")
    rms = (sum(error**2 for error in errors) / len(errors)) ** 0.5
    return tr("{n} anchor, {rms:.1f} px rms, {most:.1f} px most", "{n} anchors, {rms:.1f} px rms, {most:.1f} px most",
              len(errors), rms=rms, most=max(errors))
