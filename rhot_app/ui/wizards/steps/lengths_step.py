"""A second known length, so that a board whose squares were written down wrong is found out: baseline, or a ruler."""

from __future__ import annotations

import numpy as np

from rhot_app.calibration.stereo.calibrate import KnownLengths
from rhot_app.calibration.stereo.ruler import RulerReading
from rhot_app.ui.backend.feed import Picture
from rhot_app.ui.wizards.models.drawing import Dots, Line, Overlay
from rhot_app.ui.wizards.models.step import Pictures, Step, StepView

ENDS = 2
NEEDED = ("The scale comes from the board's squares alone; a second length finds a wrong number. Next waits for one, "
          "or for Skip below.")
SKIPPED = "The rig file will say that no length was checked, and so will the app."


class LengthsStep(Step):
    """One of them is needed, or a person who knows what it means to skip it. The ruler's ends are clicked in pictures
    that stand still; lengths in mm, 0 for none."""

    title = "A known length"
    watches = captures = True

    def __init__(self, cameras: tuple[str, ...]) -> None:
        self.cameras = cameras
        self._baseline_mm = 0.0
        self._ruler_mm = 0.0
        self._live: Pictures = {}
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

    def see(self, pictures: Pictures) -> Pictures:
        """Nothing to look for: a person marks the ends."""
        return pictures

    def take(self, seen: Pictures) -> None:
        """The pictures that Space would hold."""
        self._live = seen

    def capture(self) -> bool:
        """Hold the pictures, to click in them; again lets them go."""
        if self._ruler_mm <= 0.0:
            return False
        self.frozen = {} if self.frozen else dict(self._live)
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
            self.frozen = {}
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
        hint = "" if known else SKIPPED if self.skipped else NEEDED
        return StepView(self._sentence(known), done=known, hint=hint, overlays=overlays, pictures=self.frozen,
                        passable=self.skipped and not self.frozen, kept=int(bool(self.frozen)))

    def _sentence(self, known: bool) -> str:
        if self.frozen and self._known.ruler is None:
            return "Click both ends of the ruler in each picture, in the same order."
        if self._ruler_mm > 0.0 and self._known.ruler is None:
            return "Hold the ruler where both cameras see it, and press Space."
        if known:
            return "The scale will be checked: press Next."
        return "Lengths stay unproven: press Next." if self.skipped else "Measure a second length."

    def _overlay(self, name: str) -> Overlay:
        ends = np.array(self._ends(name)).reshape(-1, 2)
        if not len(ends):
            return ()
        return (Line(ends, "caution"), Dots(ends, "caution", radius=6.0))
