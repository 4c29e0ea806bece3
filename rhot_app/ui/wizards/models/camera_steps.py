"""The step in which cameras are set: what is told to whom, what the pictures say to it, what is burnt out or black."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.check.camera_advice import CameraAdvice, CameraAdvisor
from rhot_app.calibration.check.exposure import BRIGHT, DARK
from rhot_app.calibration.verdict import Finding, Grade, Verdict, judge
from rhot_app.errors import CalibrationError
from rhot_app.ui.wizards.feed import Picture
from rhot_app.ui.wizards.models.camera_settings import CONTROLS, CameraChoices
from rhot_app.ui.wizards.models.drawing import Layer, Line, Overlay
from rhot_app.ui.wizards.models.proposal import NodeChange, Proposal
from rhot_app.ui.wizards.models.step import Pictures, Step, StepView
from rhot_node.config import CameraSettings
from rhot_node.detect.colour import Box
from rhot_node.detect.fast import FastDetector
from rhot_node.detect.image import YuvImage, from_bgr
from rhot_node.markers import MarkerSet

REASON = "camera settings"
_BURNT, _BLACK = (255, 60, 60), (70, 120, 255)
_STRIPE_PX = 4
SETTLE_NS = 400_000_000
"""From a node's answer until a picture shows what it was told: a few frames, and the picture's own way."""

_GREY_PX = 24  # a click on grey paper is a box of this side


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """What one picture says: the advice, the `problem` of a grey patch that is none, and what to draw."""

    received_ns: int
    advice: CameraAdvice
    overlay: Overlay
    problem: str = ""


class CameraEye:
    """Looks at the pictures of one camera; used by the looker's thread only."""

    def __init__(self, markers: MarkerSet) -> None:
        self._markers = markers
        self._detector = FastDetector(markers)
        self._advisor = CameraAdvisor()
        self._settings: CameraSettings | None = None

    def look(self, picture: Picture, settings: CameraSettings, grey: Box | None) -> Look:
        """The advice on a picture that was taken with `settings`."""
        if settings != self._settings:
            self._advisor.restart()
            self._settings = settings
        image = from_bgr(picture.bgr)
        seen = self._detector.detect(image)
        masks = {self._markers.ids[mark.index]: self._detector.paint_mask(image, mark)
                 for mark in seen[:len(self._markers.ids)] if mark.found}
        t_s = 1e-9 * picture.t_node_ns
        problem = ""
        try:
            advice = self._advisor.update(image, t_s, settings, masks, grey)
        except CalibrationError as exc:
            advice, problem = self._advisor.update(image, t_s, settings, masks), str(exc)
        return Look(picture.received_ns, advice, _overlay(image, grey), problem)


class SettingsStep(Step):
    """Knobs, live pictures, advice. Nothing is saved; the last step does that."""

    title = "Settings"
    watches = True

    def __init__(self, choices: CameraChoices, markers: MarkerSet) -> None:
        self.choices = choices
        self.cameras = tuple(node.name for node in choices.nodes)
        self._eyes = {node.name: CameraEye(markers) for node in choices.nodes}
        self._ids = {node.name: node.node_id for node in choices.nodes}
        self._told = dict(choices.before)
        self._grey: dict[str, Box] = {}
        self._looks: dict[str, Look] = {}
        self._settled_ns: int | None = 0
        self._problem = ""

    def untold(self) -> list[int]:
        """Nodes that go by other settings than were chosen; they are taken as told from now on."""
        found = [node_id for node_id, settings in self.choices.now.items() if self._told[node_id] != settings]
        self._told = dict(self.choices.now)
        if found:
            self._settled_ns = None
        return found

    def note_told(self, now_ns: int) -> None:
        """The nodes have heard it; pictures that show it come a moment later."""
        self._settled_ns = now_ns + SETTLE_NS

    def tell(self, node_id: int) -> dict[str, object]:
        """What to tell a node."""
        return self.choices.whole(node_id)

    def mark_grey(self, camera: str, box: Box | None) -> None:
        """Something grey in a picture, (x0, y0, x1, y1) px; None forgets it."""
        self._problem = ""
        if box is None:
            self._grey.pop(camera, None)
        elif camera in self._ids:
            x0, y0, x1, y1 = box
            half = _GREY_PX // 2 if min(x1 - x0, y1 - y0) < _GREY_PX else 0
            self._grey[camera] = (x0 - half, y0 - half, x1 + half, y1 + half)

    @property
    def balanceable(self) -> dict[str, tuple[float, float]]:
        """Red and blue gain to set next, by camera with a grey patch; 1 each where the camera chose them so far.

        Empty until pictures show what was set last: the same correction twice would be too much.
        """
        found = {}
        for name in self._grey:
            look = self._looks.get(name)
            fresh = look is not None and self._settled_ns is not None and look.received_ns > self._settled_ns
            white = look.advice.white if fresh and look is not None else None
            if white is not None and white.findings:
                found[name] = (white.red_gain or 1.0, white.blue_gain or 1.0)
        return found

    def balance(self) -> bool:
        """Set the gains that make the grey patches grey; whether there was anything to set."""
        red, blue = (next(control for control in CONTROLS if control.field == field)
                     for field in ("red_gain", "blue_gain"))
        found = self.balanceable
        for number, (name, gains) in enumerate(found.items()):
            for control, gain, goes_on in ((red, gains[0], number > 0), (blue, gains[1], True)):
                self.choices.change((self._ids[name],), control, gain, goes_on=goes_on)
        return bool(found)

    def undo(self) -> bool:
        """The last change back."""
        return self.choices.undo()

    @property
    def keeps(self) -> bool:
        """Whether anything was changed."""
        return bool(self.choices.changed)

    def see(self, pictures: Pictures) -> dict[str, Look]:
        """Advice on each picture."""
        now, grey = self._told, dict(self._grey)
        return {name: self._eyes[name].look(picture, now[self._ids[name]], grey.get(name))
                for name, picture in pictures.items() if name in self._eyes}

    def take(self, seen: dict[str, Look]) -> None:
        """The newest advice."""
        self._looks = {**self._looks, **seen}
        for name, look in seen.items():
            if look.problem and name in self._grey:
                self.mark_grey(name, None)
                self._problem = f"{name}: {look.problem}"

    @property
    def verdict(self) -> Verdict | None:
        """On all cameras together; None before the first pictures."""
        advice = {name: look.advice for name, look in self._looks.items()}
        if not advice:
            return None
        summary = "; ".join(f"{name} {one.exposure.picture.over:.1%} too bright, {one.exposure.picture.under:.1%} black"
                            for name, one in advice.items())
        return judge(f"{summary}.", [_of(name, finding) for name, one in advice.items()
                                     for finding in one.verdict.findings])

    @property
    def _good(self) -> bool:
        return self.verdict is not None and self.verdict.grade is Grade.GOOD

    def view(self) -> StepView:
        """What to turn, and why."""
        if not self.cameras:
            return StepView("No camera answers.", hint="Look at the Nodes panel: its sentence says what is wrong.")
        verdict, good = self.verdict, self._good
        sentence = ("The pictures are good: press Next." if good else
                    "Turn the knobs until the verdict is good.")
        return StepView(sentence, done=good or bool(self.choices.changed), hint=self._problem, verdict=verdict,
                        overlays={name: look.overlay for name, look in self._looks.items()}, passable=True)

    def propose(self, rig_path: Path | None) -> Proposal | None:
        """All changed cameras' settings; settings that were checked and are good; None for neither.

        Poor light does not forbid to save: what is in force now was no better, and a lamp is not a setting.
        """
        if not self.choices.changed:
            return Proposal(REASON, self.verdict, self.choices.rows(self.choices.nodes)) if (
                self.verdict is not None and self._good) else None
        verdict = self.verdict or judge("no picture has come since.", [])
        allowed = [replace(finding, grade=Grade.FAIR) if finding.grade is Grade.POOR else finding
                   for finding in verdict.findings]
        summary = verdict.sentence.partition(": ")[2]
        return Proposal(REASON, judge(summary, allowed), self.choices.rows(self.choices.changed),
                        tuple(NodeChange(node.node_id, *self.choices.differences(node.node_id))
                              for node in self.choices.changed))


def _of(camera: str, finding: Finding) -> Finding:
    return replace(finding, figure=f"{camera}: {finding.figure}")


def _overlay(image: YuvImage, grey: Box | None) -> Overlay:
    """Stripes where luma is at an end of its range, and the grey patch."""
    height, width = image.y.shape
    stripes = (np.add.outer(np.arange(height), np.arange(width)) // _STRIPE_PX) % 2 == 0
    rgba: NDArray[np.uint8] = np.zeros((height, width, 4), np.uint8)
    for mask, colour in ((image.y >= BRIGHT, _BURNT), (image.y <= DARK, _BLACK)):
        rgba[mask & stripes] = (*colour, 230)
    layer: Overlay = (Layer(rgba),)
    if grey is None:
        return layer
    x0, y0, x1, y1 = grey
    return (*layer, Line(np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]], float), "caution", closed=True))
