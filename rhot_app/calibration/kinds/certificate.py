"""The certificate: how good a rig is, as chapter 7 of the RHOT thesis measures it. ``rhot certify`` is its command."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from platformdirs import user_documents_path

from rhot_app.calibration.registry import Calibration, InForce

if TYPE_CHECKING:
    from rhot_app.calibration.proposal import Command, Proposal
    from rhot_app.calibration.report import Report
    from rhot_app.calibration.verdict import Verdict
    from rhot_app.certificate.document import Certificate, Line
    from rhot_app.certificate.recordings import ProtocolFile
    from rhot_app.progress import Progress

    Result = tuple[ProtocolFile, Certificate]

_CHARTED = ("depth", "rod")
_HEADLINES = {"depth": "scale error", "timing": "sum, p99", "rod": "length error", "latency": "screen to master",
              "upright": "tilt"}


def solve(protocol: ProtocolFile, now: InForce, *, progress: Progress) -> Result:
    """What ``rhot certify`` does with a folder of recordings."""
    from rhot_app.certificate.certify import certify

    return protocol, certify(Path("/"), protocol, now.rig, progress)


def verdict_of(result: Result) -> Verdict:
    """One finding for each line, the differing ones first. A certificate may always be kept, so none forbids it: what
    differs is said, and graded fair."""
    from rhot_app.calibration.verdict import Finding, Grade, Verdict

    grades = {"agrees": Grade.GOOD, "not measured": Grade.FAIR, "differs": Grade.POOR}
    lines = sorted(result[1].lines, key=lambda line: -grades[line.verdict].rank)
    return Verdict(result[1].summary, tuple(
        Finding(line.code, min(grades[line.verdict], Grade.FAIR, key=lambda grade: grade.rank),
                f"{line.title}, {line.verdict}: {line.sentence}", line.cause, line.remedy) for line in lines))


def report(result: Result, now: InForce) -> Report:
    """The lines as findings, and the certificate's own charts of what was moved through the volume."""
    from rhot_app.calibration.report import Report
    from rhot_app.certificate.charts import chart_of

    charts = (chart_of(line) for line in result[1].lines if line.code in _CHARTED)
    return Report(verdict_of(result), charts=tuple(chart for chart in charts if chart is not None))


@dataclass(frozen=True, slots=True)
class WriteCertificate:
    """A `Change` that writes the report's folder, its recordings with it, and removes it again."""

    folder: Path
    report: Result

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


def propose(result: Result, now: InForce) -> Proposal:
    """The lines of the certificate as rows: title, verdict, and the figure that it rests on or what to do."""
    from rhot_app.calibration.proposal import Proposal, Row

    rows = tuple(Row(line.title, line.verdict, _headline(line)) for line in result[1].lines)
    place = _place(now.rig.name, result[1].created)
    return Proposal(CALIBRATION.reason, verdict_of(result), rows, changes=(WriteCertificate(place, result),),
                    afterwards=f"It stands in {place}: certificate.html, .pdf and .json, with the recordings.")


def _headline(line: Line) -> str:
    """E.g. ``length error 0.12 % (-0.20 to 0.44)``."""
    from rhot_app.certificate.document import in_words

    name = _HEADLINES.get(line.code, "")
    chief = line.figure(name) or next(iter(line.figures), None)
    if chief is None or line.verdict == "not measured":
        return line.remedy
    if not name and line.code == "static":
        chief = max((one for one in line.figures if one.unit == "px"), key=lambda one: one.value or 0.0)
    return f"{chief.name} {in_words(chief.interval, chief.unit)}"


def _place(rig: str, created: str) -> Path:
    """A folder in the user's documents for a certificate that was `created` then, ISO 8601."""
    name = "".join(letter if letter.isalnum() or letter in "-_" else "-" for letter in rig)
    made = datetime.fromisoformat(created).astimezone()
    return user_documents_path() / "RHOT" / "certificates" / f"{name}-{made:%Y%m%d-%H%M%S}"


CALIBRATION = Calibration(
    "certificate", "Certificate", "How good this rig is, measured as the thesis did, with 95 % intervals: five "
    "minutes.", "certificate", solve=solve, report=report, propose=propose, solver="rhot_app.certificate.certify")
