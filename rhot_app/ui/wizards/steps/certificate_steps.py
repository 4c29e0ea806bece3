"""The certificate's wizard without its widgets: what is recorded, what the operator states, and what comes of it."""

from __future__ import annotations

import dataclasses
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from rhot_app.calibration.proposal import Command, Proposal, Row
from rhot_app.calibration.registry import CERTIFICATE
from rhot_app.calibration.report import Report
from rhot_app.calibration.verdict import Finding, Grade, Verdict
from rhot_app.certificate.collect import SECONDS
from rhot_app.certificate.document import Certificate, Line, in_words
from rhot_app.certificate.recordings import (
    FlashStep,
    PlumbStep,
    ProtocolFile,
    RodStep,
    RulerStep,
    StaticStep,
)
from rhot_app.progress import Progress
from rhot_app.project import Rig
from rhot_app.ui.wizards.models.movement import MovementStep, Request
from rhot_app.ui.wizards.models.step import AcceptStep, StepView, Task

if TYPE_CHECKING:
    from collections.abc import Sequence


_SENTENCES: dict[str, str] = {
    "static": "Rest your hand, palm to the cameras, fingers spread; or rest a board. Then press Record.",
    "ruler": "Hold one marker still, read the ruler, type it, press Record. Eight distances, near to far.",
    "rod": "Press Record, then move a rod with two markers slowly through the whole volume, turning it every way.",
    "flash": "Turn the cameras to this screen, darken the room, press Record: the patch flashes for 20 seconds.",
    "plumb": "Hang the rod from a string. When it is still, press Record.",
}
_CHARTED = ("depth", "rod")
TITLES: dict[str, str] = {"static": "Still", "ruler": "Ruler", "rod": "Rod", "flash": "Flash", "plumb": "Plumb line"}


class CertificateStep(MovementStep):
    """A step of the protocol: a recording that may be left out, which the certificate then says."""

    def __init__(self, name: str, folder: Path, guide: Callable[[], Any],
                 recent: Callable[[], Sequence[Any]]) -> None:
        super().__init__(TITLES[name], _SENTENCES[name], SECONDS[name], folder, guide, recent)
        self.name = name

    def view(self) -> StepView:
        """One may always go on, but not while it is recorded."""
        view = super().view()
        return dataclasses.replace(view, passable=self.phase in ("waiting", "recorded"))


class RulerDistances(CertificateStep):
    """Many short recordings, one for each distance. `distance_mm` and `marker` are what is recorded next."""

    def __init__(self, folder: Path, guide: Callable[[], Any], recent: Callable[[], Sequence[Any]],
                 marker: str) -> None:
        super().__init__("ruler", folder, guide, recent)
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
        return dataclasses.replace(view, sentence=f"{len(self.rows)} distances. Type the next one and press Record, or "
                                   "go on.", done=len(self.rows) >= 4, kept=len(self.rows))


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


def solve_protocol(protocol: ProtocolFile, rig: Rig, *, progress: Progress) -> tuple[ProtocolFile, Certificate]:
    """What ``rhot certify`` does with a folder of recordings."""
    from rhot_app.certificate.certify import certify

    return protocol, certify(Path("/"), protocol, rig, progress)


def task_of(statements: Statements, steps: dict[str, CertificateStep]) -> Task | None:
    """The work; None while nothing was recorded."""
    protocol = statements.protocol(steps)
    if protocol == ProtocolFile(simulated=protocol.simulated):
        return None
    return Task("Measuring the recordings …", solve_protocol, (protocol, statements.rig))


_GRADES = {"agrees": Grade.GOOD, "not measured": Grade.FAIR, "differs": Grade.POOR}


def verdict_of(result: tuple[ProtocolFile, Certificate]) -> Verdict:
    """One finding for each line, the differing ones first. A certificate may always be kept, so none forbids it: what
    differs is said, and graded fair."""
    certificate = result[1]
    lines = sorted(certificate.lines, key=lambda line: -_GRADES[line.verdict].rank)
    return Verdict(certificate.summary, tuple(
        Finding(line.code, min(_GRADES[line.verdict], Grade.FAIR, key=lambda grade: grade.rank),
                f"{line.title}, {line.verdict}: {line.sentence}", line.cause, line.remedy) for line in lines))


def report(result: tuple[ProtocolFile, Certificate]) -> Report:
    """The lines as findings, and the certificate's own charts of what was moved through the volume."""
    from rhot_app.certificate.charts import chart_of

    charts = (chart_of(line) for line in result[1].lines if line.code in _CHARTED)
    return Report(verdict_of(result), charts=tuple(chart for chart in charts if chart is not None))


# -- keeping it --------------------------------------------------------------------------------------------------------

@dataclass(frozen=True, slots=True)
class WriteCertificate:
    """A `Change` that writes the report's folder, its recordings with it, and removes it again."""

    folder: Path
    report: tuple[ProtocolFile, Certificate]

    def use(self, command: Command) -> None:
        """Write it; raises CertificateError."""
        from rhot_app.certificate.report import write_report

        self.folder.parent.mkdir(parents=True, exist_ok=True)
        write_report(self.folder, self.report[1], recordings=(Path("/"), self.report[0]))

    def restore(self, command: Command) -> None:
        """Remove what was written."""
        shutil.rmtree(self.folder, ignore_errors=True)

    @property
    def way_back(self) -> str:
        """What it is, and that it replaces nothing."""
        return ("A certificate is a folder with a page, a PDF, the raw numbers and the recordings; the rig stays as it "
                "is.")


class KeepStep(AcceptStep):
    """The last step: the lines, and the folder that they are written to."""

    title = "Keep"
    use_label = "Write the certificate"

    def _sentence(self) -> str:
        if self.state == "used" and self.proposal is not None:
            return "It is written."
        if self.state == "restored":
            return "It is deleted."
        return super()._sentence() if self.state == "under way" or self.proposal is None else (
            "Write the certificate, or go back and record a step again.")


_HEADLINES = {"depth": "scale error", "timing": "sum, p99", "rod": "length error", "latency": "screen to master",
              "upright": "tilt"}


def _headline(line: Line) -> str:
    """E.g. ``length error 0.12 % (-0.20 to 0.44)``."""
    name = _HEADLINES.get(line.code, "")
    chief = line.figure(name) or next(iter(line.figures), None)
    if chief is None or line.verdict == "not measured":
        return line.remedy
    if not name and line.code == "static":
        chief = max((one for one in line.figures if one.unit == "px"), key=lambda one: one.value or 0.0)
    return f"{chief.name} {in_words(chief.interval, chief.unit)}"


def propose(result: tuple[ProtocolFile, Certificate] | None, folder: Callable[[str], Path]) -> Proposal | None:
    """The lines of the certificate as rows: title, verdict, and the figure that it rests on or what to do. `folder`:
    where one that was made then, ISO 8601, is written."""
    if result is None:
        return None
    rows = tuple(Row(line.title, line.verdict, _headline(line)) for line in result[1].lines)
    place = folder(result[1].created)
    return Proposal(CERTIFICATE.reason, verdict_of(result), rows, changes=(WriteCertificate(place, result),),
                    afterwards=f"It stands in {place}: certificate.html, .pdf and .json, with the recordings.")


