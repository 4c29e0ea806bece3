"""What a person does to the fit: changes, steps back, long work in a worker, and where the hand is kept."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QWidget

from rhot_app.errors import CalibrationError
from rhot_app.hand.anatomy import HandAnatomy, save_hand
from rhot_app.handfit.session import HandFit
from rhot_app.handfit.state import FitState
from rhot_app.ui.common.job import Job, Progress
from rhot_app.ui.common.parts import ask_where_to_save
from rhot_app.ui.handfit.frame import Kept
from rhot_app.ui.language import tr
from rhot_app.ui.wizards.framework.definition import SettingsStore

FOLDER_KEY = "fit/folder"

LEAST_FOUND = 0.77
"""Part of a finger's contour that is found at least: 0.9 (`contour_residual.MISSED`) less two standard deviations of
twenty slices."""


class Changes(QObject):
    """Makes one change of `fit` at a time. `changed`: the fit, or what may be done to it, is another one; `stepped`:
    its instants may be others, too; `said`: there is another `message`, which is a problem if `bad`; `used`: the rig
    has the hand."""

    changed = Signal()
    stepped = Signal()
    said = Signal()
    used = Signal()

    def __init__(self, fit: HandFit, kept: Kept, memory: SettingsStore, window: QWidget) -> None:
        super().__init__(window)
        self.fit, self._kept, self._memory, self._window = fit, kept, memory, window
        self.message, self.bad = fit.warning, False
        self._job: Job | None = None
        self.storing = False  # the job writes the rig, which nothing takes back half way

    @property
    def idle(self) -> bool:
        """Whether nothing is being computed or kept."""
        return self._job is None

    def tell(self, sentence: str, *, bad: bool = False) -> None:
        """What was done, or why it could not be done."""
        self.message, self.bad = sentence, bad
        self.said.emit()

    # -- changes and steps back ------------------------------------------------------------------------------------

    def edit(self, change: Callable[[], None]) -> bool:
        """Make one change of the fit, or say why not; whether it was made."""
        if self._job is not None:
            return False
        try:
            change()
        except CalibrationError as exc:
            self.tell(str(exc), bad=True)
            return False
        if self.bad:
            self.tell("")
        self.changed.emit()
        return True

    def free_joints(self) -> None:
        """No anchors."""
        self.edit(self.fit.remove_anchors)

    def reset(self) -> None:
        """As in the beginning."""
        if self.edit(self.fit.reset):
            self.tell(tr("As in the beginning. Undo brings the fit back."))

    def undo(self) -> None:
        """One step back."""
        self._go(self.fit.undo, self.fit.undoable, tr("Undone"))

    def redo(self) -> None:
        """One step forward."""
        self._go(self.fit.redo, self.fit.redoable, tr("Done again"))

    def _go(self, go: Callable[[], None], what: str, word: str) -> None:
        if what and self._job is None:
            go()
            self.stepped.emit()
            self.tell(f"{word}: {what}.")

    # -- long work -------------------------------------------------------------------------------------------------

    def fit_to_anchors(self) -> None:
        """The most probable hand by all anchors, in a worker."""
        self._work(tr("Fitting to the anchors"), lambda progress: self.fit.fitted_to_anchors(),
                   tr("fitting to anchors"),
                   lambda: tr("Fitted to the anchors of this instant.") if self.fit.freedom == "pose"
                   else tr("Fitted to the anchors of all instants."))

    def fit_to_contours(self) -> None:
        """The hand by the edges in the pictures, in a worker."""
        def say() -> str:
            one = self.fit.instant
            found = one.contour.found if one is not None and one.contour is not None else 0.0
            return (tr("{found:.0%} of the hand's contour was found in the pictures.", found=found)
                    + ("" if found > LEAST_FOUND else tr(" Drag what is wrong to its place, then fit again.")))

        self._work(tr("Fitting to the contours"), lambda progress: self.fit.fitted_to_contours(),
                   tr("fitting to contours"), say)

    def find_hand(self) -> None:
        """Look for the hand, in a worker."""
        self._work(tr("Looking for the hand"), lambda progress: self.fit.with_found_hand(progress.report),
                   tr("finding the hand"),
                   lambda: tr("Look whether it is the hand; if not, undo and drag the joints instead."))

    def _work(self, text: str, op: Callable[[Progress], FitState], done: str, say: Callable[[], str]) -> None:
        """Compute another state in a worker, and take it."""
        if self._job is not None or self.fit.instant is None:
            return

        def take(state: FitState) -> None:
            self._job = None
            self.fit.take(state, done)
            self.changed.emit()
            self.tell(say())

        self._job = Job(op, take, self._failed, lambda what, part: self.tell(f"{text}: {part:.0%}"), self)
        self.tell(f"{text} …")
        self._job.start()
        self.changed.emit()

    def cancel(self) -> None:
        """Give up what is computed."""
        if self._job is not None and not self.storing:
            self._job.cancel()
            self._job = None
            self.tell(tr("Cancelled; nothing was changed."))
            self.changed.emit()

    def end(self) -> None:
        """The window closes: nobody waits for what is under way."""
        if self._job is not None:
            self._job.cancel()
            self._job = None

    def _failed(self, sentence: str) -> None:
        self._job, self.storing = None, False
        self.tell(sentence, bad=True)
        self.changed.emit()

    # -- keeping the hand ------------------------------------------------------------------------------------------

    @property
    def named_hand(self) -> HandAnatomy:
        """The hand as it is kept: its name says how it was made, unless pictures have changed none of its lengths."""
        name = self.fit.shapes.base.name
        if not self.fit.reshaped:
            return self.fit.shapes.base
        return self.fit.renamed(name if "fitted to pictures" in name else f"{name}, fitted to pictures".lstrip(", "))

    def save(self) -> None:
        """Write a hand file."""
        if self._job is not None:
            return
        out = self._kept.out
        if out is None:
            start = Path(self._memory.remembered(FOLDER_KEY) or str(Path.home())) / "hand.json"
            out = ask_where_to_save(self._window, tr("Save the hand"), start, tr("Hand files (*.json)"))
            if out is None:
                return
        try:
            save_hand(out, self.named_hand)
        except OSError as exc:
            self.tell(tr("{out}: cannot be written ({strerror}); nothing was saved.", out=out, strerror=exc.strerror),
                      bad=True)
            return
        self.fit.note_saved()
        self.tell(tr("Saved: {out}", out=out))
        self.changed.emit()

    def use(self) -> None:
        """Put the hand into the rig, in a worker."""
        use, hand = self._kept.use, self.named_hand
        if self._job is not None or use is None:
            return

        if hand == self.fit.rig.hand:
            self.tell(tr("The rig has this hand already: only the pose was fitted."))
            return

        def done(_: None) -> None:
            self._job, self.storing = None, False
            self.fit.note_saved()
            self.tell(tr("The rig has this hand now. Calibrate, Bring back an earlier calibration restores the old "
                         "one."))
            self.changed.emit()
            self.used.emit()

        self.storing = True
        self._job = Job(lambda progress: use(hand), done, self._failed, None, self).start()
        self.changed.emit()
