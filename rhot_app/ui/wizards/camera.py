"""The wizard for what the cameras are told: exposure, gains, white balance, contrast, saturation, brightness."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QComboBox, QHBoxLayout, QLabel, QScrollArea, QVBoxLayout, QWidget

from rhot_app.calibration.check.camera_advice import CameraAdvice, CameraAdvisor
from rhot_app.calibration.check.exposure import BRIGHT, DARK
from rhot_app.calibration.kinds.wizard_only import CAMERA
from rhot_app.calibration.proposal import NodeChange, Proposal, Row
from rhot_app.calibration.verdict import Finding, Grade, Verdict, judge
from rhot_app.errors import CalibrationError, RhotError
from rhot_app.project import RigNode
from rhot_app.ui.backend.contract import CommandClient, Connect
from rhot_app.ui.backend.feed import Picture
from rhot_app.ui.common.job import Job
from rhot_app.ui.common.parts import plain_button
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.wizards.framework.control_row import Control, ControlRow, Value
from rhot_app.ui.wizards.framework.definition import Definition, WizardContext, accept_page
from rhot_app.ui.wizards.framework.drawing import Layer, Line, Overlay
from rhot_app.ui.wizards.framework.page import Page, shrinkable
from rhot_app.ui.wizards.framework.step import AnnotatedPicture, Pictures, Step, StepView
from rhot_node.config import CameraSettings
from rhot_node.detect.colour import Box
from rhot_node.detect.fast import FastDetector
from rhot_node.detect.image import YuvImage, from_bgr
from rhot_node.markers import MarkerSet


def make_wizard(context: WizardContext) -> Definition:
    """The wizard's pages for the rig at hand."""
    choices = CameraChoices(context.rig.nodes, context.now.node_settings)
    step = SettingsStep(choices, context.rig.markers)
    tryout = Tryout(context.connect)
    last = accept_page(context, step.propose,
                       tr("No picture shows these settings yet, or they cannot be used: go back."))
    accept = last.accept
    page = CameraPage(step, tryout)
    tryout.setParent(page)

    def put_back() -> None:
        """What was only tried out goes; what was saved stays."""
        in_force: dict[int, Settings] = {node.node_id: choices.whole(node.node_id, before=True)
                                         for node in choices.nodes}
        if accept.state == "used" and accept.proposal is not None:
            for change in accept.proposal.changes:
                if isinstance(change, NodeChange):
                    in_force[change.node_id]["camera"].update(change.after["camera"])
        tryout.put_back(in_force)

    return Definition((page, last), put_back=put_back)


# -- the knobs of the camera wizard ------------------------------------------------------------------------------------

class CameraPage(Page):
    """What is turned is tried out at once by the cameras chosen; nothing is saved."""

    def __init__(self, step: SettingsStep, tryout: Tryout) -> None:
        super().__init__(step)
        self._settings = step
        self._tryout = tryout
        self._shown: object = None
        self.which = QComboBox()
        self.which.setToolTip(tr("Whose settings are turned. Both at once keeps equal cameras equal."))
        choices = step.choices
        if len(choices.nodes) > 1:
            self.which.addItem(tr("All cameras"), tuple(node.node_id for node in choices.nodes))
        for node in choices.nodes:
            self.which.addItem(node.name, (node.node_id,))
        self.rows = {control.field: ControlRow(control) for control in CONTROLS}
        knobs = QWidget()
        knobs.setProperty("panel", False)
        column = QVBoxLayout(knobs)
        column.setContentsMargins(0, 0, 8, 0)
        column.setSpacing(4)
        for row in self.rows.values():
            column.addWidget(row)
            row.changed.connect(lambda value, goes_on, row=row: self._turn(row.control, value, goes_on=goes_on))
        column.addStretch(1)
        scroll = QScrollArea()
        scroll.setWidgetResizable(True)
        scroll.setWidget(knobs)
        self.balance_button = plain_button(tr("Balance on grey"), tr("Drag over something grey or white in a picture "
                                                                     "first, a sheet of paper for instance. Press "
                                                                     "again until nothing changes."), self._balance)
        self.undo_button = plain_button(tr("Undo"), tr("Ctrl+Z. The last change back."), self._undo)
        self.problem = QLabel()
        self.problem.setWordWrap(True)
        self.column.addWidget(self.which)
        self.column.addWidget(scroll, 1)
        shrinkable(scroll)
        self.column.addWidget(self.problem)
        buttons = QHBoxLayout()
        buttons.addWidget(self.balance_button)
        buttons.addWidget(self.undo_button)
        self.column.addLayout(buttons)
        self.which.currentIndexChanged.connect(self._choose)
        tryout.answered.connect(self._answered)
        self.first_field = self.which
        self.pickable = True

    @property
    def chosen(self) -> tuple[int, ...]:
        """Node ids of the cameras that are being set."""
        ids: tuple[int, ...] = self.which.currentData() or ()
        return ids

    def _choose(self) -> None:
        self._shown = None
        self.changed.emit()

    def _turn(self, control: Control, value: Value, *, goes_on: bool) -> None:
        try:
            self._settings.choices.change(self.chosen, control, value, goes_on=goes_on)
        except ValueError as exc:
            self.problem.setText(str(exc))
            return
        self.changed.emit()

    def _undo(self) -> None:
        if self._settings.undo():
            self.changed.emit()

    def _balance(self) -> None:
        if self._settings.balance():
            self.changed.emit()

    def pick(self, picture: Picture, x: float, y: float, width: float, height: float) -> None:
        """Something grey."""
        self._settings.mark_grey(picture.camera, (round(x), round(y), round(x + width), round(y + height)))

    def _answered(self, problem: str) -> None:
        self._settings.note_sent(time.monotonic_ns())
        self.problem.setText(problem)

    def show_view(self, view: StepView) -> None:
        """Show the settings, and have the cameras try out what is new."""
        choices = self._settings.choices
        self.balance_button.setEnabled(bool(self._settings.balanceable))
        if self._shown is choices.now:
            return
        self._shown = choices.now
        for node_id in self._settings.untold():
            self._tryout.want(node_id, self._settings.tell(node_id))
        for row in self.rows.values():
            values = {choices.value(node_id, row.control) for node_id in self.chosen}
            row.fill(choices.value(self.chosen[0], row.control) if self.chosen else None)
            row.check_box.setText(tr(row.control.name) if len(values) < 2
                                  else tr("{name} (they differ)", name=tr(row.control.name)))
        self.undo_button.setEnabled(choices.undoable)


# -- node settings tried out while a person turns a knob ---------------------------------------------------------------

Settings = dict[str, Any]


class Tryout(QObject):
    """`want` as often as you like; at most one request is under way. `answered` with "" or with what went wrong."""

    answered = Signal(str)

    def __init__(self, connect: Connect, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._connect = connect
        self._wanted: dict[int, Settings] = {}
        self._job: Job | None = None
        self._tried: set[int] = set()
        self._lock = threading.Lock()  # between the worker that sends and the one that puts back

    @property
    def under_way(self) -> bool:
        """Whether the nodes have not been told everything yet."""
        return self._job is not None

    def want(self, node_id: int, settings: Settings) -> None:
        """Have the node go by `settings` without saving them."""
        self._wanted[node_id] = settings
        self._tried.add(node_id)
        self._begin()

    def _begin(self) -> None:
        if self._job is None and self._wanted:
            wanted, self._wanted = self._wanted, {}
            self._job = Job(lambda progress: self._send(wanted), self._sent, self._failed, None, self).start()

    def _send(self, wanted: dict[int, Settings]) -> None:
        with self._lock, contextlib.closing(self._connect()) as client:
            for node_id, settings in wanted.items():
                try_settings(client, node_id, settings)

    def _sent(self, _: None) -> None:
        self._job = None
        self.answered.emit("")
        self._begin()

    def _failed(self, sentence: str) -> None:
        self._job = None
        self.answered.emit(sentence)
        self._begin()

    def put_back(self, before: dict[int, Settings]) -> None:
        """Have every node that was told anything go by `before` again; waits, so call it in a worker. A node that does
        not answer is left: what was tried out ends with its process."""
        self._wanted = {}
        with self._lock, contextlib.closing(self._connect()) as client:
            for node_id in sorted(self._tried):
                try:
                    try_settings(client, node_id, before[node_id])
                except RhotError:
                    continue


def try_settings(client: CommandClient, node_id: int, settings: Settings) -> None:
    """Settings that are in force but not saved; raises EngineError with the node's sentence."""
    client.command("node", node_id=node_id, request={"request": "set_settings", "settings": settings, "save": False})


# -- what is told to whom, and what the pictures say to it -------------------------------------------------------------

CONTROLS: tuple[Control, ...] = (
    Control("exposure_us", tr_noop("Exposure time"),
            tr_noop("How long each row collects light. Short keeps moving markers sharp; a multiple of the mains' half "
                    "period (10 ms at 50 Hz, 8.33 ms at 60 Hz) keeps lamps from flickering."), 0.1, 33.0, 1000.0, 4.0,
            unit=" ms", scale=1000.0, optional=False, logarithmic=True, least=0.01),
    Control("gain", tr_noop("Gain"),
            tr_noop("Amplifies the signal, and its noise. Raise it only when light and exposure cannot be."), 1.0, 16.0,
            1000.0, 1.0, logarithmic=True, least=0.01),
    Control("brightness", tr_noop("Brightness"),
            tr_noop("Added to every pixel. 0 leaves it; it brings no light, so change it last."), -1.0, 1.0, 255.0, 0.0,
            least=-255.0),
    Control("contrast", tr_noop("Contrast"), tr_noop("Spreads the grey levels about the middle; 1 leaves them."), 0.0,
            4.0, 255.0, 1.0, least=0.0),
    Control("saturation", tr_noop("Saturation"),
            tr_noop("How strong colours are; 1 leaves them, more sets the markers apart from grey."), 0.0, 4.0, 255.0,
            1.0, least=0.0),
    Control("red_gain", tr_noop("Red gain"), tr_noop("White balance: raise it when white looks green or blue."), 0.2,
            8.0, 1000.0, 1.0, logarithmic=True, least=0.01),
    Control("blue_gain", tr_noop("Blue gain"), tr_noop("White balance: raise it when white looks yellow or red."), 0.2,
            8.0, 1000.0, 1.0, logarithmic=True, least=0.01),
)


class CameraChoices:
    """The settings of all cameras: as they were, and as they are being tried out; the way back step by step."""

    def __init__(self, nodes: tuple[RigNode, ...], node_settings: Mapping[int, dict[str, Any]]) -> None:
        """`node_settings` by node id, as the nodes gave them; cameras whose node gave none cannot be set."""
        self.nodes = tuple(node for node in nodes if node.node_id in node_settings)
        self.before = {node.node_id: msgspec.convert(node_settings[node.node_id]["camera"], CameraSettings)
                       for node in self.nodes}
        self.now = dict(self.before)
        self._undone: list[dict[int, CameraSettings]] = []

    def value(self, node_id: int, control: Control) -> Value:
        """A camera's setting in the control's unit; None when it is left to the camera."""
        value = getattr(self.now[node_id], control.field)
        return None if value is None else float(value) / control.scale

    def change(self, node_ids: tuple[int, ...], control: Control, value: Value, *, goes_on: bool = False) -> None:
        """Tell these cameras another value; `goes_on`: a slider is still moving, one step back undoes it whole.

        Raises ValueError, in the words of the settings' own check, for a value that cannot be.
        """
        raw = None if value is None else value * control.scale
        changed = dict(self.now)
        for node_id in node_ids:
            fields = msgspec.to_builtins(self.now[node_id]) | {control.field: raw}
            changed[node_id] = msgspec.convert(fields, CameraSettings)
        if changed != self.now:
            if not goes_on or not self._undone:
                self._undone.append(self.now)
            self.now = changed

    def undo(self) -> bool:
        """One step back."""
        if not self._undone:
            return False
        self.now = self._undone.pop()
        return True

    @property
    def undoable(self) -> bool:
        """Whether there is a step back."""
        return bool(self._undone)

    def whole(self, node_id: int, *, before: bool = False) -> dict[str, Any]:
        """All of a camera's settings, as a node is told them: now, or as they were."""
        return {"camera": msgspec.to_builtins((self.before if before else self.now)[node_id])}

    @property
    def changed(self) -> tuple[RigNode, ...]:
        """Cameras whose settings are others now."""
        return tuple(node for node in self.nodes if self.now[node.node_id] != self.before[node.node_id])

    def differences(self, node_id: int) -> tuple[dict[str, Any], dict[str, Any]]:
        """The node settings that differ, before and now."""
        old, new = (msgspec.to_builtins(settings[node_id]) for settings in (self.before, self.now))
        fields = [field for field in new if new[field] != old[field]]
        return {"camera": {field: old[field] for field in fields}}, {"camera": {field: new[field] for field in fields}}

    def rows(self, nodes: tuple[RigNode, ...]) -> tuple[Row, ...]:
        """Every setting of these cameras before and after."""
        return tuple(
            Row(f"{node.name}: {tr(control.name).lower()}", value_text(control, self.before[node.node_id]),
                value_text(control, self.now[node.node_id]))
            for node in nodes for control in CONTROLS)


def value_text(control: Control, settings: CameraSettings) -> str:
    """A setting with its unit, in words when it is left to the camera."""
    value = getattr(settings, control.field)
    if value is None:
        return tr("left to the camera")
    return f"{float(value) / control.scale:.{control.decimals}f}{control.unit}"


# -- Step: set the cameras ---------------------------------------------------------------------------------------------

_BURNT, _BLACK = (255, 60, 60), (70, 120, 255)
_STRIPE_PX = 4
SETTLE_NS = 400_000_000
"""From a node's answer until a picture shows what it was told: a few frames, and the picture's own way."""

SILENT_NS = 3_000_000_000  # without a picture while other cameras deliver
_GREY_PX = 24  # a click on grey paper is a box of this side


@dataclass(frozen=True, slots=True, eq=False)
class PictureAdvice:
    """What one picture says: the advice, and the `problem` of a grey patch that is none."""

    annotated: AnnotatedPicture
    advice: CameraAdvice
    problem: str = ""

    @property
    def received_ns(self) -> int:
        """When the picture came, monotonic."""
        return self.annotated.picture.received_ns


class CameraEye:
    """Looks at the pictures of one camera; used by the picture worker's thread only."""

    def __init__(self, markers: MarkerSet) -> None:
        self._markers = markers
        self._detector = FastDetector(markers)
        self._advisor = CameraAdvisor([one.id for one in markers.markers if one.shape != "landmark"])
        self._settings: CameraSettings | None = None

    def look(self, picture: Picture, settings: CameraSettings, grey: Box | None) -> PictureAdvice:
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
        return PictureAdvice(AnnotatedPicture(picture, _overlay(image, grey)), advice, problem)


class SettingsStep(Step):
    """Knobs, live pictures, advice. Nothing is saved; the last step does that."""

    title = tr_noop("Settings")
    watches = True

    def __init__(self, choices: CameraChoices, markers: MarkerSet) -> None:
        self.choices = choices
        self.cameras = tuple(node.name for node in choices.nodes)
        self._eyes = {node.name: CameraEye(markers) for node in choices.nodes}
        self._ids = {node.name: node.node_id for node in choices.nodes}
        self._sent = dict(choices.before)
        self._grey: dict[str, Box] = {}
        self._looks: dict[str, PictureAdvice] = {}
        self._last_ns: dict[str, int] = {}  # when each camera gave its last picture, or the first one gave its first
        self._settled_ns: int | None = 0
        self._before: Grade | None = None  # of the settings that were in force
        self._problem = ""

    def untold(self) -> list[int]:
        """Nodes that go by other settings than were chosen; they are taken as told from now on."""
        found = [node_id for node_id, settings in self.choices.now.items() if self._sent[node_id] != settings]
        self._sent = dict(self.choices.now)
        if found:
            self._settled_ns = None
        return found

    def note_sent(self, now_ns: int) -> None:
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
            white = self._looks[name].advice.white if self._fresh(name) else None
            if white is not None and white.findings:
                found[name] = (white.red_gain or 1.0, white.blue_gain or 1.0)
        return found

    def _fresh(self, camera: str) -> bool:
        """Whether the last advice is on a picture that shows what the camera was told last."""
        look = self._looks.get(camera)
        return look is not None and self._settled_ns is not None and look.received_ns > self._settled_ns

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

    def observe(self, pictures: Pictures) -> dict[str, PictureAdvice]:
        """Advice on each picture."""
        now, grey = self._sent, dict(self._grey)
        return {name: self._eyes[name].look(picture, now[self._ids[name]], grey.get(name))
                for name, picture in pictures.items() if name in self._eyes}

    def accept_observation(self, seen: dict[str, PictureAdvice]) -> None:
        """The newest advice."""
        self._looks = {**self._looks, **seen}
        if seen and not self._last_ns:
            self._last_ns = dict.fromkeys(self._ids, next(iter(seen.values())).received_ns)
        self._last_ns.update((name, look.received_ns) for name, look in seen.items())
        for name, look in seen.items():
            if look.problem and name in self._grey:
                self.mark_grey(name, None)
                self._problem = f"{name}: {look.problem}"
        if not self.choices.changed and self._current and self.verdict is not None:
            self._before = self.verdict.grade

    @property
    def verdict(self) -> Verdict | None:
        """On all cameras together; None before the first pictures."""
        advice = {name: look.advice for name, look in self._looks.items() if name not in self._silent}
        if not advice:
            return None
        summary = "; ".join(f"{name} {one.exposure.summary}" for name, one in advice.items())
        missing = [Finding("no_picture", Grade.POOR, tr("No picture comes from {name}.", name=name), "",
                           tr("Look at the Nodes panel.")) for name in self._silent]
        return judge(f"{summary}.", [*missing, *(_of(name, finding) for name, one in advice.items()
                                                 for finding in one.verdict.findings)])

    @property
    def _silent(self) -> list[str]:
        """Cameras that gave no picture for long while others did."""
        newest = max(self._last_ns.values(), default=0)
        return [name for name, last in self._last_ns.items() if newest - last > SILENT_NS]

    @property
    def _current(self) -> bool:
        """Whether pictures of all cameras that deliver any show what was told last."""
        return bool(self._looks) and all(self._fresh(name) for name in self._ids if name not in self._silent)

    @property
    def _good(self) -> bool:
        return self._current and self.verdict is not None and self.verdict.grade is Grade.GOOD

    def view(self) -> StepView:
        """What to turn, and why."""
        if not self.cameras:
            return StepView(tr("No camera answers."),
                            hint=tr("Look at the Nodes panel: its sentence says what is wrong."))
        verdict, good = self.verdict, self._good
        sentence = (tr("The pictures are good: press Next.") if good
                    else tr("Show the hand with its markers, and turn the knobs until the verdict is good."))
        return StepView(sentence, done=good, hint=self._problem, verdict=verdict,
                        annotated={name: look.annotated for name, look in self._looks.items()}, passable=self._current)

    def propose(self) -> Proposal | None:
        """All changed cameras' settings, or those in force when they may be used; None for neither.

        Poor light does not forbid to save what is no worse than the settings in force: a lamp is not a setting.
        """
        if self.verdict is None or not self._current:
            return None
        if not self.choices.changed:
            return Proposal(CAMERA.reason, self.verdict, self.choices.rows(self.choices.nodes)) \
                if self.verdict.acceptable else None
        verdict = self.verdict
        if verdict.grade is Grade.POOR and self._before is Grade.POOR:
            verdict = judge(tr("{sentence} The settings in force are no better.",
                               sentence=verdict.sentence.partition(": ")[2]),
                            [replace(finding, grade=Grade.FAIR) for finding in verdict.findings])
        return Proposal(CAMERA.reason, verdict, self.choices.rows(self.choices.changed), changes=tuple(
                            NodeChange(node.node_id, *self.choices.differences(node.node_id))
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
