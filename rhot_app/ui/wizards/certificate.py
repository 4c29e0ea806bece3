"""The certificate's wizard: five minutes that repeat chapter 7 of the RHOT thesis on the rig at hand."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QColor, QPainter, QPaintEvent
from PySide6.QtWidgets import QComboBox, QDoubleSpinBox, QFormLayout, QLabel, QWidget

from rhot_app.calibration.collect import Movement
from rhot_app.certificate.collect import SECONDS
from rhot_app.certificate.latency import flash_edges
from rhot_app.certificate.recordings import FlashStep, PlumbStep, ProtocolFile, RodStep, RulerStep, StaticStep
from rhot_app.project import Rig
from rhot_app.ui.backend.contract import Connect
from rhot_app.ui.backend.feed import StateFeed
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.models.rows import marker_name
from rhot_app.ui.wizards.framework.definition import Definition, WizardContext
from rhot_app.ui.wizards.framework.movement import MovementPage, Movements, MovementStep, QuietGuide, Request
from rhot_app.ui.wizards.framework.page import AcceptPage, ChartPage
from rhot_app.ui.wizards.framework.step import AcceptStep, SolveStep, StepView

_FLASH_STEP_MS = 4  # a quarter of a 60 Hz screen's frame
_SEED = 7

_SIDES = ((tr_noop("Palm to the cameras"), "palm"), (tr_noop("Back to the cameras"), "back"),
          (tr_noop("A board, no hand"), None))


def make_wizard(context: WizardContext) -> Definition:
    """Still, ruler, rod, flash, plumb line; then the lines, and where they are kept."""
    movements = Movements(context)
    ids = context.rig.markers.ids
    said = Statements(context.rig, rod_markers=(ids[0], ids[1 % len(ids)]), flash_marker=ids[0])

    folder, recent = movements.folder, movements.states.recent
    made = {"static": movements.add(CertificateStep("static", tr("Hold still."), folder, recent)),
            "ruler": movements.add(RulerDistances(tr("Hold still."), folder, recent, ids[0])),
            "rod": movements.add(CertificateStep("rod", tr("Go on."), folder, recent)),
            "flash": movements.add(CertificateStep("flash", tr("Go on."), folder, recent)),
            "plumb": movements.add(CertificateStep("plumb", tr("Hold still."), folder, recent))}
    pages = (StillPage(made["static"], context.connect, movements.states, said),
             RulerPage(made["ruler"], context.connect, movements.states, ids),
             RodPage(made["rod"], context.connect, movements.states, said),
             FlashPage(made["flash"], context.connect, movements.states, said),
             MovementPage(made["plumb"], context.connect, movements.states))
    def recorded() -> tuple[ProtocolFile] | None:
        protocol = said.protocol(made)
        return None if protocol == ProtocolFile(simulated=protocol.simulated) else (protocol,)

    solve = SolveStep(context.calibration, context.now, recorded, tr("Measuring the recordings …"))
    propose = context.calibration.propose
    assert propose is not None
    keep = KeepStep(lambda: None if solve.result is None else propose(solve.result, context.now), context.now.path,
                    tr("Record a step first."))
    return Definition((*pages, ChartPage(solve, context.scheme), KeepPage(keep, context.scheme)),
                      put_back=movements.end)


# -- steps -------------------------------------------------------------------------------------------------------------

_SENTENCES: dict[str, str] = {
    "static": tr_noop("Rest your hand, palm to the cameras, fingers spread; or rest a board. Then press Record."),
    "ruler": tr_noop("Hold one marker still, read the ruler, type it, press Record. Eight distances, near to far."),
    "rod": tr_noop("Press Record, then move a rod with two markers slowly through the whole volume, turning it every "
                   "way."),
    "flash": tr_noop("Turn the cameras to this screen, darken the room, press Record: the patch flashes for 20 "
                     "seconds."),
    "plumb": tr_noop("Hang the rod from a string. When it is still, press Record."),
}
TITLES: dict[str, str] = {"static": tr_noop("Still"), "ruler": tr_noop("Ruler"), "rod": tr_noop("Rod"),
                          "flash": tr_noop("Flash"), "plumb": tr_noop("Plumb line")}


class CertificateStep(MovementStep):
    """A step of the protocol: a recording that may be left out, which the certificate then says."""

    def __init__(self, name: str, sentence: str, folder: Path, recent: Callable[[], Sequence[Any]]) -> None:
        """`sentence` is said while it is recorded."""
        super().__init__(Movement(tr(TITLES[name]), tr(_SENTENCES[name]), SECONDS[name], lambda: QuietGuide(sentence)),
                         folder, recent)

    def view(self) -> StepView:
        """One may always go on, but not while it is recorded."""
        view = super().view()
        return dataclasses.replace(view, passable=self.phase in ("waiting", "recorded"))


class RulerDistances(CertificateStep):
    """Many short recordings, one for each distance. `distance_mm` and `marker` are what is recorded next."""

    def __init__(self, sentence: str, folder: Path, recent: Callable[[], Sequence[Any]], marker: str) -> None:
        super().__init__("ruler", sentence, folder, recent)
        self.distance_mm = 200.0
        self.marker = marker
        self.rows: list[RulerStep] = []
        self._next = (self.distance_mm, marker)

    def capture(self) -> bool:
        """Begin, or end; the distance is that of the beginning."""
        if self.phase in ("waiting", "recorded"):
            self._next = (self.distance_mm, self.marker)
        return super().capture()

    def answered(self, request: Request) -> None:
        """A finished recording is a row."""
        super().answered(request)
        if request.kind == "end":
            self.rows.append(RulerStep(str(request.path), *self._next))

    def undo(self) -> bool:
        """Take the last row back."""
        if not self.rows or self.phase not in ("waiting", "recorded"):
            return False
        self.rows.pop()
        return True

    def view(self) -> StepView:
        """How many there are."""
        view = super().view()
        if self.phase != "recorded":
            return view
        return dataclasses.replace(view,
                                   sentence=tr("{rows} distances. Type the next one and press Record, or go on.",
                                               rows=len(self.rows)), done=len(self.rows) >= 4, kept=len(self.rows))


@dataclass
class Statements:
    """What the operator says of the recordings; the pages fill it in."""

    rig: Rig
    facing: Literal["palm", "back"] | None = "palm"
    rod_mm: float = 300.0
    rod_markers: tuple[str, str] = ("", "")
    edges: tuple[tuple[int, bool], ...] = ()
    flash_marker: str = ""

    def protocol(self, steps: dict[str, CertificateStep]) -> ProtocolFile:
        """The protocol of what was recorded so far."""
        logs = {name: str(step.log) for name, step in steps.items() if step.log is not None}
        ruler = steps["ruler"]
        assert isinstance(ruler, RulerDistances)
        upper, lower = self.rod_markers
        return ProtocolFile(
            static=StaticStep(logs["static"], self.facing) if "static" in logs else None,
            ruler=tuple(ruler.rows),
            rod=RodStep(logs["rod"], self.rod_mm, self.rod_markers) if "rod" in logs else None,
            flash=FlashStep(logs["flash"], self.flash_marker, self.edges) if "flash" in logs else None,
            plumb=PlumbStep(logs["plumb"], upper, lower) if "plumb" in logs else None,
            simulated=self.rig.calibration is not None and self.rig.calibration.method == "exact")


class KeepStep(AcceptStep):
    """The last step: the lines, and the folder that they are written to."""

    title = tr_noop("Keep")
    use_label = tr_noop("Write the certificate")

    def _sentence(self) -> str:
        if self.state == "used" and self.proposal is not None:
            return tr("It is written.")
        if self.state == "restored":
            return tr("It is deleted.")
        return super()._sentence() if self.state == "under way" or self.proposal is None else (
            tr("Write the certificate, or go back and record a step again."))


# -- pages -------------------------------------------------------------------------------------------------------------

class StillPage(MovementPage):
    """Which side of a hand it is."""

    def __init__(self, step: CertificateStep, connect: Connect, states: StateFeed,
                 said: Statements) -> None:
        super().__init__(step, connect, states)
        self.facing = QComboBox()
        for text, side in _SIDES:
            self.facing.addItem(tr(text), side)
        self.facing.setToolTip(tr("A mirrored rig tracks smoothly and is wrong; this tells."))
        self.facing.currentIndexChanged.connect(lambda: setattr(said, "facing", self.facing.currentData()))
        form = QFormLayout()
        form.addRow(tr("Hand"), self.facing)
        self.column.insertLayout(0, form)


class RulerPage(MovementPage):
    """The distance by the ruler, and the rows so far."""

    def __init__(self, step: CertificateStep, connect: Connect, states: StateFeed,
                 ids: tuple[str, ...]) -> None:
        super().__init__(step, connect, states)
        assert isinstance(step, RulerDistances)
        self.distances = step
        self.marker = _marker_box(ids, 0, tr("The marker that is held along the ruler."),
                                  lambda name: setattr(step, "marker", name))
        self.distance = _length_box(step.distance_mm,
                                    tr("From the line between both lenses straight ahead, by a ruler."),
                                    lambda value: setattr(step, "distance_mm", value))
        self.rows = QLabel()
        self.rows.setWordWrap(True)
        form = QFormLayout()
        form.addRow(tr("Marker"), self.marker)
        form.addRow(tr("Distance"), self.distance)
        self.column.insertLayout(0, form)
        self.column.insertWidget(self.column.count() - 1, self.rows)
        self.first_field = self.distance

    def show_view(self, view: StepView) -> None:
        """What was taken."""
        super().show_view(view)
        if self.movement.phase == "recorded":
            self.button.setText(tr("Record"))
        self.rows.setText(", ".join(f"{row.distance_mm:g}" for row in self.distances.rows) + " mm"
                          if self.distances.rows else tr("No distance yet."))


class RodPage(MovementPage):
    """The rod's length and its markers."""

    def __init__(self, step: CertificateStep, connect: Connect, states: StateFeed,
                 said: Statements) -> None:
        super().__init__(step, connect, states)
        ids = said.rig.markers.ids
        self.length = _length_box(said.rod_mm,
                                  tr("From the centre of one marker to the centre of the other, by a ruler."),
                                  lambda value: setattr(said, "rod_mm", value))
        self.upper_end, self.lower_end = (
            _marker_box(ids, k, tr("The end that is above when the rod hangs.") if k == 0 else tr("The other end."),
                        lambda _: self._name(said)) for k in (0, 1))
        form = QFormLayout()
        form.addRow(tr("Length"), self.length)
        form.addRow(tr("Upper marker"), self.upper_end)
        form.addRow(tr("Lower marker"), self.lower_end)
        self.column.insertLayout(0, form)

    def _name(self, said: Statements) -> None:
        said.rod_markers = (self.upper_end.currentData(), self.lower_end.currentData())


class FlashPage(MovementPage):
    """A patch in a marker's colour in the middle of the window; it flashes while it is recorded."""

    def __init__(self, step: CertificateStep, connect: Connect, states: StateFeed, said: Statements,
                 clock: Callable[[], int] = time.monotonic_ns) -> None:
        super().__init__(step, connect, states)
        self.clock = clock
        self._said = said
        self.patch = Patch()
        self.centre = self.patch
        self._began_ns = 0
        self._code: list[tuple[float, bool]] = []
        ids = said.rig.markers.ids
        self.marker = _marker_box(ids, 0, tr("The colour of the patch: one that nothing else in the pictures has."),
                                  self._choose)
        form = QFormLayout()
        form.addRow(tr("Colour of"), self.marker)
        self.column.insertLayout(0, form)
        self._timer = QTimer(self)
        self._timer.setTimerType(Qt.TimerType.PreciseTimer)
        self._timer.timeout.connect(self.turn)
        self._choose(ids[0])

    @property
    def edges(self) -> tuple[tuple[int, bool], ...]:
        """When the patch was switched, by the clock, and whether it was lit then."""
        return self._said.edges

    def _choose(self, name: str) -> None:
        marker = self._said.rig.markers.markers[self._said.rig.markers.ids.index(name)]
        self._said.flash_marker = name
        self.patch.colour = QColor(*marker.display_rgb)
        self.patch.update()

    def show_view(self, view: StepView) -> None:
        """The code begins and ends with the recording."""
        super().show_view(view)
        recording = self.movement.phase == "recording"
        if recording and not self._timer.isActive():
            self._code = flash_edges(self.movement.seconds, _SEED)
            self._began_ns, self._said.edges = self.clock(), ()
            self.patch.show_lit(lit=False)
            self._timer.start(_FLASH_STEP_MS)
        elif not recording and self._timer.isActive():
            self._timer.stop()
            self.patch.show_lit(lit=True)

    def turn(self) -> None:
        """Show the next edge of the code when its time has come, and note when the screen was told."""
        done = len(self._said.edges)
        if done < len(self._code) and 1e-9 * (self.clock() - self._began_ns) >= self._code[done][0]:
            lit = self._code[done][1]
            self.patch.show_lit(lit=lit)
            self._said.edges = (*self._said.edges, (self.clock(), lit))


class Patch(QWidget):
    """A disc of one colour on black; dark when it is not lit."""

    def __init__(self) -> None:
        super().__init__()
        self.colour = QColor("white")
        self.lit = True
        self.setMinimumSize(240, 240)
        self.setAccessibleName(tr("flashing patch"))

    def show_lit(self, *, lit: bool) -> None:
        """Draw it at once, not with the next events."""
        self.lit = lit
        self.repaint()

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: N802
        """The disc."""
        painter = QPainter(self)
        painter.fillRect(self.rect(), QColor("black"))
        if self.lit:
            side = round(0.5 * min(self.width(), self.height()))
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            painter.setBrush(self.colour)
            painter.setPen(Qt.PenStyle.NoPen)
            painter.drawEllipse(self.rect().center(), side // 2, side // 2)
        painter.end()


class KeepPage(AcceptPage):
    """The lines in a table, and the way to delete what was written."""

    def __init__(self, step: KeepStep, scheme: Scheme) -> None:
        super().__init__(step, scheme, ("", "verdict", "measured"))
        self.restore_button.setText(tr("Delete it again"))
        self.restore_button.setToolTip(tr("Removes the folder that was written."))


def _marker_box(ids: tuple[str, ...], chosen: int, meaning: str, choose: Callable[[str], None]) -> QComboBox:
    box = QComboBox()
    for one in ids:
        box.addItem(marker_name(one), one)
    box.setCurrentIndex(min(chosen, len(ids) - 1))
    box.setToolTip(meaning)
    box.currentIndexChanged.connect(lambda index: choose(ids[index]))
    return box


def _length_box(value: float, meaning: str, enter: Callable[[float], None]) -> QDoubleSpinBox:
    box = QDoubleSpinBox()
    box.setRange(10.0, 5000.0)
    box.setDecimals(1)
    box.setSuffix(" mm")
    box.setValue(value)
    box.setToolTip(meaning)
    box.valueChanged.connect(enter)
    return box
