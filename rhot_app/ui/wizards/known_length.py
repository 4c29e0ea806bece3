"""A second known length, so that a board whose squares were written down wrong is found out: baseline, or a ruler."""

from __future__ import annotations

import numpy as np
from PySide6.QtWidgets import QDoubleSpinBox, QFormLayout

from rhot_app.calibration.stereo.calibrate import KnownLengths
from rhot_app.calibration.stereo.ruler import RulerReading
from rhot_app.simulator.scene.scene_description import RulerShow
from rhot_app.ui.backend.feed import Picture
from rhot_app.ui.common.parts import plain_button
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.wizards.framework.drawing import Dots, Line, Overlay
from rhot_app.ui.wizards.framework.page import Page
from rhot_app.ui.wizards.framework.step import Pictures, Step, StepView

ENDS = 2
NEEDED = (tr_noop("The scale comes from the board's squares alone; a second length finds a wrong number. Next waits "
                  "for one, or for Skip below."))
SKIPPED = tr_noop("The rig file will say that no length was checked, and so will the app.")


class LengthsStep(Step):
    """One of them is needed, or a person who knows what it means to skip it. The ruler's ends are clicked in pictures
    that stand still; lengths in mm, 0 for none."""

    title = tr_noop("A known length")
    watches = captures = True

    def __init__(self, cameras: tuple[str, ...]) -> None:
        self.cameras = cameras
        self._baseline_mm = 0.0
        self._ruler_mm = 0.0
        self._live: Pictures = {}
        self._holding = False  # also before the first pictures came, which are held then
        self.frozen: dict[str, Picture] = {}
        self._clicks: list[tuple[str, float, float]] = []
        self._known = KnownLengths()
        self.skipped = False

    @property
    def known(self) -> KnownLengths:
        """What is known so far."""
        return self._known

    def set_lengths(self, baseline_mm: float, ruler_mm: float) -> None:
        """What the person measured."""
        if (baseline_mm, ruler_mm) != (self._baseline_mm, self._ruler_mm):
            self._baseline_mm, self._ruler_mm = baseline_mm, ruler_mm
            self._renew()

    def skip(self, on: bool) -> None:
        """The person leaves the lengths unproven, or not after all."""
        self.skipped = on

    def observe(self, pictures: Pictures) -> Pictures:
        """Nothing to look for: a person marks the ends."""
        return pictures

    def accept_observation(self, seen: Pictures) -> None:
        """The pictures that Space would hold."""
        self._live = seen
        if self._holding and not self.frozen:
            self.frozen = dict(seen)

    def capture(self) -> bool:
        """Hold the pictures, to click in them; again lets them go."""
        if self._ruler_mm <= 0.0:
            return False
        self._holding = not self._holding
        self.frozen = dict(self._live) if self._holding else {}
        self._clicks = []
        self._renew()
        return bool(self.frozen)

    def pick(self, camera: str, x: float, y: float) -> None:
        """One end in one picture, px."""
        if camera in self.frozen and len(self._ends(camera)) < ENDS:
            self._clicks.append((camera, x, y))
            self._renew()

    def undo(self) -> bool:
        """The last end, or the held pictures."""
        if self._clicks:
            self._clicks.pop()
        elif self.frozen:
            self.frozen, self._holding = {}, False
        else:
            return False
        self._renew()
        return True

    def _ends(self, camera: str) -> list[tuple[float, float]]:
        return [(x, y) for name, x, y in self._clicks if name == camera]

    def _renew(self) -> None:
        names = self.cameras or ()
        ends = np.full((len(names), ENDS, 2), np.nan)
        for camera, name in enumerate(names):
            for end, at in enumerate(self._ends(name)):
                ends[camera, end] = at
        whole = int(np.isfinite(ends).all(axis=(1, 2)).sum())
        ruler = RulerReading(1e-3 * self._ruler_mm, ends) if self._ruler_mm > 0.0 and whole >= 2 else None
        self._known = KnownLengths(1e-3 * self._baseline_mm if self._baseline_mm > 0.0 else None, ruler)

    def view(self) -> StepView:
        """What to do for the ruler, if there is one."""
        overlays = {name: self._overlay(name) for name in self.cameras or ()}
        known = self._known.ruler is not None or self._known.baseline_m is not None
        hint = "" if known else tr(SKIPPED) if self.skipped else tr(NEEDED)
        return StepView(self._sentence(known), done=known, hint=hint, overlays=overlays, pictures=self.frozen,
                        passable=self.skipped and not self.frozen, kept=int(bool(self.frozen)))

    def _sentence(self, known: bool) -> str:
        if self.frozen and self._known.ruler is None:
            return tr("Click both ends of the ruler in each picture, in the same order.")
        if self._ruler_mm > 0.0 and self._known.ruler is None:
            return tr("Hold the ruler where both cameras see it, and press Space.")
        if known:
            return tr("The scale will be checked: press Next.")
        return tr("Lengths stay unproven: press Next.") if self.skipped else tr("Measure a second length.")

    def _overlay(self, name: str) -> Overlay:
        ends = np.array(self._ends(name)).reshape(-1, 2)
        if not len(ends):
            return ()
        return (Line(ends, "caution"), Dots(ends, "caution", radius=6.0))


# -- its page: two fields, and clicks on the ruler's ends --------------------------------------------------------------

SKIP = tr_noop("Skip: lengths stay unproven")


class LengthsPage(Page):
    """Two lengths in mm; 0 says that it was not measured. With neither, a person must say so."""

    def __init__(self, step: LengthsStep) -> None:
        super().__init__(step)
        self._known = step
        self.pickable = True
        self.twin_facts = tr("Shows a ruler: its crosses are {length_mm:g} mm apart.", length_mm=RulerShow().length_mm)
        self.baseline = _length(tr("The distance between the middles of the two lenses, measured by hand. 75 mm on the "
                                   "frame that the thesis describes."))
        self.ruler = _length(tr("The distance between two marks on a ruler, 200 mm for instance, that both cameras "
                                "see."))
        form = QFormLayout()
        form.setSpacing(8)
        form.addRow(tr("Lens to lens"), self.baseline)
        form.addRow(tr("Ruler"), self.ruler)
        self.hold = plain_button(tr("Hold the pictures"), tr("Space. Then click both ends of the ruler in each "
                                                             "picture."), self._hold)
        self.column.addLayout(form)
        self.skip = plain_button(tr(SKIP), tr("If the size of the squares was typed wrong, every length is wrong by "
                                              "the same factor and nothing will tell."), self._skip)
        self.column.addWidget(self.hold)
        self.column.addWidget(self.skip)
        self.column.addStretch(1)
        for box in (self.baseline, self.ruler):
            box.valueChanged.connect(self._take)

    def _take(self) -> None:
        self._known.set_lengths(self.baseline.value(), self.ruler.value())
        self.changed.emit()

    def _skip(self) -> None:
        self._known.skip(not self._known.skipped)
        self.changed.emit()

    def _hold(self) -> None:
        self._known.capture()
        self.changed.emit()

    def pick(self, picture: Picture, x: float, y: float, width: float, height: float) -> None:
        """An end of the ruler; a drag is a click that slipped."""
        self._known.pick(picture.camera, x, y)

    def show_view(self, view: StepView) -> None:
        """The button says what it would do; there is nothing to skip once a length is known."""
        self.skip.setEnabled(not view.done)
        self.skip.setText(tr("Do not skip") if self._known.skipped and not view.done else tr(SKIP))
        self.hold.setEnabled(self.ruler.value() > 0.0)
        self.hold.setText(tr("Let the pictures go on") if view.pictures else tr("Hold the pictures"))


def _length(meaning: str) -> QDoubleSpinBox:
    box = QDoubleSpinBox()
    box.setRange(0.0, 5000.0)
    box.setDecimals(1)
    box.setSuffix(" mm")
    box.setSpecialValueText(tr("not measured"))
    box.setToolTip(meaning)
    return box
