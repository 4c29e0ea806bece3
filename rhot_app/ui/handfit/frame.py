"""Where everything stands in the window that fits a hand. No behaviour."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from PySide6.QtWidgets import (
    QBoxLayout,
    QComboBox,
    QDoubleSpinBox,
    QHBoxLayout,
    QLabel,
    QVBoxLayout,
    QWidget,
)

from rhot_app.hand.anatomy import HandAnatomy
from rhot_app.handfit.session import HandFit
from rhot_app.handfit.solve import Freedom
from rhot_app.ui.common.parts import plain_button
from rhot_app.ui.common.sentence import Sentence
from rhot_app.ui.handfit.number_form import NumberForm
from rhot_app.ui.handfit.picture import FitPicture
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.models.palette import Scheme

_RIGHT_PX, _OTHERS_PX = 368, 150  # of the numbers at the right; of the rows above and below the pictures
_UPRIGHT = 0.85  # chosen: a hand is higher than wide, and a view beside another one is higher, which zooming uses
_FREEDOMS: Final[tuple[tuple[Freedom, str], ...]] = (
    ("pose", tr_noop("the pose alone")), ("lengths", tr_noop("pose and lengths")),
    ("roots", tr_noop("pose, lengths and finger roots")))


@dataclass(frozen=True, slots=True)
class Kept:
    """Where a hand may go: `use` puts it into the rig, in a worker, and raises RhotError; None: there is no rig to
    change. `out`: the hand file to write, None: it is asked for."""

    use: Callable[[HandAnatomy], None] | None = None
    out: Path | None = None


class FitFrame:
    """The widgets, laid out in `parent`; `live`: cameras give pictures."""

    def __init__(self, fit: HandFit, scheme: Scheme, kept: Kept, parent: QWidget, *, live: bool) -> None:
        self.views = [FitPicture(name, (camera.width, camera.height), scheme)
                      for name, camera in zip(fit.names, fit.cameras, strict=True)]
        self.form = NumberForm(fit.numbers)
        self.take_button = plain_button(tr("Take pictures"), tr("The pictures of all cameras now, as one more instant "
                                                                "(Space). Hold the hand still."))
        self.open_button = plain_button(tr("Open pictures …"), tr("Picture or video files of one instant, one for each "
                                                                  "camera. They are told apart by the cameras' names "
                                                                  "in theirs, or sorted (Ctrl+O)."))
        self.find_button = plain_button(tr("Find the hand"), tr("Look for the hand by the landmark networks (rhot "
                                                                "landmarks install), and put all its joints there."))
        self.instant_box = QComboBox()
        self.instant_box.setToolTip(tr("Which pictures are shown. All instants share the lengths; each has its own "
                                       "pose."))
        self.instant_box.setAccessibleName(tr("Instant"))
        self.remove_button = plain_button(tr("Remove"), tr("Remove the instant shown; undo brings it back."))
        self.undo_button, self.redo_button = plain_button(tr("Undo"), ""), plain_button(tr("Redo"), "")
        self.freedom_box = QComboBox()
        self.freedom_box.setAccessibleName(tr("What a drag or a fit may change"))
        self.freedom_box.setToolTip(tr("What a drag or a fit may change. Begin with the pose; free lengths when the "
                                       "anchors or contours of two cameras or two instants show them."))
        for freedom, words in _FREEDOMS:
            self.freedom_box.addItem(tr(words), freedom)
        self.sd_box = QDoubleSpinBox()
        self.sd_box.setRange(0.1, 50.0)
        self.sd_box.setDecimals(1)
        self.sd_box.setSingleStep(0.5)
        self.sd_box.setSuffix(" px")
        self.sd_box.setKeyboardTracking(False)
        self.sd_box.setAccessibleName(tr("Standard deviation of an anchor"))
        self.sd_box.setToolTip(tr("How exactly you can point at a joint in these pictures. The standard deviations and "
                                  "Fit to anchors go by it; a drag meets the pointer whatever it is."))
        self.anchors_button = plain_button(tr("Fit to anchors"), tr("The most probable hand by all anchors at once "
                                                                    "(Ctrl+Return)."))
        self.contours_button = plain_button(tr("Fit to contours"), tr("Search the edges of the hand in the pictures, "
                                                                      "from where it is now, and fit it to them "
                                                                      "(Ctrl+Shift+Return)."))
        self.free_button = plain_button(tr("Free all joints"), tr("Remove all anchors of this instant."))
        self.reset_button = plain_button(tr("Reset"), tr("Back to the hand and the poses of the beginning; undo brings "
                                                         "everything back."))
        self.save_button = plain_button(tr("Save hand file …"), tr("Write the hand as a hand file (Ctrl+S)."))
        self.use_button = plain_button(tr("Use this hand"), tr("Put the hand into the rig. The rig file keeps what it "
                                                               "had; Calibrate, Bring back an earlier calibration "
                                                               "restores it."))
        self.close_button = plain_button(tr("Close"), tr("Escape."))
        self.cancel_button = plain_button(tr("Cancel"), tr("Give the search up."))
        self.errors = QLabel()
        self.sentence = Sentence(2)
        self.take_button.setVisible(live)
        self.use_button.setVisible(kept.use is not None)
        if kept.out is not None:
            self.save_button.setText(tr("Save hand file"))
            self.save_button.setToolTip(tr("Write the hand to {out} (Ctrl+S).", out=kept.out))
        self._lay_out(parent)

    def _lay_out(self, parent: QWidget) -> None:
        top, middle, below, side = QHBoxLayout(), QHBoxLayout(), QHBoxLayout(), QVBoxLayout()
        for part in (self.take_button, self.open_button, self.find_button, self.instant_box, self.remove_button):
            top.addWidget(part)
        top.addStretch(1)
        for part in (self.undo_button, self.redo_button):
            top.addWidget(part)
        self._wall = QBoxLayout(QBoxLayout.Direction.LeftToRight)
        self._wall.setSpacing(8)
        for view in self.views:
            self._wall.addWidget(view, 1)
        side.setSpacing(8)
        side.addWidget(self.form, 1)
        freedom, spread, fits, frees = QHBoxLayout(), QHBoxLayout(), QVBoxLayout(), QHBoxLayout()
        freedom.addWidget(QLabel(tr("Change")))
        freedom.addWidget(self.freedom_box, 1)
        spread.addWidget(QLabel(tr("Anchors ±")))
        spread.addWidget(self.sd_box, 1)
        for part in (self.anchors_button, self.contours_button):  # German has no room for both beside each other
            fits.addWidget(part)
        for part in (self.free_button, self.reset_button):
            frees.addWidget(part, 1)
        side.addLayout(freedom)
        side.addLayout(spread)
        side.addWidget(self.errors)
        side.addLayout(fits)
        side.addLayout(frees)
        right = QWidget()
        right.setFixedWidth(_RIGHT_PX)
        right.setLayout(side)
        side.setContentsMargins(0, 0, 0, 0)
        middle.setSpacing(16)
        middle.addLayout(self._wall, 1)
        middle.addWidget(right)
        below.addWidget(self.sentence, 1)
        for part in (self.cancel_button, self.save_button, self.use_button, self.close_button):
            below.addWidget(part)
        layout = QVBoxLayout(parent)
        layout.setContentsMargins(16, 16, 16, 16)
        layout.setSpacing(8)
        layout.addLayout(top)
        layout.addLayout(middle, 1)
        layout.addLayout(below)

    def arrange(self, width: int, height: int) -> None:
        """Pictures beside or above each other, whichever makes the hand larger in a window of this size px."""
        count = len(self.views)
        width, height = width - _RIGHT_PX - 48, height - _OTHERS_PX
        beside = min(width / count, 4 / 3 * height)
        stacked = min(float(width), 4 / 3 * height / count)
        self._wall.setDirection(QBoxLayout.Direction.LeftToRight if beside >= _UPRIGHT * stacked
                                else QBoxLayout.Direction.TopToBottom)

    def show_buttons(self, fit: HandFit, *, fitted: bool, anchored: bool, idle: bool) -> None:
        """Which buttons may be pressed."""
        for button, on in (
                (self.take_button, True), (self.open_button, True), (self.find_button, fitted),
                (self.remove_button, fitted), (self.undo_button, bool(fit.undoable)),
                (self.redo_button, bool(fit.redoable)), (self.contours_button, fitted),
                (self.anchors_button, anchored), (self.free_button, anchored), (self.reset_button, fitted),
                (self.save_button, fitted), (self.use_button, fitted)):
            button.setEnabled(on and idle)
        self.instant_box.setEnabled(idle and self.instant_box.count() > 0)
        self.form.setEnabled(fitted and idle)
        self.cancel_button.setVisible(not idle)
        back, forward = fit.undoable, fit.redoable
        back = tr("Takes back: {change}.", change=tr(back)) if back else tr("Nothing to undo.")
        forward = tr("Brings back: {change}.", change=tr(forward)) if forward else tr("Nothing to redo.")
        self.undo_button.setToolTip(f"Ctrl+Z. {back}")
        self.redo_button.setToolTip(f"Ctrl+Shift+Z. {forward}")
